"""``hsbench check``."""

from __future__ import annotations

from pathlib import Path

import click

from hsbench.cli.common import ANY_PATH, data_option, json_option, next_step, note_own_data, on_split, print_json
from hsbench.errors import SubmissionError


@click.command(
    epilog="Example: hsbench check pred/carve --task scene-completion --data data/rgbd --split val",
    short_help="check a submission, without truth",
)
@click.argument("submission", type=ANY_PATH)
@click.option("--task", "task_name", required=True, metavar="NAME")
@data_option
@click.option(
    "--allow-missing", is_flag=True, help="A missing episode is no fault: it scores as the task's missing answer."
)
@json_option
@click.pass_context
def command(
    context: click.Context,
    submission: Path,
    task_name: str,
    data: Path,
    split: str | None,
    allow_missing: bool,
    as_json: bool,
) -> None:
    """Check SUBMISSION, a folder or a zip: every fault in one run, exit code 3 if there is one. Needs no truth."""
    from hsbench.datasets.dataset import load
    from hsbench.evaluation.score import check_on
    from hsbench.tasks import task

    spec, dataset = task(task_name), load(data, split, frames=False)
    note_own_data(spec, dataset.name)
    faults = check_on(submission, spec, dataset, allow_missing=allow_missing)
    if as_json:
        print_json({"submission": str(submission), "episodes": len(dataset), "faults": faults})
        context.exit(SubmissionError.exit_code if faults else 0)
    if faults:
        for fault in faults:
            click.echo(f"fault: {fault}", err=True)
        click.echo(f"{submission}: {len(faults)} fault{'s' if len(faults) > 1 else ''}", err=True)
        context.exit(SubmissionError.exit_code)
    click.echo(f"{submission}: {len(dataset)} episodes, no faults")
    next_step("score", submission, "--task", task_name, "--data", data, *on_split(split), "--out", "report.json")
