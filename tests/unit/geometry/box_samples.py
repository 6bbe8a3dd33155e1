"""Boxes for the tests of boxes: random ones, the same ones moved, and rows of rational boxes."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def upright(rng: np.random.Generator, n: int, spread_m: float = 2.0) -> np.ndarray:
    """(n, 7) random upright boxes."""
    yaw = rng.uniform(-np.pi, np.pi, n)
    return np.column_stack([rng.uniform(-spread_m, spread_m, (n, 3)), rng.uniform(0.05, 3.0, (n, 3)), yaw])


def oriented(rng: np.random.Generator, n: int, spread_m: float = 1.0) -> np.ndarray:
    """(n, 15) random oriented boxes."""
    rotation = Rotation.random(n, random_state=int(rng.integers(2**31))).as_matrix()
    return rows(rng.uniform(-spread_m, spread_m, (n, 3)), rng.uniform(0.05, 3.0, (n, 3)), rotation)


def rows(centre: np.ndarray, size: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """(n, 3), (n, 3), (n, 3, 3) -> (n, 15)."""
    return np.column_stack([centre, size, rotation.reshape(-1, 9)])


def row(box) -> np.ndarray:
    """A rational box (centre, size, rotation) -> (1, 15)."""
    return np.array([[float(x) for part in (box[0], box[1], *box[2]) for x in part]])


def turned(boxes: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """(n, 15) boxes, each turned about its own centre by a (3, 3) rotation of the world."""
    return np.column_stack([boxes[:, :6], (rotation @ boxes[:, 6:].reshape(-1, 3, 3)).reshape(-1, 9)])


def moved(boxes: np.ndarray, rotation: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """(n, 15) boxes after a rigid motion of the world."""
    boxes = turned(boxes, rotation)
    boxes[:, :3] = boxes[:, :3] @ rotation.T + shift
    return boxes
