"""Carving on hand-made rooms: what a body frees, to which height, and what stays."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.carve import activity_maps, carve, fill_holes, seats, voxel_states
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import Action, VoxelState

CONFIG = CarveConfig()
GRID = VoxelGrid((0.0, -1.0, 0.0), (40, 40, 48), 0.05)
X, Y = np.meshgrid(GRID.axis_centres(0), GRID.axis_centres(1), indexing="ij")
Z = GRID.axis_centres(2)
OCCLUDED = np.full(GRID.shape, VoxelState.OCCLUDED, np.uint8)


def activity(*rows: tuple[float, float, Action, float], repeat: int = 15) -> Activity:
    """Every row ``repeat`` times: x, y, action, pelvis height."""
    rows = rows * repeat
    return Activity(
        np.array([r[:2] for r in rows]).reshape(-1, 2),
        np.array([r[2] for r in rows], np.uint8),
        np.array([r[3] for r in rows]),
    )


def carved(done: Activity, states: np.ndarray = OCCLUDED, config: CarveConfig = CONFIG) -> np.ndarray:
    maps = activity_maps(done, GRID, config)
    return carve(states, maps.stand, seats(maps.sit, done, GRID, config), GRID, config)


def disc(x: float, y: float) -> np.ndarray:
    """(nx, ny) cells with their centre within a body's radius of a place."""
    return (X - x) ** 2 + (Y - y) ** 2 <= 0.22**2


def test_a_column_where_somebody_stood_is_freed_up_to_175_cm_and_not_above() -> None:
    occupied = carved(activity((1.0, 0.0, Action.STAND, 0.9)))
    here = disc(1.0, 0.0)
    assert 50 < here.sum() < 70
    assert not occupied[here][:, Z <= 1.75].any()
    assert occupied[here][:, Z > 1.75].all()
    assert occupied[~here].all()


def test_nobody_is_all_solid() -> None:
    states = np.random.default_rng(0).integers(0, 7, GRID.shape).astype(np.uint8)
    expected = np.isin(states, (VoxelState.SURFACE, VoxelState.OCCLUDED))
    assert np.array_equal(carved(activity(), states), expected)


def test_what_was_seen_is_never_carved() -> None:
    states = np.random.default_rng(0).integers(0, 7, GRID.shape).astype(np.uint8)
    everywhere = activity(*((x, y, Action.STAND, 0.9) for x in np.arange(0, 2, 0.2) for y in np.arange(-1, 1, 0.2)))
    sitting = activity((1.0, 0.0, Action.SIT, 0.55))
    for done in (everywhere, sitting):
        occupied = carved(done, states)
        assert occupied[states == VoxelState.SURFACE].all()
        others = ~np.isin(states, (VoxelState.SURFACE, VoxelState.OCCLUDED))
        assert not occupied[others].any()
        assert (occupied <= carved(activity(), states)).all()


def test_a_seat_frees_the_sitter_and_supports_from_below() -> None:
    occupied = carved(activity((1.0, 0.0, Action.SIT, 0.61)))  # seat at .51
    here = disc(1.0, 0.0)
    assert occupied[here][:, Z <= 0.51].all()
    assert not occupied[here][:, (Z > 0.51) & (Z <= 0.51 + 0.85)].any()
    assert occupied[here][:, Z > 0.51 + 0.85].all()
    assert occupied[~here].all()


def test_a_seat_without_a_tracked_pelvis_is_45_cm_high() -> None:
    here = disc(1.0, 0.0)
    occupied = carved(activity((1.0, 0.0, Action.SIT, np.nan)))
    assert np.array_equal(occupied[here].all(axis=0), (Z <= 0.45) | (Z > 1.30))


def test_each_seat_has_its_own_height_the_median_of_its_sitters() -> None:
    rows = [(0.4, -0.5, Action.SIT, h) for h in (0.5, 0.55, 0.9)] + [(1.5, 0.5, Action.SIT, h) for h in (0.7, np.nan)]
    occupied = carved(activity(*rows))
    low, high = disc(0.4, -0.5), disc(1.5, 0.5)
    assert np.array_equal(occupied[low].all(axis=0), (Z <= 0.45) | (Z > 1.30))
    assert np.array_equal(occupied[high].all(axis=0), (Z <= 0.60) | (Z > 1.45))


def test_support_under_a_seat_stays_where_somebody_stands_beside_it() -> None:
    both = carved(activity((1.0, 0.0, Action.SIT, 0.55), (1.2, 0.0, Action.STAND, 0.9)))
    seat, stand = disc(1.0, 0.0), disc(1.2, 0.0)
    assert (seat & stand).any()
    assert both[seat][:, Z <= 0.45].all()
    assert not both[seat & stand][:, (Z > 0.45) & (Z <= 1.75)].any()
    assert not both[stand & ~seat][:, Z <= 1.75].any()


