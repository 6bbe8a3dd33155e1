"""``hsbench task show NAME``."""

from __future__ import annotations

import click

from hsbench.cli.common import json_option, print_json


@click.group(short_help="one task, exactly", epilog="Example: hsbench task show scene-completion")
def command() -> None:
    """One task, exactly."""


@command.command(epilog="Example: hsbench task show scene-completion")
@click.argument("name")
@json_option
def show(name: str, as_json: bool) -> None:
    """What task NAME gives, asks and scores."""
    from hsbench.tasks import task

    spec = task(name)
    arrays = {key: f"{array.dtype} {array.shape}" for key, array in spec.prediction.arrays.items()}
    facts = {
        "name": spec.name,
        "version": spec.version,
        "title": spec.title,
        "dataset": spec.dataset,
        "inputs": list(spec.inputs),
        "tracks": list(spec.tracks),
        "grid": {"origin_m": list(spec.grid.origin_m), "shape": list(spec.grid.shape), "voxel_m": spec.grid.voxel_m},
        "prediction": {"file": f"predictions/<episode_id>{spec.prediction.suffix}", "arrays": arrays},
        "protocol": spec.protocol,
        "primary_metric": f"{spec.primary_metric} ({spec.direction} is better)",
        "observation_times_s": list(spec.observation_times_s),
        "controls": list(spec.controls),
        "missing_answer": spec.missing_answer,
    }
    if as_json:
        print_json(facts)
        return
    for key, value in facts.items():
        click.echo(f"{key + ':':<21}{', '.join(map(str, value)) if isinstance(value, list) else value}")
