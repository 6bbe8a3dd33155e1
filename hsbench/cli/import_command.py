"""``hsbench import``: Kinect v2 recordings and scenes; ``import_rooms`` and ``import_poses`` have the other formats."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import click

from hsbench.cli import import_pictures, import_poses, import_rooms
from hsbench.cli.common import ANY_PATH, FOLDER, new_file, next_step
from hsbench.cli.import_options import FILE, camera_options, chosen_id, name_option, out_option, tell_next


@click.group(short_help="bring a real capture into the schema", epilog="Example: hsbench import sscnet --help")
def command() -> None:
    """Bring real captures into the common schema, so that the same code loads, predicts and scores them."""


@command.command(
    name="kinect-csv", epilog="Example: hsbench import kinect-csv wave.csv --out data/kinect --map map.png"
)
@click.argument("recording_csv", type=FILE)
@out_option
@name_option()
@camera_options
@click.option(
    "--map", "map_png", type=ANY_PATH, metavar="FILE", help="Also draw the activity map seen from above (PNG)."
)
def kinect(
    recording_csv: Path,
    out: Path,
    name: str | None,
    height_m: float | None,
    tilt_deg: float | None,
    map_png: Path | None,
) -> None:
    """A Kinect v2 skeleton recording (LabanotationSuite CSV) as observed poses."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.captures import kinect_episode
    from hsbench.datasets.importers.kinect_csv import estimate_camera, read_kinect_csv

    if (height_m is None) != (tilt_deg is None):
        raise click.UsageError("--height and --tilt go together: give both, or neither to have them estimated")
    if map_png is not None:
        new_file("--map", map_png, ".png")
    episode_id = chosen_id(name, recording_csv.stem)
    recording = read_kinect_csv(recording_csv)
    if height_m is None or tilt_deg is None:
        height_m, tilt_rad = estimate_camera(recording)
    else:
        tilt_rad = math.radians(tilt_deg)
    episode = kinect_episode(recording, episode_id, height_m, tilt_rad)
    add_capture(out, episode)
    click.echo(
        f"{out}: episode {episode.episode_id}, {len(recording.timestamp_ns)} poses in {episode.duration_s:.1f} s, "
        f"camera {height_m:.2f} m high, {_tilt(tilt_rad)}"
    )
    if map_png is not None:
        from hsbench.viz.pictures import save_activity_map

        save_activity_map(map_png, episode)
        click.echo(f"activity map: {map_png}")
    tell_next(out, episode)


@command.command(epilog="Example: hsbench import scene flat.glb --labels flat.csv --out scenes/flat")
@click.argument("source", type=ANY_PATH, metavar="FILE")
@click.option("--labels", type=FILE, metavar="TABLE", help="Which node is what: .csv, .tsv or .json.")
@click.option("--out", required=True, type=FOLDER, metavar="DIR", help="New folder for the scene.")
@name_option("Scene id; default: the file's name.")
@click.option("--default", metavar="CATEGORY", help="Category of nodes without a label, such as object.")
@click.option("--up", type=click.Choice(["y", "z"]), help="Axis of height; default: the format's, y for OBJ.")
@click.option("--scale", type=float, default=1.0, show_default=True, help="Metres per unit.")
@click.option("--assets", type=FOLDER, metavar="DIR", help="Where referenced files lie; default: the folder of FILE.")
def scene(
    source: Path, labels: Path | None, out: Path, name: str | None, default: str | None, up: str | None, scale: float,
    assets: Path | None,
) -> None:  # fmt: skip
    """A furnished room in a 3D FILE: glTF, GLB, OBJ, a list of models, a Habitat scene; or a folder with one of them.

    Its objects get boxes, roles, solid voxels and affordance, its rooms a floor to walk on, as generated scenes have.
    """
    from hsbench.datasets.importers.scene_to_folder import import_to_folder
    from hsbench.schema.states import Affordance

    imported, truth = import_to_folder(
        source, labels, out, name=name, default=default, up=up, scale=scale, assets=assets
    )
    for note in (*imported.notes, *truth.notes):
        click.echo(f"note: {note}", err=True)
    found = imported.scene
    counts = Counter(item.category_name for item in found.objects)
    area = sum(room.area_m2 for room in found.rooms)
    click.echo(
        f"{out}: {len(found.objects)} objects, {len(found.rooms)} rooms of {area:.1f} m2, {found.height_m:.2f} m high"
    )
    click.echo(", ".join(f"{number} {category}" for category, number in sorted(counts.items())))
    click.echo(
        f"{int(truth.occupancy.solid.sum()):,} solid voxels of {truth.occupancy.grid.voxel_m * 100:g} cm, "
        f"{truth.walk.free.sum() * truth.walk.cell_m**2:.1f} m2 free to stand on"
    )
    plan, cell_m2 = truth.affordance.labels, truth.affordance.cell_m**2
    shown = (f"{(plan >> kind & 1).sum() * cell_m2:.2f} m2 {kind.name.lower()}" for kind in Affordance)
    click.echo(f"from above: {', '.join(shown)}")
    next_step("export", out, "--plan", "plan.svg")


for other in (*import_rooms.COMMANDS, *import_poses.COMMANDS, *import_pictures.COMMANDS):
    command.add_command(other)


def _tilt(tilt_rad: float) -> str:
    return f"looking {abs(math.degrees(tilt_rad)):.1f} deg {'down' if tilt_rad >= 0 else 'up'}"
