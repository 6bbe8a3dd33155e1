"""Filming with a static camera: the background is rendered once, people are drawn before it frame by frame.

Where people stand or sit the background darkens a little: those pixels of a patch keep the background's depth and id.
While a thing is not where it was at t0, people stand before the picture of the moved room (``moved_room``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, partial, reduce

import numba
import numpy as np

from hsbench.geometry.cameras import TopDownCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.io.frame_store import Patch, Picture
from hsbench.io.images import MM_PER_M, depth_from_mm
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.poses import PoseTable
from hsbench.schema.scene import PERSON_ID_OFFSET, Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.crops import corners_of, crop, cut, differs, joined, window_of, within
from hsbench.synth.moved_room import MovedRoom
from hsbench.synth.people import HELD, Body, capsules, held_meshes
from hsbench.synth.render import Lighting, Mesh, Renderer, Window
from hsbench.synth.render.contact import REACH_M, light_left, shade
from hsbench.synth.render.image_boxes import ray_table
from hsbench.synth.render.raster import Layer, amodal_masks, layer
from hsbench.synth.render.sources import person_lighting, sources_of
from hsbench.synth.render.tone import decode_srgb, encode_srgb, toned
from hsbench.synth.scene_meshes import facing
from hsbench.typing import BoolArray, Float32Array, FloatArray, UInt8Array, UInt16Array

DISPLAY_STEPS = 2**14  # of display light: a byte has at least five
LIGHT_STEPS, BRIGHTEST = 2**16, 8.0  # of light: a byte has at least four; what is brighter looks the same


@dataclass(frozen=True, eq=False)
class Person:
    """Somebody in view. ends, radii: of the body's capsules. window: the pixels that it can cover or shade.

    farthest_m: no depth beyond it is shaded.
    """

    mesh: Mesh
    ends: FloatArray
    radii: FloatArray
    window: Window
    farthest_m: float


@dataclass(frozen=True, eq=False)
class Filming:
    """A static sensor in a scene with people; all in the episode frame.

    poses: true 3D poses, track_id k belongs to ``bodies[k - 1]``. lights: for people (``room_lighting``).
    motions: of things in the scene. held: (N,) what is in the hands at each pose, places in ``HELD``; None: nothing.
    """

    scene: Scene
    bodies: Sequence[Body]
    poses: PoseTable
    sensor: Sensor
    renderer: Renderer
    lights: Lighting
    motions: ObjectMotions = field(default_factory=ObjectMotions.none)
    held: UInt8Array | None = None

    def background(self) -> Picture:
        """The room at t0 without people."""
        return self.room.at_rest

    def patch(self, background: Picture, timestamp_ns: int, people: Sequence[Person] | None = None) -> Patch:
        """What people and moved things change of the background at one time; an empty mask when none is in view.

        people: as ``people`` gives them for that time, where they are at hand.
        """
        return self.begun(background, timestamp_ns, people)()

    def begun(
        self, background: Picture, timestamp_ns: int, people: Sequence[Person] | None = None
    ) -> Callable[[], Patch]:
        """As ``patch``, with what needs the renderer done, and the rest left to any thread."""
        room, changed = self.room.picture(background, timestamp_ns)
        return partial(self.peopled, background, room, changed, timestamp_ns, self.lights, people)

    def peopled(
        self, background: Picture, room: Picture, changed: Window | None, timestamp_ns: int, lights: Lighting,
        people: Sequence[Person] | None = None,
    ) -> Patch:  # fmt: skip
        """As ``patch``, before a picture of the room that differs from the background in the window ``changed`` alone.

        lights: for people.
        """
        people = self.people([timestamp_ns])[0] if people is None else people
        window = reduce(joined, (person.window for person in people), changed)
        if window is None:
            empty = Picture(np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.uint16), np.zeros((0, 0), np.uint16))
            return Patch(timestamp_ns, 0, 0, np.zeros((0, 0), bool), empty)
        behind = cut(room, window)
        picture = Picture(behind.rgb.copy(), behind.depth_mm.copy(), behind.instance.copy())
        camera, pose = self.sensor.camera, self.sensor.world_T_camera
        shaded_m = depth_from_mm(picture.depth_mm)
        behind_m = shaded_m.copy()
        layers = []
        for person in people:
            before_m = behind_m[crop(within(person.window, window))]
            drawn = layer(person.mesh, camera, pose, lights, before_m, person.window)
            if drawn is not None:
                at = crop(within(drawn.window, window))
                np.copyto(behind_m[at], drawn.depth_m, where=drawn.ids > 0)
                shaded_m[at][drawn.coverage == 1.0] = 0.0  # no shade is seen there
                layers.append(drawn)
        rays, from_above = ray_table(camera), isinstance(camera, TopDownCamera)
        for person in people:
            at = crop(within(person.window, window))
            left = light_left(
                shaded_m[at], rays[crop(person.window)], pose, from_above, person.ends, person.radii, person.farthest_m
            )
            shade(picture.rgb[at], left)
        for drawn in layers:
            stand_before(cut(picture, within(drawn.window, window)), drawn)
        mask = differs(picture, cut(background, window)) | (picture.instance > PERSON_ID_OFFSET)
        return Patch(timestamp_ns, window.v0, window.u0, mask, picture)

    def amodal(self, timestamp_ns: int) -> dict[int, BoolArray]:
        """Instance id -> (height, width) pixels that a person in view would cover if nothing else were there."""
        meshes = [person.mesh for person in self.people([timestamp_ns])[0]]
        masks = amodal_masks(meshes, self.sensor.camera, self.sensor.world_T_camera)
        return {mesh.mesh_id: mask for mesh, mask in zip(meshes, masks, strict=True)}

    def people(self, timestamps_ns: Sequence[int]) -> list[list[Person]]:
        """All in view at each of some times. Many times at once take less time each."""
        assert self.poses.joints_m is not None
        found: dict[int, list[Person]] = {int(time): [] for time in timestamps_ns}
        rows = np.flatnonzero(np.isin(self.poses.timestamp_ns, list(found)))
        posed = {}
        for track_id in np.unique(self.poses.track_id[rows]).tolist():
            mine, body = rows[self.poses.track_id[rows] == track_id], self.bodies[track_id - 1]
            joints = self.poses.joints_m[mine].astype(np.float64)
            held = [HELD[0] if self.held is None else HELD[int(self.held[row])] for row in mine]
            ends, radii = capsules(body, joints)
            for row, mesh, at in zip(mine.tolist(), held_meshes(body, joints, held), ends, strict=True):
                posed[row] = (Mesh(PERSON_ID_OFFSET + track_id, *mesh, smooth=True), at, radii)
        for row in rows.tolist():
            person = self._in_view(*posed[row])
            if person is not None:
                found[int(self.poses.timestamp_ns[row])].append(person)
        return [found[int(time)] for time in timestamps_ns]

    def _in_view(self, mesh: Mesh, ends: FloatArray, radii: FloatArray) -> Person | None:
        box = _shaded_box(mesh.vertices)
        window = window_of(self.sensor, [(mesh.vertices, box)])
        if window is None:
            return None
        _, depth_m = self.sensor.camera.project(apply(invert(self.sensor.world_T_camera), box))
        return Person(mesh, ends, radii, window, float(depth_m.max()))

    @cached_property
    def room(self) -> MovedRoom:
        """The room without people."""
        return MovedRoom(self.shown, self.motions, self.sensor, self.renderer)

    @cached_property
    def shown(self) -> Scene:
        """The scene with what turns to the camera turned to it."""
        return facing(self.scene, self.sensor.world_T_camera[:3, 3])


def room_lighting(scene: Scene, camera_xy: FloatArray) -> Lighting:
    """Light for people in a scene, for a camera at a point (2,): exposed as the background's."""
    sources = sources_of(scene)
    return person_lighting(sources, camera_xy, sources.exposure(camera_xy))


