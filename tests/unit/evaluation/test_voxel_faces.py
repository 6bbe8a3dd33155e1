"""Faces near faces: the same counts as the metric of points that it stands for."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.evaluation.voxel_faces import faces, near
from hsbench.metrics import reconstruction

SHAPE = (11, 9, 7)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("reach_voxels", [0.5, 1.0, 1.5, 2.0, 3.0])
def test_counts_are_those_of_the_nearest_points(seed: int, reach_voxels: float) -> None:
    rng = np.random.default_rng(seed)
    a, b = (rng.random(SHAPE) < share for share in (0.02, 0.1))
    points = [reconstruction.voxel_surface(solid, (0.0, 0.0, 0.0), 1.0) for solid in (a, b)]
    expected = reconstruction.counts(points[1], points[0], reach_voxels)
    assert (faces(a).sum(), faces(b).sum()) == (expected.predicted, expected.true)
    assert near(faces(a), faces(b), reach_voxels) == expected.predicted_near
    assert near(faces(b), faces(a), reach_voxels) == expected.true_near


def test_nothing_is_near_nothing() -> None:
    some, none = np.zeros(SHAPE, bool), np.zeros(SHAPE, bool)
    some[5, 5, 5] = True
    assert near(faces(some), faces(none), 2.0) == near(faces(none), faces(some), 2.0) == 0
    assert faces(~none).sum() == 0
