"""``hsbench predict``."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import click

from hsbench.cli.common import ANY_PATH, FOLDER, next_step, on_split, progress
from hsbench.errors import HsbenchError


@click.command(
    epilog="Example: hsbench predict carve --data data/rgbd --split val --out pred/carve",
    short_help="run a baseline over a data set",
)
@click.argument("method", required=False)
@click.option("--task", "task_name", metavar="NAME", help="The task; needed where several have METHOD.")
@click.option("--data", type=FOLDER, metavar="DIR", help="Folder of a data set.")
@click.option("--split", metavar="NAME", help="Only this split: train, val, test-seen, test-novel.")
@click.option("--out", type=FOLDER, metavar="DIR", help="Folder of the submission.")
@click.option(
    "--train", type=FOLDER, metavar="DIR", help="Data set whose split train fits the method; default: the same."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of methods that draw.")
@click.option(
    "--weights", type=ANY_PATH, metavar="FILE", help="Of a network, as hsbench train writes it; default: its own."
)
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Processes.")
@click.option("--replace", is_flag=True, help="Replace --out if it exists.")
@click.option("--list", "list_methods", is_flag=True, is_eager=True, help="List the methods.")
def command(
    method: str | None,
    task_name: str | None,
    data: Path | None,
    split: str | None,
    out: Path | None,
    train: Path | None,
    seed: int,
    weights: Path | None,
    workers: int,
    replace: bool,
    list_methods: bool,
) -> None:
    """Run METHOD on every episode of a data set and write its answers as a submission; without METHOD, list them."""
    from hsbench.baselines.registry import METHODS, find
    from hsbench.baselines.run import predict
    from hsbench.datasets.dataset import load
    from hsbench.tasks.registry import task

    if list_methods or (method is None and data is None and out is None):
        for name in METHODS if task_name is None else [task(task_name).name]:
            for item in METHODS[name].values():
                control = f" (control {item.control})" if item.control else ""
                click.echo(f"{item.name:<22}{item.task:<26}{item.track:<14}{item.summary}{control}")
        return
    if method is None or data is None or out is None:
        raise click.UsageError("METHOD, --data DIR and --out DIR go together; hsbench predict alone lists the methods")
    if out.exists() and not replace:
        raise HsbenchError(f"{out} exists already; choose another --out or give --replace")
    dataset = load(data, split)
    chosen = find(method, dataset.name, task_name)
    training = None if train is None else load(train, "train")
    # Closed at once on Ctrl-C, as in ``generate``: else workers go on until somebody collects the iterator.
    with closing(
        predict(chosen, dataset, out, train=training, seed=seed, weights=weights, replace_out=replace, workers=workers)
    ) as answers:
        count = sum(1 for _ in progress(answers, len(dataset), method))
    click.echo(f"{out}: {count} predictions of {method}")
    next_step("check", out, "--task", chosen.task, "--data", data, *on_split(split))
