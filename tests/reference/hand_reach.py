"""Which points of functional parts a hand reaches, by marching along the arm; slow and plain on purpose.

Written from the text of task affordance-topdown by somebody who had not read the package's own answer.
What the text leaves open is read as follows.

- The shoulder is a point 1.4 m above the centre of any walkable cell, or .55 m above the middle of any free patch on
  which somebody can sit (``body_fit``), at every use position of a movable seat.
- The hand is a point on the part's surface; .75 m is the distance in space. The line from shoulder to hand is a line
  without thickness and must not enter any solid: points every 2 mm are tried, and every .2 mm of the last 2 mm
  before the hand, but for the last of them.
- Of a top only the upper side counts (tilted at most 15 degrees), where it is .4 to 1.4 m above the floor. Of all other
  roles every face counts, at any height. Roles seat and mattress are not functional here.
- For the standing all things are at their place at t0, pushed-in chairs too. For the sitting only their own seat moves.
"""

from __future__ import annotations

import numpy as np

from tests.reference.body_fit import top_faces
from tests.reference.solid_points import depth, object_hulls, scene_hulls

FUNCTIONAL = ("top", "shelf", "handle", "door", "drawer", "screen", "switch", "tap", "front", "board")
TOP_M = (0.4, 1.4)
STANDING_M, SEATED_M, ARM_M = 1.4, 0.55, 0.75
STEP_M = 0.002
INSIDE_M = 1e-6  # a line along a face is free
BATCH = 16
SEAT_LATTICE_M = 0.05  # sitters closer than this to another are one


def surface_points(scene, count, rng):
    """Random points on functional parts, ``count`` a part: (N,) object ids, (N,) part indices, (N, 3) points, normals.

    Points are even over the area that counts; parts without any (a top out of reach by its height) have none.
    """
    rows = []
    for hull in scene_hulls(scene):
        if hull.role not in FUNCTIONAL:
            continue
        triangles = top_faces(hull) if hull.role == "top" else hull.triangles
        if len(triangles) == 0:
            continue
        a, b, c = triangles.transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        area = np.linalg.norm(normals, axis=1)
        chosen = rng.choice(len(area), count, p=area / area.sum())
        u, v = rng.random((2, count, 1))
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        points = a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]
        normals = (normals / area[:, None])[chosen]
        counts = np.ones(count, dtype=bool)
        if hull.role == "top":
            counts = (points[:, 2] >= TOP_M[0]) & (points[:, 2] <= TOP_M[1])
        rows += [(hull.object_id, hull.part_index, *pn) for pn in zip(points[counts], normals[counts], strict=True)]
    ids, indices, points, normals = zip(*rows, strict=True) if rows else ((), (), (), ())
    return np.array(ids, int), np.array(indices, int), np.reshape(points, (-1, 3)), np.reshape(normals, (-1, 3))


def shoulder_groups(scene, walk, places):
    """[((K, 3) shoulders, hulls around them)]: one group for the standing and one for each pose of each seat."""
    everything = scene_hulls(scene)
    groups = [(np.column_stack([walk, np.full(len(walk), STANDING_M)]), everything)]
    seats = {}
    for place in places:
        seats.setdefault((place.object_id, place.scene_T_object.tobytes()), []).append(place)
    for (object_id, _), sitters in seats.items():
        shoulders = np.array([s.patch for s in sitters]) + [0, 0, SEATED_M]
        _, first = np.unique((shoulders / SEAT_LATTICE_M).round(), axis=0, return_index=True)
        moved = object_hulls(scene.object(object_id), sitters[0].scene_T_object)
        groups.append((shoulders[first], [h for h in everything if h.object_id != object_id] + moved))
    return groups


def lines_free(hand, shoulders, hulls):
    """(K,) bool: the straight line from the hand (3,) to each of (K, 3) shoulders enters no hull."""
    low, high = np.minimum(shoulders.min(axis=0), hand), np.maximum(shoulders.max(axis=0), hand)
    near = [h for h in hulls if (h.low < high).all() and (h.high > low).all()]
    length = np.linalg.norm(shoulders - hand, axis=1)
    along = np.concatenate([np.arange(1, 10) * STEP_M / 10, np.arange(STEP_M, length.max() + STEP_M, STEP_M)])
    points = hand + along[:, None] * ((shoulders - hand) / length[:, None])[:, None]
    inside = depth(near, points.reshape(-1, 3)).reshape(len(shoulders), -1) > INSIDE_M
    return ~(inside & (along < length[:, None])).any(axis=1)


def is_reached(hand, normal, groups):
    """Whether any shoulder of any group reaches a point of a surface, from the side its normal shows to."""
    for shoulders, hulls in groups:
        ray = shoulders - hand
        able = shoulders[(np.linalg.norm(ray, axis=1) <= ARM_M) & (ray @ normal > 0)]
        able = able[np.argsort((able - hand) @ -normal)]  # the straightest first: most are then free at once
        if any(lines_free(hand, able[i : i + BATCH], hulls).any() for i in range(0, len(able), BATCH)):
            return True
    return False


def reached(scene, walk, places, count, rng):
    """Sampled points and whether a hand reaches them: (N,) object ids, (N,) part indices, (N, 3) points, (N,) bool."""
    ids, indices, points, normals = surface_points(scene, count, rng)
    groups = shoulder_groups(scene, walk, places)
    answer = [is_reached(hand, normal, groups) for hand, normal in zip(points, normals, strict=True)]
    return ids, indices, points, np.array(answer, dtype=bool)
