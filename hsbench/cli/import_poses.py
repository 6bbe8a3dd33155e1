"""``hsbench import`` of recorded poses: NTU RGB+D, KIMORE, PiGraphs, Pose2Room, OpenPose and COCO keypoints."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import ANY_PATH
from hsbench.cli.import_options import (
    FILE,
    POSITIVE,
    camera_options,
    chosen_id,
    focal_option,
    name_option,
    out_option,
    size,
    tell_next,
)

if TYPE_CHECKING:
    from hsbench.datasets.importers.kinect_bodies import KinectBodies
    from hsbench.schema.episode import Episode


@click.command(
    name="ntu-skeleton", epilog="Example: hsbench import ntu-skeleton S001C001P001R001A011.skeleton --out data/ntu"
)
@click.argument("recording", type=FILE)
@out_option
@name_option()
@camera_options
def ntu_skeleton(recording: Path, out: Path, name: str | None, height_m: float | None, tilt_deg: float | None) -> None:
    """People in a .skeleton file of NTU RGB+D (Kinect v2) as observed poses."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.ntu_skeleton import read_ntu_skeleton
    from hsbench.datasets.importers.pose_captures import ntu_episode

    episode_id = chosen_id(name, recording.stem)
    found = read_ntu_skeleton(recording)
    episode = ntu_episode(found, episode_id, *_placed(found.bodies, height_m, tilt_deg))
    add_capture(out, episode)
    _tell(out, episode)


@click.command(
    name="kimore-csv", epilog="Example: hsbench import kimore-csv JointPositionExercise4.csv --out data/kimore"
)
@click.argument("recording", type=FILE)
@out_option
@name_option()
@camera_options
def kimore_csv(recording: Path, out: Path, name: str | None, height_m: float | None, tilt_deg: float | None) -> None:
    """A Kinect v2 skeleton recording of KIMORE (JointPosition*.csv) as observed poses."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.captures import KINECT_V2_DEPTH
    from hsbench.datasets.importers.kimore_csv import read_kimore_csv
    from hsbench.datasets.importers.pose_captures import kinect_bodies_episode

    episode_id = chosen_id(name, recording.stem)
    bodies = read_kimore_csv(recording)
    height_m, tilt_rad = _placed(bodies, height_m, tilt_deg)
    episode = kinect_bodies_episode(bodies, episode_id, "kimore-csv", height_m, tilt_rad, KINECT_V2_DEPTH)
    add_capture(out, episode)
    _tell(out, episode)


@click.command(epilog="Example: hsbench import pigraphs gates381_cam1_2015-01-01.json --out data/pigraphs")
@click.argument("recording", type=FILE)
@out_option
@name_option()
@click.option(
    "--floor", "floor_m", type=float, metavar="M", help="z of the floor in the scan; default: where feet are."
)
def pigraphs(recording: Path, out: Path, name: str | None, floor_m: float | None) -> None:
    """A PiGraphs recording (.json) as observed poses, seen from where its camera stood in the scan."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.pigraphs import floor_level, read_pigraphs
    from hsbench.datasets.importers.pose_captures import pigraphs_episode

    episode_id = chosen_id(name, recording.stem)
    found = read_pigraphs(recording)
    episode = pigraphs_episode(found, episode_id, floor_level(found) if floor_m is None else floor_m)
    add_capture(out, episode)
    _tell(out, episode)


