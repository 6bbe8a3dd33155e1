"""Sitting at ease: leaning back, with the legs as they were, stretched out or crossed; and moving along a seat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels
from hsbench.synth.people.gait import stepped_over
from hsbench.synth.people.kinematics import SIDE_SIGN
from hsbench.synth.people.timing import shares_of, smooth
from hsbench.typing import FloatArray

LEGS = ("upright", "stretched", "crossed")
"""How the legs are, for ``lean_back``: with feet below the knees, ahead of them, or ahead and crossed at the ankles."""

KNEE_DROP = (0.0, 0.055, 0.055)  # of stature: by how much more than they must knees are lower than hips
ROUNDED_RAD = 0.12  # by which the spine of who leans back is bent forwards
LOOK_SHARE = 0.75  # of the angle by which the head stays upright
ANKLES_AHEAD = 0.44  # of stature, on the floor or a bed: legs half stretched, hips and knees well within their ranges
CROSSED = (0.02, 0.06)  # of stature: feet beyond the middle, and the left above the right


def lean_back(
    body: Body, start: Channels, slide_m: float, tilt_rad: float, legs: str, duration_s: float, fps: float
) -> Channels:
    """Who sits slides back, leans back about the hips and puts the feet as one of ``LEGS``.

    ``backwards()`` of it sits up again.
    """
    before = start.last()
    share = shares_of(duration_s, fps)
    way, held = smooth(share), before.hold(len(share))
    look = before.look[0] - [0.0, LOOK_SHARE * tilt_rad]
    back = -slide_m * np.array([np.cos(before.yaw[0]), np.sin(before.yaw[0])])
    return replace(
        held,
        xy=held.xy + way[:, None] * back,
        tilt=held.tilt - way * tilt_rad,
        lean=held.lean + way * (ROUNDED_RAD - held.lean),
        look=held.look + way[:, None] * (look - held.look),
        feet=stepped_over(before.feet, _balls(body, before.xy[0] + back, before, legs), 0.0, share),
    )


def shuffle(
    body: Body,
    start: Channels,
    pelvis_xy: FloatArray,
    ground_m: float,
    duration_s: float,
    fps: float,
    tuck_m: float = 0.0,
) -> Channels:
    """Who sits moves to another place (2,) of the seat, facing as before; the feet go to the floor below the knees, or,
    on a bed, ahead of the pelvis onto what is ``ground_m`` high; nearer to the pelvis by ``tuck_m``.
    """
    before = start.last()
    share = shares_of(duration_s, fps)
    if ground_m == 0.0:
        balls = _balls(body, pelvis_xy, before, LEGS[0])
    else:
        balls = legs_ahead(body, pelvis_xy, float(before.yaw[0]), ground_m)
    balls[:, :2] -= quantise_m(tuck_m * np.array([np.cos(before.yaw[0]), np.sin(before.yaw[0])]))
    return replace(
        before.hold(len(share)),
        xy=before.xy + smooth(share)[:, None] * (pelvis_xy - before.xy),
        feet=stepped_over(before.feet, balls, 0.0, share),
    )


def legs_ahead(body: Body, pelvis_xy: FloatArray, yaw_rad: float, ground_m: float) -> FloatArray:
    """(2, 3) balls of the feet of who sits on the ground, a floor or a bed, with the legs half stretched."""
    facing = np.array([np.cos(yaw_rad), np.sin(yaw_rad)])
    ahead = pelvis_xy + body.of_stature(ANKLES_AHEAD + anatomy.BALL_FORWARD) * facing
    aside = body.hip_half_m * np.array([-facing[1], facing[0]])
    height_m = ground_m + body.of_stature(anatomy.BALL_HEIGHT)
    return quantise_m(np.stack([np.append(ahead + sign * aside, height_m) for sign in SIDE_SIGN]))


def _balls(body: Body, pelvis_xy: FloatArray, before: Channels, legs: str) -> FloatArray:
    """(2, 3) where the balls of the feet go: along the heading, as far as the legs get from a pelvis (2,)."""
    yaw = float(before.yaw[0])
    ahead, left = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    thigh_m, shank_m = body.of_stature(anatomy.THIGH), body.of_stature(anatomy.SHANK)
    hip_m = float(before.height[0]) - body.of_stature(anatomy.ANKLE_HEIGHT)  # above the ankles
    drop_m = min(max(hip_m - shank_m, 0.0) + body.of_stature(KNEE_DROP[LEGS.index(legs)]), thigh_m)
    forth_m = np.sqrt(thigh_m**2 - drop_m**2) + np.sqrt(max(shank_m**2 - (hip_m - drop_m) ** 2, 0.0))
    balls = np.empty((2, 3))
    for side, sign in enumerate(SIDE_SIGN):
        is_crossed = legs == "crossed"
        out_m = sign * (-body.of_stature(CROSSED[0]) if is_crossed else body.hip_half_m)
        balls[side, :2] = pelvis_xy + (forth_m + body.of_stature(anatomy.BALL_FORWARD)) * ahead + out_m * left
        balls[side, 2] = body.of_stature(anatomy.BALL_HEIGHT + (CROSSED[1] if is_crossed and sign > 0 else 0.0))
    return quantise_m(balls)
