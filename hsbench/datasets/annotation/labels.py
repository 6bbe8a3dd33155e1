"""Labels of one picture: regions with names, and the bits of ``Affordance`` that the names stand for.

Places in a picture are those of docs/conventions.md: u to the right, v down, (0, 0) the upper left corner of the upper
left pixel. LabelMe and the polygons of COCO count alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.annotation import polygons
from hsbench.datasets.importers import pose_json
from hsbench.errors import DataError, SchemaError
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.states import Affordance
from hsbench.typing import BoolArray, FloatArray, UInt8Array

NAMES: Mapping[str, int] = {
    **{kind.name.lower(): 1 << kind for kind in Affordance},
    "unscored": VIEW_UNSCORED,
    "nothing": 0,
}
"""Label -> bits of a view: the affordances by name, what no score counts, and what affords nothing."""

EDGE_PX = 1.0
"""A corner may lie so far outside of its picture: tools round, and let a hand slip over the edge."""

MAX_SIDE_PX = 65_536
MAX_PIXELS = 2**26
"""Of a picture: twice those of 8K."""

MAX_MASK_PIXELS = 2**29
"""Of all masks of a file together."""

MAX_REGIONS = 10_000
MAX_BYTES = 2**26
MAX_NAMES = 1000


@dataclass(frozen=True, eq=False)
class Region:
    """A labelled region: polygons, (n, 2) each, of which it is the union; or a mask (h, w) bool of its picture."""

    label: str
    polygons_px: tuple[FloatArray, ...] = ()
    mask: BoolArray | None = None

    def __post_init__(self) -> None:
        if bool(self.polygons_px) == (self.mask is not None):
            raise SchemaError(f"region {self.label!r} has both or neither of polygons and a mask; expected one")

    def holds(self, points_px: FloatArray) -> BoolArray:
        """(..., 2) places in the picture -> (...) bool: in the region. NaN is in none."""
        if self.mask is None:
            return np.asarray(np.any([polygons.holds(p, points_px) for p in self.polygons_px], axis=0))
        height, width = self.mask.shape
        inside = _within(points_px, width, height)
        column, row = np.where(inside[..., None], points_px, 0.0).astype(np.int64).transpose(-1, *range(inside.ndim))
        return np.asarray(inside & self.mask[row, column])


@dataclass(frozen=True, eq=False)
class ViewLabels:
    """Everything labelled in one picture: its file name, size, and regions, which may overlap.

    Raises SchemaError where a mask has another size.
    """

    file_name: str
    width_px: int
    height_px: int
    regions: tuple[Region, ...]

    def __post_init__(self) -> None:
        for index, region in enumerate(self.regions):
            if region.mask is not None and region.mask.shape != (self.height_px, self.width_px):
                raise SchemaError(
                    f"regions[{index}] ({region.label}) has a mask of shape {region.mask.shape}; expected"
                    f" {(self.height_px, self.width_px)} as the picture"
                )


def bits_of(labels: ViewLabels, names: Mapping[str, int], where: str) -> tuple[int, ...]:
    """The bits of each region. Raises DataError, starting with ``where``, for a label that has none."""
    for index, region in enumerate(labels.regions):
        if region.label not in names:
            raise DataError(
                f"{where}: regions[{index}] has the label {ascii(region.label)[:60]}; expected one of"
                f" {', '.join(names)[:300]} (or say what it stands for: --labels)"
            )
    return tuple(names[region.label] for region in labels.regions)


def labels_at(labels: ViewLabels, bits: tuple[int, ...], points_px: FloatArray) -> UInt8Array:
    """(..., 2) places in the labelled picture -> (...) uint8 bits of a view.

    Regions are laid down in their order: one adds its bits to those below it, and one without any, such as the hole in
    a floor where a table stands, takes away what is below it. What lies in no region affords nothing; what lies outside
    of the picture, NaN included, is ``VIEW_UNSCORED``.
    """
    found = np.zeros(points_px.shape[:-1], dtype=np.uint8)
    for region, own in zip(labels.regions, bits, strict=True):
        inside = region.holds(points_px)
        found[inside] = found[inside] | np.uint8(own) if own else 0
    found[~_within(points_px, labels.width_px, labels.height_px)] = VIEW_UNSCORED
    return found


def read_names(path: Path) -> dict[str, int]:
    """What own labels stand for, from JSON such as ``{"chair seat": ["sittable", "reachable"], "wall": []}``.

    The names of ``NAMES`` keep their meaning. Raises DataError for anything else.
    """
    found = pose_json.load(path, MAX_BYTES)
    if not isinstance(found, dict):
        raise DataError(f"{path}: is no object; expected labels and what they stand for")
    if len(found) > MAX_NAMES:
        raise DataError(f"{path}: {len(found)} labels; expected at most {MAX_NAMES}")
    return {**NAMES, **{label: _bits(value, f"{path}: {ascii(label)[:60]}") for label, value in found.items()}}


def checked_polygon(points: Any, where: str, width_px: int, height_px: int) -> FloatArray:
    """A polygon in a picture, from JSON. Raises DataError as ``polygons.checked``."""
    high = (width_px + EDGE_PX, height_px + EDGE_PX)
    return polygons.checked(points, where, (-EDGE_PX, -EDGE_PX), high, "pixels")


def picture_size(root: Any, keys: tuple[str, str], where: str) -> tuple[int, int]:
    """(width, height) of a picture, from two keys of a JSON object. Raises DataError unless it is a picture's."""
    width_px, height_px = (
        pose_json.whole(pose_json.field(root, key, where), f"{where}: {key}", 1, MAX_SIDE_PX) for key in keys
    )
    if width_px * height_px > MAX_PIXELS:
        raise DataError(f"{where}: {width_px} x {height_px} px; expected at most {MAX_PIXELS:,} pixels")
    return width_px, height_px


def check_masks(regions: list[Region], width_px: int, height_px: int, where: str) -> None:
    """Raise DataError where one more mask beside those of ``regions`` would fill the memory."""
    count = 1 + sum(region.mask is not None for region in regions)
    if count * width_px * height_px > MAX_MASK_PIXELS:
        raise DataError(f"{where}: {count} masks of {width_px} x {height_px} px; expected less (use a label picture?)")


def _bits(value: Any, where: str) -> int:
    bits = 0
    for index, name in enumerate(pose_json.items(value, where, len(NAMES))):
        if not isinstance(name, str) or name not in NAMES:
            raise DataError(f"{where}[{index}] is {ascii(name)[:60]}; expected one of {', '.join(NAMES)}")
        bits |= NAMES[name]
    return bits


def _within(points_px: FloatArray, width_px: int, height_px: int) -> BoolArray:
    return np.asarray(((points_px >= 0.0) & (points_px < (width_px, height_px))).all(axis=-1))
