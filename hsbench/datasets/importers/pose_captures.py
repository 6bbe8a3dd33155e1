"""Recorded poses as episodes: what the readers of skeletons and keypoints give, put into the schema."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import numpy as np

from hsbench.datasets.importers import coco_keypoints, ntu_skeleton, openpose, pigraphs, pose2room
from hsbench.datasets.importers.captures import KINECT_V2_DEPTH, sensor_at
from hsbench.datasets.importers.kinect_bodies import KINECT_T_CAMERA, KinectBodies, unmirrored
from hsbench.errors import DataError
from hsbench.geometry import convex, transforms
from hsbench.geometry.cameras import Camera, PinholeCamera, TopDownCamera, world_T_camera
from hsbench.schema.episode import Episode, EpisodeTruth, FrameList
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import COCO_17, KINECT_V2

FOCAL_PER_SIDE = 1.2
"""Focal length over the longer side where nobody knows it: COLMAP's prior, default_focal_length_factor."""

MIN_INSIDE = 0.5
"""Share of the 2D joints that must lie within the picture; detectors put nearly all there."""

PIGRAPHS_DEPTH = unmirrored(367.50, 366.33, 267.09, 197.22)
"""The depth camera by PiGraphs' own constants."""

CELL_M = 0.05
MARGIN_M = 1.0
"""Cells of the view from above on a Pose2Room sample, and how far it reaches beyond what is known."""

CATEGORY_OF_CLASS = {
    **{
        name: name
        for name in ("bathtub", "bed", "bench", "bookshelf", "chair", "desk", "dishwasher", "fridge", "microwave")
    },
    **{name: name for name in ("sofa", "stove", "toilet", "window")},
    **{"closet": "wardrobe", "garbagecan": "waste_bin", "lamp": "table_lamp", "monitor": "television"},
    **{"nightstand": "night_stand", "washingmachine": "washing_machine"},
}
"""Pose2Room classes with a category of ours (its cabinets are of three kinds); every other class becomes ``object``."""

BOX_COLOUR = (160, 160, 160)


def kinect_bodies_episode(
    bodies: KinectBodies, episode_id: str, dataset: str, height_m: float, tilt_rad: float, camera: PinholeCamera
) -> Episode:
    """People before a Kinect v2 at a height and tilt, as observed poses in its episode frame."""
    episode_T_kinect = world_T_camera(height_m, tilt_rad) @ KINECT_T_CAMERA
    sensor = Sensor("rgbd", camera, height_m, tilt_rad)
    return Episode(episode_id, dataset, sensor, FrameList(), bodies.poses(episode_T_kinect), 0, bodies.end_ns)


def ntu_episode(recording: ntu_skeleton.NtuRecording, episode_id: str, height_m: float, tilt_rad: float) -> Episode:
    """An NTU RGB+D recording, with the intrinsics that its own pixels give, or typical ones where they give none."""
    camera = ntu_skeleton.depth_camera(recording) or KINECT_V2_DEPTH
    return kinect_bodies_episode(recording.bodies, episode_id, "ntu-skeleton", height_m, tilt_rad, camera)


def pigraphs_episode(recording: pigraphs.PigraphsRecording, episode_id: str, floor_m: float) -> Episode:
    """A PiGraphs recording as observed poses; the sensor's pose is the file's, above a floor at z = ``floor_m``."""
    episode_T_kinect, episode_T_camera = pigraphs.to_episode_frame(recording, floor_m)
    bodies = recording.bodies
    sensor = sensor_at(PIGRAPHS_DEPTH, episode_T_camera)
    return Episode(episode_id, "pigraphs", sensor, FrameList(), bodies.poses(episode_T_kinect), 0, bodies.end_ns)


def openpose_episode(
    recording: openpose.OpenPoseRecording,
    episode_id: str,
    scale: str,
    size_px: tuple[int, int],
    rate_hz: float,
    focal_px: float | None = None,
) -> Episode:
    """2D people of one camera at unknown height. focal_px: default ``FOCAL_PER_SIDE`` times the longer side.

    Raises DataError where most joints lie outside a picture of this size.
    """
    camera = _camera(size_px, focal_px)
    poses = openpose.poses(recording, scale, size_px, rate_hz)
    _check_inside(camera, poses)
    times = openpose.frame_times(recording.frames - recording.frames[0], rate_hz)
    return Episode(episode_id, "openpose", Sensor("monocular", camera, None), FrameList(), poses, 0, int(times[-1]))


