"""The SSCNet reader on frame NYU0001 of the SSCNet repository (research terms, never part of this project).

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from hsbench.datasets.importers import sscnet
from hsbench.geometry import transforms
from hsbench.geometry.grids import VoxelGrid
from hsbench.metrics.completion import score
from hsbench.schema.states import VoxelState
from hsbench.typing import AnyArray, BoolArray, FloatArray

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
SSC = REALDATA / "ssc"
pytestmark = pytest.mark.skipif(not SSC.is_dir(), reason=f"needs the real captures in {SSC} (set HSBENCH_REALDATA)")


@pytest.fixture(scope="module")
def frame() -> sscnet.SscnetFrame:
    return sscnet.read_frame(SSC / "sscnet_NYU0001_0000_depth.png", SSC / "sscnet_NYU0001_0000.bin")


@pytest.fixture(scope="module")
def prediction() -> dict[str, AnyArray]:
    with np.load(SSC / "derived_sscnet_nyu0001_gt_pred_60x36x60.npz", allow_pickle=False) as arrays:
        return {name: arrays[name].transpose(0, 2, 1) for name in ("gt", "pred")}


def near_occupied(points: FloatArray, volume: sscnet.SscnetVolume, within_m: float) -> BoolArray:
    """(N, 3) points in the volume's frame -> (N,) bool: within a distance of the nearest face of an occupied voxel."""
    occupied = (volume.labels != sscnet.EMPTY) & (volume.labels != sscnet.UNKNOWN)
    position = (points - volume.origin_m) / volume.voxel_m
    cell = np.floor(position).astype(int)
    reach = int(np.ceil(within_m / volume.voxel_m))
    near = np.zeros(len(points), dtype=bool)
    for offset in np.ndindex(*(3 * [2 * reach + 1])):
        neighbour = cell + np.array(offset) - reach
        inside = ((neighbour >= 0) & (neighbour < occupied.shape)).all(axis=1)
        gap = np.maximum(np.abs(position - neighbour - 0.5) - 0.5, 0.0)
        close = inside & (np.linalg.norm(gap, axis=1) * volume.voxel_m <= within_m)
        near[close] |= occupied[tuple(neighbour[close].T)]
    return near


def fraction_near(frame: sscnet.SscnetFrame, pose: FloatArray) -> float:
    points = frame.camera.unproject(frame.depth_m)[::5, ::5].reshape(-1, 3)
    points = points[frame.depth_m[::5, ::5].ravel() > 0]
    return float(near_occupied(transforms.apply(pose, points), frame.volume, 0.06).mean())


def test_depth_is_that_of_a_room(frame: sscnet.SscnetFrame) -> None:
    measured = frame.depth_m[frame.depth_m > 0]
    assert 0.8 < len(measured) / frame.depth_m.size < 1.0
    assert measured.min() > 0.4
    assert 3.0 < measured.max() < 10.0


def test_depth_points_lie_on_occupied_voxels(frame: sscnet.SscnetFrame) -> None:
    found = fraction_near(frame, frame.world_T_camera)
    assert found >= 0.9
    # No other reading of the camera's axes comes near: the camera turned about each axis, or the image mirrored.
    for signs in ((1, -1, -1), (-1, 1, -1), (-1, -1, 1), (-1, 1, 1)):
        assert fraction_near(frame, frame.world_T_camera @ np.diag([*signs, 1.0])) < found - 0.2


def test_the_stored_origin_is_the_centre_of_voxel_0(frame: sscnet.SscnetFrame) -> None:
    x, y, z = (value + sscnet.VOXEL_M / 2 for value in frame.volume.origin_m)
    other = replace(frame, volume=replace(frame.volume, origin_m=(x, y, z)))
    assert fraction_near(frame, frame.world_T_camera) > fraction_near(other, frame.world_T_camera)
    # Its two layers of floor enclose the floor at z = 0.
    floor = np.unique(np.argwhere(frame.volume.labels == sscnet.CLASSES_36.index("floor"))[:, 2])
    np.testing.assert_allclose(frame.volume.grid.axis_centres(2)[floor], [-0.01, 0.01], atol=1e-6)


