"""Methods of task scene-reconstruction-360: those of affordance-topdown with the height as another bin.

What a column of the map from above affords is known of from the same signs; at which heights a label is, train tells.
Walls stand about the convex hull of where people were.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import distance_transform_edt

from hsbench.baselines.controls import topdown
from hsbench.baselines.controls.fitted import Places, for_each, prepare, trace_methods
from hsbench.baselines.controls.places import PRESENCE_BINS
from hsbench.baselines.method import Method, Predictor, Settings
from hsbench.baselines.traces import Traces
from hsbench.schema.episode import Episode
from hsbench.tasks.scene_reconstruction import GRID, SCENE_RECONSTRUCTION
from hsbench.truth.affordance_volumes import Volume, VolumeTruth
from hsbench.typing import BoolArray, IntArray, UInt8Array

TASK = SCENE_RECONSTRUCTION.name
HEIGHTS = GRID.shape[2]
LABELS = (Volume.WALKABLE, Volume.SITTABLE, Volume.INTERACTABLE, Volume.WALL)
WINS = (Volume.WALL, Volume.INTERACTABLE, Volume.SITTABLE, Volume.WALKABLE)
"""The later, where volumes meet: what people did on the spot is surer than what they reached for."""


def upright(plans: IntArray) -> IntArray:
    """(4, rows, columns) bins of the map from above -> (4, nx, ny, nz) bins of the voxels over each cell."""
    return np.asarray(plans[:, ::-1, ::-1, None] * HEIGHTS + np.arange(HEIGHTS))


def about_hull(found: Traces) -> IntArray:
    """(rows, columns) distance in cells from the outline of the hull: middle bin on it, above inside, below outside."""
    inside = topdown.in_hull(found)
    if not inside.any():
        return np.zeros(inside.shape, dtype=np.int64)
    signed = np.round(distance_transform_edt(inside) - distance_transform_edt(~inside)).astype(np.int64)
    return np.clip(signed + PRESENCE_BINS // 2, 0, PRESENCE_BINS - 1)


def presence_bins(found: Traces) -> IntArray:
    """(4, nx, ny, nz) bins by height and by how often people walked, sat and reached there, of walls by their hull."""
    return upright(np.stack([*topdown.presence_bins(found), about_hull(found)]))


def _labels(true: VolumeTruth) -> tuple[BoolArray, BoolArray]:
    return np.stack([true.labels == label for label in LABELS]), true.ignored


def _merged(volumes: BoolArray) -> UInt8Array:
    label = np.zeros(GRID.shape, dtype=np.uint8)
    for volume in WINS:
        label[volumes[LABELS.index(volume)]] = volume
    return label


def _prepare(settings: Settings, name: str, places: Places, bins: int) -> Predictor:
    said = prepare(settings, name, TASK, places, bins * HEIGHTS, _labels)
    return lambda episode: _merged(said(episode))


def _columns(plan: Callable[[Episode], IntArray]) -> Places:
    return lambda episode: upright(for_each(len(LABELS), plan(episode)))


def _prepare_colours(settings: Settings) -> Predictor:
    height_m = topdown.usual_height(settings, "colours")
    return _prepare(settings, "colours", _columns(lambda e: topdown.by_colour(e, height_m)), topdown.COLOUR_BINS)


def _prepare_constant(settings: Settings) -> Predictor:
    return _prepare(settings, "best-constant", _columns(lambda e: topdown.by_place()), topdown.CONSTANT_BINS)


METHODS = (
    *trace_methods(
        TASK,
        "volumes by height and by how often people walked, sat and reached there, fitted on train",
        lambda found, _: presence_bins(found),
        PRESENCE_BINS * HEIGHTS,
        _labels,
        _merged,
    ),
    Method(
        TASK,
        "colours",
        "frames",
        "volumes by height, distance from the camera and colour at t0, fitted on train",
        _prepare_colours,
        control="no-activity",
        needs_train=True,
    ),
    Method(
        TASK,
        "best-constant",
        "frames",
        "one volume for every episode, the best on train",
        _prepare_constant,
        control="best-constant",
        needs_train=True,
    ),
)
