"""What the sensor could know at t0: the state of every voxel and the visible share of every object.

As all tasks define them (docs/conventions.md, voxel states): noise-free, without people, by rays.
"""

from __future__ import annotations

import math

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import CentralCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.polygons import contains
from hsbench.geometry.rays import RayImage, cast, pack_solids
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.scene import Scene
from hsbench.schema.states import VoxelState
from hsbench.truth.meshes import body_depth, has_mesh, mesh_body
from hsbench.typing import AnyArray, BoolArray, FloatArray, UInt8Array


def ray_image(scene: Scene, camera: CentralCamera, world_T_camera: FloatArray) -> RayImage:
    """Exact image of a scene; the owner of a pixel is the index of its object in ``scene.objects``."""
    convex = [() if has_mesh(item) else item.solids for item in scene.objects]
    owner = np.repeat(np.arange(len(convex)), [len(solids) for solids in convex])
    solids = pack_solids([solid for solids in convex for solid in solids])
    image = cast(camera, world_T_camera, solids, owner.astype(np.int32), len(convex))
    for k, item in enumerate(scene.objects):
        if has_mesh(item):
            depth_m = body_depth(mesh_body(item), camera, world_T_camera)
            image.amodal_px[k] = np.isfinite(depth_m).sum()
            nearer = (depth_m < image.depth_m) | (np.isfinite(depth_m) & (depth_m == image.depth_m) & (k < image.owner))
            image.depth_m[nearer] = depth_m[nearer]
            image.owner[nearer] = k
    return image


def surface_margin_m(voxel_m: float) -> float:
    """Half the diagonal of a voxel: a surface may pass anywhere within it."""
    return math.sqrt(3.0) / 2.0 * voxel_m


def depth_states(grid: VoxelGrid, camera: CentralCamera, world_T_camera: FloatArray, depth_m: AnyArray) -> UInt8Array:
    """States of voxel centres against a depth image (h, w) in metres, 0 = none: free, surface, occluded,
    missing_depth or outside_fov.

    Occluded where the centre's camera depth z > D + margin at its pixel, surface within the margin, else free.
    """
    size = (camera.height_px, camera.width_px)
    if np.shape(depth_m) != size:
        raise SchemaError(f"depth_m has shape {np.shape(depth_m)}; expected {size} as the camera says")
    centres = apply(invert(world_T_camera), grid.centres())
    pixels, z = camera.project(centres)
    inside = camera.contains(pixels)
    column = np.where(inside, pixels[..., 0], 0).astype(np.int64)
    row = np.where(inside, pixels[..., 1], 0).astype(np.int64)
    depth = np.asarray(depth_m, dtype=np.float64)[row, column]
    margin = surface_margin_m(grid.voxel_m)
    states = np.where(z > depth + margin, VoxelState.OCCLUDED, VoxelState.FREE)
    states[np.abs(z - depth) <= margin] = VoxelState.SURFACE
    states[~(depth > 0)] = VoxelState.MISSING_DEPTH
    states[~inside] = VoxelState.OUTSIDE_FOV
    return states.astype(np.uint8)


def inside_room(scene: Scene, grid: VoxelGrid, camera_xy: FloatArray) -> BoolArray:
    """(nx, ny, nz) bool: voxel centre inside the outline of the camera's room and between floor and ceiling."""
    centres = grid.centres()
    plan = contains(scene.room_at(camera_xy).outline_xy, centres[:, :, 0, :2])
    z = grid.axis_centres(2)
    return np.asarray(plan[:, :, None] & ((z > 0) & (z < scene.height_m))[None, None, :])


def true_states(
    scene: Scene, grid: VoxelGrid, camera: CentralCamera, world_T_camera: FloatArray, image: RayImage
) -> UInt8Array:
    """States at t0 from the exact ray image, with OUTSIDE_ROOM where the centre is not in the room."""
    states = depth_states(grid, camera, world_T_camera, image.depth_m)
    states[~inside_room(scene, grid, world_T_camera[:2, 3])] = VoxelState.OUTSIDE_ROOM
    return states
