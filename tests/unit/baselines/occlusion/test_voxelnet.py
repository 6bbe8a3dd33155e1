"""The network of scene completion: what it sees, what it is told to answer, and its methods end to end."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from hsbench import load
from hsbench.baselines.method import Settings
from hsbench.baselines.model_card import bundled, read_card
from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.voxelnet import METHODS
from hsbench.baselines.occlusion.voxelnet_features import (
    BEHIND_M,
    FULL,
    TRUNCATION_M,
    Depth,
    depth_features,
    evidence,
)
from hsbench.baselines.run import predict
from hsbench.errors import DataError
from hsbench.schema.episode import Episode, Frame, FrameList
from hsbench.schema.states import Action, VoxelState
from hsbench.submission import Predictions, check, open_submission
from hsbench.tasks import task
from hsbench.tasks.scene_completion import GRID

torch = pytest.importorskip("torch")

from hsbench.baselines.occlusion.voxelnet_network import (  # noqa: E402
    NetworkConfig,
    VoxelNet,
    completion_loss,
    planes,
)
from hsbench.baselines.occlusion.voxelnet_training import (  # noqa: E402
    Example,
    answers,
    example,
    load_network,
    mirrored,
    problem,
)
from hsbench.baselines.training import TrainConfig, save_weights, train  # noqa: E402

SPEC = task("scene-completion")
METHOD = {method.name: method for method in METHODS}
NARROW = NetworkConfig(widths=(4, 4, 4, 4))
CONFIG = NARROW.carving


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    """Threads that wait for one another on a busy machine take longer than one."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def episode(rgbd: Path) -> Episode:
    return load(rgbd, "val", truth=True)[0]


