"""Plain forms and back: the same object, whatever it holds; and what does not fit is refused as a SchemaError."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from episode_builders import (
    SENSORS,
    affordance,
    events,
    furniture,
    object_truth,
    occupancy,
    poses,
    same,
    scene,
    true_poses,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import BrownCamera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.convex import box, cylinder
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import rigid
from hsbench.schema import (
    CATEGORIES,
    SKELETONS,
    ActivityMaps,
    AffordanceTruth,
    EventTable,
    Part,
    PoseTable,
    Room,
    Scene,
    SceneObject,
    Sensor,
    codec,
)
from hsbench.schema.scene import TEXTURES

SEEDS = st.integers(0, 2**32 - 1)
FLOATS = st.floats(-1e6, 1e6)
SIZES = st.floats(1e-3, 1e4)
NAMES = st.text(max_size=8)


def through_json(value: Any) -> Any:
    return json.loads(json.dumps(value, allow_nan=False))


# ---------------------------------------------------------------- sensors

PIXELS = st.integers(1, 5000)
LENSES = st.builds(
    BrownCamera,
    *(st.just(n) for n in (640, 480, 330.0, 331.0, 320.0, 240.0)),
    *(st.floats(-small, small) for small in (0.05, 0.01, 0.002, 0.002, 0.001)),
)
PINHOLES = st.builds(PinholeCamera, PIXELS, PIXELS, SIZES, SIZES, FLOATS, FLOATS) | LENSES
CAMERA_OF = {
    "rgbd": PINHOLES,
    "monocular": PINHOLES,
    "equirectangular": PIXELS.map(lambda h: EquirectangularCamera(2 * h, h)),
    "topdown": st.builds(TopDownCamera, PIXELS, PIXELS, SIZES),
}
SENSOR_STRATEGY = st.sampled_from(sorted(CAMERA_OF)).flatmap(
    lambda kind: st.builds(
        Sensor,
        st.just(kind),
        CAMERA_OF[kind],
        st.none() | st.floats(0.001, 99.0),
        st.floats(-np.pi / 2, np.pi / 2),
        st.floats(-np.pi, np.pi),
    )
)


@given(SENSOR_STRATEGY)
def test_sensors(sensor: Sensor) -> None:
    assert same(codec.sensor_from_json(through_json(codec.sensor_to_json(sensor))), sensor)


@pytest.mark.parametrize("kind", SENSORS)
@pytest.mark.parametrize("field", ["kind", "camera", "height_m", "tilt_rad", "roll_rad"])
def test_sensors_have_exactly_their_fields(kind: str, field: str) -> None:
    value = codec.sensor_to_json(SENSORS[kind])
    less = {k: v for k, v in value.items() if k != field}
    with pytest.raises(SchemaError, match=rf"sensor lacks \['{field}'\] and has unknown \[\]"):
        codec.sensor_from_json(less)
    with pytest.raises(SchemaError, match=r"sensor lacks \[\] and has unknown \['tilt_deg'\]; expected exactly"):
        codec.sensor_from_json({**value, "tilt_deg": 3.0})


def test_cameras_have_exactly_their_fields() -> None:
    value = codec.sensor_to_json(SENSORS["rgbd"])
    for change, message in (
        ({"model": "fisheye"}, "sensor.camera.model is 'fisheye'; expected one of pinhole, equirectangular, topdown"),
        ({"model": "equirectangular"}, "sensor.camera lacks"),
        ({"model": "brown"}, "sensor.camera lacks ['k1', 'k2', 'k3', 'p1', 'p2']"),
        ({"fx": 3.0}, "has unknown ['fx']"),
        ({"fx_px": -3.0}, "camera.fx_px is -3.0"),
    ):
        with pytest.raises(SchemaError) as error:
            codec.sensor_from_json({**value, "camera": {**value["camera"], **change}})
        assert message in str(error.value)


# ---------------------------------------------------------------- poses and events


@st.composite
def pose_tables(draw: st.DrawFn) -> PoseTable:
    """Any skeleton, any joints missing, any spacing of time, metres and pixels or one of them; perhaps no pose."""
    skeleton = draw(st.sampled_from(sorted(SKELETONS)))
    rng = np.random.default_rng(draw(SEEDS))
    n, joints = draw(st.integers(0, 7)), len(SKELETONS[skeleton].names)
    rows = sorted(set(zip(rng.integers(0, 3, n).tolist(), rng.integers(-2, 5, n).tolist(), strict=True)))
    n = len(rows)
    state = rng.integers(0, 3, (n, joints)).astype(np.uint8)
    has = draw(st.sampled_from([(True, False), (False, True), (True, True)]))
    values = [
        np.where(state[..., None] == 0, np.nan, rng.normal(size=(n, joints, width)) * 10).astype(np.float32)
        for width in (3, 2)
    ]
    return PoseTable(
        skeleton,
        np.array([t * 33_333_333 for t, _ in rows], dtype=np.int64),
        np.array([track for _, track in rows], dtype=np.int32),
        state,
        *(v if wanted else None for v, wanted in zip(values, has, strict=True)),
    )


@given(pose_tables())
def test_poses(table: PoseTable) -> None:
    plain = codec.poses_to_table(table)
    assert len(plain) == len(table)
    assert same(codec.poses_from_table(plain), table)


def test_poses_as_columns_by_hand() -> None:
    table = codec.poses_to_table(poses(n=2))
    assert table.column_names == ["timestamp_ns", "track_id", "joint_state", "joints_m"]
    assert table.schema.metadata == {b"skeleton": b"kinect-v2-25"}
    row = table["joints_m"][1].as_py()
    assert np.array_equal(np.array(row, np.float32).reshape(25, 3), poses(n=2).joints_m[1], equal_nan=True)


@pytest.mark.parametrize("observed", [0, 3, 6])
def test_true_poses(observed: int) -> None:
    truth = true_poses(observed)
    table, match = codec.true_poses_to_tables(truth)
    assert len(match) == observed
    assert same(codec.true_poses_from_tables(table, match), truth)


def event_tables() -> st.SearchStrategy[EventTable]:
    row = st.tuples(st.integers(0, 9), NAMES, st.integers(0, 70000), NAMES, st.integers(0, 5), st.integers(0, 9), NAMES)
    return st.lists(row, max_size=6).map(
        lambda rows: EventTable(
            np.array([r[0] for r in rows], dtype=np.int32),
            tuple(r[1] for r in rows),
            np.array([r[2] for r in rows], dtype=np.int32),
            tuple(r[3] for r in rows),
            np.cumsum([r[4] for r in rows], dtype=np.int64),
            np.cumsum([r[4] for r in rows], dtype=np.int64) + np.array([r[5] for r in rows], dtype=np.int64),
            tuple(r[6] for r in rows),
        )
    )


@given(event_tables())
def test_events(table: EventTable) -> None:
    assert same(codec.events_from_table(codec.events_to_table(table)), table)


def replaced(table: pa.Table, name: str, values: Any) -> pa.Table:
    index = table.column_names.index(name)
    return table.set_column(index, name, values)


POSES = codec.poses_to_table(poses(n=2))
TRUE, MATCH = codec.true_poses_to_tables(true_poses())
EVENTS = codec.events_to_table(events())
OBJECTS = codec.objects_to_table(object_truth(), scene())
LISTS = POSES["joint_state"].combine_chunks()


@pytest.mark.parametrize(
    ("read", "message"),
    [
        (lambda: codec.poses_from_table(POSES.replace_schema_metadata(None)), "poses table names skeleton ''"),
        (lambda: codec.poses_from_table(POSES.replace_schema_metadata({"skeleton": "x"})), "names skeleton 'x'"),
        (lambda: codec.poses_from_table(POSES.replace_schema_metadata({"skeleton": "coco-17"})), "lists of 51"),
        (lambda: codec.poses_from_table(POSES.drop_columns(["track_id"])), r"poses table lacks columns \['track_id'\]"),
        (lambda: codec.poses_from_table(POSES.drop_columns(["joints_m"])), "neither joints_m nor joints_px"),
        (lambda: codec.poses_from_table(replaced(POSES, "track_id", pa.array([3, 4]))), "track_id has dtype int64"),
        (
            lambda: codec.poses_from_table(replaced(POSES, "track_id", pa.array([3, None], pa.int32()))),
            "track_id has 1 nulls; expected none",
        ),
        (
            lambda: codec.poses_from_table(
                replaced(POSES, "joint_state", pa.array([LISTS[0].as_py(), None], LISTS.type))
            ),
            "joint_state has 1 nulls; expected none",
        ),
        (
            lambda: codec.poses_from_table(replaced(POSES, "joint_state", pa.array([[2] * 25] * 2))),
            "joint_state has type list.*expected lists of 25",
        ),
        (
            lambda: codec.poses_from_table(replaced(POSES, "joints_m", LISTS)),
            "joints_m has type .*expected lists of 75",
        ),
        (
            lambda: codec.poses_from_table(replaced(POSES, "joint_state", LISTS.cast(pa.list_(pa.float64(), 25)))),
            "joint_state holds float64; expected uint8",
        ),
        (lambda: codec.true_poses_from_tables(TRUE.drop_columns(["action"]), MATCH), r"lacks columns \['action'\]"),
        (lambda: codec.true_poses_from_tables(TRUE, TRUE), r"match table lacks columns \['true_row'\]"),
        (lambda: codec.true_poses_from_tables(POSES, MATCH), r"true poses table lacks columns \['action'\]"),
        (lambda: codec.events_from_table(EVENTS.drop_columns(["part", "contact"])), r"\['part', 'contact'\]"),
        (lambda: codec.events_from_table(POSES), "events table lacks columns"),
        (
            lambda: codec.events_from_table(replaced(EVENTS, "activity", pa.array([1, 2]))),
            "activity has type int64.*expected string",
        ),
        (
            lambda: codec.events_from_table(replaced(EVENTS, "contact", pa.array(["pelvis", None]))),
            "contact has type string and 1 nulls",
        ),
        (lambda: codec.events_from_table(replaced(EVENTS, "end_ns", pa.array([0, 0]))), "ends before it starts"),
        (lambda: codec.objects_from_table(EVENTS), "objects table lacks columns"),
        (
            lambda: codec.objects_from_table(replaced(OBJECTS, "evidence", pa.array(["a", "b", "c"]))),
            "evidence has dtype object; expected uint8",
        ),
    ],
)
def test_tables_that_do_not_fit_are_refused(read: Any, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        read()


# ---------------------------------------------------------------- scenes


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """Any number of objects of any category, with parts that are convex or triangle meshes."""
    rng = np.random.default_rng(draw(SEEDS))
    ids = draw(st.lists(st.integers(1, 59999), max_size=4, unique=True).map(sorted))
    colour = st.tuples(*[st.integers(0, 255)] * 3)

    def part(roles: tuple[str, ...]) -> Part:
        role = draw(st.none() | st.sampled_from(roles)) if roles else None
        kind = draw(st.sampled_from(["box", "cylinder", "mesh", "empty"]))
        name = draw(NAMES)
        if kind == "mesh":
            triangles = rng.integers(0, 5, (int(rng.integers(1, 6)), 3)).astype(np.int32)
            return Part(name, draw(colour), role, mesh=(rng.normal(size=(5, 3)), triangles))
        if kind == "empty":
            return Part(name, draw(colour), role, mesh=(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32)))
        size = tuple(rng.uniform(0.01, 2, 3))
        return Part(
            name,
            draw(colour),
            role,
            box(size) if kind == "box" else cylinder(size[0], 0.0, size[1]),
            texture=draw(st.sampled_from(sorted(TEXTURES))),
        )

    def item(object_id: int) -> SceneObject:
        kind = draw(st.sampled_from(CATEGORIES))
        pose = rigid(Rotation.random(random_state=int(rng.integers(2**31))).as_matrix(), tuple(rng.normal(size=3)))
        parts = tuple(part(kind.roles) for _ in range(draw(st.integers(1, 3))))
        return SceneObject(object_id, kind.name, pose, parts, draw(st.booleans()))

    objects = tuple(item(object_id) for object_id in ids)
    outline = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]) + rng.normal(size=(4, 2)) * 0.1
    return Scene(draw(NAMES), (Room(draw(NAMES), outline),), draw(st.floats(0.1, 99)), objects, draw(NAMES))


@settings(max_examples=50)
@given(scenes())
def test_scenes(given_scene: Scene) -> None:
    description, geometry = codec.scene_to_plain(given_scene)
    assert same(codec.scene_from_plain(through_json(description), geometry), given_scene)
    for array in geometry.values():
        assert not array.dtype.hasobject


def test_scene_geometry_counts_from_each_part() -> None:
    _, geometry = codec.scene_to_plain(scene())
    assert geometry["vertex_start"].tolist() == [0, 8, 16, 48, 52]
    assert geometry["triangles"].max() == 31  # the leg of 32 vertices has the largest index


def spoilt(**changes: Any) -> Scene:
    description, geometry = codec.scene_to_plain(scene())
    description = {**description, **changes.pop("description", {})}
    return codec.scene_from_plain(description, {**geometry, **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vertex_start": np.array([0, 8])}, "holds 1 parts; expected the 4 described"),
        ({"triangle_start": np.array([0])}, "scene geometry holds"),
        ({"vertex_start": np.array([0, 2, 16, 48, 52])}, "vertices of shape"),
        ({"description": {"style": "", "area": 1}}, r"scene lacks \[\] and has unknown \['area'\]"),
        ({"description": {"height_m": 250}}, "height_m is 250"),
        ({"description": {"objects": []}}, "holds 4 parts; expected the 0 described"),
        ({"triangles": np.full((200, 3), 99, dtype=np.int32)}, "triangle indices outside"),
    ],
)
def test_scenes_that_do_not_fit_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        spoilt(**changes)


def test_a_colour_of_four_channels_is_refused() -> None:
    description, geometry = codec.scene_to_plain(Scene("s", scene().rooms, 2.5, (furniture(1, box((1, 1, 1))),)))
    description["objects"][0]["parts"][0]["colour"] = [1, 2, 3, 4]
    with pytest.raises(SchemaError, match=r"colour \(1, 2, 3, 4\); expected three"):
        codec.scene_from_plain(description, geometry)


# ---------------------------------------------------------------- truth of space


@given(SEEDS, st.tuples(*[st.integers(1, 9)] * 3))
def test_occupancy(seed: int, shape: tuple[int, int, int]) -> None:
    truth = occupancy(seed, shape)
    grid = codec.grid_from_json(through_json(codec.grid_to_json(truth.grid)))
    assert same(grid, truth.grid)
    assert same(codec.occupancy_from_arrays(codec.occupancy_to_arrays(truth), grid), truth)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"origin_m": [0, 0, 0], "shape": [1, 1, 1]}, "grid lacks"),
        ({"origin_m": [0, 0], "shape": [1, 1, 1], "voxel_m": 0.05}, "grid.origin_m"),
        ({"origin_m": [0, 0, 0], "shape": [1, 1, 1, 1], "voxel_m": 0.05}, "grid.shape"),
        ({"origin_m": [0, 0, 0], "shape": [1, 1, 1], "voxel_m": 0.0}, "grid.voxel_m"),
    ],
)
def test_grids_that_do_not_fit_are_refused(value: dict[str, Any], message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        codec.grid_from_json(value)


def test_occupancy_on_another_grid_is_refused() -> None:
    arrays = codec.occupancy_to_arrays(occupancy())
    with pytest.raises(SchemaError, match=r"occupancy\.\w+ has shape"):
        codec.occupancy_from_arrays(arrays, VoxelGrid((0, 0, 0), (5, 4, 12)))


def test_objects() -> None:
    table = codec.objects_to_table(object_truth(), scene())
    assert same(codec.objects_from_table(table), object_truth())
    assert table["category"].to_pylist() == ["wall", "dining_table", "object"]
    assert table["category_id"].to_pylist() == [item.category.category_id for item in scene().objects]
    assert table["visibility"].to_pylist() == [3, 1, 0]
    columns = ("x_m", "y_m", "z_m", "length_m", "width_m", "height_m", "yaw_rad")
    boxes = np.stack([table[c].to_numpy() for c in columns], axis=-1)
    assert np.array_equal(boxes, [item.box for item in scene().objects])


def test_no_objects() -> None:
    empty = Scene("s", scene().rooms, 2.5, ())
    assert same(codec.objects_from_table(codec.objects_to_table(object_truth(0), empty)), object_truth(0))


@given(SEEDS, st.integers(1, 9), st.integers(1, 9), SIZES)
def test_affordance(seed: int, h: int, w: int, cell_m: float) -> None:
    rng = np.random.default_rng(seed)
    truth = AffordanceTruth(rng.integers(0, 128, (h, w)).astype(np.uint8), rng.random((h, w)) < 0.3, cell_m)
    assert same(codec.affordance_from_arrays(codec.affordance_to_arrays(truth)), truth)
    assert same(codec.affordance_from_arrays(codec.affordance_to_arrays(affordance())), affordance())


@given(
    SEEDS,
    st.lists(st.sampled_from(["walk", "sit", "interact", "größe"]), max_size=3, unique=True),
    st.none() | SIZES,
)
def test_activity_maps(seed: int, channels: list[str], cell_m: float | None) -> None:
    maps = np.random.default_rng(seed).random((len(channels), 3, 4), dtype=np.float32)
    truth = ActivityMaps(maps, tuple(channels), cell_m)
    assert same(codec.activity_maps_from_arrays(codec.activity_maps_to_arrays(truth)), truth)
