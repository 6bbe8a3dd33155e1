"""A recipe of a page, outside the repository, whose units take milliseconds: random poses, and faults on demand."""

from __future__ import annotations

import json
from pathlib import Path

from hsbench.synth.generate import Job

CODE = """
import os
import sys
import time
from dataclasses import dataclass

import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.numerics import quantise_m
from hsbench.schema import Episode, PoseTable, Sensor
from hsbench.schema.episode import FrameList
from hsbench.synth.config import settings


@dataclass(frozen=True)
class Toy:
    poses: int = 200
    lasts_s: float = 0.0


def build(config, unit):
    toy = settings(Toy, config["toy"], "toy")
    if "TOY_LOG" in os.environ:
        with open(os.environ["TOY_LOG"], "a") as log:
            log.write(f"{unit.number} {resident_kb()}\\n")
    fault(unit.number)
    time.sleep(toy.lasts_s)
    rng, n = unit.seeds.rng("toy"), toy.poses
    joints = quantise_m(rng.uniform(-3, 3, (n, 25, 3))).astype(np.float32)
    stamps = np.arange(n, dtype=np.int64) * 100_000_000
    poses = PoseTable("kinect-v2-25", stamps, np.ones(n, np.int32), np.full((n, 25), 2, np.uint8), joints)
    sensor = Sensor("rgbd", PinholeCamera(24, 18, 20.0, 20.0, 12.0, 9.0), 1.5)
    yield Episode(f"toy-{unit.number:06d}", "toy", sensor, FrameList(), poses, 0, int(stamps[-1]))


def resident_kb():
    with open("/proc/self/status") as status:
        return next(line.split()[1] for line in status if line.startswith("VmRSS"))


def fault(number):
"""
NO_FAULT = "    pass\n"
SPLITS = {
    "dataset": "toy",
    "version": "v0",
    "status": "draft",
    "first_scene": {"train": 0, "val": 10000, "test-seen": 11000, "test-novel": 12000},
    "sizes": {
        "mini": {"train": 2, "val": 2, "test-seen": 1, "test-novel": 1},
        "small": {"train": 20, "val": 4, "test-seen": 3, "test-novel": 3},
        "full": {"train": 500, "val": 40, "test-seen": 30, "test-novel": 30},
    },
}


def write_toy(folder: Path, fault: str = NO_FAULT, settings: str = "") -> Path:
    """The recipe ``toy`` in a folder; fault: an indented body of ``fault(number)``; settings: lines of ``[toy]``."""
    recipe = folder / "toy"
    recipe.mkdir(parents=True)
    (recipe / "toy.py").write_text(CODE + fault)
    (recipe / "config.toml").write_text(f"[toy]\n{settings}")
    (recipe / "splits.json").write_text(json.dumps(SPLITS))
    return recipe


def toy_job(recipe: Path, count: int) -> Job:
    """The first so many training units."""
    return Job(str(recipe), 0, tuple((number, "train") for number in range(count)), "none", "raycast")
