"""What a training step sees of an episode, as plain arrays: pictures, poses, boxes and maps in one frame.

Numpy only. ``datasets`` hands these out as tensors, ``transforms`` moves all of it together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import DataError
from hsbench.geometry.cameras import Camera
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.episode import Episode
from hsbench.schema.poses import PoseTable
from hsbench.schema.skeletons import Skeleton
from hsbench.schema.states import Visibility
from hsbench.typing import AnyArray, BoolArray, Float32Array, FloatArray, IntArray, UInt8Array


@dataclass(frozen=True, eq=False)
class Sample:
    """T frames, P observed poses of J joints, M boxes, C maps; parts a data set does not have are None.

    camera, height_m, tilt_rad, roll_rad: as ``Sensor``. timestamps_ns: (T,) int64. rgb: (T, h, w, 3) uint8.
    depth_m: (T, h, w) float32, 0 = none. pose_ns, track_id: (P,). joint_state: (P, J) uint8. joints_m: (P, J, 3),
    joints_px: (P, J, 2) float32, NaN where missing. maps: (C, s, s) float32, activity maps. Of truth, None unless it
    was asked for: instance: (T, h, w) uint16. semantic: (T, h, w) uint8. boxes: (M, 7) float64 centre, size, yaw, and
    box_class, box_visibility: (M,) uint8. affordance: (s, s) uint8 bit field. On ``grid``, (nx, ny, nz): solid, bool;
    voxel_state, uint8 of ``VoxelState``. affordance_ignored, solid_ignored: bool, cells and voxels no score counts.
    """

    camera: Camera
    height_m: float | None
    tilt_rad: float
    roll_rad: float
    timestamps_ns: IntArray
    rgb: UInt8Array | None = None
    depth_m: Float32Array | None = None
    skeleton: Skeleton | None = None
    pose_ns: IntArray | None = None
    track_id: AnyArray | None = None
    joint_state: UInt8Array | None = None
    joints_m: Float32Array | None = None
    joints_px: Float32Array | None = None
    maps: Float32Array | None = None
    instance: AnyArray | None = None
    semantic: UInt8Array | None = None
    boxes: FloatArray | None = None
    box_class: UInt8Array | None = None
    box_visibility: UInt8Array | None = None
    affordance: UInt8Array | None = None
    affordance_ignored: BoolArray | None = None
    solid: BoolArray | None = None
    voxel_state: UInt8Array | None = None
    solid_ignored: BoolArray | None = None
    grid: VoxelGrid | None = None


def sample(episode: Episode, frames: Sequence[int], poses: PoseTable | None) -> Sample:
    """Some frames and poses of an episode, with what truth it was loaded with.

    Raises DataError where the chosen frames do not all have the same kinds of pictures.
    """
    chosen = [episode.frames[index] for index in frames]
    sensor, truth, maps = episode.sensor, episode.truth, episode.activity_maps
    shown = [truth.frames[index] for index in frames] if truth is not None and truth.frames is not None else []
    boxes = _boxes(episode)
    plan, occupancy = (None, None) if truth is None else (truth.affordance, truth.occupancy)
    return Sample(
        camera=sensor.camera,
        height_m=sensor.height_m,
        tilt_rad=sensor.tilt_rad,
        roll_rad=sensor.roll_rad,
        timestamps_ns=np.array([frame.timestamp_ns for frame in chosen], dtype=np.int64),
        rgb=_stacked([frame.rgb for frame in chosen], episode, "rgb"),
        depth_m=_stacked([frame.depth_m for frame in chosen], episode, "depth"),
        skeleton=None if poses is None else poses.layout,
        pose_ns=None if poses is None else poses.timestamp_ns,
        track_id=None if poses is None else poses.track_id,
        joint_state=None if poses is None else poses.joint_state,
        joints_m=None if poses is None else poses.joints_m,
        joints_px=None if poses is None else poses.joints_px,
        maps=None if maps is None else maps.maps,
        instance=_stacked([frame.instance for frame in shown], episode, "instance"),
        semantic=_stacked([frame.semantic for frame in shown], episode, "semantic"),
        boxes=None if boxes is None else boxes[0],
        box_class=None if boxes is None else boxes[1],
        box_visibility=None if boxes is None else boxes[2],
        affordance=None if plan is None else plan.labels,
        affordance_ignored=None if plan is None else plan.ignored,
        solid=None if occupancy is None else occupancy.solid,
        voxel_state=None if occupancy is None else occupancy.state,
        solid_ignored=None if occupancy is None else occupancy.ignored,
        grid=None if occupancy is None else occupancy.grid,
    )


def _stacked(pictures: Sequence[AnyArray | None], episode: Episode, name: str) -> AnyArray | None:
    there = [picture for picture in pictures if picture is not None]
    if not there:
        return None
    if len(there) < len(pictures):
        raise DataError(f"episode {episode.episode_id}: {len(there)} of {len(pictures)} frames have {name}")
    return np.stack(there)


def _boxes(episode: Episode) -> tuple[FloatArray, UInt8Array, UInt8Array] | None:
    """Boxes, classes and visibility of the furniture, in the scene's order."""
    truth = episode.truth
    if truth is None or truth.scene is None:
        return None
    rows = [k for k, item in enumerate(truth.scene.objects) if item.category.group != "structure"]
    items = [truth.scene.objects[k] for k in rows]
    visibility = (
        np.full(len(rows), Visibility.OUTSIDE, dtype=np.uint8)
        if truth.objects is None
        else truth.objects.visibility[rows]
    )
    return (
        np.array([item.box for item in items]).reshape(-1, 7),
        np.array([item.category.category_id for item in items], dtype=np.uint8),
        visibility,
    )
