"""What a picture takes over from an earlier one: only what has not changed."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("embreex")

from lit_room import CAMERA, POSE, scene, table, wardrobe

from hsbench.schema import Scene
from hsbench.schema.motions import Move, scene_at
from hsbench.synth.render import Lighting, Renderer, Window, open_renderer
from hsbench.synth.render.background import background_rgb, still_background
from hsbench.synth.render.still import OTHER, Coloured, Known
from hsbench.synth.scene_meshes import scene_meshes
from hsbench.typing import UInt8Array, UInt16Array

ROOM = scene(wardrobe(), table())
TABLE = table().object_id
WINDOW = Window(11, 33, 117, 80)  # begins and ends nowhere in particular


@pytest.fixture(scope="module")
def raycast() -> Renderer:
    return open_renderer("raycast")


def ids_of(room: Scene, renderer: Renderer) -> UInt16Array:
    return renderer.render(scene_meshes(room), CAMERA, POSE, Lighting(1.0), only="shape").ids


def inside(rgb: UInt8Array) -> UInt8Array:
    return rgb[WINDOW.v0 : WINDOW.v0 + WINDOW.height, WINDOW.u0 : WINDOW.u0 + WINDOW.width]


def wanted_share(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Filled with the share of pixels that each later picture colours again."""
    shares: list[float] = []
    changed = Known.changed

    def noted(*args: object) -> object:
        again = changed(*args)  # type: ignore[arg-type]
        shares.append(float(again.mean()))
        return again

    monkeypatch.setattr(Known, "changed", noted)
    return shares


def test_where_nothing_moved_everything_is_taken_over(raycast: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    shares, ids = wanted_share(monkeypatch), ids_of(ROOM, raycast)
    rgb, still = still_background(ROOM, ids, raycast, CAMERA, POSE)
    assert np.array_equal(rgb, background_rgb(ROOM, ids, raycast, CAMERA, POSE))
    assert np.array_equal(rgb, background_rgb(ROOM, ids, raycast, CAMERA, POSE, still=still))
    assert shares == [0.0]
    assert np.array_equal(inside(rgb), background_rgb(ROOM, ids, raycast, CAMERA, POSE, WINDOW, still))


@pytest.mark.parametrize("move", [(0.3, 0.2, 0.0), (0.0, 0.0, 0.4), (-3.0, -3.0, 0.0)])
def test_what_moved_is_coloured_as_if_nothing_were_known(
    raycast: Renderer, monkeypatch: pytest.MonkeyPatch, move: Move
) -> None:
    """Also where the thing leaves the picture, so that triangles bear other numbers."""
    shares = wanted_share(monkeypatch)
    _, still = still_background(ROOM, ids_of(ROOM, raycast), raycast, CAMERA, POSE)
    after = scene_at(ROOM, {(TABLE, ""): move})
    ids = ids_of(after, raycast)
    whole = background_rgb(after, ids, raycast, CAMERA, POSE)
    quick = background_rgb(after, ids, raycast, CAMERA, POSE, still=still)
    assert 0.0 < shares[0] < 1.0
    off = np.abs(whole.astype(int) - quick).max(axis=-1)
    assert (off[ids == TABLE] == 0).all()
    assert (off <= 2).mean() > 0.9995  # levels of 255


def test_the_counterparts_of_hand_made_pictures() -> None:
    """Two pixels of 2 x 2 samples beside two others, on a grid of one point a 2 x 2 pixels."""

    def coloured(triangle: list[list[int]], light: float) -> Coloured:
        at = np.repeat(np.repeat(np.array(triangle, dtype=np.int32), 2, axis=0), 2, axis=1)
        return Coloured(at, np.zeros(at.shape, bool), np.full((1, 1, 9), light), np.zeros((2, 2, 3)))

    before, after = coloured([[0, 1], [-1, 2]], 1.0), coloured([[1, 0], [-1, 2]], 1.0)
    swapped = Known(before, np.array([1, 0, 2, -1], dtype=np.int32))
    assert not swapped.changed(after.triangle, after.sunlit, after.grid, 4).any()
    moved = Known(before, np.array([1, 0, OTHER, -1], dtype=np.int32))
    # The grid's only point shows triangle 2, which has moved: whatever is read off it may have changed.
    assert moved.changed(after.triangle, after.sunlit, after.grid, 4).all()
    brighter = coloured([[1, 0], [-1, 2]], 1.02)
    assert swapped.changed(brighter.triangle, brighter.sunlit, brighter.grid, 4).all()
    sunlit = after.sunlit.copy()
    sunlit[0, 3] = True
    assert swapped.changed(after.triangle, sunlit, after.grid, 4).tolist() == [[False, True], [False, False]]
