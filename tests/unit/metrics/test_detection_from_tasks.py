"""hsbench's own detection protocol against a scorer written from the task's text by somebody who had not read ours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hsbench.metrics import detection
from hsbench.metrics.detection import DetectionScore, Predictions, Truths
from hsbench.schema import Evidence, Visibility
from tests.reference import detection_from_tasks as plain
from tests.reference.detection_from_tasks import Episode, Guess, Truth

THRESHOLDS = (0.25, 0.5)
CELLS = [(v.name, e.name) for v in Visibility for e in Evidence]

lengths = st.floats(0.3, 1.5)
sizes = st.tuples(lengths, lengths, lengths)
yaws = st.floats(-math.pi, math.pi)
places = st.tuples(st.floats(0.0, 2.5), st.floats(0.0, 2.5), st.floats(0.3, 0.8))
boxes = st.tuples(places, sizes, yaws).map(lambda box: (*box[0], *box[1], box[2]))
labels = st.integers(1, 3)
truths = st.builds(Truth, boxes, labels, st.booleans() | st.just(False), st.sampled_from(CELLS))
scores = st.sampled_from([0.1, 0.2, 0.5, 0.9]) | st.floats(0.0, 1.0)


@st.composite
def episodes(draw: st.DrawFn) -> Episode:
    """A room whose truths are found once, twice or never, with errors of centimetres to decimetres, and false boxes."""
    things = draw(st.lists(truths, max_size=5))
    guesses = [Guess(draw(boxes), draw(scores), draw(labels)) for _ in range(draw(st.integers(0, 4)))]
    for thing in things:
        for _ in range(draw(st.integers(0, 2))):
            error = draw(st.tuples(*[st.floats(-0.25, 0.25)] * 3))
            moved = (*(x + e for x, e in zip(thing.box, error, strict=False)), *thing.box[3:])
            label = thing.label if draw(st.integers(0, 4)) else draw(labels)
            guesses.append(Guess(moved, draw(scores), label))
    return things, guesses


def scored(rooms: Sequence[Episode], operating_score: float | None = None) -> DetectionScore:
    visibility, evidence = {v.name: int(v) for v in Visibility}, {e.name: int(e) for e in Evidence}
    there, found = [], []
    for things, guesses in rooms:
        there.append(
            Truths(
                np.array([t.box for t in things], float).reshape(-1, 7),
                np.array([t.label for t in things], int),
                np.array([t.difficult for t in things], bool),
                groups={"cell": np.array([(visibility[t.cell[0]], evidence[t.cell[1]]) for t in things], int)}
                if things
                else {},
            )
        )
        found.append(
            Predictions(
                np.array([g.box for g in guesses], float).reshape(-1, 7),
                np.array([g.score for g in guesses], float),
                np.array([g.label for g in guesses], int),
            )
        )
    return detection.score(there, found, "hsbench", THRESHOLDS, operating_score=operating_score)


def decided(rooms: Sequence[Episode]) -> bool:
    """Whether no IoU is so near a threshold, or to another of the same box, that last bits decide: the text is silent
    there, and two ways to compute an area may differ.
    """
    for things, guesses in rooms:
        for guess in guesses:
            values = sorted(plain.iou(guess.box, thing.box) for thing in things)
            if any(abs(v - t) < 1e-9 for v in values for t in THRESHOLDS):
                return False
            if any(high - low < 1e-9 for low, high in pairwise(values) if high >= THRESHOLDS[0]):
                return False
    return True


def same(got: float | None, expected: object) -> bool:
    return got is None if expected is None else got is not None and abs(got - float(expected)) < 1e-12  # type: ignore[arg-type]


@given(st.lists(episodes(), min_size=1, max_size=4), st.sampled_from([0.0, 0.2, 0.5, 0.95]))
@settings(max_examples=150, deadline=None)
def test_every_number_of_the_task(rooms: list[Episode], operating_score: float) -> None:
    assume(decided(rooms))
    got = scored(rooms, operating_score)
    assert same(got.ap, plain.average_precision(rooms, THRESHOLDS[0]))
    for overall in got.overall:
        assert same(overall.ap, plain.average_precision(rooms, overall.iou))
        hits, false, wanted = plain.counts_at(rooms, overall.iou)
        assert (overall.hits, overall.false, overall.truths) == (hits, false, wanted)
        assert same(overall.recall, hits / wanted if wanted else None)
        assert same(overall.precision, hits / (hits + false) if hits + false else None)
        # F1: twice the hits over both sides
        assert same(overall.f1, 2 * hits / (hits + false + wanted) if hits + false + wanted else None)
    for of_class in got.per_class:
        assert of_class.label is not None
        assert same(of_class.ap, plain.average_precision(plain.of_label(rooms, of_class.label), of_class.iou))
    present = {t.label for things, _ in rooms for t in things} | {g.label for _, guesses in rooms for g in guesses}
    assert {c.label for c in got.per_class} == present
    wanted_labels = {t.label for things, _ in rooms for t in things if not t.difficult}
    assert set(got.labels_without_truth) == present - wanted_labels


@given(st.lists(episodes(), min_size=1, max_size=4), st.sampled_from([0.0, 0.2, 0.5, 0.95]))
@settings(max_examples=100, deadline=None)
def test_recall_by_visibility_and_evidence(rooms: list[Episode], operating_score: float) -> None:
    assume(decided(rooms))
    rooms = [([Truth(t.box, t.label, False, t.cell) for t in things], guesses) for things, guesses in rooms]
    rows = [r for r in scored(rooms, operating_score).recall if r.group == "cell"]
    for t in THRESHOLDS:
        expected_all = plain.recall_table(rooms, t)
        expected_sure = plain.recall_table(rooms, t, operating_score)
        got = {(Visibility(r.key[0]).name, Evidence(r.key[1]).name): r for r in rows if r.iou == t}
        assert got.keys() == expected_all.keys()
        for cell, row in got.items():
            assert (row.hits, row.truths) == expected_all[cell]
            assert (row.hits_at_score, row.truths) == expected_sure[cell]


def test_the_plain_scorer_itself() -> None:
    """By hand: two tables 3 m apart, both found, a false box between them in score; then with equal scores."""
    a, b = (0.0, 0.0, 0.4, 1.0, 1.0, 0.8, 0.0), (3.0, 0.0, 0.4, 1.0, 1.0, 0.8, 0.7)
    nowhere = (9.0, 9.0, 0.4, 1.0, 1.0, 0.8, 0.0)
    assert plain.iou(a, a) == pytest.approx(1.0, abs=1e-12)
    assert plain.iou(a, (0.5, 0.0, 0.4, 1.0, 1.0, 0.8, math.pi)) == pytest.approx(1 / 3, abs=1e-12)
    rooms: list[Episode] = [([Truth(a), Truth(b)], [Guess(a, 0.9), Guess(nowhere, 0.8), Guess(b, 0.7)])]
    assert float(plain.average_precision(rooms, 0.25) or 0) == pytest.approx(0.5 * 1 + 0.5 * 2 / 3, abs=1e-15)
    tied: list[Episode] = [([Truth(a), Truth(b)], [Guess(a, 0.9), Guess(nowhere, 0.9), Guess(b, 0.9)])]
    assert float(plain.average_precision(tied, 0.25) or 0) == pytest.approx(2 / 3, abs=1e-15)
    again: list[Episode] = [([Truth(a)], [Guess(a, 0.9), Guess(a, 0.8)])]
    assert plain.counts_at(again, 0.25) == (1, 1, 1)
    assert plain.average_precision([([], [Guess(a, 0.9)])], 0.25) is None
    for rooms_ in (rooms, tied, again):
        assert same(scored(rooms_).ap, plain.average_precision(rooms_, 0.25))
