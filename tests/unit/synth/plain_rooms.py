"""Plain rooms with one group of furniture in them, and what holds of every arrangement, by exact geometry."""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from hsbench.geometry.convex import ConvexSolid
from hsbench.synth.furniture import FAMILIES, HANGING, WALL_HUNG, family
from hsbench.synth.furniture.fittings import FRONT_M
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.furnish import FITS
from hsbench.synth.rooms.groups import GROUPS
from hsbench.synth.rooms.items import Item
from hsbench.synth.rooms.placing import Layout
from hsbench.synth.rooms.poses import Context
from hsbench.synth.rooms.shell import Opening, Shell, walls_of
from hsbench.synth.seeds import Seeds

TOUCH_M = 1e-3
CONFIG = RoomConfig(walkable_share=0.1)  # a bathroom of 3.2 m2 has less free floor than the share asked elsewhere
HEIGHT_M = 2.6
LEAST_M = {
    "bathroom": (1.6, 2.0), "corridor": (1.4, 3.0), "kitchen": (1.9, 2.4), "bedroom": (2.6, 3.0), "office": (2.4, 3.0),
    "meeting": (2.8, 3.4), "living": (3.2, 3.4), "study": (2.4, 3.0), "dining": (2.6, 3.0),
}  # fmt: skip
LARGE_M = {kind: (2.2, 6.0) if kind == "corridor" else (4.6, 5.6) for kind in LEAST_M}


