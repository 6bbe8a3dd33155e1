"""Generating: the same bytes from (recipe, seed, scene number), whatever is made beside, before or after it."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import hsbench
from hsbench import load
from hsbench.cli.main import run
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError, HsbenchError, SchemaError
from hsbench.io.scene_folder import read_scene
from hsbench.io.splits import read_splits
from hsbench.synth.generate import Job, generate
from hsbench.synth.recipes import find_recipe

WriteRecipe = Callable[[Path, dict[str, dict[str, object]]], None]
ROOT = Path(hsbench.__file__).parents[1]
UNITS = tuple(read_splits("rgbd-activity").numbers("mini"))


def contents(root: Path) -> dict[str, bytes]:
    """Every file but what a kill may leave behind (a hidden ``.part`` folder)."""
    files = (p for p in root.rglob("*") if p.is_file())
    named = {p.relative_to(root).as_posix(): p.read_bytes() for p in files}
    return {name: data for name, data in named.items() if ".part" not in name}


def unit_manifests(root: Path) -> dict[str, str]:
    return {p.parent.name: p.read_text() for p in (root / "episodes").glob("[!.]*/manifest.json")}


def make(recipe: Path, out: Path, units: tuple[tuple[int, str], ...] = UNITS, seed: int = 0, workers: int = 1) -> Path:
    list(generate(Job(str(recipe), seed, units, "all", "raycast"), out, workers))
    return out


def test_same_bytes_with_two_workers_in_another_order(rgbd: Path, short_recipe: Path, tmp_path: Path) -> None:
    """The shared data set was made by one process, in order."""
    again = make(short_recipe, tmp_path / "again", UNITS[::-1], workers=2)
    assert contents(again) == contents(rgbd)
    assert verify_files(again) == []


def test_same_bytes_alone_and_in_several_runs(rgbd: Path, short_recipe: Path, tmp_path: Path) -> None:
    whole = unit_manifests(rgbd)
    out = tmp_path / "out"
    for unit in (UNITS[3], UNITS[5]):
        make(short_recipe, out, (unit,))
    assert len(unit_manifests(out)) == 2
    assert unit_manifests(out).items() <= whole.items()
    assert load(out).episode_ids == (f"rgbd-activity-{UNITS[3][0]:06d}", f"rgbd-activity-{UNITS[5][0]:06d}")
    assert verify_files(out) == []


def test_every_seed_and_scene_is_another(rgbd: Path, short_recipe: Path, tmp_path: Path) -> None:
    """Seed 0 is a seed: it differs from 1, and no two scenes of one seed share room, camera or motion."""
    other = make(short_recipe, tmp_path / "other", UNITS[:1], seed=1)
    episodes = [*load(rgbd, truth=True), *load(other, truth=True)]
    for view in (
        lambda e: e.truth.scene.rooms[0].outline_xy.tobytes(),
        lambda e: e.truth.occupancy.semantic.tobytes(),
        lambda e: (e.sensor.height_m, e.sensor.tilt_rad),
        lambda e: e.truth.poses.poses.joints_m.tobytes(),
        lambda e: e.frames[0].rgb.tobytes(),
    ):
        assert len({view(e) for e in episodes}) == len(episodes) == 7
    assert unit_manifests(other).keys() < unit_manifests(rgbd).keys()


def test_the_same_room_whatever_is_filmed(rgbd: Path, short_recipe: Path, tmp_path: Path) -> None:
    """Truth and poses do not hang on which pictures are made, nor by whom."""
    whole = json.loads(unit_manifests(rgbd)[f"rgbd-activity-{UNITS[0][0]:06d}"])
    for frames in ("none", "reference"):
        out = tmp_path / frames
        list(generate(Job(str(short_recipe), 0, UNITS[:1], frames, "raycast"), out))
        (made,) = (json.loads(m) for m in unit_manifests(out).values())
        shared = [n for n in whole if n.startswith(("truth/", "inputs/"))]
        assert len(shared) >= 8
        assert {n: made[n] for n in shared} == {n: whole[n] for n in shared}
        assert len(load(out)[0].frames) == (frames == "reference")
        if frames == "reference":
            pictures = [n for n in whole if "background" in n]
            assert {n: made[n] for n in pictures} == {n: whole[n] for n in pictures}


def test_a_finished_run_makes_nothing_again(rgbd_copy: Path, short_recipe: Path) -> None:
    before = contents(rgbd_copy)
    job = Job(str(short_recipe), 0, UNITS, "all", "raycast")
    assert list(generate(job, rgbd_copy)) == []
    assert contents(rgbd_copy) == before
    gone = rgbd_copy / "episodes" / f"rgbd-activity-{UNITS[2][0]:06d}"
    shutil.rmtree(gone)
    assert list(generate(job, rgbd_copy)) == [gone.name]
    assert contents(rgbd_copy) == before


KILLER = """
import os, signal
from dataclasses import replace

