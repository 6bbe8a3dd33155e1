"""What detection is scored from: truths and predictions of one scene, and all scenes laid end to end.

Boxes are rows of one kind throughout a call: 4 columns, x y w h or corners in pixels; 6, centre and size of an
axis-aligned box in metres; 7, centre, size, yaw about +z; 15, centre, size, row-major rotation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry import boxes as boxes3d
from hsbench.geometry import boxes2d
from hsbench.typing import AnyArray, BoolArray, FloatArray, IntArray

COLUMNS = {4: "x, y, w, h", 6: "centre, size", 7: "centre, size, yaw", 15: "centre, size, row-major rotation"}

SIZE_GROUP = "size"
"""Group by which recall is always tabled; its keys are computed from the boxes."""

MAX_LABEL = 2**63 - 1
"""Labels are int64 inside."""


@dataclass(frozen=True, eq=False)
class Truths:
    """What is in one scene.

    boxes: (N, 4 | 6 | 7 | 15). labels: (N,) integers, None = no classes. difficult: (N,) bool, neither hit nor miss.
    crowd: (N,) bool, protocol coco alone: a region of many objects, hit any number of times, neither hit nor miss.
    measure: (N,) what the protocol's ranges are made from: area in pixels^2 (coco; default w h), depth in metres
    (omni3d; None leaves its ranges undefined). groups: name -> (N,) or (N, k) integers by which recall is tabled.
    """

    boxes: AnyArray
    labels: AnyArray | None = None
    difficult: BoolArray | None = None
    crowd: BoolArray | None = None
    measure: AnyArray | None = None
    groups: Mapping[str, AnyArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = _check_boxes(self.boxes, "truths.boxes")
        _check_labels(self.labels, "truths.labels", n)
        for name in ("difficult", "crowd"):
            flags = getattr(self, name)
            if flags is not None and (not isinstance(flags, np.ndarray) or flags.shape != (n,) or flags.dtype != bool):
                raise SchemaError(f"truths.{name} is {_found(flags)}; expected bool ({n},): one a box")
        _check_numbers(self.measure, "truths.measure", n)
        if SIZE_GROUP in self.groups:
            raise SchemaError(f"truths.groups holds {SIZE_GROUP!r}, computed from the boxes; expected another name")
        for name, keys in self.groups.items():
            if not isinstance(keys, np.ndarray) or keys.dtype.kind not in "bui" or keys.ndim not in (1, 2):
                raise SchemaError(f"truths.groups[{name!r}] is {_found(keys)}; expected integers (N,) or (N, k)")
            if len(keys) != n:
                raise SchemaError(f"truths.groups[{name!r}] has {len(keys)} rows for {n} boxes")


@dataclass(frozen=True, eq=False)
class Predictions:
    """What a method says is in one scene.

    boxes: (N, 4 | 6 | 7 | 15) as the truths. scores: (N,) finite, larger = surer; need not be probabilities.
    labels: (N,) integers, None = no classes. measure: (N,) area or depth as in ``Truths``.
    """

    boxes: AnyArray
    scores: AnyArray
    labels: AnyArray | None = None
    measure: AnyArray | None = None

    def __post_init__(self) -> None:
        n = _check_boxes(self.boxes, "predictions.boxes")
        if self.scores is None:
            raise SchemaError("predictions.scores is missing; expected one number a box (equal ones for no order)")
        _check_numbers(self.scores, "predictions.scores", n)
        _check_labels(self.labels, "predictions.labels", n)
        _check_numbers(self.measure, "predictions.measure", n)


@dataclass(frozen=True, eq=False)
class Rows:
    """Boxes of all scenes end to end: boxes (n, c), labels (n,), scene (n,), start (S + 1,) first row of each scene."""

    boxes: FloatArray
    labels: IntArray
    scene: IntArray
    start: IntArray
    measure: FloatArray | None

    def __len__(self) -> int:
        return len(self.boxes)


@dataclass(frozen=True, eq=False)
class Inputs:
    """Both sides of a call: truths and detections, flags and scores, and the IoU of every pair in a scene.

    The IoU of detection d and truth t of one scene is iou[row[d] + column[t]].
    """

    scenes: int
    labelled: bool
    truths: Rows
    difficult: BoolArray
    crowd: BoolArray
    groups: Mapping[str, IntArray]
    detections: Rows
    scores: FloatArray
    without_prediction: int
    iou: FloatArray
    row: IntArray
    column: IntArray


def gather(
    truths: Sequence[Truths], predictions: Sequence[Predictions | None], form: str = "xywh", classes: str = "both"
) -> Inputs:
    """Lay all scenes end to end and compute their IoU.

    form: how 4 columns are meant (``boxes2d.FORMS``). classes: ``both`` (labels on both sides or on none), ``free``
    (labels of one side alone are dropped). Raises SchemaError naming the scene.
    """
    boxes2d.check_form(form)
    _check_scenes(truths, predictions)
    columns = _columns(truths, predictions)
    given = [_empty(columns, t) if p is None else p for p, t in zip(predictions, truths, strict=True)]
    truth_labels = _labels([t.labels for t in truths], [len(t.boxes) for t in truths], "truths")
    labels = _labels([p.labels for p in given], [len(p.boxes) for p in given], "predictions")
    truth_count, count = sum(len(t.boxes) for t in truths), sum(len(p.boxes) for p in given)
    if truth_count and count and (truth_labels is None) != (labels is None) and classes != "free":
        one, other = ("predictions", "truths") if labels is None else ("truths", "predictions")
        raise SchemaError(f"{one} have no labels while {other} do; give both, or neither for a class-agnostic score")
    labelled = all(side is not None or not n for side, n in ((truth_labels, truth_count), (labels, count)))
    labelled = labelled and (truth_labels is not None or labels is not None)
    truth_rows = _rows(
        [t.boxes for t in truths], truth_labels if labelled else None, [t.measure for t in truths], columns, "truths"
    )
    rows = _rows(
        [p.boxes for p in given], labels if labelled else None, [p.measure for p in given], columns, "predictions"
    )
    if columns == 4:
        truth_rows, rows = _in_pixels(truth_rows, form, "truths"), _in_pixels(rows, form, "predictions")
    crowd = _flags([t.crowd for t in truths], truth_rows)
    iou, row, column = _overlaps(truth_rows, rows, crowd)
    return Inputs(
        len(truths),
        labelled,
        truth_rows,
        _flags([t.difficult for t in truths], truth_rows),
        crowd,
        _groups(truths),
        rows,
        np.concatenate([np.zeros(0), *(p.scores for p in given)]).astype(np.float64),
        sum(p is None for p in predictions),
        iou,
        row,
        column,
    )


def _overlaps(truths: Rows, rows: Rows, crowd: BoolArray) -> tuple[FloatArray, IntArray, IntArray]:
    """(pairs,) IoU of every pair in a scene; where a detection's row begins; where a truth stands in a row."""
    per_scene = np.diff(truths.start)
    block = np.concatenate([[0], np.cumsum(per_scene * np.diff(rows.start))])
    row = block[rows.scene] + (np.arange(len(rows)) - rows.start[rows.scene]) * per_scene[rows.scene]
    column = np.arange(len(truths)) - truths.start[truths.scene]
    iou = np.zeros(int(block[-1]))
    columns = rows.boxes.shape[1]
    if columns == 4:
        boxes2d.fill_blocks(rows.boxes, truths.boxes, crowd, rows.start, truths.start, block[:-1], iou)
        return iou, row, column
    function = {6: boxes3d.iou_aligned, 7: boxes3d.iou_upright, 15: boxes3d.iou_oriented}[columns]
    for s in np.flatnonzero(np.diff(block)):
        here, there = slice(*rows.start[s : s + 2]), slice(*truths.start[s : s + 2])
        iou[block[s] : block[s + 1]] = function(rows.boxes[here], truths.boxes[there]).reshape(-1)
    return iou, row, column


