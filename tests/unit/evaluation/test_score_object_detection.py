"""Task object-detection-3d as a whole: every metric of a report against plain loops, and small cases by hand."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.evaluation import DatasetRef, Report, compare, score_episodes
from hsbench.evaluation.object_detection import SEEN_AND_TOUCHED, truth
from hsbench.evaluation.pooled import recompute
from hsbench.geometry.convex import box
from hsbench.geometry.transforms import planar
from hsbench.metrics.detection import Predictions, Truths, score
from hsbench.schema import Episode, EpisodeTruth, Evidence, ObjectTruth, Room, Scene, Visibility, category
from hsbench.schema.episode import FrameList
from hsbench.submission import Metadata
from hsbench.tasks import task
from hsbench.tasks.object_detection import CLASSES, Boxes
from tests.reference import detection_from_tasks as loops
from tests.unit.episode_builders import SENSORS, furniture

SPEC = task("object-detection-3d")
IDS = [CLASSES[k].category_id for k in range(3)]
CELLS = [(v, e) for v in Visibility for e in Evidence]


def report(episodes: list[tuple[str, str, Truths]], found: Mapping[str, Boxes], **changes: Any) -> Report:
    arguments: dict[str, Any] = {
        "spec": SPEC,
        "dataset": DatasetRef("rgbd-activity", "0", "ab" * 32),
        "split": "val",
        "method": Metadata(SPEC.name, SPEC.version, "guess", "poses"),
        "replicates": 50,
    }
    return score_episodes(episodes, found, **arguments | changes)


def boxes_of(rng: np.random.Generator, n: int) -> np.ndarray:
    """n boxes that overlap a lot."""
    return np.column_stack(
        [rng.uniform(0, 2, (n, 2)), rng.uniform(0, 0.6, n), rng.uniform(0.3, 1.5, (n, 3)), rng.uniform(-3, 3, n)]
    )


def true(boxes: np.ndarray, ids: np.ndarray, cells: np.ndarray) -> Truths:
    hopeless = (cells == (Visibility.FULLY_OCCLUDED, Evidence.NEITHER)).all(axis=1)
    return Truths(boxes, ids, difficult=hopeless, groups={SEEN_AND_TOUCHED: cells})


def room(seed: int) -> tuple[Truths, Boxes]:
    """Truths and guesses, some near a truth, some of no class; scores repeat across rooms, never in one."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(0, 7)), int(rng.integers(0, 12))
    truths = boxes_of(rng, n)
    cells = np.array([CELLS[k] for k in rng.integers(0, len(CELLS), n)], dtype=np.int64).reshape(-1, 2)
    guesses = boxes_of(rng, m)
    for k in range(min(n, m)):
        guesses[k] = truths[k] + rng.normal(0, 0.05, 7)
    scores = rng.permutation(20)[:m] / 20
    found = Boxes.of(guesses, scores, rng.choice([0, *IDS], m), operating_score=0.4)
    return true(truths, rng.choice(IDS, n), cells), found


ROOMS = [room(seed) for seed in range(8)]
EPISODES = [(f"ep-{k}", f"room-{k // 2}", truths) for k, (truths, _) in enumerate(ROOMS)]
GUESSES = {f"ep-{k}": found for k, (_, found) in enumerate(ROOMS)}


def as_loops(difficult: bool = False) -> list[loops.Episode]:
    """The same in the plain form of the reference."""
    episodes = []
    for truths, found in ROOMS:
        cells = truths.groups[SEEN_AND_TOUCHED]
        there = [
            loops.Truth(tuple(b), int(c), bool(d) and difficult, (Visibility(v).name, Evidence(e).name))
            for b, c, d, (v, e) in zip(truths.boxes, truths.labels, truths.difficult, cells, strict=True)
        ]
        said = [
            loops.Guess(tuple(map(float, b)), float(s), int(c))
            for b, s, c in zip(found.boxes, found.scores, found.category_ids, strict=True)
        ]
        episodes.append((there, said))
    return episodes


def close(value: float | None, expected: Any) -> bool:
    return (value is None) == (expected is None) and (value is None or abs(value - float(expected)) < 1e-12)


