"""Furnish one room: the groups of a template with backtracking, extras, fillers, and what hangs and stands on things.

Every step draws from a stream of its own name, so that one step never changes what another draws.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hsbench.schema.scene import SceneObject
from hsbench.synth.furniture import Style
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.decorate import ceiling_lamps, curtains, pictures, radiators
from hsbench.synth.rooms.groups import GROUPS
from hsbench.synth.rooms.items import Item
from hsbench.synth.rooms.placing import Layout
from hsbench.synth.rooms.poses import Context
from hsbench.synth.rooms.shell import Shell
from hsbench.synth.rooms.supports import small_things
from hsbench.synth.rooms.templates import FILLERS_OF, Template, group_name
from hsbench.synth.seeds import Seeds

FITS = (1.0, 0.5, 0.0)  # a group that does not fit is tried in smaller sizes,
EXTRA_FITS = FITS[:2]  # an extra not in the smallest, which has fallbacks for rooms that need the group
SMALLEST = FITS[-1:]
TURNS = 3  # independent draws of one group of the template
MOST_ENDINGS = 5  # ways to place all groups of a template that are tried
FILLER_ROUNDS = 3
USUAL_M2 = 14.0  # smaller rooms have fewer extras and a smaller least number of objects, larger ones more extras
BARE_M = 0.9  # a person who may stand so far from all things and walls stands on floor that lacks furniture
ONCE = frozenset(("dining", "piano", "play", "storage"))
"""Groups of which a room has one."""
Step = Callable[[Layout, Style, Seeds, RoomConfig], None]
AT_WINDOWS: tuple[Step, ...] = (radiators, curtains)
"""What is added once the groups of the template stand, in this order."""
FINISHES: tuple[Step, ...] = (ceiling_lamps, pictures, small_things)
"""What is added when all furniture stands, in this order."""

DEFINING: dict[str, tuple[frozenset[str], ...]] = {
    "living": (frozenset(("sofa", "armchair")),),
    "bedroom": (frozenset(("bed", "bunk_bed")),),
    "kitchen": (frozenset(("kitchen_counter",)),),
    "dining": (frozenset(("dining_table",)),),
    "bathroom": (frozenset(("toilet",)), frozenset(("washbasin",)), frozenset(("shower", "bathtub"))),
    "wc": (frozenset(("toilet",)), frozenset(("washbasin",))),
    "study": (frozenset(("desk",)),),
    "office": (frozenset(("desk",)),),
    "meeting": (frozenset(("meeting_table",)),),
}
"""``Template.kind`` -> sets of categories; such a room has one of each set."""

RESORTS: dict[str, str] = {
    "living": "reading", "bedroom": "bed", "kitchen": "kitchen", "dining": "dining:wall", "bathroom": "bathroom:shower",
    "wc": "wc",
    "study": "desk:wall", "office": "desk:wall", "meeting": "meeting:board",
}  # fmt: skip
"""``Template.kind`` -> the group that comes first where those of the template do not make the room what it is."""
BESIDES: dict[str, frozenset[str]] = {
    "kitchen": frozenset(("kitchen_counter",)),
    "bed:alcove": frozenset(("bed", "bunk_bed")),
    "dining:wall": frozenset(("dining_table",)),
}
"""Group -> categories of which a room has one where its template holds such a group, whatever its type."""


def furnish(
    shell: Shell, structure: Sequence[SceneObject], template: Template, style: Style, seeds: Seeds, config: RoomConfig
) -> Layout:
    """A furnished room. structure: the objects that bound it, scene frame. What does not fit is left out."""
    small = min(1.0, shell.area_m2 / USUAL_M2)
    least = round(config.furniture[0] * small)
    layout = Layout(shell, structure, replace(config, furniture=(least, config.furniture[1])), template.room_type)
    rng = seeds.rng("programme")
    core = [_one_of(rng, names) for names in template.core]
    _place_essentials(layout, style, seeds, template, core)
    for step in AT_WINDOWS:
        step(layout, style, seeds, layout.config)
    wish = int(rng.integers(config.extras[0], config.extras[1], endpoint=True))
    done = ONCE.intersection(group_name(group) for group in core)
    extras = [group for group in template.extras if group_name(group) not in done]
    _place_extras(layout, style, seeds, extras, round(wish * shell.area_m2 / USUAL_M2))
    _fill_up(layout, style, seeds.child("filler"), FILLERS_OF[template.kind])
    for finish in FINISHES:
        finish(layout, style, seeds, layout.config)
    return layout


def _place_essentials(layout: Layout, style: Style, seeds: Seeds, template: Template, core: Sequence[str]) -> None:
    """Place the groups of a template; where the room then lacks something, try once more with that first, all small."""
    empty = layout.mark()
    _place_core(layout, style, seeds.child("core"), core)
    wanted = _essentials(template)
    has = _has(layout, wanted)
    if all(has):
        return
    before = layout.mark()
    first = list(dict.fromkeys(group for (group, _), found in zip(wanted, has, strict=True) if not found))
    names = {group_name(group) for group in first}
    layout.back_to(empty)
    groups = [*first, *(g for g in core if group_name(g) not in names)]
    _place_core(layout, style, seeds.child("resort"), groups, SMALLEST)
    if _has(layout, wanted) < has:
        layout.back_to(before)


def _essentials(template: Template) -> list[tuple[str, frozenset[str]]]:
    """(group, categories of which the room has one and which the group brings), those it cannot do without first."""
    own = DEFINING.get(template.kind, ())
    held = [(g, c) for g, c in BESIDES.items() if c not in own and template.holds(group_name(g))]
    return [*((RESORTS[template.kind], categories) for categories in own), *held]


def _has(layout: Layout, wanted: Sequence[tuple[str, frozenset[str]]]) -> list[bool]:
    """Which of the essentials are there."""
    present = {item.piece.category_name for item in layout.items}
    return [bool(categories & present) for _, categories in wanted]


def _place_core(
    layout: Layout, style: Style, seeds: Seeds, groups: Sequence[str], fits: Sequence[float] = FITS
) -> None:
    """Place the groups of a template in order; where one finds no place, draw those before it anew.

    Of the endings that were tried, the room is left with the one that has most of the groups, the first ones above all.
    """
    best: tuple[bool, ...] = ()
    best_mark = layout.mark()
    endings = 0

    def extend(placed: tuple[bool, ...]) -> bool:
        nonlocal best, best_mark, endings
        k = len(placed)
        if k == len(groups):
            endings += 1
            if placed > best:
                best, best_mark = placed, layout.mark()
            return all(placed) or endings >= MOST_ENDINGS
        before = layout.mark()
        for turn in range(TURNS):
            found = bool(_place(layout, style, seeds.child(f"{k}-{turn}"), groups[k], fits))
            if extend((*placed, found)):
                return True
            layout.back_to(before)
            if not found and k > 0:
                return False
        return False

    extend(())
    layout.back_to(best_mark)


def _place_extras(layout: Layout, style: Style, seeds: Seeds, extras: Sequence[str], count: int) -> None:
    """Place so many of the extras, and the others as long as there is bare floor; those that need most first."""
    rng = seeds.rng("extras")
    order = [int(i) for i in rng.permutation(len(extras))]
    chosen, others = sorted(order[:count]), sorted(order[count:])
    for i in (*chosen, *others):
        if i in others and layout.widest_m <= BARE_M:
            break
        _place(layout, style, seeds.child(f"extra-{i}"), extras[i], EXTRA_FITS)


def _place(layout: Layout, style: Style, seeds: Seeds, group: str, fits: Sequence[float] = FITS) -> list[Item]:
    """Try a group in falling sizes; the items that found a place."""
    name, _, mode = group.partition(":")
    for fit in fits:
        ctx = Context(layout, style, seeds.child(f"fit-{fit}"), layout.config, fit)
        placed = layout.place(GROUPS[name](ctx, mode))
        if placed:
            return placed
    return []


def _fill_up(layout: Layout, style: Style, seeds: Seeds, fillers: Sequence[str]) -> None:
    """Small things until the room holds its least number of objects, or nothing fits any more."""
    rng = seeds.rng("order")
    for turn in range(FILLER_ROUNDS):
        for i in rng.permutation(len(fillers)):
            if layout.furniture_count >= layout.config.furniture[0]:
                return
            _place(layout, style, seeds.child(f"{turn}-{i}"), fillers[int(i)])


def _one_of(rng: np.random.Generator, names: str) -> str:
    options = names.split("|")
    return options[int(rng.integers(len(options)))]
