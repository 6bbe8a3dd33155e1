"""A small task and sound submissions to it, for the tests of this folder."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hsbench.errors import SchemaError
from hsbench.io.arrays import ArraySpec
from hsbench.submission import Metadata, PredictionFormat, write_submission


def encode(prediction: np.ndarray) -> dict[str, np.ndarray]:
    if prediction.shape != (2, 3):
        raise SchemaError(f"prediction has shape {prediction.shape}; expected (2, 3)")
    return {"occupied": prediction.astype(np.uint8), "score": np.ones(2, np.float32)}


def decode(arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    return arrays["occupied"] > 0


FORMAT = PredictionFormat(
    ".npz", {"occupied": ArraySpec((2, 3), "uint8"), "score": ArraySpec((None,), "float32")}, encode, decode
)


@dataclass(frozen=True)
class Task:
    name: str = "toy"
    version: str = "0"
    tracks: tuple[str, ...] = ("poses", "frames")
    observation_times_s: tuple[float, ...] = (5.0, 15.0, 120.0)
    prediction: PredictionFormat = FORMAT


TASK = Task()
METADATA = Metadata(task="toy", task_version="0", method="all free", track="poses")
EPISODES = ["ep-1", "ep-2", "ep-3"]
GRID = np.array([[1, 0, 1], [0, 0, 1]], dtype=bool)


def sound(path: Path, episodes: list[str] = EPISODES) -> Path:
    """A submission without a fault, as a folder."""
    write_submission(path, TASK, METADATA, ((episode, GRID) for episode in episodes))
    return path


def as_zip(folder: Path) -> Path:
    """The same as a zip beside it."""
    target = folder.with_suffix(".zip")
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(folder.rglob("*")):
            archive.write(file, file.relative_to(folder).as_posix())
    return target
