"""Pictures of parts: the object is the renderer's, and what a pixel shows lies on the surface of its part."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("embreex")

from lit_room import CAMERA, POSE, part, scene, table, thing, wardrobe

from hsbench.geometry.cameras import Camera, EquirectangularCamera
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.synth.part_pictures import label_picture, parts_seen
from hsbench.synth.render import Lighting, open_renderer
from hsbench.synth.scene_meshes import scene_meshes

ON_SURFACE_M = 1e-4


@pytest.mark.parametrize("camera", [CAMERA, EquirectangularCamera(128, 64)])
def test_every_pixel_lies_on_its_part_and_object(camera: Camera) -> None:
    seat, back = part("seat", (-0.2, -0.2, 0.42), (0.2, 0.2, 0.46)), part("back", (-0.2, 0.17, 0.46), (0.2, 0.2, 0.9))
    chair = thing(12, "chair", seat, back, at=planar(1.9, 1.75, -1.2))
    room, renderer = scene(wardrobe(), table(), chair), open_renderer("raycast")
    parts = parts_seen(room, renderer, camera, POSE)
    pairs = [(item, shape) for item in room.objects for shape in item.parts]
    view = renderer.render(scene_meshes(room), camera, POSE, Lighting(1.0))
    owners = np.array([item.object_id for item, _ in pairs], dtype=np.uint16)
    assert np.array_equal(label_picture(parts, owners), view.ids)
    points = apply(POSE, camera.unproject(view.depth_m))
    for number, (item, shape) in enumerate(pairs):
        seen = points[parts == number]
        planes = shape.solid.planes
        signed = apply(invert(item.scene_T_object), seen) @ planes[:, :3].T - planes[:, 3]
        assert np.abs(signed.max(axis=1)).max(initial=0.0) < ON_SURFACE_M
    names = {shape.name for number, (item, shape) in enumerate(pairs) if item is chair and (parts == number).any()}
    assert names == {"seat", "back"}


def test_labels_are_looked_up_and_nothing_is_zero() -> None:
    parts = np.array([[0, 2], [-1, 1]], np.int32)
    assert label_picture(parts, np.array([7, 5, 9], np.uint8)).tolist() == [[7, 9], [0, 5]]
