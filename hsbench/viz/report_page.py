"""A report as a page: the board's number, its curve, every table of metrics, each episode, and where it comes from."""

from __future__ import annotations

import html
from collections.abc import Mapping

import numpy as np

from hsbench.evaluation.pooled import of_each
from hsbench.evaluation.report import MetricValue, ObservationCurve, Report
from hsbench.evaluation.scorers import metrics_of
from hsbench.tasks import task
from hsbench.viz import page
from hsbench.viz.charts import Point, bar, duration, time_curve
from hsbench.viz.metric_groups import Group, groups, headline

FEW_SCENES = 10
"""The percentile interval of fewer scenes is much too narrow (``hsbench.metrics.bootstrap``)."""


def report_page(report: Report) -> str:
    """The whole page as HTML, which needs nothing from elsewhere. Raises SchemaError for an unknown task."""
    spec = task(report.task)
    lead = (
        f"{spec.title}. Data {report.dataset.name} {report.dataset.version}, split {report.split}, "
        f"track {report.method.track}."
    )
    body = [*_primary(report), *_curve(report), *_groups(report), *_all(report), *_episodes(report), *_origin(report)]
    return page.page(f"{report.method.method}: {report.task}", lead, body, script=page.SORT)


def _primary(report: Report) -> list[str]:
    primary, counts = report.primary, report.counts
    beside = report.metrics[primary.name]
    better = task(report.task).direction
    facts = [
        f"{counts.scored} episodes of {counts.scenes} scenes scored, {counts.missing} missing, "
        f"{counts.undefined} undefined.",
        f"Counts of all episodes are added first; the mean over episodes is {number(beside.mean_over_episodes)}.",
    ]
    if counts.scenes < FEW_SCENES:
        facts.append(f"An interval over {counts.scenes} scenes says little: take {FEW_SCENES} or more.")
    return [
        f'<p class="figure"><strong>{number(primary.value)}</strong> <span>{html.escape(primary.name)}, {better} is '
        f"better, 95 % interval {interval(primary.low, primary.high)}</span></p>",
        page.paragraph(" ".join(facts)),
    ]


def _curve(report: Report) -> list[str]:
    curve, name = report.curve, report.primary.name
    if curve is None:
        return []
    last = report.metrics[name]
    points = [(moment.observed_s, moment.metrics[name]) for moment in curve.moments] + [(curve.whole_s, last)]
    rows = [
        [
            duration(seconds),
            number(value.value),
            interval(value.low, value.high),
            number(value.value / last.value) if value.value is not None and last.value else "-",
            str(missing),
        ]
        for (seconds, value), missing in zip(points, _missing(curve, report), strict=True)
    ]
    area = f"{number(curve.area.value)}, 95 % interval {interval(curve.area.low, curve.area.high)}"
    known = curve_points(report)
    return [
        page.heading("Over the length of observation"),
        page.paragraph(
            f"{name} of answers given after less watching, on the same truth; the last is the number of the board. "
            f"Area over log time: {area}."
        ),
        *([time_curve(known, f"{name} over the length of observation")] if known else []),
        page.table(["watched", name, "95 % interval", "share of the last", "missing"], rows, numbers=(1, 2, 3, 4)),
    ]


def curve_points(report: Report) -> list[Point]:
    """The primary metric where it is defined, at each observation time and over the whole; none without a curve."""
    if report.curve is None:
        return []
    name = report.primary.name
    at = [(moment.observed_s, moment.metrics[name]) for moment in report.curve.moments]
    at.append((report.curve.whole_s, report.metrics[name]))
    return [(seconds, v.value, v.low, v.high) for seconds, v in at if v.value is not None]


def _missing(curve: ObservationCurve, report: Report) -> list[int]:
    return [*(sum(row.missing for row in moment.episodes) for moment in curve.moments), report.counts.missing]


def _groups(report: Report) -> list[str]:
    parts = [page.heading("By class, label, region, visibility, evidence and size")]
    for group in groups(_names(report)):
        parts += _group(group, report.metrics)
    return parts


