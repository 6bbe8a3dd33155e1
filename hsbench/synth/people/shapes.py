"""The shapes people come in: the parameters from which ``bake`` makes ``bodies.npz``, and what a body takes of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

AFRICAN, ASIAN, EUROPEAN = "african", "asian", "caucasian"  # MakeHuman's names


@dataclass(frozen=True)
class Shape:
    """One adult. gender to height are MakeHuman's macro parameters, 0..1 (age 0 is 25, 1 is 90 years).

    stature_m: of the people who have this shape, on average. girth: the factor on ``body``'s radii at which its
    capsules fit the mesh (measured, see ``tests/unit/synth/test_people_body.py``).
    """

    name: str
    gender: Literal["female", "male"]
    age: float
    muscle: float
    weight: float
    height: float
    ancestry: tuple[tuple[str, float], ...]
    stature_m: float
    girth: float


SHAPES: tuple[Shape, ...] = (
    Shape("man-average", "male", 0.15, 0.55, 0.50, 0.55, ((EUROPEAN, 1.0),), 1.78, 1.01),
    Shape("woman-average", "female", 0.15, 0.50, 0.50, 0.50, ((EUROPEAN, 1.0),), 1.66, 1.05),
    Shape("man-tall", "male", 0.05, 0.65, 0.45, 0.60, ((AFRICAN, 1.0),), 1.88, 0.98),
    Shape("woman-slim", "female", 0.05, 0.45, 0.30, 0.50, ((AFRICAN, 0.8), (EUROPEAN, 0.2)), 1.69, 1.01),
    Shape("man-slim", "male", 0.10, 0.45, 0.30, 0.52, ((ASIAN, 1.0),), 1.72, 1.01),
    Shape("woman-small", "female", 0.20, 0.45, 0.45, 0.42, ((ASIAN, 1.0),), 1.58, 1.09),
    Shape("man-stout", "male", 0.45, 0.45, 0.97, 0.50, ((EUROPEAN, 0.7), (ASIAN, 0.3)), 1.77, 1.11),
    Shape("woman-stout", "female", 0.45, 0.40, 0.95, 0.45, ((AFRICAN, 0.6), (EUROPEAN, 0.4)), 1.65, 1.17),
    Shape("man-old", "male", 0.75, 0.40, 0.60, 0.45, ((EUROPEAN, 1.0),), 1.73, 1.10),
    Shape("woman-old", "female", 0.75, 0.40, 0.60, 0.46, ((ASIAN, 0.5), (EUROPEAN, 0.5)), 1.60, 1.13),
    Shape("man-strong", "male", 0.25, 0.85, 0.65, 0.52, ((AFRICAN, 0.5), (EUROPEAN, 0.5)), 1.83, 1.05),
    Shape("woman-tall", "female", 0.30, 0.60, 0.55, 0.60, ((EUROPEAN, 0.6), (AFRICAN, 0.4)), 1.75, 1.01),
)

SHAPE_OF: dict[str, Shape] = {shape.name: shape for shape in SHAPES}
