"""verify_episode: a sound episode has no fault; pictures, states and poses of another story have one each."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.datasets.verify import verify_episode
from hsbench.geometry.cameras import PinholeCamera
from hsbench.schema.episode import Episode, FrameList
from hsbench.schema.states import VoxelState


@pytest.fixture(scope="module")
def episode(rgbd: Path) -> Episode:
    return load(rgbd, "train", truth=True)[0]


def with_occupancy(episode: Episode, **changes: object) -> Episode:
    return replace(episode, truth=replace(episode.truth, occupancy=replace(episode.truth.occupancy, **changes)))


def with_poses(episode: Episode, **changes: object) -> Episode:
    return replace(episode, poses=replace(episode.poses, **changes))


def test_generated_episodes_are_sound(rgbd: Path) -> None:
    for episode in load(rgbd, truth=True):
        assert verify_episode(episode) == []


def test_nothing_to_compare_is_no_fault(rgbd: Path, episode: Episode) -> None:
    assert verify_episode(load(rgbd)[0]) == []
    assert verify_episode(replace(episode, frames=FrameList(), truth=replace(episode.truth, frames=None))) == []


@pytest.mark.parametrize("share", [0.004, 0.02, 1.0])
def test_tampered_states(episode: Episode, share: float) -> None:
    state = episode.truth.occupancy.state.copy()
    occluded = np.argwhere(state == VoxelState.OCCLUDED)
    in_view = int(np.isin(state, (VoxelState.FREE, VoxelState.SURFACE, VoxelState.OCCLUDED)).sum())
    chosen = np.random.default_rng(0).permutation(occluded)[: round(share * in_view)]
    state[tuple(chosen.T)] = VoxelState.FREE
    faults = verify_episode(with_occupancy(episode, state=state))
    if share < 0.005:
        assert faults == []  # what rounding to millimetres may do
    else:
        (fault,) = faults
        assert fault.startswith(f"{episode.episode_id}: voxel states agree with the depth at t0 on")


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_grid_in_another_place(episode: Episode, axis: int) -> None:
    grid = episode.truth.occupancy.grid
    origin = list(grid.origin_m)
    origin[axis] += 0.3
    states, solids = verify_episode(with_occupancy(episode, grid=replace(grid, origin_m=tuple(origin))))
    assert "voxel states agree" in states
    assert "lie within a voxel of a solid" in solids


def test_a_grid_out_of_view(episode: Episode) -> None:
    state = np.full_like(episode.truth.occupancy.state, VoxelState.OUTSIDE_FOV)
    (fault,) = verify_episode(with_occupancy(episode, state=state))
    assert "no voxel of the truth grid is in view" in fault


def test_states_of_another_episode(rgbd: Path, episode: Episode) -> None:
    other = load(rgbd, "val", truth=True)[0].truth.occupancy
    states, solids = verify_episode(replace(episode, truth=replace(episode.truth, occupancy=other)))
    assert "voxel states agree" in states
    assert "lie within a voxel of a solid" in solids


def test_poses_of_another_frame_or_unit(episode: Episode) -> None:
    joints = episode.poses.joints_m
    assert len(joints) > 30
    for wrong in (joints[..., [1, 0, 2]], joints * np.array([1, -1, 1], np.float32), joints * 100, joints + 0.3):
        (fault,) = verify_episode(with_poses(episode, joints_m=wrong.astype(np.float32)))
        assert "observed joints lie" in fault
    shaken = joints + np.random.default_rng(0).normal(0, 0.03, joints.shape).astype(np.float32)
    assert verify_episode(with_poses(episode, joints_m=shaken)) == []


def test_poses_of_another_time(episode: Episode) -> None:
    match = episode.truth.poses.match.copy()
    match[match >= 0] = np.roll(match[match >= 0], 1)
    (fault,) = verify_episode(
        replace(episode, truth=replace(episode.truth, poses=replace(episode.truth.poses, match=match)))
    )
    assert "true pose of another time" in fault


def test_pictures_of_another_size(episode: Episode) -> None:
    camera = episode.sensor.camera
    assert isinstance(camera, PinholeCamera)
    frame = episode.frames[0]
    cut = replace(frame, rgb=frame.rgb[:-1], depth_m=frame.depth_m[:, 1:])
    faults = verify_episode(replace(episode, frames=FrameList((cut, episode.frames[1]))))
    assert [f for f in faults if "frame 0 rgb has size (119, 160); expected (120, 160)" in f]
    assert [f for f in faults if "frame 0 depth_m has size (120, 159)" in f]
    assert len(faults) == 2
