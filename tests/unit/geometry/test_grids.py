"""Grids: index and centre are inverse, bits by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid, pack_bits, unpack_bits

METRES = st.floats(-20, 20)
GRIDS = st.builds(
    VoxelGrid,
    st.tuples(METRES, METRES, METRES),
    st.tuples(*[st.integers(1, 9)] * 3),
    st.sampled_from([0.05, 0.1, 0.0333, 1.0]),
)


def test_a_grid_by_hand() -> None:
    grid = VoxelGrid((0.0, -3.2, 0.0), (128, 128, 48))
    centres = grid.centres()
    assert centres.shape == (128, 128, 48, 3)
    assert np.allclose(centres[0, 0, 0], [0.025, -3.175, 0.025], rtol=0, atol=1e-12)
    assert np.allclose(centres[127, 127, 47], [6.375, 3.175, 2.375], rtol=0, atol=1e-12)
    assert np.allclose(centres[3, 5, 7], [0.175, -2.925, 0.375], rtol=0, atol=1e-12)


@given(GRIDS)
def test_centres_lie_in_their_voxel(grid: VoxelGrid) -> None:
    centres = grid.centres()
    index, inside = grid.index(centres.reshape(-1, 3))
    assert inside.all()
    assert np.array_equal(index.reshape(*grid.shape, 3), np.moveaxis(np.indices(grid.shape), 0, -1))
    for axis in range(3):
        line = np.moveaxis(centres[..., axis], axis, -1)
        assert (line == grid.axis_centres(axis)).all()


@given(GRIDS, st.tuples(*[st.floats(-3, 12)] * 3))
def test_points_inside_are_those_within_the_outer_corners(grid: VoxelGrid, cells: tuple[float, ...]) -> None:
    point = np.asarray(grid.origin_m) + np.asarray(cells) * grid.voxel_m
    (index,), (inside,) = grid.index(point[None])
    low = np.asarray(grid.origin_m) + index * grid.voxel_m
    assert (low - 1e-9 <= point).all()
    assert (point <= low + grid.voxel_m + 1e-9).all()
    assert inside == all(0 <= i < n for i, n in zip(index, grid.shape, strict=True))


def test_index_is_half_open() -> None:
    grid = VoxelGrid((0.0, 0.0, 0.0), (2, 2, 2), 1.0)
    index, inside = grid.index(np.array([[0, 0, 0], [2, 0, 0], [1, 1, 1], [-1e-12, 0, 0], [0, 1.999, 0]]))
    assert inside.tolist() == [True, False, True, False, True]
    assert index.tolist() == [[0, 0, 0], [2, 0, 0], [1, 1, 1], [-1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((0.0, 0.0), (1, 1, 1), 0.05), r"grid\.origin_m is \(0\.0, 0\.0\); expected three finite metres"),
        (((0.0, np.nan, 0.0), (1, 1, 1), 0.05), r"grid\.origin_m"),
        (((0.0, np.inf, 0.0), (1, 1, 1), 0.05), r"grid\.origin_m"),
        (((0.0, 0.0, 0.0), (1, 1), 0.05), r"grid\.shape is \(1, 1\); expected three positive counts"),
        (((0.0, 0.0, 0.0), (1, 0, 1), 0.05), r"grid\.shape"),
        (((0.0, 0.0, 0.0), (1, 1, 1), 0.0), r"grid\.voxel_m is 0\.0; expected a positive finite"),
        (((0.0, 0.0, 0.0), (1, 1, 1), np.nan), r"grid\.voxel_m"),
    ],
)
def test_impossible_grids(arguments: tuple, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        VoxelGrid(*arguments)


def test_bits_by_hand() -> None:
    volume = np.zeros((1, 10), dtype=bool)
    volume[0, [0, 3, 9]] = True
    assert pack_bits(volume).tolist() == [[0b0000_1001, 0b0000_0010]]  # element 8 k + b is bit b of byte k
    assert unpack_bits(np.array([[0b1000_0001]], dtype=np.uint8), 8).tolist() == [[1, 0, 0, 0, 0, 0, 0, 1]]


@given(arrays(np.bool_, array_shapes(min_dims=1, max_dims=4, min_side=1, max_side=20)))
def test_bits_round_trip(volume: np.ndarray) -> None:
    packed = pack_bits(volume)
    assert packed.dtype == np.uint8
    assert packed.shape == (*volume.shape[:-1], -(-volume.shape[-1] // 8))
    back = unpack_bits(packed, volume.shape[-1])
    assert back.dtype == np.bool_
    assert np.array_equal(back, volume)
    for index in np.ndindex(volume.shape):
        assert bool(packed[(*index[:-1], index[-1] // 8)] >> (index[-1] % 8) & 1) == volume[index]
