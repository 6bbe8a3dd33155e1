"""The reader of Pose2Room against samples and arrays of a known person and room, written here from the layout.

The joint array's layout is checked on a real one in tests/real; of the HDF5 samples none was at hand.
"""

from __future__ import annotations

import io
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers import pose2room
from hsbench.datasets.importers.pose2room import CLASSES, KINECT_OF_53, read_pose2room, to_kinect
from hsbench.datasets.importers.pose_captures import CATEGORY_OF_CLASS, pose2room_episode
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import MissingExtraError
from hsbench.schema.categories import CATEGORIES
from hsbench.schema.poses import JointState
from hsbench.schema.skeletons import KINECT_V2
from hsbench.typing import FloatArray
from tests.unit.datasets.mutations import mutated, refused, refused_or_read
from tests.unit.datasets.test_kinect_csv import BODY, in_episode

h5py = pytest.importorskip("h5py")
ANY_FILE = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
FRAMES = 6
NAMED = [name for name in KINECT_V2.names if name != "spine_shoulder"]


def person(frames: int = FRAMES, facing_rad: float = 0.5) -> FloatArray:
    """(frames, 53, 3) in our frame: a person who walks ahead; joints that no Kinect has lie at the head."""
    body = in_episode(0.0, facing_rad)
    full = np.tile(body[KINECT_V2.index("head")], (53, 1))
    for name in NAMED:
        full[KINECT_OF_53[name]] = body[KINECT_V2.index(name)]
    steps = np.arange(frames)[:, None, None] * 0.2 * np.array([math.cos(facing_rad), math.sin(facing_rad), 0.0])
    return full + steps


