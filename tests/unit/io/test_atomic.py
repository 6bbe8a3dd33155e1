"""Atomic writes: whole or not at all, whatever happens in between."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hsbench.errors import DataError, SchemaError
from hsbench.io.atomic import atomic_file, atomic_folder, json_bytes, write_bytes, write_json


def test_file_appears_whole_with_ordinary_permissions(tmp_path: Path) -> None:
    target = tmp_path / "deep" / "er" / "a.bin"
    write_bytes(target, b"one")
    write_bytes(target, b"two")
    assert target.read_bytes() == b"two"
    (tmp_path / "plain").write_bytes(b"")
    assert target.stat().st_mode == (tmp_path / "plain").stat().st_mode
    assert [p.name for p in target.parent.iterdir()] == ["a.bin"]


def interrupt_after(file: Path, error: type[BaseException]) -> None:
    file.write_bytes(b"half")
    raise error


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path: Path, error: type[BaseException]) -> None:
    target = tmp_path / "a.bin"
    write_bytes(target, b"old")
    with pytest.raises(error), atomic_file(target) as temporary:
        interrupt_after(temporary, error)
    assert target.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.bin"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_leaves_no_folder(tmp_path: Path, error: type[BaseException]) -> None:
    with pytest.raises(error), atomic_folder(tmp_path / "out") as folder:
        interrupt_after(folder / "half", error)
    assert list(tmp_path.iterdir()) == []


def test_folder_is_not_replaced_unless_asked(tmp_path: Path) -> None:
    for text in ("one", "two"):
        with atomic_folder(tmp_path / "out", replace=text == "two") as folder:
            (folder / "a").write_text(text)
    assert (tmp_path / "out" / "a").read_text() == "two"
    with pytest.raises(DataError, match="exists already"), atomic_folder(tmp_path / "out"):
        pass
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_kill_leaves_no_final_name(tmp_path: Path) -> None:
    code = (
        "import sys, time; from hsbench.io.atomic import atomic_folder\n"
        "with atomic_folder(sys.argv[1]) as f:\n"
        "    (f / 'half').write_text('x'); print('ready', flush=True); time.sleep(60)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "out")], stdout=subprocess.PIPE)
    assert child.stdout is not None
    child.stdout.readline()
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    child.stdout.close()
    (left,) = tmp_path.iterdir()
    assert left.name.startswith(".out.")
    assert left.name.endswith(".part")
    with atomic_folder(tmp_path / "out"):
        pass
    assert (tmp_path / "out").is_dir()


def test_unwritable_place_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot write"):
        write_bytes(tmp_path / "file" / "a", b"")
    with pytest.raises(DataError, match="cannot write"), atomic_folder(tmp_path / "file" / "a"):
        pass


def test_json_is_sorted_exact_and_strict(tmp_path: Path) -> None:
    assert json_bytes({"b": 0.1 + 0.2, "a": [1, None, "ä"]}) == json_bytes({"a": (1, None, "ä"), "b": 0.1 + 0.2})
    assert b"0.30000000000000004" in json_bytes({"b": 0.1 + 0.2})
    bad = {"a[1] is nan": [0, float("nan")], "a has the key 1": {1: 2}, "a is a set": {2}}
    for item, value in bad.items():
        with pytest.raises(SchemaError) as error:
            write_json(tmp_path / "a.json", {"a": value})
        assert item in str(error.value)
        assert "a.json" in str(error.value)
    assert list(tmp_path.iterdir()) == []
