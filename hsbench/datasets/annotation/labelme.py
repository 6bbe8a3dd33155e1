"""Labels of a picture as LabelMe's JSON (github.com/wkentaro/labelme): ``shapes`` with label, type and points.

Read are polygons, rectangles (two opposite corners) and masks (a PNG of the pixels from the first point to the second,
both included). Circles, lines and points have no use as regions and are refused. Polygons of one label and one
``group_id`` are one region.
"""

from __future__ import annotations

import base64
import binascii
from typing import Any

import cv2
import numpy as np

from hsbench.datasets.annotation.labels import (
    MAX_REGIONS,
    MAX_SIDE_PX,
    Region,
    ViewLabels,
    check_masks,
    checked_polygon,
    picture_size,
)
from hsbench.datasets.annotation.polygons import MAX_POLYGONS
from hsbench.datasets.importers import pose_json
from hsbench.errors import DataError
from hsbench.io.decoding import decode_image
from hsbench.io.images import encode_png
from hsbench.typing import BoolArray, FloatArray

VERSION = "5.5.0"
"""Of LabelMe, whose form is written."""

MAX_GROUP = 2**53


def from_labelme(root: dict[str, Any], where: str) -> ViewLabels:
    """The value of a file -> labels. Raises DataError, starting with ``where`` and naming the shape."""
    width_px, height_px = picture_size(root, ("imageWidth", "imageHeight"), where)
    name = pose_json.text(pose_json.field(root, "imagePath", where), f"{where}: imagePath")
    shapes = pose_json.items(pose_json.field(root, "shapes", where), f"{where}: shapes", MAX_REGIONS)
    regions: list[Region] = []
    place_of: dict[tuple[str, int], int] = {}
    for index, shape in enumerate(shapes):
        at = f"{where}: shapes[{index}]"
        label = pose_json.text(pose_json.field(shape, "label", at), f"{at}.label")
        at = f"{at} ({label[:40]})"
        if shape.get("shape_type") == "mask":
            check_masks(regions, width_px, height_px, at)
        region = _region(shape, label, at, width_px, height_px)
        group = shape.get("group_id")
        if group is not None and region.mask is None:
            key = (label, pose_json.whole(group, f"{at}.group_id", -MAX_GROUP, MAX_GROUP))
            if key in place_of:
                joined = regions[place_of[key]].polygons_px + region.polygons_px
                if len(joined) > MAX_POLYGONS:
                    raise DataError(f"{at}: group {group} has more than {MAX_POLYGONS} polygons")
                regions[place_of[key]] = Region(label, joined)
                continue
            place_of[key] = len(regions)
        regions.append(region)
    return ViewLabels(name, width_px, height_px, tuple(regions))


def to_labelme(labels: ViewLabels) -> dict[str, Any]:
    """The inverse of ``from_labelme``. A mask without a pixel is written as one of one empty pixel."""
    shapes = []
    for number, region in enumerate(labels.regions, start=1):
        if region.mask is not None:
            shapes.append(_mask_shape(region.label, region.mask))
        group = number if len(region.polygons_px) > 1 else None
        shapes += [_shape(region.label, "polygon", p.tolist(), group) for p in region.polygons_px]
    return {
        "version": VERSION,
        "flags": {},
        "shapes": shapes,
        "imagePath": labels.file_name,
        "imageData": None,
        "imageHeight": labels.height_px,
        "imageWidth": labels.width_px,
    }


def _region(shape: Any, label: str, at: str, width_px: int, height_px: int) -> Region:
    kind = shape.get("shape_type", "polygon")
    points = pose_json.field(shape, "points", at)
    if kind == "polygon":
        return Region(label, (checked_polygon(points, f"{at}.points", width_px, height_px),))
    if kind == "rectangle":
        (u0, v0), (u1, v1) = _two(points, f"{at}.points").tolist()
        corners = [[u0, v0], [u1, v0], [u1, v1], [u0, v1]]
        return Region(label, (checked_polygon(corners, f"{at}.points", width_px, height_px),))
    if kind == "mask":
        return Region(label, mask=_mask(shape, points, at, width_px, height_px))
    raise DataError(f"{at} is of type {ascii(kind)[:40]}; expected polygon, rectangle or mask")


def _two(points: Any, where: str) -> FloatArray:
    rows = pose_json.items(points, where, 2)
    if len(rows) != 2:
        raise DataError(f"{where} has {len(rows)} points; expected two opposite corners")
    return np.array([pose_json.numbers(row, f"{where}[{i}]", 2, MAX_SIDE_PX) for i, row in enumerate(rows)])


def _mask(shape: Any, points: Any, at: str, width_px: int, height_px: int) -> BoolArray:
    low, high = _two(points, f"{at}.points").astype(np.int64)
    if not ((low >= 0).all() and (high >= low).all() and high[0] < width_px and high[1] < height_px):
        raise DataError(
            f"{at}.points are {low.tolist()} and {high.tolist()}; expected first and last pixel of {width_px} x"
            f" {height_px}"
        )
    text = pose_json.field(shape, "mask", at)
    try:
        data = base64.b64decode(text, validate=True)
    except (TypeError, ValueError, binascii.Error) as error:
        raise DataError(f"{at}.mask is no base64; expected a PNG in base64") from error
    size = (int(high[1] - low[1]) + 1, int(high[0] - low[0]) + 1)
    if png_size(data) != size:
        raise DataError(f"{at}.mask is no PNG of {size[1]} x {size[0]} px, the size its points tell")
    image, complaint = decode_image(data, cv2.IMREAD_GRAYSCALE)
    if image is None or image.shape != size:
        raise DataError(f"{at}.mask is a damaged PNG{complaint}")
    mask = np.zeros((height_px, width_px), dtype=np.bool_)
    mask[low[1] : high[1] + 1, low[0] : high[0] + 1] = image > 0
    return mask


def png_size(data: bytes) -> tuple[int, int] | None:
    """(height, width) that the header of a PNG tells, None where it is none: to be asked before it is unpacked."""
    if data[:8] != b"\x89PNG\r\n\x1a\n" or len(data) < 24:
        return None
    return int.from_bytes(data[20:24], "big"), int.from_bytes(data[16:20], "big")


def _mask_shape(label: str, mask: BoolArray) -> dict[str, Any]:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    v0, v1 = (int(rows[0]), int(rows[-1])) if len(rows) else (0, 0)
    u0, u1 = (int(columns[0]), int(columns[-1])) if len(columns) else (0, 0)
    crop = mask[v0 : v1 + 1, u0 : u1 + 1].astype(np.uint8) * 255
    text = base64.b64encode(encode_png(crop)).decode()
    return {**_shape(label, "mask", [[u0, v0], [u1, v1]], None), "mask": text}


def _shape(label: str, kind: str, points: list[list[float]], group: int | None) -> dict[str, Any]:
    return {
        "label": label, "points": points, "group_id": group, "description": "", "shape_type": kind, "flags": {},
        "mask": None,
    }  # fmt: skip
