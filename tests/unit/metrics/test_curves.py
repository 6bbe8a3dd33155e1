"""Observation curves: by hand, against scikit-learn's trapezoid, and by properties."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics.curves import Curve, area, mean_curve, time_to_reach

TIMES = (5.0, 15.0, 30.0, 60.0, 120.0)


def test_area_by_hand() -> None:
    # two doublings: .2 -> .4 -> .4: means .3 and .4
    assert area(Curve((1.0, 2.0, 4.0), (0.2, 0.4, 0.4))) == pytest.approx(0.35, abs=1e-15)
    # a decade counts as a decade
    assert area(Curve((1.0, 10.0, 100.0), (0.0, 1.0, 0.0))) == pytest.approx(0.5, abs=1e-15)
    # the second doubling alone, and the middle of both
    curve = Curve((1.0, 2.0, 4.0), (0.2, 0.4, 0.8))
    assert area(curve, (2.0, 4.0)) == pytest.approx(0.6, abs=1e-15)
    middle = area(curve, (math.sqrt(2), 2 * math.sqrt(2)))
    assert middle == pytest.approx((0.35 + 0.5) / 2, abs=1e-15)


def test_scikit_learn_integrates_the_same() -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    scores = (0.1, 0.35, 0.3, 0.5, 0.55)
    expected = metrics.auc([math.log(t) for t in TIMES], scores) / math.log(24)
    assert area(Curve(TIMES, scores)) == pytest.approx(expected, abs=1e-12)


@given(st.lists(st.floats(0, 1), min_size=5, max_size=5), st.floats(0.1, 10))
@settings(max_examples=50)
def test_area_lies_between_the_scores_and_units_of_time_do_not_matter(scores: list[float], factor: float) -> None:
    got = area(Curve(TIMES, tuple(scores)))
    assert min(scores) - 1e-12 <= got <= max(scores) + 1e-12
    assert area(Curve(tuple(t * factor for t in TIMES), tuple(scores))) == pytest.approx(got, abs=1e-9)
    assert area(Curve(TIMES, (0.7,) * 5)) == pytest.approx(0.7, abs=1e-12)


def test_undefined_scores_are_left_out_and_counted() -> None:
    curve = Curve((1.0, 2.0, 4.0, 8.0), (None, 0.2, None, 0.6))
    assert curve.undefined == 2
    assert area(curve) == pytest.approx(0.4, abs=1e-15)
    assert area(curve, (1.0, 8.0)) is None  # not continued to where there is no score
    assert area(Curve((1.0, 2.0), (0.5, None))) is None
    assert area(Curve((1.0,), (0.5,))) is None


def test_time_to_reach_by_hand() -> None:
    curve = Curve((10.0, 20.0, 40.0), (0.2, 0.4, 0.3))
    assert time_to_reach(curve, 0.3).seconds == pytest.approx(10 * math.sqrt(2), abs=1e-12)
    assert time_to_reach(curve, 0.4).seconds == 20.0
    assert time_to_reach(curve, 0.5).seconds is None
    first = time_to_reach(curve, 0.1)
    assert (first.seconds, first.at_start) == (10.0, True)
    assert not time_to_reach(curve, 0.3).at_start
    assert time_to_reach(Curve((1.0, 2.0), (None, None)), 0.1).seconds is None
    skipping = Curve((5.0, 10.0, 20.0), (None, 0.2, 0.4))
    assert (time_to_reach(skipping, 0.2).seconds, time_to_reach(skipping, 0.2).at_start) == (10.0, True)


def test_lower_is_better_mirrors() -> None:
    error = Curve((10.0, 20.0, 40.0), (0.8, 0.6, 0.7), higher_is_better=False)
    assert time_to_reach(error, 0.7).seconds == pytest.approx(10 * math.sqrt(2), abs=1e-12)
    assert time_to_reach(error, 0.5).seconds is None


def test_mean_of_curves() -> None:
    a, b = Curve((1.0, 2.0, 3.0), (0.2, None, None)), Curve((1.0, 2.0, 3.0), (0.4, 0.5, None))
    assert mean_curve([a, b]).scores == (pytest.approx(0.3, abs=1e-15), 0.5, None)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Curve((1.0, 2.0), (0.5,)), "2 times and 1 scores"),
        (lambda: Curve((), ()), "0 times"),
        (lambda: Curve([1.0, 2.0], (0.1, 0.2)), "curve.observed_s is a list; expected a tuple"),
        (lambda: Curve((1.0, 2.0), [0.1, 0.2]), "curve.scores is a list; expected a tuple"),
        (lambda: Curve((0.0, 1.0), (0.1, 0.2)), "observed_s[0] is 0.0; expected seconds > 0"),
        (lambda: Curve((2.0, 1.0), (0.1, 0.2)), "observed_s[1] is 1.0; expected more than 2.0"),
        (lambda: Curve((1.0, 2.0), (0.1, math.nan)), "scores[1] is nan; expected a number, or None"),
        (lambda: area(Curve((1.0, 2.0), (0.1, 0.2)), (2.0, 1.0)), "two ascending times"),
        (lambda: time_to_reach(Curve((1.0, 2.0), (0.1, 0.2)), math.nan), "level is nan"),
        (lambda: mean_curve([]), "0 curves on 0 axes"),
        (lambda: mean_curve([Curve((1.0,), (0.1,)), Curve((2.0,), (0.1,))]), "all at the same times"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)
