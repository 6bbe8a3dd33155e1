"""``hsbench export --to``, ``verify`` and ``info`` on a small data set, from the command line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import pytest

from hsbench.cli.main import run

OLD = Path(__file__).parents[2] / "fixtures" / "schema-0.2"


@pytest.fixture
def data(tmp_path: Path) -> Path:
    return Path(shutil.copytree(OLD, tmp_path / "data"))


@pytest.mark.parametrize("form", ["coco", "huggingface", "webdataset", "croissant"])
def test_every_form_is_written_once(form: str, data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words, told in (([], "inputs only"), (["--truth"], "with truth")):
        out = tmp_path / f"{form}{len(words)}"
        assert run(["export", str(data), "--to", form, "--out", str(out), *words]) == 0
        assert capsys.readouterr().out == f"{out}: 3 episodes as {form}, {told}\n"
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
