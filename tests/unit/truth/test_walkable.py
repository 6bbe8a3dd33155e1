"""Walkable cells against a closed form (Minkowski sum), a brute-force reference and hand-drawn connections."""

from __future__ import annotations

import time

import numpy as np
import pytest
import shapely
from shapely import affinity

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid, box, cylinder, frustum, span
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.truth.doorways import doorways
from hsbench.truth.walkable import (
    WalkMap,
    blocked,
    connected,
    connected_to_doors,
    door_entries,
    nearest_free_cell,
    shaded,
    shadows,
    walk_map,
)

ROOM = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])


def scene_of(*solids: ConvexSolid, room_xy: np.ndarray = ROOM, category: str = "sideboard") -> Scene:
    objects = tuple(
        SceneObject(i + 1, category, np.eye(4), (Part("body", (90, 90, 90), solid=solid),))
        for i, solid in enumerate(solids)
    )
    return Scene("s", (Room("living", room_xy),), 2.5, objects)


def minkowski(centres: np.ndarray, low: tuple[float, float], high: tuple[float, float], radius: float) -> np.ndarray:
    """Rectangle grown by a disc: distance to the rectangle at most the radius."""
    beyond = np.maximum(np.maximum(np.array(low) - centres, centres - np.array(high)), 0)
    return np.hypot(beyond[..., 0], beyond[..., 1]) <= radius


def test_empty_room_is_the_outline_shrunk_by_the_radius() -> None:
    walk = walk_map(scene_of())
    x, y = np.moveaxis(walk.centres(), -1, 0)
    assert np.array_equal(walk.free, (x > 0.25) & (x < 3.75) & (y > 0.25) & (y < 2.75))
    assert walk.free.shape == (80, 60)


def test_square_obstacle_is_the_minkowski_sum() -> None:
    walk = walk_map(scene_of(span((1.51, 1.22, 0.0), (2.13, 1.71, 0.8))))
    room = walk_map(scene_of()).free
    assert np.array_equal(walk.free, room & ~minkowski(walk.centres(), (1.51, 1.22), (2.13, 1.71), 0.25))


def test_only_what_a_body_can_hit_blocks() -> None:
    room = walk_map(scene_of()).free
    rug, lamp = span((1, 1, 0), (3, 2, 0.02)), span((1, 1, 1.8), (3, 2, 2.2))
    assert np.array_equal(walk_map(scene_of(rug, lamp)).free, room)
    assert walk_map(scene_of(span((1, 1, 0), (3, 2, 0.03)))).free.sum() < room.sum()
    assert walk_map(scene_of(span((1, 1, 1.79), (3, 2, 2.2)))).free.sum() < room.sum()


def test_a_cone_blocks_by_its_slice_within_the_range() -> None:
    outline = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    middle = np.array([2.0, 1.5])
    roof = frustum(outline * 0.1 + middle, outline + middle, 0.0, 3.6)  # at 1.8 m half-way: half width .55
    walk = walk_map(scene_of(roof))
    expected = walk_map(scene_of()).free & ~minkowski(walk.centres(), (1.45, 0.95), (2.55, 2.05), 0.25)
    assert np.array_equal(walk.free, expected)


def test_agrees_with_dense_sampling_of_turned_solids() -> None:
    rng = np.random.default_rng(5)
    solids = [
        box(rng.uniform(0.1, 0.8, 3)).transformed(
            planar(rng.uniform(0.5, 3.5), rng.uniform(0.5, 2.5), rng.uniform(0, 6), rng.uniform(0, 1.9))
        )
        for _ in range(12)
    ] + [cylinder(0.3, 0.0, 1.0, (1.0, 2.0), top_radius_m=0.05)]
    walk = walk_map(scene_of(*solids))
    room = walk_map(scene_of()).free
    # Points of the body: discs at many heights, densely; the reference errs only within the sampling step.
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    ring = np.concatenate([r * np.column_stack([np.cos(angle), np.sin(angle)]) for r in np.linspace(0, 1, 14)])
    heights = np.linspace(0.0201, 1.7999, 40)

    def hit(xy: np.ndarray, radius: float) -> bool:
        body = np.concatenate([np.column_stack([xy + radius * ring, np.full(len(ring), z)]) for z in heights])
        return any(solid.contains(body).any() for solid in solids)

    centres = walk.centres()
    for i in range(6, 74, 6):
        for j in range(6, 54, 6):
            if not room[i, j]:
                continue
            if hit(centres[i, j], 0.25):
                assert not walk.free[i, j]
            if not hit(centres[i, j], 0.29):
                assert walk.free[i, j]


