"""The guarantees of a generated room, checked from the finished scene alone, over 200 seeds and every template."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid, span
from hsbench.geometry.polygons import contains
from hsbench.schema.scene import Scene, SceneObject
from hsbench.synth.furniture import COMMON_FAMILIES, MOVABLE, NOVEL_FAMILIES, WALL_HUNG
from hsbench.synth.rooms import COMMON_TEMPLATES, NOVEL_TEMPLATES, TEMPLATES, RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.truth.walkable import connected_to_doors, walk_map

SEEDS = 200
TOUCH_M = 1e-3
NAMES = (*COMMON_TEMPLATES, *NOVEL_TEMPLATES)
OPENING = ("door", "drawer", "front", "handle")


def room(index: int) -> Scene:
    """Scene of one seed; templates take turns, novel ones with novel styles."""
    name = NAMES[index % len(NAMES)]
    families = NOVEL_FAMILIES if TEMPLATES[name].novel else COMMON_FAMILIES
    return build_scene(f"room-{index}", Seeds(11).child(index), RoomConfig(templates=((name, 1.0),)), families)


@pytest.fixture(scope="module")
def rooms() -> list[Scene]:
    return [room(i) for i in range(SEEDS)]


def furniture(scene: Scene) -> list[SceneObject]:
    return [o for o in scene.objects if o.category.group != "structure"]


def bounds(item: SceneObject) -> np.ndarray:
    return np.stack([item.vertices.min(axis=0), item.vertices.max(axis=0)])


def ball_in_both(a: ConvexSolid, b: ConvexSolid) -> float:
    """Radius of the largest ball inside both solids, 0 if they do not overlap (linear programme)."""
    for one, other in ((a, b), (b, a)):
        if ((other.vertices @ one.planes[:, :3].T).min(axis=0) >= one.planes[:, 3] - 1e-9).any():
            return 0.0
    planes = np.concatenate([a.planes, b.planes])
    rows = np.column_stack([planes[:, :3], np.ones(len(planes))])
    found = linprog([0, 0, 0, -1], A_ub=rows, b_ub=planes[:, 3], bounds=[(None, None)] * 3 + [(0, None)])
    return float(found.x[3]) if found.status == 0 else 0.0


def test_no_two_objects_interpenetrate(rooms: list[Scene]) -> None:
    for scene in rooms:
        boxes = [bounds(o) for o in scene.objects]
        for i, j in itertools.combinations(range(len(boxes)), 2):
            overlap = np.minimum(boxes[i][1], boxes[j][1]) - np.maximum(boxes[i][0], boxes[j][0])
            if (overlap <= TOUCH_M).any():
                continue
            for a, b in itertools.product(scene.objects[i].solids, scene.objects[j].solids):
                shared = np.minimum(a.bounds[1], b.bounds[1]) - np.maximum(a.bounds[0], b.bounds[0])
                if (shared > TOUCH_M).all():
                    names = f"{scene.scene_id}: {scene.objects[i].category_name} and {scene.objects[j].category_name}"
                    assert 2 * ball_in_both(a, b) <= TOUCH_M, names


def test_nothing_floats_and_nothing_is_outside(rooms: list[Scene]) -> None:
    for scene in rooms:
        things = furniture(scene)
        for item in things:
            low, high = bounds(item)
            assert low[2] >= -1e-9
            assert high[2] <= scene.height_m
            assert low[:2].min() >= -1e-9
            assert (high[:2] <= scene.room_xy.max(axis=0) + 1e-9).all()
            if low[2] <= 0.01:
                continue
            if item.category_name in WALL_HUNG:
                behind = item.scene_T_object[:2, :2] @ [0.0, 1.0]
                assert distance_to_wall(scene, item.vertices[:, :2]) <= 0.021, "hangs on a wall"
                assert (behind @ (scene.room_xy.mean(axis=0) - item.box[:2])) < 0, "with its back to it"
                continue
            below = [o for o in things if o is not item and abs(bounds(o)[1, 2] - low[2]) <= 0.01]
            tops = [s for o in things if o is not item for s in o.solids if abs(s.bounds[1, 2] - low[2]) <= 0.01]
            feet = item.vertices[item.vertices[:, 2] <= low[2] + 1e-6][:, :2]
            held = np.any([inside_shadow(s, feet) for s in tops], axis=0) if tops else np.zeros(1, bool)
            assert held.all(), f"{scene.scene_id}: {item.category_name} at {low[2]:.3f} m, {len(below)} supports"


def inside_shadow(solid: ConvexSolid, xy: np.ndarray) -> np.ndarray:
    """(n, 2) -> (n,) bool: above the top of a solid."""
    hull = ConvexHull(solid.vertices[np.isclose(solid.vertices[:, 2], solid.bounds[1, 2])][:, :2])
    return np.asarray((xy @ hull.equations[:, :2].T + hull.equations[:, 2] <= 1e-6).all(axis=1))


def distance_to_wall(scene: Scene, xy: np.ndarray) -> float:
    low, high = scene.room_xy.min(axis=0), scene.room_xy.max(axis=0)
    return float(min((xy - low).min(), (high - xy).min()))


def test_the_door_is_free(rooms: list[Scene]) -> None:
    for scene in rooms:
        (door,) = [o for o in scene.objects if o.category_name == "door"]
        leaf = next(p for p in door.parts if p.role == "door").vertices
        y = next(p for p in door.parts if p.name == "jamb").vertices[:, 1].min()  # the inner face of the wall
        zone = span((leaf[:, 0].min(), y - 0.9, 0.0), (leaf[:, 0].max(), y, 2.0)).transformed(door.scene_T_object)
        for item in furniture(scene):
            deepest = max(ball_in_both(zone, solid) for solid in item.solids)
            assert 2 * deepest <= TOUCH_M, f"{scene.scene_id}: {item.category_name}"


def test_windows_are_not_hidden(rooms: list[Scene]) -> None:
    for scene in rooms:
        for window in (o for o in scene.objects if o.category_name == "window"):
            pane = next(p for p in window.parts if p.name == "pane").vertices
            inverse = np.linalg.inv(window.scene_T_object)
            for item in furniture(scene):
                local = item.vertices @ inverse[:3, :3].T + inverse[:3, 3]
                covers = (
                    local[:, 0].max() > pane[:, 0].min()
                    and local[:, 0].min() < pane[:, 0].max()
                    and local[:, 1].max() > pane[:, 1].min() - 0.4
                )
                assert not covers or local[:, 2].max() <= pane[:, 2].min(), f"{scene.scene_id}: {item.category_name}"


def nearest_walkable(scene: Scene, points: np.ndarray) -> np.ndarray:
    """(n, 2) -> (n,) distance to the nearest cell centre that is connected to the door."""
    walk = walk_map(scene)
    cells = walk.centres()[connected_to_doors(walk, scene)]
    return np.linalg.norm(points[:, None] - cells[None], axis=-1).min(axis=1)


def middles(item: SceneObject, roles: tuple[str, ...]) -> np.ndarray:
    found = [s for s, p in zip(item.solids, item.parts, strict=True) if p.role in roles]
    return np.array([s.bounds.mean(axis=0)[:2] for s in found]).reshape(-1, 2)


def test_seats_beds_and_cupboards_are_reached(rooms: list[Scene]) -> None:
    for scene in rooms:
        for item in furniture(scene):
            seats, opening = middles(item, ("seat",)), middles(item, OPENING)
            if len(seats):
                assert nearest_walkable(scene, seats).max() <= 0.7, f"{scene.scene_id}: {item.category_name}"
            if len(opening):
                assert nearest_walkable(scene, opening).min() <= 0.75, f"{scene.scene_id}: {item.category_name}"
            if item.category_name == "bed":
                edge = [s.vertices[:, :2] for s, p in zip(item.solids, item.parts, strict=True) if p.role == "mattress"]
                assert nearest_walkable(scene, np.concatenate(edge)).min() <= 0.7


def test_the_floor_is_free_and_connected(rooms: list[Scene]) -> None:
    config = RoomConfig()
    for scene in rooms:
        walk = walk_map(scene)
        reached = connected_to_doors(walk, scene)
        area = float(np.prod(scene.room_xy.max(axis=0)))
        assert (walk.free & ~reached).sum() * walk.cell_m**2 <= config.pocket_m2
        assert reached.sum() * walk.cell_m**2 >= config.walkable_share * area
        assert ndimage.label(reached)[1] == 1
        centres = walk.centres()
        inside = contains(scene.room_xy, centres)
        covered = np.zeros(inside.shape, dtype=bool)
        for item in furniture(scene):
            for solid in item.solids:
                if solid.bounds[1, 2] > 0.02 and solid.bounds[0, 2] < 1.8:
                    hull = ConvexHull(solid.vertices[:, :2])
                    covered |= (centres @ hull.equations[:, :2].T + hull.equations[:, 2] <= 0).all(axis=-1)
        assert (inside & ~covered).sum() / inside.sum() >= 0.35


def test_rooms_are_furnished(rooms: list[Scene]) -> None:
    for scene in rooms:
        count = sum(o.category.group == "furniture" for o in scene.objects)
        assert 6 <= count <= 20, f"{scene.scene_id} holds {count}"
    assert {s.room_type for s in rooms} == {"living", "bedroom", "study", "dining"}
    expected = {"living": "sofa", "bedroom": "bed", "study": "desk", "dining": "dining_table"}
    for kind, wanted in expected.items():
        having = [any(o.category_name == wanted for o in s.objects) for s in rooms if s.room_type == kind]
        assert np.mean(having) >= 0.9, kind


def test_seats_at_tables_face_them(rooms: list[Scene]) -> None:
    for scene in rooms:
        tables = [o for o in scene.objects if o.category_name in ("dining_table", "desk")]
        for chair in (o for o in scene.objects if o.category_name in ("chair", "office_chair")):
            forward = chair.scene_T_object[:2, :2] @ [0.0, -1.0]
            front = chair.box[:2] + forward * chair.box[4] / 2
            gaps = [rectangle_distance(t, front) for t in tables]
            assert min(gaps) <= 0.3, f"{scene.scene_id}: a chair {min(gaps):.2f} m from any table"
            table = tables[int(np.argmin(gaps))]
            assert rectangle_distance(table, front + 0.3 * forward) <= 0.1, "it looks at the table"


def rectangle_distance(item: SceneObject, xy: np.ndarray) -> float:
    """Distance of a point (2,) from the footprint box of an object."""
    local = np.linalg.inv(item.scene_T_object) @ [*xy, 0.0, 1.0]
    return float(np.hypot(*np.maximum(np.abs(local[:2]) - item.box[3:5] / 2, 0)))


def test_televisions_face_their_sofa(rooms: list[Scene]) -> None:
    checked = 0
    for scene in rooms:
        for tv in (o for o in scene.objects if o.category_name == "television"):
            towards = scene.room_xy.mean(axis=0) - tv.box[:2]
            assert tv.scene_T_object[:2, :2] @ [0.0, -1.0] @ towards > 0
            sofas = [o for o in scene.objects if o.category_name == "sofa"]
            facing = [s.scene_T_object[:2, :2] @ [0.0, -1.0] @ (tv.box[:2] - s.box[:2]) for s in sofas]
            assert max(facing) > 1.0
            checked += 1
    assert checked > 20


def test_rooms_hide_space(rooms: list[Scene]) -> None:
    """Large things stand free in many rooms: their middle is far from every wall."""
    big = ("sofa", "dining_table", "bookshelf", "sideboard", "kitchen_island", "desk", "bed")
    free = [
        any(o.category_name in big and distance_to_wall(scene, o.box[None, :2]) > 0.6 for o in scene.objects)
        for scene in rooms
    ]
    assert np.mean(free) > 0.6


def test_no_ray_leaves_the_room(rooms: list[Scene]) -> None:
    rng = np.random.default_rng(4)
    for scene in rooms[::8]:
        shell = [s for o in scene.objects if o.category.group == "structure" for s in o.solids]
        start = np.array([*scene.room_xy.mean(axis=0), 1.3])
        directions = rng.normal(size=(1500, 3))
        corners = np.array([[x, y, z] for x, y in scene.room_xy for z in (0.0, scene.height_m)])
        seams = np.concatenate([s.vertices for s in shell])
        directions = np.concatenate([directions, corners - start, seams - start])
        directions = np.concatenate([directions, directions + rng.normal(scale=1e-4, size=directions.shape)])
        hit = np.zeros(len(directions), dtype=bool)
        for solid in shell:
            slope, rest = directions @ solid.planes[:, :3].T, solid.planes[:, 3] - solid.planes[:, :3] @ start
            with np.errstate(divide="ignore", invalid="ignore"):
                t = rest / slope
            enter = np.where(slope < -1e-12, t, -np.inf).max(axis=1)
            leave = np.where(slope > 1e-12, t, np.inf).min(axis=1)
            parallel_out = ((np.abs(slope) <= 1e-12) & (rest < 0)).any(axis=1)
            hit |= (enter <= leave + 1e-9) & (leave > 0) & ~parallel_out
        assert hit.all(), scene.scene_id


def test_structure_is_complete(rooms: list[Scene]) -> None:
    for scene in rooms:
        names = [o.category_name for o in scene.objects]
        assert names[:7] == ["floor", "ceiling", "wall", "wall", "wall", "wall", "door"]
        assert 1 <= names.count("window") <= 2
        assert [o.object_id for o in scene.objects] == list(range(1, len(names) + 1))
        assert all(o.movable == (o.category_name in MOVABLE) for o in scene.objects)
        w, d = scene.room_xy.max(axis=0)
        assert 3.6 <= w <= 6.0
        assert 3.4 <= d <= 5.4
        assert 2.4 <= scene.height_m <= 2.8


def arrays(scene: Scene) -> list[bytes]:
    poses = [o.scene_T_object.tobytes() for o in scene.objects]
    return poses + [p.vertices.tobytes() + bytes(p.colour) for o in scene.objects for p in o.parts]


def test_a_scene_is_a_function_of_its_seeds() -> None:
    for index in (0, 5, 10, 15):
        assert arrays(room(index)) == arrays(room(index))
    assert arrays(room(0)) != arrays(room(17))


def test_poses_are_quantised(rooms: list[Scene]) -> None:
    for scene in rooms[:20]:
        for item in furniture(scene):
            x, y, z = item.scene_T_object[:3, 3] * 1e4
            assert max(abs(v - round(v)) for v in (x, y, z)) < 1e-6
            degrees = np.degrees(item.box[6]) * 100
            assert abs(degrees - round(degrees)) < 1e-6


def test_a_tiny_or_greedy_configuration_still_builds() -> None:
    tight = RoomConfig(width_m=(3.0, 3.0), depth_m=(3.0, 3.0), extras=(9, 9), furniture=(20, 20))
    strict = RoomConfig(free_floor_share=0.95, walkable_share=0.7)
    for config in (tight, strict):
        for i in range(5):
            scene = build_scene("s", Seeds(5).child(i), config, COMMON_FAMILIES)
            assert len(scene.objects) >= 7


def test_novel_templates_are_never_default() -> None:
    assert {name for name, _ in RoomConfig().templates} == set(COMMON_TEMPLATES)
    assert set(COMMON_TEMPLATES).isdisjoint(NOVEL_TEMPLATES)


def test_impossible_configurations_are_refused() -> None:
    with pytest.raises(SchemaError, match="width_m"):
        RoomConfig(width_m=(5.0, 4.0))
    with pytest.raises(SchemaError, match="ballroom"):
        RoomConfig(templates=(("ballroom", 1.0),))
    with pytest.raises(SchemaError, match="positive"):
        RoomConfig(templates=(("living_wall", 0.0),))
    with pytest.raises(SchemaError, match="empty"):
        RoomConfig(templates=())
    with pytest.raises(SchemaError, match="3 m or more"):
        replace(RoomConfig(), depth_m=(2.0, 3.0))
    with pytest.raises(SchemaError, match="style family"):
        build_scene("s", Seeds(0), RoomConfig(), ())
