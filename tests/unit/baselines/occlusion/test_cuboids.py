"""Rectangles, candidates and boxes of rooms whose voxels are put there by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.aligned import AlignedRoom, Seat, aligned_room
from hsbench.baselines.occlusion.boundary import Boundary, wall_yaw
from hsbench.baselines.occlusion.candidates import candidates, counted, shared, volumes
from hsbench.baselines.occlusion.config import CarveConfig, CuboidConfig
from hsbench.baselines.occlusion.cuboids import cuboids
from hsbench.baselines.occlusion.rectangles import rectangles
from hsbench.geometry.boxes import iou_upright
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import planar
from hsbench.schema.sensor import Sensor

CONFIG = CuboidConfig()
SHAPE = (60, 50, 48)
GRID = VoxelGrid((0.5, -1.0, 0.0), SHAPE)
DESK = ((20, 44), (10, 24), (0, 15))  # 1.2 x .7 x .75 m


def room(*solid: tuple[tuple[int, int], ...], seats: tuple[Seat, ...] = (), yaw_rad: float = 0.3) -> AlignedRoom:
    """Cuboids of seen surface (hidden inside) in a room that is free elsewhere."""
    surface, hidden = np.zeros(SHAPE, dtype=bool), np.zeros(SHAPE, dtype=bool)
    for (x0, x1), (y0, y1), (z0, z1) in solid:
        surface[x0:x1, y0:y1, z0:z1] = True
        hidden[x0 + 1 : x1 - 1, y0 + 1 : y1 - 1, z0 : z1 - 1] = True
    surface &= ~hidden
    none = np.zeros(SHAPE, dtype=bool)
    return AlignedRoom(GRID, planar(0.0, 0.0, yaw_rad), surface, hidden, none, ~(surface | hidden), seats)


def test_a_box_has_a_top_and_four_sides() -> None:
    found = {(r.axis, r.sign): r for r in rectangles(room(DESK), CONFIG)}
    assert set(found) == {(2, 1), (0, 1), (0, -1), (1, 1), (1, -1)}
    assert [found[key].plane for key in ((2, 1), (0, 1), (0, -1), (1, 1), (1, -1))] == [15, 44, 20, 24, 10]
    assert (found[2, 1].span(0), found[2, 1].span(1)) == DESK[:2]
    assert (found[0, 1].span(1), found[0, 1].span(2)) == (DESK[1], DESK[2])
    assert (found[1, -1].span(0), found[1, -1].span(2)) == (DESK[0], DESK[2])


def test_a_desk_is_its_own_best_candidate_and_box() -> None:
    here = room(DESK)
    assert DESK in [tuple(map(tuple, cuboid)) for cuboid in candidates(here, CONFIG).tolist()]
    found = cuboids(here, CONFIG)
    assert found.chosen.tolist()[:1] == [True]
    assert found.chosen.sum() == 1
    middle = planar(0.0, 0.0, 0.3) @ [0.5 + 32 * 0.05, -1.0 + 17 * 0.05, 7.5 * 0.05, 1.0]
    truth = np.array([[*middle[:3], 1.2, 0.7, 0.75, 0.3]])
    assert iou_upright(truth, found.boxes[:1]) == pytest.approx(1.0)


def test_two_pieces_of_furniture_are_two_boxes() -> None:
    found = cuboids(room(DESK, ((5, 13), (34, 46), (0, 30))), CONFIG)
    assert found.chosen.sum() == 2
    assert sorted(np.round(found.boxes[found.chosen, 5], 9)) == [0.75, 1.5]
    assert (np.diff(found.scores) <= 0).all()
    assert ((found.scores >= 0) & (found.scores <= 1)).all()


def test_where_somebody_sat_a_hidden_chair_is_a_candidate() -> None:
    mask = np.zeros(SHAPE[:2], dtype=bool)
    mask[30:40, 20:30] = True
    found = candidates(room(seats=(Seat(mask, 0.45),)), CONFIG).tolist()
    assert [[30, 40], [20, 30], [0, 9]] in found
    assert [[30, 40], [20, 30], [0, 17]] in found


def test_an_empty_room_has_no_box() -> None:
    found = cuboids(room(), CONFIG)
    assert (found.boxes.shape, found.scores.shape, found.gap) == ((0, 7), (0,), 0.0)


@pytest.mark.parametrize("depth_m", [0.0, 3.0])
def test_depth_without_furniture_gives_no_error(depth_m: float) -> None:
    """All depth missing, or one wall that fills the view; nobody there."""
    sensor = Sensor("rgbd", PinholeCamera(64, 48, 45.0, 45.0, 32.0, 24.0), 1.5, 0.0)
    nobody = Activity(np.zeros((0, 2)), np.zeros(0, np.uint8), np.zeros(0))
    boundary = Boundary(0.2, np.array([0.2, -1.5]), np.array([3.0, 1.5]))
    here = aligned_room(sensor, np.full((48, 64), depth_m), boundary, nobody, CarveConfig(), CONFIG)
    assert not (here.surface & here.hidden).any()
    assert not (here.free & (here.surface | here.hidden)).any()
    assert np.isfinite(cuboids(here, CONFIG).boxes).all()


@given(st.integers(0, 2**32 - 1))
def test_counts_by_a_summed_table_are_those_of_slices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    volume = rng.random((9, 8, 7)) < 0.4
    low = rng.integers(0, (9, 8, 7), (12, 3))
    high = low + rng.integers(0, np.array([10, 9, 8]) - low)
    boxes = np.stack([low, high], axis=2)
    inside = [volume[x0:x1, y0:y1, z0:z1] for (x0, x1), (y0, y1), (z0, z1) in boxes]
    assert counted(volume, boxes).tolist() == [part.sum() for part in inside]
    assert volumes(boxes).tolist() == [part.size for part in inside]
    marks = np.zeros((12, 9, 8, 7), dtype=bool)
    for mark, ((x0, x1), (y0, y1), (z0, z1)) in zip(marks, boxes, strict=True):
        mark[x0:x1, y0:y1, z0:z1] = True
    flat = marks.reshape(12, -1).astype(int)
    assert np.array_equal(shared(boxes), flat @ flat.T)


@given(st.floats(-np.pi, np.pi), st.floats(2.0, 6.0), st.floats(2.0, 6.0), st.integers(0, 2**32 - 1))
def test_the_walls_of_a_rectangle_tell_its_yaw_through_noise(
    yaw: float, length: float, width: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    side, along = rng.integers(0, 4, 6000), rng.uniform(-0.5, 0.5, 6000)
    x = np.where(side < 2, (side - 0.5) * length, along * length)
    y = np.where(side < 2, along * width, (side - 2.5) * width)
    noisy = np.c_[x, y, rng.uniform(0.3, 2.3, 6000)] + rng.normal(0.0, 0.01, (6000, 3))
    c, s = np.cos(yaw), np.sin(yaw)
    found = wall_yaw(noisy @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    off = (np.rad2deg(found - yaw) + 45.0) % 90.0 - 45.0
    assert abs(off) <= 1.0
