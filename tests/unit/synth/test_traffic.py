"""Traffic: what is found free is free, by brute force over frames; nobody is shut in."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.synth.activities.traffic import (
    APART_AT_REST_M,
    APART_M,
    STRIDE_FRAMES,
    Traffic,
    is_bottleneck,
    without_lines,
)
from hsbench.truth.walkable import WalkMap

OPEN = np.ones((80, 60), dtype=bool)  # 4 m x 3 m


def crowd(people: int, free: np.ndarray = OPEN) -> Traffic:
    return Traffic(WalkMap(np.zeros(2), free), free, people)


def point(x: float, y: float) -> np.ndarray:
    return np.array([[x, y], [x, y]])


def walked(a: tuple[float, float], b: tuple[float, float], frames: int) -> np.ndarray:
    return np.linspace(a, b, frames)


def where(start: int, xy: np.ndarray, before: tuple[float, float], frame: int) -> tuple[np.ndarray, bool]:
    """A walker's place at a frame, and whether they walk."""
    if frame < start:
        return np.array(before), False
    return (xy[frame - start], True) if frame - start < len(xy) else (xy[-1], False)


@pytest.mark.parametrize(("behind_m", "aside_m", "is_free"), [(0.85, 0.0, False), (1.1, 0.0, True), (0.0, 0.7, True)])
def test_who_walks_behind_another_leaves_room_for_both_strides(behind_m: float, aside_m: float, is_free: bool) -> None:
    traffic = crowd(2)
    ahead = walked((1.5, 1.0), (3.5, 1.0), 61)  # 1 m/s
    after = ahead - [behind_m, -aside_m]
    traffic.go(0, 0, ahead, point(3.5, 1.0))
    rest = after[-1] - [0.0 if aside_m else 0.5, 0.0]
    assert (traffic.conflict(1, 0, after, np.stack([rest, rest])) == "") == is_free


def test_legs_ahead_of_who_moves_along_a_seat_are_in_the_way() -> None:
    traffic = crowd(2)
    pelvis = walked((1.0, 1.0), (1.0, 1.6), 31)
    legs = np.stack([pelvis + [0.9, 0.0], pelvis], axis=1)
    stand = point(2.2, 1.3)
    traffic.settle(0, 0, stand)
    assert traffic.conflict(1, 0, pelvis, point(1.0, 1.6)) == ""
    assert traffic.conflict(1, 0, legs, point(1.0, 1.6)) == "person 1 is in the way"


places = st.tuples(st.floats(0.3, 3.7), st.floats(0.3, 2.7))


@settings(max_examples=150, deadline=None)
@given(places, places, places, places, st.integers(5, 90), st.integers(5, 90), st.integers(0, 60), st.integers(0, 60))
def test_walks_found_free_never_come_too_near(a, b, c, d, n, m, first, second) -> None:  # type: ignore[no-untyped-def]
    traffic = crowd(2)
    one, two = walked(a, b, n), walked(c, d, m)
    traffic.settle(0, 0, point(*a))
    traffic.go(0, first, one, point(*b))
    start = max(first, second)
    if traffic.conflict(1, start, two, point(*d)):
        return
    for frame in range(start, start + n + m + 2, STRIDE_FRAMES):
        (p, walks_p), (q, walks_q) = where(first, one, a, frame), where(start, two, c, frame)
        phase = (frame - first) % STRIDE_FRAMES  # the other's plan is kept every so many frames
        limit = APART_M if walks_p or walks_q else APART_AT_REST_M
        slack = np.linalg.norm(one[1] - one[0]) * phase + 1e-6
        assert np.linalg.norm(p - q) >= min(limit, APART_M) - slack


