"""The scripts of docs/schema.md that open a data set give what the loaders give; one of them knows no hsbench."""

from __future__ import annotations

import ast
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.io.dataset_index import unit_folders
from hsbench.io.frame_store import Recording

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"


def run(monkeypatch: pytest.MonkeyPatch, name: str, *arguments: str) -> dict[str, object]:
    monkeypatch.setattr(sys, "argv", [name, *arguments])
    return runpy.run_path(str(EXAMPLES / name))


def test_read_without_hsbench(rgbd: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    unit = unit_folders(rgbd)[0]
    episode, recording = load(rgbd, truth=True).episode(unit.name), Recording(unit / "recording")
    changed = 0
    for frame in range(0, len(recording.timestamps_ns), 3):
        found = run(monkeypatch, "read_without_hsbench.py", str(unit), str(frame))
        picture = recording.picture(frame)
        assert np.array_equal(found["rgb"], picture.rgb)
        assert np.array_equal(found["depth_mm"], picture.depth_mm)
        changed += not np.array_equal(picture.depth_mm, recording.background.depth_mm)
    assert changed
    assert np.array_equal(found["joints_m"], episode.poses.joints_m, equal_nan=True)
    assert np.array_equal(found["solid"], episode.truth.occupancy.solid)
    assert "observed poses" in capsys.readouterr().out


def test_it_needs_no_hsbench_and_is_short() -> None:
    tree = ast.parse((EXAMPLES / "read_without_hsbench.py").read_text("utf-8"))
    imports = [n for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom)]
    names = {(n.module if isinstance(n, ast.ImportFrom) else n.names[0].name).partition(".")[0] for n in imports}
    assert names == {"json", "sys", "pathlib", "numpy", "pandas", "pyarrow", "PIL"}
    assert sum(isinstance(n, ast.Assign) for n in tree.body) == 15


def test_read_with_hsbench(rgbd: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    run(monkeypatch, "read_with_hsbench.py", str(rgbd))
    assert "solid voxels" in capsys.readouterr().out
