"""What must not raise a detection score: duplicates, swollen boxes, deleted hits, another order."""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hsbench.metrics.detection import PROTOCOLS, Predictions, Truths, score
from tests.unit.metrics.detection_samples import sample2d, sample3d

RANKED = [name for name, rules in PROTOCOLS.items() if rules.matching != "pairs"]
BEST = ("voc", "sunrgbd", "hsbench")
COLUMNS = (4, 6, 7, 15)
TOLERANCE = 1e-12


def value(truths: list[Truths], predictions: list[Predictions], protocol: str) -> float:
    ap = score(truths, predictions, protocol).ap
    assert ap is not None
    return ap


def risen(
    truths: list[Truths], before: list[Predictions], after: list[Predictions], protocol: str
) -> dict[str, tuple[float, float]]:
    """Names and values of the numbers that rose."""
    old, new = (score(truths, predictions, protocol).summary for predictions in (before, after))
    assert old.keys() == new.keys()
    rose = {}
    for name, was in old.items():
        now = new[name]
        assert (now is None) == (was is None)
        if now is not None and was is not None and now > was + TOLERANCE:
            rose[name] = (was, now)
    return rose


def clean(seed: int, columns: int) -> tuple[list[Truths], list[Predictions]]:
    """One prediction an object that matches at every threshold, and scored false ones far from all truth."""
    rng = np.random.default_rng(seed)
    truths, predictions = [], []
    size = slice(2, 4) if columns == 4 else slice(3, 6)
    for _ in range(3):
        n, false = int(rng.integers(1, 6)), int(rng.integers(0, 6))
        boxes = np.zeros((n + false, columns))
        boxes[:, 0] = 20.0 * rng.permutation(12)[: n + false]
        boxes[:, size] = rng.uniform(0.5, 1.5, (n + false, size.stop - size.start))
        if columns == 4:
            boxes[:, :2] -= boxes[:, 2:] / 2
        if columns == 7:
            boxes[:, 6] = rng.uniform(-np.pi, np.pi, n + false)
        if columns == 15:
            boxes[:, 6:] = Rotation.random(n + false, random_state=seed).as_matrix().reshape(-1, 9)
        labels = rng.integers(0, 2, n + false)
        found = boxes.copy()
        found[:, : size.stop] += rng.normal(0, 0.002, (n + false, size.stop))
        truths.append(Truths(boxes[:n], labels[:n]))
        predictions.append(Predictions(found, rng.choice([0.1, 0.3, 0.5, 0.7, 0.9], n + false), labels))
    return truths, predictions


def with_duplicates(predictions: list[Predictions], rng: np.random.Generator, how_many: int) -> list[Predictions]:
    """Some boxes once more, with lower scores."""
    more = list(predictions)
    for s in rng.integers(0, len(more), how_many):
        p = more[s]
        if not len(p.boxes):
            continue
        assert p.labels is not None
        i = int(rng.integers(len(p.boxes)))
        lower = p.scores[i] - rng.choice([0.01, 0.1, 2.0])
        more[s] = Predictions(
            np.append(p.boxes, p.boxes[i : i + 1], axis=0), np.append(p.scores, lower), np.append(p.labels, p.labels[i])
        )
    return more


@given(seed=st.integers(0, 2**32), protocol=st.sampled_from(BEST), how_many=st.integers(1, 3), flat=st.booleans())
@settings(max_examples=60, deadline=None)
def test_a_duplicate_with_a_lower_score_never_raises_ap(seed: int, protocol: str, how_many: int, flat: bool) -> None:
    truths, predictions = sample2d(seed, 6, classes=2, difficult=0.2, ties=True) if flat else sample3d(seed, 6)
    more = with_duplicates(predictions, np.random.default_rng(seed), how_many)
    assert risen(truths, predictions, more, protocol) == {}


