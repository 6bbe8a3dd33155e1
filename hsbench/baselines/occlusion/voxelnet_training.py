"""Training the network of scene completion on split train of a data set, watched on split val."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch

from hsbench.baselines.method import observed
from hsbench.baselines.occlusion.action import recognise
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.voxelnet_features import (
    Depth,
    Evidence,
    Target,
    depth_features,
    evidence,
    target,
)
from hsbench.baselines.occlusion.voxelnet_network import NetworkConfig, VoxelNet, completion_loss, planes
from hsbench.baselines.trainable import Trainable
from hsbench.baselines.training import Problem, TrainConfig, fill, load_weights
from hsbench.errors import DataError
from hsbench.schema.episode import Episode
from hsbench.schema.states import VoxelState
from hsbench.tasks.scene_completion import SCENE_COMPLETION
from hsbench.typing import AnyArray, BoolArray, IntArray


@dataclass(frozen=True, eq=False)
class Example:
    """An episode as the network learns from it."""

    depth: Depth
    activity: Evidence | None
    target: Target


def example(episode: Episode, config: NetworkConfig) -> Example:
    """Of an episode with truth."""
    carving = config.carving
    activity = evidence(recognise(observed(episode), carving), carving) if config.activity else None
    return Example(depth_features(episode), activity, target(episode))


def trainable(name: str, activity: bool) -> Trainable:
    """The network with or without the channels of activity, for ``hsbench train``."""
    config = NetworkConfig(activity)
    return Trainable(
        name,
        lambda episode: example(episode, config),
        lambda train, val, seed: problem(name, train, val, config, seed),
        TrainConfig(),
    )


def problem(name: str, train: Sequence[Example], val: Sequence[Example], config: NetworkConfig, seed: int) -> Problem:
    """Learning from examples; scores are of ``val``: the loss and the pooled IoU, precision and recall of the answers.

    name: of the method, for the card.
    """
    torch.manual_seed(seed)
    model = VoxelNet(config)

    def loss(rows: IntArray, rng: np.random.Generator) -> torch.Tensor:
        flip = rng.random(len(rows)) < 0.5
        chosen = [mirrored(train[k]) if left else train[k] for k, left in zip(rows, flip, strict=True)]
        return _loss(model(_planes(chosen, config)), chosen)

    def validate() -> dict[str, float]:
        total, true, predicted, both = 0.0, 0, 0, 0
        for item in val:
            logits = model(_planes([item], config))
            total += float(_loss(logits, [item]))
            said = answer(logits[0], item.depth)[item.target.mask]
            solid = item.target.solid[item.target.mask]
            true, predicted, both = true + solid.sum(), predicted + said.sum(), both + (said & solid).sum()
        return {
            "val_loss": total / len(val),
            "val_iou": float(both / max(true + predicted - both, 1)),
            "val_precision": float(both / max(predicted, 1)),
            "val_recall": float(both / max(true, 1)),
        }

    card = {
        "model": name,
        "network": asdict(config),
        "weights": sum(p.numel() for p in model.parameters()),
        "mask": SCENE_COMPLETION.protocol,
    }
    return Problem(model, len(train), loss, validate, card)


def load_network(path: Path, activity: bool) -> VoxelNet:
    """The network of a file of weights, to answer with. Raises DataError where it is not one of ours, or of the other
    kind.
    """
    tensors, card = load_weights(path)
    if "network" not in card or "activity" not in card["network"]:
        raise DataError(f"{path}: weights of {card.get('model')}; expected weights of a voxelnet")
    if card["network"]["activity"] != activity:
        expected = "with" if activity else "without"
        raise DataError(f"{path}: weights of {card['model']}; expected a network trained {expected} activity")
    try:
        found = card["network"]
        model = VoxelNet(NetworkConfig(activity, tuple(found["widths"]), CarveConfig(**found["carving"])))
    except (KeyError, TypeError) as error:
        raise DataError(f"{path}: weights of another network (was it trained by another version?)") from error
    fill(model, tensors, path)
    return model.eval()


def answers(model: VoxelNet, depth: Depth, activity: Evidence | None) -> BoolArray:
    """(nx, ny, nz) bool: what the network says of an episode."""
    with torch.inference_mode():
        logits = model(planes([depth], [] if activity is None else [activity], model.config))
    return answer(logits[0], depth)


def answer(logits: torch.Tensor, depth: Depth) -> BoolArray:
    """(nx, ny, nz) logits -> bool: visible surface, and of what is occluded that which is rather solid than free."""
    occluded = depth.states == VoxelState.OCCLUDED
    return np.asarray((depth.states == VoxelState.SURFACE) | (occluded & (logits.numpy() > 0)))


def mirrored(item: Example) -> Example:
    """Left and right exchanged: y becomes -y. Exact, as the grid is symmetric."""

    def turned(array: AnyArray) -> AnyArray:
        return np.ascontiguousarray(array[:, ::-1])

    depth, activity, aim = item.depth, item.activity, item.target
    return Example(
        Depth(turned(depth.states), turned(depth.distance), turned(depth.behind)),
        activity and Evidence(turned(activity.stand), turned(activity.sit), turned(activity.seat_m)),
        Target(turned(aim.mask), turned(aim.solid)),
    )


def _planes(items: list[Example], config: NetworkConfig) -> torch.Tensor:
    activity = [item.activity for item in items if item.activity is not None]
    return planes([item.depth for item in items], activity, config)


def _loss(logits: torch.Tensor, items: list[Example]) -> torch.Tensor:
    mask = torch.from_numpy(np.stack([item.target.mask for item in items]))
    return completion_loss(logits, mask, torch.from_numpy(np.stack([item.target.solid for item in items])))
