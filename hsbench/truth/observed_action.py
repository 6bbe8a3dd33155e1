"""What the person of an observed pose was really doing, by the match that is stored with truth.

Task action-recognition.
"""

from __future__ import annotations

import numpy as np

from hsbench.schema.poses import TruePoseTable
from hsbench.schema.states import Action
from hsbench.typing import UInt8Array


def observed_actions(true: TruePoseTable) -> UInt8Array:
    """(M,) uint8 of ``Action``, one an observed pose; IGNORED for false detections."""
    with_none = np.append(true.action, np.uint8(Action.IGNORED))  # match -1 is the last
    return np.asarray(with_none[true.match])
