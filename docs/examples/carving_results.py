"""The numbers of docs/results.md: carving, its controls and references on the validation split of rgbd-activity.

    python docs/examples/carving_results.py DATA OUT [--images docs/images]

DATA is a data set of recipe rgbd-activity with splits train and val. Runs every method on val, prints Markdown tables,
and draws the curves over observed seconds and over noise of the poses. Predictions and reports go to OUT.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from hsbench.baselines import run
from hsbench.baselines.method import Method, Predictor, Settings
from hsbench.baselines.occlusion.methods import METHODS
from hsbench.datasets.dataset import Dataset, load
from hsbench.errors import DataError
from hsbench.evaluation.compare import compare
from hsbench.evaluation.report import Report, write_report
from hsbench.evaluation.score import score
from hsbench.geometry.transforms import invert
from hsbench.schema.episode import Episode
from hsbench.schema.poses import PoseTable
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.activities import live
from hsbench.synth.activities.life import stamps
from hsbench.synth.assemble import poses_in, scene_in
from hsbench.synth.detectors import PRESETS, DetectorConfig, Occluders, observe
from hsbench.synth.placement import place_rgbd
from hsbench.synth.recipes import Recipe
from hsbench.synth.remake import recipe_of
from hsbench.synth.rgbd import RgbdSettings
from hsbench.synth.seeds import Seeds
from hsbench.tasks.scene_completion import SCENE_COMPLETION
from hsbench.viz.charts import COLOURS

COLUMNS = ("occluded/iou", "occluded/precision", "occluded/recall", "surface+occluded/iou")
DIFFERENCES = COLUMNS[:2]
PAIRS = (
    *(("carve", other) for other in METHODS if other not in ("carve", "carve-height-prior")),
    ("carve-height-prior", "carve"),
    ("carve-height-prior", "height-prior"),
)
TIMES_S = (5, 15, 30, 60, 120)
OVER_TIME = ("carve", "carve-true-poses", "carve-swept", "carve-shuffled")
NOISES = ("clean", "kinect", "harsh")
OVER_NOISE = ("carve", "carve-height-prior")
WITHOUT_ACTIVITY = {"carve": "all-solid", "carve-height-prior": "height-prior"}
Curve = dict[str, list[Report]]


def main() -> None:
    """Run, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--images", type=Path, help="folder of the figure; default OUT")
    arguments = parser.parse_args()
    data, out = load(arguments.data, "val"), arguments.out

    reports = {name: scored(method, data, out / name) for name, method in METHODS.items()}
    print(f"{len(data)} episodes of {len(set(data.scene_ids))} scenes, manifest {data.manifest_sha256[:12]}\n")
    print_methods(reports)
    print_differences(reports)
    print_freed(reports)
    over_time: Curve = {
        name: [scored(METHODS[name], replace(data, until_s=t), out / f"{name}@{t}s") for t in TIMES_S]
        for name in OVER_TIME
    }
    print_curve("seconds watched", [str(t) for t in TIMES_S], over_time, reports)
    over_noise: Curve = {
        name: [scored(observed_by(noise, METHODS[name]), data, out / f"{name}@{noise}") for noise in NOISES]
        for name in OVER_NOISE
    }
    print_curve("detector", NOISES, over_noise, reports)
    draw((arguments.images or out) / "carving-curves.svg", reports, over_time, over_noise)


def scored(method: Method, data: Dataset, folder: Path) -> Report:
    """The report of a method on a data set, which is also written beside its predictions."""
    for _ in run.predict(method, data, folder, replace_out=True):
        pass
    report = score(SCENE_COMPLETION.name, folder, replace(data, until_s=None))
    write_report(folder.with_name(folder.name + ".json"), report)
    return report


def observed_by(noise: str, method: Method) -> Method:
    """A method that is given the poses as another detector, in metres, sees the same life."""
    config = replace(PRESETS[noise], skeleton=KINECT_V2.name)

    def prepare(settings: Settings) -> Predictor:
        answer = method.prepare(settings)
        return lambda episode: answer(replace(episode, poses=observed_again(settings.data, episode, config)))

    return replace(method, prepare=prepare)


def observed_again(data: Dataset, episode: Episode, config: DetectorConfig) -> PoseTable:
    """The life of an episode lived again, as its recipe makes it, and seen by a detector.

    Raises DataError where another engine lives another life than the data set has: its own detector then sees it
    otherwise than it is stored.
    """
    recipe, seed = _origin(data.root)
    row = next(row for row in data.rows if row["episode_id"] == episode.episode_id)
    settings = RgbdSettings.of(recipe.config, row["split"])
    seeds = Seeds(seed).child("scene").child(int(episode.episode_id.rsplit("-", 1)[1]))
    scene = settings.scene(row["scene_id"], seeds.child("room"))
    life = live(scene, seeds.child("life"), settings.life)
    scene_T_episode, sensor = place_rgbd(scene, settings.camera, seeds.rng("rgbd-camera"))
    episode_T_scene = invert(scene_T_episode)
    true, occluders = (
        poses_in(episode_T_scene, life.poses),
        Occluders.of(scene_in(episode_T_scene, scene), life.motions),
    )
    rate_hz = settings.recording.pose_rate_hz
    looks = stamps(np.arange(round(settings.life.duration_s * rate_hz)), rate_hz)

    def seen_by(detector: DetectorConfig) -> PoseTable:
        return observe(true, life.bodies, occluders, sensor, detector, seeds.child(data.name).child("observe"), looks)[
            0
        ]

    stored, again = episode.poses, seen_by(settings.detector)
    assert stored is not None
    if not np.array_equal(stored.joints_m, again.joints_m, equal_nan=True):
        raise DataError(f"{episode.episode_id} is not what this version of hsbench makes; generate the data set again")
    return seen_by(config)


