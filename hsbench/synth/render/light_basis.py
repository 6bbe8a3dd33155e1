"""A room's picture as a sum over its lights, so that a picture under any of their states costs a sum, not a rendering.

Light adds up: the exposed light of a pixel is that of the lamp of each room, of the sky, and of the sun where it
stands, each with all that it sends around corners, times a strength and a colour. So one picture of each light is drawn
(the basis), in linear light; tone and sRGB come after the sum. The sun wanders: it is drawn at places on its way, and
between two of them its light goes over from one to the other.

One thing is not linear: how much light the rounding of edges takes away depends on the mean colour of all light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.schema.scene import Scene
from hsbench.synth.render.sources import SUN, Sources, relit
from hsbench.typing import FloatArray

SUN_STEP_RAD = float(np.radians(5.0))  # on a floor 2 m from the window a patch moves by a hand's length


@dataclass(frozen=True, eq=False)
class LightStates:
    """The light of a scene at n times, in the scene's frame; strengths are relative to ``sources_of``.

    lamps: (n, R, 3) of the lamp of each room. sky: (n, 3). sun_towards: (n, 3) unit. sun: (n, 3), of ``SUN``.
    """

    lamps: FloatArray
    sky: FloatArray
    sun_towards: FloatArray
    sun: FloatArray

    def __len__(self) -> int:
        return len(self.sky)

    def sources(self, scene: Scene, daylight: Sources, index: int) -> Sources:
        """All light at one time. daylight: ``sources_of(scene)``."""
        sun = SUN * self.sun[index]
        return relit(scene, daylight, self.lamps[index], self.sky[index], self.sun_towards[index], sun)


def decomposed(scene: Scene, daylight: Sources, states: LightStates) -> tuple[list[Sources], FloatArray]:
    """(K lights, (n, K, 3) strength and colour of each at each time): their sum is the light of the scene.

    daylight: ``sources_of(scene)``. states: at ascending times. A light that never shines is left out.
    """
    dark, white, none = np.zeros((len(scene.rooms), 3)), np.ones(3), np.zeros(3)
    lights, weights = [], []
    for room in range(len(scene.rooms)):
        lamps = dark.copy()
        lamps[room] = 1.0
        lights.append(relit(scene, daylight, lamps, none, daylight.sun_towards, none))
        weights.append(states.lamps[:, room])
    lights.append(relit(scene, daylight, dark, white, daylight.sun_towards, none))
    weights.append(states.sky)
    places, shares = _sun_places(states.sun_towards, _enters(daylight, states))
    lights += [relit(scene, daylight, dark, none, place, SUN) for place in places]
    weights += [share[:, None] * states.sun for share in shares]
    shining = [k for k, weight in enumerate(weights) if weight.any()]
    return [lights[k] for k in shining], np.stack([weights[k] for k in shining], axis=1)


def _enters(daylight: Sources, states: LightStates) -> FloatArray:
    """(n,) 1 where the sun shines into a window, else 0."""
    inward = np.array([pane.normal for pane in daylight.windows]).reshape(-1, 3)
    return np.asarray(((states.sun_towards @ inward.T < 0.0).any(axis=1) & states.sun.any(axis=1)) * 1.0)


def _sun_places(towards: FloatArray, shines: FloatArray) -> tuple[FloatArray, FloatArray]:
    """((S, 3) places at steps along a way of (n, 3) directions, (S, n) shares of each in its light)."""
    cosines = np.einsum("ij,ij->i", towards[:-1], towards[1:])
    way = np.concatenate([[0.0], np.cumsum(np.arccos(np.clip(cosines, -1.0, 1.0)))]) / SUN_STEP_RAD
    steps = np.arange(np.floor(way[-1]) + 2)
    shares = shines * np.maximum(1.0 - np.abs(way - steps[:, None]), 0.0)
    used = shares.any(axis=1)
    places = np.stack([np.interp(steps[used], way, towards[:, c]) for c in range(3)], axis=1)
    return places / np.linalg.norm(places, axis=1, keepdims=True), shares[used]
