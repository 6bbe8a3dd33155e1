"""Tiny lived-in rooms in memory: upright figures walk, sit and reach, a 360 or a wall camera watches, truth is known.

One rectangle of the floor is walked on, a square beside it is sat on, and a strip along its edge is reached for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsbench.baselines.lift import ANKLE, HIP, NECK
from hsbench.datasets.dataset import Dataset
from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera, world_T_camera
from hsbench.geometry.convex import span
from hsbench.geometry.transforms import apply, invert
from hsbench.schema import (
    AffordanceTruth,
    Episode,
    EpisodeTruth,
    OccupancyTruth,
    Part,
    PoseTable,
    Room,
    Scene,
    SceneObject,
    Sensor,
    TruePoseTable,
)
from hsbench.schema.episode import Frame, FrameList
from hsbench.schema.occupancy import AffordanceVoxels
from hsbench.schema.poses import JointState
from hsbench.schema.skeletons import COCO_18
from hsbench.schema.states import Action
from hsbench.tasks.scene_reconstruction import GRID

STEP_NS = 100_000_000
SENSORS = {
    "activity-360": Sensor("equirectangular", EquirectangularCamera(512, 256), 1.5),
    "timelapse-activity": Sensor("monocular", PinholeCamera(160, 120, 90.0, 90.0, 80.0, 60.0), 2.2, 0.5),
}
SEATED_M = 0.45  # how much lower a seated body is
HEIGHTS = {"neck": NECK, "hip": HIP, "ankle": ANKLE, "knee": 0.285 * 1.7, "wrist": 0.9, "elbow": 1.1, "shoulder": NECK}
ACROSS_M = {"hip": 0.12, "ankle": 0.1, "knee": 0.1, "wrist": 0.25, "elbow": 0.25, "shoulder": 0.18}


def figure(xy: Any, sits: bool = False, reach_m: float = 0.0) -> np.ndarray:
    """(18, 3) flat upright COCO-18 figure at a place on the floor, facing the origin; a seated one is lower."""
    xy = np.asarray(xy, dtype=np.float64)
    left = np.array([-xy[1], xy[0]]) / np.linalg.norm(xy)
    joints = np.zeros((18, 3))
    for k, name in enumerate(COCO_18.names):
        part = name.split("_")[0]
        side = 1.0 if name.endswith("left") else -1.0 if name.endswith("right") else 0.0
        across = ACROSS_M.get(part, 0.05) + (reach_m if name == "wrist_left" else 0.0)
        z = HEIGHTS.get(part, NECK + 0.15)
        low = SEATED_M if sits and part != "ankle" else 0.0
        joints[k] = [*(xy + side * across * left), max(z - low, ANKLE)]
    return joints


def seen(sensor: Sensor, joints: np.ndarray, tracks: np.ndarray | None = None) -> PoseTable:
    """Figures (n, 18, 3) as a detector without error would see them, a tenth of a second apart."""
    placed = world_T_camera(sensor.height_m, sensor.tilt_rad, sensor.roll_rad)
    pixels, _ = sensor.camera.project(apply(invert(placed), joints))
    known = sensor.camera.contains(pixels)
    pixels = np.where(known[..., None], pixels, np.nan).astype(np.float32)
    n = len(joints)
    return PoseTable(
        COCO_18.name,
        np.arange(n, dtype=np.int64) * STEP_NS,
        np.ones(n, np.int32) if tracks is None else tracks.astype(np.int32),
        np.where(known, 2, 0).astype(np.uint8),
        joints_px=pixels,
    )


def labels_at(xy: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """(...) bits of the labels at places on the floor of the room whose walked rectangle begins at ``corner``."""
    x, y = np.moveaxis(xy - corner, -1, 0)
    walked = (x >= 0) & (x < 1.5) & (y >= 0) & (y < 1.5)
    sat = (x >= 1.5) & (x < 2.1) & (y >= 0) & (y < 0.6)
    reached = (x >= 0) & (x < 1.5) & (y >= 1.5) & (y < 1.9)
    return (walked * 1 | sat * 2 | reached * 4).astype(np.uint8)


def lived(dataset: str, number: int, poses: int = 400) -> Episode:
    """An episode; the room lies differently about the camera for each number."""
    rng = np.random.default_rng(number)
    sensor = SENSORS[dataset]
    corner = rng.uniform([1.2, -2.0], [2.6, 0.5])
    sits = rng.random(poses) < 0.3
    xy = corner + np.where(
        sits[:, None], rng.uniform([1.6, 0.1], [2.0, 0.5], (poses, 2)), rng.uniform(0, 1.5, (poses, 2))
    )
    reaches = np.arange(poses) % 4 == 0
    joints = np.stack([figure(p, s, 0.4 * r) for p, s, r in zip(xy, sits, reaches, strict=True)])
    people = PoseTable(
        COCO_18.name,
        np.arange(poses, dtype=np.int64) * STEP_NS,
        np.ones(poses, np.int32),
        np.full((poses, 18), JointState.TRACKED, np.uint8),
        joints.astype(np.float32),
    )
    action = np.where(reaches, Action.INTERACT, np.where(sits, Action.SIT, Action.STAND)).astype(np.uint8)
    given = replace(sensor, height_m=None) if sensor.kind == "equirectangular" else sensor
    rgb = rng.integers(0, 256, (sensor.camera.height_px, sensor.camera.width_px, 3), dtype=np.uint8)
    return Episode(
        f"lived-{number}",
        dataset,
        given,
        FrameList((Frame(0, rgb),)),
        seen(sensor, joints),
        0,
        poses * STEP_NS,
        truth=replace(_truth(sensor, corner), poses=TruePoseTable(people, action, np.arange(poses))),
    )


def _truth(sensor: Sensor, corner: np.ndarray) -> EpisodeTruth:
    if sensor.kind == "monocular":
        rays = sensor.camera.rays() @ sensor.world_T_camera[:3, :3].T
        down = rays[..., 2] < 0
        on_floor = rays[..., :2] * np.where(down, sensor.height_m / np.where(down, -rays[..., 2], 1.0), 0.0)[..., None]
        return EpisodeTruth(view_affordance=np.where(down, labels_at(on_floor, corner), 0).astype(np.uint8))
    plan = labels_at(GRID.centres()[:, :, 0, :2], corner)
    surfaces, semantic = np.zeros(GRID.shape, np.uint8), np.zeros(GRID.shape, np.uint8)
    surfaces[:, :, 0], surfaces[:, :, 9], surfaces[:, :, 15] = plan & 1, plan & 2, plan & 4
    semantic[:, :, :9] = np.where(plan & 2, 9, 0)[..., None]  # a chair
    low, high = corner - 0.3, corner + 2.4
    outline = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    x, y = np.moveaxis(GRID.centres()[:, :, 0, :2], -1, 0)
    out = np.maximum(np.maximum(low[0] - x, x - high[0]), np.maximum(low[1] - y, y - high[1]))
    semantic[(out > 0) & (out < 0.1)] = 3  # walls
    occupancy = OccupancyTruth(
        GRID,
        semantic,
        semantic.astype(np.uint16),
        np.ones(GRID.shape, np.uint8),
        np.zeros(GRID.shape, np.bool_),
        np.full(GRID.shape, np.inf, np.float32),
    )
    wall = SceneObject(1, "wall", np.eye(4), (Part("body", (9, 9, 9), None, span((-3, -3, 0), (-2.9, 3, 2.4))),))
    scene = Scene("lived", (Room("living", outline),), 2.4, (wall,), "plain")
    affordance = AffordanceTruth(
        np.ascontiguousarray(plan[::-1, ::-1]),
        np.zeros(plan.shape, np.bool_),
        voxels=AffordanceVoxels(GRID, surfaces),
    )
    return EpisodeTruth(scene=scene, occupancy=occupancy, affordance=affordance, sensor=sensor)


@dataclass(frozen=True)
class Lived(Dataset):
    """A data set in memory; inputs only, unless truth is asked for."""

    episodes: tuple[Episode, ...] = ()

    @property
    def name(self) -> str:
        return self.episodes[0].dataset

    def _read(self, row: dict[str, Any]) -> Episode:
        episode = self.episodes[row["number"]]
        return episode if self.truth else replace(episode, truth=None)


def lived_in(episodes: list[Episode], root: Any, truth: bool = False) -> Lived:
    """A data set of episodes."""
    rows = tuple(
        {"episode_id": e.episode_id, "scene_id": e.episode_id, "split": "val", "number": k}
        for k, e in enumerate(episodes)
    )
    return Lived(root, rows, truth, episodes=tuple(episodes))
