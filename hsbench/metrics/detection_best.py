"""Protocols in which every detection goes to its best truth: hsbench, voc, sunrgbd."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hsbench.metrics import detection_matching as matching
from hsbench.metrics.detection_inputs import SIZE_GROUP, Inputs
from hsbench.metrics.detection_order import by_content, by_key, class_codes, rank_within, stable
from hsbench.metrics.detection_protocols import Protocol
from hsbench.metrics.detection_ranking import Ranking
from hsbench.metrics.detection_results import ClassScore, DetectionScore, RecallRow, mean
from hsbench.typing import AnyArray, FloatArray, IntArray

SIZE_EDGES_M = (0.6, 1.2)
"""Group ``size`` of 3D truths: 0, 1, 2 = longest side below .6 m (the task starts at .3 m), below 1.2 m, above."""

SIZE_EDGES_PX = (32.0, 96.0)
"""Group ``size`` of 2D truths: square root of the area, COCO's small, medium and large."""

SLACK = 1e-9
"""Protocol hsbench: an IoU that equals a threshold, or another, may miss it by its rounding error."""


def evaluate(
    inputs: Inputs, rules: Protocol, steps: tuple[float, ...], limit: int | None, operating_score: float | None
) -> DetectionScore:
    """The score under one of the three protocols; ``detection`` describes them."""
    own = rules.name == "hsbench"
    if own:
        order, truth_order = by_content(inputs.detections, -inputs.scores), by_content(inputs.truths, inputs.difficult)
    else:
        order, truth_order = stable(-inputs.scores), np.arange(len(inputs.truths))
    over_limit = 0
    if limit is not None:
        kept = rank_within(inputs.detections.scene[order]) < limit
        order, over_limit = order[kept], int((~kept).sum())
    overall: tuple[ClassScore, ...] = ()
    per_class: tuple[ClassScore, ...] = ()
    tables: tuple[RecallRow, ...] = ()
    if own or not inputs.labelled:
        as_one = np.zeros(len(inputs.truths), np.int64), np.zeros(len(inputs.detections), np.int64)
        run = _Run(inputs, order, truth_order, *as_one, steps, rules)
        overall = run.classes([None])
        tables = _recall_tables(inputs, run.hit_by, steps, operating_score) if own else ()
    if inputs.labelled:
        labels, truth_codes, codes = class_codes(inputs)
        per_class = _Run(inputs, order, truth_order, truth_codes, codes, steps, rules).classes(labels.tolist())
    headline = overall if own or not inputs.labelled else per_class
    summary: dict[str, float | None] = {}
    for prefix, scores in (("", overall), ("m", per_class)):
        for t in steps if scores else ():
            summary[f"{prefix}AP_{t:.2f}"] = mean(c.ap for c in scores if c.iou == t)
            summary[f"{prefix}AR_{t:.2f}"] = mean(c.recall for c in scores if c.iou == t)
    return DetectionScore(
        rules.name,
        rules.verified,
        steps,
        ap=mean(c.ap for c in headline if c.iou == steps[0]),
        ar=mean(c.recall for c in headline if c.iou == steps[0]),
        summary=summary,
        per_class=per_class,
        overall=overall,
        recall=tables,
        pairs=(),
        labels_without_truth=tuple(sorted({c.label for c in per_class if not c.truths and c.label is not None})),
        scenes=inputs.scenes,
        scenes_without_prediction=inputs.without_prediction,
        truths=int((~inputs.difficult).sum()),
        ignored=int(inputs.difficult.sum()),
        detections=len(inputs.detections),
        over_limit=over_limit,
    )


class _Run:
    """One matching of all scenes, with classes or with all as one."""

    def __init__(
        self,
        inputs: Inputs,
        order: IntArray,
        truth_order: IntArray,
        truth_codes: IntArray,
        codes: IntArray,
        steps: tuple[float, ...],
        rules: Protocol,
    ) -> None:
        self._inputs, self._steps, self._codes, self._order = inputs, steps, codes, order
        self._truth_codes, self._blocks = truth_codes, rules.name == "hsbench"
        grouped, key = by_key(order, codes, inputs.detections.scene, inputs.scenes)
        truths, truth_key = by_key(truth_order, truth_codes, inputs.truths.scene, inputs.scenes)
        self._outcome: NDArray[np.int8] = np.zeros((len(steps), len(inputs.detections)), dtype=np.int8)
        self.hit_by = np.full((len(steps), len(inputs.truths)), -1, dtype=np.int64)
        matching.match_best(
            inputs.iou,
            inputs.row,
            inputs.column,
            grouped,
            key,
            truths,
            truth_key,
            inputs.difficult,
            np.array(steps),
            rules.strict,
            SLACK if self._blocks else 0.0,
            self._outcome,
            self.hit_by,
        )

    def classes(self, labels: Sequence[int | None]) -> tuple[ClassScore, ...]:
        inputs = self._inputs
        counted = ~inputs.difficult
        out = []
        for code, label in enumerate(labels):
            here = self._order[self._codes[self._order] == code]
            there = counted & (self._truth_codes == code)
            per_scene = np.bincount(inputs.truths.scene[there], minlength=inputs.scenes).astype(np.int64)
            for k, t in enumerate(self._steps):
                ranking = Ranking(
                    inputs.scores[here],
                    self._outcome[k, here],
                    inputs.detections.scene[here],
                    per_scene,
                    self._blocks,
                )
                out.append(ClassScore(label, t, ranking.ap(), ranking))
        return tuple(out)


def _recall_tables(
    inputs: Inputs, hit_by: IntArray, steps: tuple[float, ...], operating_score: float | None
) -> tuple[RecallRow, ...]:
    counted = ~inputs.difficult
    groups = {SIZE_GROUP: _size(inputs.truths.boxes)[:, None], **inputs.groups}
    out = []
    for name, keys in groups.items():
        rows, inverse = np.unique(keys[counted], axis=0, return_inverse=True)
        for k, t in enumerate(steps):
            by = hit_by[k, counted]
            sure = None
            if operating_score is not None:
                scores = np.append(inputs.scores, -np.inf)  # the last stands for "not hit"
                sure = scores[by] >= operating_score
            for r, row in enumerate(rows):
                of_row = inverse.reshape(-1) == r
                out.append(
                    RecallRow(
                        name,
                        tuple(row.tolist()),
                        t,
                        int(of_row.sum()),
                        int((by[of_row] >= 0).sum()),
                        None if sure is None else int(sure[of_row].sum()),
                    )
                )
    return tuple(out)


def _size(boxes: FloatArray) -> AnyArray:
    if boxes.shape[1] == 4:
        return np.searchsorted(SIZE_EDGES_PX, np.sqrt(boxes[:, 2] * boxes[:, 3]), side="right")
    return np.searchsorted(SIZE_EDGES_M, boxes[:, 3:6].max(axis=1), side="right")
