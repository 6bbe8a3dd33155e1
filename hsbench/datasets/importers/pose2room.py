"""Pose2Room (github.com/yinyunie/Pose2Room, MIT): simulated people of VirtualHome in furnished rooms.

A sample is HDF5: ``skeleton_joints`` (T, 53, 3) in metres, y up, the floor at 0, five frames a second;
``object_nodes/<number>`` with ``class_id`` (1), ``centroid`` (3), ``R_mat`` (3, 3), whose rows are the axes of a box,
the second one vertical, and ``size`` (3) along them; ``room_bbox``, a box alike, which may be missing. A joint array
(.npy, or .npz with one array) holds the joints only. Votes (``skeleton_joint_votes``) follow from the rest and are not
read.

Joints are those of a humanoid of the Unity engine, HumanBodyBones in order without the jaw. ``KINECT_OF_53`` says which
lie where a Kinect v2 has one: all but the head, which is the base of the skull, and the spine's shoulder, which is
taken to lie midway between the shoulders; both are given as inferred.

Unity's frame is left-handed, with y up; samples that were mirrored as augmentation (the last number of their name is 4
to 7) are right-handed. The file does not say. The toes do: they point forward, and with the floor below a person's
left hip lies left of that. Our frame is right-handed with z up: (x, z, y) of a left-handed one, which undoes the
mirror, and (x, -z, y) of a right-handed one, which is a turn. So left and right stay the person's own.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers.hdf5 import check_chunks
from hsbench.errors import DataError, MissingExtraError
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.io.archives import ArchiveLimits, member_faults, open_zip, read_member
from hsbench.io.reading import read_limited
from hsbench.schema.poses import JointState
from hsbench.schema.skeletons import KINECT_V2
from hsbench.typing import FloatArray, IntArray, UInt8Array

RATE_HZ = 5
JOINT_COUNT = 53
CLASSES = (
    *("bathtub", "bed", "bench", "bookshelf", "cabinet", "chair", "closet", "desk", "dishwasher", "faucet", "fridge"),
    *("garbagecan", "lamp", "microwave", "monitor", "nightstand", "sofa", "stove", "toilet", "washingmachine"),
    *("window", "computer"),
)

KINECT_OF_53 = {
    **{"spine_base": 0, "spine_mid": 8, "neck": 9, "head": 10},
    **{"shoulder_left": 13, "elbow_left": 15, "wrist_left": 17, "hand_left": 29},
    **{"hand_tip_left": 31, "thumb_left": 25},
    **{"shoulder_right": 14, "elbow_right": 16, "wrist_right": 18, "hand_right": 44},
    **{"hand_tip_right": 46, "thumb_right": 40},
    **{"hip_left": 1, "knee_left": 3, "ankle_left": 5, "foot_left": 19},
    **{"hip_right": 2, "knee_right": 4, "ankle_right": 6, "foot_right": 20},
}
"""Kinect joint -> index of the 53: bones by their upper end, hands by the root of the middle finger."""

MAX_FRAMES = 36_000  # two hours
MAX_OBJECTS = 1_000
MAX_BYTES = 2**28
MAX_ARRAY_BYTES = MAX_FRAMES * JOINT_COUNT * 3 * 8
MAX_HEADER_BYTES = 4096
MAX_COORDINATE_M = 100.0
MAX_FLOOR_M = 0.3
"""How far the lowest joint of a whole recording may lie from the floor: somewhere people stand."""
MIN_AGREEMENT = 0.8
"""Share of frames whose feet must agree on where left is; all do in the source's own array."""
AXES_TOLERANCE = 1e-3

_ANKLES, _TOES, _HIPS = [5, 6], [19, 20], [1, 2]


@dataclass(frozen=True, eq=False)
class Box:
    """An upright box: centre (3,), full size (3,) along its own x, y and z, and yaw of its x axis about z."""

    centre_m: FloatArray
    size_m: FloatArray
    yaw_rad: float


