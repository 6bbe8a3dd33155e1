"""Arrangement templates: which groups of furniture a room holds, in the order in which they get their place.

A group is written ``name`` or ``name:mode``; ``a|b`` means one of them. The groups of ``core`` are always tried, what
makes the room what it is first; some of ``extras`` besides. Novel templates serve only test-novel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

AT_HOME = frozenset(("washing_machine", "laundry_basket", "bathroom_cabinet", "stool"))
"""Groups of bathrooms that offices do without."""


def group_name(group: str) -> str:
    """The name of a group without its mode."""
    return group.partition(":")[0]


@dataclass(frozen=True)
class Template:
    """One way to furnish a room of a type."""

    room_type: str
    core: tuple[str, ...]
    extras: tuple[str, ...]
    novel: bool = False

    def holds(self, group: str) -> bool:
        """Whether every room of this template has a group of a name, whatever its mode."""
        return any(all(group_name(option) == group for option in names.split("|")) for names in self.core)

    def with_table(self) -> Template:
        """The template with a table to eat at, next after what comes first and what people cook and sleep at."""
        if self.holds("dining"):
            return self
        core = self.without_table().core
        k = max([0, *(k for k, names in enumerate(core) if group_name(names) in ("kitchen", "bed"))]) + 1
        return replace(self.without_table(), core=(*core[:k], "dining:wall", *core[k:]))

    def without_table(self) -> Template:
        """The template for a room where nobody eats but at a kitchen island."""
        core = ("|".join(o for o in names.split("|") if group_name(o) != "dining") for names in self.core)
        extras = tuple(group for group in self.extras if group_name(group) != "dining")
        return replace(self, core=tuple(names for names in core if names), extras=extras)

    def without_bath(self) -> Template:
        """The template for a bathroom in an office: toilet and basin, nothing to wash oneself or clothes with."""
        core = tuple("wc" if group_name(names) == "bathroom" else names for names in self.core)
        core, extras = (tuple(name for name in names if name not in AT_HOME) for names in (core, self.extras))
        return replace(self, core=core, extras=extras)

    def with_one_basin(self) -> Template:
        """The template for the only bathroom of a home."""
        return replace(self, core=tuple(names.replace("bathroom:double", "bathroom:tub") for names in self.core))

    @property
    def kind(self) -> str:
        """What the room must have: ``wc`` for a bathroom without bath and shower, else its type."""
        return "wc" if self.holds("wc") else self.room_type

    @property
    def divided(self) -> bool:
        """Whether a divider stands in the room and hides what is behind it."""
        return self.holds("divider")


# Extras: what needs most floor first, as they get their places in this order.
_LIVING = (
    "dining:wall", "piano", "desk:wall", "reading", "storage", "play", "sideboard", "bookshelf", "plant", "shelf",
    "floor_lamp", "plant",
)  # fmt: skip
_BEDROOM = (
    "desk:wall", "reading", "storage", "dresser", "bookshelf", "plant", "mirror", "shelf", "floor_lamp",
    "laundry_basket", "rug",
)  # fmt: skip
_CHILD = ("play", "desk:wall", "bookshelf", "dresser", "reading", "shelf", "plant")
_STUDY = (
    "reading", "storage", "sideboard", "bookshelf", "filing_cabinet", "plant", "shelf", "floor_lamp", "waste_bin",
    "rug",
)  # fmt: skip
_DINING = ("piano", "reading", "storage", "sideboard", "bookshelf", "plant", "bench", "shelf", "floor_lamp", "plant")
_KITCHEN = ("dining:wall", "sideboard", "waste_bin", "plant", "shelf")
_BATHROOM = ("washing_machine", "bathroom_cabinet", "laundry_basket", "waste_bin", "stool", "plant")
_OFFICE = (
    "desk:wall", "desk:wall", "reading", "storage", "filing_cabinet", "bookshelf", "whiteboard", "coat_rack", "plant",
    "waste_bin", "plant",
)  # fmt: skip
_MEETING = (
    "sideboard", "storage", "bookshelf", "water_cooler", "coat_rack", "plant", "waste_bin", "plant", "shelf",
)  # fmt: skip
_CORRIDOR = ("shoe_cabinet", "coat_rack", "mirror")

TEMPLATES: dict[str, Template] = {
    "living_wall": Template("living", ("media:wall", "bookshelf|sideboard"), _LIVING),
    "living_free": Template("living", ("media:free", "sideboard|bookshelf|dining:wall"), _LIVING),
    "living_dining": Template("living", ("media:any", "dining:middle|dining:wall", "bookshelf"), _LIVING),
    "living_kitchen": Template("living", ("media:any", "kitchen|kitchen:corner", "dining:wall"), _LIVING),
    "living_divider": Template("living", ("media:wall", "divider", "desk:wall|reading"), _LIVING),
    "living_bedsit": Template("living", ("bed:alcove", "media:any", "dining:wall", "wardrobe"), _LIVING),
    "living_studio": Template("living", ("kitchen|kitchen:corner", "bed:alcove", "dining:wall", "media:any",
                                         "wardrobe"), _LIVING),
    "bedroom_plain": Template("bedroom", ("bed", "wardrobe", "dresser|desk:wall"), _BEDROOM),
    "bedroom_sitting": Template("bedroom", ("bed", "wardrobe", "reading", "dresser"), _BEDROOM),
    "bedroom_bunk": Template("bedroom", ("bunk", "wardrobe", "desk:wall", "play"), _CHILD),
    "bedroom_divider": Template("bedroom", ("bed", "wardrobe", "divider", "desk:wall|reading"), _BEDROOM),
    "study_wall": Template("study", ("desk:wall", "bookshelf", "bookshelf", "reading"), _STUDY),
    "study_free": Template("study", ("desk:free", "bookshelf", "bookshelf", "sofa|reading"), _STUDY),
    "study_piano": Template("study", ("desk:wall", "piano", "bookshelf", "reading"), _STUDY),
    "study_divider": Template("study", ("desk:wall", "divider", "bookshelf", "sofa|reading"), _STUDY),
    "dining_middle": Template("dining", ("dining:middle", "sideboard", "bookshelf|plant"), _DINING),
    "dining_wall": Template("dining", ("dining:wall", "sideboard", "reading|piano"), _DINING),
    "dining_kitchen": Template("dining", ("kitchen", "dining:middle|dining:wall", "sideboard"), _DINING),
    "dining_island": Template("dining", ("kitchen:island", "dining:wall|dining:middle"), _DINING),
    "kitchen_run": Template("kitchen", ("kitchen",), _KITCHEN),
    "kitchen_corner": Template("kitchen", ("kitchen:corner",), _KITCHEN),
    "kitchen_table": Template("kitchen", ("kitchen|kitchen:corner", "dining:wall"), _KITCHEN),
    "kitchen_island": Template("kitchen", ("kitchen:island", "plant"), _KITCHEN),
    "bathroom_shower": Template("bathroom", ("bathroom:shower", "towel_rail"), _BATHROOM),
    "bathroom_tub": Template("bathroom", ("bathroom:tub", "towel_rail"), _BATHROOM),
    "bathroom_laundry": Template("bathroom", ("bathroom:shower|bathroom:tub", "washing_machine", "laundry_basket",
                                              "towel_rail"),
                                 _BATHROOM),
    "office_single": Template("office", ("desk:free", "filing_cabinet", "bookshelf", "reading"), _OFFICE),
    "office_walls": Template("office", ("desk:wall", "desk:wall", "desk:wall", "filing_cabinet"), _OFFICE),
    "office_pair": Template("office", ("desk:pair", "filing_cabinet", "whiteboard"), _OFFICE),
    "office_block": Template("office", ("desk:four", "filing_cabinet", "whiteboard"), _OFFICE),
    "meeting_board": Template("meeting", ("meeting:board", "water_cooler"), _MEETING),
    "meeting_screen": Template("meeting", ("meeting:screen", "sideboard"), _MEETING),
    "meeting_both": Template("meeting", ("meeting:screen", "whiteboard", "plant"), _MEETING),
    "corridor_coats": Template("corridor", ("wardrobe_corner",), _CORRIDOR),
    "corridor_bench": Template("corridor", ("bench", "mirror", "coat_rack"), _CORRIDOR),
    "corridor_plain": Template("corridor", ("shoe_cabinet|coat_rack",), _CORRIDOR),
    "living_facing": Template("living", ("facing", "sideboard|storage", "reading"), _LIVING, novel=True),
    "living_facing_bed": Template("living", ("bed:alcove", "facing", "wardrobe"), _LIVING, novel=True),
    "living_loft": Template("living", ("kitchen", "bed:alcove", "facing", "wardrobe"), _LIVING, novel=True),
    "bedroom_twin": Template("bedroom", ("bed:twin|bed", "wardrobe", "reading"), _BEDROOM, novel=True),
    "study_pair": Template("study", ("desk:pair", "bookshelf", "sofa"), _STUDY, novel=True),
    "dining_bench": Template("dining", ("dining:bench", "sideboard", "storage"), _DINING, novel=True),
    "dining_bench_kitchen": Template("dining", ("kitchen", "dining:bench", "sideboard"), _DINING, novel=True),
    "kitchen_galley": Template("kitchen", ("kitchen:galley",), _KITCHEN, novel=True),
    "bathroom_double": Template("bathroom", ("bathroom:double", "towel_rail"), _BATHROOM, novel=True),
    "office_rows": Template("office", ("desk:rows", "filing_cabinet", "bookshelf"), _OFFICE, novel=True),
    "meeting_rows": Template("meeting", ("meeting:rows", "plant"), _MEETING, novel=True),
    "corridor_gallery": Template("corridor", ("bookshelf|shelf", "bench"), _CORRIDOR, novel=True),
}  # fmt: skip

FILLERS_OF: dict[str, tuple[str, ...]] = {
    "living": ("plant", "floor_lamp", "shelf", "bookshelf", "sideboard"),
    "bedroom": ("plant", "floor_lamp", "shelf", "laundry_basket", "dresser"),
    "study": ("plant", "floor_lamp", "shelf", "waste_bin", "bookshelf"),
    "dining": ("plant", "floor_lamp", "shelf", "bookshelf"),
    "kitchen": ("waste_bin", "shelf", "plant"),
    "bathroom": ("waste_bin", "laundry_basket", "bathroom_cabinet"),
    "wc": ("waste_bin", "plant", "mirror"),
    "office": ("plant", "waste_bin", "shelf", "bookshelf", "filing_cabinet"),
    "meeting": ("plant", "waste_bin", "shelf", "sideboard"),
    "corridor": ("shelf", "mirror"),
}
"""``Template.kind`` -> small groups that bring a sparse room up to its least number of objects."""


def even_weights(names: tuple[str, ...]) -> tuple[tuple[str, float], ...]:
    """(name, weight) such that every room type is equally likely, and within a type every template."""
    types = [TEMPLATES[name].room_type for name in names]
    return tuple((name, 1.0 / types.count(kind)) for name, kind in zip(names, types, strict=True))


COMMON_TEMPLATES: tuple[str, ...] = tuple(name for name, t in TEMPLATES.items() if not t.novel)
NOVEL_TEMPLATES: tuple[str, ...] = tuple(name for name, t in TEMPLATES.items() if t.novel)
