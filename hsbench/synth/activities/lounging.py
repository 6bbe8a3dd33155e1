"""How far whoever sits can lean back: until the back meets the backrest, and where the feet find room."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hsbench.geometry.numerics import quantise_angle
from hsbench.synth.activities.contact import Obstacles, body_depth
from hsbench.synth.people.body import CAPSULE_JOINTS, Body
from hsbench.synth.people.channels import Channels, concatenate, pose
from hsbench.synth.people.motion import LEGS, lean_back
from hsbench.truth.sittable import SEAT_HEIGHT_M
from hsbench.typing import BoolArray, FloatArray

SLIDES_M = np.arange(8) * 0.05
MOST_RAD = 0.5  # who meets nothing up to here has no backrest
TILTS = 24  # tried up to there
EASY_RAD = 0.3  # one slides back as far as it takes to lean back by about this
LEAN_BACK_S = 1.4
STILL_FPS = 1.0  # frames posed one by one: at this rate nothing is smoothed over time
WAY_FPS = 10.0
GRAZE_M = 0.01  # by which who leans back may press into what is about them: bodies sway
TRUNK = [k for k, joints in enumerate(CAPSULE_JOINTS) if not any(name.startswith(("knee", "ankle")) for name in joints)]


def at_ease(
    body: Body,
    here: Channels,
    obstacles: Obstacles,
    used_id: int,
    fps: float,
    rng: np.random.Generator,
    is_over: Callable[[FloatArray], BoolArray],
    among_others: bool = False,
) -> Channels | None:
    """Leaning back from the seated frame ``here`` against what is behind; None without a backrest, and on the floor.

    is_over: places of the pelvis (n, 2) -> (n,) bool, those on the seat: nobody slides off to lean on a wall.
    The legs are drawn; where those drawn find no room, they are as they can be. among_others: at a table, where legs
    that are stretched out would meet those of others.
    """
    if float(here.height[-1]) < SEAT_HEIGHT_M[0]:
        return None
    legs = LEGS[:1] if among_others else [LEGS[k] for k in rng.permutation(len(LEGS)).tolist()]
    backs = _backs(body, here, obstacles, used_id, is_over)
    for slide_m, tilt in sorted(backs, key=lambda back: abs(back[1] - EASY_RAD)):
        for feet in legs:
            way = pose(body, lean_back(body, here, slide_m, tilt, feet, LEAN_BACK_S, WAY_FPS), WAY_FPS, None)
            if (body_depth(obstacles, body, way, used_id) <= GRAZE_M).all():
                return lean_back(body, here, slide_m, tilt, feet, LEAN_BACK_S, fps)
    return None


def _backs(
    body: Body, here: Channels, obstacles: Obstacles, used_id: int, is_over: Callable[[FloatArray], BoolArray]
) -> list[tuple[float, float]]:
    """(slide in metres, tilt) at which the trunk is about to meet something behind it."""
    slid = [lean_back(body, here, slide_m, 0.0, LEGS[0], 1.0, STILL_FPS) for slide_m in SLIDES_M.tolist()]
    over = is_over(np.array([there.xy[-1] for there in slid]))
    slid = [there for there, is_on in zip(slid, over.tolist(), strict=True) if is_on]
    if not slid:
        return []
    tries = concatenate([lean_back(body, there, 0.0, MOST_RAD, LEGS[0], TILTS, STILL_FPS) for there in slid])
    depth = body_depth(obstacles, body, pose(body, tries, STILL_FPS, None), used_id)
    meets = (depth[:, TRUNK] > GRAZE_M).any(axis=1).reshape(len(slid), TILTS)
    first = np.argmax(meets, axis=1)
    tilts = -tries.tilt.reshape(len(slid), TILTS)
    slides_m = SLIDES_M[over]
    return [(float(slides_m[k]), quantise_angle(float(tilts[k, n - 1]))) for k, n in enumerate(first) if n > 0]
