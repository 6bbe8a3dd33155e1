"""Alignment and voxel map from one real depth frame: NYU0001 and SUN RGB-D img_0063, without people.

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout.
"""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest

from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.boundary import wall_yaw
from hsbench.baselines.occlusion.carve import activity_maps, carve, fill_holes, seats, voxel_states
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.sight import pinhole_states
from hsbench.baselines.occlusion.up_axis import sensor_from_depth
from hsbench.datasets.importers import sscnet
from hsbench.datasets.importers.sunrgbd import read_sunrgbd
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import apply
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import VoxelState
from hsbench.tasks.scene_completion import GRID
from hsbench.typing import AnyArray, FloatArray

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
NOBODY = Activity(np.empty((0, 2)), np.empty(0, np.uint8), np.empty(0))
pytestmark = pytest.mark.skipif(
    not (REALDATA / "ssc").is_dir(), reason=f"needs the real captures in {REALDATA} (set HSBENCH_REALDATA)"
)


def degrees_from(sensor: Sensor, annotated_up: FloatArray) -> float:
    return math.degrees(math.acos(min(1.0, float(sensor.world_T_camera[2, :3] @ annotated_up))))


def completed(sensor: Sensor, depth_m: AnyArray) -> tuple[AnyArray, AnyArray]:
    """States on the task's grid, and carving without activity."""
    config = CarveConfig()
    states = voxel_states(sensor, GRID, depth_m)
    maps = activity_maps(NOBODY, GRID, config)
    return states, carve(states, maps.stand, seats(maps.sit, NOBODY, GRID, config), GRID, config)


def test_nyu0001_is_upright_and_its_voxels_are_those_of_the_labelled_room() -> None:
    frame = sscnet.read_frame(REALDATA / "ssc/sscnet_NYU0001_0000_depth.png", REALDATA / "ssc/sscnet_NYU0001_0000.bin")
    sensor = sensor_from_depth(frame.camera, frame.depth_m)
    assert degrees_from(sensor, frame.world_T_camera[2, :3]) < 1.0
    assert sensor.height_m == pytest.approx(frame.world_T_camera[2, 3], abs=0.1)
    episode_T_camera, episode_T_ssc = sscnet.to_episode_frame(frame)
    labels = sscnet.resample_labels(frame.volume, episode_T_ssc, GRID)
    ours = shares_as_labelled(labels, *completed(sensor, frame.depth_m))
    states = pinhole_states(GRID, frame.camera, episode_T_camera, fill_holes(frame.depth_m))
    annotated = shares_as_labelled(labels, states, states != VoxelState.FREE)
    assert ours[0] > 0.96
    assert ours[1] > 0.85
    assert min(np.subtract(ours, annotated)) > -0.01  # no worse than with the pose that the labels came with


def shares_as_labelled(labels: AnyArray, states: AnyArray, solid: AnyArray) -> tuple[float, float]:
    """Of the voxels seen to be free, those labelled empty; of those labelled solid and in view, those answered so."""
    known, empty = labels != sscnet.UNKNOWN, labels == sscnet.EMPTY
    seen_free = known & (states == VoxelState.FREE)
    in_view = known & ~empty & np.isin(states, (VoxelState.FREE, VoxelState.SURFACE, VoxelState.OCCLUDED))
    return float(empty[seen_free].mean()), float(solid[in_view].mean())


@pytest.mark.parametrize("name", ["img_0063", "2014-12-18_11-31-54_260595134347"])
@pytest.mark.parametrize("filled", [False, True])
def test_sun_rgbd_is_upright(name: str, filled: bool) -> None:
    frame = read_sunrgbd(REALDATA / "sunrgbd/images" / name, filled=filled)
    assert isinstance(frame.camera, PinholeCamera)
    assert degrees_from(sensor_from_depth(frame.camera, frame.depth_m), frame.upright_R_camera[2]) < 1.5


def test_the_walls_and_voxels_of_img_0063_are_found() -> None:
    frame = read_sunrgbd(REALDATA / "sunrgbd/images/img_0063")
    assert isinstance(frame.camera, PinholeCamera)
    sensor = sensor_from_depth(frame.camera, frame.depth_m)
    points = apply(sensor.world_T_camera, frame.camera.unproject(frame.depth_m))[frame.depth_m > 0]
    assert np.isfinite(wall_yaw(points))
    states, solid = completed(sensor, frame.depth_m)
    assert np.array_equal(solid, np.isin(states, (VoxelState.SURFACE, VoxelState.OCCLUDED)))
    assert solid.sum() > 10_000
