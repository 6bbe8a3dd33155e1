"""Checks of label arrays that several metrics share: errors name the array, what was found, and the likely mistake."""

from __future__ import annotations

import numpy as np

from hsbench.errors import SchemaError
from hsbench.typing import AnyArray

VOID_HABITS = (255, 65535, -1, -100)
"""Values that data sets and training code use for pixels without a label."""


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
