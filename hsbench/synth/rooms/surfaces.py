"""Free space on tops, boards and seats: where a small thing can stand on a carrier.

What lies within the outline of a surface that people cannot walk under changes no promise of the layout. So things are
tested here, in the frame of their carrier, and put into the layout without another check of its floor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.geometry.transforms import apply, cos_sin, invert
from hsbench.schema.scene import Part
from hsbench.synth.rooms.items import Item, Piece, Pose
from hsbench.synth.rooms.placing import Layout
from hsbench.typing import FloatArray

APART_M = 0.01  # sideways, between things on one surface
EDGE_M = 0.015  # small things keep this far from the edge of a top
LIFT_M = 1e-4  # what stands on a surface begins so far above it, as far as obstacles are concerned
BELOW_M = 1e-3  # from a surface into what carries
BEVEL_M = 0.006  # by which the surface of a top is smaller than the top


@dataclass(frozen=True, eq=False)
class Carrier:
    """An item and, in its frame, boxes (6,) low and high corner about what things on it must not touch."""

    item: Item
    obstacles: list[FloatArray]

    @classmethod
    def of(cls, layout: Layout, item: Item) -> Carrier:
        """A carrier with its own parts, everything else in the room and the space before windows as obstacles."""
        boxes = [np.concatenate([p.vertices.min(axis=0), p.vertices.max(axis=0)]) for p in item.piece.parts]
        prisms = [(other.corners, *other.z_range) for other in layout.items if other is not item]
        windows = (o for o in layout.shell.openings if o.kind == "window")
        prisms += [hole.zone(layout.shell.walls[hole.wall], 0.0) for hole in windows]
        to_carrier = invert(item.pose.scene_T_object)
        for corners, low, high in prisms:
            flat = apply(to_carrier, np.pad(corners, ((0, 0), (0, 1))))
            boxes.append(_box(flat, low - item.pose.z, high - item.pose.z))
        return cls(item, boxes)

    def put(self, layout: Layout, top: Part, piece: Piece, place: Pose, lying: bool = False) -> bool:
        """Stand a piece on a surface of the carrier, at a place in its frame, if it fits there.

        All of it keeps from the edge of the surface; of what is ``lying`` only the foot must be on it.
        """
        z = float(top.vertices[:, 2].max())
        on_top = Pose(place.x, place.y, place.yaw, z)
        rest = _corners(_foot(piece) if lying else piece.bounds, on_top, 0.0 if lying else EDGE_M)
        if top.solid is None or not top.solid.contains(rest - [0.0, 0.0, BELOW_M]).all():
            return False
        low, high = piece.bounds[:, 2].tolist()
        box = _box(_corners(piece.bounds, on_top, 0.0), z + low + LIFT_M, z + high)
        taken = np.array(self.obstacles)
        gap = np.maximum(taken[:, :3], box[:3]) - np.minimum(taken[:, 3:], box[3:])
        if (gap < [APART_M, APART_M, 0.0]).all(axis=1).any():
            return False
        layout.items.append(Item(piece, self.item.pose.then(place.x, place.y, place.yaw, z)))
        self.obstacles.append(box)
        return True

    def points(self, xy: FloatArray) -> FloatArray:
        """(n, 2) points of the room in the frame of the carrier."""
        return apply(invert(self.item.pose.scene_T_object), np.pad(xy, ((0, 0), (0, 1))))[:, :2]


def surfaces(parts: Sequence[Part]) -> list[Part]:
    """The parts on which things stand."""
    return [p for p in parts if p.role in ("top", "shelf")]


def half_size(piece: Piece, yaw: float) -> FloatArray:
    """(2,) half the sides of the box about a turned piece, with the space it keeps from an edge."""
    c, s = np.abs(cos_sin(yaw))
    w, d = piece.width, piece.depth
    return np.array([c * w + s * d, s * w + c * d]) / 2 + EDGE_M + BEVEL_M


def _box(corners: FloatArray, low: float, high: float) -> FloatArray:
    """(6,) low and high corner about points (n, 3) between two heights."""
    (x0, y0, _), (x1, y1, _) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return np.array([x0, y0, low, x1, y1, high])


def _foot(piece: Piece) -> FloatArray:
    """(2, 3) lowest and highest corner of what touches the ground."""
    points = np.concatenate([p.vertices for p in piece.parts])
    feet = points[points[:, 2] < points[:, 2].min() + BELOW_M]
    return np.stack([feet.min(axis=0), feet.max(axis=0)])


def _corners(bounds: FloatArray, pose: Pose, edge_m: float) -> FloatArray:
    """(4, 3) corners of a box's footprint at a pose, moved outwards by a margin."""
    (x0, y0, _), (x1, y1, _) = bounds.tolist()
    flat = [[a, b, 0.0] for a in (x0 - edge_m, x1 + edge_m) for b in (y0 - edge_m, y1 + edge_m)]
    return apply(pose.scene_T_object, np.array(flat))
