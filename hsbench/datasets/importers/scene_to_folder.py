"""Importing a 3D file into a scene folder: what ``hsbench import scene`` does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers.scene_import import ImportedScene, import_scene
from hsbench.datasets.importers.scene_labels import NAMES, LabelTable, nearest_names, read_labels
from hsbench.datasets.importers.scene_placement import INSTANCE
from hsbench.datasets.importers.scene_truth import SceneTruth, scene_truth
from hsbench.errors import DataError
from hsbench.io.checksums import sha256_file
from hsbench.io.dataset_index import require_outside
from hsbench.io.scene_folder import write_scene

MODELS = (".glb", ".gltf", ".obj")


def import_to_folder(
    source: Path, labels: Path | None, out: Path, *, name: str | None = None, default: str | None = None,
    up: str | None = None, scale: float = 1.0, assets: Path | None = None,
) -> tuple[ImportedScene, SceneTruth]:  # fmt: skip
    """Read a file (or the only one of a folder), compute its truth, write both to the new folder ``out``.

    name: scene id (default: the file's name up to its first dot); the rest as in ``import_scene``. Raises DataError.
    """
    require_free(out)
    if default is not None and default not in NAMES:
        hint = ", ".join(nearest_names(default, NAMES)) or "object"
        raise DataError(f"--default {default}: no such category; nearest: {hint}")
    if not (np.isfinite(scale) and scale > 0):
        raise DataError(f"--scale {scale}: expected metres per unit, more than 0")
    path = scene_file(source)
    table = LabelTable({}) if labels is None else read_labels(labels)
    scene_id = name or path.name.partition(".")[0]
    imported = import_scene(path, table, scene_id, assets=assets, up=up, scale=scale, default=default)
    files = (*imported.files, *([labels] if labels else []))
    return imported, store_scene(out, imported, files, {"up": up, "scale": scale, "default": default})


def store_scene(out: Path, imported: ImportedScene, files: Sequence[Path], settings: Mapping[str, Any]) -> SceneTruth:
    """Compute the truth of an imported scene and write both to the new folder ``out``; returns the truth.

    files, settings: what it was read from and how, kept in ``source.json``. Raises DataError if the folder exists.
    """
    truth = scene_truth(imported.scene)
    walk = truth.walk
    hashes = {file.name: sha256_file(file) for file in files}
    write_scene(
        out,
        imported.scene,
        truth.occupancy,
        {"free": walk.free, "origin_xy": walk.origin_xy, "cell_m": np.array(walk.cell_m)},
        {"files": hashes, **settings, "notes": [*imported.notes, *truth.notes]},
        truth.affordance,
    )
    return truth


def require_free(out: Path) -> None:
    """Raise DataError, before any work, where ``out`` is there already or lies inside of a data set."""
    if out.exists():
        raise DataError(f"{out} exists already; choose another place or remove it first")
    require_outside(out)


def scene_file(source: Path) -> Path:
    """The file itself, or of a folder the Habitat scene, else the model, of which there must be one."""
    if not source.is_dir():
        return source
    files = sorted(file for file in source.iterdir() if file.is_file())
    for endings in ((INSTANCE,), MODELS):
        found = [file for file in files if file.name.lower().endswith(endings)]
        if len(found) == 1:
            return found[0]
        if found:
            raise DataError(f"{source} holds {len(found)} scenes ({', '.join(f.name for f in found[:6])}); name one")
    raise DataError(f"{source} holds no {INSTANCE}, {', '.join(MODELS)}; expected a scene")
