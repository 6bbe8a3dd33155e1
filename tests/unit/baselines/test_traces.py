"""Traces and the bins made of them, by hand and by plain loops."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lived_rooms import figure, lived

from hsbench.baselines.controls import topdown
from hsbench.baselines.controls.places import (
    COLOURS,
    DISTANCES,
    LEVELS,
    PRESENCE_BINS,
    colour,
    presence,
)
from hsbench.baselines.posture import postures
from hsbench.baselines.traces import KEPT_SHARE, own_traces, traces
from hsbench.geometry.polygons import contains
from hsbench.schema.poses import PoseTable
from hsbench.schema.skeletons import COCO_18


def in_metres(joints: np.ndarray, interval_s: float = 0.1) -> PoseTable:
    n = len(joints)
    return PoseTable(
        COCO_18.name,
        (np.arange(n) * interval_s * 1e9).astype(np.int64),
        np.ones(n, np.int32),
        np.full((n, 18), 2, np.uint8),
        joints.astype(np.float32),
    )


def test_standing_sitting_and_reaching_leave_their_own_traces() -> None:
    joints = np.stack([figure((2.0, 0.0)), figure((0.0, 1.5), sits=True), figure((-1.0, 1.0), reach_m=0.4)])
    table = in_metres(joints, interval_s=30.0)
    found = traces(table)
    assert postures(table).stands.tolist() == [True, False, True]
    assert np.allclose(found.walked, [[2.0, 0.0, 0.0], [-1.0, 1.0, 0.0]], atol=1e-6)
    assert np.allclose(found.sat[:, :2], [[0.0, 1.5]], atol=1e-6)
    assert found.sat[0, 2] == pytest.approx(0.45, abs=0.01)
    assert np.allclose(found.hands, joints[2][COCO_18.index("wrist_left")][None], atol=1e-6)
    assert found.share == pytest.approx(1 / 3)


def test_a_boundary_holds_most_places_and_no_lonely_one() -> None:
    rng = np.random.default_rng(0)
    places = np.vstack([rng.uniform(1, 2, (200, 2)), [[30.0, 30.0]]])
    found = traces(in_metres(np.stack([figure(p) for p in places])))
    inside = contains(found.boundary, places)
    assert inside.mean() > KEPT_SHARE - 0.1  # corners of a hull are not inside by the even-odd rule
    assert not inside[-1]
    assert found.boundary.max() <= 2.0 + 1e-6


@settings(max_examples=20)
@given(st.integers(0, 99), st.sampled_from([0.07, 0.003]))
def test_bins_of_presence_by_plain_loops(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    places, radius, cell, side = rng.uniform(0.1, 0.5, (int(rng.integers(1, 30)), 2)), 0.11, 0.05, 12
    bins = presence(places, share, (0.0, 0.0), (side, side), cell, radius)
    centres = [(np.array([i, j]) + 0.5) * cell for i in range(side) for j in range(side)]
    held = [min(share * sum(np.hypot(*(c - p)) <= radius for p in places), 1.0) for c in centres]
    present = [c for c, s in zip(centres, held, strict=True) if s > 0]
    for number, centre, part in zip(bins.ravel(), centres, held, strict=True):
        if part > 0:
            assert 2.0 ** (int(number) - LEVELS) < part <= 2.0 ** (int(number) - LEVELS + 1) * (1 + 1e-6)
        elif present:
            far = min(np.hypot(*(centre - c)) for c in present) / cell
            assert number == LEVELS - 1 + min(int(np.ceil(far - 1e-9)), DISTANCES)


def test_bins_where_nobody_was_or_somebody_always() -> None:
    nobody = presence(np.zeros((0, 2)), 1.0, (0.0, 0.0), (4, 4), 1.0, 1.0)
    assert (nobody == PRESENCE_BINS - 1).all()
    always = presence(np.full((3, 2), 2.0), 1.0, (0.0, 0.0), (4, 4), 1.0, 9.0)
    assert (always == LEVELS - 1).all()
    rarely = presence(np.full((1, 2), 2.0), 1e-9, (0.0, 0.0), (4, 4), 1.0, 9.0)
    assert (rarely == 0).all()


def test_colours_have_numbers_of_their_own() -> None:
    steps = np.arange(0, 256, 64, dtype=np.uint8)
    every = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1)
    assert sorted(colour(every).ravel().tolist()) == list(range(COLOURS))
    assert np.array_equal(colour(every + np.uint8(63)), colour(every))


def test_the_plan_has_the_largest_x_first_and_the_largest_y_left() -> None:
    cells = topdown.cells()
    assert cells[0, 0].tolist() == pytest.approx([6.375, 6.375])
    assert cells[-1, 0].tolist() == pytest.approx([-6.375, 6.375])
    episode = lived("activity-360", 3)
    found = own_traces(episode)
    bins = topdown.presence_bins(found)
    x, y = found.sat[:, :2].mean(axis=0)
    row, column = int((6.4 - x) / 0.05), int((6.4 - y) / 0.05)
    assert bins[1, row, column] < LEVELS
    assert bins[1, 255 - row, 255 - column] >= LEVELS
    assert np.array_equal(np.unique(topdown.by_place()), np.arange(topdown.CONSTANT_BINS))
    assert topdown.by_colour(episode, 1.5).max() < topdown.COLOUR_BINS
