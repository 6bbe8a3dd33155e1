"""``hsbench import`` of scans, panoramas and footage: ScanNet, ZInD, films of a fixed camera, captures of one's own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import ANY_PATH, FOLDER, next_step
from hsbench.cli.import_options import FILE, POSITIVE, chosen_id, focal_option, name_option, out_option, tell_next

if TYPE_CHECKING:
    from hsbench.schema.episode import Episode


@click.command(epilog="Example: hsbench import footage kitchen.mp4 --out data/kitchen")
@click.argument("source", type=ANY_PATH, metavar="VIDEO|FOLDER")
@out_option
@name_option("Episode id; default: the name of the file or folder.")
@click.option(
    "--rate",
    "rate_hz",
    type=POSITIVE,
    metavar="HZ",
    help="Pictures a second; default: the video's own times, or those of names or EXIF data.",
)
@click.option("--openpose", "openpose_json", type=FOLDER, metavar="DIR", help="OpenPose's JSON of the same pictures.")
@click.option("--scale", type=click.Choice(["pixel", "unit", "signed"]), help="Coordinates of OpenPose's JSON.")
@click.option("--coco", "coco_json", type=FILE, metavar="FILE", help="COCO annotations of the same pictures.")
@click.option("--one-view", is_flag=True, help="The camera never moved: one episode, without looking.")
@click.option("--keep-video", is_flag=True, help="Keep the video file itself: smaller and exact, slow at random.")
@focal_option
def footage(
    source: Path, out: Path, name: str | None, rate_hz: float | None, openpose_json: Path | None, scale: str | None,
    coco_json: Path | None, one_view: bool, keep_video: bool, focal_px: float | None,
) -> None:  # fmt: skip
    """A film of a fixed camera, or a folder of its pictures: an episode for each steady view, with its background."""
    from hsbench.datasets.importers import footage as importer
    from hsbench.datasets.importers.capture_set import add_captures
    from hsbench.datasets.importers.coco_keypoints import read_annotations
    from hsbench.datasets.importers.openpose import find_scale, read_openpose

    if openpose_json is not None and coco_json is not None:
        raise click.UsageError("--openpose and --coco both give poses; expected one of them")
    if scale is not None and openpose_json is None:
        raise click.UsageError("--scale is of OpenPose's JSON: give --openpose too")
    if keep_video and source.is_dir():
        raise click.UsageError(f"--keep-video: {source} is a folder, whose pictures are always kept as they are")
    place = chosen_id(name, source.stem)
    found = importer.read_footage(source, rate_hz)
    poses = None
    if openpose_json is not None:
        recording = read_openpose(openpose_json)
        poses = importer.openpose_poses(found, recording, scale or find_scale(recording.keypoints))
    if coco_json is not None:
        poses = importer.coco_poses(found, read_annotations(coco_json))
    episodes, notes = importer.footage_episodes(
        found, place, poses=poses, split=not one_view, kept=keep_video, focal_px=focal_px
    )
    add_captures(out, episodes, place)
    _tell(out, episodes, notes)


@click.command(epilog="Example: hsbench import scannet scans/scene0000_00 --out scenes/scene0000_00")
@click.argument("scan", type=FOLDER)
@click.option("--out", required=True, type=FOLDER, metavar="DIR", help="New folder for the scene.")
@name_option("Scene id; default: the scan's.")
def scannet(scan: Path, out: Path, name: str | None) -> None:
    """A ScanNet SCAN folder (labelled mesh) as a scene, like those of ``hsbench import scene``."""
    from hsbench.datasets.importers.scannet import import_scannet

    imported, truth = import_scannet(scan, out, name)
    for note in (*imported.notes, *truth.notes):
        click.echo(f"note: {note}", err=True)
    found = imported.scene
    area = sum(room.area_m2 for room in found.rooms)
    click.echo(f"{out}: {len(found.objects)} objects, {area:.1f} m2, {found.height_m:.2f} m high")
    counts = Counter(item.category_name for item in found.objects)
    click.echo(", ".join(f"{number} {category}" for category, number in sorted(counts.items())))
    next_step("export", out, "--plan", "plan.svg")


@click.command(epilog="Example: hsbench import zind 0000/zind_data.json --out data/zind")
@click.argument("home", type=FILE, metavar="ZIND_DATA_JSON")
@out_option
@name_option("Id of the home, with which those of its episodes begin; default: the name of the file's folder.")
def zind(home: Path, out: Path, name: str | None) -> None:
    """Panoramas of a home of ZInD, with their rooms as truth: an episode of one picture each."""
    from hsbench.datasets.importers.capture_set import add_captures
    from hsbench.datasets.importers.zind import read_zind, zind_episode

    scene_id = chosen_id(name, home.resolve().parent.name)
    panoramas, notes = read_zind(home)
    for note in notes:
        click.echo(f"note: {note}", err=True)
    episodes = [zind_episode(panorama, scene_id) for panorama in panoramas]
    add_captures(out, episodes, scene_id)
    for panorama, episode in zip(panoramas, episodes, strict=True):
        odd = ("" if panorama.inside else "; taken outside the room") + (
            "" if panorama.flat_ceiling else "; the ceiling is not flat"
        )
        click.echo(
            f"{out}: episode {episode.episode_id}, {panorama.room_type} of {panorama.height_m:.2f} m,"
            f" camera {panorama.camera_height_m:.2f} m high, {len(panorama.openings)} openings{odd}"
        )
    tell_next(out, episodes[0])


@click.command(epilog="Example: hsbench import capture timelapse captures/kitchen --out data/captures")
@click.argument("kind", type=click.Choice(["rgbd", "360", "timelapse"]))
@click.argument("folder", type=FOLDER)
@out_option
@name_option("Episode id; default: the folder's name.")
def capture(kind: str, folder: Path, out: Path, name: str | None) -> None:
    """A capture of human activity of one's own, in the folder layout of docs/formats/capture.md."""
    from hsbench.datasets.importers.capture_folder import capture_episodes
    from hsbench.datasets.importers.capture_set import add_captures

    place = chosen_id(name, folder.resolve().name)
    episodes, notes = capture_episodes(kind, folder, place)
    add_captures(out, episodes, place)
    _tell(out, episodes, notes)


def _tell(out: Path, episodes: Sequence[Episode], notes: Sequence[str]) -> None:
    """What was imported, a line each, and what may follow."""
    for note in notes:
        click.echo(f"note: {note}", err=True)
    for episode in episodes:
        camera, poses = episode.sensor.camera, episode.poses
        click.echo(
            f"{out}: episode {episode.episode_id}, {len(episode.frames)} pictures of {camera.width_px} x"
            f" {camera.height_px} px in {episode.duration_s:.1f} s, {0 if poses is None else len(poses)} poses"
        )
    tell_next(out, episodes[0])


COMMANDS = (scannet, zind, footage, capture)
