"""Routes: shortest against scipy's Dijkstra, and never out of the free cells."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from hsbench.synth.people.navigation import UNREACHED, clear, costs_from, route
from hsbench.truth.walkable import WalkMap

ORIGIN = np.array([-1.0, 2.0])


def cluttered(seed: int, shape: tuple[int, int] = (60, 50)) -> WalkMap:
    rng = np.random.default_rng(seed)
    free = np.zeros(shape, dtype=bool)
    free[2:-2, 2:-2] = True
    for _ in range(12):
        i, j = rng.integers(2, min(shape), 2)
        free[i : i + int(rng.integers(2, 14)), j : j + int(rng.integers(2, 12))] = False
    return WalkMap(ORIGIN, free)


def reference(free: np.ndarray, start: int) -> np.ndarray:
    """Costs by scipy on the explicit graph."""
    nx, ny = free.shape
    rows, columns, costs = [], [], []
    for i, j in np.argwhere(free):
        for di in (-1, 0, 1):
            for dj in (-1, 0, 1):
                k, m = i + di, j + dj
                if (di or dj) and 0 <= k < nx and 0 <= m < ny and free[k, m] and free[i, m] and free[k, j]:
                    rows.append(i * ny + j)
                    columns.append(k * ny + m)
                    costs.append(14.0 if di and dj else 10.0)
    graph = csr_array((costs, (rows, columns)), shape=(nx * ny, nx * ny))
    return dijkstra(graph, indices=start).reshape(nx, ny)


@pytest.mark.parametrize("seed", range(4))
def test_costs_are_scipys(seed: int) -> None:
    walk = cluttered(seed)
    start = np.argwhere(walk.free)[7 * seed]
    cost, _ = costs_from(walk, walk.centres()[tuple(start)])
    expected = reference(walk.free, int(start[0] * walk.free.shape[1] + start[1]))
    expected[~walk.free] = np.inf
    assert np.array_equal(np.where(cost == UNREACHED, np.inf, cost.astype(float)), expected)


@pytest.mark.parametrize("seed", range(6))
def test_routes_stay_in_free_cells_and_are_no_longer_than_the_cells_way(seed: int) -> None:
    walk = cluttered(seed, (110, 90))
    cells, rng = np.argwhere(walk.free), np.random.default_rng(seed)
    for _ in range(20):
        start, goal = cells[rng.integers(len(cells), size=2)]
        a, b = walk.centres()[tuple(start)], walk.centres()[tuple(goal)]
        way = route(walk, a, b)
        cost = costs_from(walk, a)[0][tuple(goal)]
        if way is None:
            assert cost == UNREACHED
            continue
        assert np.allclose(way[0], a)
        assert np.allclose(way[-1], b)
        parts = [p + np.linspace(0, 1, 300)[:, None] * (q - p) for p, q in itertools.pairwise(way)]
        index, inside = walk.index(np.concatenate([way[:1], *parts]))
        assert inside.all()
        assert walk.free[tuple(index.T)].all()
        length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
        assert length <= cost * walk.cell_m / 10 * 1.011  # 14 stands for 14.14


def test_an_open_floor_is_crossed_straight() -> None:
    walk = WalkMap(ORIGIN, np.ones((80, 60), dtype=bool))
    a, b = np.array([-0.51, 2.22]), np.array([2.6, 4.1])
    way = route(walk, a, b)
    assert way is not None
    assert np.array_equal(way, np.array([a, b]))


def test_no_way_through_a_wall_or_from_outside() -> None:
    free = np.ones((40, 40), dtype=bool)
    free[20] = False
    walk = WalkMap(ORIGIN, free)
    assert route(walk, np.array([-0.5, 2.5]), np.array([0.7, 2.5])) is None
    assert route(walk, np.array([-9.0, 2.5]), np.array([0.7, 2.5])) is None
    assert not clear(walk, np.array([-0.5, 2.5]), np.array([0.7, 2.5]))


def test_diagonal_gaps_are_closed() -> None:
    free = np.ones((10, 10), dtype=bool)
    free[:5, 5], free[5:, 4] = False, False
    free[5, 4], free[4, 5] = False, False
    walk = WalkMap(ORIGIN, free)
    assert route(walk, walk.centres()[2, 2], walk.centres()[7, 7]) is None
