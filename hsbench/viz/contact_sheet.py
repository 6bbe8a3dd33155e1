"""Contact sheets: for each scene its plan and the view of its camera, tiled on one page."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from hsbench.errors import DataError
from hsbench.schema import Episode
from hsbench.typing import UInt8Array
from hsbench.viz.pictures import beside, fitted
from hsbench.viz.plan import plan_image

ROW_PX = 300
PLAN_WIDTH_PX = 900  # drawn larger than shown, so that letters stay smooth
WIDEST_PLAN_PX = 420
GAP_PX, CAPTION_PX = 14, 26
COLUMNS = 2


def scene_cell(episode: Episode) -> UInt8Array:
    """(h, w, 3) plan and first picture of an episode with truth, under its id.

    Raises DataError for an episode without a scene.
    """
    if episode.truth is None or episode.truth.scene is None:
        raise DataError(f"episode {episode.episode_id} has no scene to draw")
    scene = episode.truth.scene
    plan = fitted(plan_image(scene, PLAN_WIDTH_PX), ROW_PX)
    if plan.shape[1] > WIDEST_PLAN_PX:
        plan = fitted(plan, round(ROW_PX * WIDEST_PLAN_PX / plan.shape[1]))
    pictures = [_padded(plan, ROW_PX, WIDEST_PLAN_PX)]
    if len(episode.frames):
        rgb = episode.frames[0].rgb
        assert rgb is not None
        pictures.append(fitted(rgb, ROW_PX))
    row = beside(pictures)
    caption = np.full((CAPTION_PX, row.shape[1], 3), 255, dtype=np.uint8)
    rooms = ", ".join(room.room_type for room in scene.rooms)
    text = f"{episode.episode_id}: {rooms}; style {scene.style}"
    cv2.putText(caption, text, (4, CAPTION_PX - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (40, 40, 40), 1, cv2.LINE_AA)
    return np.concatenate([caption, row])


def sheet(cells: Sequence[UInt8Array], columns: int = COLUMNS) -> UInt8Array:
    """Pictures tiled on white, row by row; the first takes a row of its own where it is wider than the others."""
    height, width = max(c.shape[0] for c in cells), max(c.shape[1] for c in cells)
    if len(cells) > 1 and width > max(cell.shape[1] for cell in cells[1:]):
        below = sheet(cells[1:], min(columns, len(cells) - 1))
        width = max(width, below.shape[1])
        return np.concatenate([_padded(cells[0], cells[0].shape[0], width), _padded(below, below.shape[0], width)])
    padded = [_padded(cell, height, width) for cell in cells]
    padded += [np.full_like(padded[0], 255)] * (-len(padded) % columns)
    rows = [beside(padded[k : k + columns], GAP_PX) for k in range(0, len(padded), columns)]
    return np.concatenate(rows)


def _padded(picture: UInt8Array, height_px: int, width_px: int) -> UInt8Array:
    """A picture on white, at the top and in the middle."""
    page = np.full((height_px, width_px, 3), 255, dtype=np.uint8)
    left = (width_px - picture.shape[1]) // 2
    page[: picture.shape[0], left : left + picture.shape[1]] = picture
    return page
