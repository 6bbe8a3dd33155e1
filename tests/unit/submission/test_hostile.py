"""Submissions made to harm: each is a fault, nothing leaves the archive, nothing runs, nothing takes long."""

from __future__ import annotations

import io
import os
import stat
import struct
import time
import tracemalloc
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import DataError
from hsbench.submission import check, open_submission
from hsbench.submission import read as reading
from tests.unit.submission.submitted import EPISODES, TASK, as_zip, sound


class Runs:
    """Unpickling this creates a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return (Path.touch, (self.path,))


def with_member(tmp_path: Path, info: zipfile.ZipInfo | str, data: bytes = b"x") -> Path:
    """A sound zip with one more member."""
    path = as_zip(sound(tmp_path / "s"))
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(info, data)
    return path


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("../evil.npz", "climbs out"),
        ("predictions/../../evil", "climbs out"),
        ("/etc/evil", "absolute path"),
        ("C:/evil", "absolute path"),
        ("..\\evil", "backslash"),
        ("predictions/./x", "empty or '.'"),
        ("predictions//x", "empty or '.'"),
        ("a\x1b[2Jb", "control or invisible"),
        ("a\u202eb", "control or invisible"),
        ("x" * 201, "path of 201 characters"),
    ],
)
def test_unsafe_names_are_faults_and_write_nothing(tmp_path: Path, name: str, words: str) -> None:
    path = with_member(tmp_path, name)
    before = sorted(tmp_path.rglob("*"))
    (fault,) = check(path, TASK, EPISODES)
    assert fault.startswith(f"{name!r}: ")
    assert words in fault
    assert fault.isprintable()
    assert sorted(tmp_path.rglob("*")) == before
    assert not (tmp_path.parent / "evil").exists()


def test_a_nul_in_a_name_is_not_cut_off(tmp_path: Path) -> None:
    path = with_member(tmp_path, "predictions/ep-9.npzX.txt")
    path.write_bytes(path.read_bytes().replace(b"ep-9.npzX.txt", b"ep-9.npz\0.txt"))
    (fault,) = check(path, TASK, EPISODES)
    assert "control or invisible" in fault


def test_an_empty_name(tmp_path: Path) -> None:
    (fault,) = check(with_member(tmp_path, zipfile.ZipInfo("")), TASK, EPISODES)
    assert "path of 0 characters" in fault


def test_links_in_a_zip(tmp_path: Path) -> None:
    info = zipfile.ZipInfo("predictions/ep-4.npz")
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    (fault,) = check(with_member(tmp_path, info, b"/etc/passwd"), TASK, [*EPISODES, "ep-4"])
    assert fault == "'predictions/ep-4.npz': a link"


def test_links_and_pipes_in_a_folder_are_never_opened(tmp_path: Path) -> None:
    folder = sound(tmp_path / "s")
    secret = sound(tmp_path / "other", ["ep-4"]) / "predictions" / "ep-4.npz"
    (folder / "predictions" / "ep-4.npz").symlink_to(secret)
    (folder / "elsewhere").symlink_to(tmp_path)
    os.mkfifo(folder / "pipe")
    assert check(folder, TASK, [*EPISODES, "ep-4"]) == [
        "'elsewhere': a link; expected plain files",
        "'pipe': a device, pipe or socket; expected plain files",
        "'predictions/ep-4.npz': a link; expected plain files",
    ]
    with open_submission(folder) as files:
        for name in (
            "predictions/ep-4.npz",
            "pipe",
            "../other/submission.json",
            "/etc/passwd",
            "elsewhere/other/submission.json",
        ):
            with pytest.raises(DataError):
                files.read(name)


def test_a_file_exchanged_for_a_link_after_listing(tmp_path: Path) -> None:
    folder = sound(tmp_path / "s")
    with open_submission(folder) as files:
        (folder / "submission.json").rename(tmp_path / "kept.json")
        (folder / "submission.json").symlink_to(tmp_path / "kept.json")
        with pytest.raises(DataError, match="cannot be read"):
            files.read("submission.json")


def test_duplicates_and_case_clashes(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="Duplicate name"):
        path = with_member(tmp_path, "predictions/ep-1.npz")
    faults = check(path, TASK, EPISODES)
    assert "'predictions/ep-1.npz': there twice" in faults
    faults = check(with_member(tmp_path / "b", "predictions/EP-1.npz"), TASK, EPISODES)
    assert any("differs from 'predictions/ep-1.npz' only in case" in fault for fault in faults)
    accents = with_member(tmp_path / "c", "caf\u00e9")
    with zipfile.ZipFile(accents, "a") as archive:
        archive.writestr("cafe\u0301", b"")
    assert any("case or accents" in fault for fault in check(accents, TASK, EPISODES))


def test_pickled_code_in_a_prediction_never_runs(tmp_path: Path) -> None:
    trap = tmp_path / "it ran"
    buffer = io.BytesIO()
    objects = np.empty((2, 3), dtype=object)
    objects[:] = Runs(trap)
    np.savez(buffer, occupied=objects, score=np.ones(1, np.float32))
    folder = sound(tmp_path / "s")
    (folder / "predictions" / "ep-1.npz").write_bytes(buffer.getvalue())
    (fault,) = check(folder, TASK, EPISODES)
    assert "would need pickle" in fault
    assert not trap.exists()
    np.load(io.BytesIO(buffer.getvalue()), allow_pickle=True)["occupied"]  # the trap works
    assert trap.exists()


def test_bombs_are_refused_before_they_are_unpacked(tmp_path: Path) -> None:
    zeros = bytes(1 << 20)
    path = as_zip(sound(tmp_path / "s"))
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("predictions/ep-4.npz", "w") as member:  # 100 MB in one file
            for _ in range(100):
                member.write(zeros)
        inner = io.BytesIO()  # more in one array of a small NPZ than the task lets a file hold
        with zipfile.ZipFile(inner, "w", zipfile.ZIP_DEFLATED) as nested, nested.open("occupied.npy", "w") as member:
            for _ in range(TASK.prediction.max_bytes // len(zeros) + 1):
                member.write(zeros)
        archive.writestr("predictions/ep-5.npz", inner.getvalue())
    tracemalloc.start()
    faults = check(path, TASK, [*EPISODES, "ep-4", "ep-5"])
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(faults) == 2
    assert f"the limit for one file is {reading.MAX_FILE_BYTES}" in faults[0]
    assert "the limit for one file is" in faults[1]
    assert peak < 10 << 20


def test_a_forged_size_is_a_fault(tmp_path: Path) -> None:
    path = as_zip(sound(tmp_path / "s"))
    data = bytearray(path.read_bytes())
    at = data.rfind(b"PK\1\2", 0, data.rfind(b"PK\1\2"))
    data[at + 24 : at + 28] = struct.pack("<L", 60 << 20)
    path.write_bytes(bytes(data))
    faults = check(path, TASK, EPISODES)
    assert any("more than 1100:1" in fault for fault in faults)


def test_a_million_entries_are_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "many.zip"
    count = 1_000_000
    local = struct.pack("<4s5H3L2H", b"PK\3\4", 20, 0, 0, 0, 33, 0, 0, 0, 8, 0) + b"a0000000"
    entry = struct.Struct("<4s6H3L5H2L")
    with path.open("wb") as file:
        file.write(local)
        directory = b"".join(
            entry.pack(b"PK\1\2", 20, 20, 0, 0, 0, 33, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0) + b"%08d" % i for i in range(count)
        )
        file.write(directory)
        start = file.tell()
        file.write(struct.pack("<4sQ2H2L4Q", b"PK\6\6", 44, 45, 45, 0, 0, count, count, len(directory), len(local)))
        file.write(struct.pack("<4sLQL", b"PK\6\7", 0, start, 1))
        file.write(struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0))
    start_s = time.perf_counter()
    (fault,) = check(path, TASK, EPISODES)
    assert time.perf_counter() - start_s < 0.5
    assert f"holds {count} entries; the limit is {reading.MAX_FILES}" in fault
    # the same with a count that lies
    data = bytearray(path.read_bytes())
    data[start + 24 : start + 40] = struct.pack("<2Q", 3, 3)
    path.write_bytes(bytes(data))
    (fault,) = check(path, TASK, EPISODES)
    assert "too much for" in fault


def test_too_many_files_in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = sound(tmp_path / "s")
    monkeypatch.setattr(reading, "MAX_FILES", 3)
    assert "more than 3 files" in check(folder, TASK, EPISODES)[0]
    deep = sound(tmp_path / "t", [])
    (deep / "a/b/c/d/e/f").mkdir(parents=True)
    monkeypatch.setattr(reading, "MAX_FILES", 100)
    assert any("nested more than 4 deep" in fault for fault in check(deep, TASK, []))


def test_encrypted_and_exotic_members(tmp_path: Path) -> None:
    path = as_zip(sound(tmp_path / "s"))
    data = path.read_bytes()
    at = data.rfind(b"PK\1\2")
    for offset, value, words in ((8, 1, "encrypted"), (10, zipfile.ZIP_LZMA, "compression method 14")):
        forged = bytearray(data)
        forged[at + offset : at + offset + 2] = struct.pack("<H", value)
        path.write_bytes(bytes(forged))
        (fault,) = check(path, TASK, EPISODES)
        assert words in fault


def test_any_damage_of_a_zip_is_faults_never_an_exception(tmp_path: Path) -> None:
    path = as_zip(sound(tmp_path / "s"))
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(300):
        damaged = bytearray(whole)
        for at in rng.integers(0, len(whole), rng.integers(1, 5)):
            damaged[at] = rng.integers(0, 256)
        path.write_bytes(bytes(damaged[: rng.integers(1, len(whole) + 1)] if rng.random() < 0.3 else damaged))
        for fault in check(path, TASK, EPISODES):
            assert fault.isprintable()


def test_crc_is_checked(tmp_path: Path) -> None:
    path = tmp_path / "s.zip"
    text = b'{"task": "toy", "task_version": "0", "method": "m", "track": "poses"}'
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("submission.json", text)
    path.write_bytes(path.read_bytes().replace(b'"poses"', b'"posse"'))
    assert zlib.crc32(text) != zlib.crc32(text.replace(b"poses", b"posse"))
    (fault,) = check(path, TASK, [])
    assert "truncated or damaged" in fault
