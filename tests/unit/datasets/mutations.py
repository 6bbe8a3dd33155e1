"""Files damaged at random: what every reader of foreign formats must refuse in one line, or read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest
from hypothesis import strategies as st

from hsbench.errors import HsbenchError

T = TypeVar("T")

TOKENS = (
    b"", b"0", b"-1", b"3", b"NaN", b"-inf", b"1e999", b"1e308", b"99999999999999999999999", b"4294967295", b"null",
    b"[]", b"{}", b'"x"', b"true", b"\n", b"\xff\xfe", b"\x00\x00\x00\x00", b"\xff\xff\xff\x7f", b" ", b",", b"[[[[[[",
)  # fmt: skip


@st.composite
def mutated(draw: st.DrawFn, sound: bytes) -> bytes:
    """The bytes of a sound file with up to four cuts, replaced pieces, or pieces moved elsewhere."""
    data = bytearray(sound)
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, max(len(data) - 1, 0)))
        length = draw(st.integers(0, 12))
        kind = draw(st.sampled_from(("token", "token", "bits", "cut", "end", "move", "swap")))
        if kind == "token":
            data[start : start + length] = draw(st.sampled_from(TOKENS))
        elif kind == "bits" and data:
            data[start] ^= 1 << draw(st.integers(0, 7))
        elif kind == "cut":
            del data[start : start + 40 * length]
        elif kind == "end":
            del data[start:]
        elif kind == "move":
            to = draw(st.integers(0, len(data)))
            data[to:to] = data[start : start + 40 * length]
        elif kind == "swap":
            piece = data[start : start + 8]
            data[start : start + 8] = piece[::-1]
    return bytes(data)


def refused_or_read(
    read: Callable[[Path], T], path: Path, data: bytes, build: Callable[[T], object] = lambda found: found
) -> None:
    """Read damaged bytes and build on them: both pass, or the error is one of ours, in one line.

    The reader's errors also name the file.
    """
    path.write_bytes(data)
    found, refusal = attempt(lambda: read(path))
    if refusal is not None:
        check_message(refusal, path)
        return
    _, refusal = attempt(lambda: build(found))  # type: ignore[arg-type]
    assert refusal is None or str(refusal).isprintable()


def attempt(action: Callable[[], T]) -> tuple[T | None, HsbenchError | None]:
    """What an action gives, or the error of ours that it raises; others pass through."""
    try:
        return action(), None
    except HsbenchError as error:
        return None, error


def refused(read: Callable[[Path], object], path: Path, match: str) -> None:
    """A file that must be refused, in one short line that names it."""
    with pytest.raises(HsbenchError, match=match) as caught:
        read(path)
    check_message(caught.value, path)


def check_message(error: HsbenchError, path: Path) -> None:
    """One printable line that names the file."""
    text = str(error)
    assert path.name in text
    assert text.isprintable()
    assert len(text.replace(str(path), "")) < 500
