"""Several labels a pixel: by hand, against plain loops and scikit-learn, and by properties; the counting pass too."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics import multilabel
from hsbench.metrics.multilabel import planes, score, tables
from hsbench.metrics.tables import Counts, count
from hsbench.schema.states import Affordance


@given(
    seed=st.integers(0, 2**32),
    shape=st.sampled_from([(1,), (7,), (8,), (2041,), (3, 5, 9), (4, 4, 4), (17, 160)]),
    density=st.sampled_from([0.0, 0.3, 1.0]),
    masked=st.booleans(),
    fortran=st.booleans(),
)
@settings(max_examples=120)
def test_counting_agrees_with_numpy(seed: int, shape: tuple, density: float, masked: bool, fortran: bool) -> None:
    rng = np.random.default_rng(seed)
    truth, prediction, mask = (rng.random(shape) < p for p in (0.5, density, 0.7))
    if fortran:
        truth, prediction, mask = map(np.asfortranarray, (truth, prediction, mask))
    inside = mask if masked else np.ones(shape, bool)
    expected = Counts(
        int((truth & prediction & inside).sum()),
        int((~truth & prediction & inside).sum()),
        int((truth & ~prediction & inside).sum()),
        int((~truth & ~prediction & inside).sum()),
    )
    assert count(truth, prediction, mask if masked else None) == expected
    assert count(truth, prediction, mask if masked else None).total == inside.sum()


def test_counting_takes_views_and_mixed_layouts() -> None:
    rng = np.random.default_rng(0)
    truth, prediction = rng.random((2, 20, 30)) < 0.5
    expected = count(truth.copy(), prediction.copy())
    assert count(truth, np.asfortranarray(prediction)) == expected
    assert count(truth[::-1, ::-1], prediction[::-1, ::-1]) == expected
    assert count(truth.T, prediction.T) == expected
    flat = np.concatenate([[True, False, True], truth.ravel()])  # words that start at any byte
    assert count(flat[3:], prediction.ravel()) == expected
    assert all(type(value) is int for value in (expected.tp, expected.fp, expected.fn, expected.tn))


def test_two_labels_by_hand() -> None:
    truth = np.array([[1, 1, 0, 0], [1, 0, 0, 0]], bool)
    prediction = np.array([[1, 0, 1, 0], [1, 1, 0, 0]], bool)
    assert tables(truth, prediction).tolist() == [[1, 1, 1, 1], [1, 1, 0, 2]]
    ignored = np.array([[0, 1, 0, 0], [0, 0, 0, 0]], bool)
    got = tables(truth, prediction, ignored)
    assert got.tolist() == [[1, 1, 0, 1], [1, 1, 0, 2]]
    assert tables(truth, prediction, np.array([0, 1, 0, 0], bool)).tolist() == [[1, 1, 0, 1], [1, 0, 0, 2]]
    values = score(got)
    assert values.iou == (0.5, 0.5)
    assert values.mean_iou == 0.5
    assert values.labels[0].precision == 0.5


def test_scikit_learn_gives_the_same_tables() -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    truth, prediction = np.random.default_rng(1).random((2, 3, 500)) < 0.4
    got = tables(truth, prediction)
    expected = metrics.multilabel_confusion_matrix(truth.T, prediction.T)
    assert got.tolist() == [[m[1, 1], m[0, 1], m[1, 0], m[0, 0]] for m in expected]
    jaccard = metrics.jaccard_score(truth.T, prediction.T, average=None)
    assert score(got).iou == pytest.approx(tuple(jaccard), abs=1e-12)


def test_truth_is_perfect_and_an_absent_label_is_none_and_counted() -> None:
    truth = np.zeros((2, 5, 5), bool)
    truth[0, 2] = True
    got = score(tables(truth, truth))
    assert (got.iou, got.mean_iou, got.undefined_labels) == ((1.0, None), 1.0, 1)
    nothing = score(np.zeros((2, 4), int))
    assert (nothing.mean_iou, nothing.undefined_labels) == (None, 2)


def test_tables_of_scenes_add_up_and_resample() -> None:
    rng = np.random.default_rng(2)
    truth, prediction = rng.random((2, 3, 40)) < 0.5
    whole = tables(truth, prediction)
    parts = tables(truth[:, :13], prediction[:, :13]) + tables(truth[:, 13:], prediction[:, 13:])
    assert np.array_equal(whole, parts)
    flat = np.stack([whole.ravel(), np.zeros(12, int)])
    values = multilabel.mean_iou(flat)
    assert values[0] == pytest.approx(score(whole).mean_iou, abs=1e-15)
    assert np.isnan(values[1])


def test_bit_fields() -> None:
    bits = np.array([[0b001, 0b110], [0b111, 0]], np.uint8)
    got = planes(bits, (Affordance.WALKABLE, Affordance.SITTABLE, Affordance.INTERACTABLE))
    assert got.astype(int).tolist() == [[[1, 0], [1, 0]], [[0, 1], [1, 0]], [[0, 1], [1, 0]]]


PLANE = np.zeros((2, 4), bool)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: tables(PLANE[0], PLANE[0]), "one label? add an axis"),
        (lambda: tables(PLANE, PLANE.astype(float)), "choose a threshold first"),
        (lambda: tables(PLANE, PLANE.T), "axes in another order?"),
        (lambda: tables(PLANE.astype(np.uint8), PLANE), "truth is uint8; expected bool"),
        (lambda: tables(PLANE, PLANE, np.zeros(3, bool)), "ignored has shape (3,); expected (4,)"),
        (lambda: score(np.zeros((2, 3), int)), "(labels, 4)"),
        (lambda: score(-np.ones((2, 4), int)), "label_tables holds -1; expected counts"),
        (lambda: multilabel.mean_iou(np.zeros((2, 5), int)), "flatten their last two axes"),
        (lambda: planes(np.zeros(3, int), (0,)), "expected unsigned integers"),
        (lambda: planes(np.zeros(3, np.uint8), (8,)), "a mask 1 << k?"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)
