"""Filming with a static camera: the background is rendered once, people alone in tight crops, joined by depth.

Where people stand or sit the background darkens a little: those pixels of a patch keep the background's depth and id.
While a thing is not where it was at t0, people stand before the picture of the moved room (``moved_room``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import apply
from hsbench.io.frame_store import Patch, Picture
from hsbench.io.images import depth_from_mm, depth_to_mm
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.poses import PoseTable
from hsbench.schema.scene import PERSON_ID_OFFSET, Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.crops import corners_of, cut, differs, joined, window_of, within
from hsbench.synth.moved_room import MovedRoom
from hsbench.synth.people import Body, body_mesh, capsules
from hsbench.synth.render import Lighting, Mesh, Renderer, View, Window
from hsbench.synth.render.contact import REACH_M, light_left
from hsbench.synth.render.shading import GAMMA
from hsbench.synth.render.sources import person_lighting, sources_of
from hsbench.synth.render.tone import encode_srgb, toned
from hsbench.synth.scene_meshes import facing
from hsbench.typing import FloatArray, UInt8Array

DIMMED = 0.4  # people are drawn at this share of their exposed light, so that bright ones are not clipped before toning


@dataclass(frozen=True, eq=False)
class Filming:
    """A static sensor in a scene with people; all in the episode frame.

    poses: true 3D poses, track_id k belongs to ``bodies[k - 1]``. lights: for people (``room_lighting``).
    motions: of things in the scene.
    """

    scene: Scene
    bodies: Sequence[Body]
    poses: PoseTable
    sensor: Sensor
    renderer: Renderer
    lights: Lighting
    motions: ObjectMotions = field(default_factory=ObjectMotions.none)
    _meshes: dict[int, Mesh] = field(default_factory=dict, repr=False)  # a body's mesh, moved from frame to frame

    def background(self) -> Picture:
        """The room at t0 without people."""
        # Embree is an extra: a generator without pictures runs without.
        from hsbench.synth.render.background import background_rgb

        camera, pose = self._camera, self.sensor.world_T_camera
        view = self.renderer.render(self._room.meshes, camera, pose, self.lights)
        return _picture(view, background_rgb(self._shown, view.ids, self.renderer, camera, pose))

    def patch(self, background: Picture, timestamp_ns: int) -> Patch:
        """What people and moved things change of the background at one time; an empty mask when none is in view."""
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
        room, changed = self._room.picture(background, timestamp_ns)
        near = self._window(meshes)
        window = joined(near, changed)
        if window is None:
            empty = Picture(np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.uint16), np.zeros((0, 0), np.uint16))
            return Patch(timestamp_ns, 0, 0, np.zeros((0, 0), bool), empty)
        behind = cut(room, window)
        picture = Picture(behind.rgb.copy(), behind.depth_mm.copy(), behind.instance.copy())
        if near is not None:
            view = self.renderer.render(meshes, self._camera, self.sensor.world_T_camera, self.lights, window=near)
            part = cut(picture, within(near, window))
            part.rgb[:] = self._shaded(part, near, bodies)
            _stand_before(part, _picture(view, displayed()[view.rgb]))
        mask = differs(picture, cut(background, window)) | (picture.instance > PERSON_ID_OFFSET)
        return Patch(timestamp_ns, window.v0, window.u0, mask, picture)

    @cached_property
    def _room(self) -> MovedRoom:
        return MovedRoom(self._shown, self.motions, self.sensor, self.renderer)

    @cached_property
    def _shown(self) -> Scene:
        return facing(self.scene, self.sensor.world_T_camera[:3, 3])

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
        return window_of(self.sensor, [(mesh.vertices, _shaded_box(mesh.vertices)) for mesh in meshes])


def _stand_before(picture: Picture, people: Picture) -> None:
    """Draw people over what lies farther away, in place."""
    shown = (people.instance > 0) & ((people.depth_mm < picture.depth_mm) | (picture.depth_mm == 0))
    picture.rgb[shown] = people.rgb[shown]
    picture.depth_mm[shown] = people.depth_mm[shown]
    picture.instance[shown] = people.instance[shown]


def _shaded_box(vertices: FloatArray) -> FloatArray:
    """(8, 3) corners of a box that holds all that a person of (V, 3) vertices shades: nothing above the head."""
    return corners_of(vertices.min(axis=0) - REACH_M, vertices.max(axis=0) + (REACH_M, REACH_M, 0.0))


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
