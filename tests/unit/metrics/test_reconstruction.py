"""Surfaces: by hand, against loops over all pairs, and by properties."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.geometry import transforms
from hsbench.metrics import reconstruction
from hsbench.metrics.reconstruction import aggregate, counts, score, thin, voxel_surface

NONE = np.empty((0, 3))


def test_three_points_by_hand() -> None:
    truth = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])
    prediction = np.array([[0, 0, 0.1], [1, 0, 0.3]])
    got = score(truth, prediction, 0.1)
    assert (got.accuracy, got.completeness) == (0.5, 1 / 3)
    assert got.f_score == pytest.approx(2 * 0.5 / 3 / (0.5 + 1 / 3), abs=1e-15)
    assert got.accuracy_m == pytest.approx(0.2, abs=1e-15)
    third = np.hypot(1.0, 0.3)  # (2, 0, 0) is nearest to (1, 0, .3)
    assert got.completeness_m == pytest.approx((0.1 + 0.3 + third) / 3, abs=1e-15)
    assert got.chamfer_m == pytest.approx((got.accuracy_m + got.completeness_m) / 2, abs=1e-15)


@given(seed=st.integers(0, 2**32), sizes=st.tuples(st.integers(0, 30), st.integers(0, 30)))
@settings(max_examples=60)
def test_agrees_with_all_pairs(seed: int, sizes: tuple[int, int]) -> None:
    rng = np.random.default_rng(seed)
    truth, prediction = (rng.random((n, 3)) for n in sizes)
    got = counts(truth, prediction, 0.3)
    table = np.linalg.norm(truth[:, None] - prediction[None], axis=2)
    if min(sizes):
        assert got.predicted_near == (table.min(axis=0) <= 0.3).sum()
        assert got.true_near == (table.min(axis=1) <= 0.3).sum()
        assert got.predicted_m == pytest.approx(table.min(axis=0).sum(), abs=1e-9)
        assert got.true_m == pytest.approx(table.min(axis=1).sum(), abs=1e-9)
    else:
        assert got.predicted_near == got.true_near == 0
    assert (got.true, got.predicted) == sizes
    swapped = counts(prediction, truth, 0.3)
    assert (swapped.predicted_near, swapped.predicted_m) == (got.true_near, got.true_m)


def test_truth_is_perfect_and_order_no_matter() -> None:
    rng = np.random.default_rng(0)
    truth, prediction = rng.random((2, 200, 3))
    perfect = score(truth, truth)
    assert (perfect.accuracy, perfect.completeness, perfect.f_score, perfect.chamfer_m) == (1.0, 1.0, 1.0, 0.0)
    expected = score(truth, prediction)
    order = rng.permutation(200)
    assert score(truth[order], prediction[order[::-1]]) == expected
    assert score(np.asfortranarray(truth), prediction) == expected
    close = score(truth.astype(np.float32), prediction.astype(np.float32))
    assert close.chamfer_m == pytest.approx(expected.chamfer_m, abs=1e-6)


def test_a_rigid_motion_changes_nothing() -> None:
    rng = np.random.default_rng(1)
    truth, prediction = rng.random((2, 100, 3))
    c, s = np.cos(0.7), np.sin(0.7)
    pose = transforms.rigid(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]), np.array([3.0, -2.0, 1.0]))
    got, moved = score(truth, prediction), score(transforms.apply(pose, truth), transforms.apply(pose, prediction))
    assert moved.f_score == got.f_score
    assert moved.chamfer_m == pytest.approx(got.chamfer_m, abs=1e-12)


def test_the_threshold_itself_is_near() -> None:
    # a layer of voxels moved by two voxels of .05 m is .1 m away, up to the last bits
    truth = np.stack(np.meshgrid(np.arange(9), np.arange(9), [0]), axis=-1).reshape(-1, 3) * 0.05 + 0.7
    got = score(truth, truth + [0, 0, 0.1], 0.1)
    assert (got.accuracy, got.completeness) == (1.0, 1.0)


def test_missing_sides() -> None:
    point = np.zeros((1, 3))
    missed = score(point, NONE)
    assert (missed.accuracy, missed.completeness, missed.f_score, missed.chamfer_m) == (None, 0.0, 0.0, None)
    invented = score(NONE, point)
    assert (invented.accuracy, invented.completeness, invented.f_score) == (0.0, None, 0.0)
    nothing = score(NONE, NONE)
    assert (nothing.accuracy, nothing.completeness, nothing.f_score, nothing.undefined_scenes) == (None, None, None, 1)


def test_scenes_are_summed_first() -> None:
    near, far = np.zeros((1, 3)), np.ones((3, 3))
    got = aggregate([counts(near, near), counts(near, far), counts(near, NONE)])
    assert (got.accuracy, got.completeness) == (1 / 4, 1 / 3)
    assert got.accuracy_m == pytest.approx(3 * np.sqrt(3) / 4, abs=1e-12)
    assert (got.scenes, got.undefined_scenes) == (3, 1)


def test_faces_of_voxels() -> None:
    occupied = np.zeros((3, 3, 3), bool)
    occupied[1, 1, 1] = True
    got = voxel_surface(occupied, (10.0, 0.0, 0.0), 0.5)
    expected = np.array([[1, 1.5, 1.5], [2, 1.5, 1.5], [1.5, 1, 1.5], [1.5, 2, 1.5], [1.5, 1.5, 1], [1.5, 1.5, 2]])
    assert sorted(got.tolist()) == sorted((expected * 0.5 + [10, 0, 0]).tolist())
    assert len(voxel_surface(np.ones((3, 3, 3), bool), (0, 0, 0), 0.5)) == 0
    random = np.random.default_rng(2).random((4, 5, 6)) < 0.5
    faces = sum(int((np.diff(random.astype(int), axis=a) != 0).sum()) for a in range(3))
    assert len(voxel_surface(random, (0, 0, 0), 0.05)) == faces


def test_thinning() -> None:
    points = np.array([[0.1, 0.1, 0.1], [0.3, 0.1, 0.1], [1.2, 0, 0], [-0.1, 0, 0]])
    assert thin(points, 1.0).tolist() == [[-0.1, 0, 0], [0.2, 0.1, 0.1], [1.2, 0, 0]]
    rng = np.random.default_rng(3)
    many = rng.random((500, 3))
    assert np.array_equal(thin(many, 0.2), thin(many[rng.permutation(500)], 0.2))
    assert thin(NONE, 0.1).shape == (0, 3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: score(np.zeros((3, 4)), NONE), "truth is float64 (3, 4); expected numbers (N, 3)"),
        (lambda: score(NONE, [[0, 0, 0]]), "prediction is list"),
        (lambda: score(NONE, np.array([[0, 0, 0], [0, np.nan, 0]])), "prediction[1] holds NaN"),
        (lambda: score(np.full((1, 3), 2e5), NONE), "millimetres?"),
        (lambda: score(NONE, NONE, 0.0), "threshold_m is 0.0"),
        (lambda: aggregate([]), "one scene or more"),
        (lambda: thin(NONE, 0.0), "spacing_m is 0.0"),
        (lambda: voxel_surface(np.zeros((2, 2, 2)), (0, 0, 0), 0.1), "occupied is float64; expected bool"),
        (lambda: voxel_surface(np.zeros((2, 2), bool), (0, 0, 0), 0.1), "expected (nx, ny, nz)"),
        (lambda: voxel_surface(np.zeros((2, 2, 2), bool), (0, 0, np.nan), 0.1), "origin_m is (0, 0, nan)"),
        (lambda: voxel_surface(np.zeros((2, 2, 2), bool), (0, 0, 0), np.inf), "voxel_m is inf"),
        (lambda: thin(NONE, np.inf), "spacing_m is inf"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)


def test_the_threshold_of_the_task() -> None:
    assert reconstruction.THRESHOLD_M == 0.1
