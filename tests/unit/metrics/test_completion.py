"""Scene completion: counted by hand, against plain loops, and by properties."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid
from hsbench.metrics import completion
from hsbench.metrics.completion import REGIONS, Counts, episode_counts, primary_mask, score
from hsbench.schema import CATEGORIES, OccupancyTruth, VoxelState, category
from tests.reference import completion_loop

STRUCTURE_IDS = {category(name).category_id for name in completion_loop.STRUCTURE_NAMES}
CHAIR, WALL = category("chair").category_id, category("wall").category_id


def random_truth(seed: int, shape: tuple[int, int, int] = (5, 4, 48)) -> OccupancyTruth:
    rng = np.random.default_rng(seed)
    semantic = np.where(rng.random(shape) < 0.5, rng.integers(1, len(CATEGORIES) + 1, shape), 0).astype(np.uint8)
    return OccupancyTruth(
        grid=VoxelGrid((0.0, -3.2, 0.0), shape, 0.05),
        semantic=semantic,
        instance=semantic.astype(np.uint16),
        state=rng.integers(0, 7, shape).astype(np.uint8),
        ignored=rng.random(shape) < 0.2,
        swept_s=np.where(rng.random(shape) < 0.5, rng.random(shape), np.inf).astype(np.float32),
    )


def test_eight_voxels_counted_by_hand() -> None:
    # a column of eight voxels of 0.3 m: centres 0.15 .. 1.95, 2.25
    semantic = np.array([CHAIR, CHAIR, 0, 0, WALL, CHAIR, 0, CHAIR], dtype=np.uint8).reshape(1, 1, 8)
    state = np.array([3, 3, 3, 3, 3, 2, 5, 3], dtype=np.uint8).reshape(1, 1, 8)
    swept = np.array([np.inf, np.inf, 1.0, np.inf, np.inf, np.inf, np.inf, np.inf], np.float32).reshape(1, 1, 8)
    prediction = np.array([1, 0, 1, 0, 1, 1, 1, 1], dtype=bool).reshape(1, 1, 8)
    truth = OccupancyTruth(
        VoxelGrid((0.0, 0.0, 0.0), (1, 1, 8), 0.3),
        semantic,
        semantic.astype(np.uint16),
        state,
        np.zeros((1, 1, 8), dtype=bool),
        swept,
    )
    assert episode_counts(truth, prediction) == {
        "occluded": Counts(tp=1, fp=1, fn=1, tn=1),
        "surface+occluded": Counts(tp=2, fp=1, fn=1, tn=1),
        "known": Counts(tp=2, fp=2, fn=1, tn=1),
        "everything": Counts(tp=4, fp=2, fn=1, tn=1),
        "occluded-full-height": Counts(tp=2, fp=1, fn=1, tn=1),
        "occluded-with-structure": Counts(tp=2, fp=1, fn=1, tn=1),
        "outside-frustum": Counts(tp=0, fp=1, fn=0, tn=0),
        "occluded-swept": Counts(tp=0, fp=1, fn=0, tn=0),
        "occluded-unswept": Counts(tp=1, fp=0, fn=1, tn=1),
    }


@pytest.mark.parametrize("seed", range(8))
def test_agrees_with_plain_loops_in_every_region(seed: int) -> None:
    truth = random_truth(seed)
    prediction = np.random.default_rng(seed + 100).random(truth.grid.shape) < 0.4
    for region, counts in episode_counts(truth, prediction).items():
        expected = completion_loop.count(
            region, truth.semantic, prediction, truth.state, truth.ignored, truth.swept_s, 0.0, 0.05, STRUCTURE_IDS
        )
        assert [counts.tp, counts.fp, counts.fn, counts.tn] == expected, region


def test_primary_mask_holds_the_voxels_of_the_primary_region() -> None:
    truth = random_truth(2)
    mask = primary_mask(truth)
    for here in np.ndindex(truth.grid.shape):
        values = truth.state[here], truth.semantic[here], (here[2] + 0.5) * 0.05, truth.ignored[here]
        assert mask[here] == completion_loop.belongs("occluded", *values, truth.swept_s[here], STRUCTURE_IDS)


@pytest.mark.parametrize(
    ("protocol", "region"),
    [
        ("hsbench-occluded", "occluded"),
        ("hsbench-surface-occluded", "surface+occluded"),
        ("hsbench-known", "known"),
        ("monoscene", "everything"),
    ],
)
def test_score_is_the_region_of_its_protocol(protocol: str, region: str) -> None:
    truth = random_truth(3)
    prediction = np.random.default_rng(4).random(truth.grid.shape) < 0.4
    got = score(truth.semantic, prediction, truth.state, protocol, ignored=truth.ignored)
    assert got.counts == episode_counts(truth, prediction)[region]
    assert got.protocol == protocol
    assert (got.iou, got.precision, got.recall) == (got.counts.iou, got.counts.precision, got.counts.recall)


@given(seed=st.integers(0, 2**32), shape=st.tuples(*(st.integers(1, 9),) * 3))
@settings(max_examples=40, deadline=None)
def test_truth_scores_exactly_one_and_its_complement_zero(seed: int, shape: tuple[int, int, int]) -> None:
    truth = random_truth(seed, shape)
    for counts in episode_counts(truth, truth.solid).values():
        assert counts.iou in (1.0, None)
        assert counts.fp == counts.fn == 0
    for counts in episode_counts(truth, ~truth.solid).values():
        assert counts.iou in (0.0, None)
        assert counts.tp == counts.tn == 0


@given(seed=st.integers(0, 2**32))
@settings(max_examples=20, deadline=None)
def test_regions_partition_and_voxel_order_never_matters(seed: int) -> None:
    truth = random_truth(seed)
    rng = np.random.default_rng(seed)
    prediction = rng.random(truth.grid.shape) < 0.3
    counts = episode_counts(truth, prediction)
    assert counts["occluded-swept"] + counts["occluded-unswept"] == counts["occluded"]
    x, y = rng.permutation(truth.grid.shape[0]), rng.permutation(truth.grid.shape[1])
    parts = (truth.semantic, truth.instance, truth.state, truth.ignored, truth.swept_s)
    moved = OccupancyTruth(truth.grid, *(part[x][:, y] for part in parts))
    assert episode_counts(moved, prediction[x][:, y]) == counts


def test_layout_in_memory_never_matters() -> None:
    truth = random_truth(1)
    prediction = truth.semantic > 9
    fortran = score(np.asfortranarray(truth.semantic), np.asfortranarray(prediction), np.asfortranarray(truth.state))
    assert fortran == score(truth.semantic, prediction, truth.state)


def test_undefined_is_none() -> None:
    shape = (2, 2, 2)
    state = np.full(shape, VoxelState.OCCLUDED, dtype=np.uint8)
    nothing = score(np.zeros(shape, np.uint8), np.zeros(shape, bool), state)
    assert (nothing.precision, nothing.recall, nothing.iou) == (None, None, None)
    assert nothing.counts == Counts(tn=8)
    missed = score(np.full(shape, CHAIR, np.uint8), np.zeros(shape, bool), state)
    assert (missed.precision, missed.recall, missed.iou) == (None, 0.0, 0.0)
    invented = score(np.zeros(shape, np.uint8), np.ones(shape, bool), state)
    assert (invented.precision, invented.recall, invented.iou) == (0.0, None, 0.0)


def test_predicting_structure_solid_costs_nothing() -> None:
    shape = (2, 2, 2)
    truth = np.full(shape, WALL, np.uint8)
    truth[0] = CHAIR
    state = np.full(shape, VoxelState.OCCLUDED, dtype=np.uint8)
    assert score(truth, np.ones(shape, bool), state).iou == 1.0
    assert score(truth, truth == CHAIR, state).iou == 1.0


def test_height_limit_is_two_metres_of_the_voxel_centre() -> None:
    # voxels of 0.5 m from -0.25: centres 0, 0.5, .., 2.0, 2.5: the floor's and the one above 2 m leave
    shape = (1, 1, 6)
    state = np.full(shape, VoxelState.OCCLUDED, dtype=np.uint8)
    z_m = np.arange(6) * 0.5
    assert score(np.full(shape, CHAIR, np.uint8), np.ones(shape, bool), state, z_m=z_m).counts == Counts(tp=4)


def test_bool_truth_keeps_everything_solid() -> None:
    state = np.full((1, 1, 2), VoxelState.OCCLUDED, dtype=np.uint8)
    assert score(np.ones((1, 1, 2), bool), np.ones((1, 1, 2), np.uint8), state).counts == Counts(tp=2)


def test_counts_beyond_float32_are_exact() -> None:
    big = Counts(tp=2**24 + 1, fp=1) + Counts(tp=2**53, fn=3)
    assert big.tp == 2**53 + 2**24 + 1
    assert big.recall == big.tp / (big.tp + 3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"protocol": "sscnet2"}, "expected one of hsbench-occluded, hsbench-surface-occluded, hsbench-known"),
        ({"state": None}, "state is missing"),
        ({"prediction": np.zeros((4, 4, 1), np.uint8)}, "a packed bit array"),
        ({"prediction": np.zeros((8, 4, 4), bool)}, "axes in another order"),
        ({"prediction": np.full((4, 4, 8), np.nan)}, "holds NaN; expected bool"),
        ({"prediction": np.zeros((4, 4, 8), np.float32)}, "choose a threshold first"),
        ({"prediction": np.full((4, 4, 8), -1)}, "prediction holds -1"),
        ({"prediction": [[[True]]]}, "prediction is a list"),
        ({"truth": np.full((4, 4, 8), 255, np.uint8)}, "pass them as ignored"),
        ({"truth": np.zeros((4, 4, 8))}, "expected category ids or bool"),
        ({"truth": np.zeros((2, 4, 4, 8), np.uint8)}, "one scene at a time"),
        ({"state": np.zeros((4, 4, 8), np.int64)}, "expected uint8"),
        ({"state": np.full((4, 4, 8), 7, np.uint8)}, "state holds 7"),
        ({"ignored": np.zeros((4, 4), bool)}, "ignored is bool (4, 4)"),
        ({"z_m": np.zeros(3)}, "expected (8,) metres"),
    ],
)
def test_bad_input_names_the_item_and_the_mistake(change: dict, message: str) -> None:
    arguments = {
        "truth": np.zeros((4, 4, 8), np.uint8),
        "prediction": np.zeros((4, 4, 8), bool),
        "state": np.zeros((4, 4, 8), np.uint8),
    } | change
    with pytest.raises(SchemaError) as error:
        score(**arguments)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_episode_counts_refuse_another_grid() -> None:
    with pytest.raises(SchemaError, match=r"prediction has shape \(5, 4, 47\)"):
        episode_counts(random_truth(0), np.zeros((5, 4, 47), bool))


def test_metrics_import_nothing_heavy() -> None:
    heavy = ("pandas", "cv2", "torch", "pyarrow", "scipy", "numba")
    modules = (
        "completion", "semantic_completion", "completion_protocols", "segmentation", "multilabel", "boundary", "action",
        "reconstruction", "curves", "ranking", "bootstrap",
    )  # fmt: skip
    code = (
        f"import sys, json, {', '.join(f'hsbench.metrics.{name}' for name in modules)};"
        f"print(json.dumps([m for m in {heavy} if m in sys.modules]))"
    )
    out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert json.loads(out) == []


def test_vectorised_ratios_agree_with_counts() -> None:
    table = np.array([[3, 1, 2, 9], [0, 0, 0, 5], [0, 2, 0, 0], [0, 0, 4, 1]])
    for name in ("iou", "precision", "recall"):
        got = getattr(completion, name)(table)
        expected = [getattr(Counts(*map(int, row)), name) for row in table]
        assert [None if np.isnan(v) else v for v in got] == expected


def test_every_region_is_in_the_specification() -> None:
    assert completion.__doc__ is not None
    assert all(f"``{region}``" in completion.__doc__ for region in REGIONS)
