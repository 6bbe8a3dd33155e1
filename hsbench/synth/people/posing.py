"""Compiled: from the curves of ``Channels`` to joints, adding what nobody decides: sway, breath, bob, arm swing.

Every frame's joints depend on the frames within ``OVERLAP_S`` and on absolute time alone, and are summed up in a fixed
order, so that a life posed in blocks is the same to the last bit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from hsbench.synth.people.kinematics import (
    HEAD,
    HIP,
    KNEE,
    SHOULDER,
    SIDE_SIGN,
    TOP,
    UP,
    Lengths,
    base_axes,
    highest_pelvis,
    solve_arm,
    solve_leg,
    solve_trunk,
)
from hsbench.synth.people.vectors import Axes, Vector, add, at, bent, dot, mix, vector
from hsbench.typing import FloatArray

BOB_M = (0.012, 0.010)  # walking lowers the pelvis on average, and moves it up and down by this
WALK_SWAY_M = 0.018  # towards the standing foot
WALK_SIDE_RAD = 0.02
WALK_LEAN_RAD = 0.05
WALK_TWIST_RAD = 0.10
ARM_SWING_RAD = 0.38
ARM_OUT_RAD = 0.13
ELBOW_REST_RAD = 0.22
ELBOW_SWING_RAD = 0.30
PELVIS_EASE_S = 0.2  # a pelvis does not drop faster than over about this time when a leg gets too short
OVERLAP_S = 2 * PELVIS_EASE_S
SWAY_M = 0.007  # idle, standing
IDLE_LEAN_RAD = (0.012, 0.035)  # standing, seated
IDLE_TWIST_RAD = (0.02, 0.05)
IDLE_LOOK_RAD = (0.35, 0.10)  # yaw, pitch
IDLE_LYING = 0.2  # of all that, lying
IDLE_PERIODS_S = (3.1, 5.3, 8.9)  # incommensurable, so that the sum does not repeat
WANDERS = 7
HAND_ON_THIGH = 0.68  # of the way from hip to knee
THIGH_AIR = 0.012  # of stature, from a thigh to the middle of a hand on it
REACH_CURVE = (0.8, 0.12)  # a hand first draws back to below the shoulder, by this share, and rises above its target
NEAR_CURVE = 0.25  # a hand goes to the own body in a bow before the chest, by this share of its way


class Tracks(NamedTuple):
    """The arrays of ``Channels``, (T, ...) float64 and contiguous."""

    xy: FloatArray
    height: FloatArray
    yaw: FloatArray
    lean: FloatArray
    gain: FloatArray
    phase: FloatArray
    seated: FloatArray
    reach: FloatArray
    target: FloatArray
    near: FloatArray
    offset: FloatArray
    at_head: FloatArray
    pointing: FloatArray
    look: FloatArray
    tilt: FloatArray
    roll: FloatArray
    ball: FloatArray
    foot_yaw: FloatArray
    foot_pitch: FloatArray


class Manner(NamedTuple):
    """What of a person's style shows in every frame: arm swing and glances as factors, lean in radians."""

    arm_swing: float
    gaze: float
    lean_rad: float


