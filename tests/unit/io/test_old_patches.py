"""Recordings as schema 0.3 and before stored them: read bit for bit, damage named. The tests write the old layout."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import DataError
from hsbench.io.frame_store import Film, Patch, Picture, Recording, write_recording
from hsbench.io.old_patches import OLD_SCHEMA, STAMPS_KEY
from tests.unit.io.test_frame_store import exercise, patches, picture, pixel_by_pixel, same


def old_row(frame: int, patch: Patch) -> dict[str, object]:
    taken = patch.picture
    return {
        "frame": frame, "timestamp_ns": patch.timestamp_ns, "row": patch.row, "column": patch.column,
        "height": patch.mask.shape[0], "width": patch.mask.shape[1],
        "mask": np.packbits(patch.mask.ravel(), bitorder="little").tobytes(),
        "rgb": taken.rgb[patch.mask].tobytes(),
        "depth_mm": taken.depth_mm[patch.mask].astype("<u2").tobytes(),
        "instance": taken.instance[patch.mask].astype("<u2").tobytes(),
    }  # fmt: skip


def write_old(folder: Path, background: Picture, made: list[Patch], metadata: dict[str, str] | None = None) -> None:
    write_recording(folder, background, [])
    (folder / "patches.zst").unlink()
    write_rows(folder, [old_row(k, patch) for k, patch in enumerate(made)], metadata)


def write_rows(folder: Path, rows: list[dict[str, object]], metadata: dict[str, str] | None = None) -> None:
    with pq.ParquetWriter(folder / "patches.parquet", OLD_SCHEMA, compression="zstd") as writer:
        for row in rows:
            writer.write_batch(pa.RecordBatch.from_pylist([row], schema=OLD_SCHEMA))
        if metadata is not None:
            writer.add_key_value_metadata(metadata)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 9), st.integers(1, 9), st.integers(0, 4))
def test_old_recordings_read_bit_for_bit(seed: int, height: int, width: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    background, made = picture(rng, height, width), patches(rng, height, width, count)
    with tempfile.TemporaryDirectory() as folder:
        write_old(Path(folder), background, made)
        recording = Recording(Path(folder))
        assert recording.timestamps_ns.tolist() == [p.timestamp_ns for p in made]
        for k, patch in enumerate(made):
            assert same(recording.picture(k), pixel_by_pixel(background, patch))


@pytest.fixture
def old(tmp_path: Path) -> tuple[Path, Film]:
    rng = np.random.default_rng(3)
    background, made = picture(rng, 30, 40), patches(rng, 30, 40, 6)
    stamps = np.array([p.timestamp_ns for p in made])
    write_old(tmp_path, background, made, {STAMPS_KEY: " ".join(map(str, stamps))})
    return tmp_path, Film(background, stamps, made.__getitem__, 5, "none")


def test_an_old_recording_written_anew_is_the_same(
    old: tuple[Path, Film], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder, film = old
    again = tmp_path_factory.mktemp("again")
    write_recording(again, film.background, [film.patch(k) for k in range(len(film))])
    assert Recording(again).timestamps_ns.tolist() == Recording(folder).timestamps_ns.tolist()
    assert all(same(a, b) for a, b in zip(exercise(again), exercise(folder), strict=True))


def test_any_cut_of_the_table_is_named(old: tuple[Path, Film]) -> None:
    path = old[0] / "patches.parquet"
    whole = path.read_bytes()
    for kept in [0, 1, 4, 100, *range(len(whole) // 7, len(whole), len(whole) // 7), len(whole) - 1]:
        path.write_bytes(whole[:kept])
        with pytest.raises(DataError, match=r"patches\.parquet"):
            exercise(old[0])


def test_a_damaged_byte_is_an_error_in_one_line_or_changes_nothing_but_pixels(old: tuple[Path, Film]) -> None:
    path = old[0] / "patches.parquet"
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    errors = []
    for at in rng.integers(0, len(whole), 150):
        damaged = bytearray(whole)
        damaged[at] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            pictures = exercise(old[0])
        except DataError as error:
            errors.append(str(error))
        else:
            assert all(p.rgb.shape == (30, 40, 3) for p in pictures)
    assert len(errors) > 20
    assert all("patches.parquet" in e and len(e.splitlines()) == 1 for e in errors)


ROW = {
    "frame": 0, "timestamp_ns": 0, "row": 1, "column": 1, "height": 1, "width": 3, "mask": b"\x05",
    "rgb": bytes(6), "depth_mm": bytes(4), "instance": bytes(4),
}  # fmt: skip


@pytest.mark.parametrize(
    "wrong",
    [
        {"rgb": bytes(5)},
        {"rgb": bytes(9)},
        {"depth_mm": bytes(2)},
        {"depth_mm": bytes(3)},
        {"instance": b""},
        {"mask": b"\x07"},
        {"mask": b"\x05\x00"},
        {"mask": b"\x0d"},
        {"mask": b"\x05", "height": 3},  # nine pixels take two bytes
        {"mask": None},
        {"rgb": None},
        {"row": 29, "height": 3},
        {"row": -1},
        {"column": 40},
        {"height": -1},
        {"width": None},
    ],
)
def test_a_row_that_does_not_fit_is_an_error_of_its_frame(old: tuple[Path, Film], wrong: dict[str, object]) -> None:
    write_rows(old[0], [ROW])
    assert len(exercise(old[0])) == 2
    write_rows(old[0], [{**ROW, **wrong}])
    with pytest.raises(DataError, match=r"patches\.parquet frame 0"):
        exercise(old[0])


def test_a_row_group_is_a_frame(old: tuple[Path, Film]) -> None:
    pq.write_table(pq.read_table(old[0] / "patches.parquet"), old[0] / "patches.parquet")
    with pytest.raises(DataError, match="1 row groups, 6 rows; expected one each"):
        exercise(old[0])


@pytest.mark.parametrize(("listed", "words"), [("1 2 x", "expected whole numbers"), ("1 2", "has 2 numbers")])
def test_time_stamps_of_the_metadata_fit_the_table(old: tuple[Path, Film], listed: str, words: str) -> None:
    folder, film = old
    rows = [old_row(k, film.patch(k)) for k in range(len(film))]
    write_rows(folder, rows)
    assert Recording(folder).timestamps_ns.tolist() == film.timestamps_ns.tolist()
    write_rows(folder, rows, {STAMPS_KEY: listed})
    with pytest.raises(DataError, match=words):
        _ = Recording(folder).timestamps_ns
