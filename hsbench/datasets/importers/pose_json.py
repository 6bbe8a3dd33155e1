"""Values out of parsed JSON, checked, for the readers of recorded poses. Every message starts with the place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hsbench.errors import DataError
from hsbench.io.reading import read_limited
from hsbench.io.strict_json import parse_json
from hsbench.typing import FloatArray

SHOWN = 40
"""Characters of a wrong value in a message."""


def load(path: Path, max_bytes: int) -> Any:
    """The value in a JSON file of at most ``max_bytes``. Raises DataError naming the file and the place."""
    data = read_limited(path, max_bytes, "another format?")
    if not data.strip():
        raise DataError(f"{path}: is empty; expected JSON")
    try:
        return parse_json(data)
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


def field(mapping: Any, key: str, where: str) -> Any:
    """A value of an object by its key. Raises DataError if it is no object or lacks the key."""
    if not isinstance(mapping, dict):
        raise DataError(f"{where} is {_kind(mapping)}; expected an object")
    if key not in mapping:
        raise DataError(f"{where} has no {key!r}; found {', '.join(map(repr, list(mapping)[:8])) or 'nothing'}"[:300])
    return mapping[key]


def items(value: Any, where: str, most: int) -> list[Any]:
    """A list of at most ``most`` items. Raises DataError otherwise."""
    if not isinstance(value, list):
        raise DataError(f"{where} is {_kind(value)}; expected a list")
    if len(value) > most:
        raise DataError(f"{where} has {len(value):,} items; expected at most {most:,}")
    return value


def numbers(value: Any, where: str, count: int, largest: float) -> FloatArray:
    """(count,) float64 from a list of numbers of at most ``largest``. Raises DataError naming the first that is not."""
    found = items(value, where, count)
    if len(found) != count:
        raise DataError(f"{where} has {len(found)} values; expected {count} (another skeleton, or an incomplete copy?)")
    for index, number in enumerate(found):
        if type(number) not in (int, float) or not abs(number) <= largest:
            raise DataError(f"{where}[{index}] is {_shown(number)}; expected a number of at most {largest:g}")
    return np.array(found, dtype=np.float64)


def whole(value: Any, where: str, lowest: int, largest: int) -> int:
    """A whole number within limits. Raises DataError otherwise."""
    if type(value) is not int or not lowest <= value <= largest:
        raise DataError(f"{where} is {_shown(value)}; expected a whole number of {lowest} to {largest}")
    return value


def text(value: Any, where: str) -> str:
    """A text of one line. Raises DataError otherwise."""
    if not isinstance(value, str) or not value.isprintable():
        raise DataError(f"{where} is {_shown(value)}; expected a text of one line")
    return value


def _kind(value: Any) -> str:
    names = {
        dict: "an object",
        list: "a list",
        str: "a text",
        bool: "true or false",
        int: "a number",
        float: "a number",
    }
    return names.get(type(value), "null")


def _shown(value: Any) -> str:
    return _kind(value) if isinstance(value, dict | list) or value is None else ascii(value)[:SHOWN]
