"""Camera models: conventions by hand, OpenCV's distortion, and that projecting undoes unprojecting."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import BrownCamera, EquirectangularCamera, PinholeCamera, TopDownCamera, world_T_camera
from hsbench.geometry.transforms import apply, is_rigid

SIDES = st.integers(1, 40)
PINHOLES = st.builds(
    PinholeCamera,
    SIDES,
    SIDES,
    st.floats(5.0, 500.0),
    st.floats(5.0, 500.0),
    st.floats(-10.0, 50.0),
    st.floats(-10.0, 50.0),
)
PINHOLE = PinholeCamera(8, 6, 7.0, 7.0, 4.0, 3.0)
SPHERES = st.integers(1, 24).map(lambda h: EquirectangularCamera(2 * h, h))
LENSES = (
    BrownCamera(64, 48, 33.0, 33.0, 32.0, 24.0, -0.2, 0.04, 0.0, 0.0, -0.0035),  # barrel, 103 degrees across
    BrownCamera(64, 48, 45.0, 46.0, 30.0, 25.0, 0.1, 0.02, 0.0, 0.0, 0.0),  # pincushion
    BrownCamera(51, 42, 36.5, 36.5, 26.1, 20.6, 0.0956, -0.277, 0.0, 0.0, 0.0975),  # a Kinect v2's, at a tenth
    BrownCamera(64, 48, 50.0, 50.0, 32.0, 24.0, -0.1, 0.01, 0.003, -0.002, 0.0),  # leaning
)
SEEDS = st.integers(0, 2**32 - 1)


def pixel_centres(width: int, height: int) -> np.ndarray:
    return np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), axis=-1)


# ---------------------------------------------------------------- pinhole


def test_pinhole_by_hand() -> None:
    camera = PinholeCamera(640, 480, 500.0, 400.0, 320.0, 240.0)
    pixels, depth = camera.project(np.array([[0.0, 0.0, 2.0], [1.0, 0.5, 2.0], [-1.0, -1.0, 4.0]]))
    assert pixels.tolist() == [[320.0, 240.0], [570.0, 340.0], [195.0, 140.0]]
    assert depth.tolist() == [2.0, 2.0, 4.0]


def test_a_pixel_has_its_centre_at_a_half() -> None:
    camera = PinholeCamera(4, 2, 2.0, 2.0, 2.0, 1.0)
    rays = camera.rays()
    assert rays[0, 0].tolist() == [(0.5 - 2.0) / 2.0, (0.5 - 1.0) / 2.0, 1.0]
    assert rays[1, 3].tolist() == [(3.5 - 2.0) / 2.0, (1.5 - 1.0) / 2.0, 1.0]
    assert camera.contains(np.array([[0.0, 0.0], [3.999, 1.999], [4.0, 0.0], [0.0, 2.0], [-1e-9, 0.0]])).tolist() == [
        True, True, False, False, False,
    ]  # fmt: skip


@given(PINHOLES)
def test_pinhole_rays_go_through_pixel_centres(camera: PinholeCamera) -> None:
    pixels, depth = camera.project(camera.rays() * 3.0)
    assert np.allclose(pixels, pixel_centres(camera.width_px, camera.height_px), rtol=0, atol=1e-9)
    assert np.array_equal(depth, np.full((camera.height_px, camera.width_px), 3.0))
    assert camera.contains(pixels).all()


@given(PINHOLES, SEEDS)
def test_pinhole_unproject_has_the_given_depth(camera: PinholeCamera, seed: int) -> None:
    depth_m = np.random.default_rng(seed).uniform(0.1, 10.0, (camera.height_px, camera.width_px))
    pixels, depth = camera.project(camera.unproject(depth_m))
    assert np.array_equal(depth, depth_m)
    assert np.allclose(pixels, pixel_centres(camera.width_px, camera.height_px), rtol=0, atol=1e-9)


def test_a_scaled_camera_sees_the_same_in_more_pixels() -> None:
    camera = PinholeCamera(64, 48, 50.0, 51.0, 31.0, 25.0)
    points = np.random.default_rng(0).uniform((-1, -1, 1), (1, 1, 3), (20, 3))
    assert np.allclose(camera.scaled(3).project(points)[0], 3 * camera.project(points)[0])
    assert (camera.scaled(3).width_px, camera.scaled(3).height_px) == (192, 144)
    assert camera.scaled(1 / 10).width_px == 6


def test_missing_depth_unprojects_to_the_camera() -> None:
    camera = PinholeCamera(3, 2, 2.0, 2.0, 1.5, 1.0)
    assert not camera.unproject(np.zeros((2, 3), dtype=np.float32)).any()


@pytest.mark.parametrize("z", [0.0, -1e-9, -5.0])
def test_points_not_in_front_have_no_pixel(z: float) -> None:
    camera = PinholeCamera(640, 480, 500.0, 500.0, 320.0, 240.0)
    pixels, depth = camera.project(np.array([[0.0, 0.0, z], [1.0, 2.0, z]]))
    assert np.isnan(pixels).all()
    assert (depth == z).all()
    assert not camera.contains(pixels).any()


# ---------------------------------------------------------------- distorted


def opencv_pixel(camera: BrownCamera, x: float, y: float) -> list[float]:
    """The formulas of OpenCV's documentation of calib3d, written out."""
    r2 = x**2 + y**2
    radial = 1 + camera.k1 * r2 + camera.k2 * r2**2 + camera.k3 * r2**3
    u = x * radial + 2 * camera.p1 * x * y + camera.p2 * (r2 + 2 * x**2)
    v = y * radial + camera.p1 * (r2 + 2 * y**2) + 2 * camera.p2 * x * y
    return [camera.fx_px * u + camera.cx_px, camera.fy_px * v + camera.cy_px]


