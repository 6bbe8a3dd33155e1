"""Task action-recognition: every metric against plain loops, and small cases by hand."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.evaluation import DatasetRef, Report, score_episodes
from hsbench.evaluation.action_recognition import ActionTruth, truth
from hsbench.evaluation.pooled import recompute
from hsbench.schema import Episode, EpisodeTruth
from hsbench.schema.episode import FrameList
from hsbench.submission import Metadata
from hsbench.tasks import task
from tests.reference import action_from_tasks as loops
from tests.unit.episode_builders import SENSORS, poses, true_poses

SPEC = task("action-recognition")


def report(episodes: list[tuple[str, str, ActionTruth]], answers: Mapping[str, np.ndarray]) -> Report:
    return score_episodes(
        episodes,
        answers,
        spec=SPEC,
        dataset=DatasetRef("activity-360", "0", "ab" * 32),
        split="val",
        method=Metadata(SPEC.name, SPEC.version, "guess", "poses"),
        replicates=50,
    )


def drawn(seed: int) -> tuple[ActionTruth, np.ndarray]:
    """Sixty poses of up to three tracks, labels in runs; answers right for the most part, some missing."""
    rng = np.random.default_rng(seed)
    true = np.repeat(rng.integers(0, 4, 20), rng.integers(1, 6, 20))[:60].astype(np.uint8)
    said = np.where(rng.random(len(true)) < 0.7, true, rng.integers(0, 4, len(true))).astype(np.uint8)
    return ActionTruth(true, rng.integers(5, 8, len(true)).astype(np.int32)), said


DRAWN = [drawn(seed) for seed in range(6)]
EPISODES = [(f"ep-{k}", f"room-{k // 2}", true) for k, (true, _) in enumerate(DRAWN)]
ANSWERS = {f"ep-{k}": said for k, (_, said) in enumerate(DRAWN)}
AS_LOOPS = [(t.action.tolist(), said.tolist(), t.track_id.tolist()) for t, said in DRAWN]


def hand(true: list[int], said: list[int], tracks: list[int]) -> Mapping:
    one = ActionTruth(np.array(true, np.uint8), np.array(tracks, np.int32))
    return report([("ep", "room", one)], {"ep": np.array(said, np.uint8)}).metrics


def close(value: float | None, expected: Fraction | None) -> bool:
    return (value is None) == (expected is None) and (value is None or abs(value - float(expected)) < 1e-12)


def test_every_metric_agrees_with_plain_loops() -> None:
    metrics = report(EPISODES, ANSWERS).metrics
    expected = loops.poses(AS_LOOPS)
    expected |= {f"segment-f1-{k}": loops.segment_f1(AS_LOOPS, Fraction(k, 100)) for k in (10, 25, 50)}
    assert metrics.keys() == expected.keys()
    for name, value in expected.items():
        assert close(metrics[name].value, value), name
    assert 0.5 < metrics["macro-f1"].value < 0.9
    each = [loops.poses([e])["macro-f1"] for e in AS_LOOPS]
    assert close(metrics["macro-f1"].mean_over_episodes, sum(each, Fraction(0)) / len(each))


def test_truth_as_prediction_is_perfect_in_every_metric() -> None:
    metrics = report(EPISODES, {e: t.action for e, _, t in EPISODES}).metrics
    for name, metric in metrics.items():
        _, _, cell = name.partition("confusion/")
        wrong = cell and cell.split("/")[0] != cell.split("/")[1]
        assert metric.value == (0.0 if wrong else 1.0), name


def test_by_hand() -> None:
    """Stand, stand, lie, sit, sit, interact; one answer wrong, one missing, what is said of lying counts nowhere."""
    metrics = hand([1, 1, 0, 2, 2, 3], [1, 2, 3, 2, 0, 3], [7] * 6)
    expected = {
        "accuracy": 3 / 5,
        "stand/precision": 1.0,
        "stand/recall": 1 / 2,
        "stand/f1": 2 / 3,
        "sit/precision": 1 / 2,
        "sit/f1": 1 / 2,
        "interact/f1": 1.0,
        "macro-f1": (2 / 3 + 1 / 2 + 1) / 3,
        "confusion/stand/sit": 1 / 2,
        "confusion/sit/no-answer": 1 / 2,
        # said: stand, sit, (cut) sit, interact; true: stand, (cut) sit, interact: the sit before the cut is wrong
        "segment-f1-50": 2 * 3 / (4 + 3),
    }
    for name, value in expected.items():
        assert metrics[name].value == pytest.approx(value, abs=1e-12), name


def test_constant_and_missing_answers() -> None:
    constant = hand([1, 1, 2, 3], [1, 1, 1, 1], [7] * 4)
    assert constant["macro-f1"].value == pytest.approx((2 * 2 / 6 + 0 + 0) / 3, abs=1e-12)
    assert constant["accuracy"].value == 0.5
    only_stand = hand([1, 1], [1, 1], [7, 7])
    assert (only_stand["macro-f1"].value, only_stand["sit/f1"].value) == (1.0, None)
    missing = report(EPISODES, {})
    assert (missing.primary.value, missing.counts.missing) == (0.0, 6)
    assert missing.metrics["accuracy"].value == 0.0
    nothing = report([("ep", "room", ActionTruth(np.zeros(3, np.uint8), np.zeros(3, np.int32)))], {})
    assert nothing.primary.value is None


def test_tracks_are_sequences_of_their_own() -> None:
    """Two people seen by turns, each doing one thing: two segments, not six."""
    metrics = hand([1, 2, 1, 2, 1, 2], [1, 2, 1, 2, 1, 2], [7, 8] * 3)
    assert metrics["segment-f1-50"].value == 1.0
    rows = report(
        [("ep", "room", ActionTruth(np.array([1, 2] * 3, np.uint8), np.array([7, 8] * 3, np.int32)))],
        {"ep": np.array([1, 2] * 3, np.uint8)},
    ).episodes
    assert rows[0].statistics["segments"] == (2, 2, 2, 2, 2)


def test_truth_follows_the_stored_match() -> None:
    """Rows of ``true_poses``: matches -1, 0, 1, 2, 3, -1 of actions 0, 1, 2, 3."""
    whole = EpisodeTruth(poses=true_poses(6))
    episode = Episode("ep", "rgbd-activity", SENSORS["rgbd"], FrameList(), poses(), 0, 10**9, truth=whole)
    found = truth(episode)
    assert found is not None
    assert found.action.tolist() == [0, 0, 1, 2, 3, 0]
    assert np.array_equal(found.track_id, episode.poses.track_id)
    bare = Episode("ep", "rgbd-activity", SENSORS["rgbd"], FrameList(), poses(), 0, 10**9)
    assert truth(bare) is None


def test_reports_follow_from_their_rows_and_refuse_other_lengths() -> None:
    assert recompute(Report.from_json(report(EPISODES, ANSWERS).to_json())) == []
    with pytest.raises(SchemaError, match="episode ep-0: prediction has shape"):
        report(EPISODES, {"ep-0": np.ones(3, np.uint8)})
