"""Light on surface points: soft shadows of area lights and sun, and light that other surfaces send on, by rays.

Two questions are asked of the occluders: what of each light source does a point see, and which surface does it see in
a direction. Light bounces once by rays; what bounces further is the room's ambient light (``Sources``).

Samples are spread by a low-discrepancy sequence over tiles of neighbouring points, each of which takes other members
of it: averaged over a tile (``filtering``) the light is smooth. Nothing is drawn at random.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

from hsbench.synth.render.raycast_backend import Occluders
from hsbench.synth.render.sources import SKY, AreaLight, Sources
from hsbench.synth.render.surfaces import Surfaces
from hsbench.typing import BoolArray, Float32Array, FloatArray, Int32Array, IntArray

SPOTS = 64  # of a light
LIFT_M = 0.002  # rays start so far above their surface
NEARLY_ALL = 0.998  # a ray to a light ends just before it
FAR_M = 100.0  # beyond any room
INTO_ROOM_M = 0.05  # a surface belongs to the room so far before it
ROUGHNESS = 0.07  # spread of reflections on varnish, over their distance
OPEN_M = 0.4  # a surface at this distance gets half of the ambient light: it shares a corner with us
SQUARE_SHARE = 0.75  # light from every direction alike then halves when the normal turns by a right angle, as it should
GRAZING = 0.2  # least cosine by which a light's direction is weighed
# R2 sequence (M. Roberts 2018): inverse powers of the plastic number; and a third number, the golden section.
_R2_A, _R2_B, _R2_C = 0.7548776662466927, 0.5698402909980532, 0.6180339887498949
_RED, _GREEN, _BLUE = 0.2126, 0.7152, 0.0722  # luminance, ITU-R BT.709


@dataclass(frozen=True, eq=False)
class Points:
    """N surface points: positions and unit normals (N, 3), rooms (N,), and their places (N,) in a tile of ``tile``."""

    position: FloatArray
    normal: FloatArray
    room: IntArray
    place: IntArray
    tile: int


@dataclass(frozen=True, eq=False)
class Light:
    """Light on N points. total: (N, 3) as a white matt surface there sends it back.

    towards: (N, 3) where it comes from: as the unit normal changes by d, its luminance changes by d . towards.
    """

    total: FloatArray
    towards: FloatArray


class Spots(NamedTuple):
    """A light as S spots, each of which can stand for the whole of it.

    position, normal: (S, 3). area_m2: (S,). above, below: (S, 3) radiosity for light that arrives downwards, upwards.
    """

    position: FloatArray
    normal: FloatArray
    area_m2: FloatArray
    above: FloatArray
    below: FloatArray


class Illumination:
    """A scene ready for questions about its light."""

    def __init__(self, surfaces: Surfaces, sources: Sources) -> None:
        """Both in one frame; the surfaces are all that stops light or sends it on."""
        self.surfaces, self.sources = surfaces, sources
        self._occluders = Occluders(surfaces.corners, surfaces.opaque[surfaces.part])
        self._lights = [(light.room, _spots(light)) for light in (*sources.lamps, *sources.windows)]
        if sources.sun.any():
            self._lights += [(light.room, self._sun_patch(light)) for light in sources.windows]

    def _sun_patch(self, pane: AreaLight) -> Spots:
        """What the sun lights through a pane, as a light of its own: where the rays through its spots end."""
        s = self.sources
        through = _spots(pane).position
        along = np.tile((-s.sun_towards).astype(np.float32), (len(through), 1))
        triangle = self._occluders.first(through.astype(np.float32), along)
        rows, hits, normals, _ = _hits(through, along, triangle, self.surfaces.corners, self.surfaces.normals)
        facing = normals @ s.sun_towards
        light = np.zeros_like(through)
        light[rows] = facing[:, None] * s.sun * self.surfaces.colour[self.surfaces.part[triangle[rows]]]
        position, normal, area_m2 = through, np.tile(s.sun_towards, (len(through), 1)), np.zeros(len(through))
        position[rows], normal[rows] = hits, normals
        area_m2[rows] = pane.area_m2 * max(-float(pane.normal @ s.sun_towards), 0.0) / np.maximum(facing, GRAZING)
        return Spots(position, normal, area_m2, light, light)

    def direct(self, points: Points, first: int, count: int) -> Light:
        """Light of the lamps, windows and sun patches of each point's room, by ``count`` rays to each.

        They are the rays number ``first`` and following of each point's share of the sequence.
        """
        light = Light(np.zeros_like(points.position), np.zeros_like(points.position))
        for room, spots in self._lights:
            for sample in range(first, first + count):
                rows, spot, origins, vectors, share = _rays_to_spots(
                    points.position, points.normal, points.place + sample * points.tile, points.room, room, spots
                )
                share[self._occluders.blocked(origins, vectors)] = 0.0
                _add_light(rows, spot, vectors, share / count, spots, points.normal, light.total, light.towards)
        return light

    def sunlit(self, position: FloatArray, normal: FloatArray) -> BoolArray:
        """(N,) bool: the sun reaches (N, 3) points with normals (N, 3) through a window."""
        s = self.sources
        lit = np.zeros(len(position), dtype=np.bool_)
        if s.sun.any():
            centre, half_u, half_v, inward = (
                np.array([getattr(w, k) for w in s.windows]) for k in ("centre", "half_u", "half_v", "normal")
            )
            rows = _towards_window(position, normal, s.sun_towards, centre, half_u, half_v, inward)
            origins = (position[rows] + LIFT_M * normal[rows]).astype(np.float32)
            vectors = np.tile((FAR_M * s.sun_towards).astype(np.float32), (len(rows), 1))
            lit[rows] = ~self._occluders.blocked(origins, vectors)
        return lit

    def gathered(self, points: Points, count: int) -> Light:
        """Light that other surfaces send to the points, by ``count`` rays from each."""
        total, towards = np.zeros_like(points.position), np.zeros_like(points.position)
        for sample in range(count):
            directions = _hemisphere(points.normal, points.place + sample * points.tile)
            seen, _ = self.seen(points, directions, sample)
            total += seen / count
            towards += (SQUARE_SHARE / count * (seen @ (_RED, _GREEN, _BLUE)))[:, None] * directions
        return Light(total, towards)

    def mirrored(self, points: Points, eye: FloatArray) -> FloatArray:
        """(N, 3) what mirrors at the points would show an eye at (3,): surfaces, and the sky where there is none."""
        seen, is_surface = self.seen(points, _reflected(points.position, points.normal, points.place, eye), 0)
        seen[~is_surface] = self.sources.outside * SKY
        return seen

    def seen(self, points: Points, directions: Float32Array, sample: int) -> tuple[FloatArray, BoolArray]:
        """((N, 3) what the points see in (N, 3) directions, (N,) bool whether it is a surface; else black).

        ``sample`` chooses the ray that asks for each light at the surface.
        """
        surfaces = self.surfaces
        origins = (points.position + LIFT_M * points.normal).astype(np.float32)
        triangle = self._occluders.first(origins, directions)
        rows, hits, normals, distance = _hits(points.position, directions, triangle, surfaces.corners, surfaces.normals)
        room = self.sources.room_of(hits[:, :2] + INTO_ROOM_M * normals[:, :2])
        light = self.direct(Points(hits, normals, room, points.place[rows], points.tile), sample, 1).total
        light += self.sources.ambient[room] * (distance / (distance + OPEN_M))[:, None]
        seen = np.zeros_like(points.position)
        seen[rows] = light * surfaces.colour[surfaces.part[triangle[rows]]]
        return seen, triangle >= 0


def _spots(light: AreaLight) -> Spots:
    """Spots spread evenly over a rectangle."""
    across = 2.0 * ((0.5 + np.arange(SPOTS)[:, None] * np.array([_R2_A, _R2_B])) % 1.0) - 1.0
    return Spots(
        light.centre + across[:, :1] * light.half_u + across[:, 1:] * light.half_v,
        np.tile(light.normal, (SPOTS, 1)),
        np.full(SPOTS, light.area_m2),
        np.tile(light.above, (SPOTS, 1)),
        np.tile(light.below, (SPOTS, 1)),
    )


@numba.njit(cache=True, error_model="numpy")
def _rays_to_spots(
    position: FloatArray, normal: FloatArray, number: IntArray, room: IntArray, light_room: int, spots: Spots
) -> tuple[IntArray, IntArray, Float32Array, Float32Array, FloatArray]:
    """(rows, spot, origins, vectors, share): rays from points of a room to the spot of a light that bears their number.

    share: light per radiosity, if the spot stands for the whole: the form factor of a disc of the light's area,
    cos cos A / (pi d^2 + A), which stays below 1 however near.
    """
    n = len(position)
    rows, spot, share = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n)
    origins, vectors = np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
    m = 0
    for i in range(n):
        if room[i] != light_room:
            continue
        k = number[i] % len(spots.area_m2)
        square, facing, leaving = 0.0, 0.0, 0.0
        for c in range(3):
            d = spots.position[k, c] - position[i, c]
            square += d * d
            facing += d * normal[i, c]
            leaving -= d * spots.normal[k, c]
            vectors[m, c] = d * NEARLY_ALL
            origins[m, c] = position[i, c] + LIFT_M * normal[i, c]
        if facing > 0.0 and leaving > 0.0 and spots.area_m2[k] > 0.0:
            rows[m], spot[m] = i, k
            share[m] = facing * leaving / square * spots.area_m2[k] / (math.pi * square + spots.area_m2[k])
            m += 1
    return rows[:m], spot[:m], origins[:m], vectors[:m], share[:m]


@numba.njit(cache=True, error_model="numpy")
def _add_light(
    rows: IntArray, spot: IntArray, vectors: Float32Array, share: FloatArray, spots: Spots,
    normal: FloatArray, total: FloatArray, towards: FloatArray,
) -> None:  # fmt: skip
    """Add the light that came along rays to its points, in place."""
    for m in range(len(rows)):
        if share[m] == 0.0:
            continue
        i, k = rows[m], spot[m]
        x, y, z = vectors[m, 0], vectors[m, 1], vectors[m, 2]
        length = math.sqrt(x * x + y * y + z * z)
        from_above = min(max(0.5 + 4.0 * z / length, 0.0), 1.0)  # the horizon is soft
        luminance = 0.0
        for c in range(3):
            light = share[m] * (spots.below[k, c] + (spots.above[k, c] - spots.below[k, c]) * from_above)
            total[i, c] += light
            luminance += light * (_RED if c == 0 else _GREEN if c == 1 else _BLUE)
        cosine = (x * normal[i, 0] + y * normal[i, 1] + z * normal[i, 2]) / length
        weight = luminance / (max(cosine, GRAZING) * length)
        towards[i, 0] += weight * x
        towards[i, 1] += weight * y
        towards[i, 2] += weight * z


@numba.njit(cache=True, error_model="numpy")
def _towards_window(
    position: FloatArray, normal: FloatArray, towards: FloatArray,
    centre: FloatArray, half_u: FloatArray, half_v: FloatArray, inward: FloatArray,
) -> IntArray:  # fmt: skip
    """Rows of the points that face ``towards`` (3,) and whose ray in that direction leaves through a rectangle."""
    rows = np.empty(len(position), np.int64)
    m = 0
    for i in range(len(position)):
        if normal[i, 0] * towards[0] + normal[i, 1] * towards[1] + normal[i, 2] * towards[2] <= 0.0:
            continue
        for k in range(len(centre)):
            along, gap = 0.0, 0.0
            for c in range(3):
                along -= towards[c] * inward[k, c]
                gap += (position[i, c] - centre[k, c]) * inward[k, c]
            if along <= 0.0 or gap <= 0.0:
                continue
            u, v, uu, vv = 0.0, 0.0, 0.0, 0.0
            for c in range(3):
                d = position[i, c] + gap / along * towards[c] - centre[k, c]
                u += d * half_u[k, c]
                v += d * half_v[k, c]
                uu += half_u[k, c] ** 2
                vv += half_v[k, c] ** 2
            if abs(u) < uu and abs(v) < vv:
                rows[m] = i
                m += 1
                break
    return rows[:m]


@numba.njit(cache=True, error_model="numpy")
def _hemisphere(normal: FloatArray, number: IntArray) -> Float32Array:
    """(N, 3) unit directions about the normals, as dense as the cosine, by (N,) numbers in the sequence."""
    directions = np.empty((len(normal), 3), np.float32)
    for i in range(len(normal)):
        a, b = (0.5 + number[i] * _R2_A) % 1.0, (0.5 + number[i] * _R2_B) % 1.0
        radius, height, turn = math.sqrt(a), math.sqrt(1.0 - a), 2.0 * math.pi * b
        p, q = radius * math.cos(turn), radius * math.sin(turn)
        x, y, z = normal[i, 0], normal[i, 1], normal[i, 2]
        # Two axes at right angles to the normal, without a branch that flips between neighbours (Duff et al. 2017).
        sign = 1.0 if z >= 0.0 else -1.0
        s = -1.0 / (sign + z)
        t = x * y * s
        directions[i, 0] = p * (1.0 + sign * x * x * s) + q * t + height * x
        directions[i, 1] = p * sign * t + q * (sign + y * y * s) + height * y
        directions[i, 2] = -p * sign * x - q * y + height * z
    return directions


@numba.njit(cache=True, error_model="numpy")
def _reflected(position: FloatArray, normal: FloatArray, place: IntArray, eye: FloatArray) -> Float32Array:
    """(N, 3) unit directions in which a somewhat rough mirror at the points sends a look from the eye."""
    directions = np.empty((len(position), 3), np.float32)
    steps = (_R2_A, _R2_B, _R2_C)
    for i in range(len(position)):
        look = position[i] - eye
        look /= math.sqrt(look @ look)
        look -= 2.0 * (look @ normal[i]) * normal[i]
        for c in range(3):
            look[c] += ROUGHNESS * (2.0 * ((0.5 + place[i] * steps[c]) % 1.0) - 1.0)
        below = min(look @ normal[i], 0.0)
        for c in range(3):
            directions[i, c] = look[c] - 2.0 * below * normal[i, c]
    return directions


@numba.njit(cache=True, error_model="numpy")
def _hits(
    position: FloatArray, directions: Float32Array, triangle: Int32Array, corners: FloatArray, normals: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """(rows, hits, normals, distances) of the rays that hit a triangle; normals on the side that was hit."""
    n = len(position)
    rows, distance = np.empty(n, np.int64), np.empty(n)
    hits, facing = np.empty((n, 3)), np.empty((n, 3))
    m = 0
    for i in range(n):
        t = triangle[i]
        if t < 0:
            continue
        gap, along = 0.0, 0.0
        for c in range(3):
            gap += (corners[t, 0, c] - position[i, c]) * normals[t, c]
            along += directions[i, c] * normals[t, c]
        if along == 0.0:
            continue
        rows[m], distance[m] = i, max(gap / along, 0.0)
        for c in range(3):
            hits[m, c] = position[i, c] + distance[m] * directions[i, c]
            facing[m, c] = normals[t, c] if along < 0.0 else -normals[t, c]
        m += 1
    return rows[:m], hits[:m], facing[:m], distance[:m]
