"""Damaged pictures and films: nothing reaches the terminal, and our error says what the decoder said."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.errors import DataError
from hsbench.io.decoding import STDERR, complaint, decode_image, heard
from hsbench.io.image_frames import VideoFrames, open_video
from hsbench.io.images import encode_jpeg, encode_png, read_rgb
from tests.unit.datasets.mutations import attempt, check_message

NOISE = np.random.default_rng(5).integers(0, 256, (40, 50, 3), dtype=np.uint8)


def damaged_png() -> bytes:
    data = bytearray(encode_png(NOISE))
    data[len(data) // 2] ^= 4
    return bytes(data)


def film(path: Path) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), 10.0, (64, 48))
    for k in range(20):
        writer.write(np.random.default_rng(k).integers(0, 256, (48, 64, 3), dtype=np.uint8))
    writer.release()
    return path


def test_a_sound_picture_is_decoded_as_ever() -> None:
    found, said = decode_image(encode_png(NOISE), cv2.IMREAD_COLOR)
    assert np.array_equal(found[..., ::-1], NOISE)
    assert said == ""


@pytest.mark.parametrize("data", [damaged_png(), encode_png(NOISE)[:-200], encode_jpeg(NOISE)[:200], b"x", b""])
def test_nothing_is_printed_over_a_damaged_picture(
    data: bytes, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(data)
    with suppress(DataError):  # a picture that ends early may be shown as far as it goes
        read_rgb(path)
    decode_image(data, cv2.IMREAD_UNCHANGED)
    shown = capfd.readouterr()
    assert (shown.out, shown.err) == ("", "")


def test_the_cause_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(damaged_png())
    with pytest.raises(DataError, match=r"a\.png is missing or no readable image: IDAT: \w+"):
        read_rgb(path)


def test_damaged_films_are_quiet_and_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    whole = film(tmp_path / "whole.mp4").read_bytes()
    at = whole.index(b"mdat") + 4
    spoilt = bytearray(whole)
    spoilt[at + 40 : at + len(whole) // 2] = bytes(len(whole) // 2 - 40)
    for name, data in (("junk", b"hello" * 200), ("cut", whole[: len(whole) // 3]), ("spoilt", bytes(spoilt))):
        path = tmp_path / f"{name}.mp4"
        path.write_bytes(data)
        for index in range(20):
            _, refusal = attempt(lambda path=path, index=index: VideoFrames(path, np.arange(20), np.arange(20))[index])
            if refusal is not None:
                check_message(refusal, path)
    with pytest.raises(DataError, match=r"junk\.mp4 is no readable video.* \(an incomplete copy"):
        open_video(tmp_path / "junk.mp4")
    shown = capfd.readouterr()
    assert (shown.out, shown.err) == ("", "")


@given(st.binary(max_size=200), st.integers(0, 3))
def test_a_complaint_is_one_short_printable_piece(data: bytes, before: int) -> None:
    said = complaint(["", "  "][:before] + data.decode(errors="replace").splitlines())
    assert said == "" or (said.startswith(": ") and said.isprintable() and len(said) <= 122)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("[ WARN:0@1.396] global grfmt_png.cpp:793 readFromStream PNG is incomplete", ": PNG is incomplete"),
        ("[mov,mp4,m4a,3gp @ 0x55d0a1b2c3] moov atom not found", ": moov atom not found"),
        ("libpng error: IDAT: CRC error", ": IDAT: CRC error"),
    ],
)
def test_where_a_message_comes_from_is_left_out(line: str, said: str) -> None:
    assert complaint([line]) == said


def test_the_error_stream_is_whole_again(capfd: pytest.CaptureFixture[str]) -> None:
    def listen(inside: threading.Event, leave: threading.Event) -> None:
        with heard():
            inside.set()
            leave.wait()

    before = os.fstat(STDERR).st_ino
    inside, leave = threading.Event(), threading.Event()
    other = threading.Thread(target=listen, args=(inside, leave))
    other.start()
    inside.wait()
    with heard() as lines:  # another thread listens: neither waits nor takes the stream from it
        pass
    leave.set()
    other.join()
    with heard() as lines:
        os.write(STDERR, b"one\ntwo\n" + b"x" * (1 << 20))  # more than is kept: nobody waits
    assert lines[:2] == ["one", "two"]
    assert os.fstat(STDERR).st_ino == before
    os.write(STDERR, b"back")
    assert capfd.readouterr().err == "back"
