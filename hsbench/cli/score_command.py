"""``hsbench score``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import (
    ANY_PATH,
    data_option,
    interval,
    json_option,
    next_step,
    note_own_data,
    number,
    print_json,
)
from hsbench.errors import HsbenchError

if TYPE_CHECKING:
    from hsbench.evaluation.report import ObservationCurve, Report

TABLE, PAGE = ".parquet", ".html"
NAMED = 8
"""Episodes left out that are named; of more, the first."""


@click.command(
    epilog="Example: hsbench score pred/carve --task scene-completion --data data/rgbd --split val --out report.json",
    short_help="score a submission into a report",
)
@click.argument("submission", type=ANY_PATH)
@click.option("--task", "task_name", required=True, metavar="NAME")
@data_option
@click.option("--out", type=ANY_PATH, metavar="FILE", help="Write the report here; a table and a page beside it.")
@click.option("--allow-missing", is_flag=True, help="Score missing episodes as the task's missing answer.")
@click.option("--annotated-only", is_flag=True, help="Leave out episodes without truth for the task, and say so.")
@json_option
def command(
    submission: Path,
    task_name: str,
    data: Path,
    split: str | None,
    out: Path | None,
    allow_missing: bool,
    annotated_only: bool,
    as_json: bool,
) -> None:
    """Check SUBMISSION, then score it: pooled metrics with 95 % intervals over scenes, and every episode's counts.

    --out report.json writes report.parquet (metrics of every episode) and report.html (to look at) beside it.
    """
    from hsbench.datasets.dataset import load
    from hsbench.evaluation.episode_table import write_episode_table
    from hsbench.evaluation.report import write_report
    from hsbench.evaluation.score import score
    from hsbench.io.atomic import write_bytes
    from hsbench.tasks import task
    from hsbench.viz.report_page import report_page

    if out is not None:
        _refuse_other_file(out)
    dataset = load(data, split, frames=False)
    official = note_own_data(task(task_name), dataset.name)
    report = score(task_name, submission, dataset, allow_missing=allow_missing, annotated_only=annotated_only)
    _note_left_out(report, dataset.episode_ids)
    if out is not None:
        write_report(out, report)
        write_episode_table(out.with_suffix(TABLE), report)
        write_bytes(out.with_suffix(PAGE), report_page(report).encode())
    if as_json:
        print_json(report.to_json())
        return
    counts = report.counts
    click.echo(f"{report.method.method} (track {report.method.track}) on {report.dataset.name}, split {report.split}")
    click.echo(
        f"{counts.scored} episodes of {counts.scenes} scenes scored, "
        f"{counts.missing} missing, {counts.undefined} undefined"
    )
    for name, metric in report.metrics.items():
        mark = "  <- primary" if name == report.primary.name else ""
        click.echo(f"  {name:<34}{number(metric.value):>8}  {interval(metric.low, metric.high)}{mark}")
    if report.curve is not None:
        _echo_curve(report, report.curve)
    if out is not None:
        click.echo(f"report: {out}, with {TABLE} and {PAGE} beside it")
        if official:
            next_step("board", "add", out, "--board", "DIR", "--year", "YEAR")
        next_step("compare", out, "OTHER.json")


def _note_left_out(report: Report, episode_ids: Sequence[str]) -> None:
    """Say on the error stream which episodes have no truth and were not scored."""
    scored = {row.episode_id for row in report.episodes}
    left_out = [episode_id for episode_id in episode_ids if episode_id not in scored]
    if left_out:
        names = ", ".join(left_out[:NAMED]) + (", ..." if len(left_out) > NAMED else "")
        click.echo(
            f"note: {len(left_out)} of {len(episode_ids)} episodes have no truth for {report.task} and are left out: "
            f"{names}",
            err=True,
        )


def _echo_curve(report: Report, curve: ObservationCurve) -> None:
    click.echo(f"{report.primary.name} over the length of observation")
    points = [(moment.observed_s, moment.metrics[report.primary.name]) for moment in curve.moments]
    for observed_s, value in [*points, (curve.whole_s, report.metrics[report.primary.name])]:
        click.echo(f"  {f'{observed_s:g} s':<34}{number(value.value):>8}  {interval(value.low, value.high)}")
    area = curve.area
    click.echo(f"  {'area over log time':<34}{number(area.value):>8}  {interval(area.low, area.high)}")


def _refuse_other_file(out: Path) -> None:
    """Raise HsbenchError if ``out`` is there and no report, or what goes beside it is there without: only a report is
    overwritten.
    """
    from hsbench.evaluation.report import read_report

    if out.suffix in (TABLE, PAGE):
        raise HsbenchError(f"{out} ends in {out.suffix}; expected the name of a JSON file, such as report.json")
    if out.exists():
        try:
            read_report(out)
        except HsbenchError:
            raise HsbenchError(f"{out} is there and no report; choose another --out") from None
        return
    for beside in (out.with_suffix(TABLE), out.with_suffix(PAGE)):
        if beside.exists():
            raise HsbenchError(f"{beside} is there, and would be replaced; choose another --out")