def test_average_precisions_agree_with_plain_loops() -> None:
    metrics = report(EPISODES, GUESSES).metrics
    for name, t in (("ap-25", 0.25), ("ap-50", 0.5)):
        assert close(metrics[name].value, loops.average_precision(as_loops(), t))
        assert close(metrics[f"difficult/{name}"].value, loops.average_precision(as_loops(difficult=True), t))
        each = [loops.average_precision(loops.of_label(as_loops(), i), t) for i in IDS]
        for known, expected in zip(CLASSES, each, strict=False):
            assert close(metrics[f"{name}/{known.name}"].value, expected)
        defined = [float(v) for v in each if v is not None]
        assert close(metrics[f"m{name}"].value, sum(defined) / len(defined))
        alone = [loops.average_precision([e], t) for e in as_loops()]
        defined = [float(v) for v in alone if v is not None]
        assert close(metrics[name].mean_over_episodes, sum(defined) / len(defined))
        assert metrics[name].undefined_episodes == alone.count(None)
    assert 0.1 < metrics["ap-25"].value < 0.9


def test_named_protocols_are_those_of_the_metric_over_all_rooms_at_once() -> None:
    """Equal scores in different rooms are in the order of episodes."""
    metrics = report(EPISODES[::-1], GUESSES).metrics
    truths = [dataclasses.replace(true, difficult=None) for true, _ in ROOMS]
    found = [
        Predictions(b.boxes.astype(np.float64), b.scores.astype(np.float64), b.category_ids.astype(np.int64))
        for _, b in ROOMS
    ]
    for protocol, steps in (("voc", (0.25, 0.5)), ("sunrgbd", (0.25,))):
        summary = score(truths, found, protocol, steps).summary
        for t in steps:
            assert close(metrics[f"{protocol}/map-{round(100 * t)}"].value, summary[f"mAP_{t:.2f}"])


def test_counts_and_tables_agree_with_plain_loops() -> None:
    metrics = report(EPISODES, GUESSES).metrics
    operating = float(np.float32(0.4))
    for prefix, least in (("", 0.0), ("operating/", operating)):
        hits, false, truths = loops.counts_at(as_loops(), 0.25, least)
        assert close(metrics[f"{prefix}precision"].value, hits / (hits + false))
        assert close(metrics[f"{prefix}recall"].value, hits / truths)
        assert close(metrics[f"{prefix}f1"].value, 2 * hits / (hits + false + truths))
        table = loops.recall_table(as_loops(), 0.25, least)
        for v, e in CELLS:
            found, present = table.get((v.name, e.name), (0, 0))
            name = f"{prefix}recall/{v.name.lower().replace('_', '-')}/{e.name.lower()}"
            assert close(metrics[name].value, found / present if present else None), name


def size_of(box: tuple[float, ...]) -> str:
    longest_m = max(box[3:6])
    return "small" if longest_m < 0.6 else "medium" if longest_m < 1.2 else "large"


def test_recall_by_size_agrees_with_plain_loops() -> None:
    metrics = report(EPISODES, GUESSES).metrics
    by_size = [
        ([dataclasses.replace(there, cell=(size_of(there.box), "")) for there in truths], found)
        for truths, found in as_loops()
    ]
    for prefix, least in (("", 0.0), ("operating/", float(np.float32(0.4)))):
        table = loops.recall_table(by_size, 0.25, least)
        for name in ("small", "medium", "large"):
            found, present = table.get((name, ""), (0, 0))
            assert close(metrics[f"{prefix}recall/size/{name}"].value, found / present if present else None), name
    assert {size for size, _ in loops.recall_table(by_size, 0.25)} == {"small", "medium", "large"}


def test_truth_as_prediction_is_perfect_in_every_metric() -> None:
    """Enlarged boxes are not, and a second box on each truth costs precision."""
    same = {e: Boxes.of(t.boxes, np.ones(len(t.boxes)), t.labels) for e, _, t in EPISODES}
    for name, metric in report(EPISODES, same).metrics.items():
        assert metric.value in (1.0, None), name
    large = {e: Boxes.of(t.boxes * [1, 1, 1, 9, 9, 9, 1], np.ones(len(t.boxes))) for e, _, t in EPISODES}
    assert report(EPISODES, large).primary.value == 0.0
    twice = {
        e: Boxes.of(np.repeat(t.boxes, 2, axis=0), np.tile([0.9, 0.8], len(t.boxes)), np.repeat(t.labels, 2))
        for e, _, t in EPISODES
    }
    doubled = report(EPISODES, twice).metrics
    assert (doubled["recall"].value, doubled["precision"].value) == (1.0, 0.5)


