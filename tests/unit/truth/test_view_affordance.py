"""Labels of pixels: those of the surface point, as rays against single parts and the map from above say it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera, world_T_camera
from hsbench.geometry.rays import cast, pack_solids
from hsbench.geometry.transforms import apply, planar
from hsbench.schema import Episode, EpisodeTruth, ObjectMotions, Scene, Sensor
from hsbench.schema.episode import FrameList
from hsbench.schema.motions import Move
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.states import Affordance
from hsbench.truth.affordance import afford, top_down
from hsbench.truth.view_affordance import SCORED, labelled_view, stored_view, view_affordance
from hsbench.typing import BoolArray, FloatArray, UInt8Array
from tests.unit.synth.living_rooms import chair, living_room, room, sofa, table, wardrobe

CAMERA = PinholeCamera(160, 120, 90.0, 90.0, 80.0, 60.0)
LEVEL = world_T_camera(0.0, 0.0)
POSE = planar(0.3, 0.3, 0.8) @ world_T_camera(2.1, 0.5)
ROOM = room(
    4.4, 4.0, sofa(10, 3.9, 2.4, -np.pi / 2), wardrobe(11, 1.2, 3.68, 0.0), table(13, 2.2, 2.0, 0.2),
    chair(14, 2.2, 1.2, np.pi),
)  # fmt: skip
S = 10**9
AWAY: Move = (0.5, 0.3, 0.4)


def bit(labels: UInt8Array, kind: Affordance) -> BoolArray:
    return np.asarray((labels >> kind & 1).astype(bool))


@cache
def parts_seen(scene: Scene = ROOM) -> tuple[np.ndarray, list[tuple[int, str]], FloatArray]:
    """((h, w) number of the part of each pixel by rays against single parts, names, (h, w, 3) points)."""
    named = [(o.object_id, p.name, s) for o in scene.objects for p, s in zip(o.parts, o.solids, strict=True)]
    solids = pack_solids([s for _, _, s in named])
    image = cast(CAMERA, POSE, solids, np.arange(len(named), dtype=np.int32), len(named))
    points = apply(POSE, CAMERA.unproject(image.depth_m))
    return image.owner, [(k, name) for k, name, _ in named], points


def shown(*names: tuple[int, str]) -> BoolArray:
    owner, known, _ = parts_seen()
    return np.isin(owner, [known.index(name) for name in names])


@cache
def labels() -> tuple[UInt8Array, BoolArray]:
    return labelled_view(afford(ROOM), CAMERA, POSE)


def test_seats_are_sittable_on_top_and_nowhere_else() -> None:
    found, _ = labels()
    *_, points = parts_seen()
    tops = shown((14, "seat")) & (np.abs(points[..., 2] - 0.45) < 1e-6)
    tops |= shown((10, "seat0"), (10, "seat1")) & (np.abs(points[..., 2] - 0.43) < 1e-6)
    assert tops.sum() > 100
    assert np.array_equal(bit(found, Affordance.SITTABLE), tops)


def test_legs_and_walls_afford_nothing() -> None:
    found, _ = labels()
    plain = shown(*((k, f"leg{i}") for k in (13, 14) for i in range(4)), (3, "east"), (3, "north"), (14, "back"))
    assert plain.sum() > 500
    assert not (found[plain] & SCORED).any()


def test_the_floor_is_walkable_as_the_map_says_and_so_not_under_a_table() -> None:
    found, _ = labels()
    *_, points = parts_seen()
    floor = shown((1, "floor"))
    plan = bit(top_down(afford(ROOM), np.zeros(2), (88, 80)), Affordance.WALKABLE)
    cell = np.floor(points[floor][:, :2] / 0.05).astype(int)
    assert np.array_equal(bit(found[floor], Affordance.WALKABLE), plan[tuple(cell.T)])
    local = apply(np.linalg.inv(planar(2.2, 2.0, 0.2)), points[floor])
    under = (np.abs(local[:, :2]) < [0.7, 0.4]).all(axis=1)
    assert under.sum() > 50
    assert not bit(found[floor], Affordance.WALKABLE)[under].any()
    assert bit(found[floor], Affordance.WALKABLE).sum() > 500
    assert not bit(found[~floor], Affordance.WALKABLE).any()


@pytest.mark.parametrize("seed", range(3))
def test_from_above_a_pixel_has_the_labels_of_its_cell(seed: int) -> None:
    """Borders of cells apart; a column also has the labels of a seat under a table, which the pixel does not show."""
    scene = living_room(seed)
    scene = Scene(scene.scene_id, scene.rooms, 2.5, tuple(o for o in scene.objects if o.category_name != "ceiling"))
    camera = PinholeCamera(200, 160, 260.0, 260.0, 100.0, 80.0)
    centre = scene.rooms[0].outline_xy.mean(axis=0)
    pose = planar(*centre, 0.0) @ world_T_camera(7.0, np.pi / 2)
    found = afford(scene)
    view, _ = labelled_view(found, camera, pose)
    owner = np.repeat(np.arange(len(scene.objects)), [len(o.parts) for o in scene.objects])
    image = cast(camera, pose, pack_solids([s for o in scene.objects for s in o.solids]), owner.astype(np.int32), 99)
    points = apply(pose, camera.unproject(image.depth_m))
    shape = (120, 120)
    plan = top_down(found, np.zeros(2), shape)
    cell = np.clip(np.floor(points[..., :2] / 0.05).astype(int), 0, 119)
    of_cell = plan[cell[..., 0], cell[..., 1]]
    seat, seats = bit(view, Affordance.SITTABLE), bit(of_cell, Affordance.SITTABLE)
    assert seat.sum() > 100
    assert (seat & ~seats).mean() < 0.01
    walked = bit(view, Affordance.WALKABLE)
    assert walked.sum() > 1000
    assert (walked != bit(of_cell, Affordance.WALKABLE)).mean() < 0.01


def test_glass_is_void_and_its_frame_is_not() -> None:
    _, void = labels()
    assert shown((5, "pane")).sum() > 20
    assert np.array_equal(void, shown((5, "pane")) | (parts_seen()[0] < 0))


def test_labels_do_not_depend_on_the_frame() -> None:
    turn = planar(-1.3, 2.2, 2.0)
    turned, _ = labelled_view(afford(ROOM.moved(turn)), CAMERA, turn @ POSE)
    here, _ = labels()
    floor = shown((1, "floor"))  # cells of the map of the floor lie along the frame's axes
    assert np.mean((here != turned)[~floor] & SCORED > 0) < 2e-3
    assert np.mean(bit(here, Affordance.WALKABLE) != bit(turned, Affordance.WALKABLE)) < 0.06


def motions(*keys: tuple[int, Move]) -> ObjectMotions:
    return ObjectMotions(
        np.array([t * S for t, _ in keys], dtype=np.int64),
        np.full(len(keys), 14, dtype=np.int32),
        ("",) * len(keys),
        np.array([move for _, move in keys], dtype=np.float64),
    )


def test_what_is_elsewhere_for_more_than_half_is_not_scored_where_labels_differ() -> None:
    rest: Move = (0.0, 0.0, 0.0)
    seat = shown((14, "seat")) & bit(labels()[0], Affordance.SITTABLE)
    void = labels()[1]
    for back_s, unscored in ((40, False), (60, True)):
        moved = motions((0, rest), (1, AWAY), (1 + back_s, AWAY), (2 + back_s, rest))
        view = view_affordance(ROOM, CAMERA, POSE, moved, 0, 100 * S)
        left_out = view & VIEW_UNSCORED > 0
        assert np.array_equal(view & ~np.uint8(VIEW_UNSCORED), labels()[0])
        assert left_out[void].all()
        assert left_out[seat].mean() > 0.6 if unscored else np.array_equal(left_out, void)
        assert not left_out[shown((10, "seat0"))].any()


def test_truth_of_a_view_is_checked() -> None:
    with pytest.raises(SchemaError, match=r"view_affordance has dtype int64; expected uint8"):
        EpisodeTruth(view_affordance=np.zeros((2, 3), dtype=np.int64))


def test_a_panorama_shows_what_a_picture_from_the_same_place_shows() -> None:
    """Each pixel of the picture against the pixel of the panorama that its ray goes through, but at edges."""
    around = EquirectangularCamera(1024, 512)
    found, void = labels()
    panorama, panorama_void = labelled_view(afford(ROOM), around, planar(*POSE[:2, 3], 0.0, POSE[2, 3]) @ LEVEL)
    directions = (CAMERA.rays() @ POSE[:3, :3].T) @ LEVEL[:3, :3]
    pixels, _ = around.project(directions)
    row, column = pixels[..., 1].astype(int), pixels[..., 0].astype(int)
    assert (panorama[row, column] == found).mean() > 0.97
    assert (panorama_void[row, column] == void).mean() > 0.99
    assert {int(v) for v in np.unique(found)} <= {int(v) for v in np.unique(panorama)}


def test_a_stored_view_goes_before_one_from_the_scene() -> None:
    sensor = Sensor("monocular", CAMERA, 2.1, 0.5)
    truth = EpisodeTruth(scene=ROOM, motions=ObjectMotions.none())
    episode = Episode("ep", "lab", sensor, FrameList(), None, 0, 10 * S, truth=truth)
    computed = view_affordance(ROOM, CAMERA, sensor.world_T_camera, ObjectMotions.none(), 0, 10 * S)
    assert np.array_equal(stored_view(episode), computed)
    stored = np.full((120, 160), 2, dtype=np.uint8)
    kept = replace(episode, truth=replace(truth, view_affordance=stored))
    assert stored_view(kept) is stored
    unplaced = replace(sensor, height_m=None)
    assert np.array_equal(stored_view(replace(episode, sensor=unplaced, truth=replace(truth, sensor=sensor))), computed)
    for less in (replace(episode, sensor=unplaced), replace(episode, truth=replace(truth, motions=None))):
        assert stored_view(less) is None
    assert stored_view(replace(episode, truth=None)) is None
