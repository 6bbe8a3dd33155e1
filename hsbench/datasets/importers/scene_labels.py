"""Label tables: which node of a 3D file is what. CSV, TSV or JSON.

One row a node: ``node`` (its name), ``category``, and perhaps ``part`` (a material of the node, where one node holds
several things), ``object`` (nodes with the same object are one), ``role`` and ``movable`` (true or false). A category
``ignore`` leaves a node out; an empty one makes it a part of the object around it, with its role. In JSON the rows are
objects under ``labels``; beside them there may be ``rooms`` ([{"room_type", "outline_xy"}], metres, in the frame of the
scene) and ``height_m``.

A node is matched by its exact name, else without Blender's suffix (``Chair.001`` by ``Chair``). A node's own extras
``category``, ``role`` and ``movable`` stand where the table says nothing.
"""

from __future__ import annotations

import csv
import difflib
import io
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.errors import DataError
from hsbench.io.reading import read_limited
from hsbench.io.strict_json import parse_json
from hsbench.schema.categories import CATEGORIES, ROLES
from hsbench.schema.scene import Room

IGNORE = "ignore"
COLUMNS = ("node", "part", "category", "object", "role", "movable")
MAX_TABLE_BYTES = 4 << 20
SHOWN, MAX_LETTERS = 12, 200  # of names and of columns in one message
BLENDER_SUFFIX = re.compile(r"\.\d{3,}$")
TRUTH = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
NAMES = tuple(category.name for category in CATEGORIES)


@dataclass(frozen=True)
class Label:
    """What is said of a node or of one of its materials; None where nothing is."""

    category: str | None = None
    object: str | None = None
    role: str | None = None
    movable: bool | None = None


@dataclass(frozen=True, eq=False)
class LabelTable:
    """Labels by (node, part), part "" for the whole node; rooms and height where the table gives them."""

    labels: Mapping[tuple[str, str], Label]
    rooms: tuple[Room, ...] = ()
    height_m: float | None = None

    def find(self, node: str, part: str = "") -> tuple[tuple[str, str], Label] | None:
        """The key and the label of a node or its part, None where the table says nothing."""
        plain_node, plain_part = BLENDER_SUFFIX.sub("", node), BLENDER_SUFFIX.sub("", part)
        for key in ((node, part), (plain_node, part), (node, plain_part), (plain_node, plain_part)):
            if key in self.labels:
                return key, self.labels[key]
        return None


def read_labels(path: Path) -> LabelTable:
    """A table from a file that ends in .csv, .tsv or .json. Raises DataError, naming the row."""
    data = read_limited(path, MAX_TABLE_BYTES)
    if path.suffix.lower() == ".json":
        try:
            return _from_json(parse_json(data), str(path))
        except DataError as error:
            raise DataError(str(error) if str(error).startswith(str(path)) else f"{path}: {error}") from error
    if path.suffix.lower() not in (".csv", ".tsv"):
        raise DataError(f"{path}: expected a label table that ends in .csv, .tsv or .json")
    try:
        text = data.decode("utf-8-sig")
        delimiter = "," if path.suffix.lower() == ".csv" else "\t"
        table = csv.DictReader(io.StringIO(text), delimiter=delimiter, strict=True)
        columns, rows = table.fieldnames or (), list(table)
    except (UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{path}: no valid table ({error})") from error
    if "node" not in columns:
        raise DataError(f"{path}: no column node in its first line; expected node, category and what else there is")
    return LabelTable(_labels(rows, str(path), first=2))


def label_of_extras(extras: Mapping[str, Any], at: str) -> Label:
    """What the author of a file put on a node: ``category``, ``role``, ``movable``."""
    known = {key: extras[key] for key in ("category", "role", "movable") if extras.get(key) is not None}
    return _label(known, f"{at} extras")


def nearest_names(text: str, names: Iterable[str], count: int = 3) -> list[str]:
    """The names most like a text, best first; those that it holds or that hold it come before others."""
    plain = re.sub(r"[^a-z]+", "_", BLENDER_SUFFIX.sub("", text).lower()).strip("_")
    options = {name.lower(): name for name in names}
    held = sorted((name for name in options if name in plain or (plain and plain in name)), key=len, reverse=True)
    alike = difflib.get_close_matches(plain, options, n=count, cutoff=0.6)
    return [options[name] for name in dict.fromkeys([*held, *alike])][:count]


def _from_json(document: Any, at: str) -> LabelTable:
    if not isinstance(document, dict) or set(document) - {"labels", "rooms", "height_m"}:
        raise DataError(f'{at}: expected {{"labels": [...]}}, perhaps with "rooms" and "height_m"')
    rows = document.get("labels", [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise DataError(f"{at}: labels is no list of objects; expected one object a node")
    rooms = []
    for k, entry in enumerate(document.get("rooms", [])):
        try:
            rooms.append(Room(str(entry["room_type"]), np.array(entry["outline_xy"], dtype=np.float64)))
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(f"{at}: rooms[{k}]: {error}; expected room_type and outline_xy [[x, y], ...]") from error
    height = document.get("height_m")
    if height is not None and (isinstance(height, bool) or not isinstance(height, int | float)):
        raise DataError(f"{at}: height_m is {height!r}; expected metres")
    return LabelTable(_labels(rows, at, first=0), tuple(rooms), None if height is None else float(height))


def _labels(rows: list[dict[str, Any]], at: str, first: int) -> dict[tuple[str, str], Label]:
    labels: dict[tuple[str, str], Label] = {}
    for k, row in enumerate(rows, start=first):
        where = f"{at} row {k}"
        entry = {key: value for key, value in row.items() if value not in (None, "")}
        unknown = [key for key in row if key not in COLUMNS]
        if unknown or not isinstance(entry.get("node"), str):
            found = str(list(row))[:MAX_LETTERS]
            raise DataError(f"{where}: columns {found}; expected node, category and perhaps {', '.join(COLUMNS[1:])}")
        key = (entry.pop("node"), str(entry.pop("part", "")))
        if key in labels:
            raise DataError(f"{where}: node {key[0]!r}{f' part {key[1]!r}' if key[1] else ''} is labelled twice")
        labels[key] = _label(entry, f"{where} ({key[0]!r})")
    return labels


def _label(entry: Mapping[str, Any], at: str) -> Label:
    category, role = entry.get("category"), entry.get("role")
    if category is not None and category != IGNORE and category not in NAMES:
        like = nearest_names(str(category), NAMES)
        hint = f"nearest: {', '.join(like)}" if like else f"known: {', '.join(NAMES[:SHOWN])} ..."
        raise DataError(f"{at}: category {category!r} is unknown; {hint} (or {IGNORE})")
    if role is not None and role not in ROLES:
        raise DataError(f"{at}: role {role!r} is unknown; expected one of {', '.join(sorted(ROLES))}")
    movable = entry.get("movable")
    if movable is not None and not isinstance(movable, bool):
        if str(movable).lower() not in TRUTH:
            raise DataError(f"{at}: movable is {movable!r}; expected true or false")
        movable = TRUTH[str(movable).lower()]
    name = entry.get("object")
    return Label(category, None if name is None else str(name), role, movable)
