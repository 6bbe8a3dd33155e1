"""``hsbench import`` of rooms before an RGB-D camera: SSCNet frames, SUN RGB-D, NYU v2, room models, TUM RGB-D."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import FOLDER, next_step
from hsbench.cli.import_options import FILE, chosen_id, name_option, out_option, tell_next

if TYPE_CHECKING:
    from hsbench.schema.episode import Episode

TUM_CAMERAS = ("freiburg1", "freiburg2", "freiburg3", "ros-default")


@click.command(epilog="Example: hsbench import sscnet NYU0001_0000.png NYU0001_0000.bin --out data/nyu")
@click.argument("depth_png", type=FILE)
@click.argument("volume_bin", type=FILE)
@out_option
@name_option("Episode id; default: the volume's file name.")
def sscnet(depth_png: Path, volume_bin: Path, out: Path, name: str | None) -> None:
    """An SSCNet / NYU frame: depth image DEPTH_PNG and labelled volume VOLUME_BIN, as input and truth."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.captures import sscnet_episode
    from hsbench.datasets.importers.sscnet import read_frame
    from hsbench.tasks.scene_completion import GRID

    episode_id = chosen_id(name, volume_bin.stem)
    episode = sscnet_episode(read_frame(depth_png, volume_bin), episode_id, GRID)
    add_capture(out, episode)
    click.echo(
        f"{_placed(out, episode)}" + ("" if episode.truth else "; the volume has no labels, so there is no truth")
    )
    next_step("predict", "all-solid", "--data", out, "--out", "pred")


@click.command(epilog="Example: hsbench import sunrgbd SUNRGBD/kv1/b3dodata/img_0063 --out data/sunrgbd")
@click.argument("frame", type=FOLDER)
@out_option
@name_option("Episode id; default: the folder's name.")
@click.option("--filled", is_flag=True, help="Depth with its holes filled (depth_bfx), as detectors take it.")
def sunrgbd(frame: Path, out: Path, name: str | None, filled: bool) -> None:
    """A SUN RGB-D FRAME folder: colour and depth as input, annotated boxes and the drawn room as truth."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.room_captures import sunrgbd_episode
    from hsbench.datasets.importers.sunrgbd import read_sunrgbd

    episode_id = chosen_id(name, frame.resolve().name)
    episode, notes = sunrgbd_episode(read_sunrgbd(frame, filled=filled), episode_id)
    add_capture(out, episode)
    _tell(out, episode, notes)


@click.command(
    name="sunrgbd-text",
    epilog="Example: hsbench import sunrgbd-text label/000001.txt calib/000001.txt image/000001.jpg --out data/votenet",
)
@click.argument("boxes", type=FILE)
@click.argument("calib", type=FILE)
@click.argument("image", type=FILE)
@click.option("--points", type=FILE, metavar="FILE", help="Upright points, *_pc.npz or points/*.bin: gives depth.")
@out_option
@name_option()
def sunrgbd_text(boxes: Path, calib: Path, image: Path, points: Path | None, out: Path, name: str | None) -> None:
    """A SUN RGB-D frame as VoteNet and mmdet3d have it: BOXES (label .txt or _bbox.npy), CALIB and IMAGE."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.room_captures import sunrgbd_text_episode
    from hsbench.datasets.importers.sunrgbd_text import read_sunrgbd_text

    episode_id = chosen_id(name, image.stem)
    episode, notes = sunrgbd_text_episode(read_sunrgbd_text(boxes, calib, image, points), episode_id)
    add_capture(out, episode)
    _tell(out, episode, notes)


