"""Objects as flat arrays for shading, and which of their triangles each sample of a picture shows.

Any renderer can tell the triangle: every triangle gets its number as colour, and full ambient light shows a colour
unchanged (Lighting). The hit is then the exact intersection of the sample's ray with that triangle's plane, so that
back ends that agree on the triangle agree on the point.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import Camera
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import SceneObject
from hsbench.synth.render.base import MAX_MESH_ID, Lighting, Mesh, Renderer, Window
from hsbench.synth.render.materials import is_opaque, is_pane, material
from hsbench.typing import AnyArray, BoolArray, FloatArray, Int32Array, IntArray

MAX_TRIANGLES = 2**24 - 1  # numbers that fit the three bytes of a colour; 0 is nothing


class Surfaces(NamedTuple):
    """T triangles of P parts with R face planes; world frame, metres, unless said otherwise.

    A named tuple of arrays, so that compiled code takes it whole.
    """

    corners: FloatArray
    """(T, 3, 3)."""
    normals: FloatArray
    """(T, 3) unit, outward; zero for a triangle without area."""
    part: Int32Array
    """(T,) row of the part."""
    pane: BoolArray
    """(P,) whether it is the glass of a window."""
    opaque: BoolArray
    """(P,) whether it stops light."""
    colour: FloatArray
    """(P, 3) linear albedo, before texture."""
    second: FloatArray
    """(P, 3) linear albedo that textures mix in."""
    texture: Int32Array
    """(P,) number in ``textures.CODES``."""
    grain_axis: Int32Array
    """(P,) of the object frame."""
    gloss: FloatArray
    """(P,) share of mirror reflection."""
    straight_on: FloatArray
    """(P,) mirror reflection seen along the normal."""
    edge_m: FloatArray
    """(P,) how far from an edge a surface begins to round."""
    object_T_world: FloatArray
    """(P, 4, 4)."""
    shift_m: FloatArray
    """(P, 3) added to object coordinates before a texture sees them."""
    planes: FloatArray
    """(R, 4) normal and offset of the distinct face planes of convex parts, object frame."""
    plane_start: IntArray
    """(P + 1,) first plane of each part."""


def surfaces_of(objects: Sequence[SceneObject]) -> Surfaces:
    """The surfaces of some objects, triangles in the order of objects and parts."""
    alone = [_surfaces_of_one(item) for item in objects]
    joined = {name: np.concatenate([getattr(own, name) for own in alone]) for name in Surfaces._fields}
    parts, planes = (np.cumsum([0, *(len(getattr(own, name)) for own in alone)]) for name in ("colour", "planes"))
    joined["part"] = np.concatenate([own.part + np.int32(start) for own, start in zip(alone, parts, strict=False)])
    starts = [own.plane_start[:-1] + start for own, start in zip(alone, planes, strict=False)]
    joined["plane_start"] = np.append(np.concatenate(starts), planes[-1])
    return Surfaces(**joined)


@lru_cache(maxsize=256)  # of a room that is drawn again and again most objects have not moved
def _surfaces_of_one(item: SceneObject) -> Surfaces:
    corners = [apply(item.scene_T_object, part.vertices)[part.triangles] for part in item.parts]
    planes = [np.empty((0, 4)) if part.solid is None else part.solid.planes for part in item.parts]
    materials = [material(item, part) for part in item.parts]
    joined = np.concatenate(corners)
    cross = np.cross(joined[:, 1] - joined[:, 0], joined[:, 2] - joined[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)

    def column(name: str, dtype: type[np.generic]) -> AnyArray:
        return np.array([getattr(m, name) for m in materials], dtype=dtype)

    return Surfaces(
        corners=joined,
        normals=cross / np.where(length > 0.0, length, 1.0),
        part=np.repeat(np.arange(len(item.parts), dtype=np.int32), [len(c) for c in corners]),
        pane=np.array([is_pane(item, part) for part in item.parts], dtype=np.bool_),
        opaque=np.array([is_opaque(item, part) for part in item.parts], dtype=np.bool_),
        colour=column("colour", np.float64),
        second=column("second", np.float64),
        texture=column("texture", np.int32),
        grain_axis=column("grain_axis", np.int32),
        gloss=column("gloss", np.float64),
        straight_on=column("straight_on", np.float64),
        edge_m=column("edge_m", np.float64),
        object_T_world=np.array([np.linalg.inv(item.scene_T_object)] * len(item.parts)),
        shift_m=column("shift_m", np.float64),
        planes=np.concatenate(planes),
        plane_start=np.cumsum([0, *map(len, planes)], dtype=np.int64),
    )


def triangles_seen(
    surfaces: Surfaces,
    drawn: BoolArray,
    renderer: Renderer,
    camera: Camera,
    world_T_camera: FloatArray,
    window: Window,
) -> Int32Array:
    """(h, w) number of the triangle at the centre of each pixel of a window, -1 where there is none.

    drawn: (T,) which triangles may be seen at all.
    Raises SchemaError for more triangles than a colour can number.
    """
    count = len(surfaces.corners)
    if count > MAX_TRIANGLES:
        raise SchemaError(f"the objects in view have {count} triangles; expected at most {MAX_TRIANGLES}")
    numbers = np.arange(1, count + 1)
    codes = np.stack([numbers & 255, (numbers >> 8) & 255, numbers >> 16], axis=-1).astype(np.uint8)
    triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    mesh = Mesh(MAX_MESH_ID, surfaces.corners.reshape(-1, 3), triangles[drawn], codes[drawn])
    rgb = renderer.render([mesh], camera, world_T_camera, Lighting(1.0), window, only="rgb").rgb.astype(np.int32)
    return rgb[..., 0] + (rgb[..., 1] << 8) + (rgb[..., 2] << 16) - 1
