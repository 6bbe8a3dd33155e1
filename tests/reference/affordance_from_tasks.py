"""The affordance tasks scored slowly, in plain loops, from the text of the tasks alone. Nothing of the package is used.

Rules, as the text gives them: three yes-or-no labels a cell, an answer being yes at probability .5 or more; cells that
are ignored count nowhere; a label's IoU is over the cells of all episodes together; the score is the mean of the three.
Exclusive: one label a cell, sittable before interactable before walkable before none. Scale-free: for each episode the
answer is scaled about the middle by the best of 41 factors, 2^(-1) to 2^1 in even steps of the exponent, for the mean
of the episode's three IoUs; ties go to the factor nearest 1, then to the smaller.
"""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction

Plane = list[list[bool]]
Episode = tuple[list[Plane], list[list[list[float]]], Plane]
"""(three planes of truth, three of probability, ignored), planes in the order walkable, sittable, interactable."""

Counts = list[int]  # hits, false, missed
CLASSES = ("none", "walkable", "interactable", "sittable")


def yes(probability: list[list[float]]) -> Plane:
    return [[p >= 0.5 for p in row] for row in probability]


def count(truth: Plane, answer: Plane, ignored: Plane) -> Counts:
    counts = [0, 0, 0]
    for i, row in enumerate(truth):
        for j, true in enumerate(row):
            if ignored[i][j]:
                continue
            if true and answer[i][j]:
                counts[0] += 1
            elif answer[i][j]:
                counts[1] += 1
            elif true:
                counts[2] += 1
    return counts


def share(part: int, whole: int) -> Fraction | None:
    return Fraction(part, whole) if whole else None


def mean(values: list[Fraction | None]) -> Fraction | None:
    known = [v for v in values if v is not None]
    return sum(known, Fraction(0)) / len(known) if known else None


def added(each: list[list[Counts]]) -> list[Counts]:
    """Per episode and label -> per label."""
    return [[sum(one[label][c] for one in each) for c in range(3)] for label in range(3)]


def iou(counts: Counts) -> Fraction | None:
    return share(counts[0], sum(counts))


def scores(per_label: list[Counts]) -> dict[str, Fraction | None]:
    found: dict[str, Fraction | None] = {"mean-iou": mean([iou(c) for c in per_label])}
    for name, (hits, false, missed) in zip(("walkable", "sittable", "interactable"), per_label, strict=True):
        found[f"{name}/iou"] = share(hits, hits + false + missed)
        found[f"{name}/precision"] = share(hits, hits + false)
        found[f"{name}/recall"] = share(hits, hits + missed)
    return found


def metric(episodes: list[Episode]) -> dict[str, Fraction | None]:
    each = [[count(truth[k], yes(said[k]), ignored) for k in range(3)] for truth, said, ignored in episodes]
    return scores(added(each))


def scaled(answer: Plane, factor: float) -> Plane:
    rows, columns = len(answer), len(answer[0])
    out = [[False] * columns for _ in range(rows)]
    for i in range(rows):
        for j in range(columns):
            a = math.floor((i + 0.5 - rows / 2) / factor + rows / 2)
            b = math.floor((j + 0.5 - columns / 2) / factor + columns / 2)
            if 0 <= a < rows and 0 <= b < columns:
                out[i][j] = answer[a][b]
    return out


def scale_free(episodes: list[Episode]) -> dict[str, Fraction | None]:
    chosen = []
    for truth, said, ignored in episodes:
        best: tuple[Fraction, int, int] | None = None
        kept: list[Counts] = []
        for step in range(-20, 21):
            counts = [count(truth[k], scaled(yes(said[k]), 2.0 ** (step / 20)), ignored) for k in range(3)]
            value = mean([iou(c) for c in counts])
            rank = (Fraction(-1) if value is None else value, -abs(step), -step)
            if best is None or rank > best:
                best, kept = rank, counts
        chosen.append(kept)
    return scores(added(chosen))


def one_label(planes: list[Plane], i: int, j: int) -> str:
    walkable, sittable, interactable = (plane[i][j] for plane in planes)
    return "sittable" if sittable else "interactable" if interactable else "walkable" if walkable else "none"


def exclusive(episodes: list[Episode]) -> dict[str, Fraction | None]:
    pairs: Counter[tuple[str, str]] = Counter()
    for truth, said, ignored in episodes:
        answer = [yes(plane) for plane in said]
        for i, row in enumerate(ignored):
            for j, out in enumerate(row):
                if not out:
                    pairs[one_label(truth, i, j), one_label(answer, i, j)] += 1
    found = {
        f"{c}/iou": share(pairs[c, c], sum(number for pair, number in pairs.items() if c in pair)) for c in CLASSES
    }
    found["mean-iou"] = mean([found[f"{c}/iou"] for c in CLASSES[1:]])
    found["accuracy"] = share(sum(pairs[c, c] for c in CLASSES), sum(pairs.values()))
    return found
