"""The door by which people come in: shut at t0, opened by who comes, and shut behind them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply, cos_sin
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.synth.activities.contact import Obstacles
from hsbench.synth.activities.diary import Shift
from hsbench.synth.people.navigation import costs_from, nearest_free, route_from
from hsbench.truth.doorways import Doorway, doorways
from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray

OPEN_S, SHUT_S = 1.0, 1.3
OPEN_DEG = (90.0, 75.0, 60.0)  # the first to which the leaf swings freely; if none, the door stays shut
STEP_DEG = 7.5
HIT_M = 0.005  # a leaf that reaches so far into another thing hits it
SHUT_M = 0.1  # a leaf that is deeper through the wall stands open
OUTSIDE_M = 0.6  # whoever comes stands so far before the inner face of the wall
BEYOND_M = 0.35  # and goes in so much farther than the leaf swings
SNAP_M = 0.4
BODY_M = 0.25


@dataclass(frozen=True, eq=False)
class Entrance:
    """A door that opens. parts: of its leaf; pivot_xy, open_rad: the leaf's turn in the object's frame.

    way: (n, 2) from outside to where one is clear of the leaf. swept: (nx, ny) bool, cells that the leaf needs.
    """

    object_id: int
    parts: tuple[str, ...]
    pivot_xy: FloatArray
    open_rad: float
    way: FloatArray
    swept: BoolArray

    def shifts(self, frame: int, share: float) -> list[Shift]:
        """Key poses of the leaf's parts at a frame, open by a share of its turn."""
        yaw = quantise_angle(share * self.open_rad)
        x, y = quantise_m(self.pivot_xy - _turn(yaw) @ self.pivot_xy).tolist()
        return [Shift(frame, self.object_id, part, (x, y, yaw)) for part in self.parts]


def find_entrance(scene: Scene, floor: WalkMap, entry_xy: FloatArray, obstacles: Obstacles) -> Entrance | None:
    """The shut door behind the free cell ``entry_xy`` (2,) by which one comes in; None if there is none that opens."""
    outer = [way for way in doorways(scene) if len(way.rooms) == 1]
    outer = [way for way in outer if np.sum((way.feet[0] - entry_xy) ** 2) < (SNAP_M + BEYOND_M) ** 2]
    for way in sorted(outer, key=lambda w: float(np.round(np.sum((w.feet[0] - entry_xy) ** 2), 6))):
        found = _entrance(scene.object(way.object_id), way, floor, entry_xy, obstacles)
        if found is not None:
            return found
    return None


def _entrance(
    item: SceneObject, way: Doorway, floor: WalkMap, entry_xy: FloatArray, obstacles: Obstacles
) -> Entrance | None:
    leaf = next((p for p in item.parts if p.role == "door" and p.solid is not None), None)
    handle = next((p for p in item.parts if p.role == "handle" and p.solid is not None), None)
    into = -item.scene_T_object[:2, 1]
    if leaf is None or handle is None or np.ptp(leaf.vertices[:, 1]) > SHUT_M or into @ way.inward[0] <= 0:
        return None
    low, high = leaf.vertices.min(axis=0) - HIT_M, leaf.vertices.max(axis=0) + HIT_M
    parts = [p for p in item.parts if p.solid is not None and _within(p, low, high)]
    right = handle.vertices[:, 0].mean() < (low[0] + high[0]) / 2  # it hangs on the side of +x
    pivot = np.array([(high if right else low)[0], 0.0])
    turn = _free_turn(item, parts, pivot, 1.0 if right else -1.0, obstacles.without(item.object_id))
    if turn is None:
        return None
    length = float(high[0] - low[0])
    goal = nearest_free(floor, way.feet[0] + (length + BEYOND_M) * way.inward[0], SNAP_M)
    inside = None if goal is None else route_from(floor, costs_from(floor, entry_xy), entry_xy, goal[0])
    if inside is None:
        return None
    outside = quantise_m(way.feet[0] - OUTSIDE_M * way.inward[0])
    hinge = apply(item.scene_T_object, np.append(pivot, 0.0))[:2]
    swept = floor.free & (np.sum((floor.centres() - hinge) ** 2, axis=-1) <= (length + BODY_M) ** 2)
    names = tuple(part.name for part in parts)
    return Entrance(item.object_id, names, pivot, turn, np.concatenate([outside[None], inside]), swept)


def _within(part: Part, low: FloatArray, high: FloatArray) -> bool:
    """Whether a part lies over the leaf, seen from the front."""
    corners = part.vertices[:, [0, 2]]
    return bool((corners >= low[[0, 2]]).all() and (corners <= high[[0, 2]]).all())


def _free_turn(item: SceneObject, parts: list[Part], pivot: FloatArray, sign: float, others: Obstacles) -> float | None:
    """How far the leaf turns into the room without hitting anything, radians; None if not far enough."""
    points = np.concatenate([p.vertices for p in parts])
    points = np.concatenate([points, *((points + points[k]) / 2 for k in range(min(len(parts[0].vertices), 8)))])
    free = 0.0
    for degrees in np.arange(STEP_DEG, OPEN_DEG[0] + STEP_DEG / 2, STEP_DEG):
        turned = points.copy()
        turned[:, :2] = (points[:, :2] - pivot) @ _turn(sign * np.radians(degrees)).T + pivot
        there = apply(item.scene_T_object, turned)
        if (others.depth(there[there[:, 2] > HIT_M], np.zeros(int((there[:, 2] > HIT_M).sum()))) > HIT_M).any():
            break
        free = float(degrees)
    best = next((d for d in OPEN_DEG if d <= free), None)
    return None if best is None else sign * float(np.radians(best))


def _turn(yaw_rad: float) -> FloatArray:
    c, s = cos_sin(yaw_rad)
    return np.array([[c, -s], [s, c]])
