"""Scenes put together of several files: our model lists, and Habitat's scene instances and stage configurations.

A model list is JSON of ours, in a frame with z up, metres::

    {"models": [{"file": "sofa.gltf", "name": "sofa", "category": "sofa", "translation": [0, -2.4, 0],
                 "rotation": [1, 0, 0, 0], "scale": 1.0}]}

``file`` is needed. ``rotation`` is a unit quaternion w x y z; ``scene_T_object``, a rigid (4, 4) matrix, may stand for
translation and rotation. The model's own axis of height is that of its format, or ``up``. Each model becomes one node
that holds the nodes of its file; its category, if given, is that of the whole.

Habitat (aihabitat.org, JSON configurations): y up. Templates are looked for by name under the folder of assets.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers.scene_gltf import read_gltf
from hsbench.datasets.importers.scene_obj import read_obj
from hsbench.datasets.importers.scene_source import (
    MAX_FILE_BYTES,
    MAX_NODES,
    TOO_LARGE,
    SourceNode,
    SourceScene,
    check_triangles,
    referenced,
)
from hsbench.errors import DataError
from hsbench.geometry.transforms import apply, is_rigid, matrix_from_quaternion, rigid
from hsbench.io.reading import read_limited
from hsbench.io.strict_json import parse_json
from hsbench.typing import FloatArray

Z_UP_T_Y_UP = rigid(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]), (0.0, 0.0, 0.0))
"""From a frame with y up to one with z up, about x: glTF's front (+z) becomes -y, the front of our objects."""

MODEL_KEYS = ("file", "name", "category", "translation", "rotation", "scene_T_object", "scale", "up")
INSTANCE, STAGE, OBJECT = ".scene_instance.json", ".stage_config.json", ".object_config.json"
HABITAT_FRAME = ((0.0, 1.0, 0.0), (0.0, 0.0, -1.0))  # up, front


