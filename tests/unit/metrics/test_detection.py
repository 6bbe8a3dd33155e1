"""Detection: every protocol by hand on boxes on a line, and bad input."""

from __future__ import annotations

import contextlib
import io
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics import detection
from hsbench.metrics.detection import PROTOCOLS, Predictions, Truths, score
from hsbench.schema import Evidence, ObjectTruth, Visibility
from hsbench.typing import AnyArray
from tests.unit.metrics.detection_samples import sample2d, sample3d

RANKED = [name for name, rules in PROTOCOLS.items() if rules.matching != "pairs"]


def line(*spans: tuple[float, float]) -> AnyArray:
    """Boxes of height 1 over (start, length): their IoU is that of intervals."""
    return np.array([(start, 0.0, length, 1.0) for start, length in spans]).reshape(-1, 4)


def flags(*values: int) -> AnyArray:
    return np.array(values, dtype=bool)


NESTED = [Truths(line((0, 10), (2, 10)))]
# IoU with the truths: 1 and 8/12; 9.5/10.5 and 8.5/11.5; 0
ON_NESTED = [Predictions(line((0, 10), (0.5, 10), (50, 10)), np.array([0.9, 0.8, 0.7]))]


@pytest.mark.parametrize(
    ("protocol", "ap", "recall"),
    [("hsbench", 0.5, 0.5), ("voc", 0.5, 0.5), ("sunrgbd", 0.5, 0.5), ("coco", 1.0, 1.0), ("omni3d", 1.0, 1.0)],
)
def test_a_second_detection_of_one_of_two_nested_truths(protocol: str, ap: float, recall: float) -> None:
    # best truth: both go to the first one, the second is false. Best untaken truth: the second hits the other
    got = score(NESTED, ON_NESTED, protocol, 0.5)
    assert got.ap == pytest.approx(ap, abs=1e-12)
    assert got.ar == recall
    (overall,) = got.overall
    assert (overall.truths, overall.hits, overall.false, overall.neither) == (2, 2 * recall, 3 - 2 * recall, 0)


def test_pairs_by_hand() -> None:
    labelled = [Truths(NESTED[0].boxes, np.array([1, 2]))]
    found = [Predictions(ON_NESTED[0].boxes, ON_NESTED[0].scores, np.array([1, 3, 1]))]
    # pairs of IoU 1 and 8.5/11.5 = .739: both above .5, one above .75, none above 1
    got = score(labelled, found, "class-agnostic", [0.5, 0.75, 1.0])
    assert [(p.precision, p.recall) for p in got.pairs] == [(2 / 3, 1.0), (1 / 3, 0.5), (0.0, 0.0)]
    assert [(p.label_precision, p.label_recall) for p in got.pairs] == [(1 / 3, 0.5), (1 / 3, 0.5), (0.0, 0.0)]
    assert [p.f1 for p in got.pairs] == [pytest.approx(0.8), pytest.approx(0.4), 0.0]
    assert [p.pooled_f1 for p in got.pairs] == [0.8, 0.4, 0.0]
    assert got.ap is None


def test_pairs_are_averaged_over_scenes_and_pooled_beside() -> None:
    got = score([*NESTED, Truths(line((0, 1)))], [*ON_NESTED, None], "class-agnostic", 0.5).pairs[0]
    assert (got.precision, got.recall) == (1 / 3, 0.5)  # a scene without prediction counts 0, as in the toolbox
    assert (got.pooled_precision, got.pooled_recall, got.pooled_f1) == (2 / 3, 2 / 3, 4 / 6)
    assert got.label_precision is None


@pytest.mark.parametrize(
    ("protocol", "ap"), [("hsbench", 1.0), ("voc", 0.0), ("sunrgbd", 1.0), ("coco", 1.0), ("omni3d", 1.0)]
)
def test_iou_equal_to_the_threshold(protocol: str, ap: float) -> None:
    got = score([Truths(line((0, 10)))], [Predictions(line((0, 5)), np.array([0.9]))], protocol, 0.5)
    assert got.ap == pytest.approx(ap, abs=1e-12)


