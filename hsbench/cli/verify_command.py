"""``hsbench verify``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import FOLDER, json_option, print_json, progress
from hsbench.errors import HsbenchError

if TYPE_CHECKING:
    from hsbench.synth.survey import Promise


@click.command(
    epilog="Example: hsbench verify data/rgbd",
    short_help="check a data set's files and contents, or the scene generator",
)
@click.argument("data", type=FOLDER, required=False)
@click.option("--scenes", type=click.IntRange(min=1), metavar="N", help="Build and examine N generated scenes instead.")
@click.option("--lives", type=click.IntRange(min=1), metavar="N", help="Simulate and measure life in N homes instead.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of scenes and lives.")
@click.option(
    "--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Processes for scenes and lives."
)
@json_option
@click.pass_context
def command(
    context: click.Context,
    data: Path | None,
    scenes: int | None,
    lives: int | None,
    seed: int,
    workers: int,
    as_json: bool,
) -> None:
    """Check DATA: every file against its sha256, every episode against the schema. Lists every fault, and repairs.

    With --scenes N: build N homes, offices and single rooms, and check what the generator promises of them.
    With --lives N: let three persons live for ten minutes in each of N homes, and check what is promised of that.
    """
    if sum(given is not None for given in (data, scenes, lives)) != 1:
        raise HsbenchError("verify takes a data set, --scenes N or --lives N, one of them")
    if data is not None:
        sound = _verify_data(data, as_json)
    elif scenes is not None:
        sound = _verify_scenes(scenes, seed, workers, as_json)
    else:
        sound = _verify_lives(lives or 0, seed, workers, as_json)
    context.exit(0 if sound else 2)


def _verify_data(data: Path, as_json: bool) -> bool:
    from hsbench.datasets.faults import dataset_faults
    from hsbench.io.dataset_index import unit_folders

    count = len(unit_folders(data))
    faults = [fault for found in progress(dataset_faults(data), count + 2, "verify") for fault in found]
    repairs = list(dict.fromkeys(fault.repair for fault in faults))
    if as_json:
        texts = [fault.text for fault in faults]
        print_json({"data": str(data), "episodes": count, "faults": texts, **({"repairs": repairs} if faults else {})})
    else:
        for fault in faults:
            click.echo(f"fault: {fault.text}", err=True)
        for repair in repairs:
            click.echo(f"repair: {repair}")
        click.echo(f"{data}: {count} episodes, {len(faults)} faults")
    return not faults


def _verify_scenes(count: int, seed: int, workers: int, as_json: bool) -> bool:
    from dataclasses import asdict

    from hsbench.synth.survey import promises, survey

    found = list(progress(survey(range(count), seed, workers), count, "verify", "scene"))
    lines = promises(found)
    if as_json:
        print_json({"scenes": [asdict(s) for s in found], "promises": [asdict(line) for line in lines]})
    else:
        for scene in found:
            for fault in (*scene.faults.penetrating, *scene.faults.floating, *scene.faults.blocked_doors):
                click.echo(f"fault: scene {scene.number}: {fault}", err=True)
        _print_promises(lines)
    return all(line.kept for line in lines)


def _verify_lives(count: int, seed: int, workers: int, as_json: bool) -> bool:
    from dataclasses import asdict

    from hsbench.synth.activities.measures import Measures, promises
    from hsbench.synth.activities.survey import survey

    found = sum(progress(survey(count, seed, workers), count, "verify", "life"), Measures())
    lines = promises(found)
    if as_json:
        print_json({"lives": count, "measures": asdict(found), "promises": [asdict(line) for line in lines]})
    else:
        _print_promises(lines)
    return all(line.kept for line in lines)


def _print_promises(lines: Sequence[Promise]) -> None:
    width = max(len(line.name) for line in lines)
    for line in lines:
        click.echo(f"{line.name:<{width}}  {line.measured}{'' if line.kept else '  NOT KEPT'}")
