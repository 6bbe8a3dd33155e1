"""An invalid object cannot be built, and its message names the item, what was found and what was expected."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from episode_builders import (
    SENSORS,
    affordance,
    events,
    furniture,
    motions,
    object_truth,
    occupancy,
    poses,
    scene,
    true_poses,
)

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera
from hsbench.geometry.convex import box
from hsbench.geometry.transforms import apply, planar
from hsbench.schema import ActivityMaps, Episode, EpisodeTruth, Frame, Part, Room, category
from hsbench.schema.episode import FrameList, check_id
from hsbench.schema.poses import require

CUBE = box((1.0, 1.0, 1.0))
TRIANGLE = (np.eye(3), np.array([[0, 1, 2]], dtype=np.int32))
MAPS = ActivityMaps(np.zeros((2, 4, 5), dtype=np.float32), ("walk", "sit"), 0.1)
FRAMES = FrameList((Frame(0), Frame(100_000_000), Frame(250_000_000)))
EPISODE = Episode("e-1", "d", SENSORS["rgbd"], FRAMES, poses(), 0, 300_000_000, truth=EpisodeTruth(poses=true_poses()))
OUTLINE = scene().rooms[0].outline_xy
BODY = Part("body", (1, 2, 3), "seat", CUBE)
OBJECTS = {
    "sensor": SENSORS["rgbd"],
    "part": BODY,
    "room": scene().rooms[0],
    "object": furniture(4, CUBE),
    "scene": scene(),
    "poses": poses(),
    "poses px": poses(metres=False, pixels=True),
    "true poses": true_poses(),
    "events": events(),
    "motions": motions(),
    "occupancy": occupancy(),
    "objects": object_truth(),
    "affordance": affordance(),
    "maps": MAPS,
    "episode": EPISODE,
}


def edited(array: np.ndarray, index: Any, value: Any) -> np.ndarray:
    copy = array.copy()
    copy[index] = value
    return copy


def given(name: str, field: str) -> np.ndarray:
    return getattr(OBJECTS[name], field)


SHUT = occupancy().semantic
MISSING_JOINT = tuple(np.argwhere(poses().joint_state == 0)[0])
SEEN_JOINT = tuple(np.argwhere(poses().joint_state == 2)[0])

# object, what is wrong about it, and what the message must say: the item, the found, the expected
FAULTS: list[tuple[str, dict[str, Any], tuple[str, ...]]] = [
    # sensor
    ("sensor", {"kind": "lidar"}, ("sensor.kind", "'lidar'", "rgbd, monocular, equirectangular, topdown")),
    (
        "sensor",
        {"camera": EquirectangularCamera(8, 4)},
        ("sensor.camera", "EquirectangularCamera", "PinholeCamera or BrownCamera for kind 'rgbd'"),
    ),
    ("sensor", {"kind": "equirectangular"}, ("sensor.camera", "PinholeCamera", "expected EquirectangularCamera")),
    ("sensor", {"height_m": 1500.0}, ("sensor.height_m", "1500.0", "0..100 m", "millimetres?")),
    ("sensor", {"height_m": 0.0}, ("sensor.height_m", "0.0", "0..100 m")),
    ("sensor", {"height_m": -1.0}, ("sensor.height_m", "-1.0", "0..100 m")),
    ("sensor", {"height_m": np.nan}, ("sensor.height_m", "nan", "0..100 m")),
    ("sensor", {"tilt_rad": 15.0}, ("sensor.tilt_rad", "15.0", "-pi/2..pi/2", "degrees?")),
    ("sensor", {"tilt_rad": np.nan}, ("sensor.tilt_rad", "nan", "-pi/2..pi/2")),
    ("sensor", {"roll_rad": -4.0}, ("sensor.roll_rad", "-4.0", "-pi..pi", "degrees?")),
    ("sensor", {"roll_rad": np.inf}, ("sensor.roll_rad", "inf", "-pi..pi")),
    # scene
    ("part", {"role": "handel"}, ("part 'body'", "'handel'", "expected None or one of", "handle")),
    ("part", {"mesh": TRIANGLE}, ("part 'body'", "both or neither", "exactly one")),
    ("part", {"solid": None}, ("part 'body'", "both or neither", "exactly one")),
    ("part", {"colour": (1, 2)}, ("part 'body'", "(1, 2)", "three integers 0..255")),
    ("part", {"colour": (1, 2, 256)}, ("part 'body'", "(1, 2, 256)", "0..255")),
    ("part", {"colour": (0.5, 0.5, 0.5)}, ("part 'body'", "(0.5, 0.5, 0.5)", "integers")),
    (
        "part",
        {"solid": None, "mesh": (np.eye(4), TRIANGLE[1])},
        ("part 'body' mesh vertices", "(4, 4)", "expected (any, 3)"),
    ),
    (
        "part",
        {"solid": None, "mesh": (np.eye(3), np.array([[0, 1, 2]]))},
        ("part 'body' mesh triangles", "int64", "int32"),
    ),
    (
        "part",
        {"solid": None, "mesh": (np.eye(3), np.array([[0, 1, 3]], dtype=np.int32))},
        ("part 'body'", "triangle indices", "outside 0..2"),
    ),
    ("object", {"category_name": "sofaa"}, ("'sofaa'", "unknown", "expected one of", "sofa")),
    ("object", {"object_id": 0}, ("object_id is 0", "expected 1..59999")),
    ("object", {"object_id": 60000}, ("object_id is 60000", "expected 1..59999")),
    ("object", {"parts": ()}, ("object 4 (sideboard)", "no parts")),
    ("object", {"scene_T_object": np.eye(4) * 2}, ("object 4 (sideboard)", "pose", "no rigid transform")),
    ("object", {"scene_T_object": np.eye(3)}, ("object 4 (sideboard)", "no rigid transform")),
    (
        "object",
        {"parts": (replace(BODY, role="seat"),)},
        ("object 4 (sideboard)", "role seat", "expected of its category"),
    ),
    ("part", {"texture": "wod"}, ("part 'body'", "'wod'", "expected one of", "wood")),
    ("room", {"outline_xy": np.zeros((2, 2))}, ("dining room: outline_xy", "2 corners", "at least 3")),
    ("room", {"outline_xy": np.zeros((4, 3))}, ("dining room: outline_xy", "(4, 3)", "(any, 2)")),
    ("room", {"outline_xy": OUTLINE[::-1]}, ("dining room: outline_xy", "clockwise", "expected counter-clockwise")),
    ("room", {"outline_xy": np.ones((4, 2))}, ("dining room: outline_xy", "no area")),
    ("room", {"outline_xy": edited(OUTLINE, 0, np.nan)}, ("dining room: outline_xy", "not finite", "metres")),
    ("scene", {"rooms": ()}, ("scene-000012 has no rooms", "at least one")),
    ("scene", {"height_m": 250.0}, ("scene-000012: height_m is 250.0", "expected metres", "centimetres?")),
    ("scene", {"height_m": 0.0}, ("scene-000012: height_m is 0.0", "expected metres")),
    ("scene", {"height_m": np.nan}, ("scene-000012: height_m is nan", "expected metres")),
    ("scene", {"objects": scene().objects[::-1]}, ("scene-000012: object ids", "not ascending and unique")),
    ("scene", {"objects": scene().objects[:1] * 2}, ("scene-000012: object ids", "not ascending and unique")),
    # poses
    ("poses", {"skeleton": "kinect"}, ("poses.skeleton", "'kinect'", "kinect-v2-25, coco-17, coco-18, body-25")),
    ("poses", {"skeleton": "coco-17"}, ("poses.joint_state", "(6, 25)", "(6, 17)")),
    (
        "poses",
        {"timestamp_ns": given("poses", "timestamp_ns") / 1e9},
        ("poses.timestamp_ns", "float64", "expected int64"),
    ),
    ("poses", {"track_id": given("poses", "track_id")[:5]}, ("poses.track_id", "(5,)", "(6)")),
    ("poses", {"track_id": [3, 4, 3, 4, 3, 4]}, ("poses.track_id", "list", "numpy array")),
    (
        "poses",
        {"timestamp_ns": edited(given("poses", "timestamp_ns"), 4, 50)},
        ("poses.timestamp_ns", "decreases at row 4", "ordered by time"),
    ),
    (
        "poses",
        {"track_id": np.full(6, 3, dtype=np.int32)},
        ("poses row 1", "repeats or disorders a track", "by time, then track"),
    ),
    (
        "poses",
        {"track_id": edited(given("poses", "track_id"), slice(2, 4), [4, 3])},
        ("poses row 3", "repeats or disorders", "by time, then track"),
    ),
    (
        "poses",
        {"joint_state": edited(given("poses", "joint_state"), (0, 0), 3)},
        ("poses.joint_state", "holds 3", "0 missing, 1 inferred, 2 tracked"),
    ),
    ("poses", {"joints_m": None}, ("poses have neither joints_m nor joints_px", "at least one")),
    (
        "poses",
        {"joints_m": given("poses", "joints_m").astype(np.float64)},
        ("poses.joints_m", "float64", "expected float32"),
    ),
    ("poses", {"joints_m": given("poses", "joints_m")[..., :2]}, ("poses.joints_m", "(6, 25, 2)", "(6, 25, 3)")),
    (
        "poses",
        {"joints_m": edited(given("poses", "joints_m"), MISSING_JOINT, 0.0)},
        (f"poses.joints_m row {MISSING_JOINT[0]} joint", "with state 0", "NaN where, and only where"),
    ),
    (
        "poses",
        {"joints_m": edited(given("poses", "joints_m"), (*MISSING_JOINT, 1), 0.0)},
        (f"poses.joints_m row {MISSING_JOINT[0]} joint", "with state 0", "NaN where, and only where"),
    ),
    (
        "poses px",
        {"joints_px": edited(given("poses px", "joints_px"), MISSING_JOINT, np.inf)},
        (f"poses.joints_px row {MISSING_JOINT[0]} joint", "with state 0", "NaN where, and only where"),
    ),
    (
        "poses",
        {"joints_m": edited(given("poses", "joints_m"), (*SEEN_JOINT, 2), np.nan)},
        (f"poses.joints_m row {SEEN_JOINT[0]} joint", "with state 2", "NaN where, and only where"),
    ),
    (
        "poses",
        {"joints_m": given("poses", "joints_m") * np.float32(1000)},
        ("poses.joints_m reaches", "expected a room", "millimetres?"),
    ),
    ("poses px", {"joints_px": given("poses", "joints_m")}, ("poses.joints_px", "(6, 25, 3)", "(6, 25, 2)")),
    ("true poses", {"action": np.zeros(3, dtype=np.uint8)}, ("true_poses.action", "(3,)", "(4)")),
    ("true poses", {"action": np.full(4, 4, dtype=np.uint8)}, ("true_poses.action", "holds 4", "0..3")),
    ("true poses", {"match": np.array([4])}, ("true_poses.match", "outside rows -1..3")),
    ("true poses", {"match": np.array([-2])}, ("true_poses.match", "outside rows -1..3")),
    ("true poses", {"match": np.array([0], dtype=np.int32)}, ("true_poses.match", "int32", "int64")),
    # events
    ("events", {"person_id": np.array([1], dtype=np.int32)}, ("events.person_id", "(1,)", "(2)")),
    ("events", {"object_id": np.array([1, 2])}, ("events.object_id", "int64", "int32")),
    ("events", {"start_ns": np.array([0.0, 1.0])}, ("events.start_ns", "float64", "int64")),
    ("events", {"end_ns": np.zeros((2, 1), dtype=np.int64)}, ("events.end_ns", "(2, 1)", "(2)")),
    ("events", {"part": ("seat",)}, ("events have 1 parts and 2 contacts", "expected 2 of each")),
    ("events", {"contact": ("", "", "")}, ("events have 2 parts and 3 contacts", "expected 2 of each")),
    ("events", {"end_ns": np.array([7, 4])}, ("events row 1 ends before it starts", "5 > 4")),
    ("events", {"start_ns": np.array([6, 5])}, ("events are not ordered by start_ns",)),
    # truth of space
    ("occupancy", {"semantic": SHUT.astype(np.int32)}, ("occupancy.semantic", "int32", "uint8")),
    ("occupancy", {"instance": SHUT}, ("occupancy.instance", "uint8", "uint16")),
    ("occupancy", {"state": SHUT[:4]}, ("occupancy.state", "(4, 4, 11)", "(5, 4, 11)")),
    ("occupancy", {"ignored": SHUT}, ("occupancy.ignored", "uint8", "bool")),
    ("occupancy", {"swept_s": SHUT.astype(np.float64)}, ("occupancy.swept_s", "float64", "float32")),
    ("occupancy", {"state": np.full_like(SHUT, 7)}, ("occupancy.state", "holds 7", "0..6")),
    ("occupancy", {"semantic": np.ones_like(SHUT)}, ("occupancy.semantic and occupancy.instance", "disagree")),
    (
        "occupancy",
        {"swept_s": np.full(SHUT.shape, np.nan, dtype=np.float32)},
        ("occupancy.swept_s", "NaN or negative", ">= 0 or +inf"),
    ),
    ("occupancy", {"swept_s": np.full(SHUT.shape, -1, dtype=np.float32)}, ("occupancy.swept_s", ">= 0 or +inf")),
    ("occupancy", {"seen_s": SHUT.astype(np.float64)}, ("occupancy.seen_s", "float64", "float32")),
    ("occupancy", {"seen_s": np.full(SHUT.shape, -1, dtype=np.float32)}, ("occupancy.seen_s", ">= 0 or +inf")),
    ("objects", {"object_id": np.array([1, 4, 7])}, ("objects.object_id", "int64", "int32")),
    ("objects", {"visible_px": np.array([0, 0])}, ("objects.visible_px", "(2,)", "(3)")),
    ("objects", {"amodal_px": np.array([1.0, 1.0, 1.0])}, ("objects.amodal_px", "float64", "int64")),
    ("objects", {"evidence": np.array([0, 0, 0])}, ("objects.evidence", "int64", "uint8")),
    ("objects", {"visible_px": np.array([1, 0, 0])}, ("objects.visible_px exceeds amodal_px or is negative",)),
    ("objects", {"visible_px": np.array([-1, 0, 0])}, ("objects.visible_px exceeds amodal_px or is negative",)),
    ("objects", {"evidence": np.array([0, 3, 0], dtype=np.uint8)}, ("objects.evidence", "holds 3", "0..2")),
    ("objects", {"skirted_share": np.array([0, 1.1, 0], dtype=np.float32)}, ("objects.skirted_share", "0..1")),
    ("objects", {"skirted_share": np.array([0, np.nan, 0], dtype=np.float32)}, ("objects.skirted_share", "0..1")),
    ("affordance", {"labels": np.zeros((3, 3))}, ("affordance.labels", "float64", "uint8")),
    ("affordance", {"labels": np.zeros(3, dtype=np.uint8)}, ("affordance.labels", "(3,)", "(any, any)")),
    ("affordance", {"ignored": np.zeros((3, 3), dtype=bool)}, ("affordance.ignored", "(3, 3)", "(8, 16)")),
    ("affordance", {"cell_m": 0.0}, ("affordance.cell_m is 0.0", "metres > 0")),
    ("affordance", {"cell_m": np.nan}, ("affordance.cell_m is nan", "metres > 0")),
    ("motions", {"part": ("", "leg")}, ("motions.timestamp_ns", "(3,)", "(2)")),
    ("motions", {"part": ("leg", "", "")}, ("motions row 1 (5, 4, '')", "rows by time, object, part")),
    ("motions", {"move": np.full((3, 3), np.inf)}, ("motions.move", "NaN or infinity")),
    ("motions", {"move": 4.0 * np.arange(9.0).reshape(3, 3)}, ("object 4 '' by 24 rad", "at most half a turn")),
    # episode
    ("maps", {"channels": ("walk",)}, ("activity_maps.maps", "(2, 4, 5)", "(1, any, any)")),
    ("maps", {"maps": np.zeros((2, 4, 5))}, ("activity_maps.maps", "float64", "float32")),
    ("maps", {"maps": MAPS.maps + np.float32(1.5)}, ("activity_maps.maps", "0..1")),
    ("maps", {"maps": MAPS.maps - np.float32(0.5)}, ("activity_maps.maps", "0..1")),
    ("maps", {"maps": MAPS.maps * np.float32(np.nan)}, ("activity_maps.maps", "NaN")),
    ("maps", {"cell_m": -0.1}, ("activity_maps.cell_m is -0.1", "metres > 0, or None")),
    ("maps", {"cell_m": np.nan}, ("activity_maps.cell_m is nan", "metres > 0, or None")),
    ("episode", {"episode_id": "../e"}, ("episode_id is '../e'", "letters, digits")),
    ("episode", {"end_ns": -1}, ("episode e-1 ends at -1 ns", "before it starts at 0 ns")),
    ("episode", {"end_ns": 240_000_000}, ("episode e-1: frames span 0..250000000 ns", "expected within 0..240000000")),
    ("episode", {"t0_ns": 1}, ("episode e-1: frames span 0..", "expected within 1..300000000")),
    (
        "episode",
        {"frames": FrameList(), "end_ns": 199_999_999},
        ("episode e-1: poses span 0..200000000 ns", "expected within 0..199999999"),
    ),
    ("episode", {"frames": FrameList((Frame(5), Frame(5)))}, ("episode e-1: frame time stamps", "ascend strictly")),
    ("episode", {"frames": FrameList((Frame(7), Frame(3), Frame(9)))}, ("episode e-1: frame time stamps", "ascend")),
    ("episode", {"truth": EpisodeTruth(poses=true_poses(5))}, ("episode e-1: 5 matches for 6 observed poses",)),
    ("episode", {"poses": None}, ("episode e-1: 6 matches for 0 observed poses",)),
]


@pytest.mark.parametrize(("name", "changes", "says"), FAULTS, ids=[f"{n}-{','.join(c)}" for n, c, _ in FAULTS])
def test_what_is_wrong_is_refused_by_name(name: str, changes: dict[str, Any], says: tuple[str, ...]) -> None:
    with pytest.raises(SchemaError) as error:
        replace(OBJECTS[name], **changes)
    message = str(error.value)
    assert "\n" not in message
    for words in says:
        assert words in message


def test_every_array_of_every_object_is_checked() -> None:
    for name, built in OBJECTS.items():
        for field in fields(built):
            value = getattr(built, field.name)
            if isinstance(value, np.ndarray) and name not in ("object", "scene"):
                with pytest.raises(SchemaError):
                    replace(built, **{field.name: value.astype(np.complex64)})
                with pytest.raises(SchemaError):
                    replace(built, **{field.name: value[None]})


@pytest.mark.parametrize("identifier", ["a", "rgbd-activity-000012", "A_b-C.d", "0", "a" * 100, "a..b", "x-"])
def test_identifiers_that_are_file_names(identifier: str) -> None:
    check_id(identifier, "episode_id")


@pytest.mark.parametrize("identifier", ["", ".", "..", ".a", "-", "a/b", "a b", "a\n", "é", "a" * 101, "a\\b", "a:b"])
def test_identifiers_that_are_not(identifier: str) -> None:
    with pytest.raises(SchemaError, match=rf"^episode_id is {re.escape(repr(identifier))}; expected 1-100 letters"):
        check_id(identifier, "episode_id")


def test_require_is_exact() -> None:
    array = np.zeros((2, 3), dtype=np.float32)
    require(array, "x", (2, 3), np.float32)
    require(array, "x", (None, 3), np.float32)
    for shape in ((2,), (2, 3, 1), (3, 2), (None, 2), ()):
        with pytest.raises(SchemaError, match=r"^x has shape \(2, 3\); expected \("):
            require(array, "x", shape, np.float32)
    with pytest.raises(SchemaError, match=r"^x has dtype float32; expected float64$"):
        require(array, "x", (2, 3), np.float64)
    with pytest.raises(SchemaError, match=r"^x is a list; expected a numpy array$"):
        require([1.0], "x", (1,), np.float64)  # type: ignore[arg-type]


def test_looking_up_what_is_not_there_names_what_is() -> None:
    with pytest.raises(SchemaError, match="category 'settee' is unknown; expected one of floor, ceiling, wall"):
        category("settee")
    with pytest.raises(SchemaError, match="scene scene-000012 has no object 5"):
        scene().object(5)
    assert scene().object(7).category_name == "object"
    with pytest.raises(SchemaError, match="skeleton coco-17 has no joint 'neck'; expected one of nose"):
        poses(skeleton="coco-17").layout.index("neck")
    with pytest.raises(SchemaError, match=r"sensor\.height_m is not given"):
        _ = SENSORS["equirectangular"].world_T_camera


def test_the_limits_themselves_are_allowed() -> None:
    replace(SENSORS["rgbd"], tilt_rad=np.pi / 2, roll_rad=-np.pi)
    replace(SENSORS["rgbd"], tilt_rad=-np.pi / 2, roll_rad=np.pi, height_m=99.9)
    furniture(1, CUBE)
    furniture(59999, CUBE)
    replace(EPISODE, frames=FrameList((Frame(0), Frame(300_000_000))))
    replace(EPISODE, frames=FrameList(), end_ns=200_000_000)
    replace(events(), end_ns=events().start_ns)
    replace(true_poses(), match=np.array([-1, 3, 3], dtype=np.int64))
    everything_missing = replace(
        poses(), joint_state=np.zeros((6, 25), dtype=np.uint8), joints_m=np.full((6, 25, 3), np.nan, np.float32)
    )
    assert len(everything_missing) == 6
    PinholeCamera(1, 1, 1e-3, 1e-3, -5.0, 5.0)


def test_an_object_knows_its_box() -> None:
    table = scene().object(4)
    # Legs to 0, top to .74; 1.2 x .8 in its own axes, turned by .7.
    assert np.allclose(table.box, [2.0, 0.3, 0.37, 1.2, 0.8, 0.74, 0.7], rtol=0, atol=1e-9)
    assert len(scene().object(7).solids) == 0
    assert len(table.solids) == 2
    inside = np.array([[2.0, 0.3, 0.72]])
    assert table.solids[0].contains(inside).all()


def test_a_moved_scene_is_the_same_scene_elsewhere() -> None:
    a_T_scene = planar(3.0, -1.0, 0.4)
    still, moved = scene(), scene().moved(a_T_scene)
    for a, b in zip(still.objects, moved.objects, strict=True):
        assert np.allclose(apply(a_T_scene, a.vertices), b.vertices, rtol=0, atol=1e-12)
    for room, there in zip(still.rooms, moved.rooms, strict=True):
        outline = np.column_stack([room.outline_xy, np.zeros(4)])
        assert np.allclose(apply(a_T_scene, outline)[:, :2], there.outline_xy, rtol=0, atol=1e-12)
        assert room.room_type == there.room_type
        assert room.area_m2 == pytest.approx(there.area_m2, rel=1e-9)
    assert (moved.scene_id, moved.style) == (still.scene_id, still.style)


def test_the_room_of_a_point_holds_it_or_is_nearest() -> None:
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    flat = replace(scene(), rooms=(Room("bedroom", square), Room("kitchen", square + [2.2, 0.0])))
    points = np.array([[1.0, 1.0], [2.05, 1.0], [2.15, 1.0], [3.0, 1.0], [9.0, 9.0]])
    assert [flat.room_at(p).room_type for p in points] == ["bedroom", "bedroom", "kitchen", "kitchen", "kitchen"]
    assert flat.contains(points).tolist() == [True, False, False, True, False], "a doorway is in no room"
