"""Confusion matrices and what follows from them: by hand, against plain loops and scikit-learn, and by properties."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics import segmentation
from hsbench.metrics.bootstrap import interval
from hsbench.metrics.segmentation import ABSENT_RULES, confusion_matrix, score, score_scenes

DTYPES = (np.uint8, np.int8, np.uint16, np.int32, np.int64, np.uint64)


def loop(truth, prediction, n, ignore=None, no_answer=None) -> list[list[int]]:
    table = [[0] * (n + (no_answer is not None)) for _ in range(n)]
    for t, p in zip(truth.ravel().tolist(), prediction.ravel().tolist(), strict=True):
        if t != ignore:
            table[t][n if p == no_answer else p] += 1
    return table


def test_six_pixels_by_hand() -> None:
    truth = np.array([[0, 0, 1], [1, 2, 9]])
    prediction = np.array([[0, 1, 1], [1, 0, 2]])
    matrix = confusion_matrix(truth, prediction, 3, ignore=9)
    assert matrix.tolist() == [[1, 1, 0], [0, 2, 0], [1, 0, 0]]
    assert matrix.dtype == np.int64
    got = score(matrix)
    assert got.iou == (1 / 3, 2 / 3, 0.0)
    assert got.mean_iou == pytest.approx(1 / 3, abs=1e-15)
    assert got.pixel_accuracy == 3 / 5
    assert got.class_accuracy == (0.5, 1.0, 0.0)
    assert got.mean_class_accuracy == 0.5
    assert got.frequency_weighted_iou == pytest.approx(2 / 5 / 3 + 2 / 5 * 2 / 3, abs=1e-15)
    assert (got.undefined_classes, got.absent_classes) == (0, 0)


@given(
    seed=st.integers(0, 2**32),
    n=st.sampled_from([1, 2, 5, 21, 253, 254, 255, 256, 300]),
    dtypes=st.tuples(st.sampled_from(DTYPES), st.sampled_from(DTYPES)),
    shape=st.sampled_from([(1,), (7,), (64,), (5, 3), (4, 6, 2)]),
)
@settings(max_examples=150)
def test_agrees_with_a_plain_loop(seed: int, n: int, dtypes: tuple, shape: tuple[int, ...]) -> None:
    n = min(n, *(np.iinfo(d).max for d in dtypes))
    rng = np.random.default_rng(seed)
    truth, prediction = (rng.integers(0, n, shape).astype(d) for d in dtypes)
    assert confusion_matrix(truth, prediction, n).tolist() == loop(truth, prediction, n)
    ignore, missing = int(truth.flat[0]), int(prediction.flat[-1])
    got = confusion_matrix(truth, prediction, n, ignore, no_answer=missing)
    assert got.tolist() == loop(truth, prediction, n, ignore, missing)


def test_scikit_learn_gives_the_same_matrix_and_iou() -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    rng = np.random.default_rng(1)
    truth, prediction = rng.integers(0, 21, (2, 300, 200)).astype(np.uint8)
    got = confusion_matrix(truth, prediction, 21)
    assert np.array_equal(got, metrics.confusion_matrix(truth.ravel(), prediction.ravel(), labels=np.arange(21)))
    expected = metrics.jaccard_score(truth.ravel(), prediction.ravel(), average=None)
    np.testing.assert_allclose(score(got).iou, expected, rtol=0, atol=1e-12)
    accuracy = metrics.accuracy_score(truth.ravel(), prediction.ravel())
    assert score(got).pixel_accuracy == pytest.approx(accuracy, abs=1e-12)
    balanced = metrics.balanced_accuracy_score(truth.ravel(), prediction.ravel())
    assert score(got).mean_class_accuracy == pytest.approx(balanced, abs=1e-12)


@given(seed=st.integers(0, 2**32), cut=st.integers(0, 60))
@settings(max_examples=40)
def test_order_chunks_and_memory_layout_change_nothing(seed: int, cut: int) -> None:
    rng = np.random.default_rng(seed)
    truth, prediction = rng.integers(0, 5, (2, 6, 10)).astype(np.uint8)
    expected = confusion_matrix(truth, prediction, 4, ignore=4, no_answer=4)
    order = rng.permutation(60)
    assert np.array_equal(
        confusion_matrix(truth.ravel()[order], prediction.ravel()[order], 4, 4, no_answer=4), expected
    )
    parts = [
        confusion_matrix(truth.ravel()[part], prediction.ravel()[part], 4, 4, no_answer=4)
        for part in (slice(cut), slice(cut, None))
    ]
    assert np.array_equal(parts[0] + parts[1], expected)
    fortran = np.asfortranarray(truth), prediction.repeat(2, axis=1)[:, ::2]
    assert np.array_equal(confusion_matrix(*fortran, 4, 4, no_answer=4), expected)
    shifted = np.concatenate([[0, 1, 2], truth.ravel()]).astype(np.uint8)[3:]  # words that start at any byte
    assert np.array_equal(confusion_matrix(shifted, prediction.ravel(), 4, 4, no_answer=4), expected)
    renamed = rng.permutation(4)
    names = np.append(renamed, 4)
    moved = confusion_matrix(names[truth], names[prediction], 4, 4, no_answer=4)
    assert np.array_equal(moved[np.ix_(renamed, np.append(renamed, 4))], expected)


def test_whole_chunks_of_wide_labels_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    truth, prediction = rng.integers(0, 300, (2, 1000))
    expected = confusion_matrix(truth, prediction, 300)
    monkeypatch.setattr(segmentation, "CHUNK", 7)
    monkeypatch.setattr(segmentation, "MAX_PART", 64)
    assert np.array_equal(confusion_matrix(truth, prediction, 300), expected)
    small = confusion_matrix(truth % 9, prediction % 9, 9)
    assert small.tolist() == loop(truth % 9, prediction % 9, 9)
    assert np.array_equal(confusion_matrix((truth % 9).astype(np.uint8), (prediction % 9).astype(np.uint8), 9), small)


@given(seed=st.integers(0, 2**32))
@settings(max_examples=30)
def test_truth_as_prediction_is_perfect_under_every_rule(seed: int) -> None:
    truth = np.random.default_rng(seed).integers(0, 4, 50)
    matrix = confusion_matrix(truth, truth, 4)
    for rule in ABSENT_RULES:
        got = score(matrix, rule, classes=np.unique(truth).tolist())
        assert (got.mean_iou, got.frequency_weighted_iou, got.pixel_accuracy) == (1.0, 1.0, 1.0)
        assert got.mean_class_accuracy == 1.0


# four classes, the last neither true nor predicted; the others have a mean IoU of .7: the published example
ABSENT = np.array([[6, 1, 0, 0], [0, 7, 2, 0], [0, 1, 8, 0], [0, 0, 0, 0]])
ABSENT_IOU = (6 / 7 + 7 / 11 + 8 / 11) / 3
PREDICTED = np.array([[3, 0, 1], [0, 4, 0], [0, 0, 0]])  # class 2 is predicted, never true


def test_published_values_of_an_absent_class() -> None:
    # three IoU of .7 and an absent class: .700 left out, .525 as 0, .775 as 1 (shared protocols, what goes wrong, 3)
    matrix = np.diag([7, 7, 7, 0]) + np.array([[0, 0, 3, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]])
    matrix[:3, :3] = [[28, 6, 0], [0, 28, 6], [6, 0, 28]]
    values = [28 / 40] * 3
    assert score(matrix).iou[:3] == pytest.approx(values, abs=1e-15)
    assert score(matrix, "cityscapes").mean_iou == pytest.approx(0.700, abs=1e-12)
    assert score(matrix, "semantic-kitti").mean_iou == pytest.approx(0.525, abs=1e-12)
    assert score(matrix, "occupancy-for-nuscenes").mean_iou == pytest.approx(0.775, abs=1e-12)
    assert score(matrix, "scannet").mean_iou is None


@pytest.mark.parametrize(
    ("rule", "absent", "predicted"),
    [
        ("hsbench", ABSENT_IOU, (3 / 4 + 1 + 0) / 3),
        ("cityscapes", ABSENT_IOU, (3 / 4 + 1 + 0) / 3),
        ("scannet", None, (3 / 4 + 1 + 0) / 3),
        ("semantic-kitti", 3 * ABSENT_IOU / 4, (3 / 4 + 1 + 0) / 3),
        ("occupancy-for-nuscenes", (3 * ABSENT_IOU + 1) / 4, (3 / 4 + 1 + 1) / 3),
        ("torchmetrics-mean-iou", ABSENT_IOU, (3 / 4 + 1 + 0) / 3),
        ("torchmetrics-jaccard", ABSENT_IOU, (3 / 4 + 1 + 0) / 3),
        ("average-precision", 3 * ABSENT_IOU / 4, (3 / 4 + 1 + 0) / 3),
    ],
)
def test_every_rule_by_hand(rule: str, absent: float | None, predicted: float) -> None:
    got = score(ABSENT, rule)
    assert got.mean_iou == (None if absent is None else pytest.approx(absent, abs=1e-15))
    assert (got.undefined_classes, got.absent_classes) == (1, 1)
    assert score(ABSENT, rule, classes=(0, 1, 2)).mean_iou == pytest.approx(ABSENT_IOU, abs=1e-15)
    other = score(PREDICTED, rule)
    assert other.mean_iou == pytest.approx(predicted, abs=1e-15)
    assert (other.undefined_classes, other.absent_classes) == (0, 1)
    assert other.class_accuracy[2] is None
    assert set(ABSENT_RULES) >= {rule}


@pytest.mark.parametrize("which", ["absent", "predicted"])
def test_the_scorers_own_answers(which: str) -> None:
    answers = json.loads((Path(__file__).parents[2] / "reference" / "absent_class_scorers.json").read_text())
    for rule, expected in answers["mean_iou"][which].items():
        got = score(np.array(answers["matrices"][which]), rule)
        assert got.mean_iou == (None if expected is None else pytest.approx(expected, abs=1e-7)), rule
        assert got.verified_by
    assert score(ABSENT, "average-precision").verified_by is None


def test_missing_answers_are_missed_and_nobodys_mistake() -> None:
    truth, prediction = np.array([0, 0, 1, 1]), np.array([0, -1, 1, -1])
    matrix = confusion_matrix(truth, prediction, 2, no_answer=-1)
    assert matrix.tolist() == [[1, 0, 1], [0, 1, 1]]
    got = score(matrix)
    assert got.iou == (0.5, 0.5)
    assert got.pixel_accuracy == 0.5
    # the same pixels given to another class are also its false positives
    wrong = score(confusion_matrix(truth, np.array([0, 1, 1, 0]), 2))
    assert wrong.iou == (1 / 3, 1 / 3)


def test_nothing_to_score_is_none() -> None:
    got = score(confusion_matrix(np.full(3, 255), np.zeros(3, int), 2, ignore=255))
    assert (got.mean_iou, got.pixel_accuracy, got.frequency_weighted_iou, got.mean_class_accuracy) == (None,) * 4
    assert got.undefined_classes == 2


def test_pooled_and_per_scene() -> None:
    a, b = np.array([[9, 1], [0, 10]]), np.array([[1, 1], [0, 0]])
    got = score_scenes([a, b, np.zeros((2, 2), int)])
    assert got.pooled == score(a + b)
    assert got.scenes[1].iou == (0.5, 0.0)
    assert got.mean_over_scenes == pytest.approx((0.5 * (9 / 10 + 10 / 11) + 0.25) / 2, abs=1e-15)
    assert got.undefined_scenes == 1


def test_vectorised_mean_iou_serves_the_bootstrap() -> None:
    rng = np.random.default_rng(3)
    matrices = rng.integers(0, 20, (8, 3, 3))
    matrices[:, 2] = matrices[:, :, 2] = 0
    flat = matrices.reshape(8, 9)
    values = segmentation.mean_iou(flat)
    assert values.tolist() == pytest.approx([score(m).mean_iou for m in matrices], abs=1e-15)
    assert np.isnan(segmentation.mean_iou(np.zeros((1, 9), int)))[0]
    got = interval(flat, segmentation.mean_iou, replicates=100)
    assert got.estimate == pytest.approx(score(matrices.sum(axis=0)).mean_iou, abs=1e-15)
    assert got.low < got.estimate < got.high


def test_missing_answers_can_be_resampled() -> None:
    matrices = np.random.default_rng(4).integers(0, 20, (6, 3, 4))
    values = segmentation.mean_iou(matrices.reshape(6, 12))
    assert values.tolist() == pytest.approx([score(m).mean_iou for m in matrices], abs=1e-15)
    for wrong in (matrices[..., :3], np.zeros((2, 7), int), np.zeros((2, 0), int), np.int64(3)):
        with pytest.raises(SchemaError, match="flatten their last two axes"):
            segmentation.mean_iou(wrong)


def test_counts_beyond_float32_are_exact() -> None:
    matrix = np.array([[2**24 + 1, 2**53 + 1], [0, 1]])
    assert score_scenes([matrix, matrix]).pooled.iou[1] == 2 / (2**54 + 4)


GOOD = {"truth": np.zeros((2, 3), np.uint8), "prediction": np.zeros((2, 3), np.uint8), "n_classes": 2}


def with_value(value: int, dtype: type = np.int64) -> np.ndarray:
    array = np.zeros((2, 3), dtype)
    array[1, 2] = value
    return array


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"truth": with_value(255, np.uint8)},
            "truth holds 255 at [1, 2]; expected 0..1 (pixels without a label? pass ignore=255)",
        ),
        ({"truth": with_value(-1)}, "truth holds -1 at [1, 2]"),
        ({"truth": with_value(2)}, "labels counted from 1?"),
        ({"truth": with_value(7)}, "ids of another table?"),
        ({"truth": with_value(7), "ignore": 5}, "expected 0..1 or 5 (ignore)"),
        ({"prediction": with_value(255, np.uint8)}, "prediction holds 255 at [1, 2]; expected 0..1 (pixels without"),
        ({"prediction": with_value(-1), "ignore": -1}, "pass no_answer=-1)"),
        ({"prediction": np.zeros((3, 2), np.uint8)}, "axes in another order?"),
        ({"prediction": np.zeros((2, 3, 2), np.uint8)}, "take the argmax first"),
        ({"prediction": np.zeros((2, 4), np.uint8)}, "prediction has shape (2, 4); expected (2, 3)"),
        ({"prediction": np.full((2, 3), np.nan)}, "holds NaN; expected integers (scores? take the argmax first)"),
        ({"truth": [[0, 0, 0]] * 2}, "truth is a list"),
        ({"truth": np.zeros((2, 3), complex)}, "truth has dtype complex128"),
        ({"n_classes": 0}, "n_classes is 0"),
        ({"n_classes": 10**6}, "n_classes is 1000000"),
        ({"n_classes": 2.0}, "n_classes is 2.0; expected an integer of 1..4096"),
        ({"ignore": "void"}, "ignore is 'void'; expected an integer"),
        ({"ignore": np.nan}, "ignore is nan"),
        ({"no_answer": -0.5}, "no_answer is -0.5"),
    ],
)
def test_bad_labels_name_the_pixel_and_the_mistake(change: dict, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        confusion_matrix(**GOOD | change)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_bad_prediction_at_an_ignored_pixel_does_not_count() -> None:
    got = confusion_matrix(with_value(9), with_value(77), 2, ignore=9)
    assert got.tolist() == [[5, 0], [0, 0]]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: score(np.zeros((2, 4), int)), "expected (n, n), or (n, n + 1)"),
        (lambda: score(np.eye(2)), "normalised already?"),
        (lambda: score(np.array([[1, -1], [0, 0]])), "holds -1"),
        (lambda: score(np.eye(2, dtype=int), "mean"), "expected one of hsbench, cityscapes"),
        (lambda: score(np.eye(2, dtype=int), classes=(0, 2)), "expected different ones of 0..1"),
        (lambda: score(np.eye(2, dtype=int), classes=(0.5,)), "expected different ones of 0..1"),
        (lambda: score([[1, 2], [3]]), "rows of different lengths"),
        (lambda: score(np.full((2, 2), 2**62)), "adds up to 1.84467e+19"),
        (lambda: score_scenes([]), "no scene"),
        (lambda: score_scenes([np.eye(2, dtype=int), np.eye(3, dtype=int)]), "confusions[1] has shape (3, 3)"),
    ],
)
def test_bad_matrices(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)


def test_every_rule_is_in_the_specification() -> None:
    assert all(f"``{rule}``" in segmentation.__doc__ for rule in ABSENT_RULES)
