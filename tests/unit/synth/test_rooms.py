"""The guarantees of generated rooms and homes, checked from the finished scenes alone, over many seeds."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pytest
import shapely
from scipy import ndimage
from shapely.affinity import affine_transform

from hsbench.errors import SchemaError
from hsbench.geometry.convex import span
from hsbench.geometry.polygons import contains
from hsbench.geometry.separation import penetrating_pairs
from hsbench.schema.scene import Room, Scene, SceneObject
from hsbench.synth.config import settings
from hsbench.synth.furniture import COMMON_FAMILIES, MOVABLE, NOVEL_FAMILIES, family
from hsbench.synth.rooms import (
    COMMON_TEMPLATES,
    NOVEL_TEMPLATES,
    PROGRAMMES,
    TEMPLATES,
    HomeConfig,
    RoomConfig,
    build_home,
    build_scene,
)
from hsbench.synth.rooms.floor_plans import draw_home_plan
from hsbench.synth.rooms.furnish import DEFINING, furnish
from hsbench.synth.rooms.plan_shapes import SHAPES
from hsbench.synth.rooms.room_roles import divided, draw_templates
from hsbench.synth.rooms.structure import around_room, room_style, structure
from hsbench.synth.rooms.templates import even_weights
from hsbench.synth.seeds import Seeds
from hsbench.truth.walkable import WalkMap, connected_to_doors, walk_map

TOUCH_M = 2e-3
SEAT_AT_M = 0.7  # from the edge of a table to the middle of a seat at it
NAMES = tuple(TEMPLATES)
HOMES = tuple(PROGRAMMES)
OPENING = ("door", "drawer", "front")
NOVEL_HOME = RoomConfig(templates=even_weights(NOVEL_TEMPLATES))


def room(index: int) -> Scene:
    """A room of one seed; templates and shapes take turns, novel templates with novel styles."""
    name, shape = NAMES[index % len(NAMES)], SHAPES[index % len(SHAPES)]
    families = NOVEL_FAMILIES if TEMPLATES[name].novel else COMMON_FAMILIES
    config = RoomConfig(templates=((name, 1.0),), shapes=((shape, 1.0),))
    return build_scene(f"room-{index}-{name}", Seeds(11).child(index), config, families)


def home(index: int) -> Scene:
    """A home of one seed; programmes take turns, every fourth is novel."""
    novel = index % 4 == 3
    name = HOMES[index % len(HOMES)]
    config = HomeConfig(programmes=((name, 1.0),), room=NOVEL_HOME if novel else RoomConfig())
    families = NOVEL_FAMILIES if novel else COMMON_FAMILIES
    return build_home(f"home-{index}-{name}", Seeds(12).child(index), config, families)


@dataclass(frozen=True, eq=False)
class Checked:
    """A scene and what several tests need of it."""

    scene: Scene

    @cached_property
    def walk(self) -> WalkMap:
        return walk_map(self.scene)

    @cached_property
    def reached(self) -> np.ndarray:
        return connected_to_doors(self.walk, self.scene)

    @cached_property
    def things(self) -> list[SceneObject]:
        return [o for o in self.scene.objects if o.category.group != "structure"]

    def of_room(self, room: Room) -> list[SceneObject]:
        inside = shapely.Polygon(room.outline_xy).buffer(1e-6)
        return [o for o in self.things if inside.contains(shapely.Point(o.box[:2]))]


@pytest.fixture(
    scope="module",
    params=[(range(0, 48, 2), range(4)), pytest.param((range(184), range(4, 44)), marks=pytest.mark.slow)],
    ids=["some", "many"],
)
def scenes(request: pytest.FixtureRequest) -> list[Checked]:
    rooms, homes = request.param
    return [Checked(room(i)) for i in rooms] + [Checked(home(i)) for i in homes]


def test_no_two_objects_interpenetrate(scenes: list[Checked]) -> None:
    for checked in scenes:
        objects = checked.scene.objects
        solids = [s for o in objects for s in o.solids]
        owner = np.array([k for k, o in enumerate(objects) for _ in o.solids])
        pairs, depth = penetrating_pairs(solids, owner, TOUCH_M)
        found = {(objects[i].category_name, objects[j].category_name) for i, j in owner[pairs]}
        assert not found, f"{checked.scene.scene_id}: {found} by {depth.max():.4f} m"


def test_everything_is_inside_a_room_and_held(scenes: list[Checked]) -> None:
    for checked in scenes:
        scene = checked.scene
        rooms = [shapely.Polygon(r.outline_xy) for r in scene.rooms]
        for item in checked.things:
            low, high = item.vertices.min(axis=0), item.vertices.max(axis=0)
            name = f"{scene.scene_id}: {item.category_name} {item.object_id}"
            assert low[2] >= -1e-9, name
            assert high[2] <= scene.height_m + 1e-9, name
            shadow = shapely.MultiPoint(item.vertices[:, :2]).convex_hull
            (own,) = [r for r in rooms if r.buffer(2e-3).covers(shadow)]
            if low[2] <= 0.01 or high[2] >= scene.height_m - 0.01:
                continue
            feet = shapely.MultiPoint(item.vertices[item.vertices[:, 2] <= low[2] + 0.01][:, :2])
            tops = [
                s for o in checked.things for s in o.solids if o is not item and abs(s.bounds[1, 2] - low[2]) <= 0.015
            ]
            carried = shapely.union_all([shapely.MultiPoint(s.vertices[:, :2]).convex_hull for s in tops])
            at_wall = own.exterior.distance(shadow) <= 0.04
            assert at_wall or carried.buffer(1e-3).intersects(feet), name


def test_ways_are_free(scenes: list[Checked]) -> None:
    for checked in scenes:
        for way in (o for o in checked.scene.objects if o.category_name in ("door", "passage")):
            jambs = [p.vertices for p in way.parts if p.name.startswith("jamb")]
            x0, x1 = min(j[:, 0].max() for j in jambs), max(j[:, 0].min() for j in jambs)
            deep = max(j[:, 1].max() for j in jambs)
            zones = [span((x0, -0.89, 0.0), (x1, -0.02, 2.0)), span((x0, deep + 0.02, 0.0), (x1, deep + 0.89, 2.0))]
            zones = [z.transformed(way.scene_T_object) for z in zones]
            near = [o for o in checked.things if np.linalg.norm(o.box[:2] - way.box[:2]) < 3.0]
            solids = [*zones, *(s for o in near for s in o.solids)]
            owner = np.array([0, 0, *(k for k, o in enumerate(near, start=1) for _ in o.solids)])
            pairs, _ = penetrating_pairs(solids, owner, TOUCH_M)
            hits = {near[j - 1].category_name for i, j in owner[pairs] if i == 0}
            assert not hits, f"{checked.scene.scene_id}: {hits} in the way at {way.category_name} {way.object_id}"


def test_windows_are_not_hidden(scenes: list[Checked]) -> None:
    for checked in scenes:
        for window in (o for o in checked.scene.objects if o.category_name == "window"):
            pane = next(p for p in window.parts if p.name == "pane").vertices
            inverse = np.linalg.inv(window.scene_T_object)
            for item in checked.things:
                local = item.vertices @ inverse[:3, :3].T + inverse[:3, 3]
                covers = (
                    local[:, 0].max() > pane[:, 0].min()
                    and local[:, 0].min() < pane[:, 0].max()
                    and local[:, 1].max() > pane[:, 1].min() - 0.4
                    and local[:, 1].min() < pane[:, 1].max()
                    and local[:, 2].min() < pane[:, 2].max()  # a lamp may hang above it
                )
                assert not covers or local[:, 2].max() <= pane[:, 2].min(), (
                    f"{checked.scene.scene_id}: {item.category_name}"
                )


def nearest_walkable(checked: Checked, points: np.ndarray) -> np.ndarray:
    """(n, 2) -> (n,) distance to the nearest cell centre that is connected to a door."""
    cells = checked.walk.centres()[checked.reached]
    return np.linalg.norm(points[:, None] - cells[None], axis=-1).min(axis=1)


def middles(item: SceneObject, roles: tuple[str, ...]) -> np.ndarray:
    found = [s for s, p in zip(item.solids, item.parts, strict=True) if p.role in roles]
    return np.array([s.bounds.mean(axis=0)[:2] for s in found]).reshape(-1, 2)


def test_seats_beds_and_cupboards_are_reached(scenes: list[Checked]) -> None:
    for checked in scenes:
        for item in checked.things:
            name = f"{checked.scene.scene_id}: {item.category_name} {item.object_id}"
            seats, opening = middles(item, ("seat",)), middles(item, OPENING)
            if len(seats):
                assert nearest_walkable(checked, seats).max() <= 0.7, name
            if len(opening) and item.category.group == "furniture":
                assert nearest_walkable(checked, opening).min() <= 0.75, name
            edge = [s.vertices[:, :2] for s, p in zip(item.solids, item.parts, strict=True) if p.role == "mattress"]
            if edge:
                assert nearest_walkable(checked, np.concatenate(edge)).min() <= 0.7, name


def test_the_floor_is_free_and_connected(scenes: list[Checked]) -> None:
    config = RoomConfig()
    for checked in scenes:
        scene, walk, reached = checked.scene, checked.walk, checked.reached
        assert ndimage.label(reached)[1] == 1, f"{scene.scene_id}: all doors and rooms are one floor"
        centres, cell = walk.centres(), walk.cell_m**2
        for number, own in enumerate(scene.rooms):
            inside = contains(own.outline_xy, centres)
            name = f"{scene.scene_id}: room {number} {own.room_type}"
            assert (walk.free & ~reached & inside).sum() * cell <= config.pocket_m2 + 1e-9, name
            assert (reached & inside).sum() * cell >= config.walkable_share * own.area_m2, name
            covered = np.zeros(inside.shape, dtype=bool)
            for item in checked.of_room(own):
                shadows = [
                    shapely.MultiPoint(s.vertices[:, :2]).convex_hull
                    for s in item.solids
                    if s.bounds[1, 2] > 0.02 and s.bounds[0, 2] < 1.8
                ]
                covered |= shapely.contains_xy(shapely.union_all(shadows), centres[..., 0], centres[..., 1])
            assert (inside & ~covered).sum() / inside.sum() >= 0.3, name


BATHS = frozenset({"bathtub", "shower"})


def test_rooms_are_what_they_are_called(scenes: list[Checked]) -> None:
    for checked in scenes:
        for own in checked.scene.rooms:
            present = {o.category_name for o in checked.of_room(own)}
            types = {room.room_type for room in checked.scene.rooms}
            is_at_work = (
                own.room_type == "bathroom" and types & {"office", "meeting"} and not types & {"living", "bedroom"}
            )
            for wanted in DEFINING.get(own.room_type, ()):
                if is_at_work and wanted == BATHS:  # people wash at home
                    assert not wanted & present, f"{checked.scene.scene_id}: the office has {sorted(wanted & present)}"
                else:
                    assert wanted & present, f"{checked.scene.scene_id}: {own.room_type} holds {sorted(present)}"
            count = sum(o.category.group == "furniture" for o in checked.of_room(own))
            assert 1 <= count <= RoomConfig().furniture[1]
            assert own.area_m2 < 10 or own.room_type == "corridor" or count >= 4, f"{own.room_type} holds {count}"


def test_homes_have_one_kitchen_and_a_bed(scenes: list[Checked]) -> None:
    for checked in scenes:
        types = [r.room_type for r in checked.scene.rooms]
        if "living" not in types or len(types) == 1:
            continue  # a single room, or an office
        holding = [{o.category_name for o in checked.of_room(r)} for r in checked.scene.rooms]
        assert sum("kitchen_counter" in present for present in holding) == 1, checked.scene.scene_id
        assert any({"bed", "bunk_bed"} & present for present in holding), checked.scene.scene_id


def test_homes_have_one_table_to_eat_at(scenes: list[Checked]) -> None:
    """Or bar stools at an island instead; a flat of one room may be too small."""
    eaten = []
    for checked in scenes:
        types = [r.room_type for r in checked.scene.rooms]
        if "living" not in types or len(types) == 1:
            continue
        names = [o.category_name for o in checked.things]
        assert names.count("dining_table") <= 1, checked.scene.scene_id
        eaten.append("dining_table" in names or "bar_stool" in names)
        assert eaten[-1] or len(types) == 2, checked.scene.scene_id
    assert np.mean(eaten) >= 0.9


def test_people_pass_what_stands_in_a_hall(scenes: list[Checked]) -> None:
    passed = 0
    for checked in scenes:
        for own in (r for r in checked.scene.rooms if r.room_type == "corridor"):
            standing = [o for o in checked.of_room(own) if o.category.group == "furniture" and o.box[2] < o.box[5]]
            for item in standing:
                x, y = item.box[3] / 2, item.box[4] / 2
                ends = np.array([[-x, -y - 0.9], [x, -y - 0.9], [x, -y - 0.01], [-x, -y - 0.01]])
                c, s = np.cos(item.box[6]), np.sin(item.box[6])
                before = shapely.Polygon(ends @ np.array([[c, s], [-s, c]]) + item.box[:2])
                assert shapely.Polygon(own.outline_xy).buffer(1e-3).covers(before), checked.scene.scene_id
                for other in standing:
                    shadow = shapely.MultiPoint(other.vertices[:, :2]).convex_hull
                    assert other is item or not before.buffer(-1e-3).intersects(shadow), checked.scene.scene_id
                passed += 1
    assert passed > 0


def test_heads_of_beds_are_at_a_wall(scenes: list[Checked]) -> None:
    for checked in scenes:
        for own in checked.scene.rooms:
            things = checked.of_room(own)
            for bed in (o for o in things if o.category_name in ("bed", "bunk_bed")):
                head = bed.scene_T_object[:2, :2] @ [0.0, bed.box[4] / 2] + bed.box[:2]
                to_wall = shapely.Polygon(own.outline_xy).exterior.distance(shapely.Point(head))
                assert to_wall <= 0.12, f"{checked.scene.scene_id}: {to_wall:.2f} m from a wall"


def test_wide_storage_has_its_back_at_a_wall_or_another_back(scenes: list[Checked]) -> None:
    """But for the shelves that divide a room, and what stands behind a sofa that is free in it."""
    for checked in scenes:
        for own in checked.scene.rooms:
            outline = shapely.Polygon(own.outline_xy).exterior
            things = checked.of_room(own)
            backs = [o for o in things if o.category_name == "sofa"]
            for item in (o for o in things if o.category_name in ("wardrobe", "sideboard", "dresser", "tv_stand")):
                back = item.scene_T_object[:2, :2] @ [0.0, item.box[4] / 2] + item.box[:2]
                to_thing = min((rectangle_distance(o, back) for o in backs), default=1.0)
                nearest = min(outline.distance(shapely.Point(back)), to_thing)
                # In a row of storage the backs are in one plane.
                assert nearest <= 0.15, f"{checked.scene.scene_id}: {item.category_name} {nearest:.2f} m from a wall"


def test_seats_at_tables_face_them(scenes: list[Checked]) -> None:
    checked_chairs = 0
    for checked in scenes:
        tables = [o for o in checked.things if o.category_name in ("dining_table", "desk", "meeting_table")]
        for chair in (o for o in checked.things if o.category_name in ("chair", "office_chair")):
            forward = chair.scene_T_object[:2, :2] @ [0.0, -1.0]
            front = chair.box[:2] + forward * chair.box[4] / 2
            gaps = [rectangle_distance(t, front) for t in tables]
            if min(gaps, default=1.0) > 0.3:
                continue  # an extra chair stands by itself
            table = tables[int(np.argmin(gaps))]
            assert rectangle_distance(table, front + 0.3 * forward) <= 0.1, f"{checked.scene.scene_id}: looks away"
            checked_chairs += 1
    assert checked_chairs > 20


def test_tables_to_eat_at_have_two_seats_and_as_many_across(scenes: list[Checked]) -> None:
    for checked in scenes:
        for table in (o for o in checked.things if o.category_name == "dining_table"):
            half = np.abs(np.concatenate([p.vertices for p in table.parts])[:, :2]).max(axis=0)
            seats = [o for o in checked.things if o.category_name in ("chair", "bench")]
            at = [np.linalg.inv(table.scene_T_object) @ o.scene_T_object[:, 3] for o in seats]
            near = [(o, p) for o, p in zip(seats, at, strict=True) if (np.abs(p[:2]) < half + SEAT_AT_M).all()]
            along = [p[1] for o, p in near if abs(p[0]) < half[0] and o.category_name == "chair"]
            sides = [sum(y > 0 for y in along), sum(y < 0 for y in along)]
            assert len(near) >= 2, checked.scene.scene_id
            assert 0 in sides or sides[0] == sides[1], checked.scene.scene_id


def test_toilets_are_free_on_both_sides(scenes: list[Checked]) -> None:
    for checked in scenes:
        solid = [o for o in checked.things if o.box[2] - o.box[5] / 2 < 0.05 and o.category_name != "rug"]
        for toilet in (o for o in checked.things if o.category_name == "toilet"):
            points = np.concatenate([p.vertices for p in toilet.parts])
            low, high = points.min(axis=0), points.max(axis=0)
            beside = shapely.box(low[0] - 0.24, low[1], high[0] + 0.24, high[1])
            matrix = toilet.scene_T_object
            taken = affine_transform(beside, [*matrix[0, :2], *matrix[1, :2], *matrix[:2, 3]])
            inside = [r for r in checked.scene.rooms if shapely.Polygon(r.outline_xy).buffer(1e-3).contains(taken)]
            assert inside, checked.scene.scene_id
            wedged = [o.category_name for o in solid if o is not toilet and footprint(o).intersects(taken)]
            assert not wedged, (checked.scene.scene_id, wedged)


def test_offices_are_no_homes(scenes: list[Checked]) -> None:
    for checked in scenes:
        types = [r.room_type for r in checked.scene.rooms]
        names = [o.category_name for o in checked.things]
        if len(types) > 1 and "living" not in types:
            assert not {"shower", "bathtub", "washing_machine", "laundry_basket"} & set(names)
        if types.count("bathroom") == 1 and len(types) > 1:
            assert names.count("washbasin") == 1, checked.scene.scene_id


def test_nothing_stands_below_a_shelf_on_a_wall(scenes: list[Checked]) -> None:
    for checked in scenes:
        standing = [o for o in checked.things if o.box[2] - o.box[5] / 2 < 0.05 and o.category_name not in UNDER]
        for shelf in (o for o in checked.things if o.category_name == "shelf"):
            below = [o.category_name for o in standing if footprint(o).intersects(footprint(shelf).buffer(-2e-3))]
            assert not below, (checked.scene.scene_id, below)


UNDER = ("rug", "desk")  # a work place may have a shelf above it


def footprint(item: SceneObject) -> shapely.Polygon:
    """The convex hull of an object seen from above."""
    flat = np.concatenate([s.vertices[:, :2] for s in item.solids])
    return shapely.MultiPoint(flat).convex_hull


def rectangle_distance(item: SceneObject, xy: np.ndarray) -> float:
    """Distance of a point (2,) from the footprint box of an object."""
    local = np.linalg.inv(item.scene_T_object) @ [*xy, 0.0, 1.0]
    return float(np.hypot(*np.maximum(np.abs(local[:2]) - item.box[3:5] / 2, 0)))


def test_structure_comes_first_and_ids_ascend(scenes: list[Checked]) -> None:
    for checked in scenes:
        objects = checked.scene.objects
        assert [o.object_id for o in objects] == list(range(1, len(objects) + 1))
        groups = [o.category.group == "structure" for o in objects]
        assert groups == sorted(groups, reverse=True)
        assert all(o.movable == (o.category_name in MOVABLE) for o in objects)
        # Furniture stands in the order of the rooms.
        order = [next(k for k, r in enumerate(checked.scene.rooms) if o in checked.of_room(r)) for o in checked.things]
        assert order == sorted(order)


def test_poses_are_quantised(scenes: list[Checked]) -> None:
    for checked in scenes[::5]:
        for item in checked.things:
            assert np.abs(item.scene_T_object[:3, 3] * 1e4 - np.round(item.scene_T_object[:3, 3] * 1e4)).max() < 1e-6
            degrees = np.degrees(item.box[6]) * 100
            assert abs(degrees - round(degrees)) < 1e-6


def test_rooms_hide_space(scenes: list[Checked]) -> None:
    """Large things stand free in many living rooms and studies: their middle is far from every wall."""
    big = ("sofa", "dining_table", "bookshelf", "sideboard", "kitchen_island", "desk", "bed")
    free = [
        any(shapely.Polygon(r.outline_xy).exterior.distance(shapely.Point(o.box[:2])) > 0.6 for o in found)
        for checked in scenes
        for r in checked.scene.rooms
        if r.room_type in ("living", "study", "bedroom", "dining")
        and (found := [o for o in checked.of_room(r) if o.category_name in big])
    ]
    assert np.mean(free) > 0.6


def arrays(scene: Scene) -> list[bytes]:
    poses = [o.scene_T_object.tobytes() for o in scene.objects]
    parts = [p.vertices.tobytes() + bytes(p.colour) + p.texture.encode() for o in scene.objects for p in o.parts]
    return [*poses, *parts, *(r.outline_xy.tobytes() for r in scene.rooms)]


def test_a_scene_is_a_function_of_its_seeds() -> None:
    for build in (room, home):
        first, second = build(1), build(2)
        assert arrays(build(1)) == arrays(first)
        assert arrays(first) != arrays(second)


def test_a_room_of_a_home_does_not_know_the_others() -> None:
    """Furnished alone and in any order, rooms hold what they hold in the home."""
    seeds, config = Seeds(12).child(4), HomeConfig(programmes=(("one_room", 1.0),))
    whole = build_home("s", seeds, config, ("nordic",))
    plan = draw_home_plan(seeds, config)
    style = family("nordic").for_room(seeds.rng("style"))
    styles = [room_style(style, r.room_type, seeds.rng(f"style-{i}")) for i, r in enumerate(plan.rooms)]
    bounds = structure(plan, seeds.child("structure"), style, styles)
    furniture = [o for o in whole.objects if o.category.group != "structure"]
    names = draw_templates(seeds, plan, config.room)
    for i in reversed(range(len(plan.rooms))):
        around = around_room(bounds, plan, i)
        layout = furnish(plan.shell(i), around, names[i], styles[i], seeds.child(f"room-{i}"), config.room)
        own = [o for o in furniture if whole.room_at(o.box[:2]) is whole.rooms[i]]
        assert [item.piece.category_name for item in layout.items] == [o.category_name for o in own]
        origin = layout.shell.origin_xy
        for item, thing in zip(layout.items, own, strict=True):
            assert np.allclose(thing.scene_T_object[:2, 3] - origin, [item.pose.x, item.pose.y], atol=1e-9)


def test_a_tiny_or_greedy_configuration_still_builds() -> None:
    tight = RoomConfig(width_m=(3.0, 3.0), depth_m=(3.0, 3.0), extras=(9, 9), furniture=(20, 20))
    strict = RoomConfig(free_floor_share=0.95, walkable_share=0.7)
    for config in (tight, strict):
        for i in range(2):
            scene = build_scene("s", Seeds(5).child(i), config, COMMON_FAMILIES)
            assert len(scene.objects) >= 7


def test_what_a_recipe_sets_is_what_it_gets() -> None:
    config = RoomConfig(
        width_m=(4.0, 4.0), depth_m=(3.5, 3.5), shapes=(("rectangle", 1.0),), ceiling_m=(2.5, 2.5), clutter_per_top=0.0,
        templates=(("living_wall", 1.0),),
    )  # fmt: skip
    scene = build_scene("s", Seeds(6), config, ("classic",))
    assert sorted(np.ptp(scene.rooms[0].outline_xy, axis=0)) == [3.5, 4.0]
    assert (scene.height_m, scene.style, scene.rooms[0].room_type) == (2.5, "classic", "living")
    table = settings(RoomConfig, {"windows": [1, 1], "templates": [["study_wall", 1.0]]}, "room")
    assert sum(o.category_name == "window" for o in build_scene("s", Seeds(7), table, ("nordic",)).objects) <= 1


def test_dividers_have_their_share() -> None:
    for share in (0.0, 0.4, 1.0):
        weights = dict(divided(RoomConfig().templates, share))
        for kind in ("living", "study", "bedroom"):
            own = {n: w for n, w in weights.items() if TEMPLATES[n].room_type == kind}
            found = sum(w for n, w in own.items() if TEMPLATES[n].divided) / sum(own.values())
            assert found == pytest.approx(share)


def test_novel_templates_are_never_default() -> None:
    assert {name for name, _ in RoomConfig().templates} == set(COMMON_TEMPLATES)
    assert {name for name, _ in HomeConfig().room.templates} == set(COMMON_TEMPLATES)
    assert set(COMMON_TEMPLATES).isdisjoint(NOVEL_TEMPLATES)


def test_impossible_configurations_are_refused() -> None:
    for wrong, message in (
        ({"width_m": (5.0, 4.0)}, "width_m"),
        ({"templates": (("ballroom", 1.0),)}, "ballroom"),
        ({"templates": (("living_wall", 0.0),)}, "positive"),
        ({"templates": ()}, "empty"),
        ({"shapes": (("star", 1.0),)}, "star"),
        ({"depth_m": (0.5, 3.0)}, "1.4 m or more"),
    ):
        with pytest.raises(SchemaError, match=message):
            replace(RoomConfig(), **wrong)
    with pytest.raises(SchemaError, match="style family"):
        build_scene("s", Seeds(0), RoomConfig(), ())
    lone = HomeConfig(room=RoomConfig(templates=(("living_wall", 1.0),)))
    with pytest.raises(SchemaError, match="has none for"):
        build_home("s", Seeds(0), lone, COMMON_FAMILIES)


def test_all_programmes_and_templates_have_their_turn() -> None:
    kinds = {TEMPLATES[n].room_type for n in COMMON_TEMPLATES}
    assert kinds == set(itertools.chain.from_iterable(PROGRAMMES.values()))
    assert kinds == {TEMPLATES[n].room_type for n in NOVEL_TEMPLATES}
