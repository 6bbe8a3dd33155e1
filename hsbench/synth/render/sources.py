"""The light of a scene by day: a lamp at the ceiling of every room, the sky in its windows, and a hazy sun.

Everything here follows from the structure alone (outlines, heights, windows), so that no piece of furniture changes it.
Brightness is in units of the light that a white matt surface sends back; ``exposure`` brings it to the display.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hsbench.geometry.polygons import contains, distance, outline_distance
from hsbench.geometry.transforms import apply, cos_sin
from hsbench.schema.scene import Room, Scene, SceneObject
from hsbench.synth.render.base import MAX_LIGHTS_PER_KIND, DirectionalLight, Lighting, PointLight, Vector
from hsbench.synth.render.materials import is_pane
from hsbench.typing import FloatArray, IntArray

SKY = np.array([5.3, 5.9, 6.6])  # through a window, from above the horizon
GROUND = np.array([2.2, 2.1, 1.8])  # from below it
LAMP_COLOUR = np.array([1.06, 1.0, 0.9])
LAMP_LEVEL, LAMP_LEVEL_DARK = 0.18, 0.7  # mean light that the lamp gives a room with and without a window
LAMP_HALF_M = 0.45
LAMP_TRIES = 23  # places across a room
ALIKE_M = 0.001  # of two walls as long as each other the first counts
HIPS_M, LIFTED_M = 1.0, 2.0  # where people are lit as the room is; how far their lamps hang above the ceiling
SCATTERED = 0.15  # of the light of lamp and windows is scattered by things before it reaches somebody
SPHERE_TO_DISC = 4.0  # light from one direction, spread over all: a sphere has four times the area of its disc
BEFORE_WINDOW_M = 0.5  # a pane lights the room that lies so far before it
LAMP_GAP_M = 0.02  # below the ceiling
SUN = np.array([1.9, 1.7, 1.42])  # on a surface that faces it: thin clouds before it, or it would drown the room
SUNNY_SHARE = 0.6
SUN_ELEVATION_DEG, SUN_AZIMUTH_DEG = (24.0, 46.0), (12.0, 48.0)  # azimuth from the window's axis
ALBEDO = 0.55  # mean of a furnished room, for the light that bounces on and on
KEY = 0.76  # exposed mean light: a white wall in it is shown at half of the range


class AreaLight(NamedTuple):
    """A rectangle that shines on the side of its normal; metres, scene frame; colours are linear RGB (3,).

    above, below: radiosity for light that arrives downwards and upwards.
    """

    room: int
    centre: FloatArray
    half_u: FloatArray
    half_v: FloatArray
    normal: FloatArray
    above: FloatArray
    below: FloatArray

    @property
    def area_m2(self) -> float:
        """Area in square metres."""
        return 4.0 * float(np.linalg.norm(self.half_u) * np.linalg.norm(self.half_v))

    @property
    def flux(self) -> FloatArray:
        """(3,) radiosity times area."""
        return self.area_m2 * (self.above + self.below) / 2


@dataclass(frozen=True, eq=False)
class Sources:
    """Where light comes from, in the scene's frame.

    lamps: one a room. windows: panes. ambient: (R, 3) light that has bounced about in a room.
    sun_towards: (3,) unit. sun: (3,) its light on a surface that faces it, zero where there is none.
    outlook: unit (3,), the view out of the windows is turned to it. outside: (3,) what that view is multiplied by.
    """

    rooms: tuple[Room, ...]
    lamps: tuple[AreaLight, ...]
    windows: tuple[AreaLight, ...]
    ambient: FloatArray
    sun_towards: FloatArray
    sun: FloatArray
    outlook: FloatArray
    outside: FloatArray

    def room_of(self, points_xy: FloatArray) -> IntArray:
        """(N, 2) points -> (N,) number of the room that holds each, else of the nearest."""
        if len(self.rooms) == 1:
            return np.zeros(len(points_xy), dtype=np.int64)
        inside = np.stack([contains(room.outline_xy, points_xy) for room in self.rooms])
        found = inside.argmax(axis=0)
        (lost,) = np.nonzero(~inside.any(axis=0))
        far = np.stack([outline_distance(room.outline_xy, points_xy[lost]) for room in self.rooms])
        found[lost] = far.argmin(axis=0)
        return found

    def exposure(self, point_xy: FloatArray) -> float:
        """What light is multiplied by for the display, for a camera at a point (2,)."""
        (room,) = self.room_of(np.asarray(point_xy, dtype=np.float64)[None])
        return float(KEY * ALBEDO / self.ambient[room].mean())  # bounced light is ALBEDO of all the light


def sources_of(scene: Scene) -> Sources:
    """The light sources of a scene."""
    windows = tuple(pane for item in scene.objects for pane in _panes(item, scene.rooms))
    towards, sun = _sun(scene, windows)
    daylit = {pane.room for pane in windows}
    levels = [LAMP_LEVEL if k in daylit else LAMP_LEVEL_DARK for k in range(len(scene.rooms))]
    lamps = tuple(
        _lamp(k, room, scene.height_m, levels[k] * (1 - ALBEDO) * _surface_m2(room, scene.height_m))
        for k, room in enumerate(scene.rooms)
    )
    sources = Sources(scene.rooms, lamps, windows, np.empty(0), towards, sun, towards, np.ones(3))
    return replace(sources, ambient=_ambient(sources, scene.height_m))


def relit(
    scene: Scene, sources: Sources, lamps: FloatArray, sky: FloatArray, sun_towards: FloatArray, sun: FloatArray
) -> Sources:
    """The sources of a scene with other strengths.

    lamps: (R, 3) and sky: (3,) what their light is multiplied by. sun_towards: unit (3,), sun: (3,) its own light.
    """
    changed = replace(
        sources,
        lamps=tuple(_times(lamp, lamps[lamp.room]) for lamp in sources.lamps),
        windows=tuple(_times(pane, sky) for pane in sources.windows),
        sun_towards=sun_towards,
        sun=sun,
        outside=sky,
    )
    return replace(changed, ambient=_ambient(changed, scene.height_m))


def _times(light: AreaLight, factor: FloatArray) -> AreaLight:
    return light._replace(above=light.above * factor, below=light.below * factor)


def _ambient(sources: Sources, height_m: float) -> FloatArray:
    """(R, 3) light that has bounced about in each room: a series, since every surface sends on ALBEDO of it."""
    ambient = []
    for number, room in enumerate(sources.rooms):
        panes = [pane for pane in sources.windows if pane.room == number]
        sunlight = sum((_sunlight_sent_on(pane, sources.sun_towards, sources.sun) for pane in panes), np.zeros(3))
        flux = sum((pane.flux for pane in panes), sources.lamps[number].flux) + sunlight
        ambient.append(flux / _surface_m2(room, height_m) * ALBEDO / (1 - ALBEDO))
    return np.array(ambient)


def person_lighting(sources: Sources, camera_xy: FloatArray, exposure: float) -> Lighting:
    """The same light, exposed, for people, who are drawn alone and without shadows: for a camera at a point (2,).

    Bounced light is ambient; the windows of the camera's room shine from one direction each, as bright as in the middle
    of the room; its lamp is a point above the ceiling, so that no head under it burns out, as bright at the hips.
    A share of each, ``SCATTERED``, comes from all around.
    """
    here = sources.room_of(np.asarray(camera_xy, dtype=np.float64)[None])[0]
    middle = np.array([*sources.lamps[here].centre[:2], HIPS_M])
    windows = sorted((w for w in sources.windows if w.room == here), key=lambda w: -_form_factor(w, middle))
    windows = windows[:MAX_LIGHTS_PER_KIND]
    whole = sum(_form_factor(light, middle) * float(light.above.mean()) for light in (sources.lamps[here], *windows))
    direct = exposure * (1 - SCATTERED)
    return Lighting(
        ambient=exposure * (float(sources.ambient[here].mean()) + SCATTERED * whole / SPHERE_TO_DISC),
        points=(_lifted(sources.lamps[here], direct),),
        directionals=tuple(
            DirectionalLight(_vector(middle - w.centre), direct * _form_factor(w, middle), _vector(w.above))
            for w in windows
        ),
    )


def _lifted(lamp: AreaLight, strength: float) -> PointLight:
    x, y, z = lamp.centre.tolist()
    light = strength * _form_factor(lamp, np.array([x, y, HIPS_M]))
    return PointLight((x, y, z + LIFTED_M), light * (z + LIFTED_M - HIPS_M) ** 2, _vector(lamp.above))


def _form_factor(light: AreaLight, point: FloatArray) -> float:
    """Light per radiosity on a surface at a point (3,) that faces an area light, taken for a disc."""
    offset = point - light.centre
    square = float(offset @ offset)
    leaving = max(float(light.normal @ offset), 0.0) / math.sqrt(square)
    return leaving * light.area_m2 / (math.pi * square + light.area_m2)


def _vector(values: FloatArray) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _panes(item: SceneObject, rooms: Sequence[Room]) -> list[AreaLight]:
    """The inner faces of a window's panes; a window looks into its room along its own -y axis."""
    found = []
    for part in item.parts:
        if is_pane(item, part):
            low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
            centre = apply(item.scene_T_object, np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2]))
            right, outward, up = item.scene_T_object[:3, :3].T
            half_x, _, half_z = (high - low) / 2
            before = centre - BEFORE_WINDOW_M * outward
            room = int(np.argmin([distance(room.outline_xy, before[:2]) for room in rooms]))
            found.append(AreaLight(room, centre, half_x * right, half_z * up, -outward, SKY, GROUND))
    return found


