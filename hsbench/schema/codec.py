"""The one codec: schema objects to and from plain forms (JSON values, Arrow tables, named arrays).

No files here. ``hsbench.io.episodes`` says which form lies in which file; docs/schema.md lists the columns.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import BrownCamera, Camera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.grids import VoxelGrid, pack_bits, unpack_bits
from hsbench.schema.episode import ActivityMaps
from hsbench.schema.events import EventTable
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.occupancy import (
    AffordanceTruth,
    AffordanceVoxels,
    ObjectTruth,
    OccupancyTruth,
    PartAffordances,
)
from hsbench.schema.poses import PoseTable, TruePoseTable
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import SKELETONS
from hsbench.typing import AnyArray

JsonObject = dict[str, Any]
Arrays = dict[str, AnyArray]

_CAMERAS: dict[str, type[Camera]] = {
    "pinhole": PinholeCamera,
    "equirectangular": EquirectangularCamera,
    "topdown": TopDownCamera,
    "brown": BrownCamera,
}

_MOVE_COLUMNS = ("x_m", "y_m", "yaw_rad")


# ---------------------------------------------------------------- sensor


def sensor_to_json(sensor: Sensor) -> JsonObject:
    """A sensor as a JSON object."""
    model = next(name for name, kind in _CAMERAS.items() if isinstance(sensor.camera, kind))
    return {
        "kind": sensor.kind,
        "camera": {"model": model, **dataclasses.asdict(sensor.camera)},
        "height_m": sensor.height_m,
        "tilt_rad": sensor.tilt_rad,
        "roll_rad": sensor.roll_rad,
    }


def sensor_from_json(value: Mapping[str, Any]) -> Sensor:
    """The inverse of ``sensor_to_json``. Raises SchemaError for a missing, unknown or unfitting field."""
    fields = exact_keys(value, "sensor", ("kind", "camera", "height_m", "tilt_rad", "roll_rad"))
    camera = dict(fields["camera"])
    model = camera.pop("model", None)
    if model not in _CAMERAS:
        raise SchemaError(f"sensor.camera.model is {model!r}; expected one of {', '.join(_CAMERAS)}")
    kind = _CAMERAS[model]
    exact_keys(camera, "sensor.camera", tuple(f.name for f in dataclasses.fields(kind)))
    return Sensor(fields["kind"], kind(**camera), fields["height_m"], fields["tilt_rad"], fields["roll_rad"])


def exact_keys(value: Mapping[str, Any], name: str, keys: tuple[str, ...]) -> Mapping[str, Any]:
    """``value`` if it has exactly these keys. Raises SchemaError naming what is missing or unknown."""
    missing, unknown = set(keys) - set(value), set(value) - set(keys)
    if missing or unknown:
        raise SchemaError(
            f"{name} lacks {sorted(missing)} and has unknown {sorted(unknown)}; expected exactly {list(keys)}"
        )
    return value


# ---------------------------------------------------------------- poses, events and motions


def poses_to_table(poses: PoseTable) -> pa.Table:
    """Poses as columns timestamp_ns, track_id, joint_state, and joints_m and/or joints_px, flattened joint by joint."""
    columns: dict[str, pa.Array] = {
        "timestamp_ns": pa.array(poses.timestamp_ns),
        "track_id": pa.array(poses.track_id),
        "joint_state": _list_column(poses.joint_state),
    }
    for name, joints in (("joints_m", poses.joints_m), ("joints_px", poses.joints_px)):
        if joints is not None:
            columns[name] = _list_column(joints)
    return pa.table(columns).replace_schema_metadata({"skeleton": poses.skeleton})


def poses_from_table(table: pa.Table) -> PoseTable:
    """The inverse of ``poses_to_table``. Raises SchemaError for missing columns or an unknown skeleton."""
    skeleton = (table.schema.metadata or {}).get(b"skeleton", b"").decode()
    if skeleton not in SKELETONS:
        raise SchemaError(f"poses table names skeleton {skeleton!r}; expected one of {', '.join(SKELETONS)}")
    n_joints = len(SKELETONS[skeleton].names)
    require_columns(table, "poses", ("timestamp_ns", "track_id", "joint_state"))
    joints = {
        name: _list_values(table, name, (n_joints, width), np.float32) if name in table.column_names else None
        for name, width in (("joints_m", 3), ("joints_px", 2))
    }
    return PoseTable(
        skeleton,
        _values(table, "timestamp_ns", np.int64),
        _values(table, "track_id", np.int32),
        _list_values(table, "joint_state", (n_joints,), np.uint8),
        joints["joints_m"],
        joints["joints_px"],
    )


def true_poses_to_tables(truth: TruePoseTable) -> tuple[pa.Table, pa.Table]:
    """(true poses with a column action, matches with a column true_row: one row an observed pose)."""
    table = poses_to_table(truth.poses)
    metadata = table.schema.metadata
    table = table.append_column("action", pa.array(truth.action)).replace_schema_metadata(metadata)
    return table, pa.table({"true_row": pa.array(truth.match)})


def true_poses_from_tables(poses: pa.Table, match: pa.Table) -> TruePoseTable:
    """The inverse of ``true_poses_to_tables``."""
    require_columns(poses, "true poses", ("action",))
    require_columns(match, "match", ("true_row",))
    return TruePoseTable(
        poses_from_table(poses), _values(poses, "action", np.uint8), _values(match, "true_row", np.int64)
    )


def events_to_table(events: EventTable) -> pa.Table:
    """Events, one row each, columns named as the fields."""
    return pa.table(
        {
            "person_id": pa.array(events.person_id),
            "activity": pa.array(list(events.activity), pa.string()),
            "object_id": pa.array(events.object_id),
            "part": pa.array(list(events.part), pa.string()),
            "start_ns": pa.array(events.start_ns),
            "end_ns": pa.array(events.end_ns),
            "contact": pa.array(list(events.contact), pa.string()),
        }
    )


def events_from_table(table: pa.Table) -> EventTable:
    """The inverse of ``events_to_table``."""
    require_columns(table, "events", tuple(f.name for f in dataclasses.fields(EventTable)))
    return EventTable(
        _values(table, "person_id", np.int32),
        _strings(table, "activity"),
        _values(table, "object_id", np.int32),
        _strings(table, "part"),
        _values(table, "start_ns", np.int64),
        _values(table, "end_ns", np.int64),
        _strings(table, "contact"),
    )


def motions_to_table(motions: ObjectMotions) -> pa.Table:
    """Motions, one key pose a row: columns timestamp_ns, object_id, part, and the move as x_m, y_m, yaw_rad."""
    columns: dict[str, Any] = {
        "timestamp_ns": pa.array(motions.timestamp_ns),
        "object_id": pa.array(motions.object_id),
        "part": pa.array(list(motions.part), pa.string()),
    }
    for axis, name in enumerate(_MOVE_COLUMNS):
        columns[name] = pa.array(motions.move[:, axis])
    return pa.table(columns)


def motions_from_table(table: pa.Table) -> ObjectMotions:
    """The inverse of ``motions_to_table``."""
    require_columns(table, "motions", ("timestamp_ns", "object_id", "part", *_MOVE_COLUMNS))
    return ObjectMotions(
        _values(table, "timestamp_ns", np.int64),
        _values(table, "object_id", np.int32),
        _strings(table, "part"),
        np.column_stack([_values(table, name, np.float64) for name in _MOVE_COLUMNS]),
    )


# ---------------------------------------------------------------- scene


def scene_to_plain(scene: Scene) -> tuple[JsonObject, Arrays]:
    """(description, geometry): part k of the description owns vertex rows vertex_start[k]:[k + 1] of the arrays,
    in its object's frame, and likewise triangles; triangle indices count from the part's first vertex.
    """
    parts = [part for item in scene.objects for part in item.parts]
    description = {
        "scene_id": scene.scene_id,
        "style": scene.style,
        "height_m": scene.height_m,
        "rooms": [{"room_type": r.room_type, "outline_xy": r.outline_xy.tolist()} for r in scene.rooms],
        "objects": [
            {
                "object_id": item.object_id,
                "category": item.category_name,
                "movable": item.movable,
                "scene_T_object": item.scene_T_object.tolist(),
                "parts": [
                    {
                        "name": p.name,
                        "role": p.role,
                        "colour": list(p.colour),
                        "texture": p.texture,
                        "convex": p.solid is not None,
                    }
                    for p in item.parts
                ],
            }
            for item in scene.objects
        ],
    }
    geometry: Arrays = {
        "vertices": np.concatenate([np.empty((0, 3)), *(p.vertices for p in parts)]),
        "vertex_start": np.cumsum([0, *(len(p.vertices) for p in parts)], dtype=np.int64),
        "triangles": np.concatenate([np.empty((0, 3), np.int32), *(p.triangles for p in parts)]),
        "triangle_start": np.cumsum([0, *(len(p.triangles) for p in parts)], dtype=np.int64),
    }
    return description, geometry


def scene_from_plain(description: Mapping[str, Any], geometry: Mapping[str, AnyArray]) -> Scene:
    """The inverse of ``scene_to_plain``. Raises SchemaError where description and geometry disagree."""
    exact_keys(description, "scene", ("scene_id", "style", "height_m", "rooms", "objects"))
    n_parts = sum(len(item["parts"]) for item in description["objects"])
    vertex_start, triangle_start = geometry["vertex_start"], geometry["triangle_start"]
    if len(vertex_start) != n_parts + 1 or len(triangle_start) != n_parts + 1:
        raise SchemaError(f"scene geometry holds {len(vertex_start) - 1} parts; expected the {n_parts} described")
    objects, k = [], 0
    for item in description["objects"]:
        parts = []
        for entry in item["parts"]:
            vertices = geometry["vertices"][vertex_start[k] : vertex_start[k + 1]]
            triangles = geometry["triangles"][triangle_start[k] : triangle_start[k + 1]]
            convex = entry["convex"]
            parts.append(
                Part(
                    entry["name"],
                    tuple(entry["colour"]),
                    entry["role"],
                    ConvexSolid(vertices, triangles) if convex else None,
                    None if convex else (vertices, triangles),
                    entry["texture"],
                )
            )
            k += 1
        pose = np.array(item["scene_T_object"], dtype=np.float64)
        objects.append(SceneObject(item["object_id"], item["category"], pose, tuple(parts), item["movable"]))
    return Scene(
        description["scene_id"],
        tuple(Room(r["room_type"], np.array(r["outline_xy"], dtype=np.float64)) for r in description["rooms"]),
        description["height_m"],
        tuple(objects),
        description["style"],
    )


# ---------------------------------------------------------------- truth of space


def grid_to_json(grid: VoxelGrid) -> JsonObject:
    """A grid as a JSON object."""
    return {"origin_m": list(grid.origin_m), "shape": list(grid.shape), "voxel_m": grid.voxel_m}


def grid_from_json(value: Mapping[str, Any]) -> VoxelGrid:
    """The inverse of ``grid_to_json``."""
    exact_keys(value, "grid", ("origin_m", "shape", "voxel_m"))
    return VoxelGrid(tuple(value["origin_m"]), tuple(value["shape"]), value["voxel_m"])


def occupancy_to_arrays(occupancy: OccupancyTruth) -> Arrays:
    """Occupancy truth as arrays; bits are packed along z in little bit order, the grid is stored apart."""
    arrays: Arrays = {
        "semantic": occupancy.semantic,
        "instance": occupancy.instance,
        "state": occupancy.state,
        "ignored_bits": pack_bits(occupancy.ignored),
        "swept_s": occupancy.swept_s,
    }
    return arrays if occupancy.seen_s is None else {**arrays, "seen_s": occupancy.seen_s}


def occupancy_from_arrays(arrays: Mapping[str, AnyArray], grid: VoxelGrid) -> OccupancyTruth:
    """The inverse of ``occupancy_to_arrays``."""
    return OccupancyTruth(
        grid,
        arrays["semantic"],
        arrays["instance"],
        arrays["state"],
        unpack_bits(arrays["ignored_bits"], grid.shape[2]),
        arrays["swept_s"],
        arrays.get("seen_s"),
    )


def objects_to_table(truth: ObjectTruth, scene: Scene) -> pa.Table:
    """Truth per object with its category and box, one row an object."""
    boxes = np.array([item.box for item in scene.objects]).reshape(-1, 7)
    columns: dict[str, Any] = {
        "object_id": truth.object_id,
        "category": [item.category_name for item in scene.objects],
        "category_id": np.array([item.category.category_id for item in scene.objects], dtype=np.uint8),
    }
    for k, name in enumerate(("x_m", "y_m", "z_m", "length_m", "width_m", "height_m", "yaw_rad")):
        columns[name] = boxes[:, k]
    columns |= {
        "visible_px": truth.visible_px,
        "amodal_px": truth.amodal_px,
        "visibility": truth.visibility,
        "evidence": truth.evidence,
        "skirted_share": truth.skirted_share,
    }
    return pa.table(columns)


def objects_from_table(table: pa.Table) -> ObjectTruth:
    """The inverse of ``objects_to_table``, less what the scene says."""
    require_columns(table, "objects", ("object_id", "visible_px", "amodal_px", "evidence", "skirted_share"))
    return ObjectTruth(
        _values(table, "object_id", np.int32),
        _values(table, "visible_px", np.int64),
        _values(table, "amodal_px", np.int64),
        _values(table, "evidence", np.uint8),
        _values(table, "skirted_share", np.float32),
    )


def affordance_to_arrays(truth: AffordanceTruth) -> Arrays:
    """Affordance as arrays: top-down ``labels`` and ``ignored``, ``cell_m`` 0-d, and where known the parts (``part_*``)
    and the voxels with their grid (``voxel_*``).
    """
    arrays: Arrays = {"labels": truth.labels, "ignored": truth.ignored, "cell_m": np.array(truth.cell_m)}
    if (parts := truth.parts) is not None:
        arrays |= {
            "part_object_id": parts.object_id,
            "part_index": parts.part_index,
            "part_name": np.array(parts.part, dtype=np.str_),
            "part_labels": parts.labels,
        }
    if (voxels := truth.voxels) is not None:
        arrays |= {
            "voxel_labels": voxels.labels,
            "voxel_origin_m": np.array(voxels.grid.origin_m),
            "voxel_m": np.array(voxels.grid.voxel_m),
        }
    return arrays


def affordance_from_arrays(arrays: Mapping[str, AnyArray]) -> AffordanceTruth:
    """The inverse of ``affordance_to_arrays``."""
    parts = voxels = None
    if "part_labels" in arrays:
        names = tuple(map(str, arrays["part_name"]))
        parts = PartAffordances(arrays["part_object_id"], arrays["part_index"], names, arrays["part_labels"])
    if "voxel_labels" in arrays:
        labels = arrays["voxel_labels"]
        x, y, z = arrays["voxel_origin_m"].tolist()
        nx, ny, nz = labels.shape
        voxels = AffordanceVoxels(VoxelGrid((x, y, z), (nx, ny, nz), float(arrays["voxel_m"])), labels)
    return AffordanceTruth(arrays["labels"], arrays["ignored"], float(arrays["cell_m"]), parts, voxels)


def activity_maps_to_arrays(maps: ActivityMaps) -> Arrays:
    """Activity maps as arrays; an unknown scale is NaN in ``cell_m``."""
    return {
        "maps": maps.maps,
        "channels": np.array(maps.channels),
        "cell_m": np.array(np.nan if maps.cell_m is None else maps.cell_m),
    }


def activity_maps_from_arrays(arrays: Mapping[str, AnyArray]) -> ActivityMaps:
    """The inverse of ``activity_maps_to_arrays``."""
    cell_m = float(arrays["cell_m"])
    return ActivityMaps(arrays["maps"], tuple(map(str, arrays["channels"])), None if np.isnan(cell_m) else cell_m)


# ---------------------------------------------------------------- columns


def require_columns(table: pa.Table, name: str, columns: tuple[str, ...]) -> None:
    """Raise SchemaError unless a table has these columns."""
    missing = [c for c in columns if c not in table.column_names]
    if missing:
        raise SchemaError(f"{name} table lacks columns {missing}; found {table.column_names}")


def _list_column(values: AnyArray) -> pa.Array:
    flat = np.ascontiguousarray(values).reshape(-1)
    return pa.FixedSizeListArray.from_arrays(pa.array(flat), int(np.prod(values.shape[1:])))


def _values(table: pa.Table, name: str, dtype: type) -> AnyArray:
    column = table[name].combine_chunks()
    if column.null_count:
        raise SchemaError(f"column {name} has {column.null_count} nulls; expected none")
    values = column.to_numpy(zero_copy_only=False)
    if values.dtype != np.dtype(dtype):
        raise SchemaError(f"column {name} has dtype {values.dtype}; expected {np.dtype(dtype)}")
    return np.array(values)


def _strings(table: pa.Table, name: str) -> tuple[str, ...]:
    column = table[name]
    if not pa.types.is_string(column.type) or column.null_count:
        raise SchemaError(
            f"column {name} has type {column.type} and {column.null_count} nulls; expected string and none"
        )
    return tuple(column.to_pylist())


def _list_values(table: pa.Table, name: str, item_shape: tuple[int, ...], dtype: type) -> AnyArray:
    column = table[name].combine_chunks()
    if column.null_count:
        raise SchemaError(f"column {name} has {column.null_count} nulls; expected none")
    width = int(np.prod(item_shape))
    if not pa.types.is_fixed_size_list(column.type) or column.type.list_size != width:
        raise SchemaError(f"column {name} has type {column.type}; expected lists of {width}")
    values = column.flatten().to_numpy(zero_copy_only=False)
    if values.dtype != np.dtype(dtype):
        raise SchemaError(f"column {name} holds {values.dtype}; expected {np.dtype(dtype)}")
    return np.array(values).reshape(len(table), *item_shape)