def test_a_room_with_a_corner_cut_out() -> None:
    outline = np.array([[0, 0], [4, 0], [4, 1.5], [2, 1.5], [2, 3], [0, 3.0]])
    walk = walk_map(scene_of(room_xy=outline))
    centres = walk.centres()
    block = minkowski(centres, (2.0, 1.5), (9.0, 9.0), 0.25)
    assert np.array_equal(walk.free, walk_map(scene_of()).free & ~block)


def test_cells_are_aligned_in_any_frame() -> None:
    moved = scene_of().moved(planar(-1.237, 0.511, 0.3))
    origin = walk_map(moved).origin_xy / 0.05
    assert np.allclose(origin, np.round(origin))


def test_connection_stops_at_a_barrier() -> None:
    walk = walk_map(scene_of(span((1.9, 0.0, 0.0), (2.1, 3.0, 1.0))))
    left = connected(walk, np.array([0.5, 1.5]))
    x = walk.centres()[..., 0]
    assert np.array_equal(left, walk.free & (x < 2))
    assert left.any()
    assert not connected(walk, np.array([-3.0, 1.5])).any()


def test_connection_from_the_door() -> None:
    wall = span((1.9, 0.0, 0.0), (2.1, 3.0, 1.0))
    scene = scene_of(wall)
    leaf = Part("leaf", (200, 200, 200), "door", box((0.9, 0.05, 2.0), (0.0, 0.0, 1.0)))
    door = SceneObject(9, "door", planar(4.05, 1.0, -np.pi / 2), (leaf,))
    scene = Scene("s", (Room("living", ROOM),), 2.5, (*scene.objects, door))
    assert np.allclose(door_entries(scene), [[3.7, 1.0]])
    walk = walk_map(scene)
    assert np.array_equal(connected_to_doors(walk, scene), walk.free & (walk.centres()[..., 0] > 2))


WEST, EAST = Room("living", ROOM), Room("bedroom", ROOM + [4.2, 0.0])  # .2 m of wall between them, x 4 to 4.2
TURN = planar(-1.31, 0.77, 0.41)


def framed(number: int, x: float, y: float, yaw: float, *more: Part, name: str = "door") -> SceneObject:
    """A doorway .9 m wide and .2 m deep, its origin on the face of the wall in front: its head, and more."""
    head = Part("head", (200, 200, 200), None, span((-0.45, 0.0, 2.0), (0.45, 0.2, 2.1)))
    return SceneObject(number, name, planar(x, y, yaw), (head, *more))


def flat(*ways: SceneObject) -> Scene:
    return Scene("s", (WEST, EAST), 2.5, ways)


LEAF = Part("leaf", (200, 200, 200), "door", span((-0.45, 0.0, 0.0), (0.45, 0.04, 2.0)))
OPEN_LEAF = Part("leaf", (200, 200, 200), "door", span((0.41, -0.9, 0.0), (0.45, 0.0, 2.0)))
THROUGH = -np.pi / 2  # yaw of a door in the wall between the rooms whose front, -y, is the western one


@pytest.mark.parametrize("turned", [False, True])
def test_a_doorway_joins_two_rooms(turned: bool) -> None:
    scene = flat(framed(1, 4.0, 1.3, THROUGH, name="passage"))
    floor = shapely.union_all(
        [shapely.Polygon(ROOM), shapely.Polygon(EAST.outline_xy), shapely.box(4, 0.85, 4.2, 1.75)]
    )
    if turned:
        scene = scene.moved(TURN)
        floor = affinity.affine_transform(floor, [*TURN[:2, :2].ravel(), *TURN[:2, 3]])
    walk = walk_map(scene)
    centres = shapely.points(walk.centres())
    expected = floor.contains(centres) & (floor.boundary.distance(centres) > 0.25)
    differing = walk.free != expected
    assert (np.abs(floor.boundary.distance(centres[differing]) - 0.25) < 1e-6).all()
    assert walk.free.any()
    assert not connected_to_doors(walk, scene).any(), "a passage alone lets nobody in"
    entrance = framed(2, 8.2, 1.3, THROUGH, LEAF)
    home = Scene("s", scene.rooms, 2.5, (scene.objects[0], entrance.moved(TURN) if turned else entrance))
    assert np.array_equal(connected_to_doors(walk, home), walk.free), "through the passage"


