"""Filming in crops: background and patches put together are the full picture, pixel by pixel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

pytest.importorskip("embreex")

from hsbench.geometry.cameras import BrownCamera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.convex import box, span
from hsbench.geometry.transforms import apply, planar
from hsbench.io.frame_store import Film, Picture
from hsbench.io.images import depth_to_mm
from hsbench.schema import KINECT_V2, Part, PoseTable, Room, Scene, SceneObject, Sensor
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.synth import assemble
from hsbench.synth.assemble import film
from hsbench.synth.film import Filming, room_lighting, stand_before
from hsbench.synth.people import Body, body_mesh
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.render import Lighting, Mesh, Renderer, Window, open_renderer
from hsbench.synth.render.contact import LEAST_COVERED, REACH_M, SKY_SHARE, light_left
from hsbench.synth.render.raster import Layer
from hsbench.synth.render.tone import decode_srgb, encode_srgb, toned
from hsbench.synth.scene_meshes import scene_meshes

CAMERA = PinholeCamera(80, 60, 60.0, 60.0, 40.0, 30.0)
SENSOR = Sensor("rgbd", CAMERA, 1.6, 0.25)
SENSORS = {
    "rgbd": SENSOR,
    "brown": Sensor("monocular", BrownCamera(80, 60, 55.0, 55.0, 40.0, 30.0, k1=-0.15, k2=0.02, p1=0.001), 2.2, 0.5),
    "equirectangular": Sensor("equirectangular", EquirectangularCamera(160, 80), 1.5),
    "topdown": Sensor("topdown", TopDownCamera(120, 120, 0.08), None),
}
CAMERA_XY = SENSOR.world_T_camera[:2, 3]
BODIES = (Body(1.78), Body(1.6, 1.05))
ROOM = np.array([[-1.0, -3.0], [5.0, -3.0], [5.0, 3.0], [-1.0, 3.0]])

# Where the two people are at each time: in the open, half behind the table, out of view, at the lens, and so on.
PLACES: tuple[tuple[tuple[int, float, float, float], ...], ...] = (
    ((1, 3.0, 0.5, 0.3),),
    ((1, 3.0, 0.5, 0.3), (2, 3.4, 0.3, 2.0)),  # one partly hides the other
    ((2, 3.2, -0.9, -1.0),),  # half behind the table
    ((1, 4.2, 2.2, 0.0),),  # cut by the border of the image
    ((1, 0.1, 0.3, 0.0), (2, 3.0, 0.5, 0.0)),  # one astride the camera's plane
    ((1, -0.8, 0.0, 0.0), (2, 2.5, -0.3, 0.0)),  # one behind the camera
    ((1, 4.5, 0.0, 0.0), (2, 4.5, 0.9, 1.0)),
)
HIDDEN, AWAY, NOBODY = 100, 101, 102


def furniture(object_id: int, *parts: Part, kind: str = "desk", at: np.ndarray | None = None) -> SceneObject:
    return SceneObject(object_id, kind, np.eye(4) if at is None else at, parts)


def part(solid) -> Part:
    return Part("body", (120, 90, 60), solid=solid)


def scene(*more: SceneObject) -> Scene:
    floor = furniture(1, part(span((-1, -3, -0.1), (5, 3, 0))), kind="floor")
    wall = furniture(2, part(span((5, -3, 0), (5.1, 3, 2.5))), kind="wall")
    table = furniture(
        3, part(box((1.0, 0.6, 0.05), (0, 0, 0.9))), part(box((0.1, 0.5, 0.9), (0, 0, 0.45))), at=planar(2.2, -0.6, 0.4)
    )
    return Scene("s", (Room("living", ROOM),), 2.5, (floor, wall, table, *more))


def poses(places: dict[int, tuple[tuple[int, float, float, float], ...]]) -> PoseTable:
    rows = []
    for stamp, people in places.items():
        for person, x, y, yaw in people:
            body = BODIES[person - 1]
            rows.append((stamp, person, pose(body, standing(body, np.array([x, y]), yaw), 30.0, None)[0]))
    return PoseTable(
        KINECT_V2.name,
        np.array([r[0] for r in rows], dtype=np.int64),
        np.array([r[1] for r in rows], dtype=np.int32),
        np.full((len(rows), 25), 2, dtype=np.uint8),
        np.array([r[2] for r in rows], dtype=np.float32).reshape(len(rows), 25, 3),
    )


TRUE = poses(
    {**dict(enumerate(PLACES)), HIDDEN: ((1, 3.6, 1.2, 0.0),), AWAY: ((1, -0.8, 0.0, 0.0), (2, -0.7, 1.0, 0.0))}
)


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return open_renderer("raycast")


@pytest.fixture(scope="module")
def filming(renderer: Renderer) -> Filming:
    room = scene()
    return Filming(room, BODIES, TRUE, SENSOR, renderer, room_lighting(room, CAMERA_XY))


def full_render(renderer: Renderer, room: Scene, stamp: int, sensor: Sensor = SENSOR) -> Picture:
    """Room and people drawn together, at once."""
    people = []
    for row in np.flatnonzero(TRUE.timestamp_ns == stamp):
        person = int(TRUE.track_id[row])
        vertices, triangles, colours = body_mesh(BODIES[person - 1], TRUE.joints_m[row].astype(np.float64))
        people.append(Mesh(PERSON_ID_OFFSET + person, vertices, triangles, colours, smooth=True))
    view = renderer.render([*scene_meshes(room), *people], sensor.camera, sensor.world_T_camera, Lighting(1.0))
    return Picture(view.rgb, depth_to_mm(view.depth_m), view.ids)


def film_of(filming: Filming, stamps: list[int]) -> Film:
    background = filming.background()
    return Film(background, np.array(stamps, dtype=np.int64), lambda i: filming.patch(background, stamps[i]), 0, "none")


@pytest.mark.parametrize("kind", SENSORS)
def test_crops_put_together_are_the_full_picture(filming: Filming, renderer: Renderer, kind: str) -> None:
    sensor = SENSORS[kind]
    film = film_of(replace(filming, sensor=sensor), list(range(len(PLACES))))
    for stamp in range(len(PLACES)):
        composed, expected = film.picture(stamp), full_render(renderer, filming.scene, stamp, sensor)
        # Embree finds triangles in float32: where two of them meet it may take the other one.
        deeper = np.abs(composed.depth_mm.astype(int) - expected.depth_mm) > 1
        assert deeper.sum() <= 2
        # Depth is joined in whole millimetres: a thing less than one behind a person keeps its id.
        tied = expected.depth_mm == film.background.depth_mm
        differ = composed.instance != expected.instance
        assert (differ & ~tied).sum() <= 2
        assert differ.sum() <= 4
        assert (composed.instance > PERSON_ID_OFFSET).any()


@pytest.mark.parametrize("kind", SENSORS)
def test_amodal_masks_hold_what_is_seen_and_what_is_hidden(filming: Filming, kind: str) -> None:
    film = replace(filming, sensor=SENSORS[kind])
    background = film.background()
    for stamp in range(len(PLACES)):
        masks, patch = film.amodal(stamp), film.patch(background, stamp)
        assert set(masks) <= {PERSON_ID_OFFSET + person for person, *_ in PLACES[stamp]}
        at = slice(patch.row, patch.row + patch.mask.shape[0]), slice(patch.column, patch.column + patch.mask.shape[1])
        for person, mask in masks.items():
            assert mask[at][patch.picture.instance == person].all()
            assert mask.sum() == mask[at].sum()
    masks, patch = film.amodal(2), film.patch(background, 2)  # half behind the table
    assert kind == "topdown" or masks[PERSON_ID_OFFSET + 2].sum() > (patch.picture.instance > PERSON_ID_OFFSET).sum()


def test_the_background_has_no_people_and_exact_depth(filming: Filming, renderer: Renderer) -> None:
    background = filming.background()
    empty = full_render(renderer, filming.scene, NOBODY)
    assert np.array_equal(background.depth_mm, empty.depth_mm)
    assert np.array_equal(background.instance, empty.instance)
    assert set(np.unique(background.instance)) <= {0, 1, 2, 3}


def test_a_patch_changes_people_and_darkens_what_is_close_to_them(filming: Filming) -> None:
    background = filming.background()
    shaded_px = 0
    for stamp in range(len(PLACES)):
        patch = filming.patch(background, stamp)
        assert patch.timestamp_ns == stamp
        height, width = patch.mask.shape
        assert patch.picture.rgb.shape == (height, width, 3)
        assert 0 <= patch.row <= 60 - height
        assert 0 <= patch.column <= 80 - width
        window = (slice(patch.row, patch.row + height), slice(patch.column, patch.column + width))
        people = [PERSON_ID_OFFSET + int(k) for k in TRUE.track_id[TRUE.timestamp_ns == stamp]]
        shown = patch.mask & np.isin(patch.picture.instance, people)
        behind = background.depth_mm[window]
        assert ((patch.picture.depth_mm < behind) | (behind == 0))[shown].all()
        shaded = patch.mask & ~shown
        assert np.array_equal(patch.picture.instance[shaded], background.instance[window][shaded])
        assert np.array_equal(patch.picture.depth_mm[shaded], behind[shaded])
        shaded &= ~binary_dilation(shown, np.ones((3, 3)))  # silhouettes are blended
        shaded_px += shaded.sum()
        assert (patch.picture.rgb[shaded] <= background.rgb[window][shaded]).all()
        points = apply(SENSOR.world_T_camera, CAMERA.unproject(background.depth_mm / 1000.0))[window][shaded]
        bodies = TRUE.joints_m[TRUE.timestamp_ns == stamp].reshape(-1, 3)
        far = np.linalg.norm(points[:, None] - bodies, axis=-1).min(axis=1)
        assert far.max(initial=0.0) < REACH_M + 0.4  # skin and the space between joints
    assert shaded_px > 5
    assert filming.patch(background, 4).mask.shape == (60, 80)  # somebody at the camera: the whole picture
    assert filming.patch(background, 0).mask.size < 80 * 60 / 3  # alone in the open: a tight crop


def test_no_shade_falls_outside_the_crop(filming: Filming, monkeypatch: pytest.MonkeyPatch) -> None:
    background = filming.background()
    tight = [filming.patch(background, stamp) for stamp in range(len(PLACES))]
    monkeypatch.setattr("hsbench.synth.film.window_of", lambda sensor, shapes: Window(0, 0, 80, 60))
    for stamp, patch in enumerate(tight):
        full = filming.patch(background, stamp)
        rows, columns = np.nonzero(full.mask)
        assert patch.mask.sum() == full.mask.sum()
        assert np.array_equal(patch.mask[rows - patch.row, columns - patch.column], full.mask[rows, columns])


def left_at(points: np.ndarray, ends: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """(h, w) light left at (h, w, 3) points: what rays from the origin show at depth 1."""
    return light_left(np.ones(points.shape[:2]), points, np.eye(4), False, ends, radii)


@pytest.mark.parametrize("kind", SENSORS)
def test_nothing_beyond_the_farthest_depth_is_shaded(filming: Filming, kind: str) -> None:
    film = replace(filming, sensor=SENSORS[kind])
    background = film.background()
    for stamp in range(len(PLACES)):
        (people,) = film.people([stamp])
        unbounded = [replace(person, farthest_m=np.inf) for person in people]
        a, b = film.patch(background, stamp, people), film.patch(background, stamp, unbounded)
        assert np.array_equal(a.mask, b.mask)
        assert np.array_equal(a.picture.rgb, b.picture.rgb)


def test_people_posed_together_are_those_posed_alone(filming: Filming) -> None:
    stamps = [*range(len(PLACES)), NOBODY, AWAY]
    for stamp, together in zip(stamps, filming.people(stamps), strict=True):
        (alone,) = filming.people([stamp])
        assert [(p.mesh.mesh_id, p.window, p.farthest_m) for p in alone] == [
            (p.mesh.mesh_id, p.window, p.farthest_m) for p in together
        ]
        for a, b in zip(alone, together, strict=True):
            assert np.array_equal(a.mesh.vertices, b.mesh.vertices)
            assert np.array_equal(a.ends, b.ends)
    times = np.array([0, 1, 2, 3, 4, 5, 6, HIDDEN, AWAY, NOBODY], dtype=np.int64)
    made = film(filming, times, 0, "none")
    for k in (3, 9, 0, 7):
        expected, patch = filming.patch(made.background, int(times[k])), made.patch(k)
        assert np.array_equal(patch.mask, expected.mask)
        assert np.array_equal(patch.picture.rgb, expected.picture.rgb)


def test_a_ball_on_the_floor_takes_the_light_of_the_sky_it_covers() -> None:
    """cos (r / d)^2 of a level surface (Lambert), without fade right below; nothing beyond reach or above it."""
    radius, height = 0.1, 0.15
    ends, radii = np.array([[[0.0, 0.0, height]] * 2]), np.full((1, 2), radius)
    below = np.array([[[0.0, 0.0, height - radius - 1e-9]]])
    assert left_at(below, ends, radii)[0, 0] == pytest.approx(1.0 - SKY_SHARE, abs=1e-6)
    for x in (0.05, 0.1, 0.2, 0.3):
        distance = np.hypot(x, height)
        fade = 1.0 - (distance - radius) / REACH_M
        covered = height / distance * (radius / distance) ** 2 * fade
        expected = 1.0 - SKY_SHARE * covered if covered > LEAST_COVERED else 1.0
        assert left_at(np.array([[[x, 0.0, 0.0]]]), ends, radii)[0, 0] == pytest.approx(expected)
    for far in ((radius + REACH_M, 0.0, 0.0), (0.0, 0.0, height + radius), (0.12, 0.0, height)):
        assert left_at(np.array([[far]]), ends, radii)[0, 0] == 1.0


def test_capsules_that_overlap_shade_no_more_than_one() -> None:
    ends, radii = np.array([[[0.0, 0.0, 0.12]] * 2]), np.full((1, 2), 0.1)
    points = np.array([[[x, 0.02, 0.0] for x in np.linspace(0.0, 0.5, 9)]])
    once = left_at(points, ends, radii)
    assert np.array_equal(left_at(points, np.repeat(ends, 4, axis=0), np.repeat(radii, 4, axis=0)), once)


def test_people_are_toned_like_the_background_and_blended_in_display_light() -> None:
    light = np.linspace(0.0, 4.0, 500)[None, :, None] * np.array([1.0, 0.7, 0.2])
    before = np.random.default_rng(0).integers(0, 256, light.shape, np.uint8)
    display = np.array([[[toned(value) for value in pixel] for pixel in row] for row in light])
    behind, person = np.full((1, 500), 3000, np.uint16), np.full((1, 500), 60001, np.uint16)
    for share in (0.0, 0.25, 1.0):
        picture = Picture(before.copy(), behind.copy(), np.ones((1, 500), np.uint16))
        ids = person if share > 0.5 else np.zeros_like(person)
        stand_before(
            picture,
            Layer(Window(0, 0, 500, 1), light, np.full((1, 500), share), np.full((1, 500), 2.0004, np.float32), ids),
        )
        off = picture.rgb.astype(int) - encode_srgb(decode_srgb(before) * (1 - share) + display * share)
        assert np.abs(off).max() <= 1
        assert np.abs(off).mean() < 0.1
        assert np.array_equal(picture.instance, person if share > 0.5 else np.ones_like(person))
        assert (picture.depth_mm == (2000 if share > 0.5 else 3000)).all()


def test_a_person_behind_furniture_changes_nothing(filming: Filming, renderer: Renderer) -> None:
    screen = furniture(9, part(span((2.0, -2.0, 0.0), (2.1, 2.5, 2.4))), kind="wardrobe")
    room = scene(screen)
    hidden = Filming(room, BODIES, TRUE, SENSOR, renderer, room_lighting(room, CAMERA_XY))
    background = hidden.background()
    patch = hidden.patch(background, HIDDEN)
    assert patch.mask.size > 0
    assert not patch.mask.any()
    assert np.array_equal(full_render(renderer, room, HIDDEN).instance, background.instance)
    assert filming.patch(filming.background(), HIDDEN).mask.any()  # without the screen the person is seen


@pytest.mark.parametrize("stamp", [AWAY, NOBODY])
def test_nobody_in_view_gives_an_empty_patch(filming: Filming, stamp: int) -> None:
    background = filming.background()
    patch = filming.patch(background, stamp)
    assert patch.timestamp_ns == stamp
    assert patch.mask.shape == (0, 0)
    assert patch.picture.rgb.shape == (0, 0, 3)
    composed = film_of(filming, [stamp]).picture(0)
    for name in ("rgb", "depth_mm", "instance"):
        assert np.array_equal(getattr(composed, name), getattr(background, name))


def test_frames_in_any_order_and_by_any_number_of_threads_are_the_same(filming: Filming) -> None:
    stamps = np.array([0, 1, 2, 0, 2, 1] * 5, dtype=np.int64)
    alone, ahead = (assemble.film(filming, stamps, 0, "none", threads) for threads in (1, 3))
    forwards = [ahead.picture(k) for k in range(len(stamps))]
    backwards = [alone.picture(k) for k in reversed(range(len(stamps)))][::-1]
    for a, b in zip(forwards, backwards, strict=True):
        for name in ("rgb", "depth_mm", "instance"):
            assert np.array_equal(getattr(a, name), getattr(b, name))


def test_one_mesh_an_object_in_the_scenes_frame() -> None:
    room = scene()
    meshes = scene_meshes(room)
    assert [m.mesh_id for m in meshes] == [1, 2, 3]
    for mesh, item in zip(meshes, room.objects, strict=True):
        assert np.array_equal(mesh.vertices, item.vertices)
        first = 0
        for k, solid in enumerate(item.solids):
            rows = slice(12 * k, 12 * (k + 1))
            assert np.array_equal(mesh.triangles[rows], solid.triangles + first)
            first += len(solid.vertices)
