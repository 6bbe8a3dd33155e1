"""``hsbench annotate``: truth of one's own captures from labels, boxes and plans drawn by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import FOLDER, json_option, new_file, next_step, print_json

if TYPE_CHECKING:
    from hsbench.datasets.annotation.homography import Quality

FILE = click.Path(path_type=Path, dir_okay=False)

data_option = click.option(
    "--data", required=True, type=FOLDER, metavar="DIR", help="Data set of imported captures; truth is added to it."
)
names_option = click.option(
    "--labels", "names_json", type=FILE, metavar="FILE", help="What own labels stand for (JSON)."
)
image_option = click.option("--image", metavar="NAME", help="Which picture, where a COCO file has several.")
replace_option = click.option("--replace", is_flag=True, help="Replace truth that is there already.")


@click.group(epilog="Example: hsbench annotate boxes room.json --data data/lab --episode day-1")
def command() -> None:
    """Give imported captures the truth that generated data have, from what a person drew."""


@command.command(epilog="Example: hsbench annotate view 000000.json --data data/lab --episode day-1 --to day-2")
@click.argument("drawn", type=FILE, metavar="LABELS")
@data_option
@click.option("--episode", required=True, metavar="ID", help="The episode of which a frame was labelled.")
@click.option("--frame", type=click.IntRange(0), default=0, show_default=True, help="Which frame was labelled.")
@click.option("--to", "others", multiple=True, metavar="ID", help="Another episode of the same place; repeat.")
@click.option("--to-all", is_flag=True, help="Every other episode of the data set.")
@click.option(
    "--camera", type=click.Choice(["auto", "fixed"]), default="auto", show_default=True,
    help="Where the camera stood: found from the pictures, or said not to have moved.",
)  # fmt: skip
@names_option
@image_option
@click.option("--pictures", type=FOLDER, metavar="DIR", help="Also draw the labels of each episode: DIR/ID.png.")
@replace_option
@json_option
@click.pass_context
def view(
    context: click.Context, drawn: Path, data: Path, episode: str, frame: int, others: tuple[str, ...], to_all: bool,
    camera: str, names_json: Path | None, image: str | None, pictures: Path | None, replace: bool, as_json: bool,
) -> None:  # fmt: skip
    """Carry the labels of one frame over to its episode and to others of the same place.

    LABELS are polygons or masks: LabelMe, COCO or plain JSON, or a label picture (PNG). Each episode is labelled or,
    where the pictures do not fit well enough, refused; exit code 2 if one is refused.
    """
    import dataclasses

    from hsbench.datasets.annotation.label_files import read_labels
    from hsbench.datasets.annotation.labels import bits_of
    from hsbench.datasets.annotation.overlay import overlaid
    from hsbench.datasets.annotation.store import check_unlabelled, drawn_record, open_capture, store_truth
    from hsbench.datasets.annotation.view import annotated_picture, transfer
    from hsbench.errors import DataError
    from hsbench.io.atomic import write_bytes
    from hsbench.io.dataset_index import read_index
    from hsbench.io.images import encode_png
    from hsbench.schema.episode import EpisodeTruth

    labels = read_labels(drawn, image)
    bits = bits_of(labels, _names(names_json), str(drawn))
    source = open_capture(data, episode)
    picture = annotated_picture(source, frame)
    targets = dict.fromkeys([episode, *others])
    if to_all:
        targets |= dict.fromkeys(row["episode_id"] for row in read_index(data))
    captures = {target: open_capture(data, target) for target in targets}
    for target, capture in captures.items():
        check_unlabelled(capture, ("view_affordance",), replace)
        if pictures is not None and not replace:
            new_file("--pictures", pictures / f"{target}.png", ".png")
    refused, figures = [], {}
    for target, capture in captures.items():
        try:
            found = transfer(labels, bits, source, picture, capture, camera)
        except DataError as error:
            refused.append(str(error))
            continue
        truth = dataclasses.replace(capture.truth or EpisodeTruth(), view_affordance=found.labels)
        figures[target] = {"moved": not found.homography.is_identity, **_figures(found.homography.quality)}
        record = drawn_record(drawn, {"episode_id": episode, "frame": frame, "camera": camera, **figures[target]})
        store_truth(data, target, truth, ("view_affordance",), record)
        if pictures is not None:
            write_bytes(pictures / f"{target}.png", encode_png(overlaid(found.background, found.labels)))
        if not as_json:
            click.echo(f"{data}: episode {target}, {_told(found.homography.is_identity, found.homography.quality)}")
    if as_json:
        print_json({"episodes": figures, "refused": refused})
    elif figures:
        next_step("verify", data)
    for line in refused:
        click.echo(f"error: {line}", err=True)
    if refused:
        context.exit(DataError.exit_code)


@command.command(epilog="Example: hsbench annotate boxes room.json --data data/lab --episode day-1")
@click.argument("drawn", type=FILE, metavar="BOXES")
@data_option
@click.option("--episode", required=True, metavar="ID", help="The RGB-D episode they belong to.")
@click.option("--affordance", is_flag=True, help="Also what the boxes and their parts afford, by geometry.")
@replace_option
def boxes(drawn: Path, data: Path, episode: str, affordance: bool, replace: bool) -> None:
    """Oriented 3D boxes of a room, hidden objects included: scene, voxels and objects of an RGB-D episode."""
    from hsbench.datasets.annotation.box_truth import box_truth, with_boxes
    from hsbench.datasets.annotation.boxes import read_boxes
    from hsbench.datasets.annotation.store import (
        check_unlabelled,
        drawn_record,
        open_capture,
        scene_id_of,
        store_truth,
    )
    from hsbench.errors import DataError, SchemaError
    from hsbench.schema.states import Evidence, Visibility
    from hsbench.tasks.scene_completion import GRID

    labels = read_boxes(drawn)
    capture = open_capture(data, episode)
    fields = ("scene", "occupancy", "objects", *(("affordance",) if affordance else ()))
    check_unlabelled(capture, fields, replace)
    try:
        found = box_truth(labels, capture, scene_id_of(data, episode), GRID, affordance)
    except (DataError, SchemaError) as error:
        raise DataError(f"{drawn}: {error}") from error
    record = drawn_record(drawn, {"explained": found.explained})
    store_truth(data, episode, with_boxes(capture.truth, found), fields, record)
    click.echo(
        f"{data}: episode {episode}, {len(labels.boxes)} boxes, {int(found.occupancy.solid.sum()):,} solid voxels;"
        f" {found.explained:.1%} of the points measured in the room lie on something annotated"
    )
    objects, drawn_ids = found.objects, {box.object_id for box in labels.boxes}
    for k, item in enumerate(found.scene.objects):
        if item.object_id in drawn_ids:
            seen, evidence = Visibility(objects.visibility[k]), Evidence(objects.evidence[k])
            click.echo(
                f"  {item.object_id} {item.category_name}: {seen.name.lower().replace('_', ' ')}"
                f" ({objects.visible_px[k]} of {objects.amodal_px[k]} px), activity: {evidence.name.lower()}"
            )
    next_step("verify", data)


@command.command(epilog="Example: hsbench annotate plan plan.json --data data/lab --episode flat-360")
@click.argument("drawn", type=FILE, metavar="PLAN")
@data_option
@click.option("--episode", required=True, metavar="ID", help="The episode it belongs to, of a 360 camera or another.")
@names_option
@image_option
@replace_option
def plan(drawn: Path, data: Path, episode: str, names_json: Path | None, image: str | None, replace: bool) -> None:
    """Affordance drawn on a plan from above: polygons in metres, or labels of a picture of the plan."""
    import dataclasses

    from hsbench.datasets.annotation.plan import plan_truth, read_plan
    from hsbench.datasets.annotation.store import check_unlabelled, drawn_record, open_capture, store_truth
    from hsbench.schema.episode import EpisodeTruth
    from hsbench.schema.states import Affordance

    found = plan_truth(read_plan(drawn, image), _names(names_json), str(drawn))
    capture = open_capture(data, episode)
    check_unlabelled(capture, ("affordance",), replace)
    truth = dataclasses.replace(capture.truth or EpisodeTruth(), affordance=found)
    store_truth(data, episode, truth, ("affordance",), drawn_record(drawn, {}))
    areas = {kind.name.lower(): float((found.labels >> kind & 1).sum()) * found.cell_m**2 for kind in Affordance}
    shown = ", ".join(f"{area:.2f} m2 {name}" for name, area in areas.items() if area)
    click.echo(f"{data}: episode {episode}, {shown or 'no label'}; {int(found.ignored.sum())} cells ignored")
    next_step("verify", data)


@command.command(epilog="Example: hsbench annotate convert 000000.json --to coco --out 000000_coco.json")
@click.argument("drawn", type=FILE, metavar="LABELS")
@click.option("--to", "form", required=True, type=click.Choice(["plain", "labelme", "coco", "png"]), help="The form.")
@click.option("--out", required=True, type=FILE, metavar="FILE", help="New file.")
@names_option
@image_option
def convert(drawn: Path, form: str, out: Path, names_json: Path | None, image: str | None) -> None:
    """Labels of a picture from one form into another."""
    from hsbench.datasets.annotation.label_files import read_labels, write_labels

    new_file("--out", out, ".png" if form == "png" else ".json")
    labels = read_labels(drawn, image)
    write_labels(out, labels, form, _names(names_json))
    click.echo(f"{out}: {len(labels.regions)} regions of {labels.file_name}")


def _names(path: Path | None) -> dict[str, int]:
    from hsbench.datasets.annotation.labels import NAMES, read_names

    return dict(NAMES) if path is None else read_names(path)


def _figures(quality: Quality) -> dict[str, float | int | None]:
    return {
        "matches": quality.matches, "inlier_share": quality.inlier_share, "error_px": quality.error_px,
        "worst_px": quality.worst_px, "overlap": quality.overlap,
    }  # fmt: skip


def _told(is_still: bool, quality: Quality) -> str:
    """The quality of a transfer that passed, in one line."""
    return (
        f"camera {'as it was' if is_still else 'moved'}: {quality.inlier_share:.0%} of {quality.matches} features fit"
        f" to {quality.error_px:.2f} px, the worst place to {quality.worst_px:.2f} px, {quality.overlap:.0%} shown"
    )
