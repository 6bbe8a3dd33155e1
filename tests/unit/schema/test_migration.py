"""Frozen data sets of older schema versions open as they were meant: every value is what their files say."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench import load
from hsbench.errors import SchemaError
from hsbench.io.dataset_index import verify_files
from hsbench.io.scene_folder import read_scene
from hsbench.schema import SCHEMA_VERSION, Episode, category
from hsbench.schema.migration import STEPS, is_newer, migrated_episode, migrated_scene, steps_from

FIXTURES = Path(__file__).parents[2] / "fixtures"
OLDER = tuple(step.source for step in STEPS)
KINDS = {"film-1": "rgbd", "s-1": "equirectangular", "m-1": "topdown"}


@pytest.fixture(params=OLDER)
def old(request: pytest.FixtureRequest) -> Path:
    return FIXTURES / f"schema-{request.param}"


def by_hand(recording: Path, frame: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(rgb, depth_mm, instance) of a frame, as docs/schema.md says that a recording is read."""
    pictures = [
        cv2.imread(str(recording / "background_rgb.png"))[..., ::-1].copy(),
        cv2.imread(str(recording / "background_depth.png"), cv2.IMREAD_UNCHANGED),
        cv2.imread(str(recording / "background_instance.png"), cv2.IMREAD_UNCHANGED),
    ]
    row = pd.read_parquet(recording / "patches.parquet").iloc[frame]
    mask = np.unpackbits(np.frombuffer(row["mask"], np.uint8), bitorder="little")[: row["height"] * row["width"]]
    for at, k in enumerate(np.flatnonzero(mask)):
        y, x = row["row"] + k // row["width"], row["column"] + k % row["width"]
        pictures[0][y, x] = list(row["rgb"][3 * at : 3 * at + 3])
        for picture, name in ((pictures[1], "depth_mm"), (pictures[2], "instance")):
            picture[y, x] = int.from_bytes(row[name][2 * at : 2 * at + 2], "little")
    return pictures[0], pictures[1], pictures[2]


def test_each_version_has_a_step_to_the_next_and_a_frozen_data_set() -> None:
    assert all(a.target == b.source for a, b in pairwise(STEPS))
    assert STEPS[-1].target == SCHEMA_VERSION
    assert steps_from(SCHEMA_VERSION) == ()
    for version in OLDER:
        assert json.loads((FIXTURES / f"schema-{version}" / "dataset.json").read_text())["schema_version"] == version


def test_every_episode_opens_and_no_file_changes(old: Path) -> None:
    assert verify_files(old) == []
    inputs, episodes = load(old), load(old, truth=True)
    assert {e.episode_id: e.sensor.kind for e in episodes} == KINDS
    assert all(e.truth is None for e in inputs)
    for episode in episodes:
        descriptor = json.loads((old / "episodes" / episode.episode_id / "episode.json").read_text())
        assert descriptor["schema_version"] == old.name.removeprefix("schema-")
        assert (episode.t0_ns, episode.end_ns) == (descriptor["t0_ns"], descriptor["end_ns"])
        assert episode.sensor.height_m == descriptor["sensor"]["height_m"]
    assert verify_files(old) == []


def test_tables_say_what_pandas_reads(old: Path) -> None:
    for name in ("film-1", "s-1"):
        folder, episode = old / "episodes" / name, load(old, truth=True).episode(name)
        truth = episode.truth
        assert truth is not None
        assert truth.poses is not None
        assert truth.events is not None
        assert truth.objects is not None
        for table, poses in (("inputs", episode.poses), ("truth", truth.poses.poses)):
            rows = pd.read_parquet(folder / table / "poses.parquet")
            assert poses is not None
            assert len(poses) == len(rows) > 0
            for column in ("timestamp_ns", "track_id", "joint_state", "joints_m", "joints_px"):
                stored = getattr(poses, column)
                assert (stored is None) == (column not in rows)
                if stored is not None:
                    expected = np.array(rows[column].tolist()).reshape(stored.shape)
                    np.testing.assert_array_equal(stored, expected.astype(stored.dtype))
        events = pd.read_parquet(folder / "truth" / "events.parquet")
        assert list(truth.events.activity) == list(events["activity"])
        objects = pd.read_parquet(folder / "truth" / "objects.parquet")
        assert (objects["visible_px"] == truth.objects.visible_px).all()
        with np.load(folder / "truth" / "occupancy.npz") as arrays:
            assert truth.occupancy is not None
            assert truth.occupancy.seen_s is None
            np.testing.assert_array_equal(truth.occupancy.semantic, arrays["semantic"])


