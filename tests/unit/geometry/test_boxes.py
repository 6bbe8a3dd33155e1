"""Boxes: what every box and pair of boxes must satisfy, closed forms, GIoU and errors. Exact volumes: next file."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from hsbench.errors import SchemaError
from hsbench.geometry import boxes
from tests.unit.geometry.box_samples import moved, oriented, upright

SEEDS = st.integers(0, 2**31 - 1)
IOU = {6: boxes.iou_aligned, 7: boxes.iou_upright, 15: boxes.iou_oriented}
PAIRS = {6: boxes.iou_aligned_pairs, 7: boxes.iou_upright_pairs, 15: boxes.iou_oriented_pairs}
GIOU = {6: boxes.giou_aligned, 7: boxes.giou_upright, 15: boxes.giou_oriented}
COMMON = {6: boxes.intersection_aligned, 7: boxes.intersection_upright, 15: boxes.intersection_oriented}
KINDS = pytest.mark.parametrize("kind", [6, 7, 15])


def sample(kind: int, seed: int, n: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return oriented(rng, n) if kind == 15 else upright(rng, n)[:, :kind]


def close(a: np.ndarray, b: np.ndarray | float, tolerance: float = 1e-9) -> bool:
    return bool(np.abs(np.asarray(a) - b).max(initial=0.0) <= tolerance)


# ---------------------------------------------------------------- every box, every pair


@KINDS
def test_5000_boxes_meet_themselves_fully(kind: int) -> None:
    a = sample(kind, 0, 5000)
    assert close(PAIRS[kind](a, a), 1.0, 1e-13)
    assert (PAIRS[kind](a, a) <= 1.0).all()


@KINDS
@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_swapping_transposes_bit_for_bit(kind: int, seed: int) -> None:
    a, b = sample(kind, seed, 9), sample(kind, seed + 1, 7)
    b[:2, 3:6] = a[:2, [4, 5, 3]]  # equal volumes, where the order of a pair is decided by the rest of the row
    for measure in (IOU[kind], GIOU[kind], COMMON[kind]):
        assert np.array_equal(measure(a, b), measure(b, a).T)


@KINDS
@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_measures_agree_and_stay_in_range(kind: int, seed: int) -> None:
    a, b = sample(kind, seed, 9), sample(kind, seed + 1, 9)
    iou, giou, common = IOU[kind](a, b), GIOU[kind](a, b), COMMON[kind](a, b)
    volume_a, volume_b = boxes.volumes(a)[:, None], boxes.volumes(b)
    assert ((iou >= 0) & (iou <= 1) & (giou > -1) & (giou <= iou)).all()
    assert ((common >= 0) & (common <= volume_a) & (common <= volume_b)).all()
    assert np.array_equal(common / (volume_a + volume_b - common), iou)
    assert np.array_equal(PAIRS[kind](a, b), np.diag(iou))


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_kinds_agree(seed: int) -> None:
    a, b = sample(6, seed, 9), sample(6, seed + 1, 9)
    still = np.zeros((9, 1))
    assert close(boxes.iou_upright(np.hstack([a, still]), np.hstack([b, still])), boxes.iou_aligned(a, b), 1e-13)
    a, b = sample(7, seed, 9), sample(7, seed + 1, 9)
    assert close(boxes.iou_oriented(boxes.as_oriented(a), boxes.as_oriented(b)), boxes.iou_upright(a, b), 1e-12)


@given(SEEDS, st.tuples(*[st.floats(-20, 20)] * 3))
@settings(max_examples=50, deadline=None)
def test_rigid_motion_changes_nothing(seed: int, shift: tuple[float, float, float]) -> None:
    a, b = sample(15, seed, 9), sample(15, seed + 1, 9)
    rotation = Rotation.random(random_state=seed).as_matrix()
    assert close(
        boxes.iou_oriented(moved(a, rotation, np.array(shift)), moved(b, rotation, np.array(shift))),
        boxes.iou_oriented(a, b),
        1e-12,
    )


@KINDS
@pytest.mark.parametrize("shift", [(1e6, 0, 0), (-1e6, 1e6, 1e6), (0, 3e5, -1e6)])
def test_a_thousand_kilometres_away(kind: int, shift: tuple[float, float, float]) -> None:
    a, b = sample(kind, 5, 300), sample(kind, 6, 300)
    b[:150] = a[:150]
    b[:75, 0] += np.linspace(0, 0.5, 75)
    far_a, far_b = a.copy(), b.copy()
    far_a[:, :3] += shift
    far_b[:, :3] += shift
    assert close(PAIRS[kind](far_a, far_b), PAIRS[kind](a, b), 1e-8)
    # relative to centres that are exact there, nothing at all may change
    far_a[:, :3] = np.round(far_a[:, :3])
    far_b[:, :3] = np.round(far_b[:, :3] * 4) / 4
    near_a, near_b = far_a.copy(), far_b.copy()
    near_a[:, :3] -= shift
    near_b[:, :3] -= shift
    assert close(PAIRS[kind](far_a, far_b), PAIRS[kind](near_a, near_b), 1e-15)


@KINDS
@given(SEEDS, st.floats(1e-9, 1.0))
@settings(max_examples=50, deadline=None)
def test_boxes_that_a_plane_parts_share_exactly_nothing(kind: int, seed: int, gap: float) -> None:
    a, b = sample(kind, seed, 20), sample(kind, seed + 1, 20)
    # planes along faces of a, along faces of b, along an edge of each, and any
    rng = np.random.default_rng(seed)
    axes_a, axes_b = (
        boxes.as_oriented(box)[:, 6:].reshape(-1, 3, 3)[np.arange(20), :, rng.integers(0, 3, 20)] for box in (a, b)
    )
    normal = np.stack([axes_a, axes_b, np.cross(axes_a, axes_b), rng.normal(size=(20, 3))])[
        np.arange(20) % 4, np.arange(20)
    ]
    normal += ~normal.any(axis=1, keepdims=True)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    top = np.einsum("nck,nk->nc", boxes.corners(a), normal).max(axis=1)
    bottom = np.einsum("nck,nk->nc", boxes.corners(b), normal).min(axis=1)
    b[:, :3] += normal * (top - bottom + gap)[:, None]
    assert (PAIRS[kind](a, b) == 0.0).all()
    b[:, :3] -= normal * gap  # now they touch
    assert (PAIRS[kind](a, b) <= 1e-12).all()


@KINDS
def test_no_specks(kind: int) -> None:
    """Of 100,000 pairs none shares a volume that is only rounding (1e-17 and the like; true ones are larger)."""
    iou = IOU[kind](sample(kind, 21, 500), sample(kind, 22, 200))
    assert 0.1 < (iou > 0).mean() < 0.9
    assert not ((iou > 0) & (iou < 1e-15)).any()


@KINDS
def test_shares_of_points_inside_both(kind: int) -> None:
    """Not exact, but independent of any geometry: 200,000 points a pair."""
    a, b = sample(kind, 7, 6), sample(kind, 8, 6)
    b[:, :3] = a[:, :3] + 0.2
    rng = np.random.default_rng(9)
    frame, other = boxes.as_oriented(a), boxes.as_oriented(b)
    for i, share in enumerate(np.diag(COMMON[kind](a, b)) / boxes.volumes(a)):
        points = rng.uniform(-0.5, 0.5, (200_000, 3)) * a[i, 3:6] @ frame[i, 6:].reshape(3, 3).T + a[i, :3]
        local = (points - b[i, :3]) @ other[i, 6:].reshape(3, 3)
        assert share == pytest.approx((np.abs(local) <= b[i, 3:6] / 2).all(axis=1).mean(), abs=0.006)


# ---------------------------------------------------------------- closed forms


@pytest.mark.parametrize("turn", [np.pi, -np.pi, 2 * np.pi, 0.0, 11 * np.pi])
def test_half_turns_leave_a_box_where_it_is(turn: float) -> None:
    a = sample(7, 1, 500)
    b = a + np.eye(7)[6] * turn
    assert close(boxes.iou_upright_pairs(a, b), 1.0, 1e-12)
    a[:, 6] = np.pi
    b[:, 6] = -np.pi
    assert close(boxes.iou_upright_pairs(a, b), 1.0, 1e-12)


@pytest.mark.parametrize("angle", [1e-15, 1e-9, 1e-4, 0.1, np.pi / 6, np.pi / 4, 1.5, np.pi / 2 - 1e-9])
@pytest.mark.parametrize("yaw", [0.0, 0.3, np.pi / 2, np.pi, -np.pi])
def test_turned_squares(angle: float, yaw: float) -> None:
    """A unit square and itself turned by an angle share 2 / (1 + sin + cos)."""
    common = 2 / (1 + np.sin(angle) + np.cos(angle))
    a, b = np.array([[3, -2, 1, 1, 1, 2, yaw]]), np.array([[3, -2, 1, 1, 1, 2, yaw + angle]])
    expected = pytest.approx(common / (2 - common), abs=1e-13)
    assert boxes.iou_upright(a, b)[0, 0] == expected
    assert boxes.iou_oriented(boxes.as_oriented(a), boxes.as_oriented(b))[0, 0] == expected


@pytest.mark.parametrize("thin", [1e-2, 1e-4, 1e-6])
@KINDS
def test_thin_boards_shifted_along_themselves(kind: int, thin: float) -> None:
    a = sample(kind, 2, 200)
    a[:, 3:6] = 2.0, 1.0, thin
    along = boxes.as_oriented(a)[:, [6, 9, 12]]  # the axis of l
    b = a.copy()
    b[:, :3] += along * 0.5  # 1.5 of 2 m remain common
    # 1e-15 times the aspect: the last bits of a centre and of a product of rotations, against the thickness
    assert close(PAIRS[kind](a, b), 1.5 / 2.5, max(1e-13, 1e-15 / thin))
    assert close(PAIRS[kind](a, a), 1.0, max(1e-13, 1e-15 / thin))


@KINDS
@given(SEEDS, st.floats(0.01, 1.0))
@settings(max_examples=30, deadline=None)
def test_nested_boxes(kind: int, seed: int, scale: float) -> None:
    a = sample(kind, seed, 10)
    b = a.copy()
    b[:, 3:6] *= scale
    assert close(PAIRS[kind](a, b), scale**3, 1e-12)
    inner = boxes.as_oriented(b)
    # moved until two of its faces lie in faces of the outer box
    b[:, :3] += np.einsum("nij,nj->ni", inner[:, 6:].reshape(-1, 3, 3), (a[:, 3:6] - b[:, 3:6]) / 2 * [1, 1, 0])
    assert close(PAIRS[kind](a, b), scale**3, 1e-12)


def test_touching_boxes() -> None:
    a = np.array([[0.1, 0.2, 0.3, 0.1, 0.2, 0.7, 0.6]])
    c, s = np.cos(0.6), np.sin(0.6)
    for step in (
        (0.1 * c, 0.1 * s, 0),
        (-0.2 * s, 0.2 * c, 0),
        (0, 0, 0.7),
        (0.1 * c - 0.2 * s, 0.1 * s + 0.2 * c, 0.7),
    ):
        b = a + [*step, 0, 0, 0, 0]
        assert boxes.iou_upright(a, b)[0, 0] <= 1e-15
        assert boxes.iou_oriented(boxes.as_oriented(a), boxes.as_oriented(b))[0, 0] <= 1e-15


def test_volumes_and_corners() -> None:
    a = np.array([[1.0, 2.0, 3.0, 4.0, 2.0, 6.0, np.pi / 2]])
    assert boxes.volumes(a) == pytest.approx([48.0])
    assert boxes.corners(a)[0, 0] == pytest.approx([2, 0, 0])  # l points along y, w along -x
    assert boxes.corners(a)[0, 4] == pytest.approx([2, 4, 0])
    assert boxes.corners(a)[0, 2] == pytest.approx([0, 0, 0])
    assert boxes.corners(a)[0, 7] == pytest.approx([0, 4, 6])
    b = sample(15, 3, 50)
    hulls = [ConvexHull(points).volume for points in boxes.corners(b)]
    assert boxes.volumes(b) == pytest.approx(hulls, rel=1e-9)
    assert boxes.corners(a[:, :6])[0, 7] == pytest.approx([3, 3, 6])


# ---------------------------------------------------------------- GIoU


def test_giou_by_hand() -> None:
    # unit cubes 1 m apart fill 2 of the 3 m3 that hold them; diagonal neighbours 2 of 4, or of a hull of 3
    a = np.array([[0, 0, 0, 1, 1, 1.0]])
    apart, diagonal = a + [2, 0, 0, 0, 0, 0], a + [1, 1, 0, 0, 0, 0]
    for kind in (6, 7, 15):
        x, y, z = (np.pad(box, ((0, 0), (0, kind % 6 == 1))) for box in (a, apart, diagonal))
        if kind == 15:
            x, y, z = (boxes.as_oriented(box) for box in (x, y, z))
        assert GIOU[kind](x, y)[0, 0] == pytest.approx(-1 / 3, abs=1e-12)
        assert GIOU[kind](x, z)[0, 0] == pytest.approx(-1 / 2 if kind == 6 else -1 / 3, abs=1e-12)
        assert GIOU[kind](x, x)[0, 0] == pytest.approx(1.0, abs=1e-12)
    # a cube standing on another, half as high: the prism is theirs exactly, so is the hull
    on_top = np.array([[0, 0, 0.75, 1, 1, 0.5, np.pi]])
    assert boxes.giou_upright(np.pad(a, ((0, 0), (0, 1))), on_top)[0, 0] == pytest.approx(0.0, abs=1e-12)


def test_giou_against_hulls_of_corners() -> None:
    a, b = sample(7, 11, 12), sample(7, 12, 12)
    expected, prisms = np.empty((12, 12)), np.empty((12, 12))
    for i, p in enumerate(boxes.corners(a)):
        for j, q in enumerate(boxes.corners(b)):
            points = np.concatenate([p, q])
            expected[i, j] = ConvexHull(points).volume
            prisms[i, j] = ConvexHull(points[:, :2]).volume * np.ptp(points[:, 2])
    union = boxes.volumes(a)[:, None] + boxes.volumes(b) - boxes.intersection_upright(a, b)
    iou = boxes.iou_upright(a, b)
    assert close(boxes.giou_upright(a, b), iou - (prisms - union) / prisms, 1e-12)
    as_oriented = boxes.giou_oriented(boxes.as_oriented(a), boxes.as_oriented(b))
    assert close(as_oriented, iou - (expected - union) / expected, 1e-12)
    assert (as_oriented >= boxes.giou_upright(a, b) - 1e-12).all()


def test_giou_is_continuous_in_small_turns() -> None:
    a = sample(7, 13, 40)
    for exponent in np.arange(-16, -2, 0.5):
        b = a + np.eye(7)[6] * 10**exponent
        for measure, x, y in ((boxes.giou_upright, a, b), (boxes.giou_oriented, *map(boxes.as_oriented, (a, b)))):
            values = np.array([measure(x[i : i + 1], y[i : i + 1])[0, 0] for i in range(len(x))])
            assert close(values, 1.0, 1e-9 + 200 * 10**exponent)


# ---------------------------------------------------------------- shapes, threads, errors


@KINDS
def test_no_boxes(kind: int) -> None:
    a, none = sample(kind, 0, 3), np.empty((0, kind))
    for measure in (IOU[kind], GIOU[kind], COMMON[kind]):
        assert measure(a, none).shape == (3, 0)
        assert measure(none, a).shape == (0, 3)
    assert PAIRS[kind](none, none).shape == (0,)
    assert boxes.corners(none).shape == (0, 8, 3)


@KINDS
def test_any_real_dtype_and_layout(kind: int) -> None:
    a = sample(kind, 4, 30).astype(np.float32)
    before = a.copy()
    assert close(PAIRS[kind](a, a), 1.0, 1e-12)  # float32 rotations are orthonormal to 1e-7 only
    assert np.array_equal(a, before)
    b = sample(kind, 5, 30)
    assert np.array_equal(IOU[kind](np.asfortranarray(b), b[::-1]), IOU[kind](b, b[::-1].copy()))


def test_threads_never_change_anything() -> None:
    a, b = sample(15, 1, 37), sample(15, 2, 23)
    alone = boxes.iou_oriented(a, b)
    for threads in (2, 3, 64):
        assert np.array_equal(boxes.iou_oriented(a, b, threads=threads), alone)
    with pytest.raises(SchemaError, match="threads is 0"):
        boxes.iou_oriented(a, b, threads=0)


def wrong(kind: int, column: int | slice, value: object) -> np.ndarray:
    a = sample(kind, 0, 5)
    a[3, column] = value
    return a


IDENTITY = np.eye(3).ravel()


@pytest.mark.parametrize(
    ("kind", "bad", "message"),
    [
        (7, wrong(7, 6, np.nan), r"b\[3\] holds nan in yaw"),
        (7, wrong(7, 1, np.inf), r"b\[3\] holds inf in centre y"),
        (15, wrong(15, 9, np.nan), r"b\[3\] holds nan in its rotation"),
        (6, wrong(6, 4, 0.0), r"b\[3\] has size .* 0, .*corners instead of centre and size"),
        (7, wrong(7, 3, -1.0), r"b\[3\] has size \(-1, "),
        (7, wrong(7, 3, 1e-10), r"b\[3\] has size .*logarithm"),
        (7, wrong(7, 3, 1e10), r"b\[3\] has size"),
        (7, wrong(7, 2, -2e9), r"b\[3\] has centre"),
        (15, wrong(15, slice(6, 15), 2 * IDENTITY), r"b\[3\] has a rotation .* 3; .*scaled, or a quaternion"),
        (15, wrong(15, slice(6, 15), IDENTITY.round(3) + 1e-4), r"b\[3\] has a rotation .*rounded for print"),
        (15, wrong(15, slice(6, 15), 1e300 * IDENTITY), r"b\[3\] has a rotation"),
        (
            15,
            wrong(15, slice(6, 15), IDENTITY * [1, 1, 1, 1, 1, 1, 1, 1, -1]),
            r"b\[3\] .*determinant -1.*axis flipped",
        ),
        (7, sample(6, 0, 4), r"b has shape \(4, 6\); expected \(N, 7\) upright .*look like aligned"),
        (7, sample(7, 0, 4)[0], r"b has shape \(7,\).*single box"),
        (7, np.array([]), r"b has shape \(0,\).*no boxes"),
        (7, sample(7, 0, 4).T, r"b has shape \(7, 4\).*transposed"),
        (15, np.zeros((4, 8, 3)), r"b has shape \(4, 8, 3\).*corners"),
        (7, np.zeros((4, 8)), r"b has shape \(4, 8\).*score or class"),
        (7, np.ones((4, 5)), r"b has shape \(4, 5\); expected \(N, 7\) upright boxes: centre x y z, size l w h, yaw$"),
        (7, np.ones((4, 7), dtype=bool), "b has dtype bool"),
        (7, np.ones((4, 7), dtype=complex), "b has dtype complex128"),
        (7, np.full((4, 7), "1"), "b has dtype <U1"),
    ],
)
def test_bad_boxes(kind: int, bad: np.ndarray, message: str) -> None:
    good = sample(kind, 1, 2)
    for measure in (IOU[kind], GIOU[kind], COMMON[kind]):
        with pytest.raises(SchemaError, match=message):
            measure(good, bad)
        with pytest.raises(SchemaError, match="^a" + message.removeprefix("b")):
            measure(bad, good)


def test_pairs_of_unequal_number() -> None:
    with pytest.raises(SchemaError, match="a has 2 boxes and b 3; expected pairs"):
        boxes.iou_upright_pairs(sample(7, 0, 2), sample(7, 0, 3))


def test_importing_compiles_nothing() -> None:
    code = (
        "import sys; from hsbench.geometry import boxes, box_overlap as o;"
        "assert not any(f.signatures for f in (o.fill_aligned, o.fill_upright, o.fill_oriented));"
        "assert 'scipy.spatial' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
