"""Where cameras stand: at the outskirts of a room, in a corner below the ceiling, or in the middle.

The heading is drawn first and never rejected, so that the yaw of the walls in the episode frame says nothing
(docs/conventions.md); of the positions that a kind of camera takes those that see most of the room with it are chosen
from. Mesh parts of imported scenes count as convex parts do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import BrownCamera, CentralCamera, EquirectangularCamera, PinholeCamera
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.polygons import contains
from hsbench.geometry.transforms import planar
from hsbench.geometry.triangle_rays import TriangleTree, nearest
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.config import settings
from hsbench.truth.doorways import doorways
from hsbench.truth.meshes import has_mesh, mesh_body
from hsbench.truth.sight import ray_image
from hsbench.truth.walkable import walk_map
from hsbench.typing import BoolArray, FloatArray

THUMBNAIL = 1 / 16  # of the picture's sides, to see whether something stands before the camera
FEELERS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)])
SWING_MARGIN_M = 0.1  # between a tripod and where the leaf of a door can come
HEADROOM_M = 0.15  # between a lens and the ceiling
STANDS = ("outskirts", "corner")


@dataclass(frozen=True)
class CameraConfig:
    """A pinhole camera and how it is set up. Lengths in metres, angles in degrees, focal length in pixels.

    The default field of view, 70.6 degrees across, is that of a Kinect v2's depth camera.
    principal_px: where the axis meets the picture; none: its middle. distortion: k1, k2, p1, p2, k3 of ``BrownCamera``.
    stand: along the walls (``outskirts``), ``wall_distance_m`` from them, or so where two of them meet (``corner``) if
    ``corner_share`` of the floor is seen from one.
    clearance_m: no thing is nearer to the lens. near_m, near_share: a position with a larger share of the picture
    nearer than that is taken last. choose_from: one of so many that see most floor.
    Raises SchemaError for another ``stand``.
    """

    width_px: int = 640
    height_px: int = 480
    focal_px: float = 452.0
    principal_px: tuple[float, float] | None = None
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    stand: str = "outskirts"
    height_m: tuple[float, float] = (1.35, 2.05)
    tilt_deg: tuple[float, float] = (10.0, 24.0)
    wall_distance_m: float = 0.22
    clearance_m: float = 0.15
    near_m: float = 0.9
    near_share: float = 0.25
    spacing_m: float = 0.2
    choose_from: int = 4
    corner_share: float = 0.5

    def __post_init__(self) -> None:
        if self.stand not in STANDS:
            raise SchemaError(f"camera.stand is {self.stand!r}; expected {' or '.join(STANDS)}")

    @property
    def camera(self) -> PinholeCamera | BrownCamera:
        """The camera model, a plain pinhole where there is no distortion."""
        cx_px, cy_px = self.principal_px or (self.width_px / 2, self.height_px / 2)
        numbers = self.width_px, self.height_px, self.focal_px, self.focal_px, cx_px, cy_px
        return BrownCamera(*numbers, *self.distortion) if any(self.distortion) else PinholeCamera(*numbers)


CAMERAS: dict[str, CameraConfig] = {
    "kinect-v2-registered": CameraConfig(),
    # Factory calibration of one depth camera, read out in github.com/OpenKinect/libfreenect2/issues/41.
    "kinect-v2": CameraConfig(
        width_px=512,
        height_px=424,
        focal_px=365.402802,
        principal_px=(260.925507, 205.594604),
        distortion=(0.095575, -0.277055, 0.0, 0.0, 0.097539),
    ),
    "ordinary": CameraConfig(focal_px=520.0, height_m=(1.6, 2.15), tilt_deg=(8.0, 24.0)),
    "security": CameraConfig(
        focal_px=330.0,
        distortion=(-0.2, 0.04, 0.0, 0.0, -0.0035),
        stand="corner",
        height_m=(1.9, 2.15),
        tilt_deg=(20.0, 40.0),
        wall_distance_m=0.15,
        clearance_m=0.1,
        near_share=0.3,
        choose_from=1,
    ),
}
"""Cameras by name: a Kinect v2 as registered to a 640 x 480 picture and as its depth camera is; an ordinary one, 63
degrees across; a security camera in a corner, 103 degrees across. Where no source is named: choices of hsbench.
"""


def camera_config(table: Mapping[str, Any], name: str) -> CameraConfig:
    """The camera of a recipe's section: its ``preset`` (``kinect-v2-registered`` if none is named), other keys over it.

    Raises SchemaError for an unknown preset or key.
    """
    preset = table.get("preset", "kinect-v2-registered")
    if preset not in CAMERAS:
        raise SchemaError(f"config section [{name}]: preset is {preset!r}; expected one of {', '.join(CAMERAS)}")
    own = {key: value for key, value in table.items() if key != "preset"}
    return settings(CameraConfig, {**vars(CAMERAS[preset]), **own}, name)


@dataclass(frozen=True)
class SphereConfig:
    """A 360 camera and how it is set up. Lengths in metres.

    central_share: it stands on one of this share of the largest room's clear cells that are nearest to all its others.
    near_m, near_share: as of ``CameraConfig``.
    """

    width_px: int = 1024
    height_m: tuple[float, float] = (1.2, 1.8)
    central_share: float = 0.15
    near_m: float = 0.5
    near_share: float = 0.25

    @property
    def camera(self) -> EquirectangularCamera:
        """The camera model."""
        return EquirectangularCamera(self.width_px, self.width_px // 2)


def place_rgbd(scene: Scene, config: CameraConfig, rng: np.random.Generator) -> tuple[FloatArray, Sensor]:
    """``place_camera`` for an RGB-D camera."""
    return place_camera("rgbd", scene, config, rng)


def place_camera(kind: str, scene: Scene, config: CameraConfig, rng: np.random.Generator) -> tuple[FloatArray, Sensor]:
    """(scene_T_episode (4, 4), sensor) of a camera in the largest room, the scene in its own frame.

    kind: ``rgbd`` or ``monocular``. Of the ``choose_from`` positions that see most floor, one is drawn; positions
    inside furniture, or with more than ``near_share`` of the picture closer than ``near_m``, come last.
    """
    heading = quantise_angle(rng.uniform(-math.pi, math.pi))
    height_m = _below_ceiling(float(quantise_m(rng.uniform(*config.height_m))), scene)
    tilt_rad = quantise_angle(math.radians(rng.uniform(*config.tilt_deg)))
    draw = int(rng.integers(config.choose_from))
    sensor = Sensor(kind, config.camera, height_m, tilt_rad)
    outline = max(scene.rooms, key=lambda room: room.area_m2).outline_xy
    floor = _floor_points(outline, config.spacing_m)
    outskirts, corners = _outskirts(outline, config), _corners(outline, config)
    clear = [p[_is_clear(p, height_m, scene, config.clearance_m)] for p in (corners, outskirts, floor)]
    if config.stand == "corner":
        seen = np.array([_seen_share(floor, position, heading, config) for position in clear[0]])
        far, _ = _candidates(clear[0][seen >= config.corner_share], floor, heading, scene, sensor, config)
        if far:
            return far[draw % len(far)], sensor
    positions = next((p for p in clear[1:] if len(p)), outskirts)  # a room full to the brim still has a camera
    far, near = _candidates(positions, floor, heading, scene, sensor, config)
    candidates = (far + near)[: config.choose_from]
    return candidates[draw % len(candidates)], sensor


def _candidates(
    positions: FloatArray, floor: FloatArray, heading: float, scene: Scene, sensor: Sensor, config: CameraConfig
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Poses (4, 4) at (N, 2) positions, those that see most floor first: (with nothing too near, the others), until the
    first are as many as one is chosen from.
    """
    seen = np.array([_seen_share(floor, position, heading, config) for position in positions])
    far: list[FloatArray] = []
    near: list[FloatArray] = []
    for x, y in positions[np.argsort(-seen, kind="stable")]:
        pose = planar(float(x), float(y), heading)
        blocked = _near_share(scene, pose, sensor, config.near_m) > config.near_share
        (near if blocked else far).append(pose)
        if len(far) == config.choose_from:
            break
    return far, near


