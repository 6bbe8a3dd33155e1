"""From one depth frame and observed activity to boxes of furniture, seen or not: candidates, costs, choice, scores."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.baselines.occlusion.aligned import AlignedRoom
from hsbench.baselines.occlusion.candidates import candidates, counted, sides_of, suppressed
from hsbench.baselines.occlusion.config import CuboidConfig
from hsbench.baselines.occlusion.program import choose
from hsbench.baselines.occlusion.rectangles import exposed
from hsbench.geometry.transforms import apply
from hsbench.typing import BoolArray, FloatArray, IntArray

CHOSEN_SCORE = 0.5
"""Chosen boxes score from here to 1, the others below: what else is likely, for recall."""


@dataclass(frozen=True, eq=False)
class Found:
    """boxes: (C, 7) centre, size, yaw, episode frame. scores: (C,), falling. chosen: (C,) bool. gap: as of Choice."""

    boxes: FloatArray
    scores: FloatArray
    chosen: BoolArray
    gap: float


def cuboids(room: AlignedRoom, config: CuboidConfig) -> Found:
    """The boxes of a room and what they score, best first."""
    every = candidates(room, config)
    cost = unary(every, room, config)
    covered = _covered(every, room, config)
    rows = suppressed(every, cost - covered, config)
    kept, cost, covered = every[rows], cost[rows], covered[rows]
    choice = choose(kept, cost, _weight(room, config), config)
    share = np.clip((covered - cost) / np.maximum(covered, 1.0), 0.0, 1.0)
    scores = share * (1.0 - CHOSEN_SCORE) + np.where(choice.chosen, CHOSEN_SCORE, 0.0)
    order = np.argsort(-scores, kind="stable")
    return Found(boxes_of(kept, room)[order], scores[order], choice.chosen[order], choice.gap)


def unary(every: IntArray, room: AlignedRoom, config: CuboidConfig) -> FloatArray:
    """(C,) cost of choosing each cuboid: free space in it, sides without a face, and a price for every box."""
    solid = room.surface | room.hidden
    bare = np.zeros(len(every))
    for axis, sign, slab, cells in sides_of(every, solid.shape, reach=1):
        faces = np.minimum(counted(exposed(solid, room.free, axis, sign), slab), cells)
        bare += cells - faces
    return np.asarray(config.free_cost * counted(room.free, every) + config.face_cost * bare + config.box_cost)


def _weight(room: AlignedRoom, config: CuboidConfig) -> FloatArray:
    """(nx, ny, nz) what covering a voxel is worth."""
    weight = config.surface_weight * room.surface + config.hidden_weight * room.hidden
    weight[room.support] = config.support_weight
    return np.asarray(weight)


def _covered(every: IntArray, room: AlignedRoom, config: CuboidConfig) -> FloatArray:
    """(C,) weight of what each cuboid covers."""
    other = room.hidden & ~room.support
    return np.asarray(
        config.surface_weight * counted(room.surface, every)
        + config.support_weight * counted(room.support, every)
        + config.hidden_weight * counted(other, every)
    )


def boxes_of(every: IntArray, room: AlignedRoom) -> FloatArray:
    """(C, 3, 2) voxel borders -> (C, 7) upright boxes in the episode frame."""
    edges = np.asarray(room.grid.origin_m)[:, None] + every * room.grid.voxel_m
    yaw = np.arctan2(room.episode_T_room[1, 0], room.episode_T_room[0, 0])
    centre = apply(room.episode_T_room, edges.mean(axis=2))
    return np.concatenate([centre, np.ptp(edges, axis=2), np.full((len(every), 1), yaw)], axis=1)
