"""Procedural textures: what every surface point's colour is multiplied by and mixed with. Pure functions, compiled.

A texture sees a point in its object's frame (metres, moved by an offset that differs from part to part), the axis the
surface faces most (the pattern lies in the plane of the other two, so that nothing smears on walls), the axis of the
grain, and the size of a pixel there along each axis. It answers

- ``factor``: brightness times the part's colour,
- ``warmth``: -1 bluish .. 1 reddish, a few per cent of hue,
- ``share``: how much of the part's second colour (grout, the other stripe) is mixed in.

Sizes are those of real materials. Lines are filtered exactly over the pixel; what is finer than one fades to its mean.
"""

from __future__ import annotations

import math

import numba

from hsbench.schema.scene import TEXTURES
from hsbench.synth.render.noise import cell_value, lines, noise, noise2, visible
from hsbench.typing import FloatArray

CODES: dict[str, int] = {name: code for code, name in enumerate(sorted(TEXTURES))}
"""The number by which compiled code knows a texture."""

_WOOD, _PLANKS, _PARQUET, _TILES, _CARPET, _WEAVE, _STRIPES, _CHECKS = (
    CODES[n] for n in ("wood", "planks", "parquet", "tiles", "carpet", "weave", "stripes", "checks")
)
_MARBLE, _PLASTER, _LEAVES, _HERRINGBONE, _TERRAZZO, _BRICK, _CORDUROY, _DOTS = (
    CODES[n] for n in ("marble", "plaster", "leaves", "herringbone", "terrazzo", "brick", "corduroy", "dots")
)

# Pattern sizes in metres.
RING = 0.011  # between growth rings on a board
PLANK, PLANK_LENGTH, PLANK_GAP = 0.15, 1.6, 0.0025
PARQUET_SQUARE, PARQUET_STRIPS, STRIP_GAP = 0.3, 5, 0.0015
HERRINGBONE_WIDTH, HERRINGBONE_RATIO = 0.08, 5
TILE, GROUT = 0.25, 0.005
BRICK_LENGTH, BRICK_HEIGHT, MORTAR = 0.24, 0.07, 0.01
STRIPE, STRIPE_WIDTH = 0.09, 0.035
CHECK = 0.09
RIDGE = 0.007
DOT_GRID, DOT = 0.055, 0.012
THREAD = 0.004
CHIP_GRID = 0.026
LEAF = 0.045

Answer = tuple[float, float, float]


@numba.njit(cache=True, error_model="numpy")
def texture(code: int, p: FloatArray, pixel: FloatArray, normal_axis: int, grain_axis: int) -> Answer:
    """(factor, warmth, share) of texture ``code`` at p (3,) with pixels of pixel (3,) metres along the axes."""
    if code == _BRICK and grain_axis == 2:
        grain_axis = normal_axis  # courses lie level
    # In the plane of the surface: u along the grain where the grain lies in it; on walls, else, v is up.
    a, b = (normal_axis + 1) % 3, (normal_axis + 2) % 3
    if b == grain_axis or (a != grain_axis and a == 2):
        a, b = b, a
    u, v, du, dv = p[a], p[b], pixel[a], pixel[b]
    size = max(du, dv)
    if code == _WOOD:
        return _wood(p[grain_axis], p[(grain_axis + 1) % 3], p[(grain_axis + 2) % 3], size)
    if code == _PLANKS:
        return _planks(u, v, du, dv)
    if code == _PARQUET:
        return _parquet(u, v, du, dv)
    if code == _HERRINGBONE:
        return _herringbone(u, v, size)
    if code == _TILES:
        return _tiles(u, v, du, dv)
    if code == _BRICK:
        return _brick(u, v, du, dv)
    if code == _CARPET:
        return _carpet(u, v, size)
    if code == _WEAVE:
        return _weave(u, v, du, dv)
    if code == _CORDUROY:
        return _corduroy(u, v, du, dv)
    if code == _STRIPES:
        factor, warmth, _ = _weave(u, v, du, dv)
        return factor, warmth, lines(v, STRIPE, STRIPE_WIDTH, dv)
    if code == _CHECKS:
        factor, warmth, _ = _weave(u, v, du, dv)
        return factor, warmth, 0.5 * (lines(u, CHECK, CHECK / 2, du) + lines(v, CHECK, CHECK / 2, dv))
    if code == _DOTS:
        factor, warmth, _ = _weave(u, v, du, dv)
        return factor, warmth, _dots(u, v, size)
    if code == _MARBLE:
        return _marble(p[0], p[1], p[2], size)
    if code == _TERRAZZO:
        return _terrazzo(u, v, size)
    if code == _LEAVES:
        return _leaves(p[0], p[1], p[2], size)
    if code == _PLASTER:
        return _plaster(u, v, size, 1.0)
    return _plain(p[0], p[1], p[2])


