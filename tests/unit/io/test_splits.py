"""Splits: every scene number in one split only, in all data sets; sizes lie inside each other."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import pytest

import hsbench.io.resources as resources
import hsbench.io.splits as splits_module
from hsbench.errors import DataError
from hsbench.io.resources import KINDS, resource
from hsbench.io.splits import SPLITS, read_splits

FILES = sorted(resource("splits").glob("*/*.json"))
TASKS_V0 = {  # scenes of train, val, test-seen, test-novel
    "rgbd-activity": (200, 40, 30, 30),
    "activity-360": (120, 40, 30, 30),
    "timelapse-activity": (120, 40, 30, 30),
    "all-sensors": (40, 30, 20, 20),
    "activity-maps": (400, 25, 25, 25),  # of 20 samples each: 8000, 500, 500, 500
    "pairs": (0, 0, 40, 0),  # for a test of leaks, not to train on
}


def test_there_are_some() -> None:
    assert {f.parent.name for f in FILES} >= set(TASKS_V0)


@pytest.mark.parametrize("path", FILES, ids=lambda p: f"{p.parent.name}-{p.stem}")
def test_sizes_are_those_of_the_specification_and_nested(path: Path) -> None:
    splits = read_splits(path.parent.name, path.stem)
    assert (splits.dataset, splits.version) == (path.parent.name, path.stem)
    assert splits.status in ("draft", "released")
    counts = {size: [len(splits.numbers(size, name)) for name in SPLITS] for size in splits.scenes}
    assert counts["full"] == list(TASKS_V0[splits.dataset])
    assert counts["small"] == [n // 10 for n in counts["full"]]
    assert counts["mini"] == [min(most, n) for most, n in zip((2, 2, 1, 1), counts["full"], strict=True)]
    chosen = {size: splits.numbers(size) for size in splits.scenes}
    assert set(chosen["mini"]) < set(chosen["small"]) < set(chosen["full"])
    for size, units in chosen.items():
        assert len({number for number, _ in units}) == len(units)  # a scene number in one split only
        assert units == [u for name in SPLITS for u in splits.numbers(size, name)]
        assert all(number >= 0 for number, _ in units)


def test_a_scene_is_in_the_same_split_of_every_data_set() -> None:
    everywhere = [u for path in FILES for u in read_splits(path.parent.name, path.stem).numbers("full")]
    assert len({number for number, _ in everywhere}) == len(set(everywhere))


def test_ranges_leave_room_to_grow() -> None:
    """A split may be lengthened, a release being append-only, without running into the next."""
    first = {name: read_splits("rgbd-activity").scenes["full"][name] for name in SPLITS}
    for (a, n), (b, m) in itertools.combinations(first.values(), 2):
        assert a + 2 * n <= b or b + 2 * m <= a


def test_what_is_unknown_is_told_the_known() -> None:
    splits = read_splits("rgbd-activity")
    with pytest.raises(DataError, match="size 'tiny' is unknown; expected one of full, small, mini"):
        splits.numbers("tiny")
    with pytest.raises(DataError, match="split 'test' is unknown; expected one of train, val, test-seen, test-novel"):
        splits.numbers("mini", "test")
    with pytest.raises(DataError, match=r"nowhere.*v0\.json"):
        read_splits("nowhere")


HEAD = '{"dataset": "d", "version": "v0", "status": "draft", '


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[]",
        "{}",
        HEAD + '"first_scene": {"train": 0}, "sizes": {"full": {"train": 1}}}',
        HEAD + '"first_scene": 3, "sizes": {"full": {}}}',
        HEAD + '"first_scene": {}, "sizes": []}',
    ],
)
def test_a_damaged_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "v0.json").write_text(text)
    monkeypatch.setattr(splits_module, "resource", lambda kind: tmp_path)
    with pytest.raises(DataError, match=r"v0\.json"):
        read_splits("d")


def test_numbers_follow_first_scene_and_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    value = {
        "dataset": "d", "version": "v1", "status": "draft",
        "first_scene": {"train": 5, "val": 50, "test-seen": 60, "test-novel": 70},
        "sizes": {"full": {"train": 3, "val": 0, "test-seen": 1, "test-novel": 2}},
    }  # fmt: skip
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "v1.json").write_text(json.dumps(value))
    monkeypatch.setattr(splits_module, "resource", lambda kind: tmp_path)
    assert read_splits("d", "v1").numbers("full") == [
        (5, "train"), (6, "train"), (7, "train"), (60, "test-seen"), (70, "test-novel"), (71, "test-novel"),
    ]  # fmt: skip
    assert read_splits("d", "v1").numbers("full", "val") == []


def test_resources_come_from_the_wheel_first_then_from_the_checkout(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for kind in KINDS:
        assert resource(kind).is_dir()
        assert resource(kind).name == kind
    package = tmp_path / "hsbench"
    package.mkdir()
    monkeypatch.setattr(resources, "PACKAGE", package)
    with pytest.raises(DataError, match="splits/ is neither"):
        resource("splits")
    (tmp_path / "splits").mkdir()
    assert resource("splits") == tmp_path / "splits"
    (package / "bundled" / "splits").mkdir(parents=True)
    assert resource("splits") == package / "bundled" / "splits"
    with pytest.raises(DataError, match=r"'\.\./etc' is unknown; expected one of generators, splits, leaderboards"):
        resource("../etc")
