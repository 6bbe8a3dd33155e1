"""Task scene-reconstruction-360 scored slowly, in plain loops, from the text alone. Nothing of the package is used.

Rules, as the text gives them: labels 0 none, 1 walkable, 2 sittable, 3 interactable, 4 wall; the score is the mean of
the four IoU, counted over all episodes, ignored voxels left out. Sittable, interactable and wall are solid: their IoU
against true solids, and the shares of the faces between solid and free within 10 cm of a face of the other side.
Scale-free: the answer scaled about the origin of the frame by the best of 41 factors of the episode.

Truth, as the text gives it: surfaces are extruded to the floor, floor and walls are one voxel thick, and where volumes
meet sittable goes before interactable before wall before walkable.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

Cell = tuple[int, int, int]
NAMES = {1: "walkable", 2: "sittable", 3: "interactable", 4: "wall"}


@dataclass(frozen=True)
class Episode:
    """Labels by voxel on both sides, true solids, ignored voxels; all voxels i, j, k of the shape have one."""

    shape: Cell
    origin: tuple[float, float, float]  # minimum corner, in voxels
    truth: dict[Cell, int]
    solid: set[Cell]
    ignored: set[Cell]
    said: dict[Cell, int]


def cells(shape: Cell) -> list[Cell]:
    return [(i, j, k) for i in range(shape[0]) for j in range(shape[1]) for k in range(shape[2])]


def share(part: int, whole: int) -> Fraction | None:
    return Fraction(part, whole) if whole else None


def mean(values: list[Fraction | None]) -> Fraction | None:
    known = [v for v in values if v is not None]
    return sum(known, Fraction(0)) / len(known) if known else None


def pairs(episode: Episode, said: dict[Cell, int]) -> list[tuple[int, int]]:
    return [(episode.truth[c], said[c]) for c in cells(episode.shape) if c not in episode.ignored]


def scores(both: list[tuple[int, int]]) -> dict[str, Fraction | None]:
    found: dict[str, Fraction | None] = {}
    for label, name in NAMES.items():
        hits = sum(t == a == label for t, a in both)
        true, answered = sum(t == label for t, _ in both), sum(a == label for _, a in both)
        found[f"{name}/iou"] = share(hits, true + answered - hits)
        found[f"{name}/precision"] = share(hits, answered)
        found[f"{name}/recall"] = share(hits, true)
    found["mean-iou"] = mean([found[f"{name}/iou"] for name in NAMES.values()])
    return found


def volumes(episodes: list[Episode]) -> dict[str, Fraction | None]:
    return scores([pair for e in episodes for pair in pairs(e, e.said)])


def scaled(episode: Episode, factor: float) -> dict[Cell, int]:
    out = {}
    for cell in cells(episode.shape):
        from_ = tuple(math.floor((i + 0.5 + low) / factor - low) for i, low in zip(cell, episode.origin, strict=True))
        out[cell] = episode.said.get(from_, 0)
    return out


def scale_free(episodes: list[Episode]) -> dict[str, Fraction | None]:
    chosen: list[tuple[int, int]] = []
    for episode in episodes:
        best: tuple[Fraction, int, int] | None = None
        kept: list[tuple[int, int]] = []
        for step in range(-20, 21):
            both = pairs(episode, scaled(episode, 2.0 ** (step / 20)))
            value = scores(both)["mean-iou"]
            rank = (Fraction(-1) if value is None else value, -abs(step), -step)
            if best is None or rank > best:
                best, kept = rank, both
        chosen += kept
    return scores(chosen)


def occupancy(episodes: list[Episode]) -> dict[str, Fraction | None]:
    hits = false = missed = 0
    for e in episodes:
        for c in cells(e.shape):
            if c in e.ignored:
                continue
            said, true = e.said[c] in (2, 3, 4), c in e.solid
            hits, false, missed = hits + (said and true), false + (said and not true), missed + (true and not said)
    return {
        "iou": share(hits, hits + false + missed),
        "precision": share(hits, hits + false),
        "recall": share(hits, hits + missed),
    }


def faces(shape: Cell, is_solid: Callable[[Cell], bool]) -> list[tuple[int, int, int]]:
    """Middles of faces between solid and free, in half voxels."""
    out = []
    for c in cells(shape):
        for axis in range(3):
            d = tuple(c[a] + (a == axis) for a in range(3))
            if d[axis] < shape[axis] and is_solid(c) != is_solid(d):
                out.append(tuple(2 * c[a] + (2 if a == axis else 1) for a in range(3)))
    return out


def surface(episodes: list[Episode], near_voxels: int = 2) -> dict[str, Fraction | None]:
    counts = [0, 0, 0, 0]
    for e in episodes:
        true = faces(e.shape, lambda c, e=e: c in e.solid and c not in e.ignored)
        said = faces(e.shape, lambda c, e=e: e.said[c] in (2, 3, 4) and c not in e.ignored)
        limit = (2 * near_voxels) ** 2
        for own, other, at in ((said, true, 0), (true, said, 2)):
            counts[at] += sum(any(math.dist(p, q) ** 2 <= limit + 0.5 for q in other) for p in own)
            counts[at + 1] += len(own)
    accuracy, completeness = share(counts[0], counts[1]), share(counts[2], counts[3])
    both = (accuracy or Fraction(0)) + (completeness or Fraction(0))
    f = 2 * (accuracy or Fraction(0)) * (completeness or Fraction(0)) / both if both else Fraction(0)
    return {"accuracy": accuracy, "completeness": completeness, "f-score": f if counts[1] + counts[3] else None}


def extruded(
    shape: Cell, walk: set[Cell], sit: set[Cell], use: set[Cell], walls: set[Cell], inside: set[tuple[int, int]]
) -> dict[Cell, int]:
    """Labels from labelled surfaces, the voxels of walls, and the columns inside rooms; the floor is layer 0."""
    out = {}
    for i, j, k in cells(shape):
        above = [(i, j, z) for z in range(k, shape[2])]
        beside = [(i + 1, j, k), (i - 1, j, k), (i, j + 1, k), (i, j - 1, k)]
        facing = any(b[:2] in inside and b not in walls for b in beside)
        if any(c in sit for c in above):
            out[i, j, k] = 2
        elif any(c in use for c in above):
            out[i, j, k] = 3
        elif (i, j, k) in walls and facing:
            out[i, j, k] = 4
        else:
            out[i, j, k] = int(k == 0 and (i, j, k) in walk)
    return out
