"""``hsbench task template``: a valid submission to start from, for every task of a data set."""

from __future__ import annotations

import json
import shlex
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from hsbench.cli.main import run
from hsbench.evaluation.report import read_report
from hsbench.evaluation.scorers import metrics_of
from hsbench.io.resources import resource
from hsbench.io.strict_json import read_json
from hsbench.synth.timelapse import TimelapseSettings
from hsbench.tasks import TASKS
from hsbench.tasks.spec import NOISE_PRESETS

OF_RGBD = [name for name, spec in TASKS.items() if "rgbd-activity" in spec.datasets]


@pytest.mark.parametrize("name", OF_RGBD)
def test_a_template_is_checked_and_scores_nothing(name: str, rgbd: Path, tmp_path: Path) -> None:
    out, report = tmp_path / "template", tmp_path / "report.json"
    data = ["--data", str(rgbd), "--split", "val"]
    assert run(["task", "template", name, *data, "--out", str(out)]) == 0
    assert run(["check", str(out), "--task", name, *data]) == 0
    assert run(["score", str(out), "--task", name, *data, "--out", str(report)]) == 0
    assert read_report(report).primary.value == 0.0
    assert run(["task", "template", name, *data, "--out", str(out)]) == 2  # it is there
    assert run(["task", "template", name, *data, "--out", str(out), "--replace"]) == 0


