"""Scenes on which the published completion scorers were run; ``completion_scorers.json`` holds their answers.

A scene holds the arrays each scorer reads, in its own encoding: nothing here comes from hsbench. Bits of a Philox
generator are fixed for all times, so the scenes are too.
"""

from __future__ import annotations

import numpy as np

SHAPE = (6, 5, 8)
N_CLASSES = 12
UNLABELLED = 255
SETS = ("full", "holes")
NO_PIXEL = 640 * 480


def scenes(which: str) -> list[dict[str, np.ndarray]]:
    """Scenes of a set: in "full" every class occurs; "holes" has absent classes and empty scenes."""
    return [_scene(which, number) for number in range(5)]


def _scene(which: str, number: int) -> dict[str, np.ndarray]:
    stream = np.random.Philox(1000 * SETS.index(which) + number)

    def draw(*values: float) -> np.ndarray:
        raw = stream.random_raw(int(np.prod(SHAPE))).reshape(SHAPE) >> np.uint64(33)
        return np.array(values)[(raw % np.uint64(len(values))).astype(int)]

    present = range(1, N_CLASSES) if which == "full" else (1, 2, 3, 5, 8, 10)
    label = draw(*[0] * 6, *present, UNLABELLED, UNLABELLED).astype(np.int64)
    other = draw(*[0] * 6, *(range(1, N_CLASSES) if which == "full" else (1, 2, 3, 4, 5, 8))).astype(np.int64)
    prediction = np.where((draw(0, 0, 1) == 0) & (label != UNLABELLED), label, other)
    if which == "holes" and number == 1:
        prediction[:] = 0
    if which == "holes" and number == 2:
        label[label != UNLABELLED] = 0
    if which == "holes" and number == 3:
        label[label != UNLABELLED] = 0
        prediction[:] = 0
    vol = draw(1, 1, -1, -1, -1, 0, 0.25, -0.5, 0.75, -2, -3, -4, -5)
    tsdf = draw(0.001, 0.001, 1, 1, -0.001, -0.001, 0, -0.4, 0.5).astype(np.float32)
    return {
        "label": label,
        "prediction": prediction,
        "vol": vol,
        "tsdf": tsdf,
        "label_weight": draw(0, 1, 1, 1).astype(np.float32) * (label != UNLABELLED),
        "mapping": np.where(draw(0, 1, 1) == 0, np.arange(label.size).reshape(SHAPE), NO_PIXEL).astype(np.int64),
        "invalid": draw(0, 0, 0, 1).astype(np.uint8),
    }


def downsample_blocks() -> np.ndarray:
    """(16, 24, 16) uint8 labels: blocks of 4 x 4 x 4 with ties, majorities and few or many labels."""
    raw = np.random.Philox(77).random_raw(16 * 24 * 16).reshape(16, 24, 16) >> np.uint64(33)
    kind = np.random.Philox(78).random_raw(4 * 6 * 4).reshape(4, 6, 4) >> np.uint64(33)
    tables = (
        [0, 255],
        [0, 0, 0, 255],
        [0, 255, 255],
        [0] * 20 + [255] * 20 + [5],
        [0] * 12 + [7, 9],
        [3, 7, 36],
        [255] * 30 + [1, 2],
        [0],
    )
    labels = np.zeros(raw.shape, dtype=np.uint8)
    for i in np.ndindex(kind.shape):
        table = np.array(tables[int(kind[i]) % 8])
        block = tuple(slice(4 * k, 4 * k + 4) for k in i)
        labels[block] = table[(raw[block] % np.uint64(len(table))).astype(int)]
        if int(kind[i]) % 8 == 0:  # a tie
            labels[block] = np.where(np.arange(64).reshape(4, 4, 4) % 2 == 0, 0, 255)
    return labels
