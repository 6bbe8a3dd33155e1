"""A picture with its labels drawn over it, to be looked at."""

from __future__ import annotations

import cv2
import numpy as np

from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.states import Affordance
from hsbench.typing import UInt8Array

COLOURS = {
    Affordance.WALKABLE: (60, 190, 80),
    Affordance.REACHABLE: (150, 150, 150),
    Affordance.SUPPORTABLE: (70, 110, 235),
    Affordance.SITTABLE: (235, 150, 20),
    Affordance.LYABLE: (170, 80, 200),
    Affordance.OPENABLE: (30, 190, 200),
    Affordance.INTERACTABLE: (220, 50, 60),
}
"""sRGB of each label; where a pixel has several, the last of them shows, and the outlines of all."""

FILL = 0.5
OUTLINE_PX = 2
VOID = (110, 110, 110)


def overlaid(rgb: UInt8Array, labels: UInt8Array) -> UInt8Array:
    """(h, w, 3) sRGB with (h, w) bits of a view in colours, and grey where no score counts."""
    drawn = rgb.copy()
    held = {kind: labels & np.uint8(1 << kind) > 0 for kind in COLOURS}
    for kind, colour in COLOURS.items():
        drawn[held[kind]] = np.round((1 - FILL) * rgb[held[kind]] + FILL * np.array(colour))
    for kind, colour in COLOURS.items():
        edges, _ = cv2.findContours(held[kind].astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.polylines(drawn, edges, True, colour, OUTLINE_PX, cv2.LINE_AA)
    drawn[labels & VIEW_UNSCORED > 0] = VOID
    return drawn
