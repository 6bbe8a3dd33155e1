"""Splits: which scene belongs where. ``splits/<data set>/<version>.json``, append-only once released.

A scene number alone decides its split, in every data set: ranges of numbers are shared, so no scene can be
in training here and in test there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hsbench.errors import DataError
from hsbench.io.resources import resource
from hsbench.io.strict_json import read_json

SPLITS = ("train", "val", "test-seen", "test-novel")


@dataclass(frozen=True)
class Splits:
    """Scene numbers of a data set: ``scenes[size][split]`` is (first, count); ``status`` is draft or released."""

    dataset: str
    version: str
    status: str
    scenes: dict[str, dict[str, tuple[int, int]]]

    def numbers(self, size: str, split: str | None = None) -> list[tuple[int, str]]:
        """(scene number, split) of a size, of one split or of all in the order of ``SPLITS``.

        Raises DataError for an unknown size or split.
        """
        if size not in self.scenes:
            raise DataError(f"size {size!r} is unknown; expected one of {', '.join(self.scenes)}")
        if split is not None and split not in SPLITS:
            raise DataError(f"split {split!r} is unknown; expected one of {', '.join(SPLITS)}")
        chosen = SPLITS if split is None else (split,)
        ranges = self.scenes[size]
        return [(ranges[name][0] + k, name) for name in chosen for k in range(ranges[name][1])]


def read_splits(dataset: str, version: str = "v0") -> Splits:
    """The splits of a data set. Raises DataError if there are none or the file is damaged."""
    return splits_in(resource("splits") / dataset / f"{version}.json")


def splits_in(path: Path) -> Splits:
    """The splits that a file tells. Raises DataError where it is missing or damaged."""
    value = read_json(path)
    try:
        first = value["first_scene"]
        return Splits(
            value["dataset"],
            value["version"],
            value["status"],
            {
                size: {name: (int(first[name]), int(counts[name])) for name in SPLITS}
                for size, counts in value["sizes"].items()
            },
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise DataError(
            f"{path}: {type(error).__name__} on {error}; expected dataset, version, status, first_scene, sizes"
        ) from error
