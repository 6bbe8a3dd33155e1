"""Oriented 3D boxes of a room, drawn by a person: plain JSON, read and written.

::

    {"format": "hsbench-boxes", "version": 1, "frame": "episode",
     "room": {"room_type": "living", "outline_xy": [[0.5, -2], [4, -2], [4, 2], [0.5, 2]], "height_m": 2.5},
     "boxes": [{"id": 1, "category": "sofa", "centre_m": [3, 0, 0.4], "size_m": [1.8, 0.8, 0.8], "yaw_deg": 90,
                "touched": true, "movable": false,
                "parts": [{"name": "seat", "role": "seat", "centre_m": [0, -0.1, 0.2], "size_m": [1.8, 0.6, 0.4]}]}]}

``frame`` is ``episode``, or ``camera``: the origin at the camera, axes along those of the episode frame (z up, x along
the heading, y left). Size is length, width, height, along the object's x, y, z; yaw as in docs/conventions.md. Parts
are in the object's frame (origin on the floor in the middle of its footprint, front towards -y) and reach to every side
of the box; without parts the box is solid. ``touched``: somebody touched it during the episode. ``movable``,
``touched`` and ``parts`` may be left out. Boxes are of everything in the room, hidden objects included; floor, ceiling
and walls follow from the room. Whole JSON numbers are metres, of yaw degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.annotation import polygons
from hsbench.datasets.importers import pose_json
from hsbench.datasets.importers.scene_labels import NAMES, nearest_names
from hsbench.errors import DataError
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.polygons import distance, signed_area
from hsbench.io.atomic import write_json
from hsbench.schema.categories import ROLES, category
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.typing import FloatArray

FORMAT, VERSION = "hsbench-boxes", 1
FRAMES = ("episode", "camera")

MAX_BYTES = 2**24
MAX_BOXES = 2000
MAX_PARTS = 200
MAX_PLACE_M = 100.0
MAX_SIZE_M = 20.0
MIN_SIZE_M = 0.001
WALL_M = 0.5
"""A box may reach its middle so far outside of the room: doors and windows lie in walls."""

FLOOR_M = 0.1
"""A box may reach so far below the floor or above the ceiling: hands are not exact."""

FIT_M = 0.01
"""Parts reach to the sides of their box as exactly."""


@dataclass(frozen=True, eq=False)
class BoxPart:
    """A part: name, role or None, centre (3,) and size (3,) in metres in the object's frame."""

    name: str
    role: str | None
    centre_m: FloatArray
    size_m: FloatArray


@dataclass(frozen=True, eq=False)
class AnnotatedBox:
    """A box: centre (3,) in metres in the file's frame, size (3,) length, width, height, yaw in radians, its parts."""

    object_id: int
    category: str
    centre_m: FloatArray
    size_m: FloatArray
    yaw_rad: float
    parts: tuple[BoxPart, ...] = ()
    movable: bool = False
    touched: bool = False


@dataclass(frozen=True, eq=False)
class BoxLabels:
    """A room and what is in it. frame: of centres. outline_xy: (n, 2) metres, counter-clockwise. Ids ascend."""

    frame: str
    room_type: str
    outline_xy: FloatArray
    height_m: float
    boxes: tuple[AnnotatedBox, ...]


