"""Floor plans: what an architect would check, over many seeds, with shapely, sampled points and a body that walks."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage
from shapely.geometry import LineString, Point, Polygon, box

from hsbench.errors import SchemaError
from hsbench.geometry.rays import pack_solids, segments_blocked
from hsbench.schema.scene import Scene, SceneObject
from hsbench.synth.furniture import COMMON_FAMILIES, family
from hsbench.synth.rooms.config import HomeConfig, RoomConfig
from hsbench.synth.rooms.floor_plans import draw_home_plan, draw_room_plan
from hsbench.synth.rooms.plan import OUTSIDE, FloorPlan, PlanOpening
from hsbench.synth.rooms.plan_openings import VIEW_M
from hsbench.synth.rooms.plan_shapes import SHAPES
from hsbench.synth.rooms.regions import Lines, inside, outline_of, rectangles_of
from hsbench.synth.rooms.room_kinds import PROGRAMMES, ROOM_KINDS
from hsbench.synth.rooms.structure import around_room, room_style, structure
from hsbench.synth.rooms.walls import masonry
from hsbench.synth.seeds import Seeds
from hsbench.truth.doorways import doorways
from hsbench.truth.walkable import WalkMap, connected, walk_map

NAMES = tuple(PROGRAMMES)
HOMES, ROOMS = 60, 36
BUILT = 20  # of each, with their objects
BODY_M = 0.3  # half of .6 m
CLEAR_M = 0.7
LEAVES = frozenset(("bathroom", "bedroom", "study", "office", "meeting"))
EPS = 1e-6


@cache
def home(index: int) -> FloorPlan:
    return draw_home_plan(Seeds(21).child(index), HomeConfig(programmes=((NAMES[index % len(NAMES)], 1.0),)))


@cache
def room(index: int) -> FloorPlan:
    kinds = tuple(ROOM_KINDS)
    config = RoomConfig(shapes=((SHAPES[index % len(SHAPES)], 1.0),))
    return draw_room_plan(Seeds(22).child(index), config, kinds[index % len(kinds)])


def plans(homes: int = HOMES, rooms: int = ROOMS) -> list[FloorPlan]:
    return [*(home(i) for i in range(homes)), *(room(i) for i in range(rooms))]


@cache
def built(index: int) -> tuple[FloorPlan, Scene]:
    """A plan and the scene of its structure alone; homes first."""
    plan = home(index) if index < BUILT else room(index - BUILT)
    seeds = Seeds(23).child(index)
    style = family(COMMON_FAMILIES[index % len(COMMON_FAMILIES)]).for_room(seeds.rng("style"))
    styles = [room_style(style, r.room_type, seeds.rng(f"style-{i}")) for i, r in enumerate(plan.rooms)]
    return plan, Scene("s", plan.rooms, plan.height_m, tuple(structure(plan, seeds, style, styles)))


EVERY = range(2 * BUILT)


def polygons(plan: FloorPlan) -> list[Polygon]:
    return [Polygon(r.outline_xy) for r in plan.rooms]


def hole(plan: FloorPlan, opening: PlanOpening) -> Polygon:
    wall = plan.walls[opening.front][opening.wall]
    half = opening.width_m / 2
    ends = [wall.point(opening.middle_m + s * half, -t) for s, t in ((-1, 0), (1, 0), (1, opening.thickness_m))]
    return Polygon([*ends, wall.point(opening.middle_m - half, opening.thickness_m * -1)])


def test_rooms_are_rectilinear_in_whole_centimetres() -> None:
    for plan in plans():
        for outline in (plan.outline_xy, *(r.outline_xy for r in plan.rooms)):
            assert np.array_equal(outline, outline.round(2))
            step = np.roll(outline, -1, axis=0) - outline
            assert ((step != 0).sum(axis=1) == 1).all()
            assert ((step[:, 0] == 0) == (np.roll(step, 1, axis=0)[:, 0] != 0)).all(), "every corner turns"
        assert np.concatenate([r.outline_xy for r in plan.rooms]).min(axis=0).tolist() == [0, 0]


def test_rooms_keep_the_thickness_of_their_walls() -> None:
    low, high = HomeConfig().inner_m
    for plan in plans():
        shapes = polygons(plan)
        building = Polygon(plan.outline_xy)
        for i, j in itertools.combinations(range(len(shapes)), 2):
            apart = shapes[i].distance(shapes[j])
            assert apart >= low - EPS
            assert apart <= high + EPS or not any({o.front, o.back} == {i, j} for o in plan.openings)
        core = building.buffer(-plan.outer_m, join_style="mitre")
        for shape in shapes:
            assert core.buffer(EPS).covers(shape)
            assert core.exterior.distance(shape) <= EPS or len(shapes) > 2
        assert 0.2 <= plan.outer_m <= 0.4
        assert 2.3 <= plan.height_m <= 3.2


def test_a_plan_has_the_rooms_of_its_programme_and_they_have_their_sizes() -> None:
    for i in range(HOMES):
        plan = home(i)
        assert tuple(r.room_type for r in plan.rooms) == PROGRAMMES[NAMES[i % len(NAMES)]]
        for r in plan.rooms:
            kind = ROOM_KINDS[r.room_type]
            sides = r.outline_xy.max(axis=0) - r.outline_xy.min(axis=0)
            assert sides.min() >= kind.side_m - EPS, r.room_type
            assert r.area_m2 >= 0.9 * kind.area_m2[0], r.room_type
            assert r.room_type == "corridor" or r.area_m2 <= 1.6 * kind.area_m2[1], f"{i} {r.room_type} {r.area_m2}"


def test_most_rooms_are_well_proportioned() -> None:
    ratios: dict[str, list[float]] = {}
    for i in range(HOMES):
        for r in home(i).rooms:
            sides = np.sort(r.outline_xy.max(axis=0) - r.outline_xy.min(axis=0))
            ratios.setdefault(r.room_type, []).append(sides[1] / sides[0] / ROOM_KINDS[r.room_type].slender)
    for kind, values in ratios.items():
        assert np.mean(np.array(values) <= 1.3) >= 0.9, kind


def test_single_rooms_have_their_shape() -> None:
    corners = {"rectangle": {4}, "l": {4, 6}, "t": {4, 8}, "niche": {4, 6, 8}}
    found: dict[str, list[int]] = {}
    for i in range(ROOMS):
        found.setdefault(SHAPES[i % len(SHAPES)], []).append(len(room(i).rooms[0].outline_xy))
    for shape, counts in found.items():
        assert set(counts) <= corners[shape]
        assert np.mean([n > 4 for n in counts]) >= (0.6 if shape != "rectangle" else 0.0)


def test_every_point_of_a_building_is_room_or_opening_or_one_piece_of_wall() -> None:
    rng = np.random.default_rng(2)
    for plan in plans(24, 16):
        shape = Polygon(plan.outline_xy)
        low, high = plan.outline_xy.min(axis=0), plan.outline_xy.max(axis=0)
        points = np.column_stack([rng.uniform(low, high, (4000, 2)), rng.uniform(0, plan.height_m, 4000)])
        points = points[shapely.contains_xy(shape, points[:, 0], points[:, 1])]
        count = np.sum([shapely.contains_xy(p, points[:, 0], points[:, 1]) for p in polygons(plan)], axis=0)
        for opening in plan.openings:
            tall = (opening.low_m < points[:, 2]) & (points[:, 2] < opening.high_m)
            count += tall & shapely.contains_xy(hole(plan, opening), points[:, 0], points[:, 1])
        cut = masonry(plan)
        for piece in cut.boxes:
            x0, y0, x1, y1 = np.array(piece.rect) / 1000
            below = points < [x1, y1, piece.high / 1000]
            count += (below & (points > [x0, y0, piece.low / 1000])).all(axis=1)
        assert (count == 1).all()
        area = sum((x1 - x0) * (y1 - y0) for own in cut.territories for x0, y0, x1, y1 in own) / 1e6
        assert area == pytest.approx(shape.area, abs=1e-9)


def test_each_room_owns_its_half_of_a_wall() -> None:
    for plan in plans(24, 16):
        cut = masonry(plan)
        shapes = polygons(plan)
        for piece in cut.boxes:
            rect = box(*(np.array(piece.rect) / 1000))
            for k, shape in enumerate(shapes):
                assert k == piece.room or rect.intersection(shape.exterior).length < EPS, "a face is its room's"
        for opening in (o for o in plan.openings if o.back != OUTSIDE):
            # Beside a doorway the wall is cut in the middle of its thickness.
            wall = plan.walls[opening.front][opening.wall]
            for share, owner in ((0.49, opening.front), (0.51, opening.back)):
                at = Point(wall.point(opening.middle_m + opening.width_m / 2 + 0.03, -share * opening.thickness_m))
                found = [b for b in cut.boxes if box(*(np.array(b.rect) / 1000)).contains(at)]
                assert [b.room for b in found] == [owner]


def test_openings_lie_apart_in_their_walls() -> None:
    for plan in plans():
        holes = [hole(plan, o) for o in plan.openings]
        for (i, a), (j, b) in itertools.combinations(enumerate(holes), 2):
            assert a.distance(b) > 0.02, (i, j)
        for gap in holes:
            assert all(gap.intersection(shape).area < EPS for shape in polygons(plan))
            assert Polygon(plan.outline_xy).buffer(EPS).covers(gap)


def test_windows_are_in_outer_walls_and_look_out() -> None:
    for plan in plans():
        for window in (o for o in plan.openings if o.kind == "window"):
            wall = plan.walls[window.front][window.wall]
            assert window.back == OUTSIDE
            assert window.low_m >= 0.8
            ray = LineString([wall.point(window.middle_m, -plan.outer_m - 0.01), wall.point(window.middle_m, -VIEW_M)])
            assert not ray.intersects(Polygon(plan.outline_xy))
            for end in (-0.5, 0.5):
                sill = Point(wall.point(window.middle_m + end * window.width_m, -plan.outer_m / 2))
                assert Polygon(plan.outline_xy).contains(sill)
    # Rooms where people live and work have daylight; a narrow kitchen may have all its outer wall behind doors.
    dark = [
        (i, r.room_type)
        for i in range(HOMES)
        for k, r in enumerate(home(i).rooms)
        if ROOM_KINDS[r.room_type].windows.count[0] > 0
        and not any(o.kind == "window" and o.front == k for o in home(i).openings)
    ]
    assert len(dark) <= HOMES // 20, dark


def test_every_room_is_reached_and_closed_off_where_it_should_be() -> None:
    for plan in plans():
        entrance = plan.openings[0]
        assert (entrance.kind, entrance.front, entrance.back, entrance.open_rad) == ("door", 0, OUTSIDE, 0.0)
        assert sum(o.back == OUTSIDE and o.kind != "window" for o in plan.openings) == 1
        ways = [o for o in plan.openings[1:] if o.kind != "window"]
        reached = {0}
        for _ in plan.rooms:
            reached |= {a for o in ways for a in (o.front, o.back) if reached & {o.front, o.back}}
        assert reached == set(range(len(plan.rooms)))
        for way in ways:
            types = {plan.rooms[i].room_type for i in (way.front, way.back)}
            assert (way.kind == "door") == (way.open_rad > 0)
            assert way.kind == "door" or not types & LEAVES
            if way.open_rad > 0:
                assert np.radians(75) <= way.open_rad <= np.radians(100) + EPS
        for i, r in enumerate(plan.rooms):
            through = [o for o in ways if i in (o.front, o.back)]
            assert r.room_type != "bathroom" or len(through) <= 1, "nobody walks through a bathroom"


def only(item: SceneObject, *starts: str) -> list[np.ndarray]:
    return [
        s.vertices for s, p in zip(item.solids, item.parts, strict=True) if p.name.startswith(starts)
    ]  # fmt: skip


@pytest.mark.parametrize("index", EVERY)
def test_leaves_stand_free_in_their_room(index: int) -> None:
    plan, scene = built(index)
    doors = [o for o in scene.objects if o.category_name in ("door", "passage")]
    ways = [o for o in plan.openings if o.kind != "window"]
    assert len(doors) == len(ways)
    for item, way in zip(doors, ways, strict=True):
        turn, at = item.scene_T_object[:2, :2], item.scene_T_object[:2, 3]
        front = Polygon(plan.rooms[way.front].outline_xy)
        assert front.exterior.distance(Point(at)) < EPS, "the origin is on the face of the wall in front"
        assert front.contains(Point(at - 0.05 * turn[:, 1]))
        beyond = Point(at + (way.thickness_m + 0.05) * turn[:, 1])
        if way.back == OUTSIDE:
            assert not Polygon(plan.outline_xy).contains(beyond)
        else:
            assert Polygon(plan.rooms[way.back].outline_xy).contains(beyond)
        jambs = [p.vertices[:, 0] for p in item.parts if p.name.startswith("jamb")]
        assert max(j.min() for j in jambs) - min(j.max() for j in jambs) >= CLEAR_M
        if way.open_rad == 0:
            continue
        leaf = Polygon(shapely.MultiPoint(np.concatenate(only(item, "door", "panel", "handle"))[:, :2]).convex_hull)
        assert front.buffer(2e-3).covers(leaf.difference(hole(plan, way))), "it stays in its room"
        solid = Polygon(shapely.MultiPoint(np.concatenate(only(item, "door", "panel"))[:, :2]).convex_hull)
        jamb = max((shapely.MultiPoint(v[:, :2]).convex_hull for v in only(item, "jamb")), key=solid.distance)
        assert solid.distance(jamb) >= CLEAR_M, "the way past it is wide"
        for other in scene.objects:
            if other is not item and other.category_name not in ("floor", "ceiling"):
                for part in other.solids:
                    if part.bounds[0, 2] < way.high_m - EPS and part.bounds[1, 2] > 0:
                        shape = shapely.MultiPoint(part.vertices[:, :2]).convex_hull
                        assert leaf.intersection(shape).area < 1e-4, other.category_name


@pytest.mark.parametrize("index", EVERY)
def test_a_body_passes_every_doorway(index: int) -> None:
    _, scene = built(index)
    walk = walk_map(scene, radius_m=BODY_M)
    ways = doorways(scene)
    assert len(ways) == sum(o.category_name in ("door", "passage") for o in scene.objects)
    for way in ways:
        if len(way.rooms) < 2:
            continue
        # Only cells near the doorway count: no way round through other rooms.
        near = np.linalg.norm(walk.centres() - way.feet.mean(axis=0), axis=-1) < 0.9
        local = WalkMap(walk.origin_xy, walk.free & near)
        ends = way.feet + 0.45 * way.inward
        reached = connected(local, ends[0])
        assert reached[tuple(local.index(ends[1:])[0][0])], f"object {way.object_id}"


@pytest.mark.parametrize("index", EVERY)
def test_no_leaf_cuts_a_room_in_two(index: int) -> None:
    _, scene = built(index)
    walk = walk_map(scene)
    labels, count = ndimage.label(walk.free)
    areas = np.bincount(labels.ravel())[1:] * walk.cell_m**2
    assert np.sort(areas)[:-1].sum() < 0.1, "the empty building is one floor"
    assert count >= 1


@pytest.mark.parametrize("index", EVERY)
def test_the_structure_of_an_empty_building(index: int) -> None:
    plan, scene = built(index)
    names = [o.category_name for o in scene.objects]
    walls = sum(len(w) for w in plan.walls)
    expected = ["floor"] * len(plan.rooms) + ["ceiling"] + ["wall"] * walls + [o.kind for o in plan.openings]
    assert names == expected
    assert [o.object_id for o in scene.objects] == list(range(1, len(names) + 1))
    switches = sum(p.role == "switch" for o in scene.objects for p in o.parts)
    assert switches == sum(len(plan.shell(i).switches) for i in range(len(plan.rooms)))
    assert switches >= len(plan.rooms) - 1
    objects = [o for o in scene.objects if o.category_name == "wall"]
    for item, wall in zip(objects, itertools.chain.from_iterable(plan.walls), strict=True):
        back = item.scene_T_object[:2, 1]
        assert np.allclose(back, -wall.inward, atol=1e-9)
        assert np.allclose(item.scene_T_object[:2, 3], wall.point(wall.length_m / 2, 0.0), atol=1e-4)
    for i in range(len(plan.rooms)):
        bounds = around_room(scene.objects, plan, i)
        assert sum(o.category_name == "wall" for o in bounds) == len(plan.walls[i])
        assert [o.category_name for o in bounds if o.category_name != "wall"] == [
            o.kind for o in plan.openings if i in (o.front, o.back)
        ]


@pytest.mark.parametrize("index", EVERY)
def test_no_ray_leaves_the_building(index: int) -> None:
    plan, scene = built(index)
    rng = np.random.default_rng(index)
    solids = [s for o in scene.objects for s in o.solids]
    packed = pack_solids(solids)
    seams = np.concatenate([s.vertices for s in solids])
    for i in range(len(plan.rooms)):
        # Off the lines of the plan: a ray within the plane of a joint is in neither of the pieces that meet there.
        middle = plan.shell(i).middle_xy + plan.shell(i).origin_xy + rng.uniform(0.001, 0.05, 2)
        start = np.array([*middle, rng.uniform(0.5, 1.9)])
        aim = np.concatenate([rng.normal(size=(600, 3)), seams[rng.permutation(len(seams))[:1500]] - start])
        aim /= np.linalg.norm(aim, axis=1, keepdims=True)
        aim = np.concatenate([aim, aim + rng.normal(scale=1e-4, size=aim.shape)])
        assert segments_blocked(start, start + 60.0 * aim, packed).all()


def bytes_of(plan: FloorPlan) -> list[bytes]:
    return [r.outline_xy.tobytes() for r in plan.rooms] + [repr((plan.openings, plan.height_m)).encode()]


def test_a_plan_is_a_function_of_its_seeds() -> None:
    config = HomeConfig()
    first = [bytes_of(draw_home_plan(Seeds(4).child(i), config)) for i in range(6)]
    again = [bytes_of(draw_home_plan(Seeds(4).child(i), config)) for i in reversed(range(6))]
    assert first == again[::-1]
    assert len({b"".join(b) for b in first}) == 6


def test_an_opening_beyond_its_wall_is_refused() -> None:
    plan = room(0)
    far = PlanOpening("window", 0, OUTSIDE, 0, 50.0, 1.0, 0.9, 2.0, plan.outer_m)
    with pytest.raises(SchemaError, match="within its wall"):
        FloorPlan(plan.rooms, (far,), plan.height_m, plan.outer_m, plan.outline_xy)
    tall = PlanOpening("window", 0, OUTSIDE, 0, 1.0, 1.0, 0.9, 5.0, plan.outer_m)
    with pytest.raises(SchemaError, match="floor and ceiling"):
        FloorPlan(plan.rooms, (tall,), plan.height_m, plan.outer_m, plan.outline_xy)


def test_doors_do_not_open_across_each_other() -> None:
    """The quarter disc that each leaf sweeps, the entrance's too, keeps from all other doorways; seldom it cannot."""
    met = []
    for i, plan in enumerate(plans()):
        doors = [o for o in plan.openings if o.kind == "door"]
        ways = [o for o in plan.openings if o.kind != "window"]
        for door, other in itertools.product(doors, ways):
            wall = plan.walls[door.front][door.wall]
            hinge = wall.point(door.middle_m - door.hinge * door.width_m / 2, 0.0)
            inside = Polygon(plan.rooms[door.front].outline_xy).buffer(0.01)
            swept = Point(*hinge).buffer(door.width_m).intersection(inside)
            if door is not other and swept.intersects(hole(plan, other).buffer(0.1)):
                met.append(i)
    assert len(set(met)) <= len(plans()) // 20, met


