"""Doorways: where doors and passages lead, found from the objects of a scene and the outlines of its rooms.

A doorway lies in the wall, so in no outline. It is looked for along the y axis of its object, which leads through the
wall; where no room is found there (imported objects), along its x axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.schema.scene import Scene, SceneObject
from hsbench.typing import FloatArray

WAYS = ("door", "passage")
WALL_REACH_M = 0.6  # a doorway is no deeper: walls are thinner
INTO_ROOM_M = 0.15  # a door object may lie so far inside a room
STEEP = 0.7  # cosine between a way and the normal of the wall it passes


@dataclass(frozen=True, eq=False)
class Doorway:
    """A door or passage and its one or two sides that lie at rooms.

    rooms: their numbers. feet: (S, 2) where the way crosses their outlines, metres. inward: (S, 2) unit directions into
    them. across: (2,) unit vector along the wall, span_m: how far the object reaches along it from the feet.
    """

    object_id: int
    rooms: tuple[int, ...]
    feet: FloatArray
    inward: FloatArray
    across: FloatArray
    span_m: tuple[float, float]

    def corners(self, side: int) -> FloatArray:
        """(2, 2) the ends of the doorway on one of its sides."""
        return np.asarray(self.feet[side] + np.array(self.span_m)[:, None] * self.across)


def doorways(scene: Scene) -> list[Doorway]:
    """The doorways of a scene in the order of its objects; doors that lead into no room are left out."""
    found = (_doorway(scene, item) for item in scene.objects if item.category_name in WAYS)
    return [way for way in found if way is not None]


def _doorway(scene: Scene, item: SceneObject) -> Doorway | None:
    origin = item.scene_T_object[:2, 3]
    for axis in (1, 0):
        through = item.scene_T_object[:2, axis]
        sides = [s for s in (_side(scene, origin, sign * through) for sign in (-1.0, 1.0)) if s is not None]
        if sides:
            rooms, feet, inward = zip(*sides, strict=True)
            across = item.scene_T_object[:2, 1 - axis]
            along = (item.vertices[:, :2] - origin) @ across
            span = float(along.min()), float(along.max())
            return Doorway(item.object_id, rooms, np.array(feet), np.array(inward), across, span)
    return None


def _side(scene: Scene, origin: FloatArray, direction: FloatArray) -> tuple[int, FloatArray, FloatArray] | None:
    """(room, foot, direction) of the first room that a way from a point along a unit direction comes into."""
    best = None
    for number, room in enumerate(scene.rooms):
        start, end = room.outline_xy, np.roll(room.outline_xy, -1, axis=0)
        length = np.linalg.norm(end - start, axis=1)
        along = (end - start) / length[:, None]
        inward = np.column_stack([-along[:, 1], along[:, 0]])
        slope = inward @ direction
        facing = slope > STEEP
        away = np.einsum("ij,ij->i", start - origin, inward)[facing] / slope[facing]
        foot = origin + away[:, None] * direction
        place = np.einsum("ij,ij->i", foot - start[facing], along[facing])
        hit = (away >= -INTO_ROOM_M) & (away <= WALL_REACH_M) & (place >= 0) & (place <= length[facing])
        for distance, point in zip(away[hit], foot[hit], strict=True):
            if best is None or abs(distance) < best[0]:
                best = (abs(float(distance)), number, point)
    return None if best is None else (best[1], best[2], direction)
