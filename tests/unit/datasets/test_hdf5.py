"""Chunks of HDF5 arrays: what inflates beyond the array's own size is refused before HDF5 would allocate it."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.datasets.importers import mat73, nyu_labelled, pose2room
from hsbench.datasets.importers.hdf5 import check_chunks
from hsbench.datasets.importers.mat73 import read_mat73
from hsbench.datasets.importers.nyu_labelled import read_nyu_labelled
from hsbench.datasets.importers.pose2room import read_pose2room
from hsbench.errors import DataError
from tests.unit.datasets.mutations import refused

h5py = pytest.importorskip("h5py", reason="the extra import is not installed")

MOST = 1 << 20
TOO_MUCH = r"has a chunk of more than its [\d,]+ bytes"


def bomb() -> bytes:
    """A stream of eight times the limit."""
    return zlib.compress(bytes(8 * MOST), 9)


def one_chunk(path: Path, content: bytes, shape: tuple[int, ...] = (10, 10), **packing: Any) -> Path:
    """A file whose array ``model`` has one chunk with these bytes as stored."""
    with h5py.File(path, "w") as file:
        array = file.create_dataset("model", shape, "f8", chunks=shape, **packing)
        array.id.write_direct_chunk((0,) * len(shape), content)
    return path


def check(path: Path, most_bytes: int = MOST, wanted: Callable[[tuple[int, ...]], bool] = lambda _: True) -> None:
    with h5py.File(path, "r") as file:
        check_chunks(file["model"], "model", most_bytes, wanted)


@settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([{}, {"compression": "gzip"}, {"compression": "gzip", "compression_opts": 9}]),
    st.booleans(),
    st.booleans(),
    st.integers(0, 3),
)
def test_what_hdf5_writes_passes(
    tmp_path: Path, packing: dict[str, Any], shuffle: bool, checksum: bool, seed: int
) -> None:
    content = np.random.default_rng(seed).random((300, 70)) * (seed > 0)  # random numbers do not deflate, zeros do
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("model", data=content, chunks=(64, 64), shuffle=shuffle, fletcher32=checksum, **packing)
    check(tmp_path / "a.h5", 64 * 64 * 8)


def test_a_chunk_that_inflates_beyond_itself(tmp_path: Path) -> None:
    path = one_chunk(tmp_path / "a.h5", bomb(), compression="gzip")
    with pytest.raises(DataError, match=TOO_MUCH):
        check(path)
    check(path, wanted=lambda start: start != (0, 0))
    with pytest.raises(DataError, match=TOO_MUCH):
        check(one_chunk(tmp_path / "b.h5", bytes(1 << 20), compression="gzip"))
    check(one_chunk(tmp_path / "c.h5", b"no stream" * 1000, compression="gzip"))  # HDF5 says so itself


def test_other_filters_and_orders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"packed by HDF5 filters \[32000\]; expected deflate, shuffle or a checksum"):
        check(one_chunk(tmp_path / "a.h5", bomb(), compression="lzf"))
    pipeline = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    pipeline.set_chunk((10, 10))
    for _ in range(2):
        pipeline.set_deflate(9)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        h5py.h5d.create(file.id, b"model", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((10, 10)), pipeline)
    with pytest.raises(DataError, match=r"packed by HDF5 filters \[1, 1\]"):
        check(tmp_path / "b.h5")


def test_the_readers_refuse_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for reader, limit in ((mat73, "MAX_PLAIN_BYTES"), (pose2room, "MAX_BYTES"), (nyu_labelled, "MAX_CHUNK_BYTES")):
        monkeypatch.setattr(reader, limit, MOST)
    refused(lambda p: read_mat73(p, "model"), one_chunk(tmp_path / "a.mat", bomb(), compression="gzip"), TOO_MUCH)
    with h5py.File(tmp_path / "b.hdf5", "w") as file:
        joints = file.create_dataset("skeleton_joints", (6, 53, 3), "f8", chunks=(6, 53, 3), compression="gzip")
        joints.id.write_direct_chunk((0, 0, 0), bomb())
    refused(read_pose2room, tmp_path / "b.hdf5", TOO_MUCH)
    with h5py.File(tmp_path / "c.mat", "w") as file:
        depth = file.create_dataset("rawDepths", (2, 640, 480), "f4", chunks=(1, 64, 64), compression="gzip")
        depth.id.write_direct_chunk((1, 64, 0), bomb())
    refused(lambda p: read_nyu_labelled(p, 1), tmp_path / "c.mat", TOO_MUCH)
