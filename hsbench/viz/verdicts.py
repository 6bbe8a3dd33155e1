"""What a prediction got right and wrong in one episode, part by part, as the metrics judge it; and its colours.

A part is a voxel (task scene-completion) or a box (object-detection-3d). *Hit* is claimed and there, *false* claimed
and not there, *missed* there and not claimed. Which voxels count is the metric's mask, and which box hits which truth
is the metric's matching: nothing is judged anew here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from hsbench.evaluation import object_detection
from hsbench.metrics import completion, detection
from hsbench.metrics.detection import Predictions, Truths
from hsbench.metrics.detection_inputs import gather
from hsbench.metrics.detection_matching import HIT as HIT_OUTCOME
from hsbench.metrics.detection_order import by_content
from hsbench.schema.categories import STRUCTURE
from hsbench.schema.episode import Episode
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.schema.states import VoxelState
from hsbench.tasks.object_detection import Boxes
from hsbench.tasks.scene_completion import GRID
from hsbench.truth.detectable import detectable
from hsbench.typing import BoolArray, UInt8Array

MATCH_IOU = object_detection.IOU[0]
"""IoU from which a box counts as found: that of the task's primary metric."""

EACH = "each"  # group of truths in which every truth is a group of its own


class Verdict(IntEnum):
    """Of a voxel. The first four are judged by the primary metric; the others are shown so that these make sense."""

    NOTHING = 0  # outside the room, or nothing is known
    HIT = 1
    FALSE = 2
    MISSED = 3
    HIDDEN_FREE = 4  # judged: free, and not claimed
    SEEN_FREE = 5
    SEEN_SOLID = 6
    STRUCTURE = 7  # walls, doors, windows, floor, ceiling
    NOT_JUDGED = 8  # in no pixel, above what is scored, or changed for most of the episode


COLOURS: dict[Verdict, tuple[int, int, int]] = {
    Verdict.NOTHING: (255, 255, 255),
    Verdict.HIT: (58, 143, 208),
    Verdict.FALSE: (200, 66, 10),
    Verdict.MISSED: (244, 207, 62),
    Verdict.HIDDEN_FREE: (232, 232, 228),
    Verdict.SEEN_FREE: (250, 246, 239),
    Verdict.SEEN_SOLID: (172, 172, 166),
    Verdict.STRUCTURE: (61, 65, 71),
    Verdict.NOT_JUDGED: (241, 242, 245),
}
"""Blue, vermilion and yellow stay apart in every common kind of colour vision, and on white and on black."""


def voxel_verdicts(truth: OccupancyTruth, occupied: BoolArray) -> UInt8Array:
    """(nx, ny, nz) uint8 of ``Verdict`` for a prediction (nx, ny, nz) bool on the grid of ``truth``."""
    labels = np.full(truth.grid.shape, int(Verdict.NOTHING), dtype=np.uint8)
    solid, state = truth.solid, truth.state
    seen = np.isin(state, [VoxelState.FREE, VoxelState.SURFACE])
    labels[~np.isin(state, [VoxelState.UNKNOWN, VoxelState.OUTSIDE_ROOM])] = Verdict.NOT_JUDGED
    labels[seen & ~solid] = Verdict.SEEN_FREE
    labels[seen & solid] = Verdict.SEEN_SOLID
    labels[np.isin(truth.semantic, list(STRUCTURE))] = Verdict.STRUCTURE
    judged = completion.primary_mask(truth)
    labels[judged & ~solid & ~occupied] = Verdict.HIDDEN_FREE
    labels[judged & solid & occupied] = Verdict.HIT
    labels[judged & ~solid & occupied] = Verdict.FALSE
    labels[judged & solid & ~occupied] = Verdict.MISSED
    return labels


@dataclass(frozen=True, eq=False)
class BoxVerdicts:
    """Which truths are found, (T,) bool, which boxes hit one, (N,) bool, and the episode's AP; None without truth."""

    found: BoolArray
    hits: BoolArray
    average_precision: float | None


def true_boxes(episode: Episode) -> Truths | None:
    """What the task's metric asks for; of a capture whose boxes alone are annotated, those of them it would ask for."""
    truths = object_detection.truth(episode)
    if truths is not None or episode.truth is None or episode.truth.scene is None:
        return truths
    objects = episode.truth.scene.objects
    if not objects:
        return None
    return Truths(np.array([item.box for item in objects])[detectable(episode.truth.scene, GRID)])


def box_verdicts(truths: Truths, boxes: Boxes) -> BoxVerdicts:
    """The primary metric's matching of one episode, at IoU ``MATCH_IOU``; no truth counts as difficult."""
    each = np.arange(len(truths.boxes), dtype=np.int64)
    counting_all = replace(truths, difficult=None, groups={EACH: each})
    predictions = Predictions(
        boxes.boxes.astype(np.float64), boxes.scores.astype(np.float64), boxes.category_ids.astype(np.int64)
    )
    scored = detection.score([counting_all], [predictions], "hsbench", MATCH_IOU)
    ranking = scored.overall[0].ranking
    inputs = gather([counting_all], [predictions], classes="free")
    hits = np.zeros(len(boxes.boxes), dtype=np.bool_)
    # the ranking is in the metric's order, which never depends on the order of rows in a file
    hits[by_content(inputs.detections, -inputs.scores)[: len(ranking.outcome)]] = ranking.outcome == HIT_OUTCOME
    found = np.zeros(len(each), dtype=np.bool_)
    found[[row.key[0] for row in scored.recall if row.group == EACH and row.hits]] = True
    return BoxVerdicts(found, hits, scored.overall[0].ap)
