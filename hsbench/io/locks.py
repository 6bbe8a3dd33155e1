"""One writer at a time: a lock on a folder that goes with its process, however it ends."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hsbench.errors import DataError

LOCK_FILE = ".writing"


@contextmanager
def sole_writer(folder: Path) -> Iterator[None]:
    """Hold the lock of an existing folder. Raises DataError at once where another process holds it."""
    path = folder / LOCK_FILE
    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise DataError(f"another run is writing to {folder}; wait for it or choose another folder") from None
        try:
            yield
        finally:
            path.unlink(missing_ok=True)