def _rows(
    boxes: list[AnyArray], labels: IntArray | None, measure: list[AnyArray | None], columns: int, side: str
) -> Rows:
    counts = np.array([len(b) for b in boxes], dtype=np.int64)
    start = np.concatenate([[0], np.cumsum(counts)])
    flat = np.concatenate([np.zeros((0, columns)), *boxes]).astype(np.float64)
    scene = np.repeat(np.arange(len(boxes)), counts)
    known = [m for m, n in zip(measure, counts, strict=True) if n]
    some = [m for m in known if m is not None]
    if some and len(some) < len(known):
        raise SchemaError(
            f"{side}.measure is given for {len(some)} of {len(known)} scenes with boxes; give all or none"
        )
    return Rows(
        flat,
        np.zeros(len(flat), dtype=np.int64) if labels is None else labels,
        scene,
        start,
        np.concatenate([np.zeros(0), *some]).astype(np.float64) if some else None,
    )


def _in_pixels(rows: Rows, form: str, side: str) -> Rows:
    try:
        boxes = boxes2d.as_xywh(rows.boxes, form)
    except SchemaError as error:
        for s in range(len(rows.start) - 1):  # the scene's own error says which box of it is wrong
            try:
                boxes2d.as_xywh(rows.boxes[rows.start[s] : rows.start[s + 1]], form)
            except SchemaError as own:
                raise SchemaError(f"{side} of scene {s}: {own}") from None
        raise error
    measure = boxes[:, 2] * boxes[:, 3] if rows.measure is None else rows.measure
    return Rows(boxes, rows.labels, rows.scene, rows.start, measure)


