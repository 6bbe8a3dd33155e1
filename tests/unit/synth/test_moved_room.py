"""Filming things that move: every frame is the moved scene, drawn as the room at t0 is, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("embreex")

from lit_room import CAMERA, POSE, part, scene, table, thing, wardrobe

from hsbench.errors import HsbenchError
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.io.frame_store import Film, Picture
from hsbench.io.images import depth_to_mm
from hsbench.schema import KINECT_V2, ObjectMotions, PoseTable, Scene, SceneObject, Sensor
from hsbench.schema.motions import Move, Thing, scene_at
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.synth.film import Filming, room_lighting
from hsbench.synth.moved_room import LEAST_CHANGE
from hsbench.synth.people import Body, body_mesh
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.render import Mesh, Renderer, open_renderer
from hsbench.synth.render.background import background_rgb
from hsbench.synth.scene_meshes import scene_meshes

SENSOR = Sensor("rgbd", CAMERA, 1.7, 0.35)
EPISODE_T_ROOM = SENSOR.world_T_camera @ invert(POSE)  # a sensor stands in its own frame
BODY = Body(1.7)
S = 10**9
CHAIR, LEAF, SHELF, BIN = (12, ""), (13, "leaf"), 14, (15, "")
DRAWN_BACK: Move = (0.05, 0.4, 0.3)


def chair(x: float, y: float, yaw: float) -> SceneObject:
    legs = [part("leg", (a, b, 0), (a + 0.04, b + 0.04, 0.42)) for a in (-0.2, 0.16) for b in (-0.2, 0.16)]
    seat = part("seat", (-0.2, -0.2, 0.42), (0.2, 0.2, 0.46), (60, 90, 150), "weave")
    back = part("back", (-0.2, 0.17, 0.46), (0.2, 0.2, 0.9), (60, 90, 150), "stripes")
    return thing(12, "chair", seat, back, *legs, at=planar(x, y, yaw))


def door() -> SceneObject:
    """Closes the doorway to the second room, its front towards the camera; hinge at x = .48 of its frame."""
    head = part("head", (-0.5, 0.0, 2.06), (0.5, 0.1, 2.1))
    leaf = part("leaf", (-0.5, 0.0, 0.0), (0.48, 0.04, 2.06), (110, 80, 60), "wood")
    return thing(13, "door", head, leaf, at=planar(4.0, 1.7, -np.pi / 2))


def opened(angle_rad: float) -> Move:
    hinge = np.array([0.48, 0.0, 0.0])
    x, y, _ = hinge - apply(planar(0, 0, angle_rad), hinge)
    return float(x), float(y), angle_rad


def shelf_behind_the_door() -> SceneObject:
    return thing(SHELF, "bookshelf", part("body", (6.6, 2.0, 0), (6.9, 3.5, 1.8), (200, 40, 40)))


def bin_behind_the_wardrobe() -> SceneObject:
    return thing(15, "waste_bin", part("body", (3.3, 0.75, 0), (3.5, 0.95, 0.5), (250, 30, 30)))


def room(*more: SceneObject) -> Scene:
    return scene(wardrobe(), table(), chair(1.9, 1.75, np.pi + 0.3), door(), *more).moved(EPISODE_T_ROOM)


def motions(keys: list[tuple[int, Thing, Move]]) -> ObjectMotions:
    rows = sorted(keys)
    return ObjectMotions(
        np.array([t for t, _, _ in rows], dtype=np.int64),
        np.array([of[0] for _, of, _ in rows], dtype=np.int32),
        tuple(of[1] for _, of, _ in rows),
        np.array([move for _, _, move in rows], dtype=np.float64).reshape(-1, 3),
    )


REST: Move = (0.0, 0.0, 0.0)
MOTIONS = motions(
    [
        *((t * S, CHAIR, m) for t, m in ((1, REST), (2, DRAWN_BACK), (6, DRAWN_BACK), (7, REST))),
        *((t * S, LEAF, m) for t, m in ((3, REST), (4, opened(1.2)), (8, opened(1.2)), (9, REST))),
    ]
)
# Chair alone on its way, at rest; leaf on its way too; both; the leaf alone; all back.
MOVED_NS = tuple(round(t * S) for t in (1.5, 2.0, 3.4, 5.0, 7.5))
STILL_NS = (0, S, 9 * S)


def people() -> PoseTable:
    """One person: behind the chair, before it, and in the doorway, at the times of MOVED_NS; then at the end."""
    places = {MOVED_NS[1]: (2.4, 3.1), MOVED_NS[3]: (1.4, 1.2), MOVED_NS[4]: (4.4, 1.6), STILL_NS[2]: (2.0, 1.0)}
    rows = []
    for x, y in places.values():
        at = apply(EPISODE_T_ROOM, np.array([x, y, 0.0]))
        rows.append(pose(BODY, standing(BODY, at[:2], 0.7), 30.0, None)[0])
    n = len(rows)
    return PoseTable(
        KINECT_V2.name,
        np.array(list(places), dtype=np.int64),
        np.ones(n, dtype=np.int32),
        np.full((n, 25), 2, dtype=np.uint8),
        np.array(rows, dtype=np.float32),
    )


PEOPLE = people()
NOBODY = PEOPLE.until(-1)


@pytest.fixture(scope="module", params=["pyrender", "raycast"])
def renderer(request: pytest.FixtureRequest) -> Renderer:
    try:
        return open_renderer(request.param)
    except HsbenchError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def raycast() -> Renderer:
    return open_renderer("raycast")


def filming(renderer: Renderer, of: Scene, moved: ObjectMotions = MOTIONS, poses: PoseTable = PEOPLE) -> Filming:
    lights = room_lighting(of, SENSOR.world_T_camera[:2, 3])
    return Filming(of, (BODY,), poses, SENSOR, renderer, lights, moved)


def film(made: Filming, stamps: tuple[int, ...]) -> Film:
    background = made.background()
    times = np.array(stamps, dtype=np.int64)
    return Film(background, times, lambda i: made.patch(background, stamps[i]), 0, "none")


def full_render(renderer: Renderer, made: Filming, stamp: int) -> Picture:
    """The moved scene and people drawn together, at once."""
    meshes = scene_meshes(scene_at(made.scene, made.motions.moves_at(stamp)))
    for row in np.flatnonzero(made.poses.timestamp_ns == stamp):
        vertices, triangles, colours = body_mesh(BODY, made.poses.joints_m[row].astype(np.float64))
        meshes.append(Mesh(PERSON_ID_OFFSET + 1, vertices, triangles, colours, smooth=True))
    view = renderer.render(meshes, CAMERA, SENSOR.world_T_camera, made.lights)
    return Picture(view.rgb, depth_to_mm(view.depth_m), view.ids)


def equal(a: Picture, b: Picture) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("rgb", "depth_mm", "instance"))


# ---------------------------------------------------------------- ids and depth


def test_ids_and_depth_are_those_of_the_moved_scene_drawn_at_once(renderer: Renderer) -> None:
    made = filming(renderer, room(shelf_behind_the_door()))
    stamps = (*STILL_NS, *MOVED_NS)
    recorded = film(made, stamps)
    for k, stamp in enumerate(stamps):
        picture, expected = recorded.picture(k), full_render(renderer, made, stamp)
        person = (picture.instance > PERSON_ID_OFFSET) | (expected.instance > PERSON_ID_OFFSET)
        off_mm = np.abs(picture.depth_mm.astype(int) - expected.depth_mm)
        unlike = picture.instance != expected.instance
        assert not (unlike | (off_mm > 0))[~person].any()
        # People are drawn by their own rasteriser: in GL, silhouettes and depth are rounded otherwise.
        assert (off_mm <= 1).mean() >= 0.999
        assert (~unlike).mean() >= 0.999
    assert any((recorded.picture(k).instance > PERSON_ID_OFFSET).any() for k in range(3, len(stamps)))


def test_the_story_of_the_test_is_what_it_says(raycast: Renderer) -> None:
    """Chair and leaf are seen at t0 and elsewhere later; the shelf in the second room appears as the door opens."""
    made = filming(raycast, room(shelf_behind_the_door()), poses=NOBODY)
    recorded = film(made, (0, *MOVED_NS))
    ids = [recorded.picture(k).instance for k in range(len(recorded))]
    assert [(i == SHELF).any() for i in ids] == [False, False, False, False, True, True]
    for number in (12, 13):
        assert (ids[0] == number).sum() > 200
    assert ((ids[0] == 12) != (ids[2] == 12)).sum() > 200
    assert np.array_equal(ids[0] == 12, ids[5] == 12)


# ---------------------------------------------------------------- when nothing has moved


def test_what_is_where_it_was_leaves_every_byte(raycast: Renderer) -> None:
    still, moving = filming(raycast, room(), ObjectMotions.none()), filming(raycast, room())
    one, other = film(still, (*STILL_NS, MOVED_NS[1])), film(moving, (*STILL_NS, MOVED_NS[1]))
    assert equal(one.background, other.background)
    for k in range(len(STILL_NS)):
        a, b = one.patch(k), other.patch(k)
        assert (a.row, a.column, a.mask.tobytes()) == (b.row, b.column, b.mask.tobytes())
        assert equal(a.picture, b.picture)
    assert not equal(one.picture(3), other.picture(3))


def test_frames_in_any_order_are_the_same(raycast: Renderer) -> None:
    recorded = film(filming(raycast, room()), MOVED_NS)
    forwards = [recorded.picture(k) for k in range(5)]
    backwards = [recorded.picture(k) for k in range(4, -1, -1)][::-1]
    assert all(equal(a, b) for a, b in zip(forwards, backwards, strict=True))


# ---------------------------------------------------------------- colours


@pytest.mark.parametrize("stamp", MOVED_NS)
def test_what_moved_is_lit_like_the_rest(raycast: Renderer, stamp: int) -> None:
    """The picture at t0 of the moved scene: the same pixels on what moved or appeared, hardly others elsewhere."""
    made = filming(raycast, room(shelf_behind_the_door()), poses=NOBODY)
    recorded, moved = film(made, (0, stamp)), scene_at(made.scene, made.motions.moves_at(stamp))
    first, picture = recorded.picture(0), recorded.picture(1)
    anew = background_rgb(moved, picture.instance, raycast, CAMERA, SENSOR.world_T_camera).astype(int)
    off = np.abs(picture.rgb - anew).max(axis=-1)
    things = [number for number, _ in made.motions.moves_at(stamp)]
    own = (
        (picture.instance != first.instance) | (picture.depth_mm != first.depth_mm) | np.isin(picture.instance, things)
    )
    assert own.sum() > 200
    assert (off[own] <= LEAST_CHANGE).mean() > 0.95  # things drawn apart do not shade each other
    assert (off <= 2 * LEAST_CHANGE).mean() > 0.9
    assert off.mean() < 0.5 * np.abs(first.rgb - anew).max(axis=-1).mean()


def test_a_thing_in_the_sun_takes_its_shadow_along(raycast: Renderer) -> None:
    """A board before the window: no pixel of the whole picture keeps its shadow, which falls on the floor far below."""
    board = thing(16, "shelf", part("body", (1.5, 3.3, 1.2), (2.3, 3.35, 1.5)))
    moved = motions([(0, (16, ""), REST), (S, (16, ""), (0.8, 0.0, 0.0))])
    made = filming(raycast, room(board), moved, NOBODY)
    recorded = film(made, (0, S))
    first, picture = recorded.picture(0), recorded.picture(1)
    after = scene_at(made.scene, moved.moves_at(S))
    anew = background_rgb(after, picture.instance, raycast, CAMERA, SENSOR.world_T_camera).astype(int)
    assert (np.abs(first.rgb - anew).max(axis=-1) > 40)[60:].sum() > 200  # on the floor: the sun shines
    assert (np.abs(picture.rgb - anew).max(axis=-1) > 40).sum() == 0


# ---------------------------------------------------------------- no trace of what no pixel shows


def test_what_moves_unseen_leaves_no_trace(raycast: Renderer) -> None:
    unseen = motions([(S, BIN, REST), (2 * S, BIN, (0.05, 0.05, 0.0))])
    with_it = film(filming(raycast, room(bin_behind_the_wardrobe()), unseen, NOBODY), (0, 2 * S))
    without = film(filming(raycast, room(), ObjectMotions.none(), NOBODY), (0, 2 * S))
    assert equal(with_it.background, without.background)
    assert with_it.patch(1).mask.shape == without.patch(1).mask.shape == (0, 0)


def test_an_object_without_a_pixel_leaves_no_trace_while_others_move(raycast: Renderer) -> None:
    with_it, without = (film(filming(raycast, r), MOVED_NS) for r in (room(bin_behind_the_wardrobe()), room()))
    for k in range(len(MOVED_NS)):
        a, b = with_it.patch(k), without.patch(k)
        assert (a.row, a.column, a.mask.tobytes()) == (b.row, b.column, b.mask.tobytes())
        assert equal(a.picture, b.picture)
