"""What a detection score is made of; the rules behind the numbers are in ``detection``. None = undefined."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from hsbench.metrics.detection_ranking import Ranking


@dataclass(frozen=True)
class ClassScore:
    """One class at one IoU threshold; label None = all classes as one. The curve is ``ranking.curve()``."""

    label: int | None
    iou: float
    ap: float | None
    ranking: Ranking = field(repr=False, compare=False)

    @property
    def recall(self) -> float | None:
        """Hits over truths that count, with all detections kept."""
        return self.ranking.recall

    @property
    def precision(self) -> float | None:
        """Hits over detections that count, None without any."""
        return self.ranking.precision

    @property
    def f1(self) -> float | None:
        """Twice the hits over truths and detections that count, None without any."""
        both = self.truths + self.hits + self.false
        return 2 * self.hits / both if both else None

    @property
    def truths(self) -> int:
        """Truths that count."""
        return self.ranking.truths

    @property
    def hits(self) -> int:
        """Truths that are hit."""
        return self.ranking.hits

    @property
    def false(self) -> int:
        """Detections that hit nothing."""
        return self.ranking.false

    @property
    def neither(self) -> int:
        """Detections that do not count."""
        return self.ranking.neither


@dataclass(frozen=True)
class RecallRow:
    """Recall of the truths of one group and key, all classes as one, at one IoU threshold.

    hits: with all boxes kept; hits_at_score: with those from the operating score on, None where none was given.
    """

    group: str
    key: tuple[int, ...]
    iou: float
    truths: int
    hits: int
    hits_at_score: int | None

    @property
    def recall(self) -> float | None:
        """Hits over truths with all boxes kept."""
        return self.hits / self.truths if self.truths else None

    @property
    def recall_at_score(self) -> float | None:
        """Hits over truths from the operating score on."""
        return self.hits_at_score / self.truths if self.truths and self.hits_at_score is not None else None


@dataclass(frozen=True)
class PairScore:
    """Boxes paired 1-1 at one IoU threshold: the mean over scenes of each ratio, and pooled counts.

    label_precision, label_recall: of pairs whose classes agree, None without classes. A mean is None without scenes.
    """

    iou: float
    precision: float | None
    recall: float | None
    label_precision: float | None
    label_recall: float | None
    pairs: int
    label_pairs: int | None
    detections: int
    truths: int

    @property
    def f1(self) -> float | None:
        """Harmonic mean of precision and recall, 0 where both are 0."""
        if self.precision is None or self.recall is None:
            return None
        both = self.precision + self.recall
        return 2 * self.precision * self.recall / both if both else 0.0

    @property
    def pooled_precision(self) -> float | None:
        """Pairs over detections of all scenes."""
        return self.pairs / self.detections if self.detections else None

    @property
    def pooled_recall(self) -> float | None:
        """Pairs over truths of all scenes."""
        return self.pairs / self.truths if self.truths else None

    @property
    def pooled_f1(self) -> float | None:
        """Twice the pairs over all boxes of both sides."""
        both = self.detections + self.truths
        return 2 * self.pairs / both if both else None


@dataclass(frozen=True)
class DetectionScore:
    """What ``score`` returns; None = undefined.

    ap: the protocol's headline: hsbench class-agnostic AP at the first threshold; voc and sunrgbd mean AP over classes
    at the first threshold; coco and omni3d mean over classes and thresholds; class-agnostic None.
    ar: recall likewise. summary: the protocol's numbers by name. per_class: by label, then threshold; without labels
    empty. overall: the class-agnostic ones, hsbench and calls without labels. recall: tables, hsbench alone.
    pairs: protocol class-agnostic alone. truths: those that count; ignored: difficult or crowd.
    """

    protocol: str
    verified: bool
    iou: tuple[float, ...]
    ap: float | None
    ar: float | None
    summary: Mapping[str, float | None]
    per_class: tuple[ClassScore, ...]
    overall: tuple[ClassScore, ...]
    recall: tuple[RecallRow, ...]
    pairs: tuple[PairScore, ...]
    labels_without_truth: tuple[int, ...]
    scenes: int
    scenes_without_prediction: int
    truths: int
    ignored: int
    detections: int
    over_limit: int


def mean(values: Iterable[float | None]) -> float | None:
    """Mean of the defined values, None if there is none."""
    defined = [v for v in values if v is not None]
    return sum(defined) / len(defined) if defined else None
