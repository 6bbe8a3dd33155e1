"""The foreign completion protocols voxel by voxel, written from the table of protocols alone; slow and plain.

Scenes are those of ``completion_inputs``: every protocol reads its own source's encoding of what the camera saw.
"""

from __future__ import annotations

EMPTY, UNLABELLED, NO_PIXEL = 0, 255, 640 * 480


def scored_voxels(protocol, scene, *, semantic):
    """(truth, prediction) of every voxel that counts."""
    for here, label in zip(range(scene["label"].size), scene["label"].ravel().tolist(), strict=True):
        vol, tsdf = float(scene["vol"].flat[here]), float(scene["tsdf"].flat[here])
        no_pixel = int(scene["mapping"].flat[here]) == NO_PIXEL
        if protocol == "sscnet":
            counts = abs(vol) < 1 or vol == -1 if semantic else -1 <= vol < 0
            label = EMPTY if label == UNLABELLED else label
        elif protocol == "aicnet":
            counts = label != UNLABELLED and (tsdf < 0.000999 or tsdf == 1)
        elif protocol == "3dsketch":
            counts = label != UNLABELLED and scene["label_weight"].flat[here] > 0 and (semantic or no_pixel)
        elif protocol == "monoscene":
            counts = label != UNLABELLED
        else:
            counts = label != UNLABELLED and scene["invalid"].flat[here] != 1
        if counts:
            yield label, int(scene["prediction"].flat[here])


def completion(protocol, scenes):
    """[precision, recall, IoU] of several scenes, None where the protocol gives NaN."""
    tables = []
    for scene in scenes:
        pairs = [(t > 0, p > 0) for t, p in scored_voxels(protocol, scene, semantic=False)]
        tables.append([pairs.count((True, True)), pairs.count((False, True)), pairs.count((True, False))])
    if protocol in ("sscnet", "aicnet"):
        each = [ratios(protocol, *table) for table in tables]
        return [None if None in column else sum(column) / len(column) for column in zip(*each, strict=True)]
    return ratios(protocol, *[sum(column) for column in zip(*tables, strict=True)])


def ratios(protocol, tp, fp, fn):
    below = [tp + fp, tp + fn, tp + fp + fn]
    values = [tp / d if d else None for d in below]
    if protocol == "sscnet":
        return [values[0] if tp else 0, values[1] or 0, values[2]]
    if protocol == "aicnet":
        return [value or 0 for value in values]
    if protocol == "monoscene":
        return values if tp else [0, 0, 0]
    if protocol == "semantic-kitti":
        return [tp / (below[0] + 2**-23), tp / (below[1] + 2**-23), values[2]]
    return values


def semantic(protocol, scenes, n):
    """([IoU of class 1..n-1], mean IoU) of several scenes."""
    per_scene = [list(scored_voxels(protocol, scene, semantic=True)) for scene in scenes]
    if protocol == "aicnet":
        classes = []
        for c in range(1, n):
            values = [class_iou(pairs, c, 0.0) for pairs in per_scene if any(t == c for t, _ in pairs)]
            classes.append(sum(values) / len(values) if values else None)
        found = [value for value in classes if value is not None]
        return [value or 0.0 for value in classes], sum(found) / len(found)
    pairs = [pair for scene in per_scene for pair in scene]
    extra = {"monoscene": 1e-5, "semantic-kitti": 1e-15}.get(protocol, 0.0)
    classes = [class_iou(pairs, c, extra) for c in range(1, n)]
    found = [value for value in classes if value is not None]
    if protocol == "sscnet" and len(found) < len(classes):
        return classes, None
    return classes, sum(found) / len(found)


def class_iou(pairs, c, extra):
    both = sum(t == c and p == c for t, p in pairs)
    either = sum(t == c or p == c for t, p in pairs)
    return both / (either + extra) if either + extra else None
