"""Task scene-reconstruction-360: every metric against plain loops, and small cases by hand."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from fractions import Fraction

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.evaluation import DatasetRef, Report, score_episodes
from hsbench.evaluation.pooled import recompute
from hsbench.geometry.grids import VoxelGrid
from hsbench.submission import Metadata
from hsbench.tasks import task
from hsbench.truth.affordance_volumes import Volume, VolumeTruth
from tests.reference import reconstruction_from_tasks as loops

SHAPE = (10, 8, 6)
GRID = VoxelGrid((-0.25, -0.2, 0.0), SHAPE, 0.05)
SPEC = dataclasses.replace(task("scene-reconstruction-360"), grid=GRID)


def report(episodes: list[tuple[str, str, VolumeTruth]], answers: Mapping[str, np.ndarray]) -> Report:
    return score_episodes(
        episodes,
        answers,
        spec=SPEC,
        dataset=DatasetRef("activity-360", "0", "ab" * 32),
        split="val",
        method=Metadata(SPEC.name, SPEC.version, "guess", "poses"),
        replicates=50,
    )


def drawn(seed: int) -> tuple[VolumeTruth, np.ndarray]:
    """Boxes of labels, and an answer right for the most part."""
    rng = np.random.default_rng(seed)
    labels = np.zeros(SHAPE, dtype=np.uint8)
    labels[1:8, 1:7, 0] = Volume.WALKABLE
    labels[0, :, :] = Volume.WALL
    for label in (Volume.INTERACTABLE, Volume.SITTABLE):
        i, j = rng.integers(1, 6, 2)
        labels[i : i + 3, j : j + 2, : int(rng.integers(2, 5))] = label
    solid = (labels > Volume.WALKABLE) & (rng.random(SHAPE) < 0.8)
    said = np.where(rng.random(SHAPE) < 0.8, labels, rng.integers(0, 5, SHAPE)).astype(np.uint8)
    if seed == 1:
        said = np.roll(said, 1, axis=0)
    ignored = np.zeros(SHAPE, dtype=bool)
    ignored[8, :, :] = seed % 2
    return VolumeTruth(GRID, labels, solid, ignored | (rng.random(SHAPE) < 0.02)), said


DRAWN = [drawn(seed) for seed in range(3)]
EPISODES = [(f"ep-{k}", f"room-{k}", true) for k, (true, _) in enumerate(DRAWN)]
ANSWERS = {f"ep-{k}": said for k, (_, said) in enumerate(DRAWN)}


def as_loops() -> list[loops.Episode]:
    def where(mask: np.ndarray) -> set:
        return {tuple(c) for c in np.argwhere(mask).tolist()}

    return [
        loops.Episode(
            SHAPE,
            (-5, -4, 0),
            {c: int(true.labels[c]) for c in loops.cells(SHAPE)},
            where(true.solid),
            where(true.ignored),
            {c: int(said[c]) for c in loops.cells(SHAPE)},
        )
        for true, said in DRAWN
    ]


def close(value: float | None, expected: Fraction | None) -> bool:
    return (value is None) == (expected is None) and (value is None or abs(value - float(expected)) < 1e-12)


def test_every_metric_agrees_with_plain_loops() -> None:
    metrics = report(EPISODES, ANSWERS).metrics
    expected = {
        **loops.volumes(as_loops()),
        **{f"scale-free/{k}": v for k, v in loops.scale_free(as_loops()).items()},
        **{f"occupancy/{k}": v for k, v in loops.occupancy(as_loops()).items()},
        **{f"surface/{k}": v for k, v in loops.surface(as_loops()).items()},
    }
    assert metrics.keys() == expected.keys()
    for name, value in expected.items():
        assert close(metrics[name].value, value), name
    assert 0.3 < metrics["mean-iou"].value < 0.9


def test_each_truth_as_prediction_is_perfect_in_the_metrics_that_name_it() -> None:
    volumes = report(EPISODES, {e: t.labels for e, _, t in EPISODES}).metrics
    solids = report(EPISODES, {e: t.solid * np.uint8(Volume.WALL) for e, _, t in EPISODES}).metrics
    for name in volumes:
        of_solids = name.startswith(("occupancy/", "surface/"))
        assert (solids if of_solids else volumes)[name].value == 1.0, name


def test_empty_full_and_missing_answers_by_hand() -> None:
    """A grid of 480 voxels, 4 of them wall, alone in the middle of space."""
    labels = np.zeros(SHAPE, dtype=np.uint8)
    labels[4, 3:5, 2:4] = Volume.WALL
    true = VolumeTruth(GRID, labels, labels > 0, np.zeros(SHAPE, bool))
    episodes = [("ep", "room", true)]
    full = report(episodes, {"ep": np.full(SHAPE, Volume.WALL, np.uint8)}).metrics
    assert full["mean-iou"].value == full["occupancy/iou"].value == 4 / 480
    assert full["surface/accuracy"].value is None  # nothing free, so no face
    assert full["surface/completeness"].value == full["surface/f-score"].value == 0.0
    sofa = report(episodes, {"ep": np.full(SHAPE, Volume.SITTABLE, np.uint8)}).metrics
    assert (sofa["mean-iou"].value, sofa["occupancy/recall"].value) == (0.0, 1.0)
    missing = report(episodes, {})
    assert missing.metrics == report(episodes, {"ep": np.zeros(SHAPE, np.uint8)}).metrics
    assert (missing.primary.value, missing.counts.missing) == (0.0, 1)
    floor = report(episodes, {"ep": np.full(SHAPE, Volume.WALKABLE, np.uint8)}).metrics
    assert floor["occupancy/precision"].value is None  # the floor is no solid


def test_a_wall_at_twice_its_distance_is_right_when_scale_is_free() -> None:
    labels, far = np.zeros(SHAPE, dtype=np.uint8), np.zeros(SHAPE, dtype=np.uint8)
    labels[4:6, 3:5, :2] = Volume.WALL
    far[3:7, 2:6, :4] = Volume.WALL
    true = VolumeTruth(GRID, labels, labels > 0, np.zeros(SHAPE, bool))
    metrics = report([("ep", "room", true)], {"ep": far}).metrics
    assert (metrics["wall/iou"].value, metrics["scale-free/wall/iou"].value) == (8 / 64, 1.0)


def test_reports_follow_from_their_rows_and_refuse_other_grids() -> None:
    assert recompute(Report.from_json(report(EPISODES, ANSWERS).to_json())) == []
    other = dataclasses.replace(EPISODES[0][2], grid=VoxelGrid((0.0, 0.0, 0.0), SHAPE, 0.05))
    with pytest.raises(SchemaError, match="episode ep-0: truth is on"):
        report([("ep-0", "room", other)], ANSWERS)
    with pytest.raises(SchemaError, match="episode ep-0: prediction has shape"):
        report(EPISODES, {"ep-0": np.zeros((2, 2, 2), np.uint8)})
