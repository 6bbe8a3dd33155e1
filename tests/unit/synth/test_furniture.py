"""Every builder in every family and size: valid solids, plausible shapes, and the frame all others rely on."""

from __future__ import annotations

import colorsys
import json
import math
import os
from functools import cache
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import MultiPoint, Polygon

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid
from hsbench.schema.categories import CATEGORIES, category
from hsbench.schema.scene import TEXTURES, Part, Room, Scene, SceneObject
from hsbench.synth.furniture import (
    BUILDERS,
    COMMON_FAMILIES,
    FAMILIES,
    HANGING,
    MOVABLE,
    NOVEL_FAMILIES,
    SIZES,
    WALL_HUNG,
    build,
    door,
    family,
    kitchen_counter_of,
    passage,
    wall_cabinet_of,
    window,
)
from hsbench.synth.furniture.openings import JAMB_M, LEAF_M
from hsbench.synth.furniture.shapes import bar, loft, oval_outline, rounded_outline
from hsbench.synth.furniture.sizes import DEVIATIONS, REAL, Size
from hsbench.synth.furniture.style import Style
from hsbench.synth.seeds import Seeds
from hsbench.truth.obstacles import pack_obstacles
from hsbench.truth.sittable import seat_uses
from hsbench.truth.walkable import walk_map

FITS = (0.0, 1.0)
DRAWS = 2
CASES = [(kind, name) for kind in BUILDERS for name in FAMILIES]
THINNEST_M = 0.01
JOINT_M = 0.01
"""Parts of one object are connected over gaps up to this, and go into each other no deeper, but for:"""
GROWN = {"plant": ("stem", "leaf", "soil", "pot"), "books": ("pages",), "clutter": ("pages",)}
"""leaves where they sprout, and the pages of a book between its covers."""
MOST_PARTS, MEDIAN_PARTS, MOST_TRIANGLES = 60, 20, 1500
NOT_MEASURED = ("handle", "tap", "spout", "column", "pipe", "mount", "stem", "lever", "flower", "soap", "pump", "brush",
                "tumbler")  # fmt: skip
"""What the ranges of sizes leave out (plants and radiators are measured whole)."""
REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[4] / "shared" / "realdata"))
REAL_SIZES = REALDATA / "scenes3d" / "procthor" / "asset-database.json"
SEATS = ("sofa", "armchair", "chair", "office_chair", "stool", "bench", "ottoman", "toilet", "bar_stool")


@cache
def variants(kind: str, name: str) -> tuple[tuple[Part, ...], ...]:
    style = family(name)
    return tuple(build(kind, Seeds(7).child(kind).rng(i), style, fit) for i, fit in product(range(DRAWS), FITS))


def solid(part: Part) -> ConvexSolid:
    assert part.solid is not None
    return part.solid


def bounds(parts: tuple[Part, ...]) -> tuple[np.ndarray, np.ndarray]:
    points = np.concatenate([p.vertices for p in parts])
    return points.min(axis=0), points.max(axis=0)


def stem(part: Part) -> str:
    """The name without its number."""
    return part.name.rstrip("0123456789").rstrip("_")


def thickness(part: Part) -> float:
    """Least extent of a part along a face normal."""
    along = part.vertices @ solid(part).planes[:, :3].T
    return float((along.max(axis=0) - along.min(axis=0)).min())


def edges(item: ConvexSolid) -> np.ndarray:
    """Directions of the edges, each once."""
    t = item.triangles
    ends = np.unique(np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1), axis=0)
    along = item.vertices[ends[:, 1]] - item.vertices[ends[:, 0]]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    along *= np.sign(along[np.arange(len(along)), np.abs(along).argmax(axis=1)])[:, None]
    return np.unique(along.round(6), axis=0)