def test_rounding_does_not_decide_whether_hsbench_finds_a_truth() -> None:
    # a box of 1 m moved by .6 m: IoU .4/1.6; in floating point .25, .2500000000000001 or .24999999999999994
    for x in np.arange(0.0, 3.0, 0.37):
        here = np.array([[x, x, x, 1, 1, 1, 0.0]])
        beside = here + [[0.6, 0, 0, 0, 0, 0, 0]]
        assert score([Truths(here)], [Predictions(beside, np.array([0.9]))], iou=0.25).ap == 1.0
        assert (
            score([Truths(here)], [Predictions(beside + [1e-6, 0, 0, 0, 0, 0, 0], np.array([0.9]))], iou=0.25).ap == 0
        )


def test_iou_one_is_reached_by_coco_and_by_no_strict_test() -> None:
    same = [Truths(line((0, 10)))], [Predictions(line((0, 10)), np.array([0.9]))]
    assert score(*same, "coco", 1.0).ap == pytest.approx(1.0, abs=1e-12)
    assert score(*same, "hsbench", 1.0).ap == 1.0
    assert score(*same, "voc", 1.0).ap == 0.0
    assert score(*same, "class-agnostic", 1.0).pairs[0].precision == 0.0


@pytest.mark.parametrize(
    ("protocol", "ap", "neither"),
    [("hsbench", 1.0, 2), ("voc", 1.0, 2), ("sunrgbd", 1.0, 2), ("coco", 0.5, 1), ("omni3d", 0.5, 1)],
)
def test_difficult_truth_is_neither_hit_nor_miss(protocol: str, ap: float, neither: int) -> None:
    truths = [Truths(line((0, 10), (50, 10)), difficult=flags(1, 0))]
    found = [Predictions(line((0, 10), (1, 10), (50, 10)), np.array([0.9, 0.8, 0.7]))]
    # coco and omni3d ignore one detection a difficult truth; the second is false
    got = score(truths, found, protocol, 0.5)
    assert got.ap == pytest.approx(ap, abs=1e-12)
    assert got.overall[0].neither == neither
    assert (got.truths, got.ignored) == (1, 1)
    assert score(truths, [None], protocol, 0.5).ap == 0.0


def test_crowd_takes_any_number_and_its_iou_is_over_the_detection() -> None:
    truths = [Truths(line((0, 40), (50, 10)), crowd=flags(1, 0))]
    found = [Predictions(line((0, 10), (1, 10), (50, 10)), np.array([0.9, 0.8, 0.7]))]
    got = score(truths, found, "coco", 0.5)
    assert got.ap == pytest.approx(1.0, abs=1e-12)
    assert got.overall[0].neither == 2


@pytest.mark.parametrize("first", [0, 1])
def test_equal_scores_are_taken_at_once_by_hsbench_alone(first: int) -> None:
    boxes = line((0, 10), (50, 10))[[first, 1 - first]]
    tied = [Truths(line((0, 10)))], [Predictions(boxes, np.array([0.5, 0.5]))]
    assert score(*tied, "hsbench", 0.5).ap == 0.5
    assert score(*tied, "voc", 0.5).ap == (1.0, 0.5)[first]


def test_boxes_beyond_the_limit_are_left_out_and_counted() -> None:
    got = score(NESTED, ON_NESTED, "hsbench", 0.5, limit=2)
    assert (got.overall[0].false, got.over_limit, got.detections) == (1, 1, 3)
    many = Predictions(np.repeat(line((50, 10)), 65, axis=0), np.linspace(1, 2, 65))
    assert score(NESTED, [many]).over_limit == 1
    assert score(NESTED, [many], "voc").over_limit == 0


def test_classes_without_truth_are_left_out_and_named() -> None:
    truths = [Truths(line((0, 10), (50, 10)), np.array([1, 2]), flags(0, 1))]
    found = [Predictions(line((0, 10), (50, 10), (90, 10)), np.array([0.9, 0.8, 0.7]), np.array([1, 2, 3]))]
    for protocol in RANKED:
        got = score(truths, found, protocol, 0.5)
        assert got.labels_without_truth == (2, 3)
        assert [c.ap for c in got.per_class] == [pytest.approx(1.0, abs=1e-12), None, None]
        assert [c.recall for c in got.per_class] == [1.0, None, None]
        assert got.summary["AP" if protocol in ("coco", "omni3d") else "mAP_0.50"] == pytest.approx(1.0, abs=1e-12)