def test_a_leaf_closes_a_doorway_until_it_stands_open() -> None:
    closed, ajar = flat(framed(1, 4.0, 1.3, THROUGH, LEAF)), flat(framed(1, 4.0, 1.3, THROUGH, OPEN_LEAF))
    for scene, joined in ((closed, False), (ajar, True)):
        walk = walk_map(scene)
        west = connected(walk, np.array([1.0, 2.0]))
        assert west[walk.centres()[..., 0] < 3.0].any()
        assert west[walk.centres()[..., 0] > 5.0].any() == joined
        # A closed door leads into both rooms all the same.
        assert np.array_equal(connected_to_doors(walk, scene), walk.free)


def test_entries_lie_on_each_side_of_a_doorway() -> None:
    entrance = framed(2, 0.0, 2.0, np.pi / 2, LEAF)  # its front looks east, into the room
    scene = flat(framed(1, 4.0, 1.3, THROUGH, OPEN_LEAF), entrance)
    expected = np.array([[3.7, 1.3], [4.5, 1.3], [0.3, 2.0]])
    assert np.allclose(door_entries(scene), expected)
    inner, outer = doorways(scene)
    assert (inner.object_id, inner.rooms, outer.rooms) == (1, (0, 1), (0,))
    assert np.allclose(inner.feet, [[4.0, 1.3], [4.2, 1.3]])
    moved = doorways(scene.moved(TURN))[0]
    assert np.allclose(moved.feet, inner.feet @ TURN[:2, :2].T + TURN[:2, 3])
    assert np.allclose(moved.inward, inner.inward @ TURN[:2, :2].T)


def test_a_doorway_is_found_whichever_of_its_axes_leads_through() -> None:
    along = SceneObject(1, "door", planar(4.1, 1.3, 0.0), (Part("leaf", (1, 2, 3), None, box((0.2, 0.9, 2.0))),))
    (way,) = doorways(flat(along))
    assert sorted(way.rooms) == [0, 1]
    far = SceneObject(2, "door", planar(-2.0, 1.3, 0.0), (LEAF,))
    assert doorways(flat(far)) == []
    assert door_entries(flat(far)).shape == (0, 2)


def test_a_room_round_the_corner_is_not_behind_a_door() -> None:
    # The door is .2 m from the wall of a third room, which it does not lead into.
    third = Room("study", np.array([[0.0, 3.2], [8.2, 3.2], [8.2, 6.0], [0.0, 6.0]]))
    scene = Scene("s", (WEST, EAST, third), 2.5, (framed(1, 4.0, 2.5, THROUGH, OPEN_LEAF),))
    assert doorways(scene)[0].rooms == (0, 1)


def test_the_nearest_free_cell() -> None:
    walk = walk_map(scene_of())
    rng = np.random.default_rng(3)
    for xy in rng.uniform((-0.6, -0.6), (4.6, 3.6), (200, 2)):
        away = np.linalg.norm(walk.centres() - xy, axis=-1)
        away[~walk.free] = np.inf
        best = np.unravel_index(int(np.argmin(away)), away.shape)
        assert nearest_free_cell(walk, xy) == (best if away[best] <= 0.5 else None)


def test_shadows_of_many_solids_are_those_of_each() -> None:
    rng = np.random.default_rng(8)
    solids = [
        box(rng.uniform(0.05, 0.9, 3)).transformed(planar(*rng.uniform(0, 4, 2), rng.uniform(0, 6), rng.uniform(0, 2)))
        for _ in range(30)
    ]
    walk = walk_map(scene_of())
    one_by_one = walk
    for solid in solids:
        one_by_one = blocked(one_by_one, [solid])
    assert np.array_equal(shaded(walk, shadows(solids)).free, one_by_one.free)
    assert np.array_equal(shaded(walk, shadows([])).free, walk.free)


def test_an_impossible_map_cannot_be_built() -> None:
    with pytest.raises(SchemaError, match="origin_xy"):
        WalkMap(np.zeros(3), np.zeros((2, 2), dtype=bool))
    with pytest.raises(SchemaError, match="bool"):
        WalkMap(np.zeros(2), np.zeros((2, 2)))  # type: ignore[arg-type]
    with pytest.raises(SchemaError, match="cell_m"):
        WalkMap(np.zeros(2), np.zeros((2, 2), dtype=bool), 0.0)


def test_a_furnished_room_takes_little_time() -> None:
    rng = np.random.default_rng(1)
    solids = [
        box(rng.uniform(0.02, 0.6, 3), (rng.uniform(0, 4), rng.uniform(0, 3), rng.uniform(0, 2))) for _ in range(400)
    ]
    scene = scene_of(*solids)
    walk_map(scene)
    start = time.perf_counter()
    walk_map(scene)
    assert time.perf_counter() - start < 0.25  # 50 ms on a free core; the margin is for busy machines
