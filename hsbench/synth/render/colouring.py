"""The colour of every sample of a picture: point, rounded normal, texture, light read off a grid, reflection, sky."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from hsbench.synth.render.filtering import LightGrid, read_off
from hsbench.synth.render.noise import noise2
from hsbench.synth.render.rays import Rays, aim
from hsbench.synth.render.surfaces import Surfaces
from hsbench.synth.render.textures import texture
from hsbench.synth.render.tone import toned
from hsbench.typing import BoolArray, FloatArray, Int32Array

CHANNELS = 9  # of the light grid: total, towards (see Light), and what a mirror there would show
WARM_RED, WARM_BLUE = 0.04, 0.07  # what warmth 1 does to a colour
FACET_COSINE = 0.8  # faces that meet at less than this angle (37 degrees) approximate a curve,
FACET_EDGE_M = 0.03  # and are smoothed over this width
FLAT_COSINE, BACK_COSINE = 0.9999, -0.3  # faces turned less or more than this do not round each other's edges
LEAST_CHANGE = 0.25  # rounding leaves at least this share of the light
# The view out of a window, in exposed light: haze above the horizon, blue above that, trees, the ground.
HAZE, BLUE = np.array([2.0, 2.15, 2.3]), np.array([0.95, 1.35, 2.0])
TREES, EARTH = np.array([0.36, 0.5, 0.3]), np.array([0.72, 0.82, 0.55])


class Sun(NamedTuple):
    """Unit direction towards the sun (3,), its light (3,), and which (h, w) samples it reaches.

    outside: (3,) what the view out of windows is multiplied by. outlook: unit (3,), that view is turned to it.
    """

    towards: FloatArray
    light: FloatArray
    reaches: BoolArray
    outside: FloatArray
    outlook: FloatArray


class Work(NamedTuple):
    """Room for what is computed on the way, (3,) each but for the last."""

    ray: FloatArray
    beside: FloatArray
    below: FloatArray
    point: FloatArray
    local: FloatArray
    turned: FloatArray
    pixel: FloatArray
    base: FloatArray
    light: FloatArray


@numba.njit(cache=True, error_model="numpy")
def points_seen(
    triangle: Int32Array, rays: Rays, surfaces: Surfaces, start: int, step: int
) -> tuple[FloatArray, FloatArray]:
    """(h, w, 3) points and normals of (H, W) samples, every ``step``-th from ``start``; 0 where triangle is -1."""
    shape = (len(range(start, triangle.shape[0], step)), len(range(start, triangle.shape[1], step)), 3)
    point, normal, ray = np.zeros(shape), np.zeros(shape), np.empty(3)
    for y in range(shape[0]):
        for x in range(shape[1]):
            i, j = start + y * step, start + x * step
            if triangle[i, j] >= 0:
                aim(rays, float(i), float(j), ray)
                normal[y, x] = surfaces.normals[triangle[i, j]]
                depth = _depth(rays.eye, ray, surfaces, triangle[i, j])
                for c in range(3):
                    point[y, x, c] = rays.eye[c] + depth * ray[c]
    return point, normal


@numba.njit(cache=True, error_model="numpy")
def colour_pixels(
    triangle: Int32Array, rays: Rays, surfaces: Surfaces, grid: LightGrid, grid_step: int, sun: Sun, exposure: float,
    factor: int, on_display: bool, wanted: BoolArray, result: FloatArray,
) -> None:  # fmt: skip
    """Set result (h, w, 3) to the light of the ``wanted`` (h, w) pixels of factor x factor samples: the mean over
    those with a triangle, else 0.

    on_display: as the display shows it, else as it is exposed: linear in the light of grid, sun and outside.
    triangle: (factor h, factor w). grid: a point of CHANNELS channels in the middle of every grid_step x grid_step
    samples. A pixel that shows one triangle alone is asked for once, in its middle: textures are filtered.
    """
    h, w = triangle.shape[0] // factor, triangle.shape[1] // factor
    light = np.empty(3)
    work = Work(
        np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3),
        np.empty(CHANNELS),
    )  # fmt: skip
    for y in range(h):
        for x in range(w):
            if not wanted[y, x]:
                continue
            result[y, x] = 0.0
            first, alike, found, sunlit = triangle[factor * y, factor * x], True, 0, 0.0
            for i in range(factor * y, factor * (y + 1)):
                for j in range(factor * x, factor * (x + 1)):
                    alike &= triangle[i, j] == first
                    found += triangle[i, j] >= 0
                    sunlit += sun.reaches[i, j]
            if found == 0:
                continue
            if alike:
                middle = 0.5 * (factor - 1)
                _shade(
                    first, factor * y + middle, factor * x + middle, rays, surfaces, grid, grid_step, sun,
                    sunlit / (factor * factor), exposure, factor, work, light,
                )  # fmt: skip
                for c in range(3):
                    result[y, x, c] = toned(light[c]) if on_display else light[c]
                continue
            for i in range(factor * y, factor * (y + 1)):
                for j in range(factor * x, factor * (x + 1)):
                    if triangle[i, j] >= 0:
                        _shade(
                            triangle[i, j], float(i), float(j), rays, surfaces, grid, grid_step, sun,
                            1.0 if sun.reaches[i, j] else 0.0, exposure, factor, work, light,
                        )  # fmt: skip
                        for c in range(3):
                            result[y, x, c] += (toned(light[c]) if on_display else light[c]) / found


@numba.njit(cache=True, error_model="numpy")
def _shade(
    t: int, i: float, j: float, rays: Rays, surfaces: Surfaces, grid: LightGrid, grid_step: int, sun: Sun,
    sunlit: float, exposure: float, pixel_steps: int, work: Work, light: FloatArray,
) -> None:  # fmt: skip
    """Set light (3,) to the exposed light of triangle t in the direction of sample (i, j)."""
    aim(rays, i, j, work.ray)
    k, p = surfaces.part[t], work.point
    if surfaces.pane[k]:
        _look_out(work.ray, sun, light)
        return
    depth = _depth(rays.eye, work.ray, surfaces, t)
    for c in range(3):
        p[c] = rays.eye[c] + depth * work.ray[c]
    _into_object(surfaces, k, t, p, work.local, work.turned)
    aim(rays, i, j + 1.0, work.beside)
    aim(rays, i + 1.0, j, work.below)
    _pixel_size(surfaces, k, t, work, depth * pixel_steps)
    bend = _rounded_normal(work.local, work.turned, surfaces, k)
    _albedo(surfaces, k, work.local, work.turned, work.pixel, work.base)
    nx, ny, nz = surfaces.normals[t, 0], surfaces.normals[t, 1], surfaces.normals[t, 2]
    row, column = (i + 0.5) / grid_step - 0.5, (j + 0.5) / grid_step - 0.5
    read_off(grid, row, column, p[0], p[1], p[2], nx, ny, nz, work.light)
    _lit(surfaces, k, t, work.ray, bend, work.base, work.light, sun, sunlit, exposure, light)


@numba.njit(cache=True, error_model="numpy")
def _lit(
    surfaces: Surfaces, k: int, t: int, ray: FloatArray, bend: tuple[float, float, float], base: FloatArray,
    here: FloatArray, sun: Sun, sunlit: float, exposure: float, light: FloatArray,
) -> None:  # fmt: skip
    """Set light (3,) to the exposed light that a point of albedo ``base`` sends along the ray, given the grid's."""
    tilt, sun_cosine, facing, length = 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        bent = 0.0
        for a in range(3):
            bent += surfaces.object_T_world[k, a, c] * bend[a]
        tilt += (bent - surfaces.normals[t, c]) * here[3 + c]
        sun_cosine += bent * sun.towards[c]
        facing -= bent * ray[c]
        length += ray[c] * ray[c]
    luminance = 0.2126 * here[0] + 0.7152 * here[1] + 0.0722 * here[2]
    change = max(1.0 + tilt / max(luminance, 1e-6), LEAST_CHANGE)
    sunlight = max(sun_cosine, 0.0) * sunlit
    away = 1.0 - min(max(facing / math.sqrt(length), 0.0), 1.0)
    straight_on = surfaces.straight_on[k]
    mirror = surfaces.gloss[k] * (straight_on + (1.0 - straight_on) * away * away * away * away * away)
    for c in range(3):
        matt = base[c] * (here[c] * change + sunlight * sun.light[c])
        light[c] = exposure * (matt + mirror * (here[6 + c] - matt))


