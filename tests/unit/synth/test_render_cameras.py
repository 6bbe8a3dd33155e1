"""Every camera through the renderer and the background: true rays, no seam, no first row, a plan from above."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("embreex")

from lit_room import HEIGHT_M, THERE, part, scene, table, thing, wardrobe

from hsbench.geometry.cameras import BrownCamera, Camera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.cameras import world_T_camera as standing
from hsbench.geometry.polygons import contains
from hsbench.geometry.transforms import apply, planar
from hsbench.synth.render import Lighting, Renderer, Window, background, open_renderer
from hsbench.synth.render.background import background_rgb
from hsbench.synth.render.base import CUT_M
from hsbench.synth.render.rays import Rays, directions, rays_of
from hsbench.synth.scene_meshes import scene_meshes
from hsbench.truth.sight import ray_image
from hsbench.typing import FloatArray, UInt8Array

LAMP = thing(20, "ceiling_lamp", part("shade", (1.0, 2.8, 2.35), (1.3, 3.1, 2.5)))
POLE = thing(21, "coat_rack", part("pole", (3.6, 3.0, 0.0), (3.7, 3.1, 2.42)))
ROOM = scene(wardrobe(), table(), LAMP, POLE)
SPHERE = EquirectangularCamera(256, 128)
LENS = BrownCamera(160, 120, 82.0, 82.0, 80.0, 60.0, -0.2, 0.04, 0.001, -0.001, -0.0035)
ABOVE = TopDownCamera(180, 120, 0.05)
HERE = planar(1.4, 1.2, 0.7) @ standing(1.6, 0.0)
CORNER = planar(0.2, 0.25, 0.7) @ standing(2.2, 0.5)
PLAN = planar(3.4, 1.8, math.pi / 2)


@pytest.fixture(scope="module")
def raycast() -> Renderer:
    return open_renderer("raycast")


def picture(raycast: Renderer, camera: Camera, pose: FloatArray, window: Window | None = None) -> UInt8Array:
    ids = raycast.render(scene_meshes(ROOM), camera, pose, Lighting(1.0)).ids
    return background_rgb(ROOM, ids, raycast, camera, pose, window)


# --- ids and depth


@pytest.mark.parametrize(("camera", "pose"), [(SPHERE, HERE), (LENS, CORNER)], ids=["sphere", "lens"])
def test_ids_and_depth_are_those_of_exact_rays(raycast: Renderer, camera: Camera, pose: FloatArray) -> None:
    view = raycast.render(scene_meshes(ROOM), camera, pose, Lighting(1.0))
    assert not isinstance(camera, TopDownCamera)
    image = ray_image(ROOM, camera, pose)
    ids = np.array([item.object_id for item in ROOM.objects])[image.owner]
    assert (view.ids == ids).mean() >= 0.999
    assert (np.abs(view.depth_m - image.depth_m) < 1e-4).mean() >= 0.999
    assert (view.ids > 0).all()


def test_another_back_end_leaves_them_to_the_ray_caster(raycast: Renderer) -> None:
    try:
        pyrender = open_renderer("pyrender")
    except Exception as error:  # which one depends on what is missing
        pytest.skip(str(error))
    for camera, pose in ((SPHERE, HERE), (LENS, CORNER), (ABOVE, PLAN)):
        a, b = (r.render(scene_meshes(ROOM), camera, pose, Lighting(0.7)) for r in (pyrender, raycast))
        assert all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("rgb", "depth_m", "ids"))


@pytest.mark.parametrize(("camera", "pose"), [(SPHERE, HERE), (LENS, CORNER), (ABOVE, PLAN)], ids=["s", "l", "a"])
def test_a_window_equals_the_same_pixels(
    raycast: Renderer, camera: Camera, pose: FloatArray, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = Window(21, 13, 77, 50)
    full = raycast.render(scene_meshes(ROOM), camera, pose, Lighting(0.7))
    monkeypatch.setattr("hsbench.synth.render.raycast_backend.BLOCK_RAYS", 1000)
    small = raycast.render(scene_meshes(ROOM), camera, pose, Lighting(0.7), window)
    for name in ("rgb", "depth_m", "ids"):
        assert np.array_equal(getattr(small, name), getattr(full, name)[13:63, 21:98])


# --- from above


def test_a_plan_shows_what_stands_below_the_cut(raycast: Renderer) -> None:
    """Heights by the boxes of the room, looked up at the middle of every cell."""
    view = raycast.render(scene_meshes(ROOM), ABOVE, PLAN, Lighting(1.0))
    xy = apply(PLAN, ABOVE.origins())[..., :2]
    within = {}
    for object_id, (low, high) in {10: ((2.6, 0.5), (3.2, 1.1)), 21: ((3.6, 3.0), (3.7, 3.1))}.items():
        within[object_id] = ((xy > low) & (xy < high)).all(axis=-1)
    assert within[10].sum() > 100
    assert (view.ids[within[10]] == 10).all()
    assert (view.depth_m[within[10]] == np.float32(2.0)).all()
    assert (view.ids[within[21]] == 21).all()  # reaches through the cut
    assert (view.depth_m[within[21]] == np.float32(CUT_M)).all()
    assert not np.isin(view.ids, [2, 20]).any()  # the ceiling, and a lamp that hangs from it
    there = contains(THERE, xy)
    assert (view.ids[there] == 1).all()
    assert (view.depth_m[there] == 0.0).all()
    walls = (view.ids >= 3) & (view.ids <= 5)
    assert walls.sum() > 500
    cut_through = walls & (view.depth_m == np.float32(CUT_M))
    assert cut_through.sum() > 0.7 * walls.sum()  # all but the sill of the window
    points = apply(PLAN, ABOVE.unproject(view.depth_m))[view.ids == 11]
    assert ((points[:, 2] > 0.6) & (points[:, 2] < 0.75)).mean() > 0.99  # the top of the table


def test_a_plan_is_lit_below_and_dark_where_walls_are_cut(raycast: Renderer) -> None:
    rgb = picture(raycast, ABOVE, PLAN)
    view = raycast.render(scene_meshes(ROOM), ABOVE, PLAN, Lighting(1.0))
    floor, walls = (view.ids == 1) & (view.depth_m == 0), (view.ids == 5) & (view.depth_m > 2)
    assert rgb[floor].mean() > 70
    assert rgb[walls].mean() < 0.75 * rgb[floor].mean()
    assert (rgb[view.ids == 0] == 0).all()


# --- the background


def test_a_turned_sphere_shows_the_same_moved_along(raycast: Renderer) -> None:
    """Nothing marks a first column: light, textures and windows turn with the camera, by whole tiles of its grid."""
    columns = 3 * background.TILE_PX
    turn = 2 * math.pi * columns / SPHERE.width_px
    here = picture(raycast, SPHERE, HERE).astype(np.int16)
    turned = picture(raycast, SPHERE, planar(1.4, 1.2, 0.7 - turn) @ standing(1.6, 0.0)).astype(np.int16)
    difference = np.abs(np.roll(turned, columns, axis=1) - here).max(axis=-1)
    assert (difference <= 1).mean() > 0.998  # a ray through an edge, or the rim of a shadow, may go either way


@pytest.mark.parametrize(
    ("camera", "pose", "window"),
    [
        (SPHERE, HERE, Window(0, 40, 20, 30)),
        (SPHERE, HERE, Window(200, 90, 56, 38)),
        (SPHERE, HERE, Window(97, 3, 41, 60)),
        (LENS, CORNER, Window(61, 33, 50, 41)),
        (ABOVE, PLAN, Window(61, 33, 50, 41)),
    ],
)
def test_a_window_is_that_part_of_the_full_picture(
    raycast: Renderer, camera: Camera, pose: FloatArray, window: Window
) -> None:
    part = picture(raycast, camera, pose)[window.v0 : window.v0 + window.height, window.u0 : window.u0 + window.width]
    assert np.array_equal(picture(raycast, camera, pose, window), part)


def test_bands_leave_no_trace(raycast: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = picture(raycast, SPHERE, HERE)
    monkeypatch.setattr(background, "BAND_PX", 40 * SPHERE.width_px)
    assert np.array_equal(picture(raycast, SPHERE, HERE), whole)


def test_one_point_has_one_colour_in_every_camera(raycast: Renderer) -> None:
    """The matt floor far from edges, seen by pinhole, lens and sphere of one place, and from above."""
    eye = planar(1.4, 1.2, 0.7) @ standing(1.6, 0.5)
    pinhole = PinholeCamera(160, 120, 80.0, 80.0, 80.0, 60.0)
    plain, view = picture(raycast, pinhole, eye), raycast.render(scene_meshes(ROOM), pinhole, eye, Lighting(1.0))
    floor = np.argwhere((view.ids == 1) & (view.depth_m < 2.0))[::37]
    points = apply(eye, pinhole.unproject(view.depth_m))[floor[:, 0], floor[:, 1]]
    mine = plain[floor[:, 0], floor[:, 1]].astype(float).mean(axis=1)
    for camera, pose in ((LENS, eye), (SPHERE, HERE), (ABOVE, PLAN)):
        pixels, _ = camera.project(apply(np.linalg.inv(pose), points))
        shown = camera.contains(pixels)
        assert shown.sum() > 20
        column, row = pixels[shown].astype(int).T
        theirs = picture(raycast, camera, pose)[row, column].astype(float).mean(axis=1)
        assert np.median(np.abs(theirs - mine[shown])) < 5.0


# --- rays for compiled code


def sample_rays(rays: Rays, shape: tuple[int, int]) -> FloatArray:
    rows, columns = np.indices(shape)
    return directions(rays, rows.ravel(), columns.ravel()).reshape(*shape, 3)


@pytest.mark.parametrize("camera", [SPHERE, LENS, PinholeCamera(60, 40, 50.0, 51.0, 29.0, 21.0)])
def test_compiled_rays_are_the_cameras(camera: Camera) -> None:
    window = Window(7, 5, 40, 30)
    found = sample_rays(rays_of(camera, CORNER, window), (30, 40))
    expected = camera.rays()[5:35, 7:47] @ CORNER[:3, :3].T
    assert np.allclose(found, expected, rtol=0, atol=3e-12)
    later = rays_of(camera, CORNER, window).part(4, 9)
    assert np.allclose(sample_rays(later, (26, 31)), expected[4:, 9:], rtol=0, atol=3e-12)


def test_compiled_rays_from_above_reach_their_points() -> None:
    rays = rays_of(ABOVE, PLAN, Window.full(ABOVE))
    points = apply(PLAN, ABOVE.unproject(np.full((120, 180), HEIGHT_M)))
    way = sample_rays(rays, (120, 180))
    height = (points[..., 2:] - rays.eye[2]) / way[..., 2:]
    assert np.abs(rays.eye + height * way - points).max() < 2e-4


def test_only_a_whole_sphere_goes_round() -> None:
    whole, half = rays_of(SPHERE, HERE, Window.full(SPHERE)), rays_of(SPHERE, HERE, Window(0, 0, 128, 128))
    assert whole.goes_round(256)
    assert not half.goes_round(128)
    assert not rays_of(ABOVE, PLAN, Window.full(ABOVE)).goes_round(180)