@click.command(epilog="Example: hsbench import pose2room 0_1_12_Male1_0.hdf5 --out data/pose2room")
@click.argument("sample", type=FILE)
@out_option
@name_option()
def pose2room(sample: Path, out: Path, name: str | None) -> None:
    """A Pose2Room SAMPLE (.hdf5) or joint array (.npy, .npz) as poses seen from above; boxes of a room as truth."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.pose2room import read_pose2room
    from hsbench.datasets.importers.pose_captures import pose2room_episode

    episode_id = chosen_id(name, sample.stem)
    found = read_pose2room(sample)
    episode = pose2room_episode(found, episode_id)
    add_capture(out, episode)
    if found.was_left_handed:
        click.echo("note: the file's frame is left-handed; it was mirrored so that left stays left", err=True)
    if found.boxes and found.room is None:
        click.echo(f"note: no room_bbox, so the {len(found.boxes)} objects are left out", err=True)
    _tell(out, episode)


@click.command(epilog="Example: hsbench import openpose json/ --size 1280x720 --rate 30 --out data/openpose")
@click.argument("source", type=ANY_PATH)
@out_option
@name_option()
@click.option("--size", "size_px", required=True, callback=size, metavar="WxH", help="Size of the pictures in pixels.")
@click.option("--rate", "rate_hz", type=POSITIVE, metavar="HZ", help="Pictures a second; a single file needs none.")
@click.option(
    "--scale", type=click.Choice(["pixel", "unit", "signed"]),
    help="Coordinates in pixels, 0 to 1 or -1 to 1; default: found by their range.",
)  # fmt: skip
@focal_option
def openpose(
    source: Path, out: Path, name: str | None, size_px: tuple[int, int], rate_hz: float | None, scale: str | None,
    focal_px: float | None,
) -> None:  # fmt: skip
    """OpenPose's JSON (BODY_25 or COCO-18), a folder or one file, as observed 2D poses of one camera."""
    from hsbench.datasets.importers.capture_set import add_capture
    from hsbench.datasets.importers.openpose import find_scale, read_openpose
    from hsbench.datasets.importers.pose_captures import openpose_episode

    if rate_hz is None and source.is_dir():
        raise click.UsageError("--rate is needed for a folder: OpenPose's files have no times")
    episode_id = chosen_id(name, source.stem)
    found = read_openpose(source)
    if scale is None:
        scale = find_scale(found.keypoints)
        click.echo(f"note: coordinates are taken to be of scale {scale!r}", err=True)
    episode = openpose_episode(found, episode_id, scale, size_px, rate_hz or 1.0, focal_px)
    add_capture(out, episode)
    if not found.has_identities:
        click.echo("note: no identities; a track is a place in the list of people of its picture", err=True)
    _tell(out, episode)


@click.command(
    name="coco-keypoints",
    epilog="Example: hsbench import coco-keypoints person_keypoints_val2017.json --out data/coco",
)
@click.argument("keypoints", type=FILE)
@click.option("--images", type=FILE, metavar="FILE", help="Annotations with the pictures that results belong to.")
@out_option
@click.option("--rate", "rate_hz", type=POSITIVE, metavar="HZ", help="The pictures are one film of this rate.")
@name_option("Episode id of a film; default: the file's name.")
@focal_option
def coco_keypoints(
    keypoints: Path, images: Path | None, out: Path, rate_hz: float | None, name: str | None, focal_px: float | None
) -> None:
    """Keypoints in COCO's JSON, annotations or results: an episode a picture, or with --rate one of them all."""
    from hsbench.datasets.importers.capture_set import add_capture, add_captures
    from hsbench.datasets.importers.coco_keypoints import read_annotations, read_images, read_results
    from hsbench.datasets.importers.pose_captures import coco_episode, coco_episodes

    if name is not None and rate_hz is None:
        raise click.UsageError(
            "--name is of a film: give --rate too (without it, episodes are named as their pictures)"
        )
    film_id = "" if rate_hz is None else chosen_id(name, keypoints.stem)
    found = read_annotations(keypoints) if images is None else read_results(keypoints, read_images(images))
    if found.crowds or found.unlabelled:
        click.echo(f"note: left out {found.crowds} crowds and {found.unlabelled} people without a joint", err=True)
    if rate_hz is not None:
        episode = coco_episode(found, film_id, rate_hz, focal_px)
        add_capture(out, episode)
        _tell(out, episode)
    else:
        episodes = coco_episodes(found, focal_px)
        add_captures(out, episodes)
        click.echo(f"{out}: {len(episodes)} episodes of a picture each, {len(found.image)} poses")
        tell_next(out, episodes[0])


COMMANDS = (ntu_skeleton, kimore_csv, pigraphs, pose2room, openpose, coco_keypoints)


def _placed(bodies: KinectBodies, height_m: float | None, tilt_deg: float | None) -> tuple[float, float]:
    """Height and tilt (radians) as given, or as estimated."""
    from hsbench.datasets.importers.kinect_bodies import estimate_camera

    if (height_m is None) != (tilt_deg is None):
        raise click.UsageError("--height and --tilt go together: give both, or neither to have them estimated")
    if height_m is None or tilt_deg is None:
        return estimate_camera(bodies)
    return height_m, math.radians(tilt_deg)


def _tell(out: Path, episode: Episode) -> None:
    """What was imported, in one line, and what may follow."""
    poses, sensor = episode.poses, episode.sensor
    tracks = 0 if poses is None else len(set(poses.track_id.tolist()))
    line = f"{out}: episode {episode.episode_id}, {0 if poses is None else len(poses)} poses of {tracks} tracks in"
    line += f" {episode.duration_s:.1f} s"
    if sensor.height_m is not None:
        down = "down" if sensor.tilt_rad >= 0 else "up"
        line += f", camera {sensor.height_m:.2f} m high, looking {abs(math.degrees(sensor.tilt_rad)):.1f} deg {down}"
    click.echo(line)
    tell_next(out, episode)
