"""Seats against hand-worked positions, at both sides of every limit, and under what must not change them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.geometry.convex import box, cylinder, span
from hsbench.geometry.transforms import planar, rigid, rotation_x
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.truth.obstacles import pack_obstacles
from hsbench.truth.sittable import SeatUse, seat_uses
from hsbench.truth.walkable import WalkMap, connected_to_doors, walk_map
from tests.unit.synth.living_rooms import bed, chair, part, room, sofa, table

GREY = (120, 120, 120)


def uses_of(scene: Scene) -> tuple[SeatUse, ...]:
    walk = walk_map(scene)
    return seat_uses(scene, WalkMap(walk.origin_xy, connected_to_doors(walk, scene)), pack_obstacles(scene))


def seats(scene: Scene) -> set[tuple[int, str]]:
    """(object id, part name) of what can be sat on."""
    return {
        (item.object_id, item.parts[use.part_index].name)
        for use in uses_of(scene)
        for item in [scene.objects[use.object_index]]
    }


def cube(number: int, low: tuple[float, float, float], high: tuple[float, float, float]) -> SceneObject:
    return SceneObject(number, "sideboard", np.eye(4), (part("body", low, high),))


def stool(
    number: int, x: float, y: float, size: float = 0.35, height: float = 0.45, yaw: float = 0.0, movable: bool = False
) -> SceneObject:
    """A slab on a pole that stays clear of legs."""
    half = size / 2
    seat = part("seat", (-half, -half, height - 0.04), (half, half, height), "seat")
    pole = part("pole", (-0.02, -0.02, 0), (0.02, 0.02, height - 0.04))
    return SceneObject(number, "stool", planar(x, y, yaw), (seat, pole), movable)


def bench(number: int, x: float, y: float, width: float, depth: float, height: float = 0.45) -> SceneObject:
    """Fixed, without a back, a box down to the floor."""
    seat = part("seat", (-width / 2, -depth / 2, 0), (width / 2, depth / 2, height), "seat")
    return SceneObject(number, "bench", planar(x, y, 0), (seat,))


def armchair(number: int, x: float, y: float, yaw: float) -> SceneObject:
    parts = (
        part("seat", (-0.3, -0.4, 0.1), (0.3, 0.2, 0.45), "seat"),
        part("back", (-0.3, 0.2, 0.1), (0.3, 0.4, 0.9)),
    )
    return SceneObject(number, "armchair", planar(x, y, yaw), parts)


def test_a_chair_alone_is_used_where_it_stands() -> None:
    (use,) = uses_of(room(4, 4, chair(10, 2, 2, np.pi / 2)))
    assert np.allclose(use.front_xy, [1, 0])  # the front, -y, turned by a quarter
    assert (use.pull_m, use.height_m) == (0.0, 0.45)
    assert np.allclose(use.shift_xy, 0)
    # The seat is .44 wide and, before its back, .41 deep: the patch has 9 cm across and reaches from .045 to -.015.
    assert use.centres_xy[:, 1].min() == pytest.approx(2 - 0.045, abs=1e-6)
    assert use.centres_xy[:, 1].max() == pytest.approx(2 + 0.045, abs=1e-6)
    assert use.centres_xy[:, 0].max() == pytest.approx(2.22 - 0.175, abs=2e-6)
    assert use.centres_xy[:, 0].min() >= 2 - 0.015 - 1e-6


@pytest.mark.parametrize(("height", "sat"), [(0.25, True), (0.249, False), (0.75, True), (0.751, False)])
def test_height_of_the_seat(height: float, sat: bool) -> None:
    assert bool(seats(room(4, 4, stool(10, 2, 2, height=height)))) == sat


@pytest.mark.parametrize(("size", "sat"), [(0.35, True), (0.349, False)])
@pytest.mark.parametrize("yaw", [0.0, 0.3, np.pi / 2])
def test_size_of_a_square_patch(size: float, sat: bool, yaw: float) -> None:
    assert bool(seats(room(4, 4, stool(10, 2, 2, size, yaw=yaw)))) == sat


@pytest.mark.parametrize(("inner_radius", "sat"), [(0.1751, True), (0.1749, False)])
def test_a_round_seat_is_as_large_as_its_diameter(inner_radius: float, sat: bool) -> None:
    sides = 16
    seat = Part("seat", GREY, "seat", cylinder(inner_radius / np.cos(np.pi / sides), 0.1, 0.45, sides=sides))
    item = SceneObject(10, "stool", planar(2, 2, 0.4), (seat,))
    assert bool(seats(room(4, 4, item))) == sat


@pytest.mark.parametrize(("tilt_deg", "sat"), [(14.9, True), (15.1, False)])
def test_tilt_of_the_seat(tilt_deg: float, sat: bool) -> None:
    solid = box((0.5, 0.5, 0.05)).transformed(rigid(rotation_x(np.radians(tilt_deg)), (0.0, 0.0, 0.45)))
    item = SceneObject(10, "stool", planar(2, 2, 0), (Part("seat", GREY, "seat", solid),))
    assert bool(seats(room(4, 4, item))) == sat


@pytest.mark.parametrize(("gap", "sat"), [(0.85, True), (0.84, False)])
def test_head_room_above_the_patch(gap: float, sat: bool) -> None:
    shelf = cube(11, (1.5, 1.5, 0.45 + gap), (2.5, 2.5, 0.45 + gap + 0.05))
    # Nobody can stand under the shelf: the seat must be reached from beside it.
    assert bool(seats(room(4, 4, bench(10, 2, 2, 0.6, 0.6), shelf))) == sat


@pytest.mark.parametrize(("gap", "sat"), [(0.35, True), (0.34, False)])
@pytest.mark.parametrize(("bottom", "matters"), [(0.0, False), (0.05, True), (0.44, True), (0.45, False), (0.7, False)])
def test_room_for_legs_in_front(gap: float, sat: bool, bottom: float, matters: bool) -> None:
    front = 2.0 - 0.4
    # A bar across the front of the seat; it ends before the sides, from where one comes.
    bar = cube(11, (1.7, front - gap - 0.05, bottom), (2.3, front - gap, bottom + 0.06))
    assert bool(seats(room(4, 4, armchair(10, 2, 2, 0), bar))) == (sat or not matters)


@pytest.mark.parametrize(("top", "sat"), [(0.1, True), (0.11, False)])
def test_legs_pass_over_what_is_low(top: float, sat: bool) -> None:
    low = cube(11, (1.75, 1.4, 0), (2.25, 1.6, top))
    assert bool(seats(room(4, 4, armchair(10, 2, 2, 0), low))) == sat


@pytest.mark.parametrize(("distance", "sat"), [(0.699, True), (0.75, False)])
def test_a_walkable_cell_is_near(distance: float, sat: bool) -> None:
    # Low bars all around: a body cannot stand among them, legs pass over. Cells begin .25 m beyond their outer edge.
    beyond = distance - 0.25 - 0.025
    low, high = 1.6 - beyond, 2.4 + beyond
    bars = [
        cube(11, (low, low, 0.03), (high, low + 0.05, 0.09)),
        cube(12, (low, high - 0.05, 0.03), (high, high, 0.09)),
        cube(13, (low, low, 0.03), (low + 0.05, high, 0.09)),
        cube(14, (high - 0.05, low, 0.03), (high, high, 0.09)),
        cube(15, (low, 1.75, 0.03), (high, 1.77, 0.09)),
        cube(16, (low, 2.23, 0.03), (high, 2.25, 0.09)),
        cube(17, (1.75, low, 0.03), (1.77, high, 0.09)),
        cube(18, (2.23, low, 0.03), (2.25, high, 0.09)),
    ]
    scene = room(5, 5, bench(10, 2, 2, 0.8, 0.8), *bars)
    assert bool(seats(scene)) == sat


def test_without_a_door_nothing_is_sittable() -> None:
    assert seats(room(4, 4, chair(10, 2, 2, 0)))
    assert not seats(room(4, 4, chair(10, 2, 2, 0), door=False))


def test_a_chair_pushed_under_a_table_is_pulled_out() -> None:
    # The table's edge is at y = 1.6. The chair faces it (-y); its seat reaches from 1.42 to 1.83, up to its back.
    scene = room(4, 4, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0))
    (use,) = uses_of(scene)
    # Moved towards +y. The patch may begin .06 m behind the front edge; it must clear the table.
    assert np.allclose(use.front_xy, [0, -1])
    foremost = 1.42 + 0.05  # patches are tried every 5 cm of depth
    assert use.pull_m == pytest.approx(np.ceil(round((1.6 - foremost) / 0.01, 6)) * 0.01)
    assert use.centres_xy[:, 1].min() - 0.175 >= 1.6 - 1e-3


def test_a_chair_that_cannot_be_pulled_out_is_none() -> None:
    pushed_in = (table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0))
    assert seats(room(4, 4, *pushed_in)) == {(11, "seat")}
    wall = cube(12, (0.9, 1.9, 0), (3.1, 1.95, 1.0))  # 4 cm behind the back
    assert not seats(room(4, 4, *pushed_in, wall))
    passage = cube(12, (0.9, 2.05, 0), (3.1, 2.1, 2.0))  # room for the chair, none to come between
    assert not seats(room(4, 4, *pushed_in, passage))


def test_a_chair_that_is_fixed_is_not_pulled() -> None:
    pushed_in = chair(11, 2, 1.64, 0)
    fixed = SceneObject(11, "chair", pushed_in.scene_T_object, pushed_in.parts, movable=False)
    assert not seats(room(4, 4, table(10, 2, 1.2, 0), fixed))


def test_a_pulled_chair_does_not_jump_over_what_is_behind_it() -> None:
    bar = cube(12, (1.5, 1.93, 0.0), (2.5, 1.945, 0.5))
    assert not seats(room(4, 4, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0), bar))
    thin = cube(12, (1.5, 1.93, 0.0), (2.5, 1.945, 0.019))  # stepped on, passed over
    assert seats(room(4, 4, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0), thin))


def test_a_stool_comes_out_on_the_side_that_is_free() -> None:
    top = SceneObject(10, "dining_table", np.eye(4), (part("top", (1.5, 1.5, 0.7), (2.5, 2.5, 0.75), "top"),))
    pushed_in = stool(11, 1.8, 2.0, movable=True)  # its middle .3 m under the edge at x = 1.5
    uses = uses_of(room(4, 4, top, pushed_in))
    (use,) = uses
    assert np.allclose(use.front_xy, [1, 0])
    assert use.pull_m == pytest.approx(0.48, abs=0.0101)  # .3 + .175 m, whole centimetres
    blocked = cube(12, (1.2, 1.6, 0), (1.25, 2.4, 1.0))
    others = uses_of(room(4, 4, top, pushed_in, blocked))
    assert {tuple(np.round(u.front_xy)) for u in others} <= {(0.0, 1.0), (0.0, -1.0), (-1.0, 0.0)}


def test_a_bed_at_the_wall_is_used_from_its_free_edges() -> None:
    scene = room(4, 4, bed(10, 0.8, 3.0, 0.0))  # left side and head at walls
    fronts = {tuple(np.round(use.front_xy).tolist()) for use in uses_of(scene)}
    assert fronts == {(1.0, 0.0), (0.0, -1.0)}
    boxed_in = [cube(11, (1.65, 1.5, 0), (1.7, 4, 1)), cube(12, (0, 1.8, 0), (1.7, 1.85, 1))]
    assert not seats(room(4, 4, bed(10, 0.8, 3.0, 0.0), *boxed_in))


def test_every_place_of_a_sofa_is_one() -> None:
    scene = room(5, 5, sofa(10, 2.5, 2.5, 0.0))
    assert seats(scene) == {(10, "seat0"), (10, "seat1")}
    in_the_middle = cube(11, (2.75, 2.3, 0.45), (3.05, 2.6, 0.7))  # of the right one: .25 m are left beside it
    assert seats(room(5, 5, sofa(10, 2.5, 2.5, 0.0), in_the_middle)) == {(10, "seat0")}
    at_its_side = cube(11, (2.6, 2.3, 0.45), (2.9, 2.6, 0.7))
    assert seats(room(5, 5, sofa(10, 2.5, 2.5, 0.0), at_its_side)) == {(10, "seat0"), (10, "seat1")}


def test_bedding_is_sat_upon_and_a_high_rim_is_not_passed() -> None:
    def cot(rim: float) -> SceneObject:
        parts = (
            part("mattress", (-0.5, -1, 0.2), (0.5, 1, 0.45), "mattress"),
            part("duvet", (-0.5, -1, 0.45), (0.5, 1, 0.5)),
            *(part("rim", (a, -1.03, 0.1), (a + 0.03, 1.03, rim)) for a in (-0.53, 0.5)),
            *(part("rim", (-0.5, b, 0.1), (0.5, b + 0.03, rim)) for b in (-1.03, 1.0)),
        )
        return SceneObject(10, "bed", planar(2, 2, 0.2), parts)

    assert seats(room(4, 4, cot(0.45))) == {(10, "mattress")}
    assert not seats(room(4, 4, cot(0.7)))


@given(st.integers(0, 3), st.integers(-20, 20), st.integers(-20, 20), st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_a_move_by_whole_cells_and_quarter_turns_moves_the_seats(turns: int, i: int, j: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(1.0, 3.0, 2).round(2)
    scene = room(5, 4, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0), bench(12, x, y, 1.0, 0.4), sofa(13, 3.9, 3.4, 0.0))
    a_T_scene = planar(0.05 * i, 0.05 * j, turns * np.pi / 2)
    before, after = uses_of(scene), uses_of(scene.moved(a_T_scene))
    assert len(before) == len(after)
    for a, b in zip(before, after, strict=True):
        assert (a.object_index, a.part_index, a.height_m) == (b.object_index, b.part_index, b.height_m)
        assert a.pull_m == b.pull_m
        moved = np.column_stack([a.centres_xy, np.zeros(len(a.centres_xy))]) @ a_T_scene[:3, :3].T + a_T_scene[:3, 3]
        assert np.allclose(moved[:, :2], b.centres_xy, atol=1e-5)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_one_more_thing_in_the_room_makes_nothing_sittable(seed: int) -> None:
    rng = np.random.default_rng(seed)
    things = [table(10, 2.4, 2.6, 0.3), sofa(13, 4.4, 3.0, -np.pi / 2), bed(14, 1.0, 3.9, 0.0)]
    for k in range(4):
        x, y = rng.uniform(1.2, 3.8, 2)
        things.append(chair(20 + k, x, y, rng.uniform(0, 6)))
    low = np.append(rng.uniform(0.2, 4.2, 2), rng.uniform(0, 1))
    high = low + rng.uniform(0.05, 0.8, 3)
    # The door is at (.8, 0): what stands there changes where one comes from, which is not the question here.
    low[1], high[1] = low[1] + 1.0, high[1] + 1.0
    one_more = SceneObject(30, "sideboard", np.eye(4), (Part("body", GREY, solid=span(low, high)),))
    assert seats(room(5, 5, *things, one_more)) <= seats(room(5, 5, *things))


@pytest.mark.parametrize("seed", range(4))
def test_no_solid_reaches_into_the_boxes_of_a_use(seed: int) -> None:
    """Dense points of the torso and, at one of the places for legs, of the legs: all free, as the rule says."""
    rng = np.random.default_rng(seed)
    things = [table(10, 2.4, 2.6, 0.3), sofa(13, 4.4, 2.0, -np.pi / 2 + 0.1)]
    things += [chair(20 + k, *rng.uniform(0.8, 3.8, 2), rng.uniform(0, 6)) for k in range(5)]
    scene = room(5, 5, *things)
    uses = uses_of(scene)
    assert uses
    unit = np.stack(np.meshgrid(*[np.linspace(0, 1, 15)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    margin = 0.002
    for use in uses:
        shift = np.append(use.shift_xy, 0)
        solids = [
            s.transformed(planar(*shift[:2], 0)) if k == use.object_index else s
            for k, item in enumerate(scene.objects)
            for s in item.solids
        ]
        for centre in use.centres_xy[:: max(1, len(use.centres_xy) // 3)]:
            torso = _points(unit, centre, use.front_xy, (-0.175, 0.175), (use.height_m, use.height_m + 0.85))
            assert not any(s.contains(torso, margin).any() for s in solids)
            legs = [
                _points(unit, centre, use.front_xy, (0.175 + d, 0.525 + d), (0.1, use.height_m))
                for d in np.arange(0, 0.15001, 0.0025)
            ]
            assert any(not any(s.contains(p, margin + 0.001).any() for s in solids) for p in legs)


def _points(
    unit: np.ndarray, centre: np.ndarray, front: np.ndarray, ahead: tuple[float, float], up: tuple[float, float]
) -> np.ndarray:
    a = ahead[0] + (ahead[1] - ahead[0]) * unit[:, 0]
    b = 0.35 * (unit[:, 1] - 0.5)
    xy = centre + a[:, None] * front + b[:, None] * np.array([-front[1], front[0]])
    return np.column_stack([xy, up[0] + (up[1] - up[0]) * unit[:, 2]])
