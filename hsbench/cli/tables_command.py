"""``hsbench tables``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import ANY_PATH, FOLDER

if TYPE_CHECKING:
    from hsbench.evaluation.tables import DatasetCounts


@click.command(
    epilog="Example: hsbench tables carve.json all-solid.json --data data/rgbd",
    short_help="reports and data sets in the forms of published tables",
)
@click.argument("reports", nargs=-1, type=ANY_PATH)
@click.option("--data", multiple=True, type=FOLDER, metavar="DIR", help="Folder of a data set; may be given again.")
@click.option("--csv", "csv_folder", type=FOLDER, metavar="DIR", help="Also write each table to table-NUMBER.csv here.")
def command(reports: tuple[Path, ...], data: tuple[Path, ...], csv_folder: Path | None) -> None:
    """REPORTS and data sets as Markdown, in the forms of the source's tables; a cell without data stays empty."""
    from hsbench.evaluation.report import read_report
    from hsbench.evaluation.tables import tables
    from hsbench.io.atomic import write_bytes
    from hsbench.viz.text_tables import csv_text, markdown

    made = tables([read_report(path) for path in reports], [_counts(folder) for folder in data])
    click.echo(markdown(made), nl=False)
    if csv_folder is not None:
        for table in made:
            write_bytes(csv_folder / f"table-{table.number}.csv", csv_text(table).encode())


def _counts(folder: Path) -> DatasetCounts:
    from hsbench.datasets.dataset import load
    from hsbench.datasets.statistics import split_counts
    from hsbench.evaluation.tables import DatasetCounts

    data = load(folder, frames=False)
    return DatasetCounts(data.name, data[0].sensor.kind if len(data) else "", split_counts(data))
