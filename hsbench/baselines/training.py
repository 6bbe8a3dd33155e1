"""Training a network: the loop, its checkpoints, and the file of weights with its model card. Knows no task.

Everything a step depends on is a function of its number and the seed: the order of the samples, what augmentation
draws, the learning rate (a linear start, then half a cosine down to 0). So a checkpoint is weights, the optimiser's
state and a number, and a run that was stopped and resumed ends with the very weights of one that was not.

Files, all safetensors with a JSON text in the header, none of them pickled: ``out`` holds the weights and the card, a
``.json`` beside it the card alone, an ``.svg`` the curves; while a run goes on, ``.checkpoint`` is where it stands.
"""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from math import ceil, cos, pi
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from hsbench.baselines.curves import curves_svg
from hsbench.baselines.model_card import CARD, read_card
from hsbench.errors import DataError, MissingExtraError
from hsbench.io.atomic import json_bytes, write_bytes, write_json, write_text
from hsbench.synth.seeds import Seeds
from hsbench.typing import IntArray

try:
    import safetensors
    import torch
    from safetensors.torch import save
except ModuleNotFoundError as error:
    raise MissingExtraError("a network", error.name or "torch", "torch") from error

CHECKPOINT = ".checkpoint"
MODEL, OPTIMISER = "model.", "optimiser."
OPTIMISER_STATE = ("step", "exp_avg", "exp_avg_sq")  # of AdamW

Curve = list[dict[str, float]]
"""An epoch each: its number, mean loss, and what validation found."""


@dataclass(frozen=True)
class TrainConfig:
    """How long and how fast: AdamW, gradients clipped to ``clip_norm``, the first ``warm_share`` of the steps warm up.

    The numbers are hsbench defaults.
    """

    epochs: int = 12
    batch: int = 4
    learning_rate: float = 3e-3
    weight_decay: float = 1e-2
    warm_share: float = 0.05
    clip_norm: float = 1.0
    seed: int = 0

    def steps(self, samples: int) -> int:
        """Of a run over so many samples; an epoch ends with a smaller batch where they do not divide."""
        return self.epochs * ceil(samples / self.batch)


@dataclass(frozen=True, eq=False)
class Problem:
    """What is trained.

    model: its weights are changed in place. samples: how many there are to train on. loss: numbers of some samples and
    a generator for augmentation -> the loss to lower. validate: the scores shown for every epoch, the model being in
    evaluation mode. card: what the model card says besides configuration and curves; a resumed run must have the same.
    """

    model: torch.nn.Module
    samples: int
    loss: Callable[[IntArray, np.random.Generator], torch.Tensor]
    validate: Callable[[], Mapping[str, float]]
    card: Mapping[str, Any]


@dataclass(frozen=True)
class Progress:
    """After a step: its number from 1, of how many, its loss; and the curve so far, an entry an epoch."""

    step: int
    steps: int
    loss: float
    curve: Curve


def train(
    problem: Problem, config: TrainConfig, out: Path, *, resume: bool = False
) -> Generator[Progress, None, dict[str, Any]]:
    """Train and write ``out``, yielding after every step; returns the model card.

    A checkpoint is written after every epoch, and on Ctrl-C or when the generator is closed after the last whole step.
    resume: go on from the checkpoint, which must be there. Raises DataError where it is not, or is of another run, and
    where there is one that nobody asked to resume.
    """
    torch.manual_seed(config.seed)
    seeds = Seeds(config.seed).child("training")
    model = problem.model
    optimiser = torch.optim.AdamW(model.parameters(), lr=0.0, weight_decay=config.weight_decay)
    run = {**problem.card, "config": asdict(config)}
    steps = config.steps(problem.samples)
    an_epoch = steps // config.epochs
    done, total, curve = 0, 0.0, Curve()
    if resume:
        done, total, curve = _restore(_checkpoint(out), run, model, optimiser)
    elif _checkpoint(out).exists():
        raise DataError(f"{_checkpoint(out)}: a run stopped here; go on with --resume, or remove it to begin again")
    with _interrupts_held() as interrupted, _deterministic():
        while done < steps:
            epoch, within = divmod(done, an_epoch)
            order = seeds.rng(f"order-{epoch}").permutation(problem.samples)
            rows = order[within * config.batch : (within + 1) * config.batch]
            for group in optimiser.param_groups:
                group["lr"] = learning_rate(config, done, steps)
            loss = _learn(problem, optimiser, rows, seeds.rng(f"step-{done}"), config.clip_norm)
            done, total = done + 1, total + loss
            if done % an_epoch == 0:
                model.eval()
                with torch.no_grad():
                    found = problem.validate()
                curve = [*curve, {"epoch": epoch + 1, "loss": total / an_epoch, **found}]
                total = 0.0
                _save_checkpoint(out, run, model, optimiser, done, total, curve)
            try:
                if interrupted.is_set():
                    raise KeyboardInterrupt
                yield Progress(done, steps, loss, curve)
            except (KeyboardInterrupt, GeneratorExit):
                _save_checkpoint(out, run, model, optimiser, done, total, curve)
                raise
    card = {**run, "curve": curve}
    save_weights(out, model, card)
    _checkpoint(out).unlink(missing_ok=True)
    return card