def separation(a: ConvexSolid, b: ConvexSolid) -> float:
    """Separating-axis distance: the gap along the best axis, or minus the depth of penetration (exact)."""

    def along(axes: np.ndarray) -> float:
        p, q = a.vertices @ axes.T, b.vertices @ axes.T
        return float(np.maximum(p.min(axis=0) - q.max(axis=0), q.min(axis=0) - p.max(axis=0)).max())

    best = along(np.concatenate([a.planes[:, :3], b.planes[:, :3]]))
    if best < -JOINT_M:  # only then do the axes across two edges matter
        axes = np.cross(edges(a)[:, None], edges(b)[None]).reshape(-1, 3)
        length = np.linalg.norm(axes, axis=1)
        if (length > 1e-3).any():
            best = max(best, along(axes[length > 1e-3] / length[length > 1e-3, None]))
    return best


def near_pairs(parts: tuple[Part, ...], gap: float) -> list[tuple[int, int]]:
    boxes = np.stack([solid(p).bounds for p in parts])
    apart = (boxes[:, None, 0] > boxes[None, :, 1] + gap).any(axis=-1)
    near = ~(apart | apart.T)
    return [(i, j) for i, j in combinations(range(len(parts)), 2) if near[i, j]]


def shared_face_m2(a: ConvexSolid, b: ConvexSolid) -> float:
    """Area over which faces of two solids look the same way in one plane: what would flicker in a picture."""
    same = (a.planes[:, :3] @ b.planes[:, :3].T > 0.9999) & (np.abs(a.planes[:, None, 3] - b.planes[None, :, 3]) < 4e-4)
    same &= ~((a.planes[:, 2] < -0.99) & (np.abs(a.planes[:, 3]) < 1e-9))[:, None]  # nobody sees what is on the floor
    area = 0.0
    for i, j in zip(*np.nonzero(same), strict=True):
        keep = np.delete(np.arange(3), np.abs(a.planes[i, :3]).argmax())
        faces = []
        for item, plane in ((a, a.planes[i]), (b, b.planes[j])):
            on = np.abs(item.vertices @ plane[:3] - plane[3]) < 1e-4
            faces.append(MultiPoint(item.vertices[on][:, keep]).convex_hull)
        area += faces[0].intersection(faces[1]).area
    return float(area)


def check_joints(kind: str, parts: tuple[Part, ...]) -> None:
    """One connected object, no part deep inside another, no two colours in one plane."""
    links: dict[int, set[int]] = {i: {i} for i in range(len(parts))}
    for i, j in near_pairs(parts, JOINT_M + 1e-6):
        a, b = parts[i], parts[j]
        gap = separation(solid(a), solid(b))
        if gap <= JOINT_M + 1e-6:
            links[i].add(j)
            links[j].add(i)
        grown = {stem(a), stem(b)} & set(GROWN.get(kind, ()))
        assert gap >= -JOINT_M * 1.3 or grown, (kind, a.name, b.name, gap)
        if (a.colour, a.texture) != (b.colour, b.texture):
            assert shared_face_m2(solid(a), solid(b)) < 1e-4, (kind, a.name, b.name)
    seen, todo = {0}, [0]
    while todo:
        for other in links[todo.pop()] - seen:
            seen.add(other)
            todo.append(other)
    assert len(seen) == len(parts), (kind, [parts[i].name for i in set(links) - seen])


def test_every_category_to_furnish_with_has_a_builder_and_a_size() -> None:
    wanted = {c.name for c in CATEGORIES if c.group in ("furniture", "fixture", "soft", "clutter")}
    assert set(BUILDERS) == set(SIZES) == wanted
    assert wanted >= MOVABLE | WALL_HUNG | HANGING


@pytest.mark.parametrize("kind", BUILDERS)
def test_contract_of_every_builder(kind: str) -> None:
    for name in FAMILIES:
        for parts in variants(kind, name):
            SceneObject(1, kind, np.eye(4), parts)  # refuses roles that the category does not have
            low, high = bounds(parts)
            assert np.abs((low + high)[:2] / 2).max() <= 1e-4, "the origin is the middle of the footprint"
            if kind in HANGING:
                assert high[2] == 0.0
            else:
                assert low[2] > 0.01 if kind in WALL_HUNG else low[2] == 0.0
            assert len({p.name for p in parts}) == len(parts) <= MOST_PARTS
            assert sum(len(p.triangles) for p in parts) <= MOST_TRIANGLES
            for part in parts:
                assert thickness(part) >= THINNEST_M - 1e-6, part.name
                assert part.name.isidentifier()
                assert not part.texture or part.texture in TEXTURES
                heights = part.vertices[:, 2][[part.vertices[:, 2].argmin(), part.vertices[:, 2].argmax()]]
                assert np.isfinite(heights).all()


