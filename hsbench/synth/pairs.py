"""Controlled pairs: two rooms that differ in one object nobody can see or has come near.

All that is published of both must be the same bytes: pictures, depth, observed poses. What decides is geometry alone,
so that the same pairs are made with any renderer and with none; a test compares the bytes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.schema.episode import EpisodeTruth
from hsbench.schema.poses import PoseTable
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import Evidence
from hsbench.synth.furniture import HANGING, MOVABLE, WALL_HUNG, Style, build
from hsbench.truth.sight import ray_image
from hsbench.truth.validity import floating
from hsbench.typing import FloatArray

ANYWHERE = (
    "armchair", "bench", "bookshelf", "chair", "dresser", "filing_cabinet", "floor_lamp", "laundry_basket",
    "night_stand", "ottoman", "plant", "sideboard", "side_table", "stool", "waste_bin",
)  # fmt: skip
"""What may stand in a corner of any room."""
FITS = (0.5, 0.0)  # how small a variant of each category is asked for, in turn
FINER = 3  # rays a pixel along both axes: pictures are drawn with several samples a pixel
SLACK_M = 1e-6


def hidden_objects(scene: Scene, sensor: Sensor, moved: frozenset[int] = frozenset()) -> tuple[int, ...]:
    """Ids of standing furniture in the picture's frame of which no ray sees anything, whatever of ``moved`` is taken
    away: the ids of things that do not always stay where they are. Scene and sensor in the episode frame.
    """
    assert isinstance(sensor.camera, PinholeCamera)
    fixed = replace(scene, objects=tuple(o for o in scene.objects if o.object_id not in moved))
    image = ray_image(fixed, sensor.camera.scaled(FINER), sensor.world_T_camera)
    seen = np.bincount(image.owner[image.owner >= 0], minlength=len(fixed.objects))
    return tuple(
        item.object_id
        for item, px, amodal in zip(fixed.objects, seen, image.amodal_px, strict=True)
        if px == 0 and amodal > 0 and item.category.group == "furniture" and _stands(item)
    )


def is_unrevealed(truth: EpisodeTruth, object_id: int) -> bool:
    """Whether life says nothing of an object: it is neither used nor skirted, and moves nowhere."""
    assert truth.objects is not None
    (row,) = np.flatnonzero(truth.objects.object_id == object_id)
    return bool(truth.objects.evidence[row] == Evidence.NEITHER and truth.objects.visible_px[row] == 0)


def same_poses(one: PoseTable | None, other: PoseTable | None) -> bool:
    """Whether two tables of observed 3D poses are the same bytes."""
    if one is None or other is None or one.joints_m is None or other.joints_m is None:
        return one is other
    return all(
        a.tobytes() == b.tobytes()
        for a, b in (
            (one.timestamp_ns, other.timestamp_ns),
            (one.track_id, other.track_id),
            (one.joint_state, other.joint_state),
            (one.joints_m, other.joints_m),
        )
    )


def exchanged(scene: Scene, object_id: int, style: Style, rng: np.random.Generator) -> Scene | None:
    """The scene with an object of another category in the place of one, within its box; None where none fits.

    The new object has the id and pose of the old. Nothing may rest on the old one that would float without it.
    """
    old = scene.object(object_id)
    low, high = _bounds(old.parts)
    names = [name for name in ANYWHERE if name != old.category_name]
    for index in rng.permutation(len(names)):
        for fit in FITS:
            parts = build(names[index], rng, style, fit)
            least, most = _bounds(parts)
            if (least >= low - SLACK_M).all() and (most <= high + SLACK_M).all():
                new = SceneObject(object_id, names[index], old.scene_T_object, parts, names[index] in MOVABLE)
                changed = replace(scene, objects=tuple(new if o is old else o for o in scene.objects))
                return None if floating(changed) else changed
    return None


def _stands(item: SceneObject) -> bool:
    return item.category_name not in WALL_HUNG | HANGING


def _bounds(parts: tuple[Part, ...]) -> tuple[FloatArray, FloatArray]:
    """(3,) least and (3,) greatest corner in the object frame."""
    points = np.concatenate([part.vertices for part in parts])
    return points.min(axis=0), points.max(axis=0)
