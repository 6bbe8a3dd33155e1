"""Rooms that hold the limits of standing and sitting, with the places where the answer is known without a program."""

from __future__ import annotations

import numpy as np

from hsbench.geometry.convex import cylinder, frustum
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from tests.unit.synth.living_rooms import GREY, part, room


def thing(number, kind, *parts):
    """An object whose parts are given in the scene frame."""
    return SceneObject(number, kind, planar(0, 0, 0), parts)


STAND_YES = {
    "open floor": (2.0, 0.6),
    "on a rug of 15 mm": (2.0, 1.4),
    "under a board at 1.85 m": (4.6, 0.6),
    "in a gap of .6 m": (3.3, 2.6),
}
STAND_NO = {
    "on a threshold of 3 cm": (0.6, 1.5),
    "under a board at 1.75 m": (4.6, 1.6),
    "under a table": (4.5, 4.0),
    "in a gap of .45 m": (4.325, 2.6),
    "behind a gap of .45 m, without a door": (0.5, 4.5),
    "by a cone that is wide at its foot": (2.75, 0.9),
}


def limits_of_standing() -> Scene:
    """5 x 5 m, a door at (.8, 0): what is walked over, under and between, and a pocket nobody gets into."""
    blocks = (
        part("a", (2.8, 2.2, 0), (3.0, 3.0, 1.0)),
        part("b", (3.6, 2.2, 0), (4.1, 3.0, 1.0)),
        part("c", (4.55, 2.2, 0), (5.0, 3.0, 1.0)),
    )
    # The pocket's wall leaves a gap of .45 m at x 0 to .45.
    pocket = (part("d", (0.45, 3.8, 0), (1.5, 3.9, 2.0)), part("e", (1.4, 3.9, 0), (1.5, 5.0, 2.0)))
    cone = Part("cone", GREY, None, cylinder(0.3, 0.0, 1.2, (3.2, 0.9), top_radius_m=0.05))
    table = (part("top", (4.0, 3.6, 0.7), (5.0, 4.4, 0.74), "top"), part("leg", (4.45, 3.6, 0), (4.5, 3.65, 0.7)))
    return room(
        5.0,
        5.0,
        thing(10, "rug", part("rug", (1.5, 1.0, 0), (2.5, 1.8, 0.015))),
        thing(11, "clutter", part("threshold", (0.3, 1.3, 0), (0.9, 1.7, 0.03))),
        thing(12, "shelf", part("board", (4.3, 0.3, 1.85), (5.0, 1.0, 1.9))),
        thing(13, "shelf", part("board", (4.3, 1.4, 1.75), (5.0, 1.8, 1.8))),
        thing(14, "bookshelf", *blocks),
        thing(15, "bookshelf", *pocket),
        thing(16, "plant", cone),
        thing(17, "dining_table", *table),
    )


def stool(number, x, y, low=0.0, height=0.45, side=0.4, slope=0.0, yaw=0.0):
    """A square block to sit on; its top rises by ``slope`` (a gradient) towards +x."""
    half, rise = side / 2, slope * side / 2
    outline = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    solid = frustum(outline, outline, low, height)
    vertices = solid.vertices.copy()
    vertices[4:, 2] += np.sign(vertices[4:, 0]) * rise
    seat = Part("seat", GREY, "seat", type(solid)(vertices, solid.triangles))
    return SceneObject(number, "stool", planar(x, y, yaw), (seat,))


def round_stool(number, x, y, diameter):
    """A drum to sit on, .45 m high."""
    seat = Part("seat", GREY, "seat", cylinder(diameter / 2, 0.0, 0.45))
    return SceneObject(number, "stool", planar(x, y, 0.0), (seat,))


