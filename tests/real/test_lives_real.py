"""Lives in imported scenes: people sit on the CC0 sofa and on SceneNet's chairs, and what they touch they do touch.

Trimesh tells how far fingers and pelvises are from the triangles, independently of what planned them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from hsbench.datasets.importers.scene_import import ImportedScene, import_scene
from hsbench.datasets.importers.scene_labels import Label
from hsbench.geometry.transforms import apply
from hsbench.io.scene_folder import read_scene
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.synth.activities import Life, LifeConfig, live
from hsbench.synth.activities.measures import measure, promises
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import J
from hsbench.synth.seeds import Seeds
from tests.real.test_scenes_real import HABITAT, SCENES, living, room_89, table

pytestmark = [
    pytest.mark.skipif(not SCENES.is_dir(), reason=f"needs the real scenes in {SCENES} (set HSBENCH_REALDATA)"),
    pytest.mark.filterwarnings("ignore:meshes with open pieces"),
]
__all__ = ["living", "room_89"]  # fixtures
FINGER_M = 0.03  # as near as a finger tip that touches must be
PELVIS_M = 0.03
EVERY = 15  # poses of an event that are compared
UNTIMED = "faster than life, planning included"
EXPLORER = LifeConfig(duration_s=150.0, unused_share=0.0, atypical_share=0.0)


def lived(scene: Scene) -> Life:
    life = live(scene, Seeds(2), EXPLORER)
    assert walked_m(life) > 10.0
    broken = [p for p in promises(measure(scene, life)) if not p.kept and p.name != UNTIMED]
    assert not broken
    return life


def walked_m(life: Life) -> float:
    assert life.poses.joints_m is not None
    return float(np.linalg.norm(np.diff(life.poses.joints_m[:, 0, :2], axis=0), axis=1).sum())


def used(scene: Scene, life: Life, activity: str) -> list[tuple[SceneObject, Part, str, np.ndarray]]:
    """For each event of an activity: object, part, what is in contact, and joints (n, 25, 3) of some of its poses."""
    events, found = life.events, []
    for k in np.flatnonzero([name == activity for name in events.activity]):
        item = scene.object(int(events.object_id[k]))
        (part,) = (p for p in item.parts if p.name == events.part[k])
        during = (life.poses.timestamp_ns >= events.start_ns[k]) & (life.poses.timestamp_ns <= events.end_ns[k])
        assert life.poses.joints_m is not None
        joints = life.poses.joints_m[during & (life.poses.track_id == events.person_id[k])]
        found.append((item, part, events.contact[k], joints[::EVERY].astype(np.float64)))
    return found


def mesh_of(item: SceneObject, part: Part) -> trimesh.Trimesh:
    return trimesh.Trimesh(apply(item.scene_T_object, part.vertices), part.triangles, process=False)


def assert_contacts_are_real(scene: Scene, life: Life) -> None:
    for item, part, contact, joints in used(scene, life, "touch"):
        for hand in contact.split(","):
            tips = joints[:, J[hand.replace("hand", "hand_tip")]]
            corners = mesh_of(item, part).triangles
            for tip in tips:
                nearest = trimesh.triangles.closest_point(corners, np.tile(tip, (len(corners), 1)))
                assert np.linalg.norm(nearest - tip, axis=1).min() < FINGER_M
    belly_m = life.bodies[0].radius(anatomy.RADIUS_BELLY[0])
    for item, part, _, joints in used(scene, life, "sit"):
        pelvis = joints[:, J["spine_base"]]
        down = np.tile([0.0, 0.0, -1.0], (len(pelvis), 1))
        hits, rays, _ = mesh_of(item, part).ray.intersects_location(pelvis, down, multiple_hits=False)
        assert len(rays) == len(pelvis)
        assert np.abs(pelvis[rays, 2] - hits[:, 2] - belly_m).max() < PELVIS_M


@pytest.mark.slow
def test_somebody_sits_on_the_sofa_and_opens_nothing_in_vain(living: Path) -> None:
    scene = read_scene(living)
    life = lived(scene)
    assert "sofa" in {item.category_name for item, *_ in used(scene, life, "sit")}
    assert {item.category_name for item, *_ in used(scene, life, "touch")} & {"sideboard", "wardrobe", "bookshelf"}
    assert_contacts_are_real(scene, life)


@pytest.mark.slow
def test_chairs_of_the_scenenet_room_are_sat_on_and_its_tables_touched(room_89: ImportedScene) -> None:
    life = lived(room_89.scene)
    assert {item.category_name for item, *_ in used(room_89.scene, life, "sit")} == {"chair"}
    assert "dining_table" in {item.category_name for item, *_ in used(room_89.scene, life, "touch")}
    assert_contacts_are_real(room_89.scene, life)


@pytest.mark.slow
def test_the_habitat_table_is_touched() -> None:
    rows: dict[str, str | Label] = {"Cube": "floor", "Cube.001": "object"}
    rows |= {f"Cube.00{k}": Label("dining_table", "table", "top" if k == 2 else None) for k in range(2, 7)}
    scene = import_scene(HABITAT / "simple_room.stage_config.json", table(rows), "simple").scene
    life = lived(scene)
    assert {item.category_name for item, *_ in used(scene, life, "touch")} == {"dining_table"}
    assert_contacts_are_real(scene, life)
