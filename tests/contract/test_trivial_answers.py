"""What trivial answers score in every task, against counts by hand on two tiny rooms.

Each room is a row of eight places: voxels, cells, pixels, poses or spots for a box. One label is at places 0 and 1 of
the first room and at 1, 2 and 3 of the second: 5 of 16. An answer names places too.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Mapping
from fractions import Fraction
from itertools import chain, combinations
from typing import Any, NamedTuple

import numpy as np
import pytest

from hsbench.evaluation import DatasetRef, score_episodes
from hsbench.evaluation.action_recognition import ActionTruth
from hsbench.geometry.grids import VoxelGrid
from hsbench.metrics.detection import Truths
from hsbench.schema import AffordanceTruth, Evidence, OccupancyTruth, Visibility, VoxelState, category
from hsbench.schema.states import Action
from hsbench.submission import Metadata
from hsbench.tasks import TASKS, task
from hsbench.tasks.object_detection import Boxes
from hsbench.tasks.spec import PlanGrid
from hsbench.truth.affordance_volumes import Volume, VolumeTruth

PLACES = 8
ROW = VoxelGrid((0.0, 0.0, 0.0), (PLACES, 1, 1), 0.05)
ROOMS = ({0, 1}, {1, 2, 3})
SUBSETS = list(chain.from_iterable(combinations(range(PLACES), k) for k in range(PLACES + 1)))

Places = Collection[int]


def at(places: Places) -> np.ndarray:
    return np.isin(np.arange(PLACES), list(places))


class Tiny(NamedTuple):
    """A task on rows of places: its grid, the truth of a room, an answer."""

    grid: Any
    truth: Callable[[Places], Any]
    answer: Callable[[Places], Any]


def solid(places: Places) -> OccupancyTruth:
    semantic = (at(places) * category("chair").category_id).astype(np.uint8).reshape(ROW.shape)
    state = np.full(ROW.shape, VoxelState.OCCLUDED, np.uint8)
    never = np.full(ROW.shape, np.inf, np.float32)
    return OccupancyTruth(ROW, semantic, semantic.astype(np.uint16), state, np.zeros(ROW.shape, bool), never)


def boxes(places: Places, side_m: float = 1.0) -> np.ndarray:
    """Cubes three metres apart."""
    return np.array([[3.0 * k, 0, 0.5, side_m, side_m, side_m, 0] for k in sorted(places)]).reshape(-1, 7)


def furniture(places: Places) -> Truths:
    cells = np.tile([Visibility.VISIBLE, Evidence.USED], (len(places), 1))
    labels = np.full(len(places), category("chair").category_id)
    return Truths(boxes(places), labels, np.zeros(len(places), bool), groups={"visibility-evidence": cells})


def sure(rows: np.ndarray, score: float = 0.5) -> Boxes:
    return Boxes.of(rows, np.full(len(rows), score))


def sitting(places: Places) -> np.ndarray:
    return np.where(at(places), Action.SIT, Action.STAND).astype(np.uint8)


def maps(places: Places) -> np.ndarray:
    found = np.zeros((3, 1, PLACES), np.float32)
    found[1, 0] = at(places)
    return found


def bits(places: Places) -> np.ndarray:
    return (at(places) * 0b010).astype(np.uint8)[None]


def volumes(places: Places) -> np.ndarray:
    return (at(places) * Volume.SITTABLE).astype(np.uint8).reshape(ROW.shape)


TINY: Mapping[str, Tiny] = {
    "scene-completion": Tiny(ROW, solid, lambda places: at(places).reshape(ROW.shape)),
    "object-detection-3d": Tiny(None, furniture, lambda places: sure(boxes(places))),
    "affordance-topdown": Tiny(
        PlanGrid((1, PLACES), 0.05), lambda places: AffordanceTruth(bits(places), np.zeros((1, PLACES), bool)), maps
    ),
    "affordance-view": Tiny(None, bits, maps),
    "action-recognition": Tiny(
        None, lambda places: ActionTruth(sitting(places), np.ones(PLACES, dtype=np.int32)), sitting
    ),
    "scene-reconstruction-360": Tiny(
        ROW, lambda places: VolumeTruth(ROW, volumes(places), at(places).reshape(ROW.shape), np.zeros(ROW.shape, bool)),
        volumes,
    ),
}  # fmt: skip


def primary(name: str, rooms: Collection[Places], answers: Collection[Any | None]) -> float | None:
    """The primary metric; an answer that is None is missing."""
    spec = task(name) if TINY[name].grid is None else dataclasses.replace(task(name), grid=TINY[name].grid)
    ids = [f"ep-{k:03d}" for k in range(len(rooms))]
    report = score_episodes(
        [(e, e.replace("ep", "room"), TINY[name].truth(room)) for e, room in zip(ids, rooms, strict=True)],
        {e: answer for e, answer in zip(ids, answers, strict=True) if answer is not None},
        spec=spec,
        dataset=DatasetRef(spec.datasets[0], "0", "ab" * 32),
        split="val",
        method=Metadata(spec.name, spec.version, "trivial", "poses"),
        replicates=2,
    )
    return report.primary.value


def said(name: str, *answers: Places) -> float | None:
    return primary(name, ROOMS, [TINY[name].answer(places) for places in answers])


IOU = ("scene-completion", "affordance-topdown", "affordance-view", "scene-reconstruction-360")
ANSWERS: Mapping[str, tuple[Places, Places]] = {
    "truth": ROOMS,
    "full": (range(PLACES), range(PLACES)),
    "constant": ({1}, {1}),
    "shuffled": (ROOMS[1], ROOMS[0]),
    "enlarged": ({0, 1, 2}, {1, 2, 3, 4}),
}
HITS = {  # of the label: hits, false, missed, added over both rooms
    "truth": (5, 0, 0),
    "full": (5, 11, 0),
    "constant": (2, 0, 3),
    "shuffled": (2, 3, 3),
    "enlarged": (5, 2, 0),
}


def f1(hits: int, false: int, missed: int) -> Fraction:
    return Fraction(2 * hits, 2 * hits + false + missed)


def by_hand(name: str, hits: int, false: int, missed: int, places: int) -> Fraction:
    """The primary metric of counts. Detection has one block of equal scores, so AP = precision x recall; a pose is
    standing where it is not sitting, so what one label misses is false for the other.
    """
    if name == "object-detection-3d":
        return Fraction(hits, hits + false) * Fraction(hits, hits + missed)
    if name == "action-recognition":
        return (f1(hits, false, missed) + f1(places - hits - false - missed, missed, false)) / 2
    return Fraction(hits, hits + false + missed)


def test_every_task_is_here() -> None:
    assert list(TINY) == list(TASKS)


@pytest.mark.parametrize("name", TINY)
@pytest.mark.parametrize("answer", ANSWERS)
def test_answers_of_places(name: str, answer: str) -> None:
    assert said(name, *ANSWERS[answer]) == pytest.approx(float(by_hand(name, *HITS[answer], 16)), abs=1e-15)


@pytest.mark.parametrize("name", TINY)
def test_empty_and_missing(name: str) -> None:
    """No place at all, or no answer at all. Who sits nowhere stands everywhere: half of 2 x 11 / (2 x 11 + 5)."""
    stands = Fraction(22, 27) / 2 if name == "action-recognition" else 0
    assert said(name, (), ()) == pytest.approx(float(stands), abs=1e-15)
    assert primary(name, ROOMS, [None, None]) == 0.0


@pytest.mark.parametrize("name", TINY)
def test_random(name: str) -> None:
    """Each of the 256 sets of places once: a place is named in half of them."""
    found = primary(name, [ROOMS[0]] * len(SUBSETS), [TINY[name].answer(places) for places in SUBSETS])
    assert found == pytest.approx(float(by_hand(name, 256, 768, 256, 2048)), abs=1e-15)
    if name in IOU:
        assert found == pytest.approx(2 / (2 + PLACES), abs=1e-15)


def test_duplicated_boxes() -> None:
    """Once more with a lower score: nothing is lost that AP counts. With the same score, every second box is false."""
    for score, expected in ((0.4, 1.0), (0.5, 0.5)):
        answers = [Boxes.of(np.repeat(boxes(room), 2, axis=0), np.tile([0.5, score], len(room))) for room in ROOMS]
        assert primary("object-detection-3d", ROOMS, answers) == expected


@pytest.mark.parametrize(("side_m", "expected"), [(1.2, 1.0), (2.0, 0.0), (100.0, 0.0)])
def test_enlarged_boxes(side_m: float, expected: float) -> None:
    """A side 1.2 times as long gives IoU 1 / 1.728, twice as long 1 / 8, below 1 / 4."""
    answers = [sure(boxes(room, side_m)) for room in ROOMS]
    assert primary("object-detection-3d", ROOMS, answers) == expected
