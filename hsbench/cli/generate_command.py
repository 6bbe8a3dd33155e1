"""``hsbench generate``."""

from __future__ import annotations

import sys
import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click
from tqdm import tqdm

from hsbench.cli.common import FOLDER, next_step, progress
from hsbench.errors import HsbenchError

if TYPE_CHECKING:
    from hsbench.io.splits import Splits
    from hsbench.synth.executors import Executor
    from hsbench.synth.generate import Job, Made

POSITIVE = click.FloatRange(min=0, min_open=True)


@click.command(
    epilog="Example: hsbench generate rgbd-activity --size mini --out data/rgbd",
    short_help="make a data set from a recipe",
)
@click.argument("recipe")
@click.option("--size", type=click.Choice(["mini", "small", "full"]), default="mini", show_default=True)
@click.option("--split", metavar="NAME", help="Only this split: train, val, test-seen, test-novel.")
@click.option(
    "--episodes", metavar="A:B", help="Only these positions of what size and split choose, as in a Python slice."
)
@click.option(
    "--out", required=True, type=FOLDER, metavar="DIR", help="Folder of the data set; continued if it was begun."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Processes.")
@click.option(
    "--threads", type=click.IntRange(min=1), default=1, show_default=True, help="Of each process, that draw people."
)
@click.option(
    "--shard",
    metavar="I/N",
    help="Only part I of N, from 1/N to N/N: for job arrays, each with its own --out; see merge.",
)
@click.option(
    "--dask", metavar="ADDRESS", help="Workers of this Dask scheduler, in place of processes of this machine."
)
@click.option("--unit-timeout", type=POSITIVE, metavar="S", help="A scene that takes longer fails.")
@click.option("--memory", type=POSITIVE, metavar="GB", help="Of each process; a scene that asks for more fails.")
@click.option(
    "--keep-going/--fail-fast",
    default=True,
    show_default=True,
    help="After a scene that fails: make the others, or stop.",
)
@click.option("--verbose", is_flag=True, help="A line for each scene that is done.")
@click.option(
    "--frames",
    metavar="all|every:N|reference|none",
    default="all",
    show_default=True,
    help="Pictures: all, every N-th, only the one at t0, or none. Poses and truth are always whole.",
)
@click.option("--preview", is_flag=True, help="Make no data: draw a plan and a view of each scene to DIR/preview.png.")
@click.option("--renderer", type=click.Choice(["auto", "pyrender", "raycast"]), default="auto", show_default=True)
def command(
    recipe: str,
    size: str,
    split: str | None,
    episodes: str | None,
    out: Path,
    seed: int,
    workers: int,
    threads: int,
    shard: str | None,
    dask: str | None,
    unit_timeout: float | None,
    memory: float | None,
    keep_going: bool,
    verbose: bool,
    frames: str,
    preview: bool,
    renderer: Literal["auto", "pyrender", "raycast"],
) -> None:
    """Make a data set from RECIPE, a bundled recipe's name or the path of a folder with one.

    Scenes, motion, truth and poses follow from recipe, seed and scene number alone, on any machine and with any
    number of workers. A stopped run goes on where it was when the same command is given again.
    """
    from hsbench.synth.executors import Cluster, local
    from hsbench.synth.generate import Job, missing_units
    from hsbench.synth.limits import Limits
    from hsbench.synth.recipes import find_recipe

    if dask is not None and (workers != 1 or memory is not None):
        raise click.UsageError("--dask takes the cluster's workers and their memory; leave out --workers and --memory")
    splits = find_recipe(recipe).splits
    units = tuple(splits.numbers(size, split)[parse_slice(episodes)][parse_shard(shard)])
    if not units:
        options = (("--episodes", episodes), ("--shard", shard))
        chosen = " ".join(f"{option} {value}" for option, value in options if value is not None)
        raise HsbenchError(f"{chosen} chooses nothing of size {size}" + (f", split {split}" if split else ""))
    job = Job(recipe, seed, units, frames, renderer, splits.version, threads)
    if preview:
        _preview(job, out)
        return
    missing = len(missing_units(job, out))
    least = min(workers, max(missing, 1))
    executor = local(least, Limits(unit_timeout, memory)) if dask is None else Cluster(dask, unit_timeout)
    _tell_cost(job, out, splits, missing, least if dask is None else None)
    _run(job, out, executor, missing, keep_going, verbose)
    if shard is None:
        next_step("verify", out)
    else:
        next_step("merge", out, other=" OTHERS... --out DIR")


def _run(job: Job, out: Path, executor: Executor, missing: int, keep_going: bool, verbose: bool) -> None:
    """Make the units with a progress bar, and say what was done."""
    from hsbench.synth.cost import BYTES_PER_MB, lasting, sized
    from hsbench.synth.generate import make_units, raise_failures

    done: list[Made] = []
    began_s = time.monotonic()
    # Closed at once on Ctrl-C, wherever it strikes: else workers go on until somebody collects the iterator.
    with closing(make_units(job, out, executor, keep_going)) as units:
        for made in progress(units, missing, "generate", "scene"):
            done.append(made)
            if verbose:
                tqdm.write(_line(made, len(done), missing), file=sys.stdout)
    count, size_mb = sum(len(m.episode_ids) for m in done), sum(m.size_bytes for m in done) / BYTES_PER_MB
    took = f" in {lasting(time.monotonic() - began_s)}, {sized(size_mb)}" if count else ""
    failed = [made for made in done if made.error is not None]
    failures = f", {len(failed)} scenes failed" if failed else ""
    click.echo(f"{out}: {len(job.units)} scenes ({count} episodes made now){took}{failures}")
    raise_failures(failed)


def _line(made: Made, position: int, count: int) -> str:
    from hsbench.synth.cost import BYTES_PER_MB, sized

    if made.error is not None:
        return f"failed ({position} of {count}): {made.error}"
    return (
        f"{made.episode_ids[0]} ({position} of {count}): {made.time_s:.1f} s, {sized(made.size_bytes / BYTES_PER_MB)}"
    )


def _tell_cost(job: Job, out: Path, splits: Splits, missing: int, workers: int | None) -> None:
    """Say what each size and this run cost, where that is known. Raises DataError where the disk has no room."""
    from hsbench.synth.cost import lasting, require_room, sized, unit_cost
    from hsbench.synth.recipes import find_recipe

    cost = unit_cost(find_recipe(job.recipe), job.frames)
    if cost is None or not missing:
        return
    for size in splits.scenes:
        count = len(splits.numbers(size))
        whole = cost.times(count)
        click.echo(f"size {size}: {count} scenes, {sized(whole.size_mb)}, {lasting(whole.time_s)} of one process")
    run = cost.times(missing)
    here = "" if workers is None else f", about {lasting(run.time_s / workers)} here"
    click.echo(f"this run: {missing} scenes, {sized(run.size_mb)}{here}")
    require_room(out, run.size_mb)


def _preview(job: Job, out: Path) -> None:
    from hsbench.io.atomic import write_bytes
    from hsbench.io.images import encode_png
    from hsbench.synth.generate import preview
    from hsbench.viz.contact_sheet import scene_cell, sheet

    cells = [scene_cell(episode) for episode in progress(preview(job), len(job.units), "preview", "scene")]
    path = out / "preview.png"
    write_bytes(path, encode_png(sheet(cells)))
    click.echo(path)


def parse_slice(text: str | None) -> slice:
    """``A:B`` (either may be left out) as a slice. Raises HsbenchError for anything else."""
    if text is None:
        return slice(None)
    try:
        start, stop = (int(part) if part else None for part in text.split(":"))
    except ValueError:
        raise HsbenchError(f"--episodes is {text!r}; expected A:B with whole numbers, such as 0:10") from None
    return slice(start, stop)


def parse_shard(text: str | None) -> slice:
    """``I/N`` as a slice: every N-th from the I-th on, counted from 1. Raises HsbenchError for anything else."""
    if text is None:
        return slice(None)
    part, _, count = text.partition("/")
    if not (part.isascii() and part.isdigit() and count.isascii() and count.isdigit() and 1 <= int(part) <= int(count)):
        raise HsbenchError(f"--shard is {text!r}; expected I/N with I from 1 to N, such as 1/8")
    return slice(int(part) - 1, None, int(count))
