"""Filming with a static camera: the background is rendered once, people alone in tight crops, joined by depth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hsbench.geometry.transforms import apply, invert
from hsbench.io.frame_store import Patch, Picture
from hsbench.io.images import depth_to_mm
from hsbench.schema.poses import PoseTable
from hsbench.schema.scene import PERSON_ID_OFFSET, Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.people import Body, body_mesh
from hsbench.synth.render import Lighting, Mesh, Renderer, View, Window
from hsbench.typing import FloatArray, UInt8Array

SUPERSAMPLE = 2  # of the background's colours, paid once
CROP_MARGIN_PX = 2
NEAR_M = 0.05  # in front of it a vertex has a pixel


def scene_meshes(scene: Scene) -> list[Mesh]:
    """One mesh an object, in the scene's frame."""
    meshes = []
    for item in scene.objects:
        counts = np.cumsum([0, *(len(p.vertices) for p in item.parts)])
        triangles = np.concatenate([p.triangles + first for p, first in zip(item.parts, counts, strict=False)])
        colours = np.concatenate([np.tile(np.array(p.colour, np.uint8), (len(p.triangles), 1)) for p in item.parts])
        meshes.append(Mesh(item.object_id, item.vertices, triangles.astype(np.int32), colours))
    return meshes


@dataclass(frozen=True, eq=False)
class Filming:
    """A static sensor in a scene with people; all in the episode frame.

    poses: true 3D poses, track_id k belongs to ``bodies[k - 1]``.
    """

    scene: Scene
    bodies: Sequence[Body]
    poses: PoseTable
    sensor: Sensor
    renderer: Renderer
    lights: Lighting
    _meshes: dict[int, Mesh] = field(default_factory=dict, repr=False)  # a body's mesh, moved from frame to frame

    def background(self) -> Picture:
        """The room at t0 without people."""
        return _picture(
            self.renderer.render(
                scene_meshes(self.scene),
                self.sensor.camera,  # type: ignore[arg-type]
                self.sensor.world_T_camera,
                self.lights,
                supersample=SUPERSAMPLE,
            )
        )

    def patch(self, background: Picture, timestamp_ns: int) -> Patch:
        """What people change of the background at one time; an empty mask when nobody is in view."""
        rows = np.flatnonzero(self.poses.timestamp_ns == timestamp_ns)
        assert self.poses.joints_m is not None
        meshes = []
        for row in rows:
            person = int(self.poses.track_id[row])
            vertices, triangles, colours = body_mesh(
                self.bodies[person - 1], self.poses.joints_m[row].astype(np.float64)
            )
            if person not in self._meshes:
                self._meshes[person] = Mesh(PERSON_ID_OFFSET + person, vertices, triangles, colours, smooth=True)
            meshes.append(self._meshes[person].moved(vertices))
        window = self._window(meshes)
        if window is None:
            empty = Picture(np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.uint16), np.zeros((0, 0), np.uint16))
            return Patch(timestamp_ns, 0, 0, np.zeros((0, 0), bool), empty)
        view = self.renderer.render(
            meshes,
            self.sensor.camera,  # type: ignore[arg-type]
            self.sensor.world_T_camera,
            self.lights,
            window=window,
        )
        picture = _picture(view)
        crop = (slice(window.v0, window.v0 + window.height), slice(window.u0, window.u0 + window.width))
        behind = background.depth_mm[crop]
        mask = (picture.instance > 0) & ((picture.depth_mm < behind) | (behind == 0))
        return Patch(timestamp_ns, window.v0, window.u0, mask, picture)

    def _window(self, meshes: Sequence[Mesh]) -> Window | None:
        """The pixels that people can cover, or None where they are out of view."""
        camera = self.sensor.camera
        camera_T_world = invert(self.sensor.world_T_camera)
        size = np.array([camera.width_px, camera.height_px])
        low, high = size.copy(), np.zeros(2, dtype=np.int64)
        for mesh in meshes:
            points = apply(camera_T_world, mesh.vertices)
            if points[:, 2].max() <= NEAR_M:
                continue
            if points[:, 2].min() <= NEAR_M:  # somebody stands against the lens
                low, high = np.zeros(2, dtype=np.int64), size
                break
            pixels, _ = camera.project(points)
            low = np.minimum(low, np.floor(pixels.min(axis=0)).astype(np.int64) - CROP_MARGIN_PX)
            high = np.maximum(high, np.ceil(pixels.max(axis=0)).astype(np.int64) + CROP_MARGIN_PX)
        low, high = np.clip(low, 0, size), np.clip(high, 0, size)
        if (high <= low).any():
            return None
        return Window(int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]))


def room_lighting(scene: Scene, camera_xy: FloatArray) -> Lighting:
    """Indoor light for the camera's room."""
    outline = scene.room_at(camera_xy).outline_xy
    low, high = outline.min(axis=0), outline.max(axis=0)
    return Lighting.indoor((float(low[0]), float(low[1]), 0.0), (float(high[0]), float(high[1]), scene.height_m))


def _picture(view: View) -> Picture:
    rgb: UInt8Array = view.rgb
    return Picture(rgb, depth_to_mm(view.depth_m), view.ids)
