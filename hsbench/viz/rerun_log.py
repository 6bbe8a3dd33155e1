"""An episode as a Rerun recording: pictures, depth, poses and boxes on one clock."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hsbench.errors import MissingExtraError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.io.atomic import atomic_file
from hsbench.io.images import MM_PER_M, depth_to_mm, encode_png
from hsbench.schema.episode import NS_PER_S, Episode
from hsbench.schema.poses import JointState
from hsbench.typing import UInt8Array

CLOCK = "episode"
JPEG_QUALITY = 92


def write_rerun(path: Path, episode: Episode) -> None:
    """Write an ``.rrd`` file that the Rerun viewer opens. Raises MissingExtraError without the extra ``viz``.

    World is the episode frame. 360 pictures and those of sensors at unknown height are shown apart from it.
    """
    try:
        import rerun as rr
    except ModuleNotFoundError as error:
        raise MissingExtraError("a Rerun recording", error.name or "rerun-sdk", "viz") from error

    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as temporary:
        recording = rr.RecordingStream("hsbench", recording_id=episode.episode_id)
        recording.save(temporary)
        _log_episode(rr, recording, episode)
        recording.flush()
        recording.disconnect()


def _log_episode(rr: Any, recording: Any, episode: Episode) -> None:
    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    camera, placed = episode.sensor.camera, episode.sensor.height_m is not None
    if isinstance(camera, PinholeCamera) and placed:
        pose = episode.sensor.world_T_camera
        recording.log("world/camera", rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]), static=True)
        recording.log(
            "world/camera",
            rr.Pinhole(
                focal_length=(camera.fx_px, camera.fy_px),
                principal_point=(camera.cx_px, camera.cy_px),
                resolution=(camera.width_px, camera.height_px),
                camera_xyz=rr.ViewCoordinates.RDF,
            ),
            static=True,
        )
        picture = "world/camera"
    else:
        picture = "picture"
    _log_scene(rr, recording, episode)
    for index in range(len(episode.frames)):
        frame = episode.frames[index]
        recording.set_time(CLOCK, duration=(frame.timestamp_ns - episode.t0_ns) / NS_PER_S)
        if frame.rgb is not None:
            recording.log(f"{picture}/rgb", rr.EncodedImage(contents=_jpeg(frame.rgb), media_type="image/jpeg"))
        if frame.depth_m is not None:
            recording.log(
                f"{picture}/depth",
                rr.EncodedDepthImage(
                    blob=encode_png(depth_to_mm(frame.depth_m)), media_type="image/png", meter=MM_PER_M
                ),
            )
    _log_poses(rr, recording, episode, picture)


def _log_scene(rr: Any, recording: Any, episode: Episode) -> None:
    """Amodal boxes of the scene, where truth has one."""
    if episode.truth is None or episode.truth.scene is None:
        return
    boxes = [(item, item.box) for item in episode.truth.scene.objects if item.category.group != "structure"]
    if not boxes:
        return
    rows = np.array([box for _, box in boxes])
    yaw = rows[:, 6]
    turns = np.column_stack([np.zeros((len(rows), 2)), np.sin(yaw / 2), np.cos(yaw / 2)])
    recording.log(
        "world/objects",
        rr.Boxes3D(
            centers=rows[:, :3],
            sizes=rows[:, 3:6],
            quaternions=turns,
            labels=[item.category_name for item, _ in boxes],
            show_labels=False,
        ),
        static=True,
    )


def _log_poses(rr: Any, recording: Any, episode: Episode, picture: str) -> None:
    """Observed poses: in space where they are 3D, else over the picture."""
    poses = episode.poses
    if poses is None:
        return
    spatial = poses.joints_m is not None
    joints = poses.joints_m if poses.joints_m is not None else poses.joints_px
    assert joints is not None  # one of them is there
    points, lines = (rr.Points3D, rr.LineStrips3D) if spatial else (rr.Points2D, rr.LineStrips2D)
    root = "world/poses" if spatial else f"{picture}/poses"
    for timestamp_ns in np.unique(poses.timestamp_ns):
        rows = np.flatnonzero(poses.timestamp_ns == timestamp_ns)
        recording.set_time(CLOCK, duration=(int(timestamp_ns) - episode.t0_ns) / NS_PER_S)
        found = poses.joint_state[rows] != JointState.MISSING
        tracks = np.repeat(poses.track_id[rows, None], found.shape[1], axis=1)
        recording.log(f"{root}/joints", points(joints[rows][found], class_ids=tracks[found]))
        strips, owners = [], []
        for row, seen in zip(rows, found, strict=True):
            for a, b in poses.layout.bones:
                if seen[a] and seen[b]:
                    strips.append(joints[row, [a, b]])
                    owners.append(poses.track_id[row])
        recording.log(f"{root}/bones", lines(strips, class_ids=owners))


def _jpeg(rgb: UInt8Array) -> bytes:
    _, data = cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()
