"""How things move over time: a chair drawn back from its table, the leaf of a door swung open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.poses import require
from hsbench.typing import FloatArray, Int32Array, IntArray


@dataclass(frozen=True, eq=False)
class ObjectMotions:
    """M key poses of things that move. Before its first a thing is as at t0; between two it moves evenly.

    timestamp_ns: (M,) int64; rows are ordered by time, then object, then part; no two are equal in all three.
    object_id: (M,) int32. part: (M,) names of the part that moves alone (a leaf), "" for the whole object.
    move: (M, 3) float64, the planar move from its pose at t0 in the object's own frame at t0: x and y in metres, yaw
    in radians about that frame's origin. Raises SchemaError otherwise.
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

    def __len__(self) -> int:
        return len(self.part)

    @classmethod
    def none(cls) -> ObjectMotions:
        """Nothing moves."""
        return cls(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int32), (), np.empty((0, 3)))

    def moves_at(self, timestamp_ns: int) -> dict[tuple[int, str], FloatArray]:
        """The moves (3,) at one time, by object id and part; things that have not moved yet are left out."""
        found: dict[tuple[int, str], FloatArray] = {}
        for key in dict.fromkeys(zip(self.object_id.tolist(), self.part, strict=True)):
            rows = [k for k in range(len(self)) if (int(self.object_id[k]), self.part[k]) == key]
            times = self.timestamp_ns[rows]
            if timestamp_ns >= times[0]:
                moves = self.move[rows]
                found[key] = np.array(
                    [np.interp(timestamp_ns - times[0], times - times[0], moves[:, a]) for a in range(3)]
                )
        return found
