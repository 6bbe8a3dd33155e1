"""From MakeHuman's mesh to half a dressed body: the curves at which regions end, and how far clothes stand off.

MakeHuman's close-fitting ``helper-tights`` become clothes and bare limbs; head and hands of its body are sewn to them;
eye sockets and mouth are closed; garments are parted by steps; the face is painted by cutting along curves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from hsbench.synth.people.baking.makehuman import MakeHuman
from hsbench.synth.people.baking.surgery import (
    Piece,
    borders,
    cut,
    filled,
    hem,
    joined,
    membrane,
    normals,
    sew,
    smoothed,
)  # fmt: skip
from hsbench.synth.people.body import unit
from hsbench.synth.people.regions import EDGES, Region
from hsbench.typing import BoolArray, FloatArray, IntArray

MIDDLE_M = 1e-5  # so near to the middle plane a vertex lies in it

# Curves in the mean body, in metres from the joints named.
COLLAR = (-0.029, 0.375, 4.0)  # of the neck opening: height over the neck joint, rise to the back, curve to the sides
COLLAR_RISE_M = 0.04  # a shirt stands off fully so far from it
WRIST_SHARE = 0.93  # of the way from elbow to hand: where the sleeve ends
SLEEVE_SHARE = 0.68  # of the way from shoulder to elbow: where a short sleeve ends
HEM_M = 0.015  # above the hip joint
ANKLE_M = 0.025  # above the ankle
SOLE_M = 0.017  # above the floor
SKIRT_M = (0.045, -0.02)  # its top above the hip joint and its end above the knee
NAPE_M = (0.012, 0.012)  # its end above the collar, and its front behind the ear's root
HAIRLINE = (0.85, 0.055, 0.035)  # its slope, and where it passes above and before the head joint
IRIS_M = 0.0062  # its radius
BROW_DROP_M = 0.003  # of its ends
BROW_M = (0.021, 0.0032, 0.012, 0.048)  # height over the eye, half thickness, from x to x
LIPS_M, SMILE_PER_M = (0.026, 0.0085), 3.5  # half width and half height; how corners rise
FACE_DEPTH_M = 0.03  # of the face behind the eyes
EYE_REACH_M = 0.025  # from the middle of an eye, to the corners of its lids
EAR_M, EAR_TIP_M = (0.030, 0.026, 0.040), 0.012  # half axes of an ear, and the part that finds it
MOUTH_SHARES = (0.2, 0.55)  # between chin and eyes
FIELD_NOISE = 1e-7  # what is nearer to a curve is on it
ARM_BONES = ("upperarm", "lowerarm", "hand", "thumb", "index", "middle", "ring", "pinky")
ARM_SHARE = 0.5  # of a vertex's weights that make it one of the arm

# Thickness of clothes and hair over the skin, in metres: chosen by eye, as are the curves above.
SHIRT_M, SHIRT_HEM_M, SHIRT_CUFF_M, COLLAR_M = 0.006, 0.012, 0.011, 0.004
SLEEVE_M, TROUSERS_M, TROUSERS_END_M, SHOE_M = 0.007, 0.006, 0.016, 0.006
SKIRT_TOP_OUT_M, SKIRT_OUT_M, SKIRT_FADE_M, THIGH_IN_M = -0.025, 0.016, 0.12, -0.02  # thighs draw in under a skirt
SHORT_HAIR_M, LONG_HAIR_M, NAPE_HAIR_M = 0.012, 0.016, 0.034
FADE_M = 0.022  # hair grows to its thickness so far from the hairline
HEM_FADE_M = 0.15  # and a shirt gets wider towards its hem over this length
CLOTH_ROUNDS, CLOTH_SHARE = 8, 0.5  # of smoothing: cloth does not follow every muscle

LAYERS = ("shirt", "sleeves", "shorts", "trousers", "shoes", "skirt", "short_hair", "long_hair")

# Importance in simplification: errors on the face show most.
FACE_WEIGHT, HEAD_WEIGHT, HAND_WEIGHT, PAINT_WEIGHT = 40.0, 10.0, 5.0, 60.0
COLLAR_WEIGHT, COLLAR_RIM_M = 8.0, 0.02

RAYS, SEEN_RAYS, RAY_SEED, RAY_START_M, GRAZING = 200, 3, 0, 1e-4, 0.15
"""A face from which no more than so many of so many random rays get out is in a pocket."""


@dataclass(frozen=True, eq=False)
class Half:
    """Half a dressed body. thickness: (V, len(LAYERS)) in metres, weight: (V,) importance."""

    piece: Piece
    thickness: FloatArray
    weight: FloatArray

    def middle(self, base: FloatArray) -> BoolArray:
        """(V,) whether a vertex lies in the middle plane of base vertices (N, 3)."""
        return np.asarray(np.abs(self.piece.at(base)[:, 0]) < MIDDLE_M)


def places(piece: Piece, base: FloatArray) -> FloatArray:
    """(V, 3) skin of a shape with base vertices (N, 3); what is nearly in the middle plane is in it."""
    points = piece.at(base)
    points[np.abs(points[:, 0]) < MIDDLE_M, 0] = 0.0
    return points


def skin_normals(piece: Piece, base: FloatArray) -> FloatArray:
    """(V, 3) unit normals of a shape's skin: clothes stand off along them."""
    points = places(piece, base)
    return normals(points, piece.triangles[~np.isin(piece.region, EDGES)], points[:, 0] == 0)


