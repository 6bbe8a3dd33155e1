"""Training: a stopped and resumed run ends with the same bytes as an unbroken one, and what it writes reads back."""

from __future__ import annotations

import json
import signal
from collections.abc import Generator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from hsbench.errors import DataError

torch = pytest.importorskip("torch")

from hsbench.baselines.training import (  # noqa: E402
    Problem,
    Progress,
    TrainConfig,
    fill,
    learning_rate,
    load_weights,
    save_weights,
    train,
)

SLOPE = np.array([1.5, -2.0, 0.5])
CONFIG = TrainConfig(epochs=6, batch=4, learning_rate=0.1, weight_decay=0.0, seed=3)


def line(samples: int = 10) -> Problem:
    """Fitting a line through noisy points; augmentation draws, so the generator counts too."""
    points = torch.tensor(np.random.default_rng(0).normal(size=(samples, 3)), dtype=torch.float32)
    truth = points @ torch.tensor(SLOPE, dtype=torch.float32)
    torch.manual_seed(7)
    model = torch.nn.Linear(3, 1)

    def loss(rows: np.ndarray, rng: np.random.Generator) -> torch.Tensor:
        noise = torch.tensor(rng.normal(scale=0.01, size=len(rows)), dtype=torch.float32)
        return ((model(points[rows])[:, 0] - truth[rows] - noise) ** 2).mean()

    def validate() -> dict[str, float]:
        assert not model.training
        return {"error": float(((model(points)[:, 0] - truth) ** 2).mean())}

    return Problem(model, samples, loss, validate, {"model": "line"})


def finish(run: Generator[Progress, None, object]) -> list[Progress]:
    return list(run)


def test_it_learns_and_tells_the_curve(tmp_path: Path) -> None:
    problem = line()
    steps = finish(train(problem, replace(CONFIG, epochs=60), tmp_path / "a.safetensors"))
    assert [s.step for s in steps] == list(range(1, 60 * 3 + 1))  # ten samples make three batches
    assert np.allclose(problem.model.weight.detach().numpy()[0], SLOPE, atol=0.02)
    curve = steps[-1].curve
    assert [entry["epoch"] for entry in curve] == list(range(1, 61))
    assert curve[-1]["error"] < 0.01 * curve[0]["error"]
    assert sum(s.loss for s in steps[:3]) / 3 == pytest.approx(curve[0]["loss"], rel=1e-12)


@pytest.mark.parametrize("stop", [1, 3, 8, 17])
def test_stopped_and_resumed_is_the_same_as_unbroken(stop: int, tmp_path: Path) -> None:
    """Within an epoch, at its end, in the middle of the run, and one step before its end."""
    whole, broken = tmp_path / "whole.safetensors", tmp_path / "broken.safetensors"
    steps = finish(train(line(), CONFIG, whole))
    run = train(line(), CONFIG, broken)
    first = list(islice(run, stop))
    run.close()
    assert not broken.exists()
    rest = finish(train(line(), CONFIG, broken, resume=True))
    assert first + rest == steps
    for suffix in (".safetensors", ".json", ".svg"):
        assert whole.with_suffix(suffix).read_bytes() == broken.with_suffix(suffix).read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(
        f"{name}.{suffix}" for name in ("whole", "broken") for suffix in ("safetensors", "json", "svg")
    )


def test_ctrl_c_ends_the_step_and_leaves_a_checkpoint(tmp_path: Path) -> None:
    out, whole = tmp_path / "net.safetensors", tmp_path / "whole.safetensors"
    finish(train(line(), CONFIG, whole))
    problem = line()

    def interrupted(rows: np.ndarray, rng: np.random.Generator) -> torch.Tensor:
        calls.append(len(rows))
        if len(calls) == 5:
            signal.raise_signal(signal.SIGINT)
        return problem.loss(rows, rng)

    calls: list[int] = []
    before = signal.getsignal(signal.SIGINT)
    run = train(replace(problem, loss=interrupted), CONFIG, out)
    with pytest.raises(KeyboardInterrupt):
        finish(run)
    assert signal.getsignal(signal.SIGINT) is before
    tensors, found = load_weights(out.with_suffix(".checkpoint"))
    assert found["done"] == 5  # the step in which it came was finished
    assert torch.equal(tensors["model.weight"], problem.model.weight)
    finish(train(line(), CONFIG, out, resume=True))
    assert out.read_bytes() == whole.read_bytes()


def test_only_the_same_run_is_resumed(tmp_path: Path) -> None:
    out = tmp_path / "net.safetensors"
    with pytest.raises(DataError, match="no checkpoint to resume from"):
        finish(train(line(), CONFIG, out, resume=True))
    run = train(line(), CONFIG, out)
    next(run)
    run.close()
    with pytest.raises(DataError, match="a run stopped here; go on with --resume"):
        finish(train(line(), CONFIG, out))
    with pytest.raises(DataError, match=r"config\.epochs was 6, now it is 7"):
        finish(train(line(), replace(CONFIG, epochs=7), out, resume=True))
    with pytest.raises(DataError, match="model was 'line', now it is 'curve'"):
        finish(train(replace(line(), card={"model": "curve"}), CONFIG, out, resume=True))


def test_the_seed_and_nothing_else_decides(tmp_path: Path) -> None:
    for name, seed in (("a", 3), ("b", 3), ("c", 0)):
        torch.manual_seed(ord(name))  # what was drawn before does not matter
        finish(train(line(), replace(CONFIG, seed=seed), tmp_path / f"{name}.safetensors"))
    a, b, c = ((tmp_path / f"{name}.safetensors").read_bytes() for name in "abc")
    assert a == b != c


def test_weights_and_card_read_back(tmp_path: Path) -> None:
    out = tmp_path / "net.safetensors"
    card = {"model": "line", "note": "weiß", "curve": [{"epoch": 1, "loss": 0.5}, {"epoch": 2, "loss": 0.25}]}
    model = torch.nn.Linear(3, 2)
    save_weights(out, model, card)
    tensors, found = load_weights(out)
    assert found == card == json.loads(out.with_suffix(".json").read_text(encoding="utf-8"))
    other = torch.nn.Linear(3, 2)
    fill(other, tensors, out)
    assert all(torch.equal(x, y) for x, y in zip(model.parameters(), other.parameters(), strict=True))
    with pytest.raises(DataError, match="weights of another network"):
        fill(torch.nn.Linear(2, 2), tensors, out)
    picture = ElementTree.fromstring(out.with_suffix(".svg").read_text(encoding="utf-8"))
    assert len(picture.findall("{*}polyline")) == 1


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04 no weights", "plain"])
def test_what_is_no_file_of_ours_is_one_line(content: bytes | str | None, tmp_path: Path) -> None:
    out = tmp_path / "net.safetensors"
    if content == "plain":
        from safetensors.torch import save_file

        save_file({"x": torch.zeros(2)}, out)
    elif isinstance(content, bytes):
        out.write_bytes(content)
    with pytest.raises(DataError, match="hsbench train") as error:
        load_weights(out)
    assert "\n" not in str(error.value)


def test_the_rate_rises_and_falls_to_nothing() -> None:
    rates = [learning_rate(CONFIG, step, 200) for step in range(200)]
    top = int(np.argmax(rates))
    assert top == 9  # a twentieth of the steps
    assert rates[top] == CONFIG.learning_rate
    assert (np.diff(rates[: top + 1]) > 0).all()
    assert (np.diff(rates[top + 1 :]) < 0).all()
    assert 0 < rates[-1] < 0.001 * CONFIG.learning_rate