def _lamp(number: int, room: Room, height_m: float, flux: float) -> AreaLight:
    """A square at the ceiling, along the longest wall, where the outline leaves most space around it."""
    sides = np.roll(room.outline_xy, -1, axis=0) - room.outline_xy
    lengths = np.linalg.norm(sides, axis=1)
    longest = int(np.argmax(lengths > lengths.max() - ALIKE_M))
    along = sides[longest] / lengths[longest]
    axes = np.array([along, [-along[1], along[0]]])
    outline = room.outline_xy @ axes.T
    low, high = outline.min(axis=0), outline.max(axis=0)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, LAMP_TRIES).T, indexing="ij"), axis=-1).reshape(-1, 2)
    free = np.where(contains(outline, grid), outline_distance(outline, grid), -1.0)
    off = np.linalg.norm(grid - (low + high) / 2, axis=1)
    # A long room has many such places: the one in the middle, whatever the last bits say.
    best = int(np.lexsort((off.round(3), free < free.max() - 0.05))[0])
    half = min(LAMP_HALF_M, 0.6 * float(free[best]))
    radiosity = LAMP_COLOUR * (flux / (4.0 * half * half))
    x, y = np.pad(half * axes, ((0, 0), (0, 1)))
    centre = np.array([*(grid[best] @ axes), height_m - LAMP_GAP_M])
    return AreaLight(number, centre, x, y, np.array([0.0, 0.0, -1.0]), radiosity, radiosity)


