"""Descriptions of older schema versions, brought step by step to the present version as they are read.

Files stay as they are. A step says what a version wrote otherwise than the next one: in the descriptor of an episode
(``episode.json``) and in the description of its scene (``truth/scene.json``). Tables and arrays kept their columns, but
for the patches of recordings, which 0.4 packs (``hsbench.io.old_patches`` reads the others), and category ids their
meaning; what a later version added is absent, as it may be in any episode.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hsbench.errors import SchemaError
from hsbench.schema import SCHEMA_VERSION
from hsbench.schema.categories import category

JsonObject = Mapping[str, Any]


@dataclass(frozen=True)
class Step:
    """From one version to the next: how its ``episode.json`` and its ``scene.json`` become those of the next."""

    source: str
    target: str
    episode: Callable[[JsonObject], JsonObject]
    scene: Callable[[JsonObject], JsonObject]


def migrated_episode(descriptor: JsonObject) -> JsonObject:
    """A descriptor of any known version as one of ``SCHEMA_VERSION``. Raises SchemaError as ``steps_from``."""
    for step in steps_from(descriptor.get("schema_version")):
        descriptor = {**step.episode(descriptor), "schema_version": step.target}
    return descriptor


def migrated_scene(description: JsonObject, version: object) -> JsonObject:
    """The description of a scene that an episode of ``version`` holds, as one of ``SCHEMA_VERSION``."""
    for step in steps_from(version):
        description = step.scene(description)
    return description


def steps_from(version: object) -> tuple[Step, ...]:
    """The steps from a version to the present one. Raises SchemaError for an unknown one, and says if it is newer."""
    known = [*(step.source for step in STEPS), SCHEMA_VERSION]
    if version not in known:
        hint = "a newer hsbench wrote it: upgrade hsbench" if is_newer(version) else "is this an hsbench data set?"
        older = " or ".join(known[:-1])
        raise SchemaError(f"schema_version is {version!r}; expected {SCHEMA_VERSION!r}, or an older {older} ({hint})")
    return STEPS[known.index(version) :]


def is_newer(version: object) -> bool:
    """Whether a version, such as "0.5", comes after the present one."""
    numbers = [re.fullmatch(r"(\d{1,9})\.(\d{1,9})", text) for text in (str(version), SCHEMA_VERSION)]
    found, present = (None if match is None else tuple(map(int, match.groups())) for match in numbers)
    return found is not None and present is not None and found > present


def _unchanged(value: JsonObject) -> JsonObject:
    return value


def _with_rooms_and_textures(scene: JsonObject) -> JsonObject:
    """0.1 had one room, ``room_type`` and ``room_xy`` (but the last of it several), parts without textures, and no rule
    which roles the parts of a category may have: a role it may not have now is dropped.
    """
    scene = dict(scene)
    if "room_type" in scene:
        scene["rooms"] = [{"room_type": scene.pop("room_type"), "outline_xy": scene.pop("room_xy")}]
    scene["objects"] = [
        {**item, "parts": [_with_texture(part, category(item["category"]).roles) for part in item["parts"]]}
        for item in scene["objects"]
    ]
    return scene


def _with_texture(part: JsonObject, roles: tuple[str, ...]) -> JsonObject:
    return {"texture": "", **part, "role": part["role"] if part["role"] in roles else None}


def _with_image_noise(descriptor: JsonObject) -> JsonObject:
    """0.2 had pictures without noise; the last of 0.2 wrote ``image_noise`` already."""
    return {"image_noise": None, **descriptor}


STEPS: tuple[Step, ...] = (
    Step("0.1", "0.2", _unchanged, _with_rooms_and_textures),
    Step("0.2", "0.3", _with_image_noise, _unchanged),
    Step("0.3", "0.4", _unchanged, _unchanged),
)
"""In order, each from where the one before ends; the last ends at ``SCHEMA_VERSION``."""
