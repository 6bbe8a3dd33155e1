"""The fast scorer and the stored states against plain loops written from the task's text and docs/schema.md alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hsbench.datasets.dataset import load
from hsbench.evaluation.score import score
from hsbench.metrics.completion import episode_counts, iou
from hsbench.submission import Metadata, write_submission
from hsbench.tasks import task
from tests.reference import completion_from_tasks

REGIONS = (
    *("occluded", "surface+occluded", "occluded-full-height", "occluded-with-structure"),
    *("outside-frustum", "occluded-swept", "occluded-unswept", "known", "everything"),
)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_counts_agree_in_every_region(rgbd: Path, share: float) -> None:
    rng = np.random.default_rng(7)
    rows, pooled = [], np.zeros(4, dtype=np.int64)
    for episode in load(rgbd, "val", truth=True, frames=False):
        occupied = rng.random(episode.truth.occupancy.grid.shape) < share
        expected = completion_from_tasks.score_episode(rgbd / "episodes" / episode.episode_id, occupied)
        counts = episode_counts(episode.truth.occupancy, occupied)
        for region in REGIONS:
            got = counts[region]
            assert (got.tp, got.fp, got.fn, got.tn) == tuple(expected[region]), region
        rows.append(expected)
        pooled += expected["occluded"]
    value = iou(pooled[None])[0]
    assert completion_from_tasks.pooled_iou(rows) == pytest.approx(value, abs=1e-12)


def test_every_metric_of_a_report_and_its_mean_over_episodes(rgbd: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    spec, data = task("scene-completion"), load(rgbd, "val", frames=False)
    answers = {episode_id: rng.random(spec.grid.shape) < 0.2 for episode_id in data.episode_ids}
    metadata = Metadata(spec.name, spec.version, "noise", "poses")
    write_submission(tmp_path / "s", spec, metadata, answers.items())
    metrics = score(spec.name, tmp_path / "s", data).metrics
    each = [completion_from_tasks.score_episode(rgbd / "episodes" / e, said) for e, said in answers.items()]
    assert set(metrics) == {f"{region}/{name}" for region in REGIONS for name in ("iou", "precision", "recall")}
    for region in REGIONS:
        pooled = completion_from_tasks.ratios([sum(row[region][k] for row in each) for k in range(4)])
        alone = [completion_from_tasks.ratios(row[region]) for row in each]
        for name, value in pooled.items():
            found = metrics[f"{region}/{name}"]
            assert found.value == (None if value is None else pytest.approx(value, abs=1e-12)), (region, name)
            known = [ratios[name] for ratios in alone if ratios[name] is not None]
            mean = pytest.approx(sum(known) / len(known), abs=1e-12) if known else None
            assert (found.mean_over_episodes, found.undefined_episodes) == (mean, len(each) - len(known))


def test_stored_states_follow_from_the_depth_at_t0(rgbd: Path) -> None:
    """The PNG has whole millimetres and the states come from exact rays: they may differ where a voxel's centre lies
    within half a millimetre of the margin, on a few in ten thousand."""
    differing = total = 0
    for episode in load(rgbd, truth=True, frames=False):
        state = episode.truth.occupancy.state
        for i, j, k, expected in completion_from_tasks.states_at_t0(rgbd / "episodes" / episode.episode_id):
            differing += int(state[i, j, k] != expected)
            total += 1
    assert total > 10_000
    assert differing <= 1e-3 * total
