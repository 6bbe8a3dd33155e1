"""Tasks affordance-topdown and affordance-view: every metric against plain loops, and small cases by hand."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.evaluation import DatasetRef, Report, score_episodes
from hsbench.evaluation.pooled import recompute
from hsbench.evaluation.scale import FACTORS, best, source
from hsbench.schema import AffordanceTruth
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.submission import Metadata
from hsbench.tasks import task
from hsbench.tasks.spec import PlanGrid
from tests.reference import affordance_from_tasks as loops

SIDE = 16
PLAN = dataclasses.replace(task("affordance-topdown"), grid=PlanGrid((SIDE, SIDE), 0.05))
VIEW = task("affordance-view")


def report(spec: Any, episodes: list[tuple[str, str, Any]], answers: Mapping[str, np.ndarray]) -> Report:
    return score_episodes(
        episodes,
        answers,
        spec=spec,
        dataset=DatasetRef(spec.datasets[0], "0", "ab" * 32),
        split="val",
        method=Metadata(spec.name, spec.version, "guess", "poses"),
        replicates=50,
    )


def blobs(rng: np.random.Generator) -> np.ndarray:
    """(16, 16) bits: patches that share cells, and other labels that no score counts."""
    bits = np.zeros((SIDE, SIDE), dtype=np.uint8)
    for label in (0, 1, 2, 2, 0):
        i, j = rng.integers(0, SIDE - 3, 2)
        bits[i : i + int(rng.integers(2, 9)), j : j + int(rng.integers(2, 9))] |= np.uint8(1 << label)
    return bits | (rng.random(bits.shape) < 0.2).astype(np.uint8) * np.uint8(1 << 4)


def answers_of(rng: np.random.Generator, bits: np.ndarray, factor: float) -> np.ndarray:
    """Truth at another scale, then noise; some cells exactly .5, which is yes."""
    index = np.clip(np.floor((np.arange(SIDE) + 0.5 - SIDE / 2) / factor + SIDE / 2), 0, SIDE - 1).astype(int)
    planes = np.stack([bits >> k & 1 for k in range(3)])[:, index][:, :, index].astype(np.float32)
    noisy = np.clip(planes * 0.6 + rng.uniform(0, 0.5, planes.shape), 0, 1).astype(np.float32)
    return np.where(rng.random(planes.shape) < 0.05, np.float32(0.5), noisy)


def drawn() -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
    rng = np.random.default_rng(3)
    bits = [blobs(rng) for _ in range(4)]
    said = [answers_of(rng, b, f) for b, f in zip(bits, (1.0, 0.7, 1.5, 1.0), strict=True)]
    return bits, said, [rng.random(b.shape) < 0.1 for b in bits]


BITS, SAID, IGNORED = drawn()
PLANS = [
    (f"ep-{k}", f"room-{k // 2}", AffordanceTruth(b, g)) for k, (b, g) in enumerate(zip(BITS, IGNORED, strict=True))
]
VIEWS = [
    (f"ep-{k}", f"room-{k // 2}", b | np.where(g, VIEW_UNSCORED, 0).astype(np.uint8))
    for k, (b, g) in enumerate(zip(BITS, IGNORED, strict=True))
]
ANSWERS = {f"ep-{k}": said for k, said in enumerate(SAID)}


def as_loops() -> list[loops.Episode]:
    return [
        ([(b >> k & 1).astype(bool).tolist() for k in range(3)], s.tolist(), g.tolist())
        for b, s, g in zip(BITS, SAID, IGNORED, strict=True)
    ]


def close(value: float | None, expected: Fraction | None) -> bool:
    return (value is None) == (expected is None) and (value is None or abs(value - float(expected)) < 1e-12)


def test_both_tasks_agree_with_plain_loops() -> None:
    plain, exclusive = loops.metric(as_loops()), loops.exclusive(as_loops())
    for spec, episodes in ((PLAN, PLANS), (VIEW, VIEWS)):
        metrics = report(spec, episodes, ANSWERS).metrics
        for name, expected in plain.items():
            assert close(metrics[name].value, expected), name
        for name, expected in exclusive.items():
            assert close(metrics[f"exclusive/{name}"].value, expected), name
        each = [loops.metric([e])["mean-iou"] for e in as_loops()]
        assert close(metrics["mean-iou"].mean_over_episodes, loops.mean(each))
    assert 0.2 < metrics["mean-iou"].value < 0.9


def test_scale_free_agrees_with_plain_loops_and_is_never_below() -> None:
    metrics = report(PLAN, PLANS, ANSWERS).metrics
    for name, expected in loops.scale_free(as_loops()).items():
        assert close(metrics[f"scale-free/{name}"].value, expected), name
    assert metrics["scale-free/mean-iou"].mean_over_episodes > metrics["mean-iou"].mean_over_episodes


def test_truth_as_prediction_is_perfect_in_every_metric() -> None:
    same = {f"ep-{k}": np.stack([b >> k & 1 for k in range(3)]).astype(np.float32) for k, b in enumerate(BITS)}
    for spec, episodes in ((PLAN, PLANS), (VIEW, VIEWS)):
        for name, metric in report(spec, episodes, same).metrics.items():
            assert metric.value == 1.0, name
            assert metric.mean_over_episodes == 1.0, name


def test_empty_full_and_missing_answers_by_hand() -> None:
    """Two cells of 256 are walkable and sittable, one of them ignored; two others interactable."""
    bits = np.zeros((SIDE, SIDE), dtype=np.uint8)
    bits[0, :2], bits[5, 5:7] = 0b011, 0b100
    ignored = np.zeros(bits.shape, dtype=bool)
    ignored[0, 0] = True
    episodes = [("ep", "room", AffordanceTruth(bits, ignored))]
    full = report(PLAN, episodes, {"ep": np.ones((3, SIDE, SIDE), np.float32)}).metrics
    assert full["walkable/iou"].value == full["sittable/iou"].value == 1 / 255
    assert full["interactable/iou"].value == 2 / 255
    assert full["mean-iou"].value == pytest.approx(4 / 255 / 3, abs=1e-15)
    assert full["exclusive/sittable/iou"].value == 1 / 255
    assert full["exclusive/walkable/iou"].value is None  # nobody's one label
    assert full["exclusive/mean-iou"].value == pytest.approx((1 / 255 + 0) / 2, abs=1e-15)
    empty = report(PLAN, episodes, {"ep": np.zeros((3, SIDE, SIDE), np.float32)})
    missing = report(PLAN, episodes, {})
    assert missing.metrics == empty.metrics
    assert (missing.counts.missing, missing.primary.value) == (1, 0.0)
    assert empty.metrics["walkable/precision"].value is None
    assert empty.metrics["exclusive/none/iou"].value == empty.metrics["exclusive/accuracy"].value == 252 / 255
    constant = report(PLAN, episodes, {"ep": np.full((3, SIDE, SIDE), 0.5, np.float32)}).metrics
    assert constant == full


def test_one_half_is_yes_and_just_below_is_no() -> None:
    bits = np.full((SIDE, SIDE), 0b111, dtype=np.uint8)
    episodes = [("ep", "room", bits)]
    half, below = np.float32(0.5), np.nextafter(np.float32(0.5), np.float32(0))
    for value, expected in ((half, 1.0), (below, 0.0)):
        assert report(VIEW, episodes, {"ep": np.full((3, SIDE, SIDE), value)}).primary.value == expected


def test_a_room_twice_as_large_is_right_when_scale_is_free() -> None:
    bits = np.zeros((SIDE, SIDE), dtype=np.uint8)
    bits[6:10, 6:10] = 0b001
    large = np.zeros((3, SIDE, SIDE), np.float32)
    large[0, 4:12, 4:12] = 1
    episodes = [("ep", "room", AffordanceTruth(bits, np.zeros(bits.shape, bool)))]
    metrics = report(PLAN, episodes, {"ep": large}).metrics
    assert (metrics["walkable/iou"].value, metrics["scale-free/walkable/iou"].value) == (16 / 64, 1.0)


def test_factors_and_ties() -> None:
    assert (len(FACTORS), FACTORS[0], FACTORS[20], FACTORS[40]) == (41, 0.5, 1.0, 2.0)
    assert np.allclose(np.diff(np.log(FACTORS)), np.log(2) / 20)
    assert np.array_equal(source(8, 4.0, 1.0), np.arange(8))
    assert source(8, 4.0, 2.0).tolist() == [2, 2, 3, 3, 4, 4, 5, 5]
    assert source(4, 0.0, 0.5).tolist() == [1, 3, -1, -1]
    values = np.zeros(41)
    assert best(values) == best(values * np.nan) == 20
    values[[3, 17, 23, 40]] = 0.7
    assert best(values) == 17


def test_reports_follow_from_their_rows_and_refuse_other_grids() -> None:
    whole = report(PLAN, PLANS, ANSWERS)
    assert recompute(Report.from_json(whole.to_json())) == []
    with pytest.raises(SchemaError, match="episode ep-0: truth is on PlanGrid"):
        report(task("affordance-topdown"), PLANS, ANSWERS)
    with pytest.raises(SchemaError, match="episode ep-0: prediction has shape"):
        report(VIEW, VIEWS, {"ep-0": np.zeros((3, 2, 2), np.float32)})
