"""What hands do while a person stands or sits: type, write, stir, eat, phone, talk and so on.

A gesture begins and ends with hands and gaze where they were. Hands that are out at a target of the scene
(``Channels.reach``) work around it, never more than ``ROAM_M`` away but for what is brought to mouth or ear; hands that
are not work before the own body. Offsets are forward, left, up of the top of the spine, or of the middle of the head,
as shares of stature; hands point forward, left, up of the chest; those of a right hand are mirrored.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hsbench.errors import SchemaError
from hsbench.synth.people.channels import Channels
from hsbench.synth.people.kinematics import SIDE_SIGN
from hsbench.synth.people.props import HELD
from hsbench.synth.people.timing import frames_of, smooth
from hsbench.typing import FloatArray

ROAM_M = {"type": 0.02, "write": 0.06, "stir": 0.06, "wipe": 0.20, "wash": 0.06, "pour": 0.20}
"""How far from their targets hands go, at most."""

EASE_S = 1.1  # to and from the place of a gesture
NOMINAL_STATURE_M = 1.7  # paths are laid out for it
TINY = 1e-12
OUT = 0.5  # from this weight of ``Channels.reach`` on a hand is at its target

Offset = tuple[float, float, float]
LAP: Offset = (0.23, 0.05, -0.20)  # offsets in the chest's axes
WORK: Offset = (0.23, 0.09, -0.17)
FORTH: Offset = (0.30, 0.07, -0.14)
BOOK: Offset = (0.21, 0.055, -0.055)
BOWL: Offset = (0.19, 0.010, -0.115)
SPOON: Offset = (0.20, 0.035, -0.060)
CUP_HELD: Offset = (0.20, 0.020, -0.115)
TALKING: Offset = (0.20, 0.09, -0.15)
MOUTH: Offset = (0.075, 0.0, -0.045)  # and in the head's
CUP: Offset = (0.085, -0.025, -0.045)
EAR: Offset = (0.005, 0.062, -0.004)
BASIN_M = (0.40, 0.04, 0.93)  # ahead and outwards of who stands at a basin, and above the floor

STRAIGHT: Offset = (0.0, 0.0, 0.0)  # where hands point, see ``Channels``: on from the forearm
LEVEL: Offset = (0.6, -0.2, 0.0)
ONTO_PAGES: Offset = (0.35, -0.25, 0.55)
AROUND_CUP: Offset = (0.30, -0.80, 0.10)
ROUND_BOWL: Offset = (0.30, -0.75, 0.0)
ALONG_CHEEK: Offset = (-0.58, -0.15, 0.72)

EAT_S, DRINK_S = 5.0, 9.0  # a bite, a sip with its pauses
LIFT_S = 1.0  # hand to mouth
MOUTH_S = {"eat": 0.4, "drink": 1.5}
DOWN_LOOK_RAD = -0.40
SIP_LOOK_RAD = 0.22
NOD_RAD = 0.06
BASIN_LEAN_RAD = 0.22


@dataclass(frozen=True, eq=False)
class _Scene:
    """What a gesture sees: the frame before, times (T,), a weight (T,) that is 0 at both ends, its size, and rng."""

    before: Channels
    time_s: FloatArray
    weight: FloatArray
    size: float
    rng: np.random.Generator

    @property
    def hand(self) -> int:
        return int(self.before.hand[0])

    def wave(self, frequency_hz: float) -> FloatArray:
        """(T,) a sine of this frequency, within a tenth, and random phase."""
        f, phase = frequency_hz * self.rng.uniform(0.9, 1.1), self.rng.uniform(0, 2 * np.pi)
        return np.asarray(np.sin(2 * np.pi * f * self.time_s + phase))

    def held(self) -> Channels:
        return self.before.hold(len(self.time_s))


def gesture(
    start: Channels, kind: str, duration_s: float, fps: float, rng: np.random.Generator, size: float = 1.0
) -> Channels:
    """A gesture of ``GESTURES`` for a while, from the last frame of ``start`` back to it. SchemaError for another.

    size: of the way that hands at work go, against the usual one.
    """
    if kind not in GESTURES:
        raise SchemaError(f"gesture is {kind!r}; expected one of {', '.join(GESTURES)}")
    n = frames_of(duration_s, fps)
    time_s = np.arange(1, n + 1) / fps
    ease_s = min(EASE_S, duration_s / 3)
    weight = smooth(time_s / ease_s) * smooth((time_s[-1] - time_s) / ease_s)
    chunk = _GESTURES[kind](_Scene(start.last(), time_s, weight, size, rng))
    held = np.full(n, float(HELD.index(HELD_IN[kind])))
    held[-1] = start.held[-1]
    return replace(chunk, held=held)


def _type(scene: _Scene) -> Channels:
    bursts = np.clip(0.5 + scene.wave(0.15), 0, 1)
    chunk = scene.held()
    for side in (0, 1):
        taps = 0.010 * bursts * np.maximum(scene.wave(2.3), 0)
        path = np.stack([0.006 * scene.wave(0.7), 0.008 * scene.wave(0.5), taps], -1)
        chunk = _work(scene, chunk, side, LAP, path, LEVEL)
    return _look(scene, chunk, 0.3 * DOWN_LOOK_RAD)


def _write(scene: _Scene) -> Channels:
    stroke, line, none = 0.006 * scene.wave(3.0), 0.045 * scene.wave(0.2) + 0.006 * scene.wave(2.6), 0.0 * scene.time_s
    path = (stroke, line, none) if scene.before.seated[0] > 0 else (none, line, stroke)  # standing, on a board
    return _look(scene, _work(scene, scene.held(), scene.hand, WORK, np.stack(path, -1)), DOWN_LOOK_RAD)


def _stir(scene: _Scene) -> Channels:
    turn = 2 * np.pi * scene.rng.uniform(0.9, 1.2) * scene.time_s
    circle = np.stack([0.05 * np.cos(turn), 0.05 * np.sin(turn), 0.01 * (1 + scene.wave(0.3))], -1)
    return _look(scene, _work(scene, scene.held(), scene.hand, WORK, circle), DOWN_LOOK_RAD)


def _wipe(scene: _Scene) -> Channels:
    sweep = np.stack([0.07 * scene.wave(0.17), 0.16 * scene.wave(0.6), 0.0 * scene.time_s], -1)
    return _look(scene, _work(scene, scene.held(), scene.hand, WORK, sweep), DOWN_LOOK_RAD)


def _wash(scene: _Scene) -> Channels:
    rub, chunk = scene.wave(1.4), scene.held()
    for side, sign in enumerate(SIDE_SIGN):
        path = np.stack([0.03 * sign * rub, 0.02 * scene.wave(0.5), 0.015 * scene.wave(0.8)], -1)
        chunk = _at_basin(scene, chunk, side, path)
    bowed = chunk.lean + scene.weight * BASIN_LEAN_RAD
    return _look(scene, replace(chunk, lean=bowed), DOWN_LOOK_RAD)


def _pour(scene: _Scene) -> Channels:
    path = np.stack([0.02 * scene.wave(0.3), 0.04 * scene.wave(0.2), 0.12 + 0.02 * scene.wave(0.4)], -1)
    return _look(scene, _work(scene, scene.held(), scene.hand, FORTH, path, LEVEL), DOWN_LOOK_RAD)


def _eat(scene: _Scene) -> Channels:
    at_mouth = _bites(scene, EAT_S, MOUTH_S["eat"])
    chunk = _near(scene.held(), scene.hand, np.array(SPOON), scene.weight)
    chunk = _to_head(chunk, scene.hand, MOUTH, at_mouth)
    chunk = _near(chunk, 1 - scene.hand, np.array(BOWL), scene.weight, ROUND_BOWL)
    return _look(scene, chunk, DOWN_LOOK_RAD, 1 - at_mouth)


def _drink(scene: _Scene) -> Channels:
    at_mouth = _bites(scene, DRINK_S, MOUTH_S["drink"])
    chunk = _near(scene.held(), scene.hand, np.array(CUP_HELD), scene.weight, AROUND_CUP)
    chunk = _to_head(chunk, scene.hand, CUP, at_mouth, AROUND_CUP)
    return _look(scene, chunk, SIP_LOOK_RAD, at_mouth**4)


def _phone(scene: _Scene) -> Channels:
    chunk = _to_head(scene.held(), scene.hand, EAR, scene.weight, ALONG_CHEEK)
    return _look(scene, chunk, 0.3 * DOWN_LOOK_RAD)


def _read(scene: _Scene) -> Channels:
    chunk = scene.held()
    for side in (0, 1):
        chunk = _near(chunk, side, np.array(BOOK), scene.weight, ONTO_PAGES)
    return _look(scene, chunk, DOWN_LOOK_RAD)


def _talk(scene: _Scene) -> Channels:
    chunk = scene.held()
    phrases = smooth(0.9 + 0.8 * scene.wave(0.13))
    for side in (0, 1):
        taking_part = phrases if side == scene.hand else phrases * smooth(0.5 + scene.wave(0.09))
        beat = np.stack([0.020 * scene.wave(0.6), 0.020 * scene.wave(0.45), 0.025 * scene.wave(0.8)], -1)
        chunk = _near(chunk, side, np.array(TALKING) + beat, scene.weight * taking_part)
    return _look(scene, chunk, NOD_RAD, scene.wave(0.4))


_GESTURES: dict[str, Callable[[_Scene], Channels]] = {
    "type": _type, "write": _write, "stir": _stir, "wipe": _wipe, "wash": _wash, "pour": _pour, "eat": _eat,
    "drink": _drink, "phone": _phone, "read": _read, "talk": _talk,
}  # fmt: skip
GESTURES: tuple[str, ...] = tuple(_GESTURES)
"""Kinds of gestures."""

HELD_IN: dict[str, str] = dict.fromkeys(GESTURES, "") | {
    "write": "pen", "stir": "pan", "wipe": "cloth", "pour": "can", "eat": "meal", "drink": "cup", "phone": "phone",
    "read": "book",
}  # fmt: skip
"""What is in the hands, of ``HELD``."""


def _work(
    scene: _Scene, chunk: Channels, side: int, offset: Offset, path_m: FloatArray, pointing: Offset = STRAIGHT
) -> Channels:
    """One hand moves along (T, 3) forward, left, up, around its target in the scene or an offset before the chest."""
    if scene.before.reach[0, side] < OUT:
        path = scene.size * path_m * [1.0, SIDE_SIGN[side], 1.0] / NOMINAL_STATURE_M
        return _near(chunk, side, np.array(offset) + path, scene.weight, pointing)
    target = chunk.target.copy()
    target[:, side] += _turned(scene.size * path_m * scene.weight[:, None], float(scene.before.yaw[0]))
    return replace(chunk, target=target)


def _at_basin(scene: _Scene, chunk: Channels, side: int, path_m: FloatArray) -> Channels:
    """One hand moves along (T, 3) about its target, or goes down to where a basin is before who stands."""
    if scene.before.reach[0, side] >= OUT:
        return _work(scene, chunk, side, WORK, path_m)
    ahead_m, out_m, height_m = BASIN_M
    place = _turned(path_m + [ahead_m, SIDE_SIGN[side] * out_m, height_m], float(scene.before.yaw[0]))
    place[:, :2] += scene.before.xy
    reach, target = chunk.reach.copy(), chunk.target.copy()
    reach[:, side], target[:, side] = np.maximum(reach[:, side], scene.weight), place
    return replace(chunk, reach=reach, target=target)


def _turned(path_m: FloatArray, yaw_rad: float) -> FloatArray:
    """(T, 3) forward, left, up -> the same in the scene."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    ahead, left, up = path_m.T
    return np.stack([ahead * c - left * s, ahead * s + left * c, up], axis=-1)


