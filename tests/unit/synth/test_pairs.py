"""Hidden objects and what takes their place; the bytes of a pair of a real recipe."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Scene, SceneObject
from hsbench.schema.sensor import Sensor
from hsbench.synth.furniture import family
from hsbench.synth.generate import Job, generate
from hsbench.synth.pairs import ANYWHERE, exchanged, hidden_objects
from hsbench.truth.validity import floating
from tests.unit.synth.living_rooms import chair, part, room

SENSOR = Sensor("rgbd", PinholeCamera(80, 60, 55.0, 55.0, 40.0, 30.0), 1.2, 0.0)
FRAME = planar(-0.5, -2.0, 0.0)  # the camera stands at the west wall's middle and looks east
STYLE = family("classic")


def block(
    number: int, category: str, x: float, y: float, size: tuple[float, float, float], z: float = 0.0
) -> SceneObject:
    w, d, h = (np.array(size) / (2, 2, 1)).tolist()
    return SceneObject(number, category, planar(x, y, 0.0, z), (part("body", (-w, -d, 0), (w, d, h)),))


def seen_from_the_camera(*things: SceneObject) -> Scene:
    return room(6.0, 4.0, *things).moved(FRAME)


SCREEN = block(20, "wardrobe", 2.5, 2.0, (0.4, 2.4, 2.0))
BEHIND = block(21, "dresser", 4.5, 2.0, (0.9, 0.9, 0.9))
BESIDE = block(22, "dresser", 3.0, 0.4, (0.4, 0.4, 0.4))
HUNG = block(23, "picture", 5.95, 2.0, (0.05, 0.5, 0.4), z=1.0)
OUT_OF_SIGHT = block(24, "dresser", 0.2, 0.4, (0.3, 0.3, 0.3))


def test_what_stands_behind_something_is_hidden_and_nothing_else() -> None:
    scene = seen_from_the_camera(SCREEN, BEHIND, BESIDE, HUNG, OUT_OF_SIGHT)
    assert hidden_objects(scene, SENSOR) == (21,)


def test_what_only_a_moving_thing_hides_is_not_hidden() -> None:
    scene = seen_from_the_camera(SCREEN, BEHIND)
    assert hidden_objects(scene, SENSOR, frozenset({20})) == ()
    assert hidden_objects(scene, SENSOR, frozenset({21})) == ()  # and what moves is not fit for it


def test_a_slit_narrower_than_a_pixel_is_found() -> None:
    """At 2.3 m a pixel of the camera is 4 cm wide, a ray of the finer one 1.4 cm."""
    halves = [block(30 + k, "wardrobe", 2.5, 2.0 + s, (0.4, 1.2, 2.0)) for k, s in enumerate((-0.61, 0.61))]
    assert hidden_objects(seen_from_the_camera(BEHIND, *halves), SENSOR) == ()
    assert hidden_objects(seen_from_the_camera(SCREEN, BEHIND), SENSOR) == (21,)


def test_another_object_in_the_same_box() -> None:
    scene = seen_from_the_camera(SCREEN, BEHIND)
    kinds = set()
    for seed in range(20):
        other = exchanged(scene, 21, STYLE, np.random.default_rng(seed))
        assert other is not None
        new, old = other.object(21), scene.object(21)
        kinds.add(new.category_name)
        assert new.category_name in set(ANYWHERE) - {"dresser"}
        assert new.category.group == "furniture"  # both of a pair count for detection
        assert np.array_equal(new.scene_T_object, old.scene_T_object)
        for points, inside in ((new.vertices, old.vertices),):
            assert (points.min(axis=0) >= inside.min(axis=0) - 1e-6).all()
            assert (points.max(axis=0) <= inside.max(axis=0) + 1e-6).all()
        assert [o for o in other.objects if o.object_id != 21] == [o for o in scene.objects if o.object_id != 21]
        assert floating(other) == ()
    assert len(kinds) > 3


def test_nothing_fits_into_a_matchbox_and_nothing_is_taken_from_under_a_thing() -> None:
    tiny = seen_from_the_camera(block(21, "dresser", 4.5, 2.0, (0.05, 0.05, 0.05)))
    assert exchanged(tiny, 21, STYLE, np.random.default_rng(0)) is None
    low = block(21, "dresser", 4.5, 2.0, (2.0, 0.25, 0.9))
    vase = block(22, "vase", 4.5 - 0.95, 2.0, (0.1, 0.1, 0.3), z=0.9)
    for seed in range(10):
        other = exchanged(seen_from_the_camera(low, vase), 21, STYLE, np.random.default_rng(seed))
        assert other is None or floating(other) == ()


def test_a_chair_may_stand_hidden() -> None:
    assert hidden_objects(seen_from_the_camera(SCREEN, chair(25, 4.5, 2.0, 0.0)), SENSOR) == (25,)


@pytest.mark.slow
def test_pairs_share_every_published_byte(tmp_path: Path) -> None:
    list(generate(Job("pairs", 0, ((20000, "test-seen"),), "all", "raycast"), tmp_path))
    base, twin, noise = (tmp_path / "episodes" / f"pairs-020000{v}" for v in ("", "-hidden", "-noise"))
    published = [p.relative_to(base) for top in ("inputs", "recording") for p in (base / top).rglob("*") if p.is_file()]
    assert len(published) >= 5
    for path in published:
        assert (base / path).read_bytes() == (twin / path).read_bytes(), path
    assert (base / "truth" / "occupancy.npz").read_bytes() != (twin / "truth" / "occupancy.npz").read_bytes()
    same = [(base / p).read_bytes() == (noise / p).read_bytes() for p in published]
    assert 0 < sum(same) < len(same)  # the film is the same, what a detector gives is not
