"""Mirrors against the law of reflection: each sample's path, and the picture of a thing where its image must be."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("embreex")

from lit_room import CAMERA, POSE, part, scene, table, thing, wardrobe

from hsbench.geometry.rays import pack_solids, segments_blocked
from hsbench.geometry.transforms import apply
from hsbench.schema import Scene, SceneObject
from hsbench.synth.render import Lighting, Renderer, Window, open_renderer
from hsbench.synth.render.background import background_rgb
from hsbench.synth.render.colouring import points_seen
from hsbench.synth.render.mirrors import Reflection, reflections
from hsbench.synth.render.rays import rays_of
from hsbench.synth.render.surfaces import Surfaces, surfaces_of, triangles_seen
from hsbench.synth.scene_meshes import scene_meshes
from hsbench.typing import UInt8Array, UInt16Array

GLASS_X_M = 3.98  # the plane of the mirror, on the wall to the other room, looking back along -x
EYE = POSE[:3, 3]
POST = np.array([[2.8, 3.1, 0.0], [3.1, 3.4, 2.0]])  # in view, and in the mirror
STEP = 32


def mirror() -> SceneObject:
    frame = part("frame", (GLASS_X_M + 0.01, 2.35, 0.75), (4.0, 3.5, 2.05))
    glass = part("glass", (GLASS_X_M, 2.4, 0.8), (GLASS_X_M + 0.01, 3.45, 2.0), (208, 218, 222))
    return thing(30, "mirror", frame, glass)


def red_post() -> SceneObject:
    low, high = ((float(x), float(y), float(z)) for x, y, z in POST)
    return thing(29, "bookshelf", part("post", low, high, (200, 30, 30)))


def beside_the_camera() -> SceneObject:
    """Out of the picture, but before the mirror."""
    return thing(20, "bookshelf", part("body", (0.05, 2.6, 0), (0.4, 3.5, 2.2), (30, 30, 250)))


SCENE = scene(wardrobe(), table(), red_post(), mirror())


@pytest.fixture(scope="module")
def raycast() -> Renderer:
    return open_renderer("raycast")


@pytest.fixture(scope="module")
def reflected(raycast: Renderer) -> tuple[Surfaces, Reflection, np.ndarray, np.ndarray]:
    """(Surfaces, the only reflection, (N, 3) places on the glass, (N,) triangles seen by way of them)."""
    surfaces = surfaces_of(SCENE.objects)
    everything = np.ones(len(surfaces.corners), dtype=np.bool_)
    triangle = triangles_seen(surfaces, everything, raycast, CAMERA, POSE, Window.full(CAMERA))
    rays = rays_of(CAMERA, POSE, Window.full(CAMERA))
    (found,) = reflections(triangle, rays, surfaces, STEP)
    position, _ = points_seen(triangle, rays, surfaces, 0, 1)
    shown = found.triangle >= 0
    return surfaces, found, position[found.rows, found.columns][shown], found.triangle[shown]


def test_each_path_obeys_the_law_of_reflection(
    reflected: tuple[Surfaces, Reflection, np.ndarray, np.ndarray],
) -> None:
    """It arrives as steeply as it leaves, its end lies on the triangle's front, and nothing stands in its way."""
    surfaces, found, glass, triangle = reflected
    assert len(triangle) > 500
    assert (found.rows.start % STEP, found.columns.start % STEP) == (0, 0)
    assert glass[:, 0] == pytest.approx(GLASS_X_M)
    seen = points_seen(found.triangle, found.rays, surfaces, 0, 1)[0][found.triangle >= 0]
    arriving, leaving = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (glass - EYE, seen - glass))
    assert leaving == pytest.approx(arriving * (-1, 1, 1), abs=1e-9)
    assert (np.einsum("ij,ij->i", leaving, surfaces.normals[triangle]) < 0).all()
    solids = pack_solids([s for item in SCENE.objects for s in item.solids])
    blocked = [
        segments_blocked(start + 0.004 * direction, (end - 0.004 * direction)[None], solids)[0]
        for start, end, direction in zip(glass[::3], seen[::3], leaving[::3], strict=True)
    ]
    assert np.mean(blocked) < 0.004  # single precision grazes an edge now and then


def test_rims_of_glass_are_no_mirrors() -> None:
    surfaces = surfaces_of([mirror()])
    everything = np.arange(len(surfaces.corners), dtype=np.int32)[None]
    rays = rays_of(CAMERA, POSE, Window.full(CAMERA))
    eyes = [found.rays.eye[0] for found in reflections(everything, rays, surfaces, 1)]
    assert sorted(eyes) == pytest.approx([2 * x - EYE[0] for x in (GLASS_X_M, GLASS_X_M + 0.01)])  # front and back


def picture(room: Scene, renderer: Renderer, window: Window | None = None) -> tuple[UInt8Array, UInt16Array]:
    ids = renderer.render(scene_meshes(room), CAMERA, POSE, Lighting(1.0)).ids
    return background_rgb(room, ids, renderer, CAMERA, POSE, window), ids


def test_a_post_is_red_where_its_image_must_be(raycast: Renderer) -> None:
    """The rays of the eye's image against the box, by slabs."""
    rgb, ids = picture(SCENE, raycast)
    v, u = np.nonzero(ids == 30)
    ends = apply(POSE, CAMERA.unproject(np.ones(ids.shape)))[v, u]
    image, ends = EYE * (-1, 1, 1), ends * (-1, 1, 1)
    image, ends = image + (2 * GLASS_X_M, 0, 0), ends + (2 * GLASS_X_M, 0, 0)
    t = (POST[:, None] - image) / (ends - image)
    expected = t.min(axis=0).max(axis=1) < t.max(axis=0).min(axis=1)
    at_glass = apply(POSE, CAMERA.unproject(raycast.render(scene_meshes(SCENE), CAMERA, POSE, Lighting(1.0)).depth_m))
    on_glass = np.abs(at_glass[v, u, 0] - GLASS_X_M) < 2e-3
    red = rgb[v, u, 0] > 1.8 * rgb[v, u, 1].astype(float)
    assert expected[on_glass].sum() > 60
    assert (red == expected)[on_glass].mean() > 0.97


def test_what_has_no_pixel_is_not_in_the_mirror_either(raycast: Renderer) -> None:
    rgb, ids = picture(SCENE, raycast)
    with_it, same_ids = picture(scene(wardrobe(), table(), beside_the_camera(), red_post(), mirror()), raycast)
    assert np.array_equal(ids, same_ids)
    assert np.array_equal(rgb, with_it)


@pytest.mark.parametrize("window", [Window(70, 20, 45, 40), Window(75, 30, 7, 3)])
def test_a_window_across_a_mirror_is_that_part_of_the_full_picture(raycast: Renderer, window: Window) -> None:
    full, ids = picture(SCENE, raycast)
    crop = (slice(window.v0, window.v0 + window.height), slice(window.u0, window.u0 + window.width))
    assert (ids[crop] == 30).any()
    assert np.array_equal(picture(SCENE, raycast, window)[0], full[crop])
