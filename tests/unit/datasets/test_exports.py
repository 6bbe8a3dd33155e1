"""Exports hold what the episodes hold, to the last bit, and open in the tools that they are for."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from exported_data import OLD, PERSON, WINDOW, filmed
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from pycocotools import mask as coco_masks
from pycocotools.coco import COCO

from hsbench import Dataset, load
from hsbench.datasets.exports import huggingface, webdataset
from hsbench.datasets.exports.coco import write_coco
from hsbench.datasets.exports.croissant import write_croissant
from hsbench.datasets.exports.glb import write_glb
from hsbench.datasets.exports.huggingface import write_huggingface
from hsbench.datasets.exports.run_lengths import encode
from hsbench.datasets.exports.webdataset import write_webdataset
from hsbench.errors import DataError
from hsbench.io.checksums import manifest
from hsbench.io.scene_glb import glb_bytes
from hsbench.schema import SKELETONS, Episode, codec

WRITERS = {
    "coco": write_coco,
    "huggingface": write_huggingface,
    "webdataset": write_webdataset,
    "croissant": write_croissant,
    "glb": write_glb,
}
of_pycocotools = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
Write = Callable[[Dataset, Path], Iterator[str]]
TRUTH_NAMES = (
    "true",
    "instance",
    "semantic",
    "clean",
    "event",
    "object",
    "affordance",
    "scene.",
    "occupancy",
    "recording",
)


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return filmed(tmp_path_factory.mktemp("filmed") / "data")


def with_scenes(data: Dataset) -> Dataset:
    return replace(data, rows=tuple(row for row in data.rows if row["episode_id"] != "m-1"))


def picture(data: bytes) -> np.ndarray:
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    return image[..., ::-1] if image.ndim == 3 else image


def same_pictures(found: dict[str, bytes], episode: Episode, index: int) -> None:
    """Files by name are exactly the pictures of a frame."""
    frame = episode.frames[index]
    expected = {"rgb": frame.rgb, "depth": frame.depth_m}
    if episode.truth is not None and episode.truth.frames is not None:
        truth = episode.truth.frames[index]
        expected |= {"clean_depth": truth.depth_m, "instance": truth.instance, "semantic": truth.semantic}
    assert set(found) == {name for name, image in expected.items() if image is not None}
    for name, data in found.items():
        image = picture(data)
        if "depth" in name:
            assert image.dtype == np.uint16
            image = (image / 1000).astype(np.float32)
        np.testing.assert_array_equal(image, expected[name])


# ---------------------------------------------------------------- every form


@pytest.mark.parametrize("form", WRITERS)
def test_the_same_data_give_the_same_bytes_and_no_folder_is_replaced(form: str, tmp_path: Path) -> None:
    data = with_scenes(load(OLD, truth=True))
    for name in ("a", "b"):
        assert list(WRITERS[form](data, tmp_path / name)) == ["film-1", "s-1"]
    assert manifest(tmp_path / "a") == manifest(tmp_path / "b") != {}
    before = manifest(tmp_path / "a")
    with pytest.raises(DataError, match="exists already"):
        list(WRITERS[form](data, tmp_path / "a"))
    assert manifest(tmp_path / "a") == before


@pytest.mark.parametrize("form", WRITERS)
def test_an_export_that_stops_leaves_nothing(form: str, tmp_path: Path) -> None:
    steps = WRITERS[form](with_scenes(load(OLD, truth=True)), tmp_path / "a")
    assert next(steps) == "film-1"
    steps.close()  # type: ignore[attr-defined]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("form", sorted(set(WRITERS) - {"glb"}))
def test_inputs_only_unless_truth_was_loaded(form: str, tmp_path: Path) -> None:
    """No file, no column and no key of truth; and the inputs are the same with truth beside them."""
    list(WRITERS[form](load(OLD), tmp_path / "inputs"))
    list(WRITERS[form](load(OLD, truth=True), tmp_path / "all"))
    inputs, everything = (manifest(tmp_path / name) for name in ("inputs", "all"))
    assert inputs != everything
    assert set(inputs) <= set(everything)
    names = list(inputs)
    for path in (tmp_path / "inputs").rglob("*"):
        if path.suffix == ".parquet":
            names += pq.read_schema(path).names
        elif path.suffix == ".tar":
            with tarfile.open(path) as archive:
                names += archive.getnames()
        elif path.name == "croissant.json":
            described = json.loads(path.read_text())
            names += [item["@id"] for kind in ("distribution", "recordSet") for item in described[kind]]
            names += [field["@id"] for record in described["recordSet"] for field in record["field"]]
    assert not [name for name in names if any(word in name for word in TRUTH_NAMES)]


def test_scenes_are_truth(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="film-1 has no scene to export"):
        list(write_glb(load(OLD), tmp_path / "a"))
    data = with_scenes(load(OLD, truth=True))
    list(write_glb(data, tmp_path / "b"))
    for episode in data:
        assert (tmp_path / "b" / f"{episode.episode_id}.glb").read_bytes() == glb_bytes(episode.truth.scene)


@pytest.mark.parametrize("write", [write_coco, write_webdataset])
def test_data_without_pictures_are_named(write: Write, tmp_path: Path) -> None:
    data = load(OLD)
    with pytest.raises(DataError, match=r"schema-0\.2 has no .* to export"):
        list(write(replace(data, rows=data.rows[1:2]), tmp_path / "a"))
    assert list(tmp_path.iterdir()) == []


# ---------------------------------------------------------------- COCO


@given(arrays(bool, array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=40), elements=st.booleans()))
def test_run_lengths_are_those_of_pycocotools(mask: np.ndarray) -> None:
    theirs = coco_masks.encode(np.asfortranarray(mask.astype(np.uint8)))
    assert encode(mask) == {"size": list(theirs["size"]), "counts": theirs["counts"].decode()}


def opened(folder: Path, name: str) -> COCO:
    return COCO(str(folder / "annotations" / f"{name}.json"))


@of_pycocotools
def test_coco_pictures_and_instances(film: Dataset, tmp_path: Path) -> None:
    list(write_coco(film, tmp_path / "a"))
    coco, episode = opened(tmp_path / "a", "instances_unsplit"), film[0]
    names = {c["id"]: c["name"] for c in coco.loadCats(coco.getCatIds())}
    categories = {o.object_id: o.category_name for o in episode.truth.scene.objects} | {PERSON: "person"}
    assert len(coco.imgs) == 3
    for entry in coco.imgs.values():
        index = entry["frame"]
        assert (entry["timestamp_ns"], entry["height"], entry["width"]) == (episode.frames[index].timestamp_ns, 18, 24)
        same = picture((tmp_path / "a" / "images" / entry["file_name"]).read_bytes())
        np.testing.assert_array_equal(same, episode.frames[index].rgb)
        instance = episode.truth.frames[index].instance
        found = coco.imgToAnns[entry["id"]]
        assert sorted(a["object_id"] for a in found) == sorted(set(np.unique(instance).tolist()) - {0})
        for annotation in found:
            assert names[annotation["category_id"]] == categories[annotation["object_id"]]
            mask = coco.annToMask(annotation)
            np.testing.assert_array_equal(mask, instance == annotation["object_id"])
            lengths = coco.annToRLE(annotation)
            assert annotation["area"] == coco_masks.area(lengths) == mask.sum()
            assert annotation["bbox"] == coco_masks.toBbox(lengths).tolist()


@of_pycocotools
def test_coco_keypoints_are_projected_joints(film: Dataset, tmp_path: Path) -> None:
    """Against OpenCV's projection; 0 outside and for missing joints, 1 inferred or hidden, 2 tracked or seen."""
    list(write_coco(film, tmp_path / "a"))
    episode = film[0]
    camera, world_T_camera = episode.sensor.camera, episode.sensor.world_T_camera
    camera_T_world = np.linalg.inv(world_T_camera)
    matrix = np.array([[camera.fx_px, 0, camera.cx_px], [0, camera.fy_px, camera.cy_px], [0, 0, 1]])
    tables = {"person_keypoints_unsplit": episode.poses, "person_keypoints_true_unsplit": episode.truth.poses.poses}
    for name, poses in tables.items():
        coco = opened(tmp_path / "a", name)
        (annotation,) = coco.anns.values()
        assert coco.imgs[annotation["image_id"]]["frame"] == 1
        (person,) = coco.loadCats(annotation["category_id"])
        assert person["keypoints"] == list(SKELETONS["kinect-v2-25"].names)
        assert person["skeleton"] == [[a + 1, b + 1] for a, b in SKELETONS["kinect-v2-25"].bones]
        rotation = cv2.Rodrigues(camera_T_world[:3, :3])[0]
        joints = np.nan_to_num(poses.joints_m[0].astype(np.float64))
        pixels = cv2.projectPoints(joints, rotation, camera_T_world[:3, 3], matrix, None)[0].reshape(-1, 2)
        points = np.array(annotation["keypoints"]).reshape(-1, 3)
        labelled = points[:, 2] > 0
        assert annotation["num_keypoints"] == labelled.sum() > 15
        np.testing.assert_allclose(points[labelled, :2], pixels[labelled], atol=0.006)
        assert (points[~labelled] == 0).all()
        if "true" in name:
            inside = np.zeros((18, 24), bool)
            inside[WINDOW] = True
            rows, columns = np.floor(points[:, 1]).astype(int), np.floor(points[:, 0]).astype(int)
            np.testing.assert_array_equal(points[:, 2] == 2, inside[rows, columns] & labelled)
            np.testing.assert_array_equal(coco.annToMask(annotation), inside)
        else:
            np.testing.assert_array_equal(points[:, 2], poses.joint_state[0])
            low, high = pixels[labelled].min(axis=0), pixels[labelled].max(axis=0)
            np.testing.assert_allclose(annotation["bbox"], [*low, *(high - low)], atol=0.02)


