"""IoU of boxes against shapely and Qhull: the same boxes on both sides, in one run, ratios printed.

Threads: shapely and Qhull use one; so do ours, but for the line that says two. Ours starts from rows of boxes and
checks them; the libraries are given polygons and half-spaces that are made beforehand, unless a line says otherwise.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

from hsbench.geometry.boxes import corners, intersection_oriented, iou_oriented, iou_upright
from hsbench.typing import FloatArray
from tests.benchmarks.ratios import best_s, report

UPRIGHT_A, UPRIGHT_B = 2000, 500
ORIENTED_A, ORIENTED_B, QHULL_SIDE = 300, 200, 20


def upright(rng: np.random.Generator, n: int, spread_m: float) -> FloatArray:
    """(n, 7) boxes of furniture size, centres in a cube of this side."""
    centre = rng.uniform(-spread_m / 2, spread_m / 2, (n, 3))
    return np.column_stack([centre, rng.uniform(0.5, 3.0, (n, 3)), rng.uniform(-np.pi, np.pi, n)])


def half_of_all_pairs_overlap() -> tuple[FloatArray, FloatArray]:
    """Boxes in a 3.2 m cube: half of the million pairs share some volume."""
    rng = np.random.default_rng(0)
    return upright(rng, UPRIGHT_A, 3.2), upright(rng, UPRIGHT_B, 3.2)


def half_of_the_boxes_overlap() -> tuple[FloatArray, FloatArray]:
    """Boxes on a floor of 100 m: half of the 500 lie on one of the 2000, the others where none is."""
    rng = np.random.default_rng(0)
    a = upright(rng, UPRIGHT_A, 100.0)
    b = a[rng.choice(UPRIGHT_A, UPRIGHT_B, replace=False)] + rng.normal(0, 0.1, (UPRIGHT_B, 7)) * [1, 1, 1, 0, 0, 0, 1]
    b[UPRIGHT_B // 2 :, 0] += 200.0
    return a, b


def footprints(boxes: FloatArray) -> Any:
    """(N,) shapely polygons of upright boxes."""
    shapely = pytest.importorskip("shapely")
    return shapely.polygons(corners(boxes)[:, [0, 4, 6, 2], :2])


def upright_iou(area: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """IoU from common areas of footprints, row with row (broadcast)."""
    gap = np.abs(a[..., 2] - b[..., 2])
    height = np.clip(np.minimum((a[..., 5] + b[..., 5]) / 2 - gap, np.minimum(a[..., 5], b[..., 5])), 0, None)
    volume_a, volume_b = a[..., 3:6].prod(-1), b[..., 3:6].prod(-1)
    return area * height / (volume_a + volume_b - area * height)


@pytest.mark.slow
@pytest.mark.parametrize("scene", [half_of_all_pairs_overlap, half_of_the_boxes_overlap])
def test_upright_iou(benchmark: Any, scene: Any) -> None:
    shapely = pytest.importorskip("shapely")
    a, b = scene()
    got = benchmark.pedantic(iou_upright, (a, b), rounds=9, warmup_rounds=1)
    overlapping = got > 0
    if scene is half_of_all_pairs_overlap:
        assert 0.45 < overlapping.mean() < 0.55
    else:
        assert 0.45 < overlapping.any(axis=0).mean() < 0.55
    polygons_a, polygons_b = footprints(a), footprints(b)
    found: dict[str, FloatArray] = {}

    def all_pairs() -> None:
        area = shapely.area(shapely.intersection(polygons_a[:, None], polygons_b[None, :]))
        found["all pairs"] = upright_iou(area, a[:, None], b[None, :])

    def with_tree() -> None:
        i, j = shapely.STRtree(polygons_b).query(polygons_a, predicate="intersects")
        iou = np.zeros((len(a), len(b)))
        iou[i, j] = upright_iou(shapely.area(shapely.intersection(polygons_a[i], polygons_b[j])), a[i], b[j])
        found["tree"] = iou

    if not benchmark.enabled:
        with_tree()
        assert np.abs(found["tree"] - got).max() < 1e-9
        return
    all_pairs_s, tree_s, ours_s = best_s(all_pairs, 1), best_s(with_tree, 2), benchmark.stats.stats.min
    for iou in found.values():
        assert np.abs(iou - got).max() < 1e-9
    name = f"upright IoU, 2000 x 500, {scene.__name__.replace('_', ' ')}"
    report(name, "shapely, all pairs", all_pairs_s, ours_s, 80)
    report(name, "shapely with an STRtree", tree_s, ours_s, 5)


def oriented_around_the_origin(rng: np.random.Generator, n: int) -> FloatArray:
    """(n, 15) boxes turned at random with the origin well inside, so that Qhull's interior point is known."""
    rotation = Rotation.random(n, random_state=int(rng.integers(2**31))).as_matrix()
    size = rng.uniform(0.3, 2.0, (n, 3))
    centre = np.einsum("nij,nj->ni", rotation, rng.uniform(-0.4, 0.4, (n, 3)) * size)
    return np.column_stack([centre, size, rotation.reshape(n, 9)])


def half_spaces(box: FloatArray) -> FloatArray:
    """(15,) box -> (6, 4) half-spaces as Qhull takes them."""
    axes = box[6:].reshape(3, 3).T
    middle = axes @ box[:3]
    return np.block([[axes, (-middle - box[3:6] / 2)[:, None]], [-axes, (middle - box[3:6] / 2)[:, None]]])


@pytest.mark.slow
def test_oriented_iou(benchmark: Any) -> None:
    rng = np.random.default_rng(0)
    a, b = oriented_around_the_origin(rng, ORIENTED_A), oriented_around_the_origin(rng, ORIENTED_B)
    got = benchmark.pedantic(iou_oriented, (a, b), rounds=9, warmup_rounds=1)
    assert (got > 0).all()
    some_a, some_b, origin = a[:QHULL_SIDE], b[:QHULL_SIDE], np.zeros(3)
    planes_a, planes_b = [half_spaces(box) for box in some_a], [half_spaces(box) for box in some_b]

    def common(p: FloatArray, q: FloatArray) -> float:
        return float(ConvexHull(HalfspaceIntersection(np.concatenate([p, q]), origin).intersections).volume)

    def qhull() -> FloatArray:
        return np.array([[common(p, q) for q in planes_b] for p in planes_a])

    def qhull_from_boxes() -> FloatArray:
        return np.array([[common(half_spaces(p), half_spaces(q)) for q in some_b] for p in some_a])

    assert np.abs(qhull() - intersection_oriented(some_a, some_b)).max() < 1e-9
    if not benchmark.enabled:
        return
    share = QHULL_SIDE**2 / got.size
    ours_s = benchmark.stats.stats.min * share
    two_s = best_s(lambda: iou_oriented(a, b, threads=2), 9) * share
    ready_s, boxes_s = best_s(qhull, 5), best_s(qhull_from_boxes, 5)
    name = f"oriented IoU, {QHULL_SIDE**2} pairs that overlap"
    report(name, "Qhull, half-spaces and interior point given", ready_s, ours_s, 500)
    report(name, "Qhull from boxes, interior point given", boxes_s, ours_s, 500)
    report(f"{name}, ours on two threads", "Qhull from boxes, interior point given", boxes_s, two_s, 500)
