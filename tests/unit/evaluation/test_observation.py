"""Scores over the length of observation: by hand, against scoring each time by itself, and on disk."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from hsbench import Evaluator, load
from hsbench.errors import SchemaError, SubmissionError
from hsbench.evaluation import DatasetRef, episode_row, read_report, score_episodes, watched_report, write_report
from hsbench.evaluation.episode_table import write_episode_table
from hsbench.evaluation.observation import Watched
from hsbench.evaluation.pooled import recompute
from hsbench.evaluation.report import Report
from hsbench.evaluation.score import check_on, score
from hsbench.metrics.bootstrap import scene_weights
from hsbench.metrics.curves import Curve, area
from hsbench.submission import Metadata, SubmissionWriter
from hsbench.tasks import task
from tests.unit.evaluation.reports import DATA, EPISODES, METHOD, SPEC, guesses

ARGUMENTS = {"spec": SPEC, "dataset": DATA, "split": "val", "method": METHOD, "replicates": 50}
NOISE = {5.0: 0.5, 30.0: 0.3, None: 0.1}
ANSWERS = {observed_s: guesses(noise) for observed_s, noise in NOISE.items()}
SHORT_S, LONG_S = 20.0, 60.0


def watched(duration_s: dict[str, float], times: tuple[float, ...] = (5.0, 30.0)) -> list[Watched]:
    def row(episode: tuple, observed_s: float | None):
        return episode_row(*episode, ANSWERS[observed_s][episode[0]], SPEC)

    return [
        Watched(
            row(episode, None),
            duration_s.get(episode[0], LONG_S),
            {t: row(episode, t) for t in times if t < duration_s.get(episode[0], LONG_S)},
        )
        for episode in EPISODES
    ]


def made(**changes: object) -> Report:
    return watched_report(watched({"ep-03": SHORT_S, "ep-04": SHORT_S}), **ARGUMENTS | changes)


def test_each_point_is_the_score_of_that_time_alone() -> None:
    report = made()
    assert report.curve is not None
    assert [moment.observed_s for moment in report.curve.moments] == [5.0, 30.0]
    assert report.curve.whole_s == LONG_S
    whole = score_episodes(EPISODES, ANSWERS[None], **ARGUMENTS)
    assert report.metrics == whole.metrics
    for moment in report.curve.moments:
        ended = {} if moment.observed_s < SHORT_S else {e: ANSWERS[None][e] for e in ("ep-03", "ep-04")}
        alone = score_episodes(EPISODES, ANSWERS[moment.observed_s] | ended, **ARGUMENTS)
        assert moment.metrics == alone.metrics
        assert moment.episodes == alone.episodes
    assert recompute(report) == []


def test_the_area_and_its_interval_against_plain_loops() -> None:
    report = made()
    rows = [*(m.episodes for m in report.curve.moments), report.episodes]
    scenes = sorted({row.scene_id for row in report.episodes})

    def area_of(weight: dict[str, int]) -> float:
        points = []
        for at in rows:
            tp, fp, fn, _ = (sum(weight[row.scene_id] * row.statistics["occluded"][k] for row in at) for k in range(4))
            points.append(tp / (tp + fp + fn))
        logs = [math.log(t) for t in (5.0, 30.0, LONG_S)]
        steps = [(logs[k + 1] - logs[k]) * (points[k] + points[k + 1]) / 2 for k in range(2)]
        return sum(steps) / (logs[2] - logs[0])

    found = report.curve.area
    assert found.value == pytest.approx(area_of(dict.fromkeys(scenes, 1)), abs=1e-12)
    drawn = [area_of(dict(zip(scenes, line, strict=True))) for line in scene_weights(len(scenes), 50, 0).tolist()]
    assert (found.low, found.high) == pytest.approx(tuple(np.quantile(drawn, [0.025, 0.975])), abs=1e-12)
    points = (*(m.metrics["occluded/iou"].value for m in report.curve.moments), report.primary.value)
    assert found.value == area(Curve((5.0, 30.0, LONG_S), points))


def test_the_curve_ends_with_the_longest_episode_or_the_last_time_of_the_task() -> None:
    assert watched_report(watched({}), **ARGUMENTS).curve.whole_s == LONG_S
    endless = [dataclasses.replace(episode, duration_s=121.0) for episode in watched({})]
    assert watched_report(endless, **ARGUMENTS).curve.whole_s == SPEC.observation_times_s[-1] == 120.0
    assert watched_report(watched({}, times=()), **ARGUMENTS).curve is None


@pytest.mark.parametrize(
    ("observed_s", "change", "words"),
    [
        (30.0, "remove", "ep-05 has no answer after 30 s of 60 s; other episodes have one"),
        (7.0, "add", "ep-05 has an answer after 7 s of 60 s; times apart are 5, 15, 30 s"),
        (120.0, "add", "ep-05 has an answer after 120 s of 60 s"),
    ],
)
def test_times_must_be_those_of_the_task_and_of_the_others(observed_s: float, change: str, words: str) -> None:
    episodes = watched({})
    earlier = dict(episodes[5].earlier)
    if change == "add":
        earlier[observed_s] = episodes[5].whole
    else:
        del earlier[observed_s]
    episodes[5] = dataclasses.replace(episodes[5], earlier=earlier)
    with pytest.raises(SchemaError, match=words):
        watched_report(episodes, **ARGUMENTS)


def test_nothing_is_lost_on_disk_and_an_edited_curve_is_told(tmp_path: Path) -> None:
    report = made()
    write_report(tmp_path / "r.json", report)
    assert read_report(tmp_path / "r.json") == report
    curve = report.curve
    edited = dataclasses.replace(curve.area, value=0.99, low=0.98, high=1.0)
    faults = recompute(dataclasses.replace(report, curve=dataclasses.replace(curve, area=edited)))
    assert [fault.split(":")[0] for fault in faults] == ["area of the curve"] * 3
    better = dataclasses.replace(curve.moments[0], metrics=report.metrics)
    changed = dataclasses.replace(curve, moments=(better, curve.moments[1]))
    faults = recompute(dataclasses.replace(report, curve=changed))
    assert faults
    assert all(fault.startswith("after 5 s: metric ") for fault in faults)
    longer = dataclasses.replace(report, curve=dataclasses.replace(curve, whole_s=240.0))
    odd = dataclasses.replace(curve.moments[0], observed_s=6.0)
    other = dataclasses.replace(report, curve=dataclasses.replace(curve, moments=(odd, curve.moments[1])))
    for changed_report, words in ((longer, "over 240.0 s"), (other, r"over \[6.0\] s")):
        (fault,) = recompute(changed_report)
        assert re.search(words, fault)
    for moments in ((), curve.moments[::-1]):
        with pytest.raises(SchemaError, match="curve has times"):
            dataclasses.replace(curve, moments=moments)
    fewer = dataclasses.replace(curve.moments[0], episodes=curve.moments[0].episodes[1:])
    with pytest.raises(SchemaError, match="after 5 s is not of the report's episodes"):
        dataclasses.replace(report, curve=dataclasses.replace(curve, moments=(fewer, curve.moments[1])))


def test_reports_before_curves_are_still_read(tmp_path: Path) -> None:
    report = watched_report(watched({}, times=()), **ARGUMENTS)
    old = report.to_json() | {"format": "hsbench-report/0"}
    del old["curve"], old["provenance"]["code_sha256"], old["provenance"]["split_sha256"]
    provenance = dataclasses.replace(report.provenance, code_sha256=None)
    assert Report.from_json(old) == dataclasses.replace(report, provenance=provenance)


def test_the_table_of_episodes(tmp_path: Path) -> None:
    """Counts of an episode by hand, and the same bytes whatever the order of episodes."""
    report = made()
    write_episode_table(tmp_path / "a.parquet", report)
    backwards = watched_report(watched({"ep-03": SHORT_S, "ep-04": SHORT_S})[::-1], **ARGUMENTS)
    write_episode_table(tmp_path / "b.parquet", backwards)
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    table = pq.read_table(tmp_path / "a.parquet")
    assert table.column_names == ["episode_id", "scene_id", "observed_s", "missing", *report.metrics]
    assert table["observed_s"].to_pylist() == [5.0] * 12 + [30.0] * 12 + [None] * 12
    lines = table.to_pylist()
    rows = [*(row for m in report.curve.moments for row in m.episodes), *report.episodes]
    for line, row in zip(lines, rows, strict=True):
        tp, fp, fn, _ = row.statistics["occluded"]
        assert (line["episode_id"], line["scene_id"], line["missing"]) == (row.episode_id, row.scene_id, False)
        assert line["occluded/iou"] == pytest.approx(tp / (tp + fp + fn))
    assert all(line["outside-frustum/iou"] is None for line in lines)  # no voxel of these rooms is outside


def test_a_submission_on_disk_and_an_evaluator_agree(rgbd: Path, tmp_path: Path) -> None:
    spec = task("scene-completion")
    data = load(rgbd, "train", frames=False)
    (observed_s,) = (t for t in spec.observation_times_s if t < data[0].duration_s)
    method = Metadata(spec.name, spec.version, "noise", "poses")

    def answer(number: int) -> np.ndarray:
        return np.random.default_rng(number).random(spec.grid.shape) < 0.3

    evaluator = Evaluator(spec.name)
    with SubmissionWriter(tmp_path / "s", spec, method) as writer:
        for number, episode in enumerate(dataclasses.replace(data, truth=True)):
            writer.add(episode.episode_id, answer(number))
            writer.add(episode.episode_id, answer(number + 50), observed_s)
            evaluator.add(episode, answer(number), {observed_s: answer(number + 50)})
    report = score(spec.name, tmp_path / "s", data)
    description = data.description
    where = DatasetRef(description["name"], description["splits_version"], data.manifest_sha256)
    assert evaluator.report(where, "train", method) == report
    assert [m.observed_s for m in report.curve.moments] == [observed_s]
    assert report.curve.whole_s == data[0].duration_s

    last = sorted((tmp_path / "s" / "predictions").glob("*@*"))[-1]
    beyond = last.with_name(f"{data.episode_ids[0]}@60s.npz")
    last.rename(beyond)
    faults = check_on(tmp_path / "s", spec, data)
    assert faults == [
        f"predictions/{last.name}: missing (other episodes have an answer after {observed_s:g} s)",
        f"'predictions/{beyond.name}': unexpected file (the episode ends after {data[0].duration_s:g} s; then its "
        "answer is the file without '@')",
    ]
    with pytest.raises(SubmissionError):
        score(spec.name, tmp_path / "s", data)
    beyond.unlink()
    partly = score(spec.name, tmp_path / "s", data, allow_missing=True)
    assert sum(row.missing for row in partly.curve.moments[0].episodes) == 1
    assert partly.metrics == report.metrics
