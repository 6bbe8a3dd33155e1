"""dataset_faults: every kind of damage at once, each named once with what repairs it, and the repair repairs it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from hsbench.datasets.faults import UPGRADE, Fault, dataset_faults
from hsbench.errors import DataError
from hsbench.io.atomic import write_json
from hsbench.io.dataset_index import unit_folders, write_index

OLD = Path(__file__).parents[2] / "fixtures" / "schema-0.1"


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A small data set as if it had been generated; that the contents of one episode are random does not matter."""
    copy = Path(shutil.copytree(OLD, tmp_path / "data"))
    description = json.loads((copy / "dataset.json").read_text())
    write_json(copy / "dataset.json", {**description, "name": "rgbd-activity", "seed": 0, "recipe_sha256": "0" * 64})
    write_index(copy)
    return copy


def all_faults(root: Path) -> list[Fault]:
    found = list(dataset_faults(root))
    return [fault for faults in found for fault in faults]


def repair_of(faults: list[Fault], start: str, word: str) -> str:
    """Of the one fault that names a thing and says a word of it."""
    (fault,) = (f for f in faults if f.text.startswith(start) and word in f.text)
    assert "\n" not in fault.text + fault.repair
    return fault.repair


def test_a_sound_data_set_has_none(rgbd: Path) -> None:
    steps = list(dataset_faults(rgbd))
    assert steps == [[]] * (len(unit_folders(rgbd)) + 2)


def test_a_folder_that_is_no_part_of_the_data_set(data: Path) -> None:
    before = all_faults(data)
    (data / "pred").mkdir()
    (fault,) = (fault for fault in all_faults(data) if fault not in before)
    assert fault.text == "pred/: extra, no part of a data set"
    assert fault.repair == f"remove {data / 'pred'}, or keep it elsewhere"


def test_all_kinds_in_one_run(data: Path) -> None:
    one, two, three = (u.name for u in unit_folders(data))
    episodes = data / "episodes"
    (episodes / one / "truth" / "events.parquet").unlink()
    (episodes / one / "note.txt").write_text("extra")
    maps = episodes / two / "inputs" / "activity_maps.npz"
    maps.write_bytes(maps.read_bytes()[:-5])
    descriptor = json.loads((episodes / three / "episode.json").read_text())
    (episodes / three / "episode.json").write_text(json.dumps({**descriptor, "schema_version": "7.0"}))
    scene = episodes / one / "truth" / "scene.npz"
    damaged = bytearray(scene.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    scene.write_bytes(damaged)
    (data / "episodes.parquet").write_bytes(b"PAR1")
    faults = all_faults(data)
    again = "run `hsbench generate rgbd-activity --seed 0 --out"
    repair = repair_of(faults, f"episodes/{one}/truth/events.parquet", "missing")
    assert repair.startswith(f"remove {episodes / one} and")
    assert again in repair
    assert (
        repair_of(faults, f"episodes/{one}/note.txt", "extra")
        == f"remove {episodes / one}/note.txt, or keep it elsewhere"
    )
    assert again in repair_of(faults, f"episodes/{two}/inputs/activity_maps.npz", "truncated")
    assert again in repair_of(faults, f"episodes/{three}/episode.json", "changed")
    assert repair_of(faults, f"episodes/{three}: ", "schema_version is '7.0'") == UPGRADE
    assert again in repair_of(faults, f"episodes/{one}/truth/scene.npz", "changed")
    assert repair_of(faults, "episodes.parquet", "changed").startswith("remove episodes.parquet and manifest.json")


DAMAGE: dict[str, Callable[[Path], object]] = {
    "missing": lambda path: path.unlink(),
    "empty": lambda path: path.write_bytes(b""),
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-30]),
    "another kind": lambda path: path.write_bytes(b"[1, 2]\n"),
    "no JSON": lambda path: path.write_bytes(b'{"a": }\n'),
    "newer": lambda path: path.write_bytes(b'{"schema_version": "9.9"}\n'),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_fault_is_one_line_that_names_its_file_and_nothing_twice(data: Path, damage: str) -> None:
    """A file of each kind: what is said anew names it, from the root of the data set, and advises no second run."""
    known = {fault.text for fault in all_faults(data)}
    unit = unit_folders(data)[0].relative_to(data).as_posix()
    own = ("episode.json", "inputs/poses.parquet", "truth/scene.npz", "manifest.json")
    names = ["dataset.json", "episodes.parquet", *(f"{unit}/{name}" for name in own)]
    for name in names[:-1] if damage == "newer" else names:
        path = data / name
        whole = path.read_bytes()
        DAMAGE[damage](path)
        new = [fault for fault in all_faults(data) if fault.text not in known]
        path.write_bytes(whole)
        assert [fault for fault in new if fault.text.startswith(f"{name}: ")], name
        for text, repair in ((fault.text, fault.repair) for fault in new):
            assert "\n" not in text
            assert str(data) not in text
            assert "hsbench verify" not in text + repair
        assert len({fault.text for fault in new}) == len(new)
        if damage in ("missing", "truncated") and not name.endswith("manifest.json"):
            assert sum(name in fault.text for fault in new) == 1, [fault.text for fault in new]


