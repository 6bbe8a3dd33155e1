"""Checks of labels and counts that several metrics share: errors name the array, what was found, and the mistake."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hsbench.errors import SchemaError
from hsbench.typing import AnyArray, IntArray

VOID_HABITS = (255, 65535, -1, -100)
"""Values that data sets and training code use for pixels without a label."""

MOST = 2.0**63
"""Sums of counts stay below this: they are int64."""


def check_labels(array: AnyArray, name: str, shape: tuple[int, ...] | None = None) -> None:
    """Raise SchemaError unless ``array`` is a numpy array of bools or integers, of ``shape`` where one is given."""
    if not isinstance(array, np.ndarray):
        raise SchemaError(f"{name} is a {type(array).__name__}; expected a numpy array of integer labels")
    if array.dtype.kind == "f":
        nan = " and holds NaN" if np.isnan(array).any() else ""
        raise SchemaError(f"{name} has dtype {array.dtype}{nan}; expected integers (scores? take the argmax first)")
    if array.dtype.kind not in "bui":
        raise SchemaError(f"{name} has dtype {array.dtype}; expected integer labels")
    if shape is not None and array.shape != shape:
        hint = " (one-hot or scores? take the argmax first)" if array.ndim == len(shape) + 1 else ""
        if array.ndim == len(shape) and sorted(array.shape) == sorted(shape):
            hint = " (axes in another order?)"
        raise SchemaError(f"{name} has shape {array.shape}; expected {shape}{hint}")


def check_bool(array: AnyArray, name: str, shape: tuple[int, ...] | None = None) -> None:
    """Raise SchemaError unless ``array`` is a numpy array of bool, of ``shape`` where one is given."""
    if not isinstance(array, np.ndarray) or array.dtype != np.bool_:
        found = array.dtype if isinstance(array, np.ndarray) else type(array).__name__
        hint = " (probabilities? choose a threshold first)" if np.asarray(array).dtype.kind == "f" else ""
        raise SchemaError(f"{name} is {found}; expected bool{hint}")
    if shape is not None and array.shape != shape:
        hint = " (axes in another order?)" if sorted(array.shape) == sorted(shape) else ""
        raise SchemaError(f"{name} has shape {array.shape}; expected {shape}{hint}")


def check_integer(value: object, name: str, low: int | None = None, high: int | None = None) -> None:
    """Raise SchemaError unless ``value`` is an integer of low..high, None = no limit."""
    whole = int(value) if isinstance(value, int | np.integer) else None
    if whole is None or (low is not None and whole < low) or (high is not None and whole > high):
        bounds = "" if low is None else f" of {low}..{'' if high is None else high}"
        raise SchemaError(f"{name} is {value!r}; expected an integer{bounds}")


def chosen_classes(classes: Sequence[int] | None, n_classes: int) -> list[int]:
    """The classes that enter a mean, default all. Raises SchemaError unless they are different ones of 0..n-1."""
    chosen = list(range(n_classes)) if classes is None else list(classes)
    known = set(range(n_classes))
    if not all(isinstance(c, int | np.integer) and c in known for c in chosen) or len(set(chosen)) != len(chosen):
        raise SchemaError(f"classes are {chosen}; expected different ones of 0..{n_classes - 1}")
    return chosen


def check_counts(counts: AnyArray, name: str, shape: str) -> IntArray:
    """The counts as int64. Raises SchemaError unless they are an array of integers >= 0; ``shape`` is for the error."""
    try:
        values = np.asarray(counts)
    except ValueError:
        raise SchemaError(f"{name} has rows of different lengths; expected {shape}") from None
    if values.dtype.kind not in "ui":
        found = f"{values.dtype} {values.shape}"
        raise SchemaError(f"{name} is {found}; expected integer counts {shape} (normalised already?)")
    if values.size and values.min() < 0:
        raise SchemaError(f"{name} holds {values.min()}; expected counts >= 0")
    if values.sum(dtype=np.float64) >= MOST:
        raise SchemaError(f"{name} adds up to {values.sum(dtype=np.float64):g}; expected less than 2^63")
    return values.astype(np.int64)


def out_of_range(
    array: AnyArray, name: str, where: AnyArray, n_classes: int, extra: str, option: str | None
) -> SchemaError:
    """The error for the first element of ``where``, a mask of the array's shape.

    extra: what else is allowed. option: the argument that takes a void label, named in the hint; None = none does.
    """
    first = np.unravel_index(int(np.argmax(where)), array.shape)
    value = int(array[first])
    if value in VOID_HABITS:
        hint = f" (pixels without a label? pass {option}={value})" if option else " (only truth may be unlabelled)"
    elif value == n_classes:
        hint = " (labels counted from 1?)"
    else:
        hint = " (ids of another table?)"
    index = ", ".join(str(int(i)) for i in first)
    return SchemaError(f"{name} holds {value} at [{index}]; expected 0..{n_classes - 1}{extra}{hint}")
