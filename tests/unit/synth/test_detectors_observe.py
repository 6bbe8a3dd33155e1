"""What a detector gives of a life: valid, matched, the same for a shorter take, and blind to what hides nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from detector_people import (
    BODY,
    RANGE_M,
    SENSOR,
    SPHERE,
    STEP_NS,
    Observed,
    crowd,
    detect,
    occluders,
    person,
    states,
    still,
    table,
)

from hsbench.errors import SchemaError
from hsbench.geometry.convex import span
from hsbench.schema import JointState, PoseTable
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.detectors import PRESETS, DetectorConfig, detector
from hsbench.synth.detectors.space import JITTER_M

NAMES = sorted(PRESETS)
KINECT = PRESETS["kinect"]
STEADY = DetectorConfig(tracked_m=0.01, jitter=1.0, inferred_m=0.06)


def meeting(looks: int = 240) -> PoseTable:
    """Two who walk across each other's way, and one who stands aside: three times, ten looks a second."""
    share = np.abs(np.arange(looks) / looks * 6 % 2 - 1)[:, None, None]
    rest = np.repeat(person(3.2, -1.2, 2.5), looks, axis=0)
    return crowd(
        person(2.0, -1.5, 1.6) + share * (0.5, 3.0, 0.0), person(3.0, 1.5, -1.6) + share * (-0.5, -3.0, 0.0), rest
    )


MEETING = meeting()
SHELF = span((1.2, -0.4, 0.0), (1.5, 0.6, 1.1))


def same(a: Observed, b: Observed, rows: int | None = None) -> None:
    """Equal to the byte, the second as long as ``rows`` of the first."""
    cut = slice(None, rows)
    for name in ("timestamp_ns", "track_id", "joint_state", "joints_m", "joints_px"):
        one, other = getattr(a[0], name), getattr(b[0], name)
        assert (one is None) == (other is None)
        assert one is None or one[cut].tobytes() == other.tobytes(), name
    assert np.array_equal(a[1][cut], b[1])


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("sensor", [SENSOR, SPHERE], ids=["pinhole", "sphere"])
def test_observed_rows_are_matched_and_near_the_truth(name: str, sensor: object) -> None:
    config = replace(PRESETS[name], phantoms_per_min=20.0)
    observed, match = detect(MEETING, config, sensor=sensor, hiding=occluders([SHELF]))
    assert observed.skeleton == config.skeleton
    real = match >= 0
    assert 0.2 * len(MEETING) < real.sum() <= len(MEETING)
    assert len(np.unique(match[real])) == real.sum()
    assert (~real).any()
    assert np.array_equal(observed.timestamp_ns[real], MEETING.timestamp_ns[match[real]])
    if config.in_metres:
        values = observed.joints_m[observed.joint_state != JointState.MISSING].astype(np.float64)
        assert np.allclose(values, values.round(4), atol=1e-6)
        error = np.linalg.norm(observed.joints_m - MEETING.joints_m[match], axis=-1)[real]
        assert (
            np.nanmax(error[observed.joint_state[real] == JointState.TRACKED])
            <= 12 * config.tracked_m + 0.05 * config.jitter + 2e-4
        )


def test_clean_is_the_truth_with_states() -> None:
    observed, match = detect(MEETING, PRESETS["clean"], hiding=occluders([SHELF]))
    true = states(MEETING, [SHELF])[match]
    assert np.array_equal(observed.joint_state, true)
    expected = np.where(true[..., None] == JointState.MISSING, np.nan, MEETING.joints_m[match])
    np.testing.assert_allclose(observed.joints_m, expected, atol=1.01e-4)


@pytest.mark.parametrize("distance", [1.5, 3.0, 6.0])
def test_errors_grow_with_the_square_of_distance(distance: float) -> None:
    """Drift and jitter, a second apart, so that looks are nearly independent."""
    poses = still(6000, distance, every_ns=10 * STEP_NS)
    level = replace(SENSOR, tilt_rad=0.0)
    observed, match = detect(poses, STEADY, seed=5, sensor=level)
    tracked = np.flatnonzero(observed.joint_state[0] == JointState.TRACKED)
    assert len(tracked) > 5
    error = (observed.joints_m - poses.joints_m[match])[:, tracked]
    jitter = STEADY.jitter * np.array(
        [JITTER_M[KINECT_V2.names[j].removesuffix("_left").removesuffix("_right")] for j in tracked]
    )
    expected = np.hypot(0.01, jitter) * (1 + (poses.joints_m[0, tracked, 0] / 4.0) ** 2)
    assert np.abs(error.std(axis=(0, 2)) / expected - 1).max() < 0.05


