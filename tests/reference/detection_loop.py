"""Detection under hsbench's protocol, set by set; slow and plain on purpose. By the author of the fast scorer.

No order, no cumulative sums: at every score the set of boxes at or above it is looked at afresh, in fractions.
"""

from __future__ import annotations

from fractions import Fraction


def best_truth(overlaps, threshold):
    """Index of the truth of highest IoU, None below the threshold. overlaps: IoU with each truth, without ties."""
    best = None
    for t, value in enumerate(overlaps):
        if value >= threshold and (best is None or value > overlaps[best]):
            best = t
    return best


def average_precision(scenes, threshold, most=64):
    """AP of all scenes, None without truth that counts.

    scenes: list of (iou rows per detection, scores, difficult flags); scores at the limit without ties.
    """
    claims = []
    truths = 0
    for s, (overlaps, scores, difficult) in enumerate(scenes):
        truths += sum(not flag for flag in difficult)
        for d in sorted(range(len(scores)), key=lambda d, scores=scores: -scores[d])[:most]:
            t = best_truth(overlaps[d], threshold)
            if t is None or not difficult[t]:
                claims.append((scores[d], None if t is None else (s, t)))
    if truths == 0:
        return None
    points = []
    for score in {score for score, _ in claims}:
        kept = [truth for other, truth in claims if other >= score]
        hits = len({truth for truth in kept if truth is not None})
        points.append((Fraction(hits, truths), Fraction(hits, len(kept))))
    area, before = Fraction(0), Fraction(0)
    for recall in sorted({recall for recall, _ in points}):
        area += (recall - before) * max(p for r, p in points if r >= recall)
        before = recall
    return float(area)
