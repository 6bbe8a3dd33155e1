"""``hsbench pack``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click

from hsbench.cli.common import FOLDER, next_step, progress


@click.group(
    short_help="divide a test set into inputs to publish and hidden truth",
    epilog="Example: hsbench pack inputs --help",
)
def command() -> None:
    """Divide an organiser's data set, made with a secret seed, into the inputs that are published and the truth that
    scores what comes back. Both are data sets that load and verify, with the same new names.
    """


def _part(function: Callable[..., Any]) -> Callable[..., Any]:
    """DATA, ``--out DIR`` and ``--secret N``."""
    out = click.option("--out", required=True, type=FOLDER, metavar="DIR", help="A new folder for it.")
    secret = click.option(
        "--secret",
        type=click.IntRange(min=0),
        metavar="N",
        help="128 random bits that decide the new names, the same for inputs and truth; default: the seed of DATA.",
    )
    return click.argument("data", type=FOLDER)(out(secret(function)))


@command.command(epilog="Example: hsbench pack inputs data/secret --out hidden/inputs")
@_part
def inputs(data: Path, out: Path, secret: int | None) -> None:
    """The inputs of DATA alone: noise in full pictures, no backgrounds, no seed, new names. Safe to publish."""
    from hsbench.datasets.packing import pack_inputs

    _write(pack_inputs(data, out, secret), data, out)
    next_step("pack", "truth", data, "--out", "DIR", other=" --secret N" if secret is not None else "")


@command.command(epilog="Example: hsbench pack truth data/secret --out hidden/truth")
@_part
def truth(data: Path, out: Path, secret: int | None) -> None:
    """The rest of DATA, under the names of the packed inputs: what scores their predictions. Keep it."""
    from hsbench.datasets.packing import pack_truth

    _write(pack_truth(data, out, secret), data, out)
    next_step("score", "SUBMISSION", "--task", "NAME", "--data", out, "--out", "report.json")


def _write(made: Iterator[str], data: Path, out: Path) -> None:
    from hsbench.datasets.dataset import load

    count = len(load(data))
    for _ in progress(made, count, "pack"):
        pass
    click.echo(f"{out}: {count} episodes")
