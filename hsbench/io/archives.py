"""Opening zip archives that a stranger made: limits and names are checked before anything is decompressed.

Nothing here writes to disk. ``open_zip`` bounds the work of reading the directory itself; ``member_faults`` names
every member that could do harm; ``read_member`` gives the bytes of one, never more than it declared.
"""

from __future__ import annotations

import stat
import struct
import unicodedata
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import BinaryIO

from hsbench.errors import DataError

MAX_RATIO = 1100
"""Deflate cannot exceed 1032:1, so a member that claims more has a forged size."""

MAX_NAME_LENGTH = 200
"""Characters in a member's path."""

_END = struct.Struct("<4s4H2LH")  # end of central directory
_END64_LOCATOR = struct.Struct("<4sLQL")
_END64 = struct.Struct("<4sQ2H2L4Q")
_ENTRY_BYTES = 46  # least size of one directory entry
_ENCRYPTED = 0x1


@dataclass(frozen=True)
class ArchiveLimits:
    """What one archive may hold: files, bytes of one file and bytes of all, decompressed."""

    files: int
    file_bytes: int
    total_bytes: int


def open_zip(file: BinaryIO, limits: ArchiveLimits) -> zipfile.ZipFile:
    """Open an archive whose directory is small enough. Raises DataError: not a zip, truncated, too many entries."""
    _check_directory(file, limits)
    try:
        archive = zipfile.ZipFile(file)
    except (zipfile.BadZipFile, NotImplementedError, UnicodeDecodeError, struct.error, OSError, ValueError) as error:
        raise DataError(f"damaged zip archive ({error})") from error
    if len(archive.infolist()) > limits.files:
        raise DataError(f"zip archive holds {len(archive.infolist())} entries; the limit is {limits.files}")
    return archive


def member_faults(infos: Sequence[zipfile.ZipInfo], limits: ArchiveLimits) -> list[str]:
    """One line for each thing wrong with the members, judged from the directory alone."""
    faults: list[str] = []
    total = 0
    names: list[str] = []
    for info in infos:
        name = info.orig_filename
        faults.extend(f"{name!r}: {fault}" for fault in _member_faults(info, limits))
        if not is_folder(info):
            names.append(name)
            total += info.file_size
    if total > limits.total_bytes and not any(info.file_size > limits.file_bytes for info in infos):
        faults.append(f"files declare {total} bytes together; the limit is {limits.total_bytes}")
    return faults + clash_faults(names)


def is_folder(info: zipfile.ZipInfo) -> bool:
    """Whether a member is a folder, by its name as stored; ``ZipInfo.is_dir`` fails on an empty one."""
    return info.orig_filename.endswith("/")


def path_fault(name: str) -> str | None:
    """Why a relative posix path is unsafe (climbs, absolute, backslash, control characters), or None."""
    if not name or len(name) > MAX_NAME_LENGTH:
        return f"path of {len(name)} characters; expected 1-{MAX_NAME_LENGTH}"
    if any(unicodedata.category(c).startswith("C") for c in name):
        return "path holds control or invisible characters"
    if name.startswith("/") or (len(name) > 1 and name[1] == ":"):
        return "absolute path; expected one relative to the submission"
    if "\\" in name:
        return "path holds a backslash; expected forward slashes (packed on Windows by an old tool?)"
    parts = name.split("/")
    if ".." in parts:
        return "path climbs out of its folder with '..'"
    if "." in parts or "" in parts:
        return "path holds an empty or '.' component"
    return None


def clash_faults(names: Iterable[str]) -> list[str]:
    """One line for each name that is there twice, or that some file systems cannot tell from another."""
    faults: list[str] = []
    seen: dict[str, str] = {}
    for name in names:
        first = seen.setdefault(unicodedata.normalize("NFC", name).casefold(), name)
        if first is not name:
            faults.append(
                f"{name!r}: there twice"
                if first == name
                else f"{name!r}: differs from {first!r} only in case or accents; expected distinct names"
            )
    return faults


def read_member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> bytes:
    """The bytes of one member, exactly as many as it declares. Raises DataError: truncated or damaged."""
    try:
        with archive.open(info) as member:
            data = member.read(info.file_size)
            # reading on to the end is what compares the checksum
            surplus = member.read(1)
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError, NotImplementedError, ValueError) as error:
        raise DataError(f"truncated or damaged ({error})") from error
    if len(data) != info.file_size or surplus:
        raise DataError(f"truncated: {len(data)} bytes of {info.file_size}")
    return data


def _member_faults(info: zipfile.ZipInfo, limits: ArchiveLimits) -> Iterable[str]:
    fault = path_fault(info.orig_filename.removesuffix("/") if is_folder(info) else info.orig_filename)
    if fault:
        yield fault
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind and kind not in (stat.S_IFREG, stat.S_IFDIR):
        yield "a link" if kind == stat.S_IFLNK else "a device, pipe or socket"
    if info.flag_bits & _ENCRYPTED:
        yield "encrypted; expected plain members"
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        yield f"compression method {info.compress_type}; expected stored or deflate"
    if info.file_size > limits.file_bytes:
        yield f"declares {info.file_size} bytes; the limit for one file is {limits.file_bytes}"
    if info.file_size > MAX_RATIO * max(info.compress_size, 1):
        yield f"declares {info.file_size} bytes from {info.compress_size}; more than {MAX_RATIO}:1 is a bomb or forged"


def _check_directory(file: BinaryIO, limits: ArchiveLimits) -> None:
    """Read where the directory is as zipfile does, and refuse one that would take long to parse."""
    size = file.seek(0, 2)
    window = min(size, _END.size + 0xFFFF + _END64_LOCATOR.size + _END64.size)
    file.seek(size - window)
    tail = file.read(window)
    at = len(tail) - _END.size
    if at < 0 or tail[at : at + 4] != b"PK\5\6" or tail[-2:] != b"\0\0":
        at = tail.rfind(b"PK\5\6")
    if at < 0 or len(tail) - at < _END.size:
        file.seek(0)
        start = file.read(4)
        truncated = start == b"PK\3\4"
        raise DataError(
            "truncated zip archive: its directory, at the end, is gone" if truncated else "not a zip archive"
        )
    _, _, _, _, entries, directory_bytes, _, _ = _END.unpack_from(tail, at)
    locator = at - _END64_LOCATOR.size
    end64 = locator - _END64.size
    if end64 >= 0 and tail[locator : locator + 4] == b"PK\6\7" and tail[end64 : end64 + 4] == b"PK\6\6":
        fields = _END64.unpack_from(tail, end64)
        entries, directory_bytes = fields[7], fields[8]
    if entries > limits.files:
        raise DataError(f"zip archive holds {entries} entries; the limit is {limits.files}")
    if directory_bytes > limits.files * (_ENTRY_BYTES + 4 * MAX_NAME_LENGTH):
        raise DataError(f"zip directory takes {directory_bytes} bytes; too much for {limits.files} entries, the limit")
