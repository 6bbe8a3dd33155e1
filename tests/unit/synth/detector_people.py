"""People who stand where a test wants them, and what a detector gives of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera
from hsbench.geometry.convex import ConvexSolid, span
from hsbench.geometry.transforms import planar
from hsbench.schema import PoseTable, Sensor
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.schema.skeletons import SKELETONS
from hsbench.synth.detectors import DetectorConfig, Occluders, observe
from hsbench.synth.detectors.visibility import joint_states, people
from hsbench.synth.people import Body
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.seeds import Seeds

SENSOR = Sensor("rgbd", PinholeCamera(640, 480, 365.0, 365.0, 320.0, 240.0), 1.5, 0.15)
SPHERE = Sensor("equirectangular", EquirectangularCamera(2048, 1024), 1.5)
BODY = Body(1.75)
RANGE_M = (0.5, 8.0)
STEP_NS = 100_000_000
Observed = tuple[PoseTable, np.ndarray]


def table(joints: np.ndarray, track: np.ndarray | int = 1, times: np.ndarray | None = None) -> PoseTable:
    n = len(joints)
    stamps = np.arange(n, dtype=np.int64) * STEP_NS if times is None else times
    tracks = np.full(n, track, dtype=np.int32) if isinstance(track, int) else track.astype(np.int32)
    return PoseTable("kinect-v2-25", stamps, tracks, np.full((n, 25), 2, dtype=np.uint8), joints.astype(np.float32))


def person(x: float, y: float, yaw: float, body: Body = BODY) -> np.ndarray:
    """(1, 25, 3)."""
    return pose(body, standing(body, np.array([x, y]), yaw), 30, None)


def still(looks: int, x: float = 3.0, y: float = 0.0, yaw: float = np.pi, every_ns: int = STEP_NS) -> PoseTable:
    return table(np.repeat(person(x, y, yaw), looks, axis=0), 1, np.arange(looks, dtype=np.int64) * every_ns)


def crowd(*places: np.ndarray) -> PoseTable:
    """People 1, 2, ... each of (T, 25, 3) joints, at the same T times."""
    joints = np.stack(places, axis=1)
    times, count = joints.shape[:2]
    stamps = np.repeat(np.arange(times, dtype=np.int64) * STEP_NS, count)
    return table(joints.reshape(-1, 25, 3), np.tile(np.arange(1, count + 1), times), stamps)


def scene(solids: Sequence[ConvexSolid] = ()) -> Scene:
    """A floor and solids, each an object of its own (ids from 2) with its frame at the origin."""
    parts = [Part("body", (90, 90, 90), None, solid) for solid in solids]
    floor = Part("floor", (90, 90, 90), None, span((-20.0, -20.0, -0.1), (20.0, 20.0, 0.0)))
    objects = (
        SceneObject(1, "floor", planar(0.0, 0.0, 0.0), (floor,)),
        *(SceneObject(k, "object", planar(0.0, 0.0, 0.0), (p,)) for k, p in enumerate(parts, start=2)),
    )
    outline = np.array([[-20.0, -20.0], [20.0, -20.0], [20.0, 20.0], [-20.0, 20.0]])
    return Scene("s-1", (Room("living", outline),), 2.5, objects)


def occluders(solids: Sequence[ConvexSolid] = (), motions: ObjectMotions | None = None) -> Occluders:
    return Occluders.of(scene(solids), ObjectMotions.none() if motions is None else motions)


def states(
    poses: PoseTable,
    solids: Sequence[ConvexSolid] | Occluders = (),
    sensor: Sensor = SENSOR,
    skeleton: str = "kinect-v2-25",
    bodies: Sequence[Body] = (BODY,) * 8,
) -> np.ndarray:
    layout = SKELETONS[skeleton]
    met = people(poses.timestamp_ns, poses.track_id, poses.joints_m.astype(np.float64), bodies, layout)
    hiding = solids if isinstance(solids, Occluders) else occluders(solids)
    return joint_states(met, layout, hiding, sensor, RANGE_M)


def detect(
    poses: PoseTable,
    config: DetectorConfig,
    seed: int = 1,
    sensor: Sensor = SENSOR,
    hiding: Occluders | None = None,
    looks: np.ndarray | None = None,
    bodies: Sequence[Body] = (BODY,) * 8,
) -> Observed:
    times = np.unique(poses.timestamp_ns) if looks is None else looks
    return observe(poses, bodies, occluders() if hiding is None else hiding, sensor, config, Seeds(seed), times)
