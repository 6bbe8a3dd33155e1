"""``hsbench demo``."""

from __future__ import annotations

import os
from pathlib import Path

import click

from hsbench.cli.common import FOLDER


@click.command(epilog="Example: hsbench demo --out demo", short_help="the whole product at small size")
@click.option("--out", type=FOLDER, default=Path("demo"), show_default=True, metavar="DIR")
@click.option("--workers", type=click.IntRange(min=1), help="Processes; default: one a core, at most 4.")
@click.option("--quick", is_flag=True, help="Fewer episodes and only the pictures at t0.")
def command(out: Path, workers: int | None, quick: bool) -> None:
    """Generate rooms with a person in them, run baselines, score them, and write report.html. Takes a few minutes."""
    from hsbench.cli.demo import demo

    for step in demo(out, workers or min(os.cpu_count() or 1, 4), quick):
        click.echo(step.text)
