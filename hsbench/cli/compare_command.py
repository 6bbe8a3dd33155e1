"""``hsbench compare``."""

from __future__ import annotations

from pathlib import Path

import click

from hsbench.cli.common import ANY_PATH, interval, json_option, number, print_json

FEW_SCENES = 10  # the percentile interval of fewer is much too narrow


@click.command(
    epilog="Example: hsbench compare carve.json all-solid.json",
    short_help="is the difference between two reports real?",
)
@click.argument("report_a", type=ANY_PATH)
@click.argument("report_b", type=ANY_PATH)
@json_option
def command(report_a: Path, report_b: Path, as_json: bool) -> None:
    """REPORT_A less REPORT_B, paired over scenes, with 95 % bootstrap intervals."""
    from hsbench.evaluation.compare import compare
    from hsbench.evaluation.report import read_report
    from hsbench.io.plain import to_plain

    result = compare(read_report(report_a), read_report(report_b))
    if as_json:
        print_json(to_plain(result))
        return
    click.echo(
        f"{result.method_a} less {result.method_b}: "
        f"{result.episodes} episodes of {result.scenes} scenes, split {result.split}"
    )
    if result.unpaired:
        click.echo(f"{result.unpaired} episodes are in one report only and left out")
    for name, difference in result.differences.items():
        estimate = number(difference.estimate)
        mark = "  <- primary" if name == result.primary_metric else ""
        click.echo(f"  {name:<34}{estimate:>9}  {interval(difference.low, difference.high)}{mark}")
    verdict = {
        None: "too few scenes for an interval",
        True: "the interval excludes zero",
        False: "the interval holds zero",
    }
    click.echo(f"primary: {verdict[result.is_real]}")
    if result.scenes < FEW_SCENES:
        click.echo(f"note: an interval over {result.scenes} scenes says little; take {FEW_SCENES} or more")