@pytest.mark.parametrize("kind", BUILDERS)
def test_parts_are_closed_convex_solids(kind: str) -> None:
    for name in FAMILIES:
        for part in variants(kind, name)[1]:
            solid(part).check()


@pytest.mark.parametrize("kind", BUILDERS)
def test_objects_are_connected_and_do_not_run_through_themselves(kind: str) -> None:
    names = list(FAMILIES)
    first = list(BUILDERS).index(kind)
    for i in range(3):
        check_joints(kind, variants(kind, names[(first + 3 * i) % len(names)])[i])


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "name"), CASES)
def test_objects_are_connected_in_every_family(kind: str, name: str) -> None:
    for i, fit in product(range(8), (0.0, 0.5, 1.0)):
        check_joints(kind, build(kind, Seeds(8).child(kind).rng(i), family(name), fit))


def test_half_of_all_objects_have_few_parts() -> None:
    assert np.median([len(parts) for kind in BUILDERS for parts in variants(kind, "nordic")]) <= MEDIAN_PARTS


@pytest.mark.parametrize("kind", BUILDERS)
def test_builders_are_functions_of_their_stream(kind: str) -> None:
    style = family("nordic")
    first, second = (build(kind, Seeds(0).rng("x"), style) for _ in range(2))
    assert [(p.name, p.colour, p.texture, p.role) for p in first] == [
        (p.name, p.colour, p.texture, p.role) for p in second
    ]
    for a, b in zip(first, second, strict=True):
        assert a.vertices.tobytes() == b.vertices.tobytes()
    drawn = [build(kind, Seeds(s).rng("x"), style) for s in range(6)]
    assert len({tuple((p.colour, p.vertices.tobytes()) for p in parts) for parts in drawn}) >= 3


@pytest.mark.parametrize("kind", BUILDERS)
def test_lengths_are_quantised(kind: str) -> None:
    """Upright blocks have their corners on the .1 mm grid (trigonometry is rounded to 12 decimals elsewhere)."""
    for parts in variants(kind, "classic"):
        for part in parts:
            normals = np.abs(solid(part).planes[:, :3])
            if len(normals) == 6 and (normals.max(axis=1) == 1.0).all():
                values = part.vertices * 1e4
                assert np.abs(values - np.round(values)).max() < 1e-5, part.name


def measured(kind: str, parts: tuple[Part, ...]) -> np.ndarray:
    """(3,) size of an object without what its range leaves out."""
    whole = kind in ("plant", "radiator")
    low, high = bounds(tuple(p for p in parts if whole or stem(p) not in NOT_MEASURED))
    return high - low


def ranges(size: Size) -> np.ndarray:
    """(3, 2) ranges of width, depth and height."""
    return np.array([size.width_m, size.depth_m, size.height_m])


@pytest.mark.parametrize("kind", BUILDERS)
def test_sizes_are_in_their_ranges(kind: str) -> None:
    low, high = ranges(SIZES[kind]).T
    for name in FAMILIES:
        for parts in variants(kind, name):
            found = measured(kind, parts)
            assert (found >= low - 2e-4).all(), (name, found)
            assert (found <= high + 2e-4).all(), (name, found)


@pytest.mark.parametrize("kind", ["sofa", "chair", "bed", "wardrobe", "dining_table", "rug", "bookshelf", "desk"])
def test_a_smaller_fit_is_not_larger(kind: str) -> None:
    for name, i in product(FAMILIES, range(6)):
        small, medium, large = (
            measured(kind, build(kind, Seeds(3).rng(i), family(name), fit))[0] for fit in (0.0, 0.5, 1.0)
        )
        assert small <= medium + 1e-9 <= large + 2e-9


