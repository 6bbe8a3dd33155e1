"""``hsbench info``."""

from __future__ import annotations

from pathlib import Path

import click

from hsbench.cli.common import FOLDER, json_option, print_json


@click.command(epilog="Example: hsbench info data/rgbd", short_help="what a data set holds")
@click.argument("data", type=FOLDER)
@json_option
def command(data: Path, as_json: bool) -> None:
    """What DATA holds: episodes per split, length, pictures, poses, how it was made."""
    from hsbench.datasets.dataset import load
    from hsbench.io.splits import SPLITS

    dataset = load(data)
    description = dataset.description
    splits = {}
    for name in sorted(
        {r["split"] for r in dataset.rows}, key=lambda s: SPLITS.index(s) if s in SPLITS else len(SPLITS)
    ):
        rows = [r for r in dataset.rows if r["split"] == name]
        splits[name] = {
            "episodes": len(rows),
            "scenes": len({r["scene_id"] for r in rows}),
            "hours": round(sum(r["duration_s"] for r in rows) / 3600, 3),
            "frames": sum(r["n_frames"] for r in rows),
            "poses": sum(r["n_poses"] for r in rows),
        }
    keys = ("name", "schema_version", "seed", "splits_version", "frames", "licence")
    facts = {key: description[key] for key in keys if key in description}
    if as_json:
        print_json({**facts, "manifest_sha256": dataset.manifest_sha256, "splits": splits})
        return
    click.echo(", ".join(f"{key} {value}" for key, value in facts.items()))
    click.echo(f"{'split':<12}{'episodes':>9}{'scenes':>8}{'hours':>8}{'frames':>9}{'poses':>10}")
    for name, row in splits.items():
        click.echo(
            f"{name or '(none)':<12}{row['episodes']:>9}{row['scenes']:>8}{row['hours']:>8.2f}"
            f"{row['frames']:>9}{row['poses']:>10}"
        )
