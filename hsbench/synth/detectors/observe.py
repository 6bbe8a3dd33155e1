"""What a pose detector gives of true poses: joints that are seen, guessed or missing, with its errors and its losses.

Everything that is random comes from streams of one body or one pair of bodies, drawn in the order of time and whatever
is seen: so a longer take begins as a shorter one does, and a thing in the scene changes an observation only where it
hides a joint. Episode frame, metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import TopDownCamera
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import KINECT_V2, SKELETONS
from hsbench.synth.detectors.config import DetectorConfig
from hsbench.synth.detectors.image import misplaced, patch_axes, pixels, seen_in_patch
from hsbench.synth.detectors.losses import missed, reported_states
from hsbench.synth.detectors.occluders import Occluders
from hsbench.synth.detectors.phantoms import phantoms
from hsbench.synth.detectors.space import displaced
from hsbench.synth.detectors.tracks import Seen, track_ids
from hsbench.synth.detectors.visibility import joint_states, people
from hsbench.synth.people.body import Body, J
from hsbench.synth.seeds import Seeds
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray, UInt8Array

NEAREST_M = 0.3  # nobody is larger in the image than at this distance


class Sight(NamedTuple):
    """N bodies that could be found, people first, each part at ascending times.

    body: (N,) person > 0 or minus a phantom's number. row: (N,) row of the true pose, -1 for a phantom.
    joints: (N, J, 3) metres in the camera frame, true. pelvis: (N, 3) likewise. stature_m: (N,).
    state: (N, J) by lines of sight.
    """

    timestamp_ns: IntArray
    body: IntArray
    row: IntArray
    joints: FloatArray
    pelvis: FloatArray
    stature_m: FloatArray
    state: UInt8Array

    def of(self, rows: IntArray) -> Sight:
        """Some rows."""
        return Sight(
            self.timestamp_ns[rows], self.body[rows], self.row[rows], self.joints[rows], self.pelvis[rows],
            self.stature_m[rows], self.state[rows],
        )  # fmt: skip


def observe(
    poses: PoseTable,
    bodies: Sequence[Body],
    occluders: Occluders,
    sensor: Sensor,
    config: DetectorConfig,
    seeds: Seeds,
    times_ns: IntArray,
) -> tuple[PoseTable, IntArray]:
    """What the detector gives of N true poses -> (M observed poses, (M,) int64 row of the true pose of each, -1: none).

    poses: Kinect joints in the episode frame; track_id k is the person of ``bodies[k - 1]``. times_ns: (T,) int64
    ascending, when the detector looks; true poses of other times are not observed.
    Raises SchemaError for poses of another skeleton, of a person without a body, or none of which is at a look, and for
    a sensor from above.
    """
    if poses.skeleton != KINECT_V2.name or poses.joints_m is None:
        raise SchemaError(f"true poses are {poses.skeleton!r}; expected 3D joints of {KINECT_V2.name}")
    if isinstance(sensor.camera, TopDownCamera):
        raise SchemaError("a detector was given a topdown sensor; expected a pinhole or equirectangular camera")
    if len(poses) and not np.isin(poses.timestamp_ns, times_ns).any():
        raise SchemaError("no true pose is at a time at which the detector looks (is its rate no divisor of theirs?)")
    skeleton = SKELETONS[config.skeleton]
    sight = _sight(poses, bodies, occluders, sensor, config, seeds, times_ns)
    state, found = sight.state.copy(), np.zeros(len(sight.body), dtype=np.bool_)
    values = np.empty((*state.shape, 3 if config.in_metres else 2))
    counted = [skeleton.index(name) for name in config.counted]
    for body in np.unique(sight.body):
        rows = np.flatnonzero(sight.body == body)
        node = seeds.child("person" if body > 0 else "phantom").child(int(abs(body)))
        one = sight.of(rows)
        values[rows], inside = (_in_metres if config.in_metres else _in_pixels)(one, sensor, config, node)
        reported = reported_states(one.state, one.timestamp_ns, config, node)
        state[rows] = np.where(inside, reported, JointState.MISSING)
        tracked = (state[rows][:, counted] == JointState.TRACKED).sum(axis=1)
        found[rows] = (tracked >= config.least_tracked) & ~missed(one.timestamp_ns, config, node)
    ids = _ids(sight, found, config, seeds, times_ns)
    kept = np.flatnonzero(found)
    kept = kept[np.lexsort((ids[kept], sight.timestamp_ns[kept]))]
    answer = np.where(state[kept, :, None] == JointState.MISSING, np.nan, values[kept]).astype(np.float32)
    where = {"joints_m" if config.in_metres else "joints_px": answer}
    return PoseTable(skeleton.name, sight.timestamp_ns[kept], ids[kept], state[kept], **where), sight.row[kept]


def _sight(
    poses: PoseTable,
    bodies: Sequence[Body],
    occluders: Occluders,
    sensor: Sensor,
    config: DetectorConfig,
    seeds: Seeds,
    times_ns: IntArray,
) -> Sight:
    """People, and phantoms, which hide nobody."""
    assert poses.joints_m is not None
    row = np.flatnonzero(np.isin(poses.timestamp_ns, times_ns))
    person = poses.track_id[row].astype(np.int64)
    ghost = phantoms(times_ns, sensor, config, seeds.child("phantom"))
    parts = (
        (poses.timestamp_ns[row], person, person, row, poses.joints_m[row].astype(np.float64), bodies),
        (ghost.timestamp_ns, -ghost.number, ghost.number, np.full(len(ghost.number), -1), ghost.joints, ghost.bodies),
    )
    skeleton, camera_T_episode = SKELETONS[config.skeleton], invert(sensor.world_T_camera)
    found = []
    for stamps, number, place, true_row, joints, owners in parts:
        crowd = people(stamps, place, joints, owners, skeleton)
        state = joint_states(crowd, skeleton, occluders, sensor, config.range_m)
        stature_m = np.array([body.stature_m for body in owners])[place - 1] if len(place) else np.empty(0)
        seen, pelvis = (apply(camera_T_episode, points) for points in (crowd.joints, joints[:, J["spine_base"]]))
        found.append(Sight(stamps, number, true_row, seen, pelvis, stature_m, state))
    return Sight(*(np.concatenate(pair) for pair in zip(*found, strict=True)))


def _in_metres(one: Sight, sensor: Sensor, config: DetectorConfig, seeds: Seeds) -> tuple[FloatArray, BoolArray]:
    """(N, J, 3) what is answered for one body, in the episode frame, and (N, J) that all of it can be."""
    _, depth_m = sensor.camera.project(one.joints)
    found = displaced(one.joints, depth_m, one.state, one.timestamp_ns, config, seeds)
    return quantise_m(apply(sensor.world_T_camera, found)), np.ones(one.state.shape, dtype=np.bool_)


def _in_pixels(one: Sight, sensor: Sensor, config: DetectorConfig, seeds: Seeds) -> tuple[FloatArray, BoolArray]:
    """(N, J, 2) what is answered for one body, and (N, J) whether a joint lies in the body's patch."""
    axes = patch_axes(sensor, one.pelvis)
    place, _ = seen_in_patch(sensor, axes, one.joints)
    _, depth = seen_in_patch(sensor, axes, one.pelvis[:, None])
    size = one.stature_m / np.maximum(depth[:, 0], NEAREST_M)
    found = misplaced(place, size, one.state, SKELETONS[config.skeleton], one.timestamp_ns, config, seeds)
    return pixels(sensor, axes, found), np.asarray(np.isfinite(place).all(axis=-1))


def _ids(sight: Sight, found: BoolArray, config: DetectorConfig, seeds: Seeds, times_ns: IntArray) -> Int32Array:
    """(N,) track id of what is found, 0 elsewhere."""
    rows = {int(body): np.flatnonzero(found & (sight.body == body)) for body in np.unique(sight.body)}
    look = np.searchsorted(times_ns, sight.timestamp_ns)
    seen = {body: Seen(look[which], sight.pelvis[which]) for body, which in rows.items()}
    ids = np.zeros(len(found), dtype=np.int32)
    for body, track_id in track_ids(times_ns, seen, config, seeds).items():
        ids[rows[body]] = track_id
    return ids
