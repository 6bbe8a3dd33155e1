"""The named protocols of detection: what each tests, how it matches, and who vouches for our version of it.

The prose of each, and how they differ, is the specification in ``detection``; here are its constants.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError

INFINITE = 1e10
"""Upper end of an open range of areas (pixels^2, COCO: 1e5^2) or depths."""


@dataclass(frozen=True)
class Range:
    """A class of truths by area or depth: low <= measure <= high, both ends inside."""

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class Protocol:
    """A scorer's rules.

    iou: thresholds. strict: a hit needs IoU > t, else IoU >= t. matching: ``best`` (each detection goes to its
    best truth, taken or not), ``untaken`` (to its best truth that is not taken) or ``pairs`` (1-1, largest IoU
    first, no scores). limit: boxes kept a scene, and a class where ``limit_per_class``. verified_by: what our
    numbers were compared with: for a foreign protocol something we did not write; None = unverified.
    """

    name: str
    iou: tuple[float, ...]
    matching: str
    strict: bool
    limit: int | None
    limit_per_class: bool
    verified_by: str | None
    ranges: tuple[Range, ...] = ()
    range_of: str = ""

    @property
    def verified(self) -> bool:
        """Whether something other than this code stands behind its numbers."""
        return self.verified_by is not None


def _steps(low: float, high: float, count: int) -> tuple[float, ...]:
    return tuple(np.linspace(low, high, count).tolist())


PROTOCOLS: Mapping[str, Protocol] = {
    p.name: p
    for p in (
        Protocol(
            "hsbench",
            (0.25, 0.5),
            "best",
            False,
            64,
            False,
            "tests/reference/detection_from_tasks.py and detection_second_reader.py, by readers of the task alone",
        ),
        Protocol("voc", (0.25, 0.5), "best", True, None, False, "mmdet3d 1.4.0's indoor_eval, run"),
        Protocol("sunrgbd", (0.25,), "best", False, None, False, "the toolbox's MATLAB functions, run in Octave"),
        Protocol(
            "coco",
            _steps(0.5, 0.95, 10),
            "untaken",
            False,
            100,
            True,
            "pycocotools, run in the tests",
            (
                Range("all", 0.0, INFINITE),
                Range("small", 0.0, 32.0**2),
                Range("medium", 32.0**2, 96.0**2),
                Range("large", 96.0**2, INFINITE),
            ),
            "area",
        ),
        Protocol(
            "omni3d",
            _steps(0.05, 0.5, 10),
            "untaken",
            False,
            100,
            True,
            "the matching and accumulation of cubercnn's Omni3Deval, run on given IoU",
            (
                Range("all", 0.0, 1e5),
                Range("near", 0.0, 10.0),
                Range("medium", 10.0, 35.0),
                Range("far", 35.0, 1e5),
            ),
            "depth",
        ),
        Protocol(
            "class-agnostic",
            (0.01, *(k / 20 for k in range(1, 13)), 0.8, 1.0),
            "pairs",
            True,
            None,
            False,
            "eval_holisticScencePR.m, run in Octave",
        ),
    )
}
"""Protocol name -> its rules."""

MAX_DETECTIONS = (1, 10, 100)
"""COCO and Omni3D: detections a scene and class at which recall is averaged."""


def protocol_named(name: str) -> Protocol:
    """The protocol, or SchemaError listing all."""
    if name not in PROTOCOLS:
        raise SchemaError(f"detection protocol {name!r} is unknown; expected one of {', '.join(PROTOCOLS)}")
    return PROTOCOLS[name]


def thresholds(protocol: Protocol, iou: float | Sequence[float] | None) -> tuple[float, ...]:
    """The IoU thresholds asked for, or the protocol's own. Raises SchemaError outside 0 < t <= 1."""
    if iou is None:
        return protocol.iou
    try:
        chosen = tuple(float(t) for t in np.atleast_1d(np.asarray(iou, dtype=np.float64)))
    except (TypeError, ValueError) as error:
        raise SchemaError(f"iou is {iou!r}; expected a threshold or several") from error
    for t in chosen:
        if not 0.0 < t <= 1.0:
            raise SchemaError(f"iou threshold is {t}; expected 0 < t <= 1 (a percentage?)")
    if not chosen:
        raise SchemaError("iou holds no threshold; expected one or several")
    if len({f"{t:.2f}" for t in chosen}) < len(chosen):
        raise SchemaError(f"iou thresholds are {chosen}; expected ones that differ in two digits: these name results")
    return chosen
