"""The page of a report: all of it is there, nothing is from elsewhere, no text can become markup, and it sorts."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

from hsbench.evaluation.report import Report
from hsbench.evaluation.scorers import SCORERS
from hsbench.viz import page
from hsbench.viz.charts import bar, duration, time_curve
from hsbench.viz.metric_groups import groups, headline
from hsbench.viz.report_page import report_page
from tests.unit.evaluation.reports import METHOD, report
from tests.unit.evaluation.test_observation import made

VOID = {"meta", "img", "br", "line", "circle", "polyline", "polygon", "rect", "path"}
HOSTILE = "</script><img src=x onerror=alert(1)>&\"'"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


class Reader(HTMLParser):
    """Reads a page, and fails where an element is not closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "script"):
            self.text.append(data)


def cells(text: str) -> list[str]:
    return Reader(text).text


def with_method(made: Report, **changes: object) -> Report:
    return dataclasses.replace(made, method=dataclasses.replace(METHOD, **changes))


def test_everything_of_the_report_is_on_the_page() -> None:
    whole = made()
    shown = cells(report_page(whole))
    assert f"{whole.primary.value:.3f}" in shown
    for name in whole.metrics:
        assert name in shown
    for row in whole.episodes:
        assert row.episode_id in shown
    assert {"5 s", "30 s", "1 min"} <= set(shown)
    assert f"{whole.curve.moments[0].metrics['occluded/iou'].value:.3f}" in shown
    text = " ".join(shown)
    assert f"Area over log time: {whole.curve.area.value:.3f}" in text
    made_by = whole.provenance
    for fact in (whole.dataset.manifest_sha256, made_by.split_sha256, made_by.code_sha256, "seed 0", "50 samples"):
        assert fact in text
    assert "Over the length of observation" not in report_page(report(0.3))
    read = Report.from_json(json.loads(json.dumps(whole.to_json(), sort_keys=True)))
    assert report_page(read) == report_page(whole)


def test_nothing_is_loaded_from_elsewhere_and_both_schemes_are_served() -> None:
    text = report_page(made())
    for tag, attributes in Reader(text).tags:
        assert tag not in ("link", "iframe", "object", "base"), tag
        assert not {"src", "href", "xlink:href"} & attributes.keys() or attributes.get("src", "").startswith("data:")
        assert not any(name.startswith("on") for name in attributes)
    assert not re.search(r"url\(|@import|//[a-z]", text)
    assert "color-scheme: light dark" in text


def test_no_text_becomes_markup() -> None:
    hostile = with_method(made(), method=HOSTILE, authors=(HOSTILE,), paper=HOSTILE, training_data=(HOSTILE,))
    rows = tuple(dataclasses.replace(row, scene_id=f"{HOSTILE}{row.scene_id}") for row in report(0.3).episodes)
    page_text = report_page(hostile)
    assert page_text.count("<script>") == page_text.count("</script>") == 1
    assert not any(tag == "img" for tag, _ in Reader(page_text).tags)
    assert Reader(page_text).text.count(HOSTILE) >= 4
    assert HOSTILE in " ".join(cells(page.table(["scene"], [[row.scene_id] for row in rows], sortable=True)))
    assert Reader(time_curve([(5.0, 0.1, None, None), (9.0, 0.2, None, None)], HOSTILE)).tags


@pytest.mark.parametrize("name", SCORERS)
def test_every_grouped_metric_is_in_one_table_once(name: str) -> None:
    names = list(SCORERS[name].metrics)
    found = [cell for group in groups(names) for row in group.names for cell in row if cell is not None]
    assert len(found) == len(set(found))
    assert set(found) <= set(names)
    assert len(found) >= 0.6 * len(names)
    titles = [group.title for group in groups(names)]
    assert len(titles) == len(set(titles))


def test_tables_by_hand() -> None:
    names = ["ap-25", "recall/partial/used", "recall/partial/neither", "recall/size/small", "ap-25/bed", "ap-50/bed"]
    evidence, size, classes = groups(names)
    assert (evidence.rows, evidence.columns) == (("partial",), ("used", "neither"))
    assert size.names == (("recall/size/small",),)
    assert (classes.rows, classes.columns) == (("bed",), ("ap-25", "ap-50"))
    (holes,) = groups(["chair/iou", "wall/recall"])
    assert holes.names == (("chair/iou", None), (None, "wall/recall"))
    assert headline(["mean-iou", "walkable/iou", "walkable/recall", "exclusive/mean-iou"], "mean-iou") == [
        "mean-iou",
        "walkable/iou",
    ]
    assert headline(["occluded/iou", "occluded/recall", "known/iou"], "occluded/iou") == [
        "occluded/iou",
        "occluded/recall",
    ]


def test_charts_by_hand() -> None:
    tags = Reader(time_curve([(10.0, 0.0, None, None), (100.0, 0.5, 0.25, 1.0), (1000.0, 1.0, None, None)], "x")).tags
    dots = [(float(a["cx"]), float(a["cy"])) for tag, a in tags if tag == "circle"]
    (x0, y0), (x1, y1), (x2, y2) = dots
    assert x1 - x0 == pytest.approx(x2 - x1)  # equal factors of time are equally wide
    assert y0 - y1 == pytest.approx(y1 - y2)
    assert "width: 25.0%" in bar(0.25)
    assert bar(None) == '<span class="none">-</span>'
    said = [duration(s) for s in (5.0, 60.0, 90.0, 120.0, 900.0, 3600.0, 43200.0)]
    assert said == ["5 s", "1 min", "90 s", "2 min", "15 min", "1 h", "12 h"]


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
@pytest.mark.slow
def test_a_click_sorts_by_number_with_the_undefined_last(tmp_path: Path) -> None:
    table = page.table(
        ["id", "value"], [["a", "0.45"], ["b", "-"], ["c", "0.123"], ["d", "1.000"]], (1,), sortable=True
    )
    press = "document.querySelectorAll('th button')[1].click();"
    for clicks, expected in ((1, "dacb"), (2, "cadb")):
        file = tmp_path / f"{clicks}.html"
        file.write_text(page.page("t", "l", [table], script=page.SORT + press * clicks))
        command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", file.as_uri()]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
        assert "".join(re.findall(r"<tr><td>(\w)</td>", done.stdout)) == expected
