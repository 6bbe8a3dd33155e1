"""Actions: by hand, the published scorer's own answers, plain loops, scikit-learn, and properties."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics import action
from hsbench.metrics.action import segment_counts, segment_score, segments
from hsbench.metrics.segmentation import confusion_matrix
from hsbench.schema.states import Action

PUBLISHED = json.loads((Path(__file__).parents[2] / "reference" / "segment_scorers.json").read_text())["rows"]


def digits(text: str) -> np.ndarray:
    return np.array([int(c) for c in text], dtype=np.int64)


def test_poses_by_hand() -> None:
    a = Action
    truth = np.array([a.STAND, a.STAND, a.SIT, a.SIT, a.INTERACT, a.IGNORED], np.uint8)
    prediction = np.array([a.STAND, a.SIT, a.SIT, a.IGNORED, a.SIT, a.SIT], np.uint8)
    matrix = confusion_matrix(truth, prediction, 4, ignore=a.IGNORED, no_answer=a.IGNORED)
    got = action.score(matrix, classes=(a.STAND, a.SIT, a.INTERACT))
    assert got.accuracy == 2 / 5
    assert got.f1[1:] == (2 / 3, 2 / 5, 0.0)  # stand: 2 / (2 + 1); sit: 2 / (2 + 3); interact: 0 / (1 + 0)
    assert got.macro_f1 == pytest.approx((2 / 3 + 2 / 5) / 3, abs=1e-15)
    assert got.precision[1:] == (1.0, 1 / 3, None)
    assert got.recall[1:] == (0.5, 0.5, 0.0)
    assert (got.f1[0], got.undefined_classes) == (None, 0)


def test_scikit_learn_gives_the_same_values() -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    truth, prediction = np.random.default_rng(0).integers(0, 3, (2, 400))
    got = action.score(confusion_matrix(truth, prediction, 3))
    assert got.macro_f1 == pytest.approx(metrics.f1_score(truth, prediction, average="macro"), abs=1e-12)
    for name in ("precision", "recall", "f1"):
        expected = getattr(metrics, f"{name}_score")(truth, prediction, average=None)
        assert getattr(got, name) == pytest.approx(tuple(expected), abs=1e-12)
    assert got.accuracy == pytest.approx(metrics.accuracy_score(truth, prediction), abs=1e-12)


def test_an_absent_class_is_none_and_counted() -> None:
    got = action.score(np.diag([3, 4, 0]))
    assert (got.macro_f1, got.f1, got.undefined_classes) == (1.0, (1.0, 1.0, None), 1)
    empty = action.score(np.zeros((3, 3), int))
    assert (empty.macro_f1, empty.accuracy, empty.undefined_classes) == (None, None, 3)


def test_vectorised_macro_f1_agrees() -> None:
    matrices = np.random.default_rng(1).integers(0, 9, (6, 3, 3))
    matrices[0] = 0
    matrices[1, 2] = matrices[1, :, 2] = 0
    values = action.macro_f1(matrices.reshape(6, 9))
    expected = [action.score(m).macro_f1 for m in matrices]
    assert [None if np.isnan(v) else pytest.approx(v, abs=1e-15) for v in values] == expected


def test_missing_answers_can_be_resampled() -> None:
    matrices = np.random.default_rng(2).integers(0, 9, (6, 4, 5))
    values = action.macro_f1(matrices.reshape(6, 20))
    assert values.tolist() == pytest.approx([action.score(m).macro_f1 for m in matrices], abs=1e-15)
    with pytest.raises(SchemaError, match="missing answers"):
        action.macro_f1(np.zeros((2, 7), int))


@pytest.mark.parametrize("row", PUBLISHED)
def test_the_published_scorers_own_answers(row: dict) -> None:
    got = segment_counts(digits(row["truth"]), digits(row["prediction"]), background=row["background"])
    assert got.edit_score == pytest.approx(row["edit"], abs=1e-12)
    assert got.f1 == pytest.approx(tuple(row["f1"][k] for k in ("0.1", "0.25", "0.5")), abs=1e-12)


def test_segments_by_hand() -> None:
    assert segments(digits("1122233")).tolist() == [[1, 0, 2], [2, 2, 5], [3, 5, 7]]
    cut = np.array([0, 0, 0, 1, 1, 0, 0], bool)
    assert segments(digits("1111112"), cut).tolist() == [[1, 0, 3], [1, 5, 6], [2, 6, 7]]
    assert segments(digits("")).tolist() == []


def test_segment_scores_by_hand() -> None:
    # truth 1 x4, 2 x4, 3 x2; predicted 1 x3, 2 x1, 1 x1, 2 x3, 3 x2
    got = segment_counts(digits("1111222233"), digits("1112122233"))
    assert (got.distance, got.longer) == (2, 5)
    assert got.edit_score == pytest.approx(3 / 5, abs=1e-15)
    # overlaps: 1: 3/4, then 0 (column 4 is truth 2); 2: 0, then 3/4; 3: 1
    assert (got.hits, got.predicted, got.true) == ((3, 3, 3), 5, 3)
    assert got.f1 == (6 / 8, 6 / 8, 6 / 8)
    strict = segment_counts(digits("1111222233"), digits("1112122233"), overlaps=(0.75, 0.76, 1.0))
    assert strict.hits == (3, 1, 1)


def plain(truth: str, prediction: str, overlap: float) -> tuple[float | None, float | None]:
    """Edit score by recursion and F1 by the greedy rule, on strings."""

    def runs(text: str) -> list[tuple[str, int, int]]:
        found: list[tuple[str, int, int]] = []
        for i, c in enumerate(text):
            if found and found[-1][0] == c:
                found[-1] = (c, found[-1][1], i + 1)
            else:
                found.append((c, i, i + 1))
        return found

    def distance(a: tuple, b: tuple) -> int:
        if not a or not b:
            return len(a) + len(b)
        return min(
            distance(a[1:], b) + 1, distance(a, b[1:]) + 1, distance(a[1:], b[1:]) + (a[0] != b[0])
        )  # fmt: skip

    t, p = runs(truth), runs(prediction)
    used: set[int] = set()
    for label, start, stop in p:
        ious = [
            len(set(range(start, stop)) & set(range(a, b))) / len(set(range(start, stop)) | set(range(a, b)))
            if label == other
            else 0.0
            for other, a, b in t
        ]
        best = ious.index(max(ious))
        if ious[best] >= overlap:
            used.add(best)
    edit = 1 - distance(tuple(r[0] for r in t), tuple(r[0] for r in p)) / max(len(t), len(p))
    return edit, 2 * len(used) / (len(t) + len(p))


@given(st.lists(st.tuples(st.sampled_from("012"), st.sampled_from("012")), min_size=1, max_size=9))
@settings(max_examples=80)
def test_agrees_with_plain_loops(steps: list[tuple[str, str]]) -> None:
    truth, prediction = ("".join(column) for column in zip(*steps, strict=True))
    got = segment_counts(digits(truth), digits(prediction), overlaps=(0.25,))
    edit, f1 = plain(truth, prediction, 0.25)
    assert got.edit_score == pytest.approx(edit, abs=1e-12)
    assert got.f1[0] == pytest.approx(f1, abs=1e-12)
    perfect = segment_counts(digits(truth), digits(truth))
    assert (perfect.edit_score, perfect.f1) == (1.0, (1.0, 1.0, 1.0))
    stretched = segment_counts(digits(truth).repeat(3), digits(prediction).repeat(3), overlaps=(0.25,))
    assert stretched == got


def test_ignored_steps_cut_and_never_join() -> None:
    truth, prediction = digits("1110011"), digits("1111111")
    got = segment_counts(truth, prediction, ignore=0)
    assert (got.predicted, got.true, got.hits) == (2, 2, (2, 2, 2))
    assert got.edit_score == 1.0
    assert got == segment_counts(truth, digits("1112311"), ignore=0)  # what is predicted there is no matter


def test_nothing_to_score() -> None:
    nothing = segment_counts(digits("00"), digits("11"), ignore=0)
    assert (nothing.edit_score, nothing.f1) == (None, (None, None, None))
    invented = segment_counts(digits("00"), digits("11"), background=0)
    assert (invented.edit_score, invented.f1) == (0.0, (0.0, 0.0, 0.0))
    both = segment_score([nothing, invented])
    assert (both.edit_score, both.undefined_sequences, both.f1) == (0.0, 1, (0.0, 0.0, 0.0))
    assert segment_score([nothing]).f1 == (None, None, None)
    assert both.verified_by


def test_pooled_and_over_sequences() -> None:
    a, b = segment_counts(digits("12"), digits("12")), segment_counts(digits("121212"), digits("111111"))
    got = segment_score([a, b])
    assert b.hits == (1, 0, 0)  # its IoU with any true segment is 1/6
    assert got.f1 == (6 / 11, 4 / 11, 4 / 11)
    assert got.f1_over_sequences == pytest.approx(((1 + 2 / 7) / 2, 0.5, 0.5), abs=1e-15)
    assert got.edit_score == pytest.approx((1 + 1 / 6) / 2, abs=1e-15)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: segment_counts(digits("12"), digits("123")), "prediction has shape (3,); expected (2,)"),
        (lambda: segment_counts(np.zeros((2, 3), int), np.zeros((2, 3), int)), "one sequence at a time"),
        (lambda: segment_counts(np.zeros(2), np.zeros(2)), "take the argmax first"),
        (lambda: segment_counts(digits("12"), digits("12"), overlaps=(25,)), "percentages?"),
        (lambda: segment_score([segment_counts(digits("1"), digits("1"))], (0.5,)), "sequences[0] has 3 overlaps"),
        (lambda: segments(digits("12"), np.zeros(3, bool)), "ignored has shape (3,)"),
        (lambda: action.score(np.zeros((2, 2))), "expected integer counts"),
        (lambda: action.score(np.zeros((2, 2), int) - 1), "holds -1"),
        (lambda: action.score(np.zeros((2, 2), int), classes=(2,)), "expected different ones of 0..1"),
        (lambda: action.score(np.zeros((2, 2), int), classes=(1, 1)), "classes are [1, 1]"),
        (lambda: segments(digits("12"), np.zeros(2, int)), "ignored is int64; expected bool"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)