@pytest.mark.skipif(not REAL_SIZES.exists(), reason="sizes of the ProcTHOR assets are not on this machine")
def test_sizes_overlap_those_of_real_data() -> None:
    assets = json.loads(REAL_SIZES.read_text())
    for kind, real in REAL.items():
        sizes = np.array([[a["boundingBox"][axis] for axis in "xzy"] for a in assets[real] if a.get("boundingBox")])
        low, high = np.percentile(sizes, (5, 95), axis=0)
        drawn = [build(kind, Seeds(6).child(kind).rng(i), family(COMMON_FAMILIES[i % 6])) for i in range(30)]
        found = np.array([measured(kind, parts) for parts in drawn])
        apart = np.maximum(found.min(axis=0) - high, low - found.max(axis=0))
        assert (apart <= 0.02).all() or kind in DEVIATIONS, (kind, real, apart)
        assert len(sizes) > 1


@pytest.mark.parametrize("kind", SEATS)
def test_seats_can_be_sat_on(kind: str) -> None:
    for name in FAMILIES:
        for parts in variants(kind, name):
            low, _ = bounds(parts)
            seats = [p for p in parts if p.role == "seat"]
            assert seats
            for seat in seats:
                (x0, y0, _), (x1, y1, z1) = seat.vertices.min(axis=0), seat.vertices.max(axis=0)
                assert (0.60 <= z1 <= 0.75) if kind == "bar_stool" else (0.40 <= z1 <= 0.48)
                level = seat.vertices[seat.vertices[:, 2] > z1 - 1e-6]
                assert len(level) >= 4, "the top is level"
                assert min(x1 - x0, y1 - y0) >= 0.35
                assert y0 <= low[1] + 0.12, "the seat's front is the object's front"
                # Nothing of the object fills the .35 x .35 m in front of the seat, nor the body above its front part.
                middle = (x0 + x1) / 2
                for other in parts:
                    (a0, b0, c0), (a1, _, c1) = other.vertices.min(axis=0), other.vertices.max(axis=0)
                    across = min(a1, middle + 0.17) - max(a0, middle - 0.17)
                    if c0 >= z1 - 0.01 and other is not seat:
                        assert across <= 1e-6 or b0 >= y0 + 0.33, other.name
                    if c1 > 0.1 and c0 < z1:
                        assert b0 >= y0 - 0.1, other.name


def test_a_sofa_has_a_seat_for_every_place() -> None:
    counts = set()
    for i in range(12):
        parts = build("sofa", Seeds(2).rng(i), family("modern"))
        counts.add(sum(p.role == "seat" for p in parts))
    assert counts == {2, 3}


@pytest.mark.parametrize(
    ("kind", "low", "high"),
    [("dining_table", 0.70, 0.77), ("desk", 0.70, 0.77), ("coffee_table", 0.34, 0.46), ("meeting_table", 0.70, 0.77)],
)
def test_tops_have_their_height_and_free_space_below(kind: str, low: float, high: float) -> None:
    for name in FAMILIES:
        for parts in variants(kind, name):
            top = max(p.vertices[:, 2].max() for p in parts if p.role == "top")
            assert low <= top <= high
            if kind != "coffee_table":
                a, b = bounds(parts)
                grid = np.stack(np.meshgrid(*(np.linspace(a[i] + 0.01, b[i] - 0.01, 24) for i in (0, 1))), axis=-1)
                knees = np.concatenate([grid.reshape(-1, 2), np.full((576, 1), 0.3)], axis=1)
                assert filled(parts, knees).mean() < 0.45


def filled(parts: tuple[Part, ...], points: np.ndarray) -> np.ndarray:
    return np.asarray(np.any([solid(p).contains(points) for p in parts], axis=0))


CUPBOARDS = ("wardrobe", "sideboard", "dresser", "tv_stand", "fridge", "filing_cabinet", "shoe_cabinet")


