"""``hsbench import`` from the command line: ids are checked first, and every command says what may follow."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

import click
import cv2
import numpy as np
import pytest

from hsbench import load
from hsbench.cli.import_command import command
from hsbench.cli.main import run
from tests.unit.cli.test_command_line import EVERY
from tests.unit.datasets import test_zind

SOURCES = {"capture": ["timelapse", "gone"], "sscnet": ["gone", "gone"], "sunrgbd-text": ["gone"] * 3}
MORE = {"openpose": ["--size", "9x9"], "nyu-v2": ["--frame", "1"], "coco-keypoints": ["--rate", "5"]}


@pytest.mark.parametrize("name", ["no id", "", ".hidden", "../up", "a" * 101, "ä"])
@pytest.mark.parametrize("word", command.commands)
def test_a_name_is_checked_before_anything_is_read(
    word: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["import", word, *SOURCES.get(word, ["gone"]), *MORE.get(word, []), "--out", "x", "--name", name]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"error: --name is {name!r}; expected 1-100 letters")
    assert list(tmp_path.iterdir()) == []


def film(path: Path, colours: list[int]) -> Path:
    """A folder of grey pictures with a pattern on them."""
    path.mkdir(parents=True)
    pattern = np.random.default_rng(3).integers(0, 40, (48, 64, 3), dtype=np.uint8)
    for k, grey in enumerate(colours):
        cv2.imwrite(str(path / f"{k:03d}.png"), pattern + np.uint8(grey))
    return path


def test_a_file_name_that_is_no_id_asks_for_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = film(tmp_path / "my film", [90, 90, 90])
    words = ["import", "footage", str(source), "--rate", "1", "--out", str(tmp_path / "x")]
    assert run(words) == 2
    assert "the name of what is imported is 'my film'" in (text := capsys.readouterr().err)
    assert text.endswith("give another by --name ID\n")
    assert run([*words, "--name", "film"]) == 0
    *_, following = capsys.readouterr().out.splitlines()
    assert following == f"next: hsbench annotate view LABELS.json --data {tmp_path / 'x'} --episode film"
    parsed(following)


def test_one_home_is_one_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = test_zind.write(tmp_path / "0001", test_zind.home(test_zind.entry("pano_1"), test_zind.entry("pano_2")))
    shutil.copyfile(found.parent / "panos" / "pano_1.jpg", found.parent / "panos" / "pano_2.jpg")
    for home in ("0001", "0002"):
        assert run(["import", "zind", str(found), "--out", str(tmp_path / "x"), "--name", home]) == 0
        assert capsys.readouterr().out.splitlines()[-1] == f"next: hsbench verify {tmp_path / 'x'}"
    data = load(tmp_path / "x", truth=True)
    assert data.episode_ids == ("0001-pano_1", "0001-pano_2", "0002-pano_1", "0002-pano_2")
    assert data.scene_ids == ("0001", "0001", "0002", "0002")
    assert [episode.truth.scene.scene_id for episode in data] == list(data.scene_ids)
    assert run(["verify", str(tmp_path / "x")]) == 0


def parsed(following: str) -> click.Context:
    """A ``next:`` line is a command that parses."""
    words = shlex.split(following.removeprefix("next: hsbench "))
    called = max((w for w in EVERY if tuple(words[: len(w)]) == w), key=len)
    context = click.Context(EVERY[called])
    EVERY[called].parse_args(context, words[len(called) :])
    return context
