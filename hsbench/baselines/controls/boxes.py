"""Methods of task object-detection-3d: mean objects where people stopped, visible components, the usual boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import find_objects, label

from hsbench.baselines.controls.fitted import truth
from hsbench.baselines.method import Method, Predictor, Settings, depth_at_t0, observed, other_episodes, training
from hsbench.baselines.occlusion.boundary import Boundary, estimate_boundary
from hsbench.baselines.posture import postures
from hsbench.errors import DataError
from hsbench.geometry.activity_map import rasterise
from hsbench.geometry.transforms import apply
from hsbench.schema.episode import NS_PER_S, Episode
from hsbench.schema.poses import PoseTable
from hsbench.synth.seeds import Seeds
from hsbench.tasks.object_detection import MAX_BOXES, OBJECT_DETECTION, Boxes
from hsbench.tasks.scene_completion import GRID
from hsbench.tasks.shuffle import shuffled_poses
from hsbench.typing import FloatArray

TASK = OBJECT_DETECTION.name
PLAN = ((GRID.origin_m[0], GRID.origin_m[1]), (GRID.shape[0], GRID.shape[1]), GRID.voxel_m)
BODY_M = 0.2  # radius of the disc in which a person is at one place
STOPPED_S = 2.0  # in one place: a walking person has left it after a second
FLOOR_M, HEAD_M = 0.1, 2.0  # heights between which depth shows things
WALL_M = 0.15  # from the boundary: depth noise and the wall itself
SMALLEST_CELLS = 12  # of a component, .03 square metres of floor plan: less is noise
PLACE_M = 0.8  # side of the places whose usual box the best constant learns
SIDE_M = 0.05  # the least a box is wide or high


@dataclass(frozen=True)
class Stop:
    """A place where somebody stayed: middle x y in metres, seconds, and whether they sat."""

    x: float
    y: float
    seconds: float
    sat: bool


def stops(poses: PoseTable) -> list[Stop]:
    """Where people stayed, those who sat and those who stood apart; poses have metres."""
    found = postures(poses)
    known = np.isfinite(found.place).all(axis=-1)
    interval_ns = np.diff(np.unique(poses.timestamp_ns))
    each_s = float(np.median(interval_ns)) / NS_PER_S if len(interval_ns) else STOPPED_S
    return [
        stop
        for sat, rows in ((True, found.sits), (False, found.stands))
        for stop in _stops(found.place[known & rows, :2], each_s, sat)
    ]


def _stops(places: FloatArray, each_s: float, sat: bool) -> list[Stop]:
    episode_s = max(len(places) * each_s, STOPPED_S)
    seconds = episode_s * rasterise(places, *PLAN, BODY_M, each_s / episode_s).astype(np.float64)
    parts, _ = label(seconds >= STOPPED_S)
    found = []
    for number, window in enumerate(find_objects(parts), start=1):
        longest = np.where(parts[window] == number, seconds[window], 0.0)
        row, column = np.unravel_index(int(np.argmax(longest)), longest.shape)
        x, y = (
            low + (offset.start + index + 0.5) * GRID.voxel_m
            for low, offset, index in zip(GRID.origin_m[:2], window, (row, column), strict=True)
        )
        found.append(Stop(x, y, float(longest.max()), sat))
    return found


def components(episode: Episode) -> Boxes:
    """A box along the walls around each connected part of what depth shows between floor and head, off the walls."""
    depth = depth_at_t0(episode)
    points = apply(episode.sensor.world_T_camera, episode.sensor.camera.unproject(depth))[depth > 0]
    walls = estimate_boundary(episode.sensor, depth, None)
    along = walls.to_axes(points[:, :2])
    shown = (points[:, 2] > FLOOR_M) & (points[:, 2] < HEAD_M)
    shown &= ((along > walls.low + WALL_M) & (along < walls.high - WALL_M)).all(axis=1)
    along, height = along[shown], points[shown, 2]
    if not len(along):
        return Boxes.none()
    cell = np.floor((along - walls.low) / GRID.voxel_m).astype(np.int64)
    plan = np.zeros(cell.max(axis=0) + 1, dtype=np.bool_)
    plan[cell[:, 0], cell[:, 1]] = True
    parts, count = label(plan, structure=np.ones((3, 3)))
    sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:]
    largest = np.argsort(-sizes, kind="stable")[:MAX_BOXES]
    part_of = parts[cell[:, 0], cell[:, 1]]
    kept = [part for part in largest if sizes[part] >= SMALLEST_CELLS]
    boxes = [_around(along[part_of == part + 1], float(height[part_of == part + 1].max()), walls) for part in kept]
    return Boxes.of(np.array(boxes).reshape(-1, 7), sizes[kept] / max(sizes.max(), 1), operating_score=0.0)


def _around(along: FloatArray, top_m: float, walls: Boundary) -> FloatArray:
    """(n, 2) points along the walls -> (7,) their box from the floor up."""
    low, high = along.min(axis=0), along.max(axis=0)
    size = np.maximum(high - low, SIDE_M)
    return np.array([*walls.from_axes((low + high) / 2), top_m / 2, *size, top_m, walls.yaw_rad])


@dataclass(frozen=True, eq=False)
class Usual:
    """What stands where people stop. size: (2, 3) mean l w h of the object nearest to a stop, z: (2,) its middle,
    share: (2,) of the stops that are inside one; of those who stood, then of those who sat.
    """

    size: FloatArray
    z: FloatArray
    share: FloatArray

    def boxes(self, found: list[Stop], yaw_rad: float) -> Boxes:
        """The mean object at each stop, the longest stops first where there are too many."""
        chosen = sorted(found, key=lambda stop: -stop.seconds)[:MAX_BOXES]
        rows = [[s.x, s.y, self.z[int(s.sat)], *self.size[int(s.sat)], yaw_rad] for s in chosen]
        longest = max((s.seconds for s in chosen), default=1.0)
        scores = [self.share[int(s.sat)] * (1 + s.seconds / longest) / 2 for s in chosen]
        return Boxes.of(np.array(rows).reshape(-1, 7), np.array(scores))


def fit_usual(samples: list[tuple[list[Stop], FloatArray]]) -> Usual:
    """From (stops, (n, 7) true boxes) of each training episode."""
    nearest: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    inside: tuple[list[bool], list[bool]] = ([], [])
    for found, boxes in samples:
        for stop in found if len(boxes) else []:
            distance = np.hypot(boxes[:, 0] - stop.x, boxes[:, 1] - stop.y)
            box = boxes[int(np.argmin(distance))]
            nearest[int(stop.sat)].append(box)
            inside[int(stop.sat)].append(bool(distance.min() < box[3:5].max() / 2))
    if not any(nearest):
        raise DataError("nobody stops anywhere in the training episodes; expected poses and furniture in split train")
    every = np.array([box for boxes in nearest for box in boxes])
    means = np.array([np.mean(boxes, axis=0) if boxes else every.mean(axis=0) for boxes in nearest])
    share = np.array([np.mean(hits) if hits else 0.0 for hits in inside])
    return Usual(means[:, 3:6], means[:, 2], share)


def fit_constant(true_boxes: list[FloatArray]) -> Boxes:
    """(n, 7) true boxes of each training episode -> the mean box of each place that ever had one.

    Places are squares of ``PLACE_M``; the score is the share of episodes with an object there. The yaw is 0, since the
    heading of the camera is random.
    """
    side = round(GRID.shape[0] * GRID.voxel_m / PLACE_M)
    low = np.array(GRID.origin_m[:2])
    held: list[list[FloatArray]] = [[] for _ in range(side * side)]
    episodes = np.zeros(side * side, dtype=np.int64)
    for boxes in true_boxes:
        place = np.clip(np.floor((boxes[:, :2] - low) / PLACE_M).astype(np.int64), 0, side - 1) @ np.array([side, 1])
        for where, box in zip(place, boxes, strict=True):
            held[int(where)].append(box)
        episodes[np.unique(place)] += 1
    chosen = np.argsort(-episodes, kind="stable")[: min(MAX_BOXES, np.count_nonzero(episodes))]
    rows = [[*np.mean(held[int(where)], axis=0)[:6], 0.0] for where in chosen]
    return Boxes.of(np.array(rows).reshape(-1, 7), episodes[chosen] / max(len(true_boxes), 1))


def _true_boxes(episode: Episode) -> FloatArray:
    return np.asarray(truth(episode, TASK).boxes)


def _metric(episode: Episode) -> PoseTable:
    poses = observed(episode)
    if poses.joints_m is None:
        raise DataError(f"episode {episode.episode_id} has poses in pixels only; this method needs metres")
    return poses


def _yaw(episode: Episode) -> float:
    return estimate_boundary(episode.sensor, depth_at_t0(episode), None).yaw_rad


def _fitted(settings: Settings, name: str) -> Usual:
    return fit_usual([(stops(_metric(e)), _true_boxes(e)) for e in training(settings, name)])


def _prepare_stops(settings: Settings) -> Predictor:
    usual = _fitted(settings, "stops")
    return lambda episode: usual.boxes(stops(_metric(episode)), _yaw(episode))


def _prepare_shuffled(settings: Settings) -> Predictor:
    name = "stops-shuffled"
    other_of, seeds = other_episodes(settings, name), Seeds(settings.seed).child("shuffled-activity")
    usual = _fitted(settings, name)

    def predict(episode: Episode) -> Boxes:
        boundary = estimate_boundary(episode.sensor, depth_at_t0(episode), _metric(episode))
        poses = shuffled_poses(_metric(other_of(episode)), boundary.corners, seeds.rng(episode.episode_id))
        return usual.boxes(stops(poses), boundary.yaw_rad)

    return predict


def _prepare_components(settings: Settings) -> Predictor:
    return components


def _prepare_constant(settings: Settings) -> Predictor:
    constant = fit_constant([_true_boxes(e) for e in training(settings, "best-constant")])
    return lambda episode: constant


METHODS = (
    Method(
        TASK,
        "stops",
        "poses+frames",
        "the usual object at every place where a person stopped, fitted on train",
        _prepare_stops,
        needs_train=True,
    ),
    Method(
        TASK,
        "stops-shuffled",
        "poses+frames",
        "stops of another episode's people, turned and clipped",
        _prepare_shuffled,
        control="shuffled-activity",
        needs_train=True,
    ),
    Method(
        TASK,
        "components",
        "frames",
        "boxes around connected parts of visible depth",
        _prepare_components,
        control="no-activity",
    ),
    Method(
        TASK,
        "best-constant",
        "frames",
        "the mean box of train at each place, scored by how often one is there",
        _prepare_constant,
        control="best-constant",
        needs_train=True,
    ),
)