@numba.njit(cache=True, nogil=True)
def pose_tracks(
    lengths: Lengths, manner: Manner, tracks: Tracks, first_frame: int, fps: float, phases: FloatArray, idle: float
) -> FloatArray:
    """(T, 25, 3) joints in metres. phases: (WANDERS, 3) radians; idle: 1, or 0 for no sway and glances."""
    n = len(tracks.yaw)
    pelvis, bends, highest = np.empty((n, 3)), np.empty((n, 5)), np.empty(n)
    noise = np.empty(WANDERS)
    for t in range(n):
        _wander((first_frame + t) / fps, phases, idle, noise)
        _trunk(manner, tracks, t, noise, pelvis[t], bends[t])
        base = base_axes(tracks.yaw[t], tracks.tilt[t], tracks.roll[t])
        highest[t] = pelvis[t, 2]
        standing = math.cos(tracks.tilt[t]) ** 2
        limit = highest_pelvis(
            lengths, vector(pelvis[t]), base, tracks.ball[t], tracks.foot_yaw[t], tracks.foot_pitch[t]
        )
        highest[t] -= standing * max(pelvis[t, 2] - limit, 0.0)
    _lower_envelope(highest, round(PELVIS_EASE_S * fps) // 2, pelvis)
    joints = np.empty((n, 25, 3))
    for t in range(n):
        row = joints[t]
        yaw, tilt = tracks.yaw[t], tracks.tilt[t]
        base = base_axes(yaw, tilt, tracks.roll[t])
        lean, side, twist, look_yaw, look_pitch = bends[t]
        chest, head = solve_trunk(lengths, vector(pelvis[t]), base, lean, side, twist, look_yaw, look_pitch, row)
        upright = bent(base, twist, 0.0, 0.0)
        for s in range(2):
            ball, foot_yaw, foot_pitch = vector(tracks.ball[t, s]), tracks.foot_yaw[t, s], tracks.foot_pitch[t, s]
            solve_leg(lengths, base, yaw, tilt, ball, foot_yaw, foot_pitch, s, row)
            tip = _tip(lengths, manner, tracks, t, s, upright, chest, head, row)
            solve_arm(lengths, chest, tilt, tip, at(chest, vector(tracks.pointing[t, s])), s, row)
    return joints


@numba.njit(cache=True)
def _wander(time_s: float, phases: FloatArray, idle: float, noise: FloatArray) -> None:
    """Slow wanders between about -1 and 1: three sines each."""
    for k in range(WANDERS):
        total = 0.0
        for j in range(3):
            total += math.sin(2 * math.pi * time_s / IDLE_PERIODS_S[j] + phases[k, j])
        noise[k] = idle * total / 2


@numba.njit(cache=True)
def _trunk(manner: Manner, tracks: Tracks, t: int, noise: FloatArray, pelvis: FloatArray, bends: FloatArray) -> None:
    """Write the pelvis (3,) before its height is limited, and lean, side, twist, look yaw and pitch."""
    gain, seated, yaw, phase = tracks.gain[t], tracks.seated[t], tracks.yaw[t], tracks.phase[t]
    calm = (1 - gain) * (1 - (1 - IDLE_LYING) * math.sin(tracks.tilt[t]) ** 2)
    free = 1 - max(tracks.reach[t, 0], tracks.reach[t, 1])
    sway = WALK_SWAY_M * gain * math.sin(math.pi * phase)
    shift = SWAY_M * calm * (1 - seated) * free
    pelvis[0] = tracks.xy[t, 0] - math.sin(yaw) * sway + shift * noise[0]
    pelvis[1] = tracks.xy[t, 1] + math.cos(yaw) * sway + shift * noise[1]
    pelvis[2] = tracks.height[t] - gain * (BOB_M[0] + BOB_M[1] * math.cos(2 * math.pi * phase))
    rest_lean = manner.lean_rad * math.cos(tracks.tilt[t]) ** 2
    glance = calm * free * (1 - tracks.near[t].max()) * manner.gaze
    bends[0] = tracks.lean[t] + rest_lean + WALK_LEAN_RAD * gain + calm * noise[4] * _between(IDLE_LEAN_RAD, seated)
    bends[1] = calm * noise[5] * IDLE_LEAN_RAD[0] - WALK_SIDE_RAD * gain * math.sin(math.pi * phase)
    bends[2] = WALK_TWIST_RAD * gain * math.cos(math.pi * phase) + calm * noise[6] * _between(IDLE_TWIST_RAD, seated)
    bends[3] = tracks.look[t, 0] + glance * IDLE_LOOK_RAD[0] * noise[2]
    bends[4] = tracks.look[t, 1] + glance * IDLE_LOOK_RAD[1] * noise[3]


@numba.njit(cache=True)
def _lower_envelope(values: FloatArray, half: int, pelvis: FloatArray) -> None:
    """Write a smooth curve that is nowhere above ``values`` as heights: the mean of what is lowest around."""
    n = len(values)
    lowest = np.empty(n)
    for t in range(n):
        lowest[t] = values[max(t - half, 0) : min(t + half, n - 1) + 1].min()
    for t in range(n):
        total = 0.0
        for k in range(t - half, t + half + 1):
            total += lowest[min(max(k, 0), n - 1)]
        pelvis[t, 2] = total / (2 * half + 1)


@numba.njit(cache=True)
def _tip(
    lengths: Lengths, manner: Manner, tracks: Tracks, t: int, side: int, upright: Axes, chest: Axes, head: Axes,
    row: FloatArray,
) -> Vector:  # fmt: skip
    """Where a finger tip should be: swinging, on the thigh, on the way to a target, or before the own body."""
    sign = SIDE_SIGN[side]
    shoulder, hip, knee = vector(row[SHOULDER[side]]), vector(row[HIP[side]]), vector(row[KNEE[side]])
    swing = -sign * manner.arm_swing * tracks.gain[t] * math.cos(math.pi * tracks.phase[t])
    angle = ARM_SWING_RAD * swing
    lower = angle + ELBOW_REST_RAD + ELBOW_SWING_RAD * max(swing, 0.0)
    lower_m = lengths.forearm + lengths.hand
    ahead = lengths.upper_arm * math.sin(angle) + lower_m * math.sin(lower)
    down = lengths.upper_arm * math.cos(angle) + lower_m * math.cos(lower)
    free = add(shoulder, at(upright, (ahead, sign * math.sin(ARM_OUT_RAD) * lengths.upper_arm, -down)), 1.0)
    on_thigh = add(mix(hip, knee, HAND_ON_THIGH), UP, lengths.thigh_radius + THIGH_AIR * lengths.stature)
    tip = mix(free, on_thigh, _smooth(tracks.seated[t]))
    share = tracks.reach[t, side]
    if share > 0.0:
        target = vector(tracks.target[t, side])
        bow = mix(tip, shoulder, REACH_CURVE[0])
        tip = _bow(tip, (bow[0], bow[1], max(tip[2], target[2]) + REACH_CURVE[1]), target, share)
    share = tracks.near[t, side]
    if share > 0.0:
        offset = vector(tracks.offset[t, side])
        place = add(vector(row[TOP]), at(chest, offset), lengths.stature)
        place = mix(place, add(vector(row[HEAD]), at(head, offset), lengths.stature), tracks.at_head[t, side])
        way = add(place, tip, -1.0)
        middle = add(mix(tip, place, 0.5), chest[0], NEAR_CURVE * math.sqrt(dot(way, way)))
        tip = _bow(tip, middle, place, share)
    return tip


@numba.njit(cache=True)
def _bow(start: Vector, control: Vector, end: Vector, share: float) -> Vector:
    """A point of a quadratic curve."""
    return mix(mix(start, control, share), mix(control, end, share), share)


@numba.njit(cache=True)
def _smooth(share: float) -> float:
    return share * share * share * (10 - 15 * share + 6 * share * share)


@numba.njit(cache=True)
def _between(ends: tuple[float, float], share: float) -> float:
    return ends[0] + share * (ends[1] - ends[0])
