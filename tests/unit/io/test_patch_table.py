"""Packed patches: their bytes are what the page on the schema says, read with numpy alone; smooth pixels take few."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.io.patch_table import packed
from hsbench.typing import BoolArray, UInt8Array, UInt16Array


def by_sums(
    data: bytes, counts: dict[str, int], shape: tuple[int, int]
) -> tuple[BoolArray, UInt8Array, UInt16Array, UInt16Array]:
    """Of a picture (h, w): which pixels are stored, rgb, depth and ids, as sums down the columns of steps."""
    r, n = counts["runs"], counts["pixels"]
    flat = np.frombuffer(pa.decompress(data, 4 * r + 7 * n, "zstd", asbytes=True), np.uint8)
    runs, ids, colour, low, high = np.split(flat, np.cumsum([4 * r, 2 * n, 3 * n, n]))
    stored = np.zeros(shape, dtype=bool)
    on = np.repeat(np.arange(r) % 2 == 1, runs.view("<u4"))
    stored.ravel()[: len(on)] = on
    steps = np.zeros((*shape, 5), dtype=np.int64)
    steps[stored] = np.c_[colour.reshape(n, 3), low + 256 * high.astype(int) - 128, ids.view("<u2")]
    red, green, blue, depth_mm, instance = np.moveaxis(steps.cumsum(axis=0), -1, 0)
    rgb = np.stack([red + green, green, blue + green], axis=-1)
    return stored, *((a % 2**k).astype(f"u{k // 8}") for a, k in ((rgb, 8), (depth_mm, 16), (instance, 16)))


@given(st.integers(0, 2**32), st.integers(0, 9), st.integers(0, 19), st.integers(0, 2), st.data())
def test_bytes_are_the_steps_of_the_layout(seed: int, height: int, width: int, by: int, data: st.DataObject) -> None:
    rng = np.random.default_rng(seed)
    mask = rng.random((height, width)) < data.draw(st.sampled_from([0.0, 0.2, 0.8, 1.0]))
    rgb = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
    depth_mm, instance = (rng.integers(0, 2**16, (height, width), dtype=np.uint16) for _ in range(2))
    row, column = data.draw(st.integers(0, 2)), data.draw(st.integers(0, by))
    shape, window = (row + height + 1, width + by), np.s_[row : row + height, column : column + width]
    packed_bytes, counts = packed(mask, rgb, depth_mm, instance, row, column, shape[1])
    assert counts == {**counts, "size": len(packed_bytes), "pixels": mask.sum()}
    stored, *pictures = by_sums(packed_bytes, counts, shape)
    expected = np.zeros(shape, dtype=bool)
    expected[window] = mask
    assert np.array_equal(stored, expected)
    for got, of in zip(pictures, (rgb, depth_mm, instance), strict=True):
        assert got.dtype == of.dtype
        assert np.array_equal(got[expected], of[mask])


def test_runs_are_as_few_as_can_be() -> None:
    mask = np.array([[1, 0, 1, 1], [1, 1, 0, 0]], dtype=bool)
    pixels = np.zeros((2, 4), np.uint16)
    rgb = np.zeros((2, 4, 3), np.uint8)
    for width_px, runs in ((4, [4, 1, 1, 4]), (6, [8, 1, 1, 2, 2, 2])):
        data, counts = packed(mask, rgb, pixels, pixels, 1, width_px - 4, width_px)
        assert counts["runs"] == len(runs)
        assert np.frombuffer(pa.decompress(data, 4 * len(runs) + 7 * 5, "zstd"), "<u4", len(runs)).tolist() == runs


@pytest.mark.parametrize("order", ["C", "F"])
def test_views_of_any_layout_pack_alike(order: str) -> None:
    rng = np.random.default_rng(1)
    mask, rgb = rng.random((8, 8)) < 0.5, rng.integers(0, 256, (8, 8, 3), dtype=np.uint8)
    depth_mm = rng.integers(0, 9000, (8, 8), dtype=np.uint16)
    whole = [np.zeros((20, 20, *a.shape[2:]), a.dtype, order=order) for a in (mask, rgb, depth_mm)]  # type: ignore[call-overload]
    for large, small in zip(whole, (mask, rgb, depth_mm), strict=True):
        large[3:11, 5:13] = small
    cut = [large[3:11, 5:13] for large in whole]
    assert packed(cut[0], cut[1], cut[2], cut[2], 3, 4, 20) == packed(mask, rgb, depth_mm, depth_mm, 3, 4, 20)


def test_what_changes_slowly_down_the_columns_takes_little() -> None:
    """A slope whose columns differ at random: packed as it is, it would be noise of seven bytes a pixel."""
    rng = np.random.default_rng(1)
    down = np.arange(200)[:, None]
    mask = np.ones((200, 100), dtype=bool)
    grey = (rng.integers(0, 256, 100) + down // 4).astype(np.uint8)
    depth_mm = (rng.integers(0, 60_000, 100) + 3 * down).astype(np.uint16)
    instance = np.full((200, 100), 60001, dtype=np.uint16)
    data, _ = packed(mask, np.repeat(grey[..., None], 3, axis=2), depth_mm, instance, 0, 0, 100)
    assert len(data) < 0.01 * 7 * mask.size
