"""Where an RGB-D camera stands: at the outskirts of a room, its heading random with respect to the walls.

The heading is drawn first and never rejected, so that the yaw of the walls in the episode frame says nothing
(docs/conventions.md); of the positions along the walls those that see most of the room with it are chosen from.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.polygons import contains
from hsbench.geometry.rays import cast, pack_solids
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.typing import FloatArray

THUMBNAIL = 1 / 16  # of the picture's sides, to see whether something stands before the camera


@dataclass(frozen=True)
class CameraConfig:
    """An RGB-D camera and how it is set up. Lengths in metres, angles in degrees, focal length in pixels.

    The default field of view, 70.6 degrees across, is that of a Kinect v2's depth camera.
    """

    width_px: int = 640
    height_px: int = 480
    focal_px: float = 452.0
    height_m: tuple[float, float] = (1.35, 2.05)
    tilt_deg: tuple[float, float] = (10.0, 24.0)
    wall_distance_m: float = 0.22
    clearance_m: float = 0.15
    near_m: float = 0.9
    near_share: float = 0.25
    spacing_m: float = 0.2
    choose_from: int = 4

    @property
    def camera(self) -> PinholeCamera:
        """The pinhole model, principal point in the middle."""
        return PinholeCamera(
            self.width_px, self.height_px, self.focal_px, self.focal_px, self.width_px / 2, self.height_px / 2
        )


def place_rgbd(scene: Scene, config: CameraConfig, rng: np.random.Generator) -> tuple[FloatArray, Sensor]:
    """(scene_T_episode (4, 4), sensor) of a camera at the outskirts of the largest room, the scene in its own frame.

    Of the ``choose_from`` positions that see most floor, one is drawn; positions inside furniture, or with more
    than ``near_share`` of the picture closer than ``near_m``, come last.
    """
    heading = quantise_angle(rng.uniform(-math.pi, math.pi))
    height_m = float(quantise_m(rng.uniform(*config.height_m)))
    tilt_rad = quantise_angle(math.radians(rng.uniform(*config.tilt_deg)))
    draw = int(rng.integers(config.choose_from))
    sensor = Sensor("rgbd", config.camera, height_m, tilt_rad)
    solids = [solid for item in scene.objects for solid in item.solids]
    outline = max(scene.rooms, key=lambda room: room.area_m2).outline_xy
    floor = _floor_points(outline, config.spacing_m)
    outskirts = _outskirts(outline, config)
    clear = [p[_is_clear(p, height_m, solids, config.clearance_m)] for p in (outskirts, floor)]
    positions = next((p for p in clear if len(p)), outskirts)  # a room full to the brim still has a camera
    seen = np.array([_seen_share(floor, position, heading, config) for position in positions])
    order = np.argsort(-seen, kind="stable")
    chosen: list[FloatArray] = []
    fallback: list[FloatArray] = []
    for k in order:
        pose = planar(float(positions[k, 0]), float(positions[k, 1]), heading)
        bucket = fallback if _is_near(solids, pose, sensor, config) else chosen
        bucket.append(pose)
        if len(chosen) == config.choose_from:
            break
    candidates = (chosen + fallback)[: config.choose_from]
    return candidates[draw % len(candidates)], sensor


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


def _is_clear(positions: FloatArray, height_m: float, solids: list[ConvexSolid], clearance_m: float) -> FloatArray:
    points = np.column_stack([positions, np.full(len(positions), height_m)])
    hit = np.zeros(len(points), dtype=bool)
    for solid in solids:
        hit |= solid.contains(points, margin_m=-clearance_m)
    return np.asarray(~hit)


def _floor_points(room_xy: FloatArray, spacing_m: float) -> FloatArray:
    low, high = room_xy.min(axis=0), room_xy.max(axis=0)
    points = np.stack(np.meshgrid(*(np.arange(a, b, spacing_m) for a, b in zip(low, high, strict=True))), axis=-1)
    points = points.reshape(-1, 2)
    return np.asarray(points[contains(room_xy, points)])


def _seen_share(floor: FloatArray, position: FloatArray, heading: float, config: CameraConfig) -> float:
    """Share of the floor inside the horizontal field of view, furniture left out."""
    offset = floor - position
    angle = np.arctan2(offset[:, 1], offset[:, 0]) - heading
    off_axis = np.abs((angle + math.pi) % (2 * math.pi) - math.pi)
    return float(np.mean(off_axis < math.atan(config.width_px / 2 / config.focal_px)))


def _is_near(solids: list[ConvexSolid], scene_T_episode: FloatArray, sensor: Sensor, config: CameraConfig) -> bool:
    """Whether too much of a thumbnail of the view is close to the camera."""
    small = config.camera.scaled(THUMBNAIL)
    owner = np.zeros(len(solids), dtype=np.int32)
    image = cast(small, scene_T_episode @ sensor.world_T_camera, pack_solids(solids), owner, 1)
    return bool(np.mean(image.depth_m < config.near_m) > config.near_share)
