"""``hsbench merge``."""

from __future__ import annotations

from pathlib import Path

import click

from hsbench.cli.common import FOLDER, next_step, progress


@click.command(
    epilog="Example: hsbench merge data/part-1 data/part-2 --out data/rgbd",
    short_help="join data sets made with generate --shard",
)
@click.argument("shards", nargs=-1, required=True, type=FOLDER, metavar="SHARD...")
@click.option("--out", required=True, type=FOLDER, metavar="DIR", help="Folder of the whole; continued if it is there.")
def command(shards: tuple[Path, ...], out: Path) -> None:
    """Join SHARDs of one data set: the bytes are those of one run that made all.

    Each must be finished and of the same recipe, seed, version and renderer. Files are linked where the disk is the
    same, else copied.
    """
    from hsbench.io.dataset_index import unit_folders
    from hsbench.synth.merge import merge

    most = sum(len(unit_folders(shard)) for shard in shards)
    count = sum(1 for _ in progress(merge(shards, out), most, "merge"))
    click.echo(f"{out}: {count} episodes of {len(shards)} shards")
    next_step("verify", out)