@numba.njit(cache=True, error_model="numpy")
def _plain(x: float, y: float, z: float) -> Answer:
    """Nothing has one even colour: a percent of cloud."""
    return 1.0 + 0.012 * noise(3.1 * x, 3.1 * y, 3.1 * z, 1), 0.0, 0.0


@numba.njit(cache=True, error_model="numpy")
def _plaster(u: float, v: float, size: float, strength: float) -> Answer:
    """Painted wall: clouds of half a metre, trowel marks of a hand, grains of a centimetre."""
    cloud = 0.014 * noise2(1.7 * u, 1.7 * v, 2) + 0.01 * noise2(7.0 * u, 6.0 * v, 3)
    grain = 0.02 * noise2(90.0 * u, 90.0 * v, 4) * visible(0.022, size)
    return 1.0 + strength * (cloud + grain), 0.25 * noise2(0.9 * u, 0.9 * v, 5), 0.0


@numba.njit(cache=True, error_model="numpy")
def _wood(g: float, a: float, b: float, size: float) -> Answer:
    """Solid wood: growth rings about a far axis along the grain, wavering, and long fine fibres."""
    waver = 0.014 * noise(1.1 * g, 5.0 * a, 5.0 * b, 6) + 0.004 * noise(4.0 * g, 22.0 * a, 22.0 * b, 7)
    # Piths repeat across the grain, at a board's width and thickness: glued boards, not one giant log.
    ca, cb = a - 0.35 * math.floor(a / 0.35) - 0.21, b - 0.5 * math.floor(b / 0.5) + 0.1
    ring = (math.sqrt(ca * ca + cb * cb) + waver) / RING
    phase = ring - math.floor(ring)
    late = phase * phase * phase if phase < 0.92 else 0.78 * (1.0 - phase) / 0.08  # dark late wood, then an abrupt end
    fibre = noise(4.0 * g, 260.0 * a, 260.0 * b, 8)
    streak = noise(1.6 * g, 60.0 * a, 60.0 * b, 9)
    cloud = noise(1.3 * g, 4.0 * a, 4.0 * b, 10)
    factor = 1.0 - 0.2 * (late - 0.22) * visible(RING, size)
    factor += 0.05 * fibre * visible(0.008, size) + 0.055 * streak * visible(0.033, size) + 0.06 * cloud
    return factor, 0.6 * streak + 0.5 * cloud + 0.6 * (late - 0.22) * visible(RING, size), 0.0


@numba.njit(cache=True, error_model="numpy")
def _board(g: float, across: float, i: int, j: int, size: float, contrast: float) -> Answer:
    """The face of board (i, j): its own shade, cathedral-like figure along it, fibres."""
    shade = 2.0 * cell_value(i, j, 1, 11) - 1.0
    hue = 2.0 * cell_value(i, j, 2, 11) - 1.0
    offset = 17.0 * cell_value(i, j, 3, 11)
    bend = 0.03 * noise2(1.3 * g + offset, 6.0 * across + offset, 12)
    figure = noise2(0.9 * g + offset, 75.0 * (across + bend) + offset, 13) * visible(0.026, size)
    streak = noise2(2.2 * g + offset, 24.0 * (across + bend), 14)
    fibre = noise2(6.0 * g, 330.0 * across + offset, 15) * visible(0.006, size)
    factor = 1.0 + contrast * shade + 0.07 * figure + 0.05 * streak + 0.05 * fibre
    return factor, 0.7 * hue + 0.5 * streak, 0.0


