"""ScanNet (github.com/ScanNet/ScanNet): a scanned room as one mesh whose vertices are labelled, z up, metres.

A scan ``<id>`` is a folder of

- ``<id>_vh_clean_2.ply``: the mesh
- ``<id>_vh_clean_2.labels.ply``: the same mesh; ``label`` of a vertex is a class of NYU40, 0 where nobody knows
- ``<id>_vh_clean_2.0.010000.segs.json``: ``segIndices``, the segment of each vertex
- ``<id>.aggregation.json`` or ``<id>_vh_clean.aggregation.json``: ``segGroups`` [{objectId, segments, label}]
- ``<id>.txt``: perhaps a line ``axisAlignment = `` and 16 numbers that turn the walls along x and y

Every group becomes an object of its commonest class. What belongs to none is put together by class: the floor, the
walls, the ceiling, one ``object`` of the rest. The room is what lies under the scan: scans have no outline.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hsbench.datasets.importers import pose_json
from hsbench.datasets.importers.ply import read_ply
from hsbench.datasets.importers.scene_import import IMPORTED, USUAL_HEIGHT_M, ImportedScene
from hsbench.datasets.importers.scene_labels import LabelTable
from hsbench.datasets.importers.scene_objects import build_objects, group_nodes
from hsbench.datasets.importers.scene_rooms import ceiling_height
from hsbench.datasets.importers.scene_source import Rgb, SourceMesh, SourceNode
from hsbench.datasets.importers.scene_to_folder import require_free, store_scene
from hsbench.datasets.importers.scene_truth import SceneTruth
from hsbench.datasets.importers.upright import numbers, read_text
from hsbench.errors import DataError, SchemaError
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import apply, is_rigid
from hsbench.schema.scene import Room, Scene
from hsbench.typing import AnyArray, FloatArray, Int32Array, IntArray

MESH, LABELS = "_vh_clean_2.ply", "_vh_clean_2.labels.ply"
SEGMENTS = "_vh_clean_2.0.010000.segs.json"
AGGREGATIONS = (".aggregation.json", "_vh_clean.aggregation.json")
ALIGNMENT = "axisAlignment"
MAX_JSON_BYTES = 64 << 20  # a scan has a few MB
MAX_GROUPS = 50_000
MAX_SEGMENTS = 20_000_000
CLASSES = 40

CATEGORY_OF_CLASS = (
    "object", "wall", "floor", "object", "bed", "chair", "sofa", "dining_table", "door", "window", "bookshelf",
    "picture", "kitchen_counter", "curtain", "desk", "shelf", "curtain", "dresser", "cushion", "mirror", "rug",
    "object", "ceiling", "books", "fridge", "television", "object", "object", "curtain", "storage_box", "whiteboard",
    "object", "night_stand", "toilet", "washbasin", "floor_lamp", "bathtub", "object", "object", "object", "object",
)  # fmt: skip
"""Category of every class of NYU40, 0 to 40. Cabinets (3) are of several kinds of ours, so they are ``object``."""

PERSON = 31
FLOOR = 2
STRUCTURE = (1, 2, 8, 9, 22)  # wall, floor, door, window, ceiling: without a group they are one thing a class
CELL_M = 0.05
CLOSED_CELLS = 5  # gaps of a scan up to twice as wide are of the room
SIMPLIFIED_M = 0.1
MAX_SIDE_M = 100.0
MAX_COORDINATE_M = 1000.0
MIN_ROOM_M2 = 1.0


@dataclass(frozen=True, eq=False)
class ScannetScan:
    """A mesh in its aligned frame. points: (V, 3) metres, z up; triangles: (T, 3); colour: (V, 3) uint8 sRGB; label:
    (V,) NYU40; group: (V,) index into ``groups``, -1 for none; groups: the raw names; files: what was read.
    """

    points: FloatArray
    triangles: Int32Array
    colour: AnyArray
    label: IntArray
    group: IntArray
    groups: tuple[str, ...]
    files: tuple[Path, ...]
    notes: tuple[str, ...] = field(default=())


def read_scannet(folder: str | Path) -> ScannetScan:
    """The scan in a folder. Raises DataError, naming the file, for what is missing, damaged, or of another mesh."""
    folder = Path(folder)
    meshes = sorted(folder.glob(f"*{MESH}")) if folder.is_dir() else []
    if len(meshes) != 1:
        raise DataError(f"{folder}: {len(meshes)} files *{MESH}; expected the folder of one scan")
    stem = meshes[0].name.removesuffix(MESH)
    aggregation = next((p for p in (folder / f"{stem}{e}" for e in AGGREGATIONS) if p.is_file()), None)
    if aggregation is None:
        raise DataError(f"{folder}: no {stem}{AGGREGATIONS[0]}; expected the things of the scan")
    mesh, labelled = read_ply(meshes[0]), read_ply(folder / f"{stem}{LABELS}")
    count = len(mesh.points)
    if len(labelled.points) != count:
        raise DataError(
            f"{folder / (stem + LABELS)}: {len(labelled.points):,} vertices; expected {count:,} as the mesh"
        )
    names = labelled.values.dtype.names or ()
    if "label" not in names or labelled.values["label"].dtype.kind not in "iu":
        raise DataError(f"{folder / (stem + LABELS)}: vertices have no whole-numbered label; expected classes of NYU40")
    label = labelled.values["label"].astype(np.int64)
    if label.min() < 0 or label.max() > CLASSES:
        raise DataError(f"{folder / (stem + LABELS)}: label {label.max()}; expected 0 to {CLASSES} (raw labels?)")
    segments = _segments(folder / f"{stem}{SEGMENTS}", count)
    group, groups = _groups(aggregation, segments)
    text = folder / f"{stem}.txt"
    alignment = _alignment(text)
    notes = () if alignment is not None else (f"no {ALIGNMENT} in {text.name}: the walls may lie askew",)
    if np.abs(mesh.points).max() > MAX_COORDINATE_M:
        raise DataError(f"{meshes[0]}: reaches {np.abs(mesh.points).max():.3g} m; expected a room (millimetres?)")
    points = mesh.points if alignment is None else apply(alignment, mesh.points)
    if not np.abs(points).max() <= 2 * MAX_COORDINATE_M:
        raise DataError(
            f"{text}: {ALIGNMENT} moves the scan by {np.abs(points).max():.3g} m; expected a turn of a room"
        )
    rgb = [channel for channel in ("red", "green", "blue") if channel in (mesh.values.dtype.names or ())]
    grey = np.full((count, 3), 150, dtype=np.uint8)
    colour = np.column_stack([mesh.values[c].astype(np.float64).clip(0, 255) for c in rgb]) if len(rgb) == 3 else grey
    candidates = (meshes[0], folder / f"{stem}{LABELS}", folder / f"{stem}{SEGMENTS}", aggregation, text)
    files = tuple(file for file in candidates if file.is_file())
    return ScannetScan(
        points, mesh.triangles, np.nan_to_num(colour).astype(np.uint8), label, group, groups, files, notes
    )


def scannet_scene(scan: ScannetScan, scene_id: str) -> ImportedScene:
    """The scan as a scene with the floor at z = 0. Raises DataError where there is no floor, or no room on it."""
    notes = list(scan.notes)
    floor = scan.points[scan.label == FLOOR]
    if not len(floor):
        raise DataError(f"scan {scene_id} has no vertex of a floor; expected class {FLOOR} somewhere")
    level = float(quantise_m(np.median(floor[:, 2])))
    points = scan.points - [0.0, 0.0, level]
    notes.append(f"the floor lies at z = {level:.4g} m; everything is moved so that it lies at 0")
    nodes = _nodes(scan, points, notes)
    groups, more = group_nodes(nodes, [np.eye(4) for _ in nodes], LabelTable({}), None)
    rooms = _rooms(points[scan.triangles], scene_id)
    notes += more
    notes.append(f"the room is what lies under the scan: {sum(room.area_m2 for room in rooms):.1f} m2")
    height_m, note = ceiling_height(LabelTable({}), {}, groups)
    notes += [note, "a scan is a surface: voxels behind it are not solid, and what nobody saw is missing"]
    if not USUAL_HEIGHT_M[0] <= height_m <= USUAL_HEIGHT_M[1]:
        notes.append(f"{height_m:.2f} m is unusual for a room (a scan often lacks its ceiling)")
    scene = Scene(scene_id, rooms, height_m, build_objects(groups), IMPORTED)
    return ImportedScene(scene, tuple(notes), scan.files)


def import_scannet(folder: Path, out: Path, name: str | None = None) -> tuple[ImportedScene, SceneTruth]:
    """Read a scan, compute its truth, write both to the new folder ``out``, as ``hsbench import scene`` does.

    name: scene id (default: the scan's). Raises DataError.
    """
    require_free(out)
    scan = read_scannet(folder)
    imported = scannet_scene(scan, name or scan.files[0].name.removesuffix(MESH))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "meshes with open pieces")  # every scan is open: a note says so
        return imported, store_scene(out, imported, scan.files, {})


def _nodes(scan: ScannetScan, points: FloatArray, notes: list[str]) -> tuple[SourceNode, ...]:
    """A node for each thing: its triangles are those two of whose corners are its."""
    loose = np.where(np.isin(scan.label, STRUCTURE), scan.label, 0)
    thing = np.where(scan.group >= 0, scan.group, len(scan.groups) + loose)
    owner = np.sort(thing[scan.triangles], axis=1)[:, 1]
    nodes, people = [], 0
    for number in np.unique(owner).tolist():
        triangles = scan.triangles[owner == number]
        used, compact = np.unique(triangles, return_inverse=True)
        known = scan.label[used][scan.label[used] > 0]
        if number < len(scan.groups):
            kind = int(np.bincount(known).argmax()) if len(known) else 0
            name = scan.groups[number]
        else:
            kind = number - len(scan.groups)
            name = CATEGORY_OF_CLASS[kind] if kind else "unlabelled"
        if kind == PERSON:
            people += 1
            continue
        colour: Rgb = tuple(int(c) for c in np.median(scan.colour[used], axis=0))  # type: ignore[assignment]
        mesh = SourceMesh("scan", points[used], compact.reshape(-1, 3).astype(np.int32), colour)
        nodes.append(SourceNode(name, meshes=(mesh,), extras={"category": CATEGORY_OF_CLASS[kind]}))
    if people:
        notes.append(f"{people} people who stood still for the scan are left out")
    return tuple(nodes)


def _rooms(corners: FloatArray, scene_id: str) -> tuple[Room, ...]:
    """The outlines of what lies under (T, 3, 3) triangles, gaps closed, in cells of 5 cm."""
    low = np.floor(corners[..., :2].reshape(-1, 2).min(axis=0) / CELL_M) * CELL_M - 2 * CLOSED_CELLS * CELL_M
    size = np.ceil((corners[..., :2].reshape(-1, 2).max(axis=0) - low) / CELL_M).astype(int) + 2 * CLOSED_CELLS
    if size.max() * CELL_M > MAX_SIDE_M:
        raise DataError(f"scan {scene_id} is {size.max() * CELL_M:.0f} m long; expected at most {MAX_SIDE_M:g} m")
    covered = np.zeros(size[::-1], dtype=np.uint8)
    pixels = np.floor((corners[..., :2] - low) / CELL_M).astype(np.int32)
    for triangle in pixels:
        cv2.fillConvexPoly(covered, triangle, 1)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * CLOSED_CELLS + 1, 2 * CLOSED_CELLS + 1))
    covered = cv2.morphologyEx(covered, cv2.MORPH_CLOSE, kernel)
    contours, _ = cv2.findContours(covered, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    rooms = []
    for contour in contours:
        outline = cv2.approxPolyDP(contour, SIMPLIFIED_M / CELL_M, closed=True)[:, 0].astype(np.float64)
        area_m2 = cv2.contourArea(contour) * CELL_M**2
        if len(outline) < 3 or area_m2 < MIN_ROOM_M2:
            continue
        metres = quantise_m((outline + 0.5) * CELL_M + low)
        for turned in (metres, np.ascontiguousarray(metres[::-1])):
            try:
                rooms.append(Room("room", turned))
                break
            except SchemaError:
                continue
    if not rooms:
        raise DataError(f"scan {scene_id} covers less than {MIN_ROOM_M2:g} m2; expected a room")
    return tuple(rooms)


def _segments(path: Path, count: int) -> IntArray:
    """(V,) the segment of every vertex."""
    found = pose_json.items(
        pose_json.field(pose_json.load(path, MAX_JSON_BYTES), "segIndices", str(path)),
        f"{path}: segIndices",
        MAX_SEGMENTS,
    )
    if len(found) != count:
        raise DataError(f"{path}: {len(found):,} segIndices; expected {count:,} as the mesh has vertices")
    wrong = next((i for i, value in enumerate(found) if type(value) is not int or not 0 <= value < 2**31), None)
    if wrong is not None:
        raise DataError(f"{path}: segIndices[{wrong}] is {ascii(found[wrong])[:40]}; expected a whole number")
    return np.array(found, dtype=np.int64)


def _groups(path: Path, segments: IntArray) -> tuple[IntArray, tuple[str, ...]]:
    """((V,) index of the group of every vertex, -1 for none; names)."""
    entries = pose_json.items(
        pose_json.field(pose_json.load(path, MAX_JSON_BYTES), "segGroups", str(path)), f"{path}: segGroups", MAX_GROUPS
    )
    known = np.unique(segments)
    group_of = np.full(len(known), -1, dtype=np.int64)
    names = []
    for k, entry in enumerate(entries):
        at = f"{path}: segGroups[{k}]"
        names.append(pose_json.text(pose_json.field(entry, "label", at), f"{at}.label"))
        own = _whole_numbers(pose_json.field(entry, "segments", at), f"{at}.segments")
        place = np.searchsorted(known, own).clip(max=len(known) - 1)
        if (known[place] != own).any():
            raise DataError(f"{at}: segment {own[known[place] != own][0]} is no vertex's; expected those of {SEGMENTS}")
        if (group_of[place] >= 0).any():
            raise DataError(f"{at}: segment {own[group_of[place] >= 0][0]} belongs to another group too; expected one")
        group_of[place] = k
    return group_of[np.searchsorted(known, segments)], tuple(names)


def _whole_numbers(value: Any, where: str) -> IntArray:
    found = pose_json.items(value, where, MAX_SEGMENTS)
    for k, number in enumerate(found):
        pose_json.whole(number, f"{where}[{k}]", 0, 2**31 - 1)
    return np.array(found, dtype=np.int64)


def _alignment(path: Path) -> FloatArray | None:
    """(4, 4) from the scan's frame to the aligned one, None where the file does not say it."""
    if not path.is_file():
        return None
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        name, _, text = line.partition("=")
        if name.strip() == ALIGNMENT:
            values = numbers(text.split(), f"{path} line {number}")
            if len(values) != 16 or not is_rigid(values.reshape(4, 4), 1e-3):
                raise DataError(f"{path} line {number}: {ALIGNMENT} is no rigid transform; expected 16 numbers of one")
            return values.reshape(4, 4)
    return None
