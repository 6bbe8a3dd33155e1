"""Every builder in every family and size: valid solids, plausible shapes, and the frame all others rely on."""

from __future__ import annotations

import colorsys
from itertools import product

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.schema.categories import category
from hsbench.schema.scene import Part
from hsbench.synth.furniture import BUILDERS, COMMON_FAMILIES, FAMILIES, NOVEL_FAMILIES, WALL_HUNG, build, door, window
from hsbench.synth.furniture.style import family
from hsbench.synth.seeds import Seeds

FITS = (0.0, 0.5, 1.0)
DRAWS = 6
CASES = [(kind, name) for kind in BUILDERS for name in FAMILIES]


def variants(kind: str, name: str) -> list[tuple[Part, ...]]:
    style = family(name)
    return [build(kind, Seeds(7).child(kind).rng(i), style, fit) for i, fit in product(range(DRAWS), FITS)]


def bounds(parts: tuple[Part, ...]) -> tuple[np.ndarray, np.ndarray]:
    points = np.concatenate([p.vertices for p in parts])
    return points.min(axis=0), points.max(axis=0)


def thickness(part: Part) -> float:
    """Least extent of a part along a face normal."""
    assert part.solid is not None
    along = part.solid.vertices @ part.solid.planes[:, :3].T
    return float((along.max(axis=0) - along.min(axis=0)).min())


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_contract_of_every_builder(kind: str, name: str) -> None:
    assert category(kind).group in ("furniture", "soft", "clutter")
    for parts in variants(kind, name):
        low, high = bounds(parts)
        for part in parts:
            assert part.solid is not None
            part.solid.check()
            assert thickness(part) >= 0.01 - 1e-9, part.name
            assert part.name.isidentifier()
        assert np.abs((low + high)[:2] / 2).max() <= 1e-4, "the origin is the middle of the footprint"
        assert (low[2] > 0.01) if kind in WALL_HUNG else (low[2] == 0.0)
        assert (high - low).max() < 3.0


@pytest.mark.parametrize("kind", BUILDERS)
def test_builders_are_functions_of_their_stream(kind: str) -> None:
    style = family("nordic")
    first, second, other = (build(kind, Seeds(s).rng("x"), style) for s in (0, 0, 1))
    assert [p.colour for p in first] == [p.colour for p in second]
    for a, b in zip(first, second, strict=True):
        assert a.vertices.tobytes() == b.vertices.tobytes()
    described = [[(p.colour, p.vertices.tobytes()) for p in parts] for parts in (first, other)]
    assert described[0] != described[1]


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_lengths_are_quantised(kind: str, name: str) -> None:
    """Blocks have corners on the .1 mm grid; every solid begins and ends there in height."""
    for parts in variants(kind, name)[:4]:
        for part in parts:
            values = part.vertices if len(part.vertices) == 8 and part.name != "leg" else part.vertices[:, 2]
            assert np.abs(values * 1e4 - np.round(values * 1e4)).max() < 1e-6, part.name


@pytest.mark.parametrize("kind", ["sofa", "armchair", "chair", "office_chair", "stool", "bench"])
def test_seats_can_be_sat_on(kind: str) -> None:
    for name in FAMILIES:
        for parts in variants(kind, name):
            low, _ = bounds(parts)
            seats = [p for p in parts if p.role == "seat"]
            assert seats
            for seat in seats:
                (x0, y0, _), (x1, y1, z1) = seat.vertices.min(axis=0), seat.vertices.max(axis=0)
                assert 0.40 <= z1 <= 0.48
                assert min(x1 - x0, y1 - y0) >= 0.35
                assert y0 <= low[1] + 0.12, "the seat's front is the object's front"
                # Nothing of the object fills the .35 x .35 m in front of the seat, nor the body above its front part.
                middle = (x0 + x1) / 2
                for other in parts:
                    (a0, b0, c0), (a1, _, c1) = other.vertices.min(axis=0), other.vertices.max(axis=0)
                    across = min(a1, middle + 0.17) - max(a0, middle - 0.17)
                    if c0 >= z1 - 1e-6:
                        assert across <= 1e-6 or b0 >= y0 + 0.33, other.name
                    if c1 > 0.1 and c0 < z1:
                        assert b0 >= y0 - 0.1, other.name