def test_a_template_with_times_gives_a_curve_and_all_files_beside_the_report(
    rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, report = tmp_path / "template", tmp_path / "report.json"
    data = ["--data", str(rgbd), "--split", "val"]
    assert run(["task", "template", "scene-completion", *data, "--out", str(out), "--times"]) == 0
    names = sorted(file.name for file in (out / "predictions").iterdir())
    assert len(names) == 4  # 12 s an episode: after 5 s, and whole
    assert names[1].removesuffix("@5s.npz") == names[0].removesuffix(".npz")
    score = ["score", str(out), "--task", "scene-completion", *data, "--out"]
    capsys.readouterr()
    assert run([*score, str(report)]) == 0
    shown = capsys.readouterr().out
    assert [line.split()[:2] for line in shown.splitlines() if line.startswith(("  5 s", "  12 s", "  area"))] == [
        ["5", "s"],
        ["12", "s"],
        ["area", "over"],
    ]
    assert [moment.observed_s for moment in read_report(report).curve.moments] == [5.0]
    beside = {file: file.read_bytes() for file in (report.with_suffix(".parquet"), report.with_suffix(".html"))}
    assert beside[report.with_suffix(".html")].startswith(b"<!doctype html>")
    assert run([*score, str(report)]) == 0  # a report is replaced, with what is beside it, by the same bytes
    assert beside == {file: file.read_bytes() for file in beside}
    report.unlink()
    assert run([*score, str(report)]) == 2
    assert run([*score, str(tmp_path / "page.html")]) == 2
    assert beside == {file: file.read_bytes() for file in beside}


def test_labels_of_another_number_of_poses_are_a_fault(
    rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The check reads inputs, which need no truth, and exits as for any other fault."""
    data = ["--data", str(rgbd), "--split", "val"]
    assert run(["task", "template", "action-recognition", *data, "--out", str(tmp_path / "t")]) == 0
    file = sorted((tmp_path / "t" / "predictions").iterdir())[0]
    np.savez(file, action=np.ones(7, np.uint8))
    capsys.readouterr()
    for command in ("check", "score"):
        assert run([command, str(tmp_path / "t"), "--task", "action-recognition", *data]) == 3
        assert f"predictions/{file.name}: array 'action' has 7 labels; expected " in capsys.readouterr().err


@pytest.mark.parametrize("name", TASKS)
def test_show_tells_every_metric(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["task", "show", name, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["metrics"] == list(metrics_of(name))
    assert shown["primary_metric"].split()[0] in shown["metrics"]
    assert shown["datasets"] == list(TASKS[name].datasets)
    times = shown["observation_times_s"]
    assert sorted(times) == sorted(shown["datasets"] if TASKS[name].observation_times_s else ())
    assert all(tuple(times[data]) == TASKS[name].on(data).observation_times_s for data in times)
    for data in shown["datasets"]:
        assert shown["splits"][data] == read_json(resource("splits") / data / "v0.json")["sizes"]["full"]
    assert "z up" in shown["frame"]
    assert shown["example"].startswith(f"hsbench task template {name} ")


@pytest.mark.parametrize("name", TASKS)
def test_show_speaks_to_people(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Everything but what the task has none of, in words."""
    assert run(["task", "show", name, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert run(["task", "show", name]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sorted(line.split(":")[0] for line in lines) == sorted(key for key, value in facts.items() if value)
    assert not [line for line in lines if "{" in line or "None" in line]


def test_the_noise_is_that_of_the_recipes(capsys: pytest.CaptureFixture[str]) -> None:
    names = {data for spec in TASKS.values() for data in spec.datasets}
    assert names == set(NOISE_PRESETS)
    for name, presets in NOISE_PRESETS.items():
        config = tomllib.loads((resource("generators") / name / "config.toml").read_text(encoding="utf-8"))
        made = {"poses": config["poses"]["preset"]}
        if depth := config.get("recording", {}).get("depth_noise"):
            made["depth"] = depth
        if "timelapse" in config:
            made["pictures"] = TimelapseSettings.of(config, "train").timelapse.image_noise
        assert presets == made


def test_an_unknown_task_has_no_template(rgbd: Path, tmp_path: Path) -> None:
    assert run(["task", "template", "completion", "--data", str(rgbd), "--out", str(tmp_path / "x")]) == 2
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("name", [name for name in TASKS if name not in OF_RGBD])
def test_data_of_another_task_are_refused(
    name: str, rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An answer to another question would get a number all the same."""
    calls = (["task", "template", name], ["check", "x", "--task", name], ["score", "x", "--task", name])
    for words in calls:
        out = ["--out", str(tmp_path / "out")] if words[0] == "task" else []
        assert run([*words, "--data", str(rgbd), *out]) == 2
        assert f"task {name} is scored on {' or '.join(TASKS[name].datasets)}; rgbd-activity" in capsys.readouterr().err


def test_own_data_are_scored_and_have_no_board(rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = tmp_path / "my rooms"
    shutil.copytree(rgbd, own)
    description = json.loads((own / "dataset.json").read_text())
    (own / "dataset.json").write_text(json.dumps({**description, "name": "my-rooms"}))
    out = str(tmp_path / "a template")
    assert run(["task", "template", "scene-completion", "--data", str(own), "--out", out]) == 0
    told = capsys.readouterr()
    assert "note: my-rooms is data of one's own: boards of scene-completion take rgbd-activity" in told.err
    (hint,) = (line.removeprefix("next: hsbench ") for line in told.out.splitlines() if line.startswith("next: "))
    assert run(shlex.split(hint)) == 0  # quoted: both paths have a space
    assert run(["score", out, "--task", "scene-completion", "--data", str(own), "--out", str(tmp_path / "r")]) == 0
    told = capsys.readouterr()
    assert "board add" not in told.out
    assert "next: hsbench compare" in told.out


def test_tables_are_printed_and_written(rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, report = tmp_path / "template", tmp_path / "report.json"
    data = ["--data", str(rgbd), "--split", "val"]
    assert run(["task", "template", "scene-completion", *data, "--out", str(out)]) == 0
    assert run(["score", str(out), "--task", "scene-completion", *data, "--out", str(report)]) == 0
    capsys.readouterr()
    assert run(["tables", str(report), "--data", str(rgbd), "--csv", str(tmp_path / "csv")]) == 0
    shown = capsys.readouterr().out
    assert "| template | poses |  |  |  |  | 0.000 | 0.000 |" in shown
    assert "| rgbd-activity | val | 2 | 2 |" in shown
    written = sorted(file.name for file in (tmp_path / "csv").iterdir())
    assert len(written) == 11
    assert (tmp_path / "csv" / "table-3.2.csv").read_text().splitlines()[1] == "template,poses,,,,,0.0,0.0"
    assert run(["tables", str(tmp_path / "none.json")]) == 2
