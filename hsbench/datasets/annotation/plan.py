"""Affordance drawn on a plan from above: polygons in metres, or labels of a picture of the plan.

Plain JSON::

    {"format": "hsbench-plan-labels", "version": 1,
     "regions": [{"label": "walkable", "polygons_m": [[[-2, -1.5], [3, -1.5], [3, 2], [-2, 2]]]}]}

Places are (x, y) of the episode frame: x along the heading of the camera (the middle column of a 360 picture), y to the
left, the camera at (0, 0). LabelMe, COCO and PNG files are of a square picture of the whole plan: up is ahead, left is
left, the camera in the middle. A cell has a label where its centre is in a region. Cells in a region ``unscored`` are
ignored.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hsbench.datasets.annotation import polygons
from hsbench.datasets.annotation.label_files import read_labels
from hsbench.datasets.annotation.labels import MAX_BYTES, MAX_REGIONS, Region, ViewLabels, bits_of, labels_at
from hsbench.datasets.annotation.polygons import MAX_POLYGONS
from hsbench.datasets.importers import pose_json
from hsbench.errors import DataError
from hsbench.geometry.cameras import pixel_centres
from hsbench.io.atomic import write_json
from hsbench.schema.occupancy import VIEW_UNSCORED, AffordanceTruth
from hsbench.truth.affordance import PLAN_CELLS
from hsbench.truth.walkable import CELL_M
from hsbench.typing import FloatArray

FORMAT, VERSION = "hsbench-plan-labels", 1
HALF_M = PLAN_CELLS * CELL_M / 2


@dataclass(frozen=True, eq=False)
class PlanRegion:
    """A labelled region of the plan: the union of polygons, (n, 2) each, x and y in metres of the episode frame."""

    label: str
    polygons_m: tuple[FloatArray, ...]


def read_plan(path: str | Path, image: str | None = None) -> ViewLabels:
    """Labels of a plan from a file of any form, as those of a square picture of the whole plan.

    Raises DataError naming file and item.
    """
    path = Path(path)
    if path.suffix.lower() == ".json":
        root = pose_json.load(path, MAX_BYTES)
        if isinstance(root, dict) and root.get("format") == FORMAT:
            return on_picture(_regions(root, str(path)), path.name)
    labels = read_labels(path, image)
    if labels.width_px != labels.height_px:
        raise DataError(f"{path}: the plan has {labels.width_px} x {labels.height_px} px; expected a square")
    return labels


def write_plan(path: Path, regions: tuple[PlanRegion, ...]) -> None:
    """The inverse of ``read_plan`` for regions in metres."""
    rows = [{"label": r.label, "polygons_m": [p.tolist() for p in r.polygons_m]} for r in regions]
    write_json(path, {"format": FORMAT, "version": VERSION, "regions": rows})


def on_picture(regions: tuple[PlanRegion, ...], file_name: str) -> ViewLabels:
    """Regions in metres as those of a picture of a pixel a cell: row 0 the farthest ahead, column 0 farthest left."""
    drawn = tuple(
        Region(r.label, tuple((HALF_M - polygon[:, ::-1]) / CELL_M for polygon in r.polygons_m)) for r in regions
    )
    return ViewLabels(file_name, PLAN_CELLS, PLAN_CELLS, drawn)


def plan_truth(labels: ViewLabels, names: Mapping[str, int], where: str) -> AffordanceTruth:
    """Labels of a square picture of the plan -> truth from above. Raises DataError for a label without a meaning."""
    scale = labels.width_px / PLAN_CELLS
    found = labels_at(labels, bits_of(labels, names, where), pixel_centres(PLAN_CELLS, PLAN_CELLS) * scale)
    ignored = found & VIEW_UNSCORED > 0
    return AffordanceTruth((found & ~np.uint8(VIEW_UNSCORED)).astype(np.uint8), ignored, CELL_M)


def _regions(root: dict[str, object], where: str) -> tuple[PlanRegion, ...]:
    if root.get("version") != VERSION:
        raise DataError(f"{where}: version is {ascii(root.get('version'))[:40]}; expected {VERSION}")
    rows = pose_json.items(pose_json.field(root, "regions", where), f"{where}: regions", MAX_REGIONS)
    if not rows:
        raise DataError(f"{where}: regions is empty; expected at least one")
    found = []
    for index, item in enumerate(rows):
        at = f"{where}: regions[{index}]"
        label = pose_json.text(pose_json.field(item, "label", at), f"{at}.label")
        outlines = pose_json.items(pose_json.field(item, "polygons_m", at), f"{at}.polygons_m", MAX_POLYGONS)
        if not outlines or set(item) != {"label", "polygons_m"}:
            raise DataError(
                f"{at} ({label[:40]}) is not a label and polygons; expected label and polygons_m, not empty"
            )
        reach = (HALF_M, HALF_M)
        checked = [
            polygons.checked(p, f"{at}.polygons_m[{k}]", (-HALF_M, -HALF_M), reach, "metres")
            for k, p in enumerate(outlines)
        ]
        found.append(PlanRegion(label, tuple(checked)))
    return tuple(found)
