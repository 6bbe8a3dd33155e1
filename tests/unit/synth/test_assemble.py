"""An episode in which a chair is moved: truth is of t0, pictures follow, and what is unlike t0 for long is ignored."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("embreex")

from episode_builders import same
from living_rooms import chair, room, table

from hsbench.datasets.verify import verify_episode
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import planar
from hsbench.io.episodes import read_episode, write_episode
from hsbench.schema import KINECT_V2, Episode, EventTable, ObjectMotions, PoseTable, Sensor
from hsbench.schema.motions import scene_at
from hsbench.schema.states import Affordance
from hsbench.synth.activities import Life, LifeConfig
from hsbench.synth.assemble import filmed_episode
from hsbench.synth.detectors import DetectorConfig
from hsbench.synth.placement import CameraConfig
from hsbench.synth.recipes import Unit
from hsbench.synth.render import open_renderer
from hsbench.synth.rgbd import RgbdConfig, RgbdSettings
from hsbench.synth.rooms import RoomConfig
from hsbench.synth.seeds import Seeds
from hsbench.truth.affordance import affordance_truth
from hsbench.truth.occupancy import solid_occupancy

S = 10**9
SCENE = room(4.6, 3.8, table(13, 2.6, 1.8, 0.0), chair(14, 2.6, 1.15, np.pi))
CONFIG = RgbdConfig(frame_rate_hz=0.5, grid_shape=(80, 128, 24))
SETTINGS = RgbdSettings(RoomConfig(), (), LifeConfig(duration_s=10.0), CameraConfig(), DetectorConfig(), CONFIG)
SENSOR = Sensor("rgbd", PinholeCamera(80, 60, 55.0, 55.0, 40.0, 30.0), 1.7, 0.35)
SCORED = (Affordance.WALKABLE, Affordance.SITTABLE, Affordance.INTERACTABLE)


def filmed(away_s: int) -> Episode:
    """10 s without people; the chair stands .5 m back from 2 s on, for so long."""
    stamps = np.array([2 * S - 1, 2 * S, (2 + away_s) * S, (2 + away_s) * S + 1])
    moves = np.array([[0, 0, 0], [0, 0.5, 0.4], [0, 0.5, 0.4], [0, 0, 0]])
    none = np.empty(0, dtype=np.int64)
    ids = none.astype(np.int32)
    life = Life(
        (),
        PoseTable(KINECT_V2.name, none, ids, np.empty((0, 25), np.uint8), np.empty((0, 25, 3), np.float32)),
        none.astype(np.uint8),
        EventTable(ids, (), ids, (), none, none, ()),
        motions=ObjectMotions(stamps, np.full(4, 14, dtype=np.int32), ("",) * 4, moves),
    )
    unit = Unit(Seeds(0), 1, "train", "all", open_renderer("raycast"))
    here = planar(0.4, 0.3, 0.6)
    return filmed_episode(unit, "rgbd-activity", SCENE, life, here, SENSOR, SETTINGS)


def test_a_chair_that_stands_elsewhere_for_most_of_the_time() -> None:
    truth = filmed(6).truth
    assert truth is not None
    scene, occupancy, affordance = truth.scene, truth.occupancy, truth.affordance
    moved = scene_at(scene, truth.motions.moves_at(5 * S))
    assert np.array_equal(occupancy.semantic, solid_occupancy(scene, CONFIG.grid)[0])
    assert np.array_equal(occupancy.ignored, occupancy.semantic != solid_occupancy(moved, CONFIG.grid)[0])
    assert occupancy.ignored.sum() > 100
    bits = np.uint8(sum(1 << kind for kind in SCORED))
    assert np.array_equal(affordance.ignored, ((affordance.labels ^ affordance_truth(moved).labels) & bits) > 0)
    assert affordance.ignored.any()


def test_a_chair_that_is_back_soon_is_no_matter() -> None:
    truth = filmed(4).truth
    assert truth is not None
    assert not truth.occupancy.ignored.any()
    assert not truth.affordance.ignored.any()


def test_motions_and_pictures_through_the_disk(tmp_path: Path) -> None:
    episode = filmed(4)
    write_episode(tmp_path / "e", episode, "scene-000001", "train", "raycast")
    back = read_episode(tmp_path / "e", truth=True)
    assert same(back.truth.motions, episode.truth.motions)
    assert verify_episode(back) == []
    chair_px = [back.truth.frames[k].instance == 14 for k in range(5)]  # at 0, 2, 4, 6 and 8 s
    assert chair_px[0].sum() > 50
    assert [np.array_equal(px, chair_px[0]) for px in chair_px] == [True, False, False, False, True]
