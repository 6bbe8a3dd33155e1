"""Compiled voxel states against the definition of truth, on any camera and depth."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.baselines.occlusion.sight import pinhole_states
from hsbench.errors import SchemaError
from hsbench.geometry.cameras import PinholeCamera, world_T_camera
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.states import VoxelState
from hsbench.truth.sight import depth_states

GRID = VoxelGrid((-0.5, -1.0, 0.0), (40, 41, 20), 0.07)


@settings(max_examples=50, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.1, 3.0),
    st.floats(-1.5, 1.5),
    st.floats(-3.0, 3.0),
    st.sampled_from([(64, 48), (7, 90), (1, 1)]),
)
def test_states_are_those_of_truth(seed: int, height_m: float, tilt: float, roll: float, size: tuple[int, int]) -> None:
    rng = np.random.default_rng(seed)
    width, height = size
    camera = PinholeCamera(width, height, *rng.uniform(5, 90, 2), *(rng.uniform(-0.2, 1.2, 2) * size))
    depth = rng.uniform(0.2, 4.0, (height, width)) * (rng.random((height, width)) < 0.9)
    pose = world_T_camera(height_m, tilt, roll)
    ours, truth = pinhole_states(GRID, camera, pose, depth), depth_states(GRID, camera, pose, depth)
    assert ours.dtype == np.uint8
    # The order of additions differs: a voxel centre on the border of a pixel may fall to either side.
    assert (ours != truth).mean() <= 1e-4


def test_all_missing_depth_is_missing_or_out_of_view() -> None:
    camera = PinholeCamera(64, 48, 45.0, 45.0, 32.0, 24.0)
    states = pinhole_states(GRID, camera, world_T_camera(1.5, 0.3), np.zeros((48, 64)))
    assert set(np.unique(states)) == {VoxelState.MISSING_DEPTH, VoxelState.OUTSIDE_FOV}


def test_depth_of_another_size_is_refused() -> None:
    camera = PinholeCamera(64, 48, 45.0, 45.0, 32.0, 24.0)
    with pytest.raises(SchemaError, match=r"depth_m has shape \(64, 48\); expected \(48, 64\)"):
        pinhole_states(GRID, camera, np.eye(4), np.zeros((64, 48)))
