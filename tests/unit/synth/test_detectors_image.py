"""Errors and cells of a detector in pixels: closed forms, and what they do not depend on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from detector_people import BODY, SENSOR, SPHERE, detect, person, still, table
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import BrownCamera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.schema import JointState, PoseTable, Sensor
from hsbench.schema.skeletons import BODY_25, COCO_18
from hsbench.synth.detectors import PRESETS, DetectorConfig
from hsbench.synth.detectors.image import ROOT_AREA, SIGMAS, patch_axes, pixels, seen_in_patch, shares
from hsbench.synth.detectors.landmarks import landmarks

EXACT = replace(PRESETS["clean"], skeleton="coco-18")
LENS = Sensor(
    "monocular", BrownCamera(640, 480, 330.0, 330.0, 320.0, 240.0, -0.2, 0.04, 0.001, 0.0, -0.0035), 1.5, 0.15
)
LEVEL = Sensor("monocular", PinholeCamera(1280, 960, 900.0, 900.0, 640.0, 480.0), 1.0)


def true_pixels(sensor: Sensor, joints: np.ndarray, skeleton: object = COCO_18) -> np.ndarray:
    points = landmarks(skeleton, BODY, joints)
    return sensor.camera.project(apply(invert(sensor.world_T_camera), points))[0]


@pytest.mark.parametrize("sensor", [SENSOR, LENS, SPHERE], ids=["pinhole", "lens", "sphere"])
@pytest.mark.parametrize("skeleton", [COCO_18, BODY_25], ids=lambda s: s.name)
def test_a_clean_detector_gives_the_projection(sensor: Sensor, skeleton: object) -> None:
    poses = still(3, 2.5, -0.4, 2.0)
    observed, match = detect(poses, replace(EXACT, skeleton=skeleton.name), sensor=sensor)
    assert observed.joints_m is None
    assert observed.skeleton == skeleton.name
    expected = true_pixels(sensor, poses.joints_m.astype(np.float64), skeleton)[match]
    seen = observed.joint_state != JointState.MISSING
    assert seen.mean() > 0.9
    np.testing.assert_allclose(observed.joints_px[seen], expected[seen], atol=0.03)  # .1 mm and .01 px


@settings(max_examples=30, deadline=None)
@given(st.floats(-np.pi, np.pi), st.floats(0.5, 6.0), st.floats(-1.0, 1.0))
def test_patches_of_a_sphere_and_back(bearing: float, distance: float, height: float) -> None:
    middle = np.array([[distance * np.sin(bearing), height, distance * np.cos(bearing)]])
    axes = patch_axes(SPHERE, middle)
    np.testing.assert_allclose(axes[0] @ axes[0].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes[0]) == pytest.approx(1.0)
    assert axes[0, 0, 1] == 0  # right is level
    points = middle[:, None] + np.array([[0.0, 0.0, 0.0], [0.1, 0.2, 0.05]]) * distance
    place, depth = seen_in_patch(SPHERE, axes, points)
    np.testing.assert_allclose(place[0, 0], 0, atol=1e-9)
    assert depth[0, 0] == pytest.approx(np.linalg.norm(middle))
    expected = SPHERE.camera.project(points)[0]
    apart = np.abs(pixels(SPHERE, axes, place) - expected)
    apart[..., 0] = np.minimum(apart[..., 0], 2048 - apart[..., 0])
    assert apart.max() < 0.02


@pytest.mark.parametrize("distance", [1.5, 3.0, 6.0])
def test_errors_are_a_share_of_the_size(distance: float) -> None:
    """Standard deviation = annotators x sigma / sqrt 2 x root of the area, in pixels at the person's distance."""
    poses = still(4000, distance)
    observed, _ = detect(poses, replace(EXACT, annotators=2.0), sensor=LEVEL)
    size_px = LEVEL.camera.fx_px * BODY.stature_m / distance
    error = observed.joints_px - true_pixels(LEVEL, poses.joints_m.astype(np.float64))
    tracked = (observed.joint_state == JointState.TRACKED).all(axis=0)
    assert tracked.sum() >= 8
    for j in np.flatnonzero(tracked):
        name = COCO_18.names[j].removesuffix("_left").removesuffix("_right")
        expected = 2.0 * SIGMAS[name] / np.sqrt(2) * ROOT_AREA * size_px
        assert error[:, j].std() == pytest.approx(expected, rel=0.05)
        assert abs(error[:, j].mean()) < 4 * expected / np.sqrt(4000)


