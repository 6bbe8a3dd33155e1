"""``expected.json``: what it pins is found again however it is packed, and every kind of change is seen."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from hsbench.cli.main import run
from hsbench.io.arrays import load_npz, write_npz
from hsbench.io.images import read_rgb, write_png
from hsbench.io.resources import resource
from hsbench.synth.expected import EXPECTED_FILE, expected_faults
from hsbench.synth.generate import Job, generate
from hsbench.synth.recipes import Recipe, find_recipe
from hsbench.synth.render import open_renderer

RECIPES = sorted(path.name for path in resource("generators").iterdir() if path.is_dir())


@pytest.fixture(scope="module")
def pinned(rgbd: Path, short_recipe: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a recipe with an ``expected.json`` made from its smallest size."""
    folder = tmp_path_factory.mktemp("pinned") / short_recipe.name
    shutil.copytree(short_recipe, folder)
    assert run(["verify", str(rgbd), "--pin", "--recipe", str(folder)]) == 0
    return folder


def only(root: Path, count: int) -> Path:
    """The first episode folders of a data set; others are removed."""
    for unit in sorted((root / "episodes").iterdir())[count:]:
        shutil.rmtree(unit)
    return root


def faults(root: Path, pinned: Path) -> list[str]:
    return [fault.split(": ", 1)[1] for found in expected_faults(root, find_recipe(str(pinned))) for fault in found]


def test_what_the_recipe_made(rgbd: Path, pinned: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["verify", str(rgbd), "--expected", "--recipe", str(pinned)]) == 0
    assert capsys.readouterr().out == f"{rgbd}: 6 episodes compared with what is expected, 0 faults\n"
    content = json.loads((pinned / EXPECTED_FILE).read_text())
    assert content["seed"] == 0
    for episode in content["episodes"].values():
        assert episode.keys() == {"geometry", "motion", "poses", "truth", "pictures"}
        assert len(episode["pictures"]) == 5


def test_other_bytes_of_the_same_values(rgbd_copy: Path, pinned: Path) -> None:
    unit = sorted((only(rgbd_copy, 1) / "episodes").iterdir())[0]
    for path in unit.rglob("*.parquet"):
        if path.parent.name != "recording":
            pq.write_table(pq.read_table(path), path, compression="none", row_group_size=7)
    voxels = unit / "truth" / "occupancy.npz"
    np.savez(voxels, **dict(reversed(load_npz(voxels).items())))
    index = json.loads((unit / "index.json").read_text())
    (unit / "index.json").write_text(json.dumps(index | {"renderer": "another"}, indent=7))
    assert faults(rgbd_copy, pinned) == []


def test_every_kind_of_change(rgbd_copy: Path, pinned: Path) -> None:
    unit = sorted((only(rgbd_copy, 1) / "episodes").iterdir())[0]
    for name, kind in (("truth/scene.npz", "geometry"), ("truth/occupancy.npz", "truth")):
        before = load_npz(unit / name)
        changed = {key: value.copy() for key, value in before.items()}
        key = max(changed, key=lambda k: changed[k].nbytes)
        raw = changed[key].reshape(-1).view(np.uint8)
        raw[-1] ^= 1  # one bit
        write_npz(unit / name, **changed)
        assert faults(rgbd_copy, pinned) == [f"{kind} differs from {EXPECTED_FILE}"]
        write_npz(unit / name, **before)
    for name, kind in (("inputs/poses.parquet", "poses"), ("truth/poses.parquet", "motion")):
        table = pq.read_table(unit / name)
        pq.write_table(table.slice(1), unit / name)
        assert faults(rgbd_copy, pinned) == [f"{kind} differs from {EXPECTED_FILE}"]
        pq.write_table(table, unit / name)
    picture = unit / "recording" / "background_rgb.png"
    write_png(picture, read_rgb(picture) // 2)
    found = faults(rgbd_copy, pinned)
    assert found
    assert all("rgb_" in fault for fault in found)


def test_what_cannot_be_compared(
    rgbd: Path, rgbd_copy: Path, pinned: Path, short_recipe: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["verify", str(rgbd_copy), "--expected", "--recipe"]
    assert run([*words, str(short_recipe)]) == 2
    assert f"has no {EXPECTED_FILE}" in capsys.readouterr().err
    description = json.loads((rgbd_copy / "dataset.json").read_text())
    (rgbd_copy / "dataset.json").write_text(json.dumps(description | {"seed": 3}))
    assert run([*words, str(pinned)]) == 2
    assert "has seed 3" in capsys.readouterr().err
    (rgbd_copy / "dataset.json").write_text(json.dumps(description))
    only(rgbd_copy, 1)
    assert run([*words, str(pinned)]) == 0  # of what is there
    assert "1 episodes compared" in capsys.readouterr().out
    assert run(["verify", str(rgbd_copy), "--pin", "--recipe", str(pinned)]) == 2
    assert "lacks rgbd-activity-000001" in capsys.readouterr().err
    only(rgbd_copy, 0)
    assert run([*words, str(pinned)]) == 2
    assert "has none of the 6 episodes" in capsys.readouterr().err
    assert run(["verify", "--pin", "--scenes", "1"]) == 2
    assert "--pin takes a data set" in capsys.readouterr().err


@pytest.mark.parametrize("name", RECIPES)
def test_bundled_recipes_pin_their_smallest_size(name: str) -> None:
    recipe = find_recipe(name)
    content = json.loads((recipe.folder / EXPECTED_FILE).read_text())
    first = {episode[: len(f"{name}-000000")] for episode in content["episodes"]}
    assert first == {f"{name}-{number:06d}" for number, _ in recipe.splits.numbers("mini")}
    assert content["seed"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", RECIPES)
def test_bundled_recipes_make_what_they_pin(name: str, tmp_path: Path) -> None:
    """Of one scene; its picture at t0 by statistics, where this machine draws with the renderer that was pinned."""
    recipe = find_recipe(name)
    unit = _last(recipe)
    pinned = json.loads((recipe.folder / EXPECTED_FILE).read_text())["renderer"]
    frames = "reference" if pinned is not None and open_renderer("auto").name == pinned else "none"
    for _ in generate(Job(name, 0, (unit,), frames), tmp_path / "data"):
        pass
    found = list(expected_faults(tmp_path / "data", recipe))
    assert found
    assert [fault for of_episode in found for fault in of_episode] == []


def _last(recipe: Recipe) -> tuple[int, str]:
    """Of the smallest size: no other test makes it again."""
    return recipe.splits.numbers("mini")[-1]
