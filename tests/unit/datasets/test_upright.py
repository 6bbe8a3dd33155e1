"""From an upright frame to the episode frame, the floor among heights, and printed numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.datasets.importers import upright
from hsbench.errors import DataError
from hsbench.geometry.cameras import world_T_camera
from hsbench.geometry.transforms import apply, is_rigid, rotation_x, rotation_z
from tests.unit.datasets.mutations import refused


@given(
    yaw=st.floats(-3.1, 3.1), tilt=st.floats(-1.4, 1.4), roll=st.floats(-0.5, 0.5), height=st.floats(0.1, 5.0),
    x=st.floats(-9.0, 9.0),
)  # fmt: skip
def test_the_episode_frame_is_the_schemas_whatever_the_yaw(
    yaw: float, tilt: float, roll: float, height: float, x: float
) -> None:
    turned = rotation_z(yaw) @ world_T_camera(0.0, tilt, roll)[:3, :3]
    episode_T_camera, episode_T_upright = upright.to_episode_frame(turned, -height)
    np.testing.assert_allclose(episode_T_camera, world_T_camera(height, tilt, roll), atol=1e-9)
    assert is_rigid(episode_T_upright)
    point = np.array([x, 1.0, 2.0])  # in the camera frame
    np.testing.assert_allclose(apply(episode_T_upright, turned @ point), apply(episode_T_camera, point), atol=1e-9)


def test_cameras_without_heading_or_below_the_floor() -> None:
    with pytest.raises(DataError, match="expected a heading"):
        upright.to_episode_frame(world_T_camera(0.0, np.pi / 2)[:3, :3], -1.0)
    with pytest.raises(DataError, match=r"the floor is 0.20 m above the camera; .*upside down"):
        upright.to_episode_frame(world_T_camera(0.0, 0.1)[:3, :3], 0.2)


@given(
    level=st.floats(-2.0, -0.5), noise=st.floats(0.0, 0.01), strays=st.integers(0, 20), seed=st.integers(0, 2**32 - 1)
)
def test_the_floor_is_found_under_noise_and_below_strays(level: float, noise: float, strays: int, seed: int) -> None:
    """A tenth of the points on the floor, the others evenly up to 2.5 m above; up to 0.4 % stray below it."""
    rng = np.random.default_rng(seed)
    floor, above = level + noise * rng.standard_normal(500), level + rng.uniform(0.0, 2.5, 4500)
    heights = np.concatenate([floor, above, level - rng.uniform(0.2, 2.0, strays)])
    assert abs(upright.floor_level(heights) - level) < 0.02
    assert upright.near_floor(heights, level).sum() >= 450


def test_no_heights_no_floor() -> None:
    with pytest.raises(DataError, match="no reading at all"):
        upright.floor_level(np.empty(0))


@given(angle=st.floats(-3.0, 3.0), digits=st.integers(4, 9))
def test_printed_rotations_become_exact_ones(angle: float, digits: int) -> None:
    exact = rotation_z(0.3) @ rotation_x(angle)
    found = upright.rotation(np.round(exact, digits), "a")
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-11)
    np.testing.assert_allclose(found, exact, atol=10.0**-digits * 2)


@pytest.mark.parametrize("matrix", [np.eye(3) * 1.1, np.diag([1, 1, -1]), np.zeros((3, 3)), np.full((3, 3), np.nan)])
def test_what_is_no_rotation(matrix: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> None:
    with pytest.raises(DataError, match=r"^a.txt .* is no rotation"):
        upright.rotation(matrix.astype(np.float64), "a.txt")


def test_what_is_seen_is_around_the_camera() -> None:
    outline = upright.seen_outline(np.array([[2.0, -1.0], [2.0, 1.0], [1.0, 0.0]]))
    assert sorted(map(tuple, outline.tolist())) == [(0.0, 0.0), (2.0, -1.0), (2.0, 1.0)]


def test_texts_and_numbers(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbf1 2.5 -3e2")
    np.testing.assert_array_equal(upright.numbers(upright.read_text(path).split(), "a"), [1.0, 2.5, -300.0])
    for token in ("nan", "inf", "-1e999", "0x10", "1_0", "1,5", ""):
        with pytest.raises(DataError, match=r"^a: value 2 is .*; expected a finite number"):
            upright.numbers(["1", token], "a")
    path.write_bytes(bytes(100))
    refused(lambda p: upright.read_text(p, 99), path, "more than 99 bytes")
    path.write_bytes(b"1 \xff")
    refused(upright.read_text, path, "is no text at byte 2")
