"""The estimated boundary: rectangular rooms at many headings, from depth in closed form, and what joints add."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.baselines.occlusion.boundary import Boundary, estimate_boundary
from hsbench.geometry.cameras import PinholeCamera
from hsbench.io.depth_noise import KINECT, add_noise, noise_rng
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import KINECT_V2

SENSOR = Sensor("rgbd", PinholeCamera(320, 240, 226.0, 226.0, 160.0, 120.0), 1.7, 0.25)
LOW, HIGH = np.array([-0.3, -0.4]), np.array([4.2, 3.4])
"""The room along its own axes: the camera, at the origin, stands near one corner and looks along the diagonal."""


def turn(yaw: float) -> np.ndarray:
    return np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])


def room_depth(yaw: float, height_m: float = 2.5) -> np.ndarray:
    """Depth of an empty room whose axes are turned by ``yaw`` in the episode frame: the nearest plane of each ray."""
    rays = SENSOR.camera.rays() @ SENSOR.world_T_camera[:3, :3].T
    along = rays[..., :2] @ turn(yaw)
    with np.errstate(divide="ignore"):
        sides = [np.where(along[..., k] > 0, HIGH[k], LOW[k]) / along[..., k] for k in range(2)]
        flat = np.where(rays[..., 2] > 0, height_m - SENSOR.height_m, -SENSOR.height_m) / rays[..., 2]
    return np.minimum.reduce([*sides, flat])  # rays have camera z = 1: the factor is the depth


def joints_at(points: np.ndarray, state: JointState = JointState.TRACKED) -> PoseTable:
    n = len(points)
    joints = np.full((n, 25, 3), np.nan, np.float32)
    states = np.zeros((n, 25), np.uint8)
    joints[:, 0] = np.column_stack([points, np.ones(n)])
    states[:, 0] = state
    return PoseTable(KINECT_V2.name, np.arange(n, dtype=np.int64), np.ones(n, np.int32), states, joints)


@pytest.mark.parametrize(("draws", "yaw_limit_deg", "side_limit_m"), [(0, 0.5, 0.10), (5, 2.0, 0.15)])
@pytest.mark.parametrize("yaw_deg", range(-70, -19, 10))
def test_a_rectangular_room_is_found(yaw_deg: int, draws: int, yaw_limit_deg: float, side_limit_m: float) -> None:
    """The far walls from depth; the near ones, out of sight, from somebody who walks along them.

    With noise the median of some draws counts.
    """
    yaw = np.deg2rad(yaw_deg)
    clean = room_depth(yaw)
    near = np.array([LOW + 0.05, [HIGH[0] - 0.5, LOW[1] + 0.05], [LOW[0] + 0.05, HIGH[1] - 0.5]]) @ turn(yaw).T
    errors = []
    for depth in [add_noise(clean, KINECT, noise_rng(draw, yaw_deg % 360)) for draw in range(draws)] or [clean]:
        found = estimate_boundary(SENSOR, depth, joints_at(near))
        quarters = np.rint((found.yaw_rad - yaw) / (np.pi / 2))
        true = np.array([LOW, HIGH]) @ turn(quarters * np.pi / 2)
        sides = np.abs([found.low - true.min(axis=0), found.high - true.max(axis=0)])
        errors.append((abs(np.rad2deg(found.yaw_rad - yaw) - 90 * quarters), sides.max()))
    yaw_error, side_error = np.median(errors, axis=0)
    assert yaw_error < yaw_limit_deg
    assert side_error < side_limit_m


def test_every_tracked_joint_lies_inside_and_no_other_counts() -> None:
    depth = room_depth(-0.6)
    alone = estimate_boundary(SENSOR, depth, None)
    rng = np.random.default_rng(0)
    outside = rng.uniform(-8, 8, (40, 2))
    grown = estimate_boundary(SENSOR, depth, joints_at(outside))
    assert grown.yaw_rad == alone.yaw_rad
    assert grown.contains(outside.astype(np.float32)).all()
    assert (grown.low <= alone.low).all()
    assert (grown.high >= alone.high).all()
    assert not alone.contains(outside).all()
    inside = joints_at(alone.centre[None])
    for poses in (joints_at(outside, JointState.INFERRED), inside, joints_at(outside[:0])):
        same = estimate_boundary(SENSOR, depth, poses)
        assert np.array_equal(same.low, alone.low)
        assert np.array_equal(same.high, alone.high)


def test_without_depth_it_is_the_joints_about_the_camera() -> None:
    nothing = np.zeros((240, 320))
    empty = estimate_boundary(SENSOR, nothing, None)
    assert (empty.yaw_rad, *empty.low, *empty.high) == (0, -0.5, -0.5, 0.5, 0.5)
    found = estimate_boundary(SENSOR, nothing, joints_at(np.array([[2.0, -1.5], [3.0, 0.2]])))
    assert np.allclose([*found.low, *found.high], [-0.5, -1.5, 3.0, 0.5])


def test_a_floor_alone_has_no_walls_to_turn_to() -> None:
    down = Sensor("rgbd", SENSOR.camera, 1.7, np.pi / 2)
    assert estimate_boundary(down, np.full((240, 320), 1.7), None).yaw_rad == 0.0


@settings(max_examples=60, deadline=None)
@given(st.floats(-4, 4), st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=1, max_size=5))
def test_axes_and_back(yaw: float, points: list[tuple[float, float]]) -> None:
    boundary = Boundary(yaw, np.array([-1.0, -2.0]), np.array([3.0, 0.5]))
    xy = np.array(points)
    assert np.allclose(boundary.from_axes(boundary.to_axes(xy)), xy, atol=1e-9)
    assert np.allclose(boundary.to_axes(xy), xy @ turn(yaw), atol=1e-9)
    inside = np.array([[0.0, 0.0], [2.9, 0.4], [-0.9, -1.9]])
    assert boundary.contains(inside @ turn(yaw).T).all()
    assert not boundary.contains((inside + np.array([4, 0])) @ turn(yaw).T).any()
    assert boundary.contains(boundary.centre)
