"""Files with labels of a picture: which form a file has, reading and writing each.

Plain JSON, of our own::

    {"format": "hsbench-view-labels", "version": 1,
     "image": {"file_name": "000000_rgb.png", "width_px": 640, "height_px": 480},
     "regions": [{"label": "walkable", "polygons_px": [[[10.5, 400], [600, 410], [320, 479]]]},
                 {"label": "sittable", "mask_counts": [4000, 25, ...]}]}

``mask_counts`` are run lengths as COCO's (``rle``). Other forms: LabelMe and COCO JSON, and a label picture: an 8-bit
PNG of one channel whose values are bits of a view, as ``view_affordance.png`` of an episode.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.annotation import rle
from hsbench.datasets.annotation.coco import from_coco, to_coco
from hsbench.datasets.annotation.labelme import from_labelme, png_size, to_labelme
from hsbench.datasets.annotation.labels import (
    MAX_BYTES,
    MAX_PIXELS,
    MAX_REGIONS,
    NAMES,
    Region,
    ViewLabels,
    bits_of,
    check_masks,
    checked_polygon,
    labels_at,
    picture_size,
)
from hsbench.datasets.annotation.polygons import MAX_POLYGONS
from hsbench.datasets.importers import pose_json
from hsbench.errors import DataError
from hsbench.geometry.cameras import pixel_centres
from hsbench.io.atomic import write_bytes, write_json
from hsbench.io.images import encode_png, read_uint8
from hsbench.io.reading import read_limited
from hsbench.typing import UInt8Array

FORMAT, VERSION = "hsbench-view-labels", 1
FORMS = ("plain", "labelme", "coco", "png")


def read_labels(path: str | Path, image: str | None = None) -> ViewLabels:
    """Labels of a picture from a file of any of the forms. image: file name of the picture, where COCO has several.

    Raises DataError naming file and item.
    """
    path = Path(path)
    if path.suffix.lower() == ".png":
        return _from_png(path)
    root = pose_json.load(path, MAX_BYTES)
    where = str(path)
    if isinstance(root, dict):
        if root.get("format") == FORMAT:
            labels = _from_plain(root, where)
        elif "shapes" in root:
            labels = from_labelme(root, where)
        elif "annotations" in root:
            labels = from_coco(root, where, image)
        else:
            raise DataError(f"{path}: neither format {FORMAT!r}, LabelMe's shapes nor COCO's annotations; expected one")
        if not labels.regions:
            raise DataError(f"{path}: no region is labelled in {labels.file_name}; expected at least one")
        return labels
    raise DataError(f"{path}: is no object; expected {FORMAT}, LabelMe or COCO annotations")


def write_labels(path: Path, labels: ViewLabels, form: str, names: Mapping[str, int] = NAMES) -> None:
    """Write labels as a file of one of ``FORMS``. A picture keeps affordances alone, by the bits that names stand for.

    Raises DataError for a label that is not among the names.
    """
    if form == "png":
        bits = bits_of(labels, names, labels.file_name)
        picture = labels_at(labels, bits, pixel_centres(labels.width_px, labels.height_px))
        write_bytes(path, encode_png(picture))
    else:
        write_json(path, {"plain": _to_plain, "labelme": to_labelme, "coco": to_coco}[form](labels))


def of_picture(picture: UInt8Array, file_name: str) -> ViewLabels:
    """(h, w) uint8 bits of a view -> labels, a region for each bit that occurs."""
    regions = tuple(Region(name, mask=picture & bit > 0) for name, bit in NAMES.items() if (picture & bit).any())
    return ViewLabels(file_name, picture.shape[1], picture.shape[0], regions)


def _from_png(path: Path) -> ViewLabels:
    size = png_size(read_limited(path, MAX_BYTES)[:24])
    if size is None or size[0] * size[1] > MAX_PIXELS:
        raise DataError(f"{path}: no PNG of at most {MAX_PIXELS:,} pixels")
    labels = of_picture(np.asarray(read_uint8(path)), path.name)
    if not labels.regions:
        raise DataError(f"{path}: no pixel is labelled; expected bits of affordances (is it a picture of classes?)")
    return labels


def _from_plain(root: dict[str, Any], where: str) -> ViewLabels:
    if root.get("version") != VERSION:
        raise DataError(f"{where}: version is {ascii(root.get('version'))[:40]}; expected {VERSION}")
    image = pose_json.field(root, "image", where)
    name = pose_json.text(pose_json.field(image, "file_name", f"{where}: image"), f"{where}: image.file_name")
    width_px, height_px = picture_size(image, ("width_px", "height_px"), f"{where}: image")
    regions: list[Region] = []
    rows = pose_json.items(pose_json.field(root, "regions", where), f"{where}: regions", MAX_REGIONS)
    for index, item in enumerate(rows):
        at = f"{where}: regions[{index}]"
        label = pose_json.text(pose_json.field(item, "label", at), f"{at}.label")
        if set(item) == {"label", "mask_counts"}:
            check_masks(regions, width_px, height_px, at)
            mask = rle.decode(item["mask_counts"], width_px, height_px, f"{at}.mask_counts")
            regions.append(Region(label, mask=mask))
        elif set(item) == {"label", "polygons_px"}:
            outlines = pose_json.items(item["polygons_px"], f"{at}.polygons_px", MAX_POLYGONS)
            if not outlines:
                raise DataError(f"{at}.polygons_px is empty; expected at least one polygon")
            polygons = [
                checked_polygon(p, f"{at}.polygons_px[{k}]", width_px, height_px) for k, p in enumerate(outlines)
            ]
            regions.append(Region(label, tuple(polygons)))
        else:
            raise DataError(f"{at} has {', '.join(sorted(item))[:80]}; expected label and polygons_px or mask_counts")
    return ViewLabels(name, width_px, height_px, tuple(regions))


def _to_plain(labels: ViewLabels) -> dict[str, Any]:
    regions: list[dict[str, Any]] = []
    for region in labels.regions:
        if region.mask is not None:
            regions.append({"label": region.label, "mask_counts": rle.encode(region.mask)})
        else:
            regions.append({"label": region.label, "polygons_px": [p.tolist() for p in region.polygons_px]})
    size = {"width_px": labels.width_px, "height_px": labels.height_px}
    return {
        "format": FORMAT, "version": VERSION, "image": {"file_name": labels.file_name, **size}, "regions": regions,
    }  # fmt: skip
