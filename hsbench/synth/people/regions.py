"""The regions of a body's surface: every triangle of ``bodies.npz`` has one, and a body paints or leaves out each."""

from __future__ import annotations

from enum import IntEnum


class Region(IntEnum):
    """Where on the body. A ``*_EDGE`` is the narrow step at the end of a garment, down to what it lies over."""

    SKIN = 0  # face, neck and hands
    EYE = 1
    IRIS = 2
    BROW = 3
    LIPS = 4
    SCALP = 5
    NAPE = 6  # behind the ears, down to the collar: hair if it is long
    NAPE_EDGE = 7
    SHIRT = 8  # with sleeves to above the elbow
    NECK_EDGE = 9
    SLEEVE_EDGE = 10
    HEM_EDGE = 11
    FOREARM = 12
    WRIST_EDGE = 13
    TROUSERS = 14  # to the knee
    KNEE_EDGE = 15
    SHANK = 16
    ANKLE_EDGE = 17
    SHOE = 18
    SOLE = 19
    SKIRT = 20  # a piece of its own over the closed surface of all the others


EDGES = (
    Region.NAPE_EDGE, Region.NECK_EDGE, Region.SLEEVE_EDGE, Region.HEM_EDGE, Region.WRIST_EDGE, Region.KNEE_EDGE,
    Region.ANKLE_EDGE,
)  # fmt: skip
