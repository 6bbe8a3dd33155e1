"""The picture of a room without people: textures, soft shadows, bounced light, mirrors; paid for once an episode.

Deferred shading: a renderer says which triangle each sample shows (``surfaces``); the rest is computed per sample from
that triangle's plane and the scene. Ids and depth are the renderer's own and no business of this module.

What cannot be seen must leave no trace in the picture, or its shadow would tell of it. So nothing takes part but the
structure of the rooms and the objects that own a pixel of the id image: others are not drawn, stop no light and send
none on. Two scenes that differ in an object without a pixel have the same background, byte by byte.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hsbench.geometry.cameras import Camera, EquirectangularCamera, TopDownCamera
from hsbench.schema.scene import Scene, SceneObject
from hsbench.synth.render.base import Renderer, Window
from hsbench.synth.render.colouring import Sun, colour_pixels, points_seen
from hsbench.synth.render.filtering import LightGrid, smoothed
from hsbench.synth.render.illumination import INTO_ROOM_M, Illumination, Points
from hsbench.synth.render.materials import SILVER
from hsbench.synth.render.mirrors import reflections
from hsbench.synth.render.rays import Rays, rays_of
from hsbench.synth.render.sources import Sources, sources_of
from hsbench.synth.render.still import Coloured, Known, Still
from hsbench.synth.render.surfaces import Surfaces, surfaces_of, triangles_seen
from hsbench.synth.render.tone import encode_srgb
from hsbench.typing import BoolArray, FloatArray, Int32Array, UInt8Array, UInt16Array

SUPERSAMPLE = 2  # samples across a pixel
GRID_STEP = 4  # samples between points of light
LIGHT_RAYS = 4  # from a point to each lamp and window
GATHER_RAYS = 5  # from a point to other surfaces
FINE_GATHER_RAYS = 10  # where a light is drawn alone: it may be exposed far longer than beside others
SHARP_REACH, SOFT_REACH = 2, 4  # of the averages: half of the tiles below, for shadows and for bounced light
# Places of neighbours in a tile of samples: Bayer's matrices, which give them far members of the sequence.
_BAYER_2 = np.array([[0, 2], [3, 1]])
_BAYER_4 = np.block([[4 * _BAYER_2, 4 * _BAYER_2 + 2], [4 * _BAYER_2 + 3, 4 * _BAYER_2 + 1]])
TILES = (_BAYER_4, np.block([[4 * _BAYER_4, 4 * _BAYER_4 + 2], [4 * _BAYER_4 + 3, 4 * _BAYER_4 + 1]]))
TILE_PX = TILES[1].shape[0] * GRID_STEP // SUPERSAMPLE  # windows begin with a tile
BORDER_PX = 16  # no light of farther points reaches a pixel: two averages and where it is read off
BAND_PX = 2**19  # larger pictures are made band by band, so that memory does not grow with them


class Drawing(NamedTuple):
    """How light becomes a picture: multiplied by ``exposure``, and where ``on_display`` toned to 0..1.

    gather_rays: from a point to other surfaces.
    """

    exposure: float
    on_display: bool
    gather_rays: int


class _Band(NamedTuple):
    """Rows of a window, the window drawn for them, and the triangle and ray of each sample of that."""

    rows: Window
    drawn: Window
    triangle: Int32Array
    rays: Rays


class _Seen(NamedTuple):
    """What a window shows: of which objects, band by band, and the (h, w) pixels that show nothing."""

    window: Window
    objects: list[SceneObject]
    surfaces: Surfaces
    bands: list[_Band]
    hidden: BoolArray


def background_rgb(
    scene: Scene,
    ids: UInt16Array,
    renderer: Renderer,
    camera: Camera,
    world_T_camera: FloatArray,
    window: Window | None = None,
    still: Still | None = None,
) -> UInt8Array:
    """(h, w, 3) sRGB of a scene given in the world frame; black where ids, the id image of the full picture, is 0.

    ``window`` (default: the full picture) crops: its pixels equal those of the full picture.
    still: of the same view while things were elsewhere. Pixels whose light has changed by less than ``LEAST_LIGHT``
    since are taken from it.
    """
    seen = _seen(scene, ids, renderer, camera, world_T_camera, window)
    sources, drawing = _on_display(scene, world_T_camera)
    light, _ = _pictured(seen, sources, drawing, still)
    return encode_srgb(light)


def still_background(
    scene: Scene, ids: UInt16Array, renderer: Renderer, camera: Camera, world_T_camera: FloatArray
) -> tuple[UInt8Array, Still | None]:
    """``background_rgb`` of the full picture, and what windows of later ones may take over; None of very large ones."""
    seen = _seen(scene, ids, renderer, camera, world_T_camera, None)
    light, coloured = _pictured(seen, *_on_display(scene, world_T_camera))
    return encode_srgb(light), Still(seen.objects, coloured[0]) if len(coloured) == 1 else None


def lit_by(
    lights: Iterable[Sources],
    drawing: Drawing,
    scene: Scene,
    ids: UInt16Array,
    renderer: Renderer,
    camera: Camera,
    world_T_camera: FloatArray,
    window: Window | None = None,
) -> Iterator[FloatArray]:
    """(h, w, 3) light of the same view under each of ``lights``, whatever the scene's own; else as ``background_rgb``.

    Where it is not on the display it is linear in the sources.
    """
    seen = _seen(scene, ids, renderer, camera, world_T_camera, window)
    for sources in lights:
        light, _ = _pictured(seen, sources, drawing)
        yield light


def _on_display(scene: Scene, world_T_camera: FloatArray) -> tuple[Sources, Drawing]:
    """The lights of a scene, and how they become a picture."""
    sources = sources_of(scene)
    return sources, Drawing(sources.exposure(world_T_camera[:2, 3]), on_display=True, gather_rays=GATHER_RAYS)


def _seen(
    scene: Scene, ids: UInt16Array, renderer: Renderer, camera: Camera, world_T_camera: FloatArray,
    window: Window | None,
) -> _Seen:  # fmt: skip
    window = window or Window.full(camera)
    owners = set(np.unique(ids).tolist())
    objects = [o for o in scene.objects if o.category.group == "structure" or o.object_id in owners]
    surfaces = surfaces_of(objects)
    shown = _is_shown(objects, camera)[surfaces.part]
    fine = camera.scaled(SUPERSAMPLE)
    bands = []
    for rows in _bands(window):
        drawn = _with_surroundings(rows, camera)
        finer = _finer_window(drawn, SUPERSAMPLE)
        triangle = triangles_seen(surfaces, shown, renderer, fine, world_T_camera, finer)
        bands.append(_Band(rows, drawn, triangle, rays_of(fine, world_T_camera, finer)))
    hidden = ids[window.v0 : window.v0 + window.height, window.u0 : window.u0 + window.width] == 0
    return _Seen(window, objects, surfaces, bands, hidden)


def _pictured(
    seen: _Seen, sources: Sources, drawing: Drawing, still: Still | None = None
) -> tuple[FloatArray, list[Coloured]]:
    """((h, w, 3) light of a window, what it follows from in each band)."""
    window, illumination = seen.window, Illumination(seen.surfaces, sources)
    picture, all_coloured = np.empty((window.height, window.width, 3)), []
    for band, drawn, triangle, rays in seen.bands:
        known = None if still is None else still.cut(drawn, seen.objects)
        coloured, light = _light(illumination, triangle, rays, drawing, known)
        top, left = band.v0 - drawn.v0, band.u0 - drawn.u0
        rows = slice(band.v0 - window.v0, band.v0 - window.v0 + band.height)
        picture[rows] = light[top : top + band.height, left : left + band.width]
        all_coloured.append(coloured)
    picture[seen.hidden] = 0.0
    return picture, all_coloured


def _is_shown(objects: Sequence[SceneObject], camera: Camera) -> BoolArray:
    """(P,) which parts of the objects a camera may see: one from above, no ceiling."""
    from_above = isinstance(camera, TopDownCamera)
    shown = [not (from_above and item.category_name == "ceiling") for item in objects]
    return np.repeat(np.array(shown, dtype=np.bool_), [len(item.parts) for item in objects])


def _bands(window: Window) -> Iterator[Window]:
    """The window in bands of whole rows, from the top, of some BAND_PX pixels."""
    rows = max(BAND_PX // window.width, TILE_PX)
    for v0 in range(window.v0, window.v0 + window.height, rows):
        yield Window(window.u0, v0, window.width, min(rows, window.v0 + window.height - v0))


def _with_surroundings(window: Window, camera: Camera) -> Window:
    """The window and all pixels whose light reaches it, begun with a tile: its points are the full picture's.

    All columns of a sphere where these go on beyond its seam.
    """
    u0, v0 = (max(start - BORDER_PX, 0) // TILE_PX * TILE_PX for start in (window.u0, window.v0))
    u1 = min(window.u0 + window.width + BORDER_PX, camera.width_px)
    v1 = min(window.v0 + window.height + BORDER_PX, camera.height_px)
    if isinstance(camera, EquirectangularCamera) and (window.u0 < BORDER_PX or u1 == camera.width_px):
        u0, u1 = 0, camera.width_px
    return Window(u0, v0, u1 - u0, v1 - v0)


def _light(
    illumination: Illumination, triangle: Int32Array, rays: Rays, drawing: Drawing, known: Known | None
) -> tuple[Coloured, FloatArray]:
    """(what is not mirrored, (h, w, 3) light) of pixels of SUPERSAMPLE x SUPERSAMPLE samples.

    0 where none shows a triangle.
    """
    mirrors = list(reflections(triangle, rays, illumination.surfaces, TILE_PX * SUPERSAMPLE))
    direct = triangle.copy()
    for mirror in mirrors:
        direct[mirror.rows, mirror.columns][mirror.triangle >= 0] = -1
    coloured = _coloured(illumination, direct, rays, drawing, known)
    light = coloured.light.copy() if mirrors else coloured.light
    for mirror in mirrors:
        part = light[tuple(slice(s.start // SUPERSAMPLE, s.stop // SUPERSAMPLE) for s in (mirror.rows, mirror.columns))]
        dimmed = drawing._replace(exposure=SILVER * drawing.exposure)
        shown = _coloured(illumination, mirror.triangle, mirror.rays, dimmed).light
        share = _share(mirror.triangle >= 0, triangle[mirror.rows, mirror.columns] >= 0)
        part += share[..., None] * (shown - part)
    return coloured, light


def _coloured(
    illumination: Illumination, triangle: Int32Array, rays: Rays, drawing: Drawing, known: Known | None = None
) -> Coloured:
    """Pixels of SUPERSAMPLE x SUPERSAMPLE samples that show triangles, not what they mirror.

    Black where no sample shows a triangle.
    """
    sources = illumination.sources
    grid = _light_grid(illumination, triangle, rays, drawing.gather_rays)
    sunlit = _sunlit(illumination, triangle, rays)
    sun = Sun(sources.sun_towards, sources.sun, sunlit, sources.outside, sources.outlook)
    h, w = (n // SUPERSAMPLE for n in triangle.shape)
    wanted, light = np.ones((h, w), dtype=np.bool_), np.zeros((h, w, 3))
    if known is not None:
        wanted, light = known.changed(triangle, sunlit, grid.light, GRID_STEP), known.earlier.light.copy()
    colour_pixels(
        triangle, rays, illumination.surfaces, grid, GRID_STEP, sun, drawing.exposure, SUPERSAMPLE, drawing.on_display,
        wanted, light,
    )  # fmt: skip
    return Coloured(triangle, sunlit, grid.light, light)


def _share(some: BoolArray, valid: BoolArray) -> FloatArray:
    """(h, w) share of the valid samples of each pixel that are among ``some``; both (H, W)."""
    h, w = (n // SUPERSAMPLE for n in some.shape)
    count, of = (a.reshape(h, SUPERSAMPLE, w, SUPERSAMPLE).sum(axis=(1, 3)) for a in (some, valid))
    return np.asarray(count / np.maximum(of, 1))


def _finer_window(window: Window, factor: int) -> Window:
    return Window(window.u0 * factor, window.v0 * factor, window.width * factor, window.height * factor)


def _light_grid(illumination: Illumination, triangle: Int32Array, rays: Rays, gather_rays: int) -> LightGrid:
    """Smooth light at a point in the middle of every GRID_STEP x GRID_STEP samples."""
    start = GRID_STEP // 2
    coarse = triangle[start::GRID_STEP, start::GRID_STEP]
    position, normal = points_seen(triangle, rays, illumination.surfaces, start, GRID_STEP)
    valid = coarse >= 0
    rows, columns = np.nonzero(valid)
    goes_round = rays.goes_round(triangle.shape[1])
    p, n = position[valid], normal[valid]
    room = illumination.sources.room_of(p[:, :2] + INTO_ROOM_M * n[:, :2])
    few, many = (Points(p, n, room, places[rows % len(places), columns % len(places)], places.size) for places in TILES)

    def smooth(reach: int, *columns: FloatArray) -> FloatArray:
        light = np.zeros((*coarse.shape, 3 * len(columns)))
        light[valid] = np.concatenate(columns, axis=1)
        return smoothed(LightGrid(valid, position, normal, light, goes_round), reach).light

    direct, bounced = illumination.direct(few, 0, LIGHT_RAYS), illumination.gathered(many, gather_rays)
    light = smooth(SOFT_REACH, bounced.total, bounced.towards, illumination.mirrored(many, rays.eye))
    light[..., :6] += smooth(SHARP_REACH, direct.total, direct.towards)
    return LightGrid(valid, position, normal, light, goes_round)


def _sunlit(illumination: Illumination, triangle: Int32Array, rays: Rays) -> BoolArray:
    """(h, w) which samples the sun reaches."""
    if not illumination.sources.sun.any():
        return np.zeros(triangle.shape, dtype=np.bool_)
    position, normal = points_seen(triangle, rays, illumination.surfaces, 0, 1)
    return illumination.sunlit(position.reshape(-1, 3), normal.reshape(-1, 3)).reshape(triangle.shape)