@pytest.mark.parametrize("camera", LENSES)
def test_distortion_is_that_of_opencv(camera: BrownCamera) -> None:
    for x, y in np.random.default_rng(0).uniform(-0.4, 0.4, (20, 2)):
        pixels, depth = camera.project(np.array([2 * x, 2 * y, 2.0]))
        assert pixels == pytest.approx(opencv_pixel(camera, x, y), abs=1e-10)
        assert depth == 2.0


@pytest.mark.parametrize("camera", LENSES)
def test_rays_invert_the_distortion(camera: BrownCamera) -> None:
    rays = camera.rays()
    assert (rays[..., 2] == 1.0).all()
    back = np.array([[opencv_pixel(camera, x, y) for x, y, _ in row] for row in rays])
    assert np.abs(back - pixel_centres(camera.width_px, camera.height_px)).max() < 1e-9 * camera.fx_px
    points = camera.unproject(np.full((camera.height_px, camera.width_px), 3.0, dtype=np.float32))
    assert np.abs(camera.project(points)[0] - pixel_centres(camera.width_px, camera.height_px)).max() < 1e-7


@given(st.sampled_from(LENSES), st.floats(0, 2 * np.pi), st.floats(0.0, 1e3))
def test_what_lies_beyond_the_picture_has_no_pixel_in_it(camera: BrownCamera, angle: float, beyond: float) -> None:
    """However the polynomial turns back there; and pixels go on outwards without a jump."""
    way = np.array([np.cos(angle), np.sin(angle), 0.0])
    far = camera.project((1 + 1e-9 + beyond) * camera.reach * way + (0.0, 0.0, 1.0))[0]
    assert not camera.contains(far)
    assert np.isfinite(far).all()
    at, after = (camera.project(s * camera.reach * way + (0.0, 0.0, 1.0))[0] for s in (1 - 1e-9, 1 + 1e-9))
    assert np.abs(at - after).max() < 1e-5


def test_a_lens_without_distortion_is_a_pinhole() -> None:
    numbers = (31, 20, 25.0, 24.0, 15.0, 10.5)
    plain, lens = PinholeCamera(*numbers), BrownCamera(*numbers)
    points = np.random.default_rng(0).uniform((-1, -1, -1), (1, 1, 3), (200, 3))
    assert np.allclose(lens.project(points)[0], plain.project(points)[0], rtol=0, atol=1e-9, equal_nan=True)
    assert np.allclose(lens.rays(), plain.rays(), rtol=0, atol=1e-12)
    assert lens.scaled(2) == BrownCamera(62, 40, 50.0, 48.0, 30.0, 21.0)


# ---------------------------------------------------------------- equirectangular


def test_directions_of_the_sphere_by_hand() -> None:
    camera = EquirectangularCamera(360, 180)  # a pixel a degree
    s = np.sqrt(0.5)
    points = np.array(
        [[0, 0, 2], [1, 0, 0], [-1, 0, 0], [0, -s, s], [0, s, s], [s, 0, s]],  # x right, y down, z forward
        dtype=np.float64,
    )
    pixels, range_m = camera.project(points)
    expected = [[180, 90], [270, 90], [90, 90], [180, 45], [180, 135], [225, 90]]
    assert np.allclose(pixels, expected, rtol=0, atol=1e-9)
    assert np.allclose(range_m, [2, 1, 1, 1, 1, 1], rtol=0, atol=1e-15)


def test_poles_and_the_seam_stay_in_the_image() -> None:
    camera = EquirectangularCamera(1024, 512)
    points = [[0, -1, 0], [0, 1, 0], [0.0, 0, -1], [-0.0, 0, -1], [1e-12, 0, -1], [-1e-12, 0, -1], [-1e-300, 0, -1]]
    pixels, _ = camera.project(np.array(points))
    assert ((pixels >= 0) & (pixels < [1024, 512])).all()
    assert pixels[0, 1] == 0.0
    assert pixels[1, 1] == pytest.approx(512)
    distance_from_seam = np.minimum(pixels[2:, 0], 1024 - pixels[2:, 0])
    assert (distance_from_seam < 1e-6).all()


