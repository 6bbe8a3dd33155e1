"""What plane mirrors show: the scene from the eye's image behind the glass, drawn as the direct view is.

A reflected ray is the straight ray of the reflected eye, so a mirror needs no shading of its own. It shows what the
rest of the picture may show (``background``): structure, and objects with a pixel.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hsbench.synth.render.colouring import points_seen
from hsbench.synth.render.illumination import LIFT_M
from hsbench.synth.render.materials import SILVER
from hsbench.synth.render.raycast_backend import Occluders
from hsbench.synth.render.rays import Rays, directions
from hsbench.synth.render.surfaces import Surfaces
from hsbench.typing import BoolArray, Int32Array, IntArray

LEAST_M2 = 0.02  # smaller planes of silvered glass are its rims
ALIKE, ALIKE_M = 1e-6, 1e-4  # normals and offsets of triangles in one plane differ by less


class Reflection(NamedTuple):
    """The part of a picture with one mirror: rows and columns of samples, and what they show by way of it."""

    rows: slice
    columns: slice
    rays: Rays
    """Of the reflected eye, for the samples of this part."""
    triangle: Int32Array
    """(h, w) number of the triangle that each sample shows, -1 where it shows none by way of the mirror."""


def reflections(triangle: Int32Array, rays: Rays, surfaces: Surfaces, step: int) -> Iterator[Reflection]:
    """The mirrors in a view of (H, W) samples; their parts of it begin and end at multiples of ``step`` samples."""
    occluders = None
    for numbers in _planes(surfaces):
        among = np.zeros(len(surfaces.corners) + 1, dtype=np.bool_)  # the last is what -1 stands for
        among[numbers] = True
        mirror = among[triangle]
        if not mirror.any():
            continue
        rows, columns = (_span(np.asarray(mirror.any(axis=axis)), step) for axis in (1, 0))
        inside = mirror[rows, columns]
        occluders = occluders or Occluders(surfaces.corners, np.ones(len(surfaces.corners), dtype=np.bool_))
        part = rays.part(rows.start, columns.start)
        position, normal = points_seen(np.where(inside, triangle[rows, columns], -1), part, surfaces, 0, 1)
        behind = part.mirrored(surfaces.corners[numbers[0], 0], surfaces.normals[numbers[0]])
        onwards = directions(behind, *np.nonzero(inside))
        origins = position[inside] + LIFT_M * normal[inside]
        found = occluders.first(origins.astype(np.float32), onwards.astype(np.float32))
        facing = np.einsum("ij,ij->i", surfaces.normals[found], onwards) < 0.0
        shown = np.full(inside.shape, -1, dtype=np.int32)
        shown[inside] = np.where(facing, found, -1)  # of none, -1, there is nothing to face
        yield Reflection(rows, columns, behind, shown)


def _planes(surfaces: Surfaces) -> list[IntArray]:
    """Numbers of the silvered triangles, those of one plane together, of all planes as large as a mirror."""
    (numbers,) = np.nonzero(surfaces.straight_on[surfaces.part] >= SILVER)
    corners, normals = surfaces.corners[numbers], surfaces.normals[numbers]
    areas_m2 = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    offsets = np.einsum("ij,ij->i", normals, corners[:, 0])
    planes, left = [], np.ones(len(numbers), dtype=np.bool_)
    for k in range(len(numbers)):
        if left[k]:
            alike = left & (normals @ normals[k] > 1.0 - ALIKE) & (np.abs(offsets - offsets[k]) < ALIKE_M)
            left &= ~alike
            if areas_m2[alike].sum() >= LEAST_M2:
                planes.append(numbers[alike])
    return planes


def _span(used: BoolArray, step: int) -> slice:
    """From the first to the last True of (n,), widened to multiples of ``step``."""
    (found,) = np.nonzero(used)
    return slice(int(found[0]) // step * step, (int(found[-1]) // step + 1) * step)
