"""croissant.json names the files as they are, says how each table is read, and is valid to mlcroissant."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from hsbench.errors import DataError
from hsbench.io.dataset_index import described, verify_files, write_index

OLD = Path(__file__).parents[2] / "fixtures" / "schema-0.2"
TABLES = {
    "poses": "inputs/poses.parquet",
    "true-poses": "truth/poses.parquet",
    "events": "truth/events.parquet",
    "objects": "truth/objects.parquet",
}


@pytest.fixture
def data(tmp_path: Path) -> Path:
    copy = Path(shutil.copytree(OLD, tmp_path / "data"))
    write_index(copy)
    return copy


def test_it_is_written_with_the_index_and_vouched_for(data: Path) -> None:
    text = (data / "croissant.json").read_bytes()
    assert json.loads((data / "manifest.json").read_text())["croissant.json"] == hashlib.sha256(text).hexdigest()
    assert verify_files(data) == []
    assert json.loads(text) == described(data)
    write_index(data)
    assert (data / "croissant.json").read_bytes() == text


def test_files_and_columns_are_those_on_disk(data: Path) -> None:
    found = described(data)
    described_files = set()
    for item in found["distribution"]:
        if item["@type"] == "cr:FileObject":
            assert item["sha256"] == hashlib.sha256((data / item["contentUrl"]).read_bytes()).hexdigest()
        else:
            matched = sorted(data.glob(item["includes"]))
            assert matched
            described_files |= {p.relative_to(data).as_posix() for p in matched}
    everything = {p.relative_to(data).as_posix() for p in data.glob("episodes/*/**/*") if p.is_file()}
    left = {name.split("/", 2)[2] for name in everything - described_files}
    assert left == {
        "index.json", "manifest.json", "truth/match.parquet", "truth/motions.parquet", "truth/occupancy.json"
    }  # fmt: skip
    identifiers = [item["@id"] for key in ("distribution", "recordSet") for item in found[key]]
    identifiers += [field["@id"] for record in found["recordSet"] for field in record["field"]]
    assert len(set(identifiers)) == len(identifiers)
    columns = {r["@id"]: [f["@id"].partition("/")[2] for f in r["field"]] for r in found["recordSet"]}
    assert columns.pop("episodes") == pq.read_schema(data / "episodes.parquet").names
    for name, path in TABLES.items():
        assert columns.pop(name) == ["episode_id", *pq.read_schema(data / "episodes" / "film-1" / path).names]
    assert columns == {}


def test_inputs_alone_name_no_truth(data: Path) -> None:
    inputs = described(data, truth=False)
    assert [r["@id"] for r in inputs["recordSet"]] == ["episodes", "poses"]
    includes = [item["includes"] for item in inputs["distribution"] if "includes" in item]
    assert not [pattern for pattern in includes if "truth" in pattern or "recording" in pattern]
    assert len(includes) == 4


def test_a_damaged_table_is_named(data: Path) -> None:
    path = next(p for p in sorted(data.glob(f"episodes/*/{TABLES['events']}")))
    path.write_bytes(b"PAR1")
    with pytest.raises(DataError, match=r"events\.parquet cannot be read") as error:
        described(data)
    assert "\n" not in str(error.value)


@pytest.mark.filterwarnings("ignore")
def test_mlcroissant_finds_no_fault_and_reads_every_table(data: Path) -> None:
    """Of a data set whose episodes have the same columns, as those of one recipe and one importer do."""
    mlcroissant = pytest.importorskip("mlcroissant", reason="mlcroissant is not installed")
    shutil.rmtree(data / "episodes" / "s-1")
    write_index(data)
    theirs = mlcroissant.Dataset(str(data / "croissant.json"))
    assert not theirs.metadata.ctx.issues.errors
    rows = list(theirs.records("episodes"))
    index = pd.read_parquet(data / "episodes.parquet")
    assert [r["episodes/episode_id"].decode() for r in rows] == list(index["episode_id"])
    for name, path in TABLES.items():
        tables = {p.parents[1].name: pd.read_parquet(p) for p in sorted(data.glob(f"episodes/*/{path}"))}
        rows = list(theirs.records(name))
        assert len(rows) == sum(map(len, tables.values())) > 0
        for episode_id, table in tables.items():
            own = [r for r in rows if r[f"{name}/episode_id"].decode() == episode_id]
            assert len(own) == len(table)
            for column in table:
                for row, expected in zip(own, table[column], strict=True):
                    value = row[f"{name}/{column}"]
                    np.testing.assert_array_equal(value.decode() if isinstance(value, bytes) else value, expected)