def test_coco_keeps_other_skeletons_and_poses_of_the_very_time(tmp_path: Path) -> None:
    """The 360 episode has poses at 0, .1 and .2 s in pixels, pictures at 0, .2 and .9 s."""
    data = load(OLD)
    list(write_coco(data, tmp_path / "a"))
    coco, poses = opened(tmp_path / "a", "person_keypoints_val"), data.episode("s-1").poses
    found = [a for a in coco.anns.values() if coco.imgs[a["image_id"]]["episode_id"] == "s-1"]
    shared = {0, 200_000_000}
    assert {coco.imgs[a["image_id"]]["timestamp_ns"] for a in found} == shared
    rows = [k for k in range(len(poses)) if poses.timestamp_ns[k] in shared]
    assert [a["track_id"] for a in found] == poses.track_id[rows].tolist()
    for annotation, row in zip(found, rows, strict=True):
        points = np.array(annotation["keypoints"]).reshape(-1, 3)
        inside = (poses.joints_px[row] >= 0).all(axis=1) & (poses.joints_px[row] < [32, 16]).all(axis=1)
        np.testing.assert_allclose(points[inside, :2], poses.joints_px[row][inside], atol=0.006)
        assert (points[~inside] == 0).all()
        assert len(coco.loadCats(annotation["category_id"])[0]["keypoints"]) == 18


