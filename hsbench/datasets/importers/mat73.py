"""MATLAB files of version 7.3 (HDF5), read without trust, as the same plain Python values as those of version 5.

A struct is a group, whose fields, for an array of structs, are arrays of references; a cell array is an array of
references; text is numbers of letters. Axes are reversed. Everything must lie in the file itself, and sizes are checked
before anything is read.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers.hdf5 import check_chunks
from hsbench.errors import DataError, MissingExtraError

MAX_PLAIN_BYTES = 64 << 20
"""Of all numbers, and of one chunk of an array."""
MAX_VALUES = 1_000_000
MAX_DEPTH = 32


def read_mat73(path: Path, variable: str) -> Any:
    """Path of a file and the name of a variable -> its value.

    Raises DataError, naming the file and the place in it, for damage and for what is too large; MissingExtraError
    without the extra ``import``.
    """
    try:
        import h5py
    except ModuleNotFoundError as error:
        raise MissingExtraError("a MATLAB file of version 7.3", error.name or "h5py", "import") from error
    try:
        with h5py.File(path, "r", locking=False) as file:
            if not isinstance(file.get(variable, getlink=True), h5py.HardLink):
                raise DataError(f"has no {variable!r}; expected it (another data set?)")
            return _Reader(h5py, file).value(file[variable], 0)
    except DataError as error:
        raise DataError(f"{path}: {error}") from error
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError) as error:  # HDF5 has no one error
        reason = ascii(" ".join(str(error).split()))[1:200]
        raise DataError(f"{path}: cannot be read: {reason}; expected MATLAB 7.3, HDF5 (an incomplete copy?)") from error


class _Reader:
    """Values of one open file; what was read so far counts against the limits."""

    def __init__(self, h5py: Any, file: Any) -> None:
        self.h5py, self.file = h5py, file
        self.values, self.bytes = 0, 0

    def value(self, item: Any, depth: int) -> Any:
        self.values += 1
        if depth > MAX_DEPTH or self.values > MAX_VALUES:
            raise DataError(f"{_place(item)}: more than {MAX_VALUES:,} values, or nested deeper than {MAX_DEPTH}")
        if isinstance(item, self.h5py.Group):
            return self.struct(item, depth)
        kind = _attribute(item, "MATLAB_class")
        if "MATLAB_empty" in item.attrs:
            return "" if kind == "char" else np.empty((0, 0))
        array = self.array(item)
        if array.dtype == self.h5py.ref_dtype:
            return [self.value(self.file[reference], depth + 1) for reference in array.ravel()]
        if array.dtype.kind not in "fiub":
            return None
        if kind == "char":
            return "".join(chr(int(code) & 0xFFFF) for code in array.ravel())
        return array.T

    def struct(self, group: Any, depth: int) -> Any:
        """A dict, or for an array of structs a list of them."""
        fields: dict[str, Any] = {}
        for name in group:
            if not isinstance(group.get(name, getlink=True), self.h5py.HardLink):
                raise DataError(f"{_place(group)} links to another place; expected everything in the file itself")
            fields[str(name)] = group[name]
        if not fields or not all(self.is_column(item) for item in fields.values()):
            return {name: self.value(item, depth + 1) for name, item in fields.items()}
        columns = {name: self.value(item, depth + 1) for name, item in fields.items()}
        lengths = {len(column) for column in columns.values()}
        if len(lengths) != 1:
            raise DataError(f"{_place(group)} has fields of {sorted(lengths)[:8]} structs; expected as many of each")
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def is_column(self, item: Any) -> bool:
        """Whether a field is one of an array of structs: references without a class of their own."""
        known = isinstance(item, self.h5py.Dataset) and item.dtype == self.h5py.ref_dtype
        return known and "MATLAB_class" not in item.attrs

    def array(self, item: Any) -> Any:
        if not isinstance(item, self.h5py.Dataset) or item.shape is None or item.is_virtual or item.external:
            raise DataError(f"{_place(item)} is no array in the file itself; expected one")
        self.bytes += int(item.size) * item.dtype.itemsize
        if self.bytes > MAX_PLAIN_BYTES:
            raise DataError(f"{_place(item)}: more than {MAX_PLAIN_BYTES:,} bytes in all")
        check_chunks(item, _place(item), MAX_PLAIN_BYTES)
        return np.atleast_1d(np.asarray(item[()]))


def _attribute(item: Any, name: str) -> str:
    value = item.attrs.get(name, b"")
    return value.decode("ascii", errors="replace") if isinstance(value, bytes) else str(value)


def _place(item: Any) -> str:
    return ascii(str(getattr(item, "name", None)))[1:-1][:80]