@pytest.mark.parametrize(("poses", "freed"), [(4, False), (5, True)])
def test_one_passer_by_is_no_evidence(poses: int, freed: bool) -> None:
    """A pose adds a fifteenth; the map must exceed .3."""
    occupied = carved(activity((1.0, 0.0, Action.STAND, 0.9), repeat=poses))
    assert occupied.all() != freed


def test_maps_count_discs_up_to_one() -> None:
    done = activity((1.0, 0.0, Action.STAND, 0.9), (1.1, 0.1, Action.STAND, 0.9), (0.5, 0.5, Action.SIT, 0.5), repeat=9)
    maps = activity_maps(done, GRID, CONFIG)
    stand = 9 * (disc(1.0, 0.0).astype(int) + disc(1.1, 0.1)) / 15
    assert np.allclose(maps.stand, np.minimum(stand, 1))
    assert np.allclose(maps.sit, 9 * disc(0.5, 0.5) / 15)
    assert (maps.stand.max(), maps.stand.dtype) == (1.0, np.float32)


def test_people_outside_the_grid_change_nothing() -> None:
    away = activity((9.0, 9.0, Action.STAND, 0.9), (-5.0, 0.0, Action.SIT, 0.5))
    assert carved(away).all()


def test_more_activity_never_fills() -> None:
    rng = np.random.default_rng(0)
    rows = [(*rng.uniform((0, -1), (2, 1)), Action.STAND, 0.9) for _ in range(30)]
    before = carved(activity(*rows[:0]))
    for n in (5, 15, 30):
        after = carved(activity(*rows[:n], repeat=5))
        assert (after <= before).all()
        assert after.sum() < before.sum()
        before = after


def test_another_config_is_another_body() -> None:
    wide = carved(activity((1.0, 0.0, Action.STAND, 0.9)), config=CarveConfig(body_radius_m=0.4, stand_top_m=1.0))
    here = (X - 1.0) ** 2 + Y**2 <= 0.4**2
    assert np.array_equal(~wide, here[:, :, None] & (Z <= 1.0))


def test_maps_may_be_given_without_their_poses() -> None:
    stand = np.zeros((40, 40), np.float32)
    sit = stand.copy()
    stand[3, 4], sit[20, 20] = 0.31, 1.0
    occupied = carve(OCCLUDED, stand, seats(sit, activity(), GRID, CONFIG), GRID, CONFIG)
    assert np.array_equal(occupied[3, 4], Z > 1.75)
    assert np.array_equal(occupied[20, 20], (Z <= 0.45) | (Z > 1.30))  # nobody's pelvis: the default


# ---------------------------------------------------------------- states from a depth frame with holes


def test_holes_take_the_nearest_reading() -> None:
    rng = np.random.default_rng(0)
    depth = rng.uniform(1, 5, (12, 15))
    depth[rng.random(depth.shape) < 0.5] = 0
    filled = fill_holes(depth)
    known = np.argwhere(depth > 0)
    for v, u in np.ndindex(depth.shape):
        distance = ((known - (v, u)) ** 2).sum(axis=1)
        nearest = {depth[tuple(p)] for p in known[distance == distance.min()]}
        assert filled[v, u] in nearest
    assert np.array_equal(filled[depth > 0], depth[depth > 0])


def test_no_hole_and_nothing_but_holes_stay() -> None:
    for depth in (np.full((3, 4), 2.0), np.zeros((3, 4))):
        assert np.array_equal(fill_holes(depth), depth)


def test_states_against_a_wall() -> None:
    sensor = Sensor("rgbd", PinholeCamera(64, 48, 40.0, 40.0, 32.0, 24.0), 1.2)
    depth = np.full((48, 64), 1.0)
    depth[10:20, 10:20] = 0  # lost readings are filled
    states = voxel_states(sensor, GRID, depth)
    inside = ~np.isin(states, (VoxelState.OUTSIDE_FOV, VoxelState.MISSING_DEPTH))
    assert VoxelState.MISSING_DEPTH not in states
    x = np.broadcast_to(X[:, :, None], GRID.shape)  # level camera: x is the depth
    margin = np.sqrt(3) / 2 * 0.05
    expected = np.where(
        x > 1.0 + margin, VoxelState.OCCLUDED, np.where(x < 1.0 - margin, VoxelState.FREE, VoxelState.SURFACE)
    )
    assert inside.sum() > 10000
    assert np.array_equal(states[inside], expected[inside])
    nothing = voxel_states(sensor, GRID, np.zeros((48, 64)))
    assert set(np.unique(nothing)) == {VoxelState.MISSING_DEPTH, VoxelState.OUTSIDE_FOV}
    assert not carved(activity((1.0, 0.0, Action.STAND, 0.9)), nothing).any()
