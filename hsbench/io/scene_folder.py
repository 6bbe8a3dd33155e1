"""A scene as a folder of its own, apart from any episode: description, geometry, and the truth that needs no camera.

scene.json  scene.npz            rooms, objects, parts: as in an episode's ``truth`` folder
occupancy.json  occupancy.npz    solid voxels with category and instance, if they were computed
walkable.npz                     free (nx, ny) bool, origin_xy (2,) metres, cell_m, if it was computed
affordance.npz                   as in an episode's ``truth`` folder, if it was computed
source.json                      where it came from
manifest.json                    sha256 of every file above
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hsbench.errors import DataError, SchemaError
from hsbench.io.arrays import load_npz, write_npz
from hsbench.io.atomic import atomic_folder, write_json
from hsbench.io.checksums import manifest
from hsbench.io.strict_json import read_json
from hsbench.schema import SCHEMA_VERSION, codec
from hsbench.schema.migration import migrated_scene
from hsbench.schema.occupancy import AffordanceTruth, OccupancyTruth
from hsbench.schema.scene import Scene
from hsbench.typing import AnyArray

SCENE_FILE = "scene.json"
SCENE_FILES = (SCENE_FILE, "scene.npz")
"""What ``read_scene`` reads."""


def write_scene(
    path: Path,
    scene: Scene,
    occupancy: OccupancyTruth | None = None,
    walkable: Mapping[str, AnyArray] | None = None,
    source: Mapping[str, Any] | None = None,
    affordance: AffordanceTruth | None = None,
) -> None:
    """Write a scene as a new folder, whole or not at all. Raises DataError if the folder exists."""
    description, geometry = codec.scene_to_plain(scene)
    with atomic_folder(path) as unit:
        write_json(unit / SCENE_FILE, description)
        write_npz(unit / "scene.npz", **geometry)
        if occupancy is not None:
            write_json(unit / "occupancy.json", codec.grid_to_json(occupancy.grid))
            write_npz(unit / "occupancy.npz", **codec.occupancy_to_arrays(occupancy))
        if walkable is not None:
            write_npz(unit / "walkable.npz", **walkable)
        if affordance is not None:
            write_npz(unit / "affordance.npz", **codec.affordance_to_arrays(affordance))
        if source is not None:
            write_json(unit / "source.json", dict(source))
        write_json(unit / "manifest.json", manifest(unit))


def read_scene(path: Path) -> Scene:
    """The scene of a scene folder or of an episode's folder.

    Raises DataError for missing or damaged files, SchemaError for values that do not fit.
    """
    folder = next((f for f in (path, path / "truth") if (f / SCENE_FILE).is_file()), None)
    if folder is None:
        hint = "packed inputs hold no truth" if (path / "episode.json").is_file() else "hsbench import scene makes one"
        raise DataError(f"{path} holds no {SCENE_FILE}; expected a scene folder or an episode with truth ({hint})")
    try:
        episode = path / "episode.json"
        version = read_json(episode)["schema_version"] if episode.is_file() else SCHEMA_VERSION
        description = migrated_scene(read_json(folder / SCENE_FILE), version)
        return codec.scene_from_plain(description, load_npz(folder / "scene.npz"))
    except SchemaError as error:
        raise SchemaError(f"{folder}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        found = str(error).partition("\n")[0]
        raise DataError(f"{folder}: {type(error).__name__} on {found}; expected a scene") from error


def read_occupancy(path: Path) -> OccupancyTruth:
    """The occupancy of a scene folder. Raises DataError where it is missing or damaged."""
    grid = codec.grid_from_json(read_json(path / "occupancy.json"))
    return codec.occupancy_from_arrays(load_npz(path / "occupancy.npz"), grid)


def read_affordance(path: Path) -> AffordanceTruth:
    """The affordance of a scene folder. Raises DataError where it is missing or damaged."""
    return codec.affordance_from_arrays(load_npz(path / "affordance.npz"))
