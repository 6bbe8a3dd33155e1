"""A small seed of a hidden split is found by trying all; docs/hidden-splits.md says why one of 128 bits is not.

The attack knows what is public: the recipe, the code, the scene numbers of a split, and the packed inputs. It makes no
room and no picture: the first draws of a unit give the height and the tilt of its camera, which are published.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest

import hsbench.datasets.packing as packing
from hsbench import load
from hsbench.cli.main import run
from hsbench.datasets.packing import pack_inputs, pack_truth
from hsbench.errors import DataError
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.polygons import signed_area
from hsbench.io.splits import read_splits
from hsbench.io.strict_json import read_json
from hsbench.synth.placement import CameraConfig
from hsbench.synth.recipes import find_recipe
from hsbench.synth.rgbd import RgbdSettings
from hsbench.synth.seeds import Seeds

KEY_BITS = 16
SMALL_SEED, FULL_SEED = 0xBEEF, 0xA1B2_C3D4_E5F6_0718_293A_4B5C_6D7E_8F90
SPLIT = "test-novel"
NUMBERS = [number for number, _ in read_splits("rgbd-activity").numbers("mini", SPLIT)]

Told = tuple[float, float]
"""Height and tilt of a camera."""


def first_draws(seed: int, number: int, camera: CameraConfig) -> Told:
    """What a unit tells of its camera."""
    rng = Seeds(seed).child("scene").child(number).rng("rgbd-camera")
    rng.uniform(-math.pi, math.pi)  # the heading
    height_m = float(quantise_m(rng.uniform(*camera.height_m)))
    return height_m, quantise_angle(math.radians(rng.uniform(*camera.tilt_deg)))


def attack(published: Iterable[Told], camera: CameraConfig, seeds: Iterable[int]) -> Iterator[tuple[int, int]]:
    """(seed, scene number) of everything that could have made what is published."""
    told = set(published)
    yield from ((seed, k) for seed in seeds for k in NUMBERS if first_draws(seed, k, camera) in told)


@pytest.fixture(scope="module")
def settings(short_recipe: Path) -> RgbdSettings:
    return RgbdSettings.of(find_recipe(str(short_recipe)).config, SPLIT)


@pytest.fixture(scope="module", params=[SMALL_SEED, FULL_SEED], ids=["16 bits", "128 bits"])
def made(
    request: pytest.FixtureRequest, made_once: Callable[[str, Callable[[Path], None]], Path], short_recipe: Path
) -> tuple[int, Path]:
    """(seed, the data set that an organiser made with it)."""

    def make(folder: Path) -> None:
        words = ["--split", SPLIT, "--seed", str(request.param), "--frames", "none", "--out", str(folder / "data")]
        assert run(["generate", str(short_recipe), *words]) == 0

    return request.param, made_once(f"seed-{request.param:x}", make) / "data"


def test_a_small_seed_is_found_and_a_full_one_is_not(
    made: tuple[int, Path], settings: RgbdSettings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seed, data = made
    assert read_json(data / "dataset.json")["seed"] == seed  # as it was, with all its bits
    if seed == SMALL_SEED:
        for pack in (pack_inputs, pack_truth):
            with pytest.raises(
                DataError, match=r"seed 48879 of a hidden split can be guessed; expected 128 random bits"
            ):
                list(pack(data, tmp_path / "refused"))
        assert list(tmp_path.iterdir()) == []
        monkeypatch.setattr(packing, "LEAST_SECRET_BITS", 0)
    list(pack_inputs(data, tmp_path / "inputs"))
    inputs = load(tmp_path / "inputs", frames=False)
    published = [(e.sensor.height_m, e.sensor.tilt_rad) for e in inputs]
    found = list(attack(published, settings.camera, range(2**KEY_BITS)))
    if seed == FULL_SEED:
        assert found == []
        assert list(attack(published, settings.camera, [seed])) == [(seed, k) for k in NUMBERS]  # the code would see it
        return
    assert found == [(SMALL_SEED, k) for k in NUMBERS]
    whole = load(data, truth=True, frames=False)[0].truth.scene
    again = settings.scene(whole.scene_id, Seeds(found[0][0]).child("scene").child(found[0][1]).child("room"))
    assert [(o.category_name, o.object_id) for o in again.objects] == [
        (o.category_name, o.object_id) for o in whole.objects
    ]
    assert signed_area(again.rooms[0].outline_xy) == pytest.approx(signed_area(whole.rooms[0].outline_xy), abs=1e-3)


def test_streams_of_neighbouring_seeds_have_nothing_in_common() -> None:
    """No way to feel towards a seed: one bit apart, draws are as far apart as any."""
    base = np.array([Seeds(FULL_SEED).child(k).rng("layout").random() for k in range(2000)])
    for bit in (0, 63, 127):
        other = np.array([Seeds(FULL_SEED ^ (1 << bit)).child(k).rng("layout").random() for k in range(2000)])
        counts = np.histogram((base - other) % 1.0, bins=20, range=(0, 1))[0]
        assert ((counts - 100.0) ** 2 / 100.0).sum() < 43.8  # 99.9 % of chi-square with 19 degrees of freedom
