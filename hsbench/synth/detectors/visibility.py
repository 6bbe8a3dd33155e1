"""What hides a joint: the state of every joint of true poses, by lines of sight alone.

A joint is MISSING outside the image or the detector's range; INFERRED where something hides it (a part of the scene,
another person, or a part of the own body that is not the flesh about the joint); else TRACKED. All lines of sight are
float64 rays from the camera's centre to the true joint, never pixels. Episode frame, metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numba
import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.capsules import point_gap, segment_hits
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.poses import JointState
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import Skeleton
from hsbench.synth.detectors.landmarks import belonging, landmarks
from hsbench.synth.detectors.occluders import Occluders
from hsbench.synth.people.body import CAPSULE_JOINTS, Body, capsules
from hsbench.typing import BoolArray, FloatArray, IntArray, UInt8Array

FLESH_M = 0.10  # half a chest: what a joint lies so deep in is the skin over it, not something before it
SLACK_M2 = 1e-9  # a sphere is wider than what it holds by more than rounding


class People(NamedTuple):
    """N true poses at ascending times: joints (N, J, 3) in metres; capsules: ends (N, C, 2, 3), radii (N, C, 2)."""

    timestamp_ns: IntArray
    joints: FloatArray
    ends: FloatArray
    radii: FloatArray


def people(
    timestamp_ns: IntArray, person: IntArray, joints: FloatArray, bodies: Sequence[Body], skeleton: Skeleton
) -> People:
    """(N, 25, 3) Kinect joints of the persons 1 .. len(bodies) as a detector of this skeleton meets them.

    Raises SchemaError for a person without a body.
    """
    found = np.empty((len(joints), len(skeleton.names), 3))
    ends = np.empty((len(joints), len(CAPSULE_JOINTS), 2, 3))
    radii = np.empty(ends.shape[:3])
    for number in np.unique(person):
        if not 1 <= number <= len(bodies):
            raise SchemaError(f"true poses name person {number}; expected 1..{len(bodies)}, one for each body")
        rows, body = person == number, bodies[int(number) - 1]
        found[rows] = quantise_m(landmarks(skeleton, body, joints[rows]))
        ends[rows], radii[rows] = capsules(body, joints[rows])
    return People(timestamp_ns, found, ends, radii)


def joint_states(
    bodies: People, skeleton: Skeleton, occluders: Occluders, sensor: Sensor, range_m: tuple[float, float]
) -> UInt8Array:
    """(N, J) uint8 of ``JointState``. People hide each other where they are at the same time."""
    camera = np.ascontiguousarray(sensor.world_T_camera[:3, 3])
    pixels, depth = sensor.camera.project(apply(invert(sensor.world_T_camera), bodies.joints))
    shown = sensor.camera.contains(pixels) & (quantise_m(depth) >= range_m[0]) & (quantise_m(depth) <= range_m[1])
    hidden = occluders.hide(camera, bodies.timestamp_ns, bodies.joints, shown)
    moments = _moments(bodies.timestamp_ns)
    hidden |= _hidden_by_bodies(
        camera, bodies.joints, shown & ~hidden, bodies.ends, bodies.radii, belonging(skeleton), moments,
        _spheres(bodies.ends, bodies.radii, (1, 2)), _spheres(bodies.ends, bodies.radii, (2,)),
    )  # fmt: skip
    seen = np.where(hidden, JointState.INFERRED, JointState.TRACKED)
    return np.where(shown, seen, JointState.MISSING).astype(np.uint8)


def _moments(timestamp_ns: IntArray) -> IntArray:
    """(N, 2) first and one past the last row of the same time."""
    first = np.searchsorted(timestamp_ns, timestamp_ns, side="left")
    return np.stack([first, np.searchsorted(timestamp_ns, timestamp_ns, side="right")], axis=1).astype(np.int64)


def _spheres(ends: FloatArray, radii: FloatArray, axes: tuple[int, ...]) -> FloatArray:
    """(N, C, 2, 3) ends, (N, C, 2) radii -> (N, 4) or (N, C, 4) a sphere about what lies along the axes: x y z r^2."""
    middle = ends.mean(axis=axes, keepdims=True)
    reach = (np.sqrt(((ends - middle) ** 2).sum(axis=-1)) + radii).max(axis=axes) ** 2 + SLACK_M2
    return np.concatenate([middle.squeeze(axes), reach[..., None]], axis=-1)


@numba.njit(cache=True)
def _hidden_by_bodies(
    camera: FloatArray, joints: FloatArray, asked: BoolArray, ends: FloatArray, radii: FloatArray, belongs: BoolArray,
    moments: IntArray, bodies: FloatArray, capsules: FloatArray,
) -> BoolArray:  # fmt: skip
    """(N, J) whether a capsule of any body at the same time cuts the line from the camera to a joint.

    Of the own body those capsules do not count that the joint belongs to or lies in, nor the last ``FLESH_M`` of the
    line. bodies, capsules: their spheres.
    """
    hidden = np.zeros(asked.shape, dtype=np.bool_)
    for row in range(asked.shape[0]):
        for j in range(asked.shape[1]):
            if not asked[row, j]:
                continue
            joint = joints[row, j]
            skin = _before(camera, joint, FLESH_M)
            for other in range(moments[row, 0], moments[row, 1]):
                own = other == row
                if not own and _passes(camera, joint, bodies[other]):
                    continue
                for c in range(ends.shape[1]):
                    if (own and belongs[c, j]) or _passes(camera, joint, capsules[other, c]):
                        continue
                    a, b = ends[other, c, 0], ends[other, c, 1]
                    ra, rb = radii[other, c, 0], radii[other, c, 1]
                    if not segment_hits(camera, skin if own else joint, a, b, ra, rb):
                        continue
                    if own and point_gap(joint[0], joint[1], joint[2], a, b, ra, rb) <= 0.0:
                        continue
                    hidden[row, j] = True
                    break
                if hidden[row, j]:
                    break
    return hidden


@numba.njit(cache=True)
def _before(p: FloatArray, q: FloatArray, distance: float) -> FloatArray:
    """The point so far before q (3,) on the way from p (3,); p if that is nearer."""
    way = q - p
    length = np.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    return p + way * max(0.0, 1.0 - distance / length) if length > 0.0 else p.copy()


@numba.njit(cache=True)
def _passes(p: FloatArray, q: FloatArray, sphere: FloatArray) -> bool:
    """Whether the whole line through p and q (3,) passes a sphere (4,) x y z r^2."""
    ex, ey, ez = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    mx, my, mz = sphere[0] - p[0], sphere[1] - p[1], sphere[2] - p[2]
    cx, cy, cz = my * ez - mz * ey, mz * ex - mx * ez, mx * ey - my * ex
    return cx * cx + cy * cy + cz * cz > sphere[3] * (ex * ex + ey * ey + ez * ez)