def read_source(path: Path, root: Path) -> SourceScene:
    """Any file we read, by its name; what it refers to must lie in ``root``. Raises DataError, naming the item."""
    name = path.name.lower()
    if name.endswith((".glb", ".gltf")):
        return read_gltf(path, root)
    if name.endswith(".obj"):
        return read_obj(path, root)
    if not name.endswith(".json"):
        raise DataError(f"{path}: expected .glb, .gltf, .obj, a model list .json, {INSTANCE} or {STAGE}")
    if name.endswith(STAGE):
        return _joined([_habitat_asset(path, root)], "y", path)
    with _naming(path):
        document = parse_json(read_limited(path, MAX_FILE_BYTES, TOO_LARGE))
        if name.endswith(INSTANCE):
            return _habitat_scene(document, path, root)
        return _model_list(document, path, root)


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Make what is raised inside a DataError of one line that names the file."""
    try:
        yield
    except DataError as error:
        raise DataError(str(error) if str(path) in str(error) else f"{path}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        found = str(error).partition("\n")[0]
        raise DataError(f"{path}: {type(error).__name__} on {found}; expected a scene of models") from error


def to_z_up(up: str) -> FloatArray:
    """(4, 4) turn that makes the axis ``up`` (``y`` or ``z``) the z axis."""
    return Z_UP_T_Y_UP if up == "y" else np.eye(4)


# ---------------------------------------------------------------- our model lists


def _model_list(document: Any, path: Path, root: Path) -> SourceScene:
    if not isinstance(document, dict) or list(document) != ["models"]:
        raise DataError('expected {"models": [...]} and nothing else (a table of labels is given with --labels)')
    placed = []
    for k, entry in enumerate(document["models"]):
        unknown = sorted(set(entry) - set(MODEL_KEYS))
        if unknown or "file" not in entry:
            raise DataError(f"models[{k}] lacks file or has unknown {unknown}; expected of {', '.join(MODEL_KEYS)}")
        file = referenced(entry["file"], path.parent, root, path)
        if file.suffix.lower() == ".json":
            raise DataError(f"models[{k}].file is {entry['file']!r}; expected .glb, .gltf or .obj")
        model = read_source(file, root)
        up = entry.get("up", model.up or "y")
        if up not in ("y", "z"):
            raise DataError(f"models[{k}].up is {up!r}; expected y or z")
        pose = _pose(entry, f"models[{k}]") @ _scaling(entry.get("scale", 1.0), f"models[{k}].scale") @ to_z_up(up)
        extras = {"category": entry["category"]} if "category" in entry else {}
        placed.append((SourceNode(str(entry.get("name", file.stem)), -1, pose, extras=extras), model))
    return _joined(placed, "z", path)


def _pose(entry: Mapping[str, Any], at: str) -> FloatArray:
    if "scene_T_object" in entry:
        pose = np.array(entry["scene_T_object"], dtype=np.float64)
        if "translation" in entry or "rotation" in entry or not is_rigid(pose):
            raise DataError(f"{at}.scene_T_object is no rigid 4 x 4 matrix, or stands beside translation or rotation")
        return pose
    pose = np.eye(4)
    pose[:3, 3] = _vector(entry.get("translation", (0.0, 0.0, 0.0)), 3, f"{at}.translation")
    quaternion = _vector(entry.get("rotation", (1.0, 0.0, 0.0, 0.0)), 4, f"{at}.rotation")
    if abs(float(quaternion @ quaternion) - 1) > 1e-3:
        raise DataError(
            f"{at}.rotation is {quaternion.tolist()}; expected a unit quaternion w x y z (these are angles?)"
        )
    pose[:3, :3] = matrix_from_quaternion(quaternion)
    return pose


def _scaling(value: Any, at: str) -> FloatArray:
    """(4, 4) scaling by a number or by three, all positive."""
    scale = np.broadcast_to(_vector(value if isinstance(value, list) else [value] * 3, 3, at), 3)
    if not (scale > 0).all():
        raise DataError(f"{at} is {value}; expected positive numbers")
    return np.diag([*scale, 1.0])


def _vector(value: Any, length: int, at: str) -> FloatArray:
    vector = np.array(value, dtype=np.float64)
    if vector.shape != (length,) or not np.isfinite(vector).all():
        raise DataError(f"{at} is {value}; expected {length} finite numbers")
    return vector


# ---------------------------------------------------------------- Habitat


def _habitat_scene(document: Any, path: Path, root: Path) -> SourceScene:
    placed = []
    instances = [document["stage_instance"], *document.get("object_instances", ())]
    for k, entry in enumerate(instances):
        template = str(entry["template_name"])
        suffix = OBJECT if k else STAGE
        node, model = _habitat_asset(_template(template, suffix, path, root), root)
        pose = _pose({key: entry[key] for key in ("translation", "rotation") if key in entry}, template)
        pose = pose @ _scaling(entry.get("uniform_scale", 1.0), f"{template}.uniform_scale")
        pose = pose @ _scaling(entry.get("non_uniform_scale", 1.0), f"{template}.non_uniform_scale")
        origin = entry.get("translation_origin", document.get("translation_origin", "com"))
        if k and str(origin).lower() != "asset_local":
            pose = pose @ rigid(np.eye(3), -_centre_of_mass(node, model))
        name = template.rpartition("/")[2]
        placed.append((SourceNode(name, -1, pose @ node.parent_T_node), model))
    scene = _joined(placed, "y", path)
    if document.get("articulated_object_instances"):
        count = len(document["articulated_object_instances"])
        return replace(scene, notes=(*scene.notes, f"{count} articulated objects are left out"))
    return scene


def _template(template: str, suffix: str, path: Path, root: Path) -> Path:
    """The configuration or the model of a template: the only file under the root that bears its name."""
    name = template.rpartition("/")[2]
    for ending in (suffix, ".glb", ".gltf"):
        found = sorted(root.rglob(f"{name}{ending}")) if name and not set(name) & set("*?[\0") else []
        if len(found) > 1:
            raise DataError(f"{path}: template {template!r} could be {found[0]} or {found[1]}; expected one file")
        if found:
            return referenced(found[0].relative_to(root).as_posix(), root, root, path)
    raise DataError(f"{path}: template {template!r}: no {name}{suffix}, .glb or .gltf under {root} (give --assets DIR)")


def _habitat_asset(path: Path, root: Path) -> tuple[SourceNode, SourceScene]:
    """A model in Habitat's frame: turned by the ``up`` and ``front`` of its configuration, scaled to metres."""
    if path.suffix.lower() != ".json":
        return SourceNode(path.stem), read_source(path, root)
    with _naming(path):
        config = parse_json(read_limited(path, MAX_FILE_BYTES, TOO_LARGE))
        file = referenced(config["render_asset"], path.parent, root, path)
        if file.suffix.lower() == ".json":
            raise DataError(f"render_asset is {config['render_asset']!r}; expected a model")
        up, front = (config.get(key, value) for key, value in zip(("up", "front"), HABITAT_FRAME, strict=True))
        own = np.column_stack([_vector(up, 3, "up"), _vector(front, 3, "front")])
        turn = np.eye(4)
        turn[:3, :3] = _frame(np.array(HABITAT_FRAME).T) @ _frame(own).T
        if not is_rigid(turn):
            raise DataError(f"up {up}, front {front}; expected a right angle, length 1")
        scale = _scaling(config.get("scale", [1.0, 1.0, 1.0]), "scale")
        metres = _scaling(config.get("units_to_meters", 1.0), "units_to_meters")
        extras = {} if "COM" not in config else {"COM": _vector(config["COM"], 3, "COM").tolist()}
        node = SourceNode(path.name.partition(".")[0], -1, turn @ scale @ metres, extras=extras)
        return node, read_source(file, root)


