"""What a detector sees: states against sampled lines of sight, errors and tracks against their rules."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from living_rooms import living_room

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera
from hsbench.geometry.convex import ConvexSolid, span
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.schema import JointState, PoseTable, Sensor
from hsbench.synth.activities import LifeConfig, live
from hsbench.synth.people import KINECT, Body, PosePreset, capsules, observe
from hsbench.synth.people.body import CAPSULE_JOINTS, J
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.people.observe import joint_states
from hsbench.synth.seeds import Seeds

SENSOR = Sensor("rgbd", PinholeCamera(640, 480, 365.0, 365.0, 320.0, 240.0), 1.5, 0.15)
STEADY = PosePreset(dropouts_per_min=0.0)
BODY = Body(1.75)


def table(joints: np.ndarray, track: np.ndarray | int = 1, times: np.ndarray | None = None) -> PoseTable:
    n = len(joints)
    stamps = np.arange(n, dtype=np.int64) * 33_333_333 if times is None else times
    tracks = np.full(n, track, dtype=np.int32) if isinstance(track, int) else track
    return PoseTable("kinect-v2-25", stamps, tracks, np.full((n, 25), 2, dtype=np.uint8), joints.astype(np.float32))


def person(x: float, y: float, yaw: float, body: Body = BODY) -> np.ndarray:
    return pose(body, standing(body, np.array([x, y]), yaw), 30, None)


def lived(seed: int = 2) -> tuple[PoseTable, tuple[Body, ...], list[ConvexSolid]]:
    scene, config = living_room(seed), LifeConfig(duration_s=60.0)
    life = live(scene, Seeds(seed), config)
    episode_T_scene = invert(planar(0.15, 0.2, 0.75))
    joints = apply(episode_T_scene, life.poses.joints_m.astype(np.float64)).round(4)
    solids = [s for item in scene.moved(episode_T_scene).objects for s in item.solids]
    return replace(life.poses, joints_m=joints.astype(np.float32)), life.bodies, solids


POSES, BODIES, SOLIDS = lived()


def test_someone_facing_the_camera_is_seen_whole() -> None:
    states = joint_states(table(person(3.0, 0.0, np.pi)), [BODY], [], SENSOR, (0.5, 8.0))
    assert (states == JointState.TRACKED).all()


def test_a_screen_hides_what_is_behind_it() -> None:
    screen = span((1.5, -2.0, 0.0), (1.6, 2.0, 0.8))
    states = joint_states(table(person(3.0, 0.0, np.pi)), [BODY], [screen], SENSOR, (0.5, 8.0))[0]
    low = [J[n] for n in ("ankle_left", "ankle_right", "foot_left", "foot_right")]
    assert (states[low] == JointState.INFERRED).all()
    assert states[J["head"]] == JointState.TRACKED


def test_the_own_body_hides_the_far_arm() -> None:
    states = joint_states(table(person(3.0, 0.0, -np.pi / 2)), [BODY], [], SENSOR, (0.5, 8.0))[0]
    assert states[J["elbow_right"]] == JointState.TRACKED  # facing -y, the right side is towards the camera
    assert states[J["elbow_left"]] == JointState.INFERRED


def test_another_person_hides() -> None:
    both = np.concatenate([person(1.8, 0.0, np.pi), person(3.5, 0.0, np.pi)])
    poses = table(both, np.array([1, 2], dtype=np.int32), np.zeros(2, dtype=np.int64))
    states = joint_states(poses, [BODY, BODY], [], SENSOR, (0.5, 8.0))
    assert (states[0] == JointState.TRACKED).sum() > 15
    assert states[1, J["spine_mid"]] == JointState.INFERRED
    apart = replace(poses, timestamp_ns=np.array([0, 1], dtype=np.int64))
    assert (joint_states(apart, [BODY, BODY], [], SENSOR, (0.5, 8.0))[1] == JointState.TRACKED).all()


def test_outside_range_or_image_is_missing() -> None:
    for x, y in ((9.0, 0.0), (1.0, 3.0)):
        states = joint_states(table(person(x, y, np.pi)), [BODY], [], SENSOR, (0.5, 8.0))
        assert (states == JointState.MISSING).all()


def test_states_against_sampled_lines_of_sight() -> None:
    rows = np.arange(0, len(POSES), 173)
    some = POSES.select(rows)
    joints = some.joints_m.astype(np.float64)
    found = joint_states(some, BODIES, SOLIDS, SENSOR, (0.5, 8.0))
    camera = SENSOR.world_T_camera[:3, 3]
    share = np.linspace(0, 1, 4001)[1:-1, None]
    ends, radii = capsules(BODIES[0], joints)
    checked = 0
    for row in range(len(rows)):
        pixels, depth = SENSOR.camera.project(apply(invert(SENSOR.world_T_camera), joints[row]))
        for j in range(25):
            shown = bool(SENSOR.camera.contains(pixels[j])) and 0.5 <= depth[j] <= 8.0
            assert shown == (found[row, j] != JointState.MISSING)
            if not shown:
                continue
            line = camera + share * (joints[row, j] - camera)
            least = min((np.max(line @ s.planes[:, :3].T - s.planes[:, 3], axis=1)).min() for s in SOLIDS)
            for c, names in enumerate(CAPSULE_JOINTS):
                axis = ends[row, c, 0] + np.linspace(0, 1, 41)[:, None] * (ends[row, c, 1] - ends[row, c, 0])
                r = radii[c, 0] + np.linspace(0, 1, 41) * (radii[c, 1] - radii[c, 0])
                holds = (np.linalg.norm(axis - joints[row, j], axis=1) - r).min()
                if abs(holds) <= 1e-3:
                    least = 0.0  # sampling cannot tell whether the joint lies in this capsule
                if holds <= 1e-3 or j in (J[n] for n in names):
                    continue
                near = line[np.linalg.norm(line - axis[20], axis=1) < 0.6]
                if len(near):
                    least = min(least, float((np.linalg.norm(near[:, None] - axis, axis=-1) - r).min()))
            if abs(least) > 2e-3:
                checked += 1
                assert (found[row, j] == JointState.INFERRED) == (least < 0), (row, j, least)
    assert checked > 100


def test_observed_rows_are_valid_and_matched() -> None:
    observed, match = observe(POSES, BODIES, SOLIDS, SENSOR, KINECT, Seeds(1))
    assert 0.2 * len(POSES) < len(observed) < len(POSES)
    assert match.dtype == np.int64
    assert (np.diff(match) > 0).all()
    assert np.array_equal(observed.timestamp_ns, POSES.timestamp_ns[match])
    values = observed.joints_m[observed.joint_state != JointState.MISSING].astype(np.float64)
    assert np.allclose(values, values.round(4), atol=1e-6)
    error = np.linalg.norm(observed.joints_m - POSES.joints_m[match], axis=-1)
    assert np.nanmax(error[observed.joint_state == JointState.TRACKED]) < 6 * KINECT.tracked_m


def test_errors_have_the_promised_size_and_drift() -> None:
    still = table(np.repeat(person(3.0, 0.0, -np.pi / 2), 6000, axis=0))
    observed, match = observe(still, [BODY], [], SENSOR, STEADY, Seeds(5))
    assert len(observed) == 6000
    error = observed.joints_m - still.joints_m[match]
    tracked = error[:, observed.joint_state[0] == JointState.TRACKED]
    hidden = error[:, observed.joint_state[0] == JointState.INFERRED]
    assert tracked.std() == pytest.approx(0.012, rel=0.02)
    assert hidden.std() == pytest.approx(0.06, rel=0.12)
    lag = 30  # a second
    for errors, expected in ((tracked, 0.0), (hidden, np.exp(-1.0))):
        rho = np.mean(errors[lag:] * errors[:-lag]) / errors.var()
        assert rho == pytest.approx(expected, abs=0.08)


def test_a_body_is_lost_with_its_upper_joints_and_returns_under_a_new_track() -> None:
    here, gone = person(3.0, 0.0, np.pi), person(3.0, 9.0, np.pi)
    for away, tracks in ((20, 1), (40, 2)):
        joints = np.concatenate([np.repeat(p, n, axis=0) for p, n in ((here, 30), (gone, away), (here, 30))])
        observed, match = observe(table(joints), [BODY], [], SENSOR, STEADY, Seeds(2))
        assert len(observed) == 60
        assert not ((match >= 30) & (match < 30 + away)).any()
        assert len(np.unique(observed.track_id)) == tracks


def test_dropouts_are_short_and_rare() -> None:
    still = table(np.repeat(person(3.0, 0.0, np.pi), 18000, axis=0))
    observed, match = observe(still, [BODY], [], SENSOR, KINECT, Seeds(4))
    gaps = np.diff(match)[np.diff(match) > 1] - 1
    assert 5 <= len(gaps) <= 40
    assert gaps.max() <= 16
    assert (observed.track_id == 1).all()


def test_a_shorter_take_is_observed_the_same() -> None:
    until = int(POSES.timestamp_ns[700])
    full, full_match = observe(POSES, BODIES, SOLIDS, SENSOR, KINECT, Seeds(1))
    short, short_match = observe(POSES.until(until), BODIES, SOLIDS, SENSOR, KINECT, Seeds(1))
    cut = full.until(until)
    assert np.array_equal(cut.joints_m, short.joints_m, equal_nan=True)
    assert np.array_equal(cut.track_id, short.track_id)
    assert np.array_equal(cut.joint_state, short.joint_state)
    assert np.array_equal(full_match[: len(cut)], short_match)


def test_a_sphere_sees_all_around() -> None:
    sensor = Sensor("equirectangular", EquirectangularCamera(1024, 512), 1.5)
    states = joint_states(table(person(-2.0, 0.0, 0.0)), [BODY], [], sensor, (0.5, 8.0))
    assert (states == JointState.TRACKED).all()


def test_nobody_gives_nothing() -> None:
    observed, match = observe(table(np.empty((0, 25, 3))), [], SOLIDS, SENSOR, KINECT, Seeds(1))
    assert len(observed) == 0
    assert match.shape == (0,)


def test_a_person_without_a_body_is_refused() -> None:
    with pytest.raises(SchemaError, match="person 2"):
        observe(table(person(3.0, 0.0, 0.0), 2), [BODY], [], SENSOR, KINECT, Seeds(1))


def test_two_minutes_are_observed_within_one_and_a_half_seconds() -> None:
    still = table(np.repeat(person(3.0, 0.0, np.pi), 3600, axis=0))
    observe(still.select(np.arange(2)), [BODY], SOLIDS, SENSOR, KINECT, Seeds(1))
    start = time.perf_counter()
    observe(still, [BODY], SOLIDS, SENSOR, KINECT, Seeds(1))
    assert time.perf_counter() - start < 1.5