def build(config, unit):
    for episode in _build(config, unit):
        if unit.number == int(os.environ.get("KILL_AT_SCENE", "-1")):
            film = episode.frames
            def patch(index):
                if index == 3:
                    os.kill(os.getpid(), signal.SIGKILL)
                return film.patch(index)
            episode = replace(episode, frames=replace(film, patch=patch))
        yield episode
"""


def test_a_kill_costs_the_unit_under_way_and_no_byte_differs_afterwards(
    rgbd: Path, short_recipe: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """SIGKILL in the middle of the second unit's table of patches, then the same command again."""
    recipe = tmp_path / "recipe" / "rgbd-activity"
    shutil.copytree(short_recipe, recipe)
    code = recipe / "rgbd-activity.py"
    code.write_text(code.read_text().replace("def build(", "def _build(") + KILLER)
    out = tmp_path / "out"
    words = ["generate", str(recipe), "--split", "train", "--renderer", "raycast", "--out", str(out)]
    first, second = (f"rgbd-activity-{number:06d}" for number, _ in UNITS[:2])
    command = [sys.executable, "-m", "hsbench.cli.main", *words]
    killed = subprocess.run(command, cwd=ROOT, env={**os.environ, "KILL_AT_SCENE": str(UNITS[1][0])}, check=False)
    assert killed.returncode == -signal.SIGKILL
    left = sorted(p.name for p in (out / "episodes").iterdir())
    assert left[1:] == [first]
    assert left[0].startswith(".unit-")
    assert left[0].endswith(".part")
    (begun,) = (out / "episodes" / left[0]).iterdir()
    assert begun.name.startswith(f".{second}.")
    assert (begun / "recording" / "patches.zst").exists()
    assert not (begun / "manifest.json").exists()
    with pytest.raises(DataError, match="was its generation stopped"):
        load(out)
    assert run(words) == 0
    assert "2 scenes (1 episodes made now)" in capsys.readouterr().out
    assert verify_files(out) == []
    assert unit_manifests(out) == {n: m for n, m in unit_manifests(rgbd).items() if n in (first, second)}
    unbroken = make(recipe, tmp_path / "unbroken", UNITS[:2])
    assert contents(out) == contents(unbroken)


def test_a_killed_worker_fails_its_unit_alone(rgbd: Path, short_recipe: Path, tmp_path: Path) -> None:
    recipe = tmp_path / "recipe" / "rgbd-activity"
    shutil.copytree(short_recipe, recipe)
    code = recipe / "rgbd-activity.py"
    code.write_text(code.read_text().replace("def build(", "def _build(") + KILLER)
    out = tmp_path / "out"
    command = [
        sys.executable, "-m", "hsbench.cli.main", "generate", str(recipe), "--split", "train", "--renderer", "raycast",
        "--out", str(out), "--workers", "2",
    ]  # fmt: skip
    killed = UNITS[1][0]
    env = {**os.environ, "KILL_AT_SCENE": str(killed)}
    done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert f"recipe rgbd-activity, seed 0, scene number {killed}: its process died" in done.stderr
    first = f"rgbd-activity-{UNITS[0][0]:06d}"
    assert unit_manifests(out) == {first: unit_manifests(rgbd)[first]}
    assert verify_files(out) == []
    assert not list((out / "episodes").glob(".*.part"))


