"""``hsbench tasks``."""

from __future__ import annotations

import click

from hsbench.cli.common import json_option, print_json


@click.command(epilog="Example: hsbench tasks", short_help="list the tasks")
@json_option
def command(as_json: bool) -> None:
    """List the tasks this version scores."""
    from hsbench.tasks import TASKS

    if as_json:
        print_json(
            [
                {"name": t.name, "version": t.version, "datasets": list(t.datasets), "title": t.title}
                for t in TASKS.values()
            ]
        )
        return
    for task in TASKS.values():
        data = ", ".join(task.datasets)
        click.echo(f"{task.name} {task.version}  {task.title} (data {data}, primary {task.primary_metric})")