def coco_episode(
    keypoints: coco_keypoints.CocoKeypoints, episode_id: str, rate_hz: float, focal_px: float | None = None
) -> Episode:
    """The pictures as frames of one camera, by file name. Raises DataError if their sizes differ."""
    first = keypoints.images[0]
    size_px = (first.width_px, first.height_px)
    for image in keypoints.images:
        if (image.width_px, image.height_px) != size_px:
            raise DataError(
                f"{image.file_name} has {image.width_px} x {image.height_px} px, {first.file_name} {size_px[0]} x"
                f" {size_px[1]}; expected pictures of one camera (without a rate, each is an episode)"
            )
    times = openpose.frame_times(np.arange(len(keypoints.images)), rate_hz)
    poses = PoseTable(
        COCO_17.name, times[keypoints.image], keypoints.track_id, keypoints.state, joints_px=keypoints.joints_px
    )
    camera = _camera(size_px, focal_px)
    _check_inside(camera, poses)
    sensor = Sensor("monocular", camera, None)
    return Episode(episode_id, "coco-keypoints", sensor, FrameList(), poses, 0, int(times[-1]))


def coco_episodes(keypoints: coco_keypoints.CocoKeypoints, focal_px: float | None = None) -> list[Episode]:
    """An episode for every picture with somebody, named as its file.

    Raises DataError if two files have one name, and SchemaError if a name is no id.
    """
    shown = np.unique(keypoints.image).tolist()
    names = [Path(keypoints.images[index].file_name).stem for index in shown]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise DataError(
            f"{twice[0]!r} names {names.count(twice[0])} pictures; expected a name each (of one film? give its rate)"
        )
    return [
        coco_episode(coco_keypoints.of_picture(keypoints, index), name, 1.0, focal_px)
        for index, name in zip(shown, names, strict=True)
    ]


def pose2room_episode(sample: pose2room.Pose2RoomSample, episode_id: str) -> Episode:
    """A simulated person seen from above, with the room and its boxes as truth where the sample has a room.

    The episode frame is the sample's: its origin is the middle of the room's floor.
    """
    joints_m, state = pose2room.to_kinect(sample.joints_m)
    stamps = pose2room.timestamps_ns(sample)
    tracks = np.ones(len(stamps), dtype=np.int32)
    poses = PoseTable(KINECT_V2.name, stamps, tracks, state, joints_m.astype(np.float32))
    scene = None if sample.room is None else _scene(sample, sample.room, episode_id)
    known = [sample.joints_m[..., :2].reshape(-1, 2)]
    if scene is not None:
        known.append(scene.rooms[0].outline_xy)
    reach = np.abs(np.concatenate(known)).max(axis=0) + MARGIN_M
    side_x, side_y = (2 * math.ceil(r / CELL_M) for r in reach)
    sensor = Sensor("topdown", TopDownCamera(side_y, side_x, CELL_M), None)
    truth = None if scene is None else EpisodeTruth(scene=scene)
    return Episode(episode_id, "pose2room", sensor, FrameList(), poses, 0, int(stamps[-1]), truth=truth)


def _scene(sample: pose2room.Pose2RoomSample, room: pose2room.Box, scene_id: str) -> Scene:
    length, width, height_m = room.size_m
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [length / 2, width / 2]
    outline = corners @ transforms.rotation_z(room.yaw_rad)[:2, :2].T + room.centre_m[:2]
    objects = tuple(
        _object(number, CATEGORY_OF_CLASS.get(name, "object"), box)
        for number, (name, box) in enumerate(zip(sample.classes, sample.boxes, strict=True), start=1)
    )
    return Scene(scene_id, (Room("room", outline),), float(height_m), objects, "imported")


def _object(object_id: int, category: str, box: pose2room.Box) -> SceneObject:
    """A box standing on the middle of its footprint. Which side is its front is not known."""
    x, y, z = box.centre_m
    length, width, height = box.size_m
    part = Part("box", BOX_COLOUR, solid=convex.box((length, width, height), (0.0, 0.0, height / 2)))
    pose = transforms.planar(float(x), float(y), box.yaw_rad, float(z - height / 2))
    return SceneObject(object_id, category, pose, (part,))


def _camera(size_px: tuple[int, int], focal_px: float | None) -> PinholeCamera:
    width_px, height_px = size_px
    focal = FOCAL_PER_SIDE * max(size_px) if focal_px is None else focal_px
    return PinholeCamera(width_px, height_px, focal, focal, width_px / 2, height_px / 2)


def _check_inside(camera: Camera, poses: PoseTable) -> None:
    seen = poses.joint_state != JointState.MISSING
    inside = float(camera.contains(np.asarray(poses.joints_px, dtype=np.float64)[seen]).mean())
    if inside < MIN_INSIDE:
        raise DataError(
            f"{inside:.0%} of the joints lie within {camera.width_px} x {camera.height_px} px; expected nearly all"
            " (another size, or another scale?)"
        )
