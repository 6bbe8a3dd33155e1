"""Methods of task affordance-view: labels by how often feet, hips and hands were seen at a pixel, by colour, by place.

People are lifted to metres and projected again, so that another episode's can be turned about this camera.
"""

from __future__ import annotations

import numpy as np

from hsbench.baselines.controls.fitted import for_each, prepare, trace_methods
from hsbench.baselines.controls.places import COLOURS, PRESENCE_BINS, colour, picture, presence
from hsbench.baselines.lift import camera_height
from hsbench.baselines.method import Method, Predictor, Settings, observed
from hsbench.baselines.traces import Traces
from hsbench.geometry.cameras import world_T_camera
from hsbench.geometry.transforms import apply, invert
from hsbench.metrics import multilabel
from hsbench.schema.episode import Episode
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.tasks.affordance_view import AFFORDANCE_VIEW, image_shape
from hsbench.tasks.probability_maps import LABELS
from hsbench.typing import BoolArray, FloatArray, IntArray, UInt8Array

TASK = AFFORDANCE_VIEW.name
BLOCK_SHARE = 1 / 160  # side of a block of pixels that share an answer, of the width of the picture
BODY_BLOCKS = 3.0  # radius of the disc that a foot, a hip or a hand visits
PLACES = 24  # rows and columns of places that the best constant tells apart
BANDS = 24  # of rows, in which colours are counted
COLOUR_BINS = BANDS * COLOURS
CONSTANT_BINS = PLACES * PLACES


def block_px(shape: tuple[int, int]) -> int:
    """Side of a block of pixels."""
    return max(1, round(shape[1] * BLOCK_SHARE))


def seen_traces(found: Traces, episode: Episode) -> IntArray:
    """(3, rows, columns) bins by how often people walked, sat and reached at a pixel of the camera."""
    shape, sensor = image_shape(episode), episode.sensor
    height_m = camera_height(observed(episode), sensor)
    camera_T_episode = invert(world_T_camera(height_m, sensor.tilt_rad, sensor.roll_rad))
    side = block_px(shape)
    blocks = (-(-shape[0] // side), -(-shape[1] // side))

    def of(points: FloatArray) -> IntArray:
        pixels, _ = sensor.camera.project(apply(camera_T_episode, points))
        seen = pixels[sensor.camera.contains(pixels)][:, ::-1] / side
        bins = presence(seen, found.share, (0.0, 0.0), blocks, 1.0, BODY_BLOCKS)
        return bins.repeat(side, axis=0).repeat(side, axis=1)[: shape[0], : shape[1]]

    return np.stack([of(points) for points in (found.walked, found.sat, found.hands)])


def by_colour(episode: Episode) -> IntArray:
    """(rows, columns) band of rows and colour of each pixel at t0."""
    return _part(image_shape(episode)[0], BANDS)[:, None] * COLOURS + colour(picture(episode))


def by_place(shape: tuple[int, int]) -> IntArray:
    """(rows, columns) number of the place of each pixel."""
    return _part(shape[0], PLACES)[:, None] * PLACES + _part(shape[1], PLACES)


def _part(count: int, parts: int) -> IntArray:
    return np.arange(count) * parts // count


def _labels(bits: UInt8Array) -> tuple[BoolArray, BoolArray]:
    return multilabel.planes(bits, LABELS), (bits & VIEW_UNSCORED) > 0


def _prepare_colours(settings: Settings) -> Predictor:
    return prepare(settings, "colours", TASK, lambda e: for_each(len(LABELS), by_colour(e)), COLOUR_BINS, _labels)


def _prepare_constant(settings: Settings) -> Predictor:
    def places(episode: Episode) -> IntArray:
        return for_each(len(LABELS), by_place(image_shape(episode)))

    return prepare(settings, "best-constant", TASK, places, CONSTANT_BINS, _labels)


METHODS = (
    *trace_methods(
        TASK,
        "labels by how often people walked, sat and reached at a pixel, fitted on train",
        seen_traces,
        PRESENCE_BINS,
        _labels,
        np.asarray,
    ),
    Method(
        TASK,
        "colours",
        "frames",
        "labels by row and colour at t0, fitted on train",
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
