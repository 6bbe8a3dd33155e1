"""Inputs leak nothing: neither what a loader hands out without truth, nor what a packed hidden split holds."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest

from hsbench import load
from hsbench.datasets.faults import dataset_faults
from hsbench.datasets.packing import FILE_TIME_S, pack_inputs, pack_truth
from hsbench.evaluation.score import score
from hsbench.geometry.cameras import TopDownCamera, world_T_camera
from hsbench.io.atomic import write_json
from hsbench.io.checksums import manifest
from hsbench.io.dataset_index import unit_folders, write_index
from hsbench.io.splits import read_splits
from hsbench.io.strict_json import read_json
from hsbench.schema import Episode
from hsbench.submission import Metadata, write_submission
from hsbench.synth.generate import Job, generate
from hsbench.tasks import TASKS, TaskSpec
from tests.contract.leaks import decoded, held, keys_of, reachable, secret_arrays
from tests.contract.test_tasks import RANDOM

SEED = 0x5EED_0123_4567_89AB_CDEF_0F1E_2D3C_4B5A  # 128 bits
SENSORS = ("rgbd-activity", "activity-360", "timelapse-activity", "activity-maps", "all-sensors")
"""Recipes of every sensor. But for the first, they are filmed for these tests alone, and only at t0."""

INPUT = re.compile(
    r"episode(\.(episode_id|dataset|t0_ns|end_ns|duration_s|truth|activity_maps|poses|frames|sensor|placed_sensor"
    r"|sensor\.(kind|height_m|tilt_rad|roll_rad|world_T_camera|camera(\.pinhole)?(\.\w+_px|\.cell_m)?"
    r"|camera\.(k1|k2|p1|p2|k3|distortion(\[\])?|reach))"
    r"|frames\.(timestamps_ns|has_depth|image_noise|noise_preset|noise_seed|folder|background|_video|frames)"
    r"|frames\[\](\.(timestamp_ns|rgb|depth_m))?"
    r"|poses\.(skeleton|timestamp_ns|track_id|joint_state|joints_m|joints_px|layout.*)"
    r"|activity_maps\.(maps|cell_m|channels(\[\])?)))?"
)
"""Every path that may lead to something without truth."""

FILE = re.compile(
    r"(dataset|croissant|manifest)\.json|episodes\.parquet|episodes/[a-z0-9-]+-hidden-\d{6}/"
    r"((episode|index|manifest)\.json|inputs/(poses\.parquet|activity_maps\.npz|frames/(frames\.parquet"
    r"|\d{6}_(rgb|depth)\.png)))"
)
DESCRIPTION = {"schema_version", "hsbench_version", "name", "splits_version", "licence", "categories"}
DESCRIPTOR = {
    "schema_version", "episode_id", "dataset", "t0_ns", "end_ns", "sensor", "frames", "depth_noise", "image_noise",
    "kind", "camera", "height_m", "tilt_rad", "roll_rad", "model", "width_px", "height_px", "fx_px", "fy_px", "cx_px",
    "cy_px", "k1", "k2", "p1", "p2", "k3", "cell_m",
}  # fmt: skip
COLUMNS = {
    "episodes.parquet": {"episode_id", "scene_id", "split", "duration_s", "n_frames", "n_poses", "renderer"},
    "poses.parquet": {"timestamp_ns", "track_id", "joint_state", "joints_m", "joints_px", "metadata skeleton"},
    "frames.parquet": {"frame", "timestamp_ns"},
    "activity_maps.npz": {"maps", "channels", "cell_m"},
}


@dataclass(frozen=True)
class Packed:
    """An organiser's data set and its two parts."""

    source: Path
    inputs: Path
    truth: Path

    def named_alike(self) -> Iterator[tuple[str, str]]:
        """(id in the source, new id) of each episode, told apart by bytes that packing leaves as they are."""
        new = {untouched(unit): unit.name for unit in unit_folders(self.truth)}
        assert len(new) == len(unit_folders(self.truth))
        yield from ((unit.name, new[untouched(unit)]) for unit in unit_folders(self.source))


def untouched(unit: Path) -> str:
    """The hashes of what packing does not touch of an episode's truth."""
    kept = {k: v for k, v in read_json(unit / "manifest.json").items() if k.startswith(("truth/", "recording/"))}
    return json.dumps({k: v for k, v in kept.items() if k not in ("truth/scene.json", "truth/match.parquet")})


