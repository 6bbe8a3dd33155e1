"""Predictions of affordance: one probability map a label, walkable, sittable, interactable in this order.

A prediction file holds ``probability`` float32 (3, rows, columns) in 0..1; binary maps are 0 and 1. A label is
predicted where its probability is ``THRESHOLD`` or more, so .5 means yes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.states import Affordance
from hsbench.typing import AnyArray, Float32Array

LABELS = (Affordance.WALKABLE, Affordance.SITTABLE, Affordance.INTERACTABLE)
THRESHOLD = 0.5
HINT = "one map each of walkable, sittable, interactable, as 32-bit floats"


def encode(probability: AnyArray) -> dict[str, AnyArray]:
    """(3, rows, columns) bool, or numbers in 0..1 -> the arrays of a prediction file. Raises SchemaError."""
    if not isinstance(probability, np.ndarray) or probability.dtype.kind not in "bf":
        found = getattr(probability, "dtype", type(probability).__name__)
        raise SchemaError(f"prediction is {found}; expected bool or floats (3, rows, columns)")
    if probability.ndim != 3 or len(probability) != len(LABELS):
        raise SchemaError(f"prediction has shape {probability.shape}; expected (3, rows, columns): {HINT}")
    arrays: dict[str, AnyArray] = {"probability": probability.astype(np.float32)}
    for fault in faults(arrays):
        raise SchemaError(fault)
    return arrays


def decode(arrays: Mapping[str, AnyArray]) -> Float32Array:
    """The inverse of ``encode``: float32 (3, rows, columns)."""
    return np.asarray(arrays["probability"])


def faults(arrays: Mapping[str, AnyArray]) -> list[str]:
    """Maps that leave 0..1, a line each."""
    return [
        f"probability of {label.name.lower()} spans {plane.min()} .. {plane.max()}; expected 0..1 (logits? percents?)"
        for label, plane in zip(LABELS, arrays["probability"], strict=True)
        if plane.size and not (plane.min() >= 0 and plane.max() <= 1)
    ]