@numba.njit(cache=True, error_model="numpy")
def _depth(eye: FloatArray, ray: FloatArray, surfaces: Surfaces, t: int) -> float:
    """Where the ray meets the triangle's plane, in multiples of the ray; 0 if it does not meet its front."""
    gap, along = 0.0, 0.0
    for c in range(3):
        gap += (surfaces.corners[t, 0, c] - eye[c]) * surfaces.normals[t, c]
        along += ray[c] * surfaces.normals[t, c]
    return gap / along if along < 0.0 else 0.0


@numba.njit(cache=True, error_model="numpy")
def _into_object(surfaces: Surfaces, k: int, t: int, p: FloatArray, local: FloatArray, turned: FloatArray) -> None:
    """Set local (3,) and turned (3,) to point p and the normal of triangle t in the frame of the object of part k."""
    for a in range(3):
        local[a], turned[a] = surfaces.object_T_world[k, a, 3], 0.0
        for c in range(3):
            local[a] += surfaces.object_T_world[k, a, c] * p[c]
            turned[a] += surfaces.object_T_world[k, a, c] * surfaces.normals[t, c]


@numba.njit(cache=True, error_model="numpy")
def _pixel_size(surfaces: Surfaces, k: int, t: int, work: Work, scale: float) -> None:
    """Set work.pixel: how far the point on the plane moves along each axis of the object from pixel to pixel.

    scale: the depth of the point, times the samples along a pixel.
    """
    ray = work.ray
    along, right, down = -1e-6, 0.0, 0.0
    for c in range(3):
        along += ray[c] * surfaces.normals[t, c]
        right += (work.beside[c] - ray[c]) * surfaces.normals[t, c]
        down += (work.below[c] - ray[c]) * surfaces.normals[t, c]
    for a in range(3):
        across, up = 0.0, 0.0
        for c in range(3):
            across += surfaces.object_T_world[k, a, c] * (work.beside[c] - ray[c] - right / along * ray[c])
            up += surfaces.object_T_world[k, a, c] * (work.below[c] - ray[c] - down / along * ray[c])
        work.pixel[a] = scale * (abs(across) + abs(up))


