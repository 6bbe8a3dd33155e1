"""Generating that is killed again and again, and that goes on for long."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import hsbench
from hsbench.io.checksums import manifest
from hsbench.io.dataset_index import verify_files
from hsbench.synth.executors import Processes
from hsbench.synth.generate import generate, make_units
from tests.unit.synth.toy_recipe import toy_job, write_toy

ROOT = Path(hsbench.__file__).parents[1]
KILLS = 20
WORKERS = 2


@pytest.mark.slow
def test_twenty_kills_at_random_moments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bytes of an unbroken run, and a kill costs each worker the unit under way at most."""
    recipe, out, log = write_toy(tmp_path, settings="lasts_s = 0.3\n"), tmp_path / "out", tmp_path / "log"
    words = ["generate", str(recipe), "--size", "full", "--split", "train", "--episodes", ":80", "--frames", "none"]
    command = [sys.executable, "-m", "hsbench.cli.main", *words, "--workers", str(WORKERS), "--out", str(out)]
    monkeypatch.setenv("TOY_LOG", str(log))
    rng = random.Random(0)
    landed = 0
    while landed < KILLS:
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, start_new_session=True)
        begun = _lines(log)
        while _lines(log) == begun and process.poll() is None:  # random among the moments at which it works
            time.sleep(0.01)
        time.sleep(rng.uniform(0.0, 0.9))
        assert process.poll() is None, "it was done before twenty kills"
        if landed % 2:
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)  # its workers with it
        process.wait()
        landed += 1
    subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
    monkeypatch.delenv("TOY_LOG")
    list(generate(toy_job(recipe, 80), tmp_path / "unbroken"))
    assert manifest(out) == manifest(tmp_path / "unbroken")
    assert verify_files(out) == []
    assert len(list((out / "episodes").iterdir())) == 80
    assert _lines(log) <= 80 + KILLS * WORKERS


@pytest.mark.slow
def test_memory_does_not_grow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Less than 5 % from the 50th to the 500th unit of one process that is never replaced."""
    log = tmp_path / "log"
    monkeypatch.setenv("TOY_LOG", str(log))
    recipe = write_toy(tmp_path)
    for made in make_units(toy_job(recipe, 500), tmp_path / "out", Processes(1, recycled_after=1000)):
        assert made.error is None
    resident_kb = [int(line.split()[1]) for line in log.read_text().splitlines()]
    assert len(resident_kb) == 500
    assert resident_kb[-1] < 1.05 * resident_kb[49]


def _lines(log: Path) -> int:
    return len(log.read_text().splitlines()) if log.exists() else 0
