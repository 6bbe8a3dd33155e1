from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from hsbench.geometry.footprints import boundary_loops, hull, smallest_yaw
from hsbench.geometry.polygons import rectangle, signed_area
from hsbench.geometry.triangle_meshes import weld


@pytest.mark.parametrize("seed", range(10))
def test_the_hull_is_scipys(seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(60, 2)).round(1 + seed % 4)  # with doubles and collinear points
    ours, other = hull(points), ConvexHull(points)
    assert signed_area(ours) == pytest.approx(other.volume, rel=1e-12)
    assert sorted(map(tuple, ours)) == sorted(map(tuple, points[other.vertices]))


def test_hulls_of_next_to_nothing() -> None:
    assert hull(np.array([[1.0, 2.0]] * 3)).tolist() == [[1.0, 2.0]]
    assert len(hull(np.array([[0.0, 0], [1, 1], [2, 2], [3, 3]]))) == 2


@settings(max_examples=60, deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(0.3, 2.0), st.floats(1.1, 3.0), st.integers(0, 3))
def test_a_rectangle_has_its_own_yaw_whatever_lies_inside(yaw: float, width: float, ratio: float, turns: int) -> None:
    yaw = math.radians(round(math.degrees(yaw), 2))
    corners = rectangle(np.array([3.0, -1.0]), np.array([width * ratio, width]) / 2, yaw)
    inner = corners[[0, 1]].mean(axis=0) * 0.3 + corners[[2, 3]].mean(axis=0) * 0.7
    guess = yaw + turns * math.pi / 2 + 0.3
    found = smallest_yaw(np.concatenate([corners, inner[None]]), guess)
    assert found == pytest.approx(yaw + turns * math.pi / 2, abs=math.radians(0.011))


@pytest.mark.parametrize("seed", range(6))
def test_no_yaw_gives_a_clearly_smaller_rectangle(seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(9, 2)) * [2, 1]

    def area(yaw: float) -> float:
        c, s = math.cos(yaw), math.sin(yaw)
        return float(np.prod(np.ptp(points @ np.array([[c, -s], [s, c]]), axis=0)))

    best = min(area(yaw) for yaw in np.linspace(0, math.pi / 2, 3000))
    assert area(smallest_yaw(points, 0.4)) <= best * 1.006


def test_a_round_thing_keeps_the_yaw_it_has() -> None:
    angles = np.arange(64) * 2 * math.pi / 64
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    for yaw in (0.0, 0.5, -1.2):
        assert smallest_yaw(circle, yaw) == pytest.approx(yaw, abs=math.radians(0.006))


def grid_of(cells: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Unit squares where the drawing has an x, two triangles each, welded; row 0 is the lowest."""
    index: dict[tuple[int, int], int] = {}
    triangles = []
    for j, row in enumerate(cells):
        for i, mark in enumerate(row):
            if mark == "x":
                a, b, c, d = (index.setdefault(p, len(index)) for p in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
                triangles += [(a, b, c), (a, c, d)]
    return np.array([[*p, 0.0] for p in index]), np.array(triangles, np.int32)


def test_the_outline_of_an_l() -> None:
    (outline,) = boundary_loops(*grid_of(["xxx", "x  ", "x  "]))
    corners = {(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)}
    assert set(map(tuple, outline.astype(int))) == corners
    assert len(outline) == 6
    assert signed_area(outline) == pytest.approx(5.0)


def test_holes_run_the_other_way_and_pieces_come_by_size() -> None:
    loops = boundary_loops(*grid_of(["xxx xx", "x x xx", "xxx   "]))
    assert [signed_area(loop) for loop in loops] == pytest.approx([9.0, 4.0, -1.0])
    assert all(len(loop) == 4 for loop in loops)


def test_sides_that_lie_on_each_other_are_no_boundary() -> None:
    """A wide rectangle, a narrow one on it, none of their corners shared but one."""
    points = np.array(
        [[0, 0], [4, 0], [4, 2], [0, 2], [0, 2], [2, 2], [2, 4], [0, 4], [2.5, 2], [3.5, 2], [3.5, 3], [2.5, 3]]
    )
    triangles = np.array([[a, a + b, a + b + 1] for a in (0, 4, 8) for b in (1, 2)], np.int32)
    vertices, triangles = weld(np.pad(points.astype(float), ((0, 0), (0, 1))), triangles)
    (outline,) = boundary_loops(vertices, triangles)
    assert signed_area(outline) == pytest.approx(8 + 4 + 1)
    assert len(outline) == 10


def test_an_outline_that_touches_itself_is_left_out() -> None:
    assert boundary_loops(*grid_of(["x ", " x"])) == []
    assert boundary_loops(np.empty((0, 3)), np.empty((0, 3), np.int32)) == []
