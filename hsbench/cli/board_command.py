"""``hsbench board``."""

from __future__ import annotations

from pathlib import Path

import click

from hsbench.cli.common import ANY_PATH, FOLDER, F
from hsbench.errors import HsbenchError, SchemaError


@click.group(short_help="add entries to a board, show and build it", epilog="Example: hsbench board show --board board")
def command() -> None:
    """Boards: one JSON file an entry, tables and pages derived from them."""


def board_option(function: F) -> F:
    """``--board DIR``."""
    return click.option("--board", required=True, type=FOLDER, metavar="DIR", help="Root folder of the boards.")(
        function
    )


def existing(board: Path) -> Path:
    """The folder of a board. Raises HsbenchError where there is none."""
    if not board.is_dir():
        raise HsbenchError(f"{board} is no folder (make a board with hsbench board add)")
    return board


@command.command(epilog="Example: hsbench board add report.json --board board --name carve --year 2026")
@click.argument("report", type=ANY_PATH)
@board_option
@click.option("--name", metavar="NAME", help="Short name, safe as a file name; default: the method's.")
@click.option("--year", required=True, type=int, help="Year of the method.")
@click.option("--replace", is_flag=True, help="Replace an entry of the same name.")
def add(report: Path, board: Path, name: str | None, year: int, replace: bool) -> None:
    """Make an entry of REPORT, self-reported, after checking that its numbers follow from its episodes."""
    from hsbench.evaluation.report import read_report
    from hsbench.leaderboard import Entry, write_entry
    from hsbench.schema.episode import check_id

    value = read_report(report)
    try:
        check_id(value.method.method if name is None else name, "name")
    except SchemaError as error:
        raise HsbenchError(f"{error} (choose one with --name)") from None
    entry = Entry(
        value.method.method if name is None else name,
        year,
        value.method.authors or ("unknown",),
        "self-reported",
        value,
    )
    click.echo(f"entry: {write_entry(board, entry, replace=replace)}")


@command.command(epilog="Example: hsbench board show --board board --task scene-completion")
@board_option
@click.option("--task", "task_name", default="scene-completion", show_default=True)
def show(board: Path, task_name: str) -> None:
    """Print the board of a task as Markdown tables."""
    from hsbench.leaderboard import markdown, rank, read_entries
    from hsbench.tasks import task

    spec = task(task_name)
    click.echo(markdown(rank(read_entries(existing(board), spec.name, spec.version))), nl=False)


@command.command(epilog="Example: hsbench board build --board board --out board.html")
@board_option
@click.option("--task", "task_name", default="scene-completion", show_default=True)
@click.option("--out", required=True, type=ANY_PATH, metavar="FILE")
def build(board: Path, task_name: str, out: Path) -> None:
    """Write the board of a task as one HTML page."""
    from hsbench.io.atomic import write_text
    from hsbench.leaderboard import COLUMNS, rank, read_entries
    from hsbench.tasks import task
    from hsbench.viz.board_page import board_page

    spec = task(task_name)
    tables = rank(read_entries(existing(board), spec.name, spec.version))
    write_text(out, board_page(tables, spec, COLUMNS))
    click.echo(f"board: {out}")
