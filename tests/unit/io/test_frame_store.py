"""Recordings: what was filmed comes back bit for bit, in any order, in any process; damage is named."""

from __future__ import annotations

import hashlib
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hsbench
from hsbench.errors import DataError
from hsbench.io.frame_store import (
    Film,
    Patch,
    Picture,
    Recording,
    RecordingFrames,
    RecordingTruth,
    write_recording,
)
from hsbench.io.patch_table import PATCH_SCHEMA
from hsbench.schema.episode import Frames, FramesTruth

FIELDS = ("rgb", "depth_mm", "instance")


def picture(rng: np.random.Generator, height: int, width: int) -> Picture:
    return Picture(
        rng.integers(0, 256, (height, width, 3), dtype=np.uint8),
        rng.integers(0, 65536, (height, width), dtype=np.uint16),
        rng.integers(0, 65536, (height, width), dtype=np.uint16),
    )


def patches(rng: np.random.Generator, height: int, width: int, count: int) -> list[Patch]:
    """Windows anywhere, borders and whole images included; masks empty, full and in between."""
    made = []
    for k in range(count):
        row, column = int(rng.integers(0, height + 1)), int(rng.integers(0, width + 1))
        size = (int(rng.integers(0, height - row + 1)), int(rng.integers(0, width - column + 1)))
        mask = rng.random(size) < rng.choice([0.0, 0.3, 1.0])
        made.append(Patch(1000 + 7 * k, row, column, mask, picture(rng, *size)))
    return made


def pixel_by_pixel(background: Picture, patch: Patch) -> Picture:
    """The reference: one pixel at a time."""
    result = Picture(*(getattr(background, name).copy() for name in FIELDS))
    for i in range(patch.mask.shape[0]):
        for j in range(patch.mask.shape[1]):
            if patch.mask[i, j]:
                for name in FIELDS:
                    getattr(result, name)[patch.row + i, patch.column + j] = getattr(patch.picture, name)[i, j]
    return result


def same(a: Picture, b: Picture) -> bool:
    return all(
        getattr(a, n).dtype == getattr(b, n).dtype and np.array_equal(getattr(a, n), getattr(b, n)) for n in FIELDS
    )


def film(background: Picture, made: list[Patch], preset: str = "none", has_depth: bool = True) -> Film:
    stamps = np.array([p.timestamp_ns for p in made], dtype=np.int64)
    return Film(background, stamps, lambda index: made[index], 5, preset, has_depth)


