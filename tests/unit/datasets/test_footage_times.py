"""Times and numbers of pictures, from names and from EXIF blocks that an independent encoder writes here."""

from __future__ import annotations

import struct
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.datasets.importers.footage_times import (
    exif_time_ns,
    named_time_ns,
    natural_key,
    picture_numbers,
    picture_times,
)
from hsbench.errors import DataError
from hsbench.io.images import encode_jpeg
from tests.unit.datasets.mutations import attempt, mutated

ANY_FILE = settings(deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
JPEG = encode_jpeg(np.zeros((8, 8, 3), dtype=np.uint8))
MOMENTS = st.datetimes(datetime(1971, 1, 1), datetime(2090, 1, 1)).map(lambda t: t.replace(microsecond=0, tzinfo=UTC))


def since_1970_ns(moment: datetime) -> int:
    return (moment - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1) * 1000


def with_exif(moment: datetime, fraction: str | None = None, order: str = "<") -> bytes:
    """A JPEG whose first block is EXIF: IFD0 with a pointer to a directory with the time."""
    text = moment.strftime("%Y:%m:%d %H:%M:%S").encode() + b"\0"
    entries = [(0x9003, 2, len(text), None)]
    if fraction is not None:
        entries.append((0x9291, 2, len(fraction) + 1, (fraction.encode() + b"\0").ljust(4, b"\0")))
    first = struct.pack(order + "HHHIII", 1, 0x8769, 4, 1, 26, 0)
    place = 26 + 2 + 12 * len(entries) + 4
    body = struct.pack(order + "H", len(entries))
    for tag, kind, count, inline in entries:
        body += struct.pack(order + "HHI", tag, kind, count)
        body += struct.pack(order + "I", place) if inline is None else inline
    tiff = (b"II" if order == "<" else b"MM") + struct.pack(order + "HI", 42, 8) + first + body + bytes(4) + text
    block = b"Exif\0\0" + tiff
    return JPEG[:2] + b"\xff\xe1" + struct.pack(">H", len(block) + 2) + block + JPEG[2:]


@ANY_FILE
@given(moment=MOMENTS, milliseconds=st.integers(0, 999))
def test_times_in_names(moment: datetime, milliseconds: int) -> None:
    whole = since_1970_ns(moment)
    for pattern in ("IMG_%Y%m%d_%H%M%S.jpg", "%Y-%m-%d_%H-%M-%S.png", "cam %Y-%m-%dT%H.%M.%S.jpg", "%Y%m%d%H%M%S.jpg"):
        assert named_time_ns(Path(moment.strftime(pattern))) == whole
    name = moment.strftime("PXL_%Y%m%d_%H%M%S") + f"{milliseconds:03d}.jpg"
    assert named_time_ns(Path(name)) == whole + milliseconds * 1_000_000


@pytest.mark.parametrize(
    "name", ["frame_000123.jpg", "20241301_000000.jpg", "x.jpg", "120240501_134507.jpg", "2024.jpg"]
)
def test_names_that_tell_no_time(name: str) -> None:
    assert named_time_ns(Path(name)) is None


@ANY_FILE
@given(moment=MOMENTS, fraction=st.none() | st.sampled_from(["5", "25", "125"]), order=st.sampled_from("<>"))
def test_exif_times(tmp_path: Path, moment: datetime, fraction: str | None, order: str) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(with_exif(moment, fraction, order))
    expected = 0 if fraction is None else round(float(f"0.{fraction}") * 1e9)
    assert exif_time_ns(path) == since_1970_ns(moment) + expected


@ANY_FILE
@given(data=st.data())
def test_damaged_exif_is_no_time_or_another(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(data.draw(mutated(with_exif(datetime(2024, 5, 1, tzinfo=UTC), "5"))))
    found = exif_time_ns(path)
    assert found is None or isinstance(found, int)


def test_pictures_without_exif_tell_no_time(tmp_path: Path) -> None:
    for data in (JPEG, b"", b"\x89PNG", b"Exif\0\0II*\0"):
        (tmp_path / "a.jpg").write_bytes(data)
        assert exif_time_ns(tmp_path / "a.jpg") is None
    _, error = attempt(lambda: exif_time_ns(tmp_path / "none.jpg"))
    assert "none.jpg: cannot be read" in str(error)


def test_numbers_with_gaps_and_steps() -> None:
    def numbers(*names: str) -> tuple[list[int], list[str]]:
        found, notes = picture_numbers([Path(name) for name in names])
        return found.tolist(), notes

    assert numbers("f1.jpg", "f2.jpg", "f3.jpg") == ([0, 1, 2], [])
    places, (note,) = numbers("f8.jpg", "f9.jpg", "f12.jpg", "f13.jpg")
    assert places == [0, 1, 4, 5]
    assert note.startswith("2 numbers are missing among the names, after f9.jpg")
    assert numbers("f000.jpg", "f030.jpg", "f060.jpg") == ([0, 1, 2], [])
    assert numbers("a1.jpg", "b9.jpg") == ([0, 1], [])
    assert numbers("x.jpg", "y.jpg") == ([0, 1], [])
    assert numbers("f7.jpg") == ([0], [])
    assert numbers("f" + "9" * 40 + ".jpg", "f1.jpg") == ([0, 1], [])


def test_times_of_a_folder(tmp_path: Path) -> None:
    names = [tmp_path / f"{n}.jpg" for n in ("b", "a")]
    moments = [datetime(2024, 5, 1, 12, 0, s, tzinfo=UTC) for s in (7, 2)]
    for path, moment in zip(names, moments, strict=True):
        path.write_bytes(with_exif(moment))
    order, times, (note,) = picture_times(names, None)
    assert (order, times.tolist()) == ([1, 0], [0, 5_000_000_000])
    assert "EXIF" in note
    assert "2024-05-01 12:00:02" in note
    assert picture_times(names, 4.0)[1].tolist() == [0, 250_000_000]
    names[0].write_bytes(with_exif(moments[1]))
    with pytest.raises(DataError, match=r"a\.jpg .*at one time"):
        picture_times(names, None)
    names[0].write_bytes(JPEG)
    with pytest.raises(DataError, match=r"b\.jpg: neither its name nor EXIF"):
        picture_times(names, None)
    stamped = [Path(f"2024050{d}_000000.jpg") for d in (1, 2, 4)]
    assert picture_times(stamped, None)[1].tolist() == [0, 86_400 * 10**9, 3 * 86_400 * 10**9]
    assert picture_times(stamped, 1.0)[1].tolist() == [0, 10**9, 2 * 10**9]


@given(st.lists(st.text("ab019.²", max_size=8), max_size=8))
def test_any_names_have_an_order(names: list[str]) -> None:
    ordered = sorted((Path(name + ".jpg") for name in names), key=natural_key)
    assert len(ordered) == len(names)


def test_names_are_ordered_as_people_do() -> None:
    names = ["f10.jpg", "f9.jpg", "F1.jpg", "f9b.jpg"]
    assert [p.name for p in sorted(map(Path, names), key=natural_key)] == ["F1.jpg", "f9.jpg", "f9b.jpg", "f10.jpg"]
