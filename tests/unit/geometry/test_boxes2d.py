"""Boxes in an image: IoU by hand, in whole pixels against counting, and against pycocotools."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.geometry.boxes2d import as_xywh, iou_xywh

BOX = st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(1, 5), st.integers(1, 5))


def test_by_hand() -> None:
    a = np.array([[0, 0, 2, 2]])
    b = np.array([[0, 0, 2, 2], [1, 1, 2, 2], [2, 0, 2, 2], [0, 0, 4, 4], [9, 9, 1, 1]])
    assert iou_xywh(a, b).tolist() == [[1.0, 1 / 7, 0.0, 1 / 4, 0.0]]
    crowd = np.array([False, True, True, True, True])
    assert iou_xywh(a, b, crowd).tolist() == [[1.0, 1 / 4, 0.0, 1.0, 0.0]]
    assert iou_xywh(a[:0], b).shape == (0, 5)


@given(BOX, BOX)
def test_whole_pixels_can_be_counted(a: tuple[int, ...], b: tuple[int, ...]) -> None:
    pixels = [{(x, y) for x in range(c[0], c[0] + c[2]) for y in range(c[1], c[1] + c[3])} for c in (a, b)]
    expected = len(pixels[0] & pixels[1]) / len(pixels[0] | pixels[1])
    assert iou_xywh(np.array([a]), np.array([b]))[0, 0] == pytest.approx(expected, abs=1e-15)


def test_the_same_bits_as_pycocotools() -> None:
    mask = pytest.importorskip("pycocotools.mask")
    rng = np.random.default_rng(0)
    a, b = (np.concatenate([rng.uniform(0, 50, (n, 2)), rng.uniform(1, 60, (n, 2))], axis=1) for n in (80, 90))
    crowd = rng.random(90) < 0.3
    assert (iou_xywh(a, b, crowd) == mask.iou(a, b, crowd.astype(np.uint8))).all()


def test_corners_become_sizes() -> None:
    assert as_xywh(np.array([[3, 4, 5, 8]]), "corners").tolist() == [[3.0, 4.0, 2.0, 4.0]]


@pytest.mark.parametrize(
    ("boxes", "form", "message"),
    [
        (np.array([[0, 0, 1, 1], [5, 5, 2, 2]]), "corners", r"box 1 is \[5, 5, 2, 2\].*really x, y, w, h"),
        (np.array([[0, 0, 0, 1.0]]), "xywh", "box 0 .* sizes > 0"),
        (np.array([[0, np.inf, 1, 1]]), "xywh", "box 0 .* finite"),
        (np.ones((2, 3)), "xywh", r"shape \(2, 3\)"),
        (np.ones((2, 4)), "cxcywh", "expected one of xywh, corners"),
    ],
)
def test_bad_boxes_are_named(boxes: np.ndarray, form: str, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        as_xywh(boxes, form)
