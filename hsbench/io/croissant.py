"""``croissant.json``: a data set described to the outside, as Croissant 1.0 (JSON-LD of MLCommons).

It names the files with their hashes, and says how the tables are read: episodes, observed poses and, with truth,
events and objects. Files are named relative to the data set's folder, so the description belongs into it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from hsbench.errors import DataError

TOLD = (("license", "licence"), ("version", "hsbench_version"))  # Croissant's word, and that of dataset.json
CONFORMS_TO = "http://mlcommons.org/croissant/1.0"
JsonObject = dict[str, Any]

CONTEXT: JsonObject = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
"""The names of the specification, https://docs.mlcommons.org/croissant/docs/croissant-spec.html."""


PARQUET = "application/x-parquet"


@dataclass(frozen=True)
class _Files:
    """Files of one kind, one or more an episode: name, pattern below the episode's folder, whether they are truth, and
    what a row is where they are tables that are read.
    """

    name: str
    pattern: str
    truth: bool
    rows: str = ""


FILES = (
    _Files("descriptors", "episode.json", False),
    _Files("poses", "inputs/poses.parquet", False, "An observed pose of a person."),
    _Files("activity-maps", "inputs/activity_maps.npz", False),
    _Files("pictures", "inputs/frames/*", False),
    _Files("recordings", "recording/patches.parquet", True),
    _Files("recorded-pixels", "recording/patches.zst", True),
    _Files("backgrounds", "recording/*.png", True),
    _Files("scenes", "truth/scene.json", True),
    _Files("scene-geometry", "truth/scene.npz", True),
    _Files("true-poses", "truth/poses.parquet", True, "A true pose of a person, and what they do."),
    _Files("events", "truth/events.parquet", True, "Who did what with which part of which object, from when to when."),
    _Files("objects", "truth/objects.parquet", True, "An object of the scene: its box, and how much of it is seen."),
    _Files("occupancy", "truth/occupancy.npz", True),
    _Files("affordance", "truth/affordance.npz", True),
)


def croissant(
    root: Path, description: JsonObject, listed: Mapping[str, str], units: Sequence[Path], truth: bool = True
) -> JsonObject:
    """The description of a data set; without truth, of its inputs alone.

    description: ``dataset.json``. listed: sha256 of the files of the whole set, by name. units: folders of episodes.
    Columns are those of the first episode that has the table. A recording counts as truth: clean depth and ids lie in
    it. Raises DataError for a table that cannot be read.
    """
    distribution = [_file_object(name, digest) for name, digest in sorted(listed.items())]
    records = [
        _record_set(Path(name).stem, "An episode.", {"fileObject": {"@id": name}}, root / name)
        for name in sorted(listed)
        if _media_type(name) == PARQUET
    ]
    for files in FILES:
        example = next((path for unit in units for path in sorted(unit.glob(files.pattern))), None)
        if example is None or (files.truth and not truth):
            continue
        folder, identifier = units[0].parent.relative_to(root).as_posix(), f"files-{files.name}"
        distribution.append(
            {
                "@type": "cr:FileSet",
                "@id": identifier,
                "encodingFormat": _media_type(files.pattern),
                "includes": f"{folder}/*/{files.pattern}",
            }
        )
        if files.rows:
            records.append(_record_set(files.name, files.rows, {"fileSet": {"@id": identifier}}, example, folder))
    told = {key: description[name] for key, name in TOLD if name in description}  # one's own data may lack them
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": CONFORMS_TO,
        "name": description["name"],
        "description": f"hsbench data set {description['name']}, schema {description['schema_version']}, "
        f"{len(units)} episodes: what watching people reveals about a room.",
        **told,
        "distribution": distribution,
        "recordSet": records,
    }


def _file_object(name: str, digest: str) -> JsonObject:
    return {
        "@type": "cr:FileObject",
        "@id": name,
        "contentUrl": name,
        "encodingFormat": _media_type(name),
        "sha256": digest,
    }


def _media_type(name: str) -> str:
    return {".json": "application/json", ".parquet": PARQUET, ".png": "image/png"}.get(
        Path(name).suffix, "application/octet-stream"
    )


def _record_set(name: str, description: str, source: JsonObject, example: Path, folder: str = "") -> JsonObject:
    """How the rows of a table are read. example: has its columns. folder: of the episodes, where each has a table."""
    fields = []
    if folder:
        path = {"extract": {"fileProperty": "fullpath"}, "transform": {"regex": f"{folder}/([^/]+)/"}}
        fields.append(_field(name, "episode_id", "sc:Text", source | path))
    for column in _schema(example):
        field = _field(name, column.name, _data_type(column.type), {**source, "extract": {"column": column.name}})
        fields.append(field | ({"repeated": True} if pa.types.is_nested(column.type) else {}))
    return {"@type": "cr:RecordSet", "@id": name, "name": name, "description": description, "field": fields}


def _schema(path: Path) -> pa.Schema:
    try:
        return pq.read_schema(path)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise DataError(f"{path} cannot be read: {str(error).splitlines()[0]}") from error


def _field(record_set: str, name: str, data_type: str, source: JsonObject) -> JsonObject:
    identifier = f"{record_set}/{name}"
    return {"@type": "cr:Field", "@id": identifier, "name": identifier, "dataType": data_type, "source": source}


def _data_type(kind: pa.DataType) -> str:
    if pa.types.is_nested(kind):
        return _data_type(kind.value_type)
    if pa.types.is_integer(kind):
        return "sc:Integer"
    return "sc:Float" if pa.types.is_floating(kind) else "sc:Text"