@given(seed=st.integers(0, 2**32), how_many=st.integers(1, 5), limit=st.integers(1, 6))
@settings(max_examples=60, deadline=None)
def test_nor_does_it_at_the_limit_where_every_truth_counts(seed: int, how_many: int, limit: int) -> None:
    truths, predictions = sample3d(seed, 6, difficult=0.0)
    more = with_duplicates(predictions, np.random.default_rng(seed), how_many)
    before, after = (score(truths, p, limit=limit) for p in (predictions, more))
    for was, now in zip(before.overall, after.overall, strict=True):
        assert was.ap is not None
        assert now.ap is not None
        assert now.ap <= was.ap + TOLERANCE


def test_at_the_limit_a_duplicate_on_a_difficult_truth_is_worth_leaving_a_false_box_out() -> None:
    # the case told on the page; the hit lies in another scene, below the false box
    near, far = (np.array([[x, 0, 0, 1, 1, 1, 0.0]]) for x in (0, 9))
    truths = [Truths(near, difficult=np.array([True])), Truths(near)]
    hit = Predictions(near, np.array([0.1]))
    said = {
        "once": Predictions(np.concatenate([near, far]), np.array([0.9, 0.3])),
        "twice": Predictions(np.concatenate([near, near, far]), np.array([0.9, 0.8, 0.3])),
        "without the false box": Predictions(near, np.array([0.9])),
    }
    ap = {name: score(truths, [p, hit], limit=2).ap for name, p in said.items()}
    assert ap == {"once": 0.5, "twice": 1.0, "without the false box": 1.0}
    assert score(truths, [said["twice"], hit]).ap == 0.5


def test_coco_and_omni3d_let_a_duplicate_hit_a_neighbour() -> None:
    # the case shown on the page: two nested truths, one detection, and the same once more with a lower score
    truths = [Truths(np.array([[0, 0, 10, 1], [2, 0, 10, 1]]))]
    one = Predictions(np.array([[1.0, 0, 10, 1]]), np.array([0.9]))
    two = Predictions(np.repeat(one.boxes, 2, axis=0), np.array([0.9, 0.8]))
    for protocol in ("coco", "omni3d"):
        assert score(truths, [two], protocol, 0.5).ap == pytest.approx(1.0, abs=TOLERANCE)
        assert score(truths, [one], protocol, 0.5).ap == pytest.approx(51 / 101, abs=TOLERANCE)
    for protocol in BEST:
        assert value(truths, [two], protocol) == value(truths, [one], protocol) == 0.5


@given(
    seed=st.integers(0, 2**32 - 1),
    columns=st.sampled_from(COLUMNS),
    factor=st.floats(1.5, 100.0),
    protocol=st.sampled_from(list(PROTOCOLS)),
)
@settings(max_examples=150, deadline=None)
def test_swollen_boxes_never_raise_a_number(seed: int, columns: int, factor: float, protocol: str) -> None:
    truths, predictions = clean(seed, columns)
    swollen = []
    for p in predictions:
        boxes = p.boxes.copy()
        if columns == 4:
            boxes[:, 2:] *= factor
            boxes[:, :2] -= (boxes[:, 2:] - p.boxes[:, 2:]) / 2
        else:
            boxes[:, 3:6] *= factor
        swollen.append(replace(p, boxes=boxes))
    assert risen(truths, predictions, swollen, protocol) == {}


@given(seed=st.integers(0, 2**32 - 1), columns=st.sampled_from(COLUMNS), protocol=st.sampled_from(list(PROTOCOLS)))
@settings(max_examples=100, deadline=None)
def test_deleted_hits_never_raise_a_number(seed: int, columns: int, protocol: str) -> None:
    truths, predictions = clean(seed, columns)
    rng = np.random.default_rng(seed)
    fewer = []
    for t, p in zip(truths, predictions, strict=True):
        assert p.labels is not None
        kept = (rng.random(len(p.boxes)) < 0.5) | (np.arange(len(p.boxes)) >= len(t.boxes))  # hits come first
        fewer.append(Predictions(p.boxes[kept], p.scores[kept], p.labels[kept]))
    assert risen(truths, predictions, fewer, protocol) == {}


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_deleting_everything_scores_zero(protocol: str) -> None:
    truths, predictions = clean(1, 7)
    nothing = [Predictions(p.boxes[:0], p.scores[:0]) for p in predictions]
    for empty in (nothing, [None] * len(truths)):
        got = score(truths, empty, protocol)
        if protocol == "class-agnostic":
            assert {(p.precision, p.recall, p.f1, p.pooled_f1) for p in got.pairs} == {(0.0, 0.0, 0.0, 0.0)}
        else:
            assert got.ap == got.ar == 0.0


