"""``verify --against-recipe``: clean on what the recipe made, and every kind of change is found."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from hsbench.cli.main import run
from hsbench.io.arrays import load_npz, write_npz
from hsbench.synth.executors import InTurn
from hsbench.synth.generate import generate
from hsbench.synth.remake import episode_faults, remade_faults
from tests.unit.synth.toy_recipe import toy_job, write_toy


def test_what_the_recipe_made_and_what_it_did_not(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recipe, data = write_toy(tmp_path), tmp_path / "data"
    list(generate(toy_job(recipe, 3), data))
    words = ["verify", str(data), "--recipe", str(recipe), "--against-recipe"]
    assert run([*words, "2"]) == 0
    assert capsys.readouterr().out == f"{data}: 2 scenes made again, 0 faults\n"

    poses = data / "episodes" / "toy-000001" / "inputs" / "poses.parquet"
    table = pq.read_table(poses)
    pq.write_table(table, poses, compression="none")  # other bytes, the same values: another version of pyarrow
    assert run([*words, "3"]) == 0
    state = np.array(table["joint_state"].to_pylist(), dtype=np.uint8)
    state[5, 3] = 1
    column = pa.array(state.tolist(), type=table.schema.field("joint_state").type)
    pq.write_table(table.set_column(table.schema.get_field_index("joint_state"), "joint_state", column), poses)
    capsys.readouterr()
    assert run([*words, "3"]) == 2
    shown = capsys.readouterr()
    assert shown.err == "fault: toy-000001: inputs/poses.parquet differs from what the recipe makes\n"
    assert shown.out == f"{data}: 3 scenes made again, 1 faults\n"


def test_another_recipe_or_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recipe, data = write_toy(tmp_path), tmp_path / "data"
    list(generate(toy_job(recipe, 1), data))
    other = write_toy(tmp_path / "b", settings="poses = 190\n")
    assert run(["verify", str(data), "--recipe", str(other), "--against-recipe", "1"]) == 2
    shown = capsys.readouterr().err
    assert "note: another version of the recipe" in shown
    assert "toy-000000: episode.json differs" in shown
    assert run(["verify", str(data), "--recipe", "generators/pairs", "--against-recipe", "1"]) == 2
    assert "is of recipe toy, not pairs" in capsys.readouterr().err
    assert run(["verify", "--recipe", str(recipe), "--against-recipe", "1"]) == 2
    assert "takes a data set" in capsys.readouterr().err
    described = json.loads((data / "dataset.json").read_text())
    del described["recipe_sha256"]
    (data / "dataset.json").write_text(json.dumps(described))
    assert run(["verify", str(data), "--recipe", str(recipe), "--against-recipe", "1"]) == 2
    assert "was not generated" in capsys.readouterr().err


def test_pictures_by_statistics_and_the_rest_by_value(
    rgbd: Path, rgbd_copy: Path, short_recipe: Path, tmp_path: Path
) -> None:
    """One short episode with pictures: equal to itself, unlike another's pictures or voxels."""
    (faults,) = remade_faults(rgbd, 1, 0, InTurn(), str(short_recipe))
    assert faults == []
    units = sorted((rgbd_copy / "episodes").iterdir())
    original = rgbd / "episodes" / units[0].name
    voxels = load_npz(units[0] / "truth" / "occupancy.npz")
    voxels["state"] = voxels["state"].copy()
    voxels["state"].flat[0] ^= 1
    write_npz(units[0] / "truth" / "occupancy.npz", **voxels)
    assert episode_faults(units[0], original) == [
        f"{units[0].name}: truth/occupancy.npz differs from what the recipe makes"
    ]
    (units[0] / "recording").rename(tmp_path / "own")
    (units[1] / "recording").rename(units[0] / "recording")
    pictures = [fault for fault in episode_faults(units[0], original) if "grey levels" in fault or "depth" in fault]
    assert len(pictures) == 10
