"""A simulated person's body: segment lengths, looks, and the tapered capsules that stand for flesh and clothes.

Segment lengths are shares of stature after Drillis & Contini (1966) as printed in Winter, Biomechanics and Motor
Control of Human Movement, fig. 4.1. Winter's shoulder and hip breadths reach to the outer contour; a joint lies one
limb radius inside it. Joints are the Kinect v2 SDK's 25, in the order of ``hsbench.schema.KINECT_V2``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.people.shapes import SHAPE_OF, SHAPES
from hsbench.synth.people.style import AVERAGE, Style
from hsbench.synth.people.wardrobe import (
    HAIR_STYLES,
    HAIRS,
    LEGS,
    OUTFITS,
    SHOES,
    SKINS,
    SLEEVES,
    Colour,
    Hair,
    Legs,
    Sleeves,
    looks,
)  # fmt: skip
from hsbench.typing import FloatArray

STATURE_RANGE_M = (1.55, 1.95)
STATURE_SPREAD_M = 0.05  # of people of one shape, either way

# Shares of stature, Winter fig. 4.1 (heights above the floor, then segment lengths).
ANKLE_HEIGHT = 0.039
HIP_HEIGHT = 0.530
SHOULDER_HEIGHT = 0.818
UPPER_ARM = 0.186
FOREARM = 0.146
HAND = 0.108
THIGH = 0.245
SHANK = 0.246
SHOULDER_BREADTH = 0.259
HIP_BREADTH = 0.191

# Where Kinect v2 puts joints that Winter does not have, as shares of stature (SDK documentation, JointType figure).
SPINE_MID_HEIGHT = 0.680
SPINE_SHOULDER_HEIGHT = 0.815
NECK_HEIGHT = 0.855
HEAD_HEIGHT = 0.935
PALM = 0.050  # wrist to the middle of the hand
THUMB = (0.035, 0.022)  # from the wrist along the hand and across it
BALL_FORWARD = 0.085  # ankle to the ball of the foot
BALL_HEIGHT = 0.016
HEEL_BACK = 0.028
TOE_FORWARD = 0.030  # from the ball on

# Radii as shares of stature (limb girths of adults, NASA-STD-3000 vol. I sec. 3, clothed).
RADIUS_HEAD = 0.052
RADIUS_NECK = 0.033
RADIUS_CHEST = (0.060, 0.056)
RADIUS_BELLY = (0.060, 0.058)
RADIUS_SHOULDER = 0.031
RADIUS_UPPER_ARM = (0.028, 0.024)
RADIUS_FOREARM = (0.024, 0.018)
RADIUS_HAND = (0.018, 0.011)
RADIUS_THIGH = (0.046, 0.034)
RADIUS_SHANK = (0.033, 0.024)
RADIUS_SHOE = (0.020, 0.016)
HEAD_HALF_AXIS = 0.018
CHEST_OFFSET = 0.046  # the two chest capsules lie so far left and right of the spine
BELLY_OFFSET = 0.040

J = {name: index for index, name in enumerate(KINECT_V2.names)}
"""Joint index by name."""

SIDES = ("left", "right")


@dataclass(frozen=True)
class Body:
    """A person: stature in metres, girth (factor on all radii), shape (of ``SHAPES``), clothes, sRGB colours.

    style: how they move.
    """

    stature_m: float
    girth: float = 1.0
    skin: Colour = SKINS[1]
    hair: Colour = HAIRS[2]
    shirt: Colour = OUTFITS[0][0]
    trousers: Colour = OUTFITS[0][1]
    shoes: Colour = SHOES[0]
    shape: str = SHAPES[0].name
    hair_style: Hair = "short"
    sleeves: Sleeves = "short"
    legs: Legs = "trousers"
    style: Style = AVERAGE

    GIRTH_RANGE = (0.95, 1.06)  # of a person against the girth of their shape

    def __post_init__(self) -> None:
        low, high = STATURE_RANGE_M
        if not low <= self.stature_m <= high:
            raise SchemaError(f"body.stature_m is {self.stature_m}; expected {low}..{high} m (is it in centimetres?)")
        if not 0.5 <= self.girth <= 2.0:
            raise SchemaError(f"body.girth is {self.girth}; expected a factor of 0.5..2")
        for name, known in (
            ("shape", tuple(SHAPE_OF)), ("hair_style", HAIR_STYLES), ("sleeves", SLEEVES), ("legs", LEGS),
        ):  # fmt: skip
            if getattr(self, name) not in known:
                raise SchemaError(f"body.{name} is {getattr(self, name)!r}; expected one of {', '.join(known)}")

    @classmethod
    def sample(cls, rng: np.random.Generator) -> Body:
        """A person drawn at random."""
        shape = SHAPES[int(rng.integers(len(SHAPES)))]
        spread = rng.uniform(-STATURE_SPREAD_M, STATURE_SPREAD_M)
        stature_m = float(np.clip(quantise_m(shape.stature_m + spread), *STATURE_RANGE_M))
        girth = float(quantise_m(shape.girth * rng.uniform(*cls.GIRTH_RANGE)))
        return cls(stature_m, girth, shape=shape.name, **looks(shape, rng), style=Style.sample(rng))

    def of_stature(self, share: float) -> float:
        """A share of stature in metres."""
        return share * self.stature_m

    def radius(self, share: float) -> float:
        """A capsule radius in metres from its share of stature."""
        return share * self.stature_m * self.girth

    @property
    def shoulder_half_m(self) -> float:
        """Spine to shoulder joint, sideways."""
        return self.of_stature(SHOULDER_BREADTH / 2 - RADIUS_UPPER_ARM[0])

    @property
    def hip_half_m(self) -> float:
        """Spine to hip joint, sideways."""
        return self.of_stature(HIP_BREADTH / 2 - RADIUS_THIGH[0])

    @property
    def leg_m(self) -> float:
        """Hip to ankle of a straight leg."""
        return self.of_stature(THIGH + SHANK)

    @property
    def arm_m(self) -> float:
        """Shoulder to finger tip of a straight arm."""
        return self.of_stature(UPPER_ARM + FOREARM + HAND)


def capsules(body: Body, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(T, 25, 3) joints -> ((T, C, 2, 3) ends, (C, 2) radii): the body's tapered capsules, in the joints' frame.

    In the order of ``CAPSULE_JOINTS``. The torso is two pairs side by side, so that it is wider than deep.
    """
    joints = np.asarray(joints, dtype=np.float64)
    base, mid, top, neck, head = (joints[:, J[n], None] for n in MIDDLE_JOINTS)
    limbs = joints[:, LIMB_JOINTS]
    across = unit(limbs[:, 1, [SHOULDER, HIP]] - limbs[:, 0, [SHOULDER, HIP]])[:, None] * np.array([[[-1.0]], [[1.0]]])
    chest, belly = across[:, :, 0] * body.of_stature(CHEST_OFFSET), across[:, :, 0] * body.of_stature(BELLY_OFFSET)
    crown = unit(head - neck) * body.of_stature(HEAD_HALF_AXIS)

    middle = np.stack([np.stack([head - crown, head + crown], axis=2), np.stack([top, neck], axis=2)], axis=2)[:, 0]
    sides = np.empty((len(joints), 2, len(SIDE_RADII), 2, 3))
    sides[:, :, 0, 0] = mid + belly
    sides[:, :, 0, 1] = top - unit(top - mid) * body.radius(RADIUS_CHEST[1] / 2) + chest
    sides[:, :, 1, 0] = base + across[:, :, 1] * body.of_stature(BELLY_OFFSET)
    sides[:, :, 1, 1] = mid + belly
    sides[:, :, 2, 0], sides[:, :, 2, 1] = top, limbs[:, :, SHOULDER]
    sides[:, :, 3:6, 0], sides[:, :, 3:6, 1] = limbs[:, :, SHOULDER:TIP], limbs[:, :, SHOULDER + 1 : TIP + 1]
    sides[:, :, 6:8, 0], sides[:, :, 6:8, 1] = limbs[:, :, HIP:ANKLE], limbs[:, :, HIP + 1 : ANKLE + 1]
    sides[:, :, 8, 0], sides[:, :, 8, 1] = shoe_axis(body, *(limbs[:, :, k] for k in (ANKLE - 1, ANKLE, ANKLE + 1)))
    ends = np.concatenate([middle, sides.reshape(len(joints), 2 * len(SIDE_RADII), 2, 3)], axis=1)
    return ends, np.array([*MIDDLE_RADII, *SIDE_RADII, *SIDE_RADII]) * (body.stature_m * body.girth)