@numba.njit(cache=True, error_model="numpy")
def _planks(u: float, v: float, du: float, dv: float) -> Answer:
    """Floor boards with staggered ends."""
    row = math.floor(v / PLANK)
    along = u + PLANK_LENGTH * cell_value(row, 0, 0, 16)
    column = math.floor(along / PLANK_LENGTH)
    factor, warmth, _ = _board(u, v, row, column, max(du, dv), 0.085 * visible(2 * PLANK, max(du, dv)))
    gap = max(lines(v + PLANK_GAP / 2, PLANK, PLANK_GAP, dv), lines(along + 0.001, PLANK_LENGTH, 0.002, du))
    return factor * (1.0 - 0.55 * gap), warmth, 0.0


@numba.njit(cache=True, error_model="numpy")
def _parquet(u: float, v: float, du: float, dv: float) -> Answer:
    """Squares of strips, turned by a quarter from one to the next."""
    i, j = math.floor(u / PARQUET_SQUARE), math.floor(v / PARQUET_SQUARE)
    if (i + j) % 2 != 0:
        u, v, du, dv = v, u, dv, du
    strip = PARQUET_SQUARE / PARQUET_STRIPS
    row = math.floor(v / strip)
    factor, warmth, _ = _board(u, v, row, int(2 * i + 977 * j), max(du, dv), 0.11 * visible(2 * strip, max(du, dv)))
    gap = max(lines(v + STRIP_GAP / 2, strip, STRIP_GAP, dv), lines(u + STRIP_GAP / 2, PARQUET_SQUARE, STRIP_GAP, du))
    return factor * (1.0 - 0.5 * gap), warmth, 0.0


@numba.njit(cache=True, error_model="numpy")
def _herringbone(u: float, v: float, size: float) -> Answer:
    """Strips of five squares' length, laid at right angles in steps, the zigzag along u."""
    n, half = HERRINGBONE_RATIO, math.sqrt(0.5)
    x, y = half * (u + v) / HERRINGBONE_WIDTH, half * (v - u) / HERRINGBONE_WIDTH
    i, j = math.floor(x), math.floor(y)
    place = (i - j) % (2 * n)
    if place < n:  # lies along x; its first square is (i - place, j)
        along, across, first_i, first_j = place + x - i, y - j, i - place, j
    else:  # lies along y; its first square is (i, j + place - 2 n + 1)
        along, across, first_i, first_j = 2 * n - 1 - place + y - j, x - i, i, j + place - 2 * n + 1
    lay = 0 if place < n else 5003
    factor, warmth, _ = _board(
        along * HERRINGBONE_WIDTH,
        across * HERRINGBONE_WIDTH + 0.3 * first_j,
        first_i + lay,
        first_j,
        size,
        0.13 * visible(2 * HERRINGBONE_WIDTH, size),
    )
    edge = HERRINGBONE_WIDTH * min(min(across, 1.0 - across), min(along, n - along))  # metres to the nearest joint
    pixel = max(size, 1e-6)
    gap = min(max((STRIP_GAP / 2 - edge) / pixel + 0.5, 0.0), 1.0) * min(STRIP_GAP / pixel, 1.0)
    return factor * (1.0 - 0.55 * gap), warmth, 0.0


@numba.njit(cache=True, error_model="numpy")
def _tiles(u: float, v: float, du: float, dv: float) -> Answer:
    """Square glazed tiles, each of its own tone; the second colour is the grout's."""
    i, j = math.floor(u / TILE), math.floor(v / TILE)
    grout = lines(u + GROUT / 2, TILE, GROUT, du)
    grout = max(grout, lines(v + GROUT / 2, TILE, GROUT, dv))
    tone = 0.03 * (2.0 * cell_value(i, j, 0, 17) - 1.0)
    glaze = 0.02 * noise2(14.0 * u + 5.0 * i, 14.0 * v + 5.0 * j, 18)
    return 1.0 + tone + glaze, 0.3 * (2.0 * cell_value(i, j, 1, 17) - 1.0), grout


