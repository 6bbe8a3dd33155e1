"""Truth of an RGB-D capture from annotated boxes: scene, voxels, and what is visible and evident of each object.

Solid space, amodal pixels and evidence are those of generated data (``hsbench.truth``), computed from the boxes. What
the camera saw is taken from the capture itself: states of voxels from its depth, and a pixel shows an object only where
nothing nearer than the object's box was measured, annotated or not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_dilation

from hsbench.datasets.annotation.backgrounds import background_depth
from hsbench.datasets.annotation.boxes import FLOOR_M, WALL_M, AnnotatedBox, BoxLabels, in_episode_frame
from hsbench.datasets.annotation.swept import swept_by_joints
from hsbench.errors import DataError
from hsbench.geometry import convex
from hsbench.geometry.cameras import CentralCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.polygons import distance
from hsbench.geometry.rays import RayImage
from hsbench.geometry.transforms import apply, planar
from hsbench.schema.episode import Episode, EpisodeTruth
from hsbench.schema.events import EventTable
from hsbench.schema.occupancy import AffordanceTruth, ObjectTruth, OccupancyTruth
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.schema.states import VoxelState
from hsbench.truth.affordance import affordance_truth
from hsbench.truth.objects import object_truth
from hsbench.truth.occupancy import solid_occupancy
from hsbench.truth.sight import depth_states, inside_room, ray_image, surface_margin_m
from hsbench.truth.walkable import walk_map
from hsbench.typing import BoolArray, Float32Array

COLOUR = (160, 160, 160)
SHELL_M = 0.1
"""Thickness of the floor, ceiling and walls that are added."""

MIN_EXPLAINED = 0.5
"""Of the measured points in the room; with less, boxes and camera are not in one frame."""


@dataclass(frozen=True, eq=False)
class BoxTruth:
    """Truth of an episode from boxes. explained: share of the points measured in the room, within the grid, that lie
    within a voxel of something solid; 1 where nothing was forgotten and every box is where its object is.
    affordance: None where it is not asked of the boxes.
    """

    scene: Scene
    occupancy: OccupancyTruth
    objects: ObjectTruth
    explained: float
    affordance: AffordanceTruth | None = None


def box_truth(
    labels: BoxLabels, episode: Episode, scene_id: str, grid: VoxelGrid, affordance: bool = False
) -> BoxTruth:
    """The truth that boxes give of an RGB-D episode, on a grid in its episode frame.

    affordance: also compute what the boxes and their parts afford, by geometry; without a door in the boxes, people are
    taken to be on all of the free floor.
    Raises DataError where the episode has no depth or its camera no height, a box or the camera is outside of
    the room, or less than ``MIN_EXPLAINED`` of the measured points lie on what is annotated.
    """
    sensor, camera = episode.placed_sensor, episode.sensor.camera
    if sensor.kind != "rgbd" or sensor.height_m is None or not isinstance(camera, CentralCamera):
        raise DataError(
            f"episode {episode.episode_id} is of a {sensor.kind} camera at height {sensor.height_m}; boxes need an"
            " RGB-D camera of known height"
        )
    depth_m = background_depth(episode)
    if depth_m.shape != (camera.height_px, camera.width_px):
        raise DataError(
            f"episode {episode.episode_id} has depth of {depth_m.shape[1]} x {depth_m.shape[0]} px; expected"
            f" {camera.width_px} x {camera.height_px} as its camera says"
        )
    scene = scene_of(in_episode_frame(labels, sensor.height_m), scene_id)
    away = float(distance(scene.rooms[0].outline_xy, np.zeros(2)))
    if away > WALL_M:
        raise DataError(
            f"episode {episode.episode_id}: its camera stands at (0, 0), {away:.2f} m outside of room.outline_xy;"
            " expected inside or in a wall (the episode frame begins below the camera)"
        )
    semantic, instance = solid_occupancy(scene, grid)
    state = depth_states(grid, camera, sensor.world_T_camera, depth_m)
    within = inside_room(scene, grid, sensor.world_T_camera[:2, 3])
    state[~within] = VoxelState.OUTSIDE_ROOM
    occupancy = OccupancyTruth(
        grid,
        semantic,
        instance,
        state,
        np.zeros(grid.shape, dtype=np.bool_),
        swept_by_joints(episode.poses, episode.t0_ns, grid),
    )
    explained = _explained(occupancy.solid, episode, depth_m, grid, scene)
    if explained < MIN_EXPLAINED:
        raise DataError(
            f"episode {episode.episode_id}: {explained:.0%} of the points measured in the room lie on something"
            f" annotated; expected at least {MIN_EXPLAINED:.0%} (boxes in another frame, or most objects missing?)"
        )
    image = _seen(ray_image(scene, camera, sensor.world_T_camera), depth_m, grid.voxel_m)
    touched = [box.object_id for box in labels.boxes if box.touched]
    objects = object_truth(scene, image, occupancy, _touches(touched))
    if not affordance:
        return BoxTruth(scene, occupancy, objects, explained)
    has_door = any(item.category_name == "door" for item in scene.objects)
    plan = affordance_truth(scene, grid, walk=None if has_door else walk_map(scene))
    return BoxTruth(scene, occupancy, objects, explained, plan)


def scene_of(labels: BoxLabels, scene_id: str) -> Scene:
    """The scene of boxes in the episode frame, with floor, ceiling and a wall along each side of the room.

    Objects keep their ids; floor, ceiling and walls have the lowest ids that are free.
    """
    outline = quantise_m(labels.outline_xy)
    outline = outline[(outline != np.roll(outline, 1, axis=0)).any(axis=1)]
    objects = [_object(box) for box in labels.boxes]
    taken = {item.object_id for item in objects}
    free = iter(n for n in range(1, len(objects) + len(outline) + 3) if n not in taken)
    low, high = outline.min(axis=0) - SHELL_M, outline.max(axis=0) + SHELL_M
    x, y = quantise_m((low + high) / 2).tolist()
    size = high - low
    for name, z in (("floor", -SHELL_M), ("ceiling", labels.height_m)):
        slab = convex.box((size[0], size[1], SHELL_M), (0.0, 0.0, SHELL_M / 2))
        objects.append(
            SceneObject(next(free), name, planar(x, y, 0.0, float(quantise_m(z))), (Part(name, COLOUR, solid=slab),))
        )
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        objects.append(_wall(next(free), start.tolist(), end.tolist(), labels.height_m))
    rooms = (Room(labels.room_type, outline),)
    ordered = tuple(sorted(objects, key=lambda item: item.object_id))
    return Scene(scene_id, rooms, labels.height_m, ordered, "annotated")


def with_boxes(truth: EpisodeTruth | None, found: BoxTruth) -> EpisodeTruth:
    """What was known of an episode, with this in place of what it had of the same."""
    known = replace(truth or EpisodeTruth(), scene=found.scene, occupancy=found.occupancy, objects=found.objects)
    return known if found.affordance is None else replace(known, affordance=found.affordance)


def _object(box: AnnotatedBox) -> SceneObject:
    x, y, z = box.centre_m.tolist()
    pose = planar(x, y, box.yaw_rad, float(quantise_m(z - box.size_m[2] / 2)))
    parts = [
        Part(p.name, COLOUR, p.role, convex.box(tuple(p.size_m.tolist()), tuple(p.centre_m.tolist())))
        for p in box.parts
    ]
    if not parts:
        solid = convex.box(tuple(box.size_m.tolist()), (0.0, 0.0, float(box.size_m[2]) / 2))
        parts = [Part("box", COLOUR, solid=solid)]
    return SceneObject(box.object_id, box.category, pose, tuple(parts), box.movable)


def _wall(object_id: int, start: list[float], end: list[float], height_m: float) -> SceneObject:
    """Along a side of a counter-clockwise outline: origin in the middle of its inner face, y outwards."""
    (x0, y0), (x1, y1) = start, end
    length = float(quantise_m(math.hypot(x1 - x0, y1 - y0)))
    yaw = quantise_angle(math.atan2(y0 - y1, x0 - x1))  # x runs backwards along the outline: y points outwards
    solid = convex.box((length, SHELL_M, height_m), (0.0, SHELL_M / 2, height_m / 2))
    pose = planar(float(quantise_m((x0 + x1) / 2)), float(quantise_m((y0 + y1) / 2)), yaw)
    return SceneObject(object_id, "wall", pose, (Part("wall", COLOUR, solid=solid),))


def _seen(image: RayImage, depth_m: Float32Array, voxel_m: float) -> RayImage:
    """The image less the pixels where something was measured before what the boxes show there."""
    hidden = (depth_m > 0) & (depth_m < image.depth_m - surface_margin_m(voxel_m))
    return RayImage(image.depth_m, np.where(hidden, -1, image.owner).astype(np.int32), image.amodal_px)


def _explained(solid: BoolArray, episode: Episode, depth_m: Float32Array, grid: VoxelGrid, scene: Scene) -> float:
    """Share of the measured points in the room and the grid that lie within a voxel of a solid one.

    Points as near as that to floor, ceiling or walls are left out: they say nothing of the boxes.
    """
    sensor = episode.placed_sensor
    points = apply(sensor.world_T_camera, episode.sensor.camera.unproject(depth_m)[depth_m > 0])
    index, inside = grid.index(points)
    shell = Scene(scene.scene_id, scene.rooms, scene.height_m, tuple(o for o in scene.objects if _is_shell(o)))
    near_shell = binary_dilation(solid_occupancy(shell, grid)[0] > 0, np.ones((3, 3, 3)))
    near_shell[:, :, grid.axis_centres(2) < FLOOR_M] = True
    within = inside_room(scene, grid, sensor.world_T_camera[:2, 3])
    kept = index[inside]
    kept = kept[within[tuple(kept.T)] & ~near_shell[tuple(kept.T)]]
    near = binary_dilation(solid, np.ones((3, 3, 3)))
    return float(near[tuple(kept.T)].mean()) if len(kept) else 1.0


def _is_shell(item: SceneObject) -> bool:
    return item.category_name in ("floor", "ceiling", "wall")


def _touches(object_ids: list[int]) -> EventTable:
    """Events that say no more than that each of some objects was touched."""
    n = len(object_ids)
    none = np.zeros(n, dtype=np.int64)
    ids = np.array(object_ids, dtype=np.int32)
    return EventTable(ids * 0, ("touch",) * n, ids, ("",) * n, none, none, ("annotated",) * n)
