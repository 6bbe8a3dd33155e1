"""The background: ids and depth untouched, what is hidden leaves no trace, light and shade are where they belong."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

pytest.importorskip("embreex")

from lit_room import CAMERA, POSE, part, scene, table, thing, wardrobe

from hsbench.errors import HsbenchError, SchemaError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.io.frame_store import Picture
from hsbench.io.images import depth_to_mm
from hsbench.schema import KINECT_V2, PoseTable, Scene, SceneObject, Sensor
from hsbench.synth.film import Filming, room_lighting
from hsbench.synth.render import Lighting, Renderer, Window, open_renderer, surfaces
from hsbench.synth.render.background import background_rgb
from hsbench.synth.render.materials import material
from hsbench.synth.render.textures import texture
from hsbench.synth.scene_meshes import scene_meshes
from hsbench.typing import FloatArray, UInt8Array, UInt16Array

SCENE = scene(wardrobe(), table())


@pytest.fixture(scope="module", params=["pyrender", "raycast"])
def renderer(request: pytest.FixtureRequest) -> Renderer:
    try:
        return open_renderer(request.param)
    except HsbenchError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def raycast() -> Renderer:
    return open_renderer("raycast")


def ids_of(room: Scene, renderer: Renderer, camera: PinholeCamera = CAMERA, pose: FloatArray = POSE) -> UInt16Array:
    return renderer.render(scene_meshes(room), camera, pose, Lighting(1.0)).ids


def picture(room: Scene, renderer: Renderer, camera: PinholeCamera = CAMERA, pose: FloatArray = POSE) -> UInt8Array:
    return background_rgb(room, ids_of(room, renderer, camera, pose), renderer, camera, pose)


def brightness(rgb: UInt8Array, where: np.ndarray) -> float:
    assert where.sum() > 20
    return float(rgb[where].mean())


def floor_points(renderer: Renderer, room: Scene) -> tuple[np.ndarray, np.ndarray]:
    """((h, w) bool the floor is seen, (h, w, 3) points in the world)."""
    view = renderer.render(scene_meshes(room), CAMERA, POSE, Lighting(1.0))
    return view.ids == 1, apply(POSE, CAMERA.unproject(view.depth_m))


# --- what a hidden object changes: nothing


def behind_the_wardrobe() -> SceneObject:
    return thing(20, "waste_bin", part("body", (3.3, 0.75, 0), (3.5, 0.95, 0.5), (250, 30, 30)))


def behind_the_camera() -> SceneObject:
    return thing(20, "sofa", part("body", (0.02, 1.5, 0), (0.3, 3.0, 2.3), (250, 30, 30)))


def between_pixel_centres() -> SceneObject:
    """A tall sliver before the wardrobe that covers samples of colour but no pixel's centre."""
    u, depth = 80.0, 1.6  # a border of two columns of pixels
    x, y, _ = apply(POSE, depth * np.array([[(u - CAMERA.cx_px) / CAMERA.fx_px, 0.0, 1.0]]))[0]
    half = 0.4 * depth / CAMERA.fx_px
    pole = part("pole", (-0.001, -half, 0), (0.001, half, 2.2), (250, 30, 30))
    return thing(20, "floor_lamp", pole, at=planar(x, y, 0.5))


def background(room: Scene, renderer: Renderer) -> Picture:
    """Of the scene moved into the frame of a sensor that stands at POSE."""
    sensor = Sensor("rgbd", CAMERA, 1.7, 0.35)
    room = room.moved(sensor.world_T_camera @ invert(POSE))
    joints = np.zeros((0, 25, 3), np.float32)
    none = np.zeros(0, np.int64)
    nobody = PoseTable(KINECT_V2.name, none, none.astype(np.int32), np.zeros((0, 25), np.uint8), joints)
    lights = room_lighting(room, sensor.world_T_camera[:2, 3])
    return Filming(room, (), nobody, sensor, renderer, lights).background()


@pytest.mark.parametrize("hidden", [behind_the_wardrobe, behind_the_camera, between_pixel_centres])
def test_an_object_without_a_pixel_leaves_no_trace(renderer: Renderer, hidden: Callable[[], SceneObject]) -> None:
    with_it, without = background(scene(wardrobe(), table(), hidden()), renderer), background(SCENE, renderer)
    assert 20 not in with_it.instance
    for name in ("rgb", "depth_mm", "instance"):
        assert np.array_equal(getattr(with_it, name), getattr(without, name))


def test_an_object_in_view_does_leave_traces_beyond_its_pixels(raycast: Renderer) -> None:
    bin_in_view = thing(20, "waste_bin", part("body", (1.6, 1.0, 0), (1.9, 1.3, 0.5), (250, 30, 30)))
    room = scene(wardrobe(), table(), bin_in_view)
    others = ids_of(room, raycast) != 20
    assert (picture(room, raycast) != picture(SCENE, raycast))[others].any(axis=-1).mean() > 0.05


# --- the same picture


def test_ids_and_depth_are_those_of_the_plain_scene(renderer: Renderer) -> None:
    found = background(SCENE, renderer)
    sensor = Sensor("rgbd", CAMERA, 1.7, 0.35)
    meshes = scene_meshes(SCENE.moved(sensor.world_T_camera @ invert(POSE)))
    plain = renderer.render(meshes, CAMERA, sensor.world_T_camera, Lighting(1.0))
    assert np.array_equal(found.instance, plain.ids)
    assert np.array_equal(found.depth_mm, depth_to_mm(plain.depth_m))