def _labels(labels: list[AnyArray | None], counts: list[int], side: str) -> IntArray | None:
    """(n,) int64 of all scenes, None if none has labels; a scene without boxes need not have any."""
    some = [x for x, n in zip(labels, counts, strict=True) if n and x is not None]
    if not some:
        return None
    if len(some) < sum(n > 0 for n in counts):
        s = next(s for s, (x, n) in enumerate(zip(labels, counts, strict=True)) if n and x is None)
        raise SchemaError(f"{side} of scene {s} have no labels while others do; give labels for all scenes or for none")
    return np.concatenate(some).astype(np.int64)


def _flags(flags: list[BoolArray | None], rows: Rows) -> BoolArray:
    out = np.zeros(len(rows), dtype=np.bool_)
    for s, scene_flags in enumerate(flags):
        if scene_flags is not None:
            out[rows.start[s] : rows.start[s + 1]] = scene_flags
    return out


def _groups(truths: Sequence[Truths]) -> dict[str, IntArray]:
    """Name -> (n, k) int64 of all scenes; every scene with boxes must have every group."""
    names = sorted({name for t in truths for name in t.groups})
    out = {}
    for name in names:
        for s, t in enumerate(truths):
            if len(t.boxes) and name not in t.groups:
                raise SchemaError(f"truths of scene {s} lack group {name!r}, which others have")
        keys = [np.asarray(t.groups[name], dtype=np.int64).reshape(len(t.boxes), -1) for t in truths if len(t.boxes)]
        if len({k.shape[1] for k in keys}) > 1:
            raise SchemaError(f"truths.groups[{name!r}] has a different number of columns in different scenes")
        if keys:
            out[name] = np.concatenate(keys)
    return out


def _check_scenes(truths: Sequence[Truths], predictions: Sequence[Predictions | None]) -> None:
    for name, items in (("truths", truths), ("predictions", predictions)):
        if not isinstance(items, Sequence):
            hint = " (wrap a single scene: [scene])" if isinstance(items, Truths | Predictions) else ""
            raise SchemaError(f"{name} is a {type(items).__name__}; expected a list with one item a scene{hint}")
    if len(truths) != len(predictions):
        raise SchemaError(
            f"there are {len(truths)} scenes of truth and {len(predictions)} of predictions; expected the same scenes"
            " in the same order (a scene without prediction is None and counts as an empty one)"
        )
    for s, (t, p) in enumerate(zip(truths, predictions, strict=True)):
        if not isinstance(t, Truths):
            raise SchemaError(f"truths of scene {s} are a {type(t).__name__}; expected detection.Truths")
        if p is not None and not isinstance(p, Predictions):
            raise SchemaError(
                f"predictions of scene {s} are a {type(p).__name__}; expected detection.Predictions"
                + (" (truths and predictions swapped?)" if isinstance(p, Truths) else "")
            )


