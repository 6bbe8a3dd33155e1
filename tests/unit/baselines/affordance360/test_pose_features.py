"""Features of poses: the same wherever and whichever way a person stands, and angles that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.baselines.affordance360.pose_features import ANGLES, OFFSETS, pose_features
from hsbench.geometry.cameras import EquirectangularCamera
from hsbench.geometry.transforms import apply, planar
from hsbench.schema import KINECT_V2, PoseTable, Sensor
from hsbench.schema.skeletons import COCO_18
from tests.unit.baselines.lived_rooms import figure, seen

SPHERE = Sensor("equirectangular", EquirectangularCamera(4096, 2048), 1.5)
IN_PIXELS, IN_METRES = 13 * 2 + 8 + 2, 13 * 3 + 8 + 2


def metric(joints: np.ndarray) -> PoseTable:
    n = len(joints)
    state = np.where(np.isnan(joints).any(axis=-1), 0, 2).astype(np.uint8)
    stamps, tracks = np.arange(n, dtype=np.int64), np.ones(n, np.int32)
    return PoseTable(COCO_18.name, stamps, tracks, state, joints.astype(np.float32))


def bodies(rng: np.random.Generator, count: int = 5) -> np.ndarray:
    """(count, 18, 3) figures whose joints are moved about at random."""
    return np.stack([figure((2.0, 0.5)) + rng.normal(0.0, 0.05, (18, 3)) for _ in range(count)])


@given(st.integers(0, 999), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.1, 3.1))
def test_in_metres_place_and_heading_do_not_matter(seed: int, x: float, y: float, yaw: float) -> None:
    joints = bodies(np.random.default_rng(seed))
    here, there = (pose_features(metric(j), SPHERE) for j in (joints, apply(planar(x, y, yaw), joints)))
    assert here.shape == (5, IN_METRES)
    assert np.isfinite(here).all()
    assert here == pytest.approx(there, abs=2e-4)


@given(st.integers(0, 999), st.floats(-3.1, 3.1))
def test_in_pixels_the_direction_does_not_matter(seed: int, yaw: float) -> None:
    """All around a 360 camera, across the seam too; pixels are stored as float32."""
    joints = bodies(np.random.default_rng(seed))
    here, there = (pose_features(seen(SPHERE, j), SPHERE) for j in (joints, apply(planar(0, 0, yaw), joints)))
    assert here.shape == (5, IN_PIXELS)
    assert here == pytest.approx(there, abs=0.02)


def test_a_flat_figure_looks_in_pixels_as_it_is() -> None:
    """It faces the camera, and so does the plane: offsets are those of the figure, whatever its distance."""
    for distance in (1.5, 3.0, 6.0):
        joints = figure((distance, 0.0))[None]
        features = pose_features(seen(SPHERE, joints), SPHERE)[0]
        neck, hip = joints[0, COCO_18.index("neck")], joints[0, COCO_18.index("hip_left")]
        torso = neck[2] - hip[2]
        wrist = joints[0, COCO_18.index("wrist_left")] - neck
        at = 2 * (1 + 2 * OFFSETS.index("wrist"))
        assert features[at : at + 2] == pytest.approx([-wrist[1] / torso, wrist[2] / torso], abs=5e-3)  # x is right
        assert features[-2] == pytest.approx(torso / distance, abs=1e-3)
        assert features[-1] == pytest.approx((neck[2] - 1.5) / distance, abs=1e-3)


def test_angles_of_a_bent_knee_and_a_stretched_arm() -> None:
    joints = figure((2.0, 0.0))
    for name, at in {"hip": (0, 0, 1.0), "knee": (0.4, 0, 1.0), "ankle": (0.4, 0, 0.6)}.items():
        joints[COCO_18.index(f"{name}_left")] = at
    for name, at in {"shoulder": (0, 0, 1.4), "elbow": (0.3, 0, 1.4), "wrist": (0.6, 0, 1.4)}.items():
        joints[COCO_18.index(f"{name}_left")] = at
    features = pose_features(metric(joints[None]), SPHERE)[0]
    cosines = dict(zip([(a, side) for a in ANGLES for side in ("left", "right")], features[13 * 3 :], strict=False))
    assert cosines[("hip", "knee", "ankle"), "left"] == pytest.approx(0.0, abs=1e-6)
    assert cosines[("shoulder", "elbow", "wrist"), "left"] == pytest.approx(-1.0, abs=1e-6)
    assert cosines[("shoulder", "hip", "knee"), "left"] == pytest.approx(0.0, abs=1e-6)


def test_missing_joints_are_unknown_and_nothing_else() -> None:
    joints = np.repeat(figure((2.0, 0.5))[None], 3, axis=0)
    joints[1, COCO_18.index("wrist_left")] = np.nan
    joints[2] = np.nan
    features = pose_features(metric(joints), SPHERE)
    assert np.isfinite(features[0]).all()
    assert np.isnan(features[1]).sum() == 3 + 1  # its offset, and the angle of the elbow
    assert np.isnan(features[2]).all()
    assert pose_features(metric(joints[:0]), SPHERE).shape == (0, IN_METRES)


def test_another_skeleton_has_as_many_features() -> None:
    rng = np.random.default_rng(0)
    joints = rng.normal(0.0, 1.0, (4, 25, 3)).astype(np.float32)
    stamps, tracks = np.arange(4, dtype=np.int64), np.ones(4, np.int32)
    poses = PoseTable(KINECT_V2.name, stamps, tracks, np.full((4, 25), 2, np.uint8), joints)
    assert pose_features(poses, replace(SPHERE, height_m=None)).shape == (4, IN_METRES)
