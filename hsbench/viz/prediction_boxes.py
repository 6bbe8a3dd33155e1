"""Boxes of task object-detection-3d beside truth: on a plan of the room, and in the picture at t0, as one picture.

The plan is seen from above with the camera (a triangle) at the bottom, looking up the page, and +y to the left. A
predicted box is the more opaque the higher its score.
"""

from __future__ import annotations

from itertools import combinations

import cv2
import numpy as np

from hsbench.geometry import boxes as geometry
from hsbench.geometry.transforms import apply, invert
from hsbench.metrics.detection import Truths
from hsbench.schema.episode import Episode
from hsbench.schema.sensor import Sensor
from hsbench.tasks.object_detection import Boxes
from hsbench.typing import BoolArray, FloatArray, UInt8Array
from hsbench.viz.pictures import beside, depth_picture, fitted
from hsbench.viz.plan_canvas import Drawing, Label, Shape, raster
from hsbench.viz.verdicts import COLOURS, MATCH_IOU, BoxVerdicts, Verdict, box_verdicts, true_boxes

HEIGHT_PX = 620
MARGIN_M, HEAD_M, FOOT_M = 0.4, 0.75, 0.45
LINE_M, THIN_M, TEXT_M = 0.035, 0.015, 0.13
INK, FAINT, FLOOR, WALL = "#33363b", "#787c82", "#faf6ef", "#3d4147"
CORNERS = [0, 4, 6, 2]
"""Of ``boxes.corners``: the footprint, counter-clockwise."""
EDGES = [(a, b) for a, b in combinations(range(8), 2) if (a ^ b).bit_count() == 1]
"""Pairs of ``boxes.corners`` that differ along one side."""
LEAST_OPACITY = 0.12  # of a box with score 0
EDGE_STEPS = 24  # pieces of an edge: it may leave the picture, or bend with the lens
FAR_PX = 1e5  # what lies beside the lens projects to anywhere


def boxes_picture(episode: Episode, found: Boxes, method: str) -> UInt8Array:
    """(h, w, 3) uint8: the plan, and the first picture where there is one; without truth the boxes alone."""
    truths = true_boxes(episode)
    verdicts = None if truths is None else box_verdicts(truths, found)
    drawing = _plan(episode, found, truths, verdicts, boxes_title(episode.episode_id, found, verdicts, method))
    size = drawing.high - drawing.low
    plan = raster(drawing, round(HEIGHT_PX * float(size[0] / size[1])))
    view = _first_picture(episode)
    if view is None:
        return plan
    return beside([plan, fitted(_with_boxes(view, episode.sensor, found, truths, verdicts), plan.shape[0])])


def boxes_title(episode_id: str, found: Boxes, verdicts: BoxVerdicts | None, method: str) -> tuple[str, str]:
    """The line of an episode with its score, and the line below it."""
    count = f"{len(found.boxes)} boxes"
    if verdicts is None:
        return f"{episode_id}: {method}", f"no truth: the prediction alone, {count}"
    ap = verdicts.average_precision
    share = f"{int(verdicts.found.sum())} of {len(verdicts.found)} objects found by {count} at IoU {MATCH_IOU:g}"
    return f"{episode_id}: {method}, AP .25 {'undefined' if ap is None else f'{ap:.3f}'}", share


def opacity(score: float) -> float:
    """Of a predicted box in all pictures of it."""
    return LEAST_OPACITY + (1 - LEAST_OPACITY) * score


def box_verdict(verdicts: BoxVerdicts | None, k: int) -> Verdict:
    """Of predicted box ``k``; without truth it is drawn as a hit."""
    return Verdict.HIT if verdicts is None or verdicts.hits[k] else Verdict.FALSE


def truth_verdict(verdicts: BoxVerdicts, k: int) -> Verdict:
    """Of true box ``k``."""
    return Verdict.HIT if verdicts.found[k] else Verdict.MISSED


def _first_picture(episode: Episode) -> UInt8Array | None:
    """The picture at t0, or its depth as a picture; None where there is neither."""
    if not len(episode.frames):
        return None
    frame = episode.frames[0]
    return frame.rgb if frame.rgb is not None or frame.depth_m is None else depth_picture(frame.depth_m)


