"""Reconstruction from surfaces: how far a predicted surface lies from the true one, and how much of it is found.

Task
----
Two surfaces are given as points, evenly spread over them: samples of meshes, or the outer faces of solid voxels
(``voxel_surface``).

Conventions
-----------
Points are (N, 3) in metres, both sets in one frame. A distance is that to the nearest point of the other set; it is
longer than that to the surface itself by up to half the spacing of the points, so the spacing should be well below the
threshold. Both sets should have one spacing: ``thin`` makes it so.

Metrics
-------
- accuracy = share of predicted points within ``threshold_m`` (included) of truth; completeness = share of true points
  within it of the prediction; F-score = 2 A C / (A + C);
- ``accuracy_m``, ``completeness_m``: the mean distances themselves; chamfer = their mean, in metres.
None without points to take a share or a distance of. F is 0 if only one side has points, None if neither. Counts and
sums of distances of scenes add up; values are taken once from the sums.

Differences from other scorers
------------------------------
* "Accuracy" is a share here, as in KITTI-360 (0.2 m); Seitz et al. 2006 and DTU call the mean (or 90 %) distance so.
* Chamfer distances differ by a factor of two (sum of both sides: twice ours) and by the square (PyTorch3D: m^2).
* Tanks and Temples tests distance < threshold; points exactly at the limit count here: higher, by a null set on scans,
  by a whole layer on voxel grids.
* KITTI-360 scores accuracy only where truth was observed and thins both sets to 0.02 m. Do both before, with ``thin``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics.boundary import f_score
from hsbench.metrics.labels import check_bool
from hsbench.metrics.tables import ratio
from hsbench.typing import AnyArray, BoolArray, FloatArray

THRESHOLD_M = 0.1  # task scene-reconstruction-360
FAR_M = 1e5
_REACH = 1e-9  # relative slack: a distance meant to equal the threshold may miss it by a last bit


@dataclass(frozen=True)
class SurfaceCounts:
    """Sufficient statistics: points within the threshold, points, and sums of distances in metres, of either side.

    A sum of distances is None where the other side has no points.
    """

    predicted_near: int
    predicted: int
    true_near: int
    true: int
    predicted_m: float | None
    true_m: float | None


@dataclass(frozen=True)
class SurfaceScore:
    """Values at a threshold; None = undefined. Lengths in metres.

    undefined_scenes: scenes in which a side has no points: their distances are in no mean, their points in the shares.
    """

    threshold_m: float
    accuracy: float | None
    completeness: float | None
    f_score: float | None
    accuracy_m: float | None
    completeness_m: float | None
    chamfer_m: float | None
    scenes: int
    undefined_scenes: int


def counts(truth: AnyArray, prediction: AnyArray, threshold_m: float = THRESHOLD_M) -> SurfaceCounts:
    """Compare one scene.

    truth, prediction: (N, 3) and (M, 3) points in metres, one frame; either may be empty.
    threshold_m: in metres, > 0. Raises SchemaError for arrays that do not fit.
    """
    true, predicted = check_points(truth, "truth"), check_points(prediction, "prediction")
    if not (np.isfinite(threshold_m) and threshold_m > 0):
        raise SchemaError(f"threshold_m is {threshold_m}; expected metres > 0")
    to_truth, to_prediction = _nearest(predicted, true), _nearest(true, predicted)
    limit = threshold_m * (1 + _REACH)
    return SurfaceCounts(
        predicted_near=int((to_truth <= limit).sum()),
        predicted=len(predicted),
        true_near=int((to_prediction <= limit).sum()),
        true=len(true),
        predicted_m=float(np.sort(to_truth).sum()) if len(true) else None,  # sorted: the order of points is no matter
        true_m=float(np.sort(to_prediction).sum()) if len(predicted) else None,
    )


def aggregate(scenes: Sequence[SurfaceCounts], threshold_m: float = THRESHOLD_M) -> SurfaceScore:
    """Scenes together, counted at one threshold: sums first, then one division. Raises SchemaError for no scene."""
    if not scenes:
        raise SchemaError("scenes is empty; expected the counts of one scene or more")
    accuracy = ratio(sum(s.predicted_near for s in scenes), sum(s.predicted for s in scenes))
    completeness = ratio(sum(s.true_near for s in scenes), sum(s.true for s in scenes))
    both = [s for s in scenes if s.predicted_m is not None and s.true_m is not None and s.predicted and s.true]
    accuracy_m = _mean_m([s.predicted_m for s in both], [s.predicted for s in both])
    completeness_m = _mean_m([s.true_m for s in both], [s.true for s in both])
    chamfer = None if accuracy_m is None or completeness_m is None else (accuracy_m + completeness_m) / 2
    return SurfaceScore(
        threshold_m, accuracy, completeness, f_score(accuracy, completeness), accuracy_m, completeness_m, chamfer,
        len(scenes), len(scenes) - len(both),
    )  # fmt: skip


def score(truth: AnyArray, prediction: AnyArray, threshold_m: float = THRESHOLD_M) -> SurfaceScore:
    """``counts`` and ``aggregate`` of one scene."""
    return aggregate([counts(truth, prediction, threshold_m)], threshold_m)


def voxel_surface(occupied: BoolArray, origin_m: Sequence[float], voxel_m: float) -> FloatArray:
    """Centres of the faces between occupied and free voxels, (K, 3) in metres.

    occupied: (nx, ny, nz) bool. origin_m: minimum corner. The outside of the grid is unknown: no face there.
    Raises SchemaError for what does not fit.
    """
    check_bool(occupied, "occupied")
    if occupied.ndim != 3:
        raise SchemaError(f"occupied has shape {occupied.shape}; expected (nx, ny, nz): one scene at a time")
    if not (np.isfinite(voxel_m) and voxel_m > 0):
        raise SchemaError(f"voxel_m is {voxel_m}; expected metres > 0")
    if len(origin_m) != 3 or not np.isfinite(origin_m).all():
        raise SchemaError(f"origin_m is {tuple(origin_m)}; expected x, y, z in metres")
    faces = []
    for axis in range(3):
        sides = np.moveaxis(occupied, axis, 0)
        index = np.argwhere(np.moveaxis(sides[1:] != sides[:-1], 0, axis)) + 0.5
        index[:, axis] += 0.5
        faces.append(index)
    return np.asarray(np.concatenate(faces) * voxel_m + np.asarray(origin_m, dtype=np.float64))


def thin(points: AnyArray, spacing_m: float) -> FloatArray:
    """One point a cube of side ``spacing_m``, the mean of those in it, ordered by cube: (K, 3) metres."""
    values = check_points(points, "points")
    if not (np.isfinite(spacing_m) and spacing_m > 0):
        raise SchemaError(f"spacing_m is {spacing_m}; expected metres > 0")
    ordered = values[np.lexsort(values.T)]  # sums of one cube in one order, whatever the input's
    _, cube, number = np.unique(np.floor(ordered / spacing_m), axis=0, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(cube.reshape(-1), ordered[:, k], len(number)) for k in range(3)], axis=1)
    return np.asarray(sums / number[:, None])


def check_points(points: AnyArray, name: str) -> FloatArray:
    """(N, 3) finite metres as float64. Raises SchemaError, naming the array and the first bad row."""
    if not isinstance(points, np.ndarray) or points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "fui":
        found = f"{points.dtype} {points.shape}" if isinstance(points, np.ndarray) else type(points).__name__
        raise SchemaError(f"{name} is {found}; expected numbers (N, 3) in metres (one point a column?)")
    values = points.astype(np.float64)
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        raise SchemaError(f"{name}[{int(np.argmax(bad))}] holds NaN or infinity; expected finite metres")
    if len(values) and np.abs(values).max() > FAR_M:
        raise SchemaError(f"{name} reaches {np.abs(values).max():g} m; expected less than {FAR_M:g} (millimetres?)")
    return values


def _nearest(points: FloatArray, others: FloatArray) -> FloatArray:
    if not len(points) or not len(others):
        return np.full(len(points), np.inf)
    from scipy.spatial import KDTree

    return np.asarray(KDTree(others).query(points)[0])


def _mean_m(sums: Sequence[float | None], numbers: Sequence[int]) -> float | None:
    return sum(s for s in sums if s is not None) / sum(numbers) if sums else None