@numba.njit(cache=True, error_model="numpy")
def _rounded_normal(p: FloatArray, n: FloatArray, surfaces: Surfaces, k: int) -> tuple[float, float, float]:
    """Unit normal at a point of a face of convex part k, bent towards neighbours near the edge; object frame.

    Where two faces meet both give the mean of their normals.
    """
    x, y, z = n[0], n[1], n[2]
    edge_m, q = surfaces.edge_m[k], surfaces.planes
    for r in range(surfaces.plane_start[k], surfaces.plane_start[k + 1]):
        cosine = q[r, 0] * n[0] + q[r, 1] * n[1] + q[r, 2] * n[2]
        if cosine < BACK_COSINE or cosine > FLAT_COSINE:
            continue
        width = max(edge_m, FACET_EDGE_M) if cosine > FACET_COSINE else edge_m
        inside = max(q[r, 3] - q[r, 0] * p[0] - q[r, 1] * p[1] - q[r, 2] * p[2], 0.0)
        if inside < width:
            weight = max(1.0 - inside / (width * math.sqrt(1.0 - cosine * cosine)), 0.0)
            weight *= weight
            x += weight * q[r, 0]
            y += weight * q[r, 1]
            z += weight * q[r, 2]
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


@numba.njit(cache=True, error_model="numpy")
def _albedo(
    surfaces: Surfaces, k: int, local: FloatArray, turned: FloatArray, pixel: FloatArray, base: FloatArray
) -> None:
    """Set base (3,) to the linear colour of part k at a point; moves ``local`` into the pattern."""
    normal_axis = 0
    for a in range(1, 3):
        if abs(turned[a]) > abs(turned[normal_axis]) + 1e-6:
            normal_axis = a
    for a in range(3):
        local[a] += surfaces.shift_m[k, a]
    factor, warmth, share = texture(surfaces.texture[k], local, pixel, normal_axis, surfaces.grain_axis[k])
    for c in range(3):
        base[c] = max(surfaces.colour[k, c] * factor, 0.0)
    base[0] *= 1.0 + WARM_RED * warmth
    base[2] *= 1.0 - WARM_BLUE * warmth
    for c in range(3):
        base[c] += (surfaces.second[k, c] - base[c]) * share


@numba.njit(cache=True, error_model="numpy")
def _look_out(ray: FloatArray, sun: Sun, light: FloatArray) -> None:
    """Set light (3,) to what stands outside in a direction: sky over a line of trees over the ground.

    The trees stand where they stand to the outlook, so that they do not turn with the frame the scene is given in.
    """
    slope = ray[2] / max(math.sqrt(ray[0] ** 2 + ray[1] ** 2), 1e-6)
    across = sun.outlook[0] * ray[1] - sun.outlook[1] * ray[0]
    azimuth = math.atan2(across, sun.outlook[0] * ray[0] + sun.outlook[1] * ray[1])
    crowns = 0.03 + 0.05 * noise2(5.0 * azimuth, 0.5, 48) + 0.02 * noise2(23.0 * azimuth, 0.5, 49)
    leaf = 1.0 + 0.16 * noise2(35.0 * azimuth, 35.0 * slope, 50) + 0.12 * noise2(110.0 * azimuth, 110.0 * slope, 51)
    for c in range(3):
        if slope > crowns:
            shown = HAZE[c] + (BLUE[c] - HAZE[c]) * math.sqrt(min(slope - crowns, 1.0))
        else:
            shown = TREES[c] * leaf
            shown += (EARTH[c] - shown) * min(max((0.02 - slope) * 6.0, 0.0), 1.0)
        light[c] = sun.outside[c] * shown