@pytest.fixture
def recorded(tmp_path: Path) -> tuple[Recording, Film, list[Patch]]:
    rng = np.random.default_rng(3)
    background, made = picture(rng, 30, 40), patches(rng, 30, 40, 6)
    write_recording(tmp_path, background, made)
    return Recording(tmp_path), film(background, made, "kinect"), made


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 9), st.integers(1, 9), st.integers(0, 4))
def test_round_trip_bit_for_bit(seed: int, height: int, width: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    background, made = picture(rng, height, width), patches(rng, height, width, count)
    with tempfile.TemporaryDirectory() as folder:
        write_recording(Path(folder), background, iter(made))
        recording = Recording(Path(folder))
        assert recording.timestamps_ns.tolist() == [p.timestamp_ns for p in made]
        assert same(recording.background, background)
        for k, patch in enumerate(made):
            expected = pixel_by_pixel(background, patch)
            assert same(recording.picture(k), expected)
            assert same(film(background, made).picture(k), expected)


def test_an_empty_patch_is_the_background(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    background = picture(rng, 4, 5)
    empty = Patch(0, 0, 0, np.zeros((0, 0), bool), picture(rng, 0, 0))
    nothing = Patch(1, 1, 2, np.zeros((2, 3), bool), picture(rng, 2, 3))
    write_recording(tmp_path, background, [empty, nothing])
    recording = Recording(tmp_path)
    for k in range(2):
        assert same(recording.picture(k), background)
    assert recording.picture(0).rgb is not recording.background.rgb
    recording.picture(0).rgb[:] = 0  # belongs to the caller
    assert same(recording.picture(1), background)


def test_random_access_equals_reading_in_order(recorded: tuple[Recording, Film, list[Patch]]) -> None:
    recording, _, made = recorded
    in_order = [recording.picture(k) for k in range(len(made))]
    fresh = Recording(recording.folder)
    for k in (5, 0, 3, 3, 1, -1, -6):
        assert same(fresh.picture(k), in_order[k])
    for beyond in (6, -7):
        with pytest.raises(IndexError):
            fresh.picture(beyond)


@pytest.mark.parametrize("preset", ["kinect", "none"])
@pytest.mark.parametrize("has_depth", [True, False])
def test_what_is_filmed_is_what_is_read(tmp_path: Path, preset: str, has_depth: bool) -> None:
    rng = np.random.default_rng(8)
    background, made = picture(rng, 20, 24), patches(rng, 20, 24, 4)
    write_recording(tmp_path, background, made)
    filmed = film(background, made, preset, has_depth)
    read = RecordingFrames(Recording(tmp_path), 5, preset, has_depth)
    truth = RecordingTruth(Recording(tmp_path), np.arange(65536) % 251)
    assert isinstance(read, Frames)
    assert isinstance(filmed, Frames)
    assert isinstance(truth, FramesTruth)
    assert len(read) == len(filmed) == len(truth) == 4
    assert np.array_equal(read.timestamps_ns, filmed.timestamps_ns)
    for k in (2, 0, 3, 1, -1):
        a, b, clean = filmed[k], read[k], pixel_by_pixel(background, made[k])
        assert a.timestamp_ns == b.timestamp_ns == truth[k].timestamp_ns == made[k].timestamp_ns
        assert np.array_equal(a.rgb, clean.rgb)
        assert np.array_equal(b.rgb, clean.rgb)
        assert (a.depth_m is None) == (b.depth_m is None) == (not has_depth)
        if has_depth:
            assert a.depth_m.dtype == b.depth_m.dtype == np.float32
            assert np.array_equal(a.depth_m, b.depth_m)
            assert np.array_equal(a.depth_m, (clean.depth_mm / 1000).astype(np.float32)) == (preset == "none")
        assert np.array_equal(np.rint(truth[k].depth_m * 1000), clean.depth_mm)
        assert np.array_equal(truth[k].instance, clean.instance)
        assert np.array_equal(truth[k].semantic, clean.instance % 251)
    for frames in (filmed, read, truth):
        assert len(list(frames)) == 4  # ends with IndexError, as a sequence must
        with pytest.raises(IndexError):
            frames[4]


def test_a_recording_travels_to_another_process(recorded: tuple[Recording, Film, list[Patch]]) -> None:
    recording, _, _ = recorded
    frames = RecordingFrames(recording, 5, "kinect")
    here = [frames[k] for k in range(len(frames))]  # opened before it is sent
    sent = pickle.dumps(frames)
    assert len(sent) < 1000  # the path, never the pictures
    code = (
        "import hashlib, pickle, sys\n"
        "frames = pickle.loads(sys.stdin.buffer.read())\n"
        "for k in reversed(range(len(frames))):\n"
        "    print(hashlib.sha256(frames[k].rgb.tobytes() + frames[k].depth_m.tobytes()).hexdigest())\n"
    )
    root = str(Path(hsbench.__file__).parents[1])
    there = subprocess.run([sys.executable, "-c", code], input=sent, capture_output=True, check=True, cwd=root)
    expected = [hashlib.sha256(f.rgb.tobytes() + f.depth_m.tobytes()).hexdigest() for f in reversed(here)]
    assert there.stdout.decode().split() == expected


def exercise(folder: Path) -> list[Picture]:
    recording = Recording(folder)
    return [recording.background, *(recording.picture(k) for k in range(len(recording.timestamps_ns)))]


@pytest.mark.parametrize("name", ["patches.parquet", "patches.zst", "background_rgb.png", "background_depth.png"])
def test_a_missing_file_is_named(recorded: tuple[Recording, Film, list[Patch]], name: str) -> None:
    folder = recorded[0].folder
    (folder / name).unlink()
    with pytest.raises(DataError, match=name):
        exercise(folder)


@pytest.mark.parametrize("name", ["patches.parquet", "patches.zst"])
def test_any_cut_is_named(recorded: tuple[Recording, Film, list[Patch]], name: str) -> None:
    path = recorded[0].folder / name
    whole = path.read_bytes()
    for kept in [0, 1, 4, 100, *range(len(whole) // 7, len(whole), len(whole) // 7), len(whole) - 1]:
        path.write_bytes(whole[:kept])
        with pytest.raises(DataError, match=name):
            exercise(path.parent)


@pytest.mark.parametrize("name", ["patches.parquet", "patches.zst"])
def test_a_damaged_byte_is_an_error_in_one_line_or_changes_nothing_but_pixels(
    recorded: tuple[Recording, Film, list[Patch]], name: str
) -> None:
    path = recorded[0].folder / name
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    errors = []
    for at in rng.integers(0, len(whole), 150):
        damaged = bytearray(whole)
        damaged[at] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            pictures = exercise(path.parent)
        except DataError as error:
            errors.append(str(error))
        else:
            assert all(p.rgb.shape == (30, 40, 3) for p in pictures)
    assert len(errors) > 20
    assert all("patches." in e and len(e.splitlines()) == 1 for e in errors)


def rewritten(folder: Path, **columns: list[int | None]) -> None:
    """The table of a recording with other values in some columns."""
    table = pq.read_table(folder / "patches.parquet").to_pydict()
    pq.write_table(pa.Table.from_pydict(table | columns, schema=PATCH_SCHEMA), folder / "patches.parquet")


@pytest.fixture
def one(tmp_path: Path) -> Path:
    """A recording of one patch, of two pixels of three in a row."""
    rng = np.random.default_rng(2)
    patch = Patch(0, 1, 1, np.array([[True, False, True]]), picture(rng, 1, 3))
    write_recording(tmp_path, picture(rng, 30, 40), [patch])
    return tmp_path


@pytest.mark.parametrize(
    "wrong",
    [
        {"pixels": 1},
        {"pixels": 3},
        {"pixels": 1201},
        {"pixels": -1},
        {"pixels": 2**31 - 1},
        {"runs": 2},
        {"runs": 3},
        {"runs": 6},
        {"runs": -2},
        {"runs": 2**31 - 1},
        {"runs": 0, "pixels": 0},
    ],
)
def test_a_row_that_does_not_fit_is_an_error_of_its_frame(one: Path, wrong: dict[str, int]) -> None:
    assert len(exercise(one)) == 2
    rewritten(one, **{name: [value] for name, value in wrong.items()})
    with pytest.raises(DataError, match=r"patches\.zst frame 0"):
        exercise(one)


def test_runs_that_leave_the_picture_are_an_error_of_their_frame(one: Path) -> None:
    """The same bytes on another background."""
    smaller = picture(np.random.default_rng(0), 1, 40)
    other = one / "other"
    other.mkdir()
    write_recording(other, smaller, [])
    for name in ("background_rgb.png", "background_depth.png", "background_instance.png"):
        (other / name).replace(one / name)
    with pytest.raises(DataError, match=r"patches\.zst frame 0 cannot be read: runs name 2 pixels up to 44"):
        exercise(one)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"start": 1}, "do not follow on one another"),
        ({"size": -1}, "do not follow on one another"),
        ({"size": 1}, r"patches\.zst has \d+ bytes; expected the 1 of patches\.parquet"),
        ({"pixels": None}, "column pixels has 1 nulls"),
        ({"timestamp_ns": None}, "column timestamp_ns has 1 nulls"),
    ],
)
def test_a_table_that_does_not_fit_its_pixels_is_refused(one: Path, wrong: dict[str, int | None], words: str) -> None:
    rewritten(one, **{name: [value] for name, value in wrong.items()})
    with pytest.raises(DataError, match=words):
        exercise(one)


def test_other_columns_are_refused_and_named(recorded: tuple[Recording, Film, list[Patch]]) -> None:
    folder = recorded[0].folder
    table = pq.read_table(folder / "patches.parquet")
    for wrong in (
        table.drop_columns(["pixels"]),
        table.rename_columns([f"x{n}" for n in table.column_names]),
        table.set_column(0, "frame", table["frame"].cast(pa.int64())),
    ):
        pq.write_table(wrong, folder / "patches.parquet")
        with pytest.raises(DataError, match=r"patches\.parquet has columns .*expected"):
            exercise(folder)


def test_a_recording_without_a_frame(tmp_path: Path) -> None:
    background = picture(np.random.default_rng(0), 4, 5)
    write_recording(tmp_path, background, [])
    assert len(Recording(tmp_path).timestamps_ns) == 0
    assert same(Recording(tmp_path).background, background)