@lru_cache(maxsize=1)
def _origin(root: Path) -> tuple[Recipe, int]:
    """The recipe and the seed of a generated data set."""
    return recipe_of(root), int(load(root).description["seed"])


def print_methods(reports: dict[str, Report]) -> None:
    """A line a method: the columns, the first with its interval."""
    print("| method | track | " + " | ".join(COLUMNS) + " | IoU, mean over episodes |")
    print("|---|---|" + "---|" * (len(COLUMNS) + 1))
    for name, report in reports.items():
        cells = [value(report, column) for column in DIFFERENCES]
        cells += [f"{report.metrics[column].value:.3f}" for column in COLUMNS[len(DIFFERENCES) :]]
        mean = report.metrics[COLUMNS[0]].mean_over_episodes
        print(f"| {name} | {report.method.track} | " + " | ".join(cells) + f" | {mean:.3f} |")


def value(report: Report, name: str = COLUMNS[0]) -> str:
    """A metric with its interval."""
    metric = report.metrics[name]
    return f"{metric.value:.3f} [{metric.low:.3f}, {metric.high:.3f}]"


def difference(a: Report, b: Report, name: str = COLUMNS[0]) -> str:
    """A less B with the paired interval."""
    found = compare(a, b).differences[name]
    return f"{found.estimate:+.3f} [{found.low:+.3f}, {found.high:+.3f}]"


def print_differences(reports: dict[str, Report]) -> None:
    """A line a pair of methods."""
    print("\n| difference, paired over scenes | " + " | ".join(DIFFERENCES) + " |")
    print("|---|" + "---|" * len(DIFFERENCES))
    for a, b in PAIRS:
        cells = [difference(reports[a], reports[b], name) for name in DIFFERENCES]
        print(f"| {a} less {b} | " + " | ".join(cells) + " |")


def print_freed(reports: dict[str, Report]) -> None:
    """What each way of carving frees of what all-solid calls solid, and how much of that is free in truth."""
    counts = {name: np.sum([row.statistics["occluded"] for row in r.episodes], axis=0) for name, r in reports.items()}
    true_solid, true_free, _, _ = counts["all-solid"]
    print(
        "\n| method | hidden voxels freed | of these truly free | of all that is free and hidden |\n|---|---|---|---|"
    )
    for name in OVER_TIME:
        solid_left, free_left, _, _ = counts[name]
        wrong, right = true_solid - solid_left, true_free - free_left
        print(
            f"| {name} | {wrong + right:,} | {100 * right / (wrong + right):.1f} % | {100 * right / true_free:.1f} % |"
        )


def print_curve(over: str, places: Sequence[str], curve: Curve, reports: dict[str, Report]) -> None:
    """A line a place of the curve; beside it what watching gains over the same without activity, paired."""
    gains = [name for name in curve if name in WITHOUT_ACTIVITY]
    heads = [*curve, *(f"{name} less {WITHOUT_ACTIVITY[name]}" for name in gains)]
    print(f"\n| {over} | " + " | ".join(heads) + " |\n|---|" + "---|" * len(heads))
    for k, place in enumerate(places):
        cells = [value(found[k]) for found in curve.values()]
        cells += [difference(curve[name][k], reports[WITHOUT_ACTIVITY[name]]) for name in gains]
        print(f"| {place} | " + " | ".join(cells) + " |")


def draw(path: Path, reports: dict[str, Report], over_time: Curve, over_noise: Curve) -> None:
    """Both curves, the interval of ``carve``, and what methods without activity reach as lines."""
    plt.rcParams |= {"svg.hashsalt": "hsbench", "svg.fonttype": "none"}
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), sharey=True, constrained_layout=True)
    colours = dict(zip((*OVER_TIME, "all-solid", "height-prior"), COLOURS, strict=True)) | {
        "carve-height-prior": COLOURS[5]
    }
    _curves(left, np.log2(TIMES_S), over_time, colours)
    left.set_xticks(np.log2(TIMES_S), [f"{t} s" for t in TIMES_S])
    left.set_xlabel("watched")
    left.set_ylabel("IoU of occluded voxels, val")
    _curves(right, np.arange(len(NOISES)), over_noise, colours)
    right.set_xticks(range(len(NOISES)), NOISES)
    right.set_xlabel("detector that gave the poses")
    for axes, names in ((left, ("all-solid",)), (right, ("all-solid", "height-prior"))):
        for name in names:
            axes.axhline(reports[name].primary.value, color=colours[name], linestyle="--", linewidth=1.2, label=name)
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", alpha=0.25)
        axes.legend(frameon=False, fontsize=8)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def _curves(axes: Axes, x: np.ndarray, curve: Curve, colours: dict[str, str]) -> None:
    for name, reports in curve.items():
        middle, low, high = np.array([(r.primary.value, r.primary.low, r.primary.high) for r in reports]).T
        if name == "carve":  # one band a panel can be read; differences are paired and in the tables
            axes.fill_between(x, low, high, color=colours[name], alpha=0.12, linewidth=0)
        axes.plot(x, middle, "o-", color=colours[name], label=name)


if __name__ == "__main__":
    main()
