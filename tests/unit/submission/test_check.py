"""Every fault of a submission, all in one run, without any truth."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import SubmissionError
from hsbench.submission import check, check_or_raise
from tests.unit.submission.submitted import EPISODES, TASK, as_zip, sound


def npz(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


GOOD = {"occupied": np.zeros((2, 3), np.uint8), "score": np.ones(2, np.float32)}


def faulty_files() -> dict[str, bytes]:
    """Ten faults, each of another kind."""
    metadata = {"task": "toy", "task_version": "7", "method": "m", "track": "telepathy", "colour": "red"}
    return {
        "submission.json": json.dumps(metadata).encode(),  # 1 version, 2 track, 3 unknown key
        # 4 ep-00 is missing
        "predictions/ep-01.npz": npz(**GOOD | {"occupied": np.zeros((3, 2), np.uint8)}),  # 5 shape
        "predictions/ep-02.npz": npz(**GOOD | {"occupied": np.zeros((2, 3), np.float64)}),  # 6 dtype
        "predictions/ep-03.npz": npz(**GOOD | {"score": np.array([1, np.nan], np.float32)}),  # 7 NaN
        "predictions/ep-04.npz": npz(**GOOD)[:100],  # 8 truncated
        "predictions/ep-05.npz": npz(**GOOD | {"occupied": np.array([[{}] * 3] * 2, dtype=object)}),  # 9 object array
        "predictions/ep-06.npz": npz(**GOOD),
        "notes.txt": b"hello",  # 10 unexpected
    }


EXPECTED = [
    ("submission.json", "unknown key 'colour'"),
    ("submission.json", "task_version is '7'; expected '0'"),
    ("submission.json", "track is 'telepathy'; expected one of poses, frames"),
    ("predictions/ep-00.npz", "missing"),
    ("'notes.txt'", "unexpected file"),
    ("predictions/ep-01.npz", "array 'occupied': shape is (3, 2); expected (2, 3)"),
    ("predictions/ep-02.npz", "array 'occupied': dtype is float64; expected uint8"),
    ("predictions/ep-03.npz", "array 'score': holds nan at (1,)"),
    ("predictions/ep-04.npz", "truncated zip archive"),
    ("predictions/ep-05.npz", "array 'occupied': object array would need pickle"),
]
IDS = [f"ep-{i:02d}" for i in range(7)]


@pytest.mark.parametrize("packed", [False, True])
def test_ten_faults_give_ten_lines(tmp_path: Path, packed: bool) -> None:
    root = tmp_path / "s"
    for name, data in faulty_files().items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_bytes(data)
    path = as_zip(root) if packed else root
    faults = check(path, TASK, IDS)
    assert len(faults) == len(EXPECTED) == 10
    for fault, (file, words) in zip(faults, EXPECTED, strict=True):
        assert fault.startswith(f"{file}: "), fault
        assert words in fault
        assert "\n" not in fault
    with pytest.raises(SubmissionError) as error:
        check_or_raise(path, TASK, IDS)
    assert error.value.faults == faults
    assert error.value.exit_code == 3


def test_a_sound_submission_has_none(tmp_path: Path) -> None:
    folder = sound(tmp_path / "s")
    assert check(folder, TASK, EPISODES) == check(as_zip(folder), TASK, EPISODES) == []
    check_or_raise(folder, TASK, EPISODES)


def test_missing_episodes_may_be_allowed(tmp_path: Path) -> None:
    folder = sound(tmp_path / "s", ["ep-1"])
    assert check(folder, TASK, EPISODES) == ["predictions/ep-2.npz: missing", "predictions/ep-3.npz: missing"]
    assert check(folder, TASK, EPISODES, allow_missing=True) == []


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("predictions/ep-9.npz", "no episode of this split"),
        ("predictions/ep-1@7s.npz", "times apart are 5, 15 s"),
        ("predictions/ep-1@120s.npz", "the last time is the file without '@'"),
        ("predictions/ep-1.npy", "no part of a submission"),
        ("ep-1.npz", "no part of a submission"),
        (".DS_Store", "no part of a submission"),
    ],
)
def test_unexpected_files_are_told_why(tmp_path: Path, name: str, hint: str) -> None:
    folder = sound(tmp_path / "s")
    (folder / name).write_bytes(b"")
    (fault,) = check(folder, TASK, EPISODES)
    assert fault.startswith(f"{name!r}: unexpected file")
    assert hint in fault


def test_predictions_at_observation_times_are_checked_too(tmp_path: Path) -> None:
    folder = sound(tmp_path / "s")
    (folder / "predictions" / "ep-2@15s.npz").write_bytes(b"x")
    assert check(folder, TASK, EPISODES) == ["predictions/ep-2@15s.npz: not a zip archive (expected an NPZ file)"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"{", ["no valid JSON"]),
        (b"[]", ["holds a list; expected an object"]),
        (b"\xff", ["not UTF-8 at byte 0"]),
        (b"[" * 100_000, ["nested too deeply"]),
        (b'{"task": "toy", "task": "toy"}', ["key 'task' is given twice"]),
        (b"{}", ["task is missing", "task_version is missing", "method is missing", "track is missing"]),
        (
            b'{"task": "toys", "task_version": 0, "method": "", "track": "poses", "causal": "yes", "parameters": 1.5,'
            b' "seconds_per_episode": -1, "authors": "me"}',
            ["task_version is 0", "method is ''", "authors is 'me'", "parameters is 1.5", "seconds_per_episode is -1",
             "causal is 'yes'", "task is 'toys'"],
        ),
        (b'{"task": "toy", "parameters": NaN}', ["NaN is no JSON"]),
        (b'{"task": "toy", "parameters": 1e999}', ["1e999 is no JSON"]),
        (b"x" * (1 << 21), ["2097152 bytes; the limit is 1048576"]),
        (b'{"task": "toy", "task_version": "0", "method": "m", "track": "poses", "parameters": 1%s}' % (b"0" * 400),
         ["parameters is 1000"]),
        (b'{"task": "toy", "task_version": "0", "method": "a\\u001b[2J", "track": "poses"}', ["method is 'a\\x1b[2J'"]),
    ],
)  # fmt: skip
def test_faults_of_the_metadata(tmp_path: Path, text: bytes, words: list[str]) -> None:
    folder = sound(tmp_path / "s")
    (folder / "submission.json").write_bytes(text)
    faults = check(folder, TASK, EPISODES)
    assert len(faults) == len(words), faults
    for fault, word in zip(faults, words, strict=True):
        assert fault.startswith("submission.json: ")
        assert word in fault


def test_a_zip_of_the_folder_itself_is_told_so(tmp_path: Path) -> None:
    folder = sound(tmp_path / "s")
    with zipfile.ZipFile(tmp_path / "outer.zip", "w") as archive:
        for file in folder.rglob("*.*"):
            archive.write(file, file.relative_to(tmp_path))
    faults = check(tmp_path / "outer.zip", TASK, EPISODES)
    assert "pack what is in the folder, not the folder" in faults[0]


def test_what_is_no_submission_at_all(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"hello")
    for name, words in (("x", "not a zip archive"), ("none", "No such file")):
        (fault,) = check(tmp_path / name, TASK, EPISODES)
        assert words in fault
        assert str(tmp_path / name) in fault
