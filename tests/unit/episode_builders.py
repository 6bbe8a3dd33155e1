"""Small schema objects that several tests start from, each valid, and comparison in all fields."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.convex import ConvexSolid, box, cylinder, span
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import planar
from hsbench.schema import (
    SKELETONS,
    AffordanceTruth,
    EventTable,
    ObjectMotions,
    ObjectTruth,
    OccupancyTruth,
    Part,
    PoseTable,
    Room,
    Scene,
    SceneObject,
    Sensor,
    TruePoseTable,
)

SENSORS = {
    "rgbd": Sensor("rgbd", PinholeCamera(24, 18, 20.0, 21.5, 12.0, 9.25), 1.5, 0.3, 0.01),
    "equirectangular": Sensor("equirectangular", EquirectangularCamera(32, 16), None),
    "monocular": Sensor("monocular", PinholeCamera(24, 18, 20.0, 20.0, 12.0, 9.0), 2.2, 0.2, -0.02),
    "topdown": Sensor("topdown", TopDownCamera(16, 16, 0.4), None),
}


def same(a: Any, b: Any) -> bool:
    """Equal in type, in every field, and in the dtype, shape and every value (NaN too) of every array."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        nan = a.dtype.kind == "f"
        return a.dtype == b.dtype and a.shape == b.shape and np.array_equal(a, b, equal_nan=nan)
    if dataclasses.is_dataclass(a):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return bool(a == b)


def poses(seed: int = 0, n: int = 6, skeleton: str = "kinect-v2-25", metres: bool = True, pixels: bool = False):
    """n poses, two tracks at every time, a tenth of a second apart, some joints inferred or missing."""
    rng = np.random.default_rng(seed)
    joints = len(SKELETONS[skeleton].names)
    state = rng.choice([0, 1, 2, 2], size=(n, joints)).astype(np.uint8)
    missing = (state == 0)[..., None]
    return PoseTable(
        skeleton,
        np.arange(n, dtype=np.int64) // 2 * 100_000_000,
        (np.arange(n) % 2 + 3).astype(np.int32),
        state,
        np.where(missing, np.nan, rng.uniform(-3, 3, (n, joints, 3))).astype(np.float32) if metres else None,
        np.where(missing, np.nan, rng.uniform(0, 30, (n, joints, 2))).astype(np.float32) if pixels else None,
    )


def true_poses(observed: int = 6) -> TruePoseTable:
    """Four true poses of one person, and a match for every observed pose, false detections among them."""
    rng = np.random.default_rng(9)
    truth = PoseTable(
        "kinect-v2-25",
        np.arange(4, dtype=np.int64) * 100_000_000,
        np.ones(4, dtype=np.int32),
        np.full((4, 25), 2, dtype=np.uint8),
        rng.uniform(-3, 3, (4, 25, 3)).astype(np.float32),
    )
    match = np.array([k % 5 - 1 for k in range(observed)], dtype=np.int64)
    return TruePoseTable(truth, np.array([0, 1, 2, 3], dtype=np.uint8), match)


def events() -> EventTable:
    """Two events: sitting, then touching nothing in particular."""
    return EventTable(
        np.array([1, 2], dtype=np.int32),
        ("sit", "stand"),
        np.array([4, 0], dtype=np.int32),
        ("seat", ""),
        np.array([0, 5], dtype=np.int64),
        np.array([7, 5], dtype=np.int64),
        ("pelvis", ""),
    )


def motions() -> ObjectMotions:
    """The table of ``scene()`` is pushed aside while its leg turns on the spot, and comes back without turning."""
    move = [[0.1, -0.25, 0.5], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]]
    return ObjectMotions(
        np.array([5, 5, 200_000_000], dtype=np.int64),
        np.array([4, 4, 4], dtype=np.int32),
        ("", "leg", ""),
        np.array(move),
    )


def furniture(object_id: int, solid: ConvexSolid, category: str = "sideboard", pose: Any = None) -> SceneObject:
    """An object of one convex part."""
    part = Part("body", (90, 120, 30), "top" if category == "sideboard" else None, solid)
    return SceneObject(object_id, category, np.eye(4) if pose is None else pose, (part,))


def scene(mesh: bool = True) -> Scene:
    """A room with a wall, a turned table of two parts, and (``mesh``) an imported open surface."""
    wall = furniture(1, span((-1.0, -3.1, 0.0), (5.0, -3.0, 2.5)), "wall")
    table = SceneObject(
        4,
        "dining_table",
        planar(2.0, 0.3, 0.7),
        (
            Part("top", (200, 150, 90), "top", box((1.2, 0.8, 0.04), (0, 0, 0.72))),
            Part("leg", (10, 20, 255), None, cylinder(0.1, 0.0, 0.7)),
        ),
        movable=True,
    )
    surface = Part(
        "scan",
        (0, 0, 0),
        mesh=(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0.5]]), np.array([[0, 1, 2], [0, 2, 3]], np.int32)),
    )
    imported = (SceneObject(7, "object", planar(1.0, -1.0, -2.0, 0.4), (surface,)),) if mesh else ()
    outline = np.array([[-1.0, -3.0], [5.0, -3.0], [5.0, 3.0], [-1.0, 3.0]])
    return Scene("scene-000012", (Room("dining", outline),), 2.5, (wall, table, *imported), "plain")


def occupancy(seed: int = 0, shape: tuple[int, int, int] = (5, 4, 11)) -> OccupancyTruth:
    """Random voxels on a small grid, some never swept."""
    rng = np.random.default_rng(seed)
    solid = rng.random(shape) < 0.4
    swept = np.where(rng.random(shape) < 0.5, np.inf, rng.uniform(0, 90, shape))
    return OccupancyTruth(
        VoxelGrid((0.0, -1.25, 0.1), shape, 0.05),
        np.where(solid, rng.integers(1, 30, shape), 0).astype(np.uint8),
        np.where(solid, rng.integers(1, 59999, shape), 0).astype(np.uint16),
        rng.integers(0, 7, shape).astype(np.uint8),
        rng.random(shape) < 0.1,
        swept.astype(np.float32),
    )


def object_truth(n: int = 3) -> ObjectTruth:
    """Truth of the n objects of ``scene()``."""
    return ObjectTruth(
        np.array([1, 4, 7][:n], dtype=np.int32),
        np.array([0, 30, 100][:n], dtype=np.int64),
        np.array([0, 90, 120][:n], dtype=np.int64),
        np.array([0, 2, 1][:n], dtype=np.uint8),
        np.array([0.0, 0.25, 1.0][:n], dtype=np.float32),
    )


def affordance() -> AffordanceTruth:
    """A map of every bit, one cell ignored."""
    labels = np.arange(128, dtype=np.uint8).reshape(8, 16)
    return AffordanceTruth(labels, labels == 5, 0.1)
