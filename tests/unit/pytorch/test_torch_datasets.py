"""Torch data sets: the loader's own values, any number of workers, the same augmentation whoever draws it."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.errors import DataError, SchemaError
from hsbench.metrics.multilabel import planes
from hsbench.schema.states import Affordance

torch = pytest.importorskip("torch", reason="the extra torch is not installed")

from torch.utils.data import DataLoader  # noqa: E402

from hsbench.torch import ClipDataset, EpisodeDataset, FrameDataset, Sometimes, collate, label_planes, mirrored  # noqa: E402


def test_frames_are_those_of_the_loader(rgbd: Path) -> None:
    data = load(rgbd, truth=True)
    frames = FrameDataset(data)
    assert len(frames) == sum(row["n_frames"] for row in data.rows)
    item, episode = frames[3], data[0]
    assert item["rgb"].shape == (3, *episode.frames[3].rgb.shape[:2])
    assert np.array_equal(item["rgb"].numpy(), episode.frames[3].rgb.transpose(2, 0, 1))
    assert np.array_equal(item["depth_m"].numpy(), episode.frames[3].depth_m)
    assert np.array_equal(item["instance"].numpy(), episode.truth.frames[3].instance)
    assert int(item["timestamps_ns"]) == episode.frames[3].timestamp_ns
    assert item["camera"] == episode.sensor.camera
    gap = np.abs(episode.poses.timestamp_ns - episode.frames[3].timestamp_ns)
    if gap.min() <= 1e8:
        assert set(item["pose_ns"].tolist()) == {int(episode.poses.timestamp_ns[gap.argmin()])}
    else:
        assert len(item["pose_ns"]) == 0


def test_what_is_no_data_set_or_no_clip_is_refused(rgbd: Path) -> None:
    with pytest.raises(SchemaError, match=r"dataset is a str; expected what hsbench\.load gives"):
        EpisodeDataset(str(rgbd))
    for length, stride, step in ((0, 1, 1), (2, -1, 1), (2, 1, 0)):
        with pytest.raises(SchemaError, match="expected at least 1 frame"):
            ClipDataset(load(rgbd), length, stride, step)
    with pytest.raises(DataError, match="a batch of no items"):
        collate([])


def test_fields_that_are_chosen(rgbd: Path) -> None:
    data = load(rgbd, truth=True)
    for made in (EpisodeDataset(data, fields=("rgb", "boxes")), FrameDataset(data, fields=("rgb", "boxes"))):
        assert made[0].keys() == {"camera", "rgb", "boxes"}
    whole = EpisodeDataset(data)[0]
    assert torch.equal(EpisodeDataset(data, fields=("solid",))[0]["solid"], whole["solid"])
    with pytest.raises(SchemaError, match="field 'box' is unknown"):
        EpisodeDataset(data, fields=("box",))
    with pytest.raises(DataError, match="item 0 has no maps; expected rgb, maps"):
        _ = EpisodeDataset(data, fields=("rgb", "maps"))[0]


def test_without_truth_there_is_none(rgbd: Path) -> None:
    for item in (FrameDataset(load(rgbd))[0], EpisodeDataset(load(rgbd))[0], ClipDataset(load(rgbd), 2)[0]):
        hidden = {"instance", "semantic", "boxes", "box_class", "box_visibility", "affordance", "affordance_ignored"}
        hidden |= {"solid", "voxel_state", "solid_ignored"}
        assert not hidden & item.keys()


def test_space_and_what_of_it_counts(rgbd: Path) -> None:
    item, truth = EpisodeDataset(load(rgbd, truth=True))[0], load(rgbd, truth=True)[0].truth
    assert np.array_equal(item["solid"].numpy(), truth.occupancy.solid)
    assert np.array_equal(item["voxel_state"].numpy(), truth.occupancy.state)
    assert np.array_equal(item["solid_ignored"].numpy(), truth.occupancy.ignored)
    assert np.array_equal(item["affordance"].numpy(), truth.affordance.labels)
    assert np.array_equal(item["affordance_ignored"].numpy(), truth.affordance.ignored)


def test_a_bit_field_becomes_a_plane_a_label() -> None:
    bits = torch.arange(128, dtype=torch.uint8).reshape(2, 8, 8)
    for labels in ((0, 1, 2), (6,), tuple(Affordance)):
        found = label_planes(bits, labels)
        assert found.dtype == torch.bool
        for number in range(2):
            assert np.array_equal(found[number].numpy(), planes(bits[number].numpy(), labels))


def test_clips(rgbd: Path) -> None:
    data = load(rgbd)
    counts = [row["n_frames"] for row in data.rows]
    clips = ClipDataset(data, 3, stride=2)
    assert len(clips) == sum(n // 5 for n in counts)
    times = data[0].frames.timestamps_ns
    second = clips[1]
    assert second["timestamps_ns"].tolist() == times[[5, 7, 9]].tolist()
    assert second["rgb"].shape[:2] == (3, 3)
    poses = data[0].poses.timestamp_ns
    assert second["pose_ns"].tolist() == poses[(poses >= times[5]) & (poses <= times[9])].tolist()
    assert len(ClipDataset(data, 3, stride=2, step=1)) == sum(n - 4 for n in counts)
    with pytest.raises(DataError, match=r"has no episode of the 1000 frames of a clip; longest: \d+"):
        ClipDataset(data, 1000)


def test_batches_are_padded_and_masked(rgbd: Path) -> None:
    data = load(rgbd, truth=True)
    episodes = EpisodeDataset(data)
    batch = collate([episodes[k] for k in range(4)])
    for k in range(4):
        poses, boxes = data[k].poses, episodes[k]["boxes"]
        assert batch["pose_mask"][k].sum() == len(poses)
        assert np.array_equal(batch["joints_m"][k][batch["pose_mask"][k]], poses.joints_m, equal_nan=True)
        assert torch.isnan(batch["joints_m"][k][~batch["pose_mask"][k]]).all()
        assert torch.equal(batch["boxes"][k][batch["box_mask"][k]], boxes)
    assert batch["rgb"].shape[0] == 4
    assert len(batch["camera"]) == 4
    with pytest.raises(DataError, match=r"items of a batch differ in .*boxes"):
        collate([episodes[0], EpisodeDataset(load(rgbd))[0]])


@pytest.mark.slow
def test_augmentation_does_not_depend_on_workers(rgbd: Path) -> None:
    frames = FrameDataset(load(rgbd), transform=Sometimes(mirrored))

    def epoch(workers: int, seed: int) -> list[int]:
        generator = torch.Generator().manual_seed(seed)
        loader = DataLoader(
            frames, batch_size=4, num_workers=workers, generator=generator, collate_fn=collate,
            multiprocessing_context="spawn",
        )  # fmt: skip
        return [int(batch["rgb"].long().mul(torch.arange(batch["rgb"].shape[-1])).sum()) for batch in loader]

    assert epoch(1, 0) == epoch(2, 0)
    assert epoch(1, 0) != epoch(1, 1)


def test_augmentation_follows_torch_s_seed_in_process(rgbd: Path) -> None:
    frames = FrameDataset(load(rgbd), transform=Sometimes(mirrored))

    def drawn(seed: int) -> list[bool]:
        torch.manual_seed(seed)
        return [bool(torch.equal(frames[0]["rgb"], plain)) for _ in range(16)]

    plain = FrameDataset(load(rgbd))[0]["rgb"]
    assert drawn(0) == drawn(0)
    assert drawn(0) != drawn(1)
    assert 2 < sum(drawn(0)) < 14


def test_a_data_set_travels(rgbd: Path) -> None:
    frames = FrameDataset(load(rgbd))
    first = frames[0]
    packed = pickle.dumps(frames)
    assert len(packed) < 100_000, "paths travel, not pictures"
    assert torch.equal(pickle.loads(packed)[0]["rgb"], first["rgb"])
