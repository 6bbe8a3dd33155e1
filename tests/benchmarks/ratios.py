"""What the benchmarks share: the best of several runs, and the line that prints a ratio."""

from __future__ import annotations

import time
from collections.abc import Callable


def best_s(call: Callable[[], object], rounds: int, clock: Callable[[], float] = time.perf_counter) -> float:
    """Seconds of the fastest of ``rounds`` calls, on the wall or by another clock."""
    seconds = []
    for _ in range(rounds):
        start = clock()
        call()
        seconds.append(clock() - start)
    return min(seconds)


def report(kernel: str, against: str, theirs_s: float, ours_s: float, at_least: float | None = None) -> None:
    """Print how many times faster ours is. No assertion: speed depends on the machine."""
    goal = "" if at_least is None else f" (goal {at_least:g}x)"
    print(f"\n{kernel}: {theirs_s / ours_s:.1f}x {against}{goal}: {theirs_s * 1e3:.2f} ms, ours {ours_s * 1e3:.2f} ms")
