"""Used, skirted or neither: hand-made swept volumes, and the swept share from a plain loop over columns."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.geometry.convex import box
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.rays import RayImage
from hsbench.schema.categories import category
from hsbench.schema.events import EventTable
from hsbench.schema.occupancy import ObjectTruth, OccupancyTruth
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.schema.states import Evidence, VoxelState
from hsbench.truth.objects import object_truth

GRID = VoxelGrid((0.0, 0.0, 0.0), (40, 30, 44))
ROOM = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.5], [0.0, 1.5]])
Box = tuple[slice, slice, slice]


class Volume:
    """A room of voxels to fill in: objects by id, what bodies swept, what lies outside."""

    def __init__(self, **kinds: str) -> None:
        self.kinds = {int(name[1:]): kind for name, kind in kinds.items()}
        self.instance = np.zeros(GRID.shape, dtype=np.uint16)
        self.swept = np.full(GRID.shape, np.inf, dtype=np.float32)
        self.state = np.full(GRID.shape, VoxelState.FREE, dtype=np.uint8)

    def truth(self, contacts: tuple[tuple[int, str], ...] = ()) -> ObjectTruth:
        semantic = np.zeros(GRID.shape, dtype=np.uint8)
        for object_id, kind in self.kinds.items():
            semantic[self.instance == object_id] = category(kind).category_id
        solid = Part("body", (1, 2, 3), solid=box((1, 1, 1)))
        scene = Scene(
            "s", (Room("r", ROOM),), 2.2, tuple(SceneObject(i, k, np.eye(4), (solid,)) for i, k in self.kinds.items())
        )
        n = len(contacts)
        stamps = np.arange(n, dtype=np.int64)
        ids = np.array([i for i, _ in contacts], dtype=np.int32)
        events = EventTable(
            np.ones(n, np.int32), ("x",) * n, ids, ("",) * n, stamps, stamps, tuple(c for _, c in contacts)
        )
        image = RayImage(
            np.ones((2, 2)), np.full((2, 2), -1, dtype=np.int32), np.zeros(len(self.kinds), dtype=np.int64)
        )
        occupancy = OccupancyTruth(GRID, semantic, self.instance, self.state, np.zeros(GRID.shape, bool), self.swept)
        return object_truth(scene, image, occupancy, events)

    def share_by_loop(self, object_id: int) -> float:
        """Columns within .30 m of one of the object's, free up to 1.75 m (rugs aside), in the room: share swept."""
        mine = {(i, j) for i, j, _ in np.argwhere(self.instance == object_id).tolist()}
        rugs = [i for i, kind in self.kinds.items() if kind == "rug"]
        border = swept = 0
        for i in range(GRID.shape[0]):
            for j in range(GRID.shape[1]):
                column = self.instance[i, j, :35]
                if np.any((column > 0) & ~np.isin(column, rugs)) or self.state[i, j, 0] == VoxelState.OUTSIDE_ROOM:
                    continue
                if any((i - a) ** 2 + (j - b) ** 2 <= 6**2 for a, b in mine):
                    border += 1
                    swept += bool(np.isfinite(self.swept[i, j]).any())
        return swept / border if border else 0.0


def test_a_free_standing_column_by_hand() -> None:
    volume = Volume(_5="chair")
    volume.instance[20, 15, :10] = 5
    assert volume.truth().skirted_share.tolist() == [0.0]
    volume.swept[21:, :, 3] = 2.0  # everything on one side of it
    # 113 columns lie within 6 of the middle one; 13 of them in its row (one is the object): (113 - 13) / 2 = 50.
    assert volume.truth().skirted_share[0] == np.float32(50 / 112)
    assert volume.truth().evidence.tolist() == [Evidence.NEITHER]
    volume.swept[20, 16:22, 40] = 9.0  # six more columns, at any height: 56 of 112
    assert volume.truth().skirted_share[0] == 0.5
    assert volume.truth().evidence.tolist() == [Evidence.SKIRTED]


