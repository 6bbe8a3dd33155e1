"""Where a body finds room on a seat, and from which free cell it gets there.

A movable seat is drawn back first, as little as possible. Ways on which nothing is touched are preferred; where there
is none, a shin or a sleeve may brush past.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.schema.scene import SceneObject
from hsbench.synth.activities.contact import Obstacles, body_depth
from hsbench.synth.activities.seats import (
    CHECK_FPS,
    Point,
    Seat,
    Surface,
    facing_of,
    folded,
    moved_by,
    point_of,
    sit_on,
    step_in,
    step_out,
)
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels, pose, standing
from hsbench.synth.people.motion import SeatPose, sit_down
from hsbench.synth.people.navigation import nearest_free
from hsbench.truth.meshes import has_mesh
from hsbench.truth.sittable import APPROACH_M, PULL_M, SEAT_ROLES
from hsbench.truth.tops import PATCH_M
from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray

SEATED_GRAZE_M = 0.02  # by which who sits may press into what is about them: bodies sway
HARD_GRAZE_M = 0.0  # on what is no seat, with a wall or cupboard behind the back maybe
GRAZE_M = 0.025  # by which a body may press into what is about it as it sits down
BRUSH_M = 0.04  # and a shin or sleeve as one steps in, where there is no better way
SIT_DOWN_S = 1.2
SIT_DOWN_PER_M = 0.6  # slower if the seat is farther from where one stands
LOW_M, LOW_PER_M_S = 0.5, 2.0  # and if the pelvis comes to rest lower than this
CALF_SHARES_M = (0.0, 0.12)  # how much nearer to the seat than one's feet are later one stands
PULLS_M = (0.0, 0.08, 0.16, 0.24, 0.32, 0.40)  # a movable seat is drawn back to be sat on
ENTRIES_M = (0.0, 0.15, 0.30, 0.45)  # and so much farther to be got to
HIT_M = 0.02  # a seat that reaches so far into another thing hits it; by less it grazes it, as sleeves do
ASIDE_M = 0.5  # from the pelvis to where one gets to a seat from the side
LEGS_OUT_M = 0.6  # feet so far ahead of the pelvis are in the way of who comes from the side
GLANCE_FPS = 5.0  # most motions that lead into something are seen at this rate


@dataclass(frozen=True, eq=False)
class Setting:
    """The cells one can get to beside an object and its way, what one can run into, with the object moved by a shift.

    taken: (nx, ny) bool, cells that the moved object takes away, on its way too.
    """

    floor: WalkMap
    obstacles: Obstacles
    taken: BoolArray


def seat_at(
    surface: Surface, seat_pose: SeatPose, body: Body, setting: Callable[[FloatArray], Setting], still: Obstacles
) -> Seat | None:
    """The seat at one of ``seat_places``, if the body fits there and can get to it, else None.

    setting: floor and obstacles for a shift (2,) of the object. still: obstacles without the object.
    A movable seat is drawn back as little as possible; those that are meshes stay where they are.
    """
    back, item = -facing_of(surface), surface.item
    is_drawn = item.movable and not has_mesh(item)
    pulls, entries = (PULLS_M, ENTRIES_M) if is_drawn else ((0.0,), (0.0,))
    tight: Seat | None = None
    for pull_m in pulls:
        shift = quantise_m(pull_m * back)
        if tight is not None or not _chair_fits(item, shift, still):
            break
        moved, here = moved_by(seat_pose, shift), setting(shift).obstacles
        narrow = [is_narrow for is_narrow in (False, True) if _fits(moved, is_narrow, surface, body, here)]
        for entry_m in entries if narrow else ():
            entry = quantise_m(shift + entry_m * back)
            if pull_m + entry_m > PULL_M or not _chair_fits(item, entry, still):
                break
            there = setting(entry)
            place = Seat(
                item.object_id, surface.part.name, moved, (0.0, 0.0), (0.0, 0.0), 0.0, point_of(entry), point_of(shift)
            )
            for seat in _clear_seats(place, narrow, body, there):
                brushed_m = _brushed_m(seat, body, there.obstacles)
                if brushed_m <= GRAZE_M:
                    return seat
                if brushed_m <= BRUSH_M and tight is None:
                    tight = seat
    return tight


def _clear_seats(place: Seat, narrow: list[bool], body: Body, there: Setting) -> Iterator[Seat]:
    """The ways of a seat onto which one sits down without running into anything, walking up to it or sidling."""
    clear: dict[Point, Seat | None] = {}
    for approach, stand in _ways_in(place, body, there.floor):
        if stand not in clear:
            before = replace(place, stand_xy=stand, sit_down_s=_sit_down_s(place.pose, stand))
            tries = (replace(before, is_narrow=is_narrow) for is_narrow in narrow)
            clear[stand] = next((seat for seat in tries if _sits_clear(seat, body, there.obstacles)), None)
        seat = clear[stand]
        if seat is not None:
            for is_sidled in (False, True) if approach != stand else (False,):
                yield replace(seat, approach_xy=approach, is_sidled=is_sidled)


def _sit_down_s(pose: SeatPose, stand_xy: Point) -> float:
    away = np.array(pose.pelvis_m[:2]) - stand_xy
    low_m = max(0.0, LOW_M - pose.pelvis_m[2])
    return float(quantise_m(SIT_DOWN_S + SIT_DOWN_PER_M * np.sqrt(np.sum(away**2)) + LOW_PER_M_S * low_m))


def _chair_fits(item: SceneObject, shift_xy: FloatArray, still: Obstacles) -> bool:
    """Whether a moved object reaches into nothing: its corners and the middles of its edges."""
    if not shift_xy.any():
        return True
    corners = [c for solid in item.solids for c in (solid.vertices, *_edge_middles(solid))]
    points = np.concatenate(corners) + np.append(shift_xy, 0.0)
    points = points[points[:, 2] > HIT_M]
    return bool((still.depth(points, np.zeros(len(points))) <= HIT_M).all())


def _edge_middles(solid: ConvexSolid) -> list[FloatArray]:
    triangles = solid.vertices[solid.triangles]
    return [(triangles[:, k] + triangles[:, k - 1]) / 2 for k in range(3)]


def _fits(seated: SeatPose, is_narrow: bool, surface: Surface, body: Body, obstacles: Obstacles) -> bool:
    """Whether a body that sits hits nothing but the seat that gives way."""
    start = standing(body, np.array(seated.pelvis_m[:2]), seated.yaw_rad)
    sitting = folded(sit_down(start, seated, 1.0, CHECK_FPS), is_narrow).last()
    joints = pose(body, sitting, CHECK_FPS, None)
    graze_m = SEATED_GRAZE_M if surface.part.role in SEAT_ROLES else HARD_GRAZE_M
    return bool((body_depth(obstacles, body, joints, surface.item.object_id) <= graze_m).all())


def _ways_in(place: Seat, body: Body, floor: WalkMap) -> Iterator[tuple[Point, Point]]:
    """Free cells from where one gets to a seat, and where one stands before it: the cell itself, or nearer.

    The cells are those nearest to the feet, and to places on either side of the seat.
    """
    seated = place.entry_pose
    pelvis, ahead = np.array(seated.pelvis_m[:2]), np.array([np.cos(seated.yaw_rad), np.sin(seated.yaw_rad)])
    feet = np.mean(seated.balls_m, axis=0)[:2] - body.of_stature(anatomy.BALL_FORWARD) * ahead
    aside = ASIDE_M * np.array([-ahead[1], ahead[0]])
    cells: list[Point] = []
    sides = (pelvis + aside, pelvis - aside) if (feet - pelvis) @ ahead < LEGS_OUT_M else ()
    for beside in (feet, *sides):
        cell = nearest_free(floor, beside, APPROACH_M)
        if cell is None or point_of(cell[0]) in cells:
            continue
        if np.sum((cell[0] - pelvis) ** 2) > (APPROACH_M + PATCH_M / 2) ** 2 and beside is not feet:
            continue
        cells.append(point_of(cell[0]))
        yield cells[-1], cells[-1]
        for nearer_m in CALF_SHARES_M:
            stand = quantise_m(feet - nearer_m * ahead)
            if (stand - pelvis) @ ahead > 0:
                yield cells[-1], point_of(stand)


def _sits_clear(seat: Seat, body: Body, obstacles: Obstacles) -> bool:
    """Whether one sits down and gets up without running into anything."""
    start = standing(body, np.array(seat.stand_xy), seat.pose.yaw_rad)
    return all(
        _deepest(sit_on(start, seat, fps), fps, body, obstacles, seat.object_id) <= GRAZE_M
        for fps in (GLANCE_FPS, CHECK_FPS)
    )


def _brushed_m(seat: Seat, body: Body, obstacles: Obstacles) -> float:
    """By how much a body runs into anything between the free cell and before the seat, metres; more than ``BRUSH_M``
    may be less than it is.
    """
    away = np.array(seat.stand_xy) - seat.approach_xy
    if not away.any():
        return 0.0
    yaw = seat.pose.yaw_rad if seat.is_sidled else quantise_angle(float(np.arctan2(away[1], away[0])))
    there = standing(body, np.array(seat.approach_xy), yaw)
    before = standing(body, np.array(seat.stand_xy), seat.pose.yaw_rad)
    worst = 0.0
    for step, start in ((step_in, there), (step_out, before)):
        worst = max(worst, _deepest(step(body, start, seat, CHECK_FPS), CHECK_FPS, body, obstacles))
        if worst > BRUSH_M:
            break
    return worst


def _deepest(motion: Channels, fps: float, body: Body, obstacles: Obstacles, used_id: int = -1) -> float:
    """By how much a body that moves runs into anything, metres."""
    return float(body_depth(obstacles, body, pose(body, motion, fps, None), used_id).max())