def test_two_may_pass_each_other_with_room_and_not_without() -> None:
    traffic = crowd(2)
    traffic.settle(0, 0, point(0.5, 1.0))
    traffic.go(0, 0, walked((0.5, 1.0), (3.5, 1.0), 90), point(3.5, 1.0))
    assert traffic.conflict(1, 0, walked((3.5, 1.3), (0.5, 1.3), 90), point(0.5, 1.3)) == "person 1 is in the way"
    assert traffic.conflict(1, 0, walked((3.5, 1.9), (0.5, 1.9), 90), point(0.5, 1.9)) == ""
    assert traffic.conflict(1, 90, walked((2.5, 1.0), (0.5, 1.0), 90), point(0.5, 1.0)) == ""


def test_a_place_beside_somebody_at_rest_is_refused() -> None:
    traffic = crowd(2)
    traffic.settle(0, 0, np.array([[1.0, 1.0], [1.0, 1.8]]))
    assert traffic.refusal(1, point(1.5, 1.6)) == "person 1 is there"
    assert traffic.refusal(1, point(1.7, 1.6)) == ""


def test_nobody_is_shut_in() -> None:
    free = OPEN.copy()
    free[40, :] = False
    free[40, 28:32] = True  # a doorway .2 m wide, for centres
    traffic = crowd(2, free)
    traffic.settle(0, 0, point(0.5, 1.5))
    assert traffic.refusal(1, point(2.0, 1.5)).startswith("it would shut in")
    assert traffic.refusal(1, point(3.5, 1.5)) == ""
    assert is_bottleneck(traffic.walk, free, np.array([2.0, 1.5]), 400)
    assert not is_bottleneck(traffic.walk, free, np.array([1.0, 1.5]), 400)


def test_moved_things_are_kept_clear_of() -> None:
    traffic = crowd(2)
    cells = np.zeros_like(OPEN)
    cells[38:42, 10:50] = True
    traffic.settle(0, 0, point(0.5, 1.5))
    traffic.go(0, 0, walked((0.5, 1.5), (3.5, 1.5), 90), point(3.5, 1.5))
    assert not traffic.can_move(1, cells, 20)
    assert traffic.can_move(1, cells, 60)
    traffic.move(7, cells, 60)
    assert traffic.conflict(1, 80, walked((0.5, 2.2), (3.5, 2.2), 90), point(3.5, 2.2)) == "object 7 is in the way"
    assert not traffic.open_floor().free[40, 30]
    traffic.move_back(7, 200)
    assert traffic.open_floor().free[40, 30]
    assert traffic.conflict(1, 80, walked((0.5, 2.2), (3.5, 2.2), 90), point(3.5, 2.2)) == "object 7 is in the way"
    assert traffic.conflict(1, 200, walked((0.5, 2.2), (3.5, 2.2), 90), point(3.5, 2.2)) == ""


@pytest.mark.parametrize("before", [0, 45, 95, 400])
def test_forgetting_the_past_changes_nothing(before: int) -> None:
    def planned() -> Traffic:
        traffic = crowd(2)
        traffic.settle(0, 0, point(0.5, 1.0))
        traffic.go(0, 30, walked((0.5, 1.0), (2.0, 1.0), 60), point(2.0, 1.0))
        traffic.go(0, 200, walked((2.0, 1.0), (3.5, 1.0), 60), point(3.5, 1.0))
        return traffic

    whole, short = planned(), planned()
    short.forget(before)
    for start in range(before, 420, 15):
        for x in (0.5, 1.2, 2.0, 2.7, 3.5):
            way = walked((x, 2.5), (x, 1.0), 45)
            assert whole.conflict(1, start, way, point(x, 1.0)) == short.conflict(1, start, way, point(x, 1.0))


def test_the_floor_beside_people() -> None:
    walk = WalkMap(np.zeros(2), OPEN)
    left = without_lines(walk, [np.array([[1.0, 1.5], [2.0, 1.5]])])
    centres = walk.centres()
    along = np.clip(centres[..., 0], 1.0, 2.0)
    away = np.hypot(centres[..., 0] - along, centres[..., 1] - 1.5)
    assert np.array_equal(left.free, away >= APART_M - 1e-6)
