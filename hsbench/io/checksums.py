"""sha256 of files, and manifests: what a folder held when it was finished, checked later."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hsbench.errors import DataError

_ENDS = {".parquet": b"PAR1", ".png": b"IEND\xaeB`\x82", ".npz": b"PK\5\6", ".json": b"}\n"}
_END_BYTES = {".npz": 22}  # the last record of a zip archive without comment begins with its mark


def sha256_file(path: str | Path) -> str:
    """Lower-case hex sha256 of a file's bytes. Raises DataError where it cannot be read."""
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise DataError(f"cannot read {path}: {error.strerror or error}") from error


def manifest(folder: str | Path, exclude: Collection[str] = ()) -> dict[str, str]:
    """{relative posix path: sha256} of every file under a folder, sorted by path, less the paths in ``exclude``.

    Raises DataError for links and other things that are not plain files: a manifest vouches for content.
    """
    plain, odd = _list(Path(folder), exclude)
    if odd:
        raise DataError(f"{Path(folder) / odd[0]} is not a plain file (a link?); a manifest lists plain files only")
    return {name: sha256_file(Path(folder) / name) for name in plain}


@dataclass(frozen=True)
class FileFault:
    """What is wrong with a file: its relative posix path, how it differs from its manifest, and a line that says so."""

    name: str
    kind: Literal["missing", "extra", "changed", "truncated", "odd"]
    text: str


def verify(folder: str | Path, expected: Mapping[str, str], exclude: Collection[str] = ()) -> list[str]:
    """Every fault of a folder against its manifest, one line each, sorted by path; empty where all is well."""
    return [fault.text for fault in differences(folder, expected, exclude)]


def differences(folder: str | Path, expected: Mapping[str, str], exclude: Collection[str] = ()) -> list[FileFault]:
    """As ``verify``, with the kind of each fault."""
    plain, odd = _list(Path(folder), exclude)
    faults = [FileFault(name, "odd", f"{name}: not a plain file (a link?)") for name in odd]
    faults += [
        FileFault(name, "extra", f"{name}: extra, not in the manifest") for name in plain if name not in expected
    ]
    for name, digest in expected.items():
        if name in plain:
            faults += [fault] if (fault := changed(folder, name, digest)) else []
        elif name not in odd:
            faults.append(FileFault(name, "missing", f"{name}: missing"))
    return sorted(faults, key=lambda fault: fault.name)


def changed(folder: str | Path, name: str, digest: str) -> FileFault | None:
    """How a file differs from its sha256, if it does."""
    path = Path(folder) / name
    found = sha256_file(path)
    if found == digest:
        return None
    if _ends_early(path):
        return FileFault(
            name, "truncated", f"{name}: changed, its end is missing (truncated at {path.stat().st_size} B)"
        )
    return FileFault(name, "changed", f"{name}: changed, sha256 is {found}; expected {digest}")


def _ends_early(path: Path) -> bool:
    """Whether a file lacks what files of its format, as we write them, end with; False for other formats."""
    end = _ENDS.get(path.suffix, b"")
    return path.read_bytes()[-_END_BYTES.get(path.suffix, len(end)) :][: len(end)] != end


def _list(folder: Path, exclude: Collection[str]) -> tuple[dict[str, None], list[str]]:
    """Relative posix paths of plain files (sorted, as the keys of a dict) and of everything else but folders."""
    if not folder.is_dir():
        raise DataError(f"{folder} is not a folder")
    plain: list[str] = []
    odd: list[str] = []
    pending = [""]
    while pending:
        prefix = pending.pop()
        with os.scandir(folder / prefix) as entries:
            for entry in entries:
                name = prefix + entry.name
                if entry.is_dir(follow_symlinks=False):
                    pending.append(name + "/")
                elif name not in exclude:
                    (plain if entry.is_file(follow_symlinks=False) else odd).append(name)
    return dict.fromkeys(sorted(plain)), sorted(odd)
