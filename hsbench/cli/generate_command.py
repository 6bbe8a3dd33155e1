"""``hsbench generate``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from hsbench.cli.common import FOLDER, next_step, progress
from hsbench.errors import HsbenchError

if TYPE_CHECKING:
    from hsbench.synth.generate import Job


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
    frames: str,
    preview: bool,
    renderer: Literal["auto", "pyrender", "raycast"],
) -> None:
    """Make a data set from RECIPE, a bundled recipe's name or the path of a folder with one.

    Scenes, motion, truth and poses follow from recipe, seed and scene number alone, on any machine and with any
    number of workers. A stopped run goes on where it was when the same command is given again.
    """
    from hsbench.io.splits import read_splits
    from hsbench.synth.generate import Job, episode_id, generate
    from hsbench.synth.recipes import find_recipe

    units = read_splits(find_recipe(recipe).name).numbers(size, split)[parse_slice(episodes)]
    if not units:
        raise HsbenchError(
            f"--episodes {episodes} chooses nothing of size {size}" + (f", split {split}" if split else "")
        )
    job = Job(recipe, seed, tuple(units), frames, renderer)
    if preview:
        _preview(job, out)
        return
    firsts = {episode_id(find_recipe(recipe).name, number) for number, _ in units}
    made: list[str] = []
    for _ in progress(
        (i for i in _noted(generate(job, out, workers), made) if i in firsts), len(units), "generate", "scene"
    ):
        pass
    click.echo(f"{out}: {len(units)} scenes ({len(made)} episodes made now)")
    next_step("verify", out)


def _noted(names: Iterable[str], into: list[str]) -> Iterator[str]:
    """Pass names on, keeping them."""
    for name in names:
        into.append(name)
        yield name


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
