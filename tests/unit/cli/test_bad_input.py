"""Bad input on the command line: one clear line, no traceback, exit code 2 or 3; every fault at once."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import hsbench
from hsbench import load
from hsbench.cli.main import run
from hsbench.submission import Metadata, write_submission
from hsbench.tasks import task

ROOT = Path(hsbench.__file__).parents[1]
SPEC = task("scene-completion")


def refused(capsys: pytest.CaptureFixture[str], *arguments: object, code: int = 2) -> list[str]:
    """Run a command that must fail; the lines it says on the error stream."""
    assert run([str(a) for a in arguments]) == code
    shown = capsys.readouterr()
    assert "Traceback" not in shown.err
    return shown.err.splitlines()


@pytest.fixture
def sound(rgbd: Path, tmp_path: Path) -> Path:
    """A sound submission for split val."""
    nothing = np.zeros(SPEC.grid.shape, bool)
    metadata = Metadata(SPEC.name, SPEC.version, "by hand", "frames", authors=("A. Author",), causal=True)
    write_submission(tmp_path / "sound", SPEC, metadata, ((i, nothing) for i in load(rgbd, "val").episode_ids))
    return tmp_path / "sound"


def npz(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


BITS = np.zeros((128, 128, 6), np.uint8)
FAULTS: dict[str, tuple[Callable[[bytes], bytes | None], str]] = {
    "missing episode": (lambda _: None, "missing"),
    "wrong shape": (lambda _: npz(occupied=BITS[:-1]), "shape is (127, 128, 6); expected (128, 128, 6)"),
    "nan": (lambda _: npz(occupied=np.full(BITS.shape[1:], np.nan)), "dtype is float64; expected uint8"),
    "not packed": (lambda _: npz(occupied=np.zeros((128, 128, 48), bool)), "dtype is bool; expected uint8"),
    "doubles": (lambda _: npz(occupied=np.zeros((128, 128, 48))), "dtype is float64; expected uint8"),
    "wrong dtype": (lambda _: npz(occupied=BITS.astype(bool)), "dtype is bool; expected uint8"),
    "truncated npz": (lambda data: data[: len(data) // 2], "truncated"),
    "object array": (lambda _: npz(occupied=np.array([print, None])), "pickle"),
    "other array": (lambda _: npz(voxels=BITS), "array 'occupied' is missing"),
    "text": (lambda _: b"0 1 0 1", "not a zip archive"),
    "empty file": (lambda _: b"", "not a zip archive"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_one_fault_is_one_line_and_exit_3(
    rgbd: Path, sound: Path, capsys: pytest.CaptureFixture[str], fault: str
) -> None:
    damage, words = FAULTS[fault]
    first = load(rgbd, "val").episode_ids[0]
    path = sound / "predictions" / f"{first}.npz"
    content = damage(path.read_bytes())
    if content is None:
        path.unlink()
    else:
        path.write_bytes(content)
    arguments = [sound, "--task", "scene-completion", "--data", rgbd, "--split", "val"]
    lines = refused(capsys, "check", *arguments, code=3)
    told = [line for line in lines if line.startswith("fault: ")]
    assert any(f"predictions/{first}.npz" in line and words in line for line in told)
    assert len(told) == (2 if fault == "other array" else 1)  # that array is unexpected, too
    assert len(lines) == len(told) + 1
    assert refused(capsys, "score", *arguments, "--out", sound.parent / "r.json", code=3) == [
        line.replace("fault: ", "error: ", 1) for line in told
    ]
    assert not (sound.parent / "r.json").exists()


def test_every_fault_in_one_run(rgbd: Path, sound: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, second = load(rgbd, "val").episode_ids
    (sound / "predictions" / f"{first}.npz").write_bytes(npz(occupied=BITS[:-1], extra=BITS[0]))
    (sound / "predictions" / f"{second}.npz").unlink()
    (sound / "predictions" / "elsewhere-1.npz").write_bytes(npz(occupied=BITS))
    (sound / "notes.txt").write_text("mine")
    metadata = json.loads((sound / "submission.json").read_text())
    (sound / "submission.json").write_text(json.dumps({**metadata, "track": "telepathy", "colour": "red"}))
    arguments = ["check", sound, "--task", "scene-completion", "--data", rgbd, "--split", "val"]
    lines = refused(capsys, *arguments, code=3)
    for words in (
        "shape is (127",
        "'extra'",
        f"{second}.npz: missing",
        "elsewhere-1.npz",
        "notes.txt",
        "telepathy",
        "'colour'",
    ):
        assert len([line for line in lines if words in line]) == 1, words
    assert len(lines) == 8
    assert lines[-1].endswith("7 faults")
    assert run([*map(str, arguments), "--json"]) == 3
    assert len(json.loads(capsys.readouterr().out)["faults"]) == 7


@pytest.mark.parametrize("name", ["../../evil.npz", "/evil.npz", "predictions/../../evil.npz", "a\\..\\evil.npz"])
def test_a_path_that_climbs_out_of_an_archive(
    rgbd: Path, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    packed = tmp_path / "deep" / "down" / "s.zip"
    packed.parent.mkdir(parents=True)
    with zipfile.ZipFile(packed, "w") as archive:
        for file in sound.rglob("*.*"):
            archive.write(file, file.relative_to(sound).as_posix())
    arguments = ["check", packed, "--task", "scene-completion", "--data", rgbd, "--split", "val"]
    assert run([str(a) for a in arguments]) == 0
    capsys.readouterr()
    with zipfile.ZipFile(packed, "a") as archive:
        archive.writestr(name, npz(occupied=BITS))
    before = sorted(tmp_path.rglob("*"))
    lines = refused(capsys, *arguments, code=3)
    assert len(lines) == 2
    assert "evil.npz" in lines[0]
    assert sorted(tmp_path.rglob("*")) == before
    assert not Path("/evil.npz").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["generate", "rgbd-activty", "--out", "OUT"], "recipe 'rgbd-activty' is neither a folder nor one of"),
        (
            ["generate", "rgbd-activity", "--split", "test", "--out", "OUT"],
            "split 'test' is unknown; expected one of train",
        ),
        (["predict", "crave", "--data", "DATA", "--out", "OUT"], "method 'crave' is unknown; expected one of carve"),
        (
            ["predict", "carve", "--data", "DATA", "--split", "valid", "--out", "OUT"],
            "no episode of split 'valid'; found",
        ),
        (["predict", "carve", "--data", "OUT", "--out", "OUT2"], "is no folder (generate it first"),
        (["predict", "height-prior", "--data", "DATA", "--train", "OUT", "--out", "OUT2"], "is no folder"),
        (["predict", "carve", "--data", "DATA", "--out", "DATA"], "exists already"),
        (["check", "OUT", "--task", "completion", "--data", "DATA"], "task 'completion' is unknown; expected one of"),
        (["score", "OUT", "--task", "completion", "--data", "DATA"], "task 'completion' is unknown"),
        (["task", "show", "completion"], "task 'completion' is unknown"),
        (["compare", "OUT", "OUT"], "cannot read"),
        (["board", "add", "OUT", "--board", "OUT2", "--year", "2026"], "cannot read"),
        (["verify", "OUT"], "OUT"),
        (["info", "OUT"], "is no folder"),
        (["import", "kinect-csv", "OUT.csv", "--out", "OUT"], "OUT.csv"),
        (["import", "sscnet", "OUT.png", "OUT.bin", "--out", "OUT"], "OUT"),
    ],
)
def test_what_is_unknown_or_not_there_is_one_line_and_exit_2(
    rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    places = {"OUT": str(tmp_path / "OUT"), "OUT2": str(tmp_path / "OUT2"), "DATA": str(rgbd)}
    (line,) = refused(capsys, *(places.get(a, a) for a in arguments))
    assert line.startswith("error: ")
    assert words in line
    assert not (tmp_path / "OUT").exists()


@pytest.mark.parametrize("text", ["a:b", "3", "1:2:3", "", "1.5:2", ":x", "1-2", "5:2", "99:"])
def test_nonsense_for_episodes(
    short_recipe: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    (line,) = refused(capsys, "generate", short_recipe, "--episodes", text, "--out", tmp_path / "o")
    assert line.startswith("error: --episodes ")
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["predict", "carve", "--data", "DATA"],
        ["predict", "carve", "--out", "OUT"],
        ["generate", "rgbd-activity", "--out", "OUT", "--size", "tiny"],
        ["generate", "rgbd-activity", "--out", "OUT", "--seed", "-1"],
        ["generate", "rgbd-activity", "--out", "OUT", "--workers", "0"],
        ["generate", "rgbd-activity", "--out", "OUT", "--wrokers", "2"],
        ["frobnicate"],
        ["board", "frobnicate"],
    ],
)  # fmt: skip
def test_wrong_usage_shows_the_usage_and_exits_2(
    rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    lines = refused(capsys, *({"OUT": tmp_path / "OUT", "DATA": rgbd}.get(a, a) for a in arguments))
    assert lines[0].startswith("Usage: hsbench")
    assert lines[-1].startswith("Error: ")
    assert not (tmp_path / "OUT").exists()


def unit(root: Path) -> Path:
    return root / "episodes" / load(root, "val").episode_ids[0]


def with_nan(root: Path) -> str:
    path = unit(root) / "inputs" / "poses.parquet"
    table = pq.read_table(path)
    joints = np.full(len(table) * 75, np.nan, np.float32)
    column = pa.FixedSizeListArray.from_arrays(pa.array(joints), 75)
    pq.write_table(table.set_column(table.column_names.index("joints_m"), "joints_m", column), path)
    return "joints_m row 0"


def cut_poses(root: Path) -> str:
    path = unit(root) / "inputs" / "poses.parquet"
    path.write_bytes(path.read_bytes()[:-10])
    return "poses.parquet"


def cut_truth(root: Path) -> str:
    path = unit(root) / "truth" / "occupancy.npz"
    path.write_bytes(path.read_bytes()[:-10])
    return "occupancy.npz"


def cut_patches(root: Path) -> str:
    path = unit(root) / "recording" / "patches.parquet"
    path.write_bytes(path.read_bytes()[:-10])
    return "patches.parquet"


def gone(root: Path) -> str:
    place = unit(root)
    shutil.rmtree(place)
    return place.name


@pytest.mark.parametrize("damage", [with_nan, cut_poses, cut_truth, cut_patches, gone])
def test_a_damaged_data_set_is_told_by_verify_and_by_whoever_reads_it(
    rgbd_copy: Path, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], damage: Callable[[Path], str]
) -> None:
    words = damage(rgbd_copy)
    lines = refused(capsys, "verify", rgbd_copy)
    assert all(line.startswith("fault: ") for line in lines)
    assert any(words in line for line in lines)
    if damage is cut_truth:
        arguments = ["score", sound, "--task", "scene-completion", "--data", rgbd_copy, "--split", "val"]
    else:
        arguments = ["predict", "carve", "--data", rgbd_copy, "--split", "val", "--out", tmp_path / "p"]
    (line,) = refused(capsys, *arguments)
    assert line.startswith("error: ")
    assert words in line
    assert not (tmp_path / "p").exists()


def test_verify_lists_every_damaged_episode(rgbd_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for place in sorted((rgbd_copy / "episodes").iterdir())[:3]:
        (place / "inputs" / "poses.parquet").write_bytes(b"")
    assert run(["verify", str(rgbd_copy), "--json"]) == 2
    faults = json.loads(capsys.readouterr().out)["faults"]
    for place in sorted((rgbd_copy / "episodes").iterdir())[:3]:
        (fault,) = [f for f in faults if place.name in f]  # one file, one fault: its hash and that it cannot be read
        assert "poses.parquet: changed, its end is missing (truncated at 0 B)" in fault


def test_in_a_process_of_its_own_too(rgbd: Path, sound: Path) -> None:
    """Exit codes 0, 2 and 3 as a shell sees them."""
    task_data = ["--task", "scene-completion", "--data", str(rgbd), "--split"]
    for arguments, code in ((["val"], 0), (["valid"], 2), (["train"], 3)):
        done = subprocess.run(
            [sys.executable, "-m", "hsbench.cli.main", "check", str(sound), *task_data, *arguments],
            capture_output=True, text=True, cwd=ROOT, check=False,
        )  # fmt: skip
        assert done.returncode == code
        assert "Traceback" not in done.stderr
        assert (done.stderr == "") == (code == 0)


def test_a_misspelt_setting_of_a_recipe(short_recipe: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recipe = tmp_path / "rgbd-activity"
    shutil.copytree(short_recipe, recipe)
    config = recipe / "config.toml"
    config.write_text(config.read_text().replace("duration_s", "durration_s"))
    (line,) = refused(capsys, "generate", recipe, "--renderer", "raycast", "--out", tmp_path / "o")
    assert "config section [life] has unknown keys ['durration_s']" in line
