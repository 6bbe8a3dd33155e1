"""IoU against exact rational volumes and scipy's half-spaces, mostly on ties and near them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

from hsbench.geometry import boxes
from tests.reference import exact_boxes as exact
from tests.unit.geometry.box_samples import oriented, row, turned

CM = Fraction(1, 100)
ZERO = (Fraction(0),) * 3
# tangents of half the yaw: 0, 3-4-5, 5-12-13, 8-15-17 and quarter turns
YAW_TANGENTS = [
    Fraction(n, d) for n, d in ((0, 1), (1, 3), (1, 2), (-1, 2), (2, 3), (1, 5), (1, 4), (1, 1), (-1, 1), (3, 1))
]
QUATERNIONS = [
    (1, 0, 0, 0),
    (1, 1, 0, 0),
    (1, 1, 1, 1),
    (1, 0, 1, 0),
    (2, 1, 0, 0),
    (1, 2, 2, 0),
    (3, 1, 1, 2),
    (0, 1, 0, 1),
]

lengths = st.integers(1, 8).map(lambda n: n * 10 * CM)
offsets = st.integers(-6, 6).map(lambda n: n * 5 * CM)
fine = st.integers(-60, 60).map(lambda n: n * CM)
centres = st.tuples(offsets, offsets, offsets) | st.tuples(fine, fine, fine)
sizes = st.tuples(lengths, lengths, lengths)


def check_oriented(a, b, tolerance: float = 1e-12) -> None:
    expected = float(exact.iou(a, b))
    assert boxes.iou_oriented(row(a), row(b))[0, 0] == pytest.approx(expected, abs=tolerance)


# ---------------------------------------------------------------- ties, exactly


def test_the_oracle_itself() -> None:
    unit = (ZERO, (Fraction(1),) * 3, exact.rotation(1, 0, 0, 0))
    assert exact.intersection(unit, unit) == 1
    half = ((Fraction(1, 2), *ZERO[:2]), *unit[1:])
    assert exact.iou(unit, half) == Fraction(1, 3)
    c, s = exact.turn(Fraction(1, 3))
    assert (c, s) == (Fraction(4, 5), Fraction(3, 5))
    turned_by_345 = (ZERO, unit[1], exact.rotation_z(Fraction(1, 3)))
    assert exact.intersection(unit, turned_by_345) == 2 / (1 + s + c)
    tetrahedron = [((Fraction(-1), *ZERO[:2]), Fraction(0)), ((Fraction(0), Fraction(-1), Fraction(0)), Fraction(0))]
    tetrahedron += [((*ZERO[:2], Fraction(-1)), Fraction(0)), ((Fraction(1),) * 3, Fraction(1))]
    assert exact.volume(tetrahedron) == Fraction(1, 6)


@given(centres, sizes, sizes, *[st.sampled_from(YAW_TANGENTS)] * 2, st.booleans())
@settings(max_examples=150, deadline=None)
def test_upright_boxes_on_a_grid(centre, size_a, size_b, tangent_a, tangent_b, same) -> None:
    if same:
        size_b, tangent_b = size_a, tangent_a
        centre = tuple(round(x / s) * s for x, s in zip(centre, size_a, strict=True))  # identical, or face to face
        c, s = exact.turn(tangent_a)
        centre = (c * centre[0] - s * centre[1], s * centre[0] + c * centre[1], centre[2])
    a = (ZERO, size_a, exact.rotation_z(tangent_a))
    b = (centre, size_b, exact.rotation_z(tangent_b))
    footprints = [(box[0][:2], box[1][:2], [line[:2] for line in box[2][:2]]) for box in (a, b)]
    heights = [((box[0][2],), (box[1][2],), [[Fraction(1)]]) for box in (a, b)]
    common = exact.intersection(*footprints) * exact.intersection(*heights)
    volume_a, volume_b = (box[1][0] * box[1][1] * box[1][2] for box in (a, b))
    expected = pytest.approx(float(common / (volume_a + volume_b - common)), abs=1e-12)
    rows = [
        np.array([[float(x) for x in (*box[0], *box[1])] + [2 * np.arctan(float(tangent))]])
        for box, tangent in ((a, tangent_a), (b, tangent_b))
    ]
    assert boxes.iou_upright(*rows)[0, 0] == expected
    assert boxes.iou_oriented(row(a), row(b))[0, 0] == expected
    if tangent_a == tangent_b == 0:
        assert boxes.iou_aligned(rows[0][:, :6], rows[1][:, :6])[0, 0] == expected


@given(centres, sizes, sizes, *[st.sampled_from(QUATERNIONS)] * 2)
@settings(max_examples=60, deadline=None)
def test_oriented_boxes_on_a_grid(centre, size_a, size_b, turn_a, turn_b) -> None:
    check_oriented((ZERO, size_a, exact.rotation(*turn_a)), (centre, size_b, exact.rotation(*turn_b)))


@given(*[st.integers(-1, 1)] * 3, sizes, sizes, st.sampled_from(QUATERNIONS))
@settings(max_examples=60, deadline=None)
def test_oriented_boxes_that_share_faces_edges_or_corners(i, j, k, size_a, size_b, turn) -> None:
    """Along each axis flush inside (-1), centred (0) or face to face outside (1)."""
    local = [(b + side * a) / 2 * (side != 0) for side, a, b in zip((i, j, k), size_b, size_a, strict=True)]
    rotation = exact.rotation(*turn)
    centre = tuple(sum(line[m] * local[m] for m in range(3)) for line in rotation)
    check_oriented((ZERO, size_a, rotation), (centre, size_b, rotation))


# ---------------------------------------------------------------- near ties


TIES = {
    "identical": (ZERO, (Fraction(2), Fraction(1), Fraction(1, 2))),
    "face to face": ((Fraction(2), Fraction(0), Fraction(0)), (Fraction(2), Fraction(1), Fraction(1, 2))),
    "flush inside": ((Fraction(1, 2), Fraction(1, 4), Fraction(0)), (Fraction(1), Fraction(1, 2), Fraction(1, 2))),
    "slid along a face": ((Fraction(1, 3), Fraction(1, 7), Fraction(0)), (Fraction(2), Fraction(1), Fraction(1, 2))),
}


@pytest.mark.parametrize("tie", TIES)
@pytest.mark.parametrize("exponent", range(16))
def test_relative_rotations_exactly(tie: str, exponent: int) -> None:
    centre, size = TIES[tie]
    base = exact.rotation(3, 1, 1, 2)
    a = (ZERO, (Fraction(2), Fraction(1), Fraction(1, 2)), base)
    centre = tuple(sum(line[m] * centre[m] for m in range(3)) for line in base)
    for axis in ((0, 0, 1), (1, -2, 2)):
        b = (centre, size, exact.compose(base, exact.rotation(2 * 10**exponent, *axis)))
        check_oriented(a, b)


@pytest.mark.parametrize("tie", TIES)
def test_continuous_through_tiny_rotations_and_shifts(tie: str) -> None:
    """No value may leave the tie's by more than the change of the box allows: 300 angles of any axis, 300 shifts."""
    rng = np.random.default_rng(1)
    rotation = Rotation.random(random_state=3).as_matrix()
    a = turned(row((ZERO, (2, 1, Fraction(1, 2)), np.eye(3))), rotation)
    b = turned(row((*TIES[tie], np.eye(3))), rotation)
    b[:, :3] = rotation @ b[0, :3]
    still = boxes.iou_oriented(a, b)[0, 0]
    for angle in 10 ** np.linspace(-16, -3, 300):
        axis = rng.normal(size=3)
        small = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
        assert boxes.iou_oriented(a, turned(b, small))[0, 0] == pytest.approx(still, abs=1e-13 + 20 * angle)
        shifted = b.copy()
        shifted[:, :3] += angle * axis
        assert boxes.iou_oriented(a, shifted)[0, 0] == pytest.approx(still, abs=1e-13 + 50 * angle)
    yaws = 10 ** np.linspace(-16, -3, 300)
    a, b = np.array([[0, 0, 0, 2, 1, 0.5, 0.4]]), np.tile([[0, 0, 0, 2, 1, 0.5, 0.4]], (300, 1))
    b[:, 6] += yaws
    assert (np.abs(boxes.iou_upright(a, b)[0] - 1) <= 1e-14 + 5 * yaws).all()


