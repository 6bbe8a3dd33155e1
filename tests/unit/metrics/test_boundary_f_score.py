"""Boundary F-score: by hand, against a loop over all pairs of pixels, and by properties."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics import boundary


def loop(truth, prediction, n, ignore, tolerance) -> list[list[int]]:
    h, w = truth.shape

    def border(labels, c):
        found = []
        for i in range(h):
            for j in range(w):
                if labels[i, j] != c or truth[i, j] == ignore:
                    continue
                around = [(i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)]
                around = [(a, b) for a, b in around if 0 <= a < h and 0 <= b < w and truth[a, b] != ignore]
                if any(labels[a, b] != c for a, b in around):
                    found.append((i, j))
        return found

    def near(points, others):
        return sum(any(math.hypot(a - c, b - d) <= tolerance + 1e-9 for c, d in others) for a, b in points)

    rows = []
    for c in range(n):
        p, t = border(prediction, c), border(truth, c)
        rows.append([near(p, t), len(p), near(t, p), len(t)])
    return rows


@given(seed=st.integers(0, 2**32), tolerance=st.sampled_from([0.0, 1.0, math.sqrt(2), 2.5]))
@settings(max_examples=40)
def test_agrees_with_a_loop_over_all_pairs(seed: int, tolerance: float) -> None:
    rng = np.random.default_rng(seed)
    truth = np.kron(rng.integers(0, 4, (3, 4)), np.ones((3, 2), int))
    prediction = np.where(rng.random(truth.shape) < 0.1, rng.integers(0, 3, truth.shape), truth)
    got = boundary.counts(truth, prediction, 3, ignore=3, tolerance_px=tolerance)
    assert got.tolist() == loop(truth, prediction, 3, 3, tolerance)


def test_a_line_moved_by_one_pixel() -> None:
    truth, prediction = np.zeros((4, 8), int), np.zeros((4, 8), int)
    truth[:, 4:] = 1
    prediction[:, 5:] = 1
    strict = boundary.score(boundary.counts(truth, prediction, 2, tolerance_px=0))
    # class 0 ends in column 3 or 4, class 1 begins in column 4 or 5: nothing coincides
    assert strict.f_score == (0.0, 0.0)
    loose = boundary.score(boundary.counts(truth, prediction, 2, tolerance_px=1))
    assert loose.f_score == (1.0, 1.0)


def test_truth_is_perfect_and_an_absent_class_is_none() -> None:
    truth = np.kron(np.arange(6).reshape(2, 3), np.ones((4, 4), int))
    got = boundary.score(boundary.counts(truth, truth, 7, tolerance_px=0))
    assert got.f_score == (1.0,) * 6 + (None,)
    assert (got.mean_f_score, got.undefined_classes) == (1.0, 1)
    missed = boundary.score(boundary.counts(truth, np.zeros_like(truth), 6))
    assert missed.f_score == (0.0,) * 6  # one side has no boundary at all
    assert missed.precision[1] is None


def test_neither_image_border_nor_ignored_region_is_a_boundary() -> None:
    truth = np.zeros((5, 5), int)
    truth[:, 3:] = 9
    assert boundary.counts(truth, truth, 2, ignore=9).tolist() == [[0, 0, 0, 0]] * 2


def test_the_default_tolerance_is_that_of_the_paper() -> None:
    truth, prediction = np.zeros((300, 400), int), np.zeros((300, 400), int)  # diagonal 500: 3.75 px
    truth[:, 200:] = 1
    for shift, expected in ((3, 1.0), (4, 0.0)):
        prediction[:] = 0
        prediction[:, 200 + shift :] = 1
        assert boundary.score(boundary.counts(truth, prediction, 2)).mean_f_score == expected


def test_counts_of_images_add_up_and_turning_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    truth, prediction = np.kron(rng.integers(0, 3, (2, 4, 5)), np.ones((4, 4), int))
    got = boundary.counts(truth, prediction, 3, tolerance_px=2)
    assert np.array_equal(boundary.counts(truth.T, prediction.T, 3, tolerance_px=2), got)
    assert boundary.score(got + got) == boundary.score(got)


def test_a_prediction_at_an_ignored_pixel_may_be_anything() -> None:
    truth, prediction = np.array([[0, 0, 9], [0, 1, 9]]), np.array([[0, 0, 77], [0, 1, -1]])
    assert boundary.score(boundary.counts(truth, prediction, 2, ignore=9, tolerance_px=0)).f_score == (1.0, 1.0)


ONES = np.ones((2, 2), int)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: boundary.counts(np.zeros((2, 2, 2), int), np.zeros((2, 2, 2), int), 2), "one image at a time"),
        (lambda: boundary.counts(np.zeros((2, 2), int), np.zeros((2, 3), int), 2), "prediction has shape (2, 3)"),
        (lambda: boundary.counts(np.zeros((2, 2)), np.zeros((2, 2)), 2), "take the argmax first"),
        (
            lambda: boundary.counts(np.zeros((2, 2), int), np.zeros((2, 2), int), 2, tolerance_px=-1),
            "expected a number",
        ),
        (lambda: boundary.score(np.zeros((2, 3), int)), "(classes, 4)"),
        (lambda: boundary.counts(ONES, ONES, 1), "truth holds 1 at [0, 0]; expected 0..0 (labels counted from 1?)"),
        (lambda: boundary.counts(ONES * 255, ONES, 2), "pixels without a label? pass ignore=255"),
        (
            lambda: boundary.counts(ONES, ONES * -1, 2),
            "prediction holds -1 at [0, 0]; expected 0..1 (only truth may be",
        ),
        (lambda: boundary.counts(ONES, ONES, 0), "n_classes is 0"),
        (lambda: boundary.counts(ONES, ONES, 2, "void"), "ignore is 'void'; expected an integer"),
        (lambda: boundary.score(np.array([[0, 1, 0, 1], [1, 0, 0, 1]])), "boundary_counts[1] is [1, 0, 0, 1]"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)
