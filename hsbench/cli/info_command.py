"""``hsbench info``."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import ANY_PATH, FOLDER, json_option, new_file, print_json, progress

if TYPE_CHECKING:
    from hsbench.datasets.dataset import Dataset
    from hsbench.datasets.statistics import Classes, SplitCounts

MOST_PICTURES = 12
MEGABYTE = 1e6


@click.command(epilog="Example: hsbench info data/rgbd --classes", short_help="what a data set holds")
@click.argument("data", type=FOLDER)
@click.option("--classes", is_flag=True, help="Also people, objects, actions and affordances, from the truth.")
@click.option("--pictures", type=ANY_PATH, metavar="FILE.png", help="Also draw a sheet of some of its episodes.")
@json_option
def command(data: Path, classes: bool, pictures: Path | None, as_json: bool) -> None:
    """What DATA holds: episodes per split, length, pictures, poses, sizes on disk, how it was made."""
    from hsbench.datasets.dataset import load
    from hsbench.datasets.statistics import Classes, class_balance, split_counts
    from hsbench.io.dataset_index import contents_sha256
    from hsbench.io.plain import to_plain

    if pictures is not None:
        new_file("--pictures", pictures, ".png")
    dataset = load(data)
    description = dataset.description
    keys = ("name", "schema_version", "seed", "splits_version", "frames", "licence")
    facts = {key: description[key] for key in keys if key in description}
    splits = split_counts(dataset)
    hashes = {
        "contents_sha256": contents_sha256(data),
        "contents_sha256_without_pictures": contents_sha256(data, pictures=False),
    }
    balance = sum(progress(class_balance(dataset), len(dataset), "info"), Classes()) if classes else None
    if pictures is not None:
        _draw(dataset, pictures)
    if as_json:
        more = {} if balance is None else {"classes": to_plain(balance)}
        print_json({**facts, "manifest_sha256": dataset.manifest_sha256, **hashes, "splits": to_plain(splits), **more})
        return
    click.echo(", ".join(f"{key} {value}" for key, value in facts.items()))
    _print_splits(splits)
    for key, digest in hashes.items():
        click.echo(f"{key} {digest}")
    if balance is not None:
        _print_classes(balance, len(dataset))
    if pictures is not None:
        click.echo(f"{pictures}: a sheet of episodes")


def _print_splits(splits: dict[str, SplitCounts]) -> None:
    head = f"{'split':<12}{'episodes':>9}{'scenes':>8}{'hours':>8}{'frames':>9}{'poses':>10}"
    click.echo(head + "".join(f"{kind + ' MB':>13}" for kind in ("pictures", "poses", "truth")))
    for name, row in splits.items():
        click.echo(
            f"{name or '(none)':<12}{row.episodes:>9}{row.scenes:>8}{row.hours:>8.2f}{row.frames:>9}{row.poses:>10}"
            + "".join(f"{row.bytes_on_disk[kind] / MEGABYTE:>13.1f}" for kind in ("pictures", "poses", "truth"))
        )


def _print_classes(balance: Classes, episodes: int) -> None:
    click.echo(f"people: {balance.people} in {episodes} episodes, at most {balance.largest_group} in one")
    click.echo(f"actions of true poses: {_shares(balance.actions, balance.actions.total())}")
    click.echo(f"affordance of labelled cells from above: {_shares(balance.affordance_cells, balance.labelled_cells)}")
    counts = ", ".join(f"{name} {count}" for name, count in balance.objects.most_common())
    click.echo(f"objects: {balance.objects.total()} of {len(balance.objects)} categories: {counts or 'none'}")


def _shares(counts: Counter[str], total: int) -> str:
    return ", ".join(f"{name} {count / total:.1%}" for name, count in counts.most_common() if total) or "none"


def _draw(dataset: Dataset, path: Path) -> None:
    """A sheet of episodes spread over the data set: plan and first picture where truth is there, else the picture."""
    from dataclasses import replace

    import numpy as np

    from hsbench.errors import HsbenchError
    from hsbench.io.atomic import write_bytes
    from hsbench.io.images import encode_png
    from hsbench.viz.contact_sheet import ROW_PX, scene_cell, sheet
    from hsbench.viz.frames import annotated

    episodes = replace(dataset, truth=True)
    chosen = np.unique(np.linspace(0, len(episodes) - 1, min(MOST_PICTURES, len(episodes))).round().astype(int))
    cells = []
    for episode in (episodes[int(index)] for index in chosen):
        if episode.truth is not None and episode.truth.scene is not None:
            cells.append(scene_cell(episode))
        elif len(episode.frames):
            cells.append(annotated(episode, 0, ROW_PX))
    if not cells:
        raise HsbenchError(f"{dataset.root} has neither pictures nor scenes to draw")
    write_bytes(path, encode_png(sheet(cells)))
