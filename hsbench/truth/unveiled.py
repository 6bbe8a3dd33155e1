"""When a static sensor first saw each voxel: at t0, or later when a thing that hid it moved away.

As the states at t0, noise-free and by rays: a voxel is seen where its centre is free or surface (``sight``). People
hide more than they unveil and are left out. Of things that move, each is looked at alone, the others at their places
of t0, at its key poses and in the middle of its ways.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from hsbench.geometry.cameras import CentralCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.episode import NS_PER_S
from hsbench.schema.motions import Move, ObjectMotions, Thing, scene_at
from hsbench.schema.scene import Scene
from hsbench.schema.states import VoxelState
from hsbench.truth.sight import ray_image, surface_margin_m
from hsbench.typing import Float32Array, FloatArray, UInt8Array


def first_seen(
    scene: Scene,
    grid: VoxelGrid,
    camera: CentralCamera,
    world_T_camera: FloatArray,
    states: UInt8Array,
    motions: ObjectMotions,
    t0_ns: int,
    end_ns: int,
) -> Float32Array:
    """(nx, ny, nz) float32 seconds after t0, +inf = never: ``states`` are those of ``true_states`` at t0.

    A voxel OCCLUDED at t0 can be seen later, others are seen at once or never.
    """
    seen = np.where(np.isin(states, (VoxelState.FREE, VoxelState.SURFACE)), 0.0, np.inf).astype(np.float32)
    moving = sorted({object_id for object_id, _ in motions.tracks})
    hidden = np.argwhere(states == VoxelState.OCCLUDED)
    if not moving or not len(hidden):
        return seen
    centres = np.asarray(grid.origin_m) + (hidden + 0.5) * grid.voxel_m
    pixels, z = camera.project(apply(invert(world_T_camera), centres))
    column, row = pixels.astype(np.int64).T  # OCCLUDED: inside the image
    reach = z - surface_margin_m(grid.voxel_m)  # seen where depth is at least this
    when = np.full(len(hidden), np.inf, dtype=np.float32)
    for object_id in moving:
        others = tuple(item for item in scene.objects if item.object_id != object_id)
        behind = ray_image(replace(scene, objects=others), camera, world_T_camera).depth_m
        could = behind[row, column] >= reach
        if not could.any():
            continue
        alone = replace(scene, objects=(scene.object(object_id),))
        for time_ns, moves in _places(motions, object_id, t0_ns, end_ns):
            thing = ray_image(scene_at(alone, moves), camera, world_T_camera).depth_m
            now = could & (thing[row, column] >= reach)
            when[now] = np.minimum(when[now], np.float32((time_ns - t0_ns) / NS_PER_S))
    seen[tuple(hidden.T)] = when
    return seen


def _places(motions: ObjectMotions, object_id: int, t0_ns: int, end_ns: int) -> list[tuple[int, dict[Thing, Move]]]:
    """Times and moves of an object, each place once, at its first time."""
    own = {thing: track for thing, track in motions.tracks.items() if thing[0] == object_id}
    keys = sorted({int(t) for times, _ in own.values() for t in times if t0_ns <= t <= end_ns})
    moments = sorted({*keys, *((a + b) // 2 for a, b in pairwise(keys))})
    places: dict[tuple[tuple[Thing, Move], ...], int] = {}
    for time_ns in moments:
        moves = {thing: move for thing, move in motions.moves_at(time_ns).items() if thing in own}
        places.setdefault(tuple(moves.items()), time_ns)
    return [(time_ns, dict(moves)) for moves, time_ns in places.items() if moves]