@pytest.mark.parametrize("name", ["manifest.json", "dataset.json", "episodes.parquet", "croissant.json"])
@pytest.mark.parametrize("content", [None, b"", b"[]", b"{"])
def test_no_file_of_the_whole_set_stops_the_run(data: Path, name: str, content: bytes | None) -> None:
    if content is None:
        (data / name).unlink()
    else:
        (data / name).write_bytes(content)
    first, _, last = unit_folders(data)
    (first / "index.json").write_bytes(b"")
    (last / "inputs" / "poses.parquet").unlink()
    faults = all_faults(data)
    assert [f for f in faults if name in f.text and f.repair]
    assert [f for f in faults if f"{first.name}/index.json" in f.text]
    assert [f for f in faults if f"{last.name}/inputs/poses.parquet: missing" in f.text]


@pytest.mark.parametrize("wrong", ["0", 0.5, None, True])
def test_a_time_that_is_no_whole_number(data: Path, wrong: object) -> None:
    unit = unit_folders(data)[0]
    descriptor = json.loads((unit / "episode.json").read_text())
    write_json(unit / "episode.json", {**descriptor, "t0_ns": wrong})
    repair_of(all_faults(data), f"episodes/{unit.name}: t0_ns is {wrong!r}", "expected whole nanoseconds")


def test_the_index_and_the_episodes_disagree(data: Path) -> None:
    first, second, _ = unit_folders(data)
    shutil.copytree(first, first.with_name("by-hand"))
    shutil.rmtree(second)
    faults = all_faults(data)
    assert repair_of(faults, "episodes/by-hand", "added by hand").startswith("remove ")
    assert f"remove {second}" in repair_of(faults, f"episodes/{second.name}", "missing")
    manifest = json.loads((data / "manifest.json").read_text())
    del manifest[f"episodes/{second.name}/manifest.json"]
    manifest["episodes/by-hand/manifest.json"] = manifest[f"episodes/{first.name}/manifest.json"]
    (data / "manifest.json").write_text(json.dumps(manifest))
    repair = repair_of(all_faults(data), "episodes.parquet: no row of by-hand", "expected one")
    assert repair.startswith("remove episodes")


@pytest.mark.parametrize(
    ("version", "repair"), [("9.9", UPGRADE), ("0.0", "fetch dataset.json again"), (None, "fetch")]
)
def test_versions_of_the_whole_set(data: Path, version: str | None, repair: str) -> None:
    description = json.loads((data / "dataset.json").read_text())
    (data / "dataset.json").write_text(json.dumps({**description, "schema_version": version}))
    assert repair_of(all_faults(data), "dataset.json: schema_version", "expected").startswith(repair)


def test_an_older_version_is_no_fault_and_captures_are_imported_again(tmp_path: Path) -> None:
    data = Path(shutil.copytree(OLD, tmp_path / "data"))
    assert not [f for f in all_faults(data) if "schema" in f.text or "manifest" in f.text]
    (data / "episodes" / "m-1" / "inputs" / "activity_maps.npz").write_bytes(b"")
    repair = repair_of(all_faults(data), "episodes/m-1/inputs/activity_maps.npz", "truncated")
    assert repair == f"remove {data / 'episodes' / 'm-1'}, and import it again"


def test_what_is_no_data_set_is_said_so(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"is this a data set\?"):
        all_faults(tmp_path)
