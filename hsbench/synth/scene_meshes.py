"""A scene as renderers take it."""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Scene
from hsbench.synth.render.base import Mesh


def scene_meshes(scene: Scene) -> list[Mesh]:
    """One mesh an object, in the scene's frame."""
    meshes = []
    for item in scene.objects:
        counts = np.cumsum([0, *(len(p.vertices) for p in item.parts)])
        triangles = np.concatenate([p.triangles + first for p, first in zip(item.parts, counts, strict=False)])
        colours = np.concatenate([np.tile(np.array(p.colour, np.uint8), (len(p.triangles), 1)) for p in item.parts])
        meshes.append(Mesh(item.object_id, item.vertices, triangles.astype(np.int32), colours))
    return meshes