def test_by_hand() -> None:
    """One room with two chairs far apart; three boxes: on one of them, on nothing, and on the other, in this order."""
    chair = category("chair").category_id
    unit = [0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 0.0]
    beside = [9.0, 0.0, 0.5, 1.0, 1.0, 1.0, 0.0]
    far = [5.0, 0.0, 0.5, 1.0, 1.0, 1.0, 0.0]
    cells = np.array([[Visibility.VISIBLE, Evidence.USED], [Visibility.FULLY_OCCLUDED, Evidence.NEITHER]])
    truths = true(np.array([unit, far]), np.array([chair, chair]), cells)
    found = Boxes.of([unit, beside, far], [0.9, 0.8, 0.7], [chair, chair, 0], operating_score=0.75)
    metrics = report([("ep", "room", truths)], {"ep": found}).metrics
    expected = {
        "ap-25": 0.5 * 1 + 0.5 * 2 / 3,
        "difficult/ap-25": 1.0,  # the second chair is neither asked nor counted
        "ap-25/chair": 0.5,  # of the second chair no class is said
        "map-25": 0.5,
        "precision": 2 / 3,
        "recall": 1.0,
        "operating/precision": 0.5,
        "operating/recall": 0.5,
        "recall/fully-occluded/neither": 1.0,
        "operating/recall/fully-occluded/neither": 0.0,
        "operating/recall/visible/used": 1.0,
        "recall/size/medium": 1.0,
        "ap-25/bed": None,
    }
    for name, value in expected.items():
        assert metrics[name].value == (None if value is None else pytest.approx(value, abs=1e-12)), name


def test_a_missing_episode_is_no_box_and_equal_scores_do_not_depend_on_order() -> None:
    some = {e: GUESSES[e] for e in list(GUESSES)[1:]}
    got = report(EPISODES, some)
    assert (got.counts.missing, got.metrics) == (1, report(EPISODES, {**some, "ep-0": Boxes.none()}).metrics)
    constant = {e: Boxes.of(b.boxes, np.full(len(b.scores), 0.5)) for e, b in GUESSES.items()}
    shuffled = {e: Boxes.of(b.boxes[::-1], np.full(len(b.scores), 0.5)) for e, b in GUESSES.items()}
    assert report(EPISODES, constant).to_json() == report(EPISODES[::-1], shuffled).to_json()


def test_a_report_follows_from_its_rows_and_compares() -> None:
    good = report(EPISODES, {e: Boxes.of(t.boxes, np.ones(len(t.boxes)), t.labels) for e, _, t in EPISODES})
    bad = report(EPISODES, GUESSES)
    assert recompute(Report.from_json(bad.to_json())) == []
    result = compare(good, bad)
    assert result.primary.estimate == pytest.approx(1.0 - bad.primary.value, abs=1e-12)
    assert result.is_real
    broken = bad.to_json()
    broken["episodes"][1]["statistics"]["ap-25/hits"] = [2]
    with pytest.raises(SchemaError, match="ranking 'ap-25' is none"):
        recompute(Report.from_json(broken))


def test_truth_of_an_episode_is_its_furniture() -> None:
    """Too small, outside the grid, clutter and rugs are left out; the rest keeps its order."""

    def thing(number: int, side_m: float, name: str, x_m: float = 2.0):
        return furniture(number, box((side_m, 0.1, 0.1)), name, planar(x_m, 0.0, 0.0))

    objects = (
        thing(1, 0.3, "chair"),
        thing(2, 0.29, "chair"),
        thing(3, 0.5, "clutter"),
        thing(4, 2.0, "rug"),
        thing(5, 0.5, "bed", x_m=-0.1),
        thing(6, 0.5, "bed", x_m=6.3),
    )
    n = len(objects)
    outline = np.array([[-1.0, -3.0], [7.0, -3.0], [7.0, 3.0], [-1.0, 3.0]])
    scene = Scene("scene-0", (Room("living", outline),), 2.5, objects)
    of_objects = ObjectTruth(
        np.arange(1, n + 1, dtype=np.int32),
        np.zeros(n, dtype=np.int64),
        np.full(n, 9, dtype=np.int64),
        np.zeros(n, dtype=np.uint8),
        np.zeros(n, dtype=np.float32),
    )
    whole = EpisodeTruth(scene=scene, objects=of_objects)
    episode = Episode("ep", "rgbd-activity", SENSORS["rgbd"], FrameList(), None, 0, 9, truth=whole)
    found = truth(episode)
    assert found is not None
    assert found.labels.tolist() == [category("chair").category_id, category("bed").category_id]
    assert found.difficult.all()
    assert truth(Episode("ep", "rgbd-activity", SENSORS["rgbd"], FrameList(), None, 0, 9)) is None