def _frame(up_front: FloatArray) -> FloatArray:
    """(3, 2) up and front -> (3, 3) up, front, right."""
    return np.column_stack([up_front, np.cross(up_front[:, 1], up_front[:, 0])])


def _centre_of_mass(node: SourceNode, model: SourceScene) -> FloatArray:
    """(3,) where Habitat's ``com`` puts a translation: the stated centre of mass, else the middle of the box."""
    if "COM" in node.extras:
        return np.array(node.extras["COM"])
    points = [
        apply(node.parent_T_node @ transform, mesh.vertices)
        for transform, entry in zip(world_transforms(model.nodes), model.nodes, strict=True)
        for mesh in entry.meshes
    ]
    every = np.concatenate([np.zeros((1, 3)) if not points else points[0], *points[1:]])
    return np.asarray((every.min(axis=0) + every.max(axis=0)) / 2)


# ---------------------------------------------------------------- trees


def world_transforms(nodes: tuple[SourceNode, ...]) -> list[FloatArray]:
    """(4, 4) affine transform of each node to the frame of the file."""
    found: list[FloatArray] = []
    for node in nodes:
        found.append(node.parent_T_node if node.parent < 0 else found[node.parent] @ node.parent_T_node)
    return found


def _joined(placed: list[tuple[SourceNode, SourceScene]], up: str, path: Path) -> SourceScene:
    """One tree of models, each under the node that places it."""
    nodes: list[SourceNode] = []
    for top, model in placed:
        start = len(nodes)
        nodes.append(top)
        for node in model.nodes:
            parent = start if node.parent < 0 else start + 1 + node.parent
            nodes.append(SourceNode(node.name, parent, node.parent_T_node, node.meshes, node.extras))
        if len(nodes) > MAX_NODES:
            raise DataError(f"{path}: more than {MAX_NODES:,} nodes; expected at most that")
    check_triangles(sum(len(mesh.triangles) for node in nodes for mesh in node.meshes), path)
    notes = tuple(dict.fromkeys(note for _, model in placed for note in model.notes))
    missing = tuple(dict.fromkeys(name for _, model in placed for name in model.missing_textures))
    files = tuple(dict.fromkeys((path, *(file for _, model in placed for file in model.files))))
    return SourceScene(tuple(nodes), up, notes, missing, files)
