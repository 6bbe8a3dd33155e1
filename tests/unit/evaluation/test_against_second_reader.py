"""Four tasks against scorers that somebody wrote from the tasks' text alone, who had not seen ours.

Where the text leaves something open both chose alike, but for one: of a missing episode's cells without any label the
other reader counts all as wrong in ``exclusive/none``; ours scores an empty answer, as the task says.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.schema import AffordanceTruth
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.states import Action
from hsbench.truth.affordance_volumes import VolumeTruth
from tests.reference import second_reader_tasks as reader
from tests.unit.evaluation import test_score_action_recognition as actions
from tests.unit.evaluation import test_score_affordance as affordance
from tests.unit.evaluation import test_score_scene_reconstruction as reconstruction

SIDE = affordance.SIDE
LABELS = ("walkable", "sittable", "interactable")
ACTIONS = {Action.IGNORED: "", Action.STAND: "stand", Action.SIT: "sit", Action.INTERACT: "interact"}
SEEDS = st.integers(0, 2**32 - 1)


def drawn(seed: int, may_miss: bool) -> list[tuple[np.ndarray, np.ndarray, np.ndarray | None]]:
    """Bits, ignored cells and an answer of one to four episodes; labels or whole answers may be absent."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(int(rng.integers(1, 5))):
        bits = affordance.blobs(rng) & rng.choice(np.array([0xFF, 0b1011101, 0b11], dtype=np.uint8))
        answer = affordance.answers_of(rng, bits, float(rng.uniform(0.6, 1.7)))
        missing = may_miss and rng.random() < 0.2
        found.append((bits, rng.random(bits.shape) < rng.choice([0.0, 0.2]), None if missing else answer))
    return found


def planes(bits: np.ndarray) -> np.ndarray:
    return np.stack([(bits >> k & 1).astype(bool) for k in range(3)])


def agree(ours: Mapping[str, object], theirs: Mapping[str, float | None], names: Mapping[str, str]) -> None:
    for our_name, their_name in names.items():
        value, expected = ours[our_name].value, theirs[their_name]
        assert (value is None) == (expected is None), our_name
        assert value is None or value == pytest.approx(expected, abs=1e-12), our_name


PLAIN = {"mean-iou": "mean_iou", **{f"{label}/iou": label for label in LABELS}}
EXCLUSIVE = {f"exclusive/{label}/iou": f"exclusive/{label}" for label in ("none", *LABELS)}


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.booleans())
def test_affordance_topdown(seed: int, may_miss: bool) -> None:
    episodes = drawn(seed, may_miss)
    ours = affordance.report(
        affordance.PLAN,
        [(f"ep-{k}", "room", AffordanceTruth(bits, ignored)) for k, (bits, ignored, _) in enumerate(episodes)],
        {f"ep-{k}": answer for k, (_, _, answer) in enumerate(episodes) if answer is not None},
    ).metrics
    theirs = reader.topdown([(planes(bits), ignored, answer) for bits, ignored, answer in episodes])
    agree(ours, theirs, PLAIN)
    missed = any(answer is None for _, _, answer in episodes)
    agree(ours, theirs, {k: v for k, v in EXCLUSIVE.items() if not missed or "none" not in k})


@settings(max_examples=12, deadline=None)
@given(SEEDS)
def test_affordance_topdown_at_any_scale(seed: int) -> None:
    episodes = drawn(seed, True)[:2]
    ours = affordance.report(
        affordance.PLAN,
        [(f"ep-{k}", "room", AffordanceTruth(bits, ignored)) for k, (bits, ignored, _) in enumerate(episodes)],
        {f"ep-{k}": answer for k, (_, _, answer) in enumerate(episodes) if answer is not None},
    ).metrics
    theirs = reader.topdown_scale_free([(planes(bits), ignored, answer) for bits, ignored, answer in episodes])
    agree(ours, theirs, {f"scale-free/{ours_}": theirs_ for ours_, theirs_ in PLAIN.items()})


@settings(max_examples=60, deadline=None)
@given(SEEDS)
def test_affordance_view(seed: int) -> None:
    episodes = [
        (np.where(ignored, VIEW_UNSCORED, bits & 0b111).astype(np.uint8), a) for bits, ignored, a in drawn(seed, True)
    ]
    ours = affordance.report(
        affordance.VIEW,
        [(f"ep-{k}", "room", bits) for k, (bits, _) in enumerate(episodes)],
        {f"ep-{k}": answer for k, (_, answer) in enumerate(episodes) if answer is not None},
    ).metrics
    as_theirs = [(np.where(bits >= VIEW_UNSCORED, 255, bits).astype(np.uint8), answer) for bits, answer in episodes]
    agree(ours, reader.view(as_theirs), PLAIN)


@settings(max_examples=60, deadline=None)
@given(SEEDS)
def test_action_recognition(seed: int) -> None:
    rng = np.random.default_rng(seed)
    episodes = [(*actions.drawn(int(rng.integers(2**32))), rng.random() < 0.2) for _ in range(int(rng.integers(1, 4)))]
    ours = actions.report(
        [(f"ep-{k}", "room", true) for k, (true, _, _) in enumerate(episodes)],
        {f"ep-{k}": said for k, (_, said, missing) in enumerate(episodes) if not missing},
    ).metrics

    def names(values: np.ndarray) -> np.ndarray:
        return np.array([ACTIONS[Action(int(value))] for value in values])

    theirs = reader.action([(names(true.action), None if missing else names(said)) for true, said, missing in episodes])
    shared = {f"{label}/{kind}": f"{kind}/{label}" for label in ("stand", "sit", "interact") for kind in KINDS}
    agree(ours, theirs, {"macro-f1": "macro_f1", "accuracy": "accuracy", **shared})


KINDS = ("f1", "precision", "recall")


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_scene_reconstruction(seed: int) -> None:
    rng = np.random.default_rng(seed)
    episodes: list[tuple[VolumeTruth, np.ndarray, bool]] = []
    for _ in range(int(rng.integers(1, 3))):
        true, said = reconstruction.drawn(int(rng.integers(2**32)))
        columns = np.broadcast_to(rng.random(true.labels.shape[:2])[..., None] < 0.1, true.labels.shape)
        true = VolumeTruth(true.grid, true.labels, true.solid, columns.copy())
        episodes.append((true, said, rng.random() < 0.2))
    ours = reconstruction.report(
        [(f"ep-{k}", "room", true) for k, (true, _, _) in enumerate(episodes)],
        {f"ep-{k}": said for k, (_, said, missing) in enumerate(episodes) if not missing},
    ).metrics
    theirs = reader.reconstruction(
        [
            (true.labels.astype(int), true.ignored[:, :, 0], None if missing else said.astype(int))
            for true, said, missing in episodes
        ]
    )
    shared = {f"{label}/iou": f"iou/{label}" for label in (*LABELS, "wall")}
    agree(ours, theirs, {"mean-iou": "mean_iou", **shared})