def read_boxes(path: str | Path) -> BoxLabels:
    """Boxes from a file. Raises DataError naming file and item."""
    path = Path(path)
    root = pose_json.load(path, MAX_BYTES)
    where = str(path)
    _exact(root, where, ("format", "version", "frame", "room", "boxes"))
    if root["format"] != FORMAT or root["version"] != VERSION:
        found = f"{ascii(root['format'])[:40]} {ascii(root['version'])[:20]}"
        raise DataError(f"{where}: format and version are {found}; expected {FORMAT!r} {VERSION}")
    if root["frame"] not in FRAMES:
        raise DataError(f"{where}: frame is {ascii(root['frame'])[:40]}; expected {' or '.join(FRAMES)}")
    room = root["room"]
    _exact(room, f"{where}: room", ("room_type", "outline_xy", "height_m"))
    room_type = pose_json.text(room["room_type"], f"{where}: room.room_type")
    reach = (MAX_PLACE_M, MAX_PLACE_M)
    outline = polygons.checked(room["outline_xy"], f"{where}: room.outline_xy", (-reach[0], -reach[1]), reach, "metres")
    outline = outline if signed_area(outline) > 0 else np.ascontiguousarray(outline[::-1])
    height = _number(room["height_m"], f"{where}: room.height_m", MIN_SIZE_M, MAX_SIZE_M, "metres")
    rows = pose_json.items(root["boxes"], f"{where}: boxes", MAX_BOXES)
    if not rows:
        raise DataError(f"{where}: boxes is empty; expected at least one")
    boxes = [_box(item, f"{where}: boxes[{index}]") for index, item in enumerate(rows)]
    first: dict[int, int] = {}
    for index, box in enumerate(boxes):
        if box.object_id in first:
            raise DataError(f"{where}: boxes[{index}] has id {box.object_id} of boxes[{first[box.object_id]}]")
        first[box.object_id] = index
    return BoxLabels(root["frame"], room_type, outline, height, tuple(sorted(boxes, key=lambda box: box.object_id)))


def write_boxes(path: Path, labels: BoxLabels) -> None:
    """The inverse of ``read_boxes``."""
    boxes = [
        {
            "id": box.object_id, "category": box.category, "centre_m": box.centre_m.tolist(),
            "size_m": box.size_m.tolist(), "yaw_deg": math.degrees(box.yaw_rad), "movable": box.movable,
            "touched": box.touched,
            "parts": [
                {"name": p.name, "role": p.role, "centre_m": p.centre_m.tolist(), "size_m": p.size_m.tolist()}
                for p in box.parts
            ],
        }
        for box in labels.boxes
    ]  # fmt: skip
    room = {
        "room_type": labels.room_type,
        "outline_xy": labels.outline_xy.tolist(),
        "height_m": labels.height_m,
    }
    write_json(path, {"format": FORMAT, "version": VERSION, "frame": labels.frame, "room": room, "boxes": boxes})


def in_episode_frame(labels: BoxLabels, camera_height_m: float) -> BoxLabels:
    """The same boxes with their centres in the episode frame. Raises DataError where one is outside of the room."""
    lift = np.array([0.0, 0.0, camera_height_m if labels.frame == "camera" else 0.0])
    placed = tuple(
        AnnotatedBox(
            b.object_id, b.category, quantise_m(b.centre_m + lift), b.size_m, b.yaw_rad, b.parts, b.movable, b.touched
        )
        for b in labels.boxes
    )
    for box in placed:
        name = f"box {box.object_id} ({box.category})"
        off = float(distance(labels.outline_xy, box.centre_m[:2]))
        if off > WALL_M:
            x, y = box.centre_m[:2]
            raise DataError(
                f"{name} is centred {off:.2f} m outside of the room, at ({x:g}, {y:g}); expected inside or in a wall"
                " (another frame?)"
            )
        low, high = box.centre_m[2] - box.size_m[2] / 2, box.centre_m[2] + box.size_m[2] / 2
        if low < -FLOOR_M or high > labels.height_m + FLOOR_M:
            raise DataError(
                f"{name} reaches from {low:.2f} to {high:.2f} m; expected between floor and ceiling, 0 to"
                f" {labels.height_m:g} m (another frame?)"
            )
    return BoxLabels("episode", labels.room_type, labels.outline_xy, labels.height_m, placed)