def test_a_step_across_the_seam_is_a_step_in_azimuth() -> None:
    camera = EquirectangularCamera(720, 360)
    azimuth = np.radians([179.75, -179.75])
    pixels, _ = camera.project(np.stack([np.sin(azimuth), np.zeros(2), np.cos(azimuth)], axis=-1))
    assert np.allclose(pixels[:, 0], [719.5, 0.5], rtol=0, atol=1e-9)


def test_the_camera_itself_has_no_pixel_on_the_sphere() -> None:
    pixels, range_m = EquirectangularCamera(8, 4).project(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    assert np.isnan(pixels[0]).all()
    assert pixels[1].tolist() == [4.0, 2.0]
    assert range_m.tolist() == [0.0, 1.0]


@given(SPHERES, SEEDS)
def test_sphere_unproject_has_the_given_range(camera: EquirectangularCamera, seed: int) -> None:
    assert np.allclose(np.linalg.norm(camera.rays(), axis=-1), 1.0, rtol=0, atol=2e-12)
    range_m = np.random.default_rng(seed).uniform(0.1, 10.0, (camera.height_px, camera.width_px))
    pixels, back = camera.project(camera.unproject(range_m))
    assert np.allclose(back, range_m, rtol=2e-12, atol=0)
    assert np.allclose(pixels, pixel_centres(camera.width_px, camera.height_px), rtol=0, atol=2e-9)


@given(st.tuples(*[st.floats(-10, 10)] * 3).filter(lambda p: np.linalg.norm(p) > 1e-3))
def test_any_direction_returns_from_its_pixel(point: tuple[float, float, float]) -> None:
    camera = EquirectangularCamera(64, 32)
    (u, v), range_m = camera.project(np.array(point))
    azimuth, elevation = 2 * np.pi * u / 64 - np.pi, np.pi / 2 - np.pi * v / 32
    back = np.array([np.sin(azimuth) * np.cos(elevation), -np.sin(elevation), np.cos(azimuth) * np.cos(elevation)])
    assert np.allclose(back * range_m, point, rtol=0, atol=1e-6)


# ---------------------------------------------------------------- top down


def test_top_down_by_hand() -> None:
    camera = TopDownCamera(256, 256, 0.05)
    points = np.array([[0, 0, 1.5], [6.4, 6.4, 0], [-6.39, -6.39, 0.0], [1.0, 0.0, 0.3], [0.0, 1.0, 0.3]])
    pixels, height_m = camera.project(points)
    expected = [[128, 128], [0, 0], [255.8, 255.8], [128, 108], [108, 128]]  # forward is up, left is left
    assert np.allclose(pixels, expected, rtol=0, atol=1e-9)
    assert height_m.tolist() == [1.5, 0, 0, 0.3, 0.3]


def test_heights_seen_from_above_return_to_their_pixels() -> None:
    camera = TopDownCamera(7, 5, 0.3)
    height_m = np.random.default_rng(0).uniform(0, 2, (5, 7))
    points = camera.unproject(height_m)
    assert np.array_equal(points, camera.origins() + height_m[..., None] * camera.rays())
    pixels, back = camera.project(points)
    assert np.allclose(pixels, pixel_centres(7, 5), rtol=0, atol=1e-12)
    assert np.array_equal(back, height_m)
    finer = camera.scaled(2).project(points)[0]
    assert np.allclose(finer, 2 * pixels, rtol=0, atol=1e-12)


@pytest.mark.parametrize("camera", [PINHOLE, *LENSES, EquirectangularCamera(16, 8), TopDownCamera(9, 6, 0.1)])
def test_every_camera_holds_the_pixels_of_its_rays_and_no_others(camera) -> None:
    inside = camera.contains(pixel_centres(camera.width_px, camera.height_px))
    assert inside.shape == (camera.height_px, camera.width_px)
    assert inside.all()
    outside = [[-1e-9, 1], [1, -1e-9], [camera.width_px, 1], [1, camera.height_px], [np.nan, 1], [1, np.nan]]
    assert not camera.contains(np.array(outside)).any()
    assert camera.rays().shape == (camera.height_px, camera.width_px, 3)


# ---------------------------------------------------------------- pose


def test_a_level_camera_looks_along_x_with_y_to_its_left() -> None:
    pose = world_T_camera(1.5, 0.0)
    assert apply(pose, np.zeros(3)).tolist() == [0, 0, 1.5]
    right, down, forward = pose[:3, :3].T
    assert forward.tolist() == [1, 0, 0]
    assert right.tolist() == [0, -1, 0]
    assert down.tolist() == [0, 0, -1]


@pytest.mark.parametrize("tilt", np.radians([10, 30, 90]))
def test_tilt_looks_down(tilt: float) -> None:
    forward = world_T_camera(2.0, tilt)[:3, 2]
    assert np.allclose(forward, [np.cos(tilt), 0, -np.sin(tilt)], rtol=0, atol=1e-11)
    if tilt < np.pi / 2:  # the middle pixel sees the floor at height / tan(tilt)
        camera = PinholeCamera(2, 2, 1.0, 1.0, 1.0, 1.0)
        floor = np.array([2.0 / np.tan(tilt), 0.0, 0.0])
        inverse = np.linalg.inv(world_T_camera(2.0, tilt))
        pixels, depth = camera.project(apply(inverse, floor))
        assert np.allclose(pixels, [1.0, 1.0], rtol=0, atol=1e-9)
        assert depth == pytest.approx(2.0 / np.sin(tilt))


@pytest.mark.parametrize("tilt", [0.0, 0.4])
def test_roll_lowers_the_right_side_about_the_same_axis(tilt: float) -> None:
    level, rolled = world_T_camera(1.0, tilt), world_T_camera(1.0, tilt, 0.2)
    assert np.allclose(rolled[:3, 2:], level[:3, 2:], rtol=0, atol=1e-12)  # forward axis and position stay
    right, down = level[:3, 0], level[:3, 1]
    assert np.allclose(rolled[:3, 0], np.cos(0.2) * right + np.sin(0.2) * down, rtol=0, atol=1e-11)
    assert rolled[2, 0] < level[2, 0]


@given(st.floats(0.1, 5.0), st.floats(-np.pi / 2, np.pi / 2), st.floats(-np.pi, np.pi))
def test_every_camera_pose_is_rigid(height: float, tilt: float, roll: float) -> None:
    assert is_rigid(world_T_camera(height, tilt, roll), tolerance=1e-10)


# ---------------------------------------------------------------- what cannot be built


@pytest.mark.parametrize(
    ("build", "item", "expected"),
    [
        (lambda: PinholeCamera(0, 4, 1, 1, 1, 1), "0 x 4 px", "positive"),
        (lambda: PinholeCamera(4, -1, 1, 1, 1, 1), "4 x -1 px", "positive"),
        (lambda: PinholeCamera(4, 4, 0.0, 1, 1, 1), "camera.fx_px is 0.0", "positive finite"),
        (lambda: PinholeCamera(4, 4, 1, np.nan, 1, 1), "camera.fy_px is nan", "positive finite"),
        (lambda: PinholeCamera(4, 4, 1, np.inf, 1, 1), "camera.fy_px is inf", "positive finite"),
        (lambda: PinholeCamera(4, 4, 1, 1, np.nan, 1), "principal point", "finite"),
        (lambda: PinholeCamera(4, 4, 1, 1, 1, np.inf), "principal point", "finite"),
        (lambda: BrownCamera(64, 48, 33.0, 33.0, 32, 24, -0.3), "folds inside the image of 64 x 48 px", "one pixel"),
        (lambda: BrownCamera(64, 48, 50.0, 50.0, 32, 24, 0, 0, 0.4, 0.4), "folds inside", "one pixel"),
        (lambda: BrownCamera(64, 48, 50.0, 50.0, 32, 24, np.nan), "distortion", "finite"),
        (lambda: BrownCamera(64, 48, -50.0, 50.0, 32, 24), "camera.fx_px is -50.0", "positive finite"),
        (lambda: EquirectangularCamera(100, 100), "100 x 100 px", "width = 2 height"),
        (lambda: EquirectangularCamera(0, 0), "0 x 0 px", "positive"),
        (lambda: TopDownCamera(0, 4, 0.05), "0 x 4 px", "positive"),
        (lambda: TopDownCamera(4, 4, 0.0), "camera.cell_m is 0.0", "positive finite"),
        (lambda: TopDownCamera(4, 4, np.nan), "camera.cell_m is nan", "positive finite"),
        (lambda: PinholeCamera(4, 2, 1, 1, 1, 1).unproject(np.ones((4, 2))), "shape (4, 2)", "(2, 4)"),
        (lambda: TopDownCamera(4, 2, 1.0).unproject(np.ones((4, 2))), "shape (4, 2)", "(2, 4)"),
        (lambda: EquirectangularCamera(4, 2).unproject(np.ones((4, 2))), "shape (4, 2)", "(2, 4)"),
    ],
)
def test_impossible_cameras(build, item: str, expected: str) -> None:
    with pytest.raises(SchemaError) as error:
        build()
    assert item in str(error.value)
    assert expected in str(error.value)
