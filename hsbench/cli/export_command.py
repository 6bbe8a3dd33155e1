"""``hsbench export``."""

from __future__ import annotations

from pathlib import Path

import click

from hsbench.cli.common import ANY_PATH


@click.command(
    epilog="Example: hsbench export data/rgbd --episode rgbd-activity-000000 --glb room.glb --plan room.svg",
    short_help="a scene as GLB, JSON or plan drawing",
)
@click.argument("source", type=ANY_PATH, metavar="SCENE")
@click.option("--episode", metavar="ID", help="Which episode, where SCENE is a data set.")
@click.option("--glb", type=ANY_PATH, metavar="FILE", help="Geometry with names, roles and colours (binary glTF 2.0).")
@click.option("--json", "description", type=ANY_PATH, metavar="FILE", help="Rooms, boxes and parts, readable.")
@click.option("--plan", type=ANY_PATH, metavar="FILE", help="Plan seen from above, .svg or .png.")
@click.option(
    "--width", "width_px", type=click.IntRange(200, 8000), default=1600, show_default=True, help="Of the PNG."
)
def command(
    source: Path, episode: str | None, glb: Path | None, description: Path | None, plan: Path | None, width_px: int
) -> None:
    """Write the scene of SCENE (a scene folder, an episode with truth, or a data set) in forms others can read."""
    from hsbench.io.atomic import write_bytes, write_json, write_text
    from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER
    from hsbench.io.images import encode_png
    from hsbench.io.scene_folder import read_scene
    from hsbench.io.scene_glb import glb_bytes
    from hsbench.io.scene_json import scene_description
    from hsbench.viz.plan import plan_image, plan_svg

    if glb is None and description is None and plan is None:
        raise click.UsageError("nothing to write: give --glb, --json or --plan")
    if plan is not None and plan.suffix.lower() not in (".svg", ".png"):
        raise click.UsageError(f"--plan {plan}: expected a file that ends in .svg or .png")
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
