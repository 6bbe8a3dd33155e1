"""Cuts through a prediction of task scene-completion, beside truth where there is truth, as one picture.

Horizontal cuts are seen from above with the camera at the bottom, looking up the page, and +y to the left; the upright
one is seen from the side, the camera at its left end. It is made where most of the judged voxels are solid or claimed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from hsbench.geometry.grids import VoxelGrid
from hsbench.metrics import completion
from hsbench.schema.episode import Episode
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.typing import BoolArray, UInt8Array
from hsbench.viz.pictures import beside
from hsbench.viz.verdicts import COLOURS, Verdict, voxel_verdicts

HEIGHTS_M = (0.25, 0.75, 1.25, 1.75)
"""Of the horizontal cuts: below seats, at tables, above them, and at the top of cupboards."""

VOXEL_PX = 5
GAP_PX, BAND_PX, CAPTION_PX, TITLE_PX, LEGEND_PX = 16, 12, 28, 62, 30
INK, FAINT = (51, 54, 59), (120, 124, 130)
HATCH = (204, 204, 198)  # lines over space that is hidden and free
HATCH_PX = 10  # from one line to the next
SMALL, LARGE = 0.5, 0.62  # scales of the letters

NAMES: dict[Verdict, str] = {
    Verdict.HIT: "hidden solid, predicted",
    Verdict.FALSE: "false solid",
    Verdict.MISSED: "missed",
    Verdict.HIDDEN_FREE: "hidden, free",
    Verdict.SEEN_SOLID: "visible surface",
    Verdict.STRUCTURE: "walls, doors, windows",
    Verdict.SEEN_FREE: "seen to be free",
    Verdict.NOT_JUDGED: "not judged",
}
ALONE: dict[Verdict, str] = {Verdict.HIT: "predicted solid"}


def slices_picture(episode: Episode, occupied: BoolArray, grid: VoxelGrid, method: str) -> UInt8Array:
    """(h, w, 3) uint8 page of cuts; an episode without truth shows the prediction alone, and says so.

    occupied: (nx, ny, nz) bool on ``grid``.
    """
    truth = None if episode.truth is None else episode.truth.occupancy
    labels = labels_of(truth, occupied)
    return slices_page(labels, grid, completion_title(episode.episode_id, truth, occupied, method), truth is None)


def labels_of(truth: OccupancyTruth | None, occupied: BoolArray) -> UInt8Array:
    """(nx, ny, nz) uint8 of ``Verdict``; without truth all that is claimed is drawn as a hit."""
    return (
        np.where(occupied, Verdict.HIT, Verdict.NOTHING).astype(np.uint8)
        if truth is None
        else (voxel_verdicts(truth, occupied))
    )


def completion_title(
    episode_id: str, truth: OccupancyTruth | None, occupied: BoolArray, method: str
) -> tuple[str, str]:
    """The line of an episode with its score, and the line below it."""
    if truth is None:
        return f"{episode_id}: {method}", f"no truth: the prediction alone, {int(occupied.sum())} voxels solid"
    counts = completion.episode_counts(truth, occupied)["occluded"]
    row = np.array([counts.tp, counts.fp, counts.fn, counts.tn])
    iou, precision, recall = (_number(f(row)) for f in (completion.iou, completion.precision, completion.recall))
    line = f"precision {precision}, recall {recall} over {int(row.sum())} hidden voxels of scene-completion"
    return f"{episode_id}: {method}, IoU {iou}", line


def slices_page(labels: UInt8Array, grid: VoxelGrid, title: tuple[str, str], alone: bool) -> UInt8Array:
    """The page of labels (nx, ny, nz) of ``Verdict`` on ``grid``, with a title and the legend of what is on it."""
    low, high = _filled(labels)
    side = _upright_cut(labels)
    pictures = []
    for height_m in HEIGHTS_M:
        k = min(int((height_m - grid.origin_m[2]) / grid.voxel_m), grid.shape[2] - 1)
        plan = _enlarged(labels[low[0] : high[0], low[1] : high[1], k][::-1, ::-1])
        plan = _marked(plan, high[1] - 1 - side, high[1] + grid.origin_m[1] / grid.voxel_m)
        bottom = grid.origin_m[2] + k * grid.voxel_m
        pictures.append(_captioned(plan, f"z {bottom:.2f} .. {bottom + grid.voxel_m:.2f} m"))
    upright = _enlarged(labels[low[0] : high[0], side].T[::-1])
    at_m = grid.origin_m[1] + (side + 0.5) * grid.voxel_m
    rows = [beside(pictures[:2], GAP_PX), beside(pictures[2:], GAP_PX), _captioned(upright, _upright_caption(at_m))]
    names = ALONE if alone else NAMES
    shown = [(v, name) for v, name in names.items() if (labels == v).any()]
    width = max(row.shape[1] for row in rows)
    width = max(width, *(_text_width(line, scale) for line, scale in zip(title, (LARGE, SMALL), strict=True)))
    rows = [_title(title, width), *rows, _legend(shown, width)]
    return _margin(np.concatenate([_widened(row, width) for row in rows]))


def _number(value: object) -> str:
    ratio = float(np.asarray(value))
    return "undefined" if math.isnan(ratio) else f"{ratio:.3f}"


def _filled(labels: UInt8Array) -> tuple[tuple[int, int], tuple[int, int]]:
    """First and last-but-one columns [x, y] with anything in them; all of them where nothing is."""
    columns = (labels != Verdict.NOTHING).any(axis=2)
    if not columns.any():
        return (0, 0), (labels.shape[0], labels.shape[1])
    x, y = np.flatnonzero(columns.any(axis=1)), np.flatnonzero(columns.any(axis=0))
    return (int(x[0]), int(y[0])), (int(x[-1]) + 1, int(y[-1]) + 1)


def _upright_cut(labels: UInt8Array) -> int:
    """The index along y with most voxels that are hit, false or missed; of equal ones the first."""
    told = np.isin(labels, [Verdict.HIT, Verdict.FALSE, Verdict.MISSED])
    return int(told.sum(axis=(0, 2)).argmax())


def _upright_caption(at_m: float) -> str:
    side = "left" if at_m > 0 else "right"
    return f"upright, {abs(at_m):.2f} m to the {side} of the camera (triangles; dot: the camera)"


def _enlarged(labels: UInt8Array) -> UInt8Array:
    """(r, c) labels -> (r, c) * VOXEL_PX pixels, hidden free space hatched."""
    table = np.zeros((256, 3), dtype=np.uint8)
    for verdict, rgb in COLOURS.items():
        table[verdict] = rgb
    large = np.repeat(np.repeat(labels, VOXEL_PX, axis=0), VOXEL_PX, axis=1)
    picture = table[large]
    row, column = np.indices(large.shape)
    picture[(large == Verdict.HIDDEN_FREE) & ((row + column) % HATCH_PX < 2)] = HATCH
    return np.asarray(picture, dtype=np.uint8)


def _marked(plan: UInt8Array, cut: int, camera: float) -> UInt8Array:
    """A plan between two white bands: triangles on both at the column of the upright cut, a dot below at the camera."""
    band = np.full((BAND_PX, plan.shape[1], 3), 255, dtype=np.uint8)
    page = np.concatenate([band, plan, band])
    x, last = round((cut + 0.5) * VOXEL_PX), page.shape[0] - 1
    for edge, tip in ((0, BAND_PX), (last, last - BAND_PX)):
        corners = np.array([[x - BAND_PX // 2, edge], [x + BAND_PX // 2, edge], [x, tip]], dtype=np.int32)
        cv2.fillPoly(page, [corners], INK, cv2.LINE_AA)
    cv2.circle(page, (round(camera * VOXEL_PX), last - BAND_PX // 2), BAND_PX // 2 - 1, INK, -1, cv2.LINE_AA)
    return page


def _captioned(picture: UInt8Array, caption: str) -> UInt8Array:
    band = np.full((CAPTION_PX, max(picture.shape[1], _text_width(caption, SMALL)), 3), 255, dtype=np.uint8)
    _write(band, caption, 0, CAPTION_PX - 9, SMALL, INK)
    return np.concatenate([band, _widened(picture, band.shape[1])])


def _title(lines: tuple[str, str], width_px: int) -> UInt8Array:
    band = np.full((TITLE_PX, width_px, 3), 255, dtype=np.uint8)
    _write(band, lines[0], 0, 22, LARGE, INK)
    _write(band, lines[1], 0, 46, SMALL, FAINT)
    return band


def _legend(entries: Sequence[tuple[Verdict, str]], width_px: int) -> UInt8Array:
    """Swatches with names, as many in a line as fit."""
    lines: list[list[tuple[int, Verdict, str]]] = [[]]
    x = 0
    for verdict, name in entries:
        need = 20 + _text_width(name, SMALL) + GAP_PX
        if lines[-1] and x + need > width_px:
            lines.append([])
            x = 0
        lines[-1].append((x, verdict, name))
        x += need
    band = np.full((GAP_PX + LEGEND_PX * len(lines), width_px, 3), 255, dtype=np.uint8)
    for k, line in enumerate(lines):
        y = GAP_PX + LEGEND_PX * k
        for x, verdict, name in line:
            size = 14 // VOXEL_PX + 1
            band[y : y + 3 * VOXEL_PX, x : x + size * VOXEL_PX] = _enlarged(np.full((3, size), verdict, np.uint8))
            cv2.rectangle(band, (x, y), (x + size * VOXEL_PX - 1, y + 3 * VOXEL_PX - 1), FAINT, 1)
            _write(band, name, x + 20, y + 12, SMALL, INK)
    return band


def _write(picture: UInt8Array, text: str, x: int, y: int, scale: float, colour: tuple[int, int, int]) -> None:
    plain = text.encode("ascii", "replace").decode()
    cv2.putText(picture, plain, (x, y), cv2.FONT_HERSHEY_SIMPLEX, scale, colour, 1, cv2.LINE_AA)


def _text_width(text: str, scale: float) -> int:
    return int(cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)[0][0]) + 2


def _widened(picture: UInt8Array, width_px: int) -> UInt8Array:
    missing = np.full((picture.shape[0], width_px - picture.shape[1], 3), 255, dtype=np.uint8)
    return np.concatenate([picture, missing], axis=1)


def _margin(picture: UInt8Array) -> UInt8Array:
    return np.asarray(np.pad(picture, ((GAP_PX, GAP_PX), (GAP_PX, GAP_PX), (0, 0)), constant_values=255))
