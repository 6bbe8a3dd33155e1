"""Motions of a person: walk a route, stand, sit, lie, reach, carry, look. Each continues where the last ended.

A motion takes the frame before it (``Channels`` of one frame, or a longer line whose last frame counts) and gives the
frames that follow. Lengths in metres, times in seconds, angles in radians, the scene's frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import wrap_angle
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels
from hsbench.synth.people.gait import Feet, phase_of, step_length_m, stepped_over, walk_feet
from hsbench.synth.people.gestures import GESTURES, gesture
from hsbench.synth.people.lounging import LEGS, lean_back
from hsbench.synth.people.lying import LiePose, lie_down, lying_length_m
from hsbench.synth.people.props import HELD
from hsbench.synth.people.timing import frames_of, shares_of, smooth
from hsbench.typing import FloatArray

__all__ = [
    "GESTURES", "LEGS", "LiePose", "SeatPose", "carry", "gesture", "lean_back", "lie_down", "look", "lying_length_m",
    "reach", "reach_both", "scoot", "shift", "sit_down", "stand", "walk",
]  # fmt: skip

ACCELERATION_M_S2 = 0.9
TURN_RATE_RAD_S = 1.9  # while walking a bend
SPIN_RAD_S = 1.7  # mean, while turning on the spot
SPIN_MIN_S = 0.35
BLEND_TURN_RAD = 0.5  # a smaller turn is made while setting off
SLOWEST_M_S = 0.12  # even in the sharpest corner
SAMPLE_M = 0.02
HEADING_WINDOW_M = 0.30  # a walker turns with the route's direction averaged over this length
HEADING_SIGMA_S = 0.12
FULL_GAIT_M_S = 0.85  # from this speed on a walk swings fully
SIT_LEAN_RAD = 0.62  # bend half way down to a seat
SEATED_LEAN_RAD = -0.06
REACH_LOOK_RAD = (0.6, 0.5)  # most the head turns and bows to look at what a hand does
BACK = 0.02  # a hand of a lower weight is at its target no more
CARRIED = np.array([[0.24, 0.075, -0.28], [0.24, -0.075, -0.28]])  # as in ``Channels``: low, elbows in for doors
CARRY_EASE = 0.2  # of a motion: to take and to put down
HALF = 0.5  # from this share on hands have what they carry
SHIFT_EASE = 0.3
SHIFT_M = (0.035, 0.008)  # the pelvis, standing and seated
SHIFT_LEAN_RAD = (0.03, 0.14)
LEVEL_LOOK_M = 1.3  # nobody bows to a point higher than this


@dataclass(frozen=True)
class SeatPose:
    """Where a seated person is: pelvis (x, y, z), heading, and the balls of left and right foot, (x, y, z) each."""

    pelvis_m: tuple[float, float, float]
    yaw_rad: float
    balls_m: tuple[tuple[float, float, float], tuple[float, float, float]]


def stand(start: Channels, duration_s: float, fps: float) -> Channels:
    """Stay as one is."""
    return start.hold(frames_of(duration_s, fps))


def walk(
    body: Body, start: Channels, route: FloatArray, end_yaw_rad: float | None, speed_m_s: float, fps: float
) -> Channels:
    """Turn towards a route (n, 2), walk it, and turn to ``end_yaw_rad`` (None: as one arrives).

    The pelvis stays on the route exactly (to .1 mm), so that a route in free cells is a walk in free cells.
    """
    before = start.last()
    yaw0 = float(before.yaw[0])
    xy, heading = _along(route, speed_m_s, fps)
    if len(xy):
        heading = heading + (yaw0 + float(wrap_angle(heading[0] - yaw0)) - heading[0])
    arrival = float(heading[-1]) if len(xy) else yaw0
    departure = float(heading[0]) if len(xy) else yaw0
    final = arrival if end_yaw_rad is None else arrival + float(wrap_angle(end_yaw_rad - arrival))
    first_turn = _turn(yaw0, departure, fps) if abs(departure - yaw0) > BLEND_TURN_RAD else np.empty(0)
    last_turn = _turn(arrival, final, fps)
    origin = before.xy if len(xy) == 0 else xy[:1]
    end = before.xy if len(xy) == 0 else xy[-1:]
    places = np.concatenate([np.repeat(origin, len(first_turn), 0), xy, np.repeat(end, len(last_turn), 0)])
    yaw = np.concatenate([first_turn, heading, last_turn])
    if len(yaw) == 0:
        return before.hold(1)
    padded = np.concatenate([[yaw0], yaw, [final] * 3])
    smoothed = ndimage.gaussian_filter1d(padded, HEADING_SIGMA_S * fps, mode="nearest")
    easing = smooth(np.arange(len(padded)) / (3 * HEADING_SIGMA_S * fps))
    padded = yaw0 + easing * (smoothed - yaw0)
    ending = smooth(np.arange(len(padded))[::-1] / (3 * HEADING_SIGMA_S * fps))
    padded = final + ending * (padded - final)
    places = np.concatenate([before.xy, places, np.repeat(places[-1:], 3, 0)])
    return _stepping(body, before, places, padded, fps)


def sit_down(start: Channels, seat: SeatPose, duration_s: float, fps: float) -> Channels:
    """From standing near a seat, with the back to it, onto it. ``backwards()`` of it is getting up again."""
    before = start.last()
    n = frames_of(duration_s, fps)
    share = np.arange(1, n + 1) / n
    down, back = smooth(share), smooth(np.clip(share * 1.15, 0, 1))
    pelvis = np.array(seat.pelvis_m)
    turn = float(wrap_angle(seat.yaw_rad - before.yaw[0]))
    held = before.hold(n)
    return replace(
        held,
        xy=before.xy + back[:, None] * (pelvis[:2] - before.xy),
        height=before.height + down * (pelvis[2] - before.height),
        yaw=before.yaw + smooth(np.clip(share * 1.5, 0, 1)) * turn,
        lean=before.lean + down * (SEATED_LEAN_RAD - before.lean) + SIT_LEAN_RAD * np.sin(np.pi * share) ** 2,
        seated=smooth(np.clip(1.4 * share - 0.4, 0, 1)),
        feet=stepped_over(before.feet, np.array(seat.balls_m), turn, share),
    )


def scoot(start: Channels, shift_xy: FloatArray, duration_s: float, fps: float) -> Channels:
    """Someone who sits moves along with the seat by (2,) metres; their feet step, one after the other."""
    before = start.last()
    share = shares_of(duration_s, fps)
    balls = before.feet.ball[0] + np.append(shift_xy, 0.0)
    return replace(
        before.hold(len(share)),
        xy=before.xy + smooth(share)[:, None] * shift_xy,
        feet=stepped_over(before.feet, balls, 0.0, share),
    )


def reach(
    start: Channels, side: int, target: FloatArray, lean_rad: float, crouch_m: float, duration_s: float, fps: float
) -> Channels:
    """Move a hand (0 left, 1 right) to a point (3,), bending and going down a little. ``backwards()`` takes it back."""
    return _reach(start, (side,), np.asarray(target, dtype=np.float64)[None], lean_rad, crouch_m, duration_s, fps)


def reach_both(
    start: Channels, targets: FloatArray, lean_rad: float, crouch_m: float, duration_s: float, fps: float
) -> Channels:
    """Move both hands to points (2, 3), left and right, as ``reach`` does."""
    return _reach(start, (0, 1), np.asarray(targets, dtype=np.float64), lean_rad, crouch_m, duration_s, fps)


def carry(chunk: Channels, share: float) -> Channels:
    """The same motion with something in both hands, before the belly: taken at its start and put down at its end.

    share: 0..1 of the way from free hands to that. The first and the last frame's hands stay about where they were.
    """
    place = np.arange(1, len(chunk) + 1) / len(chunk)
    weight = share * smooth(place / CARRY_EASE) * smooth((1 - place) / CARRY_EASE)
    near = np.maximum(chunk.near, weight[:, None])
    return replace(
        chunk,
        near=near,
        offset=np.tile(CARRIED, (len(chunk), 1, 1)),
        at_head=np.zeros_like(near),
        held=np.where(weight > HALF, float(HELD.index("box")), chunk.held),
    )


def look(start: Channels, yaw_rad: float, pitch_rad: float, duration_s: float, fps: float) -> Channels:
    """Turn the head against the chest: yaw to the left, pitch up. It stays so until another motion turns it."""
    before = start.last()
    share = smooth(shares_of(duration_s, fps))[:, None]
    gaze = before.look + share * (np.array([yaw_rad, pitch_rad]) - before.look)
    return replace(before.hold(len(share)), look=gaze)


def shift(start: Channels, duration_s: float, fps: float, rng: np.random.Generator) -> Channels:
    """Ease the weight: standing onto one leg, seated a little aside and forwards; and back at the end."""
    before = start.last()
    share = shares_of(duration_s, fps)
    held = before.hold(len(share))
    seated = float(before.seated[0])
    over = smooth(share / SHIFT_EASE) * smooth((1 - share) / SHIFT_EASE)
    aside_m = (SHIFT_M[0] + seated * (SHIFT_M[1] - SHIFT_M[0])) * rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 1.0)
    lean_rad = (SHIFT_LEAN_RAD[0] + seated * (SHIFT_LEAN_RAD[1] - SHIFT_LEAN_RAD[0])) * rng.uniform(-0.3, 1.0)
    left = np.array([-np.sin(before.yaw[0]), np.cos(before.yaw[0])])
    return replace(held, xy=before.xy + over[:, None] * aside_m * left, lean=held.lean + over * lean_rad)


def _reach(
    start: Channels, sides: tuple[int, ...], points: FloatArray, lean_rad: float, crouch_m: float, duration_s: float,
    fps: float,
) -> Channels:  # fmt: skip
    """Hands of some sides to points (n, 3); the eyes go to their middle."""
    before = start.last()
    share = smooth(shares_of(duration_s, fps))
    held = before.hold(len(share))
    weights, targets, near = held.reach.copy(), held.target.copy(), held.near.copy()
    for side, point in zip(sides, points, strict=True):
        was, from_m = before.reach[0, side], before.target[0, side]
        weights[:, side] = was + share * (1 - was)
        # A hand that is back leaves a trace of its weight, and a target that may be far away by now.
        targets[:, side] = point if was < BACK else from_m + share[:, None] * (point - from_m)
        near[:, side] *= 1 - share
    middle = points.mean(axis=0)
    away = middle[:2] - before.xy[0]
    turn_most, bow_most = REACH_LOOK_RAD
    turn = float(np.clip(wrap_angle(np.arctan2(away[1], away[0]) - before.yaw[0]), -turn_most, turn_most))
    bow = bow_most * float(np.clip(LEVEL_LOOK_M - middle[2], 0.0, 1.0))
    gaze = np.array([turn, -bow])
    return replace(
        held,
        height=before.height - share * crouch_m,
        lean=before.lean + share * (lean_rad - before.lean),
        reach=weights,
        target=targets,
        near=near,
        look=before.look + share[:, None] * (gaze - before.look),
    )


def _along(route: FloatArray, speed_m_s: float, fps: float) -> tuple[FloatArray, FloatArray]:
    """(n, 2) route -> ((T, 2) places, (T,) continuous heading): starts and ends at rest, slow in bends."""
    steps = np.sqrt(np.sum(np.diff(route, axis=0) ** 2, axis=1))
    route = np.concatenate([route[:1], route[1:][steps > 0]])
    at = np.concatenate([[0.0], np.cumsum(steps[steps > 0])])
    if at[-1] < SAMPLE_M:
        return np.empty((0, 2)), np.empty(0)
    s = np.linspace(0.0, at[-1], max(3, int(np.ceil(at[-1] / SAMPLE_M)) + 1))
    ds = s[1]
    dense = np.stack([np.interp(s, at, route[:, a]) for a in (0, 1)], axis=1)
    direction = np.unwrap(np.arctan2(*np.diff(dense, axis=0).T[::-1]))
    window = max(1, round(HEADING_WINDOW_M / ds))
    heading = np.interp(s, s[:-1] + ds / 2, ndimage.uniform_filter1d(direction, window, mode="nearest"))
    bend = np.abs(np.gradient(heading, ds))
    fastest = np.clip(TURN_RATE_RAD_S / np.maximum(bend, 1e-6), SLOWEST_M_S, speed_m_s) ** 2
    fastest[[0, -1]] = 0.0
    gained = 2 * ACCELERATION_M_S2 * s
    fastest = np.minimum.accumulate(fastest - gained) + gained
    fastest = (np.minimum.accumulate((fastest + gained)[::-1]))[::-1] - gained
    speed = np.sqrt(np.maximum(fastest, 0.0))
    time = np.concatenate([[0.0], np.cumsum(2 * ds / (speed[1:] + speed[:-1]))])
    frames = np.arange(1, int(np.ceil(time[-1] * fps)) + 1) / fps
    where = np.interp(frames, time, s)
    places = quantise_m(np.stack([np.interp(where, at, route[:, a]) for a in (0, 1)], axis=1))
    return places, np.interp(where, s, heading)


def _turn(start_rad: float, end_rad: float, fps: float) -> FloatArray:
    angle = end_rad - start_rad
    if abs(angle) < 1e-3:
        return np.empty(0)
    n = frames_of(SPIN_MIN_S + abs(angle) / SPIN_RAD_S, fps)
    return np.asarray(start_rad + smooth(np.arange(1, n + 1) / n) * angle)


def _stepping(body: Body, before: Channels, xy: FloatArray, yaw: FloatArray, fps: float) -> Channels:
    """A walk with feet; row 0 of xy (T + 1, 2) and yaw (T + 1,) is the frame before it."""
    phase = phase_of(body, xy, yaw, fps)
    first = 0 if yaw[min(len(yaw) - 1, round(fps / 2))] >= yaw[0] else 1
    feet = walk_feet(body, before.feet.last(), xy, yaw, phase, first)
    speed = np.sqrt(np.sum(np.gradient(xy, axis=0) ** 2, axis=1)) * fps
    straight = speed / np.maximum(np.gradient(phase) * fps * step_length_m(body, speed), SLOWEST_M_S)
    gain = smooth(speed / FULL_GAIT_M_S) * np.minimum(straight, 1.0) ** 2
    gain = ndimage.uniform_filter1d(gain, max(1, round(fps / 3)), mode="constant")
    held = before.hold(len(yaw) - 1)
    return replace(
        held, xy=xy[1:], yaw=yaw[1:], gain=gain[1:], phase=phase[1:] + (1 if first == 0 else 0),
        feet=Feet(feet.ball[1:], feet.yaw[1:], feet.pitch[1:]),
    )  # fmt: skip
