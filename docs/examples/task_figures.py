"""Draw docs/images/tasks.png: the truth of four tasks. Usage: task_figures.py RGBD_DATA DATA_360 TIMELAPSE_DATA OUT.png

Each data set holds an episode of split val; pictures are not needed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch, Polygon

from hsbench import load
from hsbench.evaluation.scorers import scorer
from hsbench.geometry import boxes
from hsbench.schema import Episode
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.states import Affordance, Visibility
from hsbench.truth.affordance_volumes import Volume

PALE, GREY = (0.96, 0.96, 0.94), (0.75, 0.75, 0.73)
COLOURS = {"walkable": (0.62, 0.80, 0.55), "interactable": (0.35, 0.55, 0.85), "sittable": (0.90, 0.45, 0.30)}
SEEN = dict(zip(Visibility, ("#2e8b57", "#d39a1c", "#c0392b", "#8a8a8a"), strict=True))
SLICE_M = 0.42  # through seats and table legs
CROP = 28  # cells cut off on each side of a plan


def painted(planes: dict[str, np.ndarray], unscored: np.ndarray) -> np.ndarray:
    """Colours of exclusive labels, the last of the planes on top; grey where nothing counts."""
    image = np.full((*unscored.shape, 3), PALE)
    for name, plane in planes.items():
        image[plane] = COLOURS[name]
    image[unscored] = GREY
    return image


def by_bits(bits: np.ndarray) -> dict[str, np.ndarray]:
    return {name: (bits >> Affordance[name.upper()] & 1).astype(bool) for name in COLOURS}


def detection(axes: Axes, episode: Episode) -> None:
    solid = episode.truth.occupancy.solid[:, :, 1:36].any(axis=2)
    axes.imshow(np.where(solid, 0.82, 1.0)[::-1, ::-1], cmap="gray", vmin=0, vmax=1, extent=(3.2, -3.2, 0, 6.4))
    true = scorer("object-detection-3d").truth(episode)
    for box, (seen, _), hopeless in zip(true.boxes, true.groups["visibility-evidence"], true.difficult, strict=True):
        footprint = boxes.corners(box[None])[0, [0, 4, 6, 2], 1::-1]
        axes.add_patch(Polygon(footprint, fill=False, edgecolor=SEEN[seen], lw=2, ls=":" if hopeless else "-"))
    names = [Patch(color=colour, label=kind.name.lower().replace("_", " ")) for kind, colour in SEEN.items()]
    axes.legend(handles=names, fontsize=8, loc="upper right")
    axes.set_title("object-detection-3d: boxes by visibility (dotted: difficult)")


def plan(axes: Axes, episode: Episode) -> None:
    truth = episode.truth.affordance
    inner = slice(CROP, -CROP)
    axes.imshow(painted(by_bits(truth.labels), truth.ignored)[inner, inner], interpolation="nearest")
    axes.legend(handles=[Patch(color=c, label=n) for n, c in COLOURS.items()], fontsize=8, loc="upper right")
    axes.set_title("affordance-topdown, camera in the middle")


def view(axes: Axes, episode: Episode) -> None:
    bits = episode.truth.view_affordance
    axes.imshow(painted(by_bits(bits), (bits & VIEW_UNSCORED) > 0), interpolation="nearest")
    axes.set_title("affordance-view, grey: void or ignored")


def volumes(axes: Axes, episode: Episode) -> None:
    true = scorer("scene-reconstruction-360").truth(episode)
    layer = true.labels[:, :, int(SLICE_M / true.grid.voxel_m)][::-1, ::-1]
    floor = true.labels[:, :, 0][::-1, ::-1] == Volume.WALKABLE
    planes = {"walkable": floor, **{n: layer == Volume[n.upper()] for n in ("interactable", "sittable")}}
    image = painted(planes, true.ignored[:, :, 0][::-1, ::-1])
    image[layer == Volume.WALL] = 0.2
    inner = slice(CROP, -CROP)
    axes.imshow(image[inner, inner], interpolation="nearest")
    axes.set_title(f"scene-reconstruction-360: floor, and {SLICE_M} m above")


def main(rgbd: str, round_about: str, timelapse: str, out: str) -> None:
    """Four panels of the first episode of each."""
    figure, panels = plt.subplots(2, 2, figsize=(11, 10))
    first = {path: load(path, "val", truth=True, frames=False)[0] for path in (rgbd, round_about, timelapse)}
    for axes, draw, path in zip(
        panels.flat, (detection, plan, view, volumes), (rgbd, round_about, timelapse, round_about), strict=True
    ):
        draw(axes, first[path])
        axes.set_xticks([])
        axes.set_yticks([])
    figure.tight_layout()
    figure.savefig(Path(out), dpi=70)


if __name__ == "__main__":
    main(*sys.argv[1:])
