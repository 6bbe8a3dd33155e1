"""MATLAB files of version 5 (``save -v7`` and older), read without trust, as plain Python values.

A struct becomes a dict, an array of structs and a cell array a list (column by column), text a str, numbers an array of
their shape in the type they are stored in; what else there is (objects, complex or sparse numbers) becomes None.
Lengths are compared with the bytes that are there before anything is allocated, and decompression stops at
``MAX_PLAIN_BYTES``.
Layout: MathWorks, "MAT-File Format", level 5.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.errors import DataError
from hsbench.io.reading import read_limited

MAX_FILE_BYTES = 32 << 20
MAX_PLAIN_BYTES = 64 << 20
MAX_DEPTH = 32
MAX_DIMENSIONS = 8
HEADER_BYTES = 128
MAT73_STARTS = (b"MATLAB 7.3", b"\x89HDF\r\n\x1a\n")
"""HDF5, behind the text that MATLAB writes before it, and without."""

_COMPRESSED, _MATRIX = 15, 14
_CELL, _STRUCT, _CHAR = 1, 2, 4
_NUMBERS = range(6, 16)
_CLASS_MASK, _COMPLEX = 0xFF, 0x0800
_DTYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_ENCODINGS = {16: "utf-8", 17: "utf-16", 18: "utf-32"}


def read_mat5(path: Path) -> dict[str, Any]:
    """Path of a file -> its variables by name.

    Raises DataError, naming the file and the offset, for damage, for HDF5 (version 7.3), and for what is too large.
    """
    data = read_limited(path, MAX_FILE_BYTES, "another file?")
    if data.startswith(MAT73_STARTS):
        raise DataError(f"{path}: is a MATLAB file of version 7.3 (HDF5); expected version 5 (save it with -v7)")
    endian = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if endian is None or struct.unpack(f"{endian}H", data[124:126])[0] != 0x0100:
        raise DataError(f"{path}: is no MATLAB file of version 5 at offset 124 (another file, or an incomplete copy?)")
    try:
        return dict(_variables(data, endian))
    except _FaultError as fault:
        raise DataError(f"{path} offset {fault.offset}: {fault}") from fault


class _FaultError(Exception):
    """What is wrong, and where in the file; within a compressed variable, where in its plain bytes."""

    def __init__(self, offset: int | str, found: str) -> None:
        self.offset = offset
        super().__init__(found)


def _variables(data: bytes, endian: str) -> Iterator[tuple[str, Any]]:
    at, left = HEADER_BYTES, MAX_PLAIN_BYTES
    while at < len(data):
        if len(data) - at < 8:
            raise _FaultError(at, f"{len(data) - at} bytes; expected a variable (an incomplete copy?)")
        kind, size = struct.unpack(f"{endian}II", data[at : at + 8])
        if size > len(data) - at - 8:
            raise _FaultError(at, f"a variable of {size:,} bytes of which {len(data) - at - 8:,} are there")
        content = data[at + 8 : at + 8 + size]
        if kind == _COMPRESSED:
            plain = _inflated(content, left, at)
            left -= len(plain)
            reader = _Reader(plain, endian, f"{at}, plain ")
            inner, end = reader.matrix_tag(0)
            yield reader.matrix(inner, end, 0)
        elif kind == _MATRIX:
            yield _Reader(data, endian, "").matrix(at + 8, at + 8 + size, 0)
        else:
            raise _FaultError(at, f"data of type {kind}; expected a variable (bytes swapped?)")
        at += 8 + size


def _inflated(content: bytes, limit: int, at: int) -> bytes:
    stream = zlib.decompressobj()
    try:
        plain = stream.decompress(content, limit + 1)
    except zlib.error as error:
        raise _FaultError(at, f"a compressed variable is damaged ({error})") from error
    if len(plain) > limit:
        raise _FaultError(at, f"more than {MAX_PLAIN_BYTES:,} bytes in all; expected at most that (not a room model?)")
    if not stream.eof:
        raise _FaultError(at, "a compressed variable ends early (an incomplete copy?)")
    return plain


@dataclass(frozen=True)
class _Reader:
    """The elements in some bytes. ``prefix``: what goes before an offset in a message."""

    data: bytes
    endian: str
    prefix: str

    def fault(self, at: int, found: str) -> _FaultError:
        return _FaultError(f"{self.prefix}{at}", found)

    def element(self, at: int, end: int) -> tuple[int, int, int, int]:
        """(type, start and end of its data, start of the next) of the element at an offset."""
        if end - at < 8:
            raise self.fault(at, f"{end - at} bytes; expected an element (an incomplete copy?)")
        kind, size = struct.unpack_from(f"{self.endian}II", self.data, at)
        if kind >> 16:  # a small element: four bytes of data beside the tag
            kind, size = kind & 0xFFFF, kind >> 16
            if size > 4:
                raise self.fault(at, f"a small element of {size} bytes; expected at most 4")
            return kind, at + 4, at + 4 + size, at + 8
        if size > end - at - 8:
            raise self.fault(at, f"an element of {size:,} bytes where {end - at - 8:,} are left")
        padded = at + 8 + size + (-size) % 8
        return kind, at + 8, at + 8 + size, min(padded, end)

    def matrix_tag(self, at: int) -> tuple[int, int]:
        """Start and end of the array at an offset."""
        kind, start, stop, _ = self.element(at, len(self.data))
        if kind != _MATRIX:
            raise self.fault(at, f"data of type {kind}; expected an array")
        return start, stop

    def numbers(self, at: int, end: int) -> tuple[Any, int]:
        """(values as a flat array of the type they are stored in, start of the next element)."""
        kind, start, stop, after = self.element(at, end)
        if kind not in _DTYPES:
            raise self.fault(at, f"data of type {kind}; expected numbers")
        dtype = np.dtype(self.endian + _DTYPES[kind])
        if (stop - start) % dtype.itemsize:
            raise self.fault(at, f"{stop - start} bytes of {dtype}; expected whole numbers of them")
        return np.frombuffer(self.data, dtype, (stop - start) // dtype.itemsize, start), after

    def matrix(self, at: int, end: int, depth: int) -> tuple[str, Any]:
        """(name, value) of the array in [at, end)."""
        if at == end:
            return "", np.empty((0, 0))  # an empty place in a cell array
        if depth > MAX_DEPTH:
            raise self.fault(at, f"nested deeper than {MAX_DEPTH}")
        flags, after = self.numbers(at, end)
        dimensions, after = self.numbers(after, end)
        name, after = self.numbers(after, end)
        if len(flags) != 2 or not 2 <= len(dimensions) <= MAX_DIMENSIONS or (dimensions.astype(np.int64) < 0).any():
            raise self.fault(at, f"flags {flags.tolist()[:8]}, sides {dimensions.tolist()[:8]}; expected an array")
        shape = tuple(int(side) for side in dimensions)
        kind = int(flags[0]) & _CLASS_MASK
        count = math.prod(shape)
        if kind == _CELL:
            return _text(name), self.many(after, end, count, depth)
        if kind == _STRUCT:
            return _text(name), self.structs(after, end, count, depth)
        if kind == _CHAR:
            return _text(name), self.characters(after, end)
        if kind in _NUMBERS and not int(flags[0]) & _COMPLEX:
            values, _ = self.numbers(after, end)
            if len(values) != count:
                raise self.fault(after, f"{len(values):,} numbers in an array of {count:,}")
            return _text(name), values.reshape(shape, order="F")
        return _text(name), None

    def many(self, at: int, end: int, count: int, depth: int) -> list[Any]:
        """The values of ``count`` arrays one after another."""
        if count * 8 > end - at:
            raise self.fault(at, f"{count:,} arrays in {end - at:,} bytes; expected 8 bytes or more each")
        found = []
        for _ in range(count):
            kind, start, stop, after = self.element(at, end)
            if kind != _MATRIX:
                raise self.fault(at, f"data of type {kind}; expected an array")
            found.append(self.matrix(start, stop, depth + 1)[1])
            at = after
        return found

    def structs(self, at: int, end: int, count: int, depth: int) -> Any:
        """A dict for one struct, a list of them for any other number."""
        length, after = self.numbers(at, end)
        names, after = self.numbers(after, end)
        if len(length) != 1 or int(length[0]) < 1 or len(names) % int(length[0]):
            raise self.fault(at, f"field names of {length.tolist()[:4]} in {len(names)} bytes; expected equal lengths")
        width = int(length[0])
        fields = [_text(names[i : i + width]) for i in range(0, len(names), width)]
        if not fields:
            return {} if count == 1 else []
        values = self.many(after, end, count * len(fields), depth)
        rows = [dict(zip(fields, values[i : i + len(fields)], strict=True)) for i in range(0, len(values), len(fields))]
        return rows[0] if count == 1 else rows

    def characters(self, at: int, end: int) -> str:
        """A row of text."""
        kind, start, stop, _ = self.element(at, end)
        if kind in _ENCODINGS:
            order = "" if kind == 16 else "-le" if self.endian == "<" else "-be"
            return self.data[start:stop].decode(_ENCODINGS[kind] + order, errors="replace")
        return "".join(chr(code) for code in self.numbers(at, end)[0].astype(np.uint16))


def _text(codes: Any) -> str:
    return bytes(codes.astype(np.uint8)).split(b"\0")[0].decode("ascii", errors="replace")
