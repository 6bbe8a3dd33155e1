"""Groups of furniture alone in plain rooms of the least and of a large size: their relations and what they ask for."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_rooms import (
    CONFIG,
    HEIGHT_M,
    LEAST_M,
    TOUCH_M,
    arranged,
    check_bodies,
    check_kitchen,
    context,
    corners_of,
    depth,
    forward,
    in_frame_of,
    of,
    place,
    plain_shell,
)  # fmt: skip

from hsbench.geometry.convex import span
from hsbench.schema.categories import CATEGORIES
from hsbench.schema.scene import Part
from hsbench.synth.rooms.clearance import CLEAR_FRONT_M
from hsbench.synth.rooms.dining import LEG_ROOM_M, PULL_M, chairs_before
from hsbench.synth.rooms.groups import GROUPS
from hsbench.synth.rooms.items import Item, Piece, Pose
from hsbench.synth.rooms.placing import APART_M, Layout
from hsbench.synth.rooms.search import across_m, beside_ways, leaves_way, stretches, together
from hsbench.synth.rooms.shell import Shell
from hsbench.synth.rooms.supports import SUITED
from hsbench.synth.rooms.templates import FILLERS_OF, TEMPLATES

QUICK_SEEDS, MORE_SEEDS = range(2), range(2, 12)
REQUIRED = {
    "bathroom": ("toilet", "washbasin", "shower|bathtub"),
    "kitchen": ("kitchen_counter",),
    "bed": ("bed",),
    "bunk": ("bunk_bed",),
    "desk": ("desk", "chair|office_chair", "monitor|laptop"),
    "meeting": ("meeting_table", "chair|office_chair"),
    "media": ("sofa|armchair",),
    "facing": ("sofa|armchair",),
    "reading": ("armchair",),
    "piano": ("piano", "stool"),
    "dining": ("dining_table", "chair"),
    "wardrobe_corner": ("shoe_cabinet",),
}
ALONE = {("living", "reading"), ("living", "piano"), ("meeting", "water_cooler"), ("office", "filing_cabinet")}
CASES = sorted({(t.room_type, g) for t in TEMPLATES.values() for g in t.core[0].split("|")} | ALONE)


def layouts(kind: str, group: str, seeds: range) -> Iterator[tuple[str, Layout]]:
    for large, seed in itertools.product((False, True), seeds):
        yield f"{group} in a {'large' if large else 'small'} {kind}, seed {seed}", arranged(kind, group, large, seed)


def test_the_depth_of_two_boxes_is_their_overlap() -> None:
    a, b = span((0, 0, 0), (1, 1, 1)), span((0.9, 0.2, 0.3), (2, 0.8, 2))
    assert depth(a, b) == pytest.approx(0.1)
    assert depth(a, span((1.5, 0, 0), (2, 1, 1))) == pytest.approx(-0.5)


def check_fronts(name: str, layout: Layout) -> None:
    """Nothing that stands on the floor is in the first .3 m before a fridge, an oven, a toilet, or the door."""
    for item in of(layout, "fridge", "stove", "toilet", "washing_machine", "wardrobe"):
        (x0, y0, _), (x1, _, _) = item.piece.bounds
        before = span((x0 + 0.02, y0 - 0.3, 0.1), (x1 - 0.02, y0 - 0.005, 1.2)).transformed(item.pose.scene_T_object)
        for other in layout.items:
            if other is not item and other.z_range[0] < 1.2:
                assert all(depth(before, s) <= TOUCH_M for s in other.solids), f"{name}: {item.piece.category_name}"
    zone, _, high = layout.shell.openings[0].zone(
        layout.shell.walls[layout.shell.openings[0].wall], CONFIG.door_clear_m
    )
    way = span((*zone.min(axis=0), 0.0), (*zone.max(axis=0), high))
    for item in layout.items:
        assert all(depth(way, s) <= TOUCH_M for s in item.solids), f"{name}: {item.piece.category_name} before the door"


def check_seats(name: str, layout: Layout) -> None:
    """Chairs look at a table within reach, stools at an island at it; a screen on a desk looks at its chair."""
    tables = of(layout, "dining_table", "meeting_table", "desk", "kitchen_island")
    for chair in of(layout, "chair", "office_chair", "bar_stool"):
        front = np.array([*(place(chair) + forward(chair) * chair.piece.depth / 2), 0.0])
        gaps = []
        for table in tables:
            local = in_frame_of(table, np.stack([front, front + 0.3 * np.array([*forward(chair), 0.0])]))[:, :2]
            beyond = np.maximum(np.abs(local) - np.array([table.piece.width, table.piece.depth]) / 2, 0)
            gaps.append(np.hypot(*beyond.T))
        nearest = min(gaps, key=lambda g: g[0])
        assert nearest[0] <= 0.3, f"{name}: a chair {nearest[0]:.2f} m from any table"
        assert nearest[1] <= 0.1, f"{name}: a chair looks past its table"
    for screen in of(layout, "monitor", "laptop"):
        to_chairs = [place(c) - place(screen) for c in of(layout, "chair", "office_chair")]
        facing = [forward(screen) @ to / np.linalg.norm(to) for to in to_chairs if np.linalg.norm(to) < 1.2]
        assert max(facing) > 0.9, f"{name}: nobody sits before a {screen.piece.category_name}"


def check_television(name: str, layout: Layout) -> None:
    for tv in of(layout, "television"):
        seats = of(layout, "sofa") or of(layout, "meeting_table")
        for seat in seats:
            to = place(seat) - place(tv)
            assert forward(tv) @ to > 1.0, f"{name}: a television looks away"
            assert abs(forward(tv)[0] * to[1] - forward(tv)[1] * to[0]) < 0.3, f"{name}: a television stands aside"
            if seat.piece.category_name == "sofa":
                assert forward(seat) @ forward(tv) < -0.99, f"{name}: a sofa looks away"


def check_sitting(name: str, layout: Layout) -> None:
    """Sofas and armchairs around a coffee table look at it, a stool before a piano at its keys."""
    for table in of(layout, "coffee_table"):
        for seat in of(layout, "sofa", "armchair"):
            to = place(table) - place(seat)
            assert np.linalg.norm(to) < 3.0, f"{name}: a {seat.piece.category_name} far from its table"
            assert forward(seat) @ to / np.linalg.norm(to) > 0.6, f"{name}: a {seat.piece.category_name} looks away"
    for piano in of(layout, "piano"):
        (stool,) = of(layout, "stool")
        assert forward(stool) @ forward(piano) < -0.99
        assert np.linalg.norm(place(piano) - place(stool)) < 1.0


def check_bathroom(name: str, layout: Layout) -> None:
    basins = of(layout, "washbasin")
    for mirror in of(layout, "mirror"):
        aside = [abs(in_frame_of(b, np.array([[*place(mirror), 0.0]]))[0, 0]) for b in basins]
        if not basins:
            continue
        basin = basins[int(np.argmin(aside))]
        assert min(aside) < 0.01, f"{name}: a mirror hangs beside its basin"
        assert mirror.z_range[0] >= basin.z_range[1] + 0.1, f"{name}: a mirror hangs into its basin"
        assert forward(mirror) @ forward(basin) > 0.99


def check_bed(name: str, layout: Layout) -> None:
    for stand in of(layout, "night_stand"):
        bed = min(of(layout, "bed"), key=lambda b: np.linalg.norm(place(b) - place(stand)))
        x, y, _ = in_frame_of(bed, np.array([[*place(stand), 0.0]]))[0]
        assert abs(x) - (bed.piece.width + stand.piece.width) / 2 == pytest.approx(0.04, abs=0.01), (
            f"{name}: not beside"
        )
        assert bed.piece.depth / 2 - y < 0.4, f"{name}: a night stand not at the head"


CHECKS = (
    check_bodies,
    check_fronts,
    check_seats,
    check_television,
    check_sitting,
    check_kitchen,
    check_bathroom,
    check_bed,
)


@pytest.mark.parametrize(("kind", "group"), CASES)
def test_a_group_finds_its_place_and_keeps_its_relations(kind: str, group: str) -> None:
    run(kind, group, QUICK_SEEDS)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "group"), CASES)
def test_a_group_finds_its_place_in_more_rooms(kind: str, group: str) -> None:
    run(kind, group, MORE_SEEDS)


def run(kind: str, group: str, seeds: range) -> None:
    for name, layout in layouts(kind, group, seeds):
        present = {i.piece.category_name for i in layout.items}
        for wanted in REQUIRED.get(group.partition(":")[0], (group,)):
            assert present & set(wanted.split("|")), f"{name}: no {wanted} among {sorted(present)}"
        for check in CHECKS:
            check(name, layout)


def test_large_rooms_get_what_a_mode_promises() -> None:
    promised = {
        ("kitchen", "kitchen:island"): {"kitchen_island", "bar_stool", "range_hood", "fridge", "dishwasher"},
        ("kitchen", "kitchen:corner"): {"fridge", "range_hood", "wall_cabinet"},
        ("bathroom", "bathroom:tub"): {"bathtub", "mirror"},
        ("meeting", "meeting:board"): {"whiteboard"},
        ("meeting", "meeting:screen"): {"television", "tv_stand"},
        ("living", "media:wall"): {"television", "sofa", "coffee_table"},
    }
    for (kind, group), wanted in promised.items():
        found = [wanted <= {i.piece.category_name for i in arranged(kind, group, True, s).items} for s in QUICK_SEEDS]
        assert np.mean(found) >= 0.6, group
    assert all(len(of(arranged("bathroom", "bathroom:double", True, s), "washbasin")) == 2 for s in QUICK_SEEDS)
    assert all(len(of(arranged("bedroom", "bed:twin", True, s), "bed")) == 2 for s in QUICK_SEEDS)
    assert all(len(of(arranged("office", "desk:four", True, s), "desk")) == 4 for s in QUICK_SEEDS)


def test_dividers_stand_at_a_wall_with_one_side_and_split_the_room() -> None:
    for seed in QUICK_SEEDS:
        layout = Layout(plain_shell("living", True, seed), [], CONFIG)
        assert layout.place(GROUPS["divider"](context(layout, seed), ""))
        check_bodies(f"seed {seed}", layout)
        shelves = of(layout, "bookshelf")
        assert len(shelves) == 2
        at_wall = min(
            float(np.minimum(i.corners, np.array(layout.shell.size_m[:2]) - i.corners).min()) for i in shelves
        )
        assert at_wall <= 0.031
        for item in shelves:
            to_walls = np.sort(np.minimum(place(item), np.array(layout.shell.size_m[:2]) - place(item)))
            assert to_walls[1] >= 1.4, "it stands where a part of the room is on either side"


def test_a_wall_of_storage_has_its_backs_in_one_plane() -> None:
    for seed in MORE_SEEDS:
        layout = arranged("living", "storage", True, seed)
        row = of(layout, "bookshelf", "sideboard")
        assert len(row) >= 2
        backs = [float(forward(i) @ (place(i) - forward(i) * i.piece.depth / 2)) for i in row]
        assert np.ptp(backs) <= 1e-3
        aside = np.sort([in_frame_of(row[0], np.array([[*place(i), 0.0]]))[0, 0] for i in row])
        widths = np.array([i.piece.width for i in row])
        assert np.diff(aside).sum() + (widths[0] + widths[-1]) / 2 == pytest.approx(
            widths.sum() + 0.01 * (len(row) - 1), abs=2e-3
        )


def test_a_corner_to_play_in_has_its_boxes_behind_the_rug() -> None:
    for seed in MORE_SEEDS:
        layout = arranged("bedroom", "play", True, seed)
        (cloth,), boxes = of(layout, "rug"), of(layout, "storage_box")
        assert len(boxes) == 2
        for box in boxes:
            feet = in_frame_of(cloth, corners_of(box))[:, :2]
            assert (np.abs(feet[:, 0]) <= cloth.piece.width / 2).all()
            assert (feet[:, 1] >= cloth.piece.depth / 2).all()
        check_bodies(f"play, seed {seed}", layout)


def test_before_a_television_nothing_of_other_groups_stands() -> None:
    for seed in MORE_SEEDS:
        layout = arranged("living", "media:wall", True, seed)
        for stand in of(layout, "tv_stand"):
            (sofa,) = of(layout, "sofa")
            between = (place(stand) + place(sofa)) / 2
            box = Piece("storage_box", (Part("box", (0, 0, 0), None, span((-0.1, -0.1, 0.0), (0.1, 0.1, 1.5))),))
            assert stand.zone is not None
            assert not layout.free_of(Item(box, Pose(*between.tolist())), ())
            assert np.ptp(stand.zone @ forward(stand)) == pytest.approx(
                np.linalg.norm(place(stand) - place(sofa)) - (stand.piece.depth + sofa.piece.depth) / 2, abs=2e-3
            )


def test_an_armchair_to_read_in_has_a_lamp_or_a_table_beside_it() -> None:
    for seed in MORE_SEEDS:
        layout = arranged("living", "reading", True, seed)
        (chair,) = of(layout, "armchair")
        beside = [np.linalg.norm(place(i) - place(chair)) for i in of(layout, "floor_lamp", "side_table")]
        assert min(beside) < 1.0


def test_no_shelf_hangs_over_a_bed_or_table() -> None:
    for (kind, group), seed in itertools.product((("bedroom", "bed"), ("dining", "dining:wall")), MORE_SEEDS):
        layout = arranged(kind, group, False, seed)
        below = [i.corners for i in of(layout, "bed", "dining_table")]
        proposals = [p[0].corners for p in GROUPS["shelf"](context(layout, seed), "")]
        assert proposals
        for corners, low in itertools.product(proposals, below):
            gap = np.maximum(corners.min(axis=0), low.min(axis=0)) - np.minimum(corners.max(axis=0), low.max(axis=0))
            assert gap.max() >= 0.149


def test_handles_of_windows_stay_within_reach() -> None:
    """Nothing that reaches farther into the room than a person can lean stands before the handle."""
    layout = Layout(plain_shell("living", True, 0), [], CONFIG)
    (window,) = [o for o in layout.shell.openings if o.kind == "window"]
    wall = layout.shell.walls[window.wall]
    for deep, free in ((0.4, True), (0.6, True), (0.9, False)):
        box = Piece("storage_box", (Part("box", (0, 0, 0), None, span((-1.0, -deep / 2, 0.0), (1.0, deep / 2, 0.7))),))
        x, y = wall.place(window.middle_m, deep / 2 + 0.02)
        empty = layout.mark()
        assert bool(layout.place([[Item(box, Pose(x, y, wall.yaw))]])) == free, deep
        layout.back_to(empty)


# What groups ask of a room


def test_what_stands_aside_of_a_door_is_not_on_the_line_through_it() -> None:
    layout = Layout(plain_shell("living", True, 0), [], CONFIG)
    (door,) = [o for o in layout.shell.openings if o.is_way]
    wall, ctx = layout.shell.walls[door.wall], context(layout, 0)
    for aside, out, free in ((0.0, 1.0, False), (0.0, 2.5, True), (0.7, 1.0, True), (-0.5, 1.0, False)):
        x, y = wall.place(door.middle_m + aside, out)
        assert beside_ways(ctx, Pose(x, y), 0.1) == free, (aside, out)


def test_a_way_is_left_before_what_stands_at_a_wall() -> None:
    layout = Layout(plain_shell("corridor", False, 0), [], CONFIG)
    ctx = context(layout, 0)
    for wall in layout.shell.walls:
        across = across_m(layout.shell, wall, wall.length_m / 2)
        assert leaves_way(ctx, wall, wall.length_m / 2, across - 0.91)
        assert not leaves_way(ctx, wall, wall.length_m / 2, across - 0.89)


def test_the_free_depth_before_a_wall_is_that_of_the_outline() -> None:
    outline = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 2.0], [3.0, 2.0], [3.0, 4.0], [0.0, 4.0]])
    shell = Shell(outline, HEIGHT_M, (), np.zeros(2))
    south, east, _, inner, north, west = shell.walls
    assert [across_m(shell, south, x) for x in (1.0, 4.0)] == pytest.approx([4.0, 2.0])
    assert across_m(shell, east, 1.0) == pytest.approx(5.0)
    assert across_m(shell, inner, 1.0) == pytest.approx(3.0)
    assert across_m(shell, north, 1.0) == pytest.approx(4.0)
    assert [across_m(shell, west, x) for x in (1.0, 3.0)] == pytest.approx([3.0, 5.0])


def test_units_may_stand_along_all_of_a_wall_but_before_its_door() -> None:
    layout = Layout(plain_shell("kitchen", True, 0), [], CONFIG)
    found = stretches(context(layout, 0), "kitchen_counter", 0.6, 0.9)
    door = layout.shell.openings[0]
    walls = layout.shell.walls
    for i, wall in enumerate(walls):
        (low, high) = next((a, b) for w, a, b in found if w is wall)
        if i == door.wall:  # up to the zone of the door, which is at its end
            assert (low, high) == pytest.approx((0.02, door.middle_m - door.width_m / 2 - 0.1), abs=0.051)
        elif i not in ((door.wall + 1) % 4, (door.wall - 1) % 4):
            assert (low, high) == pytest.approx((0.02, wall.length_m - 0.02))


def pieces(sizes: list[tuple[float, float]]) -> list[Piece]:
    bodies = [span((-w / 2, -d / 2, 0.0), (w / 2, d / 2, 0.5)) for w, d in sizes]
    return [Piece("washbasin", (Part("body", (0, 0, 0), None, body),)) for body in bodies]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_joint_proposals_are_those_that_keep_apart(seed: int) -> None:
    """Against brute force: every proposal keeps bodies off bodies and fronts, and one is found if there is any."""
    rng = np.random.default_rng(seed)
    layout = Layout(
        Shell(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.5], [0.0, 2.5]]), HEIGHT_M, (), np.zeros(2)), [], CONFIG
    )
    steps = [
        [[Item(piece, Pose(*rng.uniform(0.4, 2.2, 2).round(2), math.pi / 2 * int(rng.integers(4))))] for _ in range(5)]
        for piece in pieces([tuple(rng.uniform(0.3, 0.7, 2).round(2)) for _ in range(3)])
    ]

    def apart(a: Item, b: Item) -> bool:
        front = CLEAR_FRONT_M["washbasin"]
        boxes = []
        for item in (a, b):
            (x0, y0, _), (x1, y1, _) = item.piece.bounds
            boxes.append([item.rectangle(x0, y0, x1, y1), item.rectangle(x0, y0 - front, x1, y1)])
        pairs = ((boxes[0][0], boxes[1][1]), (boxes[0][1], boxes[1][0]))
        gaps = [np.maximum(p.min(axis=0), q.min(axis=0)) - np.minimum(p.max(axis=0), q.max(axis=0)) for p, q in pairs]
        return bool(min(gap.max() for gap in gaps) >= APART_M - 1e-6)

    fitting = [[p for p in step if layout.free_of(p[0], ())] for step in steps]
    good = [c for c in itertools.product(*fitting) if all(apart(a[0], b[0]) for a, b in itertools.combinations(c, 2))]
    found = [tuple(items) for items in together(context(layout, 0), steps)]
    assert all(found.count(items) == 1 for items in found)
    assert {tuple(i for p in c for i in p) for c in good} >= set(found)
    assert bool(found) == bool(good)


@pytest.mark.parametrize("inset_m", [0.0, 0.05, 0.2, 0.4])
def test_chairs_have_room_to_leave_the_legs_of_their_table(inset_m: float) -> None:
    top = Part("top", (0, 0, 0), "top", span((-0.5, -0.4, 0.7), (0.5, 0.4, 0.72)))
    panel = Part("leg", (0, 0, 0), None, span((-0.5, -0.4 + inset_m, 0.0), (0.5, 0.4, 0.7)))
    seat = Part("seat", (0, 0, 0), "seat", span((-0.2, -0.2, 0.4), (0.2, 0.2, 0.45)))
    pose = Pose(2.0, 2.0, 0.3)
    chairs = chairs_before(Piece("dining_table", (top, panel)), Piece("chair", (seat,)), pose, np.random.default_rng(0))
    for chair in chairs:
        x, y = chair.pose.x - pose.x, chair.pose.y - pose.y
        out = -(math.cos(pose.yaw) * y - math.sin(pose.yaw) * x)
        gap = out - 0.2 - 0.4
        assert chair.behind_m == pytest.approx(max(PULL_M, LEG_ROOM_M - gap - inset_m), abs=2e-4)


# Tables of the catalogue


def test_every_room_type_has_common_and_novel_templates_of_known_groups() -> None:
    for kind in LEAST_M:
        own = [t for t in TEMPLATES.values() if t.room_type == kind]
        assert sum(not t.novel for t in own) >= 3
        assert sum(t.novel for t in own) >= 1
        assert FILLERS_OF[kind]
    assert {t.room_type for t in TEMPLATES.values()} == set(LEAST_M)
    named = {g for t in TEMPLATES.values() for names in (*t.core, *t.extras) for g in names.split("|")}
    named |= {g for fillers in FILLERS_OF.values() for g in fillers}
    assert {g.partition(":")[0] for g in named} <= set(GROUPS)


def test_tables_name_categories_that_exist() -> None:
    known = {c.name for c in CATEGORIES}
    assert set(CLEAR_FRONT_M) <= known
    assert set(SUITED) | {thing for things in SUITED.values() for thing in things} <= known
