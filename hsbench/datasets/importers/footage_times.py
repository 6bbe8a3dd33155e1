"""When the pictures of a folder were taken: by their names, by their EXIF data, or by a rate.

A name tells a time if it holds year, month, day, hour, minute and second in this order, perhaps with milliseconds:
``2024-05-01_13-45-07.jpg``, ``IMG_20240501_134507123.jpg``. EXIF's DateTimeOriginal and SubSecTimeOriginal are read of
JPEG files. With a rate, names that differ in one number only are numbered by it, and numbers that are missing are gaps.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from hsbench.datasets.importers.openpose import frame_times
from hsbench.errors import DataError
from hsbench.schema.episode import NS_PER_S
from hsbench.typing import IntArray

NAMED_TIME = re.compile(
    r"(?<!\d)((?:19|20)\d\d)[-_.]?(\d\d)[-_.]?(\d\d)[-_.T ]?(\d\d)[-_.:h]?(\d\d)[-_.:m]?(\d\d)(?:[-_.]?(\d{3}))?(?!\d)",
    re.ASCII,
)
EXIF_TIME = re.compile(r"(\d{4}):(\d\d):(\d\d) (\d\d):(\d\d):(\d\d)", re.ASCII)
LAST_NUMBER = re.compile(r"^(.*?)(\d+)(\D*)$", re.ASCII | re.DOTALL)
MAX_DIGITS = 15  # what int64 holds for sure
EXIF_HEAD_BYTES = 2**17  # the block is the first or second of a file, and of 64 kB at most
EXIF_POINTER, DATE_TIME_ORIGINAL, SUB_SECONDS = 0x8769, 0x9003, 0x9291  # tags of EXIF 2.3
ASCII, LONG = 2, 4  # types of its values
SHOWN = 6  # names or numbers in one message


def natural_key(path: Path) -> tuple[tuple[int, int, str], ...]:
    """Orders names as people do: ``frame9`` before ``frame10``."""
    pieces = re.split(r"(\d+)", path.name.lower(), flags=re.ASCII)
    return tuple((0, int(p[:4000]), "") if p.isdecimal() and p.isascii() else (1, 0, p) for p in pieces)


def picture_times(files: Sequence[Path], rate_hz: float | None) -> tuple[list[int], IntArray, list[str]]:
    """Files in natural order -> (their order in time, (n,) int64 ns from the first, notes).

    rate_hz: pictures a second; None: names or EXIF must tell. Raises DataError where they do not, and for equal times.
    """
    named = [named_time_ns(file) for file in files]
    if rate_hz is not None:
        numbers, notes = picture_numbers(files) if None in named else (np.arange(len(files)), [])
        return list(range(len(files))), frame_times(numbers, rate_hz), notes
    where = "their names"
    if None in named:
        where, named = "their EXIF data", [exif_time_ns(file) for file in files]
    if None in named:
        file = files[named.index(None)]
        wanted = "expected that, or their rate (--rate, or rate_hz of capture.json)"
        raise DataError(f"{file}: neither its name nor EXIF data tell when it was taken; {wanted}")
    times = np.array(named, dtype=np.int64)
    order = np.argsort(times, kind="stable")
    times = times[order]
    same = np.flatnonzero(np.diff(times) == 0)
    if len(same):
        pair = [files[order[same[0] + k]].name for k in (0, 1)]
        raise DataError(f"{files[0].parent}: {pair[0]} and {pair[1]} were taken at one time by {where}; give --rate")
    start = datetime.fromtimestamp(times[0] // NS_PER_S, UTC)
    return order.tolist(), times - times[0], [f"times are from {where}; the first is {start:%Y-%m-%d %H:%M:%S}"]


def picture_numbers(files: Sequence[Path]) -> tuple[IntArray, list[str]]:
    """(n,) numbers of pictures from 0, by the number in which their names differ, else by place; notes on gaps."""
    matches = [LAST_NUMBER.match(file.stem) for file in files]
    found = [match.groups() for match in matches if match is not None and len(match[2]) <= MAX_DIGITS]
    numbers = np.array([int(number) for _, number, _ in found], dtype=np.int64)
    around = {(before, after) for before, _, after in found}
    if len(found) < len(files) or len(around) != 1 or (np.diff(numbers) <= 0).any():
        return np.arange(len(files)), []
    step = math.gcd(*np.diff(numbers).tolist()) or 1
    places = (numbers - numbers[0]) // step
    missing = int(places[-1]) + 1 - len(files)
    if not missing:
        return places, []
    after = np.flatnonzero(np.diff(places) > 1)[:SHOWN]
    shown = ", ".join(files[i].name for i in after)
    return places, [f"{missing} numbers are missing among the names, after {shown}; they are gaps in time"]


def named_time_ns(file: Path) -> int | None:
    """Nanoseconds since 1970 by the clock that named a file, None if its name tells no time."""
    match = NAMED_TIME.search(file.stem)
    return None if match is None else _nanoseconds(match.groups()[:6], match[7])


def exif_time_ns(file: Path) -> int | None:
    """Nanoseconds since 1970 by the clock of the camera, None without a sound DateTimeOriginal."""
    try:
        with file.open("rb") as opened:
            head = opened.read(EXIF_HEAD_BYTES)
    except OSError as error:
        raise DataError(f"{file}: cannot be read: {error.strerror or error}") from error
    start = head.find(b"Exif\0\0")
    if not head.startswith(b"\xff\xd8") or start < 0:
        return None
    values = _exif_texts(head[start + 6 :])
    match = EXIF_TIME.fullmatch(values.get(DATE_TIME_ORIGINAL, ""))
    digits = values.get(SUB_SECONDS, "").strip()
    fraction = digits.ljust(9, "0")[:9] if digits.isdecimal() and digits.isascii() else None
    return None if match is None else _nanoseconds(match.groups(), fraction)


def _nanoseconds(parts: Sequence[str], fraction: str | None) -> int | None:
    year, month, day, hour, minute, second = map(int, parts)
    try:
        seconds = int(datetime(year, month, day, hour, minute, second, tzinfo=UTC).timestamp())
    except ValueError:
        return None
    return seconds * NS_PER_S + (0 if fraction is None else int(fraction.ljust(9, "0")))


def _exif_texts(block: bytes) -> dict[int, str]:
    """Tag -> text, of a TIFF block; what is damaged is left out."""
    order = {b"II": "<", b"MM": ">"}.get(block[:2])
    if order is None or len(block) < 8:
        return {}
    texts: dict[int, str] = {}
    entries = list(_entries(block, int(*struct.unpack_from(order + "I", block, 4)), order))
    pointers = [value for tag, kind, _, value in entries if (tag, kind) == (EXIF_POINTER, LONG)]
    for pointer in pointers[:1]:
        for tag, kind, count, value in _entries(block, pointer, order):
            if kind == ASCII:
                raw = struct.pack(order + "I", value)[:count] if count <= 4 else block[value : value + count]
                texts[tag] = raw.split(b"\0")[0].decode("ascii", "replace")
    return texts


def _entries(block: bytes, start: int, order: str) -> Iterator[tuple[int, int, int, int]]:
    """(tag, type, count, value or its place) of a directory of TIFF, as far as the block reaches."""
    if start + 2 <= len(block):
        (count,) = struct.unpack_from(order + "H", block, start)
        for place in range(start + 2, min(start + 2 + 12 * count, len(block) - 11), 12):
            yield struct.unpack_from(order + "HHII", block, place)
