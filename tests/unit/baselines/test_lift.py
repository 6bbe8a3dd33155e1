"""Lifting: a figure of known stature comes back where it stood, whatever the camera, and its camera's height too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from lived_rooms import SENSORS, figure, seen

from hsbench.baselines.lift import lifted
from hsbench.baselines.posture import postures
from hsbench.schema.poses import JointState, PoseTable


def at(distance: float, bearing: float) -> np.ndarray:
    return distance * np.array([np.cos(bearing), np.sin(bearing)])


@given(st.floats(0.8, 6.0), st.floats(-3.1, 3.1), st.floats(1.0, 2.4), st.booleans())
def test_a_figure_comes_back_from_a_sphere_without_a_known_height(
    distance: float, bearing: float, height_m: float, sits: bool
) -> None:
    """Somebody stands elsewhere, which tells the height of the camera."""
    sensor = replace(SENSORS["activity-360"], height_m=height_m)
    true = np.stack([figure(at(3.0, 0.3)), figure(at(2.0, -1.0)), figure(at(distance, bearing), sits)])
    found = lifted(seen(sensor, true), replace(sensor, height_m=None))
    neck_and_hips = [1, 8, 11]
    assert np.abs(found.joints_m[:2, neck_and_hips] - true[:2, neck_and_hips]).max() < 0.03
    if not sits:
        assert np.abs(found.joints_m[2, neck_and_hips] - true[2, neck_and_hips]).max() < 0.03
    assert postures(found).sits.tolist() == [False, False, sits]


@given(st.floats(1.5, 5.0), st.floats(-0.4, 0.4))
def test_a_figure_comes_back_from_a_tilted_picture(distance: float, bearing: float) -> None:
    sensor = SENSORS["timelapse-activity"]
    true = figure(at(distance, bearing))[None]
    observed = seen(sensor, true)
    found = lifted(observed, sensor)
    if (observed.joint_state[0] > 0).all():
        assert np.abs(found.joints_m - true).max() < 0.05  # flat figures are slightly oblique to the outer rays


def test_rows_stay_and_what_is_unknown_is_missing() -> None:
    sensor = SENSORS["activity-360"]
    table = seen(sensor, np.stack([figure((2.0, 0.0)), figure((0.0, 2.5)), figure((-2.0, 1.0))]))
    state = table.joint_state.copy()
    state[1, 1] = JointState.MISSING  # no neck, no ankles: no distance
    state[1, [10, 13]] = JointState.MISSING
    pixels = np.where(state[..., None] > 0, table.joints_px, np.nan).astype(np.float32)
    table = PoseTable(table.skeleton, table.timestamp_ns, table.track_id, state, joints_px=pixels)
    found = lifted(table, replace(sensor, height_m=None))
    assert len(found) == 3
    assert (found.joint_state[1] == JointState.MISSING).all()
    assert (found.joint_state[[0, 2]] == table.joint_state[[0, 2]]).all()
    assert np.isfinite(found.joints_m[[0, 2]]).all()
    assert lifted(found, sensor) is found  # metres already
    assert np.array_equal(np.round(found.joints_m[0].astype(np.float64), 4).astype(np.float32), found.joints_m[0])


def test_nobody_at_all() -> None:
    sensor = replace(SENSORS["activity-360"], height_m=None)
    empty = seen(SENSORS["activity-360"], np.zeros((0, 18, 3)))
    assert len(lifted(empty, sensor)) == 0
    assert len(postures(lifted(empty, sensor)).stands) == 0
