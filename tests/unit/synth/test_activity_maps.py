"""Simulated activity maps: lives that obey walls and seats, errors of the size asked for, truth that turns along."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.geometry.convex import box
from hsbench.geometry.rays import pack_solids, segments_blocked
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.schema.episode import Episode
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.schema.states import Action, Affordance
from hsbench.synth.activity_maps import MapConfig, PlanarLifeConfig, SphereErrors, map_episodes
from hsbench.synth.activity_maps.life import PlanarLife, live_in_plane
from hsbench.synth.activity_maps.observe import BODY_M, observe_sphere, seen_share
from hsbench.synth.activity_maps.places import SIT, TOUCH, WRIST_M, Places, find_places, follow, wrist
from hsbench.synth.activity_maps.plan import hidden_rooms, of_task, plan_truth
from hsbench.synth.activity_maps.samples import central_cells, draw_maps
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.recipes import Unit
from hsbench.synth.rooms import COMMON_TEMPLATES, TEMPLATES, RoomConfig, build_scene
from hsbench.synth.rooms.templates import even_weights
from hsbench.synth.seeds import Seeds
from hsbench.truth.affordance import AffordanceScene, afford, affordance_truth, top_down
from hsbench.truth.reach import REACH_M
from hsbench.truth.walkable import WalkMap

DINING = even_weights(tuple(t for t in COMMON_TEMPLATES if TEMPLATES[t].room_type == "dining"))
EXACT = SphereErrors(
    joint_sd_px=0, stature_sd=0, foreshortened_sd=(0, 0), miss_share=0, near_m=0, far_m=1e9,
    confusion=((1, 0, 0), (0, 1, 0), (0, 0, 1)),
)  # fmt: skip
SHORT = PlanarLifeConfig(minutes=(2.0, 4.0), sit_s=(5.0, 30.0), touch_s=(2.0, 10.0))
SMALL = MapConfig(samples_per_room=3, side_cells=64, cell_m=0.2, blur_m=0.2)


@cache
def dining(number: int = 4) -> tuple[AffordanceScene, Places]:
    seeds = Seeds(number)
    scene = build_scene("scene-000003", seeds, RoomConfig(templates=DINING), COMMON_FAMILIES)
    found = of_task(afford(scene))
    return found, find_places(found, seeds.rng("places"))


def two_rooms(leaf: bool) -> Scene:
    """Rooms of 3 x 3 m on both sides of a wall at x = 3 with a doorway from y = 1 to 2, shut by a leaf or not."""
    left, right = (np.array([[x, 0.0], [x + 3, 0.0], [x + 3, 3.0], [x, 3.0]]) for x in (0.0, 3.2))
    pieces = [("wall", (0.2, 1.0, 2.5), (3.1, 0.5, 1.25)), ("wall", (0.2, 1.0, 2.5), (3.1, 2.5, 1.25))]
    if leaf:
        pieces.append(("door", (0.2, 1.0, 2.0), (3.1, 1.5, 1.0)))
    objects = tuple(
        SceneObject(k, name, np.eye(4), (Part("body", (9, 9, 9), solid=box(size, centre)),))
        for k, (name, size, centre) in enumerate(pieces, start=1)
    )
    return Scene("scene-000000", (Room("living", left), Room("bedroom", right)), 2.5, objects)


# ---------------------------------------------------------------- places and ways


def test_places_are_those_of_the_truth() -> None:
    found, places = dining()
    counts = np.bincount(places.kind, minlength=3)
    assert counts[SIT] >= 2
    assert counts[TOUCH] >= 5
    assert found.walk.free.ravel()[places.cell].all()
    shoulders = np.concatenate([group.points_m for group in found.shoulders[1:]])
    seats = np.column_stack([places.body_xy, places.shoulder_m])[places.kind == SIT]
    assert all((np.abs(shoulders - seat).max(axis=1) < 1e-9).any() for seat in seats)
    apart = np.linalg.norm(seats[:, None, :2] - seats[None, :, :2], axis=-1) + np.eye(len(seats))
    assert apart.min() >= 0.55
    hands = places.hand_xy[places.touches]
    interactable = found.patches.point[(found.labels >> Affordance.INTERACTABLE & 1).astype(bool)]
    assert all((np.abs(interactable[:, :2] - hand).max(axis=1) < 1e-9).any() for hand in hands)
    assert np.linalg.norm(hands - places.body_xy[places.touches], axis=1).max() <= REACH_M
    assert not places.beside[places.kind != SIT].any()


def test_a_way_leads_over_free_cells_in_even_strides() -> None:
    found, places = dining()
    walk, out = found.walk, np.empty((4000, 2))
    lengths: list[float] = []
    for place, start in itertools.product(range(0, len(places), 7), places.cell[::5]):
        count = follow(places.toward[place], int(start), walk.free.shape[1], walk.origin_xy, walk.cell_m, 0.07, out)
        if not count:
            continue
        index, inside = walk.index(out[:count])
        assert inside.all()
        assert walk.free[tuple(index.T)].all()
        strides = np.linalg.norm(np.diff(out[:count], axis=0), axis=1)
        assert (strides <= 0.07 + 1e-9).all()  # shorter only where the way turns
        goal = walk.centres().reshape(-1, 2)[places.cell[place]]
        assert np.linalg.norm(out[count - 1] - goal) <= 0.07 + 1e-9
        lengths += strides.tolist()
    assert len(lengths) > 500
    assert np.mean(lengths) > 0.065


def test_a_way_stops_where_its_time_is_up_and_where_none_leads() -> None:
    toward = np.array([1, 2, -1, -1], dtype=np.int32)  # 0 -> 1 -> 2, and 3 is cut off; one row of four cells
    out = np.zeros((3, 2))
    assert follow(toward, 0, 4, np.zeros(2), 1.0, 0.5, out) == 3
    assert out.tolist() == [[0.5, 1.0], [0.5, 1.5], [0.5, 2.0]]
    assert follow(toward, 3, 4, np.zeros(2), 1.0, 0.5, out) == 0


def test_wrists_lie_behind_the_hand() -> None:
    assert wrist(np.array([1.0, 0.0]), np.array([0.0, 0.0])).tolist() == pytest.approx([1 - WRIST_M, 0])
    assert wrist(np.array([0.1, 0.0]), np.array([0.0, 0.0])).tolist() == pytest.approx([0, 0])  # never behind the body


# ---------------------------------------------------------------- lives


def life_of(seed: int, config: PlanarLifeConfig = SHORT) -> PlanarLife:
    return live_in_plane(dining()[1], np.random.default_rng(seed), config)


@pytest.mark.parametrize("seed", range(4))
def test_people_walk_where_one_can_and_stay_where_there_is_something(seed: int) -> None:
    found, places = dining()
    config = replace(SHORT, people=(3, 3), atypical_share=0.0)
    life = life_of(seed, config)
    assert 2 * 60 * config.rate_hz <= life.action.shape[1] <= 4 * 60 * config.rate_hz
    known = {tuple(xy) for xy in places.body_xy.tolist()}
    for p in range(3):
        for stay in np.unique(life.stay[p]):
            rows = life.stay[p] == stay
            body, action = life.body_xy[p, rows], life.action[p, rows]
            if len(np.unique(body, axis=0)) == 1 and tuple(body[0].tolist()) in known:
                continue
            assert (action == Action.STAND).all()
            index, inside = found.walk.index(body)
            assert inside.all()
            assert found.walk.free[tuple(index.T)].all()
            assert np.linalg.norm(np.diff(body, axis=0), axis=1).max(initial=0) <= 1.3 / config.rate_hz + 1e-9
    seated = life.action == Action.SIT
    seats = places.body_xy[places.kind == SIT]
    assert seated.any()
    assert all((np.abs(seats - xy).max(axis=1) == 0).any() for xy in np.unique(life.body_xy[seated], axis=0))
    touching = life.action == Action.INTERACT
    reach = np.linalg.norm(life.wrist_xy - life.body_xy, axis=-1)
    assert reach[touching].max() <= REACH_M - WRIST_M + 1e-9
    assert touching.any()
    assert (reach[life.action == Action.STAND] == 0).all()


@pytest.mark.parametrize("seed", range(4))
def test_a_seat_holds_one_at_a_time(seed: int) -> None:
    life = life_of(seed, replace(SHORT, people=(4, 4), sit=1.0, explore=0.0, touch=0.1, atypical_share=0.0))
    for a, b in itertools.combinations(range(4), 2):
        both = (life.action[a] != Action.STAND) & (life.action[b] != Action.STAND)
        assert (np.abs(life.body_xy[a] - life.body_xy[b]).max(axis=-1)[both] > 0).all()


def test_shares_of_what_is_done_follow_the_settings() -> None:
    def share(action: Action, **changes: float) -> float:
        config = replace(SHORT, atypical_share=0.0, seated_touch_share=0.0, **changes)
        return np.mean(np.concatenate([(life_of(s, config).action == action).ravel() for s in range(4)]))

    assert share(Action.SIT, sit=0.0) == 0
    assert share(Action.INTERACT, touch=0.0) == 0
    assert share(Action.SIT, sit=5.0) > share(Action.SIT) > 0
    assert share(Action.STAND, sit=0.0, touch=0.0) == 1


def test_some_sit_where_nobody_should() -> None:
    config = replace(SHORT, sit=0.0, explore=0.0, people=(2, 2))
    assert not (life_of(0, replace(config, atypical_share=0.0)).action == Action.SIT).any()
    assert (life_of(0, replace(config, atypical_share=0.3)).action == Action.SIT).any()


def test_an_empty_place_stays_empty() -> None:
    nowhere = Places(
        WalkMap(np.zeros(2), np.zeros((2, 2), bool)), *(np.zeros(s) for s in (0, (0, 2), 0, (0, 2), 0)),
        np.zeros(0, np.int64), np.zeros((0, 4), np.int32), np.zeros((0, 0), bool),
    )  # fmt: skip
    assert live_in_plane(nowhere, np.random.default_rng(0), SHORT).action.shape[0] == 0


# ---------------------------------------------------------------- sight and errors


def test_sight_is_that_of_straight_lines() -> None:
    found, _ = dining()
    solids = pack_solids([s for item in found.scene.objects for s in item.solids])
    camera = np.array([*found.walk.centres()[found.walk.free].mean(axis=0), 1.5])
    rng = np.random.default_rng(0)
    low, high = (np.ceil(found.scene.rooms[0].outline_xy.min(axis=0)), found.scene.rooms[0].outline_xy.max(axis=0))
    squares = low + 0.2 * np.stack(
        np.meshgrid(*(np.arange(int((b - a) / 0.2)) for a, b in zip(low, high, strict=True))), -1
    )
    body = squares.reshape(-1, 2) + rng.uniform(0.01, 0.19, (squares.size // 2, 2))  # one in each square of .2 m
    height = rng.choice([1.4, 1.0], len(body))
    points = np.column_stack([body, height])[:, None] + np.stack([np.zeros(3), np.zeros(3), BODY_M], axis=-1)
    hidden = segments_blocked(camera, points.reshape(-1, 3), solids).reshape(len(body), 3)
    seen = seen_share(camera, body, height, solids)
    assert np.allclose(seen, 1 - hidden.mean(axis=1))
    assert 0 < seen.mean() < 1


def test_a_shut_door_hides_who_is_behind_and_a_wall_always_does() -> None:
    camera, bodies = np.array([1.0, 1.5, 1.5]), np.array([[5.0, 1.5], [5.0, 0.2], [2.0, 0.5]])
    shares = {}
    for leaf in (False, True):
        solids = pack_solids([s for item in two_rooms(leaf).objects for s in item.solids])
        shares[leaf] = seen_share(camera, bodies, np.full(3, 1.4), solids).tolist()
    assert shares == {False: [1, 0, 1], True: [0, 0, 1]}


def standing(body: np.ndarray, people: int = 1) -> PlanarLife:
    shape = (people, len(body))
    xy = np.broadcast_to(body, (*shape, 2)).copy()
    return PlanarLife(
        xy, xy.copy(), np.full(shape, 1.4), np.full(shape, Action.STAND, np.uint8), np.zeros(shape, np.int32)
    )


def test_without_errors_marks_are_where_people_are() -> None:
    life, scene_T_episode = life_of(1), planar(1.3, 0.7, 2.1)
    seen = np.ones(life.action.shape)
    marks, channel = observe_sphere(life, scene_T_episode, seen, EXACT, np.random.default_rng(0))
    assert np.array_equal(channel, life.action.ravel() - Action.STAND)
    true = np.where((life.action == Action.INTERACT)[..., None], life.wrist_xy, life.body_xy).reshape(-1, 2)
    back = apply(scene_T_episode, np.column_stack([marks, np.zeros(len(marks))]))[:, :2]
    assert np.allclose(back, true, atol=1e-4)


def test_errors_have_the_size_that_geometry_gives_them() -> None:
    errors = replace(EXACT, joint_sd_px=1.5)
    jitter = 1.5 * 2 * np.pi / 1024
    for distance in (1.0, 3.0, 6.0):
        body = np.tile([0.0, distance], (40_000, 1))
        marks, _ = observe_sphere(standing(body), np.eye(4), np.ones((1, 40_000)), errors, np.random.default_rng(0))
        assert np.std(np.arctan2(-marks[:, 0], marks[:, 1])) == pytest.approx(jitter, rel=0.03)
        assert np.std(np.linalg.norm(marks, axis=1)) == pytest.approx(jitter * distance**2 / 0.49, rel=0.03)


def test_stature_scales_all_of_a_person_and_leaning_only_adds() -> None:
    life = standing(np.array([[1.0, 2.0], [3.0, -1.0]]), people=300)
    scaled, _ = observe_sphere(
        life, np.eye(4), np.ones((300, 2)), replace(EXACT, stature_sd=0.05), np.random.default_rng(1)
    )
    factor = (scaled.reshape(300, 2, 2) / life.body_xy).reshape(300, 4)
    assert np.allclose(factor, factor[:, :1], atol=2e-4)
    assert factor[:, 0].std() == pytest.approx(0.05, rel=0.15)
    leaning = replace(life, stay=np.arange(600, dtype=np.int32).reshape(300, 2))
    far, _ = observe_sphere(
        leaning, np.eye(4), np.ones((300, 2)), replace(EXACT, foreshortened_sd=(0.1, 0.3)), np.random.default_rng(1)
    )
    ratio = np.linalg.norm(far.reshape(300, 2, 2), axis=-1) / np.linalg.norm(life.body_xy, axis=-1)
    assert ratio.min() >= 1 - 1e-4
    assert ratio.mean() == pytest.approx(1 + 0.1 * np.sqrt(2 / np.pi), rel=0.01)


def test_the_detector_loses_what_is_far_half_hidden_or_too_near() -> None:
    n = 30_000
    errors = replace(EXACT, miss_share=0.1, far_m=4.0, near_m=0.5)

    def share(distance: float, seen: float) -> float:
        life = standing(np.tile([distance, 0.0], (n, 1)))
        return len(observe_sphere(life, np.eye(4), np.full((1, n), seen), errors, np.random.default_rng(0))[0]) / n

    assert share(3.0, 1.0) == pytest.approx(0.9 * np.exp(-9 / 16), abs=0.01)
    assert share(3.0, 1 / 3) == pytest.approx(0.3 * np.exp(-9 / 16), abs=0.01)
    assert share(3.0, 0.0) == share(0.4, 1.0) == 0


def test_confusion_is_the_matrix_and_interaction_marks_the_wrist() -> None:
    n, matrix = 40_000, ((0.7, 0.1, 0.2), (0.0, 0.5, 0.5), (0.3, 0.3, 0.4))
    life = standing(np.tile([1.0, 1.0], (n, 1)), people=3)
    life.action[:] = np.array([[1], [2], [3]])
    life.wrist_xy[:] += 0.5
    marks, said = observe_sphere(
        life, np.eye(4), np.ones((3, n)), replace(EXACT, confusion=matrix), np.random.default_rng(0)
    )
    rows = said.reshape(3, n)
    assert np.allclose([np.bincount(row, minlength=3) / n for row in rows], matrix, atol=0.01)
    assert np.array_equal(marks[:, 0], np.where(said == 2, 1.5, 1.0))


# ---------------------------------------------------------------- truth


def test_a_plan_without_a_turn_is_that_of_the_truth() -> None:
    """On whole cells nothing is rounded, so that the two agree to the bit."""
    found, _ = dining(6)
    scene_T_episode = planar(1.5, 1.25, 0.0)
    ours = plan_truth(found, scene_T_episode, MapConfig())
    truth = affordance_truth(found.scene.moved(invert(scene_T_episode)))
    assert np.array_equal(ours.labels, truth.labels & 7)
    assert not ours.ignored.any()


@pytest.mark.parametrize("heading", [0.5, 2.6])
def test_a_turned_plan_is_that_of_the_turned_scene_but_for_borders(heading: float) -> None:
    found, _ = dining(6)
    scene_T_episode = planar(1.7, 1.3, heading)
    ours = plan_truth(found, scene_T_episode, MapConfig()).labels
    truth = affordance_truth(found.scene.moved(invert(scene_T_episode))).labels
    for kind in (Affordance.WALKABLE, Affordance.SITTABLE, Affordance.INTERACTABLE):
        a, b = ours >> kind & 1, truth >> kind & 1
        assert (a & b).sum() / (a | b).sum() > 0.9  # a seat at the limits of use may fall either way


def test_rooms_behind_walls_are_ignored_as_far_as_no_line_leads_through_the_door() -> None:
    grid = WalkMap(np.zeros(2), np.zeros((62, 30), dtype=bool), 0.1)
    camera = np.array([1.0, 1.5])
    open_, shut = (hidden_rooms(two_rooms(leaf), grid, camera) for leaf in (False, True))
    x, y = np.moveaxis(grid.centres(), -1, 0)
    right = x > 3.2
    assert np.array_equal(shut, right)
    slope = (y - 1.5) / (x - 1.0)  # through the doorway: within .5 m of the middle at both of its ends
    through = (np.abs(slope * (3.0 - 1.0)) < 0.5) & (np.abs(slope * (3.2 - 1.0)) < 0.5)
    assert np.array_equal(open_, right & ~through)
    single = Scene("scene-000000", two_rooms(True).rooms[:1], 2.5, two_rooms(True).objects)
    assert not hidden_rooms(single, grid, camera).any()


def test_the_camera_stands_in_the_middle() -> None:
    found, _ = dining()
    cells = central_cells(found.scene, found.walk, 0.1)
    every = found.walk.centres()[found.walk.free]
    spread = lambda xy: ((every - xy) ** 2).sum(axis=1).mean()  # noqa: E731
    worst = max(spread(xy) for xy in cells)
    assert len(cells) == round(0.1 * len(every))
    assert sum(spread(xy) < worst - 1e-3 for xy in every) <= len(cells)


# ---------------------------------------------------------------- samples


@cache
def samples(count: int = 3) -> tuple[Episode, ...]:
    unit = Unit(Seeds(5), 3, "train", "none", None)
    return tuple(
        map_episodes(
            unit, "activity-maps", dining(6)[0].scene, SHORT, SphereErrors(), replace(SMALL, samples_per_room=count)
        )
    )


def test_samples_are_episodes_of_one_scene() -> None:
    made = samples()
    names = [e.episode_id for e in made]
    assert names == ["activity-maps-000003", "activity-maps-000003-01", "activity-maps-000003-02"]
    for episode in made:
        maps, truth = episode.activity_maps, episode.truth.affordance
        assert maps.maps.shape == (3, 64, 64)
        assert maps.channels == ("stand", "sit", "interact")
        assert truth.labels.shape == truth.ignored.shape == (64, 64)
        assert maps.cell_m == truth.cell_m == 0.2
        assert 120 <= episode.duration_s <= 240
        assert np.array_equal(np.rint(maps.maps * 255) / np.float32(255), maps.maps)
        assert maps.maps.max() == 1
        assert episode.poses is None
        assert (episode.truth.scene is not None) == (episode is made[0])
    again = afford(made[0].truth.scene)  # the scene is in the frame of its sample
    walkable = top_down(again, np.full(2, -6.4), (64, 64), 0.2)[::-1, ::-1] & 1
    assert (walkable == made[0].truth.affordance.labels & 1).mean() > 0.97
    assert len({e.activity_maps.maps.tobytes() for e in made}) == 3
    assert len({e.truth.affordance.labels.tobytes() for e in made}) == 3


def test_a_sample_depends_on_its_number_alone() -> None:
    by_name = {e.episode_id: e for e in samples(3)}
    for episode in samples(2):
        other = by_name[episode.episode_id]
        assert np.array_equal(episode.activity_maps.maps, other.activity_maps.maps)
        assert np.array_equal(episode.truth.affordance.labels, other.truth.affordance.labels)
        assert episode.end_ns == other.end_ns


def test_activity_lies_where_it_is_afforded() -> None:
    """Exact observations, rows and columns as truth has them: who stands does so on walkable cells."""
    found, _ = dining()
    maps = MapConfig(blur_m=0.03)
    scene_T_episode = planar(1.7, 1.3, 0.9)
    life = life_of(2, replace(SHORT, atypical_share=0.0))
    marks, channel = observe_sphere(life, scene_T_episode, np.ones(life.action.shape), EXACT, np.random.default_rng(0))
    walkable = plan_truth(found, scene_T_episode, maps).labels & 1
    row, column = np.floor(maps.side_cells / 2 - marks[channel == 0] / maps.cell_m).astype(int).T
    assert walkable[row, column].mean() > 0.98
    stand = draw_maps(marks, channel, maps)[0]
    assert stand[row, column].min() > 0  # drawn where they are, not mirrored


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PlanarLifeConfig(minutes=(5.0, 1.0)), r"life\.minutes is \(5\.0, 1\.0\)"),
        (lambda: PlanarLifeConfig(explore=0, sit=0, touch=0), "not all zero"),
        (lambda: PlanarLifeConfig(atypical_share=4.0), "in percent"),
        (lambda: SphereErrors(confusion=((1, 0, 0), (0, 1, 0), (0, 0, 0.5))), "three rows of three shares"),
        (lambda: SphereErrors(near_m=10.0), "nearest < farthest"),
        (lambda: MapConfig(delta=0.0), r"maps\.delta is 0\.0"),
        (lambda: MapConfig(samples_per_room=0), "must be > 0"),
        (lambda: MapConfig(home_share=10), "in percent"),
    ],
)
def test_impossible_settings_are_refused(make, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        make()