def test_touched_things_are_used_whoever_walks_by() -> None:
    volume = Volume(_1="sofa", _2="plant", _3="desk", _4="fridge")
    for k in range(4):
        volume.instance[10 * k + 4, 15, :10] = k + 1
    volume.swept[:20] = 1.0
    truth = volume.truth(((2, ""), (3, "hand_left"), (1, "pelvis"), (0, "hand_right"), (1, "")))
    assert truth.evidence.tolist() == [Evidence.USED, Evidence.SKIRTED, Evidence.USED, Evidence.NEITHER]
    assert truth.skirted_share[0] == 1.0
    assert truth.skirted_share[3] == 0.0


def test_walls_are_never_skirted() -> None:
    volume = Volume(_1="wall", _2="sofa")
    volume.instance[0, :, :] = 1
    volume.instance[10, 15, :10] = 2
    volume.swept[:] = 0.0
    truth = volume.truth()
    assert truth.evidence.tolist() == [Evidence.NEITHER, Evidence.SKIRTED]
    assert truth.skirted_share.tolist() == [0.0, 1.0]


def test_things_outside_the_grid_are_not_skirted() -> None:
    volume = Volume(_1="sofa")
    volume.swept[:] = 0.0
    truth = volume.truth()
    assert truth.evidence.tolist() == [Evidence.NEITHER]
    assert truth.skirted_share.tolist() == [0.0]


def test_a_thing_without_free_border_is_not_skirted() -> None:
    volume = Volume(_1="wardrobe", _2="chair")
    volume.instance[:, :, :10] = 1
    volume.instance[20, 15, :10] = 2
    volume.swept[:] = 0.0
    assert volume.truth().evidence.tolist() == [Evidence.NEITHER, Evidence.NEITHER]


@pytest.mark.parametrize("top", [34, 35])
def test_what_hangs_above_a_body_leaves_the_border_free(top: int) -> None:
    # BORDER_HEIGHT is 1.75 m, 35 voxels: a shelf from voxel 34 on blocks, one from voxel 35 on does not.
    volume = Volume(_1="chair", _2="shelf")
    volume.instance[20, 15, :10] = 1
    volume.instance[21:27, :, top:] = 2
    volume.swept[21:] = 0.0
    assert volume.truth().skirted_share[0] == pytest.approx(0.0 if top == 34 else 50 / 112)


def test_rugs_are_walked_on() -> None:
    bare, covered = Volume(_1="coffee_table", _2="rug"), Volume(_1="coffee_table", _2="rug")
    covered.instance[10:30, 5:25, 0] = 2
    for volume in (bare, covered):
        volume.instance[18:22, 13:17, :9] = 1
        volume.swept[22:, :, 2] = 4.0
    assert bare.truth().skirted_share[0] == covered.truth().skirted_share[0] > 0.3


def test_columns_outside_the_room_are_no_border() -> None:
    volume = Volume(_1="chair")
    volume.instance[20, 15, :10] = 1
    volume.state[:20] = VoxelState.OUTSIDE_ROOM
    volume.swept[21:] = 0.0
    assert volume.truth().skirted_share[0] == np.float32(50 / 62)  # 100 / 2 swept of them and 12 in its own row


@pytest.mark.parametrize("seed", range(4))
def test_shares_agree_with_a_loop_over_columns(seed: int) -> None:
    rng = np.random.default_rng(seed)
    volume = Volume(_2="sofa", _3="rug", _4="shelf", _9="dining_table")
    for object_id in (3, 2, 4, 9):
        x, y = rng.integers(0, 30), rng.integers(0, 22)
        bottom, top = {2: (0, 9), 3: (0, 1), 4: (30, 38), 9: (13, 15)}[object_id]
        volume.instance[x : x + rng.integers(2, 10), y : y + rng.integers(2, 8), bottom:top] = object_id
    volume.swept[rng.random(GRID.shape) < 0.02] = 3.0
    volume.state[:, :4] = VoxelState.OUTSIDE_ROOM
    truth = volume.truth()
    for object_id, share in zip(truth.object_id, truth.skirted_share, strict=True):
        assert share == pytest.approx(volume.share_by_loop(int(object_id)), abs=1e-7)
    expected = np.where(truth.skirted_share >= 0.5, Evidence.SKIRTED, Evidence.NEITHER)
    assert np.array_equal(truth.evidence, expected)
    assert truth.skirted_share.max() > 0
