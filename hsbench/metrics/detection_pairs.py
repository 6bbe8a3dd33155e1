"""Protocol class-agnostic: boxes of a scene paired 1-1 by IoU, without scores."""

from __future__ import annotations

import numpy as np

from hsbench.metrics.detection_inputs import Inputs
from hsbench.metrics.detection_matching import match_pairs
from hsbench.metrics.detection_protocols import Protocol
from hsbench.metrics.detection_results import DetectionScore, PairScore
from hsbench.typing import IntArray


def evaluate(inputs: Inputs, rules: Protocol, steps: tuple[float, ...]) -> DetectionScore:
    """Precision, recall and F1 at every threshold; ``detection`` describes the protocol."""
    above = np.array(steps)[:, None]
    pairs, agreeing = (np.zeros((len(steps), inputs.scenes), dtype=np.int64) for _ in range(2))
    detections, truths = np.diff(inputs.detections.start), np.diff(inputs.truths.start)
    first = 0
    for s in range(inputs.scenes):
        n, m = int(detections[s]), int(truths[s])
        d, t, overlap = match_pairs(inputs.iou[first : first + n * m].reshape(n, m))
        first += n * m
        hit = overlap > above
        labels, truth_labels = (rows.labels[rows.start[s] :] for rows in (inputs.detections, inputs.truths))
        pairs[:, s] = hit.sum(axis=1)
        agreeing[:, s] = (hit & (labels[d] == truth_labels[t])).sum(axis=1)
    scores = tuple(
        PairScore(
            t,
            _mean_ratio(pairs[k], detections),
            _mean_ratio(pairs[k], truths),
            _mean_ratio(agreeing[k], detections) if inputs.labelled else None,
            _mean_ratio(agreeing[k], truths) if inputs.labelled else None,
            int(pairs[k].sum()),
            int(agreeing[k].sum()) if inputs.labelled else None,
            len(inputs.detections),
            len(inputs.truths),
        )
        for k, t in enumerate(steps)
    )
    return DetectionScore(
        rules.name,
        rules.verified,
        steps,
        ap=None,
        ar=None,
        summary={f"{name}_{p.iou:.2f}": getattr(p, name) for p in scores for name in ("precision", "recall", "f1")},
        per_class=(),
        overall=(),
        recall=(),
        pairs=scores,
        labels_without_truth=(),
        scenes=inputs.scenes,
        scenes_without_prediction=inputs.without_prediction,
        truths=len(inputs.truths),
        ignored=0,
        detections=len(inputs.detections),
        over_limit=0,
    )


def _mean_ratio(part: IntArray, of: IntArray) -> float | None:
    """Mean over scenes of part / of, 0 where of is 0 (as the toolbox has it); None without scenes."""
    return float((part / np.maximum(of, 1)).mean()) if len(of) else None
