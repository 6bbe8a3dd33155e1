"""Side steps, as one gets past others' knees and in between a chair and its table: the heading stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels, concatenate
from hsbench.synth.people.gait import standing_feet, stepped_over
from hsbench.synth.people.timing import shares_of, smooth
from hsbench.typing import FloatArray

STEP_M = 0.16  # at most: feet do not cross
STEP_S = 0.55


def sidle(body: Body, start: Channels, goal_xy: FloatArray, fps: float) -> Channels:
    """From standing to a place (2,) in small steps, the foot on that side first."""
    before = start.last()
    way = goal_xy - before.xy[0]
    if -np.sin(before.yaw[0]) * way[0] + np.cos(before.yaw[0]) * way[1] >= 0:
        return _leftwards(body, before, goal_xy, fps)
    there = replace(before, xy=goal_xy[None], feet=standing_feet(body, goal_xy[None], before.yaw))
    return concatenate([_leftwards(body, there, before.xy[0], fps).backwards(), there])


def _leftwards(body: Body, start: Channels, goal_xy: FloatArray, fps: float) -> Channels:
    steps = max(1, int(np.ceil(np.sqrt(np.sum((goal_xy - start.xy[0]) ** 2)) / STEP_M)))
    share = shares_of(STEP_S, fps)
    chunks = [start]
    for k in range(steps):
        before = chunks[-1].last()
        place = start.xy + (k + 1) / steps * (goal_xy - start.xy)
        feet = standing_feet(body, place, before.yaw)
        chunks.append(
            replace(
                before.hold(len(share)),
                xy=before.xy + smooth(share)[:, None] * (place - before.xy),
                feet=stepped_over(before.feet, feet.ball[0], 0.0, share),
            )
        )
    return concatenate(chunks[1:])