@pytest.mark.parametrize("kind", CUPBOARDS)
def test_cupboards_are_solid_and_open_to_the_front(kind: str) -> None:
    for name in FAMILIES:
        for parts in variants(kind, name):
            low, high = bounds(parts)
            grid = [np.linspace(low[i] + 0.06, high[i] - 0.05, 9) for i in range(2)]
            z = np.linspace(0.22, high[2] - 0.04, 7)
            points = np.stack(np.meshgrid(*grid, z), axis=-1).reshape(-1, 3)
            assert filled(parts, points).mean() > 0.85
            opened = [p for p in parts if p.role in ("door", "drawer", "front")]
            assert opened
            assert all(p.vertices[:, 1].mean() < low[1] + 0.08 for p in opened)
            assert sum(p.role == "handle" for p in parts) == len(opened)


def test_shelves_are_free_inside() -> None:
    for parts in variants("bookshelf", "rustic"):
        low, high = bounds(parts)
        points = np.array([[0.0, low[1] + 0.05, z] for z in np.linspace(0.1, high[2] - 0.05, 40)])
        assert filled(parts, points).mean() < 0.3
        assert sum(p.role == "shelf" for p in parts) >= 4


@pytest.mark.parametrize(
    ("kind", "share", "below_m"),
    [("bathtub", 0.35, 0.15), ("washbasin", 0.2, 0.03), ("kitchen_counter", 0.02, 0.05), ("bowl", 0.3, 0.01)],
)
def test_basins_are_hollow(kind: str, share: float, below_m: float) -> None:
    """From above one looks past the rim: over enough of the footprint the topmost matter lies lower than the rim."""
    for name in FAMILIES:
        for parts in variants(kind, name):
            body = tuple(p for p in parts if stem(p) not in (*NOT_MEASURED, "fruit"))
            low, high = bounds(body)
            grid = np.stack(np.meshgrid(*(np.linspace(low[i], high[i], 25)[1:-1] for i in (0, 1))), axis=-1)
            rim = high[2] - 0.06 if kind == "kitchen_counter" else high[2]
            points = np.concatenate([grid.reshape(-1, 2), np.full((23 * 23, 1), rim - below_m)], axis=1)
            inside = MultiPoint(np.concatenate([p.vertices[:, :2] for p in body])).convex_hull
            within = np.array([inside.contains(MultiPoint([p[:2]]).geoms[0]) for p in points])
            assert (~filled(body, points[within])).mean() >= share, name


@pytest.mark.parametrize("kind", ["television", "monitor", "laptop"])
def test_screens_face_the_front(kind: str) -> None:
    for parts in variants(kind, "modern"):
        (screen,) = [p for p in parts if p.role == "screen"]
        planes = solid(screen).planes
        front = planes[planes[:, :3].argmin(axis=0)[1]]
        others = np.concatenate([p.vertices for p in parts if p is not screen and stem(p) in ("case", "lid", "back")])
        assert (others @ front[:3] < front[3]).all(), "the screen stands before what carries it"


def test_a_duvet_is_lain_upon() -> None:
    for kind, name in product(("bed", "bunk_bed"), FAMILIES):
        for parts in variants(kind, name):
            lain = [p for p in parts if p.role == "mattress"]
            width = measured(kind, parts)[0]
            assert len(lain) == (2 if kind == "bunk_bed" or width > 1.4 else 1)
            tops = [p.vertices[:, 2].max() for p in lain]
            assert 0.42 <= min(tops) <= 0.62
            for part in lain:
                size = np.ptp(part.vertices, axis=0)
                assert size[0] >= 0.68
                assert size[1] >= 1.4


