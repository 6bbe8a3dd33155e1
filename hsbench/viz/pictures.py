"""Pictures of an episode and of predictions: depth, activity maps seen from above, voxels. All (h, w, 3) uint8 rgb."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from hsbench.errors import DataError
from hsbench.geometry.activity_map import rasterise
from hsbench.geometry.grids import VoxelGrid
from hsbench.io.atomic import write_bytes
from hsbench.io.images import encode_png
from hsbench.schema.categories import CATEGORIES, STRUCTURE
from hsbench.schema.episode import Episode
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.schema.poses import JointState
from hsbench.schema.states import VoxelState
from hsbench.typing import AnyArray, BoolArray, Float32Array, FloatArray, UInt8Array
from hsbench.viz.voxels import draw_voxels, palette

HIT, FALSE, MISSED, SEEN = (74, 160, 106), (214, 84, 66), (78, 121, 196), (196, 196, 190)
"""Right, wrongly claimed, missed, and visible surface."""
STAND_TINT, SIT_TINT = (38, 120, 190), (222, 120, 36)
TOP_M = 2.0  # what is scored reaches up to here
MAP_RADIUS_M, MAP_DELTA = 0.22, 1.0 / 15.0


def depth_picture(depth_m: AnyArray, far_m: float | None = None) -> UInt8Array:
    """(h, w) metres -> near is bright, far is dark, none is black; ``far_m`` defaults to the 99th percentile."""
    depth = np.asarray(depth_m, dtype=np.float64)
    valid = depth > 0
    far = far_m or (float(np.percentile(depth[valid], 99)) if valid.any() else 1.0)
    scaled = (255 * (1 - np.clip(depth / far, 0, 1))).astype(np.uint8)
    picture = cv2.cvtColor(cv2.applyColorMap(scaled, cv2.COLORMAP_VIRIDIS), cv2.COLOR_BGR2RGB)
    picture[~valid] = 0
    return np.asarray(picture, dtype=np.uint8)


def instance_picture(instance: AnyArray) -> UInt8Array:
    """(h, w) ids -> a colour an id, spread around the colour wheel; 0 is black."""
    ids = np.unique(instance)
    table = np.zeros((int(ids.max()) + 1, 3), dtype=np.uint8)
    for i in ids[ids > 0]:
        hue = (int(i) * 0.618034) % 1.0  # steps of the golden ratio keep neighbouring ids apart
        table[i] = [round(255 * c) for c in colorsys.hsv_to_rgb(hue, 0.45 + 0.3 * (int(i) % 3) / 2, 0.9)]
    return np.asarray(table[instance])


def plan_picture(
    grid: VoxelGrid, stand: Float32Array, sit: Float32Array, outline: BoolArray | None = None, scale: int = 4
) -> UInt8Array:
    """Maps (nx, ny) on a grid's floor plan as a picture: camera below, x up, y to the left.

    stand is blue, sit orange; ``outline`` (nx, ny) bool draws what is furniture as a grey wash.
    """
    picture = np.full((*stand.shape, 3), 255.0)
    if outline is not None:
        picture[outline] = (214, 212, 206)
    for values, tint in ((stand, STAND_TINT), (sit, SIT_TINT)):
        weight = values[..., None] * 0.85
        picture = picture * (1 - weight) + np.array(tint) * weight
    picture = _north_up(picture.round().astype(np.uint8), scale)
    return _mark_camera(picture, grid, scale)


def _north_up(plan: UInt8Array, scale: int) -> UInt8Array:
    """Index order [x, y] -> rows from far to near, columns from left (+y) to right."""
    return np.asarray(np.repeat(np.repeat(plan[::-1, ::-1], scale, axis=0), scale, axis=1))


def _mark_camera(picture: UInt8Array, grid: VoxelGrid, scale: int) -> UInt8Array:
    """A small black triangle at the camera, which stands at (0, 0) looking up the picture."""
    canvas = np.ascontiguousarray(picture)
    column = round(((grid.origin_m[1] + grid.shape[1] * grid.voxel_m) / grid.voxel_m) * scale)
    row = round((grid.shape[0] + grid.origin_m[0] / grid.voxel_m) * scale) - 2
    corners = np.array(
        [[column, row - 4 * scale], [column - 2 * scale, row], [column + 2 * scale, row]], dtype=np.int32
    )
    cv2.fillPoly(canvas, [corners], (30, 30, 30))
    return np.asarray(canvas, dtype=np.uint8)


def footprint(occupancy: OccupancyTruth) -> BoolArray:
    """(nx, ny) bool: columns with furniture or walls below the height that is scored."""
    top = int(TOP_M / occupancy.grid.voxel_m)
    return np.asarray((occupancy.semantic[:, :, :top] > 0).any(axis=2))


def truth_voxels(occupancy: OccupancyTruth) -> UInt8Array:
    """The solid furniture of a room, coloured by category."""
    labels = np.where(_drawn(occupancy), occupancy.semantic, 0).astype(np.uint8)
    return draw_voxels(_on_floor(labels, occupancy), palette(_category_colours() | {255: (232, 228, 220)}))


def prediction_voxels(occupancy: OccupancyTruth, occupied: BoolArray) -> UInt8Array:
    """A prediction against truth in occluded space: green right, red wrongly solid, blue missed, grey visible."""
    scored = _drawn(occupancy)
    occluded = scored & (occupancy.state == VoxelState.OCCLUDED)
    labels = np.zeros(occupied.shape, dtype=np.uint8)
    labels[scored & (occupancy.state == VoxelState.SURFACE) & occupancy.solid] = 4
    labels[occluded & occupied & occupancy.solid] = 1
    labels[occluded & occupied & ~occupancy.solid] = 2
    labels[occluded & ~occupied & occupancy.solid] = 3
    colours = palette({1: HIT, 2: FALSE, 3: MISSED, 4: SEEN, 255: (232, 228, 220)})
    return draw_voxels(_on_floor(labels, occupancy), colours)


def _drawn(occupancy: OccupancyTruth) -> BoolArray:
    """What is drawn: inside the room, below the scored height, no structure."""
    below = occupancy.grid.axis_centres(2) <= TOP_M
    structure = np.isin(occupancy.semantic, list(STRUCTURE))
    return np.asarray((occupancy.state != VoxelState.OUTSIDE_ROOM) & ~structure & below)


def _on_floor(labels: UInt8Array, occupancy: OccupancyTruth) -> UInt8Array:
    """Labels with a sheet of floor (label 255) under them where the room is."""
    floor = np.where((occupancy.state[:, :, :2] != VoxelState.OUTSIDE_ROOM).any(axis=2), 255, 0).astype(np.uint8)
    return np.concatenate([floor[:, :, None], labels], axis=2)


def _category_colours() -> dict[int, tuple[int, int, int]]:
    colours = {}
    for item in CATEGORIES:
        red, green, blue = colorsys.hls_to_rgb((item.category_id * 0.618034) % 1.0, 0.62, 0.45)
        colours[item.category_id] = (round(255 * red), round(255 * green), round(255 * blue))
    return colours


def observed_map(episode: Episode, grid: VoxelGrid) -> Float32Array:
    """(nx, ny) where people were seen: every pose with a tracked spine adds to a body disc, up to 1.

    Raises DataError for an episode without 3D poses.
    """
    if episode.poses is None or episode.poses.joints_m is None:
        raise DataError(f"episode {episode.episode_id} has no 3D poses to draw")
    spine = episode.poses.layout.index("spine_mid")
    seen = episode.poses.joint_state[:, spine] == JointState.TRACKED
    positions = episode.poses.joints_m[seen, spine, :2].astype(np.float64)
    origin = (grid.origin_m[0], grid.origin_m[1])
    return rasterise(positions, origin, (grid.shape[0], grid.shape[1]), grid.voxel_m, MAP_RADIUS_M, MAP_DELTA)


def save_activity_map(path: Path, episode: Episode) -> None:
    """Draw where people were seen, from above, on a floor plan fitted to them, into a PNG file."""
    if episode.poses is None or episode.poses.joints_m is None:
        raise DataError(f"episode {episode.episode_id} has no 3D poses to draw")
    points: FloatArray = episode.poses.joints_m[episode.poses.joint_state == JointState.TRACKED].astype(np.float64)
    cell, margin = 0.05, 0.5
    far = float(points[:, 0].max()) + margin if len(points) else 1.0
    side = float(np.abs(points[:, 1]).max()) + margin if len(points) else 1.0
    grid = VoxelGrid((0.0, -side, 0.0), (int(far / cell) + 1, int(2 * side / cell) + 1, 1), cell)
    stand = observed_map(episode, grid)
    write_bytes(path, encode_png(plan_picture(grid, stand, np.zeros_like(stand))))


def beside(pictures: Sequence[UInt8Array], gap_px: int = 6) -> UInt8Array:
    """Pictures of one height side by side on white."""
    height = pictures[0].shape[0]
    gap = np.full((height, gap_px, 3), 255, dtype=np.uint8)
    row: list[UInt8Array] = []
    for k, picture in enumerate(pictures):
        row += [gap, picture] if k else [picture]
    return np.concatenate(row, axis=1)


def fitted(picture: UInt8Array, height_px: int) -> UInt8Array:
    """A picture scaled to a height."""
    width_px = round(picture.shape[1] * height_px / picture.shape[0])
    return np.asarray(cv2.resize(picture, (width_px, height_px), interpolation=cv2.INTER_AREA), dtype=np.uint8)