def test_jitter_is_that_of_the_recordings() -> None:
    """By second differences, as it was measured; rounding to .1 mm adds to it."""
    poses = still(6000, 3.0, every_ns=STEP_NS // 3)
    config = replace(KINECT, tracked_m=0.0, phantoms_per_min=0.0, bursts_per_min=0.0)
    observed, _ = detect(poses, config, sensor=replace(SENSOR, tilt_rad=0.0))
    second = np.diff(observed.joints_m.astype(np.float64), 2, axis=0) / np.sqrt(6)
    found = second.std(axis=(0, 2))
    for j in np.flatnonzero(observed.joint_state[0] == JointState.TRACKED):
        name = KINECT_V2.names[j].removesuffix("_left").removesuffix("_right")
        expected = JITTER_M[name] * (1 + (poses.joints_m[0, j, 0] / 4.0) ** 2)
        assert found[j] == pytest.approx(np.hypot(expected, 1e-4 / np.sqrt(12)), rel=0.04)


def test_errors_of_hidden_joints_drift() -> None:
    poses = still(6000, yaw=-np.pi / 2)
    observed, match = detect(poses, STEADY, seed=5)
    error = (observed.joints_m - poses.joints_m[match])[:, observed.joint_state[0] == JointState.INFERRED]
    assert error.std() == pytest.approx(0.06, rel=0.1)
    a = 4 * STEP_NS / 1e9 / STEADY.drift_s
    assert np.mean(error[4:] * error[:-4]) / error.var() == pytest.approx((1 + a) * np.exp(-a), abs=0.06)


@pytest.mark.parametrize("name", NAMES)
def test_a_shorter_take_is_observed_the_same(name: str) -> None:
    config = replace(PRESETS[name], phantoms_per_min=12.0)
    full = detect(MEETING, config, hiding=occluders([SHELF]))
    looks = np.unique(MEETING.timestamp_ns)
    for end in (37, 100, 183):
        short = detect(MEETING.until(int(looks[end])), config, hiding=occluders([SHELF]))
        same(full, short, len(short[0]))


@pytest.mark.parametrize("name", NAMES)
def test_what_hides_no_joint_changes_no_byte(name: str) -> None:
    config = replace(PRESETS[name], phantoms_per_min=6.0)
    base = detect(MEETING, config, hiding=occluders([SHELF]))
    beyond = [span((7.5, -8.0, 0.0), (7.6, 8.0, 2.0)), span((1.25, -0.3, 0.05), (1.45, 0.5, 1.0))]  # one in the shelf
    same(base, detect(MEETING, config, hiding=occluders([SHELF, *beyond])))
    hides, _ = detect(MEETING, config, hiding=occluders([SHELF, span((1.0, -3.0, 0.0), (1.05, 3.0, 1.3))]))
    assert not np.array_equal(hides.joint_state, base[0].joint_state)


def test_a_hidden_joint_changes_nothing_of_the_others() -> None:
    """Errors of what stays tracked are the same bytes, whatever is hidden beside it."""
    config = replace(STEADY, least_tracked=1)
    (seen, _), (low, _) = (detect(still(200), config, hiding=occluders(s)) for s in ([], [SHELF]))
    both = (seen.joint_state == JointState.TRACKED) & (low.joint_state == JointState.TRACKED)
    assert both.any()
    assert not both.all()
    assert seen.joints_m[both].tobytes() == low.joints_m[both].tobytes()


def test_only_looks_are_observed() -> None:
    looks = np.arange(0, 240, 3, dtype=np.int64) * STEP_NS
    observed, match = detect(MEETING, replace(KINECT, phantoms_per_min=0.0), looks=looks)
    assert set(observed.timestamp_ns) <= set(looks)
    assert np.array_equal(MEETING.timestamp_ns[match], observed.timestamp_ns)
    with pytest.raises(SchemaError, match="divisor"):
        detect(MEETING, KINECT, looks=looks + 1)


def test_phantoms_have_their_rate_and_do_not_wait_for_people() -> None:
    config = DetectorConfig(phantoms_per_min=5.0, phantom_s=(1.0, 3.0), least_tracked=1)
    looks = np.arange(36_000, dtype=np.int64) * STEP_NS  # an hour
    nobody = table(np.empty((0, 25, 3)))
    observed, match = detect(nobody, config, sensor=SPHERE, looks=looks)
    assert (match == -1).all()
    cycle_s = 60 / 5.0 + 2.0
    expected = 3600 / cycle_s
    assert abs(len(np.unique(observed.track_id)) - expected) < 4 * np.sqrt(expected)
    assert len(observed) / len(looks) == pytest.approx(2.0 / cycle_s, rel=0.2)
    feet = observed.joints_m[:, [14, 18], 2]
    assert np.nanmax(np.abs(feet)) < 0.15  # they stand on the floor


def test_phantoms_are_hidden_as_people_would_be() -> None:
    config = replace(KINECT, phantoms_per_min=30.0)
    looks = np.arange(600, dtype=np.int64) * STEP_NS
    nobody = table(np.empty((0, 25, 3)))
    walls = [span((1.0, -9.0, 0.0), (1.1, 9.0, 3.0))]
    assert len(detect(nobody, config, looks=looks)[0]) > 20
    assert len(detect(nobody, config, looks=looks, hiding=occluders(walls))[0]) == 0


def test_phantoms_hide_nobody_and_change_nobody() -> None:
    config = replace(PRESETS["openpose-like"], phantoms_per_min=0.0)
    alone, alone_match = detect(MEETING, config)
    crowded, match = detect(MEETING, replace(config, phantoms_per_min=20.0))
    real = np.flatnonzero(match >= 0)
    assert len(real) < len(match)
    assert np.array_equal(match[real], alone_match)
    assert crowded.joints_px[real].tobytes() == alone.joints_px.tobytes()


def test_lost_bodies_come_back_under_a_new_id() -> None:
    here, gone = person(3.0, 0.0, np.pi), person(3.0, 9.0, np.pi)
    for away, tracks in ((8, 1), (12, 2)):
        joints = np.concatenate([np.repeat(p, n, axis=0) for p, n in ((here, 30), (gone, away), (here, 30))])
        observed, match = detect(table(joints), STEADY)
        assert len(observed) == 60
        assert not ((match >= 30) & (match < 30 + away)).any()
        assert len(np.unique(observed.track_id)) == tracks


def test_nobody_gives_nothing() -> None:
    observed, match = detect(table(np.empty((0, 25, 3))), KINECT)
    assert len(observed) == 0
    assert match.shape == (0,)
    assert match.dtype == np.int64


def test_a_person_without_a_body_is_refused() -> None:
    with pytest.raises(SchemaError, match="person 2"):
        detect(table(person(3.0, 0.0, 0.0), 2), KINECT, bodies=[BODY])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"skeleton": "hand-21"}, "skeleton"),
        ({"miss_share": 2.0}, "percent"),
        ({"tracked_m": -0.1}, "tracked_m"),
        ({"range_m": (4.0, 1.0)}, "range_m"),
        ({"drift_s": 0.0}, "drift_s"),
        ({"cells": float("nan")}, "cells"),
    ],
)
def test_settings_out_of_range_are_refused(change: dict, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        replace(KINECT, **change)


def test_a_recipe_names_a_preset_and_overrides_it() -> None:
    assert detector({}, "poses") == KINECT
    harsh = detector({"preset": "harsh", "range_m": [1.0, 6.0], "skeleton": "coco-18"}, "poses")
    assert harsh == replace(PRESETS["harsh"], range_m=(1.0, 6.0), skeleton="coco-18")
    with pytest.raises(SchemaError, match="openpose-like"):
        detector({"preset": "openpose"}, "poses")
    with pytest.raises(SchemaError, match=r"\[poses\].*mis_share"):
        detector({"mis_share": 0.1}, "poses")


def test_presets_get_worse_in_order() -> None:
    """More errors, fewer joints and bodies, more tracks."""
    quality = []
    for name in ("clean", "openpose-like", "harsh"):
        config = replace(PRESETS[name], skeleton="coco-18", range_m=RANGE_M)
        observed, match = detect(MEETING, config)
        truth, _ = detect(MEETING, replace(PRESETS["clean"], skeleton="coco-18"))
        error = np.nanmedian(np.abs(observed.joints_px[match >= 0] - truth.joints_px[match[match >= 0]]))
        quality.append((-len(observed), (observed.joint_state == 0).mean(), error, observed.track_id.max()))
    assert quality == sorted(quality)
    assert all((np.diff(column) > 0).all() for column in np.array(quality).T)


def test_moved_things_hide_in_observations() -> None:
    motions = ObjectMotions(np.array([STEP_NS * 50]), np.array([2], dtype=np.int32), ("",), np.array([[9.0, 0.0, 0.0]]))
    observed, _ = detect(still(100), replace(STEADY, least_tracked=1), hiding=occluders([SHELF], motions))
    hidden = (observed.joint_state == JointState.INFERRED).any(axis=1)
    assert hidden[:50].all()
    assert not hidden[50:].any()
