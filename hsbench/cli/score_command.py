"""``hsbench score``."""

from __future__ import annotations

from pathlib import Path

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


@click.command(
    epilog="Example: hsbench score pred/carve --task scene-completion --data data/rgbd --split val --out report.json",
    short_help="score a submission into a report",
)
@click.argument("submission", type=ANY_PATH)
@click.option("--task", "task_name", required=True, metavar="NAME")
@data_option
@click.option("--out", type=ANY_PATH, metavar="FILE", help="Write the report (JSON) here.")
@click.option("--allow-missing", is_flag=True, help="Score missing episodes as the task's missing answer.")
@json_option
def command(
    submission: Path,
    task_name: str,
    data: Path,
    split: str | None,
    out: Path | None,
    allow_missing: bool,
    as_json: bool,
) -> None:
    """Check SUBMISSION, then score it: pooled metrics with 95 % intervals over scenes, and every episode's counts."""
    from hsbench.datasets.dataset import load
    from hsbench.evaluation.report import write_report
    from hsbench.evaluation.score import score
    from hsbench.tasks import task

    if out is not None:
        _refuse_other_file(out)
    dataset = load(data, split, frames=False)
    official = note_own_data(task(task_name), dataset.name)
    report = score(task_name, submission, dataset, allow_missing=allow_missing)
    if out is not None:
        write_report(out, report)
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
    if out is not None:
        click.echo(f"report: {out}")
        if official:
            next_step("board", "add", out, "--board", "DIR", "--year", "YEAR")
        next_step("compare", out, "OTHER.json")


def _refuse_other_file(out: Path) -> None:
    """Raise HsbenchError if ``out`` is there and no report: only a report is overwritten."""
    from hsbench.evaluation.report import read_report

    if out.exists():
        try:
            read_report(out)
        except HsbenchError:
            raise HsbenchError(f"{out} is there and no report; choose another --out") from None
