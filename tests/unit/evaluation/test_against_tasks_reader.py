"""The fast scorer and the stored states against plain loops written from the task's text and docs/schema.md alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hsbench.datasets.dataset import load
from hsbench.metrics.completion import episode_counts, iou
from tests.reference import completion_from_tasks

REGIONS = (
    *("occluded", "surface+occluded", "occluded-full-height", "occluded-with-structure"),
    *("outside-frustum", "occluded-swept", "occluded-unswept"),
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
