"""What the surface of a part is like to light: texture, second colour, gloss, softness of its edges.

Derived from what the schema says of a part (colour, texture) and of its object (category); pictures only.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass

import numpy as np

from hsbench.schema.scene import Part, SceneObject
from hsbench.synth.render.textures import CODES
from hsbench.synth.render.tone import decode_srgb
from hsbench.typing import FloatArray

PANE = "pane"
"""Parts of a window with this name are its glass: they shine with the light of the sky."""

GLOSS: dict[str, float] = {
    "wood": 0.35, "planks": 0.45, "parquet": 0.6, "herringbone": 0.55, "tiles": 0.8, "marble": 0.8, "terrazzo": 0.7,
}  # fmt: skip
"""Share of a varnished surface's mirror reflection that each texture shows; cloth, plaster and leaves show none."""
PAINT_GLOSS = 0.2  # plain parts of furniture
SCREEN_GLOSS = 0.9
VARNISH, SILVER = 0.04, 0.8  # mirror reflection, straight on
MIRRORS, MIRRORED = ("glass", "mirror"), ("mirror", "wardrobe", "bathroom_cabinet")  # such parts of such things

CLOTH_THINGS = frozenset((
    "sofa", "armchair", "ottoman", "office_chair", "bed", "bunk_bed", "curtain", "cushion", "rug", "towel_rail",
    "coat_rack", "floor_lamp", "table_lamp", "shower",
))  # fmt: skip
CLOTH_PARTS = frozenset((
    "seat", "back", "back_cushion", "armrest", "headboard", "mattress", "duvet", "overhang", "pillow", "sheet",
    "fold", "hem", "cushion", "button", "field", "border", "towel", "coat", "shade",
))  # fmt: skip
"""Plain parts of these names of these things are woven."""
DEEPEST_DYE = 0.75  # of cloth: 1 - the least of the three linear channels / the greatest; dust and fibres grey any dye

SOFT = frozenset(("weave", "carpet", "corduroy", "stripes", "checks", "dots"))
SOFT_EDGE_M, LEAF_EDGE_M, HARD_EDGE_M = 0.03, 0.05, 0.004

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear RGB, ITU-R BT.709
GROUT, MORTAR = (176, 172, 164), (184, 176, 164)
OFFSET_M = 64.0  # patterns of two parts are at most so far from each other


@dataclass(frozen=True, eq=False)
class Material:
    """How one part looks. Colours are linear RGB (3,).

    texture: its number in ``textures.CODES``. second: the colour textures mix in. gloss: share of mirror reflection.
    straight_on: mirror reflection of what is looked at along its normal (at a grazing angle it is all).
    edge_m: how far from an edge a surface begins to round. shift_m: (3,) where in the pattern the part begins.
    grain_axis: along which axis of the object frame boards and fibres run.
    """

    texture: int
    colour: FloatArray
    second: FloatArray
    gloss: float
    straight_on: float
    edge_m: float
    shift_m: FloatArray
    grain_axis: int


def material(item: SceneObject, part: Part) -> Material:
    """The material of one part of an object."""
    structure = item.category.group == "structure"
    silver = item.category.name in MIRRORED and base_name(part.name) in MIRRORS
    name = part.texture or _implied_texture(item, part)
    colour = decode_srgb(np.array(part.colour))
    if name in SOFT:
        colour = dyed(colour)
    return Material(
        CODES[name],
        colour,
        _second(name, colour),
        1.0 if silver else _gloss(name, part, structure),
        SILVER if silver else VARNISH,
        _edge_m(name, item),
        _shift(item.object_id, part.name),
        _longest_axis([p.vertices for p in item.parts] if structure else [part.vertices]),
    )


def is_pane(item: SceneObject, part: Part) -> bool:
    """Whether a part is the glass of a window."""
    return item.category.name == "window" and base_name(part.name) == PANE


def is_opaque(item: SceneObject, part: Part) -> bool:
    """Whether a part stops light: not glass, nor a lamp at the ceiling, where the room's light comes from."""
    return not is_pane(item, part) and item.category.name != "ceiling_lamp"


def base_name(name: str) -> str:
    """A part's name without the number that tells it from its like: drawer_2 -> drawer."""
    return re.sub(r"_?\d+$", "", name)


def dyed(colour: FloatArray) -> FloatArray:
    """(3,) linear colour no deeper than ``DEEPEST_DYE``: mixed with the grey of the same luminance where it is."""
    grey = float(colour @ LUMINANCE)
    excess = float((1.0 - DEEPEST_DYE) * colour.max() - colour.min())
    share = max(excess, 0.0) / max(excess + DEEPEST_DYE * grey, 1e-9)
    return colour + share * (grey - colour)


def _implied_texture(item: SceneObject, part: Part) -> str:
    """What a part is made of whose texture the schema leaves plain."""
    if item.category.name in ("wall", "ceiling"):
        return "plaster"
    return "weave" if item.category.name in CLOTH_THINGS and base_name(part.name) in CLOTH_PARTS else ""


def _second(texture: str, colour: FloatArray) -> FloatArray:
    """The colour mixed in: grout and mortar are grey; stripes, dots and veins stand out from the ground."""
    if texture in ("tiles", "brick"):
        return decode_srgb(np.array(GROUT if texture == "tiles" else MORTAR))
    light = float(colour.mean())
    grey = 0.5 * (colour + light)
    return grey * 0.4 if light > 0.25 else 0.45 * grey + 0.4


def _edge_m(texture: str, item: SceneObject) -> float:
    if item.category.name in ("wall", "floor", "ceiling", "rug"):  # flat, and of pieces that must not show
        return 0.0
    return LEAF_EDGE_M if texture == "leaves" else SOFT_EDGE_M if texture in SOFT else HARD_EDGE_M


def _gloss(texture: str, part: Part, structure: bool) -> float:
    if part.role == "screen":
        return SCREEN_GLOSS
    return GLOSS.get(texture, PAINT_GLOSS if texture == "" and not structure else 0.0)


def _shift(object_id: int, name: str) -> FloatArray:
    """(3,) metres, a multiple of 1/1024: pieces of one name in one object share a pattern, others do not."""
    digest = hashlib.blake2b(f"{object_id} {base_name(name)}".encode(), digest_size=6).digest()
    return np.frombuffer(digest, dtype="<u2").astype(np.float64) * (OFFSET_M / 2**16)


def _longest_axis(clouds: list[FloatArray]) -> int:
    points = np.concatenate(clouds)
    return int(np.argmax(np.round(points.max(axis=0) - points.min(axis=0), 3)))