@numba.njit(cache=True, error_model="numpy")
def _brick(u: float, v: float, du: float, dv: float) -> Answer:
    """Stretcher bond; the second colour is the mortar's."""
    row = math.floor(v / BRICK_HEIGHT)
    along = u + 0.5 * BRICK_LENGTH * (row % 2)
    i, j = math.floor(along / BRICK_LENGTH), row
    mortar = lines(along + MORTAR / 2, BRICK_LENGTH, MORTAR, du)
    mortar = max(mortar, lines(v + MORTAR / 2, BRICK_HEIGHT, MORTAR, dv))
    tone = 0.16 * (2.0 * cell_value(i, j, 0, 19) - 1.0)
    rough = 0.08 * noise2(60.0 * u, 60.0 * v, 20) * visible(0.03, max(du, dv)) + 0.04 * noise2(9.0 * u, 9.0 * v, 21)
    return 1.0 + tone + rough, 2.0 * cell_value(i, j, 1, 19) - 1.0, mortar


@numba.njit(cache=True, error_model="numpy")
def _carpet(u: float, v: float, size: float) -> Answer:
    """Tufts of half a centimetre, and the tracks of brushing and walking."""
    tuft = 0.16 * noise2(190.0 * u, 190.0 * v, 22) * visible(0.01, size)
    clump = 0.06 * noise2(45.0 * u, 45.0 * v, 23) * visible(0.04, size)
    track = 0.035 * noise2(2.3 * u, 3.1 * v, 24) + 0.03 * noise2(11.0 * u, 8.0 * v, 25)
    return 1.0 + tuft + clump + track, 0.3 * noise2(2.0 * u, 2.0 * v, 26), 0.0


@numba.njit(cache=True, error_model="numpy")
def _weave(u: float, v: float, du: float, dv: float) -> Answer:
    """Woven cloth: over and under, threads of uneven thickness, soft folds of light."""
    size = max(du, dv)
    i, j = math.floor(u / THREAD), math.floor(v / THREAD)
    s, t = u / THREAD - i, v / THREAD - j
    if (i + j) % 2 != 0:
        s, t = t, s
    bulge = (4.0 * t * (1.0 - t) - 0.667) * 0.22 + (4.0 * s * (1.0 - s) - 0.667) * 0.08
    warp = noise2(210.0 * u, 9.0 * v, 27) * visible(0.01, du)
    weft = noise2(9.0 * u, 210.0 * v, 28) * visible(0.01, dv)
    cloud = 0.02 * noise2(5.0 * u, 5.0 * v, 29)
    mottle = 0.035 * noise2(38.0 * u, 38.0 * v, 30) * visible(0.05, size)
    factor = 1.0 + bulge * visible(2.0 * THREAD, size) + 0.055 * (warp + weft) + mottle + cloud
    return factor, 0.2 * (warp - weft), 0.0


@numba.njit(cache=True, error_model="numpy")
def _corduroy(u: float, v: float, du: float, dv: float) -> Answer:
    """Ribs along the grain."""
    valley = lines(v, RIDGE, 0.35 * RIDGE, dv)
    nap = 0.05 * noise2(30.0 * u, 160.0 * v, 31) * visible(0.012, max(du, dv)) + 0.04 * noise2(4.0 * u, 7.0 * v, 32)
    return 1.1 - 0.29 * valley + nap, 0.2 * noise2(3.0 * u, 3.0 * v, 33), 0.0


@numba.njit(cache=True, error_model="numpy")
def _dots(u: float, v: float, size: float) -> float:
    """Share of staggered dots in a pixel."""
    row = math.floor(v / DOT_GRID)
    along = u + 0.5 * DOT_GRID * (row % 2)
    x = along - DOT_GRID * (math.floor(along / DOT_GRID) + 0.5)
    y = v - DOT_GRID * (row + 0.5)
    pixel = max(size, 1e-6)
    inside = min(max((DOT - math.sqrt(x * x + y * y)) / pixel + 0.5, 0.0), 1.0)
    mean = math.pi * DOT * DOT / (DOT_GRID * DOT_GRID)
    return mean + (inside - mean) * visible(DOT_GRID, size)


