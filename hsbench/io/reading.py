"""Reading whole files of a bounded size, so that a hostile or mistaken one is refused before it fills the memory."""

from __future__ import annotations

from pathlib import Path

from hsbench.errors import DataError


def read_limited(path: Path, limit: int, hint: str = "") -> bytes:
    """The bytes of a file. Raises DataError, with the hint, if it cannot be read or has more than ``limit``."""
    try:
        with path.open("rb") as file:
            data = file.read(limit + 1)
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror or error}") from error
    if len(data) > limit:
        raise DataError(f"{path}: more than {limit:,} bytes; expected at most that{f' ({hint})' if hint else ''}")
    return data