def place_sphere(scene: Scene, config: SphereConfig, rng: np.random.Generator) -> tuple[FloatArray, Sensor]:
    """(scene_T_episode (4, 4), sensor) of a 360 camera in the middle of the largest room, the scene in its own frame.

    It stands where a body can stand, out of the way of doors. Positions with more than ``near_share`` of the picture
    closer than ``near_m`` are taken only where there is no other.
    """
    heading = quantise_angle(rng.uniform(-math.pi, math.pi))
    height_m = _below_ceiling(float(quantise_m(rng.uniform(*config.height_m))), scene)
    sensor = Sensor("equirectangular", config.camera, height_m)
    cells = _central_cells(scene, config.central_share)
    poses = [planar(float(x), float(y), heading) for x, y in cells[rng.permutation(len(cells))]]
    chosen, least = poses[0], math.inf
    for pose in poses:
        near = _near_share(scene, pose, sensor, config.near_m)
        if near < least:
            chosen, least = pose, near
        if near <= config.near_share:
            break
    return chosen, sensor


def _below_ceiling(height_m: float, scene: Scene) -> float:
    """The height, or under a low ceiling the greatest there is."""
    return min(height_m, float(quantise_m(scene.height_m - HEADROOM_M)))


def _central_cells(scene: Scene, share: float) -> FloatArray:
    """(N, 2) middles of the cells of the largest room where a body can stand, out of the way of doors: those nearest to
    all others, N being a share of them. The middle of the room where nobody can stand.
    """
    outline = max(scene.rooms, key=lambda room: room.area_m2).outline_xy
    walk = walk_map(scene)
    cells = walk.centres()[walk.free]
    cells = cells[contains(outline, cells)]
    if not len(cells):
        return quantise_m((outline.min(axis=0) + outline.max(axis=0)) / 2)[None]
    clear = cells[~_in_swing(scene, cells)]
    return most_central(clear if len(clear) else cells, share)


