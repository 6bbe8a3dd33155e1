"""Where a body can stand and sit, by trying bodies in place; slow and plain on purpose.

Written from the text of task affordance-topdown by somebody who had not read the package's own answer.
What the text leaves open is read as follows.

Walking
- The body is an upright cylinder of radius .25 m from 2 cm to 1.8 m above the floor: what ends below 2 cm is stepped
  on, what begins above 1.8 m is walked under. Touching is allowed.
- Cells are 5 cm; a cell is free if the cylinder fits with its axis through the cell's centre, and that lies in a room
  or a doorway (the plan of a door or passage; a shut leaf blocks like anything solid).
- A walk goes from cell to cell over common sides. It is connected to a door if it comes within .5 m of the plan of a
  door: the body's radius and as much again, for handles stand out and casings are thick. A passage is no door.
  Without a door nothing is walkable, and nothing on the far side of a shut leaf where no room is.
- Movable things stand where they stand at t0.

Sitting
- The label belongs to a part: if one place on a part of role seat or mattress is free, all cells whose centres lie
  under the part's top surface are sittable; the top surface is every face tilted at most 15 degrees.
- The clear patch is a square of .35 m that lies wholly on the top surface of one part, along the axes of the object.
  A round stool of .4 m holds no such square and is not sittable.
- Front is where the sitter faces: any of the four axes of the object. Backs and arms leave what a body can use.
- The trunk is a box of .35 x .35 x .85 m on the patch; all solids but the part itself must keep out of it.
- The shins are a box of .35 x .35 m from .1 m up to the seat surface. It may begin up to .1 m before the patch
  (rounded cushions, the frame of a bed); thighs, .15 m thick, must pass over that gap. The object's own parts count.
- The seat's height is that of the middle of the patch.
- "Within .7 m" is measured in plan from the middle of the patch to the centre of a walkable cell at t0.
- A movable seat is drawn back, against its front, in steps of 5 cm up to .6 m, through free positions only. Its place
  at t0 counts as a use position too. The cells are those under the seat at t0, for truth is the room at t0.
- Solids may touch and overlap by 1 mm.

These are the readings of ``LITERAL``, taken before anything else was looked at. Against another reader four cases were
left, in each of which the text allows both; ``SETTLED`` takes the other's side, so that what remains can be compared:
- round_patch: a disc .35 m across is patch enough, so that round stools can be sat on.
- least_pull: "its use position" is one: a seat is drawn back no farther than needed to sit facing one way.
- own_front: "in front" of a seat that has a back is the front of the furniture, not any side; and a seat without one is
  drawn back against the way that one faces on it, not against a front that it does not have.
- gap_m: how far before the patch the shins may begin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.ndimage import label
from scipy.spatial import cKDTree

from tests.reference.solid_points import Hull, hull_depth, hull_of, object_hulls, scene_hulls

RADIUS_M, STEP_M, HEAD_ROOM_M = 0.25, 0.02, 1.8
DOOR_REACH_M = 0.5
FACE_M, VOLUME_M = 0.02, 0.05
TILT = np.cos(np.radians(15.0))
SEAT_M = (0.25, 0.75)
WIDE_M, TRUNK_M, SHIN_FROM_M, THIGH_M = 0.35, 0.85, 0.1, 0.15
WALK_WITHIN_M = 0.7
PULL_M, PULL_STEP_M = 0.6, 0.05
PLACE_STEP_M, GAP_STEP_M = 0.025, 0.01
TOUCH_M, SEAM_M = 1e-3, 1e-7
AROUND_M = PULL_M + THIGH_M + TRUNK_M  # what is farther from a seat is in nobody's way
QUARTER_TURNS = ((1, 0), (0, 1), (-1, 0), (0, -1))
FRONT = (0, -1)  # object frame
BACKLESS = ("stool", "bar_stool", "bench", "ottoman", "piano")  # seats that have no front of their own


def cell_centres(origin_xy, shape, cell_m=0.05):
    """(nx, ny, 2) centres of the cells of a grid whose minimum corner is ``origin_xy``."""
    x, y = (o + (np.arange(n) + 0.5) * cell_m for o, n in zip(origin_xy, shape, strict=True))
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)


def plan(item):
    """The convex outline of an object seen from above."""
    return shapely.MultiPoint(item.vertices[:, :2]).convex_hull


# Walking ------------------------------------------------------------------------------------------------------------


def volume_points(hull):
    """(N, 3) points of a 5 cm lattice inside a hull."""
    axes = [np.arange(low, high, VOLUME_M) for low, high in zip(hull.low, hull.high, strict=True)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return lattice[hull_depth(hull, lattice) > 0]


def face_points(triangle):
    """(N, 3) points at most 2 cm apart all over a triangle, its sides and corners too."""
    a, b, c = triangle
    far, wide = max(np.linalg.norm(b - a), np.linalg.norm(c - a)), np.linalg.norm(c - b)
    u = np.linspace(0, 1, 1 + int(np.ceil(far / FACE_M)))[:, None, None]
    v = np.linspace(0, 1, 1 + int(np.ceil(wide / FACE_M)))[None, :, None]
    return (a + u * ((b - a) + v * (c - b))).reshape(-1, 3)


def obstacle_points(hulls):
    """(N, 2) plan of points all over and all through the solids, as high as the cylinder.

    A cylinder that meets a solid holds points of its faces, or is wholly inside: there a coarse lattice is enough.
    """
    hulls = [h for h in hulls if h.low[2] < HEAD_ROOM_M and h.high[2] > STEP_M]
    samples = [points for h in hulls for points in (volume_points(h), *map(face_points, h.triangles))]
    points = np.concatenate([np.empty((0, 3)), *samples])
    return points[(points[:, 2] > STEP_M) & (points[:, 2] < HEAD_ROOM_M), :2]


def standable(scene, centres):
    """(..., 2) -> (...) bool: the body fits there, whether or not it can get there."""
    points = centres.reshape(-1, 2)
    doorways = [plan(o) for o in scene.objects if o.category_name in ("door", "passage")]
    floor = shapely.union_all([*(shapely.Polygon(room.outline_xy) for room in scene.rooms), *doorways])
    obstacles = obstacle_points(scene_hulls(scene))
    apart = cKDTree(obstacles).query(points, distance_upper_bound=RADIUS_M)[0] if len(obstacles) else np.inf
    free = (apart >= RADIUS_M) & shapely.contains_xy(floor, *points.T)
    return free.reshape(centres.shape[:-1])


def connected(scene, free, centres):
    """(nx, ny) bool: the free cells that are reached from a door."""
    pieces, _ = label(free)
    in_room = scene.contains(centres)
    doors = shapely.union_all([plan(o) for o in scene.objects if o.category_name == "door"])
    at_door = shapely.distance(doors, shapely.points(centres)) <= DOOR_REACH_M
    return free & np.isin(pieces, np.intersect1d(pieces[at_door], pieces[in_room]))


def walkable(scene, origin_xy, shape, cell_m=0.05):
    """(nx, ny) bool: the body fits and gets there from a door."""
    centres = cell_centres(origin_xy, shape, cell_m)
    return connected(scene, standable(scene, centres), centres)


# Sitting ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reading:
    """What was read otherwise after a comparison with another reader; see the end of the module's docstring."""

    round_patch: bool
    least_pull: bool
    own_front: bool
    gap_m: float


