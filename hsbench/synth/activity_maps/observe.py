"""What a 360 camera's detector makes of a life in the plane: who is found, as doing what, and how far away.

Sight is exact: straight lines from the camera to points of the body against the convex parts of the scene. So walls,
shut doors and tall furniture hide people.
"""

from __future__ import annotations

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.rays import PackedSolids, segments_blocked
from hsbench.schema.states import Action
from hsbench.synth.activity_maps.config import SphereErrors
from hsbench.synth.activity_maps.life import PlanarLife
from hsbench.typing import BoolArray, FloatArray, IntArray, UInt8Array

BODY_M = (0.22, 0.0, -0.4)  # head, shoulders and hips from the height of the shoulders, upright or seated
SIGHT_CELL_M = 0.2  # bodies within such a square are seen alike
CHANNELS = ("stand", "sit", "interact")
FIRST_ACTION = int(Action.STAND)  # of channel 0; the others follow


def seen_share(camera: FloatArray, body_xy: FloatArray, shoulder_m: FloatArray, solids: PackedSolids) -> FloatArray:
    """(3,) camera, (N, 2) bodies, (N,) heights of shoulders, in the solids' frame -> (N,) share of ``BODY_M`` in sight.

    Bodies that share a square of ``SIGHT_CELL_M`` and a height in centimetres are judged by the first of them.
    """
    square = np.floor(body_xy / SIGHT_CELL_M).astype(np.int64)
    square -= square.min(axis=0, initial=0)
    height = np.rint(shoulder_m * 100).astype(np.int64)
    key = (square[:, 0] * (square[:, 1].max(initial=0) + 1) + square[:, 1]) * (height.max(initial=0) + 1) + height
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    points = np.repeat(np.column_stack([body_xy[first], shoulder_m[first]])[:, None], len(BODY_M), axis=1)
    points[:, :, 2] += BODY_M
    hidden = segments_blocked(camera, points.reshape(-1, 3), solids).reshape(-1, len(BODY_M))
    return np.asarray(1.0 - hidden.mean(axis=1))[which]


def observe_sphere(
    life: PlanarLife, scene_T_episode: FloatArray, seen: FloatArray, errors: SphereErrors, rng: np.random.Generator
) -> tuple[FloatArray, IntArray]:
    """Poses found: (M, 2) where each marks the map, in the episode frame, and (M,) its channel, of ``CHANNELS``.

    scene_T_episode: (4, 4). seen: (P, T) share of each body in sight. A pose said to interact marks its wrist, any
    other its body.
    """
    rotation, at = scene_T_episode[:2, :2], scene_T_episode[:2, 3]
    body, marks = ((xy - at) @ rotation for xy in (life.body_xy, life.wrist_xy))
    distance = np.sqrt((body**2).sum(axis=-1))
    found = _found(distance, seen, errors, rng)
    channel = _said(life.action, errors, rng)
    marks = np.where((channel == Action.INTERACT - FIRST_ACTION)[..., None], marks, body)
    return _displaced(marks, distance, life, errors, rng)[found], channel[found]


def _found(distance: FloatArray, seen: FloatArray, errors: SphereErrors, rng: np.random.Generator) -> BoolArray:
    """(P, T) whether the detector finds each body: more rarely what is far or half hidden, never what is hidden."""
    chance = (1.0 - errors.miss_share) * seen * np.exp(-((distance / errors.far_m) ** 2))
    return np.asarray((rng.random(seen.shape) < chance.round(9)) & (distance >= errors.near_m))


def _said(action: UInt8Array, errors: SphereErrors, rng: np.random.Generator) -> IntArray:
    """(P, T) the channel said of each action."""
    limits = np.cumsum(errors.confusion, axis=1)[action - FIRST_ACTION]
    draw = rng.random(action.shape)
    return np.asarray((draw >= limits[..., 0]).astype(np.int64) + (draw >= limits[..., 1]))


def _displaced(
    marks: FloatArray, distance: FloatArray, life: PlanarLife, errors: SphereErrors, rng: np.random.Generator
) -> FloatArray:
    """(P, T, 2) marks about the camera with the errors of their depth and azimuth, rounded to .1 mm."""
    people = len(marks)
    jitter = errors.joint_sd_px * 2 * np.pi / errors.width_px
    stature = 1.0 + errors.stature_sd * rng.standard_normal((people, 1))
    lean = np.abs(rng.standard_normal(int(life.stay.max(initial=0)) + 1))[life.stay]
    lean *= np.where(life.action == Action.STAND, *errors.foreshortened_sd)
    angle = jitter / errors.part_m * distance * rng.standard_normal(distance.shape)
    scale = stature * (1.0 + lean) * np.maximum(1.0 + angle, 0.0)
    turn = jitter * rng.standard_normal(distance.shape)
    c, s = np.cos(turn), np.sin(turn)
    x, y = marks[..., 0], marks[..., 1]
    return quantise_m(np.stack([c * x - s * y, s * x + c * y], axis=-1) * scale[..., None])
