"""Walkable cells against a closed form (Minkowski sum), a brute-force reference and hand-drawn connections."""

from __future__ import annotations

import time

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid, box, cylinder, frustum, span
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.truth.walkable import WalkMap, connected, connected_to_doors, door_entries, walk_map

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


def test_meshes_are_refused() -> None:
    mesh = (np.eye(3), np.array([[0, 1, 2]], dtype=np.int32))
    item = SceneObject(1, "sofa", np.eye(4), (Part("body", (1, 2, 3), mesh=mesh),))
    with pytest.raises(SchemaError, match="mesh parts"):
        walk_map(Scene("s", (Room("living", ROOM),), 2.5, (item,)))


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
