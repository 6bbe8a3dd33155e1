"""Volumes of intersections in exact rational arithmetic, from half-spaces alone; slow and plain on purpose.

Lasserre's recursion (J. Optim. Theory Appl. 39, 1983): the volume of {x : a_i x <= b_i} in d dimensions is the sum over
its facets of b_i / (d |a_ij|) times the volume of facet i seen along axis j, whichever j with a_ij != 0. Exact numbers
need no tolerance: what only touches has facets of volume 0, and of parallel half-spaces the tightest is kept.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import product

HalfSpace = tuple[tuple[Fraction, ...], Fraction]


def volume(half_spaces: list[HalfSpace]) -> Fraction:
    """Volume of a bounded intersection of half-spaces (a, b): a x <= b, in as many dimensions as a has."""
    tightest: dict[tuple[Fraction, ...], Fraction] = {}
    for normal, offset in half_spaces:
        if not any(normal):
            if offset < 0:
                return Fraction(0)
            continue
        scale = abs(next(x for x in normal if x))
        key = tuple(x / scale for x in normal)
        tightest[key] = min(offset / scale, tightest.get(key, offset / scale))
    constraints = list(tightest.items())
    dimension = len(constraints[0][0])
    if dimension == 1:
        high = min(b for (a,), b in constraints if a > 0)
        low = max(-b for (a,), b in constraints if a < 0)
        return max(Fraction(0), high - low)
    total = Fraction(0)
    for normal, offset in constraints:
        if offset == 0:
            continue
        axis = next(k for k, x in enumerate(normal) if x)
        facet = []
        for other, b in constraints:
            if other is normal:
                continue
            ratio = other[axis] / normal[axis]
            left = tuple(x - ratio * y for k, (x, y) in enumerate(zip(other, normal, strict=True)) if k != axis)
            facet.append((left, b - ratio * offset))
        total += offset / (dimension * abs(normal[axis])) * volume(facet)
    return total


def box_half_spaces(centre, size, rotation) -> list[HalfSpace]:
    """The two half-spaces per axis of a box; ``rotation`` has the box's axes as columns, all Fractions."""
    found = []
    for k, side in product(range(len(centre)), (1, -1)):
        normal = tuple(side * row[k] for row in rotation)
        found.append((normal, sum(n * c for n, c in zip(normal, centre, strict=True)) + Fraction(size[k]) / 2))
    return found


def iou(a, b) -> Fraction:
    """IoU of two boxes (centre, size, rotation) of Fractions, in two or three dimensions."""
    common = intersection(a, b)
    return common / (_product(a[1]) + _product(b[1]) - common)


def intersection(a, b) -> Fraction:
    """Common volume of two boxes (centre, size, rotation) of Fractions."""
    return volume(box_half_spaces(*a) + box_half_spaces(*b))


def turn(tangent) -> tuple[Fraction, Fraction]:
    """Cosine and sine, both rational, of twice the angle with this rational tangent."""
    t = Fraction(tangent)
    return (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)


def rotation_z(tangent):
    """(3, 3) rational rotation about z by twice the angle with this tangent."""
    c, s = turn(tangent)
    return [[c, -s, Fraction(0)], [s, c, Fraction(0)], [Fraction(0), Fraction(0), Fraction(1)]]


def rotation(w, x, y, z):
    """(3, 3) rational rotation of a rational quaternion, not necessarily of unit length."""
    w, x, y, z = (Fraction(value) for value in (w, x, y, z))
    n = w * w + x * x + y * y + z * z
    return [
        [1 - 2 * (y * y + z * z) / n, 2 * (x * y - w * z) / n, 2 * (x * z + w * y) / n],
        [2 * (x * y + w * z) / n, 1 - 2 * (x * x + z * z) / n, 2 * (y * z - w * x) / n],
        [2 * (x * z - w * y) / n, 2 * (y * z + w * x) / n, 1 - 2 * (x * x + y * y) / n],
    ]


def compose(p, q):
    """Product of two (3, 3) matrices of Fractions."""
    return [[sum(p[i][k] * q[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def _product(values) -> Fraction:
    result = Fraction(1)
    for value in values:
        result *= value
    return result
