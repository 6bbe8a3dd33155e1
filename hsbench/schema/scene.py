"""A scene: rooms and objects made of parts. Truth; never handed out as input.

Parts of generated scenes are convex solids; parts of imported scenes may be triangle meshes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.polygons import contains, distance, signed_area
from hsbench.geometry.transforms import apply, is_rigid
from hsbench.schema.categories import ROLES, Category, category
from hsbench.schema.poses import require
from hsbench.typing import BoolArray, FloatArray, Int32Array

PERSON_ID_OFFSET = 60000  # a person's id in instance images: the offset plus the person id (1, 2, ...)

TEXTURES: frozenset[str] = frozenset(
    (
        "", "wood", "planks", "parquet", "tiles", "carpet", "weave", "stripes", "checks", "marble", "plaster", "leaves",
        "herringbone", "terrazzo", "brick", "corduroy", "dots",
    )
)  # fmt: skip
"""Procedural textures by name, drawn in the object frame; "" is plain. Pictures only: no truth depends on them."""


@dataclass(frozen=True, eq=False)
class Part:
    """A named piece of an object: geometry in the object frame, an sRGB colour and texture, and what it is for.

    solid: convex closed solid (generated scenes). mesh: (vertices (V, 3), triangles (T, 3)) of an imported,
    perhaps open, surface. Exactly one of the two.
    """

    name: str
    colour: tuple[int, int, int]
    role: str | None = None
    solid: ConvexSolid | None = None
    mesh: tuple[FloatArray, Int32Array] | None = None
    texture: str = ""

    def __post_init__(self) -> None:
        if self.texture not in TEXTURES:
            raise SchemaError(
                f"part {self.name!r} has texture {self.texture!r}; expected one of {', '.join(sorted(TEXTURES))}"
            )
        if self.role is not None and self.role not in ROLES:
            raise SchemaError(
                f"part {self.name!r} has role {self.role!r}; expected None or one of {', '.join(sorted(ROLES))}"
            )
        if (self.solid is None) == (self.mesh is None):
            raise SchemaError(f"part {self.name!r} has both or neither of solid and mesh; expected exactly one")
        if self.mesh is not None:
            vertices, triangles = self.mesh
            require(vertices, f"part {self.name!r} mesh vertices", (None, 3), np.float64)
            require(triangles, f"part {self.name!r} mesh triangles", (None, 3), np.int32)
            if triangles.size and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
                raise SchemaError(f"part {self.name!r} has triangle indices outside 0..{len(vertices) - 1}")
        if len(self.colour) != 3 or not all(isinstance(c, int) and 0 <= c <= 255 for c in self.colour):
            raise SchemaError(f"part {self.name!r} has colour {self.colour}; expected three integers 0..255")

    @property
    def vertices(self) -> FloatArray:
        """(V, 3) vertices in the object frame."""
        return self.solid.vertices if self.solid is not None else self.mesh[0]  # type: ignore[index]

    @property
    def triangles(self) -> Int32Array:
        """(T, 3) vertex indices, counter-clockwise from outside."""
        return self.solid.triangles if self.solid is not None else self.mesh[1]  # type: ignore[index]


@dataclass(frozen=True, eq=False)
class SceneObject:
    """An object: id (1..59999, unique in its scene), category name, pose, parts, and whether people move it.

    scene_T_object: (4, 4) object frame (origin on its footprint's middle, z up, front towards -y) to scene frame.
    """

    object_id: int
    category_name: str
    scene_T_object: FloatArray
    parts: tuple[Part, ...]
    movable: bool = False

    def __post_init__(self) -> None:
        category(self.category_name)
        if not 1 <= self.object_id < PERSON_ID_OFFSET:
            raise SchemaError(f"object_id is {self.object_id}; expected 1..{PERSON_ID_OFFSET - 1}")
        if not self.parts:
            raise SchemaError(f"object {self.object_id} ({self.category_name}) has no parts")
        wrong = sorted({p.role for p in self.parts if p.role is not None}.difference(self.category.roles))
        if wrong:
            raise SchemaError(
                f"object {self.object_id} ({self.category_name}) has parts of role {', '.join(wrong)};"
                f" expected of its category: {', '.join(self.category.roles) or 'none'}"
            )
        if not is_rigid(self.scene_T_object):
            raise SchemaError(f"object {self.object_id} ({self.category_name}) has a pose that is no rigid transform")

    @property
    def category(self) -> Category:
        """The row of the category table."""
        return category(self.category_name)

    @cached_property
    def solids(self) -> tuple[ConvexSolid, ...]:
        """The convex parts in the scene frame (mesh parts left out)."""
        return tuple(p.solid.transformed(self.scene_T_object) for p in self.parts if p.solid is not None)

    @cached_property
    def vertices(self) -> FloatArray:
        """(V, 3) all part vertices in the scene frame."""
        return apply(self.scene_T_object, np.concatenate([p.vertices for p in self.parts]))

    @cached_property
    def box(self) -> FloatArray:
        """(7,) amodal oriented box: centre x y z, full size l w h along the object's axes, yaw about +z."""
        local = np.concatenate([p.vertices for p in self.parts])
        low, high = local.min(axis=0), local.max(axis=0)
        centre = apply(self.scene_T_object, (low + high) / 2)
        yaw = np.arctan2(self.scene_T_object[1, 0], self.scene_T_object[0, 0])
        return np.array([*centre, *(high - low), yaw])

    def moved(self, a_T_scene: FloatArray) -> SceneObject:
        """The same object with its pose given in frame a."""
        return SceneObject(
            self.object_id, self.category_name, a_T_scene @ self.scene_T_object, self.parts, self.movable
        )


@dataclass(frozen=True, eq=False)
class Room:
    """A room: its type (``living``, ``bedroom`` ...) and (n, 2) inner outline, counter-clockwise, metres."""

    room_type: str
    outline_xy: FloatArray

    def __post_init__(self) -> None:
        outline = self.outline_xy
        require(outline, f"{self.room_type} room: outline_xy", (None, 2), np.float64)
        if len(outline) < 3:
            raise SchemaError(f"{self.room_type} room: outline_xy has {len(outline)} corners; expected at least 3")
        if not np.isfinite(outline).all():
            raise SchemaError(f"{self.room_type} room: outline_xy has a corner that is not finite; expected metres")
        if signed_area(outline) <= 0:
            raise SchemaError(
                f"{self.room_type} room: outline_xy encloses no area or is clockwise; expected counter-clockwise"
            )

    @property
    def area_m2(self) -> float:
        """Floor area in square metres."""
        return signed_area(self.outline_xy)


@dataclass(frozen=True, eq=False)
class Scene:
    """A room, flat or office at t0.

    scene_id: unique over all data sets. rooms: at least one. height_m: floor (z = 0) to ceiling.
    objects: furniture and structure (floor, ceiling, walls, door, window), ids ascending.
    style: the style family, so that a split can be checked for novelty.
    """

    scene_id: str
    rooms: tuple[Room, ...]
    height_m: float
    objects: tuple[SceneObject, ...]
    style: str = ""

    def __post_init__(self) -> None:
        if not self.rooms:
            raise SchemaError(f"scene {self.scene_id} has no rooms; expected at least one")
        if not 0 < self.height_m < 100:
            raise SchemaError(
                f"scene {self.scene_id}: height_m is {self.height_m}; expected metres (are these centimetres?)"
            )
        ids = [o.object_id for o in self.objects]
        if sorted(set(ids)) != ids:
            raise SchemaError(f"scene {self.scene_id}: object ids are not ascending and unique")

    def object(self, object_id: int) -> SceneObject:
        """The object of an id. Raises SchemaError if there is none."""
        for item in self.objects:
            if item.object_id == object_id:
                return item
        raise SchemaError(f"scene {self.scene_id} has no object {object_id}")

    def contains(self, points_xy: FloatArray) -> BoolArray:
        """(..., 2) points -> (...) bool: inside the outline of any room (doorways, in the walls, are not)."""
        return np.asarray(np.any([contains(room.outline_xy, points_xy) for room in self.rooms], axis=0))

    def room_at(self, point_xy: FloatArray) -> Room:
        """The room that holds a point (2,), else the one whose outline is nearest."""
        return min(self.rooms, key=lambda room: distance(room.outline_xy, np.asarray(point_xy, dtype=np.float64)))

    def moved(self, a_T_scene: FloatArray) -> Scene:
        """The same scene in frame a (a turn about z and a shift)."""
        rooms = tuple(
            Room(r.room_type, apply(a_T_scene, np.pad(r.outline_xy, ((0, 0), (0, 1))))[:, :2]) for r in self.rooms
        )
        objects = tuple(o.moved(a_T_scene) for o in self.objects)
        return Scene(self.scene_id, rooms, self.height_m, objects, self.style)
