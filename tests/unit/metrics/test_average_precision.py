"""Six AP rules on one curve, by hand in fractions, and what they share."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics.average_precision import RULES
from hsbench.typing import FloatArray

# five truths; detections right, wrong, right, right, wrong, right
RECALL = np.array([1, 1, 2, 3, 3, 4]) / 5
PRECISION = np.array([1 / 1, 1 / 2, 2 / 3, 3 / 4, 3 / 5, 4 / 6])
# the envelope: 1 up to recall 1/5, 3/4 up to 3/5, 2/3 up to 4/5, then 0

BY_HAND = {
    "area": Fraction(1, 5) * 1 + Fraction(2, 5) * Fraction(3, 4) + Fraction(1, 5) * Fraction(2, 3),
    # 0 .1 .2 | .3 .4 .5 | .6 .7 .8 | .9 1: the scorer's .6 is a last bit above 3/5
    "voc11": (3 * Fraction(1) + 3 * Fraction(3, 4) + 3 * Fraction(2, 3)) / 11,
    "coco101": (21 * Fraction(1) + 40 * Fraction(3, 4) + 20 * Fraction(2, 3)) / 101,
    # straight lines; np.interp takes the last point of a vertical step, so recall 1/5 has 3/4 and 3/5 has 2/3
    "av2": (20 * Fraction(1) + 40 * Fraction(3, 4) + 21 * Fraction(2, 3)) / 101,
    # 1/40 .. 8/40 | .. 23/40 | 24/40 (a last bit above 3/5 there) .. 32/40
    "kitti40": (8 * Fraction(1) + 15 * Fraction(3, 4) + 9 * Fraction(2, 3)) / 40,
}


def nuscenes_by_hand() -> float:
    # raw precision, interpolated between (1/5, 1/2), (2/5, 2/3), (3/5, 3/5), (4/5, 2/3); before 1/5 the first, 1
    points = {20: Fraction(1, 2), 40: Fraction(2, 3), 60: Fraction(3, 5), 80: Fraction(2, 3)}
    total = Fraction(0)
    for percent in range(11, 81):
        if percent < 20:
            value = Fraction(1)
        else:
            low = min(percent // 20 * 20, 60)
            # on the way from 2/5 to 3/5 the line ends at the first point there, 3/4
            end = Fraction(3, 4) if low == 40 and percent < 60 else points[low + 20]
            value = points[low] + (end - points[low]) * Fraction(percent - low, 20)
        total += max(value - Fraction(1, 10), Fraction(0))
    return float(total / 90 / Fraction(9, 10))


@pytest.mark.parametrize(("rule", "value"), BY_HAND.items())
def test_by_hand(rule: str, value: Fraction) -> None:
    assert RULES[rule](RECALL, PRECISION) == pytest.approx(float(value), abs=1e-12)


@pytest.mark.parametrize(
    ("rule", "published"),
    [
        ("area", 0.6333),
        ("voc11", 0.6591),
        ("coco101", 0.6370),
        ("av2", 0.6337),
        ("kitti40", 0.6312),
        ("nuscenes", 0.5063),
    ],
)
def test_numbers_of_the_protocol_table(rule: str, published: float) -> None:
    assert abs(RULES[rule](RECALL, PRECISION) - published) <= 0.51e-4


def test_nuscenes_by_hand() -> None:
    assert RULES["nuscenes"](RECALL, PRECISION) == pytest.approx(nuscenes_by_hand(), abs=1e-12)


@pytest.mark.parametrize("rule", RULES)
def test_nothing_found_is_zero(rule: str) -> None:
    assert RULES[rule](np.zeros(0), np.zeros(0)) == 0.0
    assert RULES[rule](np.zeros(3), np.zeros(3)) == 0.0


@pytest.mark.parametrize("rule", RULES)
def test_all_found_first_is_one(rule: str) -> None:
    assert RULES[rule](np.arange(1, 8) / 7, np.ones(7)) == pytest.approx(1.0, abs=1e-12)


def curve(outcomes: list[bool], missed: int) -> tuple[FloatArray, FloatArray]:
    tp = np.cumsum(outcomes)
    return tp / max(int(tp[-1]) + missed, 1), tp / np.arange(1, len(tp) + 1)


@given(st.lists(st.booleans(), min_size=1, max_size=40), st.integers(0, 5))
def test_between_zero_and_one_and_a_false_last_detection_costs_nothing_in_the_area(
    outcomes: list[bool], missed: int
) -> None:
    for rule in RULES.values():
        assert 0.0 <= rule(*curve(outcomes, missed)) <= 1.0 + 1e-12
    area = RULES["area"]
    assert area(*curve([*outcomes, False], missed)) == area(*curve(outcomes, missed))
    assert area(*curve([False, *outcomes], missed)) <= area(*curve(outcomes, missed))


def exactly(outcomes: list[bool], truths: int) -> dict[str, Fraction]:
    """Every rule in fractions, from its definition: no arrays, no sorting, no library."""
    points, hits = [], 0
    for place, hit in enumerate(outcomes, start=1):
        hits += hit
        points.append((Fraction(hits, truths), Fraction(hits, place)))

    def best_from(recall: Fraction) -> Fraction:
        return max((p for r, p in points if r >= recall), default=Fraction(0))

    def sampled(levels: list[Fraction]) -> Fraction:
        return sum(map(best_from, levels), Fraction(0)) / len(levels)

    def straight(values: list[Fraction], at: Fraction) -> Fraction:
        """Straight lines between the points; where several have one recall, on the way up the first, then the last."""
        before = [i for i, (r, _) in enumerate(points) if r <= at]
        if not before:
            return values[0]
        i = before[-1]
        if i + 1 == len(points):
            return values[i] if points[i][0] == at else Fraction(0)
        width = points[i + 1][0] - points[i][0]
        return values[i] + (values[i + 1] - values[i]) * (at - points[i][0]) / width

    percents = [Fraction(k, 100) for k in range(101)]
    raw = [p for _, p in points]
    envelope = [max(raw[i:]) for i in range(len(raw))]
    steps = [(r, points[i - 1][0] if i else Fraction(0)) for i, (r, _) in enumerate(points)]
    above = [max(straight(raw, at) - Fraction(1, 10), Fraction(0)) for at in percents[11:]]
    return {
        "area": sum(((r - before) * best_from(r) for r, before in steps), Fraction(0)),
        "voc11": sampled([Fraction(k, 10) for k in range(11)]),
        "coco101": sampled(percents),
        "kitti40": sampled([Fraction(k, 40) for k in range(1, 41)]),
        "av2": sum((straight(envelope, at) for at in percents), Fraction(0)) / 101,
        "nuscenes": sum(above, Fraction(0)) / 90 / Fraction(9, 10),
    }


@given(st.lists(st.booleans(), min_size=1, max_size=30), st.sampled_from([7, 11, 13, 17]))
def test_every_rule_in_fractions_on_any_curve(outcomes: list[bool], truths: int) -> None:
    # prime numbers of truths: no recall but 0 and 1 lies on a sample, where a last bit would decide
    outcomes = [hit and sum(outcomes[:i]) < truths for i, hit in enumerate(outcomes)]
    tp = np.cumsum(outcomes)
    recall, precision = tp / truths, tp / np.arange(1, len(tp) + 1)
    expected = exactly(outcomes, truths)
    assert expected.keys() == RULES.keys()
    for name, rule in RULES.items():
        assert rule(recall, precision) == pytest.approx(float(expected[name]), abs=1e-12), name


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize(
    ("recall", "precision", "message"),
    [
        ([0.5, 1.0], [1.0], r"recall is \(2,\), precision \(1,\)"),
        ([0.5, 1.2], [1.0, 1.0], r"recall\[1\] is 1.2; expected 0..1"),
        ([0.5, 1.0], [1.0, np.nan], r"precision\[1\] is nan; expected 0..1 .*undefined"),
        ([1.0, 0.5], [0.5, 1.0], r"recall\[1\] is 0.5 after 1.0; expected ascending \(swapped"),
    ],
)
def test_what_is_no_curve_is_an_error(rule: str, recall: list[float], precision: list[float], message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        RULES[rule](np.array(recall), np.array(precision))
