"""The demo's page: rooms as filmed, what people did, what carving made of it, and the scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.evaluation.compare import Comparison
from hsbench.evaluation.report import Report
from hsbench.metrics.completion import episode_counts
from hsbench.schema.episode import Episode
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.typing import BoolArray, Float32Array, UInt8Array
from hsbench.viz import page
from hsbench.viz.page import Figure
from hsbench.viz.pictures import (
    FALSE,
    HIT,
    MISSED,
    SEEN,
    SIT_TINT,
    STAND_TINT,
    beside,
    depth_picture,
    fitted,
    footprint,
    instance_picture,
    plan_picture,
    prediction_voxels,
    truth_voxels,
)

PERSON_SHARE = 0.012
"""Share of the picture a person must cover to be shown as an example."""

SENSOR_NAMES = {
    "rgbd": "RGB-D camera",
    "PinholeCamera": "ordinary camera",
    "BrownCamera": "wide-angle camera with distortion",
    "EquirectangularCamera": "360 camera",
    "TopDownCamera": "from above, cut below the ceiling",
}


@dataclass(frozen=True, eq=False)
class Shown:
    """An episode (read with truth) with its stand and sit maps (nx, ny) and predictions by method name."""

    episode: Episode
    stand: Float32Array
    sit: Float32Array
    predictions: Mapping[str, BoolArray]


def demo_page(
    shown: Sequence[Shown],
    views: Sequence[Figure],
    reports: Sequence[Report],
    comparisons: Sequence[Comparison],
    commands: Sequence[str],
) -> str:
    """The page as HTML. views: one moment of one room, a picture a sensor (``view_at``)."""
    body: list[str] = []
    for item in shown:
        body += _episode(item)
    body += [
        page.heading("One moment, five sensors"),
        page.paragraph("Another room and two people, filmed at once by every sensor there is: ids and clock agree."),
        page.figures(list(views)),
    ]
    body += _scores(reports, comparisons)
    body += [
        page.heading("The same by hand"),
        page.paragraph("The rooms and the row of carve were made by these commands; the other methods take its place:"),
        page.code("\n".join(commands)),
    ]
    lead = (
        "Furnished rooms and a person living in them, filmed by a static RGB-D camera. What does watching reveal of "
        "the space that the camera never sees?"
    )
    return page.page("hsbench demo", lead, body)


def view_at(episode: Episode, seconds: float) -> Figure:
    """The last picture of an episode up to a time, under the name of its sensor."""
    index = max(
        int(np.searchsorted(episode.frames.timestamps_ns, episode.t0_ns + round(seconds * 1e9), "right")) - 1, 0
    )
    camera = episode.sensor.camera
    kind = SENSOR_NAMES[type(camera).__name__ if episode.sensor.kind != "rgbd" else "rgbd"]
    caption = f"{kind}, {camera.width_px} x {camera.height_px}, after {_seconds(episode, index):.0f} s"
    return Figure(_rgb(episode, index), caption, photo=True)


def _episode(item: Shown) -> list[str]:
    episode = item.episode
    truth = episode.truth
    assert truth is not None
    assert truth.occupancy is not None
    assert truth.scene is not None
    occupancy = truth.occupancy
    moments = _moments(item)
    pictures = [Figure(_rgb(episode, 0), "t0, nobody in the room: the picture that carving starts from", photo=True)]
    pictures += [Figure(_rgb(episode, k), f"after {_seconds(episode, k):.0f} s", photo=True) for k in moments]
    last = moments[-1] if moments else 0
    depth = episode.frames[last].depth_m
    if depth is not None:
        pictures.append(
            Figure(
                depth_picture(depth), f"depth after {_seconds(episode, last):.0f} s with sensor noise, near is bright"
            )
        )
    if truth.frames is not None:
        instance = truth.frames[last].instance
        if instance is not None:
            pictures.append(Figure(instance_picture(instance), "truth: every object and person has its own id"))
    voxels = [Figure(truth_voxels(occupancy), "truth: the room's solid furniture, coloured by category")]
    for name, grid in item.predictions.items():
        counts = episode_counts(occupancy, grid)["occluded"]
        voxels.append(
            Figure(
                prediction_voxels(occupancy, grid), f"{name} against truth: IoU {_number(counts.iou)} in hidden space"
            )
        )
    plans = [
        Figure(
            plan_picture(occupancy.grid, item.stand, item.sit, footprint(occupancy)),
            "activity maps from above: the camera is the mark at the lower edge; furniture and walls (truth) in grey",
        )
    ]
    n_poses = 0 if episode.poses is None else len(episode.poses)
    return [
        page.heading(f"{truth.scene.rooms[0].room_type.capitalize()} room, episode {episode.episode_id}"),
        page.paragraph(
            f"{episode.duration_s:.0f} s, {len(episode.frames)} pictures, {n_poses} observed poses; camera "
            f"{episode.sensor.height_m:.2f} m high, tilted {np.degrees(episode.sensor.tilt_rad):.0f} degrees down."
        ),
        page.figures(pictures),
        page.figures(plans + voxels, wide=True),
        page.legend(
            [
                (STAND_TINT, "somebody stood or walked"),
                (SIT_TINT, "somebody sat"),
                (SEEN, "visible surface"),
                (HIT, "hidden and rightly solid"),
                (FALSE, "hidden, wrongly solid"),
                (MISSED, "hidden solid, missed"),
            ]
        ),
    ]


def banner(item: Shown, height_px: int = 420) -> UInt8Array:
    """One picture that tells the story: a person in the room, the activity seen, and each prediction against truth."""
    assert item.episode.truth is not None
    assert item.episode.truth.occupancy is not None
    occupancy = item.episode.truth.occupancy
    moments = _moments(item)
    pictures = [_rgb(item.episode, moments[len(moments) // 2] if moments else 0)]
    pictures.append(plan_picture(occupancy.grid, item.stand, item.sit, footprint(occupancy)))
    pictures += [prediction_voxels(occupancy, grid) for grid in item.predictions.values()]
    return beside([fitted(picture, height_px) for picture in pictures])


def _moments(item: Shown) -> list[int]:
    """Indices of up to three pictures, apart in time, with a person well in view: not cut off, not tiny."""
    truth = item.episode.truth
    if truth is None or truth.frames is None:
        return []
    shares, whole = [], []
    for k in range(len(truth.frames)):
        instance = truth.frames[k].instance
        people = np.zeros((1, 1), dtype=bool) if instance is None else instance > PERSON_ID_OFFSET
        shares.append(float(people.mean()))
        whole.append(not (people[0].any() or people[-1].any() or people[:, 0].any() or people[:, -1].any()))
    share = np.array(shares)
    good = np.flatnonzero((share >= PERSON_SHARE) & np.array(whole, dtype=bool))
    if not len(good):
        good = np.flatnonzero(share > 0)
    if not len(good):
        return []
    return sorted({int(good[len(good) // 6]), int(good[len(good) // 2]), int(good[-1 - len(good) // 6])})


def _rgb(episode: Episode, index: int) -> UInt8Array:
    rgb = episode.frames[index].rgb
    assert rgb is not None
    return rgb


def _seconds(episode: Episode, index: int) -> float:
    return (int(episode.frames.timestamps_ns[index]) - episode.t0_ns) / 1e9


def _scores(reports: Sequence[Report], comparisons: Sequence[Comparison]) -> list[str]:
    shown = {
        "occluded/precision": "precision",
        "occluded/recall": "recall",
        "surface+occluded/iou": "IoU with visible surface",
        "occluded-unswept/iou": "IoU where nobody was",
    }
    reports = sorted(reports, key=lambda report: -(report.primary.value or 0.0))
    rows = []
    for report in reports:
        rows.append(
            [
                report.method.method,
                report.method.track,
                _number(report.primary.value),
                _range(report.primary.low, report.primary.high),
                *(_number(report.metrics[name].value) for name in shown),
            ]
        )
    bars = [
        (r.method.method, r.primary.value, r.primary.low, r.primary.high)
        for r in reports
        if r.primary.value is not None
    ]
    differences = [
        [f"{c.method_a} less {c.method_b}", _number(c.primary.estimate), _range(c.primary.low, c.primary.high)]
        for c in comparisons
    ]
    counts = reports[0].counts
    return [
        page.heading("Scores"),
        page.paragraph(
            f"Task scene-completion, split {reports[0].split}: {counts.scored} episodes of {counts.scenes} scenes. The "
            "board's number is IoU over the voxels that are hidden at t0, without floor, walls, doors and windows. "
            "Brackets are 95 % intervals over scenes. Two scenes say little; docs/results.md has numbers over many."
        ),
        page.interval_bars(bars),
        page.table(["method", "track", "IoU", "95 % interval", *shown.values()], rows, numbers=(2, 3, 4, 5, 6, 7)),
        page.paragraph(
            "carve-swept is no upper bound: it frees only the voxels that true bodies held, while carve frees whole "
            "columns. carve-height-prior keeps what a prior fitted on other rooms calls solid, less where people were."
        ),
        page.paragraph("Paired differences of the same number:"),
        page.table(["difference", "IoU", "95 % interval"], differences, numbers=(1, 2)),
    ]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _range(low: float | None, high: float | None) -> str:
    return "-" if low is None or high is None else f"[{low:.3f}, {high:.3f}]"
