"""From poses and one depth frame to carved voxels: two minutes of three people at 30 Hz, against a loop over frames.

The loop is what one writes first: a frame at a time, a person at a time, numpy on 25 joints and on the plan; the voxel
map is the expression on whole arrays that the truth is made with. Both give the same voxels.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, label

from hsbench.baselines.occlusion.action import HEAD, HEAD_OVER_NECK_M, LEGS, PELVIS, TORSO, recognise
from hsbench.baselines.occlusion.carve import activity_maps, carve, seats, voxel_states
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.geometry.transforms import invert
from hsbench.io.depth_noise import KINECT, add_noise, noise_rng
from hsbench.schema import PoseTable, Sensor
from hsbench.schema.poses import JointState
from hsbench.schema.states import Action, VoxelState
from hsbench.synth.activities import LifeConfig, live
from hsbench.synth.assemble import poses_in
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.placement import CameraConfig, place_rgbd
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.tasks.scene_completion import GRID
from hsbench.truth.sight import depth_states, ray_image
from tests.benchmarks.ratios import best_s, report

SECONDS, RATE_HZ, PEOPLE = 120.0, 30, 3
LOST_SHARE = 0.2
CONFIG = CarveConfig()
Watched = tuple[Sensor, np.ndarray, PoseTable]


@pytest.fixture(scope="module")
def watched() -> Watched:
    """A camera, its depth frame, and skeletons of three people in a room, a fifth of their joints untracked."""
    seeds = Seeds(3)
    scene = build_scene("scene-000000", seeds.child("room"), RoomConfig(), COMMON_FAMILIES)
    config = LifeConfig(SECONDS, 0.0, RATE_HZ, PEOPLE, from_outside=False, arrival_s=(0.1, 0.1))
    scene_T_episode, sensor = place_rgbd(scene, CameraConfig(), seeds.rng("camera"))
    true = poses_in(invert(scene_T_episode), live(scene, seeds.child("life"), config).poses)
    lost = seeds.rng("lost").random(true.joint_state.shape) < LOST_SHARE
    poses = replace(true, joint_state=np.where(lost, JointState.INFERRED, JointState.TRACKED).astype(np.uint8))
    image = ray_image(scene, sensor.camera, scene_T_episode @ sensor.world_T_camera)
    return sensor, add_noise(image.depth_m, KINECT, noise_rng(0, 0)), poses


def ours(sensor: Sensor, depth_m: np.ndarray, poses: PoseTable) -> np.ndarray:
    activity = recognise(poses, CONFIG)
    maps = activity_maps(activity, GRID, CONFIG)
    states = voxel_states(sensor, GRID, depth_m)
    return carve(states, maps.stand, seats(maps.sit, activity, GRID, CONFIG), GRID, CONFIG)


def mean_of(values: np.ndarray, tracked: np.ndarray, joints: tuple[int, ...]) -> float:
    chosen = [values[j] for j in joints if tracked[j]]
    return float(np.mean(chosen)) if chosen else np.nan


def vote(joints: np.ndarray, tracked: np.ndarray, pelvis: float) -> int:
    """1 stands, -1 sits, 0 cannot be told."""
    straight = -np.inf
    for hip, knee in LEGS:
        if tracked[hip] and tracked[knee]:
            thigh = np.linalg.norm(joints[hip] - joints[knee])
            straight = max(straight, (joints[hip, 2] - joints[knee, 2]) / max(thigh, 1e-6))
    if straight > -np.inf:
        if straight > CONFIG.stand_ratio and pelvis > CONFIG.pelvis_stand_m:
            return 1
        return -int(straight < CONFIG.sit_ratio and CONFIG.pelvis_sit_m[0] < pelvis < CONFIG.pelvis_sit_m[1])
    head, neck = HEAD
    height = joints[head, 2] if tracked[head] else joints[neck, 2] + HEAD_OVER_NECK_M if tracked[neck] else np.nan
    if height > CONFIG.head_stand_m:
        return 1
    return -int(CONFIG.head_sit_m[0] < height < CONFIG.head_sit_m[1])


def frame_by_frame(sensor: Sensor, depth_m: np.ndarray, poses: PoseTable) -> np.ndarray:
    votes: dict[int, list[int]] = {}
    people: list[tuple[int, int, np.ndarray, float]] = []
    for timestamp in np.unique(poses.timestamp_ns):
        for row in np.flatnonzero(poses.timestamp_ns == timestamp):
            joints, tracked = poses.joints_m[row].astype(np.float64), poses.joint_state[row] == JointState.TRACKED
            pelvis = mean_of(joints[:, 2], tracked, PELVIS)
            place = np.array([mean_of(joints[:, axis], tracked, TORSO) for axis in range(2)])
            history = votes.setdefault(int(poses.track_id[row]), [])
            people.append((int(poses.track_id[row]), len(history), place, pelvis))
            history.append(vote(joints, tracked, pelvis))
    x, y = np.meshgrid(GRID.axis_centres(0), GRID.axis_centres(1), indexing="ij")
    counts, sitting = {1: np.zeros(x.shape), -1: np.zeros(x.shape)}, []
    before, after = CONFIG.vote_frames // 2, (CONFIG.vote_frames + 1) // 2
    for track, at, place, pelvis in people:
        balance = np.sign(np.sum(votes[track][max(0, at - before) : at + after]))
        if balance == 0 or not np.isfinite(place).all():
            continue
        counts[int(balance)] += (x - place[0]) ** 2 + (y - place[1]) ** 2 <= CONFIG.body_radius_m**2
        if balance < 0:
            sitting.append((place, pelvis))
    stand, sit = (np.minimum(1.0, CONFIG.delta * counts[k]) > CONFIG.threshold for k in (1, -1))
    z = GRID.axis_centres(2)
    free, support = stand[:, :, None] & (z <= CONFIG.stand_top_m), np.zeros(GRID.shape, bool)
    blobs, count = label(sit)
    for k in range(1, count + 1):
        heights = []
        for place, pelvis in sitting:
            i, j = np.floor((place - np.array(GRID.origin_m[:2])) / GRID.voxel_m).astype(int)
            if 0 <= i < GRID.shape[0] and 0 <= j < GRID.shape[1] and blobs[i, j] == k and np.isfinite(pelvis):
                heights.append(pelvis)
        seat_m = np.median(heights) - CONFIG.pelvis_over_seat_m if heights else CONFIG.seat_height_m
        here = (blobs == k)[:, :, None]
        free |= here & (z > seat_m) & (z <= seat_m + CONFIG.sit_clear_m)
        support |= here & (z <= seat_m)
    filled = depth_m[tuple(distance_transform_edt(depth_m == 0, return_distances=False, return_indices=True))]
    states = depth_states(GRID, sensor.camera, sensor.world_T_camera, filled)
    return (states == VoxelState.SURFACE) | ((states == VoxelState.OCCLUDED) & (~free | support))


def test_poses_and_a_frame_to_voxels(benchmark: Any, watched: Watched) -> None:
    sensor, depth_m, poses = watched
    got = benchmark.pedantic(ours, watched, rounds=5, warmup_rounds=1)
    activity = recognise(poses, CONFIG)
    assert len(poses) > 8000
    assert min(len(activity.of(action).position) for action in (Action.STAND, Action.SIT)) > 500
    assert np.array_equal(got, frame_by_frame(sensor, depth_m, poses))
    if benchmark.enabled:
        theirs_s = best_s(lambda: frame_by_frame(sensor, depth_m, poses), 2)
        against = f"a loop over frames, {len(poses)} poses (goal 1000 ms)"
        report("poses and a depth frame to voxels", against, theirs_s, benchmark.stats.stats.min, at_least=20)