def test_pictures_are_those_of_the_files_and_have_no_noise(old: Path) -> None:
    episode = load(old, truth=True).episode("film-1")
    assert episode.truth is not None
    assert episode.truth.frames is not None
    assert len(episode.frames) == 3
    for k in range(3):
        rgb, depth_mm, instance = by_hand(old / "episodes" / "film-1" / "recording", k)
        np.testing.assert_array_equal(episode.frames[k].rgb, rgb)
        np.testing.assert_array_equal(episode.frames[k].depth_m, (depth_mm / 1000).astype(np.float32))
        np.testing.assert_array_equal(episode.truth.frames[k].instance, instance)


def test_the_scene_has_its_room_and_plain_textures(old: Path) -> None:
    folder = old / "episodes" / "film-1"
    written = json.loads((folder / "truth" / "scene.json").read_text())
    scene = read_scene(folder)
    assert scene.scene_id == written["scene_id"]
    (room,) = scene.rooms
    (expected,) = written.get("rooms", [{"room_type": written.get("room_type"), "outline_xy": written.get("room_xy")}])
    assert room.room_type == expected["room_type"]
    np.testing.assert_array_equal(room.outline_xy, expected["outline_xy"])
    assert len(scene.objects) == len(written["objects"]) > 2
    for item, told in zip(scene.objects, written["objects"], strict=True):
        assert (item.object_id, item.category_name) == (told["object_id"], told["category"])
        for part, was in zip(item.parts, told["parts"], strict=True):
            assert (part.name, list(part.colour), part.texture) == (was["name"], was["colour"], was.get("texture", ""))
            assert part.role == (was["role"] if was["role"] in category(told["category"]).roles else None)


def test_steps_leave_what_they_are_given_as_it_is(old: Path) -> None:
    """And the present version is handed through."""
    folder, version = old / "episodes" / "film-1", old.name.removeprefix("schema-")
    for name, migrate in (
        ("episode.json", migrated_episode),
        ("truth/scene.json", lambda value: migrated_scene(value, version)),
    ):
        value = json.loads((folder / name).read_text())
        copy = json.loads(json.dumps(value))
        migrate(value)
        assert value == copy
    present = {"schema_version": SCHEMA_VERSION, "anything": 1}
    assert migrated_episode(present) is present
    assert migrated_scene(present, SCHEMA_VERSION) is present


@pytest.mark.parametrize("version", ["0.5", "0.10", "1.0", "10.0"])
def test_a_newer_version_asks_for_a_newer_hsbench(version: str) -> None:
    with pytest.raises(SchemaError, match=rf"schema_version is '{version}'; expected '0\.4'.*upgrade hsbench"):
        steps_from(version)


@given(st.one_of(st.none(), st.text(), st.integers(), st.floats(), st.lists(st.integers()), st.booleans()))
def test_whatever_is_no_version_is_one_line(version: object) -> None:
    if version in (*OLDER, SCHEMA_VERSION):
        return
    with pytest.raises(SchemaError, match=r"is this an hsbench data set|upgrade hsbench") as error:
        steps_from(version)
    assert "\n" not in str(error.value)
    assert is_newer(version) == ("upgrade" in str(error.value))


def test_the_same_episode_in_both_versions_differs_in_what_the_newer_one_added() -> None:
    """The same builders made both."""

    def facts(version: str) -> Episode:
        return load(FIXTURES / f"schema-{version}", truth=True).episode("s-1")

    older, newer = facts("0.1"), facts("0.2")
    assert older.truth is not None
    assert newer.truth is not None
    assert older.truth.motions is None
    assert newer.truth.motions is not None
    for old_frame, new_frame in zip(older.frames, newer.frames, strict=True):  # type: ignore[call-overload]
        np.testing.assert_array_equal(old_frame.rgb, new_frame.rgb)
    for a, b in zip(older.truth.scene.objects, newer.truth.scene.objects, strict=True):  # type: ignore[union-attr]
        np.testing.assert_array_equal(a.box, b.box)
