"""A submission with ten different faults gets all ten lines in one run and exit code 3, whatever the task."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.cli.main import run
from hsbench.io.arrays import npz_bytes
from hsbench.tasks import TASKS, TaskSpec, task

OWN: dict[str, tuple[dict[str, np.ndarray], str]] = {
    "scene-completion": ({"occupied": np.array([{}], dtype=object)}, "object array would need pickle"),
    "object-detection-3d": ({"scores": np.array([1.5], np.float32)}, "scores row 0: 1.5; expected 0..1"),
    "action-recognition": ({"action": np.full(7, 9, np.uint8)}, "action row 0: 9, in 7 rows; expected 1 stand"),
}
"""An array of the task with another fault than those of form, and what is said of it."""

BOX = {
    "boxes": np.array([[1, 0, 0.5, 1, 1, 1, 0]], np.float32),
    "scores": np.ones(1, np.float32),
    "category_ids": np.zeros(1, np.uint8),
    "operating_score": np.full(1, 0.5, np.float32),
}


def faulty(spec: TaskSpec, ids: tuple[str, ...], good: dict[str, np.ndarray]) -> dict[str, bytes]:
    """Files of a submission with ten faults."""
    first = next(iter(spec.prediction.arrays))
    metadata = {"task": spec.name, "task_version": "7", "method": "m", "track": "telepathy", "colour": "red"}
    wrong_type = {**good, first: good[first].astype(np.float64)}
    wrong_shape = {**good, first: np.zeros((3, 2, 1, 1), good[first].dtype)}
    files = {
        f"{ids[1]}.npz": npz_bytes(good)[:60],
        f"{ids[2]}.npz": npz_bytes(wrong_type),
        f"{ids[3]}.npz": npz_bytes(wrong_shape),
        f"{ids[5]}.npz": npz_bytes(good),
        f"{ids[5]}@60s.npz": npz_bytes(good),
        "ep-of-another-split.npz": npz_bytes(good),
    }
    files[f"{ids[4]}.npz"] = pickled({**good, **OWN[spec.name][0]})
    return {"submission.json": json.dumps(metadata).encode()} | {f"predictions/{n}": d for n, d in files.items()}


def pickled(arrays: dict[str, np.ndarray]) -> bytes:
    """As numpy writes them: ``npz_bytes`` refuses what needs pickle."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


@pytest.mark.parametrize("name", [name for name, spec in TASKS.items() if "rgbd-activity" in spec.datasets])
def test_ten_faults_ten_lines_exit_code_three(
    name: str, rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec, data = task(name), load(rgbd, frames=False)
    ids = data.episode_ids
    good = BOX if name == "object-detection-3d" else spec.prediction.encode(spec.dummy(data.episode(ids[5])))
    for file, content in faulty(spec, ids, good).items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_bytes(content)
    first = next(iter(spec.prediction.arrays))
    late = "the episode ends after 12 s" if spec.observation_times_s else "no times apart"
    expected = [
        ("submission.json: ", "unknown key 'colour'"),
        ("submission.json: ", "task_version is '7'"),
        ("submission.json: ", "track is 'telepathy'"),
        (f"predictions/{ids[0]}.npz: ", "missing"),
        (f"predictions/{ids[1]}.npz: ", "truncated zip archive"),
        (f"predictions/{ids[2]}.npz: ", f"array '{first}': dtype is float64"),
        (f"predictions/{ids[3]}.npz: ", f"array '{first}': shape is (3, 2, 1, 1)"),
        (f"predictions/{ids[4]}.npz: ", OWN[name][1]),
        (f"'predictions/{ids[5]}@60s.npz': unexpected file", late),
        ("'predictions/ep-of-another-split.npz': unexpected file", "no episode of this split"),
    ]
    for command in ("check", "score"):
        capsys.readouterr()
        assert run([command, str(tmp_path), "--task", name, "--data", str(rgbd)]) == 3
        lines = [line.removeprefix("fault: ").removeprefix("error: ") for line in capsys.readouterr().err.splitlines()]
        assert lines[10:] == ([f"{tmp_path}: 10 faults"] if command == "check" else [])
        for start, words in expected:
            assert [line for line in lines[:10] if line.startswith(start) and words in line], (start, words, lines)