@pytest.mark.parametrize(
    "window", [Window(0, 0, 1, 1), Window(37, 41, 60, 33), Window(150, 90, 10, 30), Window(70, 0, 3, 120)]
)
def test_a_window_is_that_part_of_the_full_picture(renderer: Renderer, window: Window) -> None:
    ids = ids_of(SCENE, renderer)
    part_of = picture(SCENE, renderer)[window.v0 : window.v0 + window.height, window.u0 : window.u0 + window.width]
    assert np.array_equal(background_rgb(SCENE, ids, renderer, CAMERA, POSE, window), part_of)


def test_both_back_ends_give_the_same_picture() -> None:
    views = []
    for name in ("pyrender", "raycast"):
        try:
            views.append(picture(SCENE, open_renderer(name)).astype(int))  # type: ignore[arg-type]
        except HsbenchError as error:
            pytest.skip(str(error))
    difference = np.abs(views[0] - views[1])
    assert (difference.max(axis=-1) <= 1).mean() >= 0.99  # elsewhere a sample shows another triangle
    assert difference.mean() < 0.1


def test_the_same_bytes_again(renderer: Renderer) -> None:
    assert np.array_equal(picture(SCENE, renderer), picture(SCENE, renderer))


@pytest.mark.parametrize("yaw", [np.pi / 2, 2.1])
def test_the_frame_of_the_scene_does_not_matter(raycast: Renderer, yaw: float) -> None:
    """Textures stick to objects; lamps, sun and the view outside to the rooms."""
    a_T_scene = planar(1.3, -4.2, yaw)
    turned = picture(SCENE.moved(a_T_scene), raycast, pose=a_T_scene @ POSE)
    difference = np.abs(turned.astype(int) - picture(SCENE, raycast))
    assert (difference.max(axis=-1) <= 8).mean() > 0.98  # rays of light leave in other directions: a little noise
    assert difference.mean() < 1.0


# --- light


def test_nothing_is_clipped_or_black_and_the_window_is_brightest(raycast: Renderer) -> None:
    look = planar(2.0, 0.6, np.pi / 2) @ POSE_LEVEL
    ids, rgb = ids_of(SCENE, raycast, pose=look), picture(SCENE, raycast, pose=look)
    assert rgb.max() < 255
    assert rgb.max(axis=-1).min() > 4
    assert brightness(rgb, ids == 6) > brightness(rgb, np.isin(ids, (3, 4, 5))) + 15
    assert brightness(rgb, ids == 6) > 185


POSE_LEVEL = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0]])


def test_a_table_shades_the_floor_below_it(raycast: Renderer) -> None:
    with_table, without = scene(table(), floor_texture=""), scene(floor_texture="")
    floor, points = floor_points(raycast, with_table)
    below = floor & (np.hypot(points[..., 0] - 1.9, points[..., 1] - 2.2) < 0.25)
    change = picture(with_table, raycast).astype(int) - picture(without, raycast)
    assert change[below].mean() < -15
    far = floor & (np.hypot(points[..., 0] - 1.9, points[..., 1] - 2.2) > 1.5)
    assert abs(change[far].mean()) < 4


def test_a_room_behind_a_doorway_has_light_of_its_own(raycast: Renderer) -> None:
    floor, points = floor_points(raycast, scene())
    there = floor & (points[..., 0] > 4.2)
    assert brightness(picture(scene(), raycast), there) > 50


def test_the_texture_of_a_pixel_is_that_of_its_point(raycast: Renderer) -> None:
    """The ratio of a checked floor to a plain one, against the texture asked for each pixel's point."""
    tele = PinholeCamera(160, 120, 440.0, 440.0, 80.0, 60.0)
    room = scene(floor_texture="checks")
    view = raycast.render(scene_meshes(room), tele, POSE, Lighting(1.0))
    points = apply(POSE, tele.unproject(view.depth_m))[view.ids == 1]
    checked, plain = (picture(scene(floor_texture=t), raycast, tele)[view.ids == 1] for t in ("checks", ""))
    item = room.objects[0]
    look = material(item, item.parts[0])
    pixel = np.full(3, 0.01)  # about 3 m / 440 px, seen from the side
    share = [texture(look.texture, p + look.shift_m, pixel, 2, look.grain_axis)[2] for p in points]
    assert len(share) > 3000
    # The second colour of a light floor is dark.
    assert np.corrcoef(share, checked.mean(axis=-1) / plain.mean(axis=-1))[0, 1] < -0.9


def test_pixels_that_see_nothing_are_black(raycast: Renderer) -> None:
    room = Scene("open", SCENE.rooms, 2.5, (table(),))
    ids, rgb = ids_of(room, raycast), picture(room, raycast)
    assert (rgb[ids == 0] == 0).all()
    assert (rgb[ids > 0].max(axis=-1) > 0).all()


def test_more_triangles_than_colours_are_refused(raycast: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surfaces, "MAX_TRIANGLES", 11)
    with pytest.raises(SchemaError, match="at most 11"):
        picture(Scene("one", SCENE.rooms, 2.5, (wardrobe(),)), raycast)
