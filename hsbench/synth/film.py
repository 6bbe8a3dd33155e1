"""Filming with a static camera: the background is rendered once, people alone in tight crops, joined by depth.

Where people stand or sit the background darkens a little: those pixels of a patch keep the background's depth and id.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.io.frame_store import Patch, Picture
from hsbench.io.images import depth_from_mm, depth_to_mm
from hsbench.schema.poses import PoseTable
from hsbench.schema.scene import PERSON_ID_OFFSET, Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.people import Body, body_mesh, capsules
from hsbench.synth.render import Lighting, Mesh, Renderer, View, Window
from hsbench.synth.render.contact import REACH_M, light_left
from hsbench.synth.render.shading import GAMMA
from hsbench.synth.render.sources import person_lighting, sources_of
from hsbench.synth.render.tone import encode_srgb, toned
from hsbench.typing import FloatArray, UInt8Array

CROP_MARGIN_PX = 2
NEAR_M = 0.05  # in front of it a vertex has a pixel
DIMMED = 0.4  # people are drawn at this share of their exposed light, so that bright ones are not clipped before toning


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

    poses: true 3D poses, track_id k belongs to ``bodies[k - 1]``. lights: for people (``room_lighting``).
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
        # Embree is an extra: a generator without pictures runs without.
        from hsbench.synth.render.background import background_rgb

        camera, pose = self._camera, self.sensor.world_T_camera
        view = self.renderer.render(scene_meshes(self.scene), camera, pose, self.lights)
        return _picture(view, background_rgb(self.scene, view.ids, self.renderer, camera, pose))

    def patch(self, background: Picture, timestamp_ns: int) -> Patch:
        """What people change of the background at one time; an empty mask when nobody is in view."""
        assert self.poses.joints_m is not None
        meshes, bodies = [], []
        for row in np.flatnonzero(self.poses.timestamp_ns == timestamp_ns):
            person, joints = int(self.poses.track_id[row]), self.poses.joints_m[row].astype(np.float64)
            body = self.bodies[person - 1]
            vertices, triangles, colours = body_mesh(body, joints)
            if person not in self._meshes:
                self._meshes[person] = Mesh(PERSON_ID_OFFSET + person, vertices, triangles, colours, smooth=True)
            meshes.append(self._meshes[person].moved(vertices))
            bodies.append((body, joints))
        window = self._window(meshes)
        if window is None:
            empty = Picture(np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.uint16), np.zeros((0, 0), np.uint16))
            return Patch(timestamp_ns, 0, 0, np.zeros((0, 0), bool), empty)
        view = self.renderer.render(meshes, self._camera, self.sensor.world_T_camera, self.lights, window=window)
        people = _picture(view, displayed()[view.rgb])
        crop = (slice(window.v0, window.v0 + window.height), slice(window.u0, window.u0 + window.width))
        behind = Picture(background.rgb[crop], background.depth_mm[crop], background.instance[crop])
        shown = (people.instance > 0) & ((people.depth_mm < behind.depth_mm) | (behind.depth_mm == 0))
        shaded = self._shaded(behind, window, bodies)
        mask = shown | (shaded != behind.rgb).any(axis=-1)
        picture = Picture(
            np.where(shown[..., None], people.rgb, shaded),
            np.where(shown, people.depth_mm, behind.depth_mm),
            np.where(shown, people.instance, behind.instance),
        )
        return Patch(timestamp_ns, window.v0, window.u0, mask, picture)

    @property
    def _camera(self) -> PinholeCamera:
        assert isinstance(self.sensor.camera, PinholeCamera)
        return self.sensor.camera

    def _shaded(self, behind: Picture, window: Window, bodies: Sequence[tuple[Body, FloatArray]]) -> UInt8Array:
        """(h, w, 3) sRGB of the background in a window, darker close under people."""
        camera = self._camera
        part = replace(
            camera,
            width_px=window.width,
            height_px=window.height,
            cx_px=camera.cx_px - window.u0,
            cy_px=camera.cy_px - window.v0,
        )
        points = apply(self.sensor.world_T_camera, part.unproject(depth_from_mm(behind.depth_mm)))
        left = np.ones(behind.depth_mm.shape)
        for body, joints in bodies:
            ends, radii = capsules(body, joints[None])
            left *= light_left(points, ends[0], radii)
        rgb = behind.rgb.copy()
        close = left < 1.0
        # The display curve is close to a power, so bytes scale with a root of the light.
        rgb[close] = np.rint(rgb[close] * (left[close] ** (1 / GAMMA))[:, None])
        return rgb

    def _window(self, meshes: Sequence[Mesh]) -> Window | None:
        """The pixels that people can cover or shade, or None where they are out of view."""
        camera = self._camera
        camera_T_world = invert(self.sensor.world_T_camera)
        size = np.array([camera.width_px, camera.height_px])
        low, high = size.copy(), np.zeros(2, dtype=np.int64)
        for mesh in meshes:
            points = apply(camera_T_world, mesh.vertices)
            if points[:, 2].max() <= NEAR_M:
                continue
            points = np.concatenate([points, apply(camera_T_world, _around(mesh.vertices))])
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


def _around(vertices: FloatArray) -> FloatArray:
    """(8, 3) corners of a box that holds all that a person of (V, 3) vertices shades: nothing above the head."""
    (x0, y0, z0), (x1, y1, z1) = vertices.min(axis=0) - REACH_M, vertices.max(axis=0) + REACH_M
    return np.array([(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1 - REACH_M)])


def room_lighting(scene: Scene, camera_xy: FloatArray) -> Lighting:
    """Light for people in a scene, for a camera at a point (2,): as the background's, DIMMED."""
    lights = person_lighting(sources_of(scene), camera_xy)
    return Lighting(
        lights.ambient * DIMMED,
        tuple(replace(lamp, intensity=lamp.intensity * DIMMED) for lamp in lights.points),
        tuple(replace(sun, intensity=sun.intensity * DIMMED) for sun in lights.directionals),
    )


@cache
def displayed() -> UInt8Array:
    """(256,) what each byte that a renderer gives people is on the display: toned as the background is."""
    exposed = (np.arange(256) / 255.0) ** GAMMA / DIMMED
    return encode_srgb(np.array([toned(light) for light in exposed]))


def _picture(view: View, rgb: UInt8Array) -> Picture:
    return Picture(rgb, depth_to_mm(view.depth_m), view.ids)