@dataclass(frozen=True, eq=False)
class Pose2RoomSample:
    """Joints (T, 53, 3) float64 in a right-handed frame with z up and the floor at 0; objects and room if known.

    ``classes``: a name of ``CLASSES`` per box of ``boxes``. ``was_left_handed``: of the file's frame.
    """

    joints_m: FloatArray
    classes: tuple[str, ...]
    boxes: tuple[Box, ...]
    room: Box | None
    was_left_handed: bool


def read_pose2room(path: str | Path) -> Pose2RoomSample:
    """Path of a sample (.hdf5, .h5) or a joint array (.npy, .npz) -> what it holds.

    Raises DataError, naming the file and the array or object, for damage, other shapes, values that are no metres, and
    a floor that is not at 0; MissingExtraError for a sample without the extra ``import``.
    """
    path = Path(path)
    if path.suffix in (".hdf5", ".h5"):
        return _read_sample(path)
    if path.suffix in (".npy", ".npz"):
        data = read_limited(path, MAX_BYTES, "another format?")
        joints = _npy(path, _only_member(path, data) if path.suffix == ".npz" else data)
        return _sample(path, joints, [], None)
    raise DataError(f"{path}: ends in {path.suffix!r}; expected a sample (.hdf5, .h5) or a joint array (.npy, .npz)")


