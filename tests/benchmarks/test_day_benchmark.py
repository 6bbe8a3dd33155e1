"""A day of three people at 30 Hz, streamed: peak memory after ten minutes and after 24 hours, and times real time.

python -m pytest -q -s -m slow tests/benchmarks/test_day_benchmark.py
"""

from __future__ import annotations

import resource
import time

import pytest

from hsbench.synth.activities import LifeConfig, stream
from hsbench.synth.seeds import Seeds
from hsbench.synth.survey import drawn_scene

pytestmark = pytest.mark.slow

DAY_S, BLOCKS_OF_TEN_MINUTES = 86400.0, 10
HOME = 2  # of the scene survey: a flat


def memory_mb() -> float:
    """The most this process has held so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def test_a_day_takes_the_memory_of_ten_minutes() -> None:
    scene = drawn_scene(HOME, 0)
    config = LifeConfig(duration_s=DAY_S, people=3, mode="natural", start_hour=8.0)
    began_s, peaks, poses = time.process_time(), [], 0
    for piece in stream(scene, Seeds(0).child("day"), config):
        peaks.append(memory_mb())
        poses += len(piece.poses)
    computing_s = time.process_time() - began_s
    assert poses > 0
    print(f"\n{poses:,} poses in {computing_s:.0f} s of computing, {DAY_S / computing_s:.0f}x real time; ", end="")
    print(f"peak memory {peaks[BLOCKS_OF_TEN_MINUTES - 1]:.0f} MB after ten minutes, {peaks[-1]:.0f} after a day")
