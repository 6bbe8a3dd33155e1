"""Executors: the same outcomes from all, and nobody's fault is another's."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from contextlib import suppress

import numpy as np
import pytest

from hsbench.errors import DataError, SchemaError
from hsbench.synth.executors import Executor, InTurn, Processes, WorkerDiedError, in_order, local
from hsbench.synth.limits import Limits


def square(task: int) -> int:
    return task * task


def doing(task: str) -> object:
    """What the name of the task says."""
    if task == "fails":
        raise ValueError("odd")
    if task == "dies":
        os._exit(1)
    if task == "allocates":
        return np.ones(10**10).nbytes
    if task == "hangs":
        while True:
            time.sleep(0.01)
    if task == "hangs and hears nothing":
        while True:
            with suppress(DataError):
                time.sleep(0.01)
    return task


def slowest_first(task: int) -> int:
    time.sleep(0.2 * (3 - task))
    return task


def process_id(task: int) -> int:
    return os.getpid()


def outcomes(executor: Executor, tasks: Sequence[str]) -> dict[str, object]:
    return dict(executor.outcomes(doing, tasks))


@pytest.mark.parametrize("executor", [InTurn(), Processes(1), Processes(2), Processes(2, recycled_after=2)])
def test_all_do_all(executor: Executor) -> None:
    assert sorted(executor.outcomes(square, range(7))) == [(k, k * k) for k in range(7)]
    assert list(executor.outcomes(square, [])) == []


def test_results_in_the_order_of_tasks() -> None:
    """Though later ones are done earlier; a task that fails, or whose process dies, ends it by name."""
    assert list(in_order(Processes(2), slowest_first, range(4))) == [0, 1, 2, 3]
    assert list(in_order(InTurn(), square, range(1, 4))) == [1, 4, 9]
    assert list(in_order(InTurn(), square, [])) == []
    done = in_order(InTurn(), doing, ["a", "fails", "b"])
    assert next(done) == "a"
    with pytest.raises(ValueError, match="odd"):
        next(done)
    with pytest.raises(WorkerDiedError, match="dies: its process died"):
        list(in_order(Processes(2), doing, ["a", "dies"]))


def test_faults_cost_their_task_alone() -> None:
    done = outcomes(Processes(2), ["a", "fails", "b", "dies", "c"])
    assert {k: v for k, v in done.items() if len(k) == 1} == {"a": "a", "b": "b", "c": "c"}
    assert isinstance(done["fails"], ValueError)
    assert isinstance(done["dies"], WorkerDiedError)
    assert len(done) == 5


def test_limits() -> None:
    """Of memory and of time, whether the task listens or not; then the next is done."""
    done = outcomes(Processes(1, Limits(1.0, 4.0)), ["allocates", "hangs", "a", "hangs and hears nothing", "b"])
    assert isinstance(done["allocates"], MemoryError)
    assert "took longer than 1 s" in str(done["hangs"])
    assert "took longer than 1 s and did not stop" in str(done["hangs and hears nothing"])
    assert (done["a"], done["b"]) == ("a", "b")


def test_a_process_is_replaced_after_its_share() -> None:
    ids = [process for _, process in Processes(1, recycled_after=2).outcomes(process_id, range(5))]
    assert [ids.count(process) for process in dict.fromkeys(ids)] == [2, 2, 1]
    assert os.getpid() not in ids


def test_closing_stops_what_is_under_way() -> None:
    under_way = Processes(2).outcomes(doing, ["a", "hangs", "hangs"])
    assert next(under_way) == ("a", "a")
    began_s = time.monotonic()
    under_way.close()
    assert time.monotonic() - began_s < 60  # it would hang for ever


def test_who_needs_no_process_gets_none() -> None:
    assert local(1) == InTurn()
    assert local(1, Limits(time_s=3.0)) == Processes(1, Limits(time_s=3.0))
    assert local(2) == Processes(2)
    with pytest.raises(SchemaError, match="limit memory_gb is 0"):
        Limits(memory_gb=0)
