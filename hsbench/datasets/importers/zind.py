"""ZInD, the Zillow Indoor Dataset (github.com/zillow/zind): 360 panoramas of empty homes with layouts of their rooms.

``zind_data.json`` of a home: ``merger[floor][complete room][partial room][panorama]`` with ``image_path``, ``label``,
``camera_height`` (1: the unit of the layout is the height of the camera), ``ceiling_height``,
``floor_plan_transformation.scale`` (units of the floor plan), and ``layout_complete`` or at least ``layout_raw``:
``vertices`` [[x, y], ...] of the room as seen from the panorama, ``doors``, ``windows`` and ``openings`` as triples
[left x, y], [right x, y], [bottom z, top z] with z from the camera. ``scale_meters_per_coordinate[floor]``: metres of a
unit of the floor plan, null where nobody knows.

In a panorama's plane x is left (to the right of the middle column, x is negative) and y is forward, into the middle
column; its origin is the camera. So (y, x) in metres is the episode frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers import pose_json
from hsbench.datasets.importers.footage import bounded_rgb
from hsbench.datasets.importers.room_shell import Opening, room_objects
from hsbench.datasets.importers.scene_source import referenced
from hsbench.errors import DataError, SchemaError
from hsbench.geometry.cameras import EquirectangularCamera
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.polygons import signed_area
from hsbench.io.image_frames import FileFrames
from hsbench.schema.episode import Episode, EpisodeTruth
from hsbench.schema.scene import Room, Scene
from hsbench.schema.sensor import Sensor
from hsbench.typing import FloatArray

DATASET = "zind"
MAX_BYTES = 64 << 20  # the largest of the 1,575 homes has a few MB
MAX_ITEMS = 10_000  # of a list or a level of the tree
MAX_VALUE = 1000.0  # heights of a camera
KINDS = {"doors": "door", "windows": "window", "openings": "passage"}
CAMERA_HEIGHT_M = (0.3, 3.0)
"""Of a tripod in a home; beyond, the scale is wrong."""


@dataclass(frozen=True, eq=False)
class ZindPanorama:
    """A panorama and its room, in metres and the episode frame.

    outline_xy: (n, 2) counter-clockwise. openings: doors, windows, passages. flat_ceiling: else height_m is just the
    height that is annotated. inside: whether the camera stands in the room.
    """

    name: str
    image: Path
    room_type: str
    camera_height_m: float
    height_m: float
    outline_xy: FloatArray
    openings: tuple[Opening, ...]
    flat_ceiling: bool
    inside: bool


def read_zind(path: str | Path) -> tuple[list[ZindPanorama], list[str]]:
    """Path of a ``zind_data.json`` -> (its panoramas whose pictures are there, notes on those that are left out).

    Raises DataError, naming file and place, for damage, for layouts that are no rooms, and for a home without any
    picture beside the file.
    """
    path = Path(path)
    root = pose_json.load(path, MAX_BYTES)
    scales = pose_json.field(root, "scale_meters_per_coordinate", f"{path}: the file")
    found: list[ZindPanorama] = []
    absent, unscaled, bare = [], [], []
    for where, floor, entry in _panoramas(pose_json.field(root, "merger", f"{path}: the file"), f"{path}: merger"):
        text = pose_json.text(pose_json.field(entry, "image_path", where), f"{where}.image_path")
        image = referenced(text, path.parent, path.parent, path)
        metres = pose_json.field(scales, floor, f"{path}: scale_meters_per_coordinate")
        layout = next((entry[key] for key in ("layout_complete", "layout_raw") if entry.get(key)), None)
        if not image.is_file():
            absent.append(image.name)
        elif metres is None:
            unscaled.append(image.name)
        elif layout is None:
            bare.append(image.name)
        else:
            metres = _number(metres, f"{path}: scale_meters_per_coordinate.{floor}")
            found.append(_panorama(entry, layout, image, metres, where))
    notes = [
        f"{len(names)} panoramas {why}, left out: {', '.join(names[:4])}{' ...' if len(names) > 4 else ''}"
        for names, why in ((absent, "have no picture here"), (unscaled, "have no scale"), (bare, "have no layout"))
        if names
    ]
    if not found:
        raise DataError(f"{path}: no panorama to import ({'; '.join(notes) or 'merger is empty'})")
    return found, notes


def zind_episode(panorama: ZindPanorama, home: str) -> Episode:
    """The panorama as the one frame of a 360 episode; its room, and the height of the camera, are truth.

    home: the scene, alike for all its panoramas; ids of episodes begin with it. Raises DataError for a picture that
    cannot be read or is not twice as wide as high.
    """
    height_px, width_px = bounded_rgb(panorama.image).shape[:2]
    if width_px != 2 * height_px:
        raise DataError(f"{panorama.image}: {width_px} x {height_px} px; expected a panorama twice as wide as high")
    camera = EquirectangularCamera(width_px, height_px)
    room = Room(panorama.room_type, panorama.outline_xy)
    objects = room_objects(panorama.outline_xy, panorama.height_m, panorama.openings)
    scene = Scene(home, (room,), panorama.height_m, objects, "imported")
    truth = EpisodeTruth(scene=scene, sensor=Sensor("equirectangular", camera, panorama.camera_height_m))
    frames = FileFrames(np.zeros(1, dtype=np.int64), (panorama.image,), (None,))
    sensor = Sensor("equirectangular", camera, None)
    return Episode(f"{home}-{panorama.name}", DATASET, sensor, frames, None, 0, 0, truth=truth)


def _panoramas(merger: Any, where: str) -> list[tuple[str, str, dict[str, Any]]]:
    """(place for messages, floor, entry) of every panorama, in the order of the file."""
    found = []
    for floor, rooms in _children(merger, where):
        for room, parts in _children(rooms, f"{where}.{floor}"):
            for part, panoramas in _children(parts, f"{where}.{floor}.{room}"):
                for name, entry in _children(panoramas, f"{where}.{floor}.{room}.{part}"):
                    at = f"{where}.{floor}.{room}.{part}.{name}"
                    _children(entry, at)
                    found.append((at, floor, entry))
    return found


def _children(value: Any, where: str) -> list[tuple[str, Any]]:
    if not isinstance(value, dict) or len(value) > MAX_ITEMS or not all(key.isprintable() for key in value):
        raise DataError(f"{where[:200]} is no object of at most {MAX_ITEMS:,} plain names; expected ZInD's tree")
    return list(value.items())


def _panorama(entry: dict[str, Any], layout: Any, image: Path, metres: float, where: str) -> ZindPanorama:
    plan = pose_json.field(entry, "floor_plan_transformation", where)
    unit_m = metres * _number(pose_json.field(plan, "scale", f"{where}.floor_plan_transformation"), f"{where}: scale")
    camera_height, ceiling = (
        _number(pose_json.field(entry, key, where), f"{where}.{key}") for key in ("camera_height", "ceiling_height")
    )
    height_m = float(quantise_m(camera_height * unit_m))
    if not CAMERA_HEIGHT_M[0] <= height_m <= CAMERA_HEIGHT_M[1]:
        raise DataError(
            f"{where}: the camera would be {height_m:.2f} m high; expected {CAMERA_HEIGHT_M[0]} to {CAMERA_HEIGHT_M[1]}"
            " m (is the scale that of another floor?)"
        )
    if not camera_height < ceiling:
        raise DataError(f"{where}: the ceiling is {ceiling:g} high, the camera {camera_height:g}; expected it below")
    outline = quantise_m(_points(pose_json.field(layout, "vertices", f"{where}: layout"), f"{where}: vertices", unit_m))
    if len(outline) >= 3 and signed_area(outline) < 0:
        outline = np.ascontiguousarray(outline[::-1])
    openings = []
    for key, kind in KINDS.items():
        ends = pose_json.items(layout.get(key, []), f"{where}: {key}", MAX_ITEMS)
        if len(ends) % 3:
            raise DataError(f"{where}: {key} has {len(ends)} rows; expected three for each (left, right, heights)")
        for k in range(0, len(ends), 3):
            left, right = _points(ends[k : k + 2], f"{where}: {key}[{k}]", unit_m)
            low, high = unit_m * (
                pose_json.numbers(ends[k + 2], f"{where}: {key}[{k + 2}]", 2, MAX_VALUE) + camera_height
            )
            openings.append(
                Opening(kind, quantise_m(left), quantise_m(right), *map(float, quantise_m(np.array([low, high]))))
            )
    try:
        room = Room(str(entry.get("label") or "room").replace(" ", "_"), outline)
    except SchemaError as error:
        raise DataError(f"{where}: {error}") from error
    return ZindPanorama(
        image.stem,
        image,
        room.room_type,
        height_m,
        float(quantise_m(ceiling * unit_m)),
        room.outline_xy,
        tuple(openings),
        entry.get("is_ceiling_flat") is not False,
        entry.get("is_inside") is not False,
    )


def _points(value: Any, where: str, unit_m: float) -> FloatArray:
    """(n, 2) metres, x forward and y left, of [[left, forward], ...]."""
    rows = pose_json.items(value, where, MAX_ITEMS)
    found = np.array([pose_json.numbers(row, f"{where}[{k}]", 2, MAX_VALUE) for k, row in enumerate(rows)])
    return np.ascontiguousarray(unit_m * found.reshape(-1, 2)[:, ::-1])


def _number(value: Any, where: str) -> float:
    """A positive number."""
    number = float(pose_json.numbers([value], where, 1, MAX_VALUE)[0])
    if number <= 0:
        raise DataError(f"{where} is {number:g}; expected more than 0")
    return number
