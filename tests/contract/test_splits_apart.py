"""Splits keep apart what they promise: a scene is in one split of all data sets, ``test-novel`` is made of its own."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from types import ModuleType
from typing import Any

import pytest

import hsbench.synth.panorama as panorama
import hsbench.synth.rgbd as rgbd
from hsbench.io.resources import resource
from hsbench.io.splits import SPLITS, read_splits
from hsbench.synth.activities.schedule import COMMON_HABITS
from hsbench.synth.activity_maps.config import PlanarLifeConfig
from hsbench.synth.config import settings
from hsbench.synth.furniture import FAMILIES
from hsbench.synth.recipes import SPLIT_STRIDE, Recipe, Unit, find_recipe
from hsbench.synth.rgbd import RgbdSettings
from hsbench.synth.rooms import TEMPLATES, HomeConfig, RoomConfig
from hsbench.synth.seeds import Seeds

FILES = sorted(resource("splits").glob("*/*.json"))
RECIPES = sorted({path.parent.name for path in FILES})
NOVEL = "test-novel"
UNITS = 60  # of each split: one in ten or so is a whole home


def test_a_scene_id_is_in_one_split_of_all_data_sets() -> None:
    found: dict[str, set[str]] = defaultdict(set)
    for path in FILES:
        splits, recipe = read_splits(path.parent.name, path.stem), find_recipe(path.parent.name)
        for size in splits.scenes:
            for number, split in splits.numbers(size):
                scene_id, told = recipe.known_as(number, split)
                assert told == split
                found[scene_id].add(split)
    assert len(found) > 300
    assert {scene_id: names for scene_id, names in found.items() if len(names) > 1} == {}


def test_no_two_splits_share_a_block_of_numbers() -> None:
    """However long a split grows, its numbers stay its own: of each block of a thousand but for train's ten."""
    blocks: dict[int, set[str]] = defaultdict(set)
    for path in FILES:
        splits = read_splits(path.parent.name, path.stem)
        for number, split in splits.numbers("full"):
            blocks[number // SPLIT_STRIDE].add(split)
        used = [first for first, count in splits.scenes["full"].values() if count]
        assert all(first % SPLIT_STRIDE == 0 for first in used)
    assert {block: names for block, names in blocks.items() if len(names) > 1} == {}


# ---------------------------------------------------------------- test-novel


class SceneAskedError(Exception):
    """A recipe asked for a scene: (style families, arrangement templates)."""


def ask_scene(scene_id: str, seeds: Seeds, room: RoomConfig, families: Sequence[str]) -> None:
    raise SceneAskedError(families, [name for name, _ in room.templates])


def ask_home(scene_id: str, seeds: Seeds, home: HomeConfig, families: Sequence[str]) -> None:
    raise SceneAskedError(families, [name for name, _ in home.room.templates])


def asked(recipe: Recipe, split: str) -> tuple[set[str], set[str]]:
    """All families and templates of which a recipe draws the first scenes of a split."""
    families: set[str] = set()
    templates: set[str] = set()
    first, _ = read_splits(recipe.name).scenes["full"][split]
    for number in range(first, first + UNITS):
        unit = Unit(Seeds(0).child("scene").child(number), number, split, "none", None)
        with pytest.raises(SceneAskedError) as error:
            next(iter(recipe.build(recipe.config, unit)))
        families |= set(error.value.args[0])
        templates |= set(error.value.args[1])
    return families, templates


@pytest.fixture(params=RECIPES)
def recipe(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Recipe:
    """A recipe that stops where it would build a scene."""
    found = find_recipe(request.param)
    places: list[ModuleType | dict[str, Any]] = [rgbd, panorama, found.build.__globals__]
    for place in places:
        names = place if isinstance(place, dict) else vars(place)
        for name, stand_in in (("build_scene", ask_scene), ("build_home", ask_home)):
            if name in names:
                monkeypatch.setitem(names, name, stand_in)
    return found


def test_novel_scenes_have_style_families_of_their_own(recipe: Recipe) -> None:
    drawn = {split: asked(recipe, split)[0] for split in SPLITS}
    assert drawn[NOVEL]
    for split in SPLITS[:-1]:
        assert drawn[split]
        assert not drawn[split] & drawn[NOVEL]
    assert {name for name, style in FAMILIES.items() if style.novel} >= drawn[NOVEL]


def test_novel_scenes_have_arrangements_of_their_own(recipe: Recipe) -> None:
    drawn = {split: asked(recipe, split)[1] for split in SPLITS}
    for split in SPLITS[:-1]:
        assert not drawn[split] & drawn[NOVEL]
    assert all(TEMPLATES[name].novel for name in drawn[NOVEL])


def test_novel_scenes_have_habits_of_their_own(recipe: Recipe) -> None:
    if recipe.name == "activity-maps":
        novel = recipe.config["novel-life"]
        common = asdict(settings(PlanarLifeConfig, recipe.config["life"], "life"))
        assert novel["speed_m_s"][1] <= common["speed_m_s"][0]
        assert novel["stand_s"][0] >= common["stand_s"][1]
        return
    config = {**recipe.config, "camera": {}, "recording": {}}
    common, novel = (RgbdSettings.of(config, split).life.habits for split in ("train", NOVEL))
    assert set(common) <= set(COMMON_HABITS)
    assert novel
    assert not set(common) & set(novel)
