"""``hsbench predict``: the list by task, and a name that several tasks have."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

import pytest

from hsbench.baselines.registry import METHODS
from hsbench.cli.main import run
from hsbench.io.checksums import manifest
from hsbench.tasks import TASKS


def said(capsys: pytest.CaptureFixture[str], *arguments: object, code: int = 0) -> str:
    assert run([str(a) for a in arguments]) == code
    shown = capsys.readouterr()
    return shown.err if code else shown.out


def test_methods_are_listed_task_after_task_with_their_tracks_and_controls(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [row.split(maxsplit=3) for row in said(capsys, "predict", "--list").splitlines()]
    assert [(name, task, track) for name, task, track, _ in rows] == [
        (m.name, name, m.track) for name, methods in METHODS.items() for m in methods.values()
    ]
    assert [task for task, _ in groupby(row[1] for row in rows)] == list(TASKS)
    for control in ("no-activity", "shuffled-activity", "best-constant"):
        assert {row[1] for row in rows if row[3].endswith(f"(control {control})")} == set(TASKS)
    only = said(capsys, "predict", "--list", "--task", "affordance-view").splitlines()
    assert [row.split()[1] for row in only] == ["affordance-view"] * len(METHODS["affordance-view"])


def test_a_name_of_several_tasks_needs_the_task(rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ("--data", rgbd, "--split", "val", "--out", tmp_path / "p")
    line = said(capsys, "predict", "best-constant", *asked, code=2)
    assert "of several tasks: scene-completion, object-detection-3d, action-recognition; name one with --task" in line
    assert not (tmp_path / "p").exists()
    text = said(capsys, "predict", "best-constant", "--task", "action-recognition", *asked)
    assert "2 predictions of best-constant" in text
    assert "next: hsbench check" in text
    assert "--task action-recognition" in text
    assert "no faults" in said(capsys, "check", tmp_path / "p", "--task", "action-recognition", *asked[:4])
    assert "method 'traces' is unknown; expected one of cuboids" in said(
        capsys, "predict", "traces", "--task", "object-detection-3d", *asked[:4], "--out", tmp_path / "q", code=2
    )


@pytest.mark.parametrize(
    ("task", "method"), [("scene-completion", "height-prior"), ("affordance-topdown", "traces-shuffled")]
)
def test_the_bytes_do_not_depend_on_workers(
    rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], task: str, method: str
) -> None:
    """Of a method that is fitted, and of one that draws and takes other episodes."""
    asked = ("predict", method, "--task", task, "--data", rgbd)
    for workers in (1, 2):
        said(capsys, *asked, "--workers", workers, "--out", tmp_path / f"by-{workers}")
    assert manifest(tmp_path / "by-1") == manifest(tmp_path / "by-2")
    assert len(manifest(tmp_path / "by-1")) > 2


def test_a_failure_in_a_process_leaves_nothing(
    rgbd_copy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As in one: the same line, and no folder."""
    out, episode = tmp_path / "out", sorted((rgbd_copy / "episodes").iterdir())[1]
    (episode / "episode.json").write_bytes(b"")
    asked = ("predict", "carve", "--data", rgbd_copy, "--out", out)
    lines = {said(capsys, *asked, "--workers", workers, code=2) for workers in (1, 2)}
    assert len(lines) == 1
    assert episode.name in lines.pop()
    assert not out.exists()