def test_thread_count_changes_nothing() -> None:
    truths, predictions = sample3d(7, 20)
    threads = numba.get_num_threads()
    results = []
    try:
        for count in (1, numba.config.NUMBA_NUM_THREADS):
            numba.set_num_threads(count)
            results.append([score(truths, predictions, protocol) for protocol in RANKED])
    finally:
        numba.set_num_threads(threads)
    assert results[0] == results[1]


def shuffled(
    truths: list[Truths], predictions: list[Predictions], rng: np.random.Generator
) -> tuple[list[Truths], list[Predictions]]:
    new_truths, new_predictions = [], []
    for s in rng.permutation(len(truths)):
        t, p = truths[s], predictions[s]
        a, b = rng.permutation(len(t.boxes)), rng.permutation(len(p.boxes))
        new_truths.append(
            Truths(
                t.boxes[a],
                None if t.labels is None else t.labels[a],
                None if t.difficult is None else t.difficult[a],
                groups={name: keys[a] for name, keys in t.groups.items()},
            )
        )
        new_predictions.append(Predictions(p.boxes[b], p.scores[b], None if p.labels is None else p.labels[b]))
    return new_truths, new_predictions


@given(seed=st.integers(0, 2**32), limit=st.sampled_from([2, 5, 64]))
@settings(max_examples=80, deadline=None)
def test_order_never_changes_hsbench_even_with_ties_everywhere(seed: int, limit: int) -> None:
    rng = np.random.default_rng(seed)
    truths, predictions = [], []
    for _ in range(4):
        # boxes on a coarse grid: equal boxes, equal IoU with several truths, equal scores
        n, m = int(rng.integers(0, 6)), int(rng.integers(0, 9))
        truths.append(
            Truths(
                np.concatenate([rng.integers(0, 3, (n, 2)), rng.integers(1, 4, (n, 2))], axis=1),
                rng.integers(0, 2, n),
                rng.random(n) < 0.3,
            )
        )
        predictions.append(
            Predictions(
                np.concatenate([rng.integers(0, 3, (m, 2)), rng.integers(1, 4, (m, 2))], axis=1),
                rng.integers(0, 3, m),
                rng.integers(0, 2, m),
            )
        )
    before = score(truths, predictions, limit=limit, operating_score=1.0)
    after = score(*shuffled(truths, predictions, rng), limit=limit, operating_score=1.0)
    assert after == before


@given(seed=st.integers(0, 2**32), protocol=st.sampled_from(list(PROTOCOLS)), flat=st.booleans())
@settings(max_examples=60, deadline=None)
def test_order_never_changes_a_protocol_where_scores_differ(seed: int, protocol: str, flat: bool) -> None:
    share = 0.0 if protocol == "class-agnostic" else 0.2
    if flat:
        truths, predictions = sample2d(seed, 5, classes=2, difficult=share)
        truths = [Truths(t.boxes, t.labels, t.difficult) for t in truths]
    else:
        truths, predictions = sample3d(seed, 5, difficult=share, ties=False)
    before = score(truths, predictions, protocol)
    after = score(*shuffled(truths, predictions, np.random.default_rng(seed)), protocol)
    assert after.ap == before.ap
    assert after.per_class == before.per_class
    assert after.summary == pytest.approx(before.summary, abs=TOLERANCE)  # means over scenes add up in another order
