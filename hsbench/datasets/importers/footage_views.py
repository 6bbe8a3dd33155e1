"""Where footage shows one steady view, and what that view looks like without people.

Two pictures of one place are compared by the directions of their edges, which light hardly changes: both are reduced to
``COMPARED_WIDTH_PX``, and each of 8 x 6 tiles agrees if the gradients in it correlate by more than half. People change
few tiles, a moved camera nearly all. On the real footage we have (three static cameras, people crossing and sitting),
65 % of the tiles agree at least, 74 % in any light tried; after a shift by 1.5 % of the picture's width, 36 % at most.
A shift of less than about 1 % is not noticed, nor is a change from or to a view without edges, such as a dark room; a
camera that sags over hours is followed.
"""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np

from hsbench.errors import DataError
from hsbench.schema.episode import Frames
from hsbench.typing import AnyArray, Float32Array, IntArray, UInt8Array

COMPARED_WIDTH_PX = 320
BLUR_PX = 1.0
TILES = (8, 6)  # across, down
MIN_TEXTURE = 1.5  # grey levels a pixel, root mean square over a tile: several times the noise of a camera
SAME_TILE = 0.5
SAME_VIEW = 0.5
MIN_DECIDING = 0.25
"""Share of the view's tiles with edges that must have some in a picture too; else it is dark, or covered."""

SETTLED = 3  # pictures in a row that agree with each other before a new view is believed
FOLLOWING = 0.05
"""Weight of a new picture in the view, so that the light of a day is followed; the first count alike."""

SAMPLES = 49  # odd: their median is one of them
SAMPLE_BYTES = 2**27


def steady_views(pictures: Iterable[UInt8Array | None]) -> list[IntArray]:
    """(h, w, 3) uint8 rgb pictures in order, None where one is unreadable -> the numbers of the pictures of each view.

    A new view begins with three pictures in a row that agree with each other and not with the view before. Pictures
    between two views (the camera moves) belong to none; one that agrees with nothing for a moment stays in its view.
    Pictures of another size are another view at once.
    """
    views: list[list[int]] = []
    view: View | None = None
    odd: list[int] = []  # pictures since the last that agreed with the view
    run: list[int] = []  # those of them that agree with each other
    settling: View | None = None
    for number, picture in enumerate(pictures):
        if picture is None:
            continue
        grey = _reduced(picture)
        if view is None or view.size != picture.shape:
            view, settling, odd = View(picture.shape, grey), None, []
            views.append([number])
            continue
        if view.agrees(grey):
            views[-1] += [*odd, number]
            settling, odd = None, []
            continue
        odd.append(number)
        if settling is not None and settling.agrees(grey):
            run.append(number)
        else:
            settling, run = View(picture.shape, grey), [number]
        if settling.count == SETTLED:
            view, settling, odd = settling, None, []
            views.append(run)
    if odd:
        views[-1] += odd
    return [np.array(view, dtype=np.int64) for view in views]


class View:
    """A steady view: the running mean of its pictures, small and grey."""

    def __init__(self, size: tuple[int, ...], grey: Float32Array) -> None:
        self.size, self.count, self._mean = size, 1, grey

    def agrees(self, grey: Float32Array) -> bool:
        """Whether a picture shows this view; if so it joins the mean. One without edges to compare is let pass."""
        share = agreement(self._mean, grey)
        if share is None:
            return True
        if share < SAME_VIEW:
            return False
        self.count += 1
        self._mean = self._mean + max(FOLLOWING, 1 / self.count) * (grey - self._mean)
        return True


def agreement(view: Float32Array, grey: Float32Array) -> float | None:
    """(h, w) grey levels twice -> share of tiles that agree, of those with edges in both; None if those are few."""
    view_x, view_y = _gradient(view)
    x, y = _gradient(grey)
    product = _tiles(view_x * x + view_y * y)
    view_energy, energy = _tiles(view_x * view_x + view_y * view_y), _tiles(x * x + y * y)
    edged = view_energy > MIN_TEXTURE**2
    both = edged & (energy > MIN_TEXTURE**2)
    if not both.any() or both.sum() < MIN_DECIDING * edged.sum():
        return None
    return float(np.mean(product[both] > SAME_TILE * np.sqrt(view_energy[both] * energy[both])))


def median_background(frames: Frames) -> UInt8Array:
    """(h, w, 3) uint8 rgb: the median, pixel by pixel, of up to 49 frames spread evenly over some of equal size.

    What people cover less than half of the time is seen without them. Of large pictures fewer are taken, so that they
    need no more than 128 MB. Raises DataError for none, and SchemaError for frames without colour.
    """
    if not len(frames):
        raise DataError("no frames; expected one at least")
    first = _rgb(frames, 0)
    most = max(1, min(SAMPLES, SAMPLE_BYTES // first.nbytes, len(frames)))
    count = most - (most + 1) % 2
    chosen = np.linspace(0, len(frames) - 1, count).round().astype(int) if count > 1 else [len(frames) // 2]
    stack = np.empty((count, *first.shape), dtype=np.uint8)
    for place, index in enumerate(chosen):
        stack[place] = _rgb(frames, int(index))
    background = np.empty_like(first)
    for row in range(len(first)):  # a picture is not taken apart at once, to save memory
        background[row] = np.partition(stack[:, row], count // 2, axis=0)[count // 2]
    return background


def _rgb(frames: Frames, index: int) -> UInt8Array:
    rgb = frames[index].rgb
    if rgb is None:
        raise DataError(f"frame {index} has no colour; expected a picture")
    return rgb


def _reduced(picture: UInt8Array) -> Float32Array:
    height, width = picture.shape[:2]
    size = (COMPARED_WIDTH_PX, max(TILES[1], round(height * COMPARED_WIDTH_PX / width)))
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(small, cv2.COLOR_RGB2GRAY), dtype=np.float32)


def _gradient(grey: Float32Array) -> tuple[AnyArray, AnyArray]:
    """Grey levels a pixel, along x and y."""
    smooth = cv2.GaussianBlur(grey, (0, 0), BLUR_PX)
    return cv2.Sobel(smooth, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(smooth, cv2.CV_32F, 0, 1, scale=1 / 8)


def _tiles(values: AnyArray) -> AnyArray:
    """Means over tiles."""
    return np.asarray(cv2.resize(values, TILES, interpolation=cv2.INTER_AREA))
