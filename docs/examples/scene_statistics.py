"""What generated scenes are like, in numbers and plots.

    hsbench verify --scenes 1000 --workers 2 --json > scenes.json
    python docs/examples/scene_statistics.py scenes.json OUT

Writes OUT/scene-statistics.png and prints the tables of docs/data/scenes.md.
"""

import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

BLUE, SAND = "#3b6ea5", "#d9b26f"


def main(survey: Path, out: Path) -> None:
    found = json.loads(survey.read_text(encoding="utf-8"))
    print("| promise | found |\n|---|---|")
    for line in found["promises"]:
        print(f"| {line['name']} | {line['measured']}{'' if line['kept'] else ' (not kept)'} |")
    scenes = found["scenes"]
    rooms = [r for s in scenes for r in zip(s["room_types"], s["room_m2"], s["furniture"], strict=True)]
    print("\n| room | rooms | floor, m2 (median, 5-95 %) | furniture (median, 5-95 %) |\n|---|---|---|---|")
    for kind in sorted({kind for kind, _, _ in rooms}):
        area = np.array([m2 for k, m2, _ in rooms if k == kind])
        furniture = np.array([n for k, _, n in rooms if k == kind])
        print(f"| {kind} | {len(area)} | {spread(area, 1)} | {spread(furniture, 0)} |")
    categories: Counter[str] = Counter()
    for s in scenes:
        categories.update(dict(s["categories"]))
    print("\n| category | objects | l x w x h, m (medians) |\n|---|---|---|")
    for name, number in categories.most_common():
        sizes = np.array([size for s in scenes for kind, *size in s["sizes_m"] if kind == name])
        if len(sizes):
            print(f"| {name} | {number} | {' x '.join(f'{v:.2f}' for v in np.median(sizes, axis=0))} |")
    out.mkdir(parents=True, exist_ok=True)
    plot(scenes, rooms, out / "scene-statistics.png")


def spread(values: np.ndarray, digits: int) -> str:
    low, middle, high = np.percentile(values, [5, 50, 95])
    return f"{middle:.{digits}f} ({low:.{digits}f}-{high:.{digits}f})"


def plot(scenes: list[dict[str, Any]], rooms: list[tuple[str, float, int]], path: Path) -> None:
    figure, axes = plt.subplots(2, 2, figsize=(10, 6.4), layout="constrained")
    kinds = sorted({kind for kind, _, _ in rooms})
    for axis, column, title in ((axes[0, 0], 2, "furniture in a room"), (axes[0, 1], 1, "floor of a room, m2")):
        axis.boxplot(
            [[r[column] for r in rooms if r[0] == kind] for kind in kinds], tick_labels=kinds, showfliers=False
        )
        axis.set_title(title)
        axis.tick_params(axis="x", rotation=35)
    axes[1, 0].hist([s["free_floor"] for s in scenes], bins=30, color=BLUE)
    axes[1, 0].set_title("share of the floor where a body can stand")
    axes[1, 1].hist([s["occluded"] for s in scenes if s["occluded"] is not None], bins=30, color=SAND)
    axes[1, 1].set_title("share of furniture in view that is mostly hidden")
    for axis in axes[1]:
        axis.set_ylabel("scenes")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
