"""A prediction beside truth as one interactive page: voxels or boxes in 3D, what is shown by choice, and the cuts."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hsbench.geometry import boxes as geometry
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.episode import Episode
from hsbench.tasks.object_detection import Boxes
from hsbench.tasks.scene_completion import GRID
from hsbench.typing import AnyArray, BoolArray, FloatArray, UInt8Array
from hsbench.viz import page
from hsbench.viz.orbit import ORBIT
from hsbench.viz.page import Figure
from hsbench.viz.prediction_boxes import box_verdict, boxes_title, opacity, truth_verdict
from hsbench.viz.prediction_slices import completion_title, labels_of
from hsbench.viz.verdicts import COLOURS, Verdict, box_verdicts, true_boxes, voxel_verdicts

MODES = ("everything", "truth", "prediction", "errors")
ALONE_MODES = ("prediction",)
MODES_OF: Mapping[Verdict, tuple[str, ...]] = {
    Verdict.HIT: ("everything", "truth", "prediction"),
    Verdict.FALSE: ("everything", "prediction", "errors"),
    Verdict.MISSED: ("everything", "truth", "errors"),
}
SPACED = "margin-right: .9rem"
OUTLINE_RGB = (128, 128, 128)  # of the room: right on white and on black
TRUTH_EDGE_M, EDGE_M, OUTLINE_M = 0.045, 0.02, 0.02
HINT = (
    "Drag to turn, pinch or + and - to zoom, arrow keys to turn; the wheel zooms once the view is clicked. "
    "Grey is the visible surface and the outline of the room at the floor."
)


def completion_page(episode: Episode, occupied: BoolArray, method: str, picture: UInt8Array) -> str:
    """The page of task scene-completion as HTML. occupied: (nx, ny, nz) bool on its grid; picture: its cuts."""
    truth = None if episode.truth is None else episode.truth.occupancy
    labels = labels_of(truth, occupied)
    names = {Verdict.HIT: "predicted, solid", Verdict.FALSE: "false solid", Verdict.MISSED: "missed"}
    if truth is None:
        names = {Verdict.HIT: "predicted solid"}
    sets = [_voxels(name, v, labels == v, GRID, MODES_OF[v]) for v, name in names.items()]
    title = completion_title(episode.episode_id, truth, occupied, method)
    return _page(title, [*sets, *_surroundings(episode)], truth is None, picture, "Cuts through the room.")


def boxes_page(episode: Episode, found: Boxes, method: str, picture: UInt8Array) -> str:
    """The page of task object-detection-3d as HTML; picture: its plan."""
    truths = true_boxes(episode)
    verdicts = None if truths is None else box_verdicts(truths, found)
    sets = []
    if truths is not None and verdicts is not None:
        true_modes = {Verdict.HIT: ("everything", "truth"), Verdict.MISSED: MODES_OF[Verdict.MISSED]}
        for verdict, name in ((Verdict.HIT, "objects found"), (Verdict.MISSED, "objects missed")):
            rows = [k for k in range(len(truths.boxes)) if truth_verdict(verdicts, k) == verdict]
            shapes = [_box(truths.boxes[k], 0.0, TRUTH_EDGE_M) for k in rows]
            sets.append(_set(name, COLOURS[verdict], true_modes[verdict], boxes=shapes))
    names = (
        {Verdict.HIT: "boxes", Verdict.FALSE: ""}
        if verdicts is None
        else {Verdict.HIT: "boxes that hit", Verdict.FALSE: "false boxes"}
    )
    for verdict, name in names.items():
        rows = [k for k in range(len(found.boxes)) if box_verdict(verdicts, k) == verdict]
        shapes = [_box(found.boxes[k], opacity(float(found.scores[k])), EDGE_M) for k in rows]
        modes = ("everything", "prediction") + (("errors",) if verdict == Verdict.FALSE else ())
        if name:
            sets.append(_set(name, COLOURS[verdict], modes, boxes=shapes))
    title = boxes_title(episode.episode_id, found, verdicts, method)
    return _page(title, [*sets, *_surroundings(episode)], verdicts is None, picture, "Plan, and the picture at t0.")


def _page(
    title: tuple[str, str], sets: Sequence[dict[str, Any]], alone: bool, picture: UInt8Array, caption: str
) -> str:
    """Title and lead, what may be chosen, the view, and the picture."""
    modes = ALONE_MODES if alone else MODES
    low, high = _extent(sets)
    # "<" is the one character of JSON that could end the element it stands in
    shapes = json.dumps({"low": low, "high": high, "modes": modes, "sets": sets}).replace("<", "\\u003c")
    view = (
        '<canvas id="orbit" tabindex="0" role="img" aria-label="Voxels or boxes of the room in 3D; arrow keys turn, '
        'plus and minus zoom" style="display: block; width: 100%; height: min(60vh, 36rem); touch-action: none; '
        'border: 1px solid var(--line); border-radius: 5px; cursor: grab"></canvas>'
        '<p id="orbit-failed" hidden>This browser shows no WebGL; the picture below holds the same.</p>'
        f'<script type="application/json" id="shapes">{shapes}</script>'
    )
    body = [_choices(modes, sets), view, f'<p class="note">{html.escape(HINT)}</p>']
    return page.page(*title, [*body, page.figures([Figure(picture, caption)], wide=True)], ORBIT)


def _choices(modes: Sequence[str], sets: Sequence[dict[str, Any]]) -> str:
    """Radio buttons of the modes where there are several, and a box to tick for each set."""
    radios = [
        f'<label class="entry" style="{SPACED}"><input type="radio" name="mode" value="{mode}"'
        f"{'' if k else ' checked'}> {mode}</label>"
        for k, mode in enumerate(modes)
    ]
    ticks = [
        f'<label class="entry" style="{SPACED}"><input type="checkbox" data-set="{k}" checked><span class="swatch" '
        f'style="margin-left: .3em; background: rgb{tuple(item["colour"])}"></span>{html.escape(item["name"])}</label>'
        for k, item in enumerate(sets)
    ]
    choose = f'<p role="radiogroup" aria-label="what is shown">{" ".join(radios)}</p>' if len(modes) > 1 else ""
    return f"{choose}<p>{' '.join(ticks)}</p>"


def _set(name: str, colour: tuple[int, int, int], modes: Sequence[str], **shapes: object) -> dict[str, Any]:
    return {"name": name, "colour": list(colour), "modes": list(modes), **shapes}


def _voxels(name: str, verdict: Verdict, chosen: BoolArray, grid: VoxelGrid, modes: Sequence[str]) -> dict[str, Any]:
    """Where ``chosen`` (nx, ny, nz), in three bytes a voxel."""
    cells = base64.b64encode(np.argwhere(chosen).astype(np.uint8).tobytes()).decode()
    return _set(name, COLOURS[verdict], modes, voxels=cells, origin=list(grid.origin_m), side=grid.voxel_m)


def _box(box: AnyArray, alpha: float, edge_m: float) -> dict[str, Any]:
    corners = geometry.corners(box[None].astype(np.float64))[0]
    return {"corners": corners.round(3).tolist(), "opacity": round(alpha, 3), "edge": edge_m}


def _surroundings(episode: Episode) -> list[dict[str, Any]]:
    """The visible surface and the outline of the rooms at the floor, where truth knows them; in every mode."""
    if episode.truth is None:
        return []
    sets = []
    if (truth := episode.truth.occupancy) is not None:
        nothing = np.zeros(truth.grid.shape, dtype=np.bool_)
        surface = voxel_verdicts(truth, nothing) == Verdict.SEEN_SOLID
        sets.append(_voxels("visible surface", Verdict.SEEN_SOLID, surface, truth.grid, ()))
    if (scene := episode.truth.scene) is not None:
        beams = [
            _beam(a, b) for r in scene.rooms for a, b in zip(r.outline_xy, np.roll(r.outline_xy, -1, 0), strict=True)
        ]
        sets.append(_set("outline of the room", OUTLINE_RGB, (), boxes=beams))
    return sets


def _beam(a: FloatArray, b: FloatArray) -> dict[str, Any]:
    """A line on the floor from a to b, (2,) each, as a thin box."""
    middle, along = (a + b) / 2, b - a
    yaw = np.arctan2(along[1], along[0])
    size = [max(float(np.linalg.norm(along)), OUTLINE_M), OUTLINE_M, OUTLINE_M]
    return _box(np.array([*middle, 0.0, *size, yaw]), 0.0, OUTLINE_M)


def _extent(sets: Sequence[dict[str, Any]]) -> tuple[list[float], list[float]]:
    """Lower and upper corner of everything, (3,) metres each; of the grid where there is nothing."""
    points = [np.zeros((0, 3))]
    for item in sets:
        points += [np.array(box["corners"]) for box in item.get("boxes", ())]
        if item.get("voxels"):
            cells = np.frombuffer(base64.b64decode(item["voxels"]), dtype=np.uint8).reshape(-1, 3)
            ends = np.stack([cells.min(axis=0), cells.max(axis=0) + 1.0])
            points.append(ends * item["side"] + np.array(item["origin"]))
    every = np.concatenate(points)
    if not len(every):
        origin = np.array(GRID.origin_m)
        every = np.stack([origin, origin + np.array(GRID.shape) * GRID.voxel_m])
    return every.min(axis=0).round(3).tolist(), every.max(axis=0).round(3).tolist()
