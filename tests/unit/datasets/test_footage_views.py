"""Steady views of made footage: people and light leave them alone, a moved camera and a cut do not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.datasets.importers.footage_views import SAMPLES, median_background, steady_views
from hsbench.errors import DataError
from hsbench.schema.episode import Frame, FrameList
from hsbench.typing import UInt8Array

WIDTH, HEIGHT = 320, 240
FEW = settings(deadline=None, max_examples=15)


def place(seed: int, width: int = WIDTH + 80, height: int = HEIGHT + 80) -> UInt8Array:
    """A picture full of edges in all directions, larger than what the camera sees of it."""
    rng = np.random.default_rng(seed)
    picture = np.full((height, width, 3), 128, dtype=np.uint8)
    for _ in range(150):
        centre, size = rng.integers(0, (width, height)), rng.integers(8, 50, 2)
        box = cv2.RotatedRect(centre.tolist(), size.tolist(), float(rng.uniform(0, 180)))
        corners = cv2.boxPoints(box).astype(np.int32)
        cv2.fillConvexPoly(picture, corners, rng.integers(20, 236, 3).tolist())
    return picture


def seen(picture: UInt8Array, right: int = 0, down: int = 0) -> UInt8Array:
    """What the camera sees from a place: a shift of its view in pixels."""
    return picture[40 + down : 40 + down + HEIGHT, 40 + right : 40 + right + WIDTH].copy()


def with_person(picture: UInt8Array, column: int, seed: int) -> UInt8Array:
    """A striped person 60 px wide and 180 px high."""
    rng = np.random.default_rng(seed)
    picture = picture.copy()
    stripes = np.repeat(rng.integers(0, 256, (18, 1, 3), dtype=np.uint8), 10, axis=0)
    picture[50:230, column : column + 60] = stripes
    return picture


def lit(picture: UInt8Array, gain: float, noise_seed: int) -> UInt8Array:
    noise = np.random.default_rng(noise_seed).normal(0, 4, picture.shape)
    slope = np.linspace(0.8, 1.2, picture.shape[1])[None, :, None]
    return np.clip(picture * gain * slope + noise, 0, 255).astype(np.uint8)


@FEW
@given(seed=st.integers(0, 1000), data=st.data())
def test_people_and_light_do_not_begin_a_view(seed: int, data: st.DataObject) -> None:
    view = seen(place(seed))
    columns = data.draw(st.lists(st.integers(0, WIDTH - 60), min_size=4, max_size=12))
    gains = data.draw(st.lists(st.floats(0.35, 1.2), min_size=len(columns), max_size=len(columns)))
    film = [lit(with_person(view, c, k), g, k) for k, (c, g) in enumerate(zip(columns, gains, strict=True))]
    assert [v.tolist() for v in steady_views(film)] == [list(range(len(film)))]


@FEW
@given(
    seed=st.integers(0, 1000),
    first=st.integers(1, 6),
    second=st.integers(3, 6),
    angle=st.integers(0, 7),
    shift=st.integers(5, 39),  # 1.6 % of the width and more
)
def test_a_moved_camera_begins_a_view_at_its_first_picture(
    seed: int, first: int, second: int, angle: int, shift: int
) -> None:
    picture = place(seed)
    right, down = round(shift * np.cos(angle * np.pi / 4)), round(shift * np.sin(angle * np.pi / 4))
    views = [seen(picture)] * first + [seen(picture, right, down)] * second
    film = [lit(with_person(v, 20 * k, k), 1.0, k) for k, v in enumerate(views)]
    found = [v.tolist() for v in steady_views(film)]
    assert found == [list(range(first)), list(range(first, first + second))]


def test_a_cut_a_return_and_pictures_of_another_size() -> None:
    a, b = seen(place(1)), seen(place(2))
    small = cv2.resize(b, (160, 120))
    film = [a] * 5 + [b] * 4 + [a] * 4 + [small] + [a] * 2
    assert [v.tolist() for v in steady_views(film)] == [
        [0, 1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12], [13], [14, 15],
    ]  # fmt: skip


def test_what_passes_stays_in_its_view_and_moving_pictures_belong_to_none() -> None:
    a, b, others = seen(place(1)), seen(place(2)), [seen(place(k)) for k in range(3, 7)]
    dark = np.full_like(a, 3)
    assert [v.tolist() for v in steady_views([a, a, others[0], others[1], a, dark, dark, dark, dark, a])] == [
        list(range(10))
    ]
    film = [a, a, a, *others, b, b, b, b]
    assert [v.tolist() for v in steady_views(film)] == [[0, 1, 2], [7, 8, 9, 10]]
    assert [v.tolist() for v in steady_views([a, None, a, None, b])] == [[0, 2, 4]]  # one picture is no view
    assert steady_views([]) == []
    assert steady_views([None, None]) == []


def test_daylight_over_hours_is_followed() -> None:
    a, b = seen(place(8)), seen(place(9))
    mix = [(1 - s) * a.astype(float) + s * b for s in np.linspace(0, 0.45, 60)]  # shadows that come up slowly
    assert len(steady_views([m.astype(np.uint8) for m in mix])) == 1


def test_the_background_is_what_people_leave_free_most_of_the_time() -> None:
    view = seen(place(5))
    film = [with_person(view, 40 * (k % 7), k) for k in range(200)]
    background = median_background(FrameList(tuple(Frame(k, f) for k, f in enumerate(film))))
    assert np.array_equal(background, view)


def test_the_background_of_a_few_frames_is_their_exact_median() -> None:
    rng = np.random.default_rng(0)
    for count in (1, 2, 3, 8, SAMPLES + 30):
        film = rng.integers(0, 256, (count, 6, 5, 3), dtype=np.uint8)
        taken = (
            np.linspace(0, count - 1, min(SAMPLES, count - 1 + count % 2)).round().astype(int)
            if count > 2
            else [count // 2]
        )
        found = median_background(FrameList(tuple(Frame(k, f) for k, f in enumerate(film))))
        assert np.array_equal(found, np.median(film[taken], axis=0).astype(np.uint8))
    with pytest.raises(DataError, match="no frames"):
        median_background(FrameList())
    with pytest.raises(DataError, match="no colour"):
        median_background(FrameList((Frame(0),)))