@numba.njit(cache=True, error_model="numpy")
def _marble(x: float, y: float, z: float, size: float) -> Answer:
    """Clouded stone with thin wandering veins in the second colour."""
    wx = x + 0.11 * noise(3.0 * x, 3.0 * y, 3.0 * z, 34) + 0.03 * noise(11.0 * x, 11.0 * y, 11.0 * z, 35)
    wy = y + 0.11 * noise(3.0 * x, 3.0 * y, 3.0 * z, 36) + 0.03 * noise(11.0 * x, 11.0 * y, 11.0 * z, 37)
    wide = 1.0 - abs(noise(2.6 * wx, 2.6 * wy, 2.6 * z, 38)) * 9.0
    thin = 1.0 - abs(noise(6.5 * wx, 6.5 * wy, 6.5 * z, 39)) * 16.0
    vein = 0.55 * max(wide, 0.0) * visible(0.4, size) + 0.35 * max(thin, 0.0) * visible(0.06, size)
    cloud = noise(5.0 * wx, 5.0 * wy, 5.0 * z, 40)
    return 1.0 + 0.045 * cloud, 0.15 * noise(2.0 * x, 2.0 * y, 2.0 * z, 41), min(vein, 1.0)


@numba.njit(cache=True, error_model="numpy")
def _terrazzo(u: float, v: float, size: float) -> Answer:
    """Stone chips of 5 to 20 mm in a ground: darker, lighter and reddish ones."""
    x, y = u / CHIP_GRID, v / CHIP_GRID
    i0, j0 = math.floor(x), math.floor(y)
    pixel = max(size / CHIP_GRID, 1e-6)
    factor, warmth = 1.0, 0.0
    for i in range(i0 - 1, i0 + 2):
        for j in range(j0 - 1, j0 + 2):
            cx, cy = i + 0.15 + 0.7 * cell_value(i, j, 0, 42), j + 0.15 + 0.7 * cell_value(i, j, 1, 42)
            radius = 0.08 + 0.36 * cell_value(i, j, 2, 42) ** 2
            slant = 0.4 * (2.0 * cell_value(i, j, 3, 42) - 1.0)
            dx, dy = x - cx, y - cy
            # Chips are rounded shards: a square's and a circle's distance mixed, sheared.
            far = 0.6 * max(abs(dx + slant * dy), abs(dy - slant * dx)) + 0.4 * math.sqrt(dx * dx + dy * dy)
            inside = min(max((radius - far) / pixel + 0.5, 0.0), 1.0)
            kind = cell_value(i, j, 4, 42)
            tone = 0.62 if kind < 0.3 else (1.22 if kind < 0.6 else 0.86)
            factor += (tone - factor) * inside
            warmth += ((2.2 if kind > 0.75 else -0.2) - warmth) * inside
    near = visible(CHIP_GRID, size)
    return 0.97 + (factor - 0.97) * (0.15 + 0.85 * near), warmth * near, 0.0


@numba.njit(cache=True, error_model="numpy")
def _leaves(x: float, y: float, z: float, size: float) -> Answer:
    """Foliage: long leaves in all directions, one over the other, and dark gaps between them."""
    x, y, z = x / LEAF, y / LEAF, z / LEAF
    i0, j0, k0 = math.floor(x), math.floor(y), math.floor(z)
    top, factor, warmth = -1.0, 0.5, -0.3
    for i in range(i0 - 1, i0 + 2):
        for j in range(j0 - 1, j0 + 2):
            for k in range(k0 - 1, k0 + 2):
                order = cell_value(i, j, k, 43)
                if order <= top:
                    continue
                dx = x - i - cell_value(i, j, k, 44)
                dy = y - j - cell_value(i, j, k, 45)
                dz = z - k - cell_value(i, j, k, 46)
                ax, ay, az = order - 0.5, cell_value(i, j, k, 47) - 0.5, cell_value(i, j, k, 48) - 0.5
                along = (dx * ax + dy * ay + dz * az) / math.sqrt(ax * ax + ay * ay + az * az + 1e-9)
                across = math.sqrt(max(dx * dx + dy * dy + dz * dz - along * along, 0.0))
                half_width = 0.6 * (1.0 - along * along / 1.1)
                if across < half_width:
                    top = order
                    rib = 0.16 if across < 0.05 else 0.0
                    rim = 0.25 * (across / half_width) ** 4
                    factor = 0.82 + 0.5 * cell_value(i, j, k, 49) + 0.2 * along + rib - rim
                    warmth = 1.6 * cell_value(i, j, k, 50) - 0.7
    near = visible(LEAF, size)
    return 0.9 + (factor - 0.9) * (0.25 + 0.75 * near), warmth * near, 0.0
