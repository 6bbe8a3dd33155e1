"""A data set's index and manifests: made from the units alone, and every difference of a file is found and named."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from hsbench.errors import DataError, SchemaError
from hsbench.io.dataset_index import contents_sha256, read_index, unit_folders, verify_files, write_index


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_manifests_vouch_for_every_byte(rgbd: Path) -> None:
    """Followed with the standard library alone: the root lists the units' manifests, these list every file."""
    listed = json.loads((rgbd / "manifest.json").read_text())
    reached = {"manifest.json", *listed}
    for name, expected in listed.items():
        assert sha256(rgbd / name) == expected
        if name.endswith("/manifest.json"):
            unit = (rgbd / name).parent
            inner = json.loads((rgbd / name).read_text())
            assert {n: sha256(unit / n) for n in inner} == inner
            reached |= {(unit / n).relative_to(rgbd).as_posix() for n in inner}
    assert reached == {p.relative_to(rgbd).as_posix() for p in rgbd.rglob("*") if p.is_file()}
    assert verify_files(rgbd) == []


def test_the_index_says_what_the_units_say(rgbd: Path) -> None:
    rows = read_index(rgbd)
    assert (
        [r["episode_id"] for r in rows] == [u.name for u in unit_folders(rgbd)] == sorted(u["episode_id"] for u in rows)
    )
    for row, unit in zip(rows, unit_folders(rgbd), strict=True):
        assert row == json.loads((unit / "index.json").read_text())
        assert row["n_poses"] == pq.read_metadata(unit / "inputs" / "poses.parquet").num_rows
        assert row["n_frames"] == pq.read_metadata(unit / "recording" / "patches.parquet").num_rows


@pytest.mark.parametrize(("pictures", "left_out"), [(True, ""), (False, "! -path '*/recording/*' ! -name index.json")])
def test_the_hash_of_the_contents_is_that_of_a_list_of_files(rgbd: Path, pictures: bool, left_out: str) -> None:
    """Made by the shell, from the files themselves."""
    listed = f"find episodes -type f ! -name manifest.json {left_out} | LC_ALL=C sort | xargs sha256sum | sha256sum"
    shown = subprocess.run(listed, shell=True, cwd=rgbd, capture_output=True, text=True, check=True).stdout
    assert contents_sha256(rgbd, pictures) == shown.split()[0]


def test_writing_it_again_changes_no_byte_and_a_unit_less_is_a_row_less(rgbd_copy: Path) -> None:
    files = [rgbd_copy / name for name in ("episodes.parquet", "manifest.json")]
    before = [f.read_bytes() for f in files]
    write_index(rgbd_copy)
    assert [f.read_bytes() for f in files] == before
    gone = unit_folders(rgbd_copy)[1]
    shutil.rmtree(gone)
    shutil.copytree(unit_folders(rgbd_copy)[0], rgbd_copy / "episodes" / ".half.part")  # what a kill leaves
    write_index(rgbd_copy)
    assert gone.name not in [r["episode_id"] for r in read_index(rgbd_copy)]
    assert len(read_index(rgbd_copy)) == 5
    assert verify_files(rgbd_copy) == []


def test_any_one_file_changed_or_gone_is_one_fault_that_names_it(rgbd_copy: Path) -> None:
    files = sorted(p for p in rgbd_copy.rglob("*") if p.is_file() and p != rgbd_copy / "manifest.json")
    unit = [p for p in files if unit_folders(rgbd_copy)[0] in p.parents and p.name != "manifest.json"]
    assert len(unit) > 10
    for path in [rgbd_copy / "dataset.json", rgbd_copy / "episodes.parquet", *unit]:
        name, whole = path.relative_to(rgbd_copy).as_posix(), path.read_bytes()
        damaged = bytearray(whole)
        damaged[len(whole) // 2] ^= 1
        for content, word in ((bytes(damaged), "changed"), (whole[:-1], "changed"), (None, "missing")):
            if content is None:
                path.unlink()
            else:
                path.write_bytes(content)
            (fault,) = verify_files(rgbd_copy)
            assert fault.startswith(name)
            assert word in fault
        path.write_bytes(whole)
    assert verify_files(rgbd_copy) == []


def test_all_faults_are_listed_in_one_run(rgbd_copy: Path) -> None:
    first, second, third, fourth = (u.name for u in unit_folders(rgbd_copy)[:4])
    episodes = rgbd_copy / "episodes"
    (episodes / first / "episode.json").write_text("{}")
    (episodes / second / "truth" / "note.txt").write_text("extra")
    (episodes / third / "manifest.json").unlink()
    shutil.copytree(episodes / fourth, episodes / "by-hand")
    (rgbd_copy / "stray.txt").write_text("extra")
    (episodes / "stray.npz").write_text("extra")
    expected = {
        f"episodes/{first}/episode.json": "changed",
        f"episodes/{second}/truth/note.txt": "extra",
        f"episodes/{third}/manifest.json": "missing",
        "episodes/by-hand": "not in manifest.json",
        "stray.txt": "not in manifest.json",
        "episodes/stray.npz": "not in manifest.json",
    }
    faults = verify_files(rgbd_copy)
    assert len(faults) == len(expected)
    for name, word in expected.items():
        (fault,) = (f for f in faults if f.split(" ")[0].rstrip(":") == name)
        assert word in fault


def test_a_changed_file_cannot_hide_behind_a_changed_manifest(rgbd_copy: Path) -> None:
    unit = unit_folders(rgbd_copy)[0]
    (unit / "episode.json").write_bytes((unit / "episode.json").read_bytes() + b" ")
    inner = json.loads((unit / "manifest.json").read_text())
    inner["episode.json"] = sha256(unit / "episode.json")
    (unit / "manifest.json").write_text(json.dumps(inner))
    (fault,) = verify_files(rgbd_copy)
    assert fault.startswith(f"episodes/{unit.name}/manifest.json: changed, ")


@pytest.mark.parametrize("text", ["", "[1, 2]", '{"a": 1}', "{"])
def test_what_is_no_manifest_is_said_so(rgbd_copy: Path, text: str) -> None:
    (rgbd_copy / "manifest.json").write_text(text)
    with pytest.raises(DataError, match=r"manifest\.json"):
        verify_files(rgbd_copy)


def test_a_missing_or_damaged_index_is_named(rgbd_copy: Path, tmp_path: Path) -> None:
    path = rgbd_copy / "episodes.parquet"
    table = pq.read_table(path)
    pq.write_table(table.drop_columns(["split", "scene_id"]), path)
    with pytest.raises(SchemaError, match=r"episodes\.parquet table lacks columns \['scene_id', 'split'\]"):
        read_index(rgbd_copy)
    path.write_bytes(b"PAR1")
    with pytest.raises(DataError, match=r"episodes\.parquet cannot be read"):
        read_index(rgbd_copy)
    path.unlink()
    with pytest.raises(DataError, match="was its generation stopped"):
        read_index(rgbd_copy)
    (tmp_path / "nothing").mkdir()
    with pytest.raises(DataError, match="is this a data set"):
        read_index(tmp_path / "nothing")
    with pytest.raises(DataError, match="is this a data set"):
        unit_folders(tmp_path / "nothing")
