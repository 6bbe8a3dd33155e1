"""A 360 episode: its height is truth, states follow lines of sight all around, and each scene has its own length."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("embreex")

from episode_builders import same
from lit_room import HERE, THERE, scene, table, wardrobe

from hsbench.datasets.verify import verify_episode
from hsbench.errors import SchemaError
from hsbench.geometry.polygons import contains
from hsbench.geometry.rays import pack_solids, segments_blocked
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.io.episodes import read_episode, write_episode
from hsbench.io.strict_json import read_json
from hsbench.schema import Episode
from hsbench.schema.occupancy import AffordanceTruth
from hsbench.schema.poses import JointState
from hsbench.schema.skeletons import COCO_18
from hsbench.schema.states import VoxelState
from hsbench.synth.assemble import scene_in
from hsbench.synth.detectors.landmarks import landmarks
from hsbench.synth.panorama import PanoramaConfig, PanoramaSettings, _less_hidden_rooms, panorama_episode
from hsbench.synth.people.body import Body
from hsbench.synth.recipes import Unit, find_recipe
from hsbench.synth.render import open_renderer
from hsbench.synth.seeds import Seeds
from hsbench.truth.affordance import affordance_truth

CONFIG = {
    "room": {"width_m": (3.4, 4.0), "depth_m": (3.2, 3.6)},
    "life": {"duration_s": 8.0, "empty_s": 1.0, "fps": 10, "from_outside": False},
    "panorama": {"people": (1, 1), "home_share": 0.0},
    "camera": {"width_px": 512},
    "poses": {"preset": "clean", "skeleton": "coco-18"},
    "recording": {
        "frame_rate_hz": 0.5, "pose_rate_hz": 10, "grid_origin_m": (-3.2, -3.2, 0.0), "grid_shape": (64, 64, 24),
        "voxel_m": 0.1,
    },
}  # fmt: skip
PIXELS = 0.02  # places are rounded to a hundredth of a pixel


@pytest.fixture(scope="module")
def episode() -> Episode:
    unit = Unit(Seeds(0).child("scene").child(1), 1, "train", "all", open_renderer("raycast"))
    return panorama_episode(unit, "activity-360", PanoramaSettings.of(CONFIG, "train"))


def test_the_height_of_the_camera_is_truth_alone(episode: Episode, tmp_path: Path) -> None:
    assert episode.truth is not None
    assert episode.truth.sensor is not None
    assert episode.sensor == replace(episode.truth.sensor, height_m=None) != episode.truth.sensor
    assert episode.placed_sensor == episode.truth.sensor
    write_episode(tmp_path / "unit", episode, "scene-000001", "train", "raycast")
    inputs, whole = read_episode(tmp_path / "unit"), read_episode(tmp_path / "unit", truth=True)
    assert inputs.truth is None
    assert inputs.sensor == whole.sensor == episode.sensor == inputs.placed_sensor
    assert whole.truth is not None
    assert whole.truth.sensor == episode.truth.sensor
    assert same(whole.truth.affordance, episode.truth.affordance)
    assert len(inputs.frames) == 4
    assert all(frame.depth_m is None for frame in inputs.frames)  # a 360 camera gives colour only
    assert inputs.frames[0].rgb is not None
    assert inputs.frames[0].rgb.shape == (256, 512, 3)


def test_files_pictures_poses_and_truth_tell_one_story(episode: Episode, tmp_path: Path) -> None:
    write_episode(tmp_path / "unit", episode, "scene-000001", "train", "raycast")
    assert verify_episode(read_episode(tmp_path / "unit", truth=True)) == []


def test_observed_joints_are_the_projected_ones_all_around(episode: Episode) -> None:
    truth, seen = episode.truth, episode.poses
    assert truth is not None
    assert truth.sensor is not None
    assert truth.poses is not None
    assert truth.poses.poses.joints_m is not None
    assert seen is not None
    assert seen.joints_px is not None
    assert len(seen) > 50
    body = _body_of(episode)
    joints = landmarks(COCO_18, body, truth.poses.poses.joints_m[truth.poses.match].astype(np.float64))
    expected, _ = truth.sensor.camera.project(apply(invert(truth.sensor.world_T_camera), joints))
    tracked = seen.joint_state == JointState.TRACKED
    across = np.abs(seen.joints_px[..., 0] - expected[..., 0])
    off = np.minimum(across, truth.sensor.camera.width_px - across)[tracked]
    assert off.max() < PIXELS + 1e-3
    assert np.abs(seen.joints_px[..., 1] - expected[..., 1])[tracked].max() < PIXELS + 1e-3
    assert (seen.joint_state > 0).all()  # nobody is outside a sphere's picture


def _body_of(episode: Episode) -> Body:
    """The person's body, drawn again from the stream that drew it."""
    from hsbench.synth.activities import live

    unit = Unit(Seeds(0).child("scene").child(1), 1, "train", "none", None)
    config = PanoramaSettings.of(CONFIG, "train")
    scene = config.scene(unit.scene_id, unit.seeds)
    return live(scene, unit.seeds.child("panorama").child("life"), config.life(unit)).bodies[0]


def test_what_the_camera_knows_follows_lines_of_sight(episode: Episode) -> None:
    truth = episode.truth
    assert truth is not None
    assert truth.sensor is not None
    assert truth.scene is not None
    assert truth.occupancy is not None
    grid, state = truth.occupancy.grid, truth.occupancy.state
    solids = pack_solids([s for item in truth.scene.objects for s in item.solids])
    blocked = segments_blocked(truth.sensor.world_T_camera[:3, 3], grid.centres().reshape(-1, 3), solids)
    blocked = blocked.reshape(state.shape)
    assert (state != VoxelState.OUTSIDE_FOV).all()  # a sphere has none
    inside = state != VoxelState.OUTSIDE_ROOM
    assert blocked[state == VoxelState.OCCLUDED].mean() > 0.97
    assert blocked[state == VoxelState.FREE].mean() < 0.01
    assert {VoxelState.FREE, VoxelState.SURFACE, VoxelState.OCCLUDED} <= set(state[inside].tolist())


