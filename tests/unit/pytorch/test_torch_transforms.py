"""Augmentations: what a picture shows, where joints and boxes lie and what maps say stays one story."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.geometry.boxes import corners, iou_upright
from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera, world_T_camera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.skeletons import SKELETONS

pytest.importorskip("torch", reason="the extra torch is not installed")

from hsbench.torch import Sample, Sometimes, cropped, mirrored, turned

VOXELS = ("solid", "voxel_state", "solid_ignored")
CAMERAS = {"pinhole": PinholeCamera(40, 30, 31.0, 29.0, 17.5, 16.0), "360": EquirectangularCamera(64, 32)}
SKELETON = SKELETONS["coco-18"]


def pose_of(sample: Sample) -> np.ndarray:
    return world_T_camera(sample.height_m, sample.tilt_rad, sample.roll_rad)


def made(kind: str, seed: int = 0) -> Sample:
    """A sample whose joints, in metres and pixels, and ids, seen by its camera, belong together."""
    rng = np.random.default_rng(seed)
    camera = CAMERAS[kind]
    shape = (2, camera.height_px, camera.width_px)
    height_m, tilt, roll = (1.4, 0.3, 0.1) if kind == "pinhole" else (1.4, 0.0, 0.0)
    rays = camera.rays()
    row, column = rng.integers(camera.height_px, size=(3, 18)), rng.integers(camera.width_px, size=(3, 18))
    depth = rng.uniform(1, 3, (3, 18, 1))
    joints = apply(world_T_camera(height_m, tilt, roll), depth * rays[row, column])
    state = rng.integers(0, 3, (3, 18)).astype(np.uint8)
    missing = (state == 0)[..., None]
    return Sample(
        camera, height_m, tilt, roll,
        np.arange(2, dtype=np.int64),
        rgb=rng.integers(0, 255, (*shape, 3)).astype(np.uint8),
        depth_m=rng.uniform(0.5, 4, shape).astype(np.float32),
        skeleton=SKELETON,
        pose_ns=np.zeros(3, dtype=np.int64),
        track_id=np.arange(3, dtype=np.int32),
        joint_state=state,
        joints_m=np.where(missing, np.nan, joints).astype(np.float32),
        joints_px=np.where(missing, np.nan, np.stack([column, row], axis=-1) + 0.5).astype(np.float32),
        maps=rng.uniform(size=(2, 8, 8)).astype(np.float32),
        instance=rng.integers(0, 9, shape).astype(np.uint16),
        semantic=rng.integers(0, 9, shape).astype(np.uint8),
        boxes=np.column_stack([rng.uniform(-2, 2, (4, 3)), rng.uniform(0.3, 1, (4, 3)), rng.uniform(-3, 3, 4)]),
        box_class=np.arange(4, dtype=np.uint8),
        box_visibility=np.arange(4, dtype=np.uint8) % 4,
        affordance=rng.integers(0, 8, (8, 8)).astype(np.uint8),
        affordance_ignored=rng.uniform(size=(8, 8)) < 0.4,
        solid=rng.uniform(size=(6, 4, 3)) < 0.4,
        voxel_state=rng.integers(0, 4, (6, 4, 3)).astype(np.uint8),
        solid_ignored=rng.uniform(size=(6, 4, 3)) < 0.4,
        grid=VoxelGrid((0.0, -0.3, 0.0), (6, 4, 3), 0.1),
    )  # fmt: skip


def assert_same(a: Sample, b: Sample) -> None:
    for name, value in vars(a).items():
        other = getattr(b, name)
        if isinstance(value, np.ndarray):
            np.testing.assert_allclose(value, other, atol=1e-6, err_msg=name)
        elif name != "grid":
            assert value == other, name
    np.testing.assert_allclose(a.grid.origin_m, b.grid.origin_m, atol=1e-12)


def assert_one_story(sample: Sample) -> None:
    """Joints in metres project onto those in pixels."""
    there = sample.joint_state > 0
    pixels, _ = sample.camera.project(apply(invert(pose_of(sample)), sample.joints_m.astype(np.float64)))
    off = (pixels - sample.joints_px)[there]
    off[:, 0] -= np.round(off[:, 0] / sample.camera.width_px) * sample.camera.width_px  # the seam
    assert np.abs(off).max() < 1e-3
    assert (np.isnan(sample.joints_m).all(axis=-1) == ~there).all()


def points(sample: Sample) -> np.ndarray:
    """What depth says, in the episode frame: x y z of every pixel, and its id."""
    return apply(pose_of(sample), sample.camera.unproject(sample.depth_m[0].astype(np.float64)))


def sorted_rows(rows: np.ndarray) -> np.ndarray:
    rows = np.round(rows, 5)
    return rows[np.lexsort(rows.T)]


@pytest.mark.parametrize("kind", CAMERAS)
def test_a_mirror_exchanges_left_and_right_of_everything(kind: str) -> None:
    sample = made(kind)
    assert_one_story(sample)
    flipped = mirrored(sample)
    assert_one_story(flipped)
    flip = np.array([1, -1, 1])
    for a, b in ((points(sample) * flip, points(flipped)),):
        told = [np.column_stack([p.reshape(-1, 3), s.instance[0].reshape(-1)]) for p, s in ((a, sample), (b, flipped))]
        np.testing.assert_allclose(sorted_rows(told[0]), sorted_rows(told[1]), atol=2e-5)
    left, right = SKELETON.index("wrist_left"), SKELETON.index("wrist_right")
    np.testing.assert_array_equal(flipped.joints_m[:, left], sample.joints_m[:, right] * np.float32(flip))
    np.testing.assert_array_equal(flipped.joint_state[:, right], sample.joint_state[:, left])
    for a, b in zip(corners(sample.boxes) * flip, corners(flipped.boxes), strict=True):
        np.testing.assert_allclose(sorted_rows(a), sorted_rows(b), atol=1e-5)
    assert np.array_equal(flipped.affordance, np.fliplr(sample.affordance))
    assert flipped.grid.origin_m == pytest.approx((0.0, -0.1, 0.0))
    assert np.array_equal(flipped.affordance_ignored, np.fliplr(sample.affordance_ignored))
    for name in VOXELS:
        assert np.array_equal(getattr(flipped, name), getattr(sample, name)[:, ::-1]), name
    assert_same(mirrored(flipped), sample)


@given(st.integers(-5, 9))
def test_a_turned_camera_sees_the_same_room(quarters: int) -> None:
    sample = made("360")
    new = turned(sample, quarters)
    assert_one_story(new)
    a = -quarters * np.pi / 2
    new_R_old = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    told = [
        np.column_stack([p.reshape(-1, 3), s.instance[0].reshape(-1)])
        for p, s in ((points(sample) @ new_R_old.T, sample), (points(new), new))
    ]
    np.testing.assert_allclose(sorted_rows(told[0]), sorted_rows(told[1]), atol=2e-5)
    moved = sample.boxes.copy()
    moved[:, :3], moved[:, 6] = sample.boxes[:, :3] @ new_R_old.T, sample.boxes[:, 6] + a
    np.testing.assert_allclose(np.diag(iou_upright(moved, new.boxes)), 1.0, atol=1e-9)
    assert_same(turned(new, -quarters), sample)


@pytest.mark.parametrize("quarters", range(4))
def test_maps_and_voxels_turn_with_the_camera(quarters: int) -> None:
    """Each cell and voxel is where its place in the episode frame has gone."""
    sample = made("360")
    new = turned(sample, quarters)
    c, s = np.round([np.cos(quarters * np.pi / 2), np.sin(quarters * np.pi / 2)])
    for row in range(8):
        for column in range(8):
            x, y = 3.5 - row, 3.5 - column
            there = c * x + s * y, -s * x + c * y
            cell = int(3.5 - there[0]), int(3.5 - there[1])
            assert new.affordance[cell] == sample.affordance[row, column]
            assert new.affordance_ignored[cell] == sample.affordance_ignored[row, column]
    centres = sample.grid.centres()
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    index, inside = new.grid.index((centres @ turn.T).reshape(-1, 3))
    assert inside.all()
    for name in VOXELS:
        assert np.array_equal(getattr(new, name)[tuple(index.T)], getattr(sample, name).reshape(-1)), name


@given(st.integers(0, 20), st.integers(0, 30), st.integers(1, 10), st.integers(1, 10))
def test_a_crop_is_another_camera_in_the_same_place(row: int, column: int, height: int, width: int) -> None:
    sample = made("pinhole")
    new = cropped(sample, row, column, height, width)
    assert_one_story(new)
    np.testing.assert_allclose(points(new), points(sample)[row : row + height, column : column + width], atol=1e-6)
    assert np.array_equal(new.rgb, sample.rgb[:, row : row + height, column : column + width])
    assert new.boxes is sample.boxes


def test_sometimes_is_a_share_and_follows_its_generator() -> None:
    sample = made("pinhole")
    change = pickle.loads(pickle.dumps(Sometimes(mirrored, 0.25)))  # as a worker gets it

    def drawn(seed: int) -> list[bool]:
        rng = np.random.default_rng(seed)
        return [change(sample, rng) is not sample for _ in range(400)]

    assert 70 < sum(drawn(0)) < 130
    assert drawn(0) == drawn(0)
    assert drawn(0) != drawn(1)
    assert Sometimes(mirrored, 0.0)(sample, np.random.default_rng(0)) is sample
    assert_same(Sometimes(mirrored, 1.0)(sample, np.random.default_rng(0)), mirrored(sample))


def test_what_cannot_be_is_an_error() -> None:
    with pytest.raises(SchemaError, match=r"turned needs an upright 360 camera; found PinholeCamera"):
        turned(made("pinhole"), 1)
    with pytest.raises(SchemaError, match="upright 360"):
        turned(replace(made("360"), tilt_rad=0.1), 1)
    with pytest.raises(SchemaError, match="four divides"):
        turned(replace(made("360"), camera=EquirectangularCamera(66, 33)), 1)
    with pytest.raises(SchemaError, match="cropped needs a pinhole"):
        cropped(made("360"), 0, 0, 4, 4)
    with pytest.raises(SchemaError, match=r"window of 4 x 4 at \(27, 0\) leaves the picture of 30 x 40"):
        cropped(made("pinhole"), 27, 0, 4, 4)
    with pytest.raises(SchemaError, match="square maps"):
        turned(replace(made("360"), maps=np.zeros((1, 4, 6), np.float32)), 1)
