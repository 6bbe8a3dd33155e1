"""First use, dwell, visits and curves against plain loops over cells and moments, and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.schema.events import EventTable
from hsbench.schema.poses import PoseTable
from hsbench.schema.skeletons import KINECT_V2
from hsbench.schema.states import Action, Affordance
from hsbench.truth.revealed import FEET_M, GAP_S, HAND_M, cell_use, in_contact, revealed, share_by_time

SIDE, CELL = 8, 0.5
EIGHTHS = st.integers(-20, 20).map(lambda k: k / 8)


def by_loop(points, times, person, radius):
    """From the definitions, cell by cell; all numbers are eighths."""
    first = np.full((SIDE, SIDE), np.inf)
    dwell, visits = np.zeros((SIDE, SIDE)), np.zeros((SIDE, SIDE), dtype=int)
    for i in range(SIDE):
        for j in range(SIDE):
            x, y = (SIDE / 2 - i - 0.5) * CELL, (SIDE / 2 - j - 0.5) * CELL
            for who in set(person):
                rows = [k for k in range(len(times)) if person[k] == who]
                inside = [(points[k][0] - x) ** 2 + (points[k][1] - y) ** 2 <= radius**2 for k in rows]
                for n, k in enumerate(rows):
                    if not inside[n]:
                        continue
                    first[i, j] = min(first[i, j], times[k])
                    after = times[rows[n + 1]] - times[k] if n + 1 < len(rows) else 0.0
                    dwell[i, j] += min(after, GAP_S)
                    goes_on = n > 0 and inside[n - 1] and times[k] - times[rows[n - 1]] <= GAP_S
                    visits[i, j] += not goes_on
    return first, dwell, visits


@settings(max_examples=60)
@given(
    st.lists(st.tuples(EIGHTHS, EIGHTHS, st.integers(0, 6), st.integers(1, 2)), max_size=14),
    st.sampled_from([0.25, 0.5, 1.125]),
)
def test_use_of_cells_is_the_plain_loops(rows, radius) -> None:
    points = np.array([r[:2] for r in rows]).reshape(-1, 2)
    times = np.cumsum([r[2] / 8 for r in rows])
    person = np.array([r[3] for r in rows], dtype=np.int32)
    found = cell_use(points, times, person, radius, SIDE, CELL)
    first, dwell, visits = by_loop(points.tolist(), times.tolist(), person.tolist(), radius)
    assert np.array_equal(found.first_s, first.astype(np.float32))
    assert np.array_equal(found.dwell_s, dwell.astype(np.float32))
    assert np.array_equal(found.visits, visits)
    assert np.array_equal(np.isfinite(found.first_s), found.visits > 0)


def test_a_cell_by_hand() -> None:
    # one person comes, goes away, comes again, is lost for longer than the gap, and is back
    x = [0.1, 0.1, 2.0, 0.1, 0.1, 0.1]
    times = [1.0, 1.25, 1.5, 1.75, 5.0, 5.25]
    found = cell_use(np.column_stack([x, np.full(6, 0.1)]), np.array(times), np.ones(6, np.int32), 0.3, SIDE, CELL)
    assert found.first_s[3, 3] == 1.0  # the cell from 0 to .5 m ahead and to the left
    assert found.visits[3, 3] == 3
    assert found.dwell_s[3, 3] == 0.25 + 0.25 + GAP_S + 0.25 + 0.0
    assert found.visits.sum() == 4  # and the place at 2 m lies on the border: within .3 m of no other middle
    assert found.visits[0, 3] == 1


def test_rows_out_of_order_are_refused() -> None:
    with pytest.raises(SchemaError, match="times_s decrease"):
        cell_use(np.zeros((2, 2)), np.array([1.0, 0.5]), np.ones(2, np.int32), 0.3, SIDE, CELL)


# ---------------------------------------------------------------- poses and events


def scene_of_use() -> tuple[PoseTable, np.ndarray, EventTable]:
    """Person 1 stands at (2, 0), then sits at (1, 1) and touches (0, 1) with the left hand; person 2 lies elsewhere."""
    n = 5
    joints = np.full((2 * n, 25, 3), 50.0, dtype=np.float32)
    base, left = KINECT_V2.index("spine_base"), KINECT_V2.index("hand_tip_left")
    joints[0:4:2, base, :2], joints[4:10:2, base, :2] = (2.0, 0.0), (1.0, 1.0)
    joints[::2, left, :2] = (0.0, 1.0)
    joints[1::2, base, :2] = (-1.0, -1.0)
    stamps = np.repeat(np.arange(n, dtype=np.int64) * 250_000_000, 2) + 7
    person = np.tile(np.array([1, 2], dtype=np.int32), n)
    poses = PoseTable(KINECT_V2.name, stamps, person, np.full((2 * n, 25), 2, np.uint8), joints)
    stand, sit, interact, ignored = Action.STAND, Action.SIT, Action.INTERACT, Action.IGNORED
    action = np.empty(2 * n, dtype=np.uint8)
    action[::2], action[1::2] = (stand, stand, sit, interact, interact), ignored
    events = EventTable(
        np.array([1, 1, 2], dtype=np.int32), ("sit", "touch", "touch"), np.array([4, 5, 5], dtype=np.int32),
        ("seat", "top", "top"), np.array([7 + 500_000_000, 7 + 750_000_000, 10**12], dtype=np.int64),
        np.array([7 + 10**9, 7 + 10**9, 10**12], dtype=np.int64), ("pelvis,foot_left", "hand_left", "hand_right"),
    )  # fmt: skip
    return poses, action, events


def middle(use: np.ndarray, x: float, y: float, cell: float) -> float:
    half = len(use) / 2
    return use[int(half - x / cell), int(half - y / cell)]


def test_floor_seat_and_part_by_hand() -> None:
    poses, action, events = scene_of_use()
    cell = 0.05
    found = revealed(poses, action, events, 7, 128, cell)
    floor, seat, part = (found[k] for k in (Affordance.WALKABLE, Affordance.SITTABLE, Affordance.INTERACTABLE))
    assert middle(floor.first_s, 2.0 - 0.02, 0.02, cell) == 0.0
    assert middle(floor.dwell_s, 2.0 - 0.02, 0.02, cell) == 0.25  # the moment of sitting down belongs to the seat
    assert middle(seat.first_s, 1.02, 1.02, cell) == 0.5
    assert middle(part.first_s, 0.02, 1.02, cell) == 0.75
    assert np.isfinite(floor.first_s).sum() == pytest.approx(np.pi * FEET_M**2 / cell**2, rel=0.03)
    assert np.isfinite(part.first_s).sum() == pytest.approx(np.pi * HAND_M**2 / cell**2, rel=0.1)
    for use in found.values():  # nobody on the floor where somebody lies, no hand of person 2 before its event
        assert np.isinf(middle(use.first_s, -1.0, -1.0, cell))


def test_contacts_belong_to_a_person_a_part_and_a_time() -> None:
    poses, _, events = scene_of_use()
    assert np.flatnonzero(in_contact(poses, events, "pelvis")).tolist() == [4, 6, 8]
    assert np.flatnonzero(in_contact(poses, events, "hand_left")).tolist() == [6, 8]
    assert not in_contact(poses, events, "hand_right").any()
    assert not in_contact(poses, events, "foot").any()  # names are whole


def test_a_shorter_life_reveals_the_same_so_far() -> None:
    poses, action, events = scene_of_use()
    full = revealed(poses, action, events, 7, 64, 0.1)
    short = revealed(poses.until(7 + 500_000_000), action[:6], events, 7, 64, 0.1)
    for kind in full:
        assert np.array_equal(short[kind].first_s, np.where(full[kind].first_s <= 0.5, full[kind].first_s, np.inf))


def test_foreign_skeletons_are_refused() -> None:
    poses, action, events = scene_of_use()
    flat = PoseTable("coco-17", poses.timestamp_ns, poses.track_id, poses.joint_state[:, :17], poses.joints_m[:, :17])
    with pytest.raises(SchemaError, match="coco-17 has no joint hand_tip_left, hand_tip_right, spine_base"):
        revealed(flat, action, events, 0, 8, 0.5)


# ---------------------------------------------------------------- curves


@given(st.lists(st.one_of(st.integers(0, 8).map(lambda k: k / 8), st.just(np.inf)), min_size=1, max_size=12), st.data())
def test_shares_are_counts(first, data) -> None:
    of = np.array(data.draw(st.lists(st.booleans(), min_size=len(first), max_size=len(first))))
    times = (0.0, 0.125, 0.5, 2.0)
    found = share_by_time(np.array(first, dtype=np.float32), of, times)
    chosen = [f for f, o in zip(first, of, strict=True) if o]
    if not chosen:
        assert found is None
    else:
        assert found.tolist() == [sum(f <= t for f in chosen) / len(chosen) for t in times]
        assert (np.diff(found) >= 0).all()


def test_a_time_counts_whatever_the_float() -> None:
    """0.1 is larger in single than in double precision."""
    assert share_by_time(np.array([0.1], dtype=np.float32), np.array([True]), (0.1,)).tolist() == [1.0]
    with pytest.raises(SchemaError, match=r"of has shape \(2,\); expected \(3,\)"):
        share_by_time(np.zeros(3), np.ones(2, dtype=bool), (1.0,))