def timestamps_ns(sample: Pose2RoomSample) -> IntArray:
    """(T,) int64 ns from 0, five frames a second."""
    return np.arange(len(sample.joints_m), dtype=np.int64) * (1_000_000_000 // RATE_HZ)


def to_kinect(joints_m: FloatArray) -> tuple[FloatArray, UInt8Array]:
    """(T, 53, 3) joints -> the (T, 25, 3) of a Kinect v2 and their (T, 25) uint8 ``JointState``."""
    index = [KINECT_OF_53.get(name, 0) for name in KINECT_V2.names]
    kinect = joints_m[:, index]
    shoulders = [KINECT_OF_53["shoulder_left"], KINECT_OF_53["shoulder_right"]]
    kinect[:, KINECT_V2.index("spine_shoulder")] = joints_m[:, shoulders].mean(axis=1)
    state = np.full(kinect.shape[:2], JointState.TRACKED, dtype=np.uint8)
    state[:, [KINECT_V2.index("spine_shoulder"), KINECT_V2.index("head")]] = JointState.INFERRED
    return kinect, state


def _sample(path: Path, joints: FloatArray, nodes: list[tuple[str, int, _Node]], room: _Node | None) -> Pose2RoomSample:
    """What was read, checked and in our frame."""
    outside = ~(np.abs(joints) <= MAX_COORDINATE_M).all(axis=(1, 2))
    if outside.any():
        frame = int(np.argmax(outside))
        raise DataError(
            f"{path}: frame {frame} has a coordinate that is NaN or beyond {MAX_COORDINATE_M:g} m; expected"
            " metres (millimetres, or bytes swapped?)"
        )
    lowest = float(joints[..., 1].min())
    if abs(lowest) > MAX_FLOOR_M:
        raise DataError(
            f"{path}: the lowest joint is at y = {lowest:.2f} m; expected the floor, 0 +- {MAX_FLOOR_M:g} m"
            " (z up, or relative to the hip?)"
        )
    left_handed = _is_left_handed(path, joints)
    return Pose2RoomSample(
        joints_m=_to_z_up(joints, left_handed),
        classes=tuple(CLASSES[class_id] for _, class_id, _ in nodes),
        boxes=tuple(_upright(f"{path}: {name}", node, left_handed) for name, _, node in nodes),
        room=None if room is None else _upright(f"{path}: /room_bbox", room, left_handed),
        was_left_handed=left_handed,
    )


def _is_left_handed(path: Path, joints: FloatArray) -> bool:
    """Whether left hips lie on the right of where toes point, if y is up and the frame were right-handed."""
    forward = (joints[:, _TOES] - joints[:, _ANKLES]).mean(axis=1)
    to_left = joints[:, _HIPS[0]] - joints[:, _HIPS[1]]
    # up x forward, with y up
    side = forward[:, 2] * to_left[:, 0] - forward[:, 0] * to_left[:, 2]
    against, along = float((side < 0).mean()), float((side > 0).mean())
    if max(against, along) < MIN_AGREEMENT:
        raise DataError(
            f"{path}: the left hip lies left of the toes in {along:.0%} of the frames, right of them in {against:.0%};"
            f" expected {MIN_AGREEMENT:.0%} alike (another order of joints?)"
        )
    return against > along


def _to_z_up(points: FloatArray, left_handed: bool) -> FloatArray:
    """(..., 3) points or directions of the file -> ours."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x, z if left_handed else -z, y], axis=-1)


@dataclass(frozen=True, eq=False)
class _Node:
    """A box as in the file: centre, axes as rows, full size along them."""

    centroid: FloatArray
    axes: FloatArray
    size: FloatArray


def _upright(where: str, node: _Node, left_handed: bool) -> Box:
    if not np.allclose(node.axes @ node.axes.T, np.eye(3), atol=AXES_TOLERANCE):
        raise DataError(f"{where}.R_mat has rows that are not perpendicular of length 1; expected the axes of a box")
    if abs(node.axes[1, 1]) < 1.0 - AXES_TOLERANCE:
        raise DataError(f"{where}.R_mat has second row {node.axes[1].round(3).tolist()}; expected the vertical, y")
    if not (quantise_m(node.size) > 0).all():
        raise DataError(f"{where}.size is {node.size.tolist()}; expected metres > 0")
    along = _to_z_up(node.axes[0], left_handed)
    return Box(
        centre_m=quantise_m(_to_z_up(node.centroid, left_handed)),
        size_m=quantise_m(node.size[[0, 2, 1]]),
        yaw_rad=quantise_angle(math.atan2(along[1], along[0])),
    )


def _read_sample(path: Path) -> Pose2RoomSample:
    try:
        import h5py
    except ModuleNotFoundError as error:
        raise MissingExtraError("a Pose2Room sample", error.name or "h5py", "import") from error
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise DataError(f"{path}: {size:,} bytes; expected at most {MAX_BYTES:,} (another format?)")
        with h5py.File(path, "r", locking=False) as file:
            joints = _dataset(h5py, file, "skeleton_joints", (None, JOINT_COUNT, 3))
            nodes = _nodes(h5py, file) if "object_nodes" in file else []
            room = _box(h5py, file, "room_bbox") if "room_bbox" in file else None
    except DataError as error:
        raise DataError(str(error) if str(path) in str(error) else f"{path}: {error}") from error
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError) as error:  # HDF5 has no one error
        reason = ascii(" ".join(str(error).split()))[1:200]
        raise DataError(f"{path}: cannot be read: {reason}; expected an HDF5 sample (an incomplete copy?)") from error
    return _sample(path, joints, nodes, room)


def _nodes(h5py: Any, file: Any) -> list[tuple[str, int, _Node]]:
    """(name, class id, box) of every object, by number."""
    group = _member(h5py, file, "object_nodes")
    if isinstance(group, h5py.Dataset) and group.shape is None:
        return []  # what the source writes for an empty list
    if not isinstance(group, h5py.Group):
        raise DataError("/object_nodes is no group; expected one, with an object a number")
    if len(group) > MAX_OBJECTS:
        raise DataError(f"/object_nodes has {len(group):,} objects; expected at most {MAX_OBJECTS:,}")
    nodes = []
    for name in sorted(group, key=lambda key: (len(key), key)):
        box = _box(h5py, group, name)
        class_id = float(_dataset(h5py, group[name], "class_id", (1,))[0])
        if class_id not in range(len(CLASSES)):
            raise DataError(f"{_name(group, name)}/class_id is {class_id:g}; expected 0 to {len(CLASSES) - 1}")
        nodes.append((_name(group, name), int(class_id), box))
    return nodes


def _box(h5py: Any, group: Any, name: str) -> _Node:
    item = _member(h5py, group, name)
    if not isinstance(item, h5py.Group):
        raise DataError(f"{_name(group, name)} is no group; expected centroid, R_mat and size")
    shapes: dict[str, tuple[int, ...]] = {"centroid": (3,), "R_mat": (3, 3), "size": (3,)}
    return _Node(*(_dataset(h5py, item, key, shape) for key, shape in shapes.items()))


def _member(h5py: Any, group: Any, name: str) -> Any:
    """A member of a group. Raises DataError for one that is missing, or lies in another place or file."""
    link = group.get(name, getlink=True)
    if link is None:
        raise DataError(f"{_name(group)} has no {name!a}; expected it")
    if not isinstance(link, h5py.HardLink):
        raise DataError(f"{_name(group, name)} links to another place; expected everything in the file itself")
    return group[name]


def _name(group: Any, member: str = "") -> str:
    """The place of a group or its member in the file, in one line whatever its characters."""
    return ascii(f"{group.name.rstrip('/')}/{member}".rstrip("/") or "/")[1:-1]


def _dataset(h5py: Any, group: Any, name: str, shape: tuple[int | None, ...]) -> FloatArray:
    """A small array of finite numbers. Its shape and kind are checked before anything is read."""
    item = _member(h5py, group, name)
    where = _name(group, name)
    if not isinstance(item, h5py.Dataset) or item.shape is None or item.dtype.kind not in "fiu":
        raise DataError(f"{where} is no array of numbers; expected one")
    if item.is_virtual or item.external:
        raise DataError(f"{where} lies in another file; expected everything in the file itself")
    _check_shape(where, item.shape, shape)
    check_chunks(item, where, MAX_BYTES)
    values = np.asarray(item[()], dtype=np.float64)
    if name != "skeleton_joints" and not (np.abs(values) <= MAX_COORDINATE_M).all():
        raise DataError(
            f"{where} holds {values.ravel()[:9].tolist()}; expected numbers of at most {MAX_COORDINATE_M:g}"
        )
    return values


def _check_shape(where: str, found: tuple[int, ...], shape: tuple[int | None, ...]) -> None:
    if len(found) != len(shape) or any(w not in (None, f) for w, f in zip(shape, found, strict=True)):
        wanted = ", ".join("frames" if side is None else str(side) for side in shape)
        raise DataError(f"{where} has shape {found}; expected ({wanted})")
    if None in shape and not 1 <= found[0] <= MAX_FRAMES:
        raise DataError(f"{where} has {found[0]:,} frames; expected 1 to {MAX_FRAMES:,}")


def _npy(path: Path, data: bytes) -> FloatArray:
    """(T, 53, 3) float64 from the bytes of an npy file; nothing is allocated before the header is believed."""
    file = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran_order, dtype = read(file, max_header_size=MAX_HEADER_BYTES)
    except Exception as error:  # numpy lets through whatever tokenising and evaluating the text raises
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise DataError(f"{path}: header cannot be read ({reason}); expected an npy array") from error
    if dtype.kind != "f":
        raise DataError(f"{path}: array of {dtype}; expected floating point metres (objects would need pickle)")
    _check_shape(f"{path}: array", shape, (None, JOINT_COUNT, 3))
    expected = file.tell() + math.prod(shape) * dtype.itemsize
    if len(data) != expected:
        raise DataError(f"{path}: {len(data):,} bytes; expected {expected:,} as its header says (an incomplete copy?)")
    flat = np.frombuffer(data, dtype=dtype, offset=file.tell())
    with np.errstate(invalid="ignore"):  # a signalling NaN; who checks the joints tells
        return np.array(flat.reshape(shape, order="F" if fortran_order else "C"), dtype=np.float64, order="C")


def _only_member(path: Path, data: bytes) -> bytes:
    limits = ArchiveLimits(files=1, file_bytes=MAX_ARRAY_BYTES + MAX_HEADER_BYTES, total_bytes=MAX_ARRAY_BYTES * 2)
    try:
        with open_zip(io.BytesIO(data), limits) as archive:
            infos = archive.infolist()
            faults = member_faults(infos, limits)
            if faults or len(infos) != 1:
                raise DataError(faults[0] if faults else f"{len(infos)} arrays; expected one, of joints")
            return read_member(archive, infos[0])
    except DataError as error:
        raise DataError(f"{path}: {str(error).splitlines()[0]} (expected an NPZ file of one array)") from error
