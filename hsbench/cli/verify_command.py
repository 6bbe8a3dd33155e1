"""``hsbench verify``."""

from __future__ import annotations

from pathlib import Path

import click

from hsbench.cli.common import FOLDER, json_option, print_json, progress
from hsbench.errors import HsbenchError


@click.command(epilog="Example: hsbench verify data/rgbd", short_help="check a data set's files and contents")
@click.argument("data", type=FOLDER)
@json_option
@click.pass_context
def command(context: click.Context, data: Path, as_json: bool) -> None:
    """Check DATA: every file against its sha256, every episode against the schema. Lists every fault."""
    from hsbench.datasets.dataset import load
    from hsbench.datasets.verify import verify_episode, verify_files

    episodes = load(data, truth=True)
    faults = verify_files(data)
    for index in progress(range(len(episodes)), len(episodes), "verify"):
        try:
            faults += verify_episode(episodes[index])
        except HsbenchError as error:
            faults.append(str(error))
    if as_json:
        print_json({"data": str(data), "episodes": len(episodes), "faults": faults})
    else:
        for fault in faults:
            click.echo(f"fault: {fault}", err=True)
        click.echo(f"{data}: {len(episodes)} episodes, {len(faults)} faults")
    context.exit(2 if faults else 0)