class Landmarks:
    """The mean body on which curves are drawn: its joints, and fields over the vertices of a piece."""

    def __init__(self, human: MakeHuman, base: FloatArray) -> None:
        self.human, self.base = human, base
        self.arm = sum(w for name, w in human.weights.items() if name.startswith(ARM_BONES))

    def joint(self, name: str) -> FloatArray:
        """(3,) of a joint of MakeHuman's."""
        return self.human.joint(self.base, name)

    def on_arm(self, piece: Piece) -> BoolArray:
        """(V,) whether vertices move with the arm."""
        return np.asarray(piece.at(np.asarray(self.arm)) > ARM_SHARE)

    def along(self, points: FloatArray, start: str, end: str) -> FloatArray:
        """(V, 3) points -> (V,) how far they are from one joint to another, 0..1 between them."""
        a, b = self.joint(start), self.joint(end)
        return np.asarray((points - a) @ (b - a) / ((b - a) @ (b - a)))

    def outside_collar(self, points: FloatArray) -> FloatArray:
        """(V,) metres below a saddle round the neck, lower in front and higher at the sides; negative above it."""
        up, rise, curve = COLLAR
        saddle = self.joint("neck")[2] + up + rise * points[:, 1] + curve * points[:, 0] ** 2
        return np.asarray(saddle - points[:, 2])

    def hairline(self, points: FloatArray) -> FloatArray:
        """(V,) metres from the hairline, positive in the hair: above a slanting plane and off the ears."""
        slope, up, ahead = HAIRLINE
        head = self.joint("head")
        plane = (points[:, 2] - head[2] - up) * np.cos(slope) + (points[:, 1] - head[1] + ahead) * np.sin(slope)
        off_ear = (points - self.ear) / EAR_M
        ear = (np.sqrt(np.sum(off_ear**2, axis=1)) - 1.0) * min(EAR_M)
        return np.asarray(np.minimum(plane, ear))

    @cached_property
    def ear(self) -> FloatArray:
        """(3,) middle of the left ear: of what sticks out most from the head."""
        head = self.base[np.unique(self.human.triangles("body"))]
        head = head[head[:, 2] > self.joint("jaw")[2]]
        return np.asarray(head[head[:, 0] > head[:, 0].max() - EAR_TIP_M].mean(axis=0))


def dressed_half(human: MakeHuman, base: FloatArray) -> Half:
    """Half a body of base vertices (N, 3), on which its curves are drawn."""
    at = Landmarks(human, base)
    dress = clothes(at)
    body = joined([dress, head_and_hands(at)])
    for joint, edge in (("neck", Region.NECK_EDGE), ("l-hand", Region.WRIST_EDGE)):
        points = places(body, base)
        chains = borders(body.triangles, points[:, 0] == 0)
        ends = [[c for c in chains if (c[0] < dress.rows.shape[0]) == ours] for ours in (True, False)]
        cloth, skin = (nearest(of_one, points, at.joint(joint)) for of_one in ends)
        body = sew(body, points, cloth, skin, edge)
    for hole in borders(body.triangles, places(body, base)[:, 0] == 0):
        body = filled(body, hole, Region.SHIRT)
    body = joined([body, skirt(at)])
    return Half(body, thickness(at, body), importance(at, body))


def nearest(chains: list[list[int]], points: FloatArray, place: FloatArray) -> list[int]:
    """The chain of (V, 3) points whose middle is nearest to a place (3,)."""
    return min(chains, key=lambda chain: float(np.sum((points[chain].mean(axis=0) - place) ** 2)))