# ---------------------------------------------------------------- Hugging Face


def table(folder: Path, name: str, split: str = "val") -> pd.DataFrame:
    return pd.concat([pd.read_parquet(path) for path in sorted((folder / name).glob(f"{split}-*.parquet"))])


def test_huggingface_rows_are_those_of_the_episodes(tmp_path: Path) -> None:
    data = load(OLD, truth=True)
    list(write_huggingface(data, tmp_path / "a"))
    frames, episodes = table(tmp_path / "a", "frames"), table(tmp_path / "a", "episodes")
    assert list(episodes["episode_id"]) == list(data.episode_ids)
    for episode in data:
        own = frames[frames["episode_id"] == episode.episode_id]
        assert list(own["timestamp_ns"]) == episode.frames.timestamps_ns.tolist()
        for index, (_, row) in enumerate(own.iterrows()):
            columns = ("rgb", "depth", "clean_depth", "instance", "semantic")
            same_pictures({c: row[c]["bytes"] for c in columns if row[c] is not None}, episode, index)
        (row,) = (r for _, r in episodes.iterrows() if r["episode_id"] == episode.episode_id)
        assert codec.sensor_from_json(json.loads(row["sensor"])) == episode.sensor
        np.testing.assert_array_equal(picture(row["affordance"]["bytes"]), episode.truth.affordance.labels)
        for name, poses in (("poses", episode.poses), ("true_poses", episode.truth.poses)):
            found = table(tmp_path / "a", name)
            found = found[found["episode_id"] == episode.episode_id]
            if poses is None:
                assert found.empty
                continue
            observed = poses if name == "poses" else poses.poses
            np.testing.assert_array_equal(found["timestamp_ns"], observed.timestamp_ns)
            for column in ("joint_state", "joints_m", "joints_px"):
                expected = getattr(observed, column)
                if expected is None:
                    assert found[column].isna().all()
                else:
                    stacked = np.stack([np.stack(list(value)) for value in found[column]])
                    np.testing.assert_array_equal(stacked, expected)
    maps = data.episode("m-1").activity_maps
    stored = episodes[episodes["episode_id"] == "m-1"]["activity_maps"].iloc[0]
    np.testing.assert_array_equal(np.array([[list(r) for r in m] for m in stored], np.float32), maps.maps)
    objects, scene = table(tmp_path / "a", "objects"), data[0].truth.scene
    own = objects[objects["episode_id"] == "film-1"]
    np.testing.assert_array_equal(
        own[["x_m", "y_m", "z_m", "length_m", "width_m", "height_m", "yaw_rad"]], [o.box for o in scene.objects]
    )
    assert len(table(tmp_path / "a", "events")) == sum(len(e.truth.events) for e in data if e.truth.events is not None)


def test_huggingface_files_follow_one_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(huggingface, "SHARD_BYTES", 1)
    list(write_huggingface(load(OLD), tmp_path / "a"))
    assert sorted(p.name for p in (tmp_path / "a" / "frames").iterdir()) == ["val-00000.parquet", "val-00001.parquet"]
    assert len(table(tmp_path / "a", "frames")) == 6


