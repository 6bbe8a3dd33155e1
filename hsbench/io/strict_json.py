"""Reading JSON that must mean the same to everyone: UTF-8, no NaN or infinity, no key given twice."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from hsbench.errors import DataError


def read_json(path: str | Path) -> Any:
    """The value in a JSON file. Raises DataError naming the file where it is missing or no strict JSON."""
    try:
        return parse_json(Path(path).read_bytes())
    except OSError as error:
        raise DataError(f"cannot read {path}: {error.strerror or error}") from error
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


def parse_json(data: bytes) -> Any:
    """The value in the bytes of a JSON file; a byte order mark is let pass. Raises DataError in one line."""
    try:
        return json.loads(
            data.decode("utf-8-sig"),
            parse_constant=_refuse_constant,
            parse_float=_finite_float,
            object_pairs_hook=_unique_keys,
        )
    except UnicodeDecodeError as error:
        raise DataError(f"no valid JSON (not UTF-8 at byte {error.start})") from error
    except RecursionError as error:
        raise DataError("no valid JSON (nested too deeply)") from error
    except ValueError as error:
        raise DataError(f"no valid JSON ({error})") from error


def _refuse_constant(token: str) -> Any:
    raise ValueError(f"{token} is no JSON number; expected a finite number or null")


def _finite_float(token: str) -> float:
    value = float(token)
    if not math.isfinite(value):  # 1e999
        _refuse_constant(token)
    return value


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise ValueError(f"key {key!r} is given twice")
        result[key] = value
    return result
