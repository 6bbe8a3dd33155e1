"""Labels of solid voxels under hsbench's protocols: by hand, against plain loops, and by properties.

Other benchmarks' protocols are in ``test_completion_protocols``.
"""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid
from hsbench.metrics.completion import HEIGHTS_M, OWN_PROTOCOLS, Counts, breakdown, episode_counts
from hsbench.metrics.semantic_completion import aggregate, score
from hsbench.schema import CATEGORIES, OccupancyTruth, VoxelState, category
from tests.reference import completion_loop
from tests.unit.metrics.test_completion import STRUCTURE_IDS, random_truth

CHAIR, SOFA, WALL = (category(name).category_id for name in ("chair", "sofa", "wall"))
N = len(CATEGORIES) + 1


def test_six_voxels_by_hand() -> None:
    shape = (1, 1, 6)
    truth = np.array([CHAIR, CHAIR, SOFA, 0, WALL, CHAIR], np.uint8).reshape(shape)
    guess = np.array([CHAIR, SOFA, SOFA, CHAIR, CHAIR, CHAIR], np.uint8).reshape(shape)
    state = np.array([3, 3, 3, 3, 3, 2], np.uint8).reshape(shape)
    got = aggregate([score(truth, guess, state)])
    # the wall is not in the mask; chair: TP 1, union 0 1 3; sofa: TP 1, union 1 2
    assert got.class_iou[CHAIR - 1] == 1 / 3
    assert got.class_iou[SOFA - 1] == 1 / 2
    assert got.mean_iou == pytest.approx(5 / 12, abs=1e-15)
    classes = N - 1 - len(STRUCTURE_IDS)
    assert (got.undefined_classes, got.absent_classes, got.scenes) == (classes - 2, classes - 2, 1)
    both = aggregate([score(truth, guess, state, "hsbench-surface-occluded")])
    assert both.class_iou[CHAIR - 1] == 2 / 4


@pytest.mark.parametrize("protocol", OWN_PROTOCOLS)
def test_agrees_with_plain_loops(protocol: str) -> None:
    truth = random_truth(5)
    rng = np.random.default_rng(6)
    guess = np.where(rng.random(truth.grid.shape) < 0.5, truth.semantic, rng.integers(0, N, truth.grid.shape))
    got = score(truth.semantic, guess, truth.state, protocol, ignored=truth.ignored)
    expected = np.zeros((N, N), int)
    for here in np.ndindex(truth.grid.shape):
        values = truth.state[here], truth.semantic[here], (here[2] + 0.5) * 0.05, truth.ignored[here], 0.0
        if completion_loop.belongs(OWN_PROTOCOLS[protocol], *values, STRUCTURE_IDS):
            expected[truth.semantic[here], guess[here]] += 1
    assert np.array_equal(got.confusion, expected)


def test_truth_is_perfect_and_structure_predicted_elsewhere_spoils_no_mean() -> None:
    truth = random_truth(7)
    got = aggregate([score(truth.semantic, truth.semantic, truth.state)])
    assert got.mean_iou == 1.0
    assert set(got.class_iou) <= {1.0, None}
    walls = np.where(truth.semantic == 0, WALL, truth.semantic)
    assert aggregate([score(truth.semantic, walls, truth.state)]).mean_iou == 1.0  # free voxels are in no mean


def test_scenes_are_pooled() -> None:
    a, b = random_truth(8), random_truth(9)
    guesses = [np.roll(t.semantic, 1, axis=0) for t in (a, b)]
    parts = [score(t.semantic, g, t.state) for t, g in zip((a, b), guesses, strict=True)]
    joined = score(*(np.concatenate(pair) for pair in ((a.semantic, b.semantic), guesses, (a.state, b.state))))
    assert aggregate(parts).class_iou == aggregate([joined]).class_iou
    assert aggregate(parts).mean_iou == aggregate([joined]).mean_iou


@pytest.mark.parametrize("seed", range(4))
def test_breakdown_adds_up_and_agrees_with_loops(seed: int) -> None:
    truth = random_truth(seed)
    guess = np.random.default_rng(seed + 50).random(truth.grid.shape) < 0.4
    got, whole = breakdown(truth, guess), episode_counts(truth, guess)
    assert got["seen"] + got["swept"] + got["never-observed"] == whole["known"]
    bands = [counts for name, counts in got.items() if name.endswith(" m")]
    assert len(bands) == len(HEIGHTS_M) - 1
    assert sum(bands, Counts()) == whole["occluded"]
    loop = dict.fromkeys(("seen", "swept", "never-observed", "1.0-1.5 m"), 0)
    for here in np.ndindex(truth.grid.shape):
        state, swept, height = truth.state[here], truth.swept_s[here], (here[2] + 0.5) * 0.05
        values = truth.semantic[here], height, truth.ignored[here], swept, STRUCTURE_IDS
        if completion_loop.belongs("known", state, *values):
            seen = state in (VoxelState.FREE, VoxelState.SURFACE)
            loop["seen" if seen else "swept" if np.isfinite(swept) else "never-observed"] += 1
        if completion_loop.belongs("occluded", state, *values) and 1.0 < height <= 1.5:
            loop["1.0-1.5 m"] += 1
    assert {name: got[name].total for name in loop} == loop


def test_band_limits_belong_to_the_lower_band() -> None:
    grid = VoxelGrid((0.0, 0.0, -0.25), (1, 1, 4), 0.5)  # centres 0, .5, 1, 1.5
    ones = np.ones((1, 1, 4), np.uint8)
    truth = OccupancyTruth(
        grid, CHAIR * ones, ones.astype(np.uint16), int(VoxelState.OCCLUDED) * ones, ones == 0, ones.astype(np.float32)
    )
    got = breakdown(truth, ones == 1, (0.0, 0.5, 1.5))
    assert (got["0.0-0.5 m"], got["0.5-1.5 m"]) == (Counts(tp=1), Counts(tp=2))


SHAPE = (2, 2, 4)
ZEROS = np.zeros(SHAPE, np.uint8)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: score(ZEROS, ZEROS, ZEROS, "ssc"), "expected one of hsbench-occluded"),
        (lambda: score(ZEROS, ZEROS, None), "state is missing"),
        (lambda: score(ZEROS > 0, ZEROS, ZEROS), "truth is bool; expected labels"),
        (lambda: score(ZEROS, ZEROS.astype(float), ZEROS), "take the argmax first"),
        (
            lambda: score(ZEROS, ZEROS + 255, ZEROS),
            f"prediction holds 255 at [0, 0, 0]; expected 0..{N - 1} (only truth",
        ),
        (lambda: score(ZEROS, np.zeros((*SHAPE, 38)), ZEROS), "take the argmax first"),
        (lambda: score(ZEROS, ZEROS, ZEROS, n_classes=12), f"n_classes is 12; expected {N}, the category table"),
        (lambda: score(ZEROS, ZEROS, ZEROS, "sscnet", n_classes=1), "n_classes is 1; expected an integer of 2..255"),
        (lambda: score(ZEROS + 12, ZEROS, ZEROS + 3, "sscnet", n_classes=12), "truth holds 12"),
        (lambda: score(ZEROS, ZEROS, ZEROS, "sscnet", z_m=np.zeros(4)), "evaluates all heights"),
        (lambda: score(ZEROS, ZEROS, ZEROS, z_m=np.zeros(3)), "expected (4,) metres"),
        (lambda: aggregate([]), "expected scenes of one protocol"),
        (lambda: breakdown(random_truth(0), np.zeros((5, 4, 48), bool), (1.0, 0.5)), "ascending heights"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)