def armchair_before(clear_m) -> Scene:
    """5 x 5 m, an armchair (id 10) with a seat rounded by 3 cm, and a block ``clear_m`` in front of the seat."""
    outline = np.array([[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]])
    chair = (
        Part("seat", GREY, "seat", frustum(outline, 0.9 * outline, 0.3, 0.42)),
        part("base", (-0.3, -0.3, 0.0), (0.3, 0.3, 0.3)),
        part("back", (-0.3, 0.3, 0.0), (0.3, 0.45, 0.9)),
        part("arm", (-0.4, -0.3, 0.0), (-0.3, 0.45, 0.6)),
        part("arm", (0.3, -0.3, 0.0), (0.4, 0.45, 0.6)),
    )
    front = 3.0 - 0.3 - clear_m
    block = thing(11, "ottoman", part("block", (2.3, front - 0.4, 0.0), (2.7, front, 0.4)))
    return room(5.0, 5.0, SceneObject(10, "armchair", planar(2.5, 3.0, 0.0), chair), block)


def two_rooms(opening_m, shut=False) -> Scene:
    """Two rooms of 3 x 3 m, wall .1 m, with a passage .9 m or less wide between them; a door at (.8, 0) in the first.

    shut: the opening is filled by a door instead.
    """
    first = room(6.1, 3.0)
    low, high = 1.5 - opening_m / 2, 1.5 + opening_m / 2
    wall = thing(
        10, "wall", part("wall", (3.0, 0.0, 0.0), (3.1, low, 2.5)), part("wall", (3.0, high, 0.0), (3.1, 3.0, 2.5))
    )
    half = opening_m / 2
    parts = [part("lintel", (-half, 0.0, 2.05), (half, 0.1, 2.5))]
    if shut:
        parts.append(part("leaf", (-half, 0.03, 0.0), (half, 0.07, 2.05), "door"))
    # As all doors: the front (-y) faces into the first room, the wall reaches to y = .1 m.
    opening = SceneObject(11, "door" if shut else "passage", planar(3.0, 1.5, -np.pi / 2), tuple(parts))
    outlines = (np.array([[x, 0.0], [x + 3.0, 0.0], [x + 3.0, 3.0], [x, 3.0]]) for x in (0.0, 3.1))
    rooms = tuple(Room("living", outline) for outline in outlines)
    return Scene("two rooms", rooms, 2.5, (*first.objects, wall, opening))


def ring(name, inner, outer, z):
    """Four blocks between two plan rectangles (x0, y0, x1, y1), from height z[0] to z[1]."""
    (a, b, c, d), (p, q, r, s) = inner, outer
    plans = ((p, q, r, b), (p, d, r, s), (p, b, a, d), (c, b, r, d))
    return tuple(part(name, (x0, y0, z[0]), (x1, y1, z[1])) for x0, y0, x1, y1 in plans)


def about(x, y, half):
    """The plan rectangle of a square about a point."""
    return x - half, y - half, x + half, y + half


SIT_YES = {10: "plain", 12: "of .25 m", 14: "of .75 m", 16: "of .36 m", 18: "tilted by 14 degrees", 20: "under 1.35 m"}
SIT_NO = {
    11: "walled in on all sides at .05 m",
    13: "of .2 m",
    15: "of .8 m",
    17: "of .34 m",
    19: "tilted by 16 degrees",
    21: "under 1.25 m",
    22: "in a pocket nobody can walk to",
}


def limits_of_sitting() -> Scene:
    """9 x 6 m, a door at (.8, 0): stools on either side of every limit; ``SIT_YES`` and ``SIT_NO`` name their ids."""

    def board(number, x, z):
        return thing(number, "shelf", part("board", (x - 0.2, 3.8, z), (x + 0.2, 4.2, z + 0.02)))

    def walls(number, x, y, clear):
        return thing(number, "bookshelf", *ring("wall", about(x, y, clear), about(x, y, clear + 0.05), (0, 1.0)))

    return room(
        9.0,
        6.0,
        stool(10, 1.0, 2.0),
        stool(11, 2.2, 2.0),
        stool(12, 3.4, 2.0, height=0.25),
        stool(13, 4.6, 2.0, height=0.2),
        stool(14, 5.8, 2.0, height=0.75, yaw=0.3),
        stool(15, 7.0, 2.0, height=0.8),
        stool(16, 8.2, 2.0, side=0.36, yaw=0.3),
        stool(17, 1.0, 4.0, side=0.34),
        stool(18, 2.2, 4.0, slope=np.tan(np.radians(14.0))),
        stool(19, 3.4, 4.0, slope=np.tan(np.radians(16.0))),
        stool(20, 4.6, 4.0),
        stool(21, 5.8, 4.0),
        stool(22, 7.7, 4.7),
        walls(30, 2.2, 2.0, 0.25),
        board(31, 4.6, 1.35),
        board(32, 5.8, 1.25),
        walls(33, 7.7, 4.7, 1.0),
    )


