"""Loading: the right episodes, inputs only, anywhere; what is wrong on disk is one line that names it."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import pickle
import subprocess
import sys
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import hsbench
from hsbench import load
from hsbench.datasets.dataset import Dataset
from hsbench.errors import DataError, HsbenchError, SchemaError
from hsbench.io.frame_store import Picture, Recording, RecordingTruth
from hsbench.schema import (
    EpisodeTruth,
    EventTable,
    FrameTruth,
    ObjectTruth,
    OccupancyTruth,
    Scene,
    TruePoseTable,
)
from hsbench.schema.episode import Episode
from hsbench.schema.scene import SceneObject
from hsbench.schema.states import Visibility

ROOT = Path(hsbench.__file__).parents[1]


def digest(episode: Episode) -> str:
    """A hash of every input of an episode."""
    poses = episode.poses
    assert poses is not None
    parts = [poses.timestamp_ns, poses.track_id, poses.joint_state, poses.joints_m, episode.frames.timestamps_ns]
    for frame in (episode.frames[k] for k in range(len(episode.frames))):
        parts += [frame.rgb, frame.depth_m]
    text = f"{episode.episode_id} {episode.sensor} {episode.t0_ns} {episode.end_ns}"
    return hashlib.sha256(text.encode() + b"".join(p.tobytes() for p in parts)).hexdigest()


# ---------------------------------------------------------------- which episodes


def test_where_chooses_by_split_sensor_people_and_visibility(rgbd: Path) -> None:
    data = load(rgbd, truth=True)
    assert data.where().episode_ids == data.episode_ids
    assert data.where(split="val").episode_ids == load(rgbd, "val").episode_ids
    assert load(rgbd).where(sensor="rgbd").episode_ids == data.episode_ids
    assert len(data.where(sensor="equirectangular")) == 0
    people = {e.episode_id: len(set(e.truth.poses.poses.track_id.tolist())) for e in data}
    for count in (0, 1, 2, 3, 9):
        assert data.where(people=count).episode_ids == tuple(k for k, n in people.items() if n == count)
    assert data.where(people=(1, 2)).episode_ids == tuple(k for k, n in people.items() if 1 <= n <= 2)
    hidden = tuple(e.episode_id for e in data if (e.truth.objects.visibility == Visibility.FULLY_OCCLUDED).any())
    chosen = data.where(visibility=Visibility.FULLY_OCCLUDED, people=(0, 9), sensor="rgbd")
    assert chosen.episode_ids == hidden
    assert chosen.truth  # what comes out is read as before
    assert len(chosen[:1]) == min(1, len(hidden))
    with pytest.raises(SchemaError, match="expected a data set loaded with truth=True"):
        load(rgbd).where(people=1)
    with pytest.raises(SchemaError, match="expected one of rgbd"):
        data.where(sensor="kinect")


def test_by_path_and_by_name(rgbd: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    by_path = load(rgbd)
    assert by_path.episode_ids == load(str(rgbd)).episode_ids
    monkeypatch.setenv("HSBENCH_DATA", str(rgbd.parent))
    monkeypatch.chdir(rgbd.parent.parent)
    assert load(rgbd.name).root == rgbd
    assert digest(load(rgbd.name)[0]) == digest(by_path[0])
    for name in ("nothing", f"x/{rgbd.name}", "..x"):
        with pytest.raises(DataError, match=r"is no folder .*HSBENCH_DATA"):
            load(name)
    monkeypatch.delenv("HSBENCH_DATA")
    with pytest.raises(DataError, match="is no folder"):
        load(rgbd.name)


def test_a_split_is_its_rows(rgbd: Path) -> None:
    whole = load(rgbd)
    by_split = {name: load(rgbd, name) for name in ("train", "val", "test-seen", "test-novel")}
    assert {name: len(data) for name, data in by_split.items()} == {
        "train": 2,
        "val": 2,
        "test-seen": 1,
        "test-novel": 1,
    }
    assert sorted(i for data in by_split.values() for i in data.episode_ids) == sorted(whole.episode_ids)
    assert set(whole.scene_ids) == {i.replace("rgbd-activity", "scene") for i in whole.episode_ids}
    with pytest.raises(DataError, match="no episode of split 'test'; found test-novel, test-seen, train, val"):
        load(rgbd, "test")


def test_indexing_slicing_and_iteration_agree(rgbd: Path) -> None:
    data = load(rgbd)
    ids = list(data.episode_ids)
    assert [e.episode_id for e in data] == ids == [data[k].episode_id for k in range(len(data))]
    for cut in (slice(1, 3), slice(None, None, -1), slice(4, 99), slice(0, 0)):
        part = data[cut]
        assert isinstance(part, Dataset)
        assert list(part.episode_ids) == ids[cut]
        assert [e.episode_id for e in part] == ids[cut]
    assert data[-1].episode_id == ids[-1]
    assert data.episode(ids[2]).episode_id == ids[2]
    for beyond in (len(data), -len(data) - 1):
        with pytest.raises(IndexError):
            data[beyond]
    with pytest.raises(DataError, match="no episode 'ep-9'"):
        data.episode("ep-9")
    with pytest.raises(DataError, match="in this selection of 1"):
        data[:1].episode(ids[1])


def test_a_slice_keeps_how_episodes_are_read(rgbd: Path) -> None:
    part = load(rgbd, truth=True, until_s=3.0, frames=False)[1:2]
    assert part[0].truth is not None
    assert part[0].duration_s == 3.0
    assert len(part[0].frames) == 0


@pytest.mark.parametrize("until_s", [0.0, 0.5, 3.0, 3.01, 12.0, 1e6])
def test_until_is_a_prefix_of_every_input(rgbd: Path, until_s: float) -> None:
    whole, part = load(rgbd, truth=True)[0], load(rgbd, until_s=until_s, truth=True)[0]
    end_ns = min(whole.end_ns, round(until_s * 1e9))
    assert part.end_ns == end_ns
    assert part.t0_ns == whole.t0_ns == 0
    n = int((whole.poses.timestamp_ns <= end_ns).sum())
    assert len(part.poses) == n
    for name in ("timestamp_ns", "track_id", "joint_state", "joints_m"):
        assert np.array_equal(getattr(part.poses, name), getattr(whole.poses, name)[:n], equal_nan=name == "joints_m")
    assert np.array_equal(part.truth.poses.match, whole.truth.poses.match[:n])
    stamps = whole.frames.timestamps_ns
    assert np.array_equal(part.frames.timestamps_ns, stamps[stamps <= end_ns])
    for k in (0, len(part.frames) - 1):
        assert np.array_equal(part.frames[k].depth_m, whole.frames[k].depth_m)
    assert np.array_equal(part.frames[-1].rgb, whole.frames[len(part.frames) - 1].rgb)
    for beyond in (len(part.frames), -len(part.frames) - 1):
        with pytest.raises(IndexError):
            part.frames[beyond]


@pytest.mark.parametrize("wrong", [-1.0, float("nan")])
def test_until_must_be_seconds(rgbd: Path, wrong: float) -> None:
    with pytest.raises(SchemaError, match="until_s"):
        load(rgbd, until_s=wrong)[0]


def test_without_frames_the_rest_is_the_same(rgbd: Path) -> None:
    blind, whole = load(rgbd, frames=False)[1], load(rgbd)[1]
    assert len(blind.frames) == 0
    assert len(whole.frames) == -(-whole.end_ns // 500_000_000) > 20  # 2 Hz from t0, before the end
    assert np.array_equal(blind.poses.joints_m, whole.poses.joints_m, equal_nan=True)
    assert blind.sensor == whole.sensor


def test_depth_noise_can_be_chosen_and_none_is_the_clean_depth(rgbd: Path) -> None:
    noisy, clean, truth = load(rgbd)[0], load(rgbd, depth_noise="none")[0], load(rgbd, truth=True)[0].truth
    for k in (0, 10):
        exact = truth.frames[k].depth_m
        assert np.array_equal(clean.frames[k].depth_m, exact)
        assert np.array_equal(clean.frames[k].rgb, noisy.frames[k].rgb)
        read = noisy.frames[k].depth_m
        assert 0.5 < np.mean((read != exact) & (read > 0)) < 1.0
    with pytest.raises(SchemaError, match="'loud'; expected one of kinect, mild, harsh, none"):
        load(rgbd, depth_noise="loud")[0].frames[0]


def test_the_description_is_the_file(rgbd: Path) -> None:
    data = load(rgbd)
    assert data.description == json.loads((rgbd / "dataset.json").read_text())
    assert data.name == "rgbd-activity"
    assert data.manifest_sha256 == hashlib.sha256((rgbd / "manifest.json").read_bytes()).hexdigest()


# ---------------------------------------------------------------- inputs only

TRUTH_TYPES = (
    EpisodeTruth, EventTable, FrameTruth, ObjectTruth, OccupancyTruth, Picture, Recording, RecordingTruth, Scene,
    SceneObject, TruePoseTable,
)  # fmt: skip


def reachable(root: object) -> Iterator[Any]:
    """Every object that public attributes, items and elements lead to, properties included."""
    seen: dict[int, object] = {}  # holds what it names, so that no id comes twice
    pending = [root]
    while pending:
        item = pending.pop()
        if id(item) in seen or callable(item):
            continue
        seen[id(item)] = item
        yield item
        if item is None or isinstance(item, str | bytes | int | float | Enum | Path | np.generic | np.ndarray):
            continue
        if isinstance(item, dict):
            pending += item.values()
            continue
        if hasattr(item, "__getitem__") and hasattr(item, "__len__"):
            pending += [item[k] for k in range(len(item))]
        for name in dir(item):
            if not name.startswith("_"):
                try:
                    value = getattr(item, name)
                except (AttributeError, HsbenchError):
                    continue
                pending.append(value)


def arrays_of(items: list[Any]) -> list[np.ndarray]:
    return [i for i in items if isinstance(i, np.ndarray)]


def test_no_truth_is_reachable_unless_asked_for(rgbd: Path) -> None:
    truth = load(rgbd, truth=True)[0].truth
    found = list(reachable(load(rgbd, until_s=2.0)[0]))
    assert len(arrays_of(found)) > 10  # the walk arrives at pictures and poses
    assert [type(i) for i in found if isinstance(i, TRUTH_TYPES)] == []
    first = truth.frames[0]
    secrets = [first.depth_m, first.instance, first.semantic]
    secrets += [truth.poses.poses.joints_m, truth.poses.action, truth.poses.match, truth.occupancy.semantic]
    secrets += [truth.occupancy.state, truth.events.object_id, truth.objects.visible_px]
    secrets += [room.outline_xy for room in truth.scene.rooms]
    for secret in secrets:
        assert secret.size
        for array in arrays_of(found):
            assert array.shape != secret.shape or not np.array_equal(array, secret)
    assert truth.scene.style not in [i for i in found if isinstance(i, str)]


def test_the_walk_would_find_it(rgbd: Path) -> None:
    found = [type(i) for i in reachable(load(rgbd, until_s=0.5, truth=True)[0])]
    assert set(TRUTH_TYPES) <= set(found)


def test_every_field_of_an_input_episode_is_an_input(rgbd: Path) -> None:
    episode = load(rgbd)[0]
    assert episode.truth is None
    given = {f.name for f in dataclasses.fields(episode) if getattr(episode, f.name) is not None}
    assert given == {"episode_id", "dataset", "sensor", "frames", "poses", "t0_ns", "end_ns"}
    frame = episode.frames[3]
    assert {f.name for f in dataclasses.fields(frame)} == {"timestamp_ns", "rgb", "depth_m"}
    assert (frame.rgb.dtype, frame.depth_m.dtype) == (np.uint8, np.float32)


# ---------------------------------------------------------------- other processes, read-only places


def test_data_sets_and_episodes_travel_to_another_process(rgbd: Path) -> None:
    data = load(rgbd, "val", until_s=2.0)
    episode = data[1]
    here = [digest(data[0]), digest(episode)]
    code = (
        "import pickle, sys\n"
        "from tests.unit.datasets.test_dataset import digest\n"
        "data, episode = pickle.loads(sys.stdin.buffer.read())\n"
        "print(digest(data[0]), digest(episode))\n"
    )
    sent = pickle.dumps((data, episode))
    done = subprocess.run([sys.executable, "-c", code], input=sent, capture_output=True, cwd=ROOT, check=True)
    assert done.stdout.decode().split() == here


def test_reading_writes_nothing(rgbd_copy: Path) -> None:
    def snapshot() -> dict[str, tuple[int, str]]:
        return {
            str(p): (p.stat().st_mtime_ns, hashlib.sha256(p.read_bytes()).hexdigest() if p.is_file() else "")
            for p in sorted(rgbd_copy.rglob("*"))
        }

    before = snapshot()
    places = [rgbd_copy, *rgbd_copy.rglob("*")]
    for place in places:
        place.chmod(place.stat().st_mode & ~0o222)
    try:
        data = load(rgbd_copy, truth=True)
        hashes = [digest(e) for e in data]
        assert all(e.truth.frames[0].depth_m is not None for e in data)
        assert len(set(hashes)) == 6
    finally:
        for place in places:
            place.chmod(place.stat().st_mode | 0o200)
    assert snapshot() == before


# ---------------------------------------------------------------- what is wrong


def first_unit(root: Path) -> Path:
    return sorted((root / "episodes").iterdir())[0]


def read_all(root: Path) -> Episode:
    """Everything of the first episode, decoded."""
    episode = load(root, truth=True)[0]
    for k in range(len(episode.frames)):
        assert episode.frames[k].rgb is not None
        assert episode.truth.frames[k].depth_m is not None
    assert episode.truth.scene.objects[0].solids
    return episode


def one_line(error: BaseException) -> str:
    assert len(str(error).splitlines()) == 1
    return str(error)


def test_a_half_made_data_set_says_what_to_do(rgbd_copy: Path, tmp_path: Path) -> None:
    (rgbd_copy / "episodes.parquet").unlink()
    with pytest.raises(DataError, match=r"episodes\.parquet is missing \(was its generation stopped\? run it again\)"):
        load(rgbd_copy)
    with pytest.raises(DataError, match=r"is this a data set\?"):
        load(tmp_path)


def test_an_indexed_episode_that_is_gone_is_named(rgbd_copy: Path) -> None:
    unit = first_unit(rgbd_copy)
    unit.rename(rgbd_copy / "elsewhere")
    data = load(rgbd_copy)
    with pytest.raises(DataError, match=unit.name):
        data[0]
    assert data[1].episode_id == data.episode_ids[1]


@pytest.mark.parametrize("version", ["0.0", "9.9", None, 1])
def test_another_schema_version_is_refused(rgbd_copy: Path, version: object) -> None:
    path = first_unit(rgbd_copy) / "episode.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "schema_version": version}))
    with pytest.raises(SchemaError, match=r"schema_version is .*; expected '0\.4'") as error:
        load(rgbd_copy)[0]
    assert first_unit(rgbd_copy).name in one_line(error.value)


@pytest.mark.parametrize("value", [np.nan, np.inf, 5000.0])
def test_impossible_joints_are_named(rgbd_copy: Path, value: float) -> None:
    path = first_unit(rgbd_copy) / "inputs" / "poses.parquet"
    table = pq.read_table(path)
    row = next(k for k, s in enumerate(table["joint_state"].to_pylist()) if s[3] == 2)
    joints = np.array(table["joints_m"].combine_chunks().flatten()).reshape(len(table), 75)
    joints[row, 9] = value  # x of the head
    column = pa.FixedSizeListArray.from_arrays(pa.array(joints.ravel()), 75)
    pq.write_table(table.set_column(table.column_names.index("joints_m"), "joints_m", column), path)
    expected = "are these millimetres" if value == 5000.0 else rf"joints_m row {row} joint head"
    with pytest.raises(SchemaError, match=expected) as error:
        load(rgbd_copy)[0]
    assert first_unit(rgbd_copy).name in one_line(error.value)


def test_any_cut_of_any_file_is_one_line_that_names_it(rgbd_copy: Path) -> None:
    read_all(rgbd_copy)
    files = [p for p in first_unit(rgbd_copy).rglob("*") if p.suffix in (".parquet", ".npz", ".png", ".json")]
    files = [p for p in files if p.name not in ("manifest.json", "index.json")]
    assert len(files) >= 12
    for path in [*sorted(files), rgbd_copy / "episodes.parquet"]:
        whole = path.read_bytes()
        for kept in (0, 1, len(whole) // 3, len(whole) // 2, len(whole) - 2):
            path.write_bytes(whole[:kept])
            with pytest.raises(HsbenchError) as error:
                read_all(rgbd_copy)
            assert path.name in one_line(error.value), (path.name, kept)
        path.write_bytes(whole)
    read_all(rgbd_copy)


@pytest.mark.parametrize("name", ["episode.json", "truth/scene.json", "truth/occupancy.json"])
def test_any_other_value_in_a_description_is_an_error_or_lets_be(rgbd_copy: Path, name: str) -> None:
    """Whatever a JSON leaf or branch is replaced by: never anything but one line of a HsbenchError."""
    path = first_unit(rgbd_copy) / name
    text = path.read_text()
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(80):
        value = json.loads(text)
        parent, key = value, None
        while isinstance(parent, dict | list) and len(parent):
            key = rng.choice(sorted(parent)) if isinstance(parent, dict) else int(rng.integers(len(parent)))
            if not isinstance(parent[key], dict | list) or rng.random() < 0.25:
                break
            parent = parent[key]
        junk = [None, "x", -1, 1e300, 10**30, [], {}, [1, 2], True, 0.5]
        parent[key] = junk[int(rng.integers(len(junk)))]
        path.write_text(json.dumps(value))
        try:
            episode = load(rgbd_copy, truth=True)[0]
            assert episode.frames[0].rgb is not None
        except HsbenchError as error:
            one_line(error)
            refused += 1
    assert refused > 20


def test_files_of_another_part_of_the_truth_are_missed(rgbd_copy: Path) -> None:
    truth = first_unit(rgbd_copy) / "truth"
    for name in ("scene.npz", "occupancy.npz", "match.parquet"):
        held = (truth / name).read_bytes()
        (truth / name).unlink()
        with pytest.raises(DataError, match=name):
            read_all(rgbd_copy)
        (truth / name).write_bytes(held)
    (truth / "scene.npz").write_bytes((truth / "occupancy.npz").read_bytes())
    with pytest.raises(HsbenchError, match=first_unit(rgbd_copy).name):
        read_all(rgbd_copy)