def test_hsbench_headline_ignores_classes_and_shows_them_beside() -> None:
    truths = [Truths(line((0, 10), (50, 10)), np.array([1, 2]))]
    found = [Predictions(line((0, 10), (50, 10)), np.array([0.9, 0.8]), np.array([1, 1]))]
    got = score(truths, found)
    assert got.ap == got.ar == 1.0
    assert got.summary == {f"{m}A{x}_{t}": 0.5 if m else 1.0 for m in ("", "m") for t in ("0.25", "0.50") for x in "PR"}
    without = score(truths, [Predictions(found[0].boxes, found[0].scores)])  # classes are optional here
    assert (without.ap, without.per_class) == (1.0, ())


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_no_truth_is_undefined_and_no_prediction_is_zero(protocol: str) -> None:
    none, some = [Truths(np.zeros((0, 4)))], [Truths(line((0, 10)))]
    found = [Predictions(line((0, 10)), np.array([0.9]))]
    if PROTOCOLS[protocol].matching == "pairs":
        assert score(some, [None], protocol).pairs[0].f1 == 0.0
        assert score([], [], protocol).pairs[0].f1 is None
        return
    for empty in (score(none, found, protocol), score([], [], protocol), score(none, [None], protocol)):
        assert empty.ap is None
        assert empty.ar is None
        assert set(empty.summary.values()) <= {None}
    missed = score(some, [None], protocol)
    assert (missed.ap, missed.ar, missed.scenes_without_prediction) == (0.0, 0.0, 1)


def test_recall_tables() -> None:
    objects = ObjectTruth(
        np.arange(1, 5, dtype=np.int32),
        np.array([100, 100, 1, 0]),
        np.array([100, 100, 100, 0]),
        np.array([0, 2, 0, 1], np.uint8),
        np.zeros(4, np.float32),
    )
    keys = detection.visibility_by_evidence(objects)
    assert keys.tolist() == [
        [Visibility.VISIBLE, Evidence.NEITHER],
        [Visibility.VISIBLE, Evidence.USED],
        [Visibility.FULLY_OCCLUDED, Evidence.NEITHER],
        [Visibility.OUTSIDE, Evidence.SKIRTED],
    ]
    boxes = np.array([(3.0 * i, 0, 0.5, size, 0.4, 0.4, 0.3) for i, size in enumerate((0.5, 1.0, 1.2, 2.0))])
    truths = [Truths(boxes, difficult=flags(0, 0, 1, 0), groups={"visibility x evidence": keys})]
    found = [Predictions(boxes[[0, 1, 3]], np.array([0.9, 0.2, 0.5]))]
    rows = score(truths, found, iou=0.25, operating_score=0.5).recall
    assert [(r.group, r.key, r.truths, r.hits, r.hits_at_score) for r in rows] == [
        ("size", (0,), 1, 1, 1),
        ("size", (1,), 1, 1, 0),
        ("size", (2,), 1, 1, 1),
        ("visibility x evidence", (0, 0), 1, 1, 1),
        ("visibility x evidence", (0, 2), 1, 1, 0),
        ("visibility x evidence", (3, 1), 1, 1, 1),
    ]
    assert rows[1].recall == 1.0
    assert rows[1].recall_at_score == 0.0
    assert score(truths, found, iou=0.25).recall[0].recall_at_score is None
    (missed,) = score([Truths(boxes[:1])], [None], iou=0.25, operating_score=0.5).recall
    assert (missed.recall, missed.recall_at_score) == (0.0, 0.0)