def test_downsampling_gives_the_published_labels(frame: sscnet.SscnetFrame, prediction: dict[str, AnyArray]) -> None:
    small = sscnet.downsample_labels(frame.volume.labels)
    assert np.array_equal(sscnet.eleven_classes(small), prediction["gt"])
    # This frame tells how ties break: blocks with as many empty as unknown voxels are empty, not unknown.
    blocks = frame.volume.labels.reshape(60, 4, 60, 4, 36, 4)
    empty, unknown = ((blocks == label).sum(axis=(1, 3, 5)) for label in (sscnet.EMPTY, sscnet.UNKNOWN))
    tied = (empty == unknown) & (empty + unknown > 60)
    assert tied.sum() == 1961
    assert (prediction["gt"][tied] == sscnet.EMPTY).all()


def test_completion_of_a_real_prediction(prediction: dict[str, AnyArray]) -> None:
    known = prediction["gt"] != sscnet.UNKNOWN
    truth = np.where(known, prediction["gt"], 0) > 0
    state = np.where(known, VoxelState.FREE, VoxelState.UNKNOWN).astype(np.uint8)
    result = score(truth, prediction["pred"] > 0, state, protocol="monoscene")
    assert (round(result.precision, 3), round(result.recall, 3), round(result.iou, 3)) == (0.676, 0.778, 0.567)


def test_class_map_is_the_published_one() -> None:
    mapping = loadmat(SSC / "sscnet_ClassMapping.mat")
    of_36 = [str(name[0]) for name in mapping["map36to11"].ravel()]
    assert [sscnet.CLASSES_11[label] for label in sscnet.ELEVEN_OF_36[1:]] == of_36
    assert list(sscnet.CLASSES_11[1:]) == [str(name[0]) for name in mapping["elevenClass"].ravel()]
    renamed = {"closets_wardrobes_cabinets": "closets", "household_appliance": "appliance"}
    names = [str(name[0]) for name in mapping["p5d36class"].ravel()]
    assert list(sscnet.CLASSES_36[1:]) == [renamed.get(name, name) for name in names]


def test_episode_frame(frame: sscnet.SscnetFrame) -> None:
    episode_T_camera, episode_T_ssc = sscnet.to_episode_frame(frame)
    assert transforms.is_rigid(episode_T_camera)
    np.testing.assert_allclose(episode_T_camera[:2, 3], 0.0, atol=1e-9)
    assert 1.0 < episode_T_camera[2, 3] < 1.6
    np.testing.assert_allclose(episode_T_camera[1, 2], 0.0, atol=1e-9)
    assert episode_T_camera[0, 2] > 0.9
    assert episode_T_camera[1, 0] < -0.9  # the picture's right is episode -y
    assert episode_T_camera[2, 1] < -0.9  # its down is episode -z
    grid = VoxelGrid((0.0, -3.2, 0.0), (128, 128, 48), 0.05)
    labels = sscnet.resample_labels(frame.volume, episode_T_ssc, grid)
    known = labels != sscnet.UNKNOWN
    assert 0.05 < known.mean() < 0.9
    # The resampled truth covers the same part of the room: litres of occupied space agree.
    whole = sscnet.resample_labels(frame.volume, episode_T_ssc, VoxelGrid((-1, -4, -0.06), (160, 200, 73), 0.04))
    occupied = ((whole > 0) & (whole < sscnet.UNKNOWN)).sum() * 0.04**3
    original = ((frame.volume.labels > 0) & (frame.volume.labels < sscnet.UNKNOWN)).sum() * 0.02**3
    assert abs(occupied / original - 1.0) < 0.03
    # And the depth points, in the episode frame, hit it.
    points = frame.camera.unproject(frame.depth_m)[::5, ::5].reshape(-1, 3)[frame.depth_m[::5, ::5].ravel() > 0]
    coarse = sscnet.SscnetVolume(grid.origin_m, grid.voxel_m, episode_T_camera, labels)
    points = transforms.apply(episode_T_camera, points)
    points = points[grid.index(points)[1]]
    assert near_occupied(points, coarse, 0.06).mean() > 0.85
