"""sha256 of files, and manifests: what a folder held when it was finished, checked later."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Mapping
from pathlib import Path

from hsbench.errors import DataError


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


def verify(folder: str | Path, expected: Mapping[str, str], exclude: Collection[str] = ()) -> list[str]:
    """Every fault of a folder against its manifest, one line each, sorted by path; empty where all is well."""
    plain, odd = _list(Path(folder), exclude)
    faults = {name: f"{name}: not a plain file (a link?)" for name in odd}
    for name in plain:
        if name not in expected:
            faults[name] = f"{name}: extra, not in the manifest"
        elif (found := sha256_file(Path(folder) / name)) != expected[name]:
            faults[name] = f"{name}: changed, sha256 is {found}; expected {expected[name]}"
    for name in expected:
        if name not in faults and name not in plain:
            faults[name] = f"{name}: missing"
    return [faults[name] for name in sorted(faults)]


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
