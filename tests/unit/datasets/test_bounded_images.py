"""Pictures are decoded only after their header was believed: right values, and nothing huge or damaged."""

from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.datasets.importers.bounded_images import read_colour, read_grey16
from tests.unit.datasets.mutations import mutated, refused, refused_or_read
from tests.unit.datasets.room_files import write_grey16, write_rgb

ANY_FILE = settings(deadline=None, max_examples=120, suppress_health_check=[HealthCheck.function_scoped_fixture])
SMOOTH = np.stack([*np.meshgrid(np.arange(0, 160, 5), np.arange(0, 120, 5)), np.full((24, 32), 40)], axis=-1)


def test_values_and_order_of_colours(tmp_path: Path) -> None:
    image = SMOOTH.astype(np.uint8)
    for name, slack in (("a.png", 0), ("a.jpg", 6)):
        write_rgb(tmp_path / name, image)
        found = read_colour(tmp_path / name)
        assert found.dtype == np.uint8
        assert found.shape == image.shape
        assert np.abs(found.astype(int) - image).max() <= slack
    depth = np.arange(1200).reshape(30, 40) * 50
    write_grey16(tmp_path / "d.png", depth)
    np.testing.assert_array_equal(read_grey16(tmp_path / "d.png"), depth)


@pytest.mark.parametrize("options", [[], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1], [cv2.IMWRITE_JPEG_RST_INTERVAL, 2]])
def test_every_kind_of_jpeg_tells_its_size(tmp_path: Path, options: list[int]) -> None:
    cv2.imwrite(str(tmp_path / "a.jpg"), SMOOTH.astype(np.uint8), options)
    assert read_colour(tmp_path / "a.jpg").shape == SMOOTH.shape


def test_pictures_that_claim_to_be_huge_are_refused_before_decoding(tmp_path: Path) -> None:
    write_grey16(tmp_path / "d.png", np.ones((4, 4)))
    data = bytearray((tmp_path / "d.png").read_bytes())
    data[16:24] = struct.pack(">II", 60_000, 60_000)
    (tmp_path / "d.png").write_bytes(data)
    for read in (read_colour, read_grey16):
        refused(read, tmp_path / "d.png", "60000 x 60000 px; expected 1 to 4096")
    write_rgb(tmp_path / "a.jpg", SMOOTH.astype(np.uint8))
    data = bytearray((tmp_path / "a.jpg").read_bytes())
    at = data.index(b"\xff\xc0")
    data[at + 5 : at + 9] = struct.pack(">HH", 65_000, 65_000)
    (tmp_path / "a.jpg").write_bytes(data)
    refused(read_colour, tmp_path / "a.jpg", "65000 x 65000 px")


def test_other_files(tmp_path: Path) -> None:
    write_rgb(tmp_path / "a.png", SMOOTH.astype(np.uint8))
    refused(read_grey16, tmp_path / "a.png", "8 bits, colour type 2; expected 16-bit grey")
    for content in (
        b"",
        b"BM",
        b"\x89PNG\r\n\x1a\n",
        b"\xff\xd8\xff\xda\0\x02" + bytes(20),
        b"\xff\xd8\xff\xd9" + bytes(20),
    ):
        (tmp_path / "a.jpg").write_bytes(content)
        refused(read_colour, tmp_path / "a.jpg", "is no PNG or JPEG with a size")
        refused(read_grey16, tmp_path / "a.jpg", "is no PNG")
    refused(read_colour, tmp_path / "absent.png", "cannot be read")
    data = (tmp_path / "a.png").read_bytes()
    (tmp_path / "a.png").write_bytes(data[:40])
    refused(read_colour, tmp_path / "a.png", "damaged picture")


@pytest.mark.parametrize("kept", [0.5, 0.9, -2])
def test_truncated_jpegs_are_refused_though_decoders_fill_them(tmp_path: Path, kept: float) -> None:
    write_rgb(tmp_path / "a.jpg", SMOOTH.astype(np.uint8))
    data = (tmp_path / "a.jpg").read_bytes()
    (tmp_path / "a.jpg").write_bytes(data + b"made by a camera")
    assert read_colour(tmp_path / "a.jpg").shape == SMOOTH.shape
    (tmp_path / "a.jpg").write_bytes(data[: int(kept * len(data)) if kept > 0 else int(kept)])
    refused(read_colour, tmp_path / "a.jpg", "is no PNG or JPEG with a size|JPEG without an end")


@ANY_FILE
@given(data=st.data())
def test_mutated_pictures_are_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    name, read = data.draw(st.sampled_from([("a.jpg", read_colour), ("a.png", read_colour), ("d.png", read_grey16)]))
    write_rgb(tmp_path / "sound.jpg", SMOOTH.astype(np.uint8))
    write_rgb(tmp_path / "sound.png", SMOOTH.astype(np.uint8))
    write_grey16(tmp_path / "deep.png", np.arange(1200).reshape(30, 40))
    sound = {"a.jpg": "sound.jpg", "a.png": "sound.png", "d.png": "deep.png"}[name]
    refused_or_read(read, tmp_path / name, data.draw(mutated((tmp_path / sound).read_bytes())))
