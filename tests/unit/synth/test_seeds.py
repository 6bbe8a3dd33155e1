"""Named streams: a name gives the same numbers whatever else was drawn; settings refuse what they do not know."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.synth.config import settings
from hsbench.synth.placement import CameraConfig
from hsbench.synth.seeds import Seeds

NAMES = st.text("abcdefgh-0123456789", min_size=1, max_size=6)
PATHS = st.tuples(st.integers(0, 2**63), st.lists(NAMES, max_size=3).map(tuple), NAMES)


def draw(seed: int, path: tuple[str, ...], name: str | int, count: int = 4) -> list[int]:
    node = Seeds(seed)
    for step in path:
        node = node.child(step)
    return node.rng(name).integers(0, 2**63, count).tolist()


@given(PATHS)
def test_a_stream_depends_on_its_name_alone(key: tuple) -> None:
    root = Seeds(key[0])
    for other in ("x", "y", *key[1]):
        root.child(other).rng("z").random(100)
        root.rng(other).random(3)
    assert draw(*key) == draw(*key)
    assert draw(*key, count=2) == draw(*key)[:2]


@given(st.lists(PATHS, min_size=2, max_size=8, unique=True))
def test_other_seeds_paths_and_names_are_other_streams(keys: list[tuple]) -> None:
    streams = [tuple(draw(*key)) for key in keys]
    assert len(set(streams)) == len(keys)
    assert [tuple(draw(*key)) for key in reversed(keys)] == streams[::-1]


def test_seed_zero_is_a_seed_like_any_other() -> None:
    firsts = {tuple(draw(seed, ("a",), "b")) for seed in (0, 1, 2, 10, 12)}
    assert len(firsts) == 5
    assert draw(0, ("a",), "b") == draw(0, ("a",), "b")
    assert draw(1, ("2",), "b") != draw(12, (), "b")
    assert draw(0, ("ab",), "c") != draw(0, ("a",), "bc") != draw(0, ("a", "b"), "c")


def test_numbers_are_names() -> None:
    assert Seeds(3).child(12) == Seeds(3).child("12") == Seeds(3, ("12",))
    assert draw(3, (), 7) == draw(3, (), "7")


@given(PATHS)
def test_the_stream_is_philox_keyed_by_a_hash_of_seed_path_and_name(key: tuple) -> None:
    seed, path, name = key
    digest = hashlib.blake2b("\x1f".join([str(seed), *path, name]).encode(), digest_size=16).digest()
    expected = np.random.Generator(np.random.Philox(key=int.from_bytes(digest, "little")))
    assert draw(seed, path, name) == expected.integers(0, 2**63, 4).tolist()


def test_another_process_draws_the_same() -> None:
    code = "from hsbench.synth.seeds import Seeds; print(Seeds(5).child('a').rng(2).integers(0, 2**63, 4).tolist())"
    run = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONHASHSEED": "77"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.strip() == str(draw(5, ("a",), 2))


def test_streams_are_even_and_not_alike() -> None:
    values = np.array([Seeds(0).child(k).rng("layout").random(50) for k in range(200)])
    assert abs(values.mean() - 0.5) < 4 * np.sqrt(1 / 12 / values.size)
    correlation = np.corrcoef(values)
    np.fill_diagonal(correlation, 0.0)
    assert np.abs(correlation).max() < 0.75  # 200 x 199 / 2 pairs of 50 numbers: chance alone stays below .7


# ---------------------------------------------------------------- settings


@dataclass(frozen=True)
class Knobs:
    size: int = 3
    ranges: tuple[tuple[float, float], ...] = ()
    name: str = "a"


def test_settings_from_a_table() -> None:
    assert settings(Knobs, {}, "knobs") == Knobs()
    table = {"size": 0, "ranges": [[0.1, 0.2], [3, 4]], "name": ""}
    assert settings(Knobs, table, "knobs") == Knobs(0, ((0.1, 0.2), (3, 4)), "")
    assert hash(settings(Knobs, table, "knobs")) == hash(Knobs(0, ((0.1, 0.2), (3, 4)), ""))
    assert table["ranges"] == [[0.1, 0.2], [3, 4]]


def test_a_misspelt_setting_fails_and_names_those_there_are() -> None:
    with pytest.raises(SchemaError) as error:
        settings(Knobs, {"size": 1, "nmae": "b", "range": 2}, "knobs")
    assert str(error.value) == (
        "config section [knobs] has unknown keys ['nmae', 'range']; expected some of ['name', 'ranges', 'size']"
    )


def test_settings_of_the_camera() -> None:
    config = settings(CameraConfig, {"height_m": [1.0, 2.0], "width_px": 320}, "camera")
    assert config == CameraConfig(height_m=(1.0, 2.0), width_px=320)
    assert config.camera.cx_px == 160.0