@given(centres, sizes, st.sampled_from(QUATERNIONS), st.integers(3, 15), st.tuples(*[st.integers(-3, 3)] * 3))
@settings(max_examples=60, deadline=None)
def test_nearly_parallel_boxes_on_a_grid(centre, size, turn, exponent, axis) -> None:
    a = (ZERO, (60 * CM, 40 * CM, 20 * CM), exact.rotation(*turn))
    b = (centre, size, exact.compose(a[2], exact.rotation(10**exponent, *axis)))
    check_oriented(a, b)


# ---------------------------------------------------------------- general pairs


def common_volume_by_half_spaces(a: np.ndarray, b: np.ndarray) -> float:
    """Qhull's volume of the intersection of twelve half-spaces, around their Chebyshev centre."""
    planes = []
    for box in (a, b):
        normals = np.vstack([box[6:].reshape(3, 3).T, -box[6:].reshape(3, 3).T])
        planes.append(np.column_stack([normals, -normals @ box[:3] - np.tile(box[3:6] / 2, 2)]))
    stacked = np.vstack(planes)
    found = linprog([0, 0, 0, -1], np.column_stack([stacked[:, :3], np.ones(12)]), -stacked[:, 3], bounds=(None, None))
    if not found.success or found.x[3] <= 1e-9:
        return 0.0
    return float(ConvexHull(HalfspaceIntersection(stacked, found.x[:3]).intersections).volume)


def test_random_pairs_against_half_spaces() -> None:
    rng = np.random.default_rng(4)
    a, b = oriented(rng, 300), oriented(rng, 300)
    expected = np.array([common_volume_by_half_spaces(p, q) for p, q in zip(a, b, strict=True)])
    assert (expected > 0).sum() > 150
    found = np.diag(boxes.intersection_oriented(a, b))
    assert found == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize("thin", [1e-2, 1e-3, 1e-4])
def test_thin_boards_across_each_other(thin: float) -> None:
    """Two boards that cross share thin^2 / sin(angle) times the common length of the line they cross in."""
    for angle in (0.2, 0.7, np.pi / 2, 2.5):
        rotation = Rotation.random(random_state=5).as_matrix()
        a = turned(row((ZERO, (1, Fraction(1, 2), thin), np.eye(3))), rotation)
        b = turned(row((ZERO, (Fraction(3, 4), 1, thin), Rotation.from_euler("y", angle).as_matrix())), rotation)
        common = thin**2 / np.sin(angle) * 0.5
        assert boxes.intersection_oriented(a, b)[0, 0] == pytest.approx(common, rel=1e-9)