def left_half(at: Landmarks, piece: Piece) -> Piece:
    """The triangles with x >= 0."""
    return piece.keep(piece.centres(at.base)[:, 0] > 0)


def clothes(at: Landmarks) -> Piece:
    """Shirt, forearms, trousers, shanks and shoes, with open neck and wrist."""
    piece = Piece.of(len(at.base), at.human.triangles("helper-tights"), Region.SHIRT)
    above_ankle = piece.at(at.base)[:, 2] > at.joint("l-ankle")[2] + ANKLE_M
    piece = left_half(at, smoothed(piece, CLOTH_SHARE * above_ankle, CLOTH_ROUNDS))
    hip, knee, ankle, floor = (at.joint(name)[2] for name in ("l-upper-leg", "l-knee", "l-ankle", "ground"))
    fields: tuple[Callable[[FloatArray, BoolArray], FloatArray], ...] = (
        lambda p, arm: at.outside_collar(p),
        lambda p, arm: np.where(arm, WRIST_SHARE - at.along(p, "l-elbow", "l-hand"), 1.0),
        lambda p, arm: np.where(arm, SLEEVE_SHARE - at.along(p, "l-shoulder", "l-elbow"), 1.0),
        lambda p, arm: np.where(arm, 1.0, p[:, 2] - hip - HEM_M),
        lambda p, arm: np.where(arm, 1.0, p[:, 2] - knee),
        lambda p, arm: np.where(arm, 1.0, p[:, 2] - ankle - ANKLE_M),
        lambda p, arm: np.where(arm, 1.0, p[:, 2] - floor - SOLE_M),
    )
    regions = (None, None, Region.FOREARM, Region.TROUSERS, Region.SHANK, Region.SHOE, Region.SOLE)
    for field, region in zip(fields, regions, strict=True):
        piece = cut(piece, field(piece.at(at.base), at.on_arm(piece)))
        negative = field(piece.at(at.base), at.on_arm(piece))[piece.triangles].min(axis=1) < -FIELD_NOISE
        piece = piece.keep(~negative) if region is None else piece.painted(region, negative)
    piece = hem(piece, (Region.SHIRT,), (Region.FOREARM,), Region.SLEEVE_EDGE)
    piece = hem(piece, (Region.SHIRT,), (Region.TROUSERS,), Region.HEM_EDGE)
    piece = hem(piece, (Region.TROUSERS,), (Region.SHANK,), Region.KNEE_EDGE)
    return hem(piece, (Region.SHANK,), (Region.SHOE,), Region.ANKLE_EDGE)


def head_and_hands(at: Landmarks) -> Piece:
    """Head and neck to the collar, and the hand from the wrist on."""
    whole = Piece.of(len(at.base), at.human.triangles("body"), Region.SKIN)
    hidden = whole.at(pockets(at).astype(np.float64)) > 0
    hidden &= whole.at(at.base)[:, 2] > at.joint("neck")[2]
    shut = membrane(whole, hidden)
    corner = shut.at(at.base)[shut.triangles]
    near_eye = np.zeros(len(corner), dtype=bool)
    for side in ("l", "r"):
        near_eye |= np.sqrt(np.sum((corner.mean(axis=1) - at.joint(f"{side}-eye")) ** 2, axis=1)) < EYE_REACH_M
    mouth_z = mouth_height(at, shut, hidden)
    shut = shut.painted(Region.EYE, hidden[shut.triangles].any(axis=1) & near_eye)
    half = left_half(at, shut)
    head = cut(half, at.outside_collar(half.at(at.base)))
    points = head.at(at.base)
    inside = at.outside_collar(points)[head.triangles].max(axis=1) < FIELD_NOISE
    head = painted_head(at, head.keep(inside & (head.centres(at.base)[:, 2] > at.joint("l-shoulder")[2])), mouth_z)

    def beyond_wrist(piece: Piece) -> FloatArray:
        share = at.along(piece.at(at.base), "l-elbow", "l-hand") - WRIST_SHARE
        return np.where(at.on_arm(piece), share, -1.0)

    hand = cut(half, beyond_wrist(half))
    return joined([head, hand.keep(beyond_wrist(hand)[hand.triangles].max(axis=1) > FIELD_NOISE)])


