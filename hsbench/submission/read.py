"""A submission, folder or zip, through one read-only door. Nothing is extracted, no link is followed.

Every file is judged by name and declared size before it is read; ``faults`` says what was refused. The limits below
are generous for honest submissions and small enough that a hostile one costs seconds, not a machine.
"""

from __future__ import annotations

import os
import stat
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Protocol

from hsbench.errors import DataError
from hsbench.io.archives import ArchiveLimits, clash_faults, is_folder, member_faults, open_zip, path_fault, read_member
from hsbench.io.arrays import collect_npz
from hsbench.submission.layout import SubmittedTask, prediction_file

MAX_FILES = 20_000
MAX_FILE_BYTES = 64 << 20
MAX_TOTAL_BYTES = 2 << 30
MAX_DEPTH = 4
"""Folders inside folders."""

LIMITS = ArchiveLimits(files=MAX_FILES, file_bytes=MAX_FILE_BYTES, total_bytes=MAX_TOTAL_BYTES)


class SubmissionFiles(Protocol):
    """The files of a submission, by relative posix path."""

    @property
    def names(self) -> tuple[str, ...]:
        """Files that may be read, sorted."""
        ...

    @property
    def refused(self) -> frozenset[str]:
        """Files that are there and must not be read; ``faults`` says why."""
        ...

    @property
    def faults(self) -> tuple[str, ...]:
        """What is wrong with names, links and sizes, one line each."""
        ...

    def read(self, name: str) -> bytes:
        """The bytes of one file. Raises DataError where it is missing, too large, truncated or damaged."""
        ...


@contextmanager
def open_submission(path: str | Path) -> Iterator[SubmissionFiles]:
    """Open a folder or a zip. Raises DataError where it is neither, or not readable at all."""
    place = Path(path)
    if place.is_dir():
        yield _Folder(place)
        return
    with ExitStack() as stack:
        try:
            file = stack.enter_context(place.open("rb"))
            archive = stack.enter_context(open_zip(file, LIMITS))
        except DataError as error:
            raise DataError(f"{place}: {error}; expected a submission as a folder or a zip of it") from error
        except OSError as error:
            raise DataError(f"{place}: {error.strerror or error}; expected a folder or a zip") from error
        yield _Zip(archive)


class Predictions:
    """Predictions of an open submission by episode, decoded as its task says."""

    def __init__(self, files: SubmissionFiles, task: SubmittedTask) -> None:
        self._files = files
        self._names = frozenset(files.names)
        self._task = task

    def earlier_s(self, episode_ids: Sequence[str]) -> tuple[float, ...]:
        """Observation times before the last at which any of these episodes has a prediction, ascending."""
        return tuple(
            observed_s
            for observed_s in self._task.observation_times_s[:-1]
            if any(prediction_file(self._task, episode_id, observed_s) in self._names for episode_id in episode_ids)
        )

    def get(self, episode_id: str, until_s: float | None = None) -> Any | None:
        """The prediction of an episode, None where there is none. Raises DataError where its file has a fault."""
        name = prediction_file(self._task, episode_id, until_s)
        if name not in self._names:
            return None
        form = self._task.prediction
        arrays, faults = collect_npz(self._files.read(name), form.arrays, form.max_bytes)
        if faults:
            raise DataError("\n".join(f"{name}: {fault}" for fault in faults))
        return form.decode(arrays)


class _Folder:
    def __init__(self, root: Path) -> None:
        self._root = root
        sizes: dict[str, int] = {}
        refused: dict[str, str] = {}
        crowd: list[str] = []
        for name, size, fault in _walk(root):
            if len(sizes) + len(refused) >= MAX_FILES:
                crowd = [f"more than {MAX_FILES} files, the limit; the rest was not looked at"]
                break
            if not fault and size > MAX_FILE_BYTES:
                fault = f"{size} bytes; the limit for one file is {MAX_FILE_BYTES}"
            if fault:
                refused[name] = fault
            else:
                sizes[name] = size
        total = sum(sizes.values())
        if total > MAX_TOTAL_BYTES:
            crowd.append(f"files take {total} bytes together; the limit is {MAX_TOTAL_BYTES}")
        self._sizes = sizes
        self.names = tuple(sorted(sizes))
        self.refused = frozenset(refused)
        lines = [f"{name!r}: {refused[name]}" for name in sorted(refused)]
        self.faults = (*crowd, *lines, *clash_faults(self.names))

    def read(self, name: str) -> bytes:
        if name not in self._sizes:
            raise DataError(f"{name!r}: missing")
        try:
            # a file may be exchanged for a link between listing and reading
            descriptor = os.open(self._root / name, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
            with os.fdopen(descriptor, "rb") as file:
                if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                    raise DataError(f"{name!r}: not a plain file")
                data = file.read(MAX_FILE_BYTES + 1)
        except OSError as error:
            raise DataError(f"{name!r}: cannot be read ({error.strerror or error})") from error
        if len(data) > MAX_FILE_BYTES:
            raise DataError(f"{name!r}: more than {MAX_FILE_BYTES} bytes, the limit for one file")
        return data


class _Zip:
    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        infos = archive.infolist()
        self.faults = tuple(member_faults(infos, LIMITS))
        self._infos = {i.orig_filename: i for i in infos if not is_folder(i) and not member_faults([i], LIMITS)}
        self.names = tuple(sorted(self._infos))
        self.refused = frozenset(i.orig_filename for i in infos) - self._infos.keys()

    def read(self, name: str) -> bytes:
        if name not in self._infos:
            raise DataError(f"{name!r}: missing")
        try:
            return read_member(self._archive, self._infos[name])
        except DataError as error:
            raise DataError(f"{name!r}: {error}") from error


def _walk(root: Path) -> Iterator[tuple[str, int, str | None]]:
    """(relative posix path, bytes, fault) of everything in a folder but its folders."""
    pending = [""]
    while pending:
        prefix = pending.pop()
        try:
            entries = sorted(os.scandir(root / prefix), key=lambda entry: entry.name)
        except OSError as error:
            yield prefix, 0, f"cannot be listed ({error.strerror or error})"
            continue
        for entry in entries:
            name = prefix + entry.name
            if entry.is_symlink():
                yield name, 0, "a link; expected plain files"
            elif entry.is_dir(follow_symlinks=False):
                if name.count("/") >= MAX_DEPTH:
                    yield name, 0, f"folders nested more than {MAX_DEPTH} deep"
                else:
                    pending.append(name + "/")
            elif not entry.is_file(follow_symlinks=False):
                yield name, 0, "a device, pipe or socket; expected plain files"
            else:
                yield name, entry.stat(follow_symlinks=False).st_size, path_fault(name)
