"""A body as a low-poly coloured mesh: what renderers draw. Its topology is the same for every body and every pose.

Limbs are their tapered capsules; the torso is one loft of ellipses around its capsules; the head is an ellipsoid with
a face in front and hair on top and behind. Vertices are in the joints' frame, triangles counter-clockwise from outside.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hsbench.synth.people.body import CAPSULE_JOINTS, Body, J, capsules, unit
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray, UInt8Array

SIDES = 10  # of a limb
HEAD_RINGS, HEAD_SIDES = 8, 14
TORSO_SIDES = 14
CAP_RINGS_RAD = (0.9, 0.0)  # latitudes of a limb's end: near the pole and at the rim
SKIN, HAIR, SHIRT, TROUSERS, SHOES = range(5)

HEAD_AXES = (0.055, 0.045, 0.066)  # half axes forward, left, up, shares of stature
HAIR_PLANE = (-0.75, 0.0, 0.80, 0.12)  # hair where forward, left, up of the unit sphere exceed the last
HAIR_GROWTH = 1.05

# Rings of the torso: at which joint, shift along the spine, half width, half depth (shares of stature), material above.
TORSO: tuple[tuple[str, float, float, float, int], ...] = (
    ("spine_base", -0.045, 0.050, 0.045, TROUSERS),
    ("spine_base", -0.020, 0.094, 0.060, TROUSERS),
    ("spine_base", 0.030, 0.098, 0.062, SHIRT),
    ("spine_mid", -0.040, 0.090, 0.059, SHIRT),
    ("spine_mid", 0.040, 0.099, 0.061, SHIRT),
    ("spine_shoulder", -0.050, 0.104, 0.060, SHIRT),
    ("spine_shoulder", -0.010, 0.096, 0.048, SHIRT),
    ("spine_shoulder", 0.018, 0.040, 0.036, SHIRT),
)

_LIMB_MATERIAL = {"head": SKIN, "neck": SKIN, "shoulder": SHIRT, "spine": SHIRT, "elbow": SKIN, "wrist": SKIN,
                  "hip": TROUSERS, "knee": TROUSERS, "ankle": SHOES}  # fmt: skip
LIMBS: tuple[int, ...] = tuple(
    i for i, joints in enumerate(CAPSULE_JOINTS)
    if i > 0 and not (joints[0].startswith("spine") and joints[1].startswith("spine"))
)  # fmt: skip
"""The capsules drawn as limbs: all but the head's and the torso's."""


def body_mesh(body: Body, joints: FloatArray) -> tuple[FloatArray, Int32Array, UInt8Array]:
    """(25, 3) joints -> ((V, 3) vertices in metres, (T, 3) int32 triangles, (T, 3) uint8 sRGB colours)."""
    joints = np.asarray(joints, dtype=np.float64)
    ends, radii = capsules(body, joints[None])
    limbs = list(LIMBS)
    vertices = np.concatenate([_limbs(ends[0, limbs], radii[limbs]), _torso(body, joints), _head(body, joints)])
    triangles, material = _topology()
    palette = np.array([body.skin, body.hair, body.shirt, body.trousers, body.shoes], dtype=np.uint8)
    return vertices, triangles, palette[material]


def _limbs(ends: FloatArray, radii: FloatArray) -> FloatArray:
    """(C, 2, 3) ends, (C, 2) radii -> (C * (4 SIDES + 2), 3): both poles, then the rings from a to b."""
    axis = unit(ends[:, 1] - ends[:, 0])
    helper = np.where(np.abs(axis[:, 2:]) < 0.7, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    across = unit(np.cross(helper, axis))
    beside = np.cross(axis, across)
    circle = _circle(SIDES)
    around = circle[:, 0, None] * across[:, None] + circle[:, 1, None] * beside[:, None]
    rings = []
    for end, sign, latitudes in ((0, -1.0, CAP_RINGS_RAD), (1, 1.0, CAP_RINGS_RAD[::-1])):
        for latitude in latitudes:
            middle = ends[:, end] + sign * np.sin(latitude) * radii[:, end, None] * axis
            rings.append(middle[:, None] + np.cos(latitude) * radii[:, end, None, None] * around)
    poles = np.stack([ends[:, 0] - radii[:, :1] * axis, ends[:, 1] + radii[:, 1:] * axis], axis=1)
    return np.asarray(np.concatenate([poles, *rings], axis=1).reshape(-1, 3))


def _torso(body: Body, joints: FloatArray) -> FloatArray:
    """(2 + rings * TORSO_SIDES, 3): both poles, then the rings from below."""
    base, mid, top = (joints[J[n]] for n in ("spine_base", "spine_mid", "spine_shoulder"))
    hips = joints[J["hip_left"]] - joints[J["hip_right"]]
    chest = joints[J["shoulder_left"]] - joints[J["shoulder_right"]]
    up = {"spine_base": mid - base, "spine_mid": top - base, "spine_shoulder": top - mid}
    lefts = {"spine_base": hips, "spine_mid": hips + chest, "spine_shoulder": chest}
    ups = unit(np.array([up[name] for name, *_ in TORSO]))
    left = unit(np.array([lefts[name] for name, *_ in TORSO]))
    forward = unit(np.cross(left, ups))
    left = np.cross(ups, forward)
    at = np.array([joints[J[name]] for name, *_ in TORSO])
    shape = np.array([row[1:4] for row in TORSO]) * body.stature_m * (1.0, body.girth, body.girth)
    middle = at + shape[:, :1] * ups
    circle = _circle(TORSO_SIDES)
    rings = (
        middle[:, None]
        + (circle[:, 0] * shape[:, 2, None])[..., None] * forward[:, None]
        + (circle[:, 1] * shape[:, 1, None])[..., None] * left[:, None]
    )
    return np.concatenate([middle[[0, -1]], rings.reshape(-1, 3)])


def _head(body: Body, joints: FloatArray) -> FloatArray:
    """(2 + HEAD_RINGS * HEAD_SIDES, 3) of the ellipsoid: chin and crown, then the rings from below."""
    up = unit(joints[J["head"]] - joints[J["neck"]])
    left = joints[J["shoulder_left"]] - joints[J["shoulder_right"]]
    forward = unit(np.cross(left, up))
    frame = np.stack([forward, np.cross(up, forward), up], axis=0)
    sphere, grown = _head_sphere()
    size = np.array(HEAD_AXES) * body.stature_m * body.girth**0.5
    return np.asarray(joints[J["head"]] + (sphere * grown[:, None] * size) @ frame)


@lru_cache(maxsize=1)
def _head_sphere() -> tuple[FloatArray, FloatArray]:
    """(N, 3) unit sphere in forward, left, up, and (N,) growth by hair."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, HEAD_RINGS + 2)[1:-1]
    circle = _circle(HEAD_SIDES)
    rings = [np.column_stack([np.cos(a) * circle, np.full(HEAD_SIDES, np.sin(a))]) for a in latitude]
    sphere = np.concatenate([[[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], *rings])
    return sphere, np.where(_is_hair(sphere), HAIR_GROWTH, 1.0)


def _is_hair(directions: FloatArray) -> BoolArray:
    return np.asarray(directions @ np.array(HAIR_PLANE[:3]) > HAIR_PLANE[3])


@lru_cache(maxsize=1)
def _topology() -> tuple[Int32Array, IntArray]:
    """(T, 3) triangles and (T,) material of each."""
    triangles, material, first = [], [], 0
    per_limb = 2 * len(CAP_RINGS_RAD)
    loft = _loft(per_limb, SIDES)
    for i in LIMBS:
        triangles.append(loft + first)
        material.append(np.full(len(loft), _LIMB_MATERIAL[CAPSULE_JOINTS[i][0].split("_")[0]]))
        first += per_limb * SIDES + 2
    loft = _loft(len(TORSO), TORSO_SIDES)
    triangles.append(loft + first)
    ring = np.clip((loft[:, :].min(axis=1) - 2) // TORSO_SIDES, 0, len(TORSO) - 1)
    material.append(np.array([row[4] for row in TORSO])[ring])
    material[-1][(loft == 1).any(axis=1)] = SHIRT
    first += len(TORSO) * TORSO_SIDES + 2
    loft = _loft(HEAD_RINGS, HEAD_SIDES)
    triangles.append(loft + first)
    material.append(np.where(_is_hair(unit(_head_sphere()[0][loft].mean(axis=1))), HAIR, SKIN))
    return np.concatenate(triangles).astype(np.int32), np.concatenate(material).astype(np.int64)


def _loft(rings: int, sides: int) -> IntArray:
    """(T, 3) triangles of stacked rings: vertex 0 is the low pole, 1 the high one, ring r starts at 2 + r sides."""
    i = np.arange(sides)
    j = (i + 1) % sides
    parts = [np.column_stack([np.zeros(sides, dtype=np.int64), 2 + j, 2 + i])]
    for r in range(rings - 1):
        low, high = 2 + r * sides, 2 + (r + 1) * sides
        parts += [np.column_stack([low + i, low + j, high + j]), np.column_stack([low + i, high + j, high + i])]
    last = 2 + (rings - 1) * sides
    parts.append(np.column_stack([np.ones(sides, dtype=np.int64), last + i, last + j]))
    return np.concatenate(parts).astype(np.int64)


def _circle(sides: int) -> FloatArray:
    angle = 2 * np.pi * np.arange(sides) / sides
    return np.column_stack([np.cos(angle), np.sin(angle)])
