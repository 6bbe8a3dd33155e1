"""Checks of truth against geometry: a sound episode has no fault, one that is tampered with has the one it should."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.datasets.geometry_checks import agreement, geometry_faults, joints_apart_px, view_faults
from hsbench.geometry.transforms import apply, planar
from hsbench.schema.episode import Episode, FramesTruth, FrameTruth
from hsbench.schema.scene import PERSON_ID_OFFSET


@pytest.fixture(scope="module")
def episode(rgbd: Path) -> Episode:
    """The episode in which most is seen of people."""
    return max(load(rgbd, truth=True), key=lambda e: sum((f.instance > PERSON_ID_OFFSET).sum() for f in e.truth.frames))


@dataclass(frozen=True)
class Changed:
    """Truth of frames with something done to each."""

    frames: FramesTruth
    change: Callable[[FrameTruth], FrameTruth]

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> FrameTruth:
        return self.change(self.frames[index])


def with_truth(episode: Episode, **changes: object) -> Episode:
    return replace(episode, truth=replace(episode.truth, **changes))


def with_frames(episode: Episode, change: Callable[[FrameTruth], FrameTruth]) -> Episode:
    return with_truth(episode, frames=Changed(episode.truth.frames, change))


def test_sound_episodes(rgbd: Path) -> None:
    for episode in load(rgbd, truth=True):
        assert list(geometry_faults(episode)) == []


def test_depth_of_the_wrong_unit_or_camera(episode: Episode) -> None:
    faults = list(geometry_faults(with_frames(episode, lambda f: replace(f, depth_m=1.01 * f.depth_m))))
    assert any(fault.startswith("depth at t0 is within 2 mm of exact rays on") for fault in faults)
    faults = list(geometry_faults(replace(episode, sensor=replace(episode.sensor, tilt_rad=0.0))))
    assert len(faults) >= 3


def test_ids_that_are_exchanged(episode: Episode) -> None:
    ids, counts = np.unique(episode.truth.frames[0].instance, return_counts=True)
    a, b = ids[np.argsort(counts)[-2:]]

    def exchanged(frame: FrameTruth) -> FrameTruth:
        instance = frame.instance.copy()
        instance[frame.instance == a], instance[frame.instance == b] = b, a
        return replace(frame, instance=instance)

    faults = list(geometry_faults(with_frames(episode, exchanged)))
    assert any("ids at t0" in fault for fault in faults)
    assert any(f"{a} holds" in fault for fault in faults)
    assert any(f"{b} holds" in fault for fault in faults)


def test_a_box_that_is_elsewhere(episode: Episode) -> None:
    scene = episode.truth.scene
    seen = set(np.unique(episode.truth.frames[0].instance).tolist())
    item = next(o for o in scene.objects if o.object_id in seen and o.category.group != "structure")
    away = item.moved(planar(0.05, 0.0, 0.0))
    objects = tuple(away if o is item else o for o in scene.objects)
    faults = list(geometry_faults(with_truth(episode, scene=replace(scene, objects=objects))))
    assert any(f"{item.object_id} holds" in fault for fault in faults)


def test_voxels_that_are_empty(episode: Episode) -> None:
    occupancy = episode.truth.occupancy
    empty = replace(occupancy, semantic=np.zeros_like(occupancy.semantic), instance=np.zeros_like(occupancy.instance))
    (fault,) = geometry_faults(with_truth(episode, occupancy=empty))
    assert fault.startswith("0.00% of the points at t0 lie within a voxel of a solid")


def test_bodies_of_another_place(episode: Episode) -> None:
    truth = episode.truth.poses
    aside = replace(truth.poses, joints_m=truth.poses.joints_m + np.array([0, 0.4, 0], dtype=np.float32))
    (fault,) = geometry_faults(with_truth(episode, poses=replace(truth, poses=aside)))
    assert "of the joints in view lie in their person's picture" in fault


def test_people_that_were_not_drawn(episode: Episode) -> None:
    def emptied(frame: FrameTruth) -> FrameTruth:
        person = frame.instance > PERSON_ID_OFFSET
        instance = np.where(person, 1, frame.instance).astype(np.uint16)
        return replace(frame, instance=instance, depth_m=np.where(person, np.float32(9.0), frame.depth_m))

    (fault,) = geometry_faults(with_frames(episode, emptied))
    assert fault.startswith("0.00% of the joints in view")


def test_views_of_one_room_agree(episode: Episode) -> None:
    """A second sensor in the same place agrees with itself, one whose room has another place does not."""
    twin = replace(episode, episode_id="twin")
    assert agreement(episode, twin) == 1.0
    assert list(view_faults([episode, twin])) == []
    nearer = with_frames(twin, lambda f: replace(f, depth_m=np.float32(0.9) * f.depth_m))
    faults = list(view_faults([episode, nearer]))
    assert len(faults) == 2
    assert "twin both see at t0 lie in one place to 1 cm" in faults[0]


def turned(episode: Episode) -> Episode:
    """The same room and people, told in another frame by the same sensor placed elsewhere."""
    truth, move = episode.truth, planar(0.3, -0.2, 0.1)
    joints = apply(move, truth.poses.poses.joints_m.astype(np.float64)).astype(np.float32)
    poses = replace(truth.poses, poses=replace(truth.poses.poses, joints_m=joints))
    return with_truth(replace(episode, episode_id="turned"), scene=truth.scene.moved(move), poses=poses)


def test_joints_told_by_two_sensors_project_to_one_place(episode: Episode) -> None:
    other = turned(episode)
    assert joints_apart_px(episode, other) < 0.05  # float32 and nothing else
    assert joints_apart_px(other, episode) < 0.05
    joints = other.truth.poses.poses.joints_m + np.array([0.0, 0.05, 0.0], dtype=np.float32)
    table = replace(other.truth.poses, poses=replace(other.truth.poses.poses, joints_m=joints))
    aside = with_truth(other, poses=table)
    depth_m, fx_px = 4.0, episode.sensor.camera.fx_px
    assert joints_apart_px(episode, aside) > 0.05 * fx_px / depth_m * 0.9  # somebody is nearer than 4 m
    assert any("expected at most 0.5 px" in fault for fault in view_faults([episode, aside]))
    assert joints_apart_px(replace(episode, truth=None), other) is None
    later = replace(other.truth.poses.poses, timestamp_ns=other.truth.poses.poses.timestamp_ns + 1)
    never = with_truth(other, poses=replace(other.truth.poses, poses=later))
    assert joints_apart_px(episode, never) is None


def test_another_life_in_the_room_is_not_compared(episode: Episode) -> None:
    events = episode.truth.events
    aside = with_truth(turned(episode), poses=episode.truth.poses)
    assert joints_apart_px(episode, aside) > 0.5
    other = with_truth(aside, events=replace(events, start_ns=events.start_ns + 1))
    assert joints_apart_px(episode, other) is None
    assert not any("joint" in fault for fault in view_faults([episode, other]))


def test_nothing_to_compare(rgbd: Path, episode: Episode) -> None:
    assert list(geometry_faults(load(rgbd)[0])) == []
    assert agreement(episode, load(rgbd)[0]) is None