def _columns(truths: Sequence[Truths], predictions: Sequence[Predictions | None]) -> int:
    columns: int | None = None
    for side, items in (("truths", truths), ("predictions", predictions)):
        for s, item in enumerate(items):
            if item is None:
                continue
            here = item.boxes.shape[1]
            if columns is not None and here != columns:
                raise SchemaError(
                    f"boxes of {side} of scene {s} have {here} columns ({COLUMNS[here]}) where others have {columns}"
                    f" ({COLUMNS[columns]}); all boxes of a call are of one kind"
                )
            columns = here
    return 7 if columns is None else columns


def _empty(columns: int, truths: Truths) -> Predictions:
    return Predictions(np.zeros((0, columns)), np.zeros(0), None if truths.labels is None else np.zeros(0, np.int64))


def _check_boxes(boxes: AnyArray, name: str) -> int:
    if not isinstance(boxes, np.ndarray) or boxes.dtype.kind not in "fui":
        raise SchemaError(f"{name} is {_found(boxes)}; expected numbers (N, 4 | 6 | 7 | 15)")
    if boxes.ndim != 2 or boxes.shape[1] not in COLUMNS:
        if boxes.shape == (0,):
            hint = " (no boxes? say np.zeros((0, 7)))"
        elif boxes.shape in [(c,) for c in COLUMNS]:
            hint = " (one box? say boxes[None])"
        elif boxes.ndim == 3 and boxes.shape[1:] == (8, 3):
            hint = " (corners? boxes are centre, size, yaw)"
        else:
            hint = ""
        raise SchemaError(f"{name} has shape {boxes.shape}; expected (N, 4 | 6 | 7 | 15){hint}")
    bad = ~np.isfinite(boxes).all(axis=1)
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        raise SchemaError(f"{name}[{i}] is {boxes[i].tolist()}; expected finite numbers")
    if boxes.shape[1] > 4:
        boxes3d.checked(boxes, None, name)
    return len(boxes)


def _check_labels(labels: AnyArray | None, name: str, n: int) -> None:
    if labels is None:
        return
    if not isinstance(labels, np.ndarray) or labels.shape != (n,) or (labels.dtype.kind not in "ui" and n):
        hint = (
            " (names? map them to category ids)" if isinstance(labels, np.ndarray) and labels.dtype.kind in "UO" else ""
        )
        raise SchemaError(f"{name} is {_found(labels)}; expected integers ({n},): one a box{hint}")
    if n and int(labels.min()) < 0:
        raise SchemaError(f"{name}[{int(labels.argmin())}] is {int(labels.min())}; expected >= 0 (an ignore label?)")
    if n and int(labels.max()) > MAX_LABEL:
        i = int(labels.argmax())
        raise SchemaError(f"{name}[{i}] is {int(labels[i])}; expected at most {MAX_LABEL} (-1, unsigned?)")


def _check_numbers(values: AnyArray | None, name: str, n: int) -> None:
    if values is None:
        return
    if not isinstance(values, np.ndarray) or values.shape != (n,) or values.dtype.kind not in "fui":
        hint = " (swapped with boxes?)" if isinstance(values, np.ndarray) and values.ndim == 2 else ""
        raise SchemaError(f"{name} is {_found(values)}; expected numbers ({n},): one a box{hint}")
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        i = int(np.flatnonzero(~np.isfinite(values))[0])
        raise SchemaError(f"{name}[{i}] is {values[i]}; expected a finite number")


def _found(value: object) -> str:
    return f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
