"""A scene: a room outline and objects made of parts. Truth; never handed out as input.

Parts of generated scenes are convex solids; parts of imported scenes may be triangle meshes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.polygons import signed_area
from hsbench.geometry.transforms import apply, is_rigid
from hsbench.schema.categories import Category, category
from hsbench.schema.poses import require
from hsbench.typing import FloatArray, Int32Array

PERSON_ID_OFFSET = 60000  # a person's id in instance images: the offset plus the person id (1, 2, ...)

ROLES: frozenset[str] = frozenset(
    ("seat", "mattress", "top", "shelf", "handle", "door", "drawer", "screen", "switch", "tap", "front", "board")
)
"""Functional roles of parts: what affordances are computed from. A part without one has role None."""


@dataclass(frozen=True, eq=False)
class Part:
    """A named piece of an object: geometry in the object frame, an sRGB colour, and what it is for.

    solid: convex closed solid (generated scenes). mesh: (vertices (V, 3), triangles (T, 3)) of an imported,
    perhaps open, surface. Exactly one of the two.
    """

    name: str
    colour: tuple[int, int, int]
    role: str | None = None
    solid: ConvexSolid | None = None
    mesh: tuple[FloatArray, Int32Array] | None = None

    def __post_init__(self) -> None:
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
class Scene:
    """A room at t0.

    scene_id: unique over all data sets. room_type: ``living``, ``bedroom`` ...
    room_xy: (n, 2) inner outline, counter-clockwise, metres. height_m: floor (z = 0) to ceiling.
    objects: furniture and structure (floor, ceiling, walls, door, window), ids ascending.
    style: the style family, so that a split can be checked for novelty.
    """

    scene_id: str
    room_type: str
    room_xy: FloatArray
    height_m: float
    objects: tuple[SceneObject, ...]
    style: str = ""

    def __post_init__(self) -> None:
        if self.room_xy.ndim != 2 or self.room_xy.shape[1] != 2 or len(self.room_xy) < 3:
            raise SchemaError(f"scene {self.scene_id}: room_xy has shape {self.room_xy.shape}; expected (n >= 3, 2)")
        if not np.isfinite(self.room_xy).all():
            raise SchemaError(f"scene {self.scene_id}: room_xy has a corner that is not finite; expected metres")
        if signed_area(self.room_xy) <= 0:
            raise SchemaError(
                f"scene {self.scene_id}: room_xy encloses no area or is clockwise; expected counter-clockwise"
            )
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

    def moved(self, a_T_scene: FloatArray) -> Scene:
        """The same scene in frame a (a turn about z and a shift)."""
        corners = np.column_stack([self.room_xy, np.zeros(len(self.room_xy))])
        return Scene(
            self.scene_id,
            self.room_type,
            apply(a_T_scene, corners)[:, :2],
            self.height_m,
            tuple(o.moved(a_T_scene) for o in self.objects),
            self.style,
        )
