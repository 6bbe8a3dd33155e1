"""Atomic writes: a file or folder under its final name is always whole.

Data goes to a hidden sibling (``.<name>.<random>.part``), is flushed to disk, and takes its final name in one
rename. A kill at any moment leaves the old content or none, and at most one ``.part`` beside it; an exception,
KeyboardInterrupt included, leaves nothing. Raises DataError where the place cannot be written.

What is inside of a ``.part`` folder is flushed with that folder, not file by file: waiting for the disk is slow.
"""

from __future__ import annotations

import json
import math
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hsbench.errors import DataError, SchemaError

PART = ".part"
"""What the names of files and folders under construction end with; they begin with a dot."""


@contextmanager
def atomic_file(path: str | Path) -> Iterator[Path]:
    """Yield a path to write to; on leaving, the file written there becomes ``path``, replacing what was there."""
    target = Path(path)
    temporary = _sibling(target)
    try:
        yield temporary
        try:
            if not _is_staged(target):
                _sync(temporary)
            temporary.replace(target)
        except OSError as error:
            raise _cannot_write(target, error) from error
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    if not _is_staged(target):
        _sync_folder(target.parent)


@contextmanager
def atomic_folder(path: str | Path, *, replace: bool = False) -> Iterator[Path]:
    """Yield an empty folder to fill; on leaving it becomes ``path``.

    Raises DataError if ``path`` exists, unless ``replace``: then the old folder steps aside and is deleted once the
    new one is in place (two renames: between them, for an instant, neither bears the name).
    """
    target = Path(path)
    if os.path.lexists(target) and not replace:
        raise DataError(f"{target} exists already; choose another place or remove it first")
    temporary = _sibling(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary.mkdir()
    except OSError as error:
        raise _cannot_write(target, error) from error
    try:
        yield temporary
        try:
            if not _is_staged(target):
                _sync_tree(temporary)
            _move_into_place(temporary, target)
        except OSError as error:
            raise _cannot_write(target, error) from error
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    if not _is_staged(target):
        _sync_folder(target.parent)


def sync_all() -> None:
    """Flush everything written so far to disk: for folders that were filled without ``atomic_folder``, before a rename.

    One call for many files is far quicker than one for each.
    """
    if hasattr(os, "sync"):  # not on Windows
        os.sync()


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write a whole file atomically, with its parent folders."""
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(target) as temporary:
            temporary.write_bytes(data)
    except OSError as error:
        raise _cannot_write(target, error) from error


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 text with line feeds atomically."""
    write_bytes(path, text.encode())


def write_json(path: str | Path, obj: object) -> None:
    """Write ``json_bytes(obj)`` atomically. Raises SchemaError as it does, naming the file."""
    try:
        data = json_bytes(obj)
    except SchemaError as error:
        raise SchemaError(f"{path}: {error}") from error
    write_bytes(path, data)


def json_bytes(obj: object) -> bytes:
    """The one JSON form of an object: sorted keys, floats unrounded, UTF-8, a line feed at the end.

    Raises SchemaError for NaN, infinity and types JSON does not have, naming the item.
    """
    fault = _json_fault(obj, "")
    if fault:
        raise SchemaError(fault)
    return (json.dumps(obj, sort_keys=True, indent=2, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _json_fault(obj: Any, where: str) -> str | None:
    if obj is None or isinstance(obj, bool | int | str):
        return None
    if isinstance(obj, float):
        return None if math.isfinite(obj) else f"{where or 'value'} is {obj}; expected a finite number or null"
    if isinstance(obj, dict):
        for key in obj:
            if not isinstance(key, str):
                return f"{where or 'value'} has the key {key!r}; expected text"
        children = ((f"{where}.{key}" if where else key, child) for key, child in obj.items())
    elif isinstance(obj, list | tuple):
        children = ((f"{where}[{i}]", child) for i, child in enumerate(obj))
    else:
        return f"{where or 'value'} is a {type(obj).__name__}; expected text, number, true, false, null, list or dict"
    return next((fault for at, child in children if (fault := _json_fault(child, at))), None)


def _is_staged(target: Path) -> bool:
    """Whether a folder around it is still to take its final name."""
    return any(parent.name.startswith(".") and parent.name.endswith(PART) for parent in target.parents)


def _sibling(target: Path) -> Path:
    if not target.name:
        raise DataError(f"{target} cannot be written: it has no name of its own (give one)")
    return target.with_name(f".{target.name}.{secrets.token_hex(6)}{PART}")


def _move_into_place(temporary: Path, target: Path) -> None:
    if not os.path.lexists(target):
        temporary.rename(target)
        return
    aside = _sibling(target)
    target.rename(aside)
    try:
        temporary.rename(target)
    except BaseException:
        aside.rename(target)
        raise
    if aside.is_dir() and not aside.is_symlink():
        shutil.rmtree(aside)
    else:
        aside.unlink()


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _sync_folder(path: Path) -> None:
    if os.name == "nt":  # folders cannot be opened there
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _sync_tree(folder: Path) -> None:
    for root, _, files in os.walk(folder):
        for name in files:
            file = Path(root, name)
            if not file.is_symlink():
                _sync(file)
        _sync_folder(Path(root))


def _cannot_write(target: Path, error: OSError) -> DataError:
    return DataError(f"cannot write {target}: {error.strerror or error}")