@pytest.mark.parametrize("workers", [1, 2])
def test_a_unit_that_fails_does_not_stop_the_others(short_recipe: Path, tmp_path: Path, workers: int) -> None:
    recipe = tmp_path / "recipe" / "rgbd-activity"
    shutil.copytree(short_recipe, recipe)
    code = recipe / "rgbd-activity.py"
    fault = "\ndef build(config, unit):\n    if unit.number in {0}:\n        raise ValueError('odd')\n"
    bad = {UNITS[0][0], UNITS[2][0]}
    code.write_text(
        code.read_text().replace("def build(", "def _build(")
        + fault.format(bad)
        + "    yield from _build(config, unit)\n"
    )
    made: list[str] = []
    with pytest.raises(RuntimeError, match=r"scene number \d+: ValueError: odd \(and 1 units more failed") as error:
        made.extend(generate(Job(str(recipe), 0, UNITS[:4], "none", "raycast"), tmp_path / "out", workers))
    assert any(f"scene number {number}:" in str(error.value) for number in bad)
    expected = {f"rgbd-activity-{number:06d}" for number, _ in UNITS[:4] if number not in bad}
    assert set(load(tmp_path / "out").episode_ids) == expected


@pytest.mark.parametrize(
    ("change", "key"),
    [({"seed": 1}, "seed"), ({"frames": "none"}, "frames"), ({"splits_version": "v1"}, "splits_version"),
     ({"recipe": "rgbd-activity"}, "recipe_sha256")],
)  # fmt: skip
def test_another_data_set_is_not_mixed_in(
    rgbd_copy: Path, short_recipe: Path, change: dict[str, object], key: str
) -> None:
    before = contents(rgbd_copy)
    same = {"recipe": str(short_recipe), "seed": 0, "units": UNITS, "frames": "all", "renderer": "raycast"}
    job = Job(**{**same, **change})
    with pytest.raises(DataError, match=f"holds a data set with {key}"):
        list(generate(job, rgbd_copy))
    assert contents(rgbd_copy) == before


