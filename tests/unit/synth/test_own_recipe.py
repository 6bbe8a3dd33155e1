"""The tutorial's recipe, run as the tutorial says, from a folder outside of the repository."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import hsbench
from hsbench import load
from hsbench.cli.main import run
from hsbench.datasets.verify import verify_episode

EXAMPLE = Path(hsbench.__file__).parents[1] / "docs" / "examples" / "dining-duo"
MOST_LINES = 60


def test_it_is_as_short_as_it_says() -> None:
    files = [EXAMPLE / name for name in ("dining-duo.py", "config.toml")]
    assert sum(len(file.read_text().splitlines()) for file in files) <= MOST_LINES


@pytest.mark.slow
def test_the_tutorial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(EXAMPLE, tmp_path / "dining-duo", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.chdir(tmp_path)
    assert run(["generate", "./dining-duo", "--frames", "reference", "--renderer", "raycast", "--out", "data"]) == 0
    assert "data: 3 scenes (3 episodes made now)" in capsys.readouterr().out
    assert run(["verify", "data"]) == 0
    assert run(["verify", "data", "--against-recipe", "1", "--recipe", "./dining-duo"]) == 0
    data = load("data", truth=True)
    assert data.description["name"] == "dining-duo"
    for row, episode in zip(data.rows, data, strict=True):
        assert verify_episode(episode) == []
        assert {room.room_type for room in episode.truth.scene.rooms} == {"dining"}
        assert set(episode.truth.poses.poses.track_id.tolist()) <= {1, 2}
        assert row["duration_s"] == 60.0
    (unit,) = load("data", "test-novel")
    assert unit.episode_id == "dining-duo-012000"
