"""The example of docs/torch.md: forty lines that train a network and score it."""

from __future__ import annotations

import ast
import re
import runpy
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hsbench.datasets.importers.capture_set import add_capture
from hsbench.io.dataset_index import EPISODES_FOLDER, write_index
from hsbench.io.episodes import write_episode
from hsbench.metrics import multilabel
from hsbench.schema.episode import NS_PER_S, ActivityMaps, Episode, EpisodeTruth, FrameList
from hsbench.schema.occupancy import AffordanceTruth
from hsbench.tasks.probability_maps import LABELS
from hsbench.tasks.registry import task
from tests.unit.episode_builders import SENSORS

torch = pytest.importorskip("torch", reason="the extra torch is not installed")
EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "train_torch.py"
MOST_LINES = 40
BLOCK = 32
"""Cells a side of the squares, alike all over, of which made plans consist."""


def plan(number: int) -> Episode:
    """People did, here and there, what each cell affords."""
    rng = np.random.default_rng(number)
    grid = task("affordance-topdown").grid
    blocks = rng.integers(0, 8, (grid.shape[0] // BLOCK, grid.shape[1] // BLOCK))
    labels = np.kron(blocks, np.ones((BLOCK, BLOCK))).astype(np.uint8)
    maps = (multilabel.planes(labels, LABELS) & (rng.random((3, *grid.shape)) < 0.5)).astype(np.float32)
    truth = EpisodeTruth(affordance=AffordanceTruth(labels, rng.random(grid.shape) < 0.1, grid.cell_m))
    activity = ActivityMaps(maps, ("stand", "sit", "interact"), grid.cell_m)
    sensor = SENSORS["topdown"]
    return Episode(f"m-{number}", "activity-maps", sensor, FrameList(), None, 0, NS_PER_S, activity, truth)


@pytest.fixture
def plans(tmp_path: Path) -> Path:
    """Twenty plans of split train and two of val; one more, of neither, began the data set."""
    add_capture(tmp_path / "maps", plan(0))
    for number in range(1, 23):
        episode = plan(number)
        folder = tmp_path / "maps" / EPISODES_FOLDER / episode.episode_id
        write_episode(folder, episode, episode.episode_id, "train" if number <= 20 else "val")
    write_index(tmp_path / "maps")
    return tmp_path / "maps"


@pytest.fixture
def one_thread() -> Iterator[None]:
    """Torch on one thread: several of them wait for each other where other tests run."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.mark.usefixtures("one_thread")
def test_it_trains_and_scores(plans: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["train_torch.py", str(plans)])
    runpy.run_path(str(EXAMPLE))
    said = capsys.readouterr().out
    losses = [float(loss) for loss in re.findall(r"loss ([\d.]+)", said)]
    assert len(losses) == 5
    assert losses[-1] < 0.8 * losses[0]
    scores = re.findall(r"^val IoU, .*: walkable ([\d.]+), sittable ([\d.]+), interactable ([\d.]+)$", said, re.M)
    assert len(scores) == 2
    assert [float(iou) for iou in scores[0]] == pytest.approx([0.5] * 3, abs=0.01)  # half of what holds was seen


def test_it_is_short() -> None:
    source = EXAMPLE.read_text("utf-8")
    scopes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Module | ast.FunctionDef)]
    texts = [scope.body[0] for scope in scopes if ast.get_docstring(scope)]
    told = {number for text in texts for number in range(text.lineno, (text.end_lineno or text.lineno) + 1)}
    lines = [line for number, line in enumerate(source.splitlines(), 1) if line.strip() and number not in told]
    assert len(lines) <= MOST_LINES
