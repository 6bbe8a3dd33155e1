"""Arrangement templates: which groups of furniture a room holds, in the order in which they get their place.

A group is written ``name`` or ``name:mode``; ``a|b`` means one of them. The groups of ``core`` are always tried, some
of ``extras`` besides. Novel templates serve only test-novel.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Template:
    """One way to furnish a room of a type."""

    room_type: str
    core: tuple[str, ...]
    extras: tuple[str, ...]
    novel: bool = False


_LIVING_EXTRAS = ("bookshelf", "sideboard", "reading", "plant", "floor_lamp", "shelf", "desk:wall", "stool", "plant")
_BEDROOM_EXTRAS = ("dresser", "reading", "plant", "floor_lamp", "shelf", "desk:wall", "stool", "bookshelf", "bench")
_STUDY_EXTRAS = ("sideboard", "reading", "plant", "floor_lamp", "shelf", "bookshelf", "stool", "desk:wall", "plant")
_DINING_EXTRAS = ("sideboard", "plant", "floor_lamp", "shelf", "bookshelf", "stool", "reading", "bench", "plant")

TEMPLATES: dict[str, Template] = {
    "living_wall": Template("living", ("media:wall", "bookshelf|sideboard"), _LIVING_EXTRAS),
    "living_divider": Template("living", ("media:divider", "sideboard|bookshelf|dining:wall"), _LIVING_EXTRAS),
    "living_dining": Template("living", ("media:any", "dining:middle|dining:wall", "bookshelf"), _LIVING_EXTRAS),
    "living_partition": Template("living", ("media:wall", "partition", "desk:wall|reading"), _LIVING_EXTRAS),
    "bedroom_plain": Template("bedroom", ("bed", "wardrobe", "dresser|desk:wall"), _BEDROOM_EXTRAS),
    "bedroom_partition": Template("bedroom", ("bed", "wardrobe", "partition", "desk:wall|reading"), _BEDROOM_EXTRAS),
    "bedroom_sitting": Template("bedroom", ("bed", "wardrobe", "reading", "dresser"), _BEDROOM_EXTRAS),
    "study_wall": Template("study", ("desk:wall", "bookshelf", "bookshelf", "reading"), _STUDY_EXTRAS),
    "study_free": Template("study", ("desk:free", "bookshelf", "bookshelf", "sofa|reading"), _STUDY_EXTRAS),
    "study_partition": Template("study", ("desk:wall", "partition", "bookshelf", "sofa|reading"), _STUDY_EXTRAS),
    "dining_middle": Template("dining", ("kitchen", "dining:middle", "sideboard"), _DINING_EXTRAS),
    "dining_island": Template("dining", ("kitchen:island", "dining:wall|dining:middle"), _DINING_EXTRAS),
    "dining_partition": Template("dining", ("kitchen", "dining:middle|dining:wall", "partition"), _DINING_EXTRAS),
    "living_facing": Template("living", ("facing", "sideboard|bookshelf", "partition"), _LIVING_EXTRAS, novel=True),
    "bedroom_island": Template("bedroom", ("bed:island", "wardrobe", "reading"), _BEDROOM_EXTRAS, novel=True),
    "study_pair": Template("study", ("desk:pair", "bookshelf", "sofa"), _STUDY_EXTRAS, novel=True),
    "dining_bench": Template("dining", ("kitchen", "dining:bench", "partition"), _DINING_EXTRAS, novel=True),
}

FILLERS: tuple[str, ...] = ("plant", "floor_lamp", "stool", "shelf", "side_table", "night_stand")
"""Small groups that bring a sparse room up to its least number of objects."""


def even_weights(names: tuple[str, ...]) -> tuple[tuple[str, float], ...]:
    """(name, weight) such that every room type is equally likely, and within a type every template."""
    types = [TEMPLATES[name].room_type for name in names]
    return tuple((name, 1.0 / types.count(kind)) for name, kind in zip(names, types, strict=True))


COMMON_TEMPLATES: tuple[str, ...] = tuple(name for name, t in TEMPLATES.items() if not t.novel)
NOVEL_TEMPLATES: tuple[str, ...] = tuple(name for name, t in TEMPLATES.items() if t.novel)