def unity(points: FloatArray) -> FloatArray:
    """Our frame -> Unity's: left-handed, y up."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x, z, y], axis=-1)


def augmented(points: FloatArray) -> FloatArray:
    """What the source's augmentation does to a file's points: x and z change places, a mirror."""
    return points[..., ::-1]


def write_sample(
    path: Path, joints: FloatArray, objects: list[dict[str, Any]] | None = None, room: dict[str, Any] | None = None
) -> Path:
    with h5py.File(path, "w") as file:
        file["skeleton_joints"] = joints
        file["skeleton_joint_votes"] = np.zeros((*joints.shape[:2], 10))
        if objects is not None:
            group = file.create_group("object_nodes")
            for number, node in enumerate(objects):
                for key, value in node.items():
                    group[f"{number}/{key}"] = value
        for key, value in (room or {}).items():
            file[f"room_bbox/{key}"] = value
    return path


def node(
    centre_unity: tuple[float, float, float], size: tuple[float, float, float], yaw_rad: float, class_id: int | None = 5
) -> dict[str, Any]:
    """A box whose first axis points at ``yaw_rad`` in our frame; ``size`` along its axes, the second is up."""
    along = unity(np.array([math.cos(yaw_rad), math.sin(yaw_rad), 0.0]))
    up = np.array([0.0, 1.0, 0.0])
    box = {
        "centroid": np.array(centre_unity),
        "R_mat": np.stack([along, up, np.cross(along, up)]),
        "size": np.array(size),
    }
    return box if class_id is None else {**box, "class_id": np.array([class_id], dtype=np.int32)}


ROOM = node((0.0, 1.3, 0.0), (5.0, 2.6, 4.0), 0.0, class_id=None)
CHAIR = node((1.0, 0.4, -1.2), (0.5, 0.8, 0.6), 0.7, CLASSES.index("chair"))
COMPUTER = node((-2.0, 0.9, 1.0), (0.4, 0.3, 0.2), 0.0, CLASSES.index("computer"))


def sound(path: Path) -> Path:
    return write_sample(path, unity(person()), [CHAIR, COMPUTER], ROOM)


def write_npy(path: Path, array: np.ndarray[Any, Any]) -> Path:
    np.save(path, array)
    return path


# joints and frames


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("suffix", ["npy", "npz", "hdf5"])
def test_left_stays_left_in_files_of_either_hand(tmp_path: Path, suffix: str, mirrored: bool) -> None:
    joints = unity(person())
    if mirrored:
        joints = augmented(joints)
    path = tmp_path / f"a.{suffix}"
    if suffix == "npy":
        np.save(path, joints)
    elif suffix == "npz":
        np.savez_compressed(path, joints=joints)
    else:
        write_sample(path, joints)
    found = read_pose2room(path)
    assert found.was_left_handed is not mirrored
    assert (found.boxes, found.room) == ((), None)
    kinect, _ = to_kinect(found.joints_m)
    toes = kinect[:, 15] - kinect[:, 14]
    leftward = np.cross([0.0, 0.0, 1.0], toes)
    assert ((leftward * (kinect[:, 4] - kinect[:, 8])).sum(axis=1) > 0).all()
    np.testing.assert_allclose(kinect[:, :, 2], np.broadcast_to(BODY[:, 2], (FRAMES, 25)), atol=0.06)
    if not mirrored:
        np.testing.assert_allclose(found.joints_m, person(), atol=1e-12)


def test_every_named_joint_is_where_the_kinect_has_it() -> None:
    assert sorted(KINECT_OF_53) == sorted(NAMED)
    assert len(set(KINECT_OF_53.values())) == len(NAMED)
    kinect, state = to_kinect(person())
    for name in NAMED:
        np.testing.assert_array_equal(kinect[0, KINECT_V2.index(name)], in_episode(0.0, 0.5)[KINECT_V2.index(name)])
    shoulders = kinect[0, [4, 8]].mean(axis=0)
    np.testing.assert_allclose(kinect[0, 20], shoulders)
    inferred = {KINECT_V2.names[j] for j in np.nonzero(state[0] == JointState.INFERRED)[0]}
    assert inferred == {"head", "spine_shoulder"}
    assert (state > JointState.MISSING).all()


@pytest.mark.parametrize("dtype", ["<f4", ">f4", ">f8", "<f2"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_of_any_byte_order(tmp_path: Path, dtype: str, order: str) -> None:
    array = np.array(unity(person()), dtype=dtype, order=order)  # type: ignore[call-overload]
    found = read_pose2room(write_npy(tmp_path / "a.npy", array))
    np.testing.assert_array_equal(found.joints_m, unity(array.astype(np.float64)))  # its own inverse


# boxes


@given(yaw=st.floats(-3.1, 3.1), x=st.floats(-3, 3), z=st.floats(-3, 3))
@settings(deadline=None, max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_boxes_stay_with_the_people(tmp_path: Path, yaw: float, x: float, z: float) -> None:
    """A box and the points of its corners, written alike, end at the same place."""
    item = node((x, 0.5, z), (0.6, 1.0, 0.4), yaw)
    signs = np.array([[a, b, c] for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (-0.5, 0.5)])
    corners = item["centroid"] + (signs * item["size"]) @ item["R_mat"]
    joints = unity(person())
    joints[:, 45:53] = corners  # the little finger's, which are not read
    sample = read_pose2room(write_sample(tmp_path / "a.hdf5", joints, [item], ROOM))
    episode = pose2room_episode(sample, "a")
    (chair,) = episode.truth.scene.objects
    found = chair.vertices
    gaps = np.linalg.norm(found[:, None] - sample.joints_m[0, None, 45:53], axis=-1)
    assert gaps.min(axis=0).max() < 1e-3
    assert chair.box[3:6].tolist() == [0.6, 0.4, 1.0]


def test_room_and_objects_are_truth(tmp_path: Path) -> None:
    episode = pose2room_episode(read_pose2room(sound(tmp_path / "a.hdf5")), "a")
    scene = episode.truth.scene
    assert [item.category_name for item in scene.objects] == ["chair", "object"]
    assert scene.height_m == 2.6
    assert scene.rooms[0].area_m2 == pytest.approx(20.0)
    np.testing.assert_allclose(scene.rooms[0].outline_xy.max(axis=0), [2.5, 2.0])
    np.testing.assert_allclose(scene.objects[0].box, [1.0, -1.2, 0.4, 0.5, 0.6, 0.8, 0.7], atol=1e-4)
    camera = episode.sensor.camera
    pixels, _ = camera.project(np.pad(scene.rooms[0].outline_xy, ((0, 0), (0, 1))))
    assert camera.contains(pixels).all()
    assert episode.poses.timestamp_ns.tolist() == [200_000_000 * i for i in range(FRAMES)]


def test_a_mirrored_sample_is_the_mirrored_room(tmp_path: Path) -> None:
    def flip(item: dict[str, Any]) -> dict[str, Any]:
        axes = augmented(item["R_mat"])
        return {
            **item,
            "centroid": augmented(item["centroid"]),
            "R_mat": np.stack([axes[0], axes[1], np.cross(axes[0], axes[1])]),
        }

    path = write_sample(tmp_path / "a_5.hdf5", augmented(unity(person())), [flip(CHAIR)], flip(ROOM))
    mirrored = pose2room_episode(read_pose2room(path), "a")
    plain = pose2room_episode(read_pose2room(sound(tmp_path / "a_0.hdf5")), "a")
    for one, other in ((mirrored, plain), (plain, mirrored)):
        assert one.truth.scene.rooms[0].area_m2 == pytest.approx(other.truth.scene.rooms[0].area_m2)
    gap = [
        np.linalg.norm(e.poses.joints_m[:, 0, :2] - e.truth.scene.objects[0].box[:2].astype(np.float32), axis=-1)
        for e in (plain, mirrored)
    ]
    np.testing.assert_allclose(gap[0], gap[1], atol=1e-4)


def test_a_room_may_be_empty(tmp_path: Path) -> None:
    path = write_sample(tmp_path / "a.hdf5", unity(person()), room=ROOM)
    with h5py.File(path, "a") as file:
        file["object_nodes"] = h5py.Empty("i")  # what the source writes for an empty list
    sample = read_pose2room(path)
    assert sample.boxes == ()
    assert pose2room_episode(sample, "a").truth.scene.objects == ()


def test_every_class_has_a_category() -> None:
    assert len(CLASSES) == 22
    assert set(CATEGORY_OF_CLASS) < set(CLASSES)
    assert set(CATEGORY_OF_CLASS.values()) < {category.name for category in CATEGORIES}


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "data"
    assert run(["import", "pose2room", str(sound(tmp_path / "a.hdf5")), "--out", str(out)]) == 0
    shown = capsys.readouterr()
    assert "6 poses of 1 tracks in 1.0 s" in shown.out
    assert "the file's frame is left-handed" in shown.err
    bare = write_sample(tmp_path / "bare.hdf5", unity(person()), [CHAIR])
    assert run(["import", "pose2room", str(bare), "--out", str(out)]) == 0
    assert "no room_bbox, so the 1 objects are left out" in capsys.readouterr().err
    data = load(out, truth=True)
    assert [episode.truth.scene is None for episode in data] == [False, True]
    assert verify_files(out) == []
    assert [verify_episode(episode) for episode in data] == [[], []]


# damage


def test_a_sample_needs_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = sound(tmp_path / "a.hdf5")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtraError, match=r"a Pose2Room sample needs h5py, .*hsbench\[import\]"):
        read_pose2room(path)


def test_damaged_arrays_are_named(tmp_path: Path) -> None:
    good = unity(person())
    nan, huge = good.copy(), good.copy()
    nan[3, 10, 1] = np.nan
    huge[2] *= 1000
    turned, hip = np.moveaxis(good, 2, 0).copy(), good - good[:, :1]
    cases = [
        (good[:, :25], r"array has shape \(6, 25, 3\); expected \(frames, 53, 3\)"),
        (good[0], r"array has shape \(53, 3\)"),
        (good[:0], "array has 0 frames; expected 1 to 36,000"),
        (np.moveaxis(turned, 0, 2)[..., [0, 2, 1]] + 2.0, r"lowest joint is at y = .*z up"),
        (nan, "frame 3 has a coordinate that is NaN"),
        (huge, "frame 2 has a coordinate .*millimetres"),
        (hip, "lowest joint is at y = -0.95 m; .*relative to the hip"),
        (
            np.frombuffer(good.tobytes(), ">f8").reshape(good.shape).copy(),
            "coordinate that is NaN or beyond .*bytes swapped",
        ),
        (good.astype(np.int64), "array of int64; expected floating point"),
        (good.astype("c16"), "array of complex128; expected floating point"),
        (
            np.array([good, None], dtype=object),
            "array of object; expected floating point metres .objects would need pickle",
        ),
        (good[:, ::-1].copy(), "expected 80% alike|lowest"),
        (np.zeros((2, 53, 3)), "left hip lies left of the toes in 0% of the frames"),
    ]
    for array, message in cases:
        refused(read_pose2room, write_npy(tmp_path / "damaged.npy", array), message)


def test_damaged_containers_are_named(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    np.save(buffer, unity(person()))
    data = buffer.getvalue()
    claimed = data.replace(b"(6, 53, 3)", b"(36000, 53, 3)").replace(b" " * 4 + b"\n", b"\n", 1)
    cases = {
        "empty.npy": (b"", "header cannot be read"),
        "truncated.npy": (data[:-100], r"expected .* as its header says .an incomplete copy"),
        "huge.npy": (claimed, "expected 45,792,.* as its header says"),
        "header.npy": (data[:40], "header cannot be read"),
        "evil.npy": (data.replace(b"'<f8'", b"'|O' "), "objects would need pickle"),
        "empty.npz": (b"", "expected an NPZ file of one array"),
        "text.npz": (b"hello" * 100, "expected an NPZ file of one array"),
        "a.txt": (data, "ends in '.txt'; expected a sample"),
        "empty.hdf5": (b"", "cannot be read"),
        "text.hdf5": (b"hello" * 100, "cannot be read"),
    }
    for name, (content, message) in cases.items():
        (tmp_path / name).write_bytes(content)
        refused(read_pose2room, tmp_path / name, message)
    np.savez(tmp_path / "two.npz", a=unity(person()), b=unity(person()))
    refused(read_pose2room, tmp_path / "two.npz", "2 entries; the limit is 1")
    whole = sound(tmp_path / "a.hdf5").read_bytes()
    (tmp_path / "half.hdf5").write_bytes(whole[: len(whole) // 2])
    refused(read_pose2room, tmp_path / "half.hdf5", "cannot be read")
    refused(read_pose2room, tmp_path / "absent.hdf5", "cannot be read")
    refused(read_pose2room, tmp_path / "absent.npy", "cannot be read")


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("skeleton_joints", None, "has no 'skeleton_joints'"),
        (
            "skeleton_joints",
            np.zeros((6, 25, 3)),
            r"/skeleton_joints has shape \(6, 25, 3\); expected \(frames, 53, 3\)",
        ),
        ("skeleton_joints", np.array([b"abc"]), "/skeleton_joints is no array of numbers"),
        ("skeleton_joints", h5py.Empty("f8"), "/skeleton_joints is no array of numbers"),
        ("object_nodes", np.zeros(3), "/object_nodes is no group"),
        ("object_nodes/1", 3.0, "/object_nodes/1 is no group; expected centroid, R_mat and size"),
        ("object_nodes/0/class_id", np.array([22]), "/object_nodes/0/class_id is 22; expected 0 to 21"),
        ("object_nodes/0/class_id", np.array([1.5]), "/object_nodes/0/class_id is 1.5"),
        ("object_nodes/0/class_id", None, "/object_nodes/0 has no 'class_id'"),
        ("object_nodes/0/centroid", np.array([1.0, np.nan, 0.0]), "/object_nodes/0/centroid holds"),
        ("object_nodes/0/centroid", np.zeros(2), r"/object_nodes/0/centroid has shape \(2,\); expected \(3\)"),
        ("object_nodes/0/R_mat", np.ones((3, 3)), "object_nodes/0.R_mat has rows that are not perpendicular"),
        ("object_nodes/0/R_mat", np.eye(3)[[1, 0, 2]], "object_nodes/0.R_mat has second row .*expected the vertical"),
        ("object_nodes/0/size", np.array([1.0, 0.0, 1.0]), "object_nodes/0.size is .*expected metres > 0"),
        ("object_nodes/0/size", np.array([1.0, -1.0, 1.0]), "object_nodes/0.size is"),
        ("room_bbox/size", None, "/room_bbox has no 'size'"),
        ("room_bbox", np.zeros(3), "room_bbox is no group"),
    ],
)
def test_damaged_samples_are_named(tmp_path: Path, key: str, value: Any, message: str) -> None:
    path = sound(tmp_path / "damaged.hdf5")
    with h5py.File(path, "a") as file:
        del file[key]
        if value is not None:
            file[key] = value
    refused(read_pose2room, path, message)


def test_samples_that_point_elsewhere_are_refused(tmp_path: Path) -> None:
    other = sound(tmp_path / "other.hdf5")
    secret = tmp_path / "secret.raw"
    secret.write_bytes(unity(person()).tobytes())
    for kind in ("external link", "soft link", "raw file", "virtual"):
        path = sound(tmp_path / "damaged.hdf5")
        with h5py.File(path, "a") as file:
            del file["skeleton_joints"]
            if kind == "external link":
                file["skeleton_joints"] = h5py.ExternalLink(str(other), "/skeleton_joints")
            elif kind == "soft link":
                file["skeleton_joints"] = h5py.SoftLink("/skeleton_joint_votes")
            elif kind == "raw file":
                size = secret.stat().st_size
                file.create_dataset("skeleton_joints", (FRAMES, 53, 3), "f8", external=[(str(secret), 0, size)])
            else:
                layout = h5py.VirtualLayout((FRAMES, 53, 3), "f8")
                layout[:] = h5py.VirtualSource(str(other), "skeleton_joints", (FRAMES, 53, 3))
                file.create_virtual_dataset("skeleton_joints", layout)
        refused(read_pose2room, path, "links|lies in another file")


def test_claims_are_not_allocated(tmp_path: Path) -> None:
    path = sound(tmp_path / "claims.hdf5")
    with h5py.File(path, "a") as file:
        del file["skeleton_joints"]
        file.create_dataset("skeleton_joints", (2**40, 53, 3), "f8", chunks=(1, 53, 3))
    refused(read_pose2room, path, "has 1,099,511,627,776 frames; expected 1 to 36,000")


def test_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = sound(tmp_path / "a.hdf5")
    monkeypatch.setattr(pose2room, "MAX_OBJECTS", 1)
    refused(read_pose2room, path, "object_nodes has 2 objects; expected at most 1")
    monkeypatch.setattr(pose2room, "MAX_FRAMES", 5)
    refused(read_pose2room, path, "has 6 frames; expected 1 to 5")
    monkeypatch.setattr(pose2room, "MAX_BYTES", 1000)
    refused(read_pose2room, path, "bytes; expected at most 1,000")


@pytest.fixture(scope="module")
def contents(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Sound files by suffix."""
    folder = tmp_path_factory.mktemp("sound")
    np.save(folder / "a.npy", unity(person()))
    np.savez_compressed(folder / "a.npz", joints=unity(person()))
    sound(folder / "a.hdf5")
    return {suffix: (folder / f"a.{suffix}").read_bytes() for suffix in ("npy", "npz", "hdf5")}


@ANY_FILE
@given(data=st.data(), suffix=st.sampled_from(["npy", "npz", "hdf5", "hdf5"]))
def test_mutations_are_read_or_refused(
    tmp_path: Path, contents: dict[str, bytes], data: st.DataObject, suffix: str
) -> None:
    damaged = data.draw(mutated(contents[suffix]))
    refused_or_read(
        read_pose2room, tmp_path / f"mutated.{suffix}", damaged, lambda found: pose2room_episode(found, "a")
    )