@pytest.mark.filterwarnings("ignore")
def test_huggingface_opens_offline_with_typed_features(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("HF_HUB_OFFLINE", "HF_DATASETS_OFFLINE"):
        monkeypatch.setenv(name, "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    pytest.importorskip("datasets.features", reason="Hugging Face datasets is not installed")
    pytest.importorskip("PIL", reason="its images need Pillow")
    import datasets

    data = load(OLD, truth=True)
    list(write_huggingface(data, tmp_path / "a"))
    folder, cache = str(tmp_path / "a"), str(tmp_path / "cache")
    names = datasets.get_dataset_config_names(folder)
    assert set(names) == {"frames", "poses", "episodes", "true_poses", "events", "objects"}
    frames = datasets.load_dataset(folder, "frames", split="val", cache_dir=cache)
    assert {k for k, f in frames.features.items() if isinstance(f, datasets.Image)} == {
        "rgb", "depth", "clean_depth", "instance", "semantic"
    }  # fmt: skip
    film = data.episode("film-1")
    np.testing.assert_array_equal(np.array(frames[1]["rgb"]), film.frames[1].rgb)
    np.testing.assert_array_equal((np.array(frames[1]["depth"]) / 1000).astype("f4"), film.frames[1].depth_m)
    poses = datasets.load_dataset(folder, "poses", split="val", cache_dir=cache)
    np.testing.assert_array_equal(np.array(poses[0]["joints_m"], "f4"), film.poses.joints_m[0])
    actions = datasets.load_dataset(folder, "true_poses", split="val", cache_dir=cache).features["action"]
    assert actions.names == ["ignored", "stand", "sit", "interact"]


# ---------------------------------------------------------------- WebDataset


def samples(folder: Path) -> dict[str, dict[str, bytes]]:
    """Members by key and extension; those of a key stand together."""
    found: dict[str, dict[str, bytes]] = {}
    for path in sorted(folder.glob("*.tar")):
        before = ""
        with tarfile.open(path) as archive:
            for member in archive:
                assert (member.mtime, member.uid, member.gid, member.uname) == (0, 0, 0, "")
                stem, _, extension = member.name.rpartition("/")[2].partition(".")
                key = f"{member.name.rpartition('/')[0]}/{stem}"
                assert key == before or key not in found
                before = key
                content = archive.extractfile(member)
                assert content is not None
                found.setdefault(key, {})[extension] = content.read()
    return found


@pytest.mark.parametrize("shard_bytes", [1, 1 << 30])
def test_webdataset_samples_are_frames(shard_bytes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(webdataset, "SHARD_BYTES", shard_bytes)
    data = load(OLD, truth=True)
    list(write_webdataset(data, tmp_path / "a"))
    found = samples(tmp_path / "a")
    assert len(list((tmp_path / "a").iterdir())) == (6 if shard_bytes == 1 else 1)
    assert list(found) == [f"{name}/{k:06d}" for name in ("film-1", "s-1") for k in range(3)]
    for key, sample in found.items():
        facts = json.loads(sample["json"])
        episode, index = data.episode(facts["episode_id"]), facts["frame"]
        assert key == f"{episode.episode_id}/{index:06d}"
        assert facts["timestamp_ns"] == episode.frames.timestamps_ns[index]
        assert codec.sensor_from_json(facts["sensor"]) == episode.sensor
        same_pictures({n.removesuffix(".png"): d for n, d in sample.items() if n.endswith(".png")}, episode, index)
        rows = np.flatnonzero(episode.poses.timestamp_ns == facts["timestamp_ns"])
        observed = json.loads(sample["poses.json"])
        assert [p["track_id"] for p in observed] == episode.poses.track_id[rows].tolist()
        for pose, row in zip(observed, rows, strict=True):
            assert pose["joint_state"] == episode.poses.joint_state[row].tolist()
            joints = [[np.nan, np.nan] if p is None else p for p in pose["joints_px"]]
            np.testing.assert_array_equal(np.array(joints, np.float32), episode.poses.joints_px[row])


@pytest.mark.filterwarnings("ignore")
def test_webdataset_reads_back(tmp_path: Path) -> None:
    theirs = pytest.importorskip("webdataset", reason="webdataset is not installed")
    data = load(OLD)
    list(write_webdataset(data, tmp_path / "a"))
    found = list(theirs.WebDataset(str(tmp_path / "a" / "val-000000.tar"), shardshuffle=False))
    assert [s["__key__"] for s in found] == list(samples(tmp_path / "a"))
    for sample in found:
        episode_id, _, index = sample["__key__"].partition("/")
        np.testing.assert_array_equal(picture(sample["rgb.png"]), data.episode(episode_id).frames[int(index)].rgb)
    assert io.BytesIO(found[0]["json"]).read() == samples(tmp_path / "a")["film-1/000000"]["json"]
