"""A process that films scene after scene, none of them twice, keeps nothing of those that are done."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from hsbench.io.dataset_index import EPISODES_FOLDER
from hsbench.synth.executors import Processes, in_order
from hsbench.synth.generate import Job, make_unit
from hsbench.synth.recipes import find_recipe
from tests.conftest import WriteRecipe

SHORT: dict[str, dict[str, dict[str, object]]] = {
    "rgbd-activity": {
        "life": {"duration_s": 3.0},
        "camera": {"width_px": 64, "height_px": 48, "focal_px": 45.2},
        "recording": {"grid_shape": [32, 32, 12], "voxel_m": 0.2},
    },
    "timelapse-activity": {
        "life": {"duration_s": 120.0},
        "camera": {"width_px": 64, "height_px": 48, "focal_px": 38.0},
        "timelapse": {"people": [1, 2]},
    },
}
"""Settings by which a unit takes less than a second; everything that is part of one is still done."""

FROM, TO, MOST_GROWTH = 50, 500, 0.05


def filmed(home: Path, unit: tuple[str, int]) -> float:
    """Make a unit of a recipe, (name, scene number); MB of memory that the process then has."""
    name, number = unit
    job = Job(str(home / name), 0, ((number, "train"),))
    make_unit(job, (number, "train"), home, find_recipe(job.recipe).sha256)
    status = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in status if line.startswith("VmRSS")) / 1024


@pytest.mark.slow
def test_memory_of_filming_does_not_grow(tmp_path: Path, write_recipe: WriteRecipe) -> None:
    """Less than 5 % from the 50th to the 500th unit of one process, RGB-D and time-lapse in turn, in new rooms."""
    (tmp_path / EPISODES_FOLDER).mkdir()
    for name, changes in SHORT.items():
        write_recipe(tmp_path / name, changes)
    units = [(name, number) for number in range(TO // len(SHORT)) for name in SHORT]
    resident_mb = list(in_order(Processes(1, recycled_after=TO), partial(filmed, tmp_path), units))
    growth = resident_mb[TO - 1] / resident_mb[FROM - 1] - 1
    print(f"\nmemory of filming: {', '.join(f'{mb:.0f}' for mb in resident_mb[9::10])} MB after every 10th unit")
    print(f"growth from unit {FROM} to {TO}: {100 * growth:+.1f} %, at most {100 * MOST_GROWTH:.0f} %")
    assert growth < MOST_GROWTH
