"""Two methods compared: paired over scenes, refused where the comparison would mean nothing."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.evaluation import DatasetRef, compare, score_episodes
from hsbench.evaluation.metric import statistics_of
from hsbench.evaluation.pooled import scenes_of
from hsbench.evaluation.scorers import metrics_of
from hsbench.metrics.bootstrap import paired_difference
from tests.unit.evaluation.reports import DATA, EPISODES, METHOD, SPEC, guesses, report

ARGUMENTS = {"spec": SPEC, "dataset": DATA, "split": "val", "method": METHOD}


def test_a_clear_gain_is_real_and_antisymmetric() -> None:
    good, bad = report(0.05), report(0.4)
    forth, back = compare(good, bad), compare(bad, good)
    assert forth.primary.estimate == pytest.approx(good.primary.value - bad.primary.value, abs=1e-12)
    assert forth.is_real
    assert forth.primary.low == pytest.approx(-back.primary.high, abs=1e-12)
    assert (forth.scenes, forth.episodes, forth.unpaired) == (6, 12, 0)
    metric = metrics_of("scene-completion")["known/recall"]
    sums = [np.zeros((6, 4), np.int64) for _ in range(2)]
    for summed, report_ in zip(sums, (good, bad), strict=True):
        for row, counts in zip(report_.episodes, statistics_of(report_.episodes, "known", 4), strict=True):
            summed[scenes_of(report_.episodes).index(row.scene_id)] += counts
    expected = paired_difference(*sums, metric.value)
    assert forth.differences["known/recall"] == expected


def test_a_method_is_no_better_than_itself() -> None:
    same = compare(report(0.3), report(0.3))
    assert (same.primary.estimate, same.primary.low, same.primary.high, same.is_real) == (0.0, 0.0, 0.0, False)


def test_only_common_episodes_count() -> None:
    whole = report(0.3)
    part = score_episodes(EPISODES[:8], guesses(0.1), **ARGUMENTS)
    got = compare(whole, part)
    assert (got.scenes, got.episodes, got.unpaired) == (4, 8, 4)
    same = compare(score_episodes(EPISODES[:8], guesses(0.3), **ARGUMENTS), part)
    assert got.differences == same.differences


@pytest.mark.parametrize(
    ("change", "item"),
    [({"split": "test-seen"}, "split"), ({"dataset": DatasetRef("rgbd-activity", "1", "cd")}, "dataset")],
)
def test_scores_of_different_things_do_not_compare(change: dict, item: str) -> None:
    with pytest.raises(SchemaError, match=f"reports differ in {item}"):
        compare(report(0.3), report(0.3, **change))


def test_nothing_in_common_or_moved() -> None:
    first = score_episodes(EPISODES[:2], {}, **ARGUMENTS)
    with pytest.raises(SchemaError, match="no episode in common"):
        compare(first, score_episodes(EPISODES[2:4], {}, **ARGUMENTS))
    with pytest.raises(SchemaError, match="ep-00 is in scene room-0 and elsewhere"):
        compare(first, score_episodes([(e, "elsewhere", t) for e, _, t in EPISODES[:2]], {}, **ARGUMENTS))
