"""``hsbench export``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import ANY_PATH, new_file, progress

if TYPE_CHECKING:
    from hsbench.datasets.dataset import Dataset

FORMS = {
    "coco": 'pycocotools.coco.COCO("{out}/annotations/person_keypoints_SPLIT.json")',
    "huggingface": 'datasets.load_dataset("{out}", "frames")',
    "webdataset": 'webdataset.WebDataset("{out}/SPLIT-000000.tar")',
    "croissant": "mlcroissant validate --jsonld {out}/croissant.json",
    "glb": "hsbench import scene {out}/EPISODE.glb --out scenes/EPISODE",
    "rerun": "rerun {out}/EPISODE.rrd",
}
"""What --to takes, and what to type next, in a shell or in Python."""


@click.command(
    epilog="Example: hsbench export data/rgbd --to coco --out coco",
    short_help="a data set as COCO, Hugging Face, WebDataset ..., or a scene as GLB, JSON or plan",
)
@click.argument("source", type=ANY_PATH, metavar="DATA|SCENE")
@click.option("--to", "form", type=click.Choice(list(FORMS)), help="What to make of DATA.")
@click.option("--out", type=ANY_PATH, metavar="DIR", help="A new folder for it.")
@click.option("--truth", is_flag=True, help="Truth too; without it inputs only.")
@click.option("--split", metavar="NAME", help="Only this split.")
@click.option("--episode", metavar="ID", help="Only this episode; which one, where a scene is drawn of a data set.")
@click.option("--glb", type=ANY_PATH, metavar="FILE", help="Geometry with names, roles and colours (binary glTF 2.0).")
@click.option("--json", "description", type=ANY_PATH, metavar="FILE", help="Rooms, boxes and parts, readable.")
@click.option("--plan", type=ANY_PATH, metavar="FILE", help="Plan seen from above, .svg or .png.")
@click.option(
    "--width", "width_px", type=click.IntRange(200, 8000), default=1600, show_default=True, help="Of the PNG."
)
def command(
    source: Path,
    form: str | None,
    out: Path | None,
    truth: bool,
    split: str | None,
    episode: str | None,
    glb: Path | None,
    description: Path | None,
    plan: Path | None,
    width_px: int,
) -> None:
    """Write DATA in a form that other tools read (--to, --out), or the scene of SCENE (a scene folder, an episode with
    truth, or a data set with --episode) as files (--glb, --json, --plan).
    """
    files = {
        option: (path, endings)
        for option, path, endings in (
            ("--glb", glb, (".glb",)),
            ("--json", description, (".json",)),
            ("--plan", plan, (".svg", ".png")),
        )
        if path is not None
    }
    if form is not None:
        if files:
            raise click.UsageError("--to takes a data set and --out; --glb, --json and --plan are for one scene")
        if out is None:
            raise click.UsageError(f"--to {form} needs --out DIR, a new folder")
        _export_data(source, form, out, truth, split, episode)
    elif out is not None or truth or split is not None:
        raise click.UsageError(f"--out, --truth and --split go with --to, one of {', '.join(FORMS)}")
    elif not files:
        raise click.UsageError("nothing to write: give --to and --out, or --glb, --json or --plan")
    else:
        for option, (path, endings) in files.items():
            new_file(option, path, *endings)
        _export_scene(source, episode, glb, description, plan, width_px)


def _export_data(source: Path, form: str, out: Path, truth: bool, split: str | None, episode: str | None) -> None:
    from dataclasses import replace

    from hsbench.datasets.dataset import load
    from hsbench.datasets.exports.coco import write_coco
    from hsbench.datasets.exports.croissant import write_croissant
    from hsbench.datasets.exports.glb import write_glb
    from hsbench.datasets.exports.huggingface import write_huggingface
    from hsbench.datasets.exports.webdataset import write_webdataset
    from hsbench.errors import DataError

    writers = {
        "coco": write_coco,
        "huggingface": write_huggingface,
        "webdataset": write_webdataset,
        "croissant": write_croissant,
        "glb": write_glb,
        "rerun": _write_rerun,
    }
    if form == "glb" and not truth:
        raise click.UsageError("a scene is truth: give --truth")
    if form == "croissant" and (split is not None or episode is not None):
        raise click.UsageError("croissant describes a whole data set; expected neither --split nor --episode")
    data = load(source, split, truth=truth)
    if episode is not None:
        rows = tuple(row for row in data.rows if row["episode_id"] == episode)
        if not rows:
            raise DataError(f"{source} has no episode {episode!r} among {len(data)} (hsbench info tells what it holds)")
        data = replace(data, rows=rows)
    count = len(data)
    for _ in progress(writers[form](data, out), count, "export"):
        pass
    click.echo(f"{out}: {count} episodes as {form}, {'with truth' if truth else 'inputs only'}")
    click.echo(f"next: {FORMS[form].format(out=out)}")


def _write_rerun(data: Dataset, out: Path) -> Iterator[str]:
    """``out/EPISODE.rrd`` of each episode; the folder appears at the end, whole."""
    from hsbench.datasets.exports.frames import export_folder, require_content
    from hsbench.viz.rerun_log import write_rerun

    require_content(len(data), "episode", data.root)
    with export_folder(out) as folder:
        for episode in data:
            write_rerun(folder / f"{episode.episode_id}.rrd", episode)
            yield episode.episode_id


def _export_scene(
    source: Path, episode: str | None, glb: Path | None, description: Path | None, plan: Path | None, width_px: int
) -> None:
    from hsbench.io.atomic import write_bytes, write_json, write_text
    from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER
    from hsbench.io.images import encode_png
    from hsbench.io.scene_folder import read_scene
    from hsbench.io.scene_glb import glb_bytes
    from hsbench.io.scene_json import scene_description
    from hsbench.viz.plan import plan_image, plan_svg

    if (source / DATASET_FILE).is_file() and episode is None:
        raise click.UsageError(f"{source} is a data set: give --episode ID (hsbench info {source} tells what it holds)")
    scene = read_scene(source if episode is None else source / EPISODES_FOLDER / episode)
    if glb is not None:
        write_bytes(glb, glb_bytes(scene))
        click.echo(f"{glb}: {len(scene.objects)} objects")
    if description is not None:
        write_json(description, scene_description(scene))
        click.echo(f"{description}: {len(scene.objects)} objects, {len(scene.rooms)} rooms")
    if plan is not None:
        if plan.suffix.lower() == ".svg":
            write_text(plan, plan_svg(scene))
        else:
            write_bytes(plan, encode_png(plan_image(scene, width_px)))
        click.echo(f"{plan}: plan of {scene.scene_id}")
