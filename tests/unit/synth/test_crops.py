"""Windows of a picture: what can be seen of a solid lies in its window; windows as sets of pixels."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hsbench.geometry.cameras import BrownCamera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.io.frame_store import Picture
from hsbench.schema import Sensor
from hsbench.synth.crops import corners_of, crop, cut, differs, joined, overlap, window_of, within
from hsbench.synth.render import Window
from hsbench.synth.render.base import NEAR_M

SENSOR = Sensor("rgbd", PinholeCamera(40, 30, 30.0, 30.0, 20.0, 15.0), 1.5, 0.3)
SENSORS = (
    SENSOR,
    Sensor("monocular", BrownCamera(40, 30, 24.0, 24.0, 20.0, 15.0, k1=-0.2, k2=0.03, p1=0.002), 1.5, 0.3),
    Sensor("equirectangular", EquirectangularCamera(80, 40), 1.5),
    Sensor("topdown", TopDownCamera(40, 30, 0.1), None),
)
POINTS = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)
WINDOWS = st.builds(Window, *[st.integers(0, 6)] * 2, *[st.integers(1, 6)] * 2)


def pixels(window: Window | None) -> set[tuple[int, int]]:
    if window is None:
        return set()
    rows, columns = crop(window)
    return {(v, u) for v in range(rows.start, rows.stop) for u in range(columns.start, columns.stop)}


@given(st.sampled_from(SENSORS), POINTS, POINTS, POINTS, POINTS)
def test_all_that_is_seen_of_a_solid_lies_in_its_window(sensor, a, b, c, d) -> None:
    """Vertices anywhere, and a box of what they shade, a pixel across or more, which may reach behind the lens."""
    vertices, shaded = np.array([a, b]), corners_of(np.minimum(c, d) - 0.2, np.maximum(c, d) + 0.2)
    window = window_of(sensor, [(vertices, shaded)])
    camera, camera_T_world = sensor.camera, invert(sensor.world_T_camera)
    has_plane = isinstance(camera, PinholeCamera | BrownCamera)
    if has_plane and apply(camera_T_world, vertices)[:, 2].max() <= NEAR_M:
        assert window is None
        return
    steps = np.linspace(0.0, 1.0, 7)
    grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    inside = np.concatenate([vertices, shaded[0] + grid * (shaded[-1] - shaded[0])])
    points = apply(camera_T_world, inside)
    uv, _ = camera.project(points[points[:, 2] > NEAR_M] if has_plane else points)
    seen = np.floor(uv[camera.contains(uv)]).astype(int)
    assert {(v, u) for u, v in seen.tolist()} <= pixels(window)


def test_a_shape_across_the_seam_has_a_window_as_wide_as_the_picture() -> None:
    sphere = SENSORS[2]
    behind = corners_of(np.array([-2.3, -0.3, 0.0]), np.array([-1.7, 0.3, 1.8]))
    window = window_of(sensor=sphere, shapes=[(behind, behind)])
    assert window is not None
    assert (window.u0, window.width) == (0, 80)
    assert window.height < 40
    ahead = behind * (-1.0, 1.0, 1.0)
    before = window_of(sensor=sphere, shapes=[(ahead, ahead)])
    assert before is not None
    assert (before.v0, before.height) == (window.v0, window.height)
    assert before.width < 20


def test_a_window_is_tight() -> None:
    """A box 1 m across and 3 m ahead covers 10 pixels of 30 px focal length, and the margin."""
    ahead = apply(SENSOR.world_T_camera, corners_of(np.array([-0.5, -0.5, 3.0]), np.array([0.5, 0.5, 3.0])))
    assert window_of(SENSOR, [(ahead, ahead)]) == Window(13, 8, 14, 14)
    assert window_of(SENSOR, []) is None


@given(WINDOWS, WINDOWS)
def test_windows_as_sets_of_pixels(a: Window, b: Window) -> None:
    both = joined(a, b)
    assert both is not None
    assert pixels(a) | pixels(b) <= pixels(both)
    assert len({v for v, _ in pixels(both)}) == max(a.v0 + a.height, b.v0 + b.height) - min(a.v0, b.v0)
    assert overlap(a, b) == bool(pixels(a) & pixels(b))
    assert joined(a, None) == joined(None, a) == a
    inner = within(a, both)
    assert pixels(a) == {(v + both.v0, u + both.u0) for v, u in pixels(inner)}


def test_each_kind_of_pixel_can_differ() -> None:
    rng = np.random.default_rng(0)
    shape = (5, 6)
    picture = Picture(
        rng.integers(0, 256, (*shape, 3), np.uint8),
        rng.integers(0, 9, shape, np.uint16),
        rng.integers(0, 9, shape, np.uint16),
    )
    other = Picture(picture.rgb.copy(), picture.depth_mm.copy(), picture.instance.copy())
    assert not differs(picture, other).any()
    expected = np.zeros(shape, bool)
    for k, array in enumerate(
        (other.rgb[..., 0], other.rgb[..., 1], other.rgb[..., 2], other.depth_mm, other.instance)
    ):
        array[k, k] += 1
        expected[k, k] = True
    assert np.array_equal(differs(picture, other), expected)
    window = Window(1, 2, 3, 2)
    assert np.array_equal(differs(cut(picture, window), cut(other, window)), expected[2:4, 1:4])
