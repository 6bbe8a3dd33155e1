"""Doing one thing to many: in this process, in processes of this machine, or on a Dask cluster.

All give the same outcomes, in another order. A task that raises, or whose process dies, costs itself alone.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Generator, Hashable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import active_children, get_context
from typing import Any, Protocol, TypeVar

from hsbench.errors import DataError, MissingExtraError
from hsbench.synth.limits import NO_LIMITS, Limits, limit_memory, limited_time
from hsbench.synth.workers import start_worker

Task = TypeVar("Task")
Result = TypeVar("Result")
Key = TypeVar("Key", bound=Hashable)

RECYCLED_AFTER = 100
"""Tasks that one process does before another takes its place, against what libraries may leak."""

CONNECT_S = 10.0


class WorkerDiedError(DataError):
    """The process of a task ended without an answer."""


class Executor(Protocol):
    """Somebody who does tasks."""

    def check(self) -> None:
        """Raise DataError where nobody is there to do a task: before anything is written for it."""
        ...

    def outcomes(
        self, function: Callable[[Task], Result], tasks: Sequence[Task]
    ) -> Generator[tuple[Task, Result | Exception], None, None]:
        """Each task with its result, or with what it raised, as they are done.

        function: picklable, and so are tasks and results. Closing the iterator stops what is under way.
        """
        ...


@dataclass(frozen=True)
class InTurn:
    """One task after the other in this process."""

    def check(self) -> None:
        """Nothing to check: the process that asks is there."""

    def outcomes(
        self, function: Callable[[Task], Result], tasks: Sequence[Task]
    ) -> Generator[tuple[Task, Result | Exception], None, None]:
        """As ``Executor`` says; a process that dies here is ours."""
        for task in tasks:
            yield task, _outcome(partial(function, task))


@dataclass(frozen=True)
class Processes:
    """Processes of this machine, each with its own graphics context, replaced after ``recycled_after`` tasks."""

    workers: int
    limits: Limits = NO_LIMITS
    recycled_after: int = RECYCLED_AFTER

    def check(self) -> None:
        """Nothing to check: they are started here."""

    def outcomes(
        self, function: Callable[[Task], Result], tasks: Sequence[Task]
    ) -> Generator[tuple[Task, Result | Exception], None, None]:
        """As ``Executor`` says. Ctrl-C ends the processes where they are: who stops us does not want to wait."""
        others = set(active_children())
        workers = [_Worker(self.limits, self.recycled_after) for _ in range(min(self.workers, len(tasks)))]
        running: dict[Future[Result], tuple[_Worker, Task]] = {}
        waiting = iter(tasks)

        def begin(worker: _Worker) -> None:
            for task in waiting:
                running[worker.submit(function, task)] = worker, task
                return

        try:
            for worker in workers:
                begin(worker)
            while running:
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    worker, task = running.pop(future)
                    outcome = _outcome(future.result)
                    if isinstance(outcome, BrokenProcessPool):
                        outcome = worker.died()
                    begin(worker)
                    yield task, outcome
        except (KeyboardInterrupt, GeneratorExit):
            for process in set(active_children()) - others:
                process.terminate()
            raise
        finally:
            for worker in workers:
                worker.close()


@dataclass
class _Worker:
    """One process at a time, so that a death has one cause."""

    limits: Limits
    share: int
    done: int = 0
    began_s: float = 0.0
    pool: ProcessPoolExecutor = field(init=False)

    def __post_init__(self) -> None:
        self.pool = self._process()

    def _process(self) -> ProcessPoolExecutor:
        context = get_context("spawn")
        return ProcessPoolExecutor(1, context, initializer=_start, initargs=(self.limits.memory_gb,))

    def submit(self, function: Callable[[Task], Result], task: Task) -> Future[Result]:
        if self.done == self.share:
            self._replace()
        self.done += 1
        self.began_s = time.monotonic()
        return self.pool.submit(_in_time, function, self.limits.time_s, task)

    def died(self) -> WorkerDiedError:
        """Put another process in place of a dead one; why the old one died, as far as can be said."""
        self._replace()
        limit_s = self.limits.time_s
        if limit_s is not None and time.monotonic() - self.began_s > limit_s:
            return WorkerDiedError(f"it took longer than {limit_s:g} s and did not stop; its process was ended")
        return WorkerDiedError("its process died (out of memory, or a crash of the renderer)")

    def _replace(self) -> None:
        self.close()
        self.pool, self.done = self._process(), 0

    def close(self) -> None:
        self.pool.shutdown(wait=True, cancel_futures=True)


@dataclass(frozen=True)
class Cluster:
    """Workers of a Dask scheduler, that see the same files. Each has one thread: a graphics context belongs to one.

    A task whose worker dies goes to another, as often as the scheduler's ``allowed-failures`` says. Memory is limited
    by the workers' own option.
    """

    address: str
    time_s: float | None = None

    def check(self) -> None:
        """As ``Executor`` says: no scheduler answers, or a worker has several threads. Raises MissingExtraError without
        ``distributed``.
        """
        try:
            from distributed import utils
        except ImportError as error:
            raise MissingExtraError("--dask", "distributed", "cluster") from error
        try:
            threads = utils.LoopRunner().run_sync(_threads, self.address)
        # What else may answer, such as the dashboard, is read as if it were a scheduler: anything may be raised.
        except Exception as error:
            raise DataError(f"no Dask scheduler answers at {self.address} (is it tcp://HOST:8786?)") from error
        if several := sorted(worker for worker, count in threads.items() if count > 1):
            raise DataError(f"Dask worker {several[0]} has several threads; start it with --nthreads 1")

    def outcomes(
        self, function: Callable[[Task], Result], tasks: Sequence[Task]
    ) -> Generator[tuple[Task, Result | Exception], None, None]:
        """As ``Executor`` says. Raises what ``check`` does."""
        self.check()  # a client that was not answered says so again, at length, when it is collected
        from distributed import Client, as_completed
        from distributed.scheduler import KilledWorker

        with Client(self.address, timeout=CONNECT_S, set_as_default=False) as client:
            call = partial(_in_time, function, self.time_s)
            running = {client.submit(call, task, pure=False): task for task in tasks}
            for future in as_completed(list(running), loop=client.loop):
                task = running.pop(future)
                outcome: Any = future.exception()
                if outcome is None:
                    outcome = future.result()
                elif isinstance(outcome, KilledWorker):
                    outcome = WorkerDiedError("every worker that took it died (out of memory, or a crash?)")
                yield task, outcome


def local(workers: int, limits: Limits = NO_LIMITS) -> Executor:
    """Processes of this machine; where one worker without limits would do, the process that asks."""
    return InTurn() if workers == 1 and not limits.any else Processes(workers, limits)


def in_order(
    executor: Executor, function: Callable[[Key], Result], tasks: Sequence[Key]
) -> Generator[Result, None, None]:
    """The results of tasks, all different, in their order. Raises what one of them raised, and stops the others."""
    done: dict[Key, Result] = {}
    with closing(executor.outcomes(function, tasks)) as outcomes:
        following = 0
        for task, outcome in outcomes:
            if isinstance(outcome, WorkerDiedError):
                raise WorkerDiedError(f"{task}: {outcome}")
            if isinstance(outcome, Exception):
                raise outcome
            done[task] = outcome
            while following < len(tasks) and tasks[following] in done:
                yield done.pop(tasks[following])
                following += 1


def _outcome(make: Callable[[], Result]) -> Result | Exception:
    try:
        return make()
    except Exception as error:
        return error


async def _threads(address: str) -> dict[str, int]:
    """How many threads each worker of a scheduler has."""
    from distributed import rpc
    from distributed.security import Security

    encryption = Security().get_connection_args("client")
    async with rpc(address, timeout=CONNECT_S, connection_args=encryption) as scheduler:
        # For what takes the call and says nothing: the time of ``rpc`` ends where a connection begins.
        return dict(await asyncio.wait_for(scheduler.ncores(), CONNECT_S))


def _start(memory_gb: float | None) -> None:
    start_worker()
    limit_memory(memory_gb)


def _in_time(function: Callable[[Task], Result], time_s: float | None, task: Task) -> Result:
    with limited_time(time_s):
        return function(task)
