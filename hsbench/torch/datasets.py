"""Map-style torch data sets over episodes: single frames, clips, whole episodes.

They hold paths, not arrays: picklable, lazy, safe in any number of workers and on a read-only disk.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from torch.nn.utils.rnn import pad_sequence
from torch.utils.data import Dataset as TorchDataset
from torch.utils.data import get_worker_info

from hsbench.datasets.dataset import Dataset
from hsbench.errors import DataError, SchemaError
from hsbench.schema.episode import NS_PER_S, Episode
from hsbench.schema.poses import PoseTable
from hsbench.torch.samples import Sample, sample

Tensors = dict[str, Any]
Transform = Callable[[Sample, np.random.Generator], Sample]
"""An augmentation: what it draws comes from the generator alone."""

CACHED = 8  # open episodes kept by each data set and worker: neighbours come from one episode


class _Episodes(TorchDataset[Tensors]):
    """Common to all: the episodes, the transform, and how an item finds its episode.

    fields: names of ``Sample`` that items hold, where not all that is there; the camera is always among them.
    """

    def __init__(
        self, dataset: Dataset, transform: Transform | None = None, fields: Sequence[str] | None = None
    ) -> None:
        if not isinstance(dataset, Dataset):
            raise SchemaError(f"dataset is a {type(dataset).__name__}; expected what hsbench.load gives")
        unknown = sorted(set(fields or ()).difference(ARRAYS))
        if unknown:
            raise SchemaError(f"field {unknown[0]!r} is unknown; expected one of {', '.join(ARRAYS)}")
        self.dataset, self.transform, self.fields = dataset, transform, fields
        self._open: dict[int, Episode] = {}

    def __getstate__(self) -> dict[str, Any]:
        """Without open episodes: a worker opens its own."""
        return {**self.__dict__, "_open": {}}

    def _episode(self, index: int) -> Episode:
        if index not in self._open:
            if len(self._open) >= CACHED:
                self._open.pop(next(iter(self._open)))
            self._open[index] = self.dataset[index]
        return self._open[index]

    def _item(self, found: Sample, index: int, one_frame: bool) -> Tensors:
        if self.transform is not None:
            found = self.transform(found, item_rng(index))
        tensors = to_tensors(found, one_frame)
        if self.fields is None:
            return tensors
        missing = [name for name in self.fields if name not in tensors]
        if missing:
            raise DataError(f"item {index} has no {missing[0]}; expected {', '.join(self.fields)} (truth=True?)")
        return {name: tensors[name] for name in ("camera", *self.fields)}


class EpisodeDataset(_Episodes):
    """Item i: all observed poses, boxes and maps of episode i, and its first frame where there are pictures."""

    def __len__(self) -> int:
        return len(self.dataset)

    def __getitem__(self, index: int) -> Tensors:
        index = range(len(self))[index]
        episode = self._episode(index)
        return self._item(sample(episode, [0] if len(episode.frames) else [], episode.poses), index, True)


class ClipDataset(_Episodes):
    """Item i: ``length`` frames, ``stride`` apart, and the poses observed from the first to the last of them.

    Clips of an episode begin ``step`` frames apart (default: they do not overlap). An episode too short for one clip
    has none. Raises DataError if no episode is long enough.
    """

    def __init__(
        self,
        dataset: Dataset,
        length: int,
        stride: int = 1,
        step: int | None = None,
        transform: Transform | None = None,
        fields: Sequence[str] | None = None,
    ) -> None:
        super().__init__(dataset, transform, fields)
        for name, value in (("length", length), ("stride", stride), ("step", 1 if step is None else step)):
            if value < 1:
                raise SchemaError(f"{name} of a clip is {value}; expected at least 1 frame")
        self.length, self.stride = length, stride
        span = (length - 1) * stride + 1
        counts = [int(row["n_frames"]) for row in dataset.rows]
        starts = [range(0, count - span + 1, step or span) for count in counts]
        self._clips = [(k, start) for k, found in enumerate(starts) for start in found]
        if not self._clips:
            raise DataError(
                f"{dataset.root} has no episode of the {span} frames of a clip; longest: {max(counts, default=0)}"
            )

    def __len__(self) -> int:
        return len(self._clips)

    def __getitem__(self, index: int) -> Tensors:
        index = range(len(self))[index]
        number, start = self._clips[index]
        episode = self._episode(number)
        frames = range(start, start + self.length * self.stride, self.stride)
        times = episode.frames.timestamps_ns
        poses = _between(episode.poses, times[frames[0]], times[frames[-1]])
        return self._item(sample(episode, frames, poses), index, False)


class FrameDataset(ClipDataset):
    """Item i: one frame, and the poses observed nearest to it, if within ``pose_s`` seconds."""

    def __init__(
        self,
        dataset: Dataset,
        pose_s: float = 0.1,
        every: int = 1,
        transform: Transform | None = None,
        fields: Sequence[str] | None = None,
    ) -> None:
        super().__init__(dataset, 1, 1, every, transform, fields)
        self.pose_s = pose_s

    def __getitem__(self, index: int) -> Tensors:
        index = range(len(self))[index]
        number, frame = self._clips[index]
        episode = self._episode(number)
        poses = _nearest(episode.poses, int(episode.frames.timestamps_ns[frame]), self.pose_s)
        return self._item(sample(episode, [frame], poses), index, True)


def _between(poses: PoseTable | None, first_ns: int, last_ns: int) -> PoseTable | None:
    if poses is None:
        return None
    start, end = np.searchsorted(poses.timestamp_ns, [first_ns, last_ns + 1])
    return poses.select(np.arange(start, end))


def _nearest(poses: PoseTable | None, time_ns: int, within_s: float) -> PoseTable | None:
    if poses is None:
        return None
    if not len(poses):
        return poses
    times = poses.timestamp_ns
    after = min(int(np.searchsorted(times, time_ns)), len(times) - 1)
    nearest = min(int(times[after]), int(times[max(after - 1, 0)]), key=lambda time: abs(time - time_ns))
    if abs(nearest - time_ns) > within_s * NS_PER_S:
        return poses.select(np.arange(0))
    start, end = np.searchsorted(times, [nearest, nearest + 1])
    return poses.select(np.arange(start, end))


def item_rng(index: int) -> np.random.Generator:
    """The generator of an item: it follows from torch's seed, the epoch and the item, not from the worker.

    In a ``DataLoader`` every epoch draws a new base seed, which workers share. In the main process torch's own
    generator is asked, so that ``torch.manual_seed`` decides.
    """
    info = get_worker_info()
    base = int(torch.randint(2**62, ()).item()) if info is None else info.seed - info.id
    key = hashlib.blake2b(f"item\x1f{base}\x1f{index}".encode(), digest_size=16).digest()
    return np.random.Generator(np.random.Philox(key=int.from_bytes(key, "little")))


def to_tensors(found: Sample, one_frame: bool) -> Tensors:
    """A sample as tensors by the names of its fields; what is not there is left out.

    rgb (T, 3, h, w), ids int32, ``camera`` as it is. one_frame: pictures and their time without the axis T.
    """
    tensors: Tensors = {"camera": found.camera}
    for name in ARRAYS:
        array = getattr(found, name)
        if array is None:
            continue
        if name == "rgb":
            array = array.transpose(0, 3, 1, 2)
        if array.dtype == np.uint16:
            array = array.astype(np.int32)
        if one_frame and name in OF_FRAMES and len(array):
            array = array[0]
        tensors[name] = torch.from_numpy(np.require(array, requirements=("C", "W")))
    return tensors


def collate(items: Sequence[Tensors]) -> Tensors:
    """A batch: tensors stacked; poses and boxes padded to the longest, ``pose_mask`` (B, P) and ``box_mask`` (B, M).

    Padding is 0, NaN for joints. Cameras stay a list. Raises DataError where items do not have the same fields, or
    pictures and maps of one size.
    """
    if not items:
        raise DataError("a batch of no items; expected one or more")
    names = items[0].keys()
    for item in items:
        if item.keys() != names:
            unlike = ", ".join(sorted(item.keys() ^ names))
            raise DataError(f"items of a batch differ in {unlike}; collate one data set, or choose fields")
    batch: Tensors = {"camera": [item["camera"] for item in items]}
    for rows, mask in ((OF_POSES, "pose_mask"), (OF_BOXES, "box_mask")):
        present = [name for name in rows if name in names]
        if not present:
            continue
        lengths = torch.tensor([len(item[present[0]]) for item in items])
        batch[mask] = torch.arange(int(lengths.max()))[None] < lengths[:, None]
        for name in present:
            padding = float("nan") if items[0][name].is_floating_point() and rows is OF_POSES else 0
            batch[name] = pad_sequence([item[name] for item in items], batch_first=True, padding_value=padding)
    for name in names - batch.keys():
        shapes = {tuple(item[name].shape) for item in items}
        if len(shapes) > 1:
            raise DataError(f"{name} of a batch has shapes {sorted(shapes)}; expected one (crop or scale them first)")
        batch[name] = torch.stack([item[name] for item in items])
    return batch


def label_planes(bits: torch.Tensor, labels: Sequence[int]) -> torch.Tensor:
    """(..., h, w) bit field of labels -> (..., L, h, w) bool, a plane a label: what a network of many labels learns.

    labels: bit numbers, such as ``Affordance``.
    """
    return torch.stack([(bits >> int(label) & 1).bool() for label in labels], dim=-3)


OF_FRAMES = ("timestamps_ns", "rgb", "depth_m", "instance", "semantic")
OF_POSES = ("pose_ns", "track_id", "joint_state", "joints_m", "joints_px")
OF_BOXES = ("boxes", "box_class", "box_visibility")
OF_SPACE = ("maps", "affordance", "affordance_ignored", "solid", "voxel_state", "solid_ignored")
ARRAYS = (*OF_FRAMES, *OF_POSES, *OF_BOXES, *OF_SPACE)