LITERAL = Reading(round_patch=False, least_pull=False, own_front=False, gap_m=0.1)
SETTLED = Reading(round_patch=True, least_pull=True, own_front=True, gap_m=0.15)


@dataclass(frozen=True, eq=False)
class Sitting:
    """A free place: the part, the patch's middle (3,), its facing (2,), and the pose of the object in use."""

    object_id: int
    part_index: int
    patch: np.ndarray
    facing: np.ndarray
    scene_T_object: np.ndarray


def overlap(a: Hull, b: Hull, offsets):
    """(N,) depth in metres by which hull a, moved by each of (N, 3) offsets, is in hull b; <= 0 apart or touching.

    The separating axis theorem: two convex bodies are apart if and only if they are along a face normal of either or
    a cross product of two edges.
    """
    crosses = np.cross(a.edges[:, None], b.edges[None]).reshape(-1, 3)
    length = np.linalg.norm(crosses, axis=1)
    crosses = crosses[length > 1e-6] / length[length > 1e-6, None]
    axes = np.concatenate([a.half_spaces[:, :3], b.half_spaces[:, :3], crosses])
    on_a, on_b, shift = a.vertices @ axes.T, b.vertices @ axes.T, offsets @ axes.T
    ahead = on_a.max(axis=0) - on_b.min(axis=0) + shift
    behind = on_b.max(axis=0) - on_a.min(axis=0) - shift
    return np.minimum(ahead, behind).min(axis=1)


