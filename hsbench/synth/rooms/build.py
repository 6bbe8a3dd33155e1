"""Build furnished scenes from seeds: a single room, or a flat or office of several."""

from __future__ import annotations

from collections.abc import Sequence

from hsbench.errors import SchemaError
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Scene, SceneObject
from hsbench.synth.furniture import MOVABLE, Style, family
from hsbench.synth.rooms.config import HomeConfig, RoomConfig, Weights
from hsbench.synth.rooms.floor_plans import draw_home_plan, draw_room_plan, weighted
from hsbench.synth.rooms.furnish import furnish
from hsbench.synth.rooms.placing import Layout
from hsbench.synth.rooms.plan import FloorPlan
from hsbench.synth.rooms.structure import around_room, room_style, structure
from hsbench.synth.rooms.templates import TEMPLATES
from hsbench.synth.seeds import Seeds


def build_scene(scene_id: str, seeds: Seeds, config: RoomConfig, families: tuple[str, ...]) -> Scene:
    """A furnished room in the scene frame: its smallest x and y are 0, walls along x and y, floor z = 0.

    families: names of style families to choose from. Never fails for want of space: what does not fit is left out.
    Raises SchemaError for no or unknown families.
    """
    style = _family(seeds, families)
    template = weighted(seeds.rng("template"), divided(config.templates, config.divider_share))
    plan = draw_room_plan(seeds, config, TEMPLATES[template].room_type)
    return _furnished(scene_id, plan, (template,), seeds, config, style)


def build_home(scene_id: str, seeds: Seeds, config: HomeConfig, families: tuple[str, ...]) -> Scene:
    """A furnished flat or office in the scene frame: the smallest x and y of its rooms are 0. Rooms in plan order.

    Each room depends on the plan, the style and its own seeds only. Raises SchemaError for no or unknown families.
    """
    style = _family(seeds, families)
    plan = draw_home_plan(seeds, config)
    return _furnished(scene_id, plan, draw_templates(seeds, plan, config.room), seeds, config.room, style)


def draw_templates(seeds: Seeds, plan: FloorPlan, config: RoomConfig) -> tuple[str, ...]:
    """A template for each room of a plan. Raises SchemaError for a room type without one."""
    weights = divided(config.templates, config.divider_share)
    types = [room.room_type for room in plan.rooms]
    found = []
    for i, kind in enumerate(types):
        own = tuple((name, w) for name, w in weights if TEMPLATES[name].room_type == kind)
        if not own:
            raise SchemaError(f"room.templates has none for a {kind}; expected one for each type of room")
        wanted = (kind == _cooking_room(types), kind == _sleeping_room(types))
        fitting = tuple((n, w) for n, w in own if (TEMPLATES[n].holds("kitchen"), _sleeps(n)) == wanted)
        found.append(weighted(seeds.rng(f"template-{i}"), fitting or own))
    return tuple(found)


def _cooking_room(types: Sequence[str]) -> str:
    """The type of the one room of a home where people cook: a kitchen, else the dining or living room."""
    return next((kind for kind in ("kitchen", "dining", "living") if kind in types), "")


def _sleeping_room(types: Sequence[str]) -> str:
    """The type of the rooms of a home where people sleep: bedrooms, else the living room."""
    return next((kind for kind in ("bedroom", "living") if kind in types), "")


def _sleeps(template_name: str) -> bool:
    """Whether every room of a template holds a bed."""
    return any(TEMPLATES[template_name].holds(group) for group in ("bed", "bunk"))


def divided(weights: Weights, share: float) -> Weights:
    """The weights such that, within a room type that has both, templates with a divider have this share."""
    totals: dict[tuple[str, bool], float] = {}
    for name, weight in weights:
        key = (TEMPLATES[name].room_type, TEMPLATES[name].divided)
        totals[key] = totals.get(key, 0.0) + weight
    found = []
    for name, weight in weights:
        kind, is_divided = TEMPLATES[name].room_type, TEMPLATES[name].divided
        with_divider, without = totals.get((kind, True), 0.0), totals.get((kind, False), 0.0)
        if with_divider and without:
            own = share if is_divided else 1.0 - share
            weight *= own * (with_divider + without) / (with_divider if is_divided else without)
        found.append((name, weight))
    return tuple((name, weight) for name, weight in found if weight > 0)


def _family(seeds: Seeds, families: tuple[str, ...]) -> Style:
    """A style family narrowed to one home."""
    if not families:
        raise SchemaError("a scene got no style family; expected at least one name")
    return family(families[int(seeds.rng("family").integers(len(families)))]).for_room(seeds.rng("style"))


def _furnished(
    scene_id: str, plan: FloorPlan, templates: tuple[str, ...], seeds: Seeds, config: RoomConfig, home: Style
) -> Scene:
    styles = [room_style(home, room.room_type, seeds.rng(f"style-{i}")) for i, room in enumerate(plan.rooms)]
    objects = structure(plan, seeds.child("structure"), home, styles)
    placed: list[SceneObject] = []
    for i, (template, style) in enumerate(zip(templates, styles, strict=True)):
        bounds = around_room(objects, plan, i)
        layout = furnish(plan.shell(i), bounds, template, style, seeds.child(f"room-{i}"), config)
        placed += _objects(layout, len(objects) + len(placed) + 1)
    return Scene(scene_id, plan.rooms, plan.height_m, (*objects, *placed), home.name)


def _objects(layout: Layout, first: int) -> list[SceneObject]:
    """The items of a room in the scene frame, in the order of placement, with ids from ``first``."""
    x, y = layout.shell.origin_xy
    found = []
    for i, item in enumerate(layout.items, start=first):
        pose = planar(item.pose.x + x, item.pose.y + y, item.pose.yaw, item.pose.z)
        name = item.piece.category_name
        found.append(SceneObject(i, name, pose, item.piece.parts, movable=name in MOVABLE))
    return found