def painted_head(at: Landmarks, head: Piece, mouth_z: float) -> Piece:
    """With hair, nape, iris, brow and lips."""
    eye, ear = at.joint("l-eye"), at.ear
    brow_up, brow_half, brow_in, brow_out = BROW_M
    lip_x, lip_z = LIPS_M

    def iris(p: FloatArray) -> FloatArray:
        return np.asarray(IRIS_M - np.sqrt((p[:, 0] - eye[0]) ** 2 + (p[:, 2] - eye[2]) ** 2))

    def brow(p: FloatArray) -> FloatArray:
        along = (2 * p[:, 0] - brow_in - brow_out) / (brow_out - brow_in)
        arch = brow_up - BROW_DROP_M * along**2
        return np.asarray(brow_half * (1 - along**4) - np.abs(p[:, 2] - eye[2] - arch))

    def lips(p: FloatArray) -> FloatArray:
        above = p[:, 2] - mouth_z - SMILE_PER_M * p[:, 0] ** 2
        return np.asarray(1.0 - np.abs(p[:, 0] / lip_x) ** 1.5 - (above / lip_z) ** 2)

    def nape(p: FloatArray) -> FloatArray:
        return np.minimum(p[:, 1] - ear[1] - NAPE_M[1], -at.outside_collar(p) - NAPE_M[0])

    curves: tuple[tuple[int, int, Callable[[FloatArray], FloatArray]], ...] = (
        (Region.SKIN, Region.SCALP, at.hairline),
        (Region.SKIN, Region.NAPE, nape),
        (Region.EYE, Region.IRIS, iris),
        (Region.SKIN, Region.BROW, lambda p: np.where(p[:, 1] < eye[1] + FACE_DEPTH_M, brow(p), -1.0)),
        (Region.SKIN, Region.LIPS, lambda p: np.where(p[:, 1] < eye[1] + FACE_DEPTH_M, lips(p), -1.0)),
    )
    for old, new, field in curves:
        head = cut(head, field(head.at(at.base)))
        positive = field(head.at(at.base))[head.triangles].max(axis=1) > FIELD_NOISE
        head = head.painted(new, positive & (head.region == old))
    return hem(head, (Region.NAPE,), (Region.SKIN,), Region.NAPE_EDGE)


def mouth_height(at: Landmarks, head: Piece, hidden: BoolArray) -> float:
    """How high the slit between the lips: the middle of the pocket between chin and nose."""
    points = head.at(at.base)
    chin, eye = at.joint("jaw")[2], at.joint("l-eye")[2]
    low, high = (chin + share * (eye - chin) for share in MOUTH_SHARES)
    slit = hidden & (np.abs(points[:, 0]) < LIPS_M[0]) & (points[:, 2] > low) & (points[:, 2] < high)
    return float(points[slit & (points[:, 1] < at.joint("l-eye")[1]), 2].mean())


def skirt(at: Landmarks) -> Piece:
    """A tube from the waist to the knee."""
    piece = left_half(at, Piece.of(len(at.base), at.human.triangles("helper-skirt"), Region.SKIRT))
    top, end = at.joint("l-upper-leg")[2] + SKIRT_M[0], at.joint("l-knee")[2] + SKIRT_M[1]
    for sign, height in ((-1.0, top), (1.0, end)):
        piece = cut(piece, sign * (piece.at(at.base)[:, 2] - height))
        piece = piece.keep((sign * (piece.centres(at.base)[:, 2] - height)) > 0)
    return piece


def pockets(at: Landmarks) -> BoolArray:
    """(N,) vertices of the body to which hardly any light comes: inside mouth, nostrils, and behind the eyes."""
    triangles = at.human.triangles("body")
    solid = np.concatenate([triangles, at.human.triangles("helper-l-eye"), at.human.triangles("helper-r-eye")])
    caster: Any = RayMeshIntersector(trimesh.Trimesh(at.base, solid, process=False))
    corner = at.base[triangles]
    normal = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    start = corner.mean(axis=1) + RAY_START_M * normal
    free = np.zeros(len(triangles), dtype=np.int64)
    for direction in unit(np.random.default_rng(RAY_SEED).normal(size=(RAYS, 3))):
        facing = np.flatnonzero(normal @ direction > GRAZING)
        hit = caster.intersects_any(start[facing], np.tile(direction, (len(facing), 1)))
        free[facing[~hit]] += 1
    seen = np.zeros(len(at.base), dtype=bool)
    seen[triangles[free > SEEN_RAYS]] = True
    return ~seen


