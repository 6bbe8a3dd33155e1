"""A body as a low-poly coloured mesh that follows its joints: what renderers draw.

The shapes come from ``bodies.npz`` (see ``bodies.md``): vertices of the skin and their normals for every shape, how
far each garment stands off, and up to four bones for every vertex. A body is dressed once; then each pose moves its
vertices by linear blend skinning with the frames of ``bones``. Its topology is the same in every pose. Vertices are in
the joints' frame, triangles counter-clockwise from outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from hsbench.errors import SchemaError
from hsbench.synth.people.body import Body
from hsbench.synth.people.bones import BONES, GIRTHED, STRETCHED, Rest, pose_frames
from hsbench.synth.people.props import held_mesh
from hsbench.synth.people.regions import Region
from hsbench.synth.people.shapes import SHAPE_OF
from hsbench.synth.people.wardrobe import dress
from hsbench.typing import AnyArray, FloatArray, Int32Array, UInt8Array

ASSET = Path(__file__).with_name("bodies.npz")
STEPS_PER_M = 10_000  # positions and thicknesses are stored in .1 mm
STEPS_PER_NORMAL = 127
LODS = (0, 1, 2)
"""Levels of detail: about 1200, 600 and 300 vertices."""

DRESSED_BODIES = 8  # kept ready, 1 MB each: the most people that a scene has; to dress one takes 2 ms


@dataclass(frozen=True, eq=False)
class DressedBody:
    """A body at rest, at its own size. rest: its bones. shares: (V, 4 B), of each bone a weight times (x, y, z, 1).

    triangles: (T, 3) int32; colours: (T, 3) uint8 sRGB; widen: (B,) factor on each bone's cross-section.
    """

    rest: Rest
    shares: FloatArray
    triangles: Int32Array
    colours: UInt8Array
    widen: FloatArray


def body_mesh(
    body: Body, joints: FloatArray, lod: int = 0, held: str = ""
) -> tuple[FloatArray, Int32Array, UInt8Array]:
    """(25, 3) joints -> ((V, 3) vertices in metres, (T, 3) int32 triangles, (T, 3) uint8 sRGB colours).

    held: what is in the hands, of ``props.HELD``.
    """
    return held_meshes(body, np.asarray(joints)[None], [held], lod)[0]


def held_meshes(
    body: Body, joints: FloatArray, held: Sequence[str], lod: int = 0
) -> list[tuple[FloatArray, Int32Array, UInt8Array]]:
    """(T, 25, 3) joints and what is in the hands at each time -> what ``body_mesh`` gives at each."""
    vertices, triangles, colours = body_meshes(body, joints, lod)
    meshes = [(at, triangles, colours) for at in vertices]
    for k, name in enumerate(held):
        if name:
            points, corners, paint = held_mesh(name, body.style.hand, np.asarray(joints[k], dtype=np.float64))
            meshes[k] = (
                np.concatenate([vertices[k], points]),
                np.concatenate([triangles, corners + np.int32(len(vertices[k]))]),
                np.concatenate([colours, paint]),
            )
    return meshes


def body_meshes(body: Body, joints: FloatArray, lod: int = 0) -> tuple[FloatArray, Int32Array, UInt8Array]:
    """(T, 25, 3) joints -> ((T, V, 3) vertices, and triangles and colours as ``body_mesh``)."""
    dressed = dressed_body(body, lod)
    return skinned(dressed, np.asarray(joints, dtype=np.float64)), dressed.triangles, dressed.colours


def skinned(dressed: DressedBody, joints: FloatArray) -> FloatArray:
    """(T, 25, 3) joints -> (T, V, 3) vertices: every bone turns, and stretches from joint to joint; vertices blend."""
    rest, posed = dressed.rest.frames, pose_frames(dressed.rest, joints)
    scale = np.empty((*posed.length.shape, 3))
    scale[..., 0] = np.where(STRETCHED, posed.length / rest.length, 1.0)
    scale[..., 1:] = dressed.widen[:, None]
    turn = (posed.axes * scale[..., None, :]) @ np.swapaxes(rest.axes, -1, -2)
    shift = posed.origin - (turn @ rest.origin[..., None])[..., 0]
    columns = np.concatenate([np.swapaxes(turn, -1, -2), shift[:, :, None]], axis=2)
    return np.asarray(dressed.shares @ columns.reshape(len(joints), -1, 3))


@lru_cache(maxsize=DRESSED_BODIES)
def dressed_body(body: Body, lod: int) -> DressedBody:
    """A body at rest at one level of detail. Raises SchemaError for one that is not in ``LODS``."""
    if lod not in LODS:
        raise SchemaError(f"lod is {lod}; expected one of {LODS} (0 is the finest)")
    stored = _asset()
    shape, row = SHAPE_OF[body.shape], stored["shapes"].tolist().index(body.shape)
    worn = dress(body.skin, body.hair, body.shirt, body.trousers, body.shoes, body.hair_style, body.sleeves, body.legs)
    region = stored[f"region_{lod}"]
    triangles = stored[f"triangles_{lod}"][~np.isin(region, worn.hidden)].astype(np.int64)
    used, triangles = np.unique(triangles, return_inverse=True)
    layers = [stored["layers"].tolist().index(name) for name in worn.layers]
    thickness = stored["thickness"][used][:, layers].sum(axis=1, dtype=np.int64) / STEPS_PER_M
    joints = stored["joints"][row] / STEPS_PER_M
    skin = stored["vertices"][row, used] / STEPS_PER_M
    size = body.stature_m / float(stored["statures"][row] / STEPS_PER_M)
    normals = stored["normals"][row, used] / STEPS_PER_NORMAL
    weights = np.zeros((len(used), len(BONES)))
    np.put_along_axis(weights, stored["bones"][used].astype(np.int64), stored["weights"][used] / 255.0, axis=1)
    vertices = np.column_stack([skin * size + normals * thickness[:, None], np.ones(len(used))])
    palette = np.zeros((len(Region), 3), dtype=np.uint8)
    for name, colour in worn.colours.items():
        palette[name] = colour
    return DressedBody(
        Rest.of(joints * size),
        (weights[:, :, None] * vertices[:, None]).reshape(len(used), -1),
        triangles.reshape(-1, 3).astype(np.int32),
        palette[region[~np.isin(region, worn.hidden)]],
        np.where(GIRTHED, body.girth / shape.girth, 1.0),
    )


@lru_cache(maxsize=1)
def _asset() -> dict[str, AnyArray]:
    with np.load(ASSET, allow_pickle=False) as stored:
        return dict(stored)
