"""hsbench's own detection protocol against fractions by somebody who had not read ours: ties, limits, exact IoU."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.metrics import detection
from hsbench.metrics.detection import ClassScore, DetectionScore, Predictions, Truths
from hsbench.typing import FloatArray
from tests.reference import detection_second_reader as plain
from tests.reference.detection_second_reader import Box, Counts, Detection, Scene, Truth

UNITS_M = (0.25, 0.1)
"""Length of a whole number: with a power of two the volumes of the package are exact, with a tenth they are rounded."""

THRESHOLDS = (Fraction(1, 4), Fraction(1, 2))
OPERATING_SCORE = 2


def box(low: tuple[int, int, int], size: tuple[int, int, int], label: int) -> Box:
    x, y, z = (a + b for a, b in zip(low, size, strict=True))
    return Box(low, (x, y, z), label)


coordinates, lengths, labels = st.integers(0, 3), st.integers(1, 4), st.integers(0, 2)
boxes = st.builds(box, st.tuples(coordinates, coordinates, coordinates), st.tuples(lengths, lengths, lengths), labels)
scores = st.integers(0, 4)


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """Things that may stand in each other; they are found once, twice or never, some with one side too long."""
    truths = draw(st.lists(st.builds(Truth, boxes, st.booleans() | st.just(False)), max_size=5))
    found = draw(st.lists(boxes, max_size=3))
    for truth in truths:
        for _ in range(draw(st.integers(0, 2))):
            x, y, z = truth.box.high
            more = draw(st.integers(0, 2))
            found.append(Box(truth.box.low, draw(st.sampled_from([(x + more, y, z), (x, y, z + more)])), draw(labels)))
    return truths, [Detection(b, draw(scores)) for b in found]


def metric(some: list[Box], columns: int, unit_m: float) -> FloatArray:
    """(N, 6) centre and size; (N, 7) with yaw 0; metres."""
    low, high = np.array([(b.low, b.high) for b in some], dtype=np.int64).reshape(-1, 2, 3).swapaxes(0, 1)
    numbers = np.concatenate([(low + high) * (unit_m / 2), (high - low) * unit_m], axis=1)
    return np.pad(numbers, ((0, 0), (0, columns - 6)))


def scored(rooms: list[Scene], limit: int, columns: int, unit_m: float) -> DetectionScore:
    return detection.score(
        [
            Truths(
                metric([t.box for t in truths], columns, unit_m),
                np.array([t.box.label for t in truths], dtype=np.int64),
                np.array([t.difficult for t in truths], dtype=np.bool_),
                groups={"label": np.array([t.box.label for t in truths], dtype=np.int64)},
            )
            for truths, _ in rooms
        ],
        [
            Predictions(
                metric([d.box for d in found], columns, unit_m),
                np.array([d.score for d in found], dtype=np.float64),
                np.array([d.box.label for d in found], dtype=np.int64),
            )
            for _, found in rooms
        ],
        "hsbench",
        [float(t) for t in THRESHOLDS],
        limit=limit,
        operating_score=OPERATING_SCORE,
    )


def agrees(got: ClassScore, rooms: list[Scene]) -> None:
    ap = plain.average_precision(rooms, Fraction(got.iou))
    assert (got.ap is None) == (ap is None)
    assert got.ap is None or got.ap == pytest.approx(float(ap or 0), abs=1e-12)
    at = plain.counts(rooms, Fraction(got.iou), 0)
    assert Counts(got.hits, got.false, got.truths) == at
    assert got.recall == (at.hits / at.truths if at.truths else None)
    assert got.precision == (at.hits / (at.hits + at.false) if at.hits + at.false else None)


@given(
    st.lists(scenes(), min_size=1, max_size=4),
    st.sampled_from([1, 3, 64]),
    st.sampled_from([6, 7]),
    st.sampled_from(UNITS_M),
)
@settings(max_examples=300, deadline=None)
def test_every_number_on_boxes_full_of_ties(rooms: list[Scene], limit: int, columns: int, unit_m: float) -> None:
    got = scored(rooms, limit, columns, unit_m)
    kept = [plain.kept(room, limit) for room in rooms]
    assert got.over_limit == sum(len(all_) - len(some) for (_, all_), (_, some) in zip(rooms, kept, strict=True))
    assert [c.iou for c in got.overall] == list(THRESHOLDS)
    for overall in got.overall:
        agrees(overall, kept)
    assert got.ap == got.overall[0].ap
    present = {t.box.label for truths, _ in rooms for t in truths} | {d.box.label for _, ds in rooms for d in ds}
    assert [(c.label, c.iou) for c in got.per_class] == [(x, t) for x in sorted(present) for t in THRESHOLDS]
    for of_class in got.per_class:
        assert of_class.label is not None
        agrees(of_class, [plain.of_label(room, of_class.label) for room in kept])
    ordinary = {t.box.label for truths, _ in rooms for t in truths if not t.difficult}
    assert got.labels_without_truth == tuple(sorted(present - ordinary))
    for row in got.recall:
        if row.group == "label":
            there = [[i for i, t in enumerate(ts) if (t.box.label,) == row.key and not t.difficult] for ts, _ in kept]
            assert row.truths == sum(map(len, there))
            for lowest, hits in ((0, row.hits), (OPERATING_SCORE, row.hits_at_score)):
                found = [plain.hit_truths(room, Fraction(row.iou), lowest) for room in kept]
                assert hits == sum(len(f.intersection(t)) for f, t in zip(found, there, strict=True))


def test_the_plain_scorer_itself() -> None:
    # one metre of shelf and its right half as a unit of its own; then something far away
    shelf, half, away = Box((0, 0, 0), (4, 1, 1)), Box((2, 0, 0), (4, 1, 1)), Box((9, 0, 0), (10, 1, 1))
    assert plain.overlap(shelf, half) == Fraction(1, 2)
    assert plain.overlap(shelf, away) == 0
    room = [Truth(shelf), Truth(half)], [Detection(shelf, 3), Detection(away, 2), Detection(half, 1)]
    assert plain.average_precision([room], Fraction(1, 4)) == Fraction(1, 2) + Fraction(1, 2) * Fraction(2, 3)
    tied = room[0], [Detection(d.box, 1) for d in room[1]]
    assert plain.average_precision([tied], Fraction(1, 4)) == Fraction(2, 3)
    # the shelf's right half is not there: the box of that size goes to the shelf, as a second one
    assert plain.counts([(room[0][:1], room[1])], Fraction(1, 2), 0) == Counts(1, 2, 1)
    assert plain.counts([([Truth(shelf, True)], room[1])], Fraction(1, 2), 0) == Counts(0, 1, 0)
    assert plain.average_precision([([Truth(shelf, True)], room[1])], Fraction(1, 2)) is None
