"""What a scene offers to its people: where to sit, lie, touch and look, found when first asked for and then kept.

What depends on geometry alone is found once for all; what depends on a body, once for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import TypeVar

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.synth.activities.beds import lie_places, lies_free
from hsbench.synth.activities.catalogue import Activity
from hsbench.synth.activities.contact import Obstacles
from hsbench.synth.activities.entrance import Entrance
from hsbench.synth.activities.odd_seats import FLOOR, floor_places, odd_surfaces
from hsbench.synth.activities.seating import Setting, seat_at
from hsbench.synth.activities.seats import Seat, Surface, facing_chair, seat_places, seat_surfaces
from hsbench.synth.activities.spots import Spots, is_roofed
from hsbench.synth.activities.touches import (
    SHOULDER_STANDING_M,
    StandingTouch,
    SurfacePoint,
    Touch,
    grip_points,
    is_touchable,
    moved_touch,
    plan_touch,
    reaches,
    standing_touch,
    touch_points,
)  # fmt: skip
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels, standing
from hsbench.synth.people.lying import LiePose
from hsbench.synth.people.motion import SeatPose
from hsbench.synth.seeds import Seeds
from hsbench.truth.sittable import SEAT_ROLES
from hsbench.truth.walkable import WalkMap, blocked
from hsbench.typing import BoolArray, FloatArray

T = TypeVar("T")
Touchable = tuple[SceneObject, Part]

SWEPT_M = 0.2  # where a seat is on its way is looked at every so far
DRAWN_SHARES = (0.33, 0.67, 1.0)
PLACES_TRIED = 4  # of a surface, before it counts as taken


class Places:
    """All places of a scene. floor: the cells that can be got to. Some things are never used: ``unused_share``.

    tried: what anybody has sat on or touched so far.
    """

    def __init__(self, scene: Scene, walk: WalkMap, reachable: BoolArray, unused_share: float, seeds: Seeds) -> None:
        self.scene = scene
        self.floor = WalkMap(walk.origin_xy, walk.free & reachable, walk.cell_m)
        self.obstacles = Obstacles.of(scene)
        unused = {o.object_id for o in scene.objects if seeds.rng(o.object_id).random() < unused_share}
        self.used = [item for item in scene.objects if item.object_id not in unused]
        kept = {item.object_id for item in self.used}
        self.surfaces = [s for s in seat_surfaces(scene) if s.item.object_id in kept]
        self._odd = [s for s in odd_surfaces(scene) if s.item.object_id in kept]
        self.touchables = [(item, part) for item in self.used for part in item.parts if is_touchable(item, part)]
        self.tried: set[object] = set()  # seats and parts used so far
        self.entrance: Entrance | None = None  # a door that opens
        self._kept: dict[object, object] = {}

    def offers(self, activity: Activity) -> bool:
        """Whether there is anything in the scene for an activity."""
        match activity.how:
            case "sit" | "lie":
                return bool(self.seats_for(activity))
            case "touch":
                return bool(self.touchables_for(activity))
            case "beside":
                return bool(self.things_for(activity))
            case "fetch":
                return bool(self.touchables_for(activity)) and bool(self.tops_for(activity))
            case "leave":
                return self.entrance is not None
        return True

    def seats_for(self, activity: Activity) -> list[Surface]:
        """Surfaces on which an activity is done, those for lying among them."""
        return self._once(("seats", activity.name), lambda: [s for s in self.surfaces if self._serves(s, activity)])

    def touchables_for(self, activity: Activity) -> list[Touchable]:
        """Parts that an activity touches."""
        return self._once(
            ("touch", activity.name),
            lambda: [
                (item, part)
                for item, part in self.touchables
                if (not activity.categories or item.category_name in activity.categories)
                and (not activity.roles or part.role in activity.roles)
            ],
        )

    def tops_for(self, activity: Activity) -> list[Touchable]:
        """Tops to which an activity brings things."""
        return [(item, p) for item, p in self.touchables if p.role == "top" and item.category_name in activity.near]

    def things_for(self, activity: Activity) -> list[SceneObject]:
        """Things beside which an activity is done."""
        return [item for item in self.used if item.category_name in activity.categories]

    def anchors(self, surface: Surface, activity: Activity) -> list[SceneObject]:
        """What an activity needs near a seat: in front of it and near enough, the nearest first."""
        return self._once(("anchors", activity.name, id(surface)), lambda: list(self._anchors(surface, activity)))

    def odd_seats(self, rng: np.random.Generator) -> list[Surface]:
        """One surface not meant for sitting of each category of things, drawn."""
        by_name: dict[str, list[Surface]] = {}
        for surface in self._odd:
            by_name.setdefault(surface.item.category_name, []).append(surface)
        return [found[int(rng.integers(len(found)))] for _, found in sorted(by_name.items())]

    def setting(self, item: SceneObject, shift_xy: FloatArray) -> Setting:
        """The floor and the obstacles with an object moved."""
        if not shift_xy.any():
            return self._once("t0", lambda: Setting(self.floor, self.obstacles, np.zeros_like(self.floor.free)))
        key = ("setting", item.object_id, *shift_xy.tolist())
        return self._once(key, lambda: self._moved(item, shift_xy))

    def without(self, item: SceneObject) -> Obstacles:
        """The obstacles but for one object."""
        return self._once(("still", item.object_id), lambda: self.obstacles.without(item.object_id))

    def seat(self, surface: Surface, body: Body, rng: np.random.Generator) -> Seat | None:
        """A place on a surface where a body fits, the first in a random order of some; or None."""
        places = self._once(("places", body, id(surface)), lambda: list(self._poses(surface, body)))
        for k in rng.permutation(len(places))[:PLACES_TRIED].tolist():
            seat = self._once(("seat", body, id(surface), k), partial(self._seat, surface, places[k], body))
            if seat is not None:
                return seat
        return None

    def spots(self, surface: Surface) -> Spots | None:
        """The cells of a seat, and which have been sat on so far; None of a mesh part, of what is no seat, and of a
        lower bunk.
        """
        if surface.part.solid is None or surface.part.role not in SEAT_ROLES or is_roofed(surface):
            return None
        return self._once(("spots", surface.item.object_id, surface.part.name), lambda: Spots.of(surface))

    def lying(self, surface: Surface, body: Body, rng: np.random.Generator) -> tuple[Seat, LiePose] | None:
        """A place to lie and the seat on its edge, or None."""
        found = self._once(("lie", body, id(surface)), lambda: list(self._lying(surface, body)))
        return found[int(rng.integers(len(found)))] if found else None

    def touch(
        self, thing: Touchable, body: Body, ways: tuple[tuple[int, ...], ...], rng: np.random.Generator
    ) -> StandingTouch | None:
        """A standing touch of a part with one of some ways (hands), at the first of its points in random order that
        works; or None.
        """
        item, part = thing
        points = self.points(thing)
        for k in rng.permutation(len(points)).tolist():
            found = self._once(
                ("stand", body, ways, item.object_id, part.name, k),
                partial(standing_touch, item, part, points[k], ways, body, self.floor, self.obstacles),
            )
            if found is not None:
                return found
        return None

    def grip(self, surface: Surface, seat: Seat, body: Body, hand: int) -> Touch | None:
        """How someone who stands where one gets to a seat takes hold of it, there and in its use position."""
        return self._once(("grip", body, hand, id(surface), seat), lambda: self._grip(surface, seat, body, hand))

    def points(self, thing: Touchable) -> list[SurfacePoint]:
        """Points of a part worth a touch."""
        item, part = thing
        return self._once(("points", item.object_id, part.name), lambda: touch_points(item, part))

    def _once(self, key: object, find: Callable[[], T]) -> T:
        if key not in self._kept:
            self._kept[key] = find()
        return self._kept[key]  # type: ignore[return-value]

    def _serves(self, surface: Surface, activity: Activity) -> bool:
        if activity.categories and surface.item.category_name not in activity.categories:
            return False
        return not activity.near or bool(self.anchors(surface, activity))

    def _anchors(self, surface: Surface, activity: Activity) -> Iterable[SceneObject]:
        middle = surface.item.box[:2]
        facing = surface.item.scene_T_object[:2, :2] @ surface.front
        room = self.scene.room_at(middle)
        near = []
        for item in self.used:
            if item.category_name in activity.near:
                away = _nearest(item, middle) - middle
                distance = float(quantise_m(np.sqrt(np.sum(away**2))))
                ahead = float((item.box[:2] - middle) @ facing) > 0.0
                if ahead and distance <= activity.within_m and self.scene.room_at(item.box[:2]) is room:
                    near.append((distance, item.object_id, item))
        return (item for _, _, item in sorted(near, key=lambda n: n[:2]))

    def _moved(self, item: SceneObject, shift_xy: FloatArray) -> Setting:
        steps = int(np.ceil(np.sqrt(np.sum(shift_xy**2)) / SWEPT_M))
        way = [planar(float(x), float(y), 0.0) for x, y in np.outer(np.arange(1, steps + 1) / steps, shift_xy)]
        floor = blocked(self.floor, [solid.transformed(pose) for pose in way for solid in item.solids])
        obstacles = self.obstacles.with_moved(item.object_id, shift_xy)
        return Setting(floor, obstacles, self.floor.free & ~floor.free)

    def _poses(self, surface: Surface, body: Body) -> Iterable[SeatPose]:
        if surface.item.category_name == FLOOR:
            return floor_places(surface, body, self.floor, self.obstacles)
        return seat_places(surface, body)

    def _seat(self, surface: Surface, pose: SeatPose, body: Body) -> Seat | None:
        item = surface.item
        return seat_at(surface, pose, body, lambda shift: self.setting(item, shift), self.without(item))

    def _grip(self, surface: Surface, seat: Seat, body: Body, hand: int) -> Touch | None:
        part, points = grip_points(surface.item)
        xy = np.array(seat.approach_xy)
        start, eye = standing(body, xy, facing_chair(surface, seat)), np.array([*xy, SHOULDER_STANDING_M])
        ways = ((hand,), (1 - hand,))
        for point in points:
            touch = plan_touch(surface.item, part, point, eye, start, body, self.obstacles, ways)
            if touch is not None and self._draws(touch, surface.item, np.array(seat.entry_xy), start, body):
                return touch
        return None

    def _draws(self, touch: Touch, item: SceneObject, shift_xy: FloatArray, start: Channels, body: Body) -> bool:
        """Whether a hand gets along while it draws an object by a shift, and the body stays clear of it."""
        way = [quantise_m(share * shift_xy) for share in DRAWN_SHARES]
        return all(
            reaches(moved_touch(touch, xy), start, body, self.obstacles.with_moved(item.object_id, xy)) for xy in way
        )

    def _lying(self, surface: Surface, body: Body) -> Iterable[tuple[Seat, LiePose]]:
        for seat_pose, lie in lie_places(surface, body):
            seat = self._seat(surface, seat_pose, body)
            if seat is not None and not seat.is_narrow and lies_free(seat, lie, body, self.obstacles):
                yield seat, lie


def _nearest(item: SceneObject, xy: FloatArray) -> FloatArray:
    """(2,) the point of an object's box that is nearest to a point, on the floor plan."""
    x, y, _, length, width, _, yaw = item.box
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s], [s, c]])
    local = (xy - (x, y)) @ turn
    half = np.array([length, width]) / 2
    return np.asarray(turn @ np.clip(local, -half, half) + (x, y))
