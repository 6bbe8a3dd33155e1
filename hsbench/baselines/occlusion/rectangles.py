"""Planar approximation: faces between what is solid and what is free, as rectangles along the axes of the room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_closing, find_objects, label

from hsbench.baselines.occlusion.aligned import AlignedRoom
from hsbench.baselines.occlusion.config import CuboidConfig
from hsbench.typing import BoolArray, IntArray


@dataclass(frozen=True, eq=False)
class Rectangle:
    """A face of something solid. axis: of its normal, which points to free space in direction ``sign``.

    plane: the voxel border it lies on. low, high: (2,) voxel borders along the other two axes, in their order.
    """

    axis: int
    sign: int
    plane: int
    low: IntArray
    high: IntArray

    def span(self, axis: int) -> tuple[int, int]:
        """Lowest and highest voxel border along an axis that is not the normal's."""
        k = axis - (axis > self.axis)
        return int(self.low[k]), int(self.high[k])


def exposed(solid: BoolArray, free: BoolArray, axis: int, sign: int) -> BoolArray:
    """Voxels (nx, ny, nz) that are solid and have a free neighbour along an axis, in direction ``sign``."""
    faces = np.zeros_like(solid)
    here, there = [slice(None)] * 3, [slice(None)] * 3
    here[axis], there[axis] = (slice(None, -1), slice(1, None))[::sign]
    faces[tuple(here)] = solid[tuple(here)] & free[tuple(there)]
    return faces


def rectangles(room: AlignedRoom, config: CuboidConfig) -> list[Rectangle]:
    """Connected rectangles of exposed faces: tops, and sides in four directions; nothing is looked at from below.

    A surface wavers by a voxel or so: faces of neighbouring planes count as one where most of them are.
    """
    solid, found = room.surface | room.hidden, []
    for axis, sign in ((2, 1), (0, 1), (0, -1), (1, 1), (1, -1)):
        faces = np.moveaxis(exposed(solid, room.free, axis, sign), axis, 0)
        count = faces.sum(axis=(1, 2))
        slab = np.convolve(count, (1, 2, 1), mode="same")
        around = np.pad(slab, 1)
        peaks = (slab >= config.least_face_voxels) & (slab >= around[:-2]) & (slab > around[2:])
        for k in np.flatnonzero(peaks):
            sheet = _closed(np.asarray(faces[max(k - 1, 0) : k + 2].any(axis=0)))
            for low, high in _parts(sheet, config):
                found.append(Rectangle(axis, sign, int(k) + (sign > 0), low, high))
    return found


def _closed(sheet: BoolArray) -> BoolArray:
    """A sheet without gaps of a voxel or two; SciPy's closing alone eats what touches the edge of the array."""
    return np.asarray(binary_closing(np.pad(sheet, 1), np.ones((3, 3)))[1:-1, 1:-1])


def _parts(sheet: BoolArray, config: CuboidConfig) -> list[tuple[IntArray, IntArray]]:
    """Borders of the connected parts of a (n, m) sheet, without thin ends."""
    labels, _ = label(sheet)
    parts = []
    for number, box in enumerate(find_objects(labels), start=1):
        part = labels[box] == number
        if part.sum() < config.least_face_voxels:
            continue
        borders = []
        for axis in range(2):
            filled = part.mean(axis=1 - axis)
            kept = np.flatnonzero(filled >= config.end_fill * filled.max())
            borders.append((box[axis].start + kept[0], box[axis].start + kept[-1] + 1))
        low, high = np.array(borders).T
        parts.append((low, high))
    return parts