REACH_YES = {
    10: "switch at 1.1 m",
    11: "switch at .74 m",
    13: "switch at 2 m",
    15: "handle over a block .3 m deep",
    19: "top at .42 m in front of a stool",
    22: "rim of a table",
    25: "top over a pushed-in stool",
}
REACH_NO = {
    12: "switch at .6 m",
    14: "switch at 2.2 m",
    16: "handle over a block .6 m deep",
    17: "handle in a shut box",
    18: "switch behind a board",
    20: "top at .38 m in front of a stool",
    21: "top at 1.45 m",
    23: "middle of a table",
}


def limits_of_reach() -> Scene:
    """11 x 6 m, a door at (.8, 0): parts on either side of limits; ``REACH_YES`` and ``REACH_NO`` name objects."""

    def switch(number, x, z):
        """2 cm wide on the north wall."""
        return thing(number, "wall", part("switch", (x - 0.01, 5.99, z - 0.01), (x + 0.01, 6.0, z + 0.01), "switch"))

    def handle(number, x, y):
        low, high = (x - 0.02, y - 0.02, 1.09), (x + 0.02, y, 1.11)
        return thing(number, "wardrobe", part("handle", low, high, "handle"))

    def top(number, kind, plan, z):
        (x0, y0, x1, y1) = plan
        return thing(number, kind, part("top", (x0, y0, z - 0.02), (x1, y1, z), "top"))

    def block(number, x, deep):
        return thing(number, "bookshelf", part("block", (x - 1.0, 6.0 - deep, 0.0), (x + 1.0, 6.0, 0.9)))

    middle, hole = about(7.75, 2.15, 0.15), (5.3, 3.1, 5.7, 3.5)
    frame = ring("frame", hole, (4.8, 2.6, 6.2, 3.65), (0.72, 0.74))
    lids = tuple(part("lid", (9.3, 2.8, z), (9.7, 3.2, z + 0.02)) for z in (0.98, 1.2))
    pushed_in = stool(26, 5.5, 3.3)
    return room(
        11.0,
        6.0,
        switch(10, 0.5, 1.1),
        switch(11, 1.0, 0.74),
        switch(12, 1.5, 0.6),
        switch(13, 2.0, 2.0),
        switch(14, 2.5, 2.2),
        handle(15, 4.5, 6.0),
        handle(16, 7.0, 6.0),
        handle(17, 9.5, 3.0),
        switch(18, 10.0, 1.1),
        top(19, "coffee_table", about(1.0, 2.6, 0.15), 0.42),
        top(20, "coffee_table", about(3.0, 2.6, 0.15), 0.38),
        top(21, "coffee_table", about(4.0, 1.0, 0.15), 1.45),
        top(22, "dining_table", (6.5, 1.0, 9.0, 1.1), 0.74),
        top(23, "dining_table", middle, 0.74),
        thing(24, "dining_table", *ring("frame", middle, (6.5, 1.1, 9.0, 3.2), (0.72, 0.74))),
        # Those who stand reach .36 m into a table: the top begins farther from every side but that of the stool.
        thing(25, "dining_table", part("top", (*hole[:2], 0.72), (*hole[2:], 0.74), "top"), *frame),
        SceneObject(26, "stool", pushed_in.scene_T_object, pushed_in.parts, movable=True),
        stool(27, 1.0, 3.2),
        stool(28, 3.0, 3.2),
        block(29, 4.5, 0.3),
        block(30, 7.0, 0.6),
        thing(31, "bookshelf", *ring("side", about(9.5, 3.0, 0.15), about(9.5, 3.0, 0.2), (1.0, 1.2)), *lids),
        thing(32, "bookshelf", part("board", (9.7, 5.9, 0.0), (10.3, 5.98, 2.5))),
    )
