"""Voxel grids as shaded pictures, seen at a slant from above, by exact traversal of the grid along each ray.

Traversal: Amanatides & Woo, "A fast voxel traversal algorithm for ray tracing", Eurographics 1987.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import AnyArray, FloatArray, UInt8Array

FACE_SHADE = (0.80, 0.66, 1.0)  # brightness of faces across x, y and z
EDGE_SHARE = 0.07  # share of a voxel's side that is drawn darker, so that single voxels can be told apart
EDGE_SHADE = 0.88
PAPER = (250, 250, 248)


def draw_voxels(
    labels: UInt8Array,
    colours: UInt8Array,
    azimuth_rad: float = 0.75,
    elevation_rad: float = 0.8,
    width_px: int = 560,
    height_px: int = 420,
) -> UInt8Array:
    """(nx, ny, nz) uint8 labels, 0 = empty, and (256, 3) uint8 rgb per label -> (h, w, 3) uint8 picture.

    The eye looks down by ``elevation_rad`` from ``azimuth_rad`` (0 = from +x), orthographically, fitted to what is
    filled. An empty grid gives blank paper.
    """
    picture = np.full((height_px, width_px, 3), PAPER, dtype=np.uint8)
    filled = np.argwhere(labels > 0)
    if not len(filled):
        return picture
    low, high = filled.min(axis=0), filled.max(axis=0) + 1
    labels = np.ascontiguousarray(labels[low[0] : high[0], low[1] : high[1], low[2] : high[2]])
    size = np.array(labels.shape, dtype=np.float64)
    towards_eye = np.array(
        [
            np.cos(elevation_rad) * np.cos(azimuth_rad),
            np.cos(elevation_rad) * np.sin(azimuth_rad),
            np.sin(elevation_rad),
        ]
    )
    right = np.array([-np.sin(azimuth_rad), np.cos(azimuth_rad), 0.0])
    up = np.cross(towards_eye, right)
    corners = np.stack(np.meshgrid(*([0.0, s] for s in size), indexing="ij"), axis=-1).reshape(-1, 3) - size / 2
    reach = np.array([np.abs(corners @ right).max() / width_px, np.abs(corners @ up).max() / height_px])
    voxel_per_px = 2.04 * reach.max()
    _trace(labels, colours, size / 2, right * voxel_per_px, up * voxel_per_px, towards_eye, picture)
    return picture


@numba.njit(cache=True)
def _trace(
    labels: UInt8Array,
    colours: UInt8Array,
    centre: FloatArray,
    right: FloatArray,
    up: FloatArray,
    towards_eye: FloatArray,
    picture: UInt8Array,
) -> None:
    height, width = picture.shape[:2]
    far = float(labels.shape[0] + labels.shape[1] + labels.shape[2])
    shade = np.array(FACE_SHADE)
    step = np.empty(3, dtype=np.int64)
    cell = np.empty(3, dtype=np.int64)
    crossing = np.empty(3)
    for row in range(height):
        for column in range(width):
            across, above = column + 0.5 - width / 2, height / 2 - row - 0.5
            start = centre + across * right + above * up + far * towards_eye
            enter, leave, axis = 0.0, 2 * far, 2
            for a in range(3):
                d = -towards_eye[a]
                t0, t1 = (0.0 - start[a]) / d, (labels.shape[a] - start[a]) / d
                if t0 > t1:
                    t0, t1 = t1, t0
                if t0 > enter:
                    enter, axis = t0, a
                leave = min(leave, t1)
            if enter >= leave:
                continue
            for a in range(3):
                d = -towards_eye[a]
                position = start[a] + (enter + 1e-9) * d
                cell[a] = min(max(int(np.floor(position)), 0), labels.shape[a] - 1)
                step[a] = 1 if d > 0 else -1
                border = cell[a] + 1 if d > 0 else cell[a]
                crossing[a] = (border - start[a]) / d
            t = enter
            while True:
                label = labels[cell[0], cell[1], cell[2]]
                if label:
                    light = shade[axis]
                    for a in range(3):
                        if a != axis:
                            inside = start[a] - t * towards_eye[a] - cell[a]
                            if inside < EDGE_SHARE or inside > 1 - EDGE_SHARE:
                                light *= EDGE_SHADE
                                break
                    for c in range(3):
                        picture[row, column, c] = int(colours[label, c] * light)
                    break
                axis = int(np.argmin(crossing))
                t = crossing[axis]
                cell[axis] += step[axis]
                if cell[axis] < 0 or cell[axis] >= labels.shape[axis]:
                    break
                crossing[axis] += step[axis] / -towards_eye[axis]


def palette(entries: dict[int, tuple[int, int, int]]) -> UInt8Array:
    """(256, 3) uint8 table from label -> rgb; labels not named are mid grey."""
    table: AnyArray = np.full((256, 3), 128, dtype=np.uint8)
    for label, rgb in entries.items():
        table[label] = rgb
    return table