def test_cells_of_another_room_out_of_sight_are_not_asked() -> None:
    """Of the room behind a doorway those cells count to which a line 1.5 m above the floor is free."""
    here = planar(2.0, 1.9, 0.4)
    room = scene_in(invert(here), scene(wardrobe(), table()))
    truth = affordance_truth(room)
    asked = _less_hidden_rooms(truth, room)
    assert isinstance(asked, AffordanceTruth)
    assert np.array_equal(asked.labels, truth.labels)
    side = truth.labels.shape[0]
    x, y = ((side / 2 - 0.5 - np.arange(side)) * truth.cell_m for _ in range(2))
    cells = apply(here, np.stack([*np.meshgrid(x, y, indexing="ij"), np.full((side, side), 1.5)], axis=-1))
    own, other = contains(HERE, cells[..., :2]), contains(THERE, cells[..., :2])
    assert not asked.ignored[own].any()
    assert not asked.ignored[cells[..., 0] > 7.3].any()  # outside of the flat
    walls = pack_solids([s for o in scene().objects if o.category.group == "structure" for s in o.solids])
    blocked = segments_blocked(np.array([2.0, 1.9, 1.5]), cells[other], walls)
    assert (asked.ignored[other] == blocked).mean() > 0.999
    assert 0.1 < blocked.mean() < 0.95


def test_some_scenes_of_each_test_are_watched_for_an_hour() -> None:
    config = find_recipe("activity-360").config
    length = {}
    for split, first, count in (("train", 0, 120), ("val", 10000, 40), ("test-seen", 11000, 30)):
        found = PanoramaSettings.of(config, split)
        units = [Unit(Seeds(0).child(n), n, split, "none", None) for n in range(first, first + count)]
        plans = [found.life(unit) for unit in units]
        length[split] = [plan.duration_s for plan in plans]
        assert {plan.people for plan in plans} == {1, 2, 3, 4}
    assert set(length["train"]) == {600.0}
    for split in ("val", "test-seen"):
        assert length[split].count(3600.0) == 8
        assert set(length[split][:2]) == {600.0}  # mini is short


@pytest.mark.parametrize(
    ("table", "message"),
    [({"people": (0, 2)}, "panorama.people"), ({"people": (3, 2)}, "least <= most"), ({"home_share": 2.0}, "share of")],
)
def test_impossible_settings(table: dict[str, object], message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        PanoramaConfig(**table)


def test_novel_scenes_are_drawn_from_what_no_other_split_uses() -> None:
    config = find_recipe("activity-360").config
    common, novel = (PanoramaSettings.of(config, split) for split in ("val", "test-novel"))
    assert not set(common.common.families) & set(novel.common.families)
    assert not {name for name, _ in common.common.room.templates} & {name for name, _ in novel.common.room.templates}
    with pytest.raises(SchemaError, match="unknown keys"):
        PanoramaSettings.of({**config, "camera": {"focal_px": 300.0}}, "val")


RECIPE = """
from hsbench.synth.panorama import PanoramaSettings, panorama_episode

def build(config, unit):
    yield panorama_episode(unit, "tiny", PanoramaSettings.of(config, unit.split))
"""
SETTINGS = """
[room]
width_m = [3.4, 4.0]
[life]
duration_s = 5.0
fps = 10
from_outside = false
[panorama]
people = [1, 1]
home_share = 0.0
[camera]
width_px = 64
[poses]
preset = "openpose-like"
[recording]
frame_rate_hz = 0.5
pose_rate_hz = 10
"""
GENERATE = """
from pathlib import Path
from hsbench.synth.generate import Job, generate

if __name__ == "__main__":
    job = Job({recipe!r}, 0, ((1, "train"), (2, "train")))
    print(*generate(job, Path({out!r}), workers=2))
"""


@pytest.mark.slow
def test_without_egl_a_data_set_is_made_by_rays_with_one_notice(tmp_path: Path) -> None:
    recipe = tmp_path / "tiny"
    recipe.mkdir()
    (recipe / "tiny.py").write_text(RECIPE)
    (recipe / "config.toml").write_text(SETTINGS)
    script = tmp_path / "make.py"
    script.write_text(GENERATE.format(recipe=str(recipe), out=str(tmp_path / "data")))
    environment = {**os.environ, "__EGL_VENDOR_LIBRARY_DIRS": str(tmp_path / "empty")}
    done = subprocess.run(
        [sys.executable, str(script)], env=environment, capture_output=True, text=True, timeout=300, check=True
    )
    assert sorted(done.stdout.split()) == ["tiny-000001", "tiny-000002"]
    notices = [line for line in done.stderr.splitlines() if "ray caster" in line and not line.startswith("  ")]
    assert len(notices) == 1
    assert read_json(tmp_path / "data" / "dataset.json")["renderer"] == "raycast"
    for name in ("tiny-000001", "tiny-000002"):
        episode = read_episode(tmp_path / "data" / "episodes" / name, truth=True)
        assert len(episode.frames) == 3
        assert episode.truth is not None
        assert episode.truth.frames is not None
        assert episode.truth.frames[0].instance is not None
        assert (episode.truth.frames[0].instance > 0).all()  # all around there is a room
