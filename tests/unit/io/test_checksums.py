"""Manifests: every difference of a folder is found and named."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from hsbench.errors import DataError
from hsbench.io.checksums import manifest, sha256_file, verify


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "b").mkdir()
    (tmp_path / "a.txt").write_bytes(b"abc")
    (tmp_path / "b" / "c.bin").write_bytes(b"")
    return tmp_path


def test_manifest_lists_every_file(folder: Path) -> None:
    assert manifest(folder) == {
        "a.txt": "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
        "b/c.bin": hashlib.sha256(b"").hexdigest(),
    }
    assert list(manifest(folder, exclude=["a.txt"])) == ["b/c.bin"]
    assert verify(folder, manifest(folder)) == []


def test_verify_names_missing_extra_changed_and_links(folder: Path) -> None:
    expected = {**manifest(folder), "gone/x": "0" * 64}
    (folder / "a.txt").write_bytes(b"abd")
    (folder / "new").write_bytes(b"")
    (folder / "link").symlink_to("a.txt")
    faults = verify(folder, expected)
    assert [fault.split(":")[0] for fault in faults] == ["a.txt", "gone/x", "link", "new"]
    for word, fault in zip(("changed", "missing", "link", "extra"), faults, strict=True):
        assert word in fault
    with pytest.raises(DataError, match="not a plain file"):
        manifest(folder)


def test_missing_things_are_data_errors(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot read"):
        sha256_file(tmp_path / "none")
    with pytest.raises(DataError, match="not a folder"):
        manifest(tmp_path / "none")
