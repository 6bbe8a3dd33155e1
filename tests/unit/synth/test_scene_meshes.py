"""Sheets are turned towards who looks at them, closed pieces stay as they are."""

from __future__ import annotations

import numpy as np
import trimesh

from hsbench.geometry.transforms import apply, planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.synth.scene_meshes import facing

OUTLINE = np.array([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]])


def scene_of(vertices: np.ndarray, triangles: np.ndarray) -> Scene:
    part = Part("part", (9, 9, 9), mesh=(np.array(vertices, dtype=np.float64), np.array(triangles, dtype=np.int32)))
    return Scene("room", (Room("room", OUTLINE),), 2.6, (SceneObject(1, "object", planar(0.3, 0.1, 0.7), (part,)),))


def test_triangles_that_hang_loose_face_the_eye() -> None:
    rng, eye = np.random.default_rng(4), np.array([0.5, -0.5, 1.6])
    scene = scene_of(rng.uniform(-2, 2, (60, 3)), np.arange(60).reshape(20, 3))
    (item,) = facing(scene, eye).objects
    a, b, c = np.moveaxis(apply(item.scene_T_object, item.parts[0].vertices)[item.parts[0].triangles], 1, 0)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), eye - a) > 0).all()
    before = np.sort(scene.objects[0].parts[0].triangles, axis=1)
    assert np.array_equal(np.sort(item.parts[0].triangles, axis=1), before)


def test_a_closed_box_is_left_as_it_is() -> None:
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    scene = scene_of(box.vertices, box.faces)
    (item,) = facing(scene, np.array([2.0, 2.0, 2.0])).objects
    assert np.array_equal(item.parts[0].triangles, box.faces)