def _shaded_box(vertices: FloatArray) -> FloatArray:
    """(8, 3) corners of a box that holds all that a person of (V, 3) vertices shades: nothing above the head."""
    return corners_of(vertices.min(axis=0) - REACH_M, vertices.max(axis=0) + (REACH_M, REACH_M, 0.0))


def stand_before(picture: Picture, people: Layer) -> None:
    """Draw people over a picture, in place; where they cover a pixel in part, mixed as light of the display."""
    _stand_before(
        picture.rgb, picture.depth_mm, picture.instance, people.light, people.coverage, people.depth_m, people.ids,
        *_display_tables(),
    )  # fmt: skip


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _stand_before(
    rgb: UInt8Array, depth_mm: UInt16Array, instance: UInt16Array, light: FloatArray, coverage: FloatArray,
    depth_m: Float32Array, ids: UInt16Array, toned_light: FloatArray, decoded: FloatArray, encoded: UInt8Array,
) -> None:  # fmt: skip
    for i in range(rgb.shape[0]):
        for j in range(rgb.shape[1]):
            if ids[i, j] > 0:
                depth_mm[i, j], instance[i, j] = np.rint(depth_m[i, j] * MM_PER_M), ids[i, j]
            if coverage[i, j] > 0.0:
                for c in range(3):
                    step = int(light[i, j, c] * (LIGHT_STEPS / BRIGHTEST))
                    before = toned_light[min(step, LIGHT_STEPS)]
                    mixed = before + (1.0 - coverage[i, j]) * (decoded[rgb[i, j, c]] - before)
                    rgb[i, j, c] = encoded[int(mixed * DISPLAY_STEPS)]


@cache
def _display_tables() -> tuple[FloatArray, FloatArray, UInt8Array]:
    """Display light of steps of light up to BRIGHTEST and of each byte, and the byte of each step of display light."""
    middles = (np.arange(LIGHT_STEPS + 1) + 0.5) * (BRIGHTEST / LIGHT_STEPS)
    display = (np.arange(DISPLAY_STEPS + 1) + 0.5) / DISPLAY_STEPS
    return np.array([toned(light) for light in middles]), decode_srgb(np.arange(256)), encode_srgb(display)