def plain_shell(kind: str, large: bool, seed: int) -> Shell:
    """A rectangle with a door near a corner and, but in bathrooms and corridors, a window across; seeds turn it."""
    w, d = (LARGE_M if large else LEAST_M)[kind]
    w, d = (w, d) if seed % 2 else (d, w)
    outline = np.array([[0.0, 0.0], [w, 0.0], [w, d], [0.0, d]])
    lengths = [wall.length_m for wall in walls_of(outline)]
    door, window = seed % 4, (seed + 2) % 4
    openings = [Opening("door", door, 0.55 if seed // 4 % 2 else lengths[door] - 0.55, 0.88, 0.0, 2.05)]
    if kind not in ("bathroom", "corridor"):
        sill = 1.05 if kind == "kitchen" else 0.9
        middle, width = lengths[window] / 2, round(min(1.2, 0.4 * lengths[window]), 2)
        openings.append(Opening("window", window, middle, width, sill, 2.1))
    return Shell(outline, HEIGHT_M, tuple(openings), np.zeros(2))


def context(layout: Layout, seed: int, fit: float = 1.0) -> Context:
    name = sorted(FAMILIES)[seed % len(FAMILIES)]
    style = family(name).for_room(Seeds(seed).rng("style"))
    return Context(layout, style, Seeds(seed).child(f"fit-{fit}"), CONFIG, fit)


@functools.cache
def arranged(kind: str, group: str, large: bool, seed: int) -> Layout:
    """A plain room with one group in it, in the largest size that fits."""
    layout = Layout(plain_shell(kind, large, seed), [], CONFIG)
    name, _, mode = group.partition(":")
    for fit in FITS:
        if layout.place(GROUPS[name](context(layout, seed, fit), mode)):
            break
    return layout


def of(layout: Layout, *names: str) -> list[Item]:
    return [i for i in layout.items if i.piece.category_name in names]


def forward(item: Item) -> np.ndarray:
    return np.array([math.sin(item.pose.yaw), -math.cos(item.pose.yaw)])


def place(item: Item) -> np.ndarray:
    return np.array([item.pose.x, item.pose.y])


def in_frame_of(item: Item, points: np.ndarray) -> np.ndarray:
    """(n, 3) points of the room in the frame of an item."""
    return (points - item.pose.scene_T_object[:3, 3]) @ item.pose.scene_T_object[:3, :3]


def corners_of(item: Item) -> np.ndarray:
    return np.concatenate([s.vertices for s in item.solids])


def depth(a: ConvexSolid, b: ConvexSolid) -> float:
    """How deep two convex solids reach into each other, below 0 if apart: separating axes, which are exact for them."""
    axes = [a.planes[:, :3], b.planes[:, :3]]
    edges = [directions(a), directions(b)]
    cross = np.cross(edges[0][:, None], edges[1][None]).reshape(-1, 3)
    length = np.linalg.norm(cross, axis=1)
    axes.append(cross[length > 1e-6] / length[length > 1e-6, None])
    across = np.concatenate(axes).T
    u, v = a.vertices @ across, b.vertices @ across
    return float(np.minimum(u.max(axis=0) - v.min(axis=0), v.max(axis=0) - u.min(axis=0)).min())


def directions(solid: ConvexSolid) -> np.ndarray:
    ends = solid.vertices[solid.triangles[:, [0, 1, 2, 0]]]
    along = np.diff(ends, axis=1).reshape(-1, 3)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    along *= np.where(along @ [1.0, 1e-3, 1e-6] < 0, -1.0, 1.0)[:, None]
    return np.unique(along.round(5), axis=0)


def check_bodies(name: str, layout: Layout) -> None:
    """No two solids share more than a millimetre, nothing is outside, all is held by floor, wall, ceiling or thing."""
    bounds = np.array([[v.min(axis=0), v.max(axis=0)] for v in map(corners_of, layout.items)])
    for i, j in itertools.combinations(range(len(bounds)), 2):
        if (np.minimum(bounds[i, 1], bounds[j, 1]) - np.maximum(bounds[i, 0], bounds[j, 0]) <= TOUCH_M).any():
            continue
        for a, b in itertools.product(layout.items[i].solids, layout.items[j].solids):
            if (np.minimum(a.bounds[1], b.bounds[1]) - np.maximum(a.bounds[0], b.bounds[0]) > TOUCH_M).all():
                names = [layout.items[k].piece.category_name for k in (i, j)]
                assert depth(a, b) <= TOUCH_M, f"{name}: {names} by {depth(a, b):.4f} m"
    for item, (low, high) in zip(layout.items, bounds, strict=True):
        what = f"{name}: {item.piece.category_name} at {low.round(3)}"
        assert low.min() >= -1e-9, what
        assert (high <= np.array(layout.shell.size_m) + 1e-9).all(), what
        if low[2] > 0.01:
            assert held(layout, item, low, high), what


def held(layout: Layout, item: Item, low: np.ndarray, high: np.ndarray) -> bool:
    kind = item.piece.category_name
    if kind in HANGING:
        return bool(high[2] == pytest.approx(layout.shell.height_m, abs=1e-6))
    if kind in WALL_HUNG:
        behind = place(item) - forward(item) * item.piece.depth / 2
        size = np.array(layout.shell.size_m[:2])
        return bool(min(np.abs(behind).min(), np.abs(size - behind).min()) <= 0.021)
    feet = corners_of(item)
    feet = feet[feet[:, 2] < low[2] + 1e-6][:, :2]
    tops = [s for o in layout.items if o is not item for s in o.solids if -0.01 <= s.bounds[1, 2] - low[2] <= TOUCH_M]
    return bool(np.any([above(s, feet) for s in tops], axis=0).all()) if tops else False


def above(solid: ConvexSolid, xy: np.ndarray) -> np.ndarray:
    """(n, 2) -> (n,) bool: over the upper face of a solid, or over its shadow where that face is no area."""
    face = solid.vertices[solid.vertices[:, 2] > solid.bounds[1, 2] - 1e-3][:, :2]
    hull = ConvexHull(face if len(face) > 2 else solid.vertices[:, :2])
    return np.asarray((xy @ hull.equations[:, :2].T + hull.equations[:, 2] <= 1e-6).all(axis=1))


def check_kitchen(name: str, layout: Layout) -> None:
    """Fronts and tops of a line are flush; hoods hang over hobs, cabinets over worktops, at a height to work under."""
    base = of(layout, "kitchen_counter", "dishwasher", "stove")
    for a, b in itertools.pairwise(sorted(base, key=lambda i: (i.pose.yaw, float(place(i) @ forward(i)[::-1])))):
        if a.pose.yaw != b.pose.yaw or abs(forward(a) @ (place(b) - place(a))) > 0.1:
            continue  # of another run
        planes = [forward(i) @ (place(i) + forward(i) * (front_m(i) - i.piece.depth / 2)) for i in (a, b)]
        assert abs(planes[0] - planes[1]) <= 0.005, f"{name}: fronts {planes} are not flush"
        assert abs(worktop_m(a) - worktop_m(b)) <= 0.02, f"{name}: tops {worktop_m(a)}, {worktop_m(b)} are not level"
        aside = np.linalg.norm(place(b) - place(a)) - (a.piece.width + b.piece.width) / 2
        assert 0.004 <= aside <= 0.11 or aside > 0.4, f"{name}: a slit of {aside:.3f} m"
    for hood in of(layout, "range_hood"):
        (below,) = [i for i in base if hob_x(i) is not None and under(i, hood)]
        assert in_frame_of(below, np.array([[*place(hood), 0.0]]))[0, 0] == pytest.approx(hob_x(below), abs=1e-3)
        assert hood.z_range[0] - worktop_m(below) >= 0.55, f"{name}: a hood hangs low"
    for cabinet in of(layout, "wall_cabinet"):
        below = [i for i in base if under(i, cabinet)]
        assert below, f"{name}: a wall cabinet hangs over nothing"
        assert cabinet.z_range[0] - worktop_m(below[0]) >= 0.4, f"{name}: a wall cabinet hangs low"


def under(unit: Item, hung: Item) -> bool:
    """Whether the middle of something on a wall is over a unit."""
    local = in_frame_of(unit, np.array([[*place(hung), 0.0]]))[0, :2]
    return bool((np.abs(local) < np.array([unit.piece.width, unit.piece.depth]) / 2).all())


def hob_x(unit: Item) -> float | None:
    """Where along a unit one cooks."""
    hobs = [p.vertices[:, 0] for p in unit.piece.parts if p.name == "hob"]
    return float(hobs[0].min() + hobs[0].max()) / 2 if hobs else None


def front_m(item: Item) -> float:
    """From the back to the front plane of a unit: that of its doors, drawers and oven, or of a corner's body."""
    parts = item.piece.parts
    planes = [p.vertices[:, 1].min() for p in parts if p.role in ("door", "drawer", "front") and p.name != "hob"]
    planes = planes or [p.vertices[:, 1].min() - FRONT_M for p in parts if p.name == "body"]
    return float(item.piece.bounds[1, 1] - np.median(planes))


def worktop_m(item: Item) -> float:
    tops = [p for p in item.piece.parts if p.role == "top"] or [p for p in item.piece.parts if p.name == "hob"]
    return max(float(p.vertices[:, 2].max()) for p in tops)
