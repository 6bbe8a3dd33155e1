"""Draw one picture a task: an input, the truth, what counts, and a prediction.

Usage: task_pictures.py RGBD_DATA DATA_360 TIMELAPSE_DATA PREDICTIONS OUT_FOLDER

The first three hold an episode of split val with its picture at t0; PREDICTIONS holds a submission for each task, in a
folder of its name. OUT_FOLDER gets ``task-NAME.jpg``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from task_figures import CROP, GREY, PALE, by_bits, detection, painted, plan

from hsbench import load
from hsbench.evaluation.scorers import scorer
from hsbench.geometry import boxes
from hsbench.metrics import detection as detector
from hsbench.metrics.completion import primary_mask
from hsbench.metrics.detection_matching import HIT
from hsbench.schema import Episode
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.states import Action
from hsbench.submission import Predictions, open_submission
from hsbench.tasks import task
from hsbench.tasks.probability_maps import LABELS, THRESHOLD
from hsbench.truth.affordance_volumes import Volume
from hsbench.viz.pictures import prediction_voxels, truth_voxels

INNER = slice(CROP, -CROP)
COUNTS, LEFT_OUT = (0.62, 0.72, 0.82), GREY
OF_ACTION = {Action.STAND: "#6f9fd8", Action.SIT: "#e07a4f", Action.INTERACT: "#4f9f6f"}
SLICE_M = 0.42
SHOWN = 15  # boxes of the highest scores; more would hide each other

Panels = tuple[Axes, Axes, Axes, Axes]


def picture(axes: Axes, episode: Episode) -> None:
    axes.imshow(episode.frames[0].rgb)
    axes.set_title("input: colour at t0 (and poses)")


def counting(axes: Axes, counts: np.ndarray, title: str) -> None:
    axes.imshow(np.where(counts[..., None], COUNTS, LEFT_OUT), interpolation="nearest")
    axes.set_title(title)


def completion(panels: Panels, episode: Episode, answer: np.ndarray) -> None:
    occupancy = episode.truth.occupancy
    picture(panels[0], episode)
    panels[1].imshow(truth_voxels(occupancy))
    panels[1].set_title("truth: solid furniture by category")
    columns = primary_mask(occupancy).sum(axis=2)[::-1, ::-1]
    panels[2].imshow(columns * occupancy.grid.voxel_m, cmap="Blues")
    panels[2].set_title("what counts: hidden height of each column, from above")
    panels[3].imshow(prediction_voxels(occupancy, answer))
    panels[3].set_title("prediction: green hit, red false, blue missed")


def detected(panels: Panels, episode: Episode, answer: Any) -> None:
    picture(panels[0], episode)
    detection(panels[1], episode)
    panels[1].set_title("truth: boxes by visibility")
    true = scorer("object-detection-3d").truth(episode)
    every = np.array([item.box for item in episode.truth.scene.objects])
    asked = {tuple(box) for box in true.boxes.tolist()}
    for box in every:
        outline(panels[2], box, "#2f6fb0" if tuple(box.tolist()) in asked else "#b9b9b4")
    panels[2].set_title("what counts: furniture in the grid (blue)")
    guesses = detector.Predictions(
        answer.boxes.astype(float), answer.scores.astype(float), answer.category_ids.astype(int)
    )
    ranking = detector.score([true], [guesses], "hsbench", (0.25,)).overall[0].ranking
    hits = set(ranking.scores[ranking.outcome == HIT].tolist())
    for box in true.boxes:
        outline(panels[3], box, "#b9b9b4")
    for k in np.argsort(-guesses.scores, kind="stable")[:SHOWN]:
        outline(panels[3], guesses.boxes[k], "#2e8b57" if guesses.scores[k] in hits else "#c0392b")
    panels[3].set_title("prediction: green hit at IoU 0.25, red false, grey truth")
    for axes in panels[2:]:
        axes.set(xlim=(3.2, -3.2), ylim=(0, 6.4), aspect="equal")


def outline(axes: Axes, box: np.ndarray, colour: str) -> None:
    corners = boxes.corners(np.asarray(box)[None])[0, [0, 4, 6, 2], 1::-1]
    axes.add_patch(Polygon(corners, fill=False, edgecolor=colour, lw=1.6))


def from_above(panels: Panels, episode: Episode, answer: np.ndarray) -> None:
    truth = episode.truth.affordance
    picture(panels[0], episode)
    plan(panels[1], episode)
    panels[1].set_title("truth, camera in the middle")
    counting(panels[2], ~truth.ignored[INNER, INNER], "what counts (blue)")
    panels[3].imshow(
        painted(ordered(answer), np.zeros(truth.ignored.shape, bool))[INNER, INNER], interpolation="nearest"
    )
    panels[3].set_title("prediction")


def ordered(answer: np.ndarray) -> dict[str, np.ndarray]:
    """Maps by name, in the order in which they are painted."""
    own = {label.name.lower(): answer[k] >= THRESHOLD for k, label in enumerate(LABELS)}
    return {name: own[name] for name in ("walkable", "interactable", "sittable")}


def in_view(panels: Panels, episode: Episode, answer: np.ndarray) -> None:
    bits = scorer("affordance-view").truth(episode)
    unscored = (bits & VIEW_UNSCORED) > 0
    picture(panels[0], episode)
    panels[1].imshow(painted(by_bits(bits), unscored), interpolation="nearest")
    panels[1].set_title("truth")
    counting(panels[2], ~unscored, "what counts (blue)")
    panels[3].imshow(painted(ordered(answer), np.zeros(bits.shape, bool)), interpolation="nearest")
    panels[3].set_title("prediction")


def actions(panels: Panels, episode: Episode, answer: np.ndarray) -> None:
    true = scorer("action-recognition").truth(episode)
    track = np.bincount(true.track_id[true.action != Action.IGNORED]).argmax()
    own = true.track_id == track
    minutes = (episode.poses.timestamp_ns[own] - episode.t0_ns) / 60e9
    joints_px = episode.poses.joints_px[own]
    panels[0].plot(minutes, np.nanmin(joints_px[..., 1], axis=1), ".", ms=1.5, color="#444")
    panels[0].invert_yaxis()
    panels[0].set_title("input: poses of one track (here: row of the highest joint)")
    for axes, labels, title in (
        (panels[1], true.action[own], "truth: stand blue, sit orange, interact green"),
        (panels[3], answer[own], "prediction"),
    ):
        for label, colour in OF_ACTION.items():
            axes.vlines(minutes[labels == label], 0, 1, color=colour, lw=0.6)
        axes.set_title(title)
    panels[2].vlines(minutes[true.action[own] != Action.IGNORED], 0, 1, color=COUNTS, lw=0.6)
    panels[2].set_title("what counts: not lying, transitions, false detections")
    for axes in panels:
        axes.set_xlim(minutes.min(), minutes.max())
        axes.set_facecolor(PALE)
        axes.set_box_aspect(0.3)


def volumes(panels: Panels, episode: Episode, answer: np.ndarray) -> None:
    true = scorer("scene-reconstruction-360").truth(episode)
    layer = int(SLICE_M / true.grid.voxel_m)
    picture(panels[0], episode)
    nothing = np.zeros(true.ignored[:, :, 0].shape, bool)
    for axes, labels, title in ((panels[1], true.labels, "truth"), (panels[3], answer, "prediction")):
        names = ("interactable", "sittable")
        planes = {"walkable": labels[:, :, 0] == Volume.WALKABLE}
        planes |= {name: labels[:, :, layer] == Volume[name.upper()] for name in names}
        image = painted(planes, nothing)
        image[labels[:, :, layer] == Volume.WALL] = 0.2
        axes.imshow(image[::-1, ::-1][INNER, INNER], interpolation="nearest")
        axes.set_title(f"{title}: floor, and {SLICE_M} m above")
    counting(panels[2], ~true.ignored[:, :, layer][::-1, ::-1][INNER, INNER], "what counts (blue)")


DRAWN: dict[str, tuple[int, Callable[[Panels, Episode, Any], None]]] = {
    "scene-completion": (0, completion),
    "object-detection-3d": (0, detected),
    "affordance-topdown": (1, from_above),
    "affordance-view": (2, in_view),
    "action-recognition": (1, actions),
    "scene-reconstruction-360": (1, volumes),
}
"""Task -> which of the data sets, and how."""


def main(rgbd: str, round_about: str, timelapse: str, predictions: str, out: str) -> None:
    """A picture a task, of the first episode of val."""
    for name, (which, draw) in DRAWN.items():
        episode = load((rgbd, round_about, timelapse)[which], "val", truth=True)[0]
        with open_submission(Path(predictions) / name) as files:
            answer = Predictions(files, task(name)).get(episode.episode_id)
        figure, panels = plt.subplots(2, 2, figsize=(11, 4.6 if name == "action-recognition" else 8.4))
        draw(tuple(panels.flat), episode, answer)
        for axes in panels.flat:
            axes.set_xticks([])
            axes.set_yticks([])
            axes.title.set_fontsize(10)
        figure.tight_layout()
        figure.savefig(Path(out) / f"task-{name}.jpg", dpi=80, pil_kwargs={"quality": 85})
        plt.close(figure)


if __name__ == "__main__":
    main(*sys.argv[1:])
