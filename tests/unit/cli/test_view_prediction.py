"""``hsbench view --prediction``: a picture and a page of an episode's answer, and one line where there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.cli.main import run
from hsbench.submission import Metadata, write_submission
from hsbench.tasks import task
from hsbench.tasks.object_detection import Boxes
from hsbench.tasks.scene_completion import GRID

ANSWERS = {
    "scene-completion": np.ones(GRID.shape, dtype=bool),
    "object-detection-3d": Boxes.of(np.array([[2, 0, 0.5, 1, 1, 1, 0.3]]), np.array([0.9])),
}


def submission(folder: Path, task_name: str, episode_ids: tuple[str, ...]) -> Path:
    spec = task(task_name)
    metadata = Metadata(task_name, spec.version, "mine", "poses")
    write_submission(folder, spec, metadata, ((e, ANSWERS[task_name]) for e in episode_ids))
    return folder


@pytest.mark.parametrize("task_name", ["scene-completion", "object-detection-3d"])
def test_a_picture_and_a_page_of_the_first_episode_with_an_answer(
    rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], task_name: str
) -> None:
    last = load(rgbd).episode_ids[-1]
    made = submission(tmp_path / "made", task_name, (last,))
    assert run(["view", str(rgbd), "--prediction", str(made), "--out", str(tmp_path / "out")]) == 0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [f"{last}-prediction.{e}" for e in ("html", "png")]
    assert "mine on " + task_name in capsys.readouterr().out
    folder = rgbd / "episodes" / last
    again = tmp_path / "again"
    assert run(["view", str(folder), "--prediction", str(made), "--out", str(again)]) == 0
    for name in (f"{last}-prediction.png", f"{last}-prediction.html"):
        assert (again / name).read_bytes() == (tmp_path / "out" / name).read_bytes()


def test_what_cannot_be_drawn_is_said_in_one_line(
    rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ids = load(rgbd).episode_ids
    made = submission(tmp_path / "made", "scene-completion", ids[-1:])
    other = tmp_path / "other"
    other.mkdir()
    (other / "submission.json").write_text('{"task": "action-recognition", "task_version": "0"}')
    nothing = submission(tmp_path / "nothing", "scene-completion", ("elsewhere-000000",))
    view = ["view", str(rgbd), "--out", str(tmp_path / "out"), "--prediction"]
    cases = (
        ([*view, str(made), "--episode", ids[0]], f"no prediction of {ids[0]}"),
        ([*view, str(nothing)], "no prediction of any episode"),
        ([*view, str(other)], "is of task 'action-recognition'; view --prediction draws scene-completion and"),
        ([*view, str(made), "--clip", "none"], "--clip is of frames"),
        ([*view, str(tmp_path / "absent")], "absent"),
    )
    for words, expected in cases:
        assert run(words) != 0
        said = capsys.readouterr().err.strip().splitlines()
        assert expected in said[-1]
        assert "Traceback" not in "".join(said)
    assert not (tmp_path / "out").exists()
