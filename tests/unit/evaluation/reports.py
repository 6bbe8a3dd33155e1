"""Tiny truths, predictions and reports for the tests of evaluation and leaderboard."""

from __future__ import annotations

import dataclasses

import numpy as np

from hsbench.evaluation import DatasetRef, Report, score_episodes
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema import OccupancyTruth, VoxelState, category
from hsbench.submission import Metadata
from hsbench.tasks import task

GRID = VoxelGrid((0.0, 0.0, 0.0), (2, 2, 4), 0.05)
SPEC = dataclasses.replace(task("scene-completion"), grid=GRID)
DATA = DatasetRef("rgbd-activity", "0", "ab" * 32)
METHOD = Metadata("scene-completion", "0", "guess", "poses", authors=("A. Author",))
CHAIR = category("chair").category_id


def truth(seed: int) -> OccupancyTruth:
    """Sixteen occluded voxels, about half of them chair."""
    rng = np.random.default_rng(seed)
    semantic = np.where(rng.random(GRID.shape) < 0.5, CHAIR, 0).astype(np.uint8)
    return OccupancyTruth(
        GRID,
        semantic,
        semantic.astype(np.uint16),
        np.full(GRID.shape, VoxelState.OCCLUDED, np.uint8),
        np.zeros(GRID.shape, bool),
        np.where(rng.random(GRID.shape) < 0.5, 1, np.inf).astype(np.float32),
    )


EPISODES = [(f"ep-{i:02d}", f"room-{i // 2}", truth(i)) for i in range(12)]


def guesses(noise: float, seed: int = 0) -> dict[str, np.ndarray]:
    """Truth with a share of voxels flipped."""
    rng = np.random.default_rng(seed)
    return {e: t.solid ^ (rng.random(GRID.shape) < noise) for e, _, t in EPISODES}


def report(noise: float, **changes: object) -> Report:
    """A report on all episodes."""
    arguments = {"spec": SPEC, "dataset": DATA, "split": "val", "method": METHOD, "replicates": 200} | changes
    return score_episodes(EPISODES, guesses(noise), **arguments)
