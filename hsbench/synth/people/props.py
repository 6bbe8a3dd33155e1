"""Things in hands, for the eye alone: a phone, a cup, a book, a can and so on as small meshes that follow the joints.

They are drawn with the person and are no part of any truth. Each is made of boxes and drums in axes of its own: x the
way the hand points or the chest faces, y to the left, z up, in metres, the origin in the palm or between both palms.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hsbench.geometry.transforms import cos_sin
from hsbench.synth.people.body import J, unit
from hsbench.synth.people.wardrobe import Colour
from hsbench.typing import FloatArray, Int32Array, UInt8Array

HELD: tuple[str, ...] = ("", "phone", "cup", "book", "can", "cloth", "pan", "pen", "meal", "box")
"""What hands may hold; the first is nothing."""

Piece = tuple[FloatArray, Int32Array, Colour]
"""(V, 3) vertices, (T, 3) triangles and a colour."""

SIDES = 12  # of a drum
BLACK, WHITE, STEEL = (30, 32, 36), (222, 220, 214), (120, 124, 130)
RED, BLUE, GREEN, CARD = (148, 52, 46), (72, 112, 150), (70, 120, 78), (176, 140, 100)
PAD_M = 0.025  # from the middle of a palm to its skin
UP = np.array([0.0, 0.0, 1.0])
ASIDE = np.array([0.0, 1e-9, 0.0])  # keeps axes defined for a hand that points straight up


def held_mesh(kind: str, hand: int, joints: FloatArray) -> tuple[FloatArray, Int32Array, UInt8Array]:
    """What the preferred hand (0 left, 1 right) or both hold, for (25, 3) joints; kind: of ``HELD`` but the first.

    ((V, 3) vertices in the joints' frame, (T, 3) int32 triangles counter-clockwise from outside, (T, 3) uint8 sRGB);
    the triangles and colours are the same in every pose.
    """
    points: list[FloatArray] = []
    corners: list[Int32Array] = []
    colours: list[UInt8Array] = []
    for grip, pieces in _things()[kind]:
        axes, origin = _frame(grip, hand, joints)
        for local, triangles, colour in pieces:
            corners.append(triangles + np.int32(sum(map(len, points))))
            points.append(local @ axes + origin)
            colours.append(np.tile(np.array(colour, np.uint8), (len(triangles), 1)))
    return np.concatenate(points), np.concatenate(corners), np.concatenate(colours)


def _frame(grip: str, hand: int, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Axes (3, 3), in rows, and origin (3,) of a grip.

    hand: x along it, z out of the palm. level, other: that hand or the other, z up. both: between them, z up.
    facing: between them, x at the neck.
    """
    side = 1 - hand if grip == "other" else hand
    name = ("left", "right")[side]
    palm, wrist, thumb = joints[J[f"hand_{name}"]], joints[J[f"wrist_{name}"]], joints[J[f"thumb_{name}"]]
    along = unit(joints[J[f"hand_tip_{name}"]] - wrist)
    if grip == "hand":
        across = unit(thumb - wrist - along * np.dot(thumb - wrist, along))
        out = np.cross(along, across) * (-1.0 if side == 0 else 1.0)
        return np.stack([along, np.cross(out, along), out]), palm
    if grip in ("level", "other"):
        return _axes(along), palm
    palms = joints[[J["hand_left"], J["hand_right"]]]
    middle = palms.mean(axis=0)
    if grip == "facing":
        return _axes(joints[J["neck"]] - middle, keep_x=True), middle
    left = joints[J["shoulder_left"]] - joints[J["shoulder_right"]]
    return _axes(np.cross(left, UP)), middle


def _axes(ahead: FloatArray, keep_x: bool = False) -> FloatArray:
    """(3, 3) rows x, y, z: x towards ``ahead`` or, unless it is kept, level below it."""
    ahead = unit(ahead)
    left = unit(np.cross(UP, ahead) + ASIDE)
    return np.stack([ahead, left, np.cross(ahead, left)] if keep_x else [np.cross(left, UP), left, UP])


def _box(low: tuple[float, float, float], high: tuple[float, float, float], colour: Colour) -> Piece:
    """Every face with corners of its own, so that it is shaded flat."""
    a, b = np.array(low), np.array(high)
    points: list[FloatArray] = []
    corners: list[FloatArray] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (a, b):
            face = np.tile(end, (4, 1))
            face[:, u], face[:, v] = [a[u], b[u], b[u], a[u]], [a[v], a[v], b[v], b[v]]
            corners.append(np.array([[0, 1, 2], [0, 2, 3]])[:, :: (1 if end is b else -1)] + 4 * len(points))
            points.append(face)
    return np.concatenate(points), np.concatenate(corners).astype(np.int32), colour


def _drum(centre: tuple[float, float, float], radius_m: float, height_m: float, colour: Colour) -> Piece:
    """An upright cylinder by the centre of its base; its caps have corners of their own."""
    turns = np.array([cos_sin(2 * np.pi * k / SIDES) for k in range(SIDES)])
    ring = np.column_stack([radius_m * turns, np.zeros(SIDES)]) + centre
    points = np.concatenate([ring, ring + [0, 0, height_m]] * 2)
    k, n = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    wall = np.concatenate([np.stack([k, n, n + SIDES], 1), np.stack([k, n + SIDES, k + SIDES], 1)])
    fan = np.stack([np.zeros(SIDES - 2, np.int64), np.arange(1, SIDES - 1), np.arange(2, SIDES)], axis=1)
    return points, np.concatenate([wall, fan[:, ::-1] + 2 * SIDES, fan + 3 * SIDES]).astype(np.int32), colour


Grips = tuple[tuple[str, tuple[Piece, ...]], ...]


@lru_cache(maxsize=1)
def _things() -> dict[str, Grips]:
    """What each thing is made of, by the grips in which its pieces are held."""
    pages = [_box((-0.010, a, -0.055), (0.006, b, 0.175), WHITE) for a, b in ((-0.158, -0.003), (0.003, 0.158))]
    can = (
        _drum((0.06, 0.0, -0.21), 0.075, 0.16, GREEN),
        _box((-0.01, -0.012, -0.05), (0.13, 0.012, -0.03), GREEN),
        _box((0.12, -0.012, -0.13), (0.32, 0.012, -0.105), GREEN),
        _drum((0.32, 0.0, -0.135), 0.028, 0.03, STEEL),
    )
    pan = (
        _box((-0.03, -0.012, -0.012), (0.17, 0.012, 0.010), BLACK),
        _drum((0.29, 0.0, -0.025), 0.125, 0.055, STEEL),
        _drum((0.29, 0.0, 0.024), 0.110, 0.008, RED),
    )
    bowl = (_drum((0.035, 0.0, -0.01), 0.045, 0.02, WHITE), _drum((0.035, 0.0, 0.01), 0.075, 0.05, WHITE))
    return {
        "phone": (("hand", (_box((-0.05, -0.036, PAD_M - 0.006), (0.10, 0.036, PAD_M + 0.006), BLACK),)),),
        "cup": (("level", (_drum((0.045, 0.0, -0.045), 0.038, 0.095, WHITE),)),),
        "book": (("facing", (_box((-0.022, -0.165, -0.06), (-0.010, 0.165, 0.18), RED), *pages)),),
        "can": (("level", can),),
        "cloth": (("level", (_box((-0.02, -0.09, -0.03), (0.15, 0.09, -0.015), BLUE),)),),
        "pan": (("level", pan),),
        "pen": (("hand", (_box((0.03, -0.006, 0.015), (0.16, 0.006, 0.027), BLUE),)),),
        "meal": (("other", bowl), ("hand", (_box((0.0, -0.006, PAD_M), (0.15, 0.006, PAD_M + 0.005), STEEL),))),
        "box": (("both", (_box((-0.10, -0.13, -0.09), (0.18, 0.13, 0.13), CARD),)),),
    }
