"""Second reader: four tasks scored by plain loops, written from the text of the tasks alone.

Nothing here imports or was copied from the scorers it is compared with.  Counts are Python integers and ratios are
exact fractions until they are returned.  Rules shared by all functions, with the sentence each comes from:

* "Primary metrics pool sufficient statistics over the episodes of a split" (Common rules, Sum first): one table of
  true positives, false positives and false negatives a label, summed over all episodes, divided once.
* "A metric without a denominator is null and counted" (Common rules, Missing and undefined): None.  The text does not
  say what the mean does with a null; here it is the mean of the labels that are not null, None if all are.  A label
  absent from the truth but answered has a denominator, so it is 0 and stays in the mean.
* "A missing episode is scored as an empty prediction (all truth missed), or as all wrong where labels are exclusive"
  (the same): an absent answer says no label at all.  Every true label is a false negative, nothing is a false
  positive, and where `none` is a label of its own it is missed as well.
* "FP at ignored GT pixels never count" (protocols, Segmentation): an ignored place enters no table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.generic]
Scores = dict[str, float | None]
TopdownEpisode = tuple[Array, Array, Array | None]

AFFORDANCES = ("walkable", "sittable", "interactable")
EXCLUSIVE = ("none", "walkable", "sittable", "interactable")
ACTIONS = ("stand", "sit", "interact")
VOLUMES = {0: "none", 1: "walkable", 2: "sittable", 3: "interactable", 4: "wall"}
SCORED_VOLUMES = ("walkable", "sittable", "interactable", "wall")
VOID = 255


class Tables:
    """One 2x2 table a label, without its true negatives: no metric here uses them."""

    def __init__(self, labels: Sequence[str]) -> None:
        self.tp = dict.fromkeys(labels, 0)
        self.fp = dict.fromkeys(labels, 0)
        self.fn = dict.fromkeys(labels, 0)

    def add_binary(self, label: str, true: bool, said: bool) -> None:
        """Enter one place for one label of a multi-label task."""
        if true and said:
            self.tp[label] += 1
        elif said:
            self.fp[label] += 1
        elif true:
            self.fn[label] += 1

    def add_exclusive(self, true: str, said: str | None) -> None:
        """Enter one place that has one label; `said` None says nothing, which is wrong and accuses no label."""
        for label in self.tp:
            self.add_binary(label, true == label, said == label)

    def iou(self, label: str) -> Fraction | None:
        """TP / (row + column - TP) (protocols, Segmentation)."""
        return ratio(self.tp[label], self.tp[label] + self.fp[label] + self.fn[label])

    def precision(self, label: str) -> Fraction | None:
        """TP / (TP + FP), "undefined if no positive predictions" (protocols, Scene completion)."""
        return ratio(self.tp[label], self.tp[label] + self.fp[label])

    def recall(self, label: str) -> Fraction | None:
        """TP / (TP + FN), "undefined if no GT positives" (protocols, Scene completion)."""
        return ratio(self.tp[label], self.tp[label] + self.fn[label])

    def f1(self, label: str) -> Fraction | None:
        """2 TP / (2 TP + FP + FN): 0, not null, for a label that is true but never said, or said but never true."""
        return ratio(2 * self.tp[label], 2 * self.tp[label] + self.fp[label] + self.fn[label])


def ratio(numerator: int, denominator: int) -> Fraction | None:
    """Quotient, or None where there is no denominator."""
    return Fraction(numerator, denominator) if denominator > 0 else None


def mean_of_defined(values: Sequence[Fraction | None]) -> Fraction | None:
    """Mean of the values that are not null, None if all are."""
    total = Fraction(0)
    defined = 0
    for value in values:
        if value is not None:
            total += value
            defined += 1
    return total / defined if defined else None


def as_float(value: Fraction | None) -> float | None:
    """Fraction rounded once, null kept."""
    return None if value is None else float(value)


def exclusive_label(walkable: bool, sittable: bool, interactable: bool) -> str:
    """`exclusive` labels (sittable > interactable > walkable > none) of task affordance-topdown."""
    if sittable:
        return "sittable"
    if interactable:
        return "interactable"
    if walkable:
        return "walkable"
    return "none"


def at_half(probability: object) -> bool:
    """Task affordance-topdown, "at .5", and "three probability or binary maps": .5 itself says yes, and so does 1."""
    return float(probability) >= 0.5  # type: ignore[arg-type]


def require_shape(what: str, array: Array, shape: tuple[int, ...]) -> None:
    """An answer on another grid is an error, never resized."""
    if array.shape != shape:
        raise ValueError(f"{what} has shape {array.shape}, expected {shape}")


def add_topdown(episode: TopdownEpisode, affordances: Tables, exclusive: Tables | None) -> None:
    """Enter all scored columns of one episode into the multi-label and, where given, the exclusive tables."""
    truth, ignored, answer = episode
    _, rows, columns = truth.shape
    require_shape("truth", truth, (3, rows, columns))
    require_shape("ignored", ignored, (rows, columns))
    if answer is not None:
        require_shape("answer", answer, (3, rows, columns))
    for i in range(rows):
        for j in range(columns):
            if ignored[i, j]:
                continue
            true = [bool(truth[k, i, j]) for k in range(3)]
            said = [answer is not None and at_half(answer[k, i, j]) for k in range(3)]
            for k in range(3):
                affordances.add_binary(AFFORDANCES[k], true[k], said[k])
            if exclusive is not None:
                exclusive.add_exclusive(exclusive_label(*true), None if answer is None else exclusive_label(*said))


def topdown(episodes: Sequence[TopdownEpisode]) -> Scores:
    """Task affordance-topdown at scale `metric`: "mean of the three IoUs at .5, pooled", per class and `exclusive`.

    Each episode is truth (3, n, n) bool in the order walkable, sittable, interactable, ignored (n, n) bool and answer
    (3, n, n) probabilities, or None.  "Truth is multi-label per column", so each affordance has its own table over the
    columns that are "scored: all cells but those of other rooms without line of sight" (here: not ignored).  The
    exclusive rule is applied to truth and, after the threshold, to the answer.

    Left open by the text and chosen here: exactly .5 is yes (a NaN is no); one ignored map
    serves all labels; in the exclusive form a missing episode misses its `none` columns too ("all wrong where labels
    are exclusive"), where an empty multi-label answer would have been right about them.
    """
    affordances = Tables(AFFORDANCES)
    exclusive = Tables(EXCLUSIVE)
    for episode in episodes:
        add_topdown(episode, affordances, exclusive)
    ious = {label: affordances.iou(label) for label in AFFORDANCES}
    scores = {label: as_float(iou) for label, iou in ious.items()}
    scores["mean_iou"] = as_float(mean_of_defined(list(ious.values())))
    for label in EXCLUSIVE:
        scores[f"exclusive/{label}"] = as_float(exclusive.iou(label))
    return scores


def scale_factors() -> list[float]:
    """Task affordance-topdown, "41 log steps in .5-2": both ends included, so step 20 is exactly 1."""
    return [2.0 ** ((step - 20) / 20) for step in range(41)]


def rescaled(answer: Array, factor: float) -> Array:
    """Answer (3, n, n) stretched by `factor` about the centre of the grid, nearest cell, 0 from outside the answer."""
    _, rows, columns = answer.shape
    scaled = np.zeros((3, rows, columns), dtype=np.float64)
    for i in range(rows):
        source_i = source_cell(i, rows, factor)
        if source_i is None:
            continue
        for j in range(columns):
            source_j = source_cell(j, columns, factor)
            if source_j is None:
                continue
            for k in range(3):
                scaled[k, i, j] = answer[k, source_i, source_j]
    return scaled


def source_cell(cell: int, cells: int, factor: float) -> int | None:
    """Cell of the unscaled map that holds centre / factor, in cell units from the camera; None outside the map."""
    centre_from_camera = cell + 0.5 - cells / 2
    source = math.floor(centre_from_camera / factor + cells / 2)
    return source if 0 <= source < cells else None


def best_rescaled(episode: TopdownEpisode) -> TopdownEpisode:
    """The episode with its answer at the factor of the highest mean of its own three IoUs."""
    truth, ignored, answer = episode
    if answer is None:
        return episode
    best_mean: Fraction | None = None
    best_answer = answer
    steps_nearest_one_first = sorted(range(41), key=lambda step: (abs(step - 20), step))
    for step in steps_nearest_one_first:
        candidate = rescaled(answer, scale_factors()[step])
        tables = Tables(AFFORDANCES)
        add_topdown((truth, ignored, candidate), tables, None)
        mean = mean_of_defined([tables.iou(label) for label in AFFORDANCES])
        if mean is not None and (best_mean is None or mean > best_mean):
            best_mean = mean
            best_answer = candidate
    return truth, ignored, best_answer


def topdown_scale_free(episodes: Sequence[TopdownEpisode]) -> Scores:
    """Task affordance-topdown, `scale-free`: "one factor an episode about the camera, best of 41 log steps in .5-2,
    chosen by the scorer for the mean of the three IoUs"; then pooled and reported as `topdown` does.

    The text leaves these open; the choices here are:

    * the steps are 2 ** ((s - 20) / 20), s = 0..40: both ends and 1 are among them, so an answer at factor 1 is tried
      (which makes the chosen mean of an episode never worse than its metric one, though the pooled mean may be);
    * the camera is the corner shared by the middle cells ("cells centred on the camera"), n / 2 from the edge;
    * a factor above 1 makes the answer larger; the answer moves, truth and ignored map stay where they are;
    * nearest cell: the centre of a cell of the scaled map, divided by the factor, is looked up; a cell holds its lower
      edge and not its upper one (at factor .5 and even n every centre falls on an edge); outside the answer is 0;
    * probabilities are resampled and then compared with .5, which for nearest cells is the same as the reverse;
    * the mean is that of the episode alone, over its IoUs that are not null (a label may be null at one factor and 0
      at another); a factor at which all three are null is never chosen over one with a number, and 1 stays if there
      is none;
    * means are compared exactly; among equal ones the factor nearest 1 in log wins, then the smaller;
    * the exclusive form uses the factor chosen for the three IoUs, and has no choice of its own;
    * a missing episode has no factor and is scored as in `topdown`.
    """
    return topdown([best_rescaled(episode) for episode in episodes])


def view(episodes: Sequence[tuple[Array, Array | None]]) -> Scores:
    """Task affordance-view: "mean of three IoUs, pooled", on one picture an episode, "at image size".

    Each episode is truth bits (h, w) uint8 (bit 0 walkable, 1 sittable, 2 interactable; 255 void) and answer (3, h, w)
    probabilities, or None.  "Outside the window is void", and pixels of parts that move "are ignored": both come as
    255, which no label counts.  Left open by the text and chosen here: the threshold is the .5 of task
    affordance-topdown, exactly .5 being yes; any other bit set is an error.
    """
    tables = Tables(AFFORDANCES)
    for truth_bits, answer in episodes:
        rows, columns = truth_bits.shape
        if answer is not None:
            require_shape("answer", answer, (3, rows, columns))
        for i in range(rows):
            for j in range(columns):
                bits = int(truth_bits[i, j])
                if bits == VOID:
                    continue
                if bits > 7:
                    raise ValueError(f"truth bits {bits} at pixel {(i, j)}, expected 0..7 or {VOID}")
                for k in range(3):
                    said = answer is not None and at_half(answer[k, i, j])
                    tables.add_binary(AFFORDANCES[k], bool(bits >> k & 1), said)
    ious = {label: tables.iou(label) for label in AFFORDANCES}
    scores = {label: as_float(iou) for label, iou in ious.items()}
    scores["mean_iou"] = as_float(mean_of_defined(list(ious.values())))
    return scores


def action(episodes: Sequence[tuple[Array, Array | None]]) -> Scores:
    """Task action-recognition: "one label per observed pose", "Primary: macro F1. Beside: accuracy, ... per-class".

    Each episode is true (P,) labels, '' where ignored ("lying and transitions are ignored; false positives of the
    detector are ignored"), and said (P,) labels, or None.  "Misses are not scored": a person without an observed pose
    has no entry.  Counts are pooled over all poses of all episodes, so a long episode weighs more.

    Left open by the text and chosen here: a missing episode is "all wrong": each pose is a false negative of its label
    and wrong for accuracy, but a false positive of no label; a said '' at a scored pose is the same; macro F1 is the
    mean of the F1 of pooled counts (not F1 of mean precision and recall) over the labels with a denominator; precision
    is null for a label never said, while its F1 is 0 if it is ever true.
    """
    tables = Tables(ACTIONS)
    scored = 0
    correct = 0
    for true_labels, said_labels in episodes:
        if said_labels is not None:
            require_shape("said", said_labels, true_labels.shape)
        for pose in range(len(true_labels)):
            true = str(true_labels[pose])
            said = None if said_labels is None else str(said_labels[pose])
            for label in (true, said):
                if label not in (*ACTIONS, "", None):
                    raise ValueError(f"label {label!r} at pose {pose}, expected one of {ACTIONS} or ''")
            if true == "":
                continue
            scored += 1
            correct += true == said
            tables.add_exclusive(true, said)
    scores: Scores = {
        "macro_f1": as_float(mean_of_defined([tables.f1(label) for label in ACTIONS])),
        "accuracy": as_float(ratio(correct, scored)),
    }
    for label in ACTIONS:
        scores[f"f1/{label}"] = as_float(tables.f1(label))
        scores[f"precision/{label}"] = as_float(tables.precision(label))
        scores[f"recall/{label}"] = as_float(tables.recall(label))
    return scores


def reconstruction(episodes: Sequence[tuple[Array, Array, Array | None]]) -> Scores:
    """Task scene-reconstruction-360: "mean IoU of the four labels against affordance volumes", scale `metric`.

    Each episode is truth (n, n, m) labels (0 none, 1 walkable, 2 sittable, 3 interactable, 4 wall), ignored (n, n)
    columns and answer labels of the shape of the truth, or None.  "Label per voxel": one label a voxel, so a voxel
    that says another label than the true one is a false positive of the first and a false negative of the second.
    `none` has no IoU of its own.

    Left open by the text and chosen here: the scored columns are those of task affordance-topdown, at all heights; the
    IoUs are pooled ("Sum first"); of a missing episode "empty" and "all wrong" are the same for the four labels; a
    number that is no label is an error.
    """
    tables = Tables(SCORED_VOLUMES)
    for truth, ignored, answer in episodes:
        rows, columns, levels = truth.shape
        require_shape("ignored", ignored, (rows, columns))
        if answer is not None:
            require_shape("answer", answer, truth.shape)
        for i in range(rows):
            for j in range(columns):
                if ignored[i, j]:
                    continue
                for k in range(levels):
                    said = None if answer is None else volume_label(answer[i, j, k])
                    tables.add_exclusive(volume_label(truth[i, j, k]), said)
    ious = {label: tables.iou(label) for label in SCORED_VOLUMES}
    scores = {f"iou/{label}": as_float(iou) for label, iou in ious.items()}
    scores["mean_iou"] = as_float(mean_of_defined(list(ious.values())))
    return scores


def volume_label(number: object) -> str:
    """Name of a voxel's label number."""
    label = int(number)  # type: ignore[call-overload]
    if label not in VOLUMES:
        raise ValueError(f"voxel label {label}, expected one of {sorted(VOLUMES)}")
    return VOLUMES[label]
