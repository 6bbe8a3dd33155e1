"""Reports and data sets in the forms of the tables of S. Fowler, "Visual Analysis of Human Activity", PhD thesis, 2019.

The numbers of tables are its own: 3.1, 4.2 and 5.3 data sets, 3.2 completion, 3.3 detection, 4.1 action, 4.3 and 4.4
affordance from above, 4.5 reconstruction, 5.4 and 5.5 affordance in views. Only the forms are taken over: every value
is of a report or a data set at hand, and a cell without is empty.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hsbench.datasets.statistics import SplitCounts
from hsbench.evaluation.report import Report
from hsbench.tasks import task

Cell = str | int | float | None
"""Text, a count, a share of 0..1, or None where there is no data."""

OF_METHOD = ("method", "track", "data", "split")
LABELS = ("walkable", "sittable", "interactable")
REGIONS = ("visual", "head", "torso", "arms", "thighs", "feet", "all")
"""Body regions of table 5.5, as the last word of a method's name: ``segnet-head``; visual: no activity at all."""

SENSORS = {"3.1": ("rgbd",), "4.2": ("equirectangular",), "5.3": ("monocular",)}
COUNTS = ("episodes", "scenes", "hours", "frames", "poses")


@dataclass(frozen=True)
class Table:
    """One table; every row has a cell for each column."""

    number: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class DatasetCounts:
    """A data set by name, the kind of its sensor, and what its splits hold."""

    name: str
    sensor: str
    splits: Mapping[str, SplitCounts]


def tables(reports: Sequence[Report], datasets: Sequence[DatasetCounts] = ()) -> list[Table]:
    """All tables, in the order of their numbers; of reports of equal standing in the order given."""
    own = {name: [report for report in reports if report.task == name] for name in {r.task for r in reports}}
    views = own.get("affordance-view", [])
    floors = own.get("affordance-topdown", [])
    exclusive = {label: f"exclusive/{label}/iou" for label in LABELS} | {
        "mean": "exclusive/mean-iou",
        "accuracy": "exclusive/accuracy",
    }
    volumes = {label: f"{label}/iou" for label in (*LABELS, "wall")} | {"mean": "mean-iou"}
    solid = {f"solid {ratio}": f"occupancy/{ratio}" for ratio in ("precision", "recall", "iou")}
    found = [
        *(_data_sets(number, kinds, datasets) for number, kinds in SENSORS.items()),
        _completion(own.get("scene-completion", [])),
        _scores(
            "3.3",
            "3D object detection",
            own.get("object-detection-3d", []),
            _same("ap-25", "ap-50", "map-25", "map-50", "precision", "recall", "f1"),
        ),
        _scores(
            "4.1",
            "Action recognition",
            own.get("action-recognition", []),
            _same(
                "accuracy",
                "macro-f1",
                *(f"{a}/{r}" for a in ("stand", "sit", "interact") for r in ("precision", "recall")),
            ),
        ),
        _scores("4.3", "Affordance from above, generated rooms", [r for r in floors if _generated(r)], exclusive),
        _scores("4.4", "Affordance from above, captured rooms", [r for r in floors if not _generated(r)], exclusive),
        _scores("4.5", "Scene reconstruction", own.get("scene-reconstruction-360", []), volumes | solid),
        _scores("5.4", "Affordance in views", [r for r in views if _region(r) is None], exclusive),
        _body_regions([r for r in views if _region(r) is not None], exclusive),
    ]
    return sorted(found, key=lambda table: table.number)


def _data_sets(number: str, kinds: Sequence[str], datasets: Sequence[DatasetCounts]) -> Table:
    rows = [
        (data.name, split or None, *(getattr(counts, name) for name in COUNTS))
        for data in datasets
        if data.sensor in kinds
        for split, counts in data.splits.items()
    ]
    return _table(number, f"Data sets, {' and '.join(kinds)}", ("data", "split", *COUNTS), rows)


def _completion(reports: Sequence[Report]) -> Table:
    """Real and generated rooms side by side: one row a method and track, and as many as it has reports of one kind."""
    ratios = ("precision", "recall", "iou")
    rows: dict[tuple[str, str], list[dict[bool, Report]]] = {}
    for report in reports:
        lines = rows.setdefault((report.method.method, report.method.track), [])
        line = next((line for line in lines if _generated(report) not in line), None)
        if line is None:
            lines.append({_generated(report): report})
        else:
            line[_generated(report)] = report
    cells = [
        (*key, *(_value(line.get(generated), f"occluded/{ratio}") for generated in (False, True) for ratio in ratios))
        for key, lines in rows.items()
        for line in lines
    ]
    columns = [f"{kind} {ratio}" for kind in ("real", "generated") for ratio in ratios]
    return _table(
        "3.2", "Completion of hidden space, annotated real and generated rooms", ("method", "track", *columns), cells
    )


def _scores(number: str, title: str, reports: Sequence[Report], metrics: Mapping[str, str]) -> Table:
    """One row a report. metrics: by the column they stand in."""
    rows = [
        (
            report.method.method,
            report.method.track,
            f"{report.dataset.name} {report.dataset.version}",
            report.split,
            *(_value(report, name) for name in metrics.values()),
        )
        for report in reports
    ]
    return _table(number, title, (*OF_METHOD, *metrics), rows)


def _body_regions(reports: Sequence[Report], metrics: Mapping[str, str]) -> Table:
    """Every region has a row, whether there is a report of it or not."""
    rows: list[tuple[Cell, ...]] = []
    for region in REGIONS:
        own: list[Report | None] = [report for report in reports if _region(report) == region]
        for report in own or [None]:
            name = None if report is None else report.method.method
            rows.append((region, name, *(_value(report, metric) for metric in metrics.values())))
    return _table("5.5", "Affordance in views by body region", ("region", "method", *metrics), rows)


def _table(number: str, title: str, columns: tuple[str, ...], rows: Sequence[tuple[Cell, ...]]) -> Table:
    return Table(number, title, columns, tuple(rows) or ((None,) * len(columns),))


def _same(*names: str) -> dict[str, str]:
    return {name.replace("/", " "): name for name in names}


def _value(report: Report | None, name: str) -> float | None:
    return None if report is None or name not in report.metrics else report.metrics[name].value


def _generated(report: Report) -> bool:
    """Whether it is of a data set that a recipe makes; others are real, or somebody's own."""
    return report.dataset.name in task(report.task).datasets


def _region(report: Report) -> str | None:
    last = report.method.method.rpartition("-")[2]
    return last if last in REGIONS else None
