"""Data sets for training with torch: frames, clips and episodes as tensors, and augmentations that keep them true."""

try:
    import torch as _torch  # noqa: F401
except ModuleNotFoundError as error:
    from hsbench.errors import MissingExtraError

    raise MissingExtraError("hsbench.torch", error.name or "torch", "torch") from error

from hsbench.torch.datasets import ClipDataset, EpisodeDataset, FrameDataset, collate, label_planes
from hsbench.torch.samples import Sample
from hsbench.torch.transforms import Sometimes, cropped, mirrored, turned

__all__ = [
    "ClipDataset",
    "EpisodeDataset",
    "FrameDataset",
    "Sample",
    "Sometimes",
    "collate",
    "cropped",
    "label_planes",
    "mirrored",
    "turned",
]
