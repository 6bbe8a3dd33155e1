"""Nothing of the user's is lost: what may be replaced, who may write, what a stop leaves behind."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hsbench.cli.main import run
from hsbench.errors import DataError
from hsbench.io.checksums import manifest
from hsbench.io.locks import LOCK_FILE, sole_writer

ALL_SOLID = ("predict", "all-solid", "--split", "val")


@pytest.mark.parametrize("inside", [".", "episodes", ".."])
def test_replace_never_takes_a_data_set_or_what_holds_it(rgbd_copy: Path, inside: str) -> None:
    before = manifest(rgbd_copy)
    target = rgbd_copy / inside
    assert run([*ALL_SOLID, "--data", str(rgbd_copy), "--out", str(target), "--replace"]) == 2
    assert manifest(rgbd_copy) == before


def test_replace_takes_a_submission_but_nothing_beside_it(rgbd: Path, tmp_path: Path) -> None:
    out = tmp_path / "pred"
    arguments = [*ALL_SOLID, "--data", str(rgbd), "--out", str(out)]
    assert run(arguments) == 0
    assert run(arguments) == 2
    assert run([*arguments, "--replace"]) == 0
    (out / "thesis.tex").write_text("years of work")
    assert run([*arguments, "--replace"]) == 2
    assert (out / "thesis.tex").read_text() == "years of work"


def test_a_report_is_written_over_reports_only(rgbd_copy: Path, tmp_path: Path) -> None:
    out = tmp_path / "pred"
    assert run([*ALL_SOLID, "--data", str(rgbd_copy), "--out", str(out)]) == 0
    scoring = ["score", str(out), "--task", "scene-completion", "--data", str(rgbd_copy), "--split", "val", "--out"]
    report = tmp_path / "report.json"
    assert run([*scoring, str(report)]) == 0
    assert run([*scoring, str(report)]) == 0
    description = rgbd_copy / "dataset.json"
    before = description.read_bytes()
    assert run([*scoring, str(description)]) == 2
    assert description.read_bytes() == before


def test_truth_that_was_touched_is_not_scored(
    rgbd_copy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "pred"
    assert run([*ALL_SOLID, "--data", str(rgbd_copy), "--out", str(out)]) == 0
    events = next((rgbd_copy / "episodes").glob("*-010000")) / "truth" / "events.parquet"
    data = bytearray(events.read_bytes())
    data[len(data) // 2] ^= 1
    events.write_bytes(bytes(data))
    assert run(["score", str(out), "--task", "scene-completion", "--data", str(rgbd_copy), "--split", "val"]) == 2
    assert "events.parquet has changed" in capsys.readouterr().err


def test_the_demo_refuses_a_folder_with_other_things(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    assert run(["demo", "--out", str(tmp_path)]) == 2
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_data_set_is_no_submission(rgbd: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(rgbd), "--task", "scene-completion", "--data", str(rgbd)]) == 3
    assert "is a data set, not a submission" in capsys.readouterr().err


def test_one_writer_at_a_time(tmp_path: Path) -> None:
    with sole_writer(tmp_path), pytest.raises(DataError, match="another run is writing"), sole_writer(tmp_path):
        pass
    with sole_writer(tmp_path):
        pass
    assert not (tmp_path / LOCK_FILE).exists()


def _start(words: list[str]) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "hsbench.cli.main", *words, "--workers", "2"]
    return subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True)


def _wait_for_units(out: Path, count: int) -> None:
    deadline = time.monotonic() + 120
    while len(list((out / "episodes").glob("rgbd-*"))) < count:
        assert time.monotonic() < deadline, "no episode was made"
        time.sleep(0.05)


def _processes_of(session: int) -> list[str]:
    """The processes of a session that are not zombies."""
    listed = subprocess.run(["ps", "-eo", "sid,pid,stat"], capture_output=True, text=True, check=True).stdout
    return [line for line in listed.splitlines() if line.split()[0] == str(session) and "Z" not in line.split()[2]]


@pytest.mark.skipif(shutil.which("ps") is None, reason="needs ps")
@pytest.mark.parametrize(
    "how", [signal.SIGINT, *(pytest.param(how, marks=pytest.mark.slow) for how in (signal.SIGTERM, signal.SIGKILL))]
)
def test_a_stopped_run_leaves_no_worker_and_goes_on_later(
    short_recipe: Path, tmp_path: Path, how: signal.Signals
) -> None:
    out = tmp_path / "data"
    words = ["generate", str(short_recipe), "--size", "full", "--frames", "reference", "--renderer", "raycast"]
    words += ["--out", str(out)]
    process = _start(words)
    _wait_for_units(out, 1)
    os.kill(process.pid, how)
    process.communicate(timeout=60)
    assert process.returncode == (130 if how == signal.SIGINT else -how)
    deadline = time.monotonic() + 30
    while _processes_of(process.pid):
        assert time.monotonic() < deadline, "workers outlive their parent"
        time.sleep(0.1)
    made = {p.name for p in (out / "episodes").glob("rgbd-*")}
    assert run([*words, "--episodes", f":{len(made) + 2}"]) == 0
    assert not list((out / "episodes").glob(".*.part"))
    assert json.loads((out / "manifest.json").read_text())