def test_curve_stands_at_block_ends() -> None:
    truths = [Truths(line((0, 10), (20, 10)))]
    found = [Predictions(line((0, 10), (50, 10), (20, 10)), np.array([0.9, 0.5, 0.5]))]
    curve = score(truths, found).overall[0].ranking.curve()
    assert curve is not None
    assert (curve.recall.tolist(), curve.precision.tolist()) == ([0.5, 1.0], [1.0, 2 / 3])
    assert curve.score.tolist() == [0.9, 0.5]


@pytest.mark.parametrize("columns", [6, 7, 15])
@pytest.mark.parametrize("protocol", RANKED)
def test_truth_scores_one(protocol: str, columns: int) -> None:
    truths, _ = sample3d(3, 20)
    boxes = [t.boxes[:, :columns] for t in truths]
    if columns == 15:
        boxes = [np.concatenate([b[:, :6], np.tile(np.eye(3).ravel(), (len(b), 1))], axis=1) for b in boxes]
    given = [Truths(b, t.labels) for b, t in zip(boxes, truths, strict=True)]
    assert all(t.labels is not None for t in truths)
    same = [Predictions(t.boxes, np.ones(len(t.boxes)), t.labels) for t in given]
    got = score(given, same, protocol)
    assert got.ap == pytest.approx(1.0, abs=1e-12)
    assert got.ar == 1.0


def test_corners_are_the_same_boxes() -> None:
    truths, predictions = sample2d(5, 10)

    def corners(boxes: AnyArray) -> AnyArray:
        return np.concatenate([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]], axis=1)

    other = score(
        [Truths(corners(t.boxes), t.labels) for t in truths],
        [Predictions(corners(p.boxes), p.scores, p.labels) for p in predictions],
        form="corners",
    )
    assert other.ap == score([Truths(t.boxes, t.labels) for t in truths], predictions).ap


@given(seed=st.integers(0, 2**32), cut=st.integers(1, 9))
@settings(max_examples=15, deadline=None)
def test_scenes_scored_apart_are_matched_alike(seed: int, cut: int) -> None:
    truths, predictions = sample2d(seed, 10, classes=2, ties=True)
    for protocol in RANKED:
        whole = score(truths, predictions, protocol).per_class
        parts = [score(truths[s], predictions[s], protocol).per_class for s in (slice(cut), slice(cut, None))]
        for c in whole:
            pieces = [p.ranking for part in parts for p in part if (p.label, p.iou) == (c.label, c.iou)]
            assert c.hits == sum(p.hits for p in pieces)
            assert c.false == sum(p.false for p in pieces)
            assert c.truths == sum(p.truths for p in pieces)


