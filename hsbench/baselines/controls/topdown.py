"""Methods of task affordance-topdown: labels by how often people were there, by colour, by place alone."""

from __future__ import annotations

import numpy as np

from hsbench.baselines.controls.fitted import for_each, prepare, trace_methods
from hsbench.baselines.controls.places import COLOURS, PRESENCE_BINS, colour, picture, presence
from hsbench.baselines.method import Method, Predictor, Settings, training
from hsbench.baselines.traces import CORNERS, Traces, own_traces
from hsbench.errors import DataError
from hsbench.geometry.cameras import world_T_camera
from hsbench.geometry.polygons import contains
from hsbench.geometry.transforms import apply, invert
from hsbench.metrics import multilabel
from hsbench.schema.episode import Episode
from hsbench.schema.occupancy import AffordanceTruth
from hsbench.tasks.affordance_topdown import AFFORDANCE_TOPDOWN, GRID
from hsbench.tasks.probability_maps import LABELS
from hsbench.typing import BoolArray, FloatArray, IntArray

TASK = AFFORDANCE_TOPDOWN.name
LOW_XY = (-GRID.shape[0] * GRID.cell_m / 2, -GRID.shape[1] * GRID.cell_m / 2)
BODY_M = 0.20  # radius of the disc that a person or a hand visits
BLOCK = 4  # cells a side that share an answer of the best constant, so that a few training rooms tell of it
RING_M = 0.4  # width of the rings about the camera in which colours are counted
RINGS = int(np.ceil(np.hypot(*LOW_XY) / RING_M))
COLOUR_BINS = RINGS * COLOURS
CONSTANT_BINS = (GRID.shape[0] // BLOCK) * (GRID.shape[1] // BLOCK)


def cells() -> FloatArray:
    """(rows, columns, 2) x and y of the middles of the cells: row 0 is the largest x, column 0 the largest y."""
    x, y = (-low - (np.arange(n) + 0.5) * GRID.cell_m for low, n in zip(LOW_XY, GRID.shape, strict=True))
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)


def presence_bins(found: Traces) -> IntArray:
    """(3, rows, columns) bins by how much of the time people walked, sat and reached there."""

    def of(places: FloatArray) -> IntArray:
        return presence(places[:, :2], found.share, LOW_XY, GRID.shape, GRID.cell_m, BODY_M)[::-1, ::-1]

    return np.stack([of(places) for places in (found.walked, found.sat, found.hands)])


def by_colour(episode: Episode, height_m: float) -> IntArray:
    """(rows, columns) ring about the camera and colour that the first picture shows where floor would be."""
    xy = cells()
    points = np.concatenate([xy, np.zeros((*xy.shape[:2], 1))], axis=-1)
    camera, sensor = episode.sensor.camera, episode.sensor
    placed = world_T_camera(height_m, sensor.tilt_rad, sensor.roll_rad)
    pixels, _ = camera.project(apply(invert(placed), points))
    size = (camera.width_px - 1, camera.height_px - 1)
    column, row = (np.clip(pixels[..., k].astype(np.int64), 0, size[k]) for k in range(2))
    ring = (np.hypot(xy[..., 0], xy[..., 1]) / RING_M).astype(np.int64)
    return ring * COLOURS + colour(picture(episode)[row, column])


def by_place() -> IntArray:
    """(rows, columns) number of the block of each cell."""
    rows, columns = (np.arange(n) // BLOCK for n in GRID.shape)
    return rows[:, None] * (GRID.shape[1] // BLOCK) + columns


def usual_height(settings: Settings, name: str) -> float:
    """Mean height of the cameras of train, metres: the height of the episode's own is no input."""
    heights = [e.placed_sensor.height_m for e in training(settings, name)]
    known = [h for h in heights if h is not None]
    if not known:
        raise DataError(f"{name} learns the usual height of cameras; no episode of split train knows its own")
    return float(np.mean(known))


def in_hull(found: Traces) -> BoolArray:
    """(rows, columns) bool: inside the convex hull of where people were."""
    outline = found.boundary
    return contains(outline, cells()) if len(outline) >= CORNERS else np.zeros(GRID.shape, dtype=np.bool_)


def _labels(true: AffordanceTruth) -> tuple[BoolArray, BoolArray]:
    return multilabel.planes(true.labels, LABELS), true.ignored


def _prepare_hull(settings: Settings) -> Predictor:
    usual = TRACES.prepare(settings)
    return lambda episode: np.stack([in_hull(own_traces(episode)), *usual(episode)[1:]])


def _prepare_colours(settings: Settings) -> Predictor:
    height_m = usual_height(settings, "colours")
    return prepare(
        settings, "colours", TASK, lambda e: for_each(len(LABELS), by_colour(e, height_m)), COLOUR_BINS, _labels
    )


def _prepare_constant(settings: Settings) -> Predictor:
    return prepare(settings, "best-constant", TASK, lambda e: for_each(len(LABELS), by_place()), CONSTANT_BINS, _labels)


TRACES, SHUFFLED = trace_methods(
    TASK,
    "labels by how often people walked, sat and reached there, fitted on train",
    lambda found, _: presence_bins(found),
    PRESENCE_BINS,
    _labels,
    np.asarray,
)
METHODS = (
    TRACES,
    SHUFFLED,
    Method(
        TASK,
        "hull",
        "poses",
        "as traces, but walkable is the convex hull of where people were",
        _prepare_hull,
        needs_train=True,
    ),
    Method(
        TASK,
        "colours",
        "frames",
        "labels by distance from the camera and colour at t0, fitted on train",
        _prepare_colours,
        control="no-activity",
        needs_train=True,
    ),
    Method(
        TASK,
        "best-constant",
        "frames",
        "one map for every episode, the best on train",
        _prepare_constant,
        control="best-constant",
        needs_train=True,
    ),
)
