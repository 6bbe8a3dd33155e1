"""An empty answer where truth exists scores 0 under every metric and protocol, and no truth at all is None, not 0."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.metrics import action, boundary, completion, multilabel, reconstruction, segmentation, semantic_completion
from hsbench.metrics.completion_protocols import FOREIGN
from hsbench.schema import VoxelState, category

SHAPE = (3, 3, 3)
OCCLUDED = np.full(SHAPE, VoxelState.OCCLUDED, np.uint8)
CHAIR = np.full(SHAPE, category("chair").category_id, np.uint8)
NOTHING = np.zeros(SHAPE, np.uint8)


@pytest.mark.parametrize("protocol", completion.PROTOCOLS)
def test_completion(protocol: str) -> None:
    got = completion.aggregate([completion.score(CHAIR, NOTHING, OCCLUDED, protocol)] * 2)
    assert (got.recall, got.iou) == (0.0, 0.0)
    semantic = semantic_completion.aggregate([semantic_completion.score(CHAIR, NOTHING, OCCLUDED, protocol)])
    # sscnet's mean of all its classes is undefined as soon as one has no voxel
    assert semantic.mean_iou == (None if protocol == "sscnet" else 0.0)
    nowhere = completion.aggregate([completion.score(NOTHING, NOTHING, OCCLUDED, protocol)])
    assert nowhere.iou == (0.0 if protocol in ("aicnet", "monoscene") else None)  # their own rule: 0
    if protocol not in FOREIGN:
        assert (nowhere.precision, nowhere.recall, nowhere.undefined_scenes) == (None, None, (1, 1, 1))


@pytest.mark.parametrize("rule", segmentation.ABSENT_RULES)
def test_segmentation(rule: str) -> None:
    truth = np.array([0, 0, 1, 2])
    got = segmentation.score(segmentation.confusion_matrix(truth, truth * 0 - 1, 3, no_answer=-1), rule)
    assert (got.mean_iou, got.pixel_accuracy, got.frequency_weighted_iou) == (0.0, 0.0, 0.0)
    assert got.iou == (0.0, 0.0, 0.0)


def test_labels_poses_segments_outlines_and_surfaces() -> None:
    truth = np.array([[True, False], [True, True]])
    assert multilabel.score(multilabel.tables(truth, truth & False)).mean_iou == 0.0
    assert multilabel.score(multilabel.tables(truth & False, truth & False)).mean_iou is None
    poses = np.array([1, 1, 2, 3])
    matrix = segmentation.confusion_matrix(poses, poses * 0, 4, ignore=0, no_answer=0)
    assert action.score(matrix, classes=(1, 2, 3)).macro_f1 == action.score(matrix).accuracy == 0.0
    steps = action.segment_counts(poses, poses * 0, background=0)
    assert (steps.edit_score, steps.f1) == (0.0, (0.0, 0.0, 0.0))
    image = np.kron(np.arange(4).reshape(2, 2), np.ones((3, 3), int))
    assert boundary.score(boundary.counts(image, image * 0, 4)).mean_f_score == 0.0
    surface = reconstruction.score(np.eye(3), np.zeros((0, 3)))
    assert (surface.completeness, surface.f_score, surface.chamfer_m) == (0.0, 0.0, None)
