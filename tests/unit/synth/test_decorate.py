"""Whole rooms: lamps, curtains and pictures, and small things on what suits them."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from plain_rooms import CONFIG, check_bodies, check_kitchen, context, in_frame_of, of, place, plain_shell

from hsbench.schema.categories import category
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.furnish import DEFINING, furnish
from hsbench.synth.rooms.items import Item
from hsbench.synth.rooms.placing import Layout
from hsbench.synth.rooms.supports import SUITED
from hsbench.synth.rooms.templates import TEMPLATES
from hsbench.synth.seeds import Seeds


@functools.cache
def furnished(name: str, seed: int = 5) -> Layout:
    template = TEMPLATES[name]
    layout = Layout(plain_shell(template.room_type, True, seed), [], CONFIG)
    style = context(layout, seed).style
    return furnish(layout.shell, [], template, style, Seeds(seed).child(name), RoomConfig(curtain_share=1.0))


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_furnished_room_is_whole(name: str) -> None:
    layout = furnished(name)
    present = {i.piece.category_name for i in layout.items}
    assert all(wanted & present for wanted in DEFINING.get(TEMPLATES[name].room_type, ()))
    check_bodies(name, layout)
    check_kitchen(name, layout)
    check_lamps(name, layout)
    check_curtains(name, layout)
    check_small_things(name, layout)


def check_lamps(name: str, layout: Layout) -> None:
    lamps = of(layout, "ceiling_lamp")
    assert lamps, f"{name}: no ceiling lamp"
    tables = of(layout, "dining_table", "meeting_table", "kitchen_island")
    for lamp in lamps:
        over = [t for t in tables if np.linalg.norm(place(t) - place(lamp)) < 0.01]
        assert lamp.z_range[0] >= (over[0].z_range[1] + 0.6 if over else 2.0), f"{name}: a lamp hangs low"


def check_curtains(name: str, layout: Layout) -> None:
    """In pairs, about the same window."""
    for hole in layout.shell.openings:
        wall = layout.shell.walls[hole.wall]
        own = [c for c in of(layout, "curtain") if abs((place(c) - wall.start) @ wall.inward) < 0.2]
        sides = sorted(float((place(c) - wall.start) @ wall.along) - hole.middle_m for c in own)
        assert len(sides) in (0, 2), f"{name}: {len(sides)} curtains"
        if sides:
            assert sides[0] == pytest.approx(-sides[1], abs=1e-3)
            assert sides[1] > hole.width_m / 2


def check_small_things(name: str, layout: Layout) -> None:
    """Each stands on what suits it, and every sofa keeps a seat."""
    for item in layout.items:
        kind = item.piece.category_name
        if category(kind).group != "clutter" or item.z_range[0] < 0.01:
            continue
        under = [o for o in layout.items if o is not item and on(o, item)]
        assert under, f"{name}: {kind} stands on nothing"
        carriers = {o.piece.category_name for o in under}
        suited = {c for c, things in SUITED.items() if kind in things}
        extra = {"cushion": {"sofa", "bed"}, "pot": {"stove", "kitchen_counter"}, "keyboard": {"desk"}}
        extra |= {"laptop": {"desk", "meeting_table"}, "table_lamp": {"desk"}}
        assert carriers & (suited | extra.get(kind, set())), f"{name}: {kind} stands on {carriers}"
    for sofa in of(layout, "sofa"):
        seats = [p for p in sofa.piece.parts if p.role == "seat"]
        assert len(seats) - sum(on(sofa, c) for c in of(layout, "cushion")) >= 1


def on(carrier: Item, thing: Item) -> bool:
    """Whether the middle of a thing is over a carrier that has a surface at its foot."""
    local = in_frame_of(carrier, np.array([[*place(thing), 0.0]]))[0, :2]
    within = (np.abs(local) <= np.array([carrier.piece.width, carrier.piece.depth]) / 2).all()
    heights = [carrier.pose.z + float(p.vertices[:, 2].max()) for p in carrier.piece.parts]
    return bool(within and np.abs(np.array(heights) - thing.z_range[0]).min() < 0.01)


def test_small_things_and_pictures_are_common() -> None:
    rooms = [furnished(name) for name in TEMPLATES if not TEMPLATES[name].novel]
    counts = [sum(category(i.piece.category_name).group == "clutter" for i in r.items) for r in rooms]
    dry = [r for r in rooms if not of(r, "toilet")]
    assert np.mean(counts) >= 2.0
    assert np.mean([len(of(r, "picture", "wall_clock")) for r in dry]) >= 0.7
    assert any(of(r, "cushion") for r in rooms)
    assert any(of(r, "curtain") for r in rooms)


def test_no_two_pictures_of_a_room_are_alike() -> None:
    for name in TEMPLATES:
        pieces = [
            tuple(p.vertices.tobytes() + bytes(p.colour) for p in i.piece.parts) for i in of(furnished(name), "picture")
        ]
        assert len(set(pieces)) == len(pieces), name


def test_lamps_suit_the_room() -> None:
    """Arms with bulbs hang where people live and eat, and only flat lamps in bathrooms, offices and corridors."""
    for name, template in TEMPLATES.items():
        named = {p.name for lamp in of(furnished(name), "ceiling_lamp") for p in lamp.piece.parts}
        if template.room_type not in ("living", "dining", "bedroom"):
            assert not any(part.startswith("arm") for part in named), name
        if template.room_type in ("bathroom", "office", "corridor"):
            assert "cable" not in named, name


def test_pictures_hang_at_eye_height_or_above_low_furniture() -> None:
    for name in TEMPLATES:
        for picture in of(furnished(name), "picture"):
            assert 1.4 <= sum(picture.z_range) / 2 <= 1.9


def test_a_furnished_room_is_a_function_of_its_seeds() -> None:
    for name in ("living_wall", "kitchen_island", "bathroom_double", "office_block", "bedroom_bunk"):
        furnished.cache_clear()
        first = furnished(name)
        furnished.cache_clear()
        again = furnished(name)
        assert [i.pose for i in first.items] == [i.pose for i in again.items]
        for a, b in zip(first.items, again.items, strict=True):
            parts = [[p.vertices.tobytes() + bytes(p.colour) for p in i.piece.parts] for i in (a, b)]
            assert parts[0] == parts[1]
