"""From labelled nodes to objects: which triangles belong together, in which frame, as solids or as meshes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hsbench.datasets.importers.scene_labels import IGNORE, Label, LabelTable, label_of_extras, nearest_names
from hsbench.datasets.importers.scene_labels import NAMES as CATEGORY_NAMES
from hsbench.datasets.importers.scene_source import Rgb, SourceMesh, SourceNode
from hsbench.errors import DataError, SchemaError
from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.footprints import hull, smallest_yaw
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import apply, invert, is_rigid, planar, rotation_z
from hsbench.geometry.triangle_meshes import as_convex, outward, pieces, weld
from hsbench.schema.categories import category
from hsbench.schema.scene import PERSON_ID_OFFSET, Part, SceneObject
from hsbench.typing import FloatArray, Int32Array

SNAP_M = 1e-6
"""A coordinate this near to a multiple of .1 mm is that multiple: float32 in files is good to 5e-7 m up to 8 m."""

COORDINATE_DECIMALS = 6  # what is not near one keeps a micrometre
MIN_SOLID_M = 0.01
"""Only what is as thick as this becomes a convex solid: thinner ones could slip between the points of truth."""

CHIEF_ROLES = ("seat", "mattress", "top", "shelf", "screen", "board", "door")
"""Roles that a whole object can have: of a seat, a mattress and a top only fitting surfaces count."""

SHOWN = 12  # nodes named in one message

Key = tuple[str, ...]
IGNORED: Key = (IGNORE,)


@dataclass(frozen=True, eq=False)
class LabelledMesh:
    """Triangles of one part, vertices in the scene frame; name and role of the part.

    original: the part itself, if a file of ours holds it.
    """

    name: str
    role: str | None
    colour: Rgb
    vertices: FloatArray
    triangles: Int32Array
    original: Part | None = None


@dataclass(eq=False)
class Group:
    """What becomes one object. scene_T_node: affine transform of the node whose label it is. object_id: a file of ours
    says it, and then the node's frame is the object's.
    """

    name: str
    category: str
    scene_T_node: FloatArray
    object_id: int | None = None
    movable: bool = False
    meshes: list[LabelledMesh] = field(default_factory=list)


def group_nodes(
    nodes: tuple[SourceNode, ...], scene_T_nodes: list[FloatArray], table: LabelTable, default: str | None
) -> tuple[list[Group], list[str]]:
    """Nodes with their transforms -> (objects to be, in the order of the file; notes).

    default: the category of nodes without a label. Raises DataError for such nodes if there is none.
    """
    grouping = _Grouping(nodes, scene_T_nodes, table, default)
    for index in range(len(nodes)):
        grouping.add(index)
    if grouping.unlabelled:
        raise DataError(_unlabelled(grouping.unlabelled))
    groups = [group for group in grouping.groups.values() if group.meshes]
    return groups, [*grouping.notes, *_unused(table, grouping.used, nodes), *_give_roles(groups)]


class _Grouping:
    """Nodes put into groups one by one, parents first: a node without a category joins the group of its parent."""

    def __init__(
        self, nodes: tuple[SourceNode, ...], scene_T_nodes: list[FloatArray], table: LabelTable, default: str | None
    ) -> None:
        self.nodes, self.scene_T_nodes, self.table, self.default = nodes, scene_T_nodes, table, default
        self.groups: dict[Key, Group] = {}
        self.key_of_node: list[Key | None] = []
        self.used: set[tuple[str, str]] = set()
        self.unlabelled: list[str] = []
        self.notes: list[str] = []

    def add(self, index: int) -> None:
        """Put the meshes of a node where its label, or that of their material, says."""
        node = self.nodes[index]
        label = self.lookup(node.name) or label_of_extras(node.extras, f"node {node.name!r}")
        inherited = self.key_of_node[node.parent] if node.parent >= 0 else None
        if label.category is None and inherited is None and self.default is not None and node.meshes:
            label = replace(label, category=self.default)
        key = self.claim(index, label) if label.category else inherited
        self.key_of_node.append(key)
        for mesh in node.meshes:
            detail = self.lookup(node.name, mesh.material) or Label()
            own = self.claim(index, detail, mesh.material) if detail.category else key
            if own is None:
                self.unlabelled.append(_shown(node, mesh))
            elif own != IGNORED:
                found = _in_scene(node, mesh, detail.role or label.role, self.scene_T_nodes[index], self.notes)
                if mesh.exact and np.array_equal(self.scene_T_nodes[index], self.groups[own].scene_T_node):
                    found = [replace(item, original=_original(item, mesh, node.extras)) for item in found]
                self.groups[own].meshes += found

    def lookup(self, node: str, part: str = "") -> Label | None:
        """What the table says; its row is marked as used."""
        match = self.table.find(node, part)
        if match is None:
            return None
        self.used.add(match[0])
        return match[1]

    def claim(self, index: int, label: Label, part: str = "") -> Key:
        """The group that a label with a category names, made if need be."""
        assert label.category is not None
        if label.category == IGNORE:
            return IGNORED
        key: Key = ("object", label.object) if label.object else ("node", str(index), label.category if part else "")
        if key not in self.groups:
            node, name = self.nodes[index], label.object or self.nodes[index].name
            object_id = None if part or label.object else _object_id(node.extras)
            frame = self.scene_T_nodes[index]
            self.groups[key] = Group(name, label.category, frame, object_id, bool(label.movable))
        if self.groups[key].category != label.category:
            both = f"{self.groups[key].category} and {label.category}"
            raise DataError(f"object {label.object!r} is both {both}; expected one category")
        return key


def build_objects(groups: list[Group]) -> tuple[SceneObject, ...]:
    """The objects, ids as a file of ours gives them, else 1, 2, ... in the order of the file."""
    ids = [group.object_id for group in groups]
    if None in ids or len(set(ids)) != len(ids):
        ids = list(range(1, len(groups) + 1))
    if len(groups) >= PERSON_ID_OFFSET:
        raise DataError(f"{len(groups):,} objects; expected fewer than {PERSON_ID_OFFSET:,} (join nodes in the table)")
    numbered = sorted(
        ((i, group) for i, group in zip(ids, groups, strict=True) if i is not None), key=lambda pair: pair[0]
    )
    return tuple(_build(group, object_id) for object_id, group in numbered)


def snapped(coordinates: FloatArray) -> FloatArray:
    """Metres rounded so that neither the noise of float32 nor that of a product of transforms is left."""
    near = quantise_m(coordinates)
    fine = np.round(coordinates, COORDINATE_DECIMALS) + 0.0
    return np.where(np.abs(coordinates - near) <= SNAP_M, near, fine)


def _give_roles(groups: list[Group]) -> list[str]:
    """Give the parts of objects without any role the chief one of their category, if it has one; a note says so."""
    given: dict[str, str] = {}
    for group in groups:
        role = next(iter(category(group.category).roles), None)
        if role in CHIEF_ROLES and not any(mesh.role or mesh.original for mesh in group.meshes):
            group.meshes = [replace(mesh, role=role) for mesh in group.meshes]
            given[group.category] = role
    if not given:
        return []
    shown = ", ".join(f"{name} as {role}" for name, role in sorted(given.items()))
    return [f"objects none of whose parts has a role are used as their category is: {shown}"]


def _object_id(extras: Mapping[str, Any]) -> int | None:
    value = extras.get("object_id")
    valid = isinstance(value, int) and not isinstance(value, bool) and 1 <= value < PERSON_ID_OFFSET
    return value if valid else None


def _in_scene(
    node: SourceNode, mesh: SourceMesh, role: str | None, scene_T_node: FloatArray, notes: list[str]
) -> list[LabelledMesh]:
    """The mesh in the scene frame; turned if the transform mirrors; none, with a note, if it has no triangles."""
    vertices = apply(scene_T_node, mesh.vertices)
    triangles = mesh.triangles if np.linalg.det(scene_T_node[:3, :3]) > 0 else mesh.triangles[:, ::-1]
    name = node.name if len(node.meshes) == 1 else f"{node.name} {mesh.material}"
    if not len(weld(snapped(vertices), triangles)[1]):
        notes.append(f"node {node.name!r} has a mesh without triangles; left out")
        return []
    return [LabelledMesh(name, role, mesh.colour, vertices, triangles)]


def _original(item: LabelledMesh, mesh: SourceMesh, extras: Mapping[str, Any]) -> Part | None:
    """The part that was exported, None if the extras do not fit the mesh any more."""
    texture = extras.get("texture", "")
    try:
        if extras.get("convex") is not True:
            return Part(item.name, item.colour, item.role, mesh=(mesh.vertices, mesh.triangles), texture=texture)
        solid = ConvexSolid(mesh.vertices, mesh.triangles)
        solid.check()
        return Part(item.name, item.colour, item.role, solid, texture=texture)
    except (SchemaError, TypeError):
        return None


def _build(group: Group, object_id: int) -> SceneObject:
    pose, own = _pose(group)
    parts = []
    for mesh in group.meshes:
        if own and mesh.original is not None:
            parts.append(mesh.original)
            continue
        vertices, triangles = weld(snapped(apply(invert(pose), mesh.vertices)), mesh.triangles)
        if category(group.category).group != "structure":  # a room's faces, seen from within, are inside out
            triangles = outward(triangles, pieces(vertices, triangles))
        solid = as_convex(vertices, triangles)
        if solid is not None and _thickness(solid) < MIN_SOLID_M - SNAP_M:
            solid = None
        parts.append(Part(mesh.name, mesh.colour, mesh.role, solid, None if solid else (vertices, triangles)))
    try:
        return SceneObject(object_id, group.category, pose, tuple(parts), group.movable)
    except SchemaError as error:
        raise DataError(f"node {group.name!r}: {error}") from error


def _pose(group: Group) -> tuple[FloatArray, bool]:
    """(scene_T_object (4, 4), whether it is the node's own). A file of ours gives the poses of its objects. Of others
    the origin is on the floor in the middle of the smallest rectangle around the footprint, and the yaw runs along its
    sides: of four such, the nearest to the yaw of the node.
    """
    frame = group.scene_T_node
    if group.object_id is not None and is_rigid(frame) and np.allclose(frame[2, :3], [0, 0, 1], atol=1e-9):
        return frame, True
    points = hull(np.concatenate([mesh.vertices[:, :2] for mesh in group.meshes]))
    yaw = smallest_yaw(snapped(points), float(np.arctan2(frame[1, 0], frame[0, 0])))
    turn = rotation_z(yaw)[:2, :2]
    local = points @ turn
    x, y = quantise_m(turn @ (local.min(axis=0) + local.max(axis=0)) / 2)
    return planar(float(x), float(y), yaw), False


def _thickness(solid: ConvexSolid) -> float:
    """The least distance between a face plane and the vertex farthest from it."""
    return float((solid.planes[:, 3] - (solid.vertices @ solid.planes[:, :3].T).min(axis=0)).min())


def _shown(node: SourceNode, mesh: SourceMesh) -> str:
    text = f"{node.name!r}" if len(node.meshes) == 1 else f"{node.name!r} part {mesh.material!r}"
    like = nearest_names(node.name, CATEGORY_NAMES, 1)
    return f"{text} ({like[0]}?)" if like else text


def _unlabelled(nodes: list[str]) -> str:
    names = list(dict.fromkeys(nodes))
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return (
        f"{len(names)} nodes have no label: {', '.join(names[:SHOWN])}{more};"
        " give each a category in --labels, or all of them --default object"
    )


def _unused(table: LabelTable, used: set[tuple[str, str]], nodes: tuple[SourceNode, ...]) -> list[str]:
    """A note on the rows of the table that no node answers to."""
    missing = [key for key in table.labels if key not in used]
    if not missing:
        return []
    names = list(dict.fromkeys(node.name for node in nodes))
    shown = []
    for node, part in missing[:SHOWN]:
        like = nearest_names(node, names, 1)
        shown.append(f"{node!r}" + (f" part {part!r}" if part else "") + (f" (is it {like[0]!r}?)" if like else ""))
    return [f"{len(missing)} labels fit no node: {', '.join(shown)}; the nodes are {', '.join(names[:SHOWN])}"]
