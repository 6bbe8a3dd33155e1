"""``hsbench train``: weights that predict takes, a run that goes on where it stopped, and mistakes in one line."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hsbench.cli.main import run

pytest.importorskip("torch")


def test_trained_weights_answer_and_a_stopped_run_goes_on(
    rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from torch.optim import AdamW

    out, whole = tmp_path / "net.safetensors", tmp_path / "whole.safetensors"
    command = ["train", "voxelnet-alone", "--data", str(rgbd), "--epochs", "2", "--seed", "3", "--threads", "1"]
    step = AdamW.step

    def interrupted(optimiser: AdamW) -> object:
        signal.raise_signal(signal.SIGINT)
        return step(optimiser)

    with monkeypatch.context() as patch:
        patch.setattr(AdamW, "step", interrupted)
        assert run([*command, "--out", str(out)]) == 130
    assert not out.exists()
    assert run([*command, "--out", str(out)]) == 2
    assert "go on with --resume" in capsys.readouterr().err
    assert run([*command, "--out", str(out), "--resume"]) == 0
    assert run([*command, "--out", str(whole)]) == 0
    assert out.read_bytes() == whole.read_bytes()
    shown = capsys.readouterr()
    assert "val_iou" in shown.err
    assert "next: hsbench predict voxelnet-alone" in shown.out
    card = json.loads(whole.with_suffix(".json").read_text(encoding="utf-8"))
    assert (card["data"]["train_episodes"], card["data"]["val_episodes"], card["config"]["seed"]) == (2, 2, 3)
    assert len(card["data"]["manifest_sha256"]) == 64
    answer = ["predict", "voxelnet-alone", "--data", str(rgbd), "--split", "val", "--weights", str(whole)]
    assert run([*answer, "--out", str(tmp_path / "pred")]) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["voxelnot", "--out", "a.safetensors"],
            "'voxelnot' cannot be trained; expected one of voxelnet, voxelnet-alone",
        ),
        (["voxelnet", "--out", "a.pt"], "expected a file that ends in .safetensors"),
        (["voxelnet", "--out", "a.safetensors", "--epochs", "0"], "0 is not in the range x>=1"),
    ],
)
def test_mistakes_are_one_line(
    words: list[str], said: str, rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(tmp_path / word) if word.startswith("a.") else word for word in words]
    assert run(["train", *words, "--data", str(rgbd)]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words",
    [
        ["train", "voxelnet", "--data", "DATA", "--out", "x.safetensors"],
        ["predict", "voxelnet", "--data", "DATA", "--out", "x"],
    ],
    ids=["train", "predict"],
)
def test_without_torch_the_extra_is_named(words: list[str], rgbd: Path, tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['torch'] = None\n"
        "from hsbench.cli.main import run\n"
        f"sys.exit(run({[str(rgbd) if word == 'DATA' else word for word in words]}))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "error: a network needs torch, which is not installed: pip install 'hsbench[torch]'\n"
    assert not list(tmp_path.iterdir())


def test_weights_are_for_networks(rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["predict", "carve", "--data", str(rgbd), "--weights", "x.safetensors", "--out", str(tmp_path / "p")]
    assert run(words) == 2
    assert "carve has no weights" in capsys.readouterr().err
