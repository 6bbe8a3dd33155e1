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
@click.option(
    "--against-recipe", type=click.IntRange(min=1), metavar="N", help="Make N random scenes of DATA again and compare."
)
@click.option("--expected", is_flag=True, help="Compare DATA with the expected.json of its recipe.")
@click.option("--pin", is_flag=True, help="Write the expected.json of a recipe from DATA.")
@click.option("--recipe", type=FOLDER, metavar="DIR", help="Of data made from a recipe of one's own.")
@click.option("--scenes", type=click.IntRange(min=1), metavar="N", help="Build and examine N generated scenes instead.")
@click.option("--lives", type=click.IntRange(min=1), metavar="N", help="Simulate and measure life in N homes instead.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of scenes, lives and choices.")
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Processes for what is made.")
@json_option
@click.pass_context
def command(
    context: click.Context,
    data: Path | None,
    against_recipe: int | None,
    expected: bool,
    pin: bool,
    recipe: Path | None,
    scenes: int | None,
    lives: int | None,
    seed: int,
    workers: int,
    as_json: bool,
) -> None:
    """Check DATA: every file against its sha256, every episode against the schema. Lists every fault, and repairs.

    With --against-recipe N: make N random scenes of DATA again, and compare all but pictures by hash, and pictures by
    statistics.
    With --expected: compare the scenes that the recipe's expected.json pins, without making anything.
    With --scenes N: build N homes, offices and single rooms, and check what the generator promises of them.
    With --lives N: let three persons live for ten minutes in each of N homes, and check what is promised of that.
    """
    if sum(given is not None for given in (data, scenes, lives)) != 1:
        raise HsbenchError("verify takes a data set, --scenes N or --lives N, one of them")
    own_recipe = None if recipe is None else str(recipe)
    if data is None and (against_recipe is not None or expected or pin):
        option = "--pin" if pin else "--expected" if expected else "--against-recipe N"
        raise click.UsageError(f"{option.split()[0]} takes a data set: hsbench verify DATA {option}")
    if data is not None and against_recipe is not None:
        sound = _verify_against_recipe(data, against_recipe, seed, workers, own_recipe, as_json)
    elif data is not None and pin:
        sound = _pin(data, own_recipe)
    elif data is not None and expected:
        sound = _verify_expected(data, own_recipe, as_json)
    elif data is not None:
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
        click.echo(f"{data}: {count} episodes, {len(faults)} fault{'' if len(faults) == 1 else 's'}")
    return not faults


def _verify_against_recipe(data: Path, count: int, seed: int, workers: int, recipe: str | None, as_json: bool) -> bool:
    from hsbench.synth.executors import local
    from hsbench.synth.remake import is_of_this_version, remade_faults

    if not is_of_this_version(data, recipe):
        click.echo(f"note: another version of the recipe or of hsbench made {data}", err=True)
    found = list(progress(remade_faults(data, count, seed, local(workers), recipe), count, "make again", "scene"))
    faults = [fault for of_unit in found for fault in of_unit]
    if as_json:
        print_json({"data": str(data), "scenes_made_again": len(found), "faults": faults})
    else:
        for fault in faults:
            click.echo(f"fault: {fault}", err=True)
        click.echo(f"{data}: {len(found)} scenes made again, {len(faults)} faults")
    return not faults


def _pin(data: Path, recipe: str | None) -> bool:
    from hsbench.synth.expected import pin
    from hsbench.synth.remake import recipe_of

    click.echo(f"{pin(data, recipe_of(data, recipe))}: written")
    return True


def _verify_expected(data: Path, recipe: str | None, as_json: bool) -> bool:
    from hsbench.synth.expected import expected_faults
    from hsbench.synth.remake import recipe_of

    found = list(expected_faults(data, recipe_of(data, recipe)))
    faults = [fault for of_episode in found for fault in of_episode]
    if as_json:
        print_json({"data": str(data), "episodes_compared": len(found), "faults": faults})
    else:
        for fault in faults:
            click.echo(f"fault: {fault}", err=True)
        click.echo(f"{data}: {len(found)} episodes compared with what is expected, {len(faults)} faults")
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
