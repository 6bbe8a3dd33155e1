"""Make the pictures of docs/images. Usage: make_pictures.py DATA OUT NUMBER (an episode of the split val)"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

import hsbench
from hsbench.baselines.occlusion.action import recognise
from hsbench.baselines.occlusion.carve import activity_maps, carve, seats, voxel_states
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.io.images import write_png
from hsbench.schema import VoxelState
from hsbench.tasks.scene_completion import GRID
from hsbench.viz.pictures import (
    beside,
    depth_picture,
    fitted,
    footprint,
    instance_picture,
    plan_picture,
    prediction_voxels,
    truth_voxels,
)

HEIGHT_PX = 420  # of the row that the README shows
PERSON = 60000  # instance ids above it are people
PERSON_SHARE = 0.06  # of the picture: somebody in full view, not against the lens


def main(data: Path, out: Path, number: int) -> None:
    """Pictures of one episode: what is given, what is hidden, what carving makes of it."""
    out.mkdir(parents=True, exist_ok=True)
    episode = hsbench.load(data, "val", truth=True)[number]
    truth, config = episode.truth, CarveConfig()
    assert truth is not None
    assert truth.frames is not None
    assert truth.occupancy is not None
    assert episode.poses is not None
    shares = [float((truth.frames[i].instance > PERSON).mean()) for i in range(len(episode.frames))]
    shown = int(np.argmin(np.abs(np.array(shares) - PERSON_SHARE)))
    frame, hidden = episode.frames[shown], truth.frames[shown]
    row = [frame.rgb, depth_picture(frame.depth_m), instance_picture(hidden.instance)]
    write_png(out / "frame.png", beside([smaller(picture, 0.5) for picture in row]))

    activity = recognise(episode.poses, config)
    maps = activity_maps(activity, GRID, config)
    plan = plan_picture(GRID, maps.stand, maps.sit, footprint(truth.occupancy), scale=3)
    write_png(out / "activity.png", plan)

    states = voxel_states(episode.sensor, GRID, episode.frames[0].depth_m)
    carved = carve(states, maps.stand, seats(maps.sit, activity, GRID, config), GRID, config)
    all_solid = np.isin(states, (VoxelState.SURFACE, VoxelState.OCCLUDED))
    row = [truth_voxels(truth.occupancy), *(prediction_voxels(truth.occupancy, p) for p in (all_solid, carved))]
    row = trimmed(row)
    write_png(out / "completion.png", beside(row))
    write_png(out / "demo.png", beside([fitted(p, HEIGHT_PX) for p in (frame.rgb, plan, *row[1:])]))


def smaller(picture: np.ndarray, factor: float) -> np.ndarray:
    """A picture at a share of its size."""
    return np.asarray(cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA))


def trimmed(pictures: list[np.ndarray], margin_px: int = 12) -> list[np.ndarray]:
    """Pictures of one size without the blank paper that all of them have around."""
    drawn = np.any([(picture != picture[0, 0]).any(axis=-1) for picture in pictures], axis=0)
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    top, left = max(0, rows[0] - margin_px), max(0, columns[0] - margin_px)
    return [picture[top : rows[-1] + margin_px, left : columns[-1] + margin_px] for picture in pictures]


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
