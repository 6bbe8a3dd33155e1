"""How things move over time: a chair drawn back from its table, the leaf of a door swung open."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply, cos_sin, planar
from hsbench.schema.poses import require
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.typing import FloatArray, Int32Array, IntArray

Thing = tuple[int, str]
"""What moves as one: an object id and the name of a part of it, "" for the whole object."""
Move = tuple[float, float, float]
"""x and y in metres and yaw in radians, as ``ObjectMotions.move``."""

HALF_TURN_RAD = math.pi + 1e-6  # room for rounding
STRAIGHT_RAD = 1e-9  # a turn by less is none


@dataclass(frozen=True, eq=False)
class ObjectMotions:
    """M key poses of things that move. Before its first a thing is as at t0, after its last it stays where it is.

    Between two it moves evenly: along a line, or where it turns, about one fixed point, as a leaf about its hinge.

    timestamp_ns: (M,) int64; rows are ordered by time, then object, then part; no two are equal in all three.
    object_id: (M,) int32. part: (M,) names of the part that moves alone (a leaf), "" for the whole object.
    move: (M, 3) float64, the planar move from its pose at t0 in the object's own frame at t0: x and y in metres, yaw
    in radians about that frame's origin, which goes at most half a turn from key pose to key pose. A part of an object
    that moves as a whole goes with it. Raises SchemaError otherwise.
    """

    timestamp_ns: IntArray
    object_id: Int32Array
    part: tuple[str, ...]
    move: FloatArray

    def __post_init__(self) -> None:
        n = len(self.part)
        require(self.timestamp_ns, "motions.timestamp_ns", (n,), np.int64)
        require(self.object_id, "motions.object_id", (n,), np.int32)
        require(self.move, "motions.move", (n, 3), np.float64)
        if not np.isfinite(self.move).all():
            raise SchemaError("motions.move holds NaN or infinity; expected metres and radians")
        keys = list(zip(self.timestamp_ns.tolist(), self.object_id.tolist(), self.part, strict=True))
        row = next((k for k in range(1, n) if keys[k] <= keys[k - 1]), None)
        if row is not None:
            raise SchemaError(
                f"motions row {row} {keys[row]} repeats or comes too late; expected rows by time, object, part"
            )
        for (object_id, part), (_, moves) in self.tracks.items():
            turn = np.abs(np.diff(moves[:, 2])).max(initial=0.0)
            if turn > HALF_TURN_RAD:
                raise SchemaError(
                    f"motions turn object {object_id} {part!r} by {turn:.4g} rad from one key pose to the next; "
                    f"expected at most half a turn (are these degrees?)"
                )

    def __len__(self) -> int:
        return len(self.part)

    @classmethod
    def none(cls) -> ObjectMotions:
        """Nothing moves."""
        return cls(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int32), (), np.empty((0, 3)))

    @cached_property
    def tracks(self) -> dict[Thing, tuple[IntArray, FloatArray]]:
        """The times (K,) and moves (K, 3) of each thing, in the order in which they first move."""
        rows: dict[Thing, list[int]] = {}
        for row, thing in enumerate(zip(self.object_id.tolist(), self.part, strict=True)):
            rows.setdefault(thing, []).append(row)
        return {thing: (self.timestamp_ns[own], self.move[own]) for thing, own in rows.items()}

    def moves_at(self, timestamp_ns: int) -> dict[Thing, Move]:
        """The moves at one time, rounded to .1 mm and .01 degree; things that are where they were at t0 are left out.

        In ascending order of object and part.
        """
        found = {thing: _move_at(*self.tracks[thing], timestamp_ns) for thing in sorted(self.tracks)}
        return {thing: move for thing, move in found.items() if any(move)}


def _move_at(times: IntArray, moves: FloatArray, timestamp_ns: int) -> Move:
    before = int(np.searchsorted(times, timestamp_ns, side="right")) - 1
    if before < 0:
        return 0.0, 0.0, 0.0
    if before == len(times) - 1:
        x, y, yaw = moves[before].tolist()
    else:
        share = float(timestamp_ns - times[before]) / float(times[before + 1] - times[before])
        x, y, yaw = _between(moves[before], moves[before + 1], share)
    return float(quantise_m(x)), float(quantise_m(y)), quantise_angle(yaw)


def _between(first: FloatArray, last: FloatArray, share: float) -> tuple[float, float, float]:
    """The pose at a share of the way on the circle about the fixed point of the turn, on a line if there is none."""
    turn = float(last[2] - first[2])
    along = share if abs(turn) < STRAIGHT_RAD else math.sin(share * turn / 2) / math.sin(turn / 2)
    c, s = cos_sin((share - 1.0) * turn / 2)
    dx, dy = (last[:2] - first[:2]).tolist()
    x, y, yaw = first.tolist()
    return x + along * (c * dx - s * dy), y + along * (s * dx + c * dy), yaw + share * turn


def scene_at(scene: Scene, moves: Mapping[Thing, Move]) -> Scene:
    """The scene with things moved from where they are at t0, as ``ObjectMotions.moves_at`` gives them for a time.

    Raises SchemaError for a thing that the scene does not have.
    """
    check_things(scene, moves)
    moved = {object_id for object_id, _ in moves}
    objects = tuple(_moved_object(item, moves) if item.object_id in moved else item for item in scene.objects)
    return replace(scene, objects=objects)


def check_things(scene: Scene, things: Mapping[Thing, object]) -> None:
    """Raise SchemaError unless a scene has these objects and parts."""
    for object_id, part in things:
        names = {p.name for p in scene.object(object_id).parts}
        if part and part not in names:
            raise SchemaError(
                f"scene {scene.scene_id}, object {object_id} has no part {part!r}; expected one of"
                f" {', '.join(sorted(names))}"
            )


def _moved_object(item: SceneObject, moves: Mapping[Thing, Move]) -> SceneObject:
    whole = moves.get((item.object_id, ""), (0.0, 0.0, 0.0))
    parts = tuple(
        _moved_part(part, moves[item.object_id, part.name]) if (item.object_id, part.name) in moves else part
        for part in item.parts
    )
    return replace(item, scene_T_object=item.scene_T_object @ planar(*whole), parts=parts)


def _moved_part(part: Part, move: Move) -> Part:
    object_T_moved = planar(*move)
    if part.solid is not None:
        return replace(part, solid=part.solid.transformed(object_T_moved))
    vertices, triangles = part.mesh  # type: ignore[misc]
    return replace(part, mesh=(apply(object_T_moved, vertices), triangles))
