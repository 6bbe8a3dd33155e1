"""An explorer covers seats: cells as a disc about the pelvis says, whole beds and sofas in time, nothing run into."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from hsbench.geometry.transforms import planar
from hsbench.schema import Scene, SceneObject
from hsbench.schema.states import Affordance
from hsbench.synth.activities import Life, LifeConfig, live
from hsbench.synth.activities.measures import measure
from hsbench.synth.activities.seats import seat_surfaces
from hsbench.synth.activities.spots import INSET_M, Spots, is_roofed
from hsbench.synth.seeds import Seeds
from hsbench.truth.affordance import affordance_truth
from hsbench.truth.revealed import SEAT_M, revealed
from tests.unit.synth.living_rooms import bed, part, room

CELL_M, SIDE_CELLS = 0.05, 140


def bench() -> SceneObject:
    return SceneObject(12, "bench", planar(1.5, 1.4, 0.4), (part("seat", (-0.7, -0.2, 0.0), (0.7, 0.2, 0.45), "seat"),))


@cache
def explored() -> tuple[Scene, Life]:
    """A bedroom with a bench about the origin, and a life that explores it for twenty minutes."""
    scene = room(5.0, 4.0, bed(11, 3.9, 2.9, 0.0), bench()).moved(planar(-2.5, -2.0, 0.0))
    return scene, live(scene, Seeds(0), LifeConfig(duration_s=1200.0, unused_share=0.0, atypical_share=0.0, fps=10))


def test_what_is_sat_on_is_a_disc_and_gains_are_counts_of_what_is_left() -> None:
    spots = Spots.of(next(s for s in seat_surfaces(room(4.0, 3.0, bench())) if s.item.object_id == 12))
    assert len(spots.cells) * CELL_M**2 == pytest.approx(1.4 * 0.4, rel=0.15)
    rng = np.random.default_rng(0)
    for pelvis_xy in spots.places[rng.permutation(len(spots.places))[:6]]:
        before = spots.sat.copy()
        expected = [
            sum(
                np.hypot(*(cell - place)) <= SEAT_M + 1e-6 and not s
                for cell, s in zip(spots.cells, before, strict=True)
            )
            for place in spots.places
        ]
        assert spots.gains().tolist() == expected
        spots.sit(pelvis_xy)
        away = np.hypot(*(spots.cells - pelvis_xy).T)
        assert (spots.sat == (before | (away <= SEAT_M + 1e-6))).all()


@pytest.mark.parametrize(("bottom_m", "roofed"), [(0.7, False), (0.9, True), (1.3, True), (1.5, False)])
def test_below_an_upper_bunk_one_stays_where_one_sat_down(bottom_m: float, roofed: bool) -> None:
    seat = part("seat", (-0.7, -0.2, 0.0), (0.7, 0.2, 0.45), "seat")
    upper, back = (
        part(name, (-0.7, -0.2, bottom_m), (0.7, y, bottom_m + 0.1)) for name, y in (("a", 0.2), ("b", -0.1))
    )
    for above, expected in ((upper, roofed), (back, False)):
        item = SceneObject(12, "bench", planar(1.5, 1.4, 0.4), (seat, above))
        surface = next(s for s in seat_surfaces(room(4.0, 3.0, item)) if s.item.object_id == 12)
        assert is_roofed(surface) == expected


def test_a_moved_seat_is_sat_on_where_it_is() -> None:
    spots = Spots.of(next(s for s in seat_surfaces(room(4.0, 3.0, bench())) if s.item.object_id == 12))
    shift_xy = np.array([0.2, -0.1])
    turn = bench().scene_T_object[:2, :2]
    local = (spots.places - shift_xy - (1.5, 1.4)) @ turn
    inside = (np.abs(local) <= np.array([0.7, 0.2]) - INSET_M + 1e-3).all(axis=1)
    assert (spots.holds(shift_xy) == inside).all()


def test_an_explorer_sits_on_almost_all_of_a_bed_and_a_bench() -> None:
    scene, life = explored()
    truth = affordance_truth(scene, side_cells=SIDE_CELLS, cell_m=CELL_M)
    used = revealed(life.poses, life.action, life.events, 0, SIDE_CELLS, CELL_M)
    for kind in (Affordance.SITTABLE, Affordance.WALKABLE):
        there = (truth.labels >> kind & 1).astype(bool)
        assert there.sum() > 300
        assert np.isfinite(used[kind].first_s[there]).mean() > 0.94  # rims of a bed with an unlucky lattice are left


def test_moving_along_runs_into_nothing_and_keeps_to_the_seat() -> None:
    scene, life = explored()
    found = measure(scene, life)
    assert "sit" not in dict(found.deep_in)
    assert max(found.seat_error_m) < 0.03
    assert found.over_limit == 0
