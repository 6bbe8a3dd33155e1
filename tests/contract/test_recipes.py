"""The contract of every recipe: a folder in ``generators/`` with a data sheet, settings, a short file of code, splits.

Adding a folder is registration: these tests find it.
"""

from __future__ import annotations

import ast
import inspect
import tomllib
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.io.resources import resource
from hsbench.io.splits import SPLITS, read_splits
from hsbench.schema import VoxelState
from hsbench.synth.generate import Job, generate
from hsbench.synth.recipes import find_recipe
from hsbench.tasks import TASKS

RECIPES = sorted(p.name for p in resource("generators").iterdir() if p.is_dir() and not p.name.startswith((".", "_")))
MAX_LINES = 200  # docs/architecture.md
recipes = pytest.mark.parametrize("name", RECIPES)
LONG = ("timelapse-activity", "all-sensors", "activity-360", "pairs")  # minutes of work
RUNS = [pytest.param(name, marks=[pytest.mark.slow] if name in LONG else []) for name in RECIPES]


def test_every_data_set_of_a_task_has_a_recipe() -> None:
    assert {name for spec in TASKS.values() for name in spec.datasets} <= set(RECIPES)


@recipes
def test_folder(name: str) -> None:
    folder = resource("generators") / name
    code = (folder / f"{name}.py").read_text(encoding="utf-8")
    assert len(code.splitlines()) <= MAX_LINES
    assert ast.get_docstring(ast.parse(code))
    sheet = (folder / "README.md").read_text(encoding="utf-8")
    assert name in sheet
    assert len(sheet.split()) > 100
    for word in ("licen", "seed", "split", "sensor", "truth"):
        assert word in sheet.lower(), f"the data sheet says nothing of {word}"
    assert tomllib.loads((folder / "config.toml").read_text(encoding="utf-8"))


@recipes
def test_it_is_found_and_builds(name: str) -> None:
    recipe = find_recipe(name)
    assert recipe.name == name
    assert list(inspect.signature(recipe.build).parameters) == ["config", "unit"]
    assert inspect.isgeneratorfunction(recipe.build)
    assert find_recipe(str(recipe.folder)).sha256 == recipe.sha256


@recipes
def test_it_has_splits(name: str) -> None:
    splits = read_splits(name)
    assert splits.dataset == name
    assert {"mini", "small", "full"} <= set(splits.scenes)
    used = {split for _, split in splits.numbers("mini")}
    assert used
    assert used <= set(SPLITS)


@pytest.mark.parametrize("name", RUNS)
def test_a_mini_data_set_loads_and_verifies_clean(name: str, tmp_path: Path) -> None:
    """Every mini scene with the recipe's own settings; pictures are the business of the shorter tests."""
    job = Job(name, 0, tuple(read_splits(name).numbers("mini")), "none", "raycast")
    made = list(generate(job, tmp_path / "data"))
    assert len(made) == len(set(made)) >= len(job.units)
    root = tmp_path / "data"
    assert verify_files(root) == []
    data = load(root, truth=True)
    assert {(i, r["split"]) for i, r in zip(data.scene_ids, data.rows, strict=True)} == {
        (f"scene-{number:06d}", split) for number, split in job.units
    }
    assert data.description["recipe_sha256"] == find_recipe(name).sha256
    assert data.description["licence"]
    styles: dict[bool, set[str]] = {True: set(), False: set()}
    lived_in = [True]
    for row, episode in zip(data.rows, data, strict=True):
        assert verify_episode(episode) == []
        assert episode.dataset == name
        assert (100 if name != "all-sensors" else 60) < episode.duration_s < 24 * 3600
        if episode.truth.scene is not None:
            styles[row["split"] == "test-novel"].add(episode.truth.scene.style)
            for item in episode.truth.scene.objects:
                for part in item.parts:
                    if part.solid is not None:
                        part.solid.check()
        if episode.activity_maps is not None:  # data without people or pictures
            lived_in.append(bool(episode.activity_maps.maps.any()))
            assert episode.truth.affordance.labels.any()
            continue
        if episode.sensor.kind == "topdown":  # nobody detects poses from above
            assert episode.poses is None
            continue
        assert len(episode.poses) >= (30 if name != "all-sensors" else 6)  # one of its cameras looks once a second
        assert episode.truth.poses.action.max() > 1  # somebody does more than stand
        truth = episode.truth.occupancy
        if truth is None:  # a time-lapse: what it is about is the view
            assert episode.truth.view_affordance.any()
            continue
        hidden = truth.state == VoxelState.OCCLUDED
        assert 0.01 < np.mean(hidden[truth.state != VoxelState.OUTSIDE_ROOM]) < 0.9
        assert truth.solid[hidden].any()
        moved = np.isin(
            truth.instance, episode.truth.motions.object_id
        )  # chairs: at t0 they were where somebody is later
        assert np.mean(truth.solid[np.isfinite(truth.swept_s) & ~moved]) < 0.02  # a body in a solid is a contact
    assert np.mean(lived_in) > 0.9  # in a home, the camera may see nobody
    assert bool(styles[True]) == any(split == "test-novel" for _, split in job.units)
    assert not styles[True] & styles[False]  # test-novel is new


def test_a_data_set_with_the_name_of_a_recipe_does_not_hide_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rgbd-activity").mkdir()
    assert find_recipe("rgbd-activity").folder == (resource("generators") / "rgbd-activity").resolve()
