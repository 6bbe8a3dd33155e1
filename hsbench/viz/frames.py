"""Frames of an episode as people look at them: the picture, what the detector saw in it, and when."""

from __future__ import annotations

import colorsys

import cv2
import numpy as np

from hsbench.errors import DataError
from hsbench.geometry.cameras import TopDownCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.episode import NS_PER_S, Episode
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.typing import BoolArray, FloatArray, UInt8Array
from hsbench.viz.pictures import beside, depth_picture, fitted

CAPTION_PX = 26
NEAREST_S = 0.5  # poses farther in time from a frame are not drawn into it
INFERRED_SHADE = 0.45  # of a joint that the detector only guessed
FAR_M = 8.0  # depth pictures of one episode share a scale, so that a clip does not flicker
FAR_PX = 1e5  # joints beside the lens project to anywhere
SEAM_SHARE = 0.5  # a bone longer than this share of a 360 picture's width crosses its seam


def annotated(episode: Episode, index: int, height_px: int) -> UInt8Array:
    """(h, w, 3) frame ``index``: rgb with the observed poses, depth beside it where there is any, the time below.

    Raises DataError for a frame that holds no picture at all.
    """
    frame = episode.frames[index]
    pictures = []
    if frame.rgb is not None:
        pictures.append(fitted(_with_poses(frame.rgb, episode, frame.timestamp_ns), height_px))
    if frame.depth_m is not None:
        pictures.append(fitted(depth_picture(frame.depth_m, FAR_M), height_px))
    if not pictures:
        raise DataError(f"episode {episode.episode_id} frame {index} has neither rgb nor depth to show")
    row = beside(pictures)
    caption = np.full((CAPTION_PX, row.shape[1], 3), 255, dtype=np.uint8)
    text = f"{(frame.timestamp_ns - episode.t0_ns) / NS_PER_S:.2f} s, frame {index}"
    cv2.putText(caption, text, (4, CAPTION_PX - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (40, 40, 40), 1, cv2.LINE_AA)
    return np.concatenate([row, caption])


def _with_poses(rgb: UInt8Array, episode: Episode, timestamp_ns: int) -> UInt8Array:
    """A copy of a picture with the poses that were observed nearest to its time."""
    canvas = rgb.copy()
    poses = episode.poses
    if poses is None or not len(poses):
        return canvas
    gap = np.abs(poses.timestamp_ns - timestamp_ns)
    if gap.min() > NEAREST_S * NS_PER_S:
        return canvas
    rows = np.flatnonzero(gap == gap.min())
    pixels = joint_pixels(poses, episode.sensor)
    for row in rows[poses.timestamp_ns[rows] == poses.timestamp_ns[rows[0]]]:
        _draw_pose(canvas, pixels[row], poses.joint_state[row], poses.layout.bones, int(poses.track_id[row]))
    return canvas


def joint_pixels(poses: PoseTable, sensor: Sensor) -> FloatArray:
    """(N, J, 2) where joints are in the picture, NaN where they are not: as observed, or projected from 3D."""
    if poses.joints_px is not None:
        return poses.joints_px.astype(np.float64)
    assert poses.joints_m is not None  # one of them is there
    points = poses.joints_m.astype(np.float64)
    if isinstance(sensor.camera, TopDownCamera):
        return sensor.camera.project(points)[0]
    return sensor.camera.project(apply(invert(sensor.world_T_camera), points))[0]


def _draw_pose(
    canvas: UInt8Array, pixels: FloatArray, state: UInt8Array, bones: tuple[tuple[int, int], ...], track_id: int
) -> None:
    """Bones and joints of one pose, a colour a track, guessed ones darker."""
    thickness = max(1, round(canvas.shape[0] / 240))
    shown: BoolArray = np.asarray(np.abs(pixels).max(axis=-1) < FAR_PX)  # NaN is not
    for a, b in bones:
        if shown[a] and shown[b] and abs(pixels[a, 0] - pixels[b, 0]) < SEAM_SHARE * canvas.shape[1]:
            sure = min(state[a], state[b]) == JointState.TRACKED
            ends = [(round(pixels[k, 0]), round(pixels[k, 1])) for k in (a, b)]
            cv2.line(canvas, ends[0], ends[1], _colour(track_id, sure), thickness, cv2.LINE_AA)
    for k in np.flatnonzero(shown):
        centre = (round(pixels[k, 0]), round(pixels[k, 1]))
        cv2.circle(canvas, centre, thickness + 1, _colour(track_id, state[k] == JointState.TRACKED), -1, cv2.LINE_AA)


def _colour(track_id: int, sure: bool) -> tuple[int, int, int]:
    red, green, blue = colorsys.hsv_to_rgb((0.08 + track_id * 0.618034) % 1.0, 0.9, 1.0 if sure else INFERRED_SHADE)
    return round(255 * red), round(255 * green), round(255 * blue)
