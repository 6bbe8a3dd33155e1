"""Build furnished scenes from seeds: a single room, or a flat or office of several."""

from __future__ import annotations

from collections.abc import Sequence

from hsbench.errors import SchemaError
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Scene, SceneObject
from hsbench.synth.furniture import MOVABLE, Style, family
from hsbench.synth.rooms.config import HomeConfig, RoomConfig
from hsbench.synth.rooms.floor_plans import draw_home_plan, draw_room_plan, weighted
from hsbench.synth.rooms.furnish import furnish
from hsbench.synth.rooms.placing import Layout
from hsbench.synth.rooms.plan import FloorPlan
from hsbench.synth.rooms.room_roles import divided, draw_templates, eaten_in, eating_rooms
from hsbench.synth.rooms.structure import around_room, room_style, structure
from hsbench.synth.rooms.templates import TEMPLATES, Template
from hsbench.synth.seeds import Seeds


def build_scene(scene_id: str, seeds: Seeds, config: RoomConfig, families: tuple[str, ...]) -> Scene:
    """A furnished room in the scene frame: its smallest x and y are 0, walls along x and y, floor z = 0.

    families: names of style families to choose from. Never fails for want of space: what does not fit is left out.
    Raises SchemaError for no or unknown families.
    """
    style = _family(seeds, families)
    template = TEMPLATES[weighted(seeds.rng("template"), divided(config.templates, config.divider_share))]
    plan = draw_room_plan(seeds, config, template.room_type)
    return _furnished(scene_id, plan, (template,), seeds, config, style)


def build_home(scene_id: str, seeds: Seeds, config: HomeConfig, families: tuple[str, ...]) -> Scene:
    """A furnished flat or office in the scene frame: the smallest x and y of its rooms are 0. Rooms in plan order.

    Each room depends on the plan, the style and its own seeds only. Raises SchemaError for no or unknown families.
    """
    style = _family(seeds, families)
    plan = draw_home_plan(seeds, config)
    return _furnished(scene_id, plan, draw_templates(seeds, plan, config.room), seeds, config.room, style)


def _family(seeds: Seeds, families: tuple[str, ...]) -> Style:
    """A style family narrowed to one home."""
    if not families:
        raise SchemaError("a scene got no style family; expected at least one name")
    return family(families[int(seeds.rng("family").integers(len(families)))]).for_room(seeds.rng("style"))


def _furnished(
    scene_id: str, plan: FloorPlan, templates: Sequence[Template], seeds: Seeds, config: RoomConfig, home: Style
) -> Scene:
    styles = [room_style(home, room.room_type, seeds.rng(f"style-{i}")) for i, room in enumerate(plan.rooms)]
    objects = structure(plan, seeds.child("structure"), home, styles)

    def furnished(i: int, template: Template) -> Layout:
        bounds = around_room(objects, plan, i)
        return furnish(plan.shell(i), bounds, template, styles[i], seeds.child(f"room-{i}"), config)

    layouts = [furnished(i, template) for i, template in enumerate(templates)]
    # Where the room that should have it has no place for a table, another one takes it.
    for i in eating_rooms(plan, templates)[1:]:
        if any(eaten_in(layout) for layout in layouts):
            break
        layouts[i] = furnished(i, templates[i].with_table())
    placed: list[SceneObject] = []
    for layout in layouts:
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
