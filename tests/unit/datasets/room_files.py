"""Made captures of one room, whose place every reader must find: a camera before a floor, two walls and a box.

The camera stands ``HEIGHT_M`` above the floor, tilted and rolled; the box is known in the episode frame. Depth is
traced here, plane by plane, without the code under test.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hsbench.typing import AnyArray, FloatArray

WIDTH, HEIGHT = 96, 72
FOCAL, CENTRE = 80.0, (47.0, 37.0)  # in pixels counted from 1
HEIGHT_M, TILT_RAD, ROLL_RAD = 1.3, 0.35, 0.04
WALL_X_M, WALL_Y_M = 3.0, 1.5  # the wall ahead and the one on the left
BOX_LOW, BOX_HIGH = np.array([1.6, -0.7, 0.0]), np.array([2.2, 0.1, 0.5])


def episode_R_camera() -> FloatArray:
    """(3, 3): heading +x, tilted down, then rolled so that the right side of the camera goes down."""
    c, s = np.cos(TILT_RAD), np.sin(TILT_RAD)
    right, down, forward = np.array([0, -1.0, 0]), np.array([-s, 0, -c]), np.array([c, 0, -s])
    cr, sr = np.cos(ROLL_RAD), np.sin(ROLL_RAD)
    return np.stack([cr * right + sr * down, -sr * right + cr * down, forward], axis=1)


def upright_R_camera(yaw_rad: float = 0.0) -> FloatArray:
    """(3, 3): the same camera in a frame with x right, y ahead, z up, turned by a yaw."""
    x_right = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]) @ x_right @ episode_R_camera()


def depth_m(
    focal: float = FOCAL, centre: tuple[float, float] = CENTRE, size: tuple[int, int] = (WIDTH, HEIGHT)
) -> FloatArray:
    """(h, w) depth of floor, walls and box; pixels are counted from 1."""
    u, v = np.meshgrid(np.arange(1, size[0] + 1), np.arange(1, size[1] + 1))
    rays = np.stack([(u - centre[0]) / focal, (v - centre[1]) / focal, np.ones(u.shape)], axis=-1)
    rays = rays @ episode_R_camera().T
    with np.errstate(divide="ignore", invalid="ignore"):
        planes = [-HEIGHT_M / rays[..., 2], WALL_X_M / rays[..., 0], WALL_Y_M / rays[..., 1]]
        eye = np.array([0.0, 0.0, HEIGHT_M])
        a, b = (BOX_LOW - eye) / rays, (BOX_HIGH - eye) / rays
        enter, leave = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
    hits = [np.where(t > 0, t, np.inf) for t in planes]
    hits.append(np.where((enter > 0) & (enter < leave), enter, np.inf))
    return np.asarray(np.min(hits, axis=0))


def rgb(size: tuple[int, int] = (WIDTH, HEIGHT)) -> AnyArray:
    """(h, w, 3) uint8, red on the left half, blue on the right."""
    image = np.zeros((size[1], size[0], 3), dtype=np.uint8)
    image[:, : size[0] // 2, 0] = 250
    image[:, size[0] // 2 :, 2] = 250
    return image


def write_rgb(path: Path, image: AnyArray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image[..., ::-1])


def write_grey16(path: Path, values: AnyArray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), np.round(values).astype(np.uint16))


def rotated(depth: AnyArray) -> AnyArray:
    """Millimetres rotated left by three bits."""
    mm = np.round(depth * 1000).astype(np.uint32)
    return ((mm << 3) & 0xFFFF) | (mm >> 13)


def polygon(corners_episode: AnyArray, low_z: float, high_z: float, yaw_rad: float = 0.0) -> dict[str, Any]:
    """A polygon of SUN RGB-D: (n, 2) corners in the episode frame, Y down from the camera."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    x_right = np.stack([-corners_episode[:, 1], corners_episode[:, 0]], axis=1)
    turned = x_right @ np.array([[c, -s], [s, c]]).T
    return {
        "X": turned[:, 0].tolist(),
        "Z": turned[:, 1].tolist(),
        "Ymin": HEIGHT_M - high_z,
        "Ymax": HEIGHT_M - low_z,
        "rectangle": True,
    }


def box_corners() -> FloatArray:
    """(4, 2) of the box from above; its front, between the first two, looks at the camera."""
    (x0, y0), (x1, y1) = BOX_LOW[:2].tolist(), BOX_HIGH[:2].tolist()
    return np.array([[x0, y1], [x0, y0], [x1, y0], [x1, y1]])


def sunrgbd_folder(folder: Path, yaw_rad: float = 0.0) -> Path:
    """A SUN RGB-D frame of the room; the frame of its annotation is turned by a yaw, as real ones are a little."""
    write_rgb(folder / "image" / "a.jpg", rgb())
    write_grey16(folder / "depth" / "a.png", rotated(depth_m()))
    write_grey16(folder / "depth_bfx" / "a.png", rotated(depth_m()))
    K = [[FOCAL, 0.0, CENTRE[0]], [0.0, FOCAL, CENTRE[1]], [0.0, 0.0, 1.0]]
    (folder / "intrinsics.txt").write_text("\n".join(" ".join(f"{v:.6f}" for v in row) for row in K))
    z_down = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    R = z_down @ upright_R_camera(yaw_rad)
    (folder / "extrinsics").mkdir()
    (folder / "extrinsics" / "20140101000000.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n")
    rows = [" ".join(f"{v:.6f}" for v in [*row, 0.0]) for row in R]
    (folder / "extrinsics" / "20150101000000.txt").write_text("\n".join(rows) + "\n")
    (folder / "scene.txt").write_text("office")
    table = {"name": "table:near", "polygon": [polygon(box_corners(), BOX_LOW[2], BOX_HIGH[2], yaw_rad)]}
    walls = np.array([[0.0, WALL_Y_M], [0.0, -2.0], [WALL_X_M, -2.0], [WALL_X_M, WALL_Y_M]])
    room = {"name": "room", "polygon": [{**polygon(walls, 0.0, 2.4, yaw_rad), "rectangle": False}]}
    for name, objects in (("annotation3Dfinal", [None, table, None]), ("annotation3Dlayout", [None, room])):
        (folder / name).mkdir()
        (folder / name / "index.json").write_text(json.dumps({"name": "made", "objects": objects}))
    return folder
