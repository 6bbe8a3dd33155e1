"""Methods of task action-recognition: a table of what poses look like, alone and in context, and answers without them.

A pose is told by the height of its neck, by how far a hand reaches, and by the height of that hand; in context also by
how fast the person moves, and the answer is that of most poses around it. The table says the action under which a pose
of the kind is most probable, as if all actions were equally frequent, since macro F1 counts them alike.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hsbench.baselines.controls.fitted import truth
from hsbench.baselines.lift import lifted
from hsbench.baselines.method import Method, Predictor, Settings, observed, other_episodes, training
from hsbench.baselines.posture import postures
from hsbench.schema.episode import NS_PER_S, Episode
from hsbench.schema.poses import PoseTable
from hsbench.schema.states import Action
from hsbench.synth.seeds import Seeds
from hsbench.tasks.action_recognition import ACTION_RECOGNITION, LABELS
from hsbench.typing import AnyArray, FloatArray, Int32Array, IntArray, UInt8Array

TASK = ACTION_RECOGNITION.name
NECK_EDGES_M = np.arange(0.6, 1.7, 0.1)
REACH_EDGES_M = np.array([0.15, 0.25, 0.35, 0.45, 0.55])
HAND_EDGES_M = np.array([0.6, 0.8, 1.0, 1.2])  # heights
SPEED_EDGES_MPS = np.array([0.1, 0.3, 0.6])
UNKNOWN = 1  # bins more, for what is not known
STEP_S = 0.5  # over which a speed is taken
AROUND_S = 1.0  # of the poses of a track whose answers are pooled

Kinds = Callable[[PoseTable], IntArray]
"""Poses that have metres -> (N,) number of the kind of each."""


def _binned(values: FloatArray, edges: FloatArray) -> IntArray:
    return np.where(np.isfinite(values), np.searchsorted(edges, values), len(edges) + UNKNOWN)


def alone(poses: PoseTable) -> IntArray:
    """(N,) kind of each pose, from itself."""
    found = postures(poses)
    farther = np.argmax(np.nan_to_num(found.reach_m, nan=-1.0), axis=1)
    row = np.arange(len(farther))
    reach_m, hand_m = found.reach_m[row, farther], found.hands[row, farther, 2]
    neck, reached, hand = (
        _binned(values, edges)
        for values, edges in ((found.neck_m, NECK_EDGES_M), (reach_m, REACH_EDGES_M), (hand_m, HAND_EDGES_M))
    )
    return (neck * _kinds(REACH_EDGES_M) + reached) * _kinds(HAND_EDGES_M) + hand


def _kinds(*edges: FloatArray) -> int:
    return int(np.prod([len(e) + 1 + UNKNOWN for e in edges]))


KINDS_ALONE = _kinds(NECK_EDGES_M, REACH_EDGES_M, HAND_EDGES_M)
KINDS_IN_CONTEXT = _kinds(NECK_EDGES_M, REACH_EDGES_M, HAND_EDGES_M, SPEED_EDGES_MPS)


def in_context(poses: PoseTable) -> IntArray:
    """(N,) kind of each pose, from itself and the speed of its track."""
    return alone(poses) * _kinds(SPEED_EDGES_MPS) + _binned(speed(poses), SPEED_EDGES_MPS)


def speed(poses: PoseTable) -> FloatArray:
    """(N,) metres a second along the floor, from the places of the track ``STEP_S`` before and after; NaN unknown."""
    place = postures(poses).place[:, :2]
    seconds = poses.timestamp_ns / NS_PER_S
    result = np.full(len(poses), np.nan)
    for rows in tracks(poses.track_id):
        before = rows[np.maximum(np.searchsorted(seconds[rows], seconds[rows] - STEP_S), 0)]
        after = rows[np.searchsorted(seconds[rows], seconds[rows] + STEP_S, side="right") - 1]
        passed = seconds[after] - seconds[before]
        moved = np.linalg.norm(place[after] - place[before], axis=1)
        result[rows] = np.where(passed > 0, moved / np.where(passed > 0, passed, 1.0), np.nan)
    return result


def tracks(track_id: Int32Array) -> list[IntArray]:
    """The rows of each track, ascending."""
    order = np.argsort(track_id, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(track_id[order])) + 1) if len(order) else []


def pooled(action: UInt8Array, poses: PoseTable) -> UInt8Array:
    """(N,) the most frequent label of the track within ``AROUND_S`` around each pose; of equals the smaller."""
    seconds = poses.timestamp_ns / NS_PER_S
    result = action.copy()
    for rows in tracks(poses.track_id):
        first = np.searchsorted(seconds[rows], seconds[rows] - AROUND_S / 2)
        end = np.searchsorted(seconds[rows], seconds[rows] + AROUND_S / 2, side="right")
        said = np.cumsum(np.vstack([np.zeros(len(LABELS)), action[rows, None] == np.array(LABELS)]), axis=0)
        result[rows] = np.array(LABELS, dtype=np.uint8)[np.argmax(said[end] - said[first], axis=1)]
    return result


def fit_table(samples: list[tuple[IntArray, UInt8Array]], kinds: int) -> UInt8Array:
    """From (kind, true action) of the poses of each training episode, (kinds,) the action of each kind.

    A kind never seen in training has the most frequent action.
    """
    count = np.stack([sum(np.bincount(kind[action == a], minlength=kinds) for kind, action in samples) for a in LABELS])
    total = count.sum(axis=1, keepdims=True)
    table = np.argmax(count / np.maximum(total, 1), axis=0)
    table[count.sum(axis=0) == 0] = int(np.argmax(total))
    return np.array(LABELS, dtype=np.uint8)[table]


def _poses(episode: Episode) -> PoseTable:
    return lifted(observed(episode), episode.sensor)


def _actions(episode: Episode) -> UInt8Array:
    return np.asarray(truth(episode, TASK).action)


def _table(settings: Settings, name: str, kinds_of: Kinds, kinds: int) -> UInt8Array:
    return fit_table([(kinds_of(_poses(e)), _actions(e)) for e in training(settings, name)], kinds)


def _prepare_pose(settings: Settings) -> Predictor:
    table = _table(settings, "pose", alone, KINDS_ALONE)
    return lambda episode: table[alone(_poses(episode))]


def _prepare_context(settings: Settings) -> Predictor:
    table = _table(settings, "pose-context", in_context, KINDS_IN_CONTEXT)

    def predict(episode: Episode) -> UInt8Array:
        poses = _poses(episode)
        return pooled(table[in_context(poses)], poses)

    return predict


def _prepare_shuffled(settings: Settings) -> Predictor:
    """Row i of n is answered by the pose at the same share of another episode: turning it would change nothing."""
    name = "pose-context-shuffled"
    other_of, answer = other_episodes(settings, name), _prepare_context(settings)

    def predict(episode: Episode) -> UInt8Array:
        theirs = answer(other_of(episode))
        count = len(observed(episode))
        if not len(theirs):
            return np.full(count, Action.STAND, dtype=np.uint8)
        return np.asarray(theirs[np.arange(count) * len(theirs) // max(count, 1)])

    return predict


def _frequency(settings: Settings, name: str) -> AnyArray:
    actions = np.concatenate([_actions(e) for e in training(settings, name)])
    return np.array([(actions == a).sum() for a in LABELS])


def _prepare_drawn(settings: Settings) -> Predictor:
    """Labels drawn as often as on train: what is known of a pose that is not looked at."""
    frequency = _frequency(settings, "drawn")
    edges = np.cumsum(frequency / frequency.sum())[:-1]
    seeds = Seeds(settings.seed).child("drawn-actions")

    def predict(episode: Episode) -> UInt8Array:
        draws = seeds.rng(episode.episode_id).random(len(observed(episode)))
        return np.array(LABELS, dtype=np.uint8)[np.searchsorted(edges, draws, side="right")]

    return predict


def _prepare_majority(settings: Settings) -> Predictor:
    most = LABELS[int(np.argmax(_frequency(settings, "best-constant")))]
    return lambda episode: np.full(len(observed(episode)), most, dtype=np.uint8)


METHODS = (
    Method(
        TASK,
        "pose",
        "poses",
        "a table of neck height and reach of each pose alone, fitted on train",
        _prepare_pose,
        needs_train=True,
    ),
    Method(
        TASK,
        "pose-context",
        "poses",
        "the same with speed, and pooled over a second of the track",
        _prepare_context,
        needs_train=True,
    ),
    Method(
        TASK,
        "pose-context-shuffled",
        "poses",
        "pose-context's answers to another episode's poses",
        _prepare_shuffled,
        control="shuffled-activity",
        needs_train=True,
    ),
    Method(
        TASK,
        "drawn",
        "poses",
        "labels drawn as often as on train, without looking at a pose",
        _prepare_drawn,
        control="no-activity",
        needs_train=True,
    ),
    Method(
        TASK,
        "best-constant",
        "poses",
        "the most frequent label of train for every pose",
        _prepare_majority,
        control="best-constant",
        needs_train=True,
    ),
)
