"""How long it takes to observe three people for ten minutes at 10 Hz in a furnished room, in microseconds a pose."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera
from hsbench.geometry.transforms import invert, planar
from hsbench.schema import PoseTable, Sensor
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.detectors import PRESETS, Occluders, observe
from hsbench.synth.detectors.visibility import joint_states, people
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.people import Body
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds

LOOKS, PEOPLE = 6000, 3
BODIES = tuple(Body(s) for s in (1.6, 1.72, 1.88))
WALL = Sensor("rgbd", PinholeCamera(640, 480, 452.0, 452.0, 320.0, 240.0), 1.8, 0.25)
SPHERE = Sensor("equirectangular", EquirectangularCamera(2048, 1024), 1.6)

Room = tuple[PoseTable, Occluders, int]


@pytest.fixture(scope="module")
def room() -> Room:
    """People who drift about the middle of a room, in the frame of a camera at its wall; what hides them; its parts."""
    scene = build_scene("scene-000000", Seeds(5).child("room"), RoomConfig(), COMMON_FAMILIES)
    middle = scene.rooms[0].outline_xy.mean(axis=0)
    rng = np.random.default_rng(0)
    joints = np.empty((LOOKS, PEOPLE, 25, 3))
    for k, body in enumerate(BODIES):
        at = np.stack([2.0 + np.sin(np.arange(LOOKS) / 97 + k), 1.2 * np.cos(np.arange(LOOKS) / 61 + 2 * k)], axis=1)
        still = pose(body, standing(body, np.zeros(2), rng.uniform(-3, 3)), 30, None)[0]
        joints[:, k] = still + np.pad(at, ((0, 0), (0, 1)))[:, None]
    times = np.repeat(np.arange(LOOKS, dtype=np.int64) * 100_000_000, PEOPLE)
    track = np.tile(np.arange(1, PEOPLE + 1, dtype=np.int32), LOOKS)
    states = np.full((LOOKS * PEOPLE, 25), 2, dtype=np.uint8)
    poses = PoseTable("kinect-v2-25", times, track, states, joints.reshape(-1, 25, 3).astype(np.float32))
    placed = scene.moved(invert(planar(middle[0] - 2.0, middle[1], 0.0)))
    return poses, Occluders.of(placed, ObjectMotions.none()), sum(len(item.parts) for item in scene.objects)


def test_lines_of_sight(benchmark: Any, room: Room) -> None:
    poses, occluders, parts = room
    crowd = people(poses.timestamp_ns, poses.track_id, poses.joints_m.astype(np.float64), BODIES, KINECT_V2)
    args = (crowd, KINECT_V2, occluders, WALL, (0.5, 8.0))
    states = benchmark.pedantic(joint_states, args, rounds=5, warmup_rounds=1)
    assert len(np.unique(states)) == 3
    if benchmark.enabled:
        per_pose = benchmark.stats.stats.min / len(poses) * 1e6
        print(f"\njoint states against {parts} parts (goal 60 us): {per_pose:.1f} us a pose")


@pytest.mark.parametrize(("name", "sensor"), [("kinect", WALL), ("openpose-like", SPHERE)])
def test_observing_ten_minutes(benchmark: Any, room: Room, name: str, sensor: Sensor) -> None:
    poses, occluders, _ = room
    args = (poses, BODIES, occluders, sensor, PRESETS[name], Seeds(1), np.unique(poses.timestamp_ns))
    observed, _ = benchmark.pedantic(observe, args, rounds=3, warmup_rounds=1)
    assert len(observed) > 0.3 * len(poses)
    if benchmark.enabled:
        seconds = benchmark.stats.stats.min
        print(f"\n{name}, three people for ten minutes: {seconds:.2f} s, {seconds / len(poses) * 1e6:.1f} us a pose")