class TestKitchenLine:
    """Units of one room stand side by side with flush fronts and tops."""

    STYLES = tuple(family(n).for_room(Seeds(1).rng(n)) for n in FAMILIES)

    @pytest.mark.parametrize("style", STYLES, ids=[s.name for s in STYLES])
    def test_tops_and_fronts_are_flush(self, style: Style) -> None:
        rng = Seeds(4).rng("line")
        units = [
            build("kitchen_counter", rng, style),
            kitchen_counter_of(rng, style, 0.8),
            build("dishwasher", rng, style),
        ]
        tops = [[p for p in parts if p.role == "top"] for parts in units]
        machine = build("washing_machine", rng, style)
        stove = build("stove", rng, style)
        heights = {round(float(p.vertices[:, 2].max()), 4) for found in tops for p in found}
        heights |= {round(float(p.vertices[:, 2].max()), 4) for p in machine if p.role == "top"}
        assert len(heights) == 1
        (height,) = heights
        assert max(p.vertices[:, 2].max() for p in stove if p.name == "top") == pytest.approx(height, abs=0.013)
        assert len({(p.colour, p.texture) for found in tops for p in found}) == 1
        back = [bounds(parts)[1][1] for parts in (*units, stove)]
        fronts = [min(p.vertices[:, 1].min() for p in found) - y for found, y in zip(tops, back, strict=False)]
        assert np.ptp(fronts) < 1e-9

    def test_cabinets_hang_at_one_height(self) -> None:
        style = self.STYLES[0]
        found = [bounds(wall_cabinet_of(Seeds(i).rng("x"), style, 0.5 + 0.2 * i)) for i in range(4)]
        assert len({(low[2], high[2]) for low, high in found}) == 1
        assert found[0][0][2] - style.worktop_m[0] >= 0.45

    @settings(max_examples=40)
    @given(width_mm=st.integers(1200, 3600), sink=st.booleans(), hob=st.booleans(), seed=st.integers(0, 99))
    def test_a_counter_has_the_width_asked_for(self, width_mm: int, sink: bool, hob: bool, seed: int) -> None:
        parts = kitchen_counter_of(Seeds(seed).rng("x"), self.STYLES[2], width_mm / 1000, sink, hob)
        assert len(parts) <= MOST_PARTS
        low, high = bounds(tuple(p for p in parts if p.role != "handle"))
        assert high[0] - low[0] == pytest.approx(width_mm / 1000, abs=1e-4)
        assert any(p.role == "tap" for p in parts) == sink
        assert any(p.name == "hob" for p in parts) == hob
        for part in (p for p in parts if p.role in ("door", "drawer")):
            assert part.vertices[:, 0].max() <= high[0] + 1e-9

    def test_too_narrow_a_counter_is_refused(self) -> None:
        with pytest.raises(SchemaError, match=r"at least 1\.20"):
            kitchen_counter_of(Seeds(0).rng("x"), self.STYLES[0], 1.1, sink=True, hob=True)


