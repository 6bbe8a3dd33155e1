"""What tests of leaks look at: everything an object leads to, everything a folder holds, and what neither may have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow.parquet as pq

from hsbench.errors import HsbenchError
from hsbench.io.arrays import load_npz
from hsbench.io.images import depth_to_mm
from hsbench.io.strict_json import read_json
from hsbench.schema import Episode

PLAIN = (str, bytes, int, float, Enum, Path, np.generic, np.ndarray, type(None))
LEAST_BYTES = 32
"""A shorter array may turn up anywhere by chance."""


def reachable(root: Any, name: str, private: bool = False) -> Iterator[tuple[str, Any]]:
    """(path, value) of all that attributes, properties, items and elements lead to; every element's path ends in [].

    private: attributes whose names begin with one underscore too.
    """
    seen: dict[int, Any] = {}  # holds what it names, so that no id comes twice
    pending = [(name, root)]
    while pending:
        path, value = pending.pop()
        if callable(value) or id(value) in seen:
            continue
        yield path, value
        if isinstance(value, PLAIN):
            continue
        seen[id(value)] = value
        if isinstance(value, Mapping):
            pending += [(f"{path}.{key}", item) for key, item in value.items()]
            continue
        if hasattr(value, "__getitem__") and hasattr(value, "__len__"):
            pending += [(f"{path}[]", value[k]) for k in range(len(value))]
        for attribute in dir(value):
            if attribute.startswith("__") or (attribute.startswith("_") and not private):
                continue
            try:
                pending.append((f"{path}.{attribute}", getattr(value, attribute)))
            except (AttributeError, HsbenchError):  # such as the pose of a camera whose height is truth
                continue


def decoded(file: Path) -> Iterator[tuple[str, Any]]:
    """(name, array or JSON value) of everything in a file; another kind of file is an error."""
    if file.suffix == ".json":
        yield file.name, read_json(file)
    elif file.suffix == ".parquet":
        table = pq.read_table(file)
        for key, value in (table.schema.metadata or {}).items():
            yield f"{file.name} metadata {key.decode()}", value.decode()
        for column in table.column_names:
            flat = table[column].combine_chunks()
            while hasattr(flat, "flatten") and hasattr(flat.type, "value_type"):
                flat = flat.flatten()
            yield f"{file.name} {column}", flat.to_numpy(zero_copy_only=False)
    elif file.suffix == ".npz":
        yield from ((f"{file.name} {name}", array) for name, array in load_npz(file).items())
    elif file.suffix == ".png":
        picture = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        yield file.name, picture[..., ::-1] if picture.ndim == 3 else picture
    else:
        raise AssertionError(f"nobody knows what {file} holds")


def keys_of(value: Any) -> set[str]:
    """The keys of a JSON value at any depth."""
    if isinstance(value, dict):
        return set(value).union(*(keys_of(item) for item in value.values()))
    return set().union(*(keys_of(item) for item in value)) if isinstance(value, list) else set()


def secret_arrays(episode: Episode) -> dict[bytes, str]:
    """Bytes and path of every array of an episode's truth, less constant and short ones and what inputs tell, too: time
    stamps, the camera but for its height, ids of people, which count like those of tracks, and the colours of the room
    without people, as which an episode begins.
    """
    told = ("timestamps_ns", "timestamp_ns", "track_id", "sensor", "background.rgb", "recording.light")
    secrets: dict[bytes, str] = {}
    for path, value in reachable(episode.truth, "truth"):
        if not isinstance(value, np.ndarray) or value.dtype.kind not in "biuf" or any(word in path for word in told):
            continue
        if value.nbytes >= LEAST_BYTES and (value != value.flat[0]).any():
            secrets[value.tobytes()] = path
            if path.endswith("frames[].depth_m"):
                secrets[depth_to_mm(value).tobytes()] = f"{path} in mm"
    return secrets


def held(array: np.ndarray, secrets: Mapping[bytes, str]) -> list[str]:
    """The secret arrays that lie in an array, as they are."""
    content = np.ascontiguousarray(array).tobytes()
    return [path for secret, path in secrets.items() if len(secret) <= len(content) and secret in content]