def _plan(
    episode: Episode, found: Boxes, truths: Truths | None, verdicts: BoxVerdicts | None, title: tuple[str, str]
) -> Drawing:
    scene = None if episode.truth is None else episode.truth.scene
    shapes = [] if scene is None else [Shape(_page(r.outline_xy), FLOOR, WALL, LINE_M) for r in scene.rooms]
    for k in np.argsort(found.scores, kind="stable"):
        colour = COLOURS[box_verdict(verdicts, int(k))]
        edge = _faded(colour, opacity(float(found.scores[k])))
        fill = _faded(colour, 0.45 * opacity(float(found.scores[k])))
        shapes.append(Shape(_footprint(found.boxes[k].astype(np.float64)), fill, edge, THIN_M))
    if truths is not None and verdicts is not None:
        for k, box in enumerate(truths.boxes):
            shapes.append(Shape(_footprint(box), None, INK, LINE_M + 2 * THIN_M))
            shapes.append(Shape(_footprint(box), None, _faded(COLOURS[truth_verdict(verdicts, k)], 1.0), LINE_M))
    shapes.append(Shape(np.array([[0, 0], [-0.12, -0.2], [0.12, -0.2]]), INK))
    points = np.concatenate([shape.points for shape in shapes])
    low, high = points.min(axis=0) - [MARGIN_M, FOOT_M], points.max(axis=0) + [MARGIN_M, HEAD_M]
    high[0] = max(high[0], low[0] + 5.2)  # room for the words
    left = float(low[0]) + MARGIN_M / 2
    labels = [
        Label(np.array([left, high[1] - 0.2]), title[:1], 1.4 * TEXT_M, INK, anchor="start", bold=True),
        Label(np.array([left, high[1] - 0.48]), title[1:], TEXT_M, FAINT, anchor="start"),
    ]
    x = left
    for name, outline, swatch in _legend(verdicts is None):
        square = np.array([[x, low[1] + 0.1], [x + 0.2, low[1] + 0.1], [x + 0.2, low[1] + 0.26], [x, low[1] + 0.26]])
        if outline:
            shapes += [Shape(square, None, INK, LINE_M + 2 * THIN_M), Shape(square, None, swatch, LINE_M)]
        else:
            shapes.append(Shape(square, swatch))
        labels.append(Label(np.array([x + 0.27, low[1] + 0.18]), (name,), TEXT_M * 0.9, INK, anchor="start"))
        x += 0.42 + 0.56 * TEXT_M * len(name)
    return Drawing(low, high, tuple(shapes), tuple(labels), title[0])


def _legend(alone: bool) -> list[tuple[str, bool, str]]:
    """(name, drawn as an outline, colour)"""
    hit, false, missed = (_faded(COLOURS[v], 1.0) for v in (Verdict.HIT, Verdict.FALSE, Verdict.MISSED))
    if alone:
        return [("predicted", False, hit)]
    return [("found", True, hit), ("missed", True, missed), ("predicted: hit", False, hit), ("false", False, false)]


def _page(points_xy: FloatArray) -> FloatArray:
    """(n, 2) of the episode frame, x ahead and y left -> the page, where ahead is up."""
    return np.stack([-points_xy[:, 1], points_xy[:, 0]], axis=1)


def _footprint(box: FloatArray) -> FloatArray:
    return _page(geometry.corners(box[None])[0, CORNERS, :2])


def _faded(colour: tuple[int, int, int], share: float) -> str:
    """A colour laid on white."""
    return "#" + "".join(f"{round(255 + (c - 255) * share):02x}" for c in colour)


def _with_boxes(
    rgb: UInt8Array, sensor: Sensor, found: Boxes, truths: Truths | None, verdicts: BoxVerdicts | None
) -> UInt8Array:
    """A copy of a picture with the edges of all boxes in it."""
    canvas = rgb.copy()
    thin = max(1, round(rgb.shape[0] / 480))
    for k in np.argsort(found.scores, kind="stable"):
        colour = COLOURS[box_verdict(verdicts, int(k))]
        above = canvas.copy()
        _wire(above, sensor, found.boxes[k].astype(np.float64), colour, thin)
        share = opacity(float(found.scores[k]))
        canvas = np.asarray(cv2.addWeighted(above, share, canvas, 1 - share, 0.0), dtype=np.uint8)
    if truths is not None and verdicts is not None:
        for k, box in enumerate(truths.boxes):
            _wire(canvas, sensor, box, COLOURS[truth_verdict(verdicts, k)], 2 * thin)
    return canvas


def _wire(canvas: UInt8Array, sensor: Sensor, box: FloatArray, colour: tuple[int, int, int], width_px: int) -> None:
    """The twelve edges of a box, what lies behind the camera left out, in place."""
    ends = geometry.corners(box[None])[0][np.array(EDGES)]
    share = np.linspace(0, 1, EDGE_STEPS + 1)[:, None]
    points = ends[:, :1] * (1 - share) + ends[:, 1:] * share
    pixels = sensor.camera.project(apply(invert(sensor.world_T_camera), points.reshape(-1, 3)))[0]
    pixels = pixels.reshape(*points.shape[:2], 2)
    shown: BoolArray = np.asarray((np.abs(pixels) < FAR_PX).all(axis=-1))  # NaN is not
    for edge, good in zip(pixels, shown, strict=True):
        for k in np.flatnonzero(good[:-1] & good[1:]):
            a, b = ((round(float(p[0])), round(float(p[1]))) for p in edge[k : k + 2])
            cv2.line(canvas, a, b, colour, width_px, cv2.LINE_AA)
