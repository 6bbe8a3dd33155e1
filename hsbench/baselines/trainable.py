"""The baselines that ``hsbench train`` trains: how an episode becomes an example, and what is learnt from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hsbench.errors import DataError
from hsbench.schema.episode import Episode

if TYPE_CHECKING:
    from hsbench.baselines.training import Problem, TrainConfig


@dataclass(frozen=True)
class Trainable:
    """A network and its defaults.

    example: an episode with truth -> what the network learns from. problem: the examples of splits train and val, and
    a seed for the first weights -> the problem. config: defaults of a run.
    """

    name: str
    example: Callable[[Episode], Any]
    problem: Callable[[Sequence[Any], Sequence[Any], int], Problem]
    config: TrainConfig


def _voxelnet() -> Trainable:
    from hsbench.baselines.occlusion.voxelnet_training import trainable

    return trainable("voxelnet", activity=True)


def _voxelnet_alone() -> Trainable:
    from hsbench.baselines.occlusion.voxelnet_training import trainable

    return trainable("voxelnet-alone", activity=False)


TRAINABLE: Mapping[str, Callable[[], Trainable]] = {"voxelnet": _voxelnet, "voxelnet-alone": _voxelnet_alone}
"""Name of a method -> what makes it trainable; called late, as it needs torch."""


def trainable(name: str) -> Trainable:
    """By name. Raises DataError for an unknown one, MissingExtraError without torch."""
    if name not in TRAINABLE:
        raise DataError(f"{name!r} cannot be trained; expected one of {', '.join(TRAINABLE)}")
    import hsbench.baselines.training  # noqa: F401, names the extra where torch is missing

    return TRAINABLE[name]()