MIDDLE_JOINTS = ("spine_base", "spine_mid", "spine_shoulder", "neck", "head")
SHOULDER, TIP, HIP, ANKLE = 0, 3, 4, 6  # places in a row of LIMB_JOINTS
LIMB_JOINTS = np.array(
    [
        [J[f"{n}_{side}"] for n in ("shoulder", "elbow", "wrist", "hand_tip", "hip", "knee", "ankle", "foot")]
        for side in SIDES
    ]
)
MIDDLE_RADII = ((RADIUS_HEAD, RADIUS_HEAD), (RADIUS_NECK, RADIUS_NECK))
SIDE_RADII = (
    RADIUS_CHEST, RADIUS_BELLY, (RADIUS_NECK, RADIUS_SHOULDER), RADIUS_UPPER_ARM, RADIUS_FOREARM, RADIUS_HAND,
    RADIUS_THIGH, RADIUS_SHANK, RADIUS_SHOE,
)  # fmt: skip
CAPSULE_JOINTS: tuple[tuple[str, ...], ...] = (
    ("head", "neck"),
    ("neck", "spine_shoulder"),
    *(
        joints
        for side in SIDES
        for joints in (
            ("spine_mid", "spine_shoulder"),
            ("spine_base", "spine_mid", f"hip_{side}"),
            ("spine_shoulder", f"shoulder_{side}"),
            (f"shoulder_{side}", f"elbow_{side}"),
            (f"elbow_{side}", f"wrist_{side}"),
            (f"wrist_{side}", f"hand_{side}", f"hand_tip_{side}", f"thumb_{side}"),
            (f"hip_{side}", f"knee_{side}"),
            (f"knee_{side}", f"ankle_{side}"),
            (f"ankle_{side}", f"foot_{side}"),
        )
    ),
)
"""For each capsule, in the order of ``capsules``, the joints it belongs to: they are not hidden by it."""


