"""What hides joints: states against sampled lines of sight, moved things, meshes, and culling against none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from detector_people import BODY, RANGE_M, SENSOR, SPHERE, crowd, occluders, person, scene, states, still, table
from hypothesis import given, settings
from hypothesis import strategies as st
from living_rooms import chair, living_room

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid, span
from hsbench.geometry.rays import pack_solids, segments_blocked
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.schema import JointState
from hsbench.schema.motions import ObjectMotions, scene_at
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.schema.skeletons import BODY_25, COCO_18
from hsbench.synth.detectors import Occluders
from hsbench.synth.detectors.landmarks import landmarks
from hsbench.synth.detectors.visibility import FLESH_M
from hsbench.synth.people import capsules
from hsbench.synth.people.body import CAPSULE_JOINTS, J

EPISODE_T_SCENE = invert(planar(0.15, 0.2, 0.75))
ROOM = living_room(2).moved(EPISODE_T_SCENE)
SOLIDS = [s for item in ROOM.objects for s in item.solids]


def about(count: int, seed: int = 4) -> np.ndarray:
    """(count, 25, 3) people who stand anywhere before the camera."""
    rng = np.random.default_rng(seed)
    return np.concatenate(
        [person(rng.uniform(1.0, 4.5), rng.uniform(-2.5, 2.5), rng.uniform(-3, 3)) for _ in range(count)]
    )


def in_room(scene: Scene, motions: ObjectMotions | None = None) -> Occluders:
    return Occluders.of(scene, ObjectMotions.none() if motions is None else motions)


def moving(object_id: int, part: str, keys: list[tuple[float, float, float, float]]) -> ObjectMotions:
    times = np.array([round(k[0] * 1e9) for k in keys], dtype=np.int64)
    moves = np.array([k[1:] for k in keys])
    return ObjectMotions(times, np.full(len(keys), object_id, dtype=np.int32), (part,) * len(keys), moves)


def test_someone_facing_the_camera_is_seen_whole() -> None:
    assert (states(still(1)) == JointState.TRACKED).all()


def test_a_screen_hides_what_is_behind_it() -> None:
    found = states(still(1), [span((1.5, -2.0, 0.0), (1.6, 2.0, 0.8))])[0]
    low = [J[n] for n in ("ankle_left", "ankle_right", "foot_left", "foot_right")]
    assert (found[low] == JointState.INFERRED).all()
    assert found[J["head"]] == JointState.TRACKED


@pytest.mark.parametrize("turn", [-0.5, -0.3, 0.0, 0.3, 0.5])
def test_flesh_about_a_joint_does_not_hide_it(turn: float) -> None:
    """Someone who half faces the camera: shoulders and hips are seen, though they lie in the body."""
    found = states(still(1, yaw=np.pi + turn), skeleton="body-25")[0]
    trunk = [BODY_25.index(n) for n in ("neck", "shoulder_left", "shoulder_right", "hip_mid", "hip_left", "hip_right")]
    assert (found[trunk] == JointState.TRACKED).all()


def test_the_own_body_hides_the_far_arm() -> None:
    found = states(still(1, yaw=-np.pi / 2))[0]
    assert found[J["elbow_right"]] == JointState.TRACKED  # facing -y, the right side is towards the camera
    assert found[J["elbow_left"]] == JointState.INFERRED


def test_another_person_hides() -> None:
    poses = crowd(person(1.8, 0.0, np.pi), person(3.5, 0.0, np.pi))
    found = states(poses)
    assert (found[0] == JointState.TRACKED).sum() > 15
    assert found[1, J["spine_mid"]] == JointState.INFERRED
    apart = replace(poses, timestamp_ns=np.array([0, 1], dtype=np.int64))
    assert (states(apart)[1] == JointState.TRACKED).all()


def test_outside_range_or_image_is_missing() -> None:
    for x, y in ((9.0, 0.0), (1.0, 3.0)):
        assert (states(still(1, x, y)) == JointState.MISSING).all()


def test_a_sphere_sees_all_around() -> None:
    assert (states(still(1, -2.0, 0.0, 0.0), sensor=SPHERE) == JointState.TRACKED).all()


@pytest.mark.parametrize("skeleton", ["kinect-v2-25", "coco-18"])
def test_states_against_sampled_lines_of_sight(skeleton: str) -> None:
    joints = about(6)
    found = states(table(joints), in_room(ROOM), skeleton=skeleton)
    points = joints if skeleton == "kinect-v2-25" else landmarks(COCO_18, BODY, joints)
    camera = SENSOR.world_T_camera[:3, 3]
    share = np.linspace(0, 1, 2001)[1:-1, None]
    ends, radii = capsules(BODY, joints)
    pixels, depth = SENSOR.camera.project(apply(invert(SENSOR.world_T_camera), points))
    shown = SENSOR.camera.contains(pixels) & (depth >= RANGE_M[0]) & (depth <= RANGE_M[1])
    assert np.array_equal(shown, found != JointState.MISSING)
    names = _own_names(skeleton)
    checked = {True: 0, False: 0}
    for row, j in np.argwhere(shown)[::2]:
        joint = points[row, j]
        line = camera + share * (joint - camera)
        least = min((np.max(line @ s.planes[:, :3].T - s.planes[:, 3], axis=1)).min() for s in SOLIDS)
        for c, owners in enumerate(CAPSULE_JOINTS):
            axis = ends[row, c, 0] + np.linspace(0, 1, 41)[:, None] * (ends[row, c, 1] - ends[row, c, 0])
            r = radii[c, 0] + np.linspace(0, 1, 41) * (radii[c, 1] - radii[c, 0])
            holds = (np.linalg.norm(axis - joint, axis=1) - r).min()
            if abs(holds) <= 1e-3:
                least = 0.0  # sampling cannot tell whether the joint lies in this capsule
            if holds <= 1e-3 or names[j] in owners:
                continue
            outside = np.linalg.norm(line - joint, axis=1) > FLESH_M
            near = line[outside & (np.linalg.norm(line - axis[20], axis=1) < 0.6)]
            if len(near):
                least = min(least, float((np.linalg.norm(near[:, None] - axis, axis=-1) - r).min()))
        if abs(least) > 2e-3:
            checked[bool(least < 0)] += 1
            assert (found[row, j] == JointState.INFERRED) == (least < 0), (row, j, least)
    assert min(checked.values()) > 8


def _own_names(skeleton: str) -> list[str]:
    return list(J) if skeleton == "kinect-v2-25" else ["spine_shoulder" if n == "neck" else n for n in COCO_18.names]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_culling_leaves_out_nothing_that_hides(seed: int) -> None:
    """Against the test of every segment with every solid, which knows no bounds."""
    rng = np.random.default_rng(seed)
    boxes = []
    for _ in range(30):
        low = rng.uniform(-4, 4, 3) * (1, 1, 0.3)
        boxes.append(span(low, low + rng.uniform(0.02, 1.5, 3)))
    joints = person(*rng.uniform(-4, 4, 2), rng.uniform(-3, 3))
    camera = np.array([*rng.uniform(-1, 1, 2), rng.uniform(0.2, 2.2)])
    asked = rng.random((1, 25)) < 0.7
    found = occluders(boxes).hide(camera, np.zeros(1, np.int64), joints, asked)
    floor = span((-20.0, -20.0, -0.1), (20.0, 20.0, 0.0))
    expected = segments_blocked(camera, joints[0], pack_solids([floor, *boxes]))
    assert np.array_equal(found[0], expected & asked[0])


@pytest.mark.parametrize("part", ["", "back"])
def test_moved_things_hide_where_they_are(part: str) -> None:
    """At every time as a still scene in which they stand there."""
    room = Scene("s-2", ROOM.rooms, 2.5, (chair(1, 1.6, 0.3, 0.4), chair(2, 2.0, -0.6, 2.0)))
    motions = moving(
        1, part, [(0.5, 0.0, 0.0, 0.0), (1.5, 0.3, -0.5, 1.2), (2.0, 0.3, -0.5, 1.2), (2.6, 0.0, 0.0, 0.0)]
    )
    joints = np.concatenate([person(2.6, -1.0 + k / 15, np.pi) for k in range(31)])
    poses = table(joints)
    found = states(poses, in_room(room, motions))
    changed = 0
    for row in range(len(poses)):
        there = scene_at(room, motions.moves_at(int(poses.timestamp_ns[row])))
        expected = states(poses.select(np.array([row])), in_room(there))[0]
        assert np.array_equal(found[row], expected)
        changed += int((states(poses.select(np.array([row])), in_room(room))[0] != expected).sum())
    assert changed > 0


def test_a_part_goes_with_its_object() -> None:
    room = Scene("s-2", ROOM.rooms, 2.5, (chair(1, 1.6, 0.0, 0.0),))
    times, moves = np.array([0, 0], dtype=np.int64), np.array([[0.1, 0.2, 0.6], [0.0, -0.1, -0.3]])
    motions = ObjectMotions(times, np.array([1, 1], dtype=np.int32), ("", "back"), moves)
    poses = table(about(20, seed=2))
    there = scene_at(room, motions.moves_at(0))
    assert np.array_equal(states(poses, in_room(room, motions)), states(poses, in_room(there)))


def test_motions_of_what_is_not_there_are_refused() -> None:
    with pytest.raises(SchemaError, match="seats"):
        in_room(ROOM, moving(ROOM.objects[-1].object_id, "seats", [(0.0, 0.0, 0.0, 0.0)]))


def as_mesh(item: SceneObject) -> SceneObject:
    parts = tuple(Part(p.name, p.colour, p.role, None, (p.vertices, p.triangles)) for p in item.parts)
    return replace(item, parts=parts)


def test_meshes_hide_as_the_solids_of_the_same_shape() -> None:
    meshes = replace(ROOM, objects=tuple(as_mesh(item) for item in ROOM.objects))
    poses = table(about(40, seed=5))
    found, expected = states(poses, in_room(meshes)), states(poses, in_room(ROOM))
    assert (expected == JointState.INFERRED).sum() > 50
    assert np.array_equal(found, expected)


def test_a_moved_mesh_hides_where_it_is() -> None:
    boxed = scene([span((1.5, -2.0, 0.0), (1.6, 2.0, 0.8))])
    mesh = replace(boxed, objects=(boxed.objects[0], as_mesh(boxed.objects[1])))
    poses = still(3)
    motions = moving(2, "", [(0.15, 3.0, 0.0, 0.0)])  # behind the person
    found = states(poses, in_room(mesh, motions))
    assert np.array_equal(found, states(poses, in_room(boxed, motions)))
    assert (found[:2] == JointState.INFERRED).any(axis=1).all()
    assert (found[2] == JointState.TRACKED).all()


def test_a_joint_in_a_solid_is_hidden_and_one_on_its_face_is_not() -> None:
    joint = np.array([[[2.0, 0.0, 1.0]]])
    camera, asked, time = np.array([0.0, 0.0, 1.0]), np.ones((1, 1), dtype=bool), np.zeros(1, dtype=np.int64)
    for front, hidden in ((1.9, True), (2.0, False), (2.1, False)):
        boxes: list[ConvexSolid] = [span((front, -1.0, 0.5), (3.0, 1.0, 1.5))]
        assert occluders(boxes).hide(camera, time, joint, asked)[0, 0] == hidden