def most_central(cells_xy: FloatArray, share: float) -> FloatArray:
    """(N, 2) points -> a share of them, at least one: those nearest to all others."""
    # Their mean squared distance to all, less a constant.
    squares = (cells_xy**2).sum(axis=1) - 2 * cells_xy @ cells_xy.mean(axis=0)
    order = np.argsort(squares.round(6), kind="stable")
    return quantise_m(cells_xy[order[: max(1, round(share * len(cells_xy)))]])


def _in_swing(scene: Scene, points_xy: FloatArray) -> BoolArray:
    """(N,) bool: the leaf of a door, whichever way it opens, can come near a point (N, 2)."""
    found = np.zeros(len(points_xy), dtype=np.bool_)
    for way in doorways(scene):
        width_m = way.span_m[1] - way.span_m[0]
        for side in range(len(way.rooms)):
            away = np.linalg.norm(points_xy[:, None] - way.corners(side), axis=2)  # from the hinge on either edge
            found |= (away < width_m + SWING_MARGIN_M).any(axis=1)
    return found


def _corners(room_xy: FloatArray, config: CameraConfig) -> FloatArray:
    """Points in the corners that a room has towards its inside, ``wall_distance_m`` from both walls."""
    before, after = np.roll(room_xy, 1, axis=0) - room_xy, np.roll(room_xy, -1, axis=0) - room_xy
    turn = after[:, 0] * before[:, 1] - after[:, 1] * before[:, 0]
    along = [v / np.linalg.norm(v, axis=1, keepdims=True) for v in (before, after)]
    sine = np.where(turn > 0, turn, 1.0) / np.linalg.norm(before, axis=1) / np.linalg.norm(after, axis=1)
    inside = room_xy + (along[0] + along[1]) * (config.wall_distance_m / sine)[:, None]
    return quantise_m(inside[turn > 0])


def _outskirts(room_xy: FloatArray, config: CameraConfig) -> FloatArray:
    """Points along the walls, ``wall_distance_m`` inside."""
    points = []
    for start, end in zip(room_xy, np.roll(room_xy, -1, axis=0), strict=True):
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        inward = np.array([-along[1], along[0]])
        steps = np.arange(config.wall_distance_m, length - config.wall_distance_m, config.spacing_m)
        points.append(start + steps[:, None] * along + config.wall_distance_m * inward)
    return quantise_m(np.concatenate(points))


def _is_clear(positions: FloatArray, height_m: float, scene: Scene, clearance_m: float) -> BoolArray:
    """(N,) bool: nothing is nearer to a lens at the height above (N, 2) positions."""
    points = np.column_stack([positions, np.full(len(positions), height_m)])
    hit = np.zeros(len(points), dtype=np.bool_)
    for item in scene.objects:
        if has_mesh(item):
            hit |= _is_felt(points, mesh_body(item).tree, clearance_m)
        else:
            for solid in item.solids:
                hit |= solid.contains(points, margin_m=-clearance_m)
    return ~hit


def _is_felt(points: FloatArray, tree: TriangleTree, reach_m: float) -> BoolArray:
    """(N,) bool: a triangle lies within reach of (N, 3) points, as far as FEELERS find out."""
    ways = reach_m * FEELERS / np.linalg.norm(FEELERS, axis=1, keepdims=True)
    found = nearest(tree, np.repeat(points, len(ways), axis=0), np.tile(ways, (len(points), 1)), 0.0, end=1.0)
    return np.asarray(np.isfinite(found).reshape(len(points), -1).any(axis=1))


def _floor_points(room_xy: FloatArray, spacing_m: float) -> FloatArray:
    low, high = room_xy.min(axis=0), room_xy.max(axis=0)
    points = np.stack(np.meshgrid(*(np.arange(a, b, spacing_m) for a, b in zip(low, high, strict=True))), axis=-1)
    points = points.reshape(-1, 2)
    return np.asarray(points[contains(room_xy, points)])


def _seen_share(floor: FloatArray, position: FloatArray, heading: float, config: CameraConfig) -> float:
    """Share of the floor inside the horizontal field of view, furniture left out."""
    offset = floor - position
    angle = np.arctan2(offset[:, 1], offset[:, 0]) - heading
    angle = (angle + math.pi) % (2 * math.pi) - math.pi
    camera = config.camera
    edges = camera.rays_at(np.array([[0.0, camera.cy_px], [camera.width_px, camera.cy_px]]))
    left, right = -np.arctan(edges[:, 0])
    return float(np.mean((angle < left) & (angle > right)))


def _near_share(scene: Scene, scene_T_episode: FloatArray, sensor: Sensor, near_m: float) -> float:
    """Share of a thumbnail of the view that is closer to the camera."""
    assert isinstance(sensor.camera, CentralCamera)
    image = ray_image(scene, sensor.camera.scaled(THUMBNAIL), scene_T_episode @ sensor.world_T_camera)
    return float(np.mean(image.depth_m < near_m))
