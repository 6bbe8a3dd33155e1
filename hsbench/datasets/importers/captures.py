"""Real captures as episodes: what the readers give, put into the schema."""

from __future__ import annotations

import math

import numpy as np

from hsbench.datasets.importers import kinect_csv, sscnet
from hsbench.errors import DataError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.categories import category
from hsbench.schema.episode import Episode, EpisodeTruth, Frame, FrameList
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import KINECT_V2
from hsbench.schema.states import VoxelState
from hsbench.truth.sight import depth_states
from hsbench.typing import FloatArray, UInt8Array

KINECT_V2_DEPTH = PinholeCamera(512, 424, 366.0, 366.0, 258.0, 208.0)
"""Typical intrinsics of a Kinect v2's depth camera; a unit's own differ by a few pixels."""

SUBSAMPLES = 3
"""Points an axis at which the 2 cm labels are looked up in a voxel of 5 cm: closer than a label voxel is wide."""

CATEGORY_OF_CLASS = {
    **{
        name: name
        for name in ("ceiling", "floor", "wall", "window", "door", "chair", "bed", "sofa", "desk", "bookshelf")
    },
    **{"table": "dining_table", "side_table": "side_table", "night_stand": "night_stand", "closets": "wardrobe"},
    **{"kitchen_cabinet": "kitchen_counter", "lamp": "floor_lamp", "plants": "plant", "tvs": "television"},
}
"""SSCNet classes with a category of ours; every other labelled class becomes ``object``."""


def sscnet_episode(frame: sscnet.SscnetFrame, episode_id: str, grid: VoxelGrid) -> Episode:
    """One frame with its labelled volume: depth as input; on ``grid`` (episode frame), occupancy and states as truth.

    A voxel is solid if any of 3 x 3 x 3 points in it has a label; it is ignored where its middle is unknown (255).
    A volume without any label gives an episode without truth.
    """
    if not (frame.depth_m > 0).any():
        raise DataError("the depth image has no reading at all; expected metres somewhere (is it the right file?)")
    episode_T_camera, episode_T_ssc = sscnet.to_episode_frame(frame)
    sensor = sensor_at(frame.camera, episode_T_camera)
    input_frame = Frame(0, depth_m=frame.depth_m)
    labels = frame.volume.labels
    truth = None
    if ((labels != sscnet.EMPTY) & (labels != sscnet.UNKNOWN)).any():
        truth = EpisodeTruth(occupancy=_occupancy(frame, sensor, episode_T_ssc, grid))
    return Episode(episode_id, "sscnet", sensor, FrameList((input_frame,)), None, 0, 0, truth=truth)


def _occupancy(frame: sscnet.SscnetFrame, sensor: Sensor, episode_T_ssc: FloatArray, grid: VoxelGrid) -> OccupancyTruth:
    table = _category_table()
    semantic = np.zeros(grid.shape, dtype=np.uint8)
    offsets = ((np.arange(SUBSAMPLES) + 0.5) / SUBSAMPLES - 0.5) * grid.voxel_m
    for shift in np.stack(np.meshgrid(offsets, offsets, offsets, indexing="ij"), axis=-1).reshape(-1, 3):
        x, y, z = np.asarray(grid.origin_m) + shift
        found = table[
            sscnet.resample_labels(frame.volume, episode_T_ssc, VoxelGrid((x, y, z), grid.shape, grid.voxel_m))
        ]
        semantic = np.where(semantic == 0, found, semantic)
    middle = sscnet.resample_labels(frame.volume, episode_T_ssc, grid)
    state = depth_states(grid, frame.camera, sensor.world_T_camera, frame.depth_m)
    unknown = middle == sscnet.UNKNOWN
    state[unknown & (semantic == 0)] = VoxelState.UNKNOWN
    return OccupancyTruth(
        grid=grid,
        semantic=semantic,
        instance=semantic.astype(np.uint16),  # the format knows classes, not instances
        state=state,
        ignored=unknown,
        swept_s=np.full(grid.shape, np.inf, dtype=np.float32),
    )


def _category_table() -> UInt8Array:
    """(256,) uint8: category id of every SSCNet label; empty and unknown are 0."""
    table = np.zeros(256, dtype=np.uint8)
    for label, name in enumerate(sscnet.CLASSES_36):
        if label != sscnet.EMPTY:
            table[label] = category(CATEGORY_OF_CLASS.get(name, "object")).category_id
    return table


def sensor_at(camera: PinholeCamera, episode_T_camera: FloatArray) -> Sensor:
    """The RGB-D sensor whose pose in its episode frame is a given (4, 4); height, tilt and roll are read off it."""
    rotation = episode_T_camera[:3, :3]
    tilt = math.asin(float(np.clip(-rotation[2, 2], -1.0, 1.0)))
    roll = math.asin(float(np.clip(-rotation[2, 0] / math.cos(tilt), -1.0, 1.0)))
    return Sensor("rgbd", camera, float(episode_T_camera[2, 3]), tilt, roll)


def kinect_episode(recording: kinect_csv.KinectRecording, episode_id: str, height_m: float, tilt_rad: float) -> Episode:
    """A skeleton recording as observed poses in the episode frame of a camera at a height and tilt."""
    if not (recording.state == JointState.TRACKED).any():
        raise DataError("no joint of the recording is tracked; there is nobody to import")
    joints = kinect_csv.to_episode_frame(recording.joints_kinect_m, height_m, tilt_rad).astype(np.float32)
    stamps = recording.timestamp_ns - recording.timestamp_ns[0]
    tracks = np.ones(len(stamps), dtype=np.int32)
    poses = PoseTable(KINECT_V2.name, stamps, tracks, recording.state, joints)
    sensor = Sensor("rgbd", KINECT_V2_DEPTH, height_m, tilt_rad)
    return Episode(episode_id, "kinect-csv", sensor, FrameList(), poses, 0, int(stamps[-1]))
