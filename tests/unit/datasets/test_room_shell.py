"""Walls around an outline: their volume is that of the edges less the openings, and rays pass openings alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.datasets.importers.room_shell import THRESHOLD_M, WALL_M, Opening, room_objects, triangulated
from hsbench.errors import DataError
from hsbench.geometry.polygons import contains, signed_area
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.scene import Room, Scene, SceneObject
from hsbench.truth.doorways import doorways
from hsbench.typing import FloatArray

HEIGHT_M = 2.5
L_SHAPE = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 2.0], [2.0, 2.0], [2.0, 4.0], [0.0, 4.0]])


def opening(kind: str, left: tuple[float, float], right: tuple[float, float], low: float, high: float) -> Opening:
    return Opening(kind, np.array(left), np.array(right), low, high)


OPENINGS = (
    opening("door", (1.0, 0.0), (1.9, 0.0), 0.01, 2.0),
    opening("window", (5.02, 0.5), (5.02, 1.5), 0.9, 2.1),
    opening("window", (0.0, 3.0), (0.0, 2.0), 0.8, 1.4),
    opening("window", (0.0, 2.5), (0.0, 1.5), 1.2, 2.0),  # overlaps the one before
    opening("passage", (2.0, 3.0), (2.0, 3.8), 0.0, 2.2),
)


def volume(item: SceneObject) -> float:
    total = 0.0
    for part in item.parts:
        a, b, c = (part.vertices[part.triangles[:, k]] for k in range(3))
        total += float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)
    return total


@st.composite
def polygons(draw: st.DrawFn) -> FloatArray:
    """Simple polygons, star-shaped about the origin, counter-clockwise."""
    count = draw(st.integers(3, 12))
    shares = np.cumsum([draw(st.floats(0.2, 1.0)) for _ in range(count)])
    radii = np.array([draw(st.floats(0.3, 5.0)) for _ in range(count)])
    angles = 2 * np.pi * shares / shares[-1]
    if np.diff(angles, append=angles[0] + 2 * np.pi).max() > 3.0:
        angles = 2 * np.pi * np.arange(count) / count
    return np.round(np.column_stack([np.cos(angles), np.sin(angles)]) * radii[:, None], 4)


@settings(deadline=None, max_examples=60)
@given(outline=polygons(), seed=st.integers(0, 2**16))
def test_triangles_cover_the_outline_once(outline: FloatArray, seed: int) -> None:
    triangles = triangulated(outline)
    assert triangles.shape == (len(outline) - 2, 3)
    areas = [signed_area(outline[t]) for t in triangles]
    assert min(areas) >= 0
    assert np.isclose(sum(areas), signed_area(outline))
    points = np.random.default_rng(seed).uniform(-5, 5, (200, 2))
    held = np.sum([contains(outline[t], points) for t in triangles], axis=0)
    assert np.array_equal(held == 1, contains(outline, points))


def test_straight_corners_are_no_obstacle() -> None:
    outline = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0], [0.0, 2.0]])
    assert np.isclose(sum(signed_area(outline[t]) for t in triangulated(outline)), 4.0)


def test_crossing_outlines_are_refused() -> None:
    with pytest.raises(DataError, match="crosses itself"):
        triangulated(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [1.0, -1.0], [0.0, 3.0]]))


def test_walls_are_the_edges_less_the_openings() -> None:
    objects = room_objects(L_SHAPE, HEIGHT_M, OPENINGS)
    assert [item.object_id for item in objects] == list(range(1, len(objects) + 1))
    kinds = [item.category_name for item in objects]
    assert kinds.count("wall") == 6
    perimeter = np.linalg.norm(np.roll(L_SHAPE, -1, axis=0) - L_SHAPE, axis=1).sum()
    holes = 0.9 * 1.99 + 1.0 * 1.2 + (1.0 * 0.6 + 1.0 * 0.8 - 0.5 * 0.2) + 0.8 * 2.2
    walls = sum(volume(item) for item in objects if item.category_name == "wall")
    assert walls == pytest.approx(WALL_M * (perimeter * HEIGHT_M - holes), rel=1e-9)
    for item in objects:
        points = np.concatenate([apply(item.scene_T_object, part.vertices) for part in item.parts])
        if item.category_name in ("floor", "ceiling"):
            assert np.allclose(points[:, 2], 0.0 if item.category_name == "floor" else HEIGHT_M)
            continue
        middles = [apply(item.scene_T_object, part.vertices).mean(axis=0)[:2] for part in item.parts]
        assert not contains(L_SHAPE, np.array(middles)).any()
        assert points[:, 2].min() >= -THRESHOLD_M
        assert points[:, 2].max() <= HEIGHT_M


def test_doors_and_passages_lead_through_their_walls() -> None:
    scene = Scene("a", (Room("room", L_SHAPE),), HEIGHT_M, room_objects(L_SHAPE, HEIGHT_M, OPENINGS))
    door, passage = doorways(scene)
    assert np.allclose(door.feet, [[1.45, 0.0]])
    assert np.allclose(door.inward, [[0.0, 1.0]])
    assert np.allclose(sorted(door.span_m), [-0.45, 0.45])
    assert np.allclose(passage.feet, [[2.0, 3.4]])
    assert np.allclose(passage.inward, [[-1.0, 0.0]])


def test_no_ray_passes_but_through_an_opening() -> None:
    walls = [item for item in room_objects(L_SHAPE, HEIGHT_M, OPENINGS) if item.category_name == "wall"]
    y, z = np.meshgrid(np.arange(0.05, 4.0, 0.1), np.arange(0.05, HEIGHT_M, 0.1), indexing="ij")
    middle = np.stack([np.full_like(y, -WALL_M / 2), y, z], axis=-1).reshape(-1, 3)  # in the wall at x = 0
    solid = np.zeros(len(middle), dtype=bool)
    for item in walls:
        local = apply(invert(item.scene_T_object), middle)
        for part in item.parts:
            assert part.solid is not None
            solid |= (local @ part.solid.planes[:, :3].T <= part.solid.planes[:, 3]).all(axis=1)
    y, z = middle[:, 1], middle[:, 2]
    opened = ((y > 2) & (y < 3) & (z > 0.8) & (z < 1.4)) | ((y > 1.5) & (y < 2.5) & (z > 1.2) & (z < 2.0))
    assert np.array_equal(solid, ~opened)


@pytest.mark.parametrize(
    ("wrong", "match"),
    [
        (opening("door", (1.0, 1.0), (1.9, 1.0), 0.0, 2.0), "door 1 lies 1.00 m from the nearest wall"),
        (opening("window", (1.0, 0.0), (1.0, 0.0), 0.8, 2.0), "window 1 is 0.000 m wide"),
        (opening("window", (1.0, 0.0), (2.0, 0.0), 3.0, 4.0), "window 1 is 1.000 m wide, 0.000 m high"),
    ],
)
def test_openings_without_a_wall_are_refused(wrong: Opening, match: str) -> None:
    with pytest.raises(DataError, match=match):
        room_objects(L_SHAPE, HEIGHT_M, [wrong])