class TestOpenings:
    """Doors, passages and windows in a hole of .9 x 2.05 m (or 1.2 x 1.2 m) of a wall."""

    @pytest.mark.parametrize("name", FAMILIES)
    def test_doors_and_windows_close_their_opening(self, name: str) -> None:
        style = family(name)
        for i in range(2):
            rng = Seeds(3).rng(i)
            leaf = door(rng, style, 0.9, 2.05, 0.15)
            pane = window(rng, style, 1.2, 0.9, 1.2, 0.15)
            for parts, z0, z1, half in ((leaf, 0.0, 2.05, 0.45), (pane, 0.9, 2.1, 0.6)):
                for part in parts:
                    solid(part).check()
                    assert thickness(part) >= THINNEST_M - 1e-9, part.name
                # A line through the opening along y meets a part wherever it goes.
                x, z = np.meshgrid(np.linspace(-half, half, 43), np.linspace(z0, z1, 43))
                y = np.arange(0.0025, 0.15, 0.005)
                lines = np.stack(np.broadcast_arrays(x[..., None], y, z[..., None]), axis=-1)
                closed = np.any([solid(p).contains(lines, -1e-9).any(axis=-1) for p in parts], axis=0)
                assert closed.all()

    @settings(max_examples=30)
    @given(
        name=st.sampled_from(list(FAMILIES)), hinge=st.sampled_from((-1, 1)), degrees=st.floats(40, 110),
        width_mm=st.integers(780, 1000), thick_mm=st.integers(100, 400),
    )  # fmt: skip
    def test_an_open_leaf_stands_clear(
        self, name: str, hinge: int, degrees: float, width_mm: int, thick_mm: int
    ) -> None:
        width, thick = width_mm / 1000, thick_mm / 1000
        parts = door(Seeds(5).rng("x"), family(name), width, 2.05, thick, math.radians(degrees), hinge)
        SceneObject(1, "door", np.eye(4), parts)
        frame = [p for p in parts if stem(p) in ("jamb", "head", "casing")]
        leaf = [p for p in parts if p not in frame]
        for a, b in product(frame, leaf):
            assert separation(solid(a), solid(b)) >= -JOINT_M, (a.name, b.name)
        for part in leaf:
            solid(part).check()
        (panel,) = [p for p in leaf if p.role == "door"]
        middle = panel.vertices.mean(axis=0)
        assert middle[1] < 0, "into the room in front"
        assert middle[0] * hinge > 0
        if degrees >= 85 and width >= 0.84:
            # A body .6 m wide passes between the jambs and past the leaf.
            inner = width / 2 - JAMB_M
            through = Polygon([(-hinge * inner, -0.5), (-hinge * inner, thick), (hinge * (0.6 - inner), thick),
                               (hinge * (0.6 - inner), -0.5)])  # fmt: skip
            assert through.intersection(MultiPoint(panel.vertices[:, :2]).convex_hull).area < 1e-9

    def test_opening_turns_the_leaf_and_nothing_else(self) -> None:
        shut, ajar = (door(Seeds(1).rng("x"), family("rustic"), 0.9, 2.05, 0.15, a, 1) for a in (0.0, math.pi / 2))
        for a, b in zip(shut, ajar, strict=True):
            assert (a.name, a.role, a.colour) == (b.name, b.role, b.colour)
            x, y, z = a.vertices.T
            inner = 0.45 - JAMB_M
            turned = (
                a.vertices if stem(a) in ("jamb", "head", "casing") else np.stack([inner - y, x - inner, z], axis=1)
            )
            assert np.abs(turned - b.vertices).max() < 1e-9

    def test_handles_on_both_sides(self) -> None:
        parts = door(Seeds(1).rng("x"), family("modern"), 0.9, 2.05, 0.15)
        grips = [p.vertices[:, 1].mean() for p in parts if p.role == "handle"]
        assert len(grips) == 2
        assert min(grips) < 0 < LEAF_M < max(grips)

    def test_a_passage_is_free(self) -> None:
        parts = passage(Seeds(1).rng("x"), family("modern"), 0.9, 2.05, 0.15)
        SceneObject(1, "passage", np.eye(4), parts)
        points = np.stack(
            np.meshgrid(np.linspace(-0.41, 0.41, 9), np.linspace(-0.5, 0.6, 20), [0.02, 1.0, 2.0]), axis=-1
        )
        assert not filled(parts, points).any()

    @pytest.mark.parametrize(("angle", "hinge"), [(-0.1, 1), (2.2, 1), (0.5, 0)])
    def test_other_angles_and_hinges_are_refused(self, angle: float, hinge: int) -> None:
        with pytest.raises(SchemaError, match="expected"):
            door(Seeds(1).rng("x"), family("modern"), 0.9, 2.05, 0.15, angle, hinge)


class TestShapes:
    """Outlines and lofts against closed forms."""

    @given(
        half=st.tuples(st.integers(200, 9000), st.integers(200, 9000)),
        radius=st.integers(1, 199),
        steps=st.integers(1, 6),
    )
    def test_rounded_outline_against_its_area(self, half: tuple[int, int], radius: int, steps: int) -> None:
        x, y, r = (v / 1e4 for v in (*half, radius))
        outline = rounded_outline((-x, -y, x, y), r, steps)
        sector = steps * math.sin(math.pi / 2 / steps) / 2  # of the polygon in a quarter of the unit circle
        assert Polygon(outline).area == pytest.approx(4 * x * y - 4 * r**2 * (1 - sector), rel=1e-9)
        assert Polygon(outline).exterior.is_ccw
        assert np.abs(outline).max(axis=0) == pytest.approx([x, y])

    def test_loft_against_the_volume_of_a_frustum(self) -> None:
        outline = oval_outline(0.2, 0.1, 12)
        area = Polygon(outline).area
        tapered = loft([outline, outline * 0.5], [0.0, 0.3])
        assert tapered.volume_m3 == pytest.approx(0.3 * area * (1 + 0.25 + 0.5) / 3)
        tapered.check()

    @given(end=st.tuples(*[st.integers(-3000, 3000)] * 3).filter(any))
    def test_bar_keeps_volume_and_ends(self, end: tuple[int, int, int]) -> None:
        start, tip = (0.1, -0.2, 0.3), tuple(a + v / 1e4 for a, v in zip((0.1, -0.2, 0.3), end, strict=True))
        length = math.dist(start, tip)
        outline = oval_outline(0.01, 0.02, 8)
        item = bar(start, tip, outline)  # type: ignore[arg-type]
        item.check()
        assert item.volume_m3 == pytest.approx(length * Polygon(outline).area, rel=1e-3)
        ends = item.vertices.reshape(2, 8, 3).mean(axis=1)
        assert np.abs(ends - np.array([start, tip])).max() < 1e-4


