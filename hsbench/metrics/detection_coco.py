"""Protocols in which a detection goes to its best truth not taken: coco and omni3d."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hsbench.errors import SchemaError
from hsbench.metrics import detection_matching as matching
from hsbench.metrics.detection_inputs import Inputs, Rows
from hsbench.metrics.detection_order import by_key, class_codes, stable
from hsbench.metrics.detection_protocols import MAX_DETECTIONS, Protocol
from hsbench.metrics.detection_ranking import Ranking
from hsbench.metrics.detection_results import ClassScore, DetectionScore
from hsbench.typing import BoolArray, FloatArray, IntArray

SHOWN_THRESHOLDS: Mapping[str, tuple[float, ...]] = {"coco": (0.5, 0.75), "omni3d": (0.15, 0.25, 0.5)}
"""Thresholds whose AP stands in the summary by itself, as AP50."""


def evaluate(inputs: Inputs, rules: Protocol, steps: tuple[float, ...]) -> DetectionScore:
    """The score under one of the two protocols; ``detection`` describes them."""
    assert rules.limit is not None
    if inputs.truths.measure is not None and inputs.detections.measure is None and len(inputs.detections):
        raise SchemaError(f"predictions have no measure while truths do; give the {rules.range_of} of both or of none")
    by_score = stable(-inputs.scores)
    labels, truth_codes, codes = class_codes(inputs)
    order, key = by_key(by_score, codes, inputs.detections.scene, inputs.scenes)
    truths, truth_key = by_key(np.arange(len(inputs.truths)), truth_codes, inputs.truths.scene, inputs.scenes)
    ignored = (inputs.difficult | inputs.crowd) | _outside(rules, inputs.truths)
    outcome: NDArray[np.int8] = np.empty((len(inputs.detections), len(rules.ranges), len(steps)), dtype=np.int8)
    rank = np.empty(len(inputs.detections), dtype=np.int64)
    matching.match_untaken(
        inputs.iou,
        inputs.row,
        inputs.column,
        order,
        key,
        truths,
        truth_key,
        ignored,
        inputs.crowd,
        _outside(rules, inputs.detections),
        np.array(steps),
        rules.limit,
        outcome,
        rank,
    )
    ranked = by_score[stable(codes[by_score])]
    class_start = np.concatenate([[0], np.cumsum(np.bincount(codes, minlength=len(labels)))]).astype(np.int64)
    counted = np.stack([np.bincount(truth_codes[~flags], minlength=len(labels)) for flags in ignored]).astype(np.int64)
    ap = np.empty((len(rules.ranges), len(steps), len(labels)))
    recall = np.empty((len(rules.ranges), len(MAX_DETECTIONS), len(steps), len(labels)))
    matching.accumulate(
        ranked, class_start, outcome, rank, counted, np.array(MAX_DETECTIONS), np.linspace(0.0, 1.0, 101), ap, recall
    )
    classes = _classes(inputs, labels, truth_codes, ranked, class_start, outcome[:, 0], ~ignored[0], ap[0], steps)
    return DetectionScore(
        rules.name,
        rules.verified,
        steps,
        ap=_mean(ap[0]),
        ar=_mean(recall[0, -1]),
        summary=_summary(rules, inputs, steps, ap, recall),
        per_class=classes if inputs.labelled else (),
        overall=() if inputs.labelled else classes,
        recall=(),
        pairs=(),
        labels_without_truth=tuple(labels[counted[0] == 0].tolist()) if inputs.labelled else (),
        scenes=inputs.scenes,
        scenes_without_prediction=inputs.without_prediction,
        truths=int((~ignored[0]).sum()),
        ignored=int(ignored[0].sum()),
        detections=len(inputs.detections),
        over_limit=int((rank >= rules.limit).sum()),
    )


def _outside(rules: Protocol, rows: Rows) -> BoolArray:
    """(A, n) whether a row lies outside each range. Without a measure only the first range, all, is meaningful."""
    if rows.measure is None:
        return np.zeros((len(rules.ranges), len(rows)), dtype=np.bool_)
    return np.stack([(rows.measure < r.low) | (rows.measure > r.high) for r in rules.ranges])


def _classes(
    inputs: Inputs,
    labels: IntArray,
    truth_codes: IntArray,
    ranked: IntArray,
    class_start: IntArray,
    outcome: NDArray[np.int8],
    counted: BoolArray,
    ap: FloatArray,
    steps: tuple[float, ...],
) -> tuple[ClassScore, ...]:
    cells = truth_codes[counted] * inputs.scenes + inputs.truths.scene[counted]
    per_scene = np.bincount(cells, minlength=len(labels) * inputs.scenes).astype(np.int64)
    out = []
    for c, label in enumerate(labels.tolist()):
        here = ranked[class_start[c] : class_start[c + 1]]
        scores, scene, outcomes = inputs.scores[here], inputs.detections.scene[here], outcome[here].T
        truths = per_scene[c * inputs.scenes : (c + 1) * inputs.scenes]
        for k, t in enumerate(steps):
            ranking = Ranking(scores, outcomes[k], scene, truths, False)
            value = None if np.isnan(ap[k, c]) else float(ap[k, c])
            out.append(ClassScore(label if inputs.labelled else None, t, value, ranking))
    return tuple(out)


def _summary(
    rules: Protocol, inputs: Inputs, steps: tuple[float, ...], ap: FloatArray, recall: FloatArray
) -> dict[str, float | None]:
    """The protocol's numbers by name: AP, AP50, APs, AR1, ARs ...; None where no truth counts or depth is unknown."""
    out: dict[str, float | None] = {"AP": _mean(ap[0])}
    for t in SHOWN_THRESHOLDS[rules.name]:
        at = np.flatnonzero(np.isclose(t, steps))
        out[f"AP{round(100 * t)}"] = _mean(ap[0, at])
    measured = inputs.truths.measure is not None
    ranges = list(enumerate(rules.ranges))[1:]
    out |= {f"AP{r.name[0]}": _mean(ap[a]) if measured else None for a, r in ranges}
    out |= {f"AR{most}": _mean(recall[0, m]) for m, most in enumerate(MAX_DETECTIONS)}
    out |= {f"AR{r.name[0]}": _mean(recall[a, -1]) if measured else None for a, r in ranges}
    return out


def _mean(values: FloatArray) -> float | None:
    defined = values[~np.isnan(values)]
    return float(defined.mean()) if defined.size else None
