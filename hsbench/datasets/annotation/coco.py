"""Labels of a picture as COCO's instance JSON (cocodataset.org/#format-data): polygons or run lengths.

``segmentation`` is a list of polygons, u and v in turn, whose union is the region; or run lengths (``rle``). A box
alone is refused: it is no region. Other fields are not read.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsbench.datasets.annotation import rle
from hsbench.datasets.annotation.labels import (
    MAX_NAMES,
    MAX_REGIONS,
    MAX_SIDE_PX,
    Region,
    ViewLabels,
    check_masks,
    checked_polygon,
    picture_size,
)
from hsbench.datasets.annotation.polygons import MAX_POINTS, MAX_POLYGONS
from hsbench.datasets.importers import pose_json
from hsbench.errors import DataError
from hsbench.geometry.cameras import pixel_centres

MAX_ID = 2**63 - 1
MAX_IMAGES = 500_000


def from_coco(root: dict[str, Any], where: str, file_name: str | None = None) -> ViewLabels:
    """The value of a file -> labels of one picture, named where the file has several.

    Raises DataError, starting with ``where`` and naming the annotation.
    """
    images = _images(root, where)
    image_id, name, width_px, height_px = _chosen(images, where, file_name)
    known = {item[0] for item in images}
    labels = _categories(root, where)
    regions: list[Region] = []
    found = pose_json.items(pose_json.field(root, "annotations", where), f"{where}: annotations", MAX_REGIONS)
    for index, item in enumerate(found):
        at = f"{where}: annotations[{index}]"
        of = pose_json.whole(pose_json.field(item, "image_id", at), f"{at}.image_id", 0, MAX_ID)
        if of not in known:
            raise DataError(f"{at}.image_id is {of}; expected the id of one of the {len(known)} images")
        category = pose_json.whole(pose_json.field(item, "category_id", at), f"{at}.category_id", 0, MAX_ID)
        if category not in labels:
            raise DataError(f"{at}.category_id is {category}; expected the id of one of the {len(labels)} categories")
        if of == image_id:
            if isinstance(item.get("segmentation"), dict):
                check_masks(regions, width_px, height_px, at)
            regions.append(_region(item, labels[category], at, width_px, height_px))
    return ViewLabels(name, width_px, height_px, tuple(regions))


def to_coco(labels: ViewLabels) -> dict[str, Any]:
    """The inverse of ``from_coco``: categories are the labels in alphabetical order, run lengths are lists."""
    number = {label: k for k, label in enumerate(sorted({r.label for r in labels.regions}), start=1)}
    centres = pixel_centres(labels.width_px, labels.height_px)
    annotations = []
    for index, region in enumerate(labels.regions, start=1):
        mask = region.mask if region.mask is not None else region.holds(centres)
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        box = [0, 0, 0, 0]
        if len(rows):
            u, v = int(columns[0]), int(rows[0])
            box = [u, v, int(columns[-1]) + 1 - u, int(rows[-1]) + 1 - v]
        shape: Any = [p.ravel().tolist() for p in region.polygons_px]
        if region.mask is not None:
            shape = {"size": [labels.height_px, labels.width_px], "counts": rle.encode(region.mask)}
        annotations.append(
            {
                "id": index, "image_id": 1, "category_id": number[region.label], "segmentation": shape,
                "area": int(mask.sum()), "bbox": box, "iscrowd": int(region.mask is not None),
            }
        )  # fmt: skip
    return {
        "images": [{"id": 1, "file_name": labels.file_name, "width": labels.width_px, "height": labels.height_px}],
        "categories": [{"id": k, "name": label} for label, k in number.items()],
        "annotations": annotations,
    }


def _region(item: Any, label: str, at: str, width_px: int, height_px: int) -> Region:
    shape = pose_json.field(item, "segmentation", at)
    if isinstance(shape, dict):
        at = f"{at}.segmentation"
        size = pose_json.numbers(pose_json.field(shape, "size", at), f"{at}.size", 2, MAX_SIDE_PX).tolist()
        if size != [height_px, width_px]:
            raise DataError(f"{at}.size is {size}; expected {[height_px, width_px]} as its image")
        counts = pose_json.field(shape, "counts", at)
        return Region(label, mask=rle.decode(counts, width_px, height_px, f"{at}.counts"))
    outlines = pose_json.items(shape, f"{at}.segmentation", MAX_POLYGONS)
    if not outlines:
        raise DataError(f"{at}.segmentation is empty; expected polygons or run lengths (a box alone is no region)")
    polygons = []
    for k, outline in enumerate(outlines):
        place = f"{at}.segmentation[{k}]"
        flat = pose_json.items(outline, place, 2 * MAX_POINTS)
        if len(flat) % 2:
            raise DataError(f"{place} has {len(flat)} numbers; expected u and v in turn")
        pairs = [[flat[i], flat[i + 1]] for i in range(0, len(flat), 2)]
        polygons.append(checked_polygon(pairs, place, width_px, height_px))
    return Region(label, tuple(polygons))


def _images(root: Any, where: str) -> list[tuple[int, str, int, int]]:
    """(id, file name, width, height) of every image."""
    found = []
    for index, item in enumerate(
        pose_json.items(pose_json.field(root, "images", where), f"{where}: images", MAX_IMAGES)
    ):
        at = f"{where}: images[{index}]"
        image_id = pose_json.whole(pose_json.field(item, "id", at), f"{at}.id", 0, MAX_ID)
        name = pose_json.text(pose_json.field(item, "file_name", at), f"{at}.file_name")
        found.append((image_id, name, *picture_size(item, ("width", "height"), at)))
    if len({item[0] for item in found}) != len(found):
        raise DataError(f"{where}: images have an id twice; expected different ids")
    return found


def _chosen(images: list[tuple[int, str, int, int]], where: str, file_name: str | None) -> tuple[int, str, int, int]:
    chosen = [item for item in images if file_name is None or item[1] == file_name]
    if len(chosen) != 1:
        names = ", ".join(item[1] for item in images[:5])
        asked = f"{len(images)} images" if file_name is None else f"{len(chosen)} images {file_name!r}"
        raise DataError(f"{where}: {asked}; expected one (name it with --image: {names[:200]} ...)")
    return chosen[0]


def _categories(root: Any, where: str) -> dict[int, str]:
    names: dict[int, str] = {}
    rows = pose_json.items(pose_json.field(root, "categories", where), f"{where}: categories", MAX_NAMES)
    for index, item in enumerate(rows):
        at = f"{where}: categories[{index}]"
        number = pose_json.whole(pose_json.field(item, "id", at), f"{at}.id", 0, MAX_ID)
        if number in names:
            raise DataError(f"{at}.id is {number} again; expected different ids")
        names[number] = pose_json.text(pose_json.field(item, "name", at), f"{at}.name")
    return names
