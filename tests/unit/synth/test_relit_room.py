"""Moved things and people under changing light: each frame is what a rendering of its own light would show."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("embreex")

from lit_room import CAMERA, POSE, part, scene, table, thing, wardrobe

from hsbench.geometry.transforms import apply, invert, planar
from hsbench.io.changing_light import ChangingLight
from hsbench.io.frame_store import Film, Picture, Recording, write_recording
from hsbench.schema import KINECT_V2, EventTable, ObjectMotions, PoseTable, Sensor
from hsbench.schema.motions import Move, scene_at
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.synth.daylight import Day
from hsbench.synth.film import Filming
from hsbench.synth.people import Body
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.relit_room import RelitRoom, display_table, relit_room
from hsbench.synth.render import Lighting, open_renderer
from hsbench.synth.render.background import FINE_GATHER_RAYS, Drawing, lit_by
from hsbench.synth.render.light_basis import SUN_STEP_RAD, LightStates
from hsbench.synth.render.sources import person_lighting, sources_of
from hsbench.synth.render.tone import encode_srgb, toned
from hsbench.synth.scene_meshes import scene_meshes
from hsbench.synth.seeds import Seeds
from hsbench.synth.timelapse import awake_in_rooms, film
from hsbench.typing import UInt8Array

SENSOR = Sensor("monocular", CAMERA, 1.7, 0.35)
EPISODE_T_ROOM = SENSOR.world_T_camera @ invert(POSE)
BODY = Body(1.7)
S = 10**9
BOX = 12
OTTOMAN = part("body", (-0.25, -0.25, 0), (0.25, 0.25, 0.45), (170, 60, 50))
SCENE = scene(wardrobe(), table(), thing(BOX, "ottoman", OTTOMAN, at=planar(1.4, 1.5, 0.2))).moved(EPISODE_T_ROOM)
AWAY: Move = (-0.35, 0.3, 0.4)
REST: Move = (0.0, 0.0, 0.0)
MOTIONS = ObjectMotions(
    np.array([1, 2, 5, 6], dtype=np.int64) * S,
    np.full(4, BOX, dtype=np.int32),
    ("",) * 4,
    np.array([REST, AWAY, AWAY, REST]),
)
SECONDS = np.array([0.0, 3.0, 4.0, 7.0])
DAYLIGHT = sources_of(SCENE)


def states() -> LightStates:
    """Day, then the lamps go on and the sun sets while the box is away."""
    sun = DAYLIGHT.windows[0].normal * [-1, -1, 1] * 0.8 + [0, 0, 0.6]
    way = [planar(0, 0, a)[:3, :3] @ sun for a in SUN_STEP_RAD / 0.8 * np.array([0.0, 1.0, 2.0, 3.0])]
    return LightStates(
        np.array([0.0, 0.0, 1.0, 1.0])[:, None, None] * np.ones((2, 3)),
        np.array([[1.0, 1.0, 1.0], [0.5, 0.5, 0.5], [0.05, 0.06, 0.08], [0.001, 0.001, 0.001]]),
        np.array(way),
        np.array([1.0, 0.6, 0.0, 0.0])[:, None] * np.ones(3),
    )


def people() -> PoseTable:
    """Behind the table at the first and third time."""
    at = apply(EPISODE_T_ROOM, np.array([2.4, 3.0, 0.0]))[:2]
    joints = pose(BODY, standing(BODY, at, 0.7), 30.0, None)[0]
    return PoseTable(
        KINECT_V2.name,
        np.array([0, 4 * S], dtype=np.int64),
        np.ones(2, dtype=np.int32),
        np.full((2, 25), 2, dtype=np.uint8),
        np.array([joints, joints], dtype=np.float32),
    )


@cache
def filming() -> Filming:
    return Filming(SCENE, (BODY,), people(), SENSOR, open_renderer("raycast"), Lighting(1.0), MOTIONS)


@cache
def relit() -> RelitRoom:
    return relit_room(filming().room, DAYLIGHT, states(), SECONDS)


def rendered(index: int) -> Picture:
    """The moved room under the light of a frame, drawn in one go."""
    room = relit()
    moved = scene_at(SCENE, MOTIONS.moves_at(round(SECONDS[index] * S)))
    view = filming().renderer.render(scene_meshes(moved), CAMERA, SENSOR.world_T_camera, Lighting(1.0))
    source = states().sources(SCENE, DAYLIGHT, index)
    drawing, pose = Drawing(room.day_exposure, False, FINE_GATHER_RAYS), SENSOR.world_T_camera
    (light,) = lit_by([source], drawing, moved, view.ids, filming().renderer, CAMERA, pose)
    rgb = encode_srgb(np.vectorize(toned)(light * float(room.light.exposure[index])))
    return Picture(rgb, np.rint(view.depth_m * 1000).astype(np.uint16), view.ids)


def off(a: UInt8Array, b: UInt8Array) -> np.ndarray:
    return np.asarray(np.abs(a.astype(int) - b).max(axis=-1))


@pytest.mark.parametrize("index", range(4))
def test_a_frame_is_the_moved_room_drawn_in_its_own_light(index: int) -> None:
    background = relit().background(index)
    picture, changed = relit().picture(background, index, round(SECONDS[index] * S))
    expected = rendered(index)
    assert np.array_equal(picture.instance, expected.instance)
    assert np.abs(picture.depth_mm.astype(int) - expected.depth_mm).max() <= 1
    box = expected.instance == BOX
    assert box.sum() > 100
    assert np.mean(off(picture.rgb, expected.rgb)[box] > 2) < 0.01
    assert np.mean(off(picture.rgb, expected.rgb) > 4) < 0.01  # light far from a moved thing stays
    outside = np.ones(box.shape, dtype=bool)
    if changed is not None:
        outside[changed.v0 : changed.v0 + changed.height, changed.u0 : changed.u0 + changed.width] = False
    assert (changed is None) == (index in (0, 3))
    assert np.array_equal(picture.rgb[outside], background.rgb[outside])


def test_windows_are_drawn_once_a_light_while_things_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    room = relit_room(filming().room, DAYLIGHT, states(), SECONDS)
    asked: list[int] = []

    def counting(lights: list[object], *rest: object) -> object:
        asked.append(len(lights))
        return lit_by(lights, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr("hsbench.synth.render.background.lit_by", counting)
    for _ in range(2):
        for index in (1, 2):
            room.picture(room.background(index), index, round(SECONDS[index] * S))
    new = set(room.light.shining(2)) - set(room.light.shining(1))
    assert asked == [len(room.light.shining(1)), len(new)]


def test_a_film_on_disk_gives_back_every_frame(tmp_path: Path) -> None:
    events = EventTable(*(np.empty(0, np.int32), (), np.empty(0, np.int32), (), *[np.empty(0, np.int64)] * 2, ()))
    times = (SECONDS * S).astype(np.int64)
    made = film(filming(), events, Day(50.0, 170, 12.0, 0.0), times, "camera", Seeds(1))
    assert isinstance(made, Film)
    assert isinstance(made.light, ChangingLight)
    write_recording(tmp_path, made.background, (made.patch(k) for k in range(4)), made.light)
    recording = Recording(tmp_path)
    for k in range(4):
        picture, patch = made.picture(k), made.patch(k)
        assert np.array_equal(recording.picture(k).rgb, picture.rgb)
        person = picture.instance == PERSON_ID_OFFSET + 1
        assert (person.sum() > 50) == (k in (0, 2))
        changed = off(picture.rgb, made.light.rgb(k)) > 0
        window = np.zeros(changed.shape, dtype=bool)
        window[patch.row : patch.row + patch.mask.shape[0], patch.column : patch.column + patch.mask.shape[1]] = (
            patch.mask
        )
        assert not (changed & ~window).any()
    assert np.array_equal(made.background.rgb, made.light.rgb(0))
    assert not (made.background.instance > PERSON_ID_OFFSET).any()
    assert made[0].depth_m is None


def test_people_get_the_light_of_the_frame() -> None:
    """In the same place, by day and by lamp: as much darker or brighter as the floor beside them."""
    room, poses = relit(), filming()
    shares = []
    for index in (0, 2):
        time_ns = round(SECONDS[index] * S)
        background = room.background(index)
        sources = states().sources(SCENE, DAYLIGHT, index)
        lights = person_lighting(
            sources, SENSOR.world_T_camera[:2, 3], room.day_exposure * float(room.light.exposure[index])
        )
        patch = poses.peopled(background, *room.picture(background, index, time_ns), time_ns, lights)
        body = patch.picture.rgb[patch.picture.instance == PERSON_ID_OFFSET + 1]
        wall = background.rgb[np.isin(background.instance, (3, 4, 5))]
        shares.append(float(body.mean() / wall.mean()))
    assert 0.6 < shares[0] / shares[1] < 1.6


def test_who_sleeps_needs_no_lamp() -> None:
    sleep = EventTable(
        np.array([1], dtype=np.int32), ("sleep",), np.array([0], dtype=np.int32), ("",),
        np.array([3 * S], dtype=np.int64), np.array([9 * S], dtype=np.int64), ("",),
    )  # fmt: skip
    awake = awake_in_rooms(people(), sleep, DAYLIGHT, (SECONDS * S).astype(np.int64))
    assert awake.tolist() == [[True, False], [False, False], [False, False], [False, False]]


def test_the_table_shows_each_step_in_its_middle() -> None:
    shown = display_table()
    assert (np.diff(shown.astype(int)) >= 0).all()
    light = (np.array([100, 2000, 4096, 20000]) + 0.5) ** 2 / 4096**2
    assert np.array_equal(shown[[100, 2000, 4096, 20000]], encode_srgb(np.vectorize(toned)(light)))