def test_impossible_homes_are_refused() -> None:
    with pytest.raises(SchemaError, match="palace"):
        HomeConfig(programmes=(("palace", 1.0),))
    with pytest.raises(SchemaError, match="inner_m"):
        HomeConfig(inner_m=(0.2, 0.1))


rects = st.lists(
    st.tuples(st.integers(0, 8), st.integers(0, 8), st.integers(1, 6), st.integers(1, 6)), min_size=1, max_size=6
).map(lambda found: [(10 * x, 10 * y, 10 * (x + w), 10 * (y + h)) for x, y, w, h in found])


@given(rects)
def test_regions_agree_with_shapely(found: list[tuple[int, int, int, int]]) -> None:
    union = shapely.union_all([box(*r) for r in found])
    lines = Lines.around(found)
    mask = lines.mask(found)
    for along_x in (True, False):
        pieces = [box(*r) for r in lines.rectangles(mask, along_x)]
        assert sum(p.area for p in pieces) == union.area
        assert shapely.union_all(pieces).equals(union)
    # Touching corners and holes have no single outline.
    if (
        isinstance(union, Polygon)
        and not union.interiors
        and union.buffer(-0.1, join_style="mitre").geom_type == "Polygon"
    ):
        outline = outline_of(found)
        assert Polygon(outline).equals(union)
        assert Polygon(outline).exterior.is_ccw
        assert len(outline) == len(union.simplify(0).normalize().exterior.coords) - 1 or len(outline) >= 4
        assert np.array_equal(inside(outline, lines), mask)
        assert sum(box(*r).area for r in rectangles_of(outline)) == union.area