def fits(body: Hull, offsets, hulls):
    """(N,) bool: the body, moved by each of (N, 3) offsets, is clear of all hulls."""
    clear = np.ones(len(offsets), dtype=bool)
    for hull in hulls:
        near = clear & ((body.low + offsets < hull.high) & (body.high + offsets > hull.low)).all(axis=1)
        if near.any():
            clear[near] = overlap(body, hull, offsets[near]) <= TOUCH_M
    return clear


def body_box(facing, along, z):
    """A box .35 m wide, from ``along[0]`` to ``along[1]`` in front of the origin, from height z[0] to z[1]."""
    aside = np.array([-facing[1], facing[0]])
    flat = [f * facing + s * aside for f in along for s in (-WIDE_M / 2, WIDE_M / 2)]
    return hull_of(np.array([[*xy, h] for xy in flat for h in z]))


def top_faces(hull):
    """(T, 3, 3) triangles of the top surface: tilted at most 15 degrees."""
    normals = np.cross(hull.triangles[:, 1] - hull.triangles[:, 0], hull.triangles[:, 2] - hull.triangles[:, 0])
    return hull.triangles[normals[:, 2] >= TILT * np.linalg.norm(normals, axis=1)]


def top_outline(hull):
    """The top surface of a part seen from above."""
    triangles = [shapely.Polygon(t[:, :2]).buffer(SEAM_M, join_style="mitre") for t in top_faces(hull)]
    return shapely.union_all(triangles)


def top_height(hull, points_xy):
    """(N, 2) -> (N,) height of the part's upper side."""
    up = hull.half_spaces[hull.half_spaces[:, 2] > 1e-6]
    return (-(points_xy @ up[:, :2].T + up[:, 3]) / up[:, 2]).min(axis=1)


def patch_middles(outline, facing, round_patch):
    """(N, 2) middles of patches that lie wholly on an outline: a 2.5 cm lattice with its rim."""
    aside = np.array([-facing[1], facing[0]])
    corners = [WIDE_M / 2 * (s * facing + t * aside) for s in (-1, 1) for t in (-1, 1)]
    # A square lies on a convex outline where all its corners do.
    room = shapely.intersection_all([shapely.affinity.translate(outline, *-c) for c in corners])
    if round_patch:
        room = outline.buffer(-WIDE_M / 2)
    if room.is_empty:
        return np.empty((0, 2))
    rim = shapely.get_coordinates(room) @ np.column_stack([facing, aside])
    lines = [
        np.linspace(low, high, 1 + int(np.ceil((high - low) / PLACE_STEP_M)))
        for low, high in zip(rim.min(axis=0), rim.max(axis=0), strict=True)
    ]
    lattice = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2)
    points = np.concatenate([rim, lattice]) @ np.array([facing, aside])
    return points[shapely.distance(room, shapely.points(points)) <= 1e-6]


