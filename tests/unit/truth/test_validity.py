"""Faults of scenes made by hand: what is put in wrong is found, named, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.geometry.convex import span
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.truth.usability import uses
from hsbench.truth.validity import faults

GREY = (120, 120, 120)
ROOM = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])


def thing(
    number: int, kind: str, low: tuple[float, ...], high: tuple[float, ...], pose: np.ndarray | None = None
) -> SceneObject:
    return SceneObject(number, kind, np.eye(4) if pose is None else pose, (Part("body", GREY, None, span(low, high)),))


def room(*things: SceneObject, gap_m: float = 0.9) -> Scene:
    """4 x 3 m with four walls, a leafless doorway of ``gap_m`` in the southern one, and a ceiling."""
    floor = thing(1, "floor", (-0.2, -0.2, -0.1), (4.2, 3.2, 0.0))
    ceiling = thing(2, "ceiling", (-0.2, -0.2, 2.5), (4.2, 3.2, 2.6))
    walls = [
        thing(3, "wall", (-0.2, -0.2, 0.0), (2.0 - gap_m / 2, 0.0, 2.5)),
        thing(4, "wall", (2.0 + gap_m / 2, -0.2, 0.0), (4.2, 0.0, 2.5)),
        thing(5, "wall", (-0.2, 3.0, 0.0), (4.2, 3.2, 2.5)),
        thing(6, "wall", (-0.2, 0.0, 0.0), (0.0, 3.0, 2.5)),
        thing(7, "wall", (4.0, 0.0, 0.0), (4.2, 3.0, 2.5)),
    ]
    head = Part("head", GREY, None, span((-gap_m / 2, -0.2, 2.0), (gap_m / 2, 0.0, 2.5)))
    door = SceneObject(
        8, "door", planar(2.0, 0.0, np.pi), (Part("head", GREY, None, head.solid.transformed(planar(0, 0, np.pi))),)
    )
    return Scene("s", (Room("living", ROOM),), 2.5, (floor, ceiling, *walls, door, *things))


def test_a_sound_room_has_no_faults() -> None:
    box = thing(9, "sideboard", (1.0, 2.0, 0.0), (2.0, 2.5, 0.8))
    vase = thing(10, "vase", (1.4, 2.2, 0.8), (1.5, 2.3, 1.1))
    shelf = thing(11, "shelf", (2.5, 2.75, 1.2), (3.5, 3.0, 1.25))
    lamp = thing(12, "ceiling_lamp", (1.9, 1.4, 2.2), (2.1, 1.6, 2.5))
    found = faults(room(box, vase, shelf, lamp))
    assert len(found) == 0, found


@pytest.mark.parametrize(("depth_m", "wrong"), [(0.0, False), (0.009, False), (0.011, True), (0.3, True)])
def test_penetration_is_named_with_its_depth(depth_m: float, wrong: bool) -> None:
    a = thing(9, "sideboard", (1.0, 1.0, 0.0), (2.0, 2.0, 0.8))
    b = thing(10, "armchair", (2.0 - depth_m, 1.0, 0.0), (2.8, 2.0, 0.8))
    expected = (f"sideboard 9 and armchair 10 penetrate by {depth_m:.3f} m",) if wrong else ()
    assert faults(room(a, b)).penetrating == expected


@pytest.mark.parametrize(("gap_m", "wrong"), [(0.0, False), (0.009, False), (0.02, True), (0.5, True)])
@pytest.mark.parametrize("held_by", ["floor", "top", "wall", "ceiling"])
def test_what_nothing_holds_floats(gap_m: float, wrong: bool, held_by: str) -> None:
    table = thing(9, "coffee_table", (1.0, 1.0, 0.0), (2.0, 2.0, 0.4))
    item = {
        "floor": thing(10, "storage_box", (3.0, 1.0, gap_m), (3.3, 1.3, 0.3 + gap_m)),
        "top": thing(10, "vase", (1.4, 1.4, 0.4 + gap_m), (1.5, 1.5, 0.7 + gap_m)),
        "wall": thing(10, "picture", (2.5, 2.95 - gap_m, 1.2), (3.0, 3.0 - gap_m, 1.6)),
        "ceiling": thing(10, "ceiling_lamp", (2.9, 1.9, 2.2 - gap_m), (3.1, 2.1, 2.5 - gap_m)),
    }[held_by]
    found = faults(room(table, item)).floating
    assert len(found) == int(wrong)
    assert all(line.startswith(f"{item.category_name} 10 floats at z =") for line in found)


@pytest.mark.parametrize(("gap_m", "blocked"), [(0.9, False), (0.7, False), (0.5, True)])
def test_a_narrow_door_lets_no_body_through(gap_m: float, blocked: bool) -> None:
    flat = room(gap_m=gap_m)
    hall = Room("corridor", np.array([[0.0, -1.7], [4.0, -1.7], [4.0, -0.2], [0.0, -0.2]]))
    home = Scene("s", (*flat.rooms, hall), 2.5, flat.objects)
    assert bool(faults(home).blocked_doors) == blocked


def test_seats_and_handles_count_as_usable_where_a_body_and_a_hand_get_there() -> None:
    def stool(number: int, x: float, y: float) -> SceneObject:
        seat = Part("seat", GREY, "seat", span((-0.2, -0.2, 0.4), (0.2, 0.2, 0.45)))
        return SceneObject(number, "stool", planar(x, y, 0.0), (seat,))

    def drawer(number: int, y: float, yaw: float) -> SceneObject:
        front = Part("drawer", GREY, "drawer", span((-0.3, -0.02, 0.2), (0.3, 0.0, 0.4)))
        body = Part("body", GREY, None, span((-0.3, 0.0, 0.0), (0.3, 0.4, 0.6)))
        return SceneObject(number, "dresser", planar(3.2, y, yaw), (front, body))

    closet = thing(9, "wardrobe", (0.0, 2.0, 0.0), (1.3, 2.1, 2.0))
    walled_in = [closet, thing(10, "wardrobe", (1.2, 2.1, 0.0), (1.3, 3.0, 2.0)), stool(11, 0.6, 2.6)]
    scene = room(*walled_in, stool(12, 2.0, 1.5), drawer(13, 2.4, 0.0), drawer(14, 1.4, np.pi))
    found = uses(scene)
    assert found.seats == (1, 2)
    assert found.unusable[0] == "seat of stool 11"
    assert found.functional[1] == 4
    assert found.upright[0] < found.functional[0], "low drawers are reached by bending only"
