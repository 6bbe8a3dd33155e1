"""Other benchmarks' completion protocols: the scorers' own answers, plain loops, hand-worked voxels, their quirks."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.metrics import completion, completion_protocols, semantic_completion
from hsbench.metrics.completion import PROTOCOLS, Counts, aggregate, score
from hsbench.metrics.completion_protocols import FOREIGN
from hsbench.schema import VoxelState
from tests.reference import completion_inputs, completion_protocol_loop

ANSWERS = json.loads((Path(__file__).parents[2] / "reference" / "completion_scorers.json").read_text())["answers"]
CASES = [(protocol, which) for protocol in FOREIGN for which in completion_inputs.SETS]
RATIOS = ("precision", "recall", "iou")
S = VoxelState


def states(protocol: str, scene: dict[str, np.ndarray]) -> np.ndarray | None:
    if protocol == "sscnet":
        return completion_protocols.states_from_sscnet(scene["vol"])
    if protocol == "aicnet":
        return completion_protocols.states_from_tsdf(scene["tsdf"])
    if protocol == "3dsketch":
        return completion_protocols.states_from_sketch(scene["label_weight"], scene["mapping"])
    if protocol == "semantic-kitti":
        return completion_protocols.states_from_invalid(scene["invalid"])
    return None


def summaries(protocol: str, scenes: list[dict[str, np.ndarray]]):
    parts = [(scene["label"], scene["prediction"], states(protocol, scene), protocol) for scene in scenes]
    plain = aggregate([score(*part) for part in parts])
    n = completion_inputs.N_CLASSES
    semantic = semantic_completion.aggregate([semantic_completion.score(*part, n_classes=n) for part in parts])
    return plain, semantic


def agree(got: float | None, expected: float | None, tolerance: float) -> bool:
    return got is expected if None in (got, expected) else abs(got - expected) <= tolerance


@pytest.mark.parametrize(("protocol", "which"), CASES)
def test_the_scorers_own_answers(protocol: str, which: str) -> None:
    plain, semantic = summaries(protocol, completion_inputs.scenes(which))
    expected = ANSWERS[protocol][which]
    for name in RATIOS:
        assert agree(getattr(plain, name), expected[name], 1e-12), name
    tolerance = 2e-7 if protocol == "aicnet" else 1e-12  # it sums in float32
    assert len(semantic.class_iou) == len(expected["class_iou"]) == 11
    for number, (got, want) in enumerate(zip(semantic.class_iou, expected["class_iou"], strict=True), start=1):
        assert agree(got, want, tolerance), number
    assert agree(semantic.mean_iou, expected["mean_iou"], tolerance)
    assert plain.verified_by == semantic.verified_by == FOREIGN[protocol].verified_by


@pytest.mark.parametrize(("protocol", "which"), CASES)
def test_plain_loops(protocol: str, which: str) -> None:
    scenes = completion_inputs.scenes(which)
    plain, semantic = summaries(protocol, scenes)
    for name, want in zip(RATIOS, completion_protocol_loop.completion(protocol, scenes), strict=True):
        assert agree(getattr(plain, name), want, 1e-12), name
    classes, mean = completion_protocol_loop.semantic(protocol, scenes, completion_inputs.N_CLASSES)
    assert all(agree(g, w, 1e-12) for g, w in zip(semantic.class_iou, classes, strict=True))
    assert agree(semantic.mean_iou, mean, 1e-12)


# eight voxels by hand: truth, prediction, state
#              0    1    2    3    4    5    6    7
TRUTH = np.array([1, 2, 0, 0, 1, 255, 255, 2]).reshape(1, 1, 8)
GUESS = np.array([1, 1, 2, 0, 0, 1, 2, 2]).reshape(1, 1, 8)
STATE = np.array(
    [S.OCCLUDED, S.OCCLUDED, S.OCCLUDED, S.SURFACE, S.SURFACE, S.OCCLUDED, S.UNKNOWN, S.FREE], np.uint8
).reshape(1, 1, 8)


@pytest.mark.parametrize(
    ("protocol", "counts"),
    [
        ("sscnet", Counts(tp=2, fp=2, fn=0, tn=0)),  # occluded: 0 1 2 and unlabelled 5, which is empty
        ("aicnet", Counts(tp=2, fp=1, fn=1, tn=1)),  # occluded and surface with a label: 0 1 2 3 4
        ("3dsketch", Counts(tp=2, fp=1, fn=0, tn=0)),  # occluded with a label: 0 1 2
        ("monoscene", Counts(tp=3, fp=1, fn=1, tn=1)),  # every label: 0 1 2 3 4 7
        ("semantic-kitti", Counts(tp=3, fp=1, fn=1, tn=1)),
    ],
)
def test_eight_voxels_by_hand(protocol: str, counts: Counts) -> None:
    assert score(TRUTH, GUESS, STATE, protocol).counts == counts


@pytest.mark.parametrize(
    ("protocol", "class_iou", "mean"),
    [
        # sscnet: 0 1 2 3 4 5. class 1: TP 0; truth 0 4, predicted 0 1 5 -> 1/4. class 2: truth 1, predicted 2 -> 0
        ("sscnet", (1 / 4, 0.0), 1 / 8),
        # without 5: class 1: truth 0 4, predicted 0 1 -> 1/3
        ("aicnet", (1 / 3, 0.0), 1 / 6),
        ("3dsketch", (1 / 3, 0.0), 1 / 6),
        # with 7 (2, 2): class 2: truth 1 7, predicted 2 7 -> 1/3
        ("monoscene", (1 / 3.00001, 1 / 3.00001), 1 / 3.00001),
        ("semantic-kitti", (1 / 3, 1 / 3), 1 / 3),
    ],
)
def test_eight_voxels_with_labels_by_hand(protocol: str, class_iou: tuple[float, ...], mean: float) -> None:
    got = semantic_completion.aggregate([semantic_completion.score(TRUTH, GUESS, STATE, protocol, n_classes=3)])
    assert got.class_iou == pytest.approx(class_iou, abs=1e-14)
    assert got.mean_iou == pytest.approx(mean, abs=1e-14)


def one(protocol: str, truth: int, guess: int):
    shape = (2, 2, 2)
    state = np.full(shape, S.OCCLUDED, np.uint8)
    got = score(np.full(shape, truth), np.full(shape, guess), state, protocol)
    return got.precision, got.recall, got.iou


def test_ratios_without_denominator_follow_each_source() -> None:
    nothing = {p: one(p, 0, 0) for p in FOREIGN}
    assert nothing["sscnet"] == (0.0, 0.0, None)
    assert nothing["aicnet"] == nothing["monoscene"] == (0.0, 0.0, 0.0)
    assert nothing["3dsketch"] == (None, None, None)
    assert nothing["semantic-kitti"] == (0.0, 0.0, None)
    invented = {p: one(p, 0, 1) for p in FOREIGN}
    assert invented["sscnet"] == invented["aicnet"] == invented["monoscene"] == (0.0, 0.0, 0.0)
    assert invented["3dsketch"] == (0.0, None, 0.0)
    assert invented["semantic-kitti"] == (0.0, 0.0, 0.0)


def test_an_undefined_scene_spoils_the_mean_of_sscnet_and_is_counted() -> None:
    shape = (1, 1, 2)
    state = np.full(shape, S.OCCLUDED, np.uint8)
    full, empty = np.ones(shape, int), np.zeros(shape, int)
    got = aggregate([score(full, full, state, "sscnet"), score(empty, empty, state, "sscnet")])
    assert (got.precision, got.recall, got.iou) == (0.5, 0.5, None)
    assert (got.scenes, got.undefined_scenes, got.counts) == (2, (0, 0, 1), Counts(tp=2, tn=2))
    pooled = aggregate([score(full, full, state, "3dsketch"), score(empty, empty, state, "3dsketch")])
    assert (pooled.iou, pooled.undefined_scenes) == (1.0, (1, 1, 1))


@pytest.mark.parametrize("protocol", FOREIGN)
def test_truth_as_prediction_is_perfect(protocol: str) -> None:
    scenes = completion_inputs.scenes("full")
    for scene in scenes:
        scene["prediction"] = np.where(scene["label"] == 255, 0, scene["label"])
    plain, semantic = summaries(protocol, scenes)
    # what monoscene and semantic-kitti add below the fraction is smaller than this
    tolerance = {"monoscene": 1e-6, "semantic-kitti": 1e-8}.get(protocol, 0.0)
    for value in (plain.precision, plain.recall, plain.iou, semantic.mean_iou, *semantic.class_iou):
        assert abs(value - 1.0) <= tolerance
    assert all(value <= 1.0 for value in semantic.class_iou)


@pytest.mark.parametrize("protocol", FOREIGN)
def test_order_of_voxels_dtype_and_memory_change_nothing(protocol: str) -> None:
    scene = completion_inputs.scenes("full")[0]
    label, guess, state = scene["label"], scene["prediction"], states(protocol, scene)
    expected = score(label, guess, state, protocol)
    order = np.random.default_rng(0).permutation(label.size)

    def moved(array: np.ndarray | None) -> np.ndarray | None:
        return None if array is None else array.ravel()[order].reshape(array.shape)

    assert score(moved(label), moved(guess), moved(state), protocol) == expected
    assert score(label.astype(np.uint8), guess.astype(np.int16), state, protocol) == expected
    assert score(label.astype(np.uint8), guess > 0, state, protocol) == expected
    fortran = [None if a is None else np.asfortranarray(a) for a in (label, guess, state)]
    assert score(*fortran, protocol) == expected


def test_ignored_voxels_are_unlabelled() -> None:
    unlabelled = TRUTH == 255
    truth = np.where(unlabelled, 0, TRUTH)
    for protocol in FOREIGN:
        got = score(truth, GUESS, STATE, protocol, ignored=unlabelled)
        assert got == score(TRUTH, GUESS, STATE, protocol)


def test_states_of_every_source() -> None:
    vol = np.array([-1, -0.5, 0, 0.3, 1, -2, -3, -4, -5])
    assert completion_protocols.states_from_sscnet(vol).tolist() == [
        S.OCCLUDED, S.OCCLUDED, S.SURFACE, S.SURFACE, S.FREE, S.MISSING_DEPTH, S.OUTSIDE_FOV, S.OUTSIDE_ROOM,
        S.OUTSIDE_ROOM,
    ]  # fmt: skip
    tsdf = np.array([1, 0.001, 0.0005, -0.4, 0.5], np.float32)
    assert completion_protocols.states_from_tsdf(tsdf).tolist() == [S.SURFACE, S.FREE, S.OCCLUDED, S.OCCLUDED, S.FREE]
    got = completion_protocols.states_from_sketch(np.array([0, 1, 1.0]), np.array([307200, 307200, 5]))
    assert got.tolist() == [S.FREE, S.OCCLUDED, S.SURFACE]
    assert completion_protocols.states_from_invalid(np.array([0, 1])).tolist() == [S.FREE, S.UNKNOWN]


def test_an_unverified_protocol_would_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    assert all(completion.verification(protocol) for protocol in PROTOCOLS)
    made_up = completion_protocols.Protocol(
        "made-up", "", frozenset({S.OCCLUDED}), frozenset({S.OCCLUDED}), "ignored", "pooled", True, None
    )
    monkeypatch.setitem(FOREIGN, "made-up", made_up)
    assert completion.verification("made-up") is None


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: score(TRUTH, GUESS, None, "sscnet"), "state is missing; protocol sscnet"),
        (lambda: score(TRUTH, GUESS, STATE, "aicnet", z_m=np.zeros(8)), "z_m is given; protocol aicnet"),
        (lambda: score(TRUTH, np.where(GUESS == 2, 255, GUESS), STATE, "sscnet"), "prediction holds 255"),
        (lambda: score(TRUTH + 1, GUESS, STATE, "monoscene"), "truth holds 256"),
        (lambda: score(TRUTH[0], GUESS, STATE, "monoscene"), "one scene at a time"),
        (lambda: score(TRUTH, GUESS, STATE.astype(int), "sscnet"), "expected uint8"),
        (lambda: aggregate([]), "expected one scene or more"),
        (
            lambda: aggregate([score(TRUTH, GUESS, STATE, "sscnet"), score(TRUTH, GUESS, STATE, "aicnet")]),
            "['aicnet', 'sscnet']",
        ),
        (lambda: completion_protocols.states_from_sscnet(np.array([0.5, 7.0])), "vol holds 7.0"),
        (lambda: completion_protocols.states_from_sscnet(np.array([np.nan])), "NaN"),
        (lambda: completion_protocols.states_from_invalid(np.array([0, 255], np.uint8)), "unpack them first"),
        (lambda: completion_protocols.states_from_sketch(np.ones(3), np.ones(4)), "expected (3,) as label_weight"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)


def test_every_protocol_is_in_the_specification() -> None:
    assert all(f"``{protocol}``" in completion_protocols.__doc__ for protocol in FOREIGN)
    assert all(f"``{protocol}``" in completion.__doc__ for protocol in PROTOCOLS)
