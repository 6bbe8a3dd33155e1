"""Running a method of task scene-completion by its name."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hsbench.baselines import run
from hsbench.baselines.occlusion.methods import method
from hsbench.datasets.dataset import Dataset


def predict(
    name: str, data: Dataset, out: Path, *, train: Dataset | None = None, seed: int = 0, replace_out: bool = False
) -> Iterator[str]:
    """As ``hsbench.baselines.run.predict``. Raises DataError for an unknown method too, when the first is asked for."""
    yield from run.predict(method(name), data, out, train=train, seed=seed, replace_out=replace_out)