@pytest.mark.parametrize("cells", [23, 46])
def test_answers_are_centres_of_cells(cells: int) -> None:
    """Errors are even over a cell, whose side is the person's size over the number of cells."""
    poses = still(4000)
    observed, _ = detect(poses, replace(EXACT, cells=cells), sensor=LEVEL)
    step_px = LEVEL.camera.fx_px * BODY.stature_m / 3.0 / cells
    error = observed.joints_px - true_pixels(LEVEL, poses.joints_m.astype(np.float64))
    seen = observed.joint_state != JointState.MISSING
    assert np.abs(error[seen]).max() <= step_px / 2 + 0.02
    assert error[seen].std() == pytest.approx(step_px / np.sqrt(12), rel=0.03)
    lattice = (observed.joints_px - observed.joints_px[:, :1]) / step_px
    assert np.abs(lattice[seen] - np.round(lattice[seen])).max() < 0.02 / step_px * 2


def similarity(poses: PoseTable, observed: PoseTable, match: np.ndarray) -> np.ndarray:
    """(M, J) COCO's object keypoint similarity of each joint of one who stands 3 m before ``LEVEL``, NaN missing."""
    root_area_px = ROOT_AREA * LEVEL.camera.fx_px * BODY.stature_m / 3.0
    sigma = np.array([SIGMAS[n.removesuffix("_left").removesuffix("_right")] for n in COCO_18.names])
    apart = ((observed.joints_px - true_pixels(LEVEL, poses.joints_m.astype(np.float64))[match]) ** 2).sum(axis=-1)
    return np.exp(-apart / (2 * (2 * sigma) ** 2 * root_area_px**2))


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_object_keypoint_similarity_has_its_closed_form(factor: float) -> None:
    """With errors of f annotators, OKS is 1 / (1 + f^2 / 8) on average: COCO's falls off at two sigmas."""
    poses = still(4000)
    observed, match = detect(poses, replace(EXACT, annotators=factor), sensor=LEVEL)
    tracked = observed.joint_state == JointState.TRACKED
    assert similarity(poses, observed, match)[tracked].mean() == pytest.approx(1 / (1 + factor**2 / 8), abs=0.012)


def test_openpose_like_has_the_published_precision() -> None:
    """COCO test-dev: AP .618, at OKS .5 .849, at .75 .675 (Cao, Simon, Wei, Sheikh, CVPR 2017, "CMU-Pose").

    Detections here carry no score: were the right ones ranked first, AP at a threshold is recall. Looks are 10 s apart.
    """
    poses = still(6000, every_ns=10_000_000_000)
    observed, match = detect(poses, replace(PRESETS["openpose-like"], bursts_per_min=0.0), sensor=LEVEL, seed=3)
    real = match >= 0
    visible = (detect(poses.until(0), EXACT, sensor=LEVEL)[0].joint_state == JointState.TRACKED)[0]
    scores = np.nan_to_num(similarity(poses, observed.select(real), match[real]))[:, visible].mean(axis=1)
    recall = {percent: (scores > percent / 100).sum() / len(poses) for percent in range(50, 100, 5)}
    assert recall[50] == pytest.approx(0.849, abs=0.02)
    assert recall[75] == pytest.approx(0.675, abs=0.02)
    assert np.mean(list(recall.values())) == pytest.approx(0.618, abs=0.02)


def test_errors_of_a_body_rise_and_fall_together() -> None:
    poses = still(4000, every_ns=10_000_000_000)
    observed, match = detect(poses, replace(EXACT, annotators=1.0, uneven=0.7), sensor=LEVEL)
    error = observed.joints_px - true_pixels(LEVEL, poses.joints_m.astype(np.float64))[match]
    sigma = shares(COCO_18) * LEVEL.camera.fx_px * BODY.stature_m / 3.0
    joints = np.flatnonzero((observed.joint_state == JointState.TRACKED).all(axis=0))
    sizes = ((error[:, joints] / sigma[joints, None]) ** 2).mean(axis=(1, 2))
    spread = np.log(sizes).var() - 2 / (2 * len(joints))  # the log of a mean of n squares has variance 2 / n
    assert np.sqrt(spread) / 2 == pytest.approx(0.7, rel=0.06)
    assert np.median(sizes) == pytest.approx(1.0, rel=0.12)


