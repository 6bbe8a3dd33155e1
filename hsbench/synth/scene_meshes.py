"""A scene as renderers take it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsbench.geometry.transforms import apply
from hsbench.geometry.triangle_meshes import double_areas, pieces, weld
from hsbench.schema.scene import Part, Scene
from hsbench.synth.render.base import Mesh
from hsbench.truth.meshes import has_mesh
from hsbench.typing import FloatArray


def scene_meshes(scene: Scene) -> list[Mesh]:
    """One mesh an object, in the scene's frame."""
    meshes = []
    for item in scene.objects:
        counts = np.cumsum([0, *(len(p.vertices) for p in item.parts)])
        triangles = np.concatenate([p.triangles + first for p, first in zip(item.parts, counts, strict=False)])
        colours = np.concatenate([np.tile(np.array(p.colour, np.uint8), (len(p.triangles), 1)) for p in item.parts])
        meshes.append(Mesh(item.object_id, item.vertices, triangles.astype(np.int32), colours))
    return meshes


def facing(scene: Scene, eye: FloatArray) -> Scene:
    """The scene with the sheets of its meshes turned towards a point (3,): renderers leave out the backs of faces."""
    objects = [
        replace(item, parts=tuple(_facing(part, item.scene_T_object, eye) for part in item.parts))
        if has_mesh(item)
        else item
        for item in scene.objects
    ]
    return replace(scene, objects=tuple(objects))


def _facing(part: Part, scene_T_object: FloatArray, eye: FloatArray) -> Part:
    if part.mesh is None:
        return part
    vertices, triangles = part.mesh
    corners = apply(scene_T_object, vertices)
    turned = ((eye - corners[triangles[:, 0]]) * double_areas(corners, triangles)).sum(axis=1) < 0
    welded = weld(vertices, triangles)
    if len(welded[1]) == len(triangles):  # else pieces are not known triangle by triangle
        found = pieces(*welded)
        turned &= ~found.closed[found.of]
    mesh = vertices, np.ascontiguousarray(np.where(turned[:, None], triangles[:, ::-1], triangles))
    return replace(part, mesh=mesh)
