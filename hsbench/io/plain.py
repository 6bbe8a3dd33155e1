"""Frozen dataclasses to and from plain JSON values, checked against their annotations.

For results and descriptors made of numbers, texts, tuples, mappings and nested dataclasses; schema objects with
arrays have their own codec.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from typing import Any, TypeVar

from hsbench.errors import DataError, SchemaError

T = TypeVar("T")

_SCALARS = {str: "text", int: "a whole number", float: "a number", bool: "true or false", types.NoneType: "null"}


def to_plain(obj: Any) -> Any:
    """Dataclasses and mappings as dict, tuples as list, the rest as it is."""
    if dataclasses.is_dataclass(obj) and not isinstance(obj, type):
        return {field.name: to_plain(getattr(obj, field.name)) for field in dataclasses.fields(obj)}
    if isinstance(obj, Mapping):
        return {key: to_plain(value) for key, value in obj.items()}
    if isinstance(obj, list | tuple):
        return [to_plain(value) for value in obj]
    return obj


def from_plain(cls: type[T], value: Any, name: str) -> T:
    """The inverse of ``to_plain`` for a dataclass. ``name``: what messages call the value.

    Raises DataError for a missing or unknown key or a wrong type, naming the item by its path, and where the
    dataclass itself refuses the values.
    """
    result: T = _decode(cls, value, name)
    return result


def _decode(kind: Any, value: Any, at: str) -> Any:
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return _decode_dataclass(kind, value, at)
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (types.UnionType, typing.Union):
        if value is None and types.NoneType in arguments:
            return None
        (other,) = (argument for argument in arguments if argument is not types.NoneType)
        return _decode(other, value, at)
    if origin is tuple:
        if not isinstance(value, list):
            raise DataError(f"{at} is {_shown(value)}; expected a list")
        return tuple(_decode(arguments[0], item, f"{at}[{i}]") for i, item in enumerate(value))
    if origin in (Mapping, dict):
        if not isinstance(value, dict):
            raise DataError(f"{at} is {_shown(value)}; expected an object")
        return {key: _decode(arguments[1], item, f"{at}.{key}") for key, item in value.items()}
    if origin is typing.Literal:
        if value not in arguments:
            raise DataError(f"{at} is {_shown(value)}; expected one of {', '.join(map(repr, arguments))}")
        return value
    if kind is float and type(value) is int and abs(value) <= 2**53:
        return float(value)
    if type(value) is not kind:
        raise DataError(f"{at} is {_shown(value)}; expected {_SCALARS[kind]}")
    return value


def _decode_dataclass(kind: type[Any], value: Any, at: str) -> Any:
    if not isinstance(value, dict):
        raise DataError(f"{at} is {_shown(value)}; expected an object")
    hints = typing.get_type_hints(kind)
    names = [field.name for field in dataclasses.fields(kind)]
    missing, unknown = [n for n in names if n not in value], [k for k in value if k not in names]
    if missing or unknown:
        parts = [f"lacks {', '.join(missing)}"] if missing else []
        parts += [f"has unknown {', '.join(map(repr, unknown))}"] if unknown else []
        raise DataError(f"{at} {' and '.join(parts)}; expected exactly {', '.join(names)}")
    try:
        return kind(**{n: _decode(hints[n], value[n], f"{at}.{n}") for n in names})
    except SchemaError as error:
        raise DataError(f"{at}: {error}") from error


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
