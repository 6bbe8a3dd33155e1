"""Object detection: boxes with scores against the boxes of things that are there, in 3D and, for cross-checks, in 2D.

Task
----
A method names, for every scene, boxes with a score and optionally a class. Truth is a set of boxes, with classes.
3D boxes are metric and in the episode frame; 2D boxes are pixels. IoU is that of ``geometry.boxes``, ``boxes2d``.

Conventions
-----------
One item a scene on both sides, in the same order; a scene without prediction (None) counts as an empty one: its
truths are missed. Detections are ordered by (-score, scene, index), stably. A truth that counts is one that is not
``difficult`` and no ``crowd``. A class without any truth that counts has no AP: it is left out of every mean and
named in ``labels_without_truth``; its detections cost nothing there. A value without denominator is None.
The recall of a ranking is hits over truths that count; precision is hits over detections that count.

Protocols
---------
| name | a hit needs | each detection goes to | seen again | limit | AP |
|---|---|---|---|---|---|
| ``hsbench`` | IoU >= t | its best truth | false | 64 a scene | area, at ends of equal-score blocks |
| ``voc`` | IoU > t | its best truth | false | none | area |
| ``sunrgbd`` | IoU >= t | its best truth | false | none | area |
| ``coco`` | IoU >= min(t, 1 - 1e-10) | its best truth not taken | may hit another | 100 a class and scene | 101 |
| ``omni3d`` | as coco | as coco | as coco | as coco | 101 |
| ``class-agnostic`` | IoU > t | 1-1, largest IoU first | false | none | none: precision, recall, F1 |

* ``hsbench`` (task object-detection-3d): a truth is hit once, by the highest score; a detection whose best truth is
  difficult does not count. Primary: ``ap``, class-agnostic AP at the first threshold (.25). Beside it AP .5, per
  class, AR, precision and F1 of all boxes kept, and recall by size and by the groups of the truths, with all boxes
  kept and at ``operating_score``.
  Among equally good truths, and among equal scores at the limit, the boxes' own numbers decide, never their order.
  IoU are equal, to a threshold or to each other, within 1e-9, so that rounding does not decide.
* ``voc``: VoteNet, mmdet3d, KITTI-360. ``ap`` is the mean over classes at the first threshold; AR is the recall with
  all detections, averaged over classes. VoteNet has no difficult truths; given some, the VOC kit's rule holds.
* ``sunrgbd``: the SUN RGB-D toolbox. A detection whose best truth is difficult does not count; first among equals.
* ``coco``: AP from 101 points; pycocotools' 12 numbers in ``summary``. Truths that count are preferred to ignored
  ones; unmatched detections outside an area range do not count in it. ``measure`` is the annotation's area, default
  w h. Last among equals.
* ``omni3d``: Omni3D's 13 numbers; ranges are of depth, both ends inside.
* ``class-agnostic``: SUN RGB-D ``eval_holisticScencePR``: precision and recall of every scene, then their mean (0 for
  a scene without prediction or without truth, as there); with labels, those of the pairs whose classes agree too.
  Pooled counts stand beside.

Differences from other scorers
------------------------------
* IoU. VoteNet's ``box3d_iou`` scores truth against itself right for 1412 of 5000 yawed boxes; ours for all. With
  oriented boxes our ``voc`` is therefore the protocol, not its faulty numbers; with axis-aligned boxes they agree.
* A class that is predicted but has no truth: VoteNet and mmdet3d divide by zero, and the mean of all classes is NaN;
  here it is left out: any other value than NaN is the same. COCO leaves it out too (-1); AV2 and nuScenes count 0.
* Ties. VoteNet sorts unstably, COCO and we stably; among n equal scores a favourable order can be worth up to the
  whole AP (one truth, one hit and one false box of equal score: 1 or .5). ``hsbench`` gives .5 in any order.
* Duplicates. COCO and Omni3D let a second detection of one truth hit a neighbour it overlaps: higher where truths
  are nested. Here, as in VOC, it is false.
* mmdet3d computes boxes and AP in float32: up to 1e-7 from ours. Omni3D's IoU is float32 and PyTorch3D's.
* pycocotools overwrites ``ignore`` of an annotation by ``iscrowd``; here a difficult truth is ignored under coco as
  Omni3D does it: higher than pycocotools, which counts it, where it is missed. Without difficult truths all 12
  numbers agree to 1e-12. What is -1 there is None here.
* ``class-agnostic``: the toolbox's callers skip scenes without truth layout; here every scene counts.
* Beyond the limit the lowest scores are left out and counted in ``over_limit``; others score an unlimited number. So
  one box more can push out a false one of its scene, and AP is then as if that had not been said. A duplicate raises
  AP only so, and only where it costs nothing itself: on a difficult truth, or in a mean over classes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics import detection_best, detection_coco, detection_pairs
from hsbench.metrics.detection_inputs import Predictions, Truths, gather
from hsbench.metrics.detection_protocols import PROTOCOLS, protocol_named, thresholds
from hsbench.metrics.detection_ranking import Curve, Ranking
from hsbench.metrics.detection_results import ClassScore, DetectionScore, PairScore, RecallRow
from hsbench.metrics.labels import check_integer
from hsbench.schema.occupancy import ObjectTruth
from hsbench.typing import IntArray

__all__ = [
    "PROTOCOLS",
    "PROTOCOL_VERSION",
    "ClassScore",
    "Curve",
    "DetectionScore",
    "PairScore",
    "Predictions",
    "Ranking",
    "RecallRow",
    "Truths",
    "score",
    "visibility_by_evidence",
]

PROTOCOL_VERSION = "0"
"""Raised when a rule above changes."""


def score(
    truths: Sequence[Truths],
    predictions: Sequence[Predictions | None],
    protocol: str = "hsbench",
    iou: float | Sequence[float] | None = None,
    *,
    limit: int | None = None,
    operating_score: float | None = None,
    form: str = "xywh",
) -> DetectionScore:
    """Score detections under a named protocol.

    truths, predictions: one item a scene, the same scenes in the same order; None = no prediction.
    iou: threshold or thresholds, default the protocol's. limit: boxes kept a scene, hsbench alone, default 64.
    operating_score: hsbench alone, the score from which recall is tabled too. form: how 2D boxes of 4 columns are
    meant, ``xywh`` or ``corners``.
    Raises SchemaError for an unknown protocol, scenes, boxes, labels or scores that do not fit, naming the item.
    """
    rules = protocol_named(protocol)
    steps = thresholds(rules, iou)
    for name, value in (("limit", limit), ("operating_score", operating_score)):
        if value is not None and protocol != "hsbench":
            raise SchemaError(f"{name} is {value}; only protocol hsbench takes one, not {protocol}")
    if limit is not None:
        check_integer(limit, "limit", 1)
    if operating_score is not None and not (isinstance(operating_score, Real) and math.isfinite(operating_score)):
        raise SchemaError(f"operating_score is {operating_score!r}; expected a finite number")
    inputs = gather(truths, predictions, form, "free" if protocol in ("hsbench", "class-agnostic") else "both")
    if inputs.crowd.any() and protocol != "coco":
        raise SchemaError(f"truths hold crowd regions; only protocol coco knows them, not {protocol}")
    if inputs.difficult.any() and protocol == "class-agnostic":
        raise SchemaError("truths are difficult; protocol class-agnostic knows none (leave them out on purpose?)")
    if rules.matching == "pairs":
        return detection_pairs.evaluate(inputs, rules, steps)
    if rules.matching == "untaken":
        return detection_coco.evaluate(inputs, rules, steps)
    return detection_best.evaluate(inputs, rules, steps, limit or rules.limit, operating_score)


def visibility_by_evidence(objects: ObjectTruth) -> IntArray:
    """(N, 2) ``Visibility`` and ``Evidence`` of each object: a group for ``Truths.groups``."""
    return np.stack([objects.visibility, objects.evidence], axis=1).astype(np.int64)
