"""Real captures through the common code: into episodes, to disk and back, predicted, checked and scored.

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from hsbench.baselines.occlusion.action import recognise
from hsbench.baselines.occlusion.carve import activity_maps
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.run import predict
from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.evaluation.score import score
from hsbench.geometry.transforms import apply
from hsbench.schema.states import VoxelState
from hsbench.tasks.scene_completion import GRID, SCENE_COMPLETION

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
pytestmark = pytest.mark.skipif(
    not REALDATA.is_dir(), reason=f"needs the real captures in realdata ({REALDATA}; set HSBENCH_REALDATA)"
)
SSC, SKELETON = REALDATA / "ssc", REALDATA / "skeleton"
NEAR_M = 0.06


@pytest.fixture(scope="module")
def nyu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("nyu") / "data"
    depth, volume = SSC / "sscnet_NYU0001_0000_depth.png", SSC / "sscnet_NYU0001_0000.bin"
    assert run(["import", "sscnet", str(depth), str(volume), "--out", str(out), "--name", "NYU0001"]) == 0
    return out


def test_depth_lies_on_the_occupied_voxels_of_the_imported_episode(nyu: Path) -> None:
    episode = load(nyu, truth=True)[0]
    occupancy = episode.truth.occupancy
    frame = episode.frames[0]
    points = apply(episode.sensor.world_T_camera, episode.sensor.camera.unproject(frame.depth_m))[frame.depth_m > 0]
    _, inside = GRID.index(points)
    solid = GRID.centres()[occupancy.solid]
    # distance to a voxel, not to its centre: per axis, what exceeds half a voxel
    _, nearest = KDTree(solid).query(points[inside])
    gap = np.maximum(np.abs(points[inside] - solid[nearest]) - GRID.voxel_m / 2, 0.0)
    assert np.mean(np.linalg.norm(gap, axis=1) <= NEAR_M) >= 0.90


def test_surface_voxels_from_real_depth_are_mostly_solid(nyu: Path) -> None:
    occupancy = load(nyu, truth=True)[0].truth.occupancy
    surface = (occupancy.state == VoxelState.SURFACE) & ~occupancy.ignored
    free = (occupancy.state == VoxelState.FREE) & ~occupancy.ignored
    assert occupancy.solid[surface].mean() > 10 * occupancy.solid[free].mean()


def test_a_real_frame_is_verified_predicted_and_scored_like_a_generated_one(nyu: Path, tmp_path: Path) -> None:
    data = load(nyu, truth=True)
    assert verify_files(nyu) == []
    assert verify_episode(data[0]) == []
    values = {}
    for name in ("all-solid", "visible-only"):
        assert list(predict(name, load(nyu), tmp_path / name)) == ["NYU0001"]
        values[name] = score(SCENE_COMPLETION.name, tmp_path / name, load(nyu))
    assert values["all-solid"].metrics["occluded/recall"].value > 0.99
    assert values["visible-only"].metrics["occluded/recall"].value < 0.01
    assert values["all-solid"].primary.value > values["visible-only"].primary.value


@pytest.mark.parametrize("name", ["Ges01_wavehand", "Ges04_comehere", "Ges05_demopoint"])
def test_a_recorded_person_becomes_an_activity_map(name: str, tmp_path: Path) -> None:
    recording = SKELETON / f"laban_kinect2_{name}.csv"
    arguments = [str(recording), "--out", str(tmp_path / "data"), "--map", str(tmp_path / "map.png")]
    assert run(["import", "kinect-csv", *arguments]) == 0
    episode = load(tmp_path / "data")[0]
    config = CarveConfig()
    activity = recognise(episode.poses, config)
    maps = activity_maps(activity, GRID, config)
    assert len(activity.position) > 0.9 * len(episode.poses)  # the person stands in full view
    assert maps.stand.max() == 1.0
    assert maps.sit.max() == 0.0
    middle = np.median(activity.position, axis=0)
    i, j = ((middle - np.array(GRID.origin_m[:2])) / GRID.voxel_m).astype(int)
    assert maps.stand[i, j] == 1.0
    # somebody who gestures on the spot covers about a body disc, not the room
    assert 0.05 < (maps.stand > config.threshold).sum() * GRID.voxel_m**2 < 0.6
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