def _sun(scene: Scene, windows: Sequence[AreaLight]) -> tuple[FloatArray, FloatArray]:
    """(direction towards the sun, its light): no light without windows and under an overcast sky.

    Drawn from the shapes of the panes: the same whatever stands in the room and however the scene is turned.
    """
    shapes = b"".join(part.vertices.tobytes() for item in scene.objects for part in item.parts if is_pane(item, part))
    digest = np.frombuffer(hashlib.blake2b(shapes, digest_size=8).digest(), dtype="<u2")
    sunny, which, elevation, azimuth = (float(v) / 2**16 for v in digest)
    if not windows:
        return np.array([1.0, 0.0, 0.0]), np.zeros(3)
    inward = windows[int(which * len(windows))].normal
    least, most = SUN_AZIMUTH_DEG
    turn = least + (most - least) * abs(2 * azimuth - 1)
    c, s = cos_sin(math.radians(turn if azimuth < 0.5 else -turn))
    level, up = cos_sin(math.radians(SUN_ELEVATION_DEG[0] + (SUN_ELEVATION_DEG[1] - SUN_ELEVATION_DEG[0]) * elevation))
    x, y = -inward[0], -inward[1]
    towards = np.array([level * (c * x - s * y), level * (s * x + c * y), up])
    return towards, SUN if sunny < SUNNY_SHARE else np.zeros(3)


def _sunlight_sent_on(pane: AreaLight, towards: FloatArray, sun: FloatArray) -> FloatArray:
    """(3,) flux that what the sun meets behind a pane sends on."""
    return ALBEDO * pane.area_m2 * max(-float(pane.normal @ towards), 0.0) * sun


def _surface_m2(room: Room, height_m: float) -> float:
    """Floor, ceiling and walls."""
    sides = room.outline_xy - np.roll(room.outline_xy, 1, axis=0)
    return 2 * room.area_m2 + height_m * float(np.linalg.norm(sides, axis=1).sum())
