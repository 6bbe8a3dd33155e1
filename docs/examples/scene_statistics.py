"""What generated scenes are like, in numbers and plots: ``python docs/examples/scene_statistics.py OUT [N]``.

Writes scene-statistics.png and prints the tables of docs/data/scenes.md. Building and examining 1000 scenes takes
about 20 minutes on one core.
"""

import sys
from collections import Counter
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from hsbench.synth.survey import Surveyed, survey

BLUE, SAND = "#3b6ea5", "#d9b26f"


def main(out: Path, count: int) -> None:
    found = list(survey(range(count), seed=0))
    rooms = [(kind, m2, n) for s in found for kind, m2, n in zip(s.room_types, s.room_m2, s.furniture, strict=True)]
    print("| room | rooms | floor, m2 (median, 5-95 %) | furniture (median, 5-95 %) |\n|---|---|---|---|")
    for kind in sorted({kind for kind, _, _ in rooms}):
        area = np.array([m2 for k, m2, _ in rooms if k == kind])
        furniture = np.array([n for k, _, n in rooms if k == kind])
        print(f"| {kind} | {len(area)} | {spread(area, 1)} | {spread(furniture, 0)} |")
    categories = Counter({name: 0 for s in found for name, _ in s.categories})
    for s in found:
        categories.update(dict(s.categories))
    print("\n| category | objects | size l x w x h, m (medians) |\n|---|---|---|")
    for name, number in categories.most_common():
        sizes = np.array([size for s in found for kind, *size in s.sizes_m if kind == name])
        text = " x ".join(f"{v:.2f}" for v in np.median(sizes, axis=0)) if len(sizes) else ""
        print(f"| {name} | {number} | {text} |")
    plot(found, rooms, out / "scene-statistics.png")


def spread(values: np.ndarray, digits: int) -> str:
    low, middle, high = np.percentile(values, [5, 50, 95])
    return f"{middle:.{digits}f} ({low:.{digits}f}-{high:.{digits}f})"


def plot(found: list[Surveyed], rooms: list[tuple[str, float, int]], path: Path) -> None:
    figure, axes = plt.subplots(2, 2, figsize=(10, 6.4), layout="constrained")
    kinds = sorted({kind for kind, _, _ in rooms})
    axes[0, 0].boxplot([[n for k, _, n in rooms if k == kind] for kind in kinds], tick_labels=kinds, showfliers=False)
    axes[0, 0].set_title("furniture in a room")
    axes[0, 0].tick_params(axis="x", rotation=35)
    axes[0, 1].boxplot([[m2 for k, m2, _ in rooms if k == kind] for kind in kinds], tick_labels=kinds, showfliers=False)
    axes[0, 1].set_title("floor of a room, m2")
    axes[0, 1].tick_params(axis="x", rotation=35)
    axes[1, 0].hist([s.free_floor for s in found], bins=30, color=BLUE)
    axes[1, 0].set_title("share of the floor where a body can stand")
    axes[1, 1].hist([s.occluded for s in found if s.occluded is not None], bins=30, color=SAND)
    axes[1, 1].set_title("share of furniture in view that is partly or fully occluded")
    for axis in axes[1]:
        axis.set_ylabel("scenes")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1000)