def test_a_folder_with_other_things_is_left_alone(short_recipe: Path, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(DataError, match="is not empty and holds no dataset"):
        list(generate(Job(str(short_recipe), 0, UNITS, "none", "raycast"), tmp_path))
    assert [p.name for p in tmp_path.iterdir()] == ["notes.txt"]


def test_every_nth_picture_is_that_of_all_pictures(rgbd: Path, short_recipe: Path, tmp_path: Path) -> None:
    """Poses and truth are whole whatever is filmed; of the pictures, t0's and every fifth from there."""
    out = tmp_path / "out"
    list(generate(Job(str(short_recipe), 0, UNITS[:1], "every:5", "raycast"), out))
    (some,) = load(out, depth_noise="none")
    whole = load(rgbd, depth_noise="none").episode(some.episode_id)
    assert np.array_equal(some.frames.timestamps_ns, whole.frames.timestamps_ns[::5])
    assert np.array_equal(some.poses.timestamp_ns, whole.poses.timestamp_ns)
    for k in range(len(some.frames)):
        assert np.array_equal(some.frames[k].rgb, whole.frames[5 * k].rgb)
        assert np.array_equal(some.frames[k].depth_m, whole.frames[5 * k].depth_m)


@pytest.mark.parametrize("frames", ["every", "every:", "every:0", "every:-2", "every:1.5", "some", ""])
def test_no_other_choice_of_frames(frames: str) -> None:
    with pytest.raises(SchemaError, match="expected all, every:N"):
        Job("rgbd-activity", 0, UNITS[:1], frames)


# ---------------------------------------------------------------- recipes


def test_a_recipe_is_found_by_name_or_by_path(short_recipe: Path, tmp_path: Path) -> None:
    bundled, outside = find_recipe("rgbd-activity"), find_recipe(str(short_recipe))
    assert bundled.name == outside.name == "rgbd-activity"
    assert ROOT not in outside.folder.parents
    assert outside.sha256 != bundled.sha256
    renamed = tmp_path / "my-rooms"
    shutil.copytree(short_recipe, renamed)
    (renamed / "rgbd-activity.py").rename(renamed / "my-rooms.py")
    (renamed / "README.md").write_text("A data sheet is no part of what decides the bytes.")
    assert find_recipe(str(renamed)).name == "my-rooms"
    with pytest.raises(DataError, match=r"'my-romms' is neither a folder nor one of .*rgbd-activity"):
        find_recipe("my-romms")


def test_a_data_set_may_have_the_name_of_its_recipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    job = Job("activity-maps", 0, ((0, "train"),), "none", "raycast")
    made = list(generate(job, Path("activity-maps")))
    assert made
    assert verify_files(Path("activity-maps")) == []


def test_the_hash_is_that_of_code_and_settings(write_recipe: WriteRecipe, tmp_path: Path) -> None:
    hashes = set()
    for k, text in enumerate(("", "# a remark\n")):
        for name in ("rgbd-activity.py", "config.toml"):
            folder = tmp_path / f"{k}{name[0]}" / "rgbd-activity"
            write_recipe(folder, {})
            (folder / name).write_text(text + (folder / name).read_text())
            hashes.add(find_recipe(str(folder)).sha256)
    assert len(hashes) == 3


def broken(write_recipe: WriteRecipe, tmp_path: Path, **files: str | None) -> Path:
    folder = tmp_path / "rgbd-activity"
    write_recipe(folder, {"life": {"duration_s": 3.0}})
    for name, text in files.items():
        path = folder / name.replace("__", ".").replace("_", "-")
        if text is None:
            path.unlink()
        else:
            path.write_text(text)
    return folder


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"rgbd_activity__py": None}, r"has no rgbd-activity\.py in"),
        ({"config__toml": None}, r"has no config\.toml in"),
        ({"config__toml": "[room"}, r"config\.toml is no readable TOML"),
        ({"rgbd_activity__py": "built = 1\n"}, r"has no function build\(config, unit\)"),
    ],
)
def test_what_a_recipe_lacks_is_named(
    write_recipe: WriteRecipe, tmp_path: Path, files: dict[str, str | None], message: str
) -> None:
    with pytest.raises(DataError, match=message):
        find_recipe(str(broken(write_recipe, tmp_path, **files)))


@pytest.mark.parametrize("section", ["room", "life", "camera", "poses", "recording"])
def test_a_misspelt_setting_fails_with_its_name(write_recipe: WriteRecipe, tmp_path: Path, section: str) -> None:
    folder = tmp_path / "rgbd-activity"
    write_recipe(folder, {section: {"durration": 3}})
    words = rf"scene number 0: config section \[{section}\] has unknown keys \['durration'\]"
    with pytest.raises(HsbenchError, match=words):
        list(generate(Job(str(folder), 0, ((0, "train"),), "none", "raycast"), tmp_path / "out"))
    assert list((tmp_path / "out" / "episodes").iterdir()) == []


def test_a_failure_of_a_recipe_says_where_and_keeps_its_cause(write_recipe: WriteRecipe, tmp_path: Path) -> None:
    code = "def build(config, unit):\n    raise ZeroDivisionError('x / 0')\n    yield\n"
    job = Job(str(broken(write_recipe, tmp_path, rgbd_activity__py=code)), 3, ((7, "train"),), "none", "raycast")
    where = "recipe rgbd-activity, seed 3, scene number 7: ZeroDivisionError: x / 0"
    with pytest.raises(RuntimeError, match=where) as error:
        list(generate(job, tmp_path / "out"))
    assert isinstance(error.value.__cause__, ZeroDivisionError)


