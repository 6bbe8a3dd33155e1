"""Average precision: six rules that turn one precision-recall curve into one number, each as its scorer ships it.

All take recall (n,) ascending and precision (n,) at the same detections, highest score first, and return a number in
0..1; without detections it is 0. They raise SchemaError for what is no such curve. They differ on one and the same
curve. Five truths, detections right, wrong, right, right, wrong, right:

| rule | value | by hand |
|---|---|---|
| ``area`` | .6333 | .2 x 1 + .4 x 3/4 + .2 x 2/3 |
| ``voc11`` | .6591 | (3 x 1 + 3 x 3/4 + 3 x 2/3) / 11 |
| ``coco101`` | .6370 | (21 x 1 + 40 x 3/4 + 20 x 2/3) / 101 |
| ``av2`` | .6337 | 101 samples of the straight lines between the envelope's points |
| ``kitti40`` | .6312 | (8 x 1 + 15 x 3/4 + 9 x 2/3) / 40 |
| ``nuscenes`` | .5063 | raw precision, first tenth of recall dropped, .1 subtracted, / .9 |

``voc11`` and ``kitti40`` carry a rounding error of their scorers: the sampled recall .6 is 0.6000000000000001 there
and misses the point at recall 3/5. In exact arithmetic they are .6667 and .6333.

Sources: VOC development kit 2011 and VOC 2007; COCO API ``cocoeval``; Argoverse 2 API ``evaluation/detection``;
KITTI object benchmark since 2019 (40 points), sampled as its Python ports do; nuScenes development kit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from hsbench.errors import SchemaError
from hsbench.typing import FloatArray


def envelope(precision: FloatArray) -> FloatArray:
    """(n,) precision -> (n,) the largest precision at this or any later detection."""
    return np.maximum.accumulate(precision[::-1])[::-1]


def area(recall: FloatArray, precision: FloatArray) -> float:
    """Area under the envelope, every step of recall counted (VOC 2010 and later)."""
    _check(recall, precision)
    return float(np.sum(np.diff(recall, prepend=0.0) * envelope(precision)))


def voc11(recall: FloatArray, precision: FloatArray) -> float:
    """Mean of the envelope at recall 0, .1, ... 1 (VOC 2007), sampled at ``np.arange(0, 1.1, .1)``."""
    return float(_sampled(recall, precision, np.arange(0.0, 1.1, 0.1)).mean())


def coco101(recall: FloatArray, precision: FloatArray) -> float:
    """Mean of the envelope at recall 0, .01, ... 1 (COCO)."""
    return float(_sampled(recall, precision, np.linspace(0.0, 1.0, 101)).mean())


def kitti40(recall: FloatArray, precision: FloatArray) -> float:
    """Mean of the envelope at recall 1/40, 2/40, ... 1, sampled at ``np.linspace(0, 1, 41)[1:]``."""
    return float(_sampled(recall, precision, np.linspace(0.0, 1.0, 41)[1:]).mean())


def av2(recall: FloatArray, precision: FloatArray) -> float:
    """Mean of 101 samples, interpolated linearly between the envelope's points (Argoverse 2)."""
    _check(recall, precision)
    if not len(recall):
        return 0.0
    return float(np.interp(np.linspace(0.0, 1.0, 101), recall, envelope(precision), right=0.0).mean())


def nuscenes(recall: FloatArray, precision: FloatArray) -> float:
    """As ``av2`` on the raw precision, above recall .1, less .1, over .9 (nuScenes)."""
    _check(recall, precision)
    if not len(recall):
        return 0.0
    samples = np.interp(np.linspace(0.0, 1.0, 101), recall, precision, right=0.0)[11:]
    return float(np.maximum(samples - 0.1, 0.0).mean()) / 0.9


def _sampled(recall: FloatArray, precision: FloatArray, at: FloatArray) -> FloatArray:
    """The envelope at the first detection that reaches a recall, 0 where none does."""
    _check(recall, precision)
    return np.append(envelope(precision), 0.0)[np.searchsorted(recall, at, side="left")]


def _check(recall: FloatArray, precision: FloatArray) -> None:
    if recall.ndim != 1 or recall.shape != precision.shape:
        raise SchemaError(
            f"recall is {recall.shape}, precision {precision.shape}; expected one number a detection each"
        )
    for name, values in (("recall", recall), ("precision", precision)):
        bad = ~((values >= 0.0) & (values <= 1.0))
        if bad.any():
            i = int(np.argmax(bad))
            raise SchemaError(f"{name}[{i}] is {values[i]}; expected 0..1 (percentages? undefined?)")
    falls = recall[1:] < recall[:-1]
    if falls.any():
        i = int(np.argmax(falls)) + 1
        raise SchemaError(
            f"recall[{i}] is {recall[i]} after {recall[i - 1]}; expected ascending (swapped with precision?)"
        )


RULES: Mapping[str, Callable[[FloatArray, FloatArray], float]] = {
    rule.__name__: rule for rule in (area, voc11, coco101, av2, kitti40, nuscenes)
}
"""Rule name -> (recall, precision) -> AP."""
