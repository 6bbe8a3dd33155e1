"""Completion of hidden space in imported rooms with simulated life, beside generated rooms.

    hsbench import scene room.glb --labels labels.json --out scenes/room
    python docs/examples/imported_results.py DATA OUT scenes/room scenes/other ...

DATA is a data set of recipe rgbd-activity with a split val: the generated rooms. In each imported scene one episode of
the same recipe is made in OUT: the same life, sensor and noise. Prints one table: counts are added over rooms and
divided once. A few rooms give no interval, so none is printed. The shuffled control takes its people from DATA.
"""

import argparse
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from hsbench.baselines.method import Settings
from hsbench.baselines.occlusion.methods import METHODS
from hsbench.datasets.dataset import Dataset, load
from hsbench.evaluation.completion import RATIOS, statistics, truth
from hsbench.io.resources import resource
from hsbench.schema.episode import Episode
from hsbench.synth.generate import Job, generate
from hsbench.tasks.scene_completion import SCENE_COMPLETION

SHOWN = ("carve", "all-solid", "visible-only", "carve-shuffled")
RECIPE = "rgbd-activity"
UNIT = (0, "val")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", type=Path, nargs="+")
    arguments = parser.parse_args()
    generated = load(arguments.data, "val", truth=True)
    imported = [lived(scene.resolve(), arguments.out) for scene in arguments.scenes]
    print(f"{len(imported)} imported rooms, {len(generated)} episodes in generated ones; no intervals\n")
    columns = [f"{kind} {ratio}" for kind in ("imported", "generated") for ratio in RATIOS]
    print(f"| method | {' | '.join(columns)} |\n|---|{'---:|' * len(columns)}")
    for name in SHOWN:
        cells = [*ratios(name, imported, generated), *ratios(name, generated, generated)]
        print(f"| {name} | {' | '.join(f'{cell:.3f}' for cell in cells)} |")


def lived(scene: Path, out: Path) -> Episode:
    """An episode of the recipe in an imported scene, made where it is not there yet."""
    recipe, data = out / "recipes" / scene.name / RECIPE, out / "data" / scene.name
    if not recipe.is_dir():
        recipe.mkdir(parents=True)
        for source in (resource("generators") / RECIPE).iterdir():
            if source.is_file():
                (recipe / source.name).write_bytes(source.read_bytes())
        config = recipe / "config.toml"
        config.write_text(f'scene = "{scene}"\n{config.read_text(encoding="utf-8")}', encoding="utf-8")
    for _ in generate(Job(str(recipe), 0, (UNIT,), "reference", "raycast"), data):
        pass
    return load(data, truth=True)[0]  # the split follows from the id of the scene


def ratios(name: str, episodes: Iterable[Episode], people: Dataset) -> list[float]:
    """IoU, precision and recall over hidden voxels, pooled over episodes."""
    answer = METHODS[name].prepare(Settings(people, None, 0))
    counts = np.zeros(4)
    for k, found in enumerate(episodes):
        episode = found
        true = truth(episode)
        assert true is not None
        if episode.episode_id not in people.episode_ids:  # the shuffled control takes the people that come next
            episode = replace(episode, episode_id=people.episode_ids[k % len(people)])
        counts += statistics(true, answer(episode), SCENE_COMPLETION)["occluded"]
    return [float(ratio(counts)) for ratio in RATIOS.values()]


if __name__ == "__main__":
    main()
