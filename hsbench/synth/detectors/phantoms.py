"""False bodies: for a while a detector takes something for a person who stands there.

Where, does not depend on the scene: a phantom stands on the floor in a random direction and is seen, or not, as a
person would be there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hsbench.geometry.cameras import BrownCamera, PinholeCamera
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import cos_sin
from hsbench.schema.sensor import Sensor
from hsbench.synth.detectors.config import DetectorConfig
from hsbench.synth.detectors.losses import spells
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray, IntArray

DISTANCE_M = (1.5, 5.0)


class Phantoms(NamedTuple):
    """M rows at ascending times: time (M,), number of the phantom 1, 2, ... (M,), Kinect joints (M, 25, 3), bodies."""

    timestamp_ns: IntArray
    number: IntArray
    joints: FloatArray
    bodies: tuple[Body, ...]


def phantoms(times_ns: IntArray, sensor: Sensor, config: DetectorConfig, seeds: Seeds) -> Phantoms:
    """Phantoms in the episode frame at the detector's looks (T,)."""
    found: list[tuple[int, int]] = []
    if len(times_ns):
        rng = seeds.rng("times")
        found = spells(int(times_ns[0]), int(times_ns[-1]), config.phantoms_per_min, config.phantom_s, rng)
    looks, number, joints, bodies = [], [], [], []
    for k, (first_ns, last_ns) in enumerate(found, start=1):
        body, still = _phantom(sensor, seeds.rng(k))
        during = times_ns[(times_ns >= first_ns) & (times_ns < last_ns)]
        looks.append(during)
        number.append(np.full(len(during), k))
        joints.append(np.repeat(still[None], len(during), axis=0))
        bodies.append(body)
    stamps = np.concatenate([np.empty(0, dtype=np.int64), *looks])
    order = np.argsort(stamps, kind="stable")
    return Phantoms(
        stamps[order],
        np.concatenate([np.empty(0, dtype=np.int64), *number])[order],
        np.concatenate([np.empty((0, 25, 3)), *joints])[order],
        tuple(bodies),
    )


def _phantom(sensor: Sensor, rng: np.random.Generator) -> tuple[Body, FloatArray]:
    """A body and its (25, 3) joints."""
    body = Body.sample(rng)
    across, distance_m, yaw = rng.random(), float(quantise_m(rng.uniform(*DISTANCE_M))), rng.uniform(-math.pi, math.pi)
    camera = sensor.camera
    bearing = 2.0 * math.pi * across - math.pi
    if isinstance(camera, PinholeCamera | BrownCamera):
        bearing = math.atan(camera.rays_at(np.array([across * camera.width_px, camera.cy_px]))[0])
    c, s = cos_sin(bearing)
    at = quantise_m(np.array([c, -s]) * distance_m)
    return body, pose(body, standing(body, at, float(quantise_m(yaw))), 1, None)[0]
