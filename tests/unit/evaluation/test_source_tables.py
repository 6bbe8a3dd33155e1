"""Tables in the forms of the source: what stands where, what stays empty, and both ways to write them."""

from __future__ import annotations

import csv
import dataclasses
import io

import pytest

from hsbench.datasets.statistics import SplitCounts
from hsbench.evaluation import DatasetRef, Report
from hsbench.evaluation.scorers import metrics_of
from hsbench.evaluation.tables import OF_METHOD, REGIONS, DatasetCounts, Table, tables
from hsbench.viz.text_tables import csv_text, markdown
from tests.unit.evaluation.reports import METHOD, report
from tests.unit.evaluation.test_score_affordance import ANSWERS, PLAN, PLANS, VIEW, VIEWS
from tests.unit.evaluation.test_score_affordance import report as of_affordance

NUMBERS = ["3.1", "3.2", "3.3", "4.1", "4.2", "4.3", "4.4", "4.5", "5.3", "5.4", "5.5"]


def by_number(*reports: Report, datasets: tuple[DatasetCounts, ...] = ()) -> dict[str, Table]:
    return {table.number: table for table in tables(reports, datasets)}


def named(made: Report, method: str, dataset: str | None = None) -> Report:
    where = made.dataset if dataset is None else DatasetRef(dataset, "0", "cd" * 32)
    return dataclasses.replace(made, dataset=where, method=dataclasses.replace(made.method, method=method))


def test_without_anything_every_form_is_there_and_empty() -> None:
    made = by_number()
    assert list(made) == NUMBERS
    for number, table in made.items():
        assert len({len(row) for row in table.rows} | {len(table.columns)}) == 1
        filled = {cell for row in table.rows for cell in row} - {None}
        assert filled == (set(REGIONS) if number == "5.5" else set())


def test_real_and_generated_rooms_stand_side_by_side() -> None:
    good, bad = report(0.1), report(0.4)
    table = by_number(named(good, "carve"), named(bad, "carve", "nyu"), named(bad, "other"))["3.2"]
    ratios = ("precision", "recall", "iou")
    assert table.columns == ("method", "track", *(f"{kind} {r}" for kind in ("real", "generated") for r in ratios))
    of = [tuple(r.metrics[f"occluded/{name}"].value for name in ratios) for r in (good, bad)]
    assert table.rows == (
        ("carve", METHOD.track, *of[1], *of[0]),
        ("other", METHOD.track, None, None, None, *of[1]),
    )
    twice = by_number(named(good, "carve"), named(bad, "carve"))["3.2"]
    assert [row[5:] for row in twice.rows] == of


def test_captured_rooms_and_body_regions_have_tables_of_their_own() -> None:
    floor = of_affordance(PLAN, PLANS, ANSWERS)
    view = of_affordance(VIEW, VIEWS, ANSWERS)
    made = by_number(named(floor, "a"), named(floor, "b", "my-room"), named(view, "c"), named(view, "segnet-feet"))
    assert [made[n].rows[0][0] for n in ("4.3", "4.4", "5.4")] == ["a", "b", "c"]
    mean = made["4.3"].columns.index("mean")
    assert made["4.3"].rows[0][mean] == floor.metrics["exclusive/mean-iou"].value
    regions = {row[0]: row[1:] for row in made["5.5"].rows}
    assert tuple(regions) == REGIONS
    assert regions["feet"][0] == "segnet-feet"
    assert regions["feet"][-1] == view.metrics["exclusive/accuracy"].value
    assert set(regions["head"]) == {None}


def test_data_sets_are_counted_by_sensor() -> None:
    splits = {"val": SplitCounts(3, 2, 0.5, 100, 900, {}), "": SplitCounts(1, 1, 0.25, 0, 7, {})}
    sets = (DatasetCounts("rooms", "rgbd", splits), DatasetCounts("round", "equirectangular", splits))
    made = by_number(datasets=sets)
    assert made["3.1"].rows == (("rooms", "val", 3, 2, 0.5, 100, 900), ("rooms", None, 1, 1, 0.25, 0, 7))
    assert [row[0] for row in made["4.2"].rows] == ["round", "round"]
    assert set(made["5.3"].rows[0]) == {None}


@pytest.mark.parametrize(
    ("number", "task"),
    [("3.3", "object-detection-3d"), ("4.1", "action-recognition"), ("4.5", "scene-reconstruction-360")],
)
def test_every_column_is_a_metric_of_its_task(number: str, task: str) -> None:
    columns = by_number()[number].columns[len(OF_METHOD) :]
    known = {name.replace("/", " ") for name in metrics_of(task)}
    renamed = {"mean": "mean-iou", "solid iou": "occupancy iou"} | {
        f"solid {r}": f"occupancy {r}" for r in ("precision", "recall")
    }
    plain = [renamed.get(c, c) for c in columns]
    assert all(c in known or f"{c} iou" in known for c in plain)


def test_markdown_and_csv() -> None:
    table = Table("9.9", "A | title", ("method", "value", "count"), (("a|b\n<i>", 0.12345, 3), (None, None, None)))
    assert markdown([table]) == (
        "### 9.9 A | title\n\n| method | value | count |\n| --- | ---: | ---: |\n"
        "| a\\|b \\<i\\> | 0.123 | 3 |\n|  |  |  |\n"
    )
    assert list(csv.reader(io.StringIO(csv_text(table)))) == [
        ["method", "value", "count"],
        ["a|b\n<i>", "0.12345", "3"],
        ["", "", ""],
    ]
