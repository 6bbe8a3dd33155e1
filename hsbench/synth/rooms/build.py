"""Build a furnished room from seeds: shell, groups of a template, extras, fillers, curtains and clutter.

Every step draws from a stream of its own name, so that one step never changes what another draws.
"""

from __future__ import annotations

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.scene import Room, Scene, SceneObject
from hsbench.synth.furniture import MOVABLE, Style, family
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.finish import clutter_on, curtains
from hsbench.synth.rooms.groups import GROUPS
from hsbench.synth.rooms.placing import Item, Layout
from hsbench.synth.rooms.poses import Context
from hsbench.synth.rooms.shell import draw_shell, shell_objects
from hsbench.synth.rooms.templates import FILLERS, TEMPLATES
from hsbench.synth.seeds import Seeds

FITS = (1.0, 0.5, 0.0)  # a group that does not fit is tried in smaller sizes
FILLER_ROUNDS = 3


def build_scene(scene_id: str, seeds: Seeds, config: RoomConfig, families: tuple[str, ...]) -> Scene:
    """A furnished room in the room frame: inner corner at the origin, walls along x and y, floor z = 0.

    families: names of style families to choose from. Never fails for want of space: what does not fit is left out.
    Raises SchemaError for no or unknown families.
    """
    if not families:
        raise SchemaError("build_scene got no style family; expected at least one name")
    style = family(families[int(seeds.rng("family").integers(len(families)))]).for_room(seeds.rng("style"))
    template_name = _template(seeds.rng("template"), config)
    shell = draw_shell(seeds, config)
    layout = Layout(shell, shell_objects(shell, seeds, style), config)
    for i, group in enumerate(_programme(seeds.rng("programme"), template_name, config)):
        _place(layout, style, seeds.child(f"group-{i}"), config, group)
    _fill_up(layout, style, seeds, config)
    curtains(layout, style, seeds, config)
    clutter_on(layout, style, seeds, config)
    room = Room(TEMPLATES[template_name].room_type, shell.outline_xy)
    return Scene(scene_id, (room,), shell.size_m[2], _objects(layout), style.name)


def _template(rng: np.random.Generator, config: RoomConfig) -> str:
    names, weights = zip(*config.templates, strict=True)
    edges = np.cumsum(np.array(weights, dtype=np.float64))
    return str(names[int(np.searchsorted(edges, rng.random() * edges[-1], side="right"))])


def _programme(rng: np.random.Generator, template_name: str, config: RoomConfig) -> list[str]:
    """The groups to try, in order: those of the template, then some of its extras."""
    template = TEMPLATES[template_name]
    count = int(rng.integers(config.extras[0], config.extras[1], endpoint=True))
    order = rng.permutation(len(template.extras))
    return [_one_of(rng, name) for name in (*template.core, *(template.extras[int(i)] for i in order[:count]))]


def _one_of(rng: np.random.Generator, names: str) -> str:
    options = names.split("|")
    return options[int(rng.integers(len(options)))]


def _place(layout: Layout, style: Style, seeds: Seeds, config: RoomConfig, group: str) -> list[Item]:
    """Try a group in falling sizes; the items that found a place."""
    name, _, mode = group.partition(":")
    for fit in FITS:
        placed = layout.place(GROUPS[name](Context(layout, style, seeds.child(f"fit-{fit}"), config, fit), mode))
        if placed:
            return placed
    return []


def _fill_up(layout: Layout, style: Style, seeds: Seeds, config: RoomConfig) -> None:
    """Small things until the room holds its least number of objects, or nothing fits any more."""
    rng = seeds.rng("fillers")
    for turn in range(FILLER_ROUNDS):
        for i in rng.permutation(len(FILLERS)):
            if layout.furniture_count >= config.furniture[0]:
                return
            _place(layout, style, seeds.child(f"filler-{turn}-{i}"), config, FILLERS[int(i)])


def _objects(layout: Layout) -> tuple[SceneObject, ...]:
    """All objects with ascending ids: structure first, then furniture in the order of placement."""
    first = len(layout.structure) + 1
    placed = (
        SceneObject(
            i,
            item.piece.category_name,
            item.pose.scene_T_object,
            item.piece.parts,
            movable=item.piece.category_name in MOVABLE,
        )
        for i, item in enumerate(layout.items, start=first)
    )
    return (*layout.structure, *placed)
