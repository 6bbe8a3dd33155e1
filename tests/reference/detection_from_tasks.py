"""The detection task scored by hand, slow and plain: written from the text of task object-detection-3d alone, by
somebody who had not read the scorer of the package.

Rules, as the text gives them: each detection goes to its highest-IoU truth of its episode if that IoU >= t; a truth is
hit once, by the highest score; other detections are false. Precision and recall are read at the ends of blocks of equal
score; AP is the all-point area, precision at a recall being the best at that recall or a larger one. Episodes pool.
A detection that goes to a difficult truth counts neither way, and difficult truths are not to be found.

Nothing here is shared with the package: shapely's polygons are the footprints, counts are integers, areas are rational.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from shapely import affinity
from shapely import box as rectangle


@dataclass(frozen=True)
class Truth:
    box: tuple[float, ...]  # centre x y z, full size l w h, yaw
    label: int = 1
    difficult: bool = False
    cell: tuple[str, str] = ("VISIBLE", "NEITHER")  # visibility, evidence


@dataclass(frozen=True)
class Guess:
    box: tuple[float, ...]
    score: float
    label: int = 1


Episode = tuple[list[Truth], list[Guess]]


def iou(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    height = min(a[2] + a[5] / 2, b[2] + b[5] / 2) - max(a[2] - a[5] / 2, b[2] - b[5] / 2)
    common = max(0.0, height) * footprint(a).intersection(footprint(b)).area
    return common / (a[3] * a[4] * a[5] + b[3] * b[4] * b[5] - common)


def footprint(a: tuple[float, ...]):
    lying = rectangle(-a[3] / 2, -a[4] / 2, a[3] / 2, a[4] / 2)
    return affinity.translate(affinity.rotate(lying, a[6], origin=(0, 0), use_radians=True), a[0], a[1])


def outcomes(episodes: list[Episode], t: float) -> list[tuple[float, str]]:
    """(score, "hit" | "false" | "ignored") of every detection."""
    found = []
    for truths, guesses in episodes:
        taken = set()
        for guess in sorted(guesses, key=lambda g: -g.score):
            overlaps = [iou(guess.box, truth.box) for truth in truths]
            best = max(range(len(truths)), key=lambda i: overlaps[i], default=None)
            if best is None or overlaps[best] < t:
                found.append((guess.score, "false"))
            elif truths[best].difficult:
                found.append((guess.score, "ignored"))
            elif best in taken:
                found.append((guess.score, "false"))
            else:
                taken.add(best)
                found.append((guess.score, "hit"))
    return found


def curve(episodes: list[Episode], t: float) -> list[tuple[Fraction, Fraction]]:
    """(recall, precision) at the end of every block of equal score that holds a scored detection, best score first."""
    wanted = sum(not truth.difficult for truths, _ in episodes for truth in truths)
    scored = [(score, what) for score, what in outcomes(episodes, t) if what != "ignored"]
    points = []
    for score in sorted({score for score, _ in scored}, reverse=True):
        kept = [what for s, what in scored if s >= score]
        points.append((Fraction(kept.count("hit"), wanted), Fraction(kept.count("hit"), len(kept))))
    return points


def average_precision(episodes: list[Episode], t: float) -> Fraction | None:
    """None where there is nothing to find."""
    if not any(not truth.difficult for truths, _ in episodes for truth in truths):
        return None
    points = curve(episodes, t)
    area, before = Fraction(0), Fraction(0)
    for i, (recall, _) in enumerate(points):
        area += (recall - before) * max(precision for _, precision in points[i:])
        before = recall
    return area


def of_label(episodes: list[Episode], label: int) -> list[Episode]:
    return [([t for t in ts if t.label == label], [g for g in gs if g.label == label]) for ts, gs in episodes]


def counts_at(episodes: list[Episode], t: float, operating_score: float = -math.inf) -> tuple[int, int, int]:
    """(hits, false detections, truths) among detections of at least this score."""
    kept = [(ts, [g for g in gs if g.score >= operating_score]) for ts, gs in episodes]
    what = [w for _, w in outcomes(kept, t)]
    return what.count("hit"), what.count("false"), sum(not x.difficult for ts, _ in episodes for x in ts)


def recall_table(
    episodes: list[Episode], t: float, operating_score: float = -math.inf
) -> dict[tuple[str, str], tuple[int, int]]:
    """(found, present) truths by visibility and evidence."""
    table: dict[tuple[str, str], tuple[int, int]] = {}
    for truths, guesses in episodes:
        taken = set()
        for guess in guesses:
            overlaps = [iou(guess.box, truth.box) for truth in truths]
            if guess.score >= operating_score and overlaps and max(overlaps) >= t:
                taken.add(overlaps.index(max(overlaps)))
        for i, truth in enumerate(truths):
            found, present = table.get(truth.cell, (0, 0))
            table[truth.cell] = found + (i in taken), present + 1
    return table