@pytest.mark.parametrize(
    ("kind", "low", "high"), [("dining_table", 0.70, 0.76), ("desk", 0.70, 0.76), ("coffee_table", 0.35, 0.45)]
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
                filled = np.any([p.solid.contains(knees) for p in parts if p.solid is not None], axis=0)
                assert filled.mean() < 0.45


@pytest.mark.parametrize("kind", ["wardrobe", "sideboard", "dresser", "tv_stand", "fridge", "night_stand"])
def test_cupboards_are_solid_and_open_to_the_front(kind: str) -> None:
    for name in FAMILIES:
        for parts in variants(kind, name):
            low, high = bounds(parts)
            grid = [np.linspace(low[i] + 0.05, high[i] - 0.05, 9) for i in range(2)]
            z = np.linspace(0.22, high[2] - 0.03, 7)
            points = np.stack(np.meshgrid(*grid, z), axis=-1).reshape(-1, 3)
            filled = np.any([p.solid.contains(points) for p in parts if p.solid is not None], axis=0)
            assert filled.mean() > 0.85
            opened = [p for p in parts if p.role in ("door", "drawer", "front")]
            assert opened
            assert all(p.vertices[:, 1].mean() < low[1] + 0.08 for p in opened)
            assert any(p.role == "handle" for p in parts)


def test_shelves_are_free_inside() -> None:
    for parts in variants("bookshelf", "rustic"):
        low, high = bounds(parts)
        points = np.array([[0.0, low[1] + 0.05, z] for z in np.linspace(0.1, high[2] - 0.05, 40)])
        filled = np.any([p.solid.contains(points) for p in parts if p.solid is not None], axis=0)
        assert filled.mean() < 0.3
        assert sum(p.role == "shelf" for p in parts) >= 4


@pytest.mark.parametrize("kind", ["television", "monitor"])
def test_screens_face_the_front(kind: str) -> None:
    for parts in variants(kind, "modern"):
        (screen,) = [p for p in parts if p.role == "screen"]
        assert screen.vertices[:, 1].min() == min(p.vertices[:, 1].min() for p in parts if p.name != "foot")


def test_a_mattress_and_its_duvet_are_lain_upon() -> None:
    for parts in variants("bed", "classic"):
        tops = [p.vertices[:, 2].max() for p in parts if p.role == "mattress"]
        assert 0.42 <= min(tops) <= max(tops) <= 0.62
        assert {p.name for p in parts if p.role == "mattress"} == {"mattress", "duvet"}


@pytest.mark.parametrize("name", FAMILIES)
def test_doors_and_windows_close_their_opening(name: str) -> None:
    style = family(name)
    for i in range(DRAWS):
        rng = Seeds(3).rng(i)
        leaf = door(rng, style, 0.9, 2.05, 0.15)
        pane = window(rng, style, 1.2, 0.9, 1.2, 0.15)
        for parts, z0, z1, half in ((leaf, 0.0, 2.05, 0.45), (pane, 0.9, 2.1, 0.6)):
            for part in parts:
                assert part.solid is not None
                part.solid.check()
                assert thickness(part) >= 0.01 - 1e-9, part.name
            # A line through the opening along y meets a part wherever it goes.
            x, z = np.meshgrid(np.linspace(-half, half, 61), np.linspace(z0, z1, 61))
            y = np.arange(0.0025, 0.15, 0.005)
            lines = np.stack(np.broadcast_arrays(x[..., None], y, z[..., None]), axis=-1)
            closed = np.any([p.solid.contains(lines, -1e-9).any(axis=-1) for p in parts if p.solid is not None], axis=0)
            assert closed.all()


def test_novel_families_share_neither_colours_nor_shapes_with_common_ones() -> None:
    common, novel = [family(n) for n in COMMON_FAMILIES], [family(n) for n in NOVEL_FAMILIES]
    assert len(common) >= 4
    assert len(novel) >= 2
    for palette in ("woods", "fabrics", "walls", "floors", "paints", "accents"):
        known = {colour for style in common for colour in getattr(style, palette)}
        assert all(known.isdisjoint(getattr(style, palette)) for style in novel)
    for style in novel:
        legs = [(s.leg, s.leg_taper, s.leg_splay_m) for s in (style, *common)]
        assert legs[0] not in legs[1:]
        assert all(style.back_lean_m[0] >= s.back_lean_m[1] for s in common)


def test_palettes_are_muted() -> None:
    for style in FAMILIES.values():
        for palette in (style.walls, style.floors, style.woods):
            for r, g, b in palette:
                assert colorsys.rgb_to_hsv(r / 255, g / 255, b / 255)[1] < 0.75


def test_a_room_uses_few_colours_of_its_family() -> None:
    style = family("retro").for_room(Seeds(0).rng("room"))
    assert (len(style.woods), len(style.walls), len(style.metals)) == (2, 1, 1)
    assert set(style.woods) <= set(family("retro").woods)


def test_unknown_names_are_refused() -> None:
    with pytest.raises(SchemaError, match="throne"):
        build("throne", Seeds(0).rng("x"), family("nordic"))
    with pytest.raises(SchemaError, match="baroque"):
        family("baroque")
