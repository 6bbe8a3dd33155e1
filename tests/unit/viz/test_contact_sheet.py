"""Contact sheets: every cell is there, unscaled, in order; a preview makes one picture and no data."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from hsbench import load
from hsbench.cli.main import run
from hsbench.errors import DataError
from hsbench.viz.contact_sheet import scene_cell, sheet


def test_cells_are_tiled_row_by_row_on_white() -> None:
    cells = [np.full((10 + k, 20, 3), 10 * k, dtype=np.uint8) for k in range(3)]
    page = sheet(cells, columns=2)
    height, width = 12, 20
    assert page.shape[0] == 2 * height
    assert (page[:10, :width] == 0).all()
    assert (page[10:height, :width] == 255).all(), "shorter cells are padded with white"
    assert (page[: height - 1, -width:] == 10).all()
    assert (page[height:, :width] == 20).all()
    assert (page[height:, width:] == 255).all(), "no fourth cell"


def test_a_first_cell_wider_than_the_others_stands_alone() -> None:
    cells = [np.full((10, 50, 3), 1, np.uint8), *(np.full((10, 20, 3), 10 * k, np.uint8) for k in (2, 3, 4))]
    page = sheet(cells, columns=3)
    assert page.shape[:2] == (20, 3 * 20 + 2 * 14)
    assert (page[:10] == 1).all(axis=2).sum() == 500
    assert [page[15, x, 0] for x in (5, 5 + 34, 5 + 68)] == [20, 30, 40]


def test_a_cell_shows_plan_and_picture(rgbd: Path) -> None:
    episode = load(rgbd, "val", truth=True)[0]
    cell = scene_cell(episode)
    assert cell.dtype == np.uint8
    assert cell.shape[0] == 326
    assert cell.std() > 20
    with pytest.raises(DataError, match="has no scene to draw"):
        scene_cell(load(rgbd, "val")[0])


def test_a_preview_makes_one_picture_and_no_data(tmp_path: Path) -> None:
    arguments = ["generate", "rgbd-activity", "--episodes", "0:1", "--preview", "--renderer", "raycast"]
    assert run([*arguments, "--out", str(tmp_path / "out")]) == 0
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["preview.png"]
    assert cv2.imread(str(tmp_path / "out" / "preview.png")).std() > 20
