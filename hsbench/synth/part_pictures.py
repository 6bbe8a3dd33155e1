"""Which part of which object each pixel of a room shows, and from it any picture of labels: semantic, part, affordance.

Parts are numbered as everywhere: through the scene's objects and the parts of each (``PartAffordances`` has its rows in
this order). People are no parts: where they stand, the frames' instance pictures say so.
"""

from __future__ import annotations

import numpy as np

from hsbench.geometry.cameras import Camera
from hsbench.schema.scene import Scene
from hsbench.synth.render import Renderer, Window
from hsbench.synth.render.surfaces import surfaces_of, triangles_seen
from hsbench.synth.scene_meshes import facing
from hsbench.typing import AnyArray, FloatArray, Int32Array


def parts_seen(scene: Scene, renderer: Renderer, camera: Camera, world_T_camera: FloatArray) -> Int32Array:
    """(h, w) number of the part that each pixel shows, -1 for none; the scene is in the world frame."""
    surfaces = surfaces_of(facing(scene, world_T_camera[:3, 3]).objects)
    every = np.ones(len(surfaces.corners), dtype=np.bool_)
    triangle = triangles_seen(surfaces, every, renderer, camera, world_T_camera, Window.full(camera))
    return np.append(surfaces.part, np.int32(-1))[triangle]


def label_picture(parts: Int32Array, labels: AnyArray) -> AnyArray:
    """(h, w) parts and (P,) a label a part -> (h, w) the label of what each pixel shows, 0 for nothing."""
    return np.append(labels, np.zeros(1, labels.dtype))[parts]