def _learn(
    problem: Problem, optimiser: torch.optim.Optimizer, rows: IntArray, rng: np.random.Generator, clip_norm: float
) -> float:
    """One step down the gradient of some samples; returns their loss."""
    problem.model.train()
    optimiser.zero_grad()
    loss = problem.loss(rows, rng)
    torch.autograd.backward(loss)
    torch.nn.utils.clip_grad_norm_(problem.model.parameters(), clip_norm)
    optimiser.step()
    return float(loss.detach())


def learning_rate(config: TrainConfig, step: int, steps: int) -> float:
    """Of a step, from 0: rises over the first ``warm_share`` of all, then falls along half a cosine."""
    warm = ceil(config.warm_share * steps)
    if step < warm:
        return config.learning_rate * (step + 1) / warm
    return config.learning_rate * (1 + cos(pi * (step - warm) / max(steps - warm, 1))) / 2


def set_threads(count: int) -> None:
    """Threads of torch in this process."""
    torch.set_num_threads(count)


def save_weights(out: Path, model: torch.nn.Module, card: Mapping[str, Any]) -> None:
    """Write a model's weights with its card, the card alone beside them, and the picture of its curves."""
    write_bytes(out, _packed(dict(model.state_dict()), card))
    write_json(out.with_suffix(".json"), card)
    write_text(out.with_suffix(".svg"), curves_svg(card["curve"]))


def load_weights(path: Path) -> tuple[dict[str, torch.Tensor], dict[str, Any]]:
    """A file of ``save_weights`` -> (tensors by name, card). Raises DataError where it is missing or no such file."""
    card = read_card(path)
    try:
        with safetensors.safe_open(path, framework="pt") as file:
            return {name: file.get_tensor(name) for name in file.keys()}, card  # noqa: SIM118, no mapping
    except (safetensors.SafetensorError, OSError) as error:
        raise DataError(f"{path}: the weights are damaged; expected a file that hsbench train wrote") from error


def fill(model: torch.nn.Module, tensors: Mapping[str, torch.Tensor], path: Path) -> None:
    """Put tensors into a model. Raises DataError where names or shapes are not the model's."""
    try:
        model.load_state_dict(dict(tensors))
    except RuntimeError as error:
        raise DataError(f"{path}: weights of another network (was it trained by another version?)") from error


def _packed(tensors: Mapping[str, torch.Tensor], card: Mapping[str, Any]) -> bytes:
    plain = {name: tensor.detach().contiguous() for name, tensor in tensors.items()}
    return bytes(save(plain, {CARD: json_bytes(card).decode()}))


def _checkpoint(out: Path) -> Path:
    return out.with_suffix(CHECKPOINT)


def _save_checkpoint(
    out: Path,
    run: Mapping[str, Any],
    model: torch.nn.Module,
    optimiser: torch.optim.Optimizer,
    done: int,
    total: float,
    curve: Curve,
) -> None:
    tensors = {MODEL + name: tensor for name, tensor in model.state_dict().items()}
    for k, state in optimiser.state_dict()["state"].items():
        tensors |= {f"{OPTIMISER}{k}.{name}": state[name] for name in OPTIMISER_STATE}
    write_bytes(_checkpoint(out), _packed(tensors, {"run": run, "done": done, "total": total, "curve": curve}))


def _restore(
    path: Path, run: Mapping[str, Any], model: torch.nn.Module, optimiser: torch.optim.Optimizer
) -> tuple[int, float, Curve]:
    """Put a checkpoint into model and optimiser -> (steps done, sum of losses in the epoch, curve)."""
    if not path.is_file():
        raise DataError(f"{path}: there is no checkpoint to resume from; start without --resume")
    tensors, found = load_weights(path)
    expected = json.loads(json_bytes(run))
    if found.get("run") != expected:
        theirs, ours = (_flat(item) for item in (found.get("run", {}), expected))
        name = next(k for k in sorted({*theirs, *ours}) if theirs.get(k) != ours.get(k))
        raise DataError(f"{path}: {name} was {theirs.get(name)!r}, now it is {ours.get(name)!r}; resume the same run")
    fill(model, {k.removeprefix(MODEL): v for k, v in tensors.items() if k.startswith(MODEL)}, path)
    count = len(optimiser.param_groups[0]["params"])
    state = {k: {name: tensors[f"{OPTIMISER}{k}.{name}"] for name in OPTIMISER_STATE} for k in range(count)}
    optimiser.load_state_dict({"state": state, "param_groups": optimiser.state_dict()["param_groups"]})
    return found["done"], found["total"], found["curve"]


def _flat(item: Any, name: str = "") -> dict[str, Any]:
    """Nested dicts as one: a.b -> value."""
    if not isinstance(item, dict):
        return {name: item}
    return {k: v for key, value in item.items() for k, v in _flat(value, f"{name}.{key}" if name else key).items()}


@contextmanager
def _interrupts_held() -> Iterator[threading.Event]:
    """Ctrl-C sets the event instead of stopping between two changes of the weights; a second one stops at once."""
    held = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield held
        return
    before = signal.getsignal(signal.SIGINT)

    def hold(number: int, frame: FrameType | None) -> None:
        held.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, hold)
    try:
        yield held
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _deterministic() -> Iterator[None]:
    before = torch.are_deterministic_algorithms_enabled()
    torch.use_deterministic_algorithms(True)
    try:
        yield
    finally:
        torch.use_deterministic_algorithms(before)