ONE = Truths(line((0, 10)), np.array([1]))
FOUND = Predictions(line((0, 10)), np.array([0.5]), np.array([1]))
SCHEMA_ERRORS: list[tuple[Any, str]] = [
    (lambda: Truths(np.zeros((3, 5))), r"truths.boxes has shape \(3, 5\)"),
    (lambda: Truths(np.zeros(0)), r"say np.zeros\(\(0, 7\)\)"),
    (lambda: Truths(np.ones(7)), r"one box\? say boxes\[None\]"),
    (lambda: Truths(np.ones((2, 8, 3))), r"corners\? boxes are centre"),
    (lambda: Truths([[0, 0, 1, 1]]), "truths.boxes is list"),
    (lambda: Truths(np.array([[0, 0, 0, 1, 1, -1, 0.0]])), "truths.boxes"),
    (lambda: Truths(np.array([[0, 0, np.nan, 1]])), r"truths.boxes\[0\] is .* finite"),
    (lambda: Truths(line((0, 1)), np.array([1.0])), r"truths.labels is float64 \(1,\)"),
    (lambda: Truths(line((0, 1)), np.array(["chair"])), r"names\? map them"),
    (lambda: Truths(line((0, 1)), np.array([-1])), r"truths.labels\[0\] is -1.*ignore label"),
    (lambda: Truths(line((0, 1)), difficult=np.array([1])), "truths.difficult is int64"),
    (
        lambda: Truths(line((0, 1)), np.array([2**64 - 1], np.uint64)),
        r"truths.labels\[0\] is 18446744073709551615; .* \(-1, unsigned",
    ),
    (lambda: Truths(line((0, 1)), groups={"room": np.zeros(2, int)}), r"groups\['room'\] has 2 rows for 1"),
    (lambda: Truths(line((0, 1)), groups={"room": np.zeros(1)}), "expected integers"),
    (lambda: Truths(line((0, 1)), groups={"size": np.zeros(1, int)}), "'size', computed from the boxes"),
    (lambda: Predictions(line((0, 1)), line((0, 1))), r"predictions.scores .*swapped with boxes"),
    (lambda: Predictions(line((0, 1)), np.array([np.nan])), r"predictions.scores\[0\] is nan"),
    (lambda: Predictions(line((0, 1)), None), "predictions.scores is missing"),
    (lambda: score([ONE], [FOUND], "pascal"), "expected one of hsbench, voc"),
    (lambda: score([ONE], [FOUND], iou=25), "a percentage"),
    (lambda: score([ONE], [FOUND], iou=[]), "no threshold"),
    (lambda: score(None, [FOUND]), "truths is a NoneType"),
    (lambda: score([ONE], []), "1 scenes of truth and 0 of predictions"),
    (lambda: score(ONE, FOUND), "wrap a single scene"),
    (lambda: score((scene for scene in [ONE]), [FOUND]), "truths is a generator; expected a list"),
    (lambda: score([ONE], [FOUND], iou=[0.25, 0.254]), "differ in two digits"),
    (lambda: score([Truths(np.ones((1, 7)))], [None], form="yxyx"), "form 'yxyx' is unknown"),
    (lambda: score([ONE], [FOUND], operating_score="high"), "operating_score is 'high'"),
    (lambda: score([FOUND], [ONE]), "truths of scene 0 are a Predictions"),
    (lambda: score([ONE], [Predictions(np.ones((1, 7)), np.ones(1))]), "7 columns .* where others have 4"),
    (lambda: score([ONE], [Predictions(line((0, 1)), np.ones(1))], "voc"), "predictions have no labels"),
    (lambda: score([ONE, Truths(line((0, 1)))], [FOUND, FOUND]), "truths of scene 1 have no labels"),
    (
        lambda: score([ONE], [Predictions(line((0, -1)), np.ones(1))]),
        "predictions of scene 0: 2D box 0 .*wrong way round",
    ),
    (lambda: score([ONE], [FOUND], form="yxyx"), "form 'yxyx' is unknown"),
    (lambda: score([ONE], [FOUND], "voc", limit=3), "only protocol hsbench"),
    (lambda: score([ONE], [FOUND], limit=0), "limit is 0; expected an integer of 1.."),
    (lambda: score([ONE], [FOUND], limit=2.5), "limit is 2.5"),
    (lambda: score([ONE], [FOUND], operating_score=float("nan")), "operating_score is nan"),
    (lambda: score([Truths(line((0, 1)), crowd=flags(1))], [None]), "only protocol coco"),
    (lambda: score([Truths(line((0, 1)), difficult=flags(1))], [None], "class-agnostic"), "knows none"),
    (
        lambda: score([Truths(line((0, 1)), groups={"a": np.zeros(1, int)}), Truths(line((0, 1)))], [None, None]),
        "truths of scene 1 lack group 'a'",
    ),
    (
        lambda: score(
            [Truths(np.ones((1, 7)), measure=np.ones(1))], [Predictions(np.ones((1, 7)), np.ones(1))], "omni3d"
        ),
        "predictions have no measure .* depth",
    ),
]


@pytest.mark.parametrize(("call", "message"), SCHEMA_ERRORS)
def test_errors_name_the_item_and_guess_the_mistake(call: Any, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        call()


def test_the_page_shows_what_its_example_prints() -> None:
    docs = Path(__file__).parents[3] / "docs"
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        runpy.run_path(str(docs / "examples" / "score_detections.py"))
    assert f"```text\n{printed.getvalue()}```" in (docs / "metrics" / "detection.md").read_text("utf-8")


def test_importing_hsbench_does_not_compile() -> None:
    code = "import sys, hsbench; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