def _near(
    chunk: Channels, side: int, offset: FloatArray, weight: FloatArray, pointing: Offset = STRAIGHT,
    at_head: float = 0.0,
) -> Channels:  # fmt: skip
    """One hand goes by (T,) weight to (T, 3) or (3,) offsets from the own body, and points somewhere: forwards,
    outwards and up.
    """
    before, outwards = chunk.near[:, side], [1.0, SIDE_SIGN[side], 1.0]
    near, places, head, ways = chunk.near.copy(), chunk.offset.copy(), chunk.at_head.copy(), chunk.pointing.copy()
    near[:, side] = before + weight * (1 - before)
    share = np.where(near[:, side] > 0, weight / np.maximum(near[:, side], TINY), 1.0)
    places[:, side] += share[:, None] * (offset * outwards - places[:, side])
    head[:, side] += share * (at_head - head[:, side])
    ways[:, side] += weight[:, None] * (np.array(pointing) * outwards - ways[:, side])
    return replace(chunk, near=near, offset=places, at_head=head, pointing=ways)


def _to_head(chunk: Channels, side: int, offset: Offset, weight: FloatArray, pointing: Offset = STRAIGHT) -> Channels:
    return _near(chunk, side, np.array(offset), weight, pointing, at_head=1.0)


def _bites(scene: _Scene, period_s: float, at_mouth_s: float) -> FloatArray:
    """(T,) 0..1, how near the mouth a hand is: as many rounds as have time, at least one; 0 at both ends."""
    total_s = float(scene.time_s[-1])
    rounds = max(1, int(total_s / period_s))
    round_s = total_s / rounds
    lift_s = min(LIFT_S, round_s / 3)
    at = scene.time_s % round_s
    at = np.where(scene.time_s >= total_s, 0.0, at)
    down_s = 2 * lift_s + min(at_mouth_s, round_s - 2 * lift_s)
    return smooth(at / lift_s) * smooth((down_s - at) / lift_s)


def _look(scene: _Scene, chunk: Channels, pitch_rad: float, weight: FloatArray | float = 1.0) -> Channels:
    """The head bows (negative) or rises to a pitch by a weight."""
    look = chunk.look.copy()
    look[:, 1] += scene.weight * weight * (pitch_rad - look[:, 1])
    return replace(chunk, look=look)