def _box(item: Any, at: str) -> AnnotatedBox:
    _exact(item, at, ("id", "category", "centre_m", "size_m", "yaw_deg"), ("movable", "touched", "parts"))
    object_id = pose_json.whole(item["id"], f"{at}.id", 1, PERSON_ID_OFFSET - 1)
    name = pose_json.text(item["category"], f"{at}.category")
    if name not in NAMES:
        hint = ", ".join(nearest_names(name[:60], NAMES)) or "object"
        raise DataError(f"{at}.category is {ascii(name)[:60]}; expected a category of dataset.json (nearest: {hint})")
    at = f"{at} ({name})"
    centre = _place(item["centre_m"], f"{at}.centre_m")
    size = _size(item["size_m"], f"{at}.size_m")
    yaw = _number(item["yaw_deg"], f"{at}.yaw_deg", -360.0, 360.0, "degrees")
    rows = pose_json.items(item.get("parts", []), f"{at}.parts", MAX_PARTS)
    parts = tuple(_part(part, f"{at}.parts[{k}]", category(name).roles) for k, part in enumerate(rows))
    if parts:
        low = np.min([p.centre_m - p.size_m / 2 for p in parts], axis=0)
        high = np.max([p.centre_m + p.size_m / 2 for p in parts], axis=0)
        wanted = np.array([[-size[0] / 2, -size[1] / 2, 0.0], [size[0] / 2, size[1] / 2, size[2]]])
        if (np.abs(np.stack([low, high]) - wanted) > FIT_M).any():
            raise DataError(
                f"{at}.parts reach from {np.round(low, 3).tolist()} to {np.round(high, 3).tolist()}; expected the sides"
                f" of the box, {np.round(wanted[0], 3).tolist()} to {np.round(wanted[1], 3).tolist()}"
            )
    movable, touched = (_flag(item.get(key, False), f"{at}.{key}") for key in ("movable", "touched"))
    return AnnotatedBox(object_id, name, centre, size, quantise_angle(math.radians(yaw)), parts, movable, touched)


def _part(item: Any, at: str, roles: tuple[str, ...]) -> BoxPart:
    _exact(item, at, ("name", "centre_m", "size_m"), ("role",))
    role = item.get("role")
    if role is not None and role not in roles:
        known = ", ".join(roles) or f"none (roles: {', '.join(sorted(ROLES))})"
        raise DataError(f"{at}.role is {ascii(role)[:40]}; expected null or one that its category has: {known}")
    name = pose_json.text(item["name"], f"{at}.name")
    return BoxPart(name, role, _place(item["centre_m"], f"{at}.centre_m"), _size(item["size_m"], f"{at}.size_m"))


def _place(value: Any, at: str) -> FloatArray:
    return quantise_m(pose_json.numbers(value, at, 3, MAX_PLACE_M))


def _size(value: Any, at: str) -> FloatArray:
    found = quantise_m(pose_json.numbers(value, at, 3, MAX_PLACE_M))
    if not ((found >= MIN_SIZE_M) & (found <= MAX_SIZE_M)).all():
        raise DataError(f"{at} is {found.tolist()}; expected metres from {MIN_SIZE_M:g} to {MAX_SIZE_M:g}")
    return found


def _number(value: Any, at: str, low: float, high: float, unit: str) -> float:
    if type(value) not in (int, float) or not low <= value <= high:
        raise DataError(f"{at} is {ascii(value)[:40]}; expected {unit} from {low:g} to {high:g}")
    return float(value)


def _flag(value: Any, at: str) -> bool:
    if not isinstance(value, bool):
        raise DataError(f"{at} is {ascii(value)[:40]}; expected true or false")
    return value


def _exact(item: Any, at: str, needed: tuple[str, ...], allowed: tuple[str, ...] = ()) -> None:
    """Raise DataError unless an item is an object with the needed keys and no other than the allowed."""
    for key in needed:
        pose_json.field(item, key, at)
    unknown = [key for key in item if key not in needed + allowed]
    if unknown:
        raise DataError(f"{at} has unknown {ascii(unknown[0])[:40]}; expected {', '.join(needed + allowed)}")
