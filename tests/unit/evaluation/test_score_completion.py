"""Scoring a split: pooled by hand, missing answers counted, the same bytes in any order."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import hsbench
from hsbench.errors import SchemaError
from hsbench.evaluation import episode_row, score_episodes, split_report, write_report
from hsbench.metrics.completion import REGIONS, Counts, episode_counts
from hsbench.tasks import task
from tests.unit.evaluation.reports import DATA, EPISODES, METHOD, SPEC, guesses, report

ARGUMENTS = {"spec": SPEC, "dataset": DATA, "split": "val", "method": METHOD, "replicates": 200}


def test_truth_as_prediction_is_perfect_in_every_metric() -> None:
    perfect = report(0.0)
    for name, metric in perfect.metrics.items():
        assert metric.value in (1.0, None), name
        assert metric.mean_over_episodes in (1.0, None), name
    assert (perfect.primary.value, perfect.primary.low, perfect.primary.high) == (1.0, 1.0, 1.0)
    assert list(perfect.metrics) == [f"{r}/{m}" for r in REGIONS for m in ("iou", "precision", "recall")]


def test_pooled_value_adds_counts_first_and_the_mean_stands_beside() -> None:
    predictions = guesses(0.3)
    got = score_episodes(EPISODES, predictions, **ARGUMENTS)
    each = [episode_counts(truth, predictions[e]) for e, _, truth in EPISODES]
    for region in REGIONS:
        total = sum((counts[region] for counts in each), Counts())
        for name in ("iou", "precision", "recall"):
            metric = got.metrics[f"{region}/{name}"]
            assert metric.value == getattr(total, name)
            defined = [v for counts in each if (v := getattr(counts[region], name)) is not None]
            assert metric.undefined_episodes == len(each) - len(defined)
            expected = sum(defined) / len(defined) if defined else None
            assert metric.mean_over_episodes == (None if expected is None else pytest.approx(expected, abs=1e-12))
    assert got.primary.value == got.metrics["occluded/iou"].value
    assert got.counts == dataclasses.replace(got.counts, scored=12, missing=0, undefined=0, scenes=6)


def test_a_missing_episode_is_an_empty_prediction_and_counted() -> None:
    predictions = guesses(0.3)
    emptied = {**predictions, "ep-03": np.zeros(SPEC.grid.shape, bool)}
    del predictions["ep-03"]
    missing = score_episodes(EPISODES, predictions, **ARGUMENTS)
    empty = score_episodes(EPISODES, emptied, **ARGUMENTS)
    assert missing.metrics == empty.metrics
    assert (missing.counts.scored, missing.counts.missing) == (11, 1)
    assert [row.episode_id for row in missing.episodes if row.missing] == ["ep-03"]
    nothing = score_episodes(EPISODES, {}, **ARGUMENTS)
    assert (nothing.primary.value, nothing.counts.missing) == (0.0, 12)
    assert nothing.metrics["occluded/precision"].value is None


def test_order_and_parts_make_no_difference_to_a_byte(tmp_path: Path) -> None:
    predictions = guesses(0.3)
    write_report(tmp_path / "a.json", score_episodes(EPISODES, predictions, **ARGUMENTS))
    write_report(tmp_path / "b.json", score_episodes(EPISODES[::-1], predictions, **ARGUMENTS))
    rows = [episode_row(e, s, t, predictions[e], SPEC) for e, s, t in EPISODES[6:] + EPISODES[:6]]
    write_report(tmp_path / "c.json", split_report(rows, **ARGUMENTS))
    texts = {(tmp_path / name).read_bytes() for name in ("a.json", "b.json", "c.json")}
    assert len(texts) == 1


def test_provenance_and_no_trace_of_machine_or_time() -> None:
    got = report(0.2, seed=5)
    assert (got.provenance.hsbench, got.provenance.seed, got.provenance.replicates) == (hsbench.__version__, 5, 200)
    assert (got.task, got.task_version, got.protocol) == ("scene-completion", "0", "hsbench-occluded")
    assert got.dataset == DATA
    assert got.metrics["occluded/iou"].low != report(0.2, seed=6).metrics["occluded/iou"].low


def test_one_scene_has_a_value_but_no_interval() -> None:
    one = score_episodes(EPISODES[:2], guesses(0.3), **ARGUMENTS)
    assert one.primary.value is not None
    assert (one.primary.low, one.primary.high) == (None, None)
    assert one.metrics["occluded/iou"].reason == "one scene: nothing to resample"


def test_better_guesses_score_higher() -> None:
    values = [report(noise).primary.value for noise in (0.0, 0.1, 0.3, 1.0)]
    assert values == sorted(values, reverse=True)
    assert values[-1] == 0.0


def test_refusals() -> None:
    with pytest.raises(SchemaError, match="holds no episode"):
        score_episodes([], {}, **ARGUMENTS)
    with pytest.raises(SchemaError, match="ascend strictly by episode_id"):
        score_episodes([*EPISODES, EPISODES[0]], {}, **ARGUMENTS)
    with pytest.raises(SchemaError, match="episode ep-00: truth is on"):
        score_episodes(EPISODES, {}, **ARGUMENTS | {"spec": task("scene-completion")})
    with pytest.raises(SchemaError, match="episode ep-00: prediction has shape"):
        score_episodes(EPISODES, {"ep-00": np.zeros((2, 2, 3), bool)}, **ARGUMENTS)