def test_pixels_scale_with_focal_length() -> None:
    config = replace(PRESETS["openpose-like"], phantoms_per_min=0.0)
    poses = still(300, 3.0, 0.3, 2.5)
    wide = Sensor("monocular", PinholeCamera(640, 480, 450.0, 450.0, 320.0, 240.0), 1.0)
    (small, _), (large, _) = (detect(poses, config, sensor=s) for s in (wide, LEVEL))
    assert np.array_equal(small.joint_state, large.joint_state)
    both = small.joint_state != JointState.MISSING
    inside = both & (small.joints_px > 1).all(axis=-1) & (small.joints_px < (639, 479)).all(axis=-1)
    np.testing.assert_allclose(2 * small.joints_px[inside], large.joints_px[inside], atol=0.03)


def test_a_turn_about_a_sphere_shifts_its_pixels() -> None:
    """Turning people about the camera by k columns moves every answer by k columns, round the image."""
    config = replace(PRESETS["openpose-like"], phantoms_per_min=0.0)
    joints = still(200, 2.0, 0.7, 0.4).joints_m.astype(np.float64)
    base, _ = detect(table(joints), config, sensor=SPHERE)
    for columns in (256, 900, 1500):
        turned = apply(planar(0.0, 0.0, -2 * np.pi * columns / 2048), joints)
        observed, _ = detect(table(turned), config, sensor=SPHERE)
        assert np.array_equal(observed.timestamp_ns, base.timestamp_ns)
        same = (observed.joint_state == base.joint_state).mean()
        assert same > 0.99  # but where rounding to .1 mm decides
        shift = np.abs((observed.joints_px - base.joints_px)[..., 0] - columns)
        apart = np.minimum(shift % 2048, 2048 - shift % 2048)
        assert np.nanquantile(apart, 0.99) < 0.3
        assert np.nanquantile(np.abs((observed.joints_px - base.joints_px)[..., 1]), 0.99) < 0.3


@pytest.mark.parametrize(("sensor", "away"), [(SENSOR, 1.2), (LENS, 0.8)], ids=["pinhole", "lens"])
def test_joints_outside_the_image_are_missing_and_answers_are_inside(sensor: Sensor, away: float) -> None:
    poses = still(500, away)  # too near to be in the image whole
    observed, _ = detect(poses, replace(EXACT, annotators=3.0), sensor=sensor)
    true = true_pixels(sensor, poses.joints_m[:1].astype(np.float64))[0]
    assert np.array_equal(observed.joint_state[0] == JointState.MISSING, ~sensor.camera.contains(true))
    assert (observed.joint_state[0] == JointState.MISSING).any()
    seen = observed.joints_px[observed.joint_state != JointState.MISSING]
    assert (seen >= 0).all()
    assert (seen < (640, 480)).all()


def test_a_face_is_hidden_from_behind() -> None:
    face = [COCO_18.index(n) for n in ("nose", "eye_left", "eye_right")]
    ears = [COCO_18.index(n) for n in ("ear_left", "ear_right")]
    for yaw, hidden in ((np.pi, False), (0.0, True)):
        observed, _ = detect(table(person(3.0, 0.0, yaw)), EXACT)
        assert (observed.joint_state[0, face] == (JointState.INFERRED if hidden else JointState.TRACKED)).all()
        assert (observed.joint_state[0, ears] == JointState.TRACKED).all()
    observed, _ = detect(table(person(3.0, 0.0, np.pi / 2)), EXACT)  # the left side is towards the camera
    assert observed.joint_state[0, ears].tolist() == [JointState.TRACKED, JointState.INFERRED]


def test_a_seam_of_the_sphere_is_no_border() -> None:
    poses = still(50, -2.5, 0.0, 0.0)  # behind the camera, where the image begins and ends
    observed, _ = detect(poses, replace(EXACT, annotators=1.0), sensor=SPHERE)
    assert (observed.joint_state == JointState.TRACKED).mean() > 0.8
    u = observed.joints_px[..., 0]
    assert np.nanmin(u) >= 0
    assert np.nanmax(u) < 2048
    assert (u < 300).any()
    assert (u > 1748).any()
    assert not ((u > 300) & (u < 1748)).any()


def test_sensors_from_above_are_refused() -> None:
    above = Sensor("topdown", TopDownCamera(64, 64, 0.1), 2.0)
    with pytest.raises(SchemaError, match="topdown"):
        detect(still(2), DetectorConfig(), sensor=above)


def test_resolution_of_a_sphere_does_not_change_the_answer() -> None:
    config = replace(PRESETS["openpose-like"], phantoms_per_min=0.0)
    coarse = Sensor("equirectangular", EquirectangularCamera(1024, 512), 1.5)
    fine, _ = detect(still(100), config, sensor=SPHERE)
    half, _ = detect(still(100), config, sensor=coarse)
    np.testing.assert_allclose(2 * half.joints_px, fine.joints_px, atol=0.03)
