"""Changing light: the bytes of a frame are those of the formula, on disk as in memory, by plain numpy as compiled."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from hsbench.errors import DataError, SchemaError
from hsbench.io.changing_light import ROOT_STEPS, VALUES, ChangingLight, encode_light, read_light, write_light
from hsbench.io.frame_store import Film, Patch, Picture, Recording, RecordingFrames, write_recording
from hsbench.typing import UInt8Array

DISPLAY = (np.arange(VALUES) >> 8).astype(np.uint8)


def light(rng: np.random.Generator, lights: int, frames: int, shape: tuple[int, int] = (6, 9)) -> ChangingLight:
    weight = rng.uniform(0, 3, (frames, lights, 3)).astype(np.float32) * (rng.random((frames, lights, 1)) < 0.7)
    return ChangingLight(
        tuple(rng.integers(0, VALUES, (*shape, 3), dtype=np.uint16) for _ in range(lights)),
        weight.astype(np.float32),
        rng.uniform(0.01, 60, frames).astype(np.float32),
        rng.permutation(DISPLAY),
    )


def by_the_formula(folder: Path, frame: int) -> UInt8Array:
    """From the files, with numpy and Pillow only, as the page on the schema says."""
    table = np.load(folder / "light.npz")
    factor = table["exposure"][frame] * table["weight"][frame]
    total = np.zeros((), dtype=np.float32)
    for k in np.flatnonzero(table["weight"][frame].any(axis=1)):
        root = np.array(Image.open(folder / f"light_{k}.png")).astype(np.float32) / np.float32(4096)
        red_green_blue = np.stack(np.split(root, 3), axis=-1)
        total = total + red_green_blue * red_green_blue * factor[k]
    steps = np.minimum(np.sqrt(total) * np.float32(4096), np.float32(65535)).astype(np.uint16)
    return np.asarray(table["display"][steps])


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 5))
def test_frames_are_the_formula_s_and_come_back_from_disk(
    tmp_path_factory: pytest.TempPathFactory, seed: int, lights: int
) -> None:
    made = light(np.random.default_rng(seed), lights, 4)
    folder = tmp_path_factory.mktemp("light")
    write_light(folder, made)
    back = read_light(folder, (6, 9), 4)
    assert back is not None
    for frame in range(4):
        if made.weight[frame].any():
            assert np.array_equal(made.rgb(frame), by_the_formula(folder, frame))
        assert np.array_equal(back.rgb(frame), made.rgb(frame))
        assert np.array_equal(made.rgb(frame, slice(1, 4), slice(2, 7)), made.rgb(frame)[1:4, 2:7])


def test_no_light_at_all_is_black() -> None:
    made = light(np.random.default_rng(0), 2, 1)
    dark = ChangingLight(made.lights, np.zeros_like(made.weight), made.exposure, DISPLAY)
    assert dark.rgb(0).shape == (6, 9, 3)
    assert not dark.rgb(0).any()


@given(st.floats(0, 250))
def test_light_is_kept_to_half_a_step_of_its_root(value: float) -> None:
    assert abs(np.sqrt(value) - int(encode_light(np.array(value))) / ROOT_STEPS) <= 0.5001 / ROOT_STEPS


def test_light_beyond_the_scale_is_cut() -> None:
    assert encode_light(np.array([256.0, 1e9, np.inf])).tolist() == [65535] * 3


def test_a_recording_under_changing_light_gives_what_was_filmed(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    made = light(rng, 3, 5)
    still = Picture(made.rgb(0), rng.integers(0, 9000, (6, 9), np.uint16), rng.integers(0, 50, (6, 9), np.uint16))
    spot = Picture(np.full((2, 3, 3), 7, np.uint8), np.full((2, 3), 900, np.uint16), np.full((2, 3), 60001, np.uint16))
    patches = [Patch(k, 1, 2, rng.random((2, 3)) < 0.5, spot) for k in range(5)]
    film = Film(still, np.arange(5), patches.__getitem__, 3, "none", False, "camera", made)
    write_recording(tmp_path, still, iter(patches), made)
    recording = Recording(tmp_path)
    frames = RecordingFrames(recording, 3, "none", False, "camera")
    for k, patch in enumerate(patches):
        expected = made.rgb(k)
        expected[1:3, 2:5][patch.mask] = 7
        assert np.array_equal(recording.picture(k).rgb, expected)
        assert np.array_equal(film.picture(k).rgb, expected)
        assert np.array_equal(frames[k].rgb, film[k].rgb)
        assert frames[k].depth_m is None
        assert np.array_equal(recording.picture(k).depth_mm, film.picture(k).depth_mm)
    assert np.array_equal(recording.background.rgb, made.rgb(0))


def test_damage_is_named(tmp_path: Path) -> None:
    made = light(np.random.default_rng(0), 2, 3)
    assert read_light(tmp_path, (6, 9), 3) is None
    write_light(tmp_path, made)
    with pytest.raises(DataError, match=r"light.npz.*weight.*shape is \(3, 2, 3\); expected \(4"):
        read_light(tmp_path, (6, 9), 4)
    with pytest.raises(DataError, match=r"light_0.png has shape \(18, 9\); expected \(18, 8\)"):
        read_light(tmp_path, (6, 8), 3)
    (tmp_path / "light_1.png").unlink()
    with pytest.raises(DataError, match=r"light_1\.png is missing"):
        read_light(tmp_path, (6, 9), 3)


def test_strengths_that_mean_nothing_are_refused() -> None:
    made = light(np.random.default_rng(0), 2, 3)
    for weight in (np.full_like(made.weight, np.nan), -np.ones_like(made.weight)):
        with pytest.raises(SchemaError, match="expected strengths >= 0"):
            ChangingLight(made.lights, weight, made.exposure, DISPLAY)
    with pytest.raises(SchemaError, match="light 1 has shape"):
        ChangingLight((made.lights[0], made.lights[1][1:]), made.weight, made.exposure, DISPLAY)
    with pytest.raises(SchemaError, match="no light"):
        ChangingLight((), made.weight[:, :0], made.exposure, DISPLAY)
