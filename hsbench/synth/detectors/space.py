"""Joints in metres as a depth camera's body tracker answers them: errors that drift, and a jitter from look to look."""

from __future__ import annotations

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.schema.poses import JointState
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.detectors.config import DetectorConfig
from hsbench.synth.detectors.drift import drifting
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray, IntArray, UInt8Array

JITTER_M = {
    "spine_base": 0.00015, "spine_mid": 0.00015, "neck": 0.00015, "head": 0.00015, "shoulder": 0.00015,
    "elbow": 0.00035, "wrist": 0.0009, "hand": 0.0014, "hip": 0.00015, "knee": 0.00035, "ankle": 0.00035,
    "foot": 0.0006, "spine_shoulder": 0.00015, "hand_tip": 0.0027, "thumb": 0.0044,
}  # fmt: skip
"""Standard deviation of a coordinate of a Kinect v2's tracked joint from look to look, next to the camera: median of
five recordings of LabanotationSuite (MIT) and KIMORE and of three people of NTU RGB+D, from second differences (their
median absolute deviation, so that motion counts little), with the growth of ``DetectorConfig.doubled_at_m`` taken out.
"""


def displaced(
    joints: FloatArray, depth_m: FloatArray, state: UInt8Array, timestamp_ns: IntArray, config: DetectorConfig,
    seeds: Seeds,
) -> FloatArray:  # fmt: skip
    """(N, 25, 3) true joints of one body, (N, 25) their depths -> (N, 25, 3) what the detector answers, same frame."""
    growth = (1.0 + (quantise_m(depth_m) / config.doubled_at_m) ** 2)[..., None]
    names = (n.removesuffix("_left").removesuffix("_right") for n in KINECT_V2.names)
    jitter = config.jitter * np.array([JITTER_M[n] for n in names])[:, None]
    white = seeds.rng("jitter").standard_normal(joints.shape)
    columns = joints.shape[1] * joints.shape[2]
    drift = drifting(timestamp_ns, columns, config.drift_s, seeds.rng("drift")).reshape(joints.shape)
    inferred = (state == JointState.INFERRED)[..., None]
    return joints + np.where(inferred, config.inferred_m, config.tracked_m * growth) * drift + jitter * growth * white
