"""What a picture of a room takes over from an earlier one of the same view, in which other things have moved.

Colouring costs most of a picture, and a chair that is drawn back changes few colours: those of pixels that show another
surface, or on whose surface other light falls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from hsbench.schema.scene import SceneObject
from hsbench.synth.render.base import Window
from hsbench.typing import BoolArray, FloatArray, Int32Array

LEAST_LIGHT = 0.01  # share of the light on a point: smaller changes, of about a level of 255, are taken for none
READ_OFF = 2  # points of the light grid to each side of a pixel's own of which it is coloured, nearly always
OTHER = -2


class Coloured(NamedTuple):
    """A picture and what its colours follow from; (H, W) samples, (h, w) pixels, (m, n) points of the light grid."""

    triangle: Int32Array
    """(H, W) number of the triangle, -1 for none."""
    sunlit: BoolArray
    """(H, W)."""
    grid: FloatArray
    """(m, n, c) light, in the first three channels the total."""
    light: FloatArray
    """(h, w, 3) the picture."""


class Still(NamedTuple):
    """A full picture and the objects it was drawn of."""

    objects: Sequence[SceneObject]
    coloured: Coloured

    def cut(self, window: Window, objects: Sequence[SceneObject]) -> Known:
        """What is known of a window that begins with a point of the light grid, when it shows other objects."""
        a = self.coloured
        fine, coarse = (len(x) / len(a.light) for x in (a.triangle, a.grid))
        at_sample, at_point, at_pixel = (_part(window, scale) for scale in (fine, coarse, 1.0))
        cut = Coloured(a.triangle[at_sample], a.sunlit[at_sample], a.grid[at_point], a.light[at_pixel])
        return Known(cut, _counterparts(objects, self.objects))


class Known(NamedTuple):
    """What an earlier picture of a window looked like, and what of the objects has not moved since.

    earlier_triangle: (T + 1,) number in the earlier picture of each triangle of these objects, OTHER for those that
    moved; the last stands for none.
    """

    earlier: Coloured
    earlier_triangle: Int32Array

    def changed(self, triangle: Int32Array, sunlit: BoolArray, grid: FloatArray, grid_step: int) -> BoolArray:
        """(h, w) which pixels are to be coloured again, from what ``Coloured`` holds of the picture under way.

        grid_step: samples between points of the grid, whose first point is in the middle of as many.
        """
        before = self.earlier
        samples = (self.earlier_triangle[triangle] != before.triangle) | (sunlit != before.sunlit)
        light = before.grid[: grid.shape[0], : grid.shape[1]]
        points = np.abs(grid - light).max(axis=-1) > LEAST_LIGHT * light[..., :3].max(axis=-1)
        points |= samples[grid_step // 2 :: grid_step, grid_step // 2 :: grid_step]
        side = 2 * READ_OFF + 1
        near = cv2.dilate(points.astype(np.uint8), np.ones((side, side), np.uint8)).astype(np.bool_)
        h, w = before.light.shape[:2]
        factor = len(triangle) // h
        rows, columns = (
            np.minimum(np.arange(n) * factor // grid_step, limit - 1)
            for n, limit in zip((h, w), points.shape, strict=True)
        )
        return np.asarray(samples.reshape(h, factor, w, factor).any(axis=(1, 3)) | near[np.ix_(rows, columns)])


def _part(window: Window, scale: float) -> tuple[slice, slice]:
    """Rows and columns of the points in a window of pixels, of ``scale`` points a pixel."""
    return tuple(
        slice(int(start * scale), math.ceil((start + size) * scale))
        for start, size in ((window.v0, window.height), (window.u0, window.width))
    )  # type: ignore[return-value]


def _counterparts(objects: Sequence[SceneObject], earlier: Sequence[SceneObject]) -> Int32Array:
    """(T + 1,) number of each triangle of the objects among those of the earlier objects; OTHER, and -1 at the end."""
    counts = [sum(len(part.triangles) for part in item.parts) for item in earlier]
    starts = dict(zip(map(id, earlier), np.cumsum([0, *counts]).tolist(), strict=False))
    numbers = []
    for item in objects:
        count = sum(len(part.triangles) for part in item.parts)
        start = starts.get(id(item))
        numbers.append(np.full(count, OTHER) if start is None else np.arange(start, start + count))
    return np.append(np.concatenate(numbers), -1).astype(np.int32)
