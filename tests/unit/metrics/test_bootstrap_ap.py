"""Bootstrap of AP: the same as matching and ranking every replicate anew."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics.bootstrap import scene_weights
from hsbench.metrics.bootstrap_ap import interval, paired_difference, rank_probabilities, replicate_ap
from hsbench.metrics.detection import Predictions, Ranking, Truths, score
from hsbench.typing import IntArray
from tests.unit.metrics.detection_samples import sample2d, sample3d


def drawn(items: list[Truths], weights: IntArray) -> list[Truths]:
    return [item for item, times in zip(items, weights, strict=True) for _ in range(int(times))]


@pytest.mark.parametrize("protocol", ["hsbench", "voc", "sunrgbd"])
@given(seed=st.integers(0, 2**32), ties=st.booleans())
@settings(max_examples=15, deadline=None)
def test_agrees_with_scoring_the_drawn_scenes(protocol: str, seed: int, ties: bool) -> None:
    # without the block rule, equal scores of different scenes have no order that survives drawing
    truths, predictions = sample3d(seed, 6, classes=2, ties=ties and protocol == "hsbench")
    got = score(truths, predictions, protocol, 0.25)
    weights = scene_weights(6, 20, seed % 1000)
    for c in (*got.overall, *got.per_class):
        values = replicate_ap(c.ranking, weights)
        for w, value in zip(weights, values, strict=True):
            again = score(drawn(truths, w), drawn(predictions, w), protocol, 0.25)  # type: ignore[arg-type, type-var]
            same = [x.ap for x in (*again.overall, *again.per_class) if x.label == c.label]
            if not same or same[0] is None:
                assert np.isnan(value)
            else:
                assert value == pytest.approx(same[0], abs=1e-12)


def test_number_of_replicates_side_by_side_changes_nothing() -> None:
    truths, predictions = sample2d(2, 40, classes=1, ties=True)
    ranking = score(truths, predictions).overall[0].ranking
    weights = scene_weights(40, 50, 1)
    whole = replicate_ap(ranking, weights)
    for cut in (1, 5, 16, 17, 49):
        parts = np.concatenate([replicate_ap(ranking, weights[:cut]), replicate_ap(ranking, weights[cut:])])
        assert (parts == whole).all()


def test_interval_holds_the_score_and_knows_its_scenes() -> None:
    truths, predictions = sample2d(3, 30, classes=4)
    got = score(truths, predictions, "hsbench", 0.25)
    over_classes = interval([c.ranking for c in got.per_class], replicates=200, seed=3)
    assert over_classes.estimate == pytest.approx(got.summary["mAP_0.25"], abs=1e-12)
    one = interval([got.overall[0].ranking], replicates=200, seed=3)
    assert one.estimate == pytest.approx(got.ap, abs=1e-12)
    assert one.low is not None
    assert one.high is not None
    assert one.estimate is not None
    assert one.low < one.estimate < one.high
    assert (one.scenes, one.replicates, one.undefined_replicates) == (30, 200, 0)
    assert interval([got.overall[0].ranking], replicates=200, seed=3) == one


def test_paired_difference_of_a_method_and_itself_is_zero() -> None:
    truths, predictions = sample2d(4, 20)
    a = [score(truths, predictions).overall[0].ranking]
    same = paired_difference(a, a, replicates=50)
    assert (same.estimate, same.low, same.high) == (0.0, 0.0, 0.0)
    b = [score(truths, [Predictions(p.boxes, -p.scores, p.labels) for p in predictions]).overall[0].ranking]
    assert paired_difference(a, b, replicates=50).estimate == -paired_difference(b, a, replicates=50).estimate  # type: ignore[operator]


def test_ranks_of_methods() -> None:
    truths, predictions = sample2d(6, 25, classes=1)
    rng = np.random.default_rng(0)
    worse = [Predictions(p.boxes, p.scores + rng.normal(0, 0.3, len(p.scores)), p.labels) for p in predictions]
    upside_down = [Predictions(p.boxes, -p.scores, p.labels) for p in predictions]
    methods = [[score(truths, p).overall[0].ranking] for p in (worse, predictions, upside_down, predictions)]
    got = rank_probabilities(methods, replicates=60, seed=5)
    values = np.stack([replicate_ap(m[0], scene_weights(25, 60, 5)) for m in methods])
    assert got.estimates == pytest.approx([score(truths, p).ap for p in (worse, predictions, upside_down, predictions)])
    assert got.better is not None
    assert got.probabilities is not None
    for a in range(4):
        for b in range(4):
            share = (values[a] > values[b]).mean() + (values[a] == values[b]).mean() / 2
            assert got.better[a, b] == pytest.approx(share, abs=1e-12)
    assert (got.probabilities[1] == got.probabilities[3]).all()  # one method twice shares its ranks
    assert got.better[1, 3] == 0.5
    np.testing.assert_allclose(got.probabilities.sum(axis=0), 1, atol=1e-12)
    np.testing.assert_allclose(got.probabilities.sum(axis=1), 1, atol=1e-12)
    for wrong in ([], [methods[0], []]):
        with pytest.raises(SchemaError, match="no method"):
            rank_probabilities(wrong)


def test_replicates_without_truth_are_counted() -> None:
    truths = [Truths(np.ones((1, 4))), Truths(np.zeros((0, 4)))]
    found = [Predictions(np.ones((1, 4)), np.ones(1)), None]
    got = interval([score(truths, found).overall[0].ranking], replicates=400)
    assert got.estimate == got.low == got.high == 1.0
    assert 50 < got.undefined_replicates < 150  # a quarter
    none = interval([score([truths[1]] * 2, [None, None]).overall[0].ranking])
    assert (none.estimate, none.undefined_replicates) == (None, 1000)


def test_bad_rankings_are_named() -> None:
    ok = Ranking(np.ones(1), np.ones(1, np.int8), np.zeros(1, int), np.ones(2, int), True)
    with pytest.raises(SchemaError, match="scores rise"):
        Ranking(np.arange(2.0), np.ones(2, np.int8), np.zeros(2, int), np.ones(1, int), True)
    with pytest.raises(SchemaError, match=r"scene leaves 0\.\.0"):
        Ranking(np.ones(1), np.ones(1, np.int8), np.ones(1, int), np.ones(1, int), True)
    with pytest.raises(SchemaError, match="other values than HIT"):
        Ranking(np.ones(1), np.full(1, 3, np.int8), np.zeros(1, int), np.ones(1, int), True)
    with pytest.raises(SchemaError, match="1 scores, 2 outcomes"):
        Ranking(np.ones(1), np.ones(2, np.int8), np.zeros(1, int), np.ones(1, int), True)
    with pytest.raises(SchemaError, match="expected one or more"):
        interval([])
    other = Ranking(np.ones(1), np.ones(1, np.int8), np.zeros(1, int), np.ones(3, int), True)
    with pytest.raises(SchemaError, match="the same scenes"):
        paired_difference([ok], [other])
    with pytest.raises(SchemaError, match="weights have shape"):
        replicate_ap(ok, np.ones((2, 5), int))
