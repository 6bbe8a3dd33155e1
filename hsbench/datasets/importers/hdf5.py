"""Chunks of HDF5 arrays, looked at before HDF5 reads them: it inflates a chunk whole, whatever the array claims."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from hsbench.errors import DataError

DEFLATE, SHUFFLE, FLETCHER32 = 1, 2, 3  # H5Z_FILTER_*, HDF5's numbers
ORDER = (SHUFFLE, DEFLATE, FLETCHER32)
"""The order in which MATLAB, h5py and netCDF apply them."""
MOST_INFLATION = 1032
"""Bytes that a byte of a deflate stream can become (zlib's manual, technical details)."""
SLACK_BYTES = 1 << 16
"""By which a chunk that does not deflate may outgrow itself, with its checksum."""


def check_chunks(
    item: Any, where: str, most_bytes: int, wanted: Callable[[tuple[int, ...]], bool] = lambda _: True
) -> None:
    """Raise DataError unless each chunk of an array that will be read has at most ``most_bytes``, and inflates to that.

    item: an h5py.Dataset in the file itself. where: names it. wanted: whether the chunk that begins at an index will
    be read.
    """
    if item.chunks is None:
        return
    chunk_bytes = int(np.prod(item.chunks, dtype=np.float64)) * item.dtype.itemsize
    if chunk_bytes > most_bytes:
        raise DataError(f"{where} has chunks {item.chunks} of {item.dtype}; expected at most {most_bytes:,} bytes")
    pipeline = item.id.get_create_plist()
    codes = [pipeline.get_filter(number)[0] for number in range(pipeline.get_nfilters())]
    if codes != [code for code in ORDER if code in codes]:
        raise DataError(f"{where} is packed by HDF5 filters {codes}; expected deflate, shuffle or a checksum alone")
    stored: list[Any] = []
    item.id.chunk_iter(stored.append)
    for chunk in stored:
        if not wanted(chunk.chunk_offset):
            continue
        size = chunk.size
        if size <= chunk_bytes + SLACK_BYTES and DEFLATE in codes and size * MOST_INFLATION > most_bytes:
            size = _inflated_bytes(item.id.read_direct_chunk(chunk.chunk_offset)[1], chunk_bytes + SLACK_BYTES)
        if size > chunk_bytes + SLACK_BYTES:
            raise DataError(f"{where} has a chunk of more than its {chunk_bytes:,} bytes; expected those (damaged?)")


def _inflated_bytes(packed: bytes, limit: int) -> int:
    """Bytes of a deflate stream, counted to just above a limit; of a damaged one, 0: HDF5 says so."""
    try:
        return len(zlib.decompressobj().decompress(packed, limit + 1))
    except zlib.error:
        return 0
