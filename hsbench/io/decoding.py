"""Decoding pictures and films without what decoders print: their complaint goes into our error instead.

OpenCV, FFmpeg and libpng write warnings straight to the error stream of the process, past Python.
"""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import cv2
import numpy as np

from hsbench.typing import AnyArray

STDERR = 2
_LISTENING = threading.Lock()
HEARD_BYTES = 1 << 16  # what a pipe holds; decoders that say more are not waited for
MAX_LETTERS = 120
_PLACE = re.compile(r"^(\[ *\w+:\d+@[\d.]+\] global \S+ \w+ |\[[^\]]* @ 0x[0-9a-f]+\] |libpng (error|warning): )")
"""What OpenCV, FFmpeg and libpng put before a message: where it comes from."""


@contextmanager
def heard() -> Iterator[list[str]]:
    """Keep the error stream of the process quiet; afterwards the list holds the lines that were written to it.

    One thread at a time listens; others do not wait for it, and what they hear is lost in its list.
    """
    lines: list[str] = []
    if not _LISTENING.acquire(blocking=False):
        yield lines
        return
    try:
        with _redirected(lines):
            yield lines
    finally:
        _LISTENING.release()


@contextmanager
def _redirected(lines: list[str]) -> Iterator[None]:
    try:
        kept = os.dup(STDERR)
    except OSError:  # closed, as of a daemon: nothing to keep quiet
        yield
        return
    source, sink = os.pipe()
    for end in (source, sink):
        os.set_blocking(end, False)
    os.dup2(sink, STDERR)
    os.close(sink)
    try:
        yield
    finally:
        os.dup2(kept, STDERR)
        os.close(kept)
        with suppress(BlockingIOError):
            lines += os.read(source, HEARD_BYTES).decode(errors="replace").splitlines()
        os.close(source)


def complaint(lines: list[str]) -> str:
    """The first thing a decoder said, as ``: what`` to put into a message; empty where it said nothing."""
    said = (_PLACE.sub("", line).strip() for line in lines)
    first = next((text for text in said if text), "")
    plain = "".join(letter if letter.isprintable() else " " for letter in first)
    return f": {plain[:MAX_LETTERS]}" if plain else ""


def decode_image(source: bytes | Path, flags: int) -> tuple[AnyArray | None, str]:
    """(pixels by cv2's ``flags``, or None where they cannot be decoded; the decoder's ``complaint``)."""
    with heard() as lines:
        try:
            if isinstance(source, Path):
                pixels = cv2.imread(str(source), flags)
            else:
                pixels = cv2.imdecode(np.frombuffer(source, np.uint8), flags)
        except cv2.error:
            pixels = None
    return (None if pixels is None else np.asarray(pixels)), complaint(lines)
