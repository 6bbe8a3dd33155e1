"""A submission with answers at earlier times read and scored over time, in plain steps, from docs/tasks/index.md and
docs/metrics/curves.md alone. Nothing of the package is used.

Rules, as the text gives them: the answer after the first s seconds is ``predictions/EPISODE@<s>s.npz``, after the whole
observation ``predictions/EPISODE.npz``. From its end on an episode has its whole answer, so that each point is of the
same episodes. Between two points the curve is straight over log time; its area is divided by the length of that axis.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np


def answer(folder: Path, episode_id: str, array: str, seconds: float | None) -> list:
    """The array of a prediction file as nested lists; seconds: None after the whole observation."""
    moment = "" if seconds is None else f"@{seconds:g}s"
    with zipfile.ZipFile(folder / "predictions" / f"{episode_id}{moment}.npz") as file:
        return np.lib.format.read_array(io.BytesIO(file.read(f"{array}.npy")), allow_pickle=False).tolist()


def answers(folder: Path, lasts_s: Mapping[str, float], array: str, seconds: float | None) -> dict[str, list]:
    """What counts after so many seconds, of every episode. lasts_s: how long each goes on."""
    return {
        episode_id: answer(folder, episode_id, array, None if seconds is None or seconds >= last_s else seconds)
        for episode_id, last_s in lasts_s.items()
    }


def area(points: list[tuple[float, float]]) -> float:
    """points: (seconds, score), ascending."""
    total = 0.0
    for (a, low), (b, high) in pairwise(points):
        total += (math.log(b) - math.log(a)) * (low + high) / 2
    return total / (math.log(points[-1][0]) - math.log(points[0][0]))