@pytest.fixture(scope="module")
def item(episode: Episode) -> Example:
    return example(episode, NARROW)


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Files of untrained networks: method -> file."""
    home = tmp_path_factory.mktemp("weights")
    made = {}
    for name, activity in (("voxelnet", True), ("voxelnet-alone", False)):
        torch.manual_seed(5)
        config = replace(NARROW, activity=activity)
        card = {"model": name, "network": asdict(config), "data": {"name": "rgbd-activity"}, "curve": []}
        made[name] = home / f"{name}.safetensors"
        save_weights(made[name], VoxelNet(config), card)
    made["voxelnet-shuffled"] = made["voxelnet"]
    return made


# ---------------------------------------------------------------- features


def test_the_flipped_distance_is_the_distance_to_the_nearest_surface(item: Example) -> None:
    depth, centres = item.depth, GRID.centres()
    tree = cKDTree(centres[depth.states == VoxelState.SURFACE])
    rows = np.random.default_rng(0).choice(centres.size // 3, 20_000, replace=False)
    away_m, _ = tree.query(centres.reshape(-1, 3)[rows])
    state, found = depth.states.ravel()[rows], depth.distance.ravel()[rows].astype(float)
    expected = np.maximum(FULL * (1 - away_m / TRUNCATION_M), 0)
    expected[state == VoxelState.OCCLUDED] *= -1
    expected[state == VoxelState.OUTSIDE_FOV] = 0
    assert np.abs(found - expected).max() <= 0.5 + 1e-9
    assert (depth.distance[depth.states == VoxelState.SURFACE] == FULL).all()


def test_behind_agrees_with_what_is_hidden(item: Example) -> None:
    """A voxel that is occluded lies behind, by more than the margin that states have; one that is free lies before."""
    behind_m = item.depth.behind / FULL * BEHIND_M
    step_m = BEHIND_M / FULL
    assert (behind_m[item.depth.states == VoxelState.OCCLUDED] > 0).all()
    assert (behind_m[item.depth.states == VoxelState.FREE] < 0).all()
    assert (np.abs(behind_m[item.depth.states == VoxelState.SURFACE]) < 0.0434 + step_m).all()
    assert (behind_m[item.depth.states == VoxelState.OUTSIDE_FOV] == 0).all()


def test_activity_channels_are_where_bodies_and_seats_are() -> None:
    """One who stands at (2, 1) and one who sits at (4, -1) with the pelvis at .6 m, each for long."""
    stand, sit = np.tile([2.0, 1.0], (20, 1)), np.tile([4.0, -1.0], (20, 1))
    activity = Activity(
        np.r_[stand, sit],
        np.repeat([Action.STAND, Action.SIT], 20).astype(np.uint8),
        np.r_[np.full(20, 0.95), np.full(20, 0.6)],
    )
    blank = np.zeros(GRID.shape)
    nothing = Depth(blank.astype(np.uint8), blank.astype(np.int8), blank.astype(np.int8))
    found = planes([nothing], [evidence(activity, CONFIG)], NARROW)[0].numpy()
    x, y, z = np.moveaxis(GRID.centres(), -1, 0)
    seat_m = 0.6 - CONFIG.pelvis_over_seat_m
    by_stand = np.hypot(x - 2, y - 1) <= CONFIG.body_radius_m
    by_sit = np.hypot(x - 4, y + 1) <= CONFIG.body_radius_m
    assert np.array_equal(found[4], by_stand & (z <= CONFIG.stand_top_m))
    assert np.array_equal(found[5], by_sit & (z > seat_m) & (z <= seat_m + CONFIG.sit_clear_m))
    assert np.array_equal(found[6], by_sit & (z <= seat_m))
    assert not found[:3].any()
    assert np.allclose(found[3], z / BEHIND_M)


def test_a_mirrored_example_has_mirrored_planes(item: Example) -> None:
    other = mirrored(item)
    ours, theirs = (planes([e.depth], [e.activity], NARROW) for e in (other, item))
    assert torch.equal(ours, theirs.flip(3))
    assert np.array_equal(other.target.solid, item.target.solid[:, ::-1])
    assert np.array_equal(other.target.mask, item.target.mask[:, ::-1])
    twice = mirrored(other)
    assert np.array_equal(twice.depth.distance, item.depth.distance)


# ---------------------------------------------------------------- network


def test_eight_answers_of_a_block_go_to_its_eight_voxels() -> None:
    model = VoxelNet(NARROW)
    with torch.no_grad():
        model.head.weight.zero_()
        model.head.bias.copy_(torch.arange(8.0))
        logits = model(torch.randn(2, 7, 32, 16, 16))
    x, y, z = np.indices((32, 16, 16))
    assert logits.shape == (2, 32, 16, 16)
    assert np.array_equal(logits[1].numpy(), 4 * (x % 2) + 2 * (y % 2) + z % 2)


def test_an_answer_depends_on_its_own_episode_alone(item: Example) -> None:
    torch.manual_seed(1)
    model = VoxelNet(NARROW).eval()
    other = mirrored(item)
    with torch.inference_mode():
        alone = model(planes([item.depth], [item.activity], NARROW))
        beside = model(planes([other.depth, item.depth], [other.activity, item.activity], NARROW))
    assert torch.allclose(alone[0], beside[1], atol=1e-3)  # sums of 100 000 voxels in float32, in another order


def test_the_loss_by_hand_and_without_a_voxel() -> None:
    rng = np.random.default_rng(2)
    logits, mask, solid = rng.normal(size=(2, 3, 4, 5)), rng.random((2, 3, 4, 5)) < 0.5, rng.random((2, 3, 4, 5)) < 0.3
    p = 1 / (1 + np.exp(-logits[mask]))
    y = solid[mask].astype(float)
    entropy = -(y * np.log(p) + (1 - y) * np.log(1 - p)).mean()
    soft_iou = (p * y).sum() / (p + y - p * y).sum()
    tensor = torch.tensor(logits, requires_grad=True)
    found = completion_loss(tensor, torch.from_numpy(mask), torch.from_numpy(solid))
    assert found.item() == pytest.approx(entropy + 1 - soft_iou, rel=1e-6)
    found.backward()
    assert not tensor.grad[~torch.from_numpy(mask)].any()  # only voxels of the mask teach
    sure = torch.where(torch.from_numpy(solid), 50.0, -50.0)
    assert completion_loss(sure, torch.from_numpy(mask), torch.from_numpy(solid)).item() < 1e-6
    assert torch.isfinite(completion_loss(tensor, torch.zeros_like(tensor, dtype=torch.bool), torch.from_numpy(solid)))


# ---------------------------------------------------------------- training


def test_it_learns_and_a_resumed_run_is_the_same(rgbd: Path, item: Example, tmp_path: Path) -> None:
    other = example(load(rgbd, "val", truth=True)[1], NARROW)
    config = TrainConfig(epochs=2, batch=1, learning_rate=1e-2, seed=1)
    whole, broken = tmp_path / "whole.safetensors", tmp_path / "broken.safetensors"
    steps = list(train(problem("voxelnet", [item, other], [item], NARROW, 1), config, whole))
    curve = steps[-1].curve
    assert curve[-1]["loss"] < curve[0]["loss"]
    run = train(problem("voxelnet", [item, other], [item], NARROW, 1), config, broken)
    list(islice(run, 3))
    run.close()
    list(train(problem("voxelnet", [item, other], [item], NARROW, 1), config, broken, resume=True))
    assert whole.read_bytes() == broken.read_bytes()
    assert whole.stat().st_size < 8e6
    said = answers(load_network(whole, activity=True), item.depth, item.activity)[item.target.mask]
    solid = item.target.solid[item.target.mask]
    assert curve[-1]["val_iou"] == pytest.approx((said & solid).sum() / max((said | solid).sum(), 1), abs=1e-12)


# ---------------------------------------------------------------- methods


def answered(folder: Path, ids: tuple[str, ...]) -> dict[str, np.ndarray]:
    with open_submission(folder) as files:
        predictions = Predictions(files, SPEC)
        return {i: predictions.get(i) for i in ids}


def test_methods_end_to_end(rgbd: Path, weights: dict[str, Path], tmp_path: Path) -> None:
    data = load(rgbd, "val")
    got = {}
    for name, method in METHOD.items():
        out = tmp_path / name
        assert tuple(predict(method, data, out, weights=weights[name])) == data.episode_ids
        assert check(out, SPEC, data.episode_ids) == []
        metadata = json.loads((out / "submission.json").read_text())
        assert (metadata["method"], metadata["track"]) == (name, method.track)
        assert metadata["training_data"] == ["rgbd-activity/train"]
        got[name] = answered(out, data.episode_ids)
    for episode in data:
        states = depth_features(episode).states
        for name in METHOD:
            said = got[name][episode.episode_id]
            assert said[states == VoxelState.SURFACE].all()
            assert not said[(states != VoxelState.SURFACE) & (states != VoxelState.OCCLUDED)].any()
    assert any((got["voxelnet"][i] != got["voxelnet-shuffled"][i]).any() for i in data.episode_ids)
    again = tmp_path / "again"
    list(predict(METHOD["voxelnet-shuffled"], data, again, weights=weights["voxelnet"]))
    for file in (tmp_path / "voxelnet-shuffled").rglob("*.npz"):
        assert (again / file.relative_to(tmp_path / "voxelnet-shuffled")).read_bytes() == file.read_bytes()


def test_the_network_alone_does_not_look_at_poses(rgbd: Path, episode: Episode, weights: dict[str, Path]) -> None:
    answer = METHOD["voxelnet-alone"].prepare(Settings(load(rgbd, "val"), None, weights=weights["voxelnet-alone"]))
    assert np.array_equal(answer(episode), answer(replace(episode, poses=None, truth=None)))


@pytest.mark.parametrize("name", METHOD)
def test_odd_episodes_have_answers_or_one_line(
    name: str, rgbd: Path, episode: Episode, weights: dict[str, Path]
) -> None:
    answer = METHOD[name].prepare(Settings(load(rgbd, "val"), None, weights=weights[name]))
    nobody = replace(episode, poses=episode.poses.select(np.zeros(len(episode.poses), bool)), truth=None)
    for odd in (nobody, episode.until(0.0)):
        said = answer(odd)
        assert (said.shape, said.dtype) == (GRID.shape, np.bool_)
        assert said.any()
    shape = episode.frames[0].depth_m.shape
    blind = FrameList((Frame(0, None, np.zeros(shape, np.float32)),))
    assert not answer(replace(episode, frames=blind, truth=None)).any()
    with pytest.raises(DataError, match="has no frame, so no depth"):
        answer(replace(episode, frames=FrameList(), truth=None))
    if name == "voxelnet":
        with pytest.raises(DataError, match="no observed poses"):
            answer(replace(episode, poses=None, truth=None))


def test_weights_of_another_kind_are_one_line(rgbd: Path, weights: dict[str, Path], tmp_path: Path) -> None:
    data = load(rgbd, "val")
    with pytest.raises(DataError, match="expected a network trained without activity"):
        METHOD["voxelnet-alone"].prepare(Settings(data, None, weights=weights["voxelnet"]))
    with pytest.raises(DataError, match="expected a network trained with activity"):
        METHOD["voxelnet"].prepare(Settings(data, None, weights=weights["voxelnet-alone"]))
    save_weights(tmp_path / "line.safetensors", torch.nn.Linear(1, 1), {"model": "line", "curve": []})
    with pytest.raises(DataError, match="weights of line; expected weights of a voxelnet"):
        METHOD["voxelnet"].prepare(Settings(data, None, weights=tmp_path / "line.safetensors"))
    with pytest.raises(DataError, match=r"nowhere: there are no weights \(hsbench train writes them\)"):
        list(predict(METHOD["voxelnet"], data, tmp_path / "out", weights=tmp_path / "nowhere"))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["voxelnet", "voxelnet-alone"])
def test_the_weights_that_come_with_hsbench(name: str) -> None:
    card = read_card(bundled(name))
    assert bundled(name).stat().st_size < 8e6
    assert card == json.loads(bundled(name).with_suffix(".json").read_text(encoding="utf-8"))
    assert card["model"] == name
    assert card["data"]["name"] == "rgbd-activity"
    assert [entry["epoch"] for entry in card["curve"]] == list(range(1, card["config"]["epochs"] + 1))
    load_network(bundled(name), activity=name == "voxelnet")
