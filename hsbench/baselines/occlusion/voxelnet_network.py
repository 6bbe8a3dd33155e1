"""The network: a narrow 3D encoder-decoder on the task's grid, after SSCNet (Song et al., CVPR 2017) and U-Net.

The grid is halved by the first layer, which reads blocks of 2x2x2 voxels, and the last one answers for the eight voxels
of a block: the costly full resolution holds no other layer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.voxelnet_features import BEHIND_M, FULL, Depth, Evidence
from hsbench.schema.states import VoxelState
from hsbench.tasks.scene_completion import GRID

DEPTH_CHANNELS, ACTIVITY_CHANNELS = 4, 3
GROUPS = 4  # of channels that are normalised together
BLOCK = 2  # voxels along an edge of what the first layer reads


@dataclass(frozen=True)
class NetworkConfig:
    """What makes a network; weights keep the one they were trained with.

    activity: whether the channels of activity are there. widths: channels at 10, 20, 40 and 80 cm. carving: how poses
    become maps.
    """

    activity: bool = True
    widths: tuple[int, ...] = (16, 32, 64, 96)
    carving: CarveConfig = field(default_factory=CarveConfig)


class VoxelNet(nn.Module):
    """(B, C, 128, 128, 48) float32 of ``planes`` -> (B, 128, 128, 48) logits of being solid."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        channels = DEPTH_CHANNELS + (ACTIVITY_CHANNELS if config.activity else 0)
        inner = config.widths
        self.down = nn.ModuleList(
            nn.Conv3d(a, b, BLOCK, stride=BLOCK) for a, b in zip((channels, *inner[:-1]), inner, strict=True)
        )
        self.encode = nn.ModuleList(_Block(width) for width in inner)
        self.up = nn.ModuleList(nn.ConvTranspose3d(b, a, BLOCK, stride=BLOCK) for a, b in pairwise(inner))
        self.decode = nn.ModuleList(_Block(width) for width in inner[:-1])
        self.head = nn.Conv3d(inner[0], BLOCK**3, 1)

    def forward(self, planes: Tensor) -> Tensor:
        """See the class."""
        x, skips = planes, []
        for down, encode in zip(self.down, self.encode, strict=True):
            x = encode(down(x))
            skips.append(x)
        for k in reversed(range(len(self.up))):
            x = self.decode[k](self.up[k](x) + skips[k])
        x = self.head(x)
        batch, _, nx, ny, nz = x.shape
        blocks = x.reshape(batch, BLOCK, BLOCK, BLOCK, nx, ny, nz).permute(0, 4, 1, 5, 2, 6, 3)
        return blocks.reshape(batch, nx * BLOCK, ny * BLOCK, nz * BLOCK)


class _Block(nn.Module):
    """A residual convolution: x + conv(relu(norm(x)))."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.GroupNorm(GROUPS, width)
        self.conv = nn.Conv3d(width, width, 3, padding=1)

    def forward(self, x: Tensor) -> Tensor:
        """See the class."""
        return x + self.conv(functional.relu(self.norm(x)))


def planes(depth: Sequence[Depth], activity: Sequence[Evidence], config: NetworkConfig) -> Tensor:
    """(B, C, nx, ny, nz) float32 of B episodes: flipped distance, distance behind the surface, occluded or not, height;
    with activity also how often somebody stood there, sat there, and what a seat there supports.

    activity: of the B episodes, or empty for a network without.
    """
    carving = config.carving
    z = torch.from_numpy(GRID.axis_centres(2).astype(np.float32))
    shape = (len(depth), DEPTH_CHANNELS + (ACTIVITY_CHANNELS if config.activity else 0), *GRID.shape)
    result = torch.empty(shape).to(memory_format=torch.channels_last_3d)
    for k, item in enumerate(depth):
        result[k, 0] = torch.from_numpy(item.distance) / FULL
        result[k, 1] = torch.from_numpy(item.behind) / FULL
        result[k, 2] = torch.from_numpy(item.states == VoxelState.OCCLUDED)
        result[k, 3] = z / BEHIND_M
    for k, seen in enumerate(activity):
        stand, sit, seat_m = (torch.from_numpy(plan)[..., None] for plan in (seen.stand, seen.sit, seen.seat_m))
        result[k, 4] = stand * (z <= carving.stand_top_m)
        result[k, 5] = sit * ((z > seat_m) & (z <= seat_m + carving.sit_clear_m))
        result[k, 6] = sit * (z <= seat_m)
    return result


def completion_loss(logits: Tensor, mask: Tensor, solid: Tensor) -> Tensor:
    """Cross-entropy plus 1 - soft IoU, over the voxels of the mask, all (B, nx, ny, nz).

    The soft IoU, pooled over the batch as the score is pooled over episodes, answers for the imbalance of the classes.
    """
    inside, true = logits[mask], solid[mask].float()
    probability = inside.sigmoid()
    both = (probability * true).sum()
    either = (probability + true).sum() - both
    soft_iou = both / either.clamp(min=1.0)
    entropy = functional.binary_cross_entropy_with_logits(inside, true, reduction="sum") / max(inside.numel(), 1)
    return entropy + 1 - soft_iou