def filmed(name: str, folder: Path) -> None:
    """A data set made with the secret seed: one scene, pictures at t0."""
    unit = next(unit for unit in read_splits(name).numbers("mini") if unit[1] == "test-seen")
    for _ in generate(Job(name, SEED, (unit,), "reference", "raycast"), folder / "data"):
        pass


def made_secret(rgbd: Path, folder: Path) -> None:
    """The shared data set as if it had been made with the secret seed: three of its episodes."""
    shutil.copytree(rgbd, folder / "data")
    for unit in unit_folders(folder / "data")[:3]:
        shutil.rmtree(unit)
    write_json(folder / "data" / "dataset.json", {**read_json(rgbd / "dataset.json"), "seed": SEED})
    write_index(folder / "data")


@pytest.fixture(
    scope="session", params=[pytest.param(n, marks=[] if n == SENSORS[0] else [pytest.mark.slow]) for n in SENSORS]
)
def packed(
    request: pytest.FixtureRequest, made_once: Callable[[str, Callable[[Path], None]], Path], rgbd: Path
) -> Packed:
    """A data set of each recipe, packed. Read only."""

    def make(folder: Path) -> None:
        if request.param == SENSORS[0]:
            made_secret(rgbd, folder)
        else:
            filmed(request.param, folder)
        for pack, part in ((pack_inputs, "inputs"), (pack_truth, "truth")):
            assert len(list(pack(folder / "data", folder / part))) == len(unit_folders(folder / "data"))

    folder = made_once(f"packed-{request.param}", make)
    return Packed(folder / "data", folder / "inputs", folder / "truth")


def bytes_of(root: Path) -> dict[str, bytes]:
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in sorted(root.rglob("*")) if p.is_file()}


# ---------------------------------------------------------------- loaders


def test_a_loader_hands_out_inputs_alone(packed: Packed) -> None:
    for root, private in ((packed.source, False), (packed.inputs, True)):
        truths = load(packed.source if root == packed.source else packed.truth, truth=True)
        for bare, whole in zip(load(root), truths, strict=True):
            secrets, scene = secret_arrays(whole), whole.truth.scene
            found = list(reachable(bare, "episode", private))
            assert [path for path, _ in found if not INPUT.fullmatch(path)] == []
            arrays = [(path, value) for path, value in found if isinstance(value, np.ndarray)]
            assert [path for path, array in arrays if array.tobytes() in secrets] == []
            assert [path for path, array in arrays if "[]" not in path and held(array, secrets)] == []
            texts = {value for _, value in found if isinstance(value, str)}
            assert scene is None or not texts & {scene.scene_id, scene.style, *(room.room_type for room in scene.rooms)}
            assert bare.truth is None


def test_the_walk_would_find_truth(packed: Packed) -> None:
    whole = load(packed.truth, truth=True)[0]
    found = list(reachable(whole, "episode"))
    assert {path for path, _ in found if not INPUT.fullmatch(path)} >= {"episode.truth.affordance.labels"}
    arrays = {value.tobytes() for _, value in found if isinstance(value, np.ndarray)}
    secrets = secret_arrays(whole)
    assert {path for content, path in secrets.items() if content not in arrays} <= {"truth.frames[].depth_m in mm"}
    assert secrets
    assert held(np.frombuffer(b"".join(secrets), np.uint8), secrets) == list(secrets.values())


def test_the_only_frame_is_the_camera_s_own(packed: Packed) -> None:
    """Origin below the camera, x along its heading: no matrix or number says how that lies in the room."""
    for episode in load(packed.source, frames=False):
        sensor = episode.sensor
        assert sensor.height_m is None or sensor.kind in ("rgbd", "monocular")  # that of a 360 camera is truth
        for path, value in reachable(episode, "episode"):
            if isinstance(value, np.ndarray) and value.shape[-2:] in ((3, 3), (3, 4), (4, 4)):
                assert path == "episode.sensor.world_T_camera"
                own = world_T_camera(sensor.height_m or 0.0, sensor.tilt_rad, sensor.roll_rad)
                assert np.array_equal(value, np.eye(4) if isinstance(sensor.camera, TopDownCamera) else own)
                assert np.array_equal(value[:2, 3], [0.0, 0.0])


# ---------------------------------------------------------------- a packed split


