"""Small enumerations shared by truth, sensors, protocols and files. The numbers are part of the format."""

from __future__ import annotations

from enum import IntEnum


class VoxelState(IntEnum):
    """What the sensor knows of a voxel at t0: one enum for sensor knowledge, truth and every protocol."""

    UNKNOWN = 0
    FREE = 1
    SURFACE = 2
    OCCLUDED = 3
    MISSING_DEPTH = 4
    OUTSIDE_FOV = 5
    OUTSIDE_ROOM = 6


class Action(IntEnum):
    """What a person does at one time: the classes of action recognition, and what it ignores."""

    IGNORED = 0  # lying, transitions between postures
    STAND = 1  # walking included
    SIT = 2
    INTERACT = 3  # a hand touches a functional part


class Visibility(IntEnum):
    """How much of an object the camera sees at t0: visible / amodal in-image pixels."""

    VISIBLE = 0  # >= 60 %
    PARTIAL = 1  # 2 % .. 60 %
    FULLY_OCCLUDED = 2  # < 2 %
    OUTSIDE = 3  # no amodal pixel inside the image


class Evidence(IntEnum):
    """What activity says of an object."""

    NEITHER = 0
    SKIRTED = 1  # >= 50 % of its free border swept by bodies
    USED = 2  # touched


class Affordance(IntEnum):
    """Bits of the multi-label affordance images and maps: label k is bit ``1 << k``."""

    WALKABLE = 0
    SITTABLE = 1
    INTERACTABLE = 2
    LYABLE = 3
    REACHABLE = 4
    SUPPORTABLE = 5
    OPENABLE = 6
