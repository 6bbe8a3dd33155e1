"""Types of columns as Hugging Face ``datasets`` names them, and the same as Arrow."""

from __future__ import annotations

import json
from collections.abc import Mapping
from enum import IntEnum
from typing import Any

import numpy as np
import pyarrow as pa

from hsbench.schema.categories import CATEGORIES
from hsbench.typing import AnyArray

Feature = Mapping[str, Any]


def value(dtype: str) -> Feature:
    """A number or text, by its Arrow name."""
    return {"_type": "Value", "dtype": dtype}


def sequence(feature: Feature, length: int = -1) -> Feature:
    """A list, of one length if that is given. Called Sequence, which all versions of ``datasets`` read."""
    return {"_type": "Sequence", "feature": feature, "length": length}


def class_label(names: type[IntEnum]) -> Feature:
    """An enumeration from 0 on, by its names in small letters."""
    return {"_type": "ClassLabel", "names": [member.name.lower() for member in sorted(names)]}


TEXT, INTEGER, FLOAT = value("string"), value("int64"), value("float32")
IMAGE: Feature = {"_type": "Image"}
CLASSES: Feature = {"_type": "ClassLabel", "names": ["nothing", *(c.name for c in CATEGORIES)]}
"""Category ids: their numbers are those of the category table."""


def arrow_type(feature: Feature) -> pa.DataType:
    """How a feature lies in Parquet."""
    kind = feature["_type"]
    if kind == "Value":
        return pa.type_for_alias(feature["dtype"])
    if kind == "Sequence":
        return pa.list_(arrow_type(feature["feature"]), feature["length"])
    return pa.int64() if kind == "ClassLabel" else pa.struct([("bytes", pa.binary()), ("path", pa.string())])


def schema_of(columns: Mapping[str, Feature]) -> pa.Schema:
    """The Arrow schema of columns; its metadata tells ``datasets`` their features."""
    metadata = {"huggingface": json.dumps({"info": {"features": dict(columns)}})}
    return pa.schema([(name, arrow_type(feature)) for name, feature in columns.items()], metadata=metadata)


def nested(values: AnyArray) -> pa.Array:
    """(N, J) or (N, J, W) numbers as N lists of J numbers, or of J lists of exactly W."""
    items = pa.array(np.ascontiguousarray(values).reshape(-1))
    if values.ndim == 3:
        items = pa.FixedSizeListArray.from_arrays(items, values.shape[2])
    offsets = np.arange(len(values) + 1, dtype=np.int32) * values.shape[1]
    return pa.ListArray.from_arrays(pa.array(offsets), items)
