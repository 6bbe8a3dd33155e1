"""Pictures of a room without people in which things move and the light changes.

The room at t0 is a sum over its lights (``render.light_basis``). Where things have moved, their windows are drawn once
for each light that shines and summed in the same way, so that they follow the light while they rest.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from hsbench.io.changing_light import ROOT_STEPS, VALUES, ChangingLight, encode_light
from hsbench.io.frame_store import Picture
from hsbench.io.images import depth_to_mm
from hsbench.schema.motions import scene_at
from hsbench.synth.crops import crop
from hsbench.synth.indoor_light import exposures
from hsbench.synth.moved_room import Group, MovedRoom, Shape, repainted, trimmed
from hsbench.synth.render import Lighting, Window
from hsbench.synth.render.light_basis import LightStates, decomposed
from hsbench.synth.render.sources import Sources
from hsbench.synth.render.tone import encode_srgb, toned
from hsbench.typing import FloatArray, UInt8Array, UInt16Array

KEPT = 8  # places of things that are remembered; some megabytes each
K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


@dataclass(frozen=True, eq=False)
class RelitRoom:
    """A room before a static camera in n frames.

    still: the picture at t0. sources: the lights of which ``light`` has pictures, exposed by ``day_exposure``.
    """

    room: MovedRoom
    still: Picture
    sources: list[Sources]
    day_exposure: float
    light: ChangingLight
    # What the last moves look like, and pictures of the lights in their windows: things rest, and come back to places.
    _shapes: dict[Group, Shape | None] = field(default_factory=dict, repr=False)
    _lights: dict[Group, dict[int, UInt16Array]] = field(default_factory=dict, repr=False)

    def background(self, frame: int) -> Picture:
        """The room as at t0, in the light of a frame."""
        return Picture(self.light.rgb(frame), self.still.depth_mm, self.still.instance)

    def picture(self, background: Picture, frame: int, timestamp_ns: int) -> tuple[Picture, Window | None]:
        """(The room in a frame, the window outside of which it is as the background; None: nowhere else)."""
        moves = self.room.motions.moves_at(timestamp_ns)
        shape = (
            _recent(self._shapes, tuple(moves.items()), lambda: self.room.shape(self.still, moves)) if moves else None
        )
        if shape is None:
            return background, None
        picture = Picture(background.rgb.copy(), shape.depth_mm, shape.instance)
        for group, window in shape.groups:
            rgb = self.light.shown(frame, self._window_lights(group, window, shape, frame))
            picture.rgb[crop(window)] = repainted(rgb, group, window, shape, background)
        return picture, trimmed(shape.whole, picture, background)

    def _window_lights(self, group: Group, window: Window, shape: Shape, frame: int) -> dict[int, UInt16Array]:
        """Pictures of the lights of a frame in a window with a group of things moved."""
        # Embree is an extra: a generator without pictures runs without.
        from hsbench.synth.render.background import FINE_GATHER_RAYS, Drawing, lit_by

        found: dict[int, UInt16Array] = _recent(self._lights, group, dict)
        missing = [k for k in self.light.shining(frame) if k not in found]
        if missing:
            room, drawing = self.room, Drawing(self.day_exposure, False, FINE_GATHER_RAYS)
            scene, ids = scene_at(room.scene, dict(group)), room.ids(self.still, shape, window)
            lights, camera, pose = [self.sources[k] for k in missing], room.sensor.camera, room.sensor.world_T_camera
            pictures = lit_by(lights, drawing, scene, ids, room.renderer, camera, pose, window)
            found.update(zip(missing, map(encode_light, pictures), strict=True))
        return found


def _recent(cache: dict[K, V], key: K, make: Callable[[], V]) -> V:
    """The value of a key, made where it is not among the last ``KEPT`` that were asked for."""
    cache[key] = cache.pop(key) if key in cache else make()
    if len(cache) > KEPT:
        del cache[next(iter(cache))]
    return cache[key]


def relit_room(room: MovedRoom, daylight: Sources, states: LightStates, seconds: FloatArray) -> RelitRoom:
    """A room under n states of its light, at (n,) seconds after t0. daylight: ``sources_of`` its scene."""
    # Embree is an extra: a generator without pictures runs without.
    from hsbench.synth.render.background import FINE_GATHER_RAYS, Drawing, lit_by

    camera, pose = room.sensor.camera, room.sensor.world_T_camera
    view = room.renderer.render(room.meshes, camera, pose, Lighting(1.0), only="shape")
    day_exposure = daylight.exposure(pose[:2, 3])
    sources, weight = decomposed(room.scene, daylight, states)
    here = daylight.room_of(pose[None, :2, 3])[0]
    light_here = np.einsum("nkc,kc->n", weight, np.array([own.ambient[here] for own in sources])) / 3
    exposure = exposures(daylight.ambient[here].mean() / light_here, seconds)
    drawing = Drawing(day_exposure, False, FINE_GATHER_RAYS)
    pictures = lit_by(sources, drawing, room.scene, view.ids, room.renderer, camera, pose)
    lights = tuple(encode_light(picture) for picture in pictures)
    light = ChangingLight(lights, weight.astype(np.float32), exposure.astype(np.float32), display_table())
    return RelitRoom(room, Picture(light.rgb(0), depth_to_mm(view.depth_m), view.ids), sources, day_exposure, light)


def display_table() -> UInt8Array:
    """(65536,) the byte that shows exposed light (i / ROOT_STEPS)^2, i + 1/2 being the middle of a step."""
    light = ((np.arange(VALUES) + 0.5) / ROOT_STEPS) ** 2
    return encode_srgb(np.array([toned(value) for value in light]))
