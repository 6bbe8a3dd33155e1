"""Task action-recognition scored slowly, in plain loops, from the text alone. Nothing of the package is used.

Rules, as the text gives them: one label an observed pose, 1 stand, 2 sit, 3 interact; poses whose truth is 0 (lying,
transitions, false detections) count nowhere; an answer 0 is none, and wrong. Macro F1 is the mean F1 of the labels that
are true or said somewhere. Segments are runs of one label among the poses of a track, cut where truth is 0; each said
one takes the true one of its label with the largest overlap (intersection over union of steps), the earliest of equals,
and is right if that reaches the threshold and nobody took it before. Everything is added over episodes first.
"""

from __future__ import annotations

from fractions import Fraction

Episode = tuple[list[int], list[int], list[int]]
"""(true labels, said labels, tracks) of the observed poses."""

NAMES = {1: "stand", 2: "sit", 3: "interact"}


def share(part: int, whole: int) -> Fraction | None:
    return Fraction(part, whole) if whole else None


def poses(episodes: list[Episode]) -> dict[str, Fraction | None]:
    pairs = [(t, s) for truth, said, _ in episodes for t, s in zip(truth, said, strict=True) if t != 0]
    found: dict[str, Fraction | None] = {"accuracy": share(sum(t == s for t, s in pairs), len(pairs))}
    each = []
    for label, name in NAMES.items():
        true, answered = sum(t == label for t, _ in pairs), sum(s == label for _, s in pairs)
        hits = sum(t == s == label for t, s in pairs)
        found[f"{name}/precision"] = share(hits, answered)
        found[f"{name}/recall"] = share(hits, true)
        found[f"{name}/f1"] = share(2 * hits, true + answered)
        for other, what in {**NAMES, 0: "no-answer"}.items():
            found[f"confusion/{name}/{what}"] = share(sum((t, s) == (label, other) for t, s in pairs), true)
        if true + answered:
            each.append(Fraction(2 * hits, true + answered))
    found["macro-f1"] = sum(each, Fraction(0)) / len(each) if each else None
    return found


def runs(labels: list[int], kept: list[bool]) -> list[tuple[int, set[int]]]:
    """(label, steps) of every run of a label other than 0 among the kept steps."""
    out: list[tuple[int, set[int]]] = []
    open_run = False
    for step, label in enumerate(labels):
        if not kept[step] or label == 0:
            open_run = False
        elif open_run and out[-1][0] == label:
            out[-1][1].add(step)
        else:
            out.append((label, {step}))
            open_run = True
    return out


def segment_f1(episodes: list[Episode], overlap: Fraction) -> Fraction | None:
    hits = total = 0
    for truth, said, tracks in episodes:
        for track in set(tracks):
            steps = [i for i, t in enumerate(tracks) if t == track]
            true_labels, said_labels = [truth[i] for i in steps], [said[i] for i in steps]
            kept = [t != 0 for t in true_labels]
            true, predicted = runs(true_labels, kept), runs(said_labels, kept)
            total += len(true) + len(predicted)
            taken = set()
            for label, where in predicted:
                ious = [Fraction(len(where & w), len(where | w)) if name == label else Fraction(0) for name, w in true]
                if not ious or max(ious) == 0:
                    continue
                best = ious.index(max(ious))
                if ious[best] >= overlap and best not in taken:
                    taken.add(best)
                    hits += 1
    return share(2 * hits, total)