def test_an_imported_room_is_one_scene_of_one_split(rgbd: Path, short_recipe: Path, tmp_path: Path) -> None:
    """Whatever the number of a unit, so that no room is both trained on and tested on."""
    imported = tmp_path / "scene"
    imported.mkdir()
    for name in ("scene.json", "scene.npz"):
        shutil.copy(rgbd / "episodes" / "rgbd-activity-000000" / "truth" / name, imported)
    recipe = tmp_path / "recipe" / "rgbd-activity"
    shutil.copytree(short_recipe, recipe)
    config = recipe / "config.toml"
    config.write_text('scene = "../../scene"\n' + config.read_text())
    out = tmp_path / "out"
    list(generate(Job(str(recipe), 0, (UNITS[0], UNITS[2]), "none", "raycast"), out))
    data = load(out, truth=True)
    assert len(data) == 2
    assert set(data.scene_ids) == {read_scene(imported).scene_id}
    assert {row["split"] for row in data.rows} == {"test-novel"}
    pieces = sorted(item.category_name for item in read_scene(imported).objects)
    for episode in data:
        assert sorted(item.category_name for item in episode.truth.scene.objects) == pieces
        assert verify_episode(episode) == []
    assert not np.array_equal(data[0].truth.poses.poses.joints_m, data[1].truth.poses.poses.joints_m)
    before = find_recipe(str(recipe)).sha256
    find_recipe.cache_clear()
    shutil.copy(rgbd / "episodes" / f"rgbd-activity-{UNITS[2][0]:06d}" / "truth" / "scene.npz", imported)
    assert find_recipe(str(recipe)).sha256 != before  # what is filmed decides what is made
    shutil.rmtree(imported)
    find_recipe.cache_clear()
    with pytest.raises(DataError, match="expected a folder that hsbench import scene made"):
        find_recipe(str(recipe))


def test_a_recipe_may_give_several_episodes_of_a_scene(short_recipe: Path, tmp_path: Path) -> None:
    """One room and one life, filmed twice: the second camera's episode is a unit of its own in the index."""
    recipe = tmp_path / "recipe" / "rgbd-activity"
    shutil.copytree(short_recipe, recipe)
    code = recipe / "rgbd-activity.py"
    code.write_text(
        code.read_text().replace("def build(", "def _build(")
        + "\nfrom dataclasses import replace\n\ndef build(config, unit):\n"
        "    for episode in _build(config, unit):\n"
        "        yield episode\n"
        "        yield replace(episode, episode_id=episode.episode_id + '-b')\n"
    )
    out = tmp_path / "out"
    job = Job(str(recipe), 0, UNITS[:1], "none", "raycast")
    made = list(generate(job, out))
    assert made == ["rgbd-activity-000000", "rgbd-activity-000000-b"]
    data = load(out, truth=True)
    assert data.episode_ids == tuple(made)
    assert set(data.scene_ids) == {"scene-000000"}
    assert verify_files(out) == []
    assert verify_episode(data[1]) == []

    whole = contents(out)
    shutil.rmtree(out / "episodes" / made[0])  # as a kill leaves it before the first, which comes into place last
    (out / "episodes" / made[1] / "manifest.json").unlink()
    assert list(generate(job, out)) == made
    assert contents(out) == whole


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (
            "yield replace(episode, episode_id='other')",
            "its first episode is .'other'.; expected 'rgbd-activity-000000'",
        ),
        ("yield episode; raise ZeroDivisionError('x / 0')", "ZeroDivisionError"),
        ("if False: yield episode", "its first episode is ..; expected"),
    ],
)
def test_a_unit_is_whole_or_not_there(short_recipe: Path, tmp_path: Path, body: str, words: str) -> None:
    recipe = tmp_path / "recipe" / "rgbd-activity"
    shutil.copytree(short_recipe, recipe)
    code = recipe / "rgbd-activity.py"
    code.write_text(
        code.read_text().replace("def build(", "def _build(")
        + "\nfrom dataclasses import replace\n\ndef build(config, unit):\n"
        f"    for episode in _build(config, unit):\n        {body}\n"
    )
    with pytest.raises((HsbenchError, RuntimeError), match=words):
        list(generate(Job(str(recipe), 0, UNITS[:1], "none", "raycast"), tmp_path / "out"))
    assert list((tmp_path / "out" / "episodes").iterdir()) == []