def test_novel_families_share_nothing_with_common_ones() -> None:
    common, novel = [family(n) for n in COMMON_FAMILIES], [family(n) for n in NOVEL_FAMILIES]
    assert len(common) >= 6
    assert len(novel) >= 2
    for palette in ("woods", "fabrics", "walls", "floors", "paints", "accents"):
        known = {colour for style in common for colour in getattr(style, palette)}
        assert all(known.isdisjoint(getattr(style, palette)) for style in novel)
    fields = [f for f in vars(common[0]) if f.endswith("_textures")]
    shown = [{t for style in group for f in fields for t in getattr(style, f)} - {""} for group in (common, novel)]
    assert shown[0].isdisjoint(shown[1])
    assert shown[0] | shown[1] == TEXTURES - {""}
    for style in novel:
        legs = [(s.leg, s.leg_taper, s.leg_splay_m) for s in (style, *common)]
        assert legs[0] not in legs[1:]
        assert all(style.back_lean_m[0] >= s.back_lean_m[1] for s in common)


def test_parts_show_only_textures_of_their_family() -> None:
    for name, style in FAMILIES.items():
        own = {t for f in vars(style) if f.endswith("_textures") for t in getattr(style, f)} | {""}
        shown = {p.texture for kind in BUILDERS for parts in variants(kind, name) for p in parts}
        assert shown <= own
        assert shown != {""}


def test_palettes_are_muted() -> None:
    for style in FAMILIES.values():
        for palette in (style.walls, style.floors, style.woods):
            for r, g, b in palette:
                assert colorsys.rgb_to_hsv(r / 255, g / 255, b / 255)[1] < 0.75


def test_a_room_uses_few_colours_of_its_family() -> None:
    style = family("retro").for_room(Seeds(0).rng("room"))
    assert (len(style.woods), len(style.walls), len(style.metals)) == (2, 1, 1)
    assert set(style.woods) <= set(family("retro").woods)
    assert style.worktop_m[0] == style.worktop_m[1]


def test_unknown_names_are_refused() -> None:
    with pytest.raises(SchemaError, match="throne"):
        build("throne", Seeds(0).rng("x"), family("nordic"))
    with pytest.raises(SchemaError, match="baroque"):
        family("baroque")


def test_groups_of_the_builders() -> None:
    assert {category(kind).group for kind in BUILDERS} == {"furniture", "fixture", "soft", "clutter"}


@pytest.mark.parametrize("kind", ["bar_stool", "toilet", "bench", "chair", "office_chair", "stool", "armchair"])
def test_seats_hold_a_body_where_nothing_else_is(kind: str) -> None:
    room = Room("living", np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]))
    middle = np.eye(4)
    middle[:2, 3] = 2.0
    for k, name in enumerate(FAMILIES):
        for fit in (0.0, 1.0):
            parts = build(kind, Seeds(k).rng("seat"), family(name), fit)
            scene = Scene("seat", (room,), 2.5, (SceneObject(1, kind, middle, parts),))
            used = {use.part_index for use in seat_uses(scene, walk_map(scene), pack_obstacles(scene))}
            assert used == {i for i, p in enumerate(parts) if p.role == "seat"}, (kind, name, fit)