@click.command(
    name="tum-rgbd", epilog="Example: hsbench import tum-rgbd rgbd_dataset_freiburg3_sitting_static --out data/tum"
)
@click.argument("sequence", type=FOLDER)
@out_option
@name_option("Episode id; default: the folder's name.")
@click.option("--camera", type=click.Choice(TUM_CAMERAS), help="Whose calibration; default: by the folder's name.")
@click.option(
    "--height", "height_m", type=click.FloatRange(0, 100, min_open=True), metavar="M",
    help="Camera height; default: by the floor in the first depth picture.",
)  # fmt: skip
def tum_rgbd(sequence: Path, out: Path, name: str | None, camera: str | None, height_m: float | None) -> None:
    """A TUM RGB-D SEQUENCE folder: its first stretch in which the camera stands still."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.room_captures import tum_episode
    from hsbench.datasets.importers.tum_rgbd import read_tum_rgbd

    episode_id = chosen_id(name, sequence.resolve().name)
    episode, notes = tum_episode(read_tum_rgbd(sequence, camera), episode_id, height_m)
    add_capture(out, episode)
    _tell(out, episode, notes, f"{len(episode.frames)} frames in {episode.duration_s:.1f} s")


@click.command(epilog="Example: hsbench import nyucad NYUCAD_3D/mat/1_kitchen.mat --out data/nyucad")
@click.argument("model", type=FILE)
@click.option("--depth", type=FILE, metavar="FILE", help="SSCNet's depth picture of the frame, as input.")
@out_option
@name_option()
def nyucad(model: Path, depth: Path | None, out: Path, name: str | None) -> None:
    """A room MODEL (.mat) of an NYU v2 frame: objects with meshes and the outline of the floor as truth."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.nyucad import read_nyucad
    from hsbench.datasets.importers.room_captures import nyucad_episode
    from hsbench.datasets.importers.sscnet import read_depth_png

    episode_id = chosen_id(name, model.stem)
    found = read_nyucad(model)
    episode, notes = nyucad_episode(found, episode_id, None if depth is None else read_depth_png(depth))
    add_capture(out, episode)
    _tell(out, episode, notes)


@click.command(
    name="nyu-v2", epilog="Example: hsbench import nyu-v2 nyu_depth_v2_labeled.mat --frame 1 --out data/nyu-v2"
)
@click.argument("labelled", type=FILE)
@click.option("--frame", "number", type=click.IntRange(1), required=True, metavar="N", help="Which, counted from 1.")
@click.option("--classes", type=FILE, metavar="FILE", help="classMapping40.mat: classes by their 40 coarser ones.")
@click.option("--rotations", type=FILE, metavar="FILE", help="Rotations that turn the cameras upright, as text.")
@out_option
@name_option("Episode id; default: NYU and the number.")
def nyu_v2(
    labelled: Path, number: int, classes: Path | None, rotations: Path | None, out: Path, name: str | None
) -> None:
    """A frame of NYU v2's LABELLED .mat: colour and depth; with --rotations, labelled surfaces in voxels as truth."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.nyu_labelled import read_nyu_labelled, read_rotation
    from hsbench.datasets.importers.room_captures import nyu_episode
    from hsbench.tasks.scene_completion import GRID

    frame = read_nyu_labelled(labelled, number - 1, classes)
    rotation = None if rotations is None else read_rotation(rotations, number - 1)
    episode, notes = nyu_episode(frame, name or f"NYU{number:04d}", rotation, GRID)
    add_capture(out, episode)
    _tell(out, episode, notes, f"{len(frame.names)} labelled things")


COMMANDS = (sscnet, sunrgbd, sunrgbd_text, nyu_v2, nyucad, tum_rgbd)


def _placed(out: Path, episode: Episode) -> str:
    """Where the camera of an episode stands, in one line."""
    sensor = episode.sensor
    high = "" if sensor.height_m is None else f"{sensor.height_m:.2f} m high, "
    tilt = f"looking {abs(math.degrees(sensor.tilt_rad)):.1f} deg {'down' if sensor.tilt_rad >= 0 else 'up'}"
    roll = f"rolled {math.degrees(sensor.roll_rad):.1f} deg"
    return f"{out}: episode {episode.episode_id}, camera {high}{tilt}, {roll}"


def _tell(out: Path, episode: Episode, notes: Iterable[str], more: str = "") -> None:
    """What was imported, what was assumed, and what may follow."""
    for note in notes:
        click.echo(f"note: {note}", err=True)
    click.echo(_placed(out, episode))
    if episode.truth is not None and episode.truth.scene is not None:
        scene = episode.truth.scene
        counts = Counter(item.category_name for item in scene.objects)
        area = sum(room.area_m2 for room in scene.rooms)
        click.echo(f"{len(scene.objects)} objects in {area:.1f} m2, {scene.height_m:.2f} m high")
        if counts:
            click.echo(", ".join(f"{number} {category}" for category, number in sorted(counts.items())))
    if more:
        click.echo(more)
    tell_next(out, episode)
