"""Settings from a recipe's ``config.toml`` into the engine's frozen dataclasses; a misspelt key fails."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

from hsbench.errors import SchemaError

T = TypeVar("T")


def settings(kind: type[T], table: Mapping[str, Any], name: str) -> T:
    """An instance of a dataclass from a TOML table; lists become tuples.

    Raises SchemaError naming unknown keys, with those that exist.
    """
    known = {f.name for f in dataclasses.fields(kind)}  # type: ignore[arg-type]
    unknown = sorted(set(table) - known)
    if unknown:
        raise SchemaError(f"config section [{name}] has unknown keys {unknown}; expected some of {sorted(known)}")
    return kind(**{key: _frozen(value) for key, value in table.items()})


def _frozen(value: Any) -> Any:
    return tuple(_frozen(v) for v in value) if isinstance(value, list) else value
