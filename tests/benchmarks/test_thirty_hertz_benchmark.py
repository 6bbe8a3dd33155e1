"""Two minutes of two people at 30 pictures a second, from nothing to disk, on one process: seconds, and where they go.

python -m pytest -s -m slow tests/benchmarks/test_thirty_hertz_benchmark.py          (HSBENCH_EPISODES=6: more rooms)
"""

from __future__ import annotations

import cProfile
import os
import pstats
from pathlib import Path

import pytest

from hsbench.errors import HsbenchError
from hsbench.synth.executors import local
from hsbench.synth.generate import Job, make_units
from hsbench.synth.recipes import find_recipe
from hsbench.synth.render import open_renderer
from tests.conftest import WriteRecipe

pytestmark = pytest.mark.slow

GOAL_S = 150.0
STEPS = {
    "scene": ("rooms", "build_scene"),
    "life": ("life.py", "live"),
    "truth and poses": ("assemble.py", "filmed_episode"),
    "room at t0": ("moved_room.py", "_at_rest"),
    "windows around moved things": ("moved_room.py", "_put_together"),
    "people": ("film.py", "peopled"),
    "all of writing, pictures included": ("episodes.py", "write_episode"),
}
"""What is printed -> (end of the file's path, function); the time within it. Some lie within others."""


def seconds(profile: cProfile.Profile) -> dict[str, float]:
    rows = pstats.Stats(profile).stats.items()  # type: ignore[attr-defined]
    return {
        step: sum(row[3] for (file, _, name), row in rows if name == function and place in file)
        for step, (place, function) in STEPS.items()
    }


def test_two_minutes_at_thirty_hertz(tmp_path: Path, write_recipe: WriteRecipe) -> None:
    try:
        open_renderer("auto")
    except HsbenchError as error:
        pytest.skip(str(error))
    write_recipe(tmp_path / "rgbd-activity", {"life": {"people": 2}, "recording": {"frame_rate_hz": 30.0}})
    recipe = str(tmp_path / "rgbd-activity")
    units = find_recipe(recipe).splits.numbers("full", "val")[: int(os.environ.get("HSBENCH_EPISODES", "1"))]
    took_s = []
    for unit in units:
        profile = cProfile.Profile()
        profile.enable()
        (made,) = make_units(Job(recipe, 0, (unit,)), tmp_path / "data", local(1))
        profile.disable()
        assert made.error is None
        took_s.append(made.time_s)
        parts = ", ".join(f"{step} {s:.1f}" for step, s in seconds(profile).items())
        print(
            f"\n{made.episode_ids[0]}: {made.time_s:.0f} s under the profiler, {made.size_bytes / 1e6:.0f} MB; {parts}"
        )
    mean_s = sum(took_s) / len(took_s)
    print(f"{len(took_s)} episodes: mean {mean_s:.0f} s, longest {max(took_s):.0f} s; the goal is {GOAL_S:.0f} s")
