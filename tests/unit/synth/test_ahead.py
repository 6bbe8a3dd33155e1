"""Answers worked out ahead are those of plain calls, begun in order by the caller's thread alone."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.synth.ahead import Ahead


class Questions:
    """Squares; notes which were begun, and by which thread; question ``bad`` cannot be finished."""

    def __init__(self, bad: int | None = None) -> None:
        self.begun: list[int] = []
        self.threads: set[int] = set()
        self.bad = bad

    def begin(self, index: int) -> Callable[[], int]:
        self.begun.append(index)
        self.threads.add(threading.get_ident())

        def finish() -> int:
            if index == self.bad:
                raise ZeroDivisionError(f"question {index}")
            return index * index

        return finish


@given(st.lists(st.integers(0, 9), max_size=30), st.integers(1, 4))
def test_any_order_gives_the_plain_answers(order: list[int], threads: int) -> None:
    questions = Questions()
    ahead = Ahead(questions.begin, 10, threads)
    assert [ahead(k) for k in order] == [k * k for k in order]
    assert questions.threads <= {threading.get_ident()}


@given(st.integers(1, 12), st.integers(1, 4))
def test_in_order_each_question_is_begun_once_and_few_are_begun_ahead(count: int, threads: int) -> None:
    questions = Questions()
    ahead = Ahead(questions.begin, count, threads)
    for k in range(count):
        assert ahead(k) == k * k
        assert questions.begun == list(range(min(k + (threads if threads > 1 else 0) + 1, count)))


def test_a_question_out_of_order_begins_no_other() -> None:
    questions = Questions()
    ahead = Ahead(questions.begin, 10, threads=3)
    assert ahead(7) == 49
    assert questions.begun == [7]


@pytest.mark.parametrize("threads", [1, 3])
def test_what_fails_is_raised_at_its_own_question(threads: int) -> None:
    ahead = Ahead(Questions(bad=2).begin, 5, threads)
    assert [ahead(0), ahead(1)] == [0, 1]
    with pytest.raises(ZeroDivisionError, match="question 2"):
        ahead(2)
    assert [ahead(3), ahead(4)] == [9, 16]


def test_finishing_runs_beside_the_caller() -> None:
    """The first answer waits for the second question to be under way: one thread alone would stand still."""
    meeting = threading.Barrier(2, timeout=30)
    assert Ahead(lambda k: lambda: meeting.wait() >= 0, 2, threads=2)(0)
