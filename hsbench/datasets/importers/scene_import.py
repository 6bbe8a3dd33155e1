"""3D scenes as scenes of ours: a file and its labels in, rooms and objects in metres with z up and the floor at 0 out.

The steps: read (``scene_placement``), turn upright and scale, group by labels (``scene_objects``), judge whether units
and axes can be right, put the floor at z = 0, find the rooms (``scene_rooms``), build the objects.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hsbench.datasets.importers.scene_labels import LabelTable
from hsbench.datasets.importers.scene_objects import Group, build_objects, group_nodes
from hsbench.datasets.importers.scene_placement import read_source, to_z_up, world_transforms
from hsbench.datasets.importers.scene_rooms import ceiling_height, find_rooms, floor_level, horizontal_share
from hsbench.errors import DataError
from hsbench.geometry.transforms import rigid
from hsbench.schema.scene import Scene
from hsbench.typing import FloatArray

MAX_EXTENT_M, MIN_EXTENT_M = 100.0, 0.5
"""Homes and offices are smaller than the first and larger than the second."""

USUAL_HEIGHT_M = (1.9, 6.0)
"""Of attics and halls; what lies outside is told, as no other sign may show that the units are wrong."""

LIKELY_SCALES = (0.001, 0.01, 0.0254, 0.1, 10.0, 100.0, 1000.0)
LIKELY_EXTENT_M = (2.0, 40.0)
IMPORTED = "imported"
"""The style family of what no generator made."""

MIN_HORIZONTAL = 0.5
"""Share of a floor's area that must be horizontal; of a floor on its side nothing is."""


@dataclass(frozen=True, eq=False)
class ImportedScene:
    """The scene, what its user should hear (one line each), and the files that were read."""

    scene: Scene
    notes: tuple[str, ...]
    files: tuple[Path, ...]


def import_scene(
    path: Path,
    table: LabelTable,
    scene_id: str,
    *,
    assets: Path | None = None,
    up: str | None = None,
    scale: float = 1.0,
    default: str | None = None,
) -> ImportedScene:
    """A 3D file as a scene. Raises DataError, naming the item and the likely mistake.

    assets: folder that everything the file refers to must lie in (default: the file's own). up: axis of height, ``y``
    or ``z`` (default: the format's; y for OBJ). scale: metres per unit. default: category of unlabelled nodes.
    """
    source = read_source(path, assets or path.parent)
    turn = to_z_up(up or source.up or "y") @ np.diag([scale, scale, scale, 1.0])
    scene_T_nodes = [turn @ transform for transform in world_transforms(source.nodes)]
    groups, notes = group_nodes(source.nodes, scene_T_nodes, table, default)
    if not groups:
        raise DataError(f"{path}: no node has triangles and a category; expected a furnished room")
    _check_extent(groups, scale, path)
    floors = [group for group in groups if group.category == "floor"]
    _check_up(floors, up or source.up or "y", path)
    level = floor_level(floors)
    if level:
        notes.append(f"the floor lies at z = {level:.4g} m; everything is moved so that it lies at 0")
        groups = [_lowered(group, level) for group in groups]
        floors = [group for group in groups if group.category == "floor"]
    rooms, room_notes = find_rooms(table, source.extras, floors, path)
    height_m, height_note = ceiling_height(table, source.extras, groups)
    objects = build_objects(groups)
    if source.missing_textures:
        notes.append(f"missing or unreadable, grey in their place: {', '.join(source.missing_textures)}")
    notes = [*source.notes, *notes, *room_notes, height_note]
    if not USUAL_HEIGHT_M[0] <= height_m <= USUAL_HEIGHT_M[1]:
        notes.append(f"{height_m:.2f} m is unusual for a room (if these are feet or decimetres: --scale 0.3048 or 0.1)")
    style = str(source.extras.get("style", IMPORTED))
    return ImportedScene(Scene(scene_id, rooms, height_m, objects, style), tuple(notes), source.files)


def _lowered(group: Group, level: float) -> Group:
    down = rigid(np.eye(3), (0.0, 0.0, -level))
    meshes = [replace(mesh, vertices=mesh.vertices + down[:3, 3]) for mesh in group.meshes]
    return replace(group, scene_T_node=down @ group.scene_T_node, meshes=meshes)


def _bounds(groups: list[Group]) -> tuple[FloatArray, FloatArray]:
    low = np.min([mesh.vertices.min(axis=0) for group in groups for mesh in group.meshes], axis=0)
    high = np.max([mesh.vertices.max(axis=0) for group in groups for mesh in group.meshes], axis=0)
    return low, high


def _check_extent(groups: list[Group], scale: float, path: Path) -> None:
    low, high = _bounds(groups)
    size = high - low
    if MIN_EXTENT_M <= size.max() <= MAX_EXTENT_M:
        return
    fitting = [s for s in LIKELY_SCALES if LIKELY_EXTENT_M[0] <= s * size.max() <= LIKELY_EXTENT_M[1]]
    unit = {0.001: "millimetres", 0.01: "centimetres", 0.0254: "inches"}.get(fitting[0] if fitting else 1.0, "metres")
    hint = f"--scale {fitting[0] * scale:g}" if fitting else "--scale with metres per unit"
    raise DataError(
        f"{path}: the scene measures {size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g}; expected {MIN_EXTENT_M:g} to"
        f" {MAX_EXTENT_M:g} m (are these {unit}? try {hint})"
    )


def _check_up(floors: list[Group], up: str, path: Path) -> None:
    if floors and horizontal_share(floors) < MIN_HORIZONTAL:
        raise DataError(
            f"{path}: only {horizontal_share(floors):.0%} of the floor would be horizontal with {up} up;"
            f" expected most of it (try --up {'z' if up == 'y' else 'y'})"
        )
