"""Make docs/metrics/images/detection.svg: six AP rules on one curve, two duplicate rules on nested truths."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Rectangle

from hsbench.metrics.average_precision import RULES, envelope

TRUTH, HIT, FALSE = "#444444", "#0072b2", "#d55e00"


def main(out: Path) -> None:
    """Write the figure to a file."""
    plt.rcParams.update({"svg.hashsalt": "hsbench", "svg.fonttype": "none", "font.size": 9})
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    curve(left)
    nested(right)
    figure.savefig(out, metadata={"Date": None})


def curve(axes: plt.Axes) -> None:
    """Five truths; detections right, wrong, right, right, wrong, right."""
    hits = np.cumsum([1, 0, 1, 1, 0, 1])
    recall, precision = hits / 5, hits / np.arange(1, 7)
    steps = envelope(precision)
    axes.step(np.append(0, recall), np.append(steps[0], steps), where="pre", color=HIT, label="envelope")
    axes.plot(recall, precision, "o", color=FALSE, label="precision after each detection")
    axes.set(xlim=(0, 1.02), ylim=(0, 1.08), xlabel="recall", ylabel="precision", title="One curve, six numbers")
    lines = [f"{name:9} {rule(recall, precision):.4f}" for name, rule in RULES.items()]
    axes.text(0.04, 0.06, "\n".join(lines), family="monospace", va="bottom")
    axes.legend(loc="upper right", frameon=False)


def nested(axes: plt.Axes) -> None:
    """Two overlapping truths, two detections, and who hits what."""
    for y, title, second in (
        (1.9, "best truth: hsbench, voc, sunrgbd", FALSE),
        (0.0, "best truth not taken: coco", HIT),
    ):
        for x in (0.0, 0.2):
            axes.add_patch(Rectangle((x, y), 1, 0.9, fill=False, edgecolor=TRUTH, linewidth=2.5))
        for x, colour, margin in ((0.0, HIT, 0.06), (0.05, second, 0.12)):
            height = 0.9 - 2 * margin
            axes.add_patch(Rectangle((x, y + margin), 1, height, fill=False, edgecolor=colour, linewidth=1.5, ls="--"))
        ap = "AP .5" if second == FALSE else "AP 1"
        verdict = "false" if second == FALSE else "hits the other"
        axes.text(0, y + 0.98, f"{title}: the second box {verdict}, {ap}")
    axes.set(xlim=(-0.1, 1.9), ylim=(-0.15, 3.3))
    axes.set_title("Two nested truths, one of them found twice", loc="left")
    axes.axis("off")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