def thickness(at: Landmarks, piece: Piece) -> FloatArray:
    """(V, len(LAYERS)) metres by which each garment and hair stand off the skin."""
    points, region = places(piece, at.base), garment_at(piece)
    down = np.maximum(0.0, -skin_normals(piece, at.base)[:, 2])
    hip, knee, ankle, crown = (at.joint(name)[2] for name in ("l-upper-leg", "l-knee", "l-ankle", "head-2"))
    arm = at.on_arm(piece)
    cuff = np.clip(at.along(points, "l-shoulder", "l-elbow") / SLEEVE_SHARE, 0, 1)
    low = np.clip(1 - (points[:, 2] - hip - HEM_M) / HEM_FADE_M, 0, 1)
    rim = np.clip(at.outside_collar(points) / COLLAR_RISE_M, 0, 1)
    shirt = np.where(arm, SHIRT_M + cuff * (SHIRT_CUFF_M - SHIRT_M), SHIRT_M + low * (SHIRT_HEM_M - SHIRT_M))
    shirt = np.minimum(shirt, COLLAR_M + rim * (SHIRT_CUFF_M - COLLAR_M))
    sleeve = SHIRT_CUFF_M + np.clip(at.along(points, "l-elbow", "l-hand"), 0, 1) * (SLEEVE_M - SHIRT_CUFF_M)
    leg = np.clip((hip - points[:, 2]) / (hip - ankle - ANKLE_M), 0, 1)
    hairline = at.hairline(points)
    short = SHORT_HAIR_M * smooth(hairline / FADE_M)
    falling = np.clip((crown - points[:, 2]) / (crown - at.joint("neck")[2]), 0, 1)
    behind = np.maximum(hairline, points[:, 1] - at.ear[1] - NAPE_M[1])
    long = (LONG_HAIR_M + falling * (NAPE_HAIR_M - LONG_HAIR_M)) * smooth(behind / FADE_M)
    trousers = TROUSERS_M + leg * (TROUSERS_END_M - TROUSERS_M)
    below_waist = np.clip((hip + SKIRT_M[0] - points[:, 2]) / SKIRT_FADE_M, 0, 1)
    flare = SKIRT_TOP_OUT_M + below_waist * (SKIRT_OUT_M - SKIRT_TOP_OUT_M)
    drawn_in = THIGH_IN_M * smooth((points[:, 2] - knee) / SKIRT_FADE_M) * below_waist
    layers = {
        "shirt": np.where(region == Region.SHIRT, shirt, 0),
        "sleeves": np.where(region == Region.FOREARM, sleeve, 0),
        "shorts": np.where(region == Region.TROUSERS, trousers, 0),
        "trousers": np.where(region == Region.SHANK, trousers, 0),
        "shoes": np.where(np.isin(region, (Region.SHOE, Region.SOLE)), SHOE_M * (1 - down), 0),
        "skirt": np.where(region == Region.SKIRT, flare, np.where(region == Region.TROUSERS, drawn_in, 0)),
        "short_hair": np.where(region == Region.SCALP, short, 0),
        "long_hair": np.where(np.isin(region, (Region.SCALP, Region.NAPE)), long, 0),
    }
    return np.column_stack([layers[name] for name in LAYERS])


def garment_at(piece: Piece) -> IntArray:
    """(V,) the region at each vertex, steps between garments aside."""
    return piece.painted(Region.SKIN, np.isin(piece.region, EDGES)).region_at()


def importance(at: Landmarks, piece: Piece) -> FloatArray:
    """(V,) how much more errors at a vertex count."""
    points, region = places(piece, at.base), garment_at(piece)
    head = (region <= Region.NAPE) & (points[:, 2] > at.joint("neck")[2])
    face = head & (points[:, 1] < at.joint("head")[1] - FACE_DEPTH_M)
    weight = np.where(head, HEAD_WEIGHT, 1.0)
    weight[(region <= Region.NAPE) & at.on_arm(piece)] = HAND_WEIGHT
    weight[face] = FACE_WEIGHT
    weight[(np.abs(at.outside_collar(points)) < COLLAR_RIM_M) & ~face] = COLLAR_WEIGHT
    weight[np.isin(region, (Region.EYE, Region.IRIS, Region.BROW, Region.LIPS))] = PAINT_WEIGHT
    return weight


def smooth(share: FloatArray) -> FloatArray:
    """0 up to 0, 1 from 1 on, and smoothly between."""
    share = np.clip(share, 0, 1)
    return np.asarray(share * share * (3 - 2 * share))
