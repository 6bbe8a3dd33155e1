"""Lying places: heads on pillows or by an armrest, bodies along beds and sofas, whatever the furniture."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from hsbench.geometry.transforms import apply, invert, planar
from hsbench.schema.scene import Part, SceneObject
from hsbench.synth.activities.beds import lie_places
from hsbench.synth.activities.seats import seat_surfaces
from hsbench.synth.furniture import FAMILIES, build
from hsbench.synth.people.body import Body
from hsbench.synth.people.lying import LiePose, lying_length_m
from hsbench.synth.people.motion import SeatPose
from tests.unit.synth.living_rooms import bed, room, sofa

BODIES = (Body(1.56, shape="woman-small"), Body(1.78), Body(1.92, shape="man-tall"))
POSE = planar(2.1, 2.4, 0.7)


def places(item: SceneObject, body: Body) -> list[tuple[Part, SeatPose, LiePose]]:
    scene = room(5.0, 5.0, item)
    return [(s.part, *place) for s in seat_surfaces(scene) if s.item is item for place in lie_places(s, body)]


def local(item: SceneObject, *points: tuple[float, float, float]) -> np.ndarray:
    return apply(invert(item.scene_T_object), np.array(points))


def held(part: Part, point: np.ndarray) -> bool:
    low, high = part.vertices[:, :2].min(axis=0), part.vertices[:, :2].max(axis=0)
    return bool((low <= point[:2]).all() and (point[:2] <= high).all())


@pytest.mark.parametrize(("family", "seed"), list(product(FAMILIES, range(4))))
def test_heads_lie_on_pillows_and_feet_towards_the_foot_of_every_bed(family: str, seed: int) -> None:
    parts = build("bed", np.random.default_rng(seed), FAMILIES[family])
    item = SceneObject(10, "bed", POSE, parts)
    pillows = [p for p in parts if p.name.startswith("pillow")]
    for body in BODIES[:2]:
        found = places(item, body)
        assert found
        for part, seat, lie in found:
            head, feet, pelvis = local(item, lie.head_m, lie.feet_m, seat.pelvis_m)
            assert sum(held(p, head) for p in pillows) == 1
            assert abs(head[0] - feet[0]) < 1e-3
            assert head[1] - feet[1] == pytest.approx(lying_length_m(body), abs=1e-3)
            assert held(part, pelvis)
            assert any(held(p, feet) for p in parts if p.role == "mattress")


def test_every_duvet_of_a_double_bed_has_its_sleeper() -> None:
    for seed in range(12):
        parts = build("bed", np.random.default_rng(seed), FAMILIES[next(iter(FAMILIES))])
        item = SceneObject(10, "bed", POSE, parts)
        duvets = [p for p in parts if p.role == "mattress"]
        for duvet in duvets:
            lies = [lie for part, _, lie in places(item, BODIES[1]) if part is duvet]
            assert lies
            for lie in lies:
                assert held(duvet, local(item, lie.feet_m)[0])


@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.shape)
def test_one_lies_along_a_sofa_with_the_head_at_an_arm_and_the_face_to_the_room(body: Body) -> None:
    item = sofa(10, 2.1, 2.4, 0.7)
    found = places(item, body)
    assert bool(found) == (lying_length_m(body) <= 1.6 - 0.15)
    for part, seat, lie in found:
        head, feet, pelvis = local(item, lie.head_m, lie.feet_m, seat.pelvis_m)
        assert 0.15 - 1e-3 <= 0.8 - abs(head[0]) <= 0.22 + 1e-3  # from the arm
        assert head[1] == pytest.approx(feet[1], abs=1e-3)
        assert held(part, pelvis)
        to_feet = (feet - head)[:2] / np.linalg.norm((feet - head)[:2])
        facing = np.sin(lie.roll_rad) * np.array([-to_feet[1], to_feet[0]])  # on the left side: left of that way
        assert facing[1] <= 1e-3  # the sofa's front is its -y


def test_a_bed_without_bedding_is_lain_on_along_its_length() -> None:
    item = bed(10, 2.1, 2.4, 0.7)
    for _, _, lie in places(item, BODIES[1]):
        head, feet = local(item, lie.head_m, lie.feet_m)
        assert head[1] > feet[1]
        assert abs(head[0] - feet[0]) < 1e-3
