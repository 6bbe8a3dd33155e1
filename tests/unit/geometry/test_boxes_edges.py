"""Oriented boxes in general position: the sum over edges against the integral over faces, and lanes that never mix."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hsbench.geometry import box_edges, box_faces, boxes
from tests.unit.geometry.box_samples import oriented, rows

LANES = box_edges.LANES
TIES = ("identical", "flush inside", "face to face", "one corner in the other")


def columns(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(LANES, 15) pairs -> (FIELDS, LANES), the second box in the axes of the first."""
    rotation_a, rotation_b = a[:, 6:].reshape(-1, 3, 3), b[:, 6:].reshape(-1, 3, 3)
    centre = np.einsum("nki,nk->ni", rotation_a, b[:, :3] - a[:, :3])
    cosines = (rotation_a.transpose(0, 2, 1) @ rotation_b).reshape(-1, 9)
    return np.ascontiguousarray(np.column_stack([a[:, 3:6] / 2, b[:, 3:6] / 2, centre, cosines]).T)


def by_both(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the smaller box of those of (n LANES, 15) pairs that are in general position, by edges and by faces."""
    swap = boxes.volumes(a) > boxes.volumes(b)
    a, b = np.where(swap[:, None], b, a), np.where(swap[:, None], a, b)
    edges, faces, work, out = [], [], np.empty(box_faces.SCRATCH), np.empty(LANES)
    for start in range(0, len(a), LANES):
        chunk = slice(start, start + LANES)
        pairs = columns(a[chunk], b[chunk])
        general = [n for n in range(LANES) if box_edges.is_general(pairs, n)]
        box_edges.common_volumes(pairs, out)
        volume = boxes.volumes(a[chunk])
        edges += [out[n] / volume[n] for n in general]
        faces += [box_faces.common_volume(pairs, n, work) / volume[n] for n in general]
    return np.array(edges), np.array(faces)


@pytest.mark.parametrize("thin", [1.0, 1e-2, 1e-4])
def test_both_sums_agree_on_any_boxes(thin: float) -> None:
    rng = np.random.default_rng(1)
    a, b = oriented(rng, 20 * LANES, 0.5), oriented(rng, 20 * LANES, 0.5)
    a[:, 5] *= thin
    b[:, 3] *= thin
    edges, faces = by_both(a, b)
    assert len(edges) > 15 * LANES
    assert (faces > 0).mean() > 0.5
    assert np.abs(edges - faces).max() < 1e-13 / thin**0.5


@pytest.mark.parametrize("tie", TIES)
@pytest.mark.parametrize("thin", [1.0, 1e-2])
def test_both_sums_agree_where_faces_nearly_coincide(tie: str, thin: float) -> None:
    """Down to the turns that leave the pair just in general position, where crossings are worst."""
    rng = np.random.default_rng(TIES.index(tie))
    n = 40 * LANES
    rotation = Rotation.random(n, random_state=2).as_matrix()
    # turns that are the same about all axes, so that no cosine is much less than the others
    angle = 10 ** rng.uniform(-1.75, -0.5, n)
    turn = Rotation.from_rotvec(angle[:, None] * rng.choice([-1.0, 1.0], (n, 3))).as_matrix()
    size_a = rng.uniform(0.3, 2.0, (n, 3)) * [1, 1, thin]
    size_b = size_a * rng.uniform(0.3, 1.0, (n, 1)) if tie == "flush inside" else size_a
    local = {
        "identical": 0 * size_a,
        "flush inside": (size_a - size_b) / 2,
        "face to face": size_a * [1, 0, 0],
        "one corner in the other": size_a * rng.uniform(0, 0.9, (n, 1)),
    }[tie]
    a = rows(np.zeros((n, 3)), size_a, rotation)
    b = rows(np.einsum("nij,nj->ni", rotation, local), size_b, rotation @ turn)
    edges, faces = by_both(a, b)
    assert len(edges) > n / 2
    assert np.abs(edges - faces).max() < 2e-13


@pytest.mark.parametrize("n", [1, LANES - 1, LANES, LANES + 1])
def test_a_pair_never_feels_its_neighbours(n: int) -> None:
    rng = np.random.default_rng(3)
    a, b = oriented(rng, n, 0.5), oriented(rng, 5, 0.5)
    b[3:, 6:] = a[0, 6:]  # some in general position, some not
    alone = np.array([[boxes.iou_oriented(p[None], q[None])[0, 0] for q in b] for p in a])
    assert np.array_equal(boxes.iou_oriented(a, b), alone)
    order = rng.permutation(n)
    assert np.array_equal(boxes.iou_oriented(a[order], b), alone[order])
    assert np.array_equal(boxes.iou_oriented_pairs(a, np.tile(b[:1], (n, 1))), alone[:, 0])