def test_both_parts_load_verify_and_agree(packed: Packed) -> None:
    for root in (packed.inputs, packed.truth):
        assert [fault.text for found in dataset_faults(root) for fault in found] == []
    inputs, truth = load(packed.inputs), load(packed.truth)
    assert inputs.episode_ids == truth.episode_ids
    assert [row["split"] for row in inputs.rows] == [row["split"] for row in truth.rows]
    assert {"seed", "recipe_sha256"} & truth.description.keys() == set()
    for a, b in zip(inputs, truth, strict=True):
        assert (a.sensor, a.t0_ns, a.end_ns, a.dataset) == (b.sensor, b.t0_ns, b.end_ns, b.dataset)
        assert np.array_equal(a.frames.timestamps_ns, b.frames.timestamps_ns)
        for k in range(len(a.frames)):
            for one, other in ((a.frames[k].rgb, b.frames[k].rgb), (a.frames[k].depth_m, b.frames[k].depth_m)):
                assert (one is None and other is None) or np.array_equal(one, other)
        for name in ("poses.parquet", "activity_maps.npz"):
            ours, theirs = (
                root / "episodes" / a.episode_id / "inputs" / name for root in (packed.inputs, packed.truth)
            )
            assert ours.exists() == theirs.exists()
            assert not ours.exists() or ours.read_bytes() == theirs.read_bytes()


def test_truth_is_the_same_under_new_names(packed: Packed) -> None:
    """Nothing is lost, episodes of one scene stay together, and every observed pose keeps its true one."""
    source, truth = load(packed.source, truth=True, frames=False), load(packed.truth, truth=True, frames=False)
    scenes = set()
    for known_as, new in packed.named_alike():
        before, after = source.episode(known_as), truth.episode(new)
        if before.truth.poses is not None and before.poses is not None:
            assert sorted(matched(before)) == sorted(matched(after))
        scenes.add(
            (source.scene_ids[source.episode_ids.index(known_as)], truth.scene_ids[truth.episode_ids.index(new)])
        )
        if after.truth.scene is not None:
            assert (before.truth.scene.scene_id, after.truth.scene.scene_id) in scenes
    assert len({a for a, _ in scenes}) == len({b for _, b in scenes}) == len(scenes)


def matched(episode: Episode) -> Iterator[tuple[int, bytes, int]]:
    """(time, observed joints, row of the true pose) of each observed pose."""
    poses = episode.poses
    joints = poses.joints_m if poses.joints_m is not None else poses.joints_px
    rows = zip(poses.timestamp_ns.tolist(), joints, episode.truth.poses.match.tolist(), strict=True)
    yield from ((time, place.tobytes(), row) for time, place, row in rows)


def test_a_packed_split_holds_inputs_alone(packed: Packed) -> None:
    """Every file: its name, its date, the keys and columns in it, each array, and whatever could be read as text."""
    found = {p.relative_to(packed.inputs).as_posix(): p for p in sorted(packed.inputs.rglob("*"))}
    assert {p.stat().st_mtime for p in (packed.inputs, *found.values())} == {FILE_TIME_S}
    files = {name: p for name, p in found.items() if p.is_file()}
    assert [name for name in files if not FILE.fullmatch(name)] == []
    truths = {e.episode_id: secret_arrays(e) for e in load(packed.truth, truth=True)}
    words = secret_words(packed)
    for name, path in files.items():
        texts = [path.read_bytes()]
        for item, value in decoded(path):
            if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
                secrets = truths[name.split("/")[1]] if "/" in name else {}
                assert held(value, secrets) == [], f"{name} {item}"
            else:
                texts.append(str(value.tolist() if isinstance(value, np.ndarray) else value).encode())
            kind, _, column = item.partition(" ")
            assert path.suffix not in (".parquet", ".npz") or column in COLUMNS[kind], f"{name} {item}"
        assert [word for word in words for text in texts if word in text] == [], name
    assert set(read_json(files["dataset.json"])) == DESCRIPTION
    for unit in unit_folders(packed.inputs):
        assert keys_of(read_json(unit / "episode.json")) <= DESCRIPTOR
        row = read_json(unit / "index.json")
        assert row.keys() == COLUMNS["episodes.parquet"]
        assert (row["episode_id"], row["scene_id"], row["renderer"]) == (unit.name, unit.name, None)


