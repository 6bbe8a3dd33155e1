"""What a pose detector gives of true poses: joints that are seen, guessed or missing, with its errors and its losses.

A joint is MISSING outside the image or the detector's range; INFERRED where something hides it (a solid of the scene,
another person, or a part of the own body that the joint does not belong to); else TRACKED. All lines of sight are
float64 rays from the camera's centre to the true joint, never pixels. Episode frame, metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.capsules import point_gap, segment_hits
from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.rays import pack_solids, segments_blocked
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.episode import NS_PER_S
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.people.body import CAPSULE_JOINTS, Body, J, capsules
from hsbench.synth.seeds import Seeds
from hsbench.typing import BoolArray, FloatArray, IntArray, UInt8Array

UPPER_BODY = (
    "spine_mid", "neck", "head", "spine_shoulder", "shoulder_left", "shoulder_right",
    "elbow_left", "elbow_right", "wrist_left", "wrist_right", "hand_left", "hand_right",
)  # fmt: skip


@dataclass(frozen=True)
class PosePreset:
    """A detector of 3D joints. Defaults resemble published Kinect v2 accuracy (Wang et al. 2015; Yang et al. 2015).

    tracked_m, inferred_m: standard deviation of a coordinate; the latter drifts with a correlation time of ``drift_s``.
    range_m: nearest and farthest distance along the optical axis (a sphere's: along the ray).
    upper_joints: a body is found if so many upper body joints are tracked.
    dropouts_per_min, dropout_s: moments at which the detector loses a body it could see.
    lost_s: a body lost for longer comes back under a new track id.
    """

    name: str = "kinect"
    tracked_m: float = 0.012
    inferred_m: float = 0.06
    drift_s: float = 1.0
    range_m: tuple[float, float] = (0.5, 8.0)
    upper_joints: int = 6
    dropouts_per_min: float = 2.0
    dropout_s: tuple[float, float] = (0.1, 0.5)
    lost_s: float = 1.0

    def __post_init__(self) -> None:
        if min(self.tracked_m, self.inferred_m, self.dropouts_per_min) < 0 or self.drift_s <= 0:
            raise SchemaError(f"pose preset {self.name}: errors and rates must be >= 0 and drift_s > 0")
        if not 0 <= self.range_m[0] < self.range_m[1]:
            raise SchemaError(f"pose preset {self.name}: range_m is {self.range_m}; expected 0 <= nearest < farthest")


KINECT = PosePreset()


def observe(
    poses: PoseTable,
    bodies: Sequence[Body],
    solids: Sequence[ConvexSolid],
    sensor: Sensor,
    preset: PosePreset,
    seeds: Seeds,
) -> tuple[PoseTable, IntArray]:
    """What the detector gives of N true poses -> (M observed poses, (M,) int64 row of the true pose of each).

    True poses are Kinect joints; track_id k is the person of ``bodies[k - 1]``. Poses and solids are in the episode
    frame. The first seconds of a longer take are observed as a shorter one would be.
    """
    if poses.skeleton != KINECT_V2.name or poses.joints_m is None:
        raise SchemaError(f"true poses are {poses.skeleton!r}; expected 3D joints of {KINECT_V2.name}")
    joints = poses.joints_m.astype(np.float64)
    state = joint_states(poses, bodies, solids, sensor, preset.range_m)
    found = (state[:, [J[n] for n in UPPER_BODY]] == JointState.TRACKED).sum(axis=1) >= preset.upper_joints
    track_id = np.zeros(len(poses), dtype=np.int32)
    noisy = np.empty_like(joints)
    gaps: list[tuple[int, int, IntArray]] = []
    for person in np.unique(poses.track_id):
        rows = np.flatnonzero(poses.track_id == person)
        node = seeds.child("person").child(int(person))
        found[rows] &= ~_dropped(poses.timestamp_ns[rows], preset, node.rng("dropouts"))
        noisy[rows] = joints[rows] + _errors(poses.timestamp_ns[rows], state[rows], preset, node)
        seen = rows[found[rows]]
        lost = np.diff(poses.timestamp_ns[seen]) > round(preset.lost_s * NS_PER_S)
        for part in np.split(seen, np.flatnonzero(lost) + 1):
            if len(part):
                gaps.append((int(poses.timestamp_ns[part[0]]), int(person), part))
    for number, (_, _, part) in enumerate(sorted(gaps, key=lambda g: g[:2]), start=1):
        track_id[part] = number
    kept = np.flatnonzero(found)
    kept = kept[np.lexsort((track_id[kept], poses.timestamp_ns[kept]))]
    values = np.where(state[kept, :, None] == JointState.MISSING, np.nan, quantise_m(noisy[kept])).astype(np.float32)
    observed = PoseTable(KINECT_V2.name, poses.timestamp_ns[kept], track_id[kept], state[kept], values)
    return observed, kept.astype(np.int64)


def joint_states(
    poses: PoseTable,
    bodies: Sequence[Body],
    solids: Sequence[ConvexSolid],
    sensor: Sensor,
    range_m: tuple[float, float],
) -> UInt8Array:
    """(N, 25) uint8 of ``JointState`` for true poses, by geometry alone."""
    assert poses.joints_m is not None
    joints = poses.joints_m.astype(np.float64)
    camera_at = sensor.world_T_camera[:3, 3]
    pixels, depth = sensor.camera.project(apply(invert(sensor.world_T_camera), joints))
    inside = np.isfinite(pixels).all(axis=-1)
    if isinstance(sensor.camera, PinholeCamera):
        inside = sensor.camera.contains(pixels)
    shown = inside & (quantise_m(depth) >= range_m[0]) & (quantise_m(depth) <= range_m[1])
    hidden = np.zeros(shown.shape, dtype=np.bool_)
    hidden[shown] = segments_blocked(camera_at, joints[shown], pack_solids(solids))
    if len(poses):
        ends, radii = _all_capsules(poses, bodies, joints)
        moments = _moments(poses.timestamp_ns)
        hidden |= _hidden_by_bodies(camera_at, joints, shown & ~hidden, ends, radii, _belongs(), moments)
    seen = np.where(hidden, JointState.INFERRED, JointState.TRACKED)
    return np.where(shown, seen, JointState.MISSING).astype(np.uint8)


def _all_capsules(poses: PoseTable, bodies: Sequence[Body], joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N, C, 2, 3) ends and (N, C, 2) radii of each row's body."""
    ends = np.empty((len(poses), len(CAPSULE_JOINTS), 2, 3))
    radii = np.empty(ends.shape[:3])
    for person in np.unique(poses.track_id):
        if not 1 <= person <= len(bodies):
            raise SchemaError(f"true poses name person {person}; expected 1..{len(bodies)}, one for each body")
        rows = poses.track_id == person
        ends[rows], radii[rows] = capsules(bodies[int(person) - 1], joints[rows])
    return ends, radii


def _belongs() -> BoolArray:
    """(C, 25) whether a joint belongs to a capsule, and so is not hidden by it."""
    belongs = np.zeros((len(CAPSULE_JOINTS), len(J)), dtype=np.bool_)
    for c, names in enumerate(CAPSULE_JOINTS):
        belongs[c, [J[n] for n in names]] = True
    return belongs


def _moments(timestamp_ns: IntArray) -> IntArray:
    """(N, 2) first and one past the last row of the same time."""
    first = np.searchsorted(timestamp_ns, timestamp_ns, side="left")
    return np.stack([first, np.searchsorted(timestamp_ns, timestamp_ns, side="right")], axis=1).astype(np.int64)


def _dropped(timestamp_ns: IntArray, preset: PosePreset, rng: np.random.Generator) -> BoolArray:
    """(N,) whether the detector loses the body at a time though it could see it."""
    dropped = np.zeros(len(timestamp_ns), dtype=np.bool_)
    if preset.dropouts_per_min == 0 or not len(timestamp_ns):
        return dropped
    seconds = (timestamp_ns - timestamp_ns[0]) / NS_PER_S
    at = 0.0
    while True:
        at = float(quantise_m(at + rng.exponential(60.0 / preset.dropouts_per_min)))
        length = float(quantise_m(rng.uniform(*preset.dropout_s)))
        if at > seconds[-1]:
            return dropped
        dropped |= (seconds >= at) & (seconds < at + length)
        at += length


def _errors(timestamp_ns: IntArray, state: UInt8Array, preset: PosePreset, seeds: Seeds) -> FloatArray:
    """(N, 25, 3) metres: white for tracked joints, drifting for inferred ones."""
    shape = (*state.shape, 3)
    white = seeds.rng("tracked").standard_normal(shape)
    seconds = np.diff(timestamp_ns, prepend=timestamp_ns[:1]) / NS_PER_S
    keep = np.asarray(np.round(np.exp(-seconds / preset.drift_s), 12), dtype=np.float64)
    keep[:1] = 0.0
    drift = _autoregress(seeds.rng("inferred").standard_normal(shape).reshape(len(state), -1), keep).reshape(shape)
    inferred = (state == JointState.INFERRED)[..., None]
    return np.where(inferred, preset.inferred_m * drift, preset.tracked_m * white)


@numba.njit(cache=True)
def _autoregress(white: FloatArray, keep: FloatArray) -> FloatArray:
    """x(t) = keep x(t - 1) + sqrt(1 - keep^2) white: unit variance at every time."""
    out = np.empty_like(white)
    for t in range(len(white)):
        fresh = np.sqrt(1.0 - keep[t] * keep[t])
        for k in range(white.shape[1]):
            out[t, k] = fresh * white[t, k]
            if t > 0:
                out[t, k] += keep[t] * out[t - 1, k]
    return out


@numba.njit(cache=True)
def _hidden_by_bodies(
    camera: FloatArray, joints: FloatArray, asked: BoolArray, ends: FloatArray, radii: FloatArray, belongs: BoolArray,
    moments: IntArray,
) -> BoolArray:  # fmt: skip
    """(N, 25) whether a capsule of any body at the same time cuts the line from the camera to a joint.

    Of the own body those capsules do not count that the joint belongs to or lies in.
    """
    hidden = np.zeros(asked.shape, dtype=np.bool_)
    for row in range(asked.shape[0]):
        for j in range(asked.shape[1]):
            if not asked[row, j]:
                continue
            joint = joints[row, j]
            for other in range(moments[row, 0], moments[row, 1]):
                for c in range(ends.shape[1]):
                    a, b = ends[other, c, 0], ends[other, c, 1]
                    ra, rb = radii[other, c, 0], radii[other, c, 1]
                    own = other == row
                    if own and (belongs[c, j] or point_gap(joint[0], joint[1], joint[2], a, b, ra, rb) <= 0.0):
                        continue
                    if segment_hits(camera, joint, a, b, ra, rb):
                        hidden[row, j] = True
                        break
                if hidden[row, j]:
                    break
    return hidden
