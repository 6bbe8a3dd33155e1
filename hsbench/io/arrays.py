"""Named arrays in NPZ files, read without trust and written with reproducible bytes.

Reading never unpickles: members, sizes, dtypes and shapes are compared with what is expected before an array is
allocated. Fortran order is accepted and comes out in C order with the same values. Writing uses fixed dates and
sorted names: same arrays, same bytes (for one version of zlib).
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from hsbench.errors import DataError, SchemaError
from hsbench.io.archives import ArchiveLimits, member_faults, open_zip, read_member
from hsbench.io.atomic import write_bytes
from hsbench.typing import AnyArray

MAX_ARRAYS = 256
"""Arrays in one file."""

MAX_OPEN_BYTES = 16 << 20
"""Bytes of an array one of whose lengths is open."""

MAX_LOAD_BYTES = 4 << 30
"""Decompressed bytes of a file of our own."""

_MAX_HEADER_BYTES = 4096
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest date a zip can hold


@dataclass(frozen=True)
class ArraySpec:
    """What one array must be: shape (None = any length), dtype by numpy name, and whether every value is finite."""

    shape: tuple[int | None, ...]
    dtype: str
    finite: bool = True

    def __post_init__(self) -> None:
        if np.dtype(self.dtype).hasobject:
            raise SchemaError(f"array spec has dtype {self.dtype}; expected plain numbers, never objects")

    @property
    def max_bytes(self) -> int:
        """Bytes of the largest array that fits, ``MAX_OPEN_BYTES`` where a length is open."""
        if None in self.shape:
            return MAX_OPEN_BYTES
        return math.prod(side or 0 for side in self.shape) * np.dtype(self.dtype).itemsize

    def fault(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> str | None:
        """Why an array of this shape and dtype does not fit, in one line, or None."""
        if pickle := _pickle_fault(dtype):
            return f"{pickle}; expected {self.dtype}"
        if dtype != np.dtype(self.dtype):
            return f"dtype is {dtype}; expected {self.dtype}"
        if len(shape) != len(self.shape) or any(w not in (None, g) for w, g in zip(self.shape, shape, strict=True)):
            wanted = ", ".join("any" if side is None else str(side) for side in self.shape)
            return f"shape is {shape}; expected ({wanted})"
        return None


def read_npz(source: str | Path | bytes, specs: Mapping[str, ArraySpec], max_bytes: int) -> dict[str, AnyArray]:
    """Read exactly the arrays of ``specs`` from a path or from bytes, at most ``max_bytes`` decompressed.

    Raises DataError with every fault, one a line, each naming the file (if a path) and the array.
    """
    arrays, faults = collect_npz(source, specs, max_bytes)
    if faults:
        prefix = "" if isinstance(source, bytes) else f"{source}: "
        raise DataError("\n".join(prefix + fault for fault in faults))
    return arrays


def load_npz(path: str | Path) -> dict[str, AnyArray]:
    """Every array of a file of our own, whatever its names and shapes; still nothing is unpickled.

    For what strangers send, use ``read_npz``. Raises DataError with every fault, naming the file and the array.
    """
    try:
        with Path(path).open("rb") as file:
            arrays, faults = _collect(file, None, MAX_LOAD_BYTES)
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror or error}") from error
    if faults:
        raise DataError("\n".join(f"{path}: {fault}" for fault in faults))
    return arrays


def collect_npz(
    source: str | Path | bytes, specs: Mapping[str, ArraySpec], max_bytes: int
) -> tuple[dict[str, AnyArray], list[str]]:
    """As ``read_npz``, but returns the sound arrays and the list of faults instead of raising."""
    try:
        with io.BytesIO(source) if isinstance(source, bytes) else Path(source).open("rb") as file:
            return _collect(file, specs, max_bytes)
    except OSError as error:
        return {}, [f"cannot be read: {error.strerror or error}"]


def npz_bytes(arrays: Mapping[str, AnyArray]) -> bytes:
    """The bytes of an NPZ file, compressed; the same arrays give the same bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(arrays):
            array = np.asarray(arrays[name], order="C")
            if array.dtype.hasobject:
                raise SchemaError(f"array {name!r} has dtype {array.dtype}; objects would need pickle")
            content = io.BytesIO()
            np.lib.format.write_array(content, array, version=(1, 0), allow_pickle=False)
            info = zipfile.ZipInfo(f"{name}.npy", date_time=_EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3  # else it says on which system the file was written
            info.external_attr = 0o644 << 16
            archive.writestr(info, content.getvalue())
    return buffer.getvalue()


def write_npz(path: str | Path, **arrays: AnyArray) -> None:
    """Write arrays to an NPZ file, atomically and with reproducible bytes."""
    write_bytes(path, npz_bytes(arrays))


def _collect(
    file: BinaryIO, specs: Mapping[str, ArraySpec] | None, max_bytes: int
) -> tuple[dict[str, AnyArray], list[str]]:
    limits = ArchiveLimits(files=MAX_ARRAYS, file_bytes=max_bytes, total_bytes=max_bytes)
    try:
        archive = open_zip(file, limits)
    except DataError as error:
        return {}, [f"{error} (expected an NPZ file)"]
    with archive:
        infos = archive.infolist()
        faults = member_faults(infos, limits)
        if faults:
            return {}, faults
        arrays: dict[str, AnyArray] = {}
        by_name = {info.filename: info for info in infos}
        for name, spec in ({_stem(i): None for i in by_name} if specs is None else specs).items():
            info = by_name.pop(f"{name}.npy", None)
            if info is None:
                faults.append(f"array {name!r} is missing; found {_names(infos)}")
                continue
            try:
                arrays[name] = _read_array(archive, info, spec)
            except DataError as error:
                faults.append(f"array {name!r}: {error}")
        faults.extend(f"unexpected array {_stem(name)!r}; expected only {', '.join(specs or ())}" for name in by_name)
    return arrays, faults


def _read_array(archive: zipfile.ZipFile, info: zipfile.ZipInfo, spec: ArraySpec | None) -> AnyArray:
    data = io.BytesIO(_peek(archive, info))
    try:
        version = np.lib.format.read_magic(data)
        if version not in ((1, 0), (2, 0)):
            raise ValueError(f"npy version {version}")
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran_order, dtype = read(data, max_header_size=_MAX_HEADER_BYTES)
    except Exception as error:  # numpy lets through whatever tokenising and evaluating the text raises
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise DataError(f"header cannot be read ({reason}); expected an npy array") from error
    fault = _pickle_fault(dtype) if spec is None else spec.fault(shape, dtype)
    if fault:
        raise DataError(fault)
    expected = data.tell() + math.prod(shape) * dtype.itemsize
    if info.file_size != expected:
        raise DataError(f"holds {info.file_size} bytes where its header asks for {expected}; truncated or padded")
    content = read_member(archive, info)
    flat = np.frombuffer(content, dtype=dtype, offset=data.tell())
    array = np.array(flat.reshape(shape, order="F" if fortran_order else "C"), order="C")
    if spec is not None and spec.finite and dtype.kind in "fc" and not np.isfinite(array).all():
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise DataError(f"holds {array[at]} at {at}; expected finite values only")
    return array


def _pickle_fault(dtype: np.dtype[Any]) -> str | None:
    return "object array would need pickle, which can run code" if dtype.hasobject else None


def _peek(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> bytes:
    """The first bytes of a member, enough for any header that is accepted."""
    try:
        with archive.open(info) as member:
            return member.read(_MAX_HEADER_BYTES + 16)
    except Exception as error:  # zlib, zipfile and struct each have their own for the same thing
        raise DataError(f"truncated or damaged ({error})") from error


def _names(infos: list[zipfile.ZipInfo]) -> str:
    return ", ".join(repr(_stem(info.filename)) for info in infos[:8]) or "none"


def _stem(filename: str) -> str:
    return filename.removesuffix(".npy")
