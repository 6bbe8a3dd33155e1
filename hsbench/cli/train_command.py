"""``hsbench train``."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import click

from hsbench.cli.common import ANY_PATH, FOLDER, new_file, next_step, progress


@click.command(
    epilog="Example: hsbench train voxelnet --data data/rgbd --out voxelnet.safetensors --seed 1",
    short_help="train a baseline that is a network",
)
@click.argument("method")
@click.option("--data", required=True, type=FOLDER, metavar="DIR", help="Data set with splits train and val.")
@click.option("--out", required=True, type=ANY_PATH, metavar="FILE", help="Weights to write: NAME.safetensors.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of weights, order and mirrors.")
@click.option("--epochs", type=click.IntRange(min=1), help="Passes over split train; default: the method's own.")
@click.option("--threads", type=click.IntRange(min=1), help="Threads of torch; default: as torch chooses.")
@click.option("--resume", is_flag=True, help="Go on where a run that was stopped left its checkpoint.")
def command(
    method: str, data: Path, out: Path, seed: int, epochs: int | None, threads: int | None, resume: bool
) -> None:
    """Train METHOD on split train, watched on split val, and write its weights with a model card and curves.

    A checkpoint beside --out is written after every epoch and on Ctrl-C; --resume goes on from it and ends with the
    same weights as a run that nobody stopped. METHOD: voxelnet or voxelnet-alone.
    """
    from dataclasses import replace

    from hsbench import __version__
    from hsbench.baselines.model_card import ENDING
    from hsbench.baselines.trainable import trainable
    from hsbench.datasets.dataset import load

    new_file("--out", out, ENDING)
    chosen = trainable(method)
    from hsbench.baselines.training import set_threads, train

    if threads is not None:
        set_threads(threads)
    splits = {split: load(data, split, truth=True) for split in ("train", "val")}
    examples = [
        [chosen.example(episode) for episode in progress(found, len(found), f"reading {split}")]
        for split, found in splits.items()
    ]
    problem = chosen.problem(examples[0], examples[1], seed)
    of_data = {
        "name": splits["train"].name,
        "manifest_sha256": splits["train"].manifest_sha256,
        **{f"{split}_episodes": len(found) for split, found in splits.items()},
    }
    problem = replace(problem, card={**problem.card, "data": of_data, "hsbench": __version__})
    config = replace(chosen.config, seed=seed, epochs=epochs or chosen.config.epochs)
    with closing(train(problem, config, out, resume=resume)) as steps:
        shown = 0
        for step in progress(steps, config.steps(problem.samples), method, unit="step"):
            if len(step.curve) > shown:
                shown = len(step.curve)
                click.echo("  ".join(f"{k} {v:.4g}" for k, v in step.curve[-1].items()), err=True)
    click.echo(f"{out}: {method} after {config.epochs} epochs, seed {seed}")
    next_step("predict", method, "--data", data, "--split", "val", "--weights", out, "--out", "PRED")
