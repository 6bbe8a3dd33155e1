"""``hsbench export --to``, ``verify`` and ``info`` on a small data set, from the command line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from hsbench.cli.main import run
from hsbench.datasets.importers.capture_set import add_capture
from hsbench.io.atomic import write_json
from hsbench.schema import Episode
from hsbench.schema.episode import Frame, FrameList
from tests.unit.episode_builders import SENSORS

OLD = Path(__file__).parents[2] / "fixtures" / "schema-0.2"


@pytest.fixture
def data(tmp_path: Path) -> Path:
    return Path(shutil.copytree(OLD, tmp_path / "data"))


@pytest.mark.parametrize("form", ["coco", "huggingface", "webdataset", "croissant"])
def test_every_form_is_written_once(form: str, data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words, told in (([], "inputs only"), (["--truth"], "with truth")):
        out = tmp_path / f"{form}{len(words)}"
        assert run(["export", str(data), "--to", form, "--out", str(out), *words]) == 0
        first, following = capsys.readouterr().out.splitlines()
        assert first == f"{out}: 3 episodes as {form}, {told}"
        assert following.startswith("next: ")
        assert str(out) in following
        assert run(["export", str(data), "--to", form, "--out", str(out), *words]) == 2
        assert "exists already" in capsys.readouterr().err


def test_one_episode_of_a_split(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["export", str(data), "--to", "glb", "--truth", "--split", "val", "--episode", "film-1"]
    assert run([*words, "--out", str(tmp_path / "a")]) == 0
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["film-1.glb"]
    assert "1 episodes as glb" in capsys.readouterr().out
    assert run([*words[:-1], "other", "--out", str(tmp_path / "b")]) == 2
    assert "has no episode 'other' among 3" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--to", "coco"], "needs --out DIR"),
        (["--to", "coco", "--out", "x", "--glb", "y"], "--to takes a data set"),
        (["--truth"], "go with --to"),
        (["--out", "x"], "go with --to"),
        (["--to", "glb", "--out", "x"], "give --truth"),
        (["--to", "croissant", "--split", "val", "--out", "x"], "a whole data set"),
        (["--to", "coco", "--split", "train", "--out", "x"], "no episode of split 'train'"),
        ([], "nothing to write"),
    ],
)
def test_mistakes(words: list[str], message: str, data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", str(data), *words]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.filterwarnings("always::UserWarning")
def test_pictures_without_an_annotation_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = tmp_path / "data"
    frames = FrameList((Frame(0, rgb=np.zeros((18, 24, 3), np.uint8)),))
    add_capture(data, Episode("camera", "camera", SENSORS["monocular"], frames, None, 0, 0))
    assert run(["export", str(data), "--to", "coco", "--out", str(tmp_path / "coco")]) == 0
    assert "note: no picture has an annotation" in capsys.readouterr().err
    assert not json.loads((tmp_path / "coco/annotations/person_keypoints_unsplit.json").read_text())["annotations"]


@pytest.mark.parametrize(
    "words",
    [
        ["export", "{data}", "--to", "huggingface", "--out", "{data}/hf"],
        ["export", "{data}", "--to", "glb", "--truth", "--split", "val", "--out", "{data}/episodes/film-1/glb"],
        ["export", "{data}", "--episode", "film-1", "--plan", "{data}/plan.svg"],
        ["info", "{data}", "--pictures", "{data}/sheet.png"],
        ["task", "template", "affordance-topdown", "--data", "{data}", "--out", "{data}/pred"],
    ],
)
def test_nothing_is_written_into_a_data_set(words: list[str], data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(data.rglob("*"))
    assert run([word.format(data=data) for word in words]) == 2
    assert f"lies inside of the data set {data}" in capsys.readouterr().err
    assert sorted(data.rglob("*")) == before


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["export", "{data}", "--episode", "film-1", "--plan"], "plan.svg"),
        (["export", "{data}", "--episode", "film-1", "--json"], "room.json"),
        (["export", "{data}", "--episode", "film-1", "--glb"], "room.glb"),
        (["info", "{data}", "--pictures"], "sheet.png"),
    ],
)
def test_no_file_is_written_over(
    words: list[str], name: str, data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text("mine")
    assert run([*(word.format(data=data) for word in words), str(tmp_path / name)]) == 2
    assert f"{words[-1]} {tmp_path / name}: exists already" in capsys.readouterr().err
    assert (tmp_path / name).read_text() == "mine"


def test_info_refuses_a_schema_that_loading_does_not_know(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    description = json.loads((data / "dataset.json").read_text())
    write_json(data / "dataset.json", {**description, "schema_version": "9.9"})
    assert run(["info", str(data)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "dataset.json: schema_version is '9.9'" in line
    assert "upgrade hsbench" in line


def test_verify_says_what_repairs(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (data / "episodes" / "s-1" / "note").write_text("x")
    (data / "episodes" / "m-1" / "truth" / "affordance.npz").unlink()
    assert run(["verify", str(data)]) == 2
    shown = capsys.readouterr()
    assert "fault: episodes/m-1/truth/affordance.npz: missing" in shown.err.splitlines()
    assert f"repair: remove {data}/episodes/s-1/note, or keep it elsewhere" in shown.out.splitlines()
    assert f"repair: remove {data}/episodes/m-1, and import it again" in shown.out.splitlines()
    assert run(["verify", str(data), "--json"]) == 2
    found = json.loads(capsys.readouterr().out)
    assert found["episodes"] == 3
    assert f"remove {data}/episodes/m-1, and import it again" in found["repairs"]


def test_info_counts_and_draws(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = tmp_path / "sheet.png"
    assert run(["info", str(data), "--classes", "--pictures", str(sheet)]) == 0
    text = capsys.readouterr().out
    for words in (
        "schema_version 0.2",
        "people: 2 in 3 episodes",
        "dining_table 2",
        "affordance of labelled cells from above",
        str(sheet),
    ):
        assert words in text
    assert cv2.imread(str(sheet)).shape[0] > 300
    assert run(["info", str(data), "--classes", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["classes"]["objects"] == {"wall": 2, "dining_table": 2, "object": 2}
    assert found["splits"]["val"]["bytes_on_disk"]["pictures"] > 0
    assert run(["info", str(data), "--pictures", str(tmp_path / "sheet.gif")]) == 2
    assert "ends in .png" in capsys.readouterr().err
