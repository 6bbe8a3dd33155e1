"""Entries on disk, ranks the intervals support, and pages without surprises."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import pytest

from hsbench.errors import DataError, SchemaError
from hsbench.evaluation.report import MetricValue, Primary, Report
from hsbench.leaderboard import COLUMNS, Entry, markdown, rank, read_entries, read_entry, write_entry
from hsbench.leaderboard.ranking import Table
from hsbench.viz.board_page import board_page
from tests.unit.evaluation.reports import METHOD, SPEC, report

REPORT = report(0.2)


def entry(name: str, made: Report = REPORT, **changes: object) -> Entry:
    given = {"name": name, "year": 2025, "authors": ("A. Author",), "status": "self-reported", "report": made}
    return Entry(**given | changes)


def claim(name: str, value: float | None, low: float | None, high: float | None, track: str = "poses") -> Entry:
    """An entry of an older task version, whose numbers are taken as they are."""
    metrics = {"occluded/iou": MetricValue(value, low, high, value, 0, 0)}
    method = dataclasses.replace(METHOD, task_version="old", track=track)
    made = dataclasses.replace(
        REPORT, task_version="old", method=method, metrics=metrics, primary=Primary("occluded/iou", value, low, high)
    )
    return entry(name, made)


def ranks(table: Table) -> list[tuple[str, int | None]]:
    return [(row.entry.name, row.rank) for row in table.rows]


def test_round_trip(tmp_path: Path) -> None:
    path = write_entry(tmp_path, entry("guess"))
    assert path == tmp_path / "scene-completion" / "0" / "guess.json"
    assert read_entry(path) == entry("guess")
    write_entry(tmp_path, entry("another"))
    assert [e.name for e in read_entries(tmp_path, "scene-completion", "0")] == ["another", "guess"]
    assert read_entries(tmp_path, "scene-completion", "9") == []


def test_names_are_safe_and_taken_once(tmp_path: Path) -> None:
    for name in ("../x", "", "a/b", ".x", "a b", "x" * 101):
        with pytest.raises(SchemaError, match=r"entry\.name"):
            entry(name)
    write_entry(tmp_path, entry("guess"))
    with pytest.raises(DataError, match="exists already"):
        write_entry(tmp_path, entry("Guess"))
    write_entry(tmp_path, entry("guess", year=2026), replace=True)
    assert read_entries(tmp_path, "scene-completion", "0")[0].year == 2026


def test_edited_numbers_are_refused(tmp_path: Path) -> None:
    path = write_entry(tmp_path, entry("guess"))
    value = json.loads(path.read_text())
    for item in (value["report"]["primary"], value["report"]["metrics"]["occluded/iou"]):
        item["value"] = 0.99
    path.write_text(json.dumps(value))
    with pytest.raises(DataError, match=r"value is 0\.99; its episodes give"):
        read_entry(path)


@pytest.mark.parametrize(
    ("key", "wrong", "words"),
    [
        ("status", "checked", "expected one of 'self-reported', 'verified'"),
        ("year", 25, "expected a year"),
        ("name", "other", "expected the file's name"),
        ("format", "hsbench-report/0", "entry.format"),
        ("rank", 1, "unknown 'rank'"),
    ],
)
def test_faults_of_an_entry_file(tmp_path: Path, key: str, wrong: object, words: str) -> None:
    path = write_entry(tmp_path, entry("guess"))
    value = json.loads(path.read_text())
    value[key] = wrong
    path.write_text(json.dumps(value))
    with pytest.raises(DataError) as error:
        read_entry(path)
    assert words in str(error.value)


def test_tracks_are_the_tasks(tmp_path: Path) -> None:
    with pytest.raises(SchemaError, match="track is 'magic'"):
        entry("x", report(0.2, method=dataclasses.replace(METHOD, track="magic")))


def test_old_versions_stay_readable_and_are_not_written(tmp_path: Path) -> None:
    old = claim("old", 0.5, 0.4, 0.6)
    folder = tmp_path / "scene-completion" / "old"
    folder.mkdir(parents=True)
    (folder / "old.json").write_text(json.dumps(old.to_json()))
    assert read_entries(tmp_path, "scene-completion", "old") == [old]
    with pytest.raises(SchemaError, match="is of version 'old'; expected '0'"):
        write_entry(tmp_path, old)


def test_overlapping_intervals_share_a_rank() -> None:
    (table,) = rank(
        [
            claim("d", 0.30, 0.25, 0.35),
            claim("a", 0.60, 0.55, 0.65),
            claim("c", 0.50, 0.45, 0.54),
            claim("b", 0.57, 0.50, 0.64),
            claim("none", None, None, None),
            claim("point", 0.30, None, None),
        ]
    )
    # c overlaps b but not a; d and the point are below a, b and c
    assert ranks(table) == [("a", 1), ("b", 1), ("c", 2), ("d", 4), ("point", 4), ("none", None)]


def test_tracks_are_ranked_apart() -> None:
    tables = rank([claim("a", 0.6, 0.5, 0.7), claim("b", 0.1, 0.0, 0.2, track="frames")])
    assert [(t.track, ranks(t)) for t in tables] == [("frames", [("b", 1)]), ("poses", [("a", 1)])]


def test_pages_escape_everything_and_need_no_network() -> None:
    nasty = "<script>alert(1)</script> | [x](javascript:1)"
    for link, shown in (("javascript:alert(1)", False), ('https://example.org/a?b=1&c="2', True)):
        method = dataclasses.replace(METHOD, paper=link)
        tables = rank([entry("guess", report(0.2, method=method), authors=(nasty,))])
        page = board_page(tables, dataclasses.replace(SPEC, title="Board <1>"), COLUMNS)
        assert "<script" not in page
        assert "&lt;script&gt;" in page
        assert "Board &lt;1&gt;" in page
        assert ("<a href=" in page) is shown
        assert 'href="javascript' not in page
        assert "color-scheme: light dark" in page
        assert not re.search(r"(src=|url\(|@import|<link)", page)
        (row,) = [line for line in markdown(tables).splitlines() if "guess" in line]
        assert len(re.findall(r"(?<!\\)\|", row)) == 9
        assert "<script" not in markdown(tables).replace("\\<", "")


def test_an_empty_board_says_so() -> None:
    assert markdown([]) == "No entries yet.\n"
    assert "No entries yet" in board_page([], SPEC, COLUMNS)
