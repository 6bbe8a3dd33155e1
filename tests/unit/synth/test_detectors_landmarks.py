"""Joints of COCO and BODY_25 on a body: against its mesh, and under turns and mirrors."""

from __future__ import annotations

import numpy as np
import pytest
from detector_people import BODY, person
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.geometry.transforms import apply, planar
from hsbench.schema.skeletons import BODY_25, COCO_18, KINECT_V2, SKELETONS, Skeleton
from hsbench.synth.detectors.landmarks import belonging, landmarks
from hsbench.synth.people import Body
from hsbench.synth.people.body import CAPSULE_JOINTS, J
from hsbench.synth.people.mesh import STEPS_PER_M, _asset
from hsbench.synth.people.regions import Region
from hsbench.synth.people.shapes import SHAPE_OF

HEADS = ("nose", "eye_left", "eye_right", "ear_left", "ear_right")


def rest(shape: str) -> tuple[Body, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A baked shape at rest: its body, joints (25, 3), vertices (V, 3) in metres, triangles and their regions."""
    stored = _asset()
    row = stored["shapes"].tolist().index(shape)
    size = float(np.clip(stored["statures"][row] / STEPS_PER_M, 1.55, 1.95))
    scale = size / float(stored["statures"][row])
    body = Body(size, SHAPE_OF[shape].girth, shape=shape)
    return (
        body,
        stored["joints"][row] * scale,
        stored["vertices"][row] * scale,
        stored["triangles_0"],
        stored["region_0"],
    )


@pytest.mark.parametrize("shape", sorted(SHAPE_OF))
def test_landmarks_lie_on_the_mesh(shape: str) -> None:
    body, joints, vertices, triangles, region = rest(shape)
    found = dict(zip(BODY_25.names, landmarks(BODY_25, body, joints[None])[0], strict=True))
    eyes = vertices[np.unique(triangles[region == Region.EYE])]
    shoes = vertices[np.unique(triangles[np.isin(region, [Region.SHOE, Region.SOLE])])]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        own = eyes[eyes[:, 0] * sign > 0] if joints[J["shoulder_left"], 0] > 0 else eyes[eyes[:, 0] * sign < 0]
        assert np.linalg.norm(found[f"eye_{side}"] - own.mean(axis=0)) < 0.02
        for name in ("big_toe", "small_toe", "heel"):
            assert np.linalg.norm(shoes - found[f"{name}_{side}"], axis=1).min() < 0.035, name
    near = vertices[np.linalg.norm(vertices - joints[J["head"]], axis=1) < 0.09 * body.stature_m]
    assert np.linalg.norm(found["nose"] - near[np.argmin(near[:, 1])]) < 0.025
    widest = np.abs(near[:, 0] - joints[J["head"], 0]).max()
    assert abs(abs(found["ear_left"][0] - joints[J["head"], 0]) - widest) < 0.025  # on the capsule


@pytest.mark.parametrize("skeleton", [s for s in SKELETONS.values() if s is not KINECT_V2], ids=lambda s: s.name)
def test_landmarks_of_a_mirror_image_are_the_mirror_image(skeleton: Skeleton) -> None:
    joints = person(1.0, 0.5, 0.3)
    flip = np.array([1.0, -1.0, 1.0])
    mirrored = landmarks(skeleton, BODY, joints[:, list(KINECT_V2.mirror)] * flip)
    expected = landmarks(skeleton, BODY, joints)[:, list(skeleton.mirror)] * flip
    np.testing.assert_allclose(mirrored, expected, atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(st.floats(-4, 4), st.floats(-4, 4), st.floats(-3.1, 3.1))
def test_landmarks_go_with_the_body(x: float, y: float, yaw: float) -> None:
    a_T_b, joints = planar(x, y, yaw), person(0.0, 0.0, 0.0)
    moved = landmarks(BODY_25, BODY, apply(a_T_b, joints))
    np.testing.assert_allclose(moved, apply(a_T_b, landmarks(BODY_25, BODY, joints)), atol=1e-9)


def test_face_and_feet_of_someone_upright_by_hand() -> None:
    found = dict(zip(BODY_25.names, landmarks(BODY_25, BODY, person(0.0, 0.0, 0.0))[0], strict=True))
    assert found["nose"][0] > found["eye_left"][0] > found["ear_left"][0]  # looks along +x
    assert found["eye_left"][1] > 0 > found["eye_right"][1]
    assert found["ear_left"][1] > found["eye_left"][1]
    assert found["big_toe_left"][0] > found["ankle_left"][0] > found["heel_left"][0]
    assert found["small_toe_left"][1] > found["big_toe_left"][1]
    assert found["small_toe_right"][1] < found["big_toe_right"][1]


def test_neck_and_hips_are_middles() -> None:
    found = dict(zip(BODY_25.names, landmarks(BODY_25, BODY, person(0.0, 0.0, 1.0))[0], strict=True))
    for middle, name in (("neck", "shoulder"), ("hip_mid", "hip")):
        np.testing.assert_allclose(found[middle], (found[f"{name}_left"] + found[f"{name}_right"]) / 2, atol=1e-12)


def test_limbs_are_the_kinects_and_hidden_by_other_parts_alone() -> None:
    joints = person(2.0, 1.0, 0.7)
    found = landmarks(COCO_18, BODY, joints)[0]
    belongs = belonging(COCO_18)
    for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle"):
        for side in ("left", "right"):
            j = COCO_18.index(f"{name}_{side}")
            assert np.array_equal(found[j], joints[0, J[f"{name}_{side}"]])
            assert [c for c in range(len(CAPSULE_JOINTS)) if belongs[c, j]] == [
                c for c, names in enumerate(CAPSULE_JOINTS) if f"{name}_{side}" in names
            ]
    assert not belongs[:, [COCO_18.index(n) for n in HEADS]].any()
    assert belonging(BODY_25).any(axis=0).sum() == 20
