"""Draw docs/metrics/images/boxes.svg from hsbench itself. Usage: boxes_figure.py OUT_FOLDER"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

from hsbench.geometry import boxes

INK, LINE, BLUE, GREEN, RED = "#222", "#cfcabd", "#2563a8", "#2e8b57", "#c0392b"
CENTRE, SCALE = (190.0, 190.0), 190.0


def text(x: float, y: float, words: str, fill: str = INK, anchor: str = "start", weight: int = 400) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{fill}" text-anchor="{anchor}" font-weight="{weight}">{words}</text>'


def outline(box: np.ndarray, stroke: str) -> str:
    """The footprint of an upright box, seen from above."""
    corners = boxes.corners(box)[0, [0, 4, 6, 2], :2] * [1, -1] * SCALE + CENTRE
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
    return f'<polygon points="{points}" fill="{stroke}" fill-opacity="0.15" stroke="{stroke}" stroke-width="2"/>'


def hull() -> str:
    """The octagon around a unit square and the same turned by 45 degrees."""
    corners = [
        (math.cos(k * math.pi / 4) * math.sqrt(0.5), math.sin(k * math.pi / 4) * math.sqrt(0.5)) for k in range(8)
    ]
    points = " ".join(f"{CENTRE[0] + SCALE * x:.1f},{CENTRE[1] + SCALE * y:.1f}" for x, y in corners)
    return f'<polygon points="{points}" fill="none" stroke="{RED}" stroke-width="2" stroke-dasharray="6 5"/>'


def draw() -> str:
    """The whole figure."""
    still = np.array([[0, 0, 0.5, 1, 1, 1, 0.0]])
    turned = still + [0, 0, 0, 0, 0, 0, math.pi / 4]
    iou, giou = boxes.iou_upright(still, turned)[0, 0], boxes.giou_upright(still, turned)[0, 0]
    parts = [
        hull(),
        outline(still, BLUE),
        outline(turned, GREEN),
        text(190, 34, "A cube and the same turned by 45 degrees", anchor="middle", weight=600),
        text(190, 366, f"IoU {iou:.3f}; GIoU {giou:.3f} (dashed: what holds both)", anchor="middle"),
        text(690, 34, "The same at any angle: 1 - IoU", anchor="middle", weight=600),
    ]

    def at(angle: float, loss: float) -> tuple[float, float]:
        return 480 + (math.log10(angle) + 15) * 28, 330 - (math.log10(loss) + 15) * 18.5

    for exponent in range(-15, 1, 3):
        x, y = at(10.0**exponent, 10.0**exponent)
        parts.append(f'<path d="M{x:.1f} 330V52M480 {y:.1f}H910" stroke="{LINE}"/>')
        parts.append(text(x, 348, f"1e{exponent}", anchor="middle"))
        parts.append(text(470, y + 5, f"1e{exponent}", anchor="end"))
    # 1 - 2 / (1 + sin + cos) as IoU, written so that nothing cancels
    angles = [10 ** (k / 4) for k in range(-60, 0)]
    exact = []
    for angle in angles:
        excess = math.sin(angle) - 2 * math.sin(angle / 2) ** 2  # sin + cos - 1
        exact.append(at(angle, excess / (1 + excess)))
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in exact)
    parts.append(f'<polyline points="{points}" fill="none" stroke="{RED}" stroke-width="2"/>')
    for angle in (10.0**k for k in range(-13, 0)):  # below, 1 - IoU is a few last bits, not the same on every machine
        box = boxes.as_oriented(np.array([[0, 0, 0.5, 1, 1, 1, angle]]))
        loss = 1 - boxes.iou_oriented(boxes.as_oriented(still), box)[0, 0]
        x, y = at(angle, loss)
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{BLUE}"/>')
    parts.append(text(690, 372, "turned by, rad. Line: in closed form; dots: iou_oriented", anchor="middle"))
    head = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 940 392" role="img" '
        'font-family="system-ui, \'DejaVu Sans\', sans-serif" font-size="14">\n'
        '  <title>Overlap of boxes</title>\n  <rect width="940" height="392" rx="8" fill="#ffffff"/>'
    )
    return "\n".join([head, *(f"  {part}" for part in parts), "</svg>\n"])


if __name__ == "__main__":
    (Path(sys.argv[1]) / "boxes.svg").write_text(draw(), encoding="utf-8")
