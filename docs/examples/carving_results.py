"""The numbers of docs/results.md: carving, its controls and references on the validation split of rgbd-activity.

    python docs/examples/carving_results.py OUT [--workers 2]

Generates train and val (pictures at t0 only), runs every method on val, and prints Markdown tables. A few minutes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from hsbench.baselines.occlusion.methods import METHODS
from hsbench.baselines.occlusion.run import predict
from hsbench.datasets.dataset import load
from hsbench.evaluation.compare import compare
from hsbench.evaluation.score import score
from hsbench.io.splits import read_splits
from hsbench.synth.generate import Job, generate
from hsbench.tasks.scene_completion import SCENE_COMPLETION

RECIPE = "rgbd-activity"
COLUMNS = ("occluded/iou", "occluded/precision", "occluded/recall", "surface+occluded/iou")
TIMES_S = (5, 15, 30, 60, 120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    data = arguments.out / "data"
    splits = read_splits(RECIPE)
    units = tuple(splits.numbers("full", "train") + splits.numbers("full", "val"))
    for _ in generate(Job(RECIPE, 0, units, "reference"), data, arguments.workers):
        pass

    def run(name: str, until_s: float | None = None):
        folder = arguments.out / "predictions" / (name if until_s is None else f"{name}@{until_s:g}s")
        for _ in predict(name, load(data, "val", until_s=until_s), folder, replace_out=True):
            pass
        return score(SCENE_COMPLETION.name, folder, load(data, "val"))

    reports = {name: run(name) for name in METHODS}
    counts = reports["carve"].counts
    print(f"{counts.scored} episodes of {counts.scenes} scenes, manifest {load(data).manifest_sha256[:12]}\n")
    print("| method | track | " + " | ".join(COLUMNS) + " | IoU, mean over episodes |")
    print("|---|---|" + "---|" * (len(COLUMNS) + 1))
    for name, report in reports.items():
        cells = [f"{report.metrics[c].value:.3f}" for c in COLUMNS]
        low, high = report.primary.low, report.primary.high
        cells[0] += f" [{low:.3f}, {high:.3f}]"
        mean = report.metrics["occluded/iou"].mean_over_episodes
        print(f"| {name} | {report.method.track} | " + " | ".join(cells) + f" | {mean:.3f} |")
    print("\n| difference in occluded/iou | paired, 95 % interval |\n|---|---|")
    for name in METHODS:
        if name != "carve":
            d = compare(reports["carve"], reports[name]).primary
            print(f"| carve less {name} | {d.estimate:+.3f} [{d.low:+.3f}, {d.high:+.3f}] |")
    d = compare(reports["carve-height-prior"], reports["height-prior"]).primary
    print(f"| carve-height-prior less height-prior | {d.estimate:+.3f} [{d.low:+.3f}, {d.high:+.3f}] |")
    print("\n| seconds watched | carve | carve-swept |\n|---|---|---|")
    for seconds in TIMES_S:
        cells = []
        for name in ("carve", "carve-swept"):
            primary = run(name, seconds).primary
            cells.append(f"{primary.value:.3f} [{primary.low:.3f}, {primary.high:.3f}]")
        print(f"| {seconds} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
