"""Objects with mesh parts as truth sees them: what they fill, what they show, where they stand in the way.

Each piece of a mesh (triangles that hang together by edges) is judged by itself; docs/formats/scenes.md says more.

closed         solid within, like a convex part; cavities are solid; a piece that is inside out is turned.
open           no inside: only its surface counts. A sub-sample point is solid where the surface meets the cube about it
               that is one sub-sample step wide. ``open_share`` is what warnings are made of.
closed, thin   where a closed piece is thinner than one step, points may fall on either side of it: there its surface
               counts too.
structure      of floors, walls and ceilings only what the triangles face away from is solid, and pieces that are inside
               out (the faces of a room, seen from within) count as surface: a room is not a cavity.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hsbench.geometry.cameras import CentralCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import apply
from hsbench.geometry.triangle_lattice import count_points
from hsbench.geometry.triangle_meshes import double_areas, outward, pieces, weld
from hsbench.geometry.triangle_rays import TriangleTree, depth_image, nearest, triangle_tree
from hsbench.schema.scene import SceneObject
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray, UInt8Array

SKIN_M = 1e-7  # a ray from a triangle into its piece starts so far within
TOUCH_M = 1e-6  # a board this little thinner than a step is one step thick


@dataclass(frozen=True, eq=False)
class MeshBody:
    """All parts of an object as triangles in the scene frame.

    vertices: (V, 3). triangles: (T, 3). part: (T,) its index. piece: (T,) number of the piece. solid: (T,) bool,
    bounds a closed piece; then it faces outward. sheet: (T,) bool, counts as surface whatever its thickness.
    open_share: share of the area that belongs to open pieces, 0..1.
    """

    vertices: FloatArray
    triangles: Int32Array
    part: Int32Array
    piece: Int32Array
    solid: BoolArray
    sheet: BoolArray
    open_share: float

    @cached_property
    def tree(self) -> TriangleTree:
        """The triangles for rays."""
        return triangle_tree(self.vertices, self.triangles, self.piece)

    def shifted(self, shift_xy: FloatArray) -> MeshBody:
        """The same body moved along the floor."""
        return replace(self, vertices=self.vertices + np.append(shift_xy, 0.0))

    @cached_property
    def thickness_m(self) -> FloatArray:
        """(T,) how far it is from the middle of a triangle, inward, to the next triangle of its piece."""
        inward = -double_areas(self.vertices, self.triangles)
        length = np.linalg.norm(inward, axis=1)
        flat = length == 0
        directions = inward / np.where(flat, 1.0, length)[:, None]
        found = nearest(self.tree, self.vertices[self.triangles].mean(axis=1), directions, SKIN_M, self.piece)
        return np.where(flat, np.inf, found)


def has_mesh(item: SceneObject) -> bool:
    """Whether some part of an object is a mesh: then it is handled here, its convex parts too."""
    return any(part.mesh is not None for part in item.parts)


def mesh_body(item: SceneObject) -> MeshBody:
    """An object's parts as triangles in the scene frame, their pieces judged."""
    welded = [weld(apply(item.scene_T_object, part.vertices), part.triangles) for part in item.parts]
    start = np.cumsum([0, *(len(v) for v, _ in welded)])
    vertices = np.concatenate([v for v, _ in welded])
    triangles = np.concatenate([t + s for (_, t), s in zip(welded, start[:-1], strict=True)]).astype(np.int32)
    part = np.repeat(np.arange(len(welded)), [len(t) for _, t in welded]).astype(np.int32)
    found = pieces(vertices, triangles)
    inside_out = found.closed & (found.volume_m3 < 0)
    open_pieces = ~found.closed
    sheet = open_pieces.copy()
    if item.category.group == "structure":
        sheet |= inside_out
    else:
        triangles = outward(triangles, found)
    area = float(found.area_m2.sum())
    open_share = float(found.area_m2[open_pieces].sum()) / area if area > 0 else 0.0
    return MeshBody(vertices, triangles, part, found.of, found.closed[found.of], sheet[found.of], open_share)


def count_mesh_subsamples(body: MeshBody, grid: VoxelGrid, per_side: int) -> tuple[IntArray, UInt8Array] | None:
    """Sub-sample points of each voxel that the body holds: (first voxel (3,), counts of a window).

    None where the body misses the grid.
    """
    step = grid.voxel_m / per_side
    thin = np.zeros(len(body.triangles), dtype=bool)
    if body.solid.any():
        thin = body.solid & (body.thickness_m < step - TOUCH_M)
    sheet = body.sheet | thin
    margin = step if sheet.any() else 0.0
    origin, shape = np.asarray(grid.origin_m), np.asarray(grid.shape)
    if not len(body.vertices):
        return None
    least, most = body.vertices.min(axis=0) - margin, body.vertices.max(axis=0) + margin
    low = np.clip(np.floor((least - origin) / grid.voxel_m).astype(np.int64), 0, shape)
    high = np.clip(np.ceil((most - origin) / grid.voxel_m).astype(np.int64), 0, shape)
    if (high <= low).any():
        return None
    nx, ny, nz = (int(n) for n in high - low)
    counts = count_points(
        body.vertices, body.triangles, body.solid, sheet, origin + low * grid.voxel_m, (nx, ny, nz),
        grid.voxel_m, per_side,
    )  # fmt: skip
    return low, counts


def columns_inside(
    body: MeshBody, origin_xy: FloatArray, shape: tuple[int, ...], cell_m: float, z_m: float
) -> BoolArray:
    """(nx, ny) bool: the middle of a cell, at height ``z_m``, lies inside a closed piece.

    What of a body is solid from below some slice to above it has no surface in the slice.
    """
    origin = np.array([*origin_xy, z_m - cell_m / 2])
    none = np.zeros(len(body.triangles), dtype=bool)
    counts = count_points(body.vertices, body.triangles, body.solid, none, origin, (shape[0], shape[1], 1), cell_m, 1)
    return np.asarray(counts[:, :, 0] > 0)


def body_depth(body: MeshBody, camera: CentralCamera, world_T_camera: FloatArray) -> FloatArray:
    """(h, w) float64 depth of the body at every pixel centre if it stood alone, +inf where it is not seen."""
    return depth_image(body.tree, camera, world_T_camera)
