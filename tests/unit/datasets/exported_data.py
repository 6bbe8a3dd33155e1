"""Small data sets that the exports are tested on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from episode_builders import SENSORS, events, motions, object_truth, scene

from hsbench import Dataset, load
from hsbench.datasets.importers.capture_set import add_capture
from hsbench.geometry.transforms import apply
from hsbench.io.frame_store import Film, Patch, Picture
from hsbench.schema import Episode, EpisodeTruth, PoseTable, TruePoseTable

OLD = Path(__file__).parents[2] / "fixtures" / "schema-0.2"
"""A recording, 360 pictures and activity maps, as an older version wrote them."""

STAMPS = np.array([0, 200_000_000, 900_000_000], dtype=np.int64)
PERSON = 60001
WINDOW = (slice(4, 12), slice(6, 11))
"""Rows and columns where the person is seen in the second frame."""


def filmed(path: Path, truth: bool = True) -> Dataset:
    """One RGB-D episode of three frames; a person, seen in the second, is observed and known at its very time."""
    sensor = SENSORS["rgbd"]
    rng = np.random.default_rng(11)
    room = Picture(
        rng.integers(0, 256, (18, 24, 3), dtype=np.uint8),
        rng.integers(500, 6000, (18, 24)).astype(np.uint16),
        rng.choice([0, 1, 4, 7], (18, 24)).astype(np.uint16),
    )

    def patch(index: int) -> Patch:
        shape = (8, 5) if index == 1 else (0, 0)
        seen = Picture(
            rng.integers(0, 256, (*shape, 3), dtype=np.uint8),
            np.full(shape, 1500, np.uint16),
            np.full(shape, PERSON, np.uint16),
        )
        return Patch(int(STAMPS[index]), 4, 6, np.ones(shape, bool), seen)

    patches = [patch(index) for index in range(3)]
    pixels = np.stack([np.linspace(4.25, 14.25, 25), np.linspace(2.5, 14.5, 25)], axis=-1)
    rays = np.column_stack([sensor.camera.rays_at(pixels)])
    joints = apply(sensor.world_T_camera, rays * 1.5)
    state = np.full((1, 25), 2, np.uint8)
    state[0, 3], state[0, 5] = 0, 1
    observed = joints.astype(np.float32)[None].copy()
    observed[0, 3] = np.nan
    at = STAMPS[1:2]
    true = PoseTable(
        "kinect-v2-25", at, np.array([1], np.int32), np.full((1, 25), 2, np.uint8), joints[None].astype("f4")
    )
    episode = Episode(
        "film-1",
        "filmed",
        sensor,
        Film(room, STAMPS, patches.__getitem__, 3, "kinect"),
        PoseTable("kinect-v2-25", at, np.array([5], np.int32), state, observed),
        0,
        int(STAMPS[-1]),
        truth=EpisodeTruth(
            scene(),
            TruePoseTable(true, np.array([1], np.uint8), np.array([0], np.int64)),
            events(),
            None,
            object_truth(),
            None,
            motions(),
        ),
    )
    add_capture(path, episode)
    return replace(load(path), truth=truth)