def _group(group: Group, metrics: Mapping[str, MetricValue]) -> list[str]:
    """A table with bars; rows in which nothing is defined are counted and left out."""
    rows, undefined = [], 0
    for row, names in zip(group.rows, group.names, strict=True):
        cells = [None if name is None else metrics[name] for name in names]
        if all(cell is None or cell.value is None for cell in cells):
            undefined += 1
            continue
        shown = (f'<td class="number"{_tip(cell)}>{"" if cell is None else bar(cell.value)}</td>' for cell in cells)
        rows.append(f'<tr><th scope="row">{html.escape(row)}</th>{"".join(shown)}</tr>')
    if not rows:
        return []
    head = "".join(f'<th scope="col">{html.escape(column)}</th>' for column in ("", *group.columns))
    note = f'<p class="note">Without any value: {undefined} more.</p>' if undefined else ""
    return [
        f"<h3>{html.escape(group.title)}</h3>",
        f'<div class="scroll"><table class="bars"><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table>'
        f"</div>{note}",
    ]


def _tip(cell: MetricValue | None) -> str:
    return "" if cell is None else f' title="95 % interval {interval(cell.low, cell.high)}"'


def _names(report: Report) -> list[str]:
    """The metrics in the order of their task; a report that was read has them in that of the alphabet."""
    return [name for name in metrics_of(report.task) if name in report.metrics]


def _all(report: Report) -> list[str]:
    rows = [
        [
            name,
            number(value.value),
            interval(value.low, value.high),
            number(value.mean_over_episodes),
            str(value.undefined_episodes),
        ]
        for name, value in ((name, report.metrics[name]) for name in _names(report))
    ]
    columns = ["metric", "pooled", "95 % interval", "mean over episodes", "undefined episodes"]
    table = page.table(columns, rows, numbers=(1, 2, 3, 4))
    return [page.heading("Every metric"), page.details(f"{len(rows)} metrics with their intervals", table)]


def _episodes(report: Report) -> list[str]:
    metrics = metrics_of(report.task)
    shown = headline(_names(report), report.primary.name)
    values = np.stack([of_each(report.episodes, metrics[name]) for name in shown], axis=1)
    rows = [
        [
            row.episode_id,
            row.scene_id,
            "missing" if row.missing else "",
            *(number(None if np.isnan(value) else float(value)) for value in line),
        ]
        for row, line in zip(report.episodes, values, strict=True)
    ]
    columns = ["episode", "scene", "", *shown]
    return [
        page.heading("Every episode"),
        page.paragraph(
            "Of each alone; a click on a column sorts by it. The Parquet file beside the report has the rest."
        ),
        page.table(columns, rows, numbers=tuple(range(3, len(columns))), sortable=True),
    ]


def _origin(report: Report) -> list[str]:
    method, made = report.method, report.provenance
    facts = {
        "task": f"{report.task} {report.task_version}, protocol {report.protocol} {made.protocol_version}",
        "scored by": f"hsbench {made.hsbench}, code {made.code_sha256 or 'unknown'}",
        "data set": f"{report.dataset.name} {report.dataset.version}, manifest {report.dataset.manifest_sha256}",
        "split": f"{report.split}, {made.split_sha256}",
        "intervals": f"{made.level:.0%} percentiles of {made.replicates} samples of scenes, seed {made.seed}",
        "method": method.method,
        "track": method.track,
        "authors": ", ".join(method.authors),
        "paper": method.paper,
        "code": method.code,
        "parameters": None if method.parameters is None else f"{method.parameters:,}",
        "hardware": method.hardware,
        "seconds an episode": None if method.seconds_per_episode is None else f"{method.seconds_per_episode:g}",
        "causal": None if method.causal is None else ("yes" if method.causal else "no"),
        "training data": ", ".join(method.training_data),
    }
    rows = [[name, text] for name, text in facts.items() if text]
    return [page.heading("Where it comes from"), page.table(["", ""], rows, breaking=True)]


def number(value: float | None) -> str:
    """Three digits, a dash where undefined."""
    return "-" if value is None else f"{value:.3f}"


def interval(low: float | None, high: float | None) -> str:
    """Both ends, a dash where there is none."""
    return "-" if low is None or high is None else f"{low:.3f} to {high:.3f}"
