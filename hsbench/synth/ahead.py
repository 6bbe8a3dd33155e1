"""Answers that are asked for in order, worked out ahead by threads: compiled loops let other threads run."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property
from typing import Generic, TypeVar

Answer = TypeVar("Answer")


class Ahead(Generic[Answer]):
    """``ahead(k)`` answers question k of ``count``. Asked right after question k - 1, it lets threads begin the next.

    begin: k -> what is left to do, for any thread. It is itself called in the caller's thread (which owns the
    graphics context) and in the order of the questions. Answers do not depend on what was asked before, nor on threads.
    threads: with one, nothing is begun ahead.
    """

    def __init__(self, begin: Callable[[int], Callable[[], Answer]], count: int, threads: int) -> None:
        self._begin, self._count = begin, count
        self._threads = threads
        self._begun: dict[int, Future[Answer]] = {}
        self._last = -1

    def __call__(self, index: int) -> Answer:
        """The answer to a question, 0 to count - 1."""
        in_order, self._last = index == self._last + 1, index
        if self._threads == 1 or not in_order:
            self._begun.clear()
            return self._begin(index)()
        for k in range(index, min(index + 1 + self._threads, self._count)):
            if k not in self._begun:
                self._begun[k] = self._pool.submit(self._begin(k))
        return self._begun.pop(index).result()

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(self._threads, thread_name_prefix="ahead")
