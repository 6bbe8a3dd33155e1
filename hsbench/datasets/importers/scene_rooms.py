"""Where the floor of an imported scene lies, which rooms stand on it, and how high they are; every guess is said."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers.scene_labels import LabelTable
from hsbench.datasets.importers.scene_objects import Group, snapped
from hsbench.errors import DataError, SchemaError
from hsbench.geometry.footprints import boundary_loops, hull
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.polygons import signed_area
from hsbench.geometry.triangle_meshes import double_areas, outward, pieces, weld
from hsbench.schema.scene import Room
from hsbench.typing import FloatArray, Int32Array

LEVEL = 0.9  # cosine of the steepest slope of what counts as horizontal: 26 degrees
SAME_LEVEL_M = 0.02  # tiles, thresholds and rugs worked into a floor
MIN_ROOM_M2 = 1.0
UNKNOWN_ROOM = "room"


def horizontal_share(floors: list[Group]) -> float:
    """Share of the area of floors that is horizontal."""
    vertices, triangles = _triangles(floors)
    normals = double_areas(vertices, triangles)
    area = np.linalg.norm(normals, axis=1)
    return float(area[np.abs(normals[:, 2]) > LEVEL * area].sum() / max(area.sum(), 1e-12))


def floor_level(floors: list[Group]) -> float:
    """Height of the floors: the median, by area, of what faces up (or down, if nothing does); 0 without a floor."""
    if not floors:
        return 0.0
    vertices, triangles = _top(floors)
    return _median_height(vertices, triangles)


def find_rooms(
    table: LabelTable, extras: Mapping[str, Any], floors: list[Group], path: Path
) -> tuple[tuple[Room, ...], list[str]]:
    """(rooms, notes): as the table says, else as a file of ours says, else the outlines of the floors' upper faces."""
    if table.rooms:
        return table.rooms, []
    if "rooms" in extras:
        try:
            stated = tuple(
                Room(str(entry["room_type"]), np.array(entry["outline_xy"], dtype=np.float64))
                for entry in extras["rooms"]
            )
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(f"{path}: extras rooms: {error}; expected room_type and outline_xy") from error
        return stated, ["rooms are from the extras of the file"]
    if not floors:
        raise DataError(f"{path}: no node is a floor; label one, or give rooms with their outlines in a JSON table")
    vertices, triangles = _top(floors)
    level = _median_height(vertices, triangles)
    heights = vertices[triangles][:, :, 2].mean(axis=1)
    flat, faces = weld(vertices * [1, 1, 0], triangles[np.abs(heights - level) <= SAME_LEVEL_M])
    outlines = [loop for loop in boundary_loops(flat, faces) if signed_area(loop) >= MIN_ROOM_M2]
    how = "the outline of the floor"
    if not outlines:
        outlines, how = [hull(flat[:, :2])], "the convex hull of the floor, whose outline is broken"
    try:
        rooms = tuple(Room(UNKNOWN_ROOM, quantise_m(outline)) for outline in outlines)
    except SchemaError as error:
        raise DataError(f"{path}: the floor gives no room ({error}); give rooms in a JSON table") from error
    areas = ", ".join(f"{room.area_m2:.1f} m2 with {len(room.outline_xy)} corners" for room in rooms)
    return rooms, [f"rooms are estimated: {how} ({areas}); state them in a JSON table if walls stand on it"]


def ceiling_height(table: LabelTable, extras: Mapping[str, Any], groups: list[Group]) -> tuple[float, str]:
    """(height_m, note): as the table or a file of ours says, else the ceiling's underside, the walls' or all's top."""
    for stated, where in ((table.height_m, "the table"), (extras.get("height_m"), "the extras of the file")):
        if isinstance(stated, int | float):
            return float(stated), f"height {stated:g} m, from {where}"
    for category, what in (("ceiling", "the underside of the ceiling"), ("wall", "the top of the walls")):
        chosen = [group for group in groups if group.category == category]
        if chosen:
            vertices, triangles = _triangles(chosen)
            z = _lowest_level(vertices, triangles) if category == "ceiling" else float(vertices[:, 2].max())
            height = float(quantise_m(z))
            if height > 0:
                return height, f"height {height:.2f} m: {what}"
    height = float(quantise_m(max(mesh.vertices[:, 2].max() for group in groups for mesh in group.meshes)))
    if height <= 0:
        raise DataError("nothing reaches above the floor; label walls or a ceiling, or give height_m in a JSON table")
    return height, f"height {height:.2f} m: the top of everything, for want of a ceiling or walls"


def _triangles(groups: list[Group]) -> tuple[FloatArray, Int32Array]:
    """(V, 3) and (T, 3) of all meshes of some groups, rounded and welded, closed pieces facing outward."""
    meshes = [mesh for group in groups for mesh in group.meshes]
    start = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    every = np.concatenate([mesh.triangles + s for mesh, s in zip(meshes, start[:-1], strict=True)]).astype(np.int32)
    vertices, triangles = weld(snapped(np.concatenate([mesh.vertices for mesh in meshes])), every)
    return vertices, outward(triangles, pieces(vertices, triangles))


def _top(floors: list[Group]) -> tuple[FloatArray, Int32Array]:
    """The horizontal triangles of floors that face up; if none does, those that face down, turned."""
    vertices, triangles = _triangles(floors)
    normals = double_areas(vertices, triangles)
    length = np.linalg.norm(normals, axis=1)
    up = triangles[normals[:, 2] > LEVEL * length]
    return (vertices, up) if len(up) else (vertices, triangles[normals[:, 2] < -LEVEL * length][:, ::-1])


def _median_height(vertices: FloatArray, triangles: Int32Array) -> float:
    """Median height of triangles, weighted by area, rounded to .1 mm."""
    heights = vertices[triangles][:, :, 2].mean(axis=1)
    area = np.linalg.norm(double_areas(vertices, triangles), axis=1)
    order = np.argsort(heights, kind="stable")
    total = np.cumsum(area[order])
    return float(quantise_m(heights[order][np.searchsorted(total, total[-1] / 2)])) if len(order) else 0.0


def _lowest_level(vertices: FloatArray, triangles: Int32Array) -> float:
    """The height of the lower face of a slab or of a sheet, whichever way it faces."""
    normals = double_areas(vertices, triangles)
    level = np.abs(normals[:, 2]) > LEVEL * np.linalg.norm(normals, axis=1)
    down = level & (normals[:, 2] < 0)
    chosen = triangles[down if down.any() else level]
    return _median_height(vertices, chosen) if len(chosen) else float(vertices[:, 2].min())
