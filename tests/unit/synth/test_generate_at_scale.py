"""Generating with shards, broken recipes, full disks and kills: the same bytes, clear words, nothing half there."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

import hsbench
from hsbench.cli.main import run
from hsbench.errors import DataError
from hsbench.io.checksums import manifest
from hsbench.io.dataset_index import verify_files
from hsbench.io.resources import resource
from hsbench.synth.cost import Cost, lasting, require_room, sized, unit_cost
from hsbench.synth.generate import generate
from hsbench.synth.merge import merge
from hsbench.synth.recipes import find_recipe
from tests.unit.synth.toy_recipe import toy_job, write_toy

ROOT = Path(hsbench.__file__).parents[1]
SMALL = ("--size", "small", "--frames", "none")
FAULTS = """\
    if number == 1:
        raise ValueError("odd")
    if number == 3:
        sys.exit(7)
    if number == 5:
        while True:
            time.sleep(0.01)
    if number == 7:
        np.ones(10**10)
    if number == 9:
        os._exit(1)
"""
BAD = (1, 3, 5, 7, 9)
TIMEOUT_S = 15.0  # a busy machine takes seconds to begin


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    return write_toy(tmp_path / "recipe")


@pytest.fixture
def whole(recipe: Path, tmp_path: Path) -> dict[str, str]:
    """The manifest of size small, made in one run by one process."""
    assert run(["generate", str(recipe), *SMALL, "--out", str(tmp_path / "whole")]) == 0
    return manifest(tmp_path / "whole")


def command(recipe: Path, out: Path, *options: object) -> list[str]:
    words = ("generate", recipe, *SMALL, "--out", out, *options)
    return [sys.executable, "-m", "hsbench.cli.main", *(str(word) for word in words)]


@pytest.mark.parametrize("workers", [2, 4])
def test_workers_leave_no_trace(recipe: Path, whole: dict[str, str], tmp_path: Path, workers: int) -> None:
    assert run(["generate", str(recipe), *SMALL, "--workers", str(workers), "--out", str(tmp_path / "out")]) == 0
    assert manifest(tmp_path / "out") == whole


# ---------------------------------------------------------------- shards


def test_shards_merged_are_the_bytes_of_one_run(
    recipe: Path, whole: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parts = [tmp_path / f"part-{k}" for k in (1, 2, 3)]
    for k, part in enumerate(parts, start=1):
        assert run(["generate", str(recipe), *SMALL, "--shard", f"{k}/3", "--out", str(part)]) == 0
        assert len(list((part / "episodes").iterdir())) == 10
    assert "next: hsbench merge" in capsys.readouterr().out
    out = tmp_path / "merged"
    assert run(["merge", *map(str, parts[:2]), "--out", str(out)]) == 0
    assert run(["merge", str(parts[2]), "--out", str(out)]) == 0
    assert manifest(out) == whole
    assert verify_files(out) == []
    assert run(["generate", str(recipe), *SMALL, "--out", str(out)]) == 0
    assert "(0 episodes made now)" in capsys.readouterr().out
    for part in parts:
        assert verify_files(part) == []


@pytest.mark.parametrize("text", ["0/2", "3/2", "1", "1/0", "-1/2", "1/2/3", "a/b", ""])
def test_what_is_no_shard(recipe: Path, tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["generate", str(recipe), "--shard", text, "--out", str(tmp_path / "o")]) == 2
    assert "expected I/N with I from 1 to N" in capsys.readouterr().err


def test_only_parts_of_one_data_set_are_merged(recipe: Path, tmp_path: Path) -> None:
    first, out = tmp_path / "first", tmp_path / "out"
    list(generate(toy_job(recipe, 2), first))

    other = write_toy(tmp_path / "other", settings="poses = 201\n")
    list(generate(toy_job(other, 2), tmp_path / "b"))
    with pytest.raises(DataError, match="different data sets: recipe_sha256 is"):
        list(merge([first, tmp_path / "b"], out))

    touched = Path(shutil.copytree(first, tmp_path / "c"))
    unit = touched / "episodes" / "toy-000001" / "manifest.json"
    unit.write_text(unit.read_text() + " ")
    with pytest.raises(DataError, match="hold different episodes of one name"):
        list(merge([first, touched], out))

    (touched / "manifest.json").unlink()
    with pytest.raises(DataError, match="c is not finished"):
        list(merge([first, touched], out))
    with pytest.raises(DataError, match=r"holds no dataset\.json"):
        list(merge([tmp_path], out))
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("years of work")
    with pytest.raises(DataError, match="is not empty"):
        list(merge([first], tmp_path / "mine"))
    with pytest.raises(DataError, match="lies inside of the data set"):
        list(merge([first], first / "whole"))
    assert not out.exists()
    assert verify_files(first) == []


# ---------------------------------------------------------------- broken recipes


@pytest.mark.slow
def test_each_fault_is_named_and_costs_its_unit(
    tmp_path: Path, whole: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    """An exception, sys.exit, an endless loop, a huge allocation and a death; all else is made as ever."""
    recipe, out = write_toy(tmp_path / "bad", FAULTS), tmp_path / "out"
    words = ["generate", str(recipe), *SMALL, "--out", str(out), "--workers", "2", "--verbose"]
    words += ["--unit-timeout", f"{TIMEOUT_S:g}", "--memory", "4"]
    capsys.readouterr()
    try:
        code: object = run(words)
    except (RuntimeError, DataError) as error:  # the first to fail decides of which kind
        code = str(error)
    assert code != 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("failed")]
    reasons = (
        "ValueError: odd",
        "SystemExit: 7",
        f"took longer than {TIMEOUT_S:g} s",
        "MemoryError",
        "its process died",
    )
    for number, reason in zip(BAD, reasons, strict=True):
        (line,) = (line for line in lines if f"recipe toy, seed 0, scene number {number}: " in line)
        assert reason in line
    bad = {f"toy-{number:06d}" for number in BAD}
    units = {name.split("/")[1] for name in whole if name.startswith("episodes/")}
    assert bad < units
    assert {path.name for path in (out / "episodes").iterdir()} == units - bad
    made = manifest(out)
    assert all(made[name] == digest for name, digest in whole.items() if name.startswith("episodes/") and name in made)
    assert verify_files(out) == []


def test_fail_fast_begins_nothing_more(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recipe, out = write_toy(tmp_path / "bad", FAULTS), tmp_path / "out"
    with pytest.raises(RuntimeError, match="scene number 1: ValueError: odd"):
        run(["generate", str(recipe), *SMALL, "--out", str(out), "--fail-fast"])
    assert [path.name for path in (out / "episodes").iterdir()] == ["toy-000000"]
    assert "(1 episodes made now)" in capsys.readouterr().out
    assert verify_files(out) == []


# ---------------------------------------------------------------- disks


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of its own with half a megabyte."""
    place = tmp_path / "disk"
    place.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", place], check=False).returncode:
        pytest.skip("mounting is not allowed here")
    yield place
    subprocess.run(["umount", place], check=True)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_full_disk(
    recipe: Path, whole: dict[str, str], small_disk: Path, workers: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line, what is there is whole; with more room the same command goes on to the same bytes."""
    words = ["generate", str(recipe), *SMALL, "--out", str(small_disk / "o"), "--workers", str(workers)]
    assert run(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "cannot write: No space left on device (the same command goes on)" in line
    kept = {f"{path.relative_to(small_disk / 'o')}" for path in (small_disk / "o" / "episodes").iterdir()}
    assert 0 < len(kept) < 30
    assert not [name for name in kept if ".part" in name]
    files = manifest(small_disk / "o" / "episodes")
    assert files.items() <= {(name.removeprefix("episodes/"), digest) for name, digest in whole.items()}
    subprocess.run(["mount", "-o", "remount,size=64m", small_disk], check=True)
    assert run(words) == 0
    assert manifest(small_disk / "o") == whole


def test_a_read_only_disk(recipe: Path, small_disk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    assert run(["generate", str(recipe), "--out", str(small_disk / "o")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "Read-only file system" in line


@pytest.mark.parametrize("most_kb", [1, 10, 30])
def test_files_that_cannot_grow(recipe: Path, whole: dict[str, str], tmp_path: Path, most_kb: int) -> None:
    """A write that fails in the middle of a file, the first, a later or the largest of a unit."""
    out = tmp_path / "out"
    limited = ["prlimit", f"--fsize={most_kb * 1000}", *command(recipe, out)]
    if shutil.which("prlimit") is None:
        pytest.skip("needs prlimit")
    done = subprocess.run(limited, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "File too large" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not list(out.rglob("*.part"))
    assert run(command(recipe, out)[3:]) == 0
    assert manifest(out) == whole


# ---------------------------------------------------------------- costs


def test_costs(recipe: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["generate", str(recipe), "--frames", "every:4", "--out", str(tmp_path / "o")]
    assert unit_cost(find_recipe(str(recipe)), "all") is None
    tables = "[none]\ntime_s = 1.0\nsize_mb = 2.0\n[reference]\ntime_s = 3.0\nsize_mb = 4.0\n"
    (recipe / "cost.toml").write_text(f"{tables}[all]\ntime_s = 43.0\nsize_mb = 84.0\n")
    found = find_recipe(str(recipe))
    assert unit_cost(found, "none") == Cost(1.0, 2.0)
    assert unit_cost(found, "reference") == Cost(3.0, 4.0)
    assert unit_cost(found, "every:4") == Cost(13.0, 24.0)
    assert unit_cost(found, "all") == Cost(43.0, 84.0)
    assert run([*words, "--episodes", ":2"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "size mini: 6 scenes, 144 MB, 78 s of one process"
    assert said[3] == "this run: 2 scenes, 48 MB, about 26 s here"
    (recipe / "cost.toml").write_text(f"{tables}[all]\ntime_s = 43.0\nsize_mb = 1e12\n")
    assert run([*words, "--size", "full"]) == 2
    assert "would take about" in capsys.readouterr().err
    (recipe / "cost.toml").write_text(tables)
    with pytest.raises(DataError, match="expected tables none, reference, all"):
        unit_cost(found, "all")


@pytest.mark.parametrize("file", sorted(resource("generators").glob("*/cost.toml")), ids=lambda file: file.parent.name)
def test_bundled_costs_grow_with_pictures(file: Path) -> None:
    recipe = find_recipe(str(file.parent))
    costs = [unit_cost(recipe, frames) for frames in ("none", "reference", "every:10", "every:2", "all")]
    assert None not in costs
    for less, more in pairwise(cost for cost in costs if cost is not None):
        assert 0 < less.time_s <= more.time_s
        assert 0 < less.size_mb <= more.size_mb


def test_room_and_words(tmp_path: Path) -> None:
    require_room(tmp_path / "not" / "yet" / "there", 0.001)
    free_mb = shutil.disk_usage(tmp_path).free / 1e6
    with pytest.raises(DataError, match=r"fewer --episodes, or --frames every:N"):
        require_room(tmp_path / "not" / "yet", free_mb)
    assert [lasting(t) for t in (0.4, 99, 150, 7200)] == ["0 s", "99 s", "2 min", "2.0 h"]
    assert [sized(s) for s in (0.04, 5.11, 120, 1500, 12_345)] == ["0.0 MB", "5.1 MB", "120 MB", "1.5 GB", "12 GB"]
