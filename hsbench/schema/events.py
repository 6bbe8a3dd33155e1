"""Events: who did what with which part of which object, from when to when, touching it with what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.poses import require
from hsbench.typing import Int32Array, IntArray


@dataclass(frozen=True, eq=False)
class EventTable:
    """E events, ordered by start.

    person_id: (E,) int32. activity: (E,) names such as ``sit`` or ``touch``.
    object_id: (E,) int32, 0 where no object is involved. part: (E,) part names, "" where none.
    start_ns, end_ns: (E,) int64, end >= start.
    contact: (E,) body parts in contact, comma separated ("pelvis", "hand_right"), "" where none.
    """

    person_id: Int32Array
    activity: tuple[str, ...]
    object_id: Int32Array
    part: tuple[str, ...]
    start_ns: IntArray
    end_ns: IntArray
    contact: tuple[str, ...]

    def __post_init__(self) -> None:
        n = len(self.activity)
        require(self.person_id, "events.person_id", (n,), np.int32)
        require(self.object_id, "events.object_id", (n,), np.int32)
        require(self.start_ns, "events.start_ns", (n,), np.int64)
        require(self.end_ns, "events.end_ns", (n,), np.int64)
        if len(self.part) != n or len(self.contact) != n:
            raise SchemaError(
                f"events have {len(self.part)} parts and {len(self.contact)} contacts; expected {n} of each"
            )
        if (self.end_ns < self.start_ns).any():
            row = int(np.argmax(self.end_ns < self.start_ns))
            raise SchemaError(f"events row {row} ends before it starts ({self.start_ns[row]} > {self.end_ns[row]})")
        if n and (np.diff(self.start_ns) < 0).any():
            raise SchemaError("events are not ordered by start_ns")

    def __len__(self) -> int:
        return len(self.activity)
