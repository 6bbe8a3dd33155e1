"""``hsbench task show NAME`` and ``hsbench task template NAME``."""

from __future__ import annotations

from pathlib import Path

import click

from hsbench.cli.common import (
    FOLDER,
    data_option,
    json_option,
    next_step,
    note_own_data,
    on_split,
    print_json,
    progress,
)
from hsbench.errors import HsbenchError


@click.group(short_help="one task, exactly", epilog="Example: hsbench task show scene-completion")
def command() -> None:
    """One task, exactly."""


@command.command(epilog="Example: hsbench task show scene-completion")
@click.argument("name")
@json_option
def show(name: str, as_json: bool) -> None:
    """What task NAME gives, asks and scores."""
    from hsbench.evaluation.scorers import metrics_of
    from hsbench.io.plain import to_plain
    from hsbench.io.splits import read_splits
    from hsbench.tasks import task
    from hsbench.tasks.spec import FRAME, NOISE_PRESETS

    spec = task(name)
    times = {data: list(spec.on(data).observation_times_s) for data in spec.datasets if spec.observation_times_s}
    arrays = {
        key: f"{array.dtype} {array.shape}".replace("None", "any") for key, array in spec.prediction.arrays.items()
    }
    facts = {
        "name": spec.name,
        "version": spec.version,
        "title": spec.title,
        "datasets": list(spec.datasets),
        "splits": {
            data: {name: count for name, (_, count) in read_splits(data).scenes["full"].items()}
            for data in spec.datasets
        },
        "inputs": list(spec.inputs),
        "noise": {data: dict(NOISE_PRESETS[data]) for data in spec.datasets},
        "tracks": list(spec.tracks),
        "frame": FRAME,
        "grid": to_plain(spec.grid),
        "prediction": {"file": f"predictions/<episode_id>{spec.prediction.suffix}", "arrays": arrays},
        "example": f"hsbench task template {name} --data DIR --out pred/template",
        "mask": spec.mask,
        "protocol": spec.protocol,
        "primary_metric": f"{spec.primary_metric} ({spec.direction} is better)",
        "metrics": list(metrics_of(name)),
        "earlier_prediction": f"predictions/<episode_id>@<seconds>s{spec.prediction.suffix}" if times else None,
        "observation_times_s": times,
        "controls": list(spec.controls),
        "missing_answer": spec.missing_answer,
    }
    if as_json:
        print_json(facts)
        return
    for key, value in facts.items():
        if value:
            click.echo(f"{key + ':':<21}{_text(value)}")


def _text(value: object) -> str:
    """A plain value in words: items of a list and of an object in a row, of those within in brackets."""
    if isinstance(value, dict):
        return ", ".join(
            f"{key} ({_text(v)})" if isinstance(v, dict | list) else f"{key} {v}" for key, v in value.items()
        )
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


@command.command(epilog="Example: hsbench task template scene-completion --data data/rgbd --out pred/template")
@click.argument("name")
@data_option
@click.option("--out", required=True, type=FOLDER, metavar="DIR", help="Folder of the submission.")
@click.option("--times", is_flag=True, help="An answer at each observation time too, for a curve.")
@click.option("--replace", is_flag=True, help="Replace --out if it exists.")
def template(name: str, data: Path, split: str | None, out: Path, times: bool, replace: bool) -> None:
    """Write a valid submission to task NAME that answers nothing, to start from."""
    from hsbench.datasets.dataset import load
    from hsbench.submission import Metadata, SubmissionWriter
    from hsbench.tasks import task

    spec = task(name)
    if out.exists() and not replace:
        raise HsbenchError(f"{out} exists already; choose another --out or give --replace")
    dataset = load(data, split, frames=False)
    note_own_data(spec, dataset.name)
    spec = spec.on(dataset.name)
    metadata = Metadata(spec.name, spec.version, "template", spec.tracks[0], causal=True)
    with SubmissionWriter(out, spec, metadata, replace=replace) as writer:
        for episode in progress(dataset, len(dataset), "template"):
            writer.add(episode.episode_id, spec.dummy(episode))
            for observed_s in spec.observation_times_s[:-1] if times else ():
                if observed_s < episode.duration_s:
                    writer.add(episode.episode_id, spec.dummy(episode.until(observed_s)), observed_s)
    click.echo(f"{out}: {len(dataset)} predictions of nothing; fill in predictions/ and submission.json")
    next_step("check", out, "--task", name, "--data", data, *on_split(split))
