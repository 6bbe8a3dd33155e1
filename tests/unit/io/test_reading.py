"""Files are read whole, up to a limit and not a byte more."""

from __future__ import annotations

from pathlib import Path

import pytest

from hsbench.errors import DataError
from hsbench.io.reading import read_limited


def test_a_file_of_the_limit_is_read_and_one_byte_more_is_not(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(bytes(range(100)))
    assert read_limited(path, 100) == bytes(range(100))
    with pytest.raises(DataError, match=r"a\.bin: more than 99 bytes; expected at most that$"):
        read_limited(path, 99)
    with pytest.raises(DataError, match=r"more than 99 bytes; expected at most that \(a film\?\)$"):
        read_limited(path, 99, "a film?")


def test_what_cannot_be_opened_says_why(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="none: cannot be read: No such file"):
        read_limited(tmp_path / "none", 10)
    with pytest.raises(DataError, match="cannot be read: Is a directory"):
        read_limited(tmp_path, 10)
