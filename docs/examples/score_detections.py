"""The worked example of docs/metrics/detection.md: two nested cupboards, three boxes, six protocols."""

import numpy as np

from hsbench.metrics.bootstrap_ap import interval
from hsbench.metrics.detection import PROTOCOLS, Predictions, Truths, score

# centre x y z, size l w h, yaw: two units of a kitchen, the second 20 cm along, each 1 m long
units = np.array([[0.5, 0, 0.45, 1, 0.6, 0.9, 0.0], [0.7, 0, 0.45, 1, 0.6, 0.9, 0.0]])
found = np.array([[0.5, 0, 0.45, 1, 0.6, 0.9, 0.0], [0.55, 0, 0.45, 1, 0.6, 0.9, 0.0], [5, 0, 0.45, 1, 0.6, 0.9, 0.0]])
truths = [Truths(units)]
predictions = [Predictions(found, scores=np.array([0.9, 0.8, 0.7]))]

for name, protocol in PROTOCOLS.items():
    result = score(truths, predictions, name, iou=0.5)
    verdict = "verified" if result.verified else "unverified"
    if protocol.matching == "pairs":
        pair = result.pairs[0]
        print(f"{name:14} P {pair.precision:.3f}  R {pair.recall:.3f}  F1 {pair.f1:.3f}  {verdict}")
    else:
        print(f"{name:14} AP {result.ap:.3f}  AR {result.ar:.3f}  {verdict}")

# ten such rooms; in half of them both units are found, in the others the first: an interval by drawing rooms
answers = [Predictions(units[: 1 + i % 2], np.array([0.9, 0.8])[: 1 + i % 2]) for i in range(10)]
ranking = score(truths * 10, answers).overall[0].ranking
got = interval([ranking], seed=0)
print(f"AP {got.estimate:.3f}, 95 % of replicates within {got.low:.3f} .. {got.high:.3f}")
