"""The page of a board: curves of the entries that have one, in colours that the legend names; the style of reports."""

from __future__ import annotations

import dataclasses
import re

import pytest

from hsbench.leaderboard import COLUMNS, Entry, rank
from hsbench.viz import page
from hsbench.viz.board_page import board_page
from hsbench.viz.charts import COLOURS, time_curves
from tests.unit.evaluation.reports import SPEC, report
from tests.unit.evaluation.test_observation import made
from tests.unit.viz.test_report_page import Reader, cells


def entry(name: str, watched: bool) -> Entry:
    whole = made() if watched else report(0.1, replicates=50)
    method = dataclasses.replace(whole.method, paper="https://example.org/" + name)
    return Entry(name, 2026, ("A. Author",), "self-reported", dataclasses.replace(whole, method=method))


def shown(*entries: Entry) -> str:
    return board_page(rank(entries), SPEC, COLUMNS)


def test_a_curve_is_drawn_for_each_entry_that_has_one() -> None:
    text = shown(entry("late", False), entry("a", True), entry("b", True))
    tags = Reader(text).tags
    assert [attributes["stroke"] for tag, attributes in tags if tag == "polyline"] == list(COLOURS[:2])
    swatches = [a["style"] for _, a in tags if a.get("class") == "swatch"]
    assert swatches == [f"background: {colour}" for colour in COLOURS[:2]]
    area = made().curve.area
    said = f"{100 * area.value:.2f} over log time ({100 * area.low:.2f} .. {100 * area.high:.2f})"
    assert [line for line in cells(text) if "over log time" in line] == [f"a, {said}", f"b, {said}"]
    assert "polyline" not in shown(entry("late", False))
    assert {"5 s", "30 s", "1 min", "late", "a", "b"} <= set(cells(text))


def test_the_best_are_drawn_and_the_others_counted() -> None:
    text = shown(*(entry(f"method-{k}", True) for k in range(len(COLOURS) + 2)))
    assert text.count("<polyline") == len(COLOURS)
    assert f"Drawn are the best {len(COLOURS)}; 2 more have a curve." in text
    assert "Drawn are" not in shown(entry("one", True))


def test_the_style_is_that_of_reports_and_nothing_is_loaded() -> None:
    text = shown(entry("a", True))
    assert page.STYLE in text
    links = [attributes for tag, attributes in Reader(text).tags if tag == "a"]
    assert links == [{"href": "https://example.org/a", "rel": "nofollow noopener"}]
    assert not re.search(r"(src=|url\(|@import|<link|<script)", text)


@pytest.mark.parametrize("address", ["javascript:alert(1)", "//x.org/", "ftp://x.org", "http://[", "x"])
def test_only_addresses_of_the_web_are_links(address: str) -> None:
    assert page.table(["a"], [[page.Link("<b>", address)]]).count("&lt;b&gt;") == 1
    assert "href" not in page.table(["a"], [[page.Link("<b>", address)]])


def test_labels_of_near_times_do_not_overlap() -> None:
    near = [(5.0, 0.1, None, None), (60.0, 0.2, None, None), (61.0, 0.3, None, None)]
    text = time_curves([near, near[:1]], "x")
    assert [word for word in cells(text) if word.endswith(("s", "min"))] == ["5 s", "1 min"]
    assert text.count("<circle") == 4
