"""The detection task scored set by set in fractions: written from the text of task object-detection-3d alone, by
somebody who had not read the scorer of the package.

Boxes are axis-aligned and given by whole numbers, so every overlap is a fraction, an overlap equal to a threshold is
equal to it, and a tie is a tie. There is no running count: at every score the boxes from that score on are looked at
afresh. Where the text of the task leaves room, the choice is

1. of more boxes than the limit the highest scores of a scene are kept, all classes together;
2. "all-point area" is that under the envelope: the precision at a recall is the best at that recall or more;
3. whatever goes to a difficult truth is not counted, however many go there;
4. of one class are the truths and the kept detections of that class alone, and the protocol is run on them anew;
5. the operating score itself is on the side of the boxes that are taken;
6. without ordinary truths AP and recall are undefined, without counted detections precision is.

Of ties - equal scores at the limit, equal overlaps with several truths - the text says nothing. The first version let
as many truths be hit as any choice allows, and refused ties at the limit; elsewhere it agreed. What decides now was
taken from the docs page, after both were compared: the boxes' own numbers, and an ordinary truth before a difficult
one. The recall of truths by group was written then too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True)
class Box:
    low: tuple[int, int, int]
    high: tuple[int, int, int]
    label: int = 0

    @property
    def numbers(self) -> tuple[int, ...]:
        """Twice the centre, the size, the label."""
        ends = list(zip(self.low, self.high, strict=True))
        return *(a + b for a, b in ends), *(b - a for a, b in ends), self.label


@dataclass(frozen=True)
class Truth:
    box: Box
    difficult: bool = False


@dataclass(frozen=True)
class Detection:
    box: Box
    score: int


Scene = tuple[Sequence[Truth], Sequence[Detection]]


@dataclass(frozen=True)
class Counts:
    """Of one scene or of several: hits, detections that are false, ordinary truths."""

    hits: int
    false: int
    truths: int


def overlap(a: Box, b: Box) -> Fraction:
    """Volume of the intersection over that of the union."""
    shared = volume_a = volume_b = 1
    for axis in range(3):
        shared *= max(0, min(a.high[axis], b.high[axis]) - max(a.low[axis], b.low[axis]))
        volume_a *= a.high[axis] - a.low[axis]
        volume_b *= b.high[axis] - b.low[axis]
    return Fraction(shared, volume_a + volume_b - shared)


def best_truth(detection: Detection, truths: Sequence[Truth], threshold: Fraction) -> int | None:
    """Which truth the detection goes to; None if it goes to none."""
    best, highest = None, threshold
    for i in sorted(range(len(truths)), key=lambda i: (truths[i].difficult, truths[i].box.numbers)):
        value = overlap(detection.box, truths[i].box)
        if value > highest or (best is None and value == highest):
            best, highest = i, value
    return best


def kept(scene: Scene, limit: int) -> Scene:
    """The scene with its `limit` detections of highest score."""
    truths, detections = scene
    return truths, sorted(detections, key=lambda d: (-d.score, d.box.numbers))[:limit]


def of_label(scene: Scene, label: int) -> Scene:
    """The truths and detections of one label."""
    truths, detections = scene
    return [t for t in truths if t.box.label == label], [d for d in detections if d.box.label == label]


def hit_truths(scene: Scene, threshold: Fraction, lowest_score: int) -> set[int]:
    """The ordinary truths to which a detection of at least `lowest_score` goes."""
    truths, detections = scene
    wanted = {best_truth(d, truths, threshold) for d in detections if d.score >= lowest_score}
    return {i for i in wanted if i is not None and not truths[i].difficult}


def counts(scenes: Sequence[Scene], threshold: Fraction, lowest_score: int) -> Counts:
    """What becomes of the detections of at least `lowest_score`."""
    hits = counted = ordinary = 0
    for truths, detections in scenes:
        ordinary += sum(not truth.difficult for truth in truths)
        hits += len(hit_truths((truths, detections), threshold, lowest_score))
        for detection in detections:
            best = best_truth(detection, truths, threshold)
            counted += detection.score >= lowest_score and (best is None or not truths[best].difficult)
    return Counts(hits, counted - hits, ordinary)


def average_precision(scenes: Sequence[Scene], threshold: Fraction) -> Fraction | None:
    """Area under the envelope of precision over recall at the ends of blocks of equal score."""
    curve = []
    for score in {d.score for _, detections in scenes for d in detections}:
        at = counts(scenes, threshold, score)
        if at.truths and at.hits:
            curve.append((Fraction(at.hits, at.truths), Fraction(at.hits, at.hits + at.false)))
    area = before = Fraction(0)
    for recall in sorted({r for r, _ in curve}):
        area += (recall - before) * max(p for r, p in curve if r >= recall)
        before = recall
    return area if counts(scenes, threshold, 0).truths else None
