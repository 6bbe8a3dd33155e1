"""The picture of a room without people: textures, soft shadows, bounced light; paid for once an episode.

Deferred shading: a renderer says which triangle each sample shows (``surfaces``); the rest is computed per sample from
that triangle's plane and the scene. Ids and depth are the renderer's own and no business of this module.

What cannot be seen must leave no trace in the picture, or its shadow would tell of it. So nothing takes part but the
structure of the rooms and the objects that own a pixel of the id image: others are not drawn, stop no light and send
none on. Two scenes that differ in an object without a pixel have the same background, byte by byte.
"""

from __future__ import annotations

import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.schema.scene import Scene
from hsbench.synth.render.base import Renderer
from hsbench.synth.render.colouring import Rays, Sun, colour_pixels, points_seen
from hsbench.synth.render.filtering import LightGrid, smoothed
from hsbench.synth.render.illumination import INTO_ROOM_M, Illumination, Points
from hsbench.synth.render.sources import sources_of
from hsbench.synth.render.surfaces import surfaces_of, triangles_seen
from hsbench.synth.render.tone import encode_srgb
from hsbench.typing import BoolArray, FloatArray, Int32Array, UInt8Array, UInt16Array

SUPERSAMPLE = 2  # samples across a pixel
GRID_STEP = 4  # samples between points of light
LIGHT_RAYS = 4  # from a point to each lamp and window
GATHER_RAYS = 5  # from a point to other surfaces
SHARP_REACH, SOFT_REACH = 2, 4  # of the averages: half of the tiles below, for shadows and for bounced light
# Places of neighbours in a tile of samples: Bayer's matrices, which give them far members of the sequence.
_BAYER_2 = np.array([[0, 2], [3, 1]])
_BAYER_4 = np.block([[4 * _BAYER_2, 4 * _BAYER_2 + 2], [4 * _BAYER_2 + 3, 4 * _BAYER_2 + 1]])
TILES = (_BAYER_4, np.block([[4 * _BAYER_4, 4 * _BAYER_4 + 2], [4 * _BAYER_4 + 3, 4 * _BAYER_4 + 1]]))


def background_rgb(
    scene: Scene, ids: UInt16Array, renderer: Renderer, camera: PinholeCamera, world_T_camera: FloatArray
) -> UInt8Array:
    """(h, w, 3) sRGB of a scene given in the world frame; black where ids, the (h, w) id image, is 0."""
    seen = set(np.unique(ids).tolist())
    surfaces = surfaces_of([o for o in scene.objects if o.category.group == "structure" or o.object_id in seen])
    fine = _finer(camera, SUPERSAMPLE)
    triangle = triangles_seen(surfaces, renderer, fine, world_T_camera)
    rays = _rays(fine, world_T_camera)
    sources = sources_of(scene)
    illumination = Illumination(surfaces, sources)
    grid = _light_grid(illumination, triangle, rays)
    sun = Sun(sources.sun_towards, sources.sun, _sunlit(illumination, triangle, rays))
    exposure = sources.exposure(rays.eye[:2])
    rgb = encode_srgb(colour_pixels(triangle, rays, surfaces, grid, GRID_STEP, sun, exposure, SUPERSAMPLE))
    rgb[ids == 0] = 0
    return rgb


def _finer(camera: PinholeCamera, factor: int) -> PinholeCamera:
    """The camera with ``factor`` times the pixels across the same view."""
    return PinholeCamera(
        camera.width_px * factor, camera.height_px * factor,
        camera.fx_px * factor, camera.fy_px * factor, camera.cx_px * factor, camera.cy_px * factor,
    )  # fmt: skip


def _rays(camera: PinholeCamera, world_T_camera: FloatArray) -> Rays:
    right, down, forward = np.ascontiguousarray(world_T_camera[:3, :3].T)
    u, v = (0.5 - camera.cx_px) / camera.fx_px, (0.5 - camera.cy_px) / camera.fy_px
    eye = np.ascontiguousarray(world_T_camera[:3, 3])
    return Rays(eye, u * right + v * down + forward, right / camera.fx_px, down / camera.fy_px)


def _light_grid(illumination: Illumination, triangle: Int32Array, rays: Rays) -> LightGrid:
    """Smooth light at a point in the middle of every GRID_STEP x GRID_STEP samples."""
    start = GRID_STEP // 2
    coarse = triangle[start::GRID_STEP, start::GRID_STEP]
    position, normal = points_seen(triangle, rays, illumination.surfaces, start, GRID_STEP)
    valid = coarse >= 0
    rows, columns = np.nonzero(valid)
    p, n = position[valid], normal[valid]
    room = illumination.sources.room_of(p[:, :2] + INTO_ROOM_M * n[:, :2])
    few, many = (Points(p, n, room, places[rows % len(places), columns % len(places)], places.size) for places in TILES)

    def smooth(reach: int, *columns: FloatArray) -> FloatArray:
        light = np.zeros((*coarse.shape, 3 * len(columns)))
        light[valid] = np.concatenate(columns, axis=1)
        return smoothed(LightGrid(valid, position, normal, light), reach).light

    direct, bounced = illumination.direct(few, 0, LIGHT_RAYS), illumination.gathered(many, GATHER_RAYS)
    light = smooth(SOFT_REACH, bounced.total, bounced.towards, illumination.mirrored(many, rays.eye))
    light[..., :6] += smooth(SHARP_REACH, direct.total, direct.towards)
    return LightGrid(valid, position, normal, light)


def _sunlit(illumination: Illumination, triangle: Int32Array, rays: Rays) -> BoolArray:
    """(h, w) which samples the sun reaches."""
    position, normal = points_seen(triangle, rays, illumination.surfaces, 0, 1)
    return illumination.sunlit(position.reshape(-1, 3), normal.reshape(-1, 3)).reshape(triangle.shape)
