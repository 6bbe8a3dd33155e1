"""The picture of a room without people: textures, soft shadows, bounced light, mirrors; paid for once an episode.

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
from hsbench.synth.render.base import Renderer, Window
from hsbench.synth.render.colouring import Rays, Sun, colour_pixels, points_seen
from hsbench.synth.render.filtering import LightGrid, smoothed
from hsbench.synth.render.illumination import INTO_ROOM_M, Illumination, Points
from hsbench.synth.render.materials import SILVER
from hsbench.synth.render.mirrors import reflections
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
TILE_PX = TILES[1].shape[0] * GRID_STEP // SUPERSAMPLE  # windows begin with a tile
BORDER_PX = 16  # no light of farther points reaches a pixel: two averages and where it is read off


def background_rgb(
    scene: Scene,
    ids: UInt16Array,
    renderer: Renderer,
    camera: PinholeCamera,
    world_T_camera: FloatArray,
    window: Window | None = None,
) -> UInt8Array:
    """(h, w, 3) sRGB of a scene given in the world frame; black where ids, the id image of the full picture, is 0.

    ``window`` (default: the full picture) crops: its pixels equal those of the full picture.
    """
    window = window or Window.full(camera)
    seen = set(np.unique(ids).tolist())
    surfaces = surfaces_of([o for o in scene.objects if o.category.group == "structure" or o.object_id in seen])
    drawn = _with_surroundings(window, camera)
    fine, fine_window = camera.scaled(SUPERSAMPLE), _finer_window(drawn, SUPERSAMPLE)
    triangle = triangles_seen(surfaces, renderer, fine, world_T_camera, fine_window)
    rays = _rays(fine, world_T_camera, fine_window)
    sources = sources_of(scene)
    light = _display_light(Illumination(surfaces, sources), triangle, rays, sources.exposure(rays.eye[:2]))
    top, left = window.v0 - drawn.v0, window.u0 - drawn.u0
    rgb = encode_srgb(light[top : top + window.height, left : left + window.width])
    rgb[ids[window.v0 : window.v0 + window.height, window.u0 : window.u0 + window.width] == 0] = 0
    return rgb


def _with_surroundings(window: Window, camera: PinholeCamera) -> Window:
    """The window and all pixels whose light reaches it, begun with a tile: its points are the full picture's."""
    u0, v0 = (max(start - BORDER_PX, 0) // TILE_PX * TILE_PX for start in (window.u0, window.v0))
    u1 = min(window.u0 + window.width + BORDER_PX, camera.width_px)
    v1 = min(window.v0 + window.height + BORDER_PX, camera.height_px)
    return Window(u0, v0, u1 - u0, v1 - v0)


def _display_light(illumination: Illumination, triangle: Int32Array, rays: Rays, exposure: float) -> FloatArray:
    """(h, w, 3) display light of pixels of SUPERSAMPLE x SUPERSAMPLE samples, 0 where none shows a triangle."""
    mirrors = list(reflections(triangle, rays, illumination.surfaces, TILE_PX * SUPERSAMPLE))
    direct = triangle.copy()
    for mirror in mirrors:
        direct[mirror.rows, mirror.columns][mirror.triangle >= 0] = -1
    light = _coloured(illumination, direct, rays, exposure)
    for mirror in mirrors:
        part = light[tuple(slice(s.start // SUPERSAMPLE, s.stop // SUPERSAMPLE) for s in (mirror.rows, mirror.columns))]
        shown = _coloured(illumination, mirror.triangle, mirror.rays, SILVER * exposure)
        share = _share(mirror.triangle >= 0, triangle[mirror.rows, mirror.columns] >= 0)
        part += share[..., None] * (shown - part)
    return light


def _coloured(illumination: Illumination, triangle: Int32Array, rays: Rays, exposure: float) -> FloatArray:
    """(h, w, 3) display light of pixels of SUPERSAMPLE x SUPERSAMPLE samples that show triangles, not what they mirror.

    0 where no sample shows a triangle.
    """
    sources = illumination.sources
    grid = _light_grid(illumination, triangle, rays)
    sun = Sun(sources.sun_towards, sources.sun, _sunlit(illumination, triangle, rays))
    return colour_pixels(triangle, rays, illumination.surfaces, grid, GRID_STEP, sun, exposure, SUPERSAMPLE)


def _share(some: BoolArray, valid: BoolArray) -> FloatArray:
    """(h, w) share of the valid samples of each pixel that are among ``some``; both (H, W)."""
    h, w = (n // SUPERSAMPLE for n in some.shape)
    count, of = (a.reshape(h, SUPERSAMPLE, w, SUPERSAMPLE).sum(axis=(1, 3)) for a in (some, valid))
    return np.asarray(count / np.maximum(of, 1))


def _finer_window(window: Window, factor: int) -> Window:
    return Window(window.u0 * factor, window.v0 * factor, window.width * factor, window.height * factor)


def _rays(camera: PinholeCamera, world_T_camera: FloatArray, window: Window) -> Rays:
    right, down, forward = np.ascontiguousarray(world_T_camera[:3, :3].T)
    u, v = (window.u0 + 0.5 - camera.cx_px) / camera.fx_px, (window.v0 + 0.5 - camera.cy_px) / camera.fy_px
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