def secret_words(packed: Packed) -> list[bytes]:
    """What no file may hold: known names, seeds in any writing, hashes, styles and kinds of rooms."""
    description = read_json(packed.source / "dataset.json")
    numbers = [SEED]
    words = [description["recipe_sha256"], *load(packed.source).episode_ids, *load(packed.source).scene_ids]
    for root in (packed.source, packed.truth):
        words += load(root).scene_ids
        for unit in unit_folders(root):
            descriptor = read_json(unit / "episode.json")
            numbers += [descriptor[n]["seed"] for n in ("depth_noise", "image_noise") if descriptor[n] is not None]
        words += [e.truth.scene.style for e in load(root, truth=True, frames=False) if e.truth.scene is not None]
    numbers = [n for n in numbers if n > 1 << 40]  # a film without noise has the seed 0
    written = [text for n in numbers for text in (str(n), f"{n:x}", f"{n:X}")]
    return [word.encode() for word in (*words, *written)] + [
        n.to_bytes(16, end) for n in numbers for end in ("little", "big")
    ]


def test_nothing_but_inputs_and_the_secret_decides_a_byte(packed: Packed, tmp_path: Path) -> None:
    """The same inputs with all truth gone, and other names of scenes, ids in pictures, recipe and renderer."""
    other = Path(shutil.copytree(packed.source, tmp_path / "other"))
    for unit in unit_folders(other):
        shutil.rmtree(unit / "truth")
        if (ids := unit / "recording" / "background_instance.png").exists():
            cv2.imwrite(str(ids), cv2.imread(str(ids), cv2.IMREAD_UNCHANGED) // 2 + 7)
        descriptor = read_json(unit / "episode.json")
        for noise in ("depth_noise", "image_noise"):
            if descriptor[noise] is not None:
                descriptor[noise]["seed"] += 1
        write_json(unit / "episode.json", descriptor)
        write_json(unit / "index.json", {**read_json(unit / "index.json"), "scene_id": "elsewhere", "renderer": "x"})
        write_json(unit / "manifest.json", manifest(unit, exclude=["manifest.json"]))
    changed = {"recipe_sha256": "0" * 64, "renderer": "x", "frames": "every:2"}
    write_json(other / "dataset.json", {**read_json(other / "dataset.json"), **changed})
    write_index(other)
    list(pack_inputs(other, tmp_path / "inputs"))
    assert bytes_of(tmp_path / "inputs") == bytes_of(packed.inputs)


def test_the_noise_is_in_the_pictures_and_nobody_has_its_seed(packed: Packed) -> None:
    clean, open_split = load(packed.truth, truth=True), load(packed.source)
    for known_as, new in packed.named_alike():
        published, truth = load(packed.inputs).episode(new), clean.episode(new).truth
        for k in range(len(published.frames)):
            read = published.frames[k].depth_m
            if read is None:
                continue
            exact, before = truth.frames[k].depth_m, open_split.episode(known_as).frames[k].depth_m
            both = (read > 0) & (before > 0)
            assert np.mean(read[both] != exact[both]) > 0.5
            assert np.mean(read[both] != before[both]) > 0.5  # drawn anew, from 128 bits


def an_answer(spec: TaskSpec, episode: Episode) -> Any:
    """An answer to a task that follows from inputs, but for their order."""
    nothing = spec.dummy(episode)
    rng = np.random.default_rng(len(episode.poses))
    return nothing if spec.name == "action-recognition" else RANDOM[spec.name](rng, nothing)


@pytest.mark.parametrize("packed", SENSORS[:1], indirect=True)
def test_a_submission_made_from_the_inputs_is_scored_with_the_truth(packed: Packed, tmp_path: Path) -> None:
    name = load(packed.inputs).name
    for task, spec in TASKS.items():
        if name not in spec.datasets:
            continue
        metadata = Metadata(task, spec.version, "any", "poses", authors=("A. Author",), causal=True)
        reports = []
        for number, (inputs, truth) in enumerate(((packed.source, packed.source), (packed.inputs, packed.truth))):
            answers = ((e.episode_id, an_answer(spec, e)) for e in load(inputs))
            write_submission(tmp_path / f"{task}-{number}", spec, metadata, answers)
            reports.append(score(task, tmp_path / f"{task}-{number}", load(truth)))
        before, report = reports
        assert report.primary.value is not None
        assert {k: m.value for k, m in report.metrics.items()} == {k: m.value for k, m in before.metrics.items()}
        assert {row.scene_id[:13] for row in report.episodes} == {"hidden-scene-"}


def test_tables_of_the_index_are_in_the_new_order(packed: Packed) -> None:
    rows = pq.read_table(packed.inputs / "episodes.parquet").to_pylist()
    assert [row["episode_id"] for row in rows] == sorted(row["episode_id"] for row in rows)