def shoe_axis(body: Body, knee: FloatArray, ankle: FloatArray, foot: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(..., 3) knee, ankle and foot joints -> (..., 3) heel and (..., 3) toe ends of the shoe's axis."""
    bone = unit(foot - ankle)
    side = unit(cross(ankle - knee, foot - ankle))
    drop = np.arctan2(ANKLE_HEIGHT - BALL_HEIGHT, BALL_FORWARD)
    forward = np.cos(drop) * bone + np.sin(drop) * cross(side, bone)
    down = np.cos(drop) * cross(bone, side) + np.sin(drop) * bone
    low = body.of_stature(ANKLE_HEIGHT) - body.radius(RADIUS_SHOE[0])
    heel = ankle - forward * body.of_stature(HEEL_BACK) + down * low
    toe = foot + forward * body.of_stature(TOE_FORWARD)
    toe = toe - down * (body.radius(RADIUS_SHOE[1]) - body.of_stature(BALL_HEIGHT))
    return heel, toe


def unit(vectors: FloatArray) -> FloatArray:
    """(..., 3) vectors -> the same directions at unit length (zero stays zero)."""
    length = np.sqrt(np.sum(vectors * vectors, axis=-1, keepdims=True))
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Vector products of (..., 3) arrays: those of numpy, in half of its time where they are small."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(a[..., j] * b[..., k], a[..., k] * b[..., j], out=product[..., i])
    return product