def places_on(seat, own, others, facing, walk, reading):
    """(N, 3) middles of patches on a seat hull where a body that faces one way sits free.

    own: hulls of the seat's object, others: of all other objects, walk: (K, 2) walkable cell centres.
    """
    xy = patch_middles(top_outline(seat), facing, reading.round_patch)
    if len(xy) == 0 or len(walk) == 0:
        return np.empty((0, 3))
    corners = WIDE_M / 2 * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1], [0, 0]])
    corners = corners @ np.array([facing, [-facing[1], facing[0]]])
    patch_z = np.stack([top_height(seat, xy + c) for c in corners], axis=1)
    places = np.column_stack([xy, patch_z[:, -1]])
    near = cKDTree(walk).query(xy)[0] <= WALK_WITHIN_M
    ok = near & (places[:, 2] >= SEAT_M[0] - 1e-6) & (places[:, 2] <= SEAT_M[1] + 1e-6)
    places, highest = places[ok], patch_z[ok].max(axis=1)
    around = [h for h in own if h is not seat] + others
    trunk = body_box(facing, (-WIDE_M / 2, WIDE_M / 2), (0.0, TRUNK_M))
    places = places[fits(trunk, np.column_stack([places[:, :2], highest]), around)]
    free = np.zeros(len(places), dtype=bool)
    for height in np.unique(places[:, 2].round(3)):
        here = np.flatnonzero(places[:, 2].round(3) == height)
        flat = np.column_stack([places[here, :2], np.zeros(len(here))])
        for gap in np.arange(0.0, reading.gap_m + 1e-9, GAP_STEP_M):
            front = WIDE_M / 2 + gap
            shins = body_box(facing, (front, front + WIDE_M), (SHIN_FROM_M, height))
            found = fits(shins, flat, own + others)
            if gap > 0:
                thighs = body_box(facing, (front - gap, front), (height, height + THIGH_M))
                found &= fits(thighs, flat, around)
            free[here] |= found
    return places[free]


def use_poses(item, others, facing):
    """The poses (4, 4) at which a seat may be used: its own, and those it can be drawn back to if it is movable,
    against the way (3,) that one faces.
    """
    poses = [item.scene_T_object]
    if item.movable:
        hulls = object_hulls(item)
        obstacles = [h for h in others if h.high[2] > STEP_M]
        for pull in np.arange(1, round(PULL_M / PULL_STEP_M) + 1) * PULL_STEP_M:
            back = -facing * pull
            if not all(fits(hull, back[None], obstacles)[0] for hull in hulls):
                break
            moved = item.scene_T_object.copy()
            moved[:3, 3] += back
            poses.append(moved)
    return poses


def sittings(scene, walk, reading=LITERAL) -> list[Sitting]:
    """All free places to sit that were found. walk: (K, 2) centres of walkable cells."""
    found = []
    everything = scene_hulls(scene)
    for item in scene.objects:
        if not any(part.role in ("seat", "mattress") for part in item.parts):
            continue
        low, high = item.vertices.min(axis=0) - AROUND_M, item.vertices.max(axis=0) + AROUND_M
        others = [
            h for h in everything if h.object_id != item.object_id and (h.low < high).all() and (h.high > low).all()
        ]
        backless = item.category_name in BACKLESS
        for turn in QUARTER_TURNS:
            facing, front = (item.scene_T_object[:3, :2] @ np.array(way, dtype=float) for way in (turn, FRONT))
            settled = set()
            for pose in use_poses(item, others, facing if reading.own_front and backless else front):
                own = object_hulls(item, pose)
                for seat in (h for h in own if h.role in ("seat", "mattress")):
                    if reading.own_front and turn != FRONT and seat.role == "seat" and not backless:
                        continue
                    if reading.least_pull and seat.part_index in settled:
                        continue
                    places = places_on(seat, own, others, facing[:2], walk, reading)
                    found += [Sitting(item.object_id, seat.part_index, patch, facing[:2], pose) for patch in places]
                    if len(places):
                        settled.add(seat.part_index)
    return found


def sittable(scene, places, origin_xy, shape, cell_m=0.05):
    """(nx, ny) bool: the cells at t0 under the top surface of parts on which somebody can sit."""
    parts = {(p.object_id, p.part_index) for p in places}
    tops = [top_outline(h) for h in scene_hulls(scene) if (h.object_id, h.part_index) in parts]
    return shapely.contains_xy(shapely.union_all(tops), *np.moveaxis(cell_centres(origin_xy, shape, cell_m), -1, 0))
