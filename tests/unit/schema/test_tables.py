"""The tables of the schema: skeletons, categories, enumerations. Their numbers are on disk and never change."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.schema import (
    CATEGORIES,
    KINECT_V2,
    SKELETONS,
    STRUCTURE,
    Action,
    Evidence,
    JointState,
    ObjectTruth,
    Visibility,
    VoxelState,
    category,
)
from hsbench.schema.skeletons import BODY_25, COCO_17, COCO_18, Skeleton, kinect_map
from hsbench.schema.states import Affordance

# Released names: never remove or reorder one; new ones go behind.
NAMES = (
    "floor", "ceiling", "wall", "door", "window",
    "bed", "sofa", "armchair", "chair", "stool", "office_chair", "bench", "dining_table", "coffee_table",
    "side_table", "desk", "night_stand", "wardrobe", "bookshelf", "sideboard", "dresser", "tv_stand", "television",
    "floor_lamp", "plant", "fridge", "kitchen_counter", "kitchen_island", "shelf", "monitor",
    "rug", "curtain", "clutter", "object",
    "passage",
    "toilet", "bathtub", "shower", "washbasin", "bathroom_cabinet", "washing_machine", "laundry_basket", "wall_cabinet",
    "stove", "dishwasher", "meeting_table", "whiteboard", "filing_cabinet", "coat_rack", "shoe_cabinet", "ottoman",
    "waste_bin", "piano", "bar_stool", "water_cooler", "bunk_bed",
    "range_hood", "mirror", "towel_rail", "radiator", "picture", "wall_clock", "ceiling_lamp",
    "table_lamp", "books", "vase", "bowl", "cup", "plate", "bottle", "pot", "laptop", "keyboard", "microwave", "kettle",
    "cushion", "storage_box",
)  # fmt: skip


def test_category_ids_are_only_ever_appended() -> None:
    names = tuple(c.name for c in CATEGORIES)
    for category_id, name in enumerate(NAMES, start=1):
        assert names[category_id - 1] == name
    assert [c.category_id for c in CATEGORIES] == list(range(1, len(CATEGORIES) + 1))
    assert len({c.name for c in CATEGORIES}) == len(CATEGORIES) <= 254  # uint8, one more for people
    for row in CATEGORIES:
        assert category(row.name) is row


def test_groups_of_categories() -> None:
    assert {category(n).category_id for n in ("floor", "ceiling", "wall", "door", "window", "passage")} == STRUCTURE
    assert {c.group for c in CATEGORIES} == {"structure", "furniture", "fixture", "soft", "clutter", "imported"}
    assert [c.name for c in CATEGORIES if c.group == "soft"] == ["rug", "curtain"]


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        (VoxelState, "UNKNOWN FREE SURFACE OCCLUDED MISSING_DEPTH OUTSIDE_FOV OUTSIDE_ROOM"),
        (Action, "IGNORED STAND SIT INTERACT"),
        (Visibility, "VISIBLE PARTIAL FULLY_OCCLUDED OUTSIDE"),
        (Evidence, "NEITHER SKIRTED USED"),
        (JointState, "MISSING INFERRED TRACKED"),
        (Affordance, "WALKABLE SITTABLE INTERACTABLE LYABLE REACHABLE SUPPORTABLE OPENABLE"),
    ],
)
def test_numbers_of_enumerations(kind: type[IntEnum], names: str) -> None:
    assert {name: int(value) for name, value in kind.__members__.items()} == {
        name: k for k, name in enumerate(names.split())
    }


# ---------------------------------------------------------------- skeletons


@pytest.mark.parametrize("skeleton", SKELETONS.values(), ids=list(SKELETONS))
def test_mirror_swaps_left_and_right(skeleton: Skeleton) -> None:
    mirror = skeleton.mirror
    assert [mirror[mirror[k]] for k in range(len(mirror))] == list(range(len(mirror)))
    for k, name in enumerate(skeleton.names):
        other = skeleton.names[mirror[k]]
        if "left" in name:
            assert other == name.replace("left", "right")
        else:
            assert (other == name) == ("right" not in name)
    bones = {frozenset(b) for b in skeleton.bones}
    assert {frozenset(mirror[k] for k in b) for b in bones} == bones


@pytest.mark.parametrize("skeleton", SKELETONS.values(), ids=list(SKELETONS))
def test_names_and_bones_fit(skeleton: Skeleton) -> None:
    count = len(skeleton.names)
    assert len(set(skeleton.names)) == count
    assert [skeleton.index(n) for n in skeleton.names] == list(range(count))
    assert all(0 <= a < count and 0 <= b < count and a != b for a, b in skeleton.bones)
    assert {k for bone in skeleton.bones for k in bone} == set(range(count))  # every joint hangs on a bone
    assert SKELETONS[skeleton.name] is skeleton


@pytest.mark.parametrize("skeleton", [KINECT_V2, COCO_18, BODY_25], ids=lambda s: s.name)
def test_bones_form_a_tree_from_one_root(skeleton: Skeleton) -> None:
    parents = {child: parent for parent, child in skeleton.bones}
    assert len(parents) == len(skeleton.bones) == len(skeleton.names) - 1
    (root,) = set(range(len(skeleton.names))) - set(parents)
    for joint in parents:
        steps = 0
        while joint != root:
            joint, steps = parents[joint], steps + 1
            assert steps <= len(parents)


def test_joint_orders_are_those_of_their_makers() -> None:
    assert [len(s.names) for s in (KINECT_V2, COCO_17, COCO_18, BODY_25)] == [25, 17, 18, 25]
    # JointType of the Kinect v2 SDK, keypoints of COCO, OpenPose's model pages: spot checks of published indices.
    assert [KINECT_V2.index(n) for n in ("spine_base", "head", "hand_left", "foot_right", "thumb_right")] == [
        0, 3, 7, 19, 24,
    ]  # fmt: skip
    assert [COCO_17.index(n) for n in ("nose", "shoulder_left", "wrist_right", "ankle_right")] == [0, 5, 10, 16]
    assert [COCO_18.index(n) for n in ("neck", "shoulder_right", "ankle_left", "ear_left")] == [1, 2, 13, 17]
    assert [BODY_25.index(n) for n in ("hip_mid", "ankle_left", "big_toe_left", "heel_right")] == [8, 14, 19, 24]


@pytest.mark.parametrize("skeleton", SKELETONS.values(), ids=list(SKELETONS))
def test_maps_from_kinect_commute_with_mirroring(skeleton: Skeleton) -> None:
    joints = kinect_map(skeleton)
    assert len(joints) == len(skeleton.names)
    for k, joint in enumerate(joints):
        mirrored = joints[skeleton.mirror[k]]
        assert mirrored == (-1 if joint == -1 else KINECT_V2.mirror[joint])
        if joint >= 0 and skeleton.names[k] in KINECT_V2.names:
            assert KINECT_V2.names[joint] == skeleton.names[k]
    used = [j for j in joints if j >= 0]
    assert len(set(used)) == len(used)


def test_maps_from_kinect_by_hand() -> None:
    assert kinect_map(KINECT_V2) == tuple(range(25))
    assert [COCO_17.names[k] for k, j in enumerate(kinect_map(COCO_17)) if j < 0] == [
        "nose", "eye_left", "eye_right", "ear_left", "ear_right",
    ]  # fmt: skip
    body = dict(zip(BODY_25.names, kinect_map(BODY_25), strict=True))
    assert body["hip_mid"] == KINECT_V2.index("spine_base")
    assert body["big_toe_left"] == KINECT_V2.index("foot_left")
    assert body["heel_left"] == body["small_toe_right"] == -1


# ---------------------------------------------------------------- classes of visibility


def visibility(visible: int, amodal: int) -> Visibility:
    row = ObjectTruth(
        np.array([1], dtype=np.int32),
        np.array([visible], dtype=np.int64),
        np.array([amodal], dtype=np.int64),
        np.zeros(1, dtype=np.uint8),
        np.zeros(1, dtype=np.float32),
    )
    return Visibility(row.visibility[0])


@pytest.mark.parametrize(
    ("visible", "amodal", "expected"),
    [
        (0, 0, Visibility.OUTSIDE),
        (0, 1, Visibility.FULLY_OCCLUDED),
        (0, 10**6, Visibility.FULLY_OCCLUDED),
        (1, 51, Visibility.FULLY_OCCLUDED),  # 1.96 %
        (19_999, 10**6, Visibility.FULLY_OCCLUDED),
        (20_000, 10**6, Visibility.PARTIAL),  # 2 % is not below 2 %
        (1, 50, Visibility.PARTIAL),
        (599_999, 10**6, Visibility.PARTIAL),
        (3, 5, Visibility.VISIBLE),  # 60 %
        (600_000, 10**6, Visibility.VISIBLE),
        (7, 7, Visibility.VISIBLE),
    ],
)
def test_visibility_at_the_thresholds(visible: int, amodal: int, expected: Visibility) -> None:
    assert visibility(visible, amodal) == expected


@given(st.integers(0, 300_000), st.integers(0, 300_000))
def test_visibility_in_whole_numbers(a: int, b: int) -> None:
    visible, amodal = min(a, b), max(a, b)
    if amodal == 0:
        expected = Visibility.OUTSIDE
    elif 100 * visible < 2 * amodal:
        expected = Visibility.FULLY_OCCLUDED
    elif 100 * visible < 60 * amodal:
        expected = Visibility.PARTIAL
    else:
        expected = Visibility.VISIBLE
    assert visibility(visible, amodal) == expected


def test_no_objects_have_no_visibility() -> None:
    empty = ObjectTruth(*(np.zeros(0, dtype=d) for d in (np.int32, np.int64, np.int64, np.uint8, np.float32)))
    assert empty.visibility.shape == (0,)
    assert empty.visibility.dtype == np.uint8
