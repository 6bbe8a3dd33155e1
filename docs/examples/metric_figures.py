"""Draw the figures of docs/metrics from the worked examples of its pages. Usage: metric_figures.py OUT_FOLDER"""

from __future__ import annotations

import math
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np

from hsbench.metrics import curves, ranking, reconstruction, segmentation
from hsbench.metrics.action import segment_counts, segments
from hsbench.metrics.completion import OWN_PROTOCOLS, PROTOCOLS, score
from hsbench.metrics.completion_protocols import FOREIGN
from hsbench.schema import VoxelState

INK, PALE, LINE = "#222", "#f1efe9", "#cfcabd"
BLUE, GREEN, RED, GREY = "#2563a8", "#2e8b57", "#c0392b", "#888"


def svg(title: str, width: int, height: int, parts: list[str]) -> str:
    """A white sheet with a title for screen readers."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" '
        'font-family="system-ui, \'DejaVu Sans\', sans-serif" font-size="14">\n'
        f'  <title>{title}</title>\n  <rect width="{width}" height="{height}" rx="8" fill="#ffffff"/>'
    )
    return "\n".join([head, *(f"  {part}" for part in parts), "</svg>\n"])


def text(x: float, y: float, words: str, *, fill: str = INK, anchor: str = "start", bold: bool = False) -> str:
    weight = ' font-weight="600"' if bold else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{fill}" text-anchor="{anchor}"{weight}>{words}</text>'


def box(x: float, y: float, w: float, h: float, fill: str, stroke: str = "none") -> str:
    return f'<rect x="{x:.1f}" y="{y:.1f}" width="{w:.1f}" height="{h:.1f}" fill="{fill}" stroke="{stroke}"/>'


def line(x1: float, y1: float, x2: float, y2: float, stroke: str = INK, width: float = 1, dash: str = "") -> str:
    dashes = f' stroke-dasharray="{dash}"' if dash else ""
    at = f'x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"'
    return f'<line {at} stroke="{stroke}" stroke-width="{width}"{dashes}/>'


def dot(x: float, y: float, fill: str, radius: float = 5) -> str:
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{fill}"/>'


def completion_figure() -> str:
    """Which voxel states each protocol counts, asked of the scorer with one voxel of every kind."""
    kinds = [(s.name.lower().replace("_", " "), s, 1) for s in VoxelState if s != VoxelState.UNKNOWN]
    kinds += [("no label (255)", VoxelState.OCCLUDED, 255)]
    parts = [text(24, 34, "Which voxels a protocol of completion counts", bold=True)]
    for column, (name, _, _) in enumerate(kinds):
        parts.append(text(280 + 108 * column, 66, name, anchor="middle"))
    for row, protocol in enumerate(PROTOCOLS):
        y = 84 + 32 * row
        parts += [box(20, y, 968, 28, PALE if row % 2 == 0 else "#fff"), text(30, y + 19, protocol)]
        for column, (_, state, label) in enumerate(kinds):
            if protocol in OWN_PROTOCOLS and label == 255:
                parts.append(text(280 + 108 * column, y + 19, "-", fill=GREY, anchor="middle"))
                continue
            truth = np.full((1, 1, 1), label if protocol in FOREIGN else 9, np.uint8)
            states = np.full((1, 1, 1), state, np.uint8)
            counts = score(truth, np.zeros((1, 1, 1), bool), states, protocol).counts
            if counts.total:
                solid = counts.fn == 1
                parts.append(dot(280 + 108 * column, y + 14, BLUE if solid else RED, 7))
    y = 84 + 32 * len(PROTOCOLS) + 24
    parts += [dot(34, y - 5, BLUE, 7), text(50, y, "counts"), dot(130, y - 5, RED, 7), text(146, y, "counts, as empty")]
    return svg("Voxels that each completion protocol counts", 1008, y + 20, parts)


def segmentation_figure() -> str:
    """One matrix, four values: the rules for a class without truth."""
    matrix = np.zeros((4, 4), int)
    matrix[:3, :3] = [[28, 6, 0], [0, 28, 6], [6, 0, 28]]
    parts = [text(24, 34, "Mean IoU of one matrix whose fourth class does not occur", bold=True)]
    for row, rule in enumerate(segmentation.ABSENT_RULES):
        y = 54 + 32 * row
        value = segmentation.score(matrix, rule).mean_iou
        parts.append(text(24, y + 18, rule))
        if value is None:
            parts.append(text(230, y + 18, "undefined", fill=GREY))
        else:
            fill = BLUE if rule == "hsbench" else "#9db7d5"
            parts += [box(230, y + 2, 480 * value, 22, fill), text(240 + 480 * value, y + 18, f"{value:.3f}")]
    return svg(
        "Mean IoU under each rule for an absent class", 800, 54 + 32 * len(segmentation.ABSENT_RULES) + 12, parts
    )


def action_figure() -> str:
    """Segments of truth and prediction, and which predicted ones are right at .5."""
    truth, prediction = (np.array([int(c) for c in s]) for s in ("1111222233", "1112122233"))
    counts = segment_counts(truth, prediction)
    colours = {1: "#9db7d5", 2: "#a8d0b8", 3: "#e6b8b0"}
    parts = [text(24, 34, "Segments of a sequence of ten poses", bold=True)]
    for row, (name, labels) in enumerate((("truth", truth), ("prediction", prediction))):
        y = 60 + 70 * row
        parts.append(text(24, y + 27, name))
        for label, start, stop in segments(labels):
            x, w = 130 + 60 * start, 60 * (stop - start)
            parts += [
                box(x, y, w, 42, colours[int(label)], "#fff"),
                text(x + w / 2, y + 27, str(label), anchor="middle"),
            ]
    for x, words in ((220, "IoU 3/4"), (340, "0"), (400, "0"), (520, "3/4"), (670, "1")):
        parts.append(text(x, 196, words, fill=GREY if words == "0" else GREEN, anchor="middle"))
    edit, f1 = counts.edit_score, counts.f1[-1]
    parts.append(
        text(24, 230, f"edit score 1 - {counts.distance}/{counts.longer} = {edit:.2f};  F1@.5 = 6/8 = {f1:.2f}")
    )
    return svg("Segments, their overlap, edit score and F1", 760, 250, parts)


def reconstruction_figure() -> str:
    """Three true and two predicted points, a threshold and the nearest distances."""
    truth = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])
    prediction = np.array([[0, 0, 0.1], [1, 0, 0.3]])
    got = reconstruction.score(truth, prediction, 0.1)
    parts = [text(24, 34, "Three points of truth, two predicted; threshold 0.1 m", bold=True)]

    def at(point: np.ndarray) -> tuple[float, float]:
        return 120 + 220 * point[0], 190 - 320 * point[2]

    for point in truth:
        x, y = at(point)
        parts.append(f'<circle cx="{x}" cy="{y}" r="32" fill="{PALE}" stroke="{LINE}"/>')
    for a, b in ((prediction[0], truth[0]), (prediction[1], truth[1]), (truth[2], prediction[1])):
        parts.append(line(*at(a), *at(b), stroke=GREY, dash="5 4"))
    parts += [dot(*at(p), BLUE) for p in truth] + [dot(*at(p), RED) for p in prediction]
    parts += [text(132, 152, "0.1 m"), text(352, 140, "0.3 m"), text(470, 132, "1.044 m")]
    parts += [dot(640, 80, BLUE), text(654, 85, "truth"), dot(640, 104, RED), text(654, 109, "predicted")]
    words = f"accuracy {got.accuracy:.3f}, completeness {got.completeness:.3f}, F {got.f_score:.3f}, "
    parts.append(text(24, 262, words + f"chamfer {got.chamfer_m:.3f} m"))
    return svg("Accuracy, completeness and chamfer of points", 760, 284, parts)


def curve_figure() -> str:
    """A score over log time, its area and the time to a level."""
    curve = curves.Curve((5.0, 15.0, 30.0, 60.0, 120.0), (0.20, 0.28, 0.36, 0.42, 0.44))
    value, reach = curves.area(curve), curves.time_to_reach(curve, 0.4)
    assert value is not None
    assert reach.seconds is not None

    def at(seconds: float, share: float) -> tuple[float, float]:
        return 90 + 560 * math.log(seconds / 5) / math.log(24), 280 - 440 * share

    points = [at(t, s) for t, s in zip(curve.observed_s, curve.scores, strict=True) if s is not None]
    outline = " ".join(f"{x:.1f},{y:.1f}" for x, y in [at(5, 0), *points, at(120, 0)])
    parts = [
        text(24, 34, "IoU against seconds of observation", bold=True),
        f'<polygon points="{outline}" fill="#dbe6f2"/>',
        line(*at(5, 0), *at(120, 0)), line(*at(5, 0), *at(5, 0.5)),
        line(*at(5, value), *at(120, value), stroke=BLUE, dash="6 4"),
        text(658, at(5, value)[1] + 5, f"area {value:.3f}", fill=BLUE),
        line(*at(5, 0.4), *at(reach.seconds, 0.4), stroke=GREEN, dash="3 4"),
        line(*at(reach.seconds, 0.4), *at(reach.seconds, 0), stroke=GREEN, dash="3 4"),
        text(at(reach.seconds, 0)[0] - 6, at(5, 0.06)[1], f"0.4 after {reach.seconds:.1f} s", fill=GREEN, anchor="end"),
    ]  # fmt: skip
    parts += [line(*a, *b, stroke=BLUE, width=2.5) for a, b in pairwise(points)]
    parts += [dot(*p, BLUE) for p in points]
    parts += [text(at(t, 0)[0], 302, f"{t:g} s", anchor="middle") for t in curve.observed_s]
    parts += [text(80, at(5, s)[1] + 5, f"{s:.1f}", anchor="end") for s in (0.0, 0.2, 0.4)]
    return svg("An observation curve, its area and the time to reach a level", 760, 320, parts)


def uncertainty_figure() -> str:
    """Rank probabilities of three methods on twelve scenes."""
    got = ranking.rank_probabilities(example_stats(), iou)
    assert got.probabilities is not None
    shades = (BLUE, "#9db7d5", "#dfe8f1")
    parts = [text(24, 34, "How often each method is first, second, third", bold=True)]
    for row, (name, shares) in enumerate(zip("ABC", got.probabilities, strict=True)):
        y, x = 56 + 46 * row, 130.0
        parts.append(text(24, y + 23, f"{name}: IoU {got.estimates[row]:.3f}"))
        for rank, share in enumerate(shares):
            parts.append(box(x, y, 560 * share, 34, shades[rank], "#fff"))
            if share > 0.06:
                fill = "#fff" if rank == 0 else INK
                parts.append(text(x + 280 * share, y + 23, f"{share:.2f}", fill=fill, anchor="middle"))
            x += 560 * share
    for rank, name in enumerate(("first", "second", "third")):
        parts += [box(130 + 110 * rank, 202, 16, 16, shades[rank]), text(152 + 110 * rank, 215, name)]
    return svg("Rank probabilities of three methods", 720, 236, parts)


def example_stats() -> np.ndarray:
    """(3, 12, 4): A and B differ little and in both directions, C is worse in most scenes. As in uncertainty.md."""
    k = np.arange(12)
    tp = np.stack([50 + 3 * (k % 5), 49 + 3 * (k % 5) + 3 * (k % 2), 47 + 3 * (k % 6)])
    return np.stack([tp, 20 + 0 * tp, 100 - tp, 0 * tp], axis=-1)


def iou(counts: np.ndarray) -> np.ndarray:
    """(..., 4) tp, fp, fn, tn -> (...) IoU."""
    return counts[..., 0] / counts[..., :3].sum(axis=-1)


FIGURES = {
    "completion": completion_figure,
    "segmentation": segmentation_figure,
    "action": action_figure,
    "reconstruction": reconstruction_figure,
    "curves": curve_figure,
    "uncertainty": uncertainty_figure,
}

if __name__ == "__main__":
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for name, draw in FIGURES.items():
        (out / f"{name}.svg").write_text(draw(), encoding="utf-8")
