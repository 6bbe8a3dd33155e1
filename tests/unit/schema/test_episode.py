"""Episodes of every sensor kind through the disk and back, and what a shorter watching would have given."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from episode_builders import (
    SENSORS,
    affordance,
    events,
    motions,
    object_truth,
    occupancy,
    poses,
    same,
    scene,
    true_poses,
)

from hsbench.errors import DataError, SchemaError
from hsbench.io.checksums import manifest
from hsbench.io.episodes import category_of_instance, read_episode, write_episode
from hsbench.io.frame_store import Film, Patch, Picture
from hsbench.schema import CATEGORIES, ActivityMaps, Episode, EpisodeTruth, Frame, FrameTruth, category
from hsbench.schema.episode import NS_PER_S, FrameList

END_NS = 900_000_000
STAMPS = np.array([0, 200_000_000, 900_000_000], dtype=np.int64)
TRUTH = EpisodeTruth(scene(), true_poses(), events(), occupancy(), object_truth(), affordance(), motions())


def pictures(height: int, width: int, depth: bool) -> FrameList:
    """Three frames, depth in whole millimetres, none in places."""
    rng = np.random.default_rng(4)
    return FrameList(
        tuple(
            Frame(
                int(t),
                rng.integers(0, 256, (height, width, 3), dtype=np.uint8),
                (rng.integers(0, 9000, (height, width)) / 1000.0).astype(np.float32) if depth else None,
            )
            for t in STAMPS
        )
    )


def rgbd() -> Episode:
    observed = poses(metres=True, pixels=True)
    return Episode("r-1", "rgbd-activity", SENSORS["rgbd"], pictures(18, 24, True), observed, 0, END_NS, truth=TRUTH)


def equirectangular() -> Episode:
    observed = poses(skeleton="coco-18", metres=False, pixels=True)
    frames = pictures(16, 32, False)
    return Episode("s-1", "activity-360", SENSORS["equirectangular"], frames, observed, 0, END_NS, truth=TRUTH)


def monocular() -> Episode:
    observed = poses(skeleton="body-25", metres=False, pixels=True)
    truth = EpisodeTruth(scene=scene(mesh=False), affordance=affordance())
    frames = pictures(18, 24, False)
    return Episode("t-1", "timelapse-activity", SENSORS["monocular"], frames, observed, -5, END_NS + 3, truth=truth)


def topdown() -> Episode:
    maps = np.random.default_rng(0).random((2, 16, 16), dtype=np.float32)
    activity = ActivityMaps(maps, ("walk", "sit"), None)
    truth = EpisodeTruth(affordance=affordance())
    return Episode("m-1", "activity-maps", SENSORS["topdown"], FrameList(), None, 0, 600 * NS_PER_S, activity, truth)


EPISODES = {"rgbd": rgbd, "equirectangular": equirectangular, "monocular": monocular, "topdown": topdown}


def same_frames(a: Episode, b: Episode) -> bool:
    return same(a.frames.timestamps_ns, b.frames.timestamps_ns) and all(
        same(a.frames[i], b.frames[i]) for i in range(-len(a.frames), len(a.frames))
    )


def without_frames(episode: Episode) -> Episode:
    """Two episodes whose frames lie elsewhere, compared in everything else."""
    return replace(episode, frames=FrameList())


# ---------------------------------------------------------------- to disk and back


@pytest.mark.parametrize("kind", EPISODES)
def test_an_episode_of_every_sensor_comes_back_whole(kind: str, tmp_path: Path) -> None:
    episode = EPISODES[kind]()
    write_episode(tmp_path / "e", episode, "scene-000012", "val", "raycast")
    back = read_episode(tmp_path / "e", truth=True)
    assert len(back.frames) == len(episode.frames)
    assert same_frames(back, episode)
    assert same(without_frames(back), without_frames(episode))


@pytest.mark.parametrize("kind", EPISODES)
def test_truth_and_pictures_are_handed_out_only_when_asked_for(kind: str, tmp_path: Path) -> None:
    episode = EPISODES[kind]()
    write_episode(tmp_path / "e", episode, "scene-000012", "val")
    inputs = read_episode(tmp_path / "e", frames=False)
    assert inputs.truth is None
    assert len(inputs.frames) == 0
    assert same(inputs, replace(without_frames(episode), truth=None))
    assert same_frames(read_episode(tmp_path / "e"), episode)


def test_inputs_do_not_need_the_folder_of_truth(tmp_path: Path) -> None:
    write_episode(tmp_path / "e", rgbd(), "scene-000012", "val")
    for path in (tmp_path / "e" / "truth").iterdir():
        path.unlink()
    assert same_frames(read_episode(tmp_path / "e"), rgbd())
    assert same(read_episode(tmp_path / "e", truth=True).truth, EpisodeTruth())


def test_an_empty_episode_comes_back_empty(tmp_path: Path) -> None:
    none = poses(n=0)
    truth = EpisodeTruth(poses=true_poses(0), events=replace_events())
    episode = Episode("e", "d", SENSORS["rgbd"], FrameList(), none, 7, 7, truth=truth)
    write_episode(tmp_path / "e", episode, "s", "train")
    assert same(read_episode(tmp_path / "e", truth=True), episode)


def replace_events():
    table = events()
    none = np.zeros(0, dtype=np.int32)
    return replace(
        table, person_id=none, activity=(), object_id=none, part=(), start_ns=np.zeros(0, dtype=np.int64),
        end_ns=np.zeros(0, dtype=np.int64), contact=(),
    )  # fmt: skip


def test_the_row_of_the_index_and_the_manifest(tmp_path: Path) -> None:
    write_episode(tmp_path / "e", rgbd(), "scene-000012", "val", "raycast")
    assert json.loads((tmp_path / "e" / "index.json").read_text()) == {
        "episode_id": "r-1",
        "scene_id": "scene-000012",
        "split": "val",
        "duration_s": 0.9,
        "n_frames": 3,
        "n_poses": 6,
        "renderer": "raycast",
    }
    listed = json.loads((tmp_path / "e" / "manifest.json").read_text())
    (tmp_path / "e" / "manifest.json").unlink()
    assert manifest(tmp_path / "e") == listed
    with pytest.raises(DataError):
        write_episode(tmp_path / "e", rgbd(), "scene-000012", "val")


def test_writing_twice_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_episode(tmp_path / name, rgbd(), "scene-000012", "val")
    assert (tmp_path / "a" / "manifest.json").read_bytes() == (tmp_path / "b" / "manifest.json").read_bytes()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema_version": "99"}, "schema_version is '99'; expected"),
        ({"note": 1}, r"episode lacks \[\] and has unknown \['note'\]"),
        ({"frames": "video"}, "frames is 'video'; expected recording, images or none"),
        ({"end_ns": -1}, "ends at -1 ns, before it starts"),
        ({"episode_id": "a/b"}, "episode_id is 'a/b'"),
    ],
)
def test_a_changed_descriptor_is_refused_with_the_folder(tmp_path: Path, change: dict, message: str) -> None:
    write_episode(tmp_path / "e", rgbd(), "scene-000012", "val")
    path = tmp_path / "e" / "episode.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(SchemaError, match=message) as error:
        read_episode(tmp_path / "e")
    assert str(error.value).startswith(str(tmp_path / "e"))


def test_missing_and_damaged_files_are_data_errors(tmp_path: Path) -> None:
    write_episode(tmp_path / "e", rgbd(), "scene-000012", "val")
    (tmp_path / "e" / "inputs" / "poses.parquet").write_bytes(b"no table")
    with pytest.raises(DataError, match=r"poses\.parquet cannot be read"):
        read_episode(tmp_path / "e")
    with pytest.raises(DataError, match=r"episode\.json"):
        read_episode(tmp_path / "nowhere")


# ---------------------------------------------------------------- recordings


def film() -> Film:
    rng = np.random.default_rng(1)
    background = Picture(
        rng.integers(0, 256, (18, 24, 3), dtype=np.uint8),
        rng.integers(500, 5000, (18, 24)).astype(np.uint16),
        rng.choice([0, 1, 4], (18, 24)).astype(np.uint16),
    )

    def patch(index: int) -> Patch:
        mask = np.random.default_rng(index).random((6, 5)) < 0.6
        picture = Picture(
            np.full((6, 5, 3), 10 * index, dtype=np.uint8),
            np.full((6, 5), 1000 + index, dtype=np.uint16),
            np.full((6, 5), 60001, dtype=np.uint16),
        )
        return Patch(int(STAMPS[index]), 3 * index, 2 + index, mask, picture)

    return Film(background, STAMPS, patch, 77, "kinect")


def test_a_recording_comes_back_with_its_noise_and_its_truth(tmp_path: Path) -> None:
    episode = replace(rgbd(), frames=film())
    write_episode(tmp_path / "e", episode, "scene-000012", "val")
    back = read_episode(tmp_path / "e", truth=True)
    assert same_frames(back, episode)
    assert same(replace(without_frames(back), truth=None), replace(without_frames(episode), truth=None))
    assert back.truth is not None
    assert same(replace(back.truth, frames=None), TRUTH)
    assert back.truth.frames is not None
    clean = read_episode(tmp_path / "e", depth_noise="none")
    for i in range(3):
        truth, picture = back.truth.frames[i], film().picture(i)
        assert same(truth.instance, picture.instance)
        assert np.array_equal(truth.depth_m, (picture.depth_mm / 1000.0).astype(np.float32))
        assert np.array_equal(clean.frames[i].depth_m, truth.depth_m)
        assert not np.array_equal(back.frames[i].depth_m, truth.depth_m)
        person = len(CATEGORIES) + 1
        expected = np.select(
            [picture.instance == 1, picture.instance == 4, picture.instance > 60000],
            [category("wall").category_id, category("dining_table").category_id, person],
        )
        assert np.array_equal(truth.semantic, expected)


def test_categories_of_instances() -> None:
    table = category_of_instance(scene())
    assert table.shape == (65536,)
    assert {int(i): int(table[i]) for i in np.flatnonzero(table[:60001])} == {
        item.object_id: item.category.category_id for item in scene().objects
    }
    assert (table[60001:] == len(CATEGORIES) + 1).all()


# ---------------------------------------------------------------- a shorter watching


class TruthOfFrames:
    def __len__(self) -> int:
        return 3

    def __getitem__(self, index: int) -> FrameTruth:
        return FrameTruth(int(STAMPS[index]))


@pytest.mark.parametrize(
    ("seconds", "frames", "rows"),
    [(0.0, 1, 2), (0.0999, 1, 2), (0.1, 1, 4), (0.2, 2, 6), (0.899999999, 2, 6), (0.9, 3, 6), (50.0, 3, 6),
     (float("inf"), 3, 6)],
)  # fmt: skip
def test_until_keeps_what_was_seen_by_then(seconds: float, frames: int, rows: int) -> None:
    episode = replace(rgbd(), truth=replace(TRUTH, frames=TruthOfFrames()))
    short = episode.until(seconds)
    assert len(short.frames) == frames
    assert len(short.poses) == rows
    assert short.end_ns == min(END_NS, 10**9 if seconds > 1 else round(seconds * 1e9))
    assert short.duration_s <= seconds
    assert same(short.frames.timestamps_ns, STAMPS[:frames])
    assert [same(short.frames[i], episode.frames[i]) for i in range(frames)] == [True] * frames
    assert same(short.frames[-1], episode.frames[frames - 1])
    with pytest.raises(IndexError):
        short.frames[frames]
    assert same(short.poses, episode.poses.select(slice(rows)))
    assert same(short.truth.poses.match, TRUTH.poses.match[:rows])
    assert same(short.truth.poses.poses, TRUTH.poses.poses)
    assert len(short.truth.frames) == frames
    assert short.truth.frames[-1].timestamp_ns == STAMPS[frames - 1]
    with pytest.raises(IndexError):
        short.truth.frames[frames]
    assert same(replace(short.truth, poses=None, frames=None), replace(TRUTH, poses=None, frames=None))


def test_until_counts_from_the_first_time_stamp() -> None:
    late = Episode("e", "d", SENSORS["monocular"], FrameList((Frame(100), Frame(2 * 10**9))), None, 100, 3 * 10**9)
    assert late.until(1.9).end_ns == 100 + 1_900_000_000
    assert [len(late.until(s).frames) for s in (0.0, 1.9, 1.9999999, 2.0)] == [1, 1, 2, 2]


def test_until_twice_is_until_the_shorter() -> None:
    once, twice = rgbd().until(0.1), rgbd().until(0.5).until(0.1)
    assert same(without_frames(once), without_frames(twice))
    assert same_frames(once, twice)


@pytest.mark.parametrize("seconds", [-0.1, float("nan"), -float("inf")])
def test_until_needs_a_time(seconds: float) -> None:
    with pytest.raises(SchemaError, match=r"until_s is .*; expected seconds >= 0"):
        rgbd().until(seconds)
