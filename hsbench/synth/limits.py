"""What one task of a worker may take: seconds on the clock, and memory of its process."""

from __future__ import annotations

import faulthandler
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import current_thread, main_thread

from hsbench.errors import DataError, SchemaError

GRACE_S = 2.0
"""After this much more time the process of a task that does not listen is ended."""

BYTES_PER_GB = 1_000_000_000


@dataclass(frozen=True)
class Limits:
    """Seconds a task may take, and gigabytes (1e9 bytes) of memory its process may ask for; None: no limit.

    Raises SchemaError unless they are positive.
    """

    time_s: float | None = None
    memory_gb: float | None = None

    def __post_init__(self) -> None:
        for name, value in (("time_s", self.time_s), ("memory_gb", self.memory_gb)):
            if value is not None and not value > 0:
                raise SchemaError(f"limit {name} is {value}; expected more than 0")

    @property
    def any(self) -> bool:
        """Whether there is one."""
        return self.time_s is not None or self.memory_gb is not None


NO_LIMITS = Limits()


def limit_memory(memory_gb: float | None) -> None:
    """Let this process ask for so much memory and no more: what goes beyond raises MemoryError.

    Where the system knows no such limit (Windows) there is none.
    """
    if memory_gb is None or os.name == "nt":
        return
    import resource

    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    asked = int(memory_gb * BYTES_PER_GB)
    resource.setrlimit(resource.RLIMIT_DATA, (asked if most == resource.RLIM_INFINITY else min(asked, most), most))


@contextmanager
def limited_time(time_s: float | None) -> Iterator[None]:
    """End what happens inside after so many seconds.

    First by DataError, where this is the main thread of a process; if that is not heard (compiled code, an ``except``
    that takes all), after ``GRACE_S`` by ending the process. Not for a process that does other work as well.
    """
    if time_s is None:
        yield
        return
    heard = hasattr(signal, "SIGALRM") and current_thread() is main_thread()
    with Path(os.devnull).open("w") as nowhere:  # the parent says that it hung, in one line
        faulthandler.dump_traceback_later(time_s + GRACE_S, exit=True, file=nowhere)
        try:
            if heard:
                signal.signal(signal.SIGALRM, lambda *_: _stop(time_s))
                signal.setitimer(signal.ITIMER_REAL, time_s)
            yield
        finally:
            if heard:
                signal.setitimer(signal.ITIMER_REAL, 0)
            faulthandler.cancel_dump_traceback_later()


def _stop(time_s: float) -> None:
    raise DataError(f"it took longer than {time_s:g} s (an endless loop?)")
