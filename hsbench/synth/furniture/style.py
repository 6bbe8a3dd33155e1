"""Style families: palettes, textures and shape options from which the furniture of one room is drawn.

Common families serve every split; novel ones only test-novel, so that colours, textures and shapes are new there: but
for plain surfaces (""), no texture of a novel family is in a common one. Colours are sRGB integers, muted as in an
interior catalogue. Textures are names of ``hsbench.schema.scene.TEXTURES``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.numerics import quantise_m

Rgb = tuple[int, int, int]
Range = tuple[float, float]
T = TypeVar("T")

PLAIN = ("",)
ROOM_WOODS, ROOM_FABRICS, ROOM_ACCENTS = 2, 3, 3  # how many of each a single room combines


@dataclass(frozen=True)
class Finish:
    """How a surface looks: an sRGB colour and the name of a texture."""

    colour: Rgb
    texture: str = ""


@dataclass(frozen=True)
class Style:
    """One family. Palettes are sRGB; lengths are metres.

    ``_textures``: of woods, fabrics, accents, leaves, worktops, floors (wet: bathroom, kitchen) and walls.
    leg: ``square`` or ``round``; leg_taper: foot / top width; leg_splay_m: how far a foot stands out from its top.
    chair_backs: ``slats``, ``ladder``, ``panel``, ``bars`` or ``shell``. handle: ``bar``, ``knob`` or ``rail``.
    base: cabinets on a ``plinth`` or on ``legs``. table_shapes: ``rectangle``, ``round``. lamp: ``cone`` or ``drum``.
    sofa_arms: ``round``, ``slab`` or ``open``.
    arm_height_m: above the seat. top_m: thickness of table tops. back_lean_m: how far backs lean over their height.
    worktop_m: height of kitchen tops; wall_unit_m: height of the cabinets above them. Both are one value in a room.
    """

    name: str
    novel: bool
    woods: tuple[Rgb, ...]
    fabrics: tuple[Rgb, ...]
    walls: tuple[Rgb, ...]
    floors: tuple[Rgb, ...]
    metals: tuple[Rgb, ...]
    paints: tuple[Rgb, ...]
    accents: tuple[Rgb, ...]
    leg: str
    leg_taper: float
    leg_splay_m: float
    chair_backs: tuple[str, ...]
    handle: str
    base: str
    table_shapes: tuple[str, ...]
    sofa_arms: tuple[str, ...]
    lamp: str
    arm_height_m: Range
    arm_width_m: Range
    top_m: Range
    back_lean_m: Range
    wood_textures: tuple[str, ...] = ("wood",)
    fabric_textures: tuple[str, ...] = ("", "weave")
    accent_textures: tuple[str, ...] = ("", "stripes", "checks")
    leaf_textures: tuple[str, ...] = ("", "leaves")
    stone_textures: tuple[str, ...] = ("", "marble")
    floor_textures: tuple[str, ...] = ("planks", "parquet")
    wet_floor_textures: tuple[str, ...] = ("tiles",)
    wall_textures: tuple[str, ...] = ("", "plaster")
    worktop_m: Range = (0.88, 0.92)
    wall_unit_m: Range = (0.58, 0.72)

    def for_room(self, rng: np.random.Generator) -> Style:
        """The same family narrowed to what one room combines: few colours, one floor and wall, one kitchen height."""

        def some(options: tuple[T, ...], count: int) -> tuple[T, ...]:
            order = rng.permutation(len(options))
            return tuple(options[int(i)] for i in order[:count])

        def one(low: float, high: float) -> Range:
            value = float(quantise_m(low + (high - low) * rng.random()))
            return value, value

        return replace(
            self,
            woods=some(self.woods, ROOM_WOODS),
            fabrics=some(self.fabrics, ROOM_FABRICS),
            walls=some(self.walls, 1),
            floors=some(self.floors, 1),
            metals=some(self.metals, 1),
            paints=some(self.paints, ROOM_WOODS),
            accents=some(self.accents, ROOM_ACCENTS),
            wood_textures=some(self.wood_textures, 1),
            stone_textures=some(self.stone_textures, 1),
            floor_textures=some(self.floor_textures, 1),
            wet_floor_textures=some(self.wet_floor_textures, 1),
            wall_textures=some(self.wall_textures, 1),
            worktop_m=one(*self.worktop_m),
            wall_unit_m=one(*self.wall_unit_m),
        )


_FAMILIES = (
    Style(
        "nordic", False,
        woods=((214, 186, 148), (196, 164, 122), (226, 204, 172), (178, 144, 104)),
        fabrics=((158, 166, 170), (122, 138, 150), (200, 194, 184), (104, 122, 116), (172, 152, 140)),
        walls=((236, 234, 228), (226, 230, 230), (232, 226, 216), (214, 222, 218)),
        floors=((198, 168, 130), (212, 186, 152), (184, 152, 114)),
        metals=((70, 72, 76), (176, 178, 180)),
        paints=((238, 236, 230), (222, 222, 216), (190, 200, 200)),
        accents=((206, 162, 84), (92, 122, 128), (188, 110, 92), (126, 142, 108)),
        leg="round", leg_taper=0.6, leg_splay_m=0.03, chair_backs=("slats", "ladder", "shell"), handle="knob",
        base="legs", table_shapes=("rectangle", "round"), sofa_arms=("open", "slab"), lamp="cone",
        arm_height_m=(0.14, 0.2), arm_width_m=(0.1, 0.16), top_m=(0.025, 0.035), back_lean_m=(0.05, 0.08),
    ),
    Style(
        "classic", False,
        woods=((110, 72, 48), (134, 90, 58), (92, 60, 44), (150, 108, 74)),
        fabrics=((112, 58, 58), (72, 92, 80), (186, 170, 142), (84, 90, 112), (150, 124, 94)),
        walls=((232, 222, 202), (220, 212, 194), (206, 212, 196), (226, 208, 192)),
        floors=((132, 92, 62), (150, 108, 72), (116, 80, 56)),
        metals=((168, 140, 88), (96, 86, 72)),
        paints=((120, 80, 54), (226, 218, 200), (140, 98, 66)),
        accents=((142, 44, 46), (184, 148, 78), (54, 84, 74), (88, 72, 110)),
        leg="square", leg_taper=0.55, leg_splay_m=0.0, chair_backs=("ladder", "slats"), handle="knob", base="plinth",
        table_shapes=("rectangle",), sofa_arms=("round",), lamp="cone", arm_height_m=(0.18, 0.24),
        arm_width_m=(0.16, 0.24), top_m=(0.03, 0.045), back_lean_m=(0.04, 0.07),
    ),
    Style(
        "modern", False,
        woods=((88, 80, 74), (172, 140, 106), (60, 58, 58), (200, 182, 158)),
        fabrics=((92, 96, 102), (140, 142, 144), (64, 70, 80), (188, 186, 182), (86, 104, 112)),
        walls=((240, 240, 240), (224, 226, 230), (208, 210, 212), (232, 230, 226)),
        floors=((150, 142, 134), (176, 168, 158), (120, 112, 104)),
        metals=((50, 52, 54), (190, 192, 196)),
        paints=((244, 244, 244), (72, 74, 78), (206, 206, 204)),
        accents=((214, 120, 60), (60, 120, 132), (200, 186, 70), (150, 60, 70)),
        leg="square", leg_taper=1.0, leg_splay_m=0.0, chair_backs=("panel", "shell"), handle="rail", base="plinth",
        table_shapes=("rectangle",), sofa_arms=("slab",), lamp="drum", arm_height_m=(0.1, 0.16),
        arm_width_m=(0.18, 0.26), top_m=(0.02, 0.03), back_lean_m=(0.03, 0.06),
    ),
    Style(
        "rustic", False,
        woods=((186, 140, 92), (164, 116, 72), (204, 166, 120), (146, 106, 74)),
        fabrics=((170, 110, 84), (196, 178, 148), (120, 128, 98), (152, 94, 76), (140, 132, 122)),
        walls=((238, 226, 206), (228, 212, 188), (216, 202, 180), (222, 224, 208)),
        floors=((172, 120, 82), (160, 104, 74), (186, 142, 104)),
        metals=((62, 56, 52), (130, 112, 90)),
        paints=((206, 196, 172), (164, 172, 152), (188, 148, 104)),
        accents=((178, 84, 54), (206, 166, 92), (92, 108, 76), (98, 116, 132)),
        leg="square", leg_taper=0.75, leg_splay_m=0.015, chair_backs=("ladder", "bars"), handle="bar", base="plinth",
        table_shapes=("rectangle", "round"), sofa_arms=("round", "open"), lamp="drum", arm_height_m=(0.16, 0.22),
        arm_width_m=(0.12, 0.18), top_m=(0.035, 0.05), back_lean_m=(0.03, 0.06),
    ),
    Style(
        "coastal", False,
        woods=((222, 208, 186), (206, 190, 164), (188, 172, 148), (236, 228, 214)),
        fabrics=((214, 206, 190), (128, 152, 172), (92, 116, 140), (196, 202, 200), (178, 168, 150)),
        walls=((244, 243, 238), (222, 232, 236), (238, 232, 220), (212, 224, 222)),
        floors=((214, 200, 178), (196, 182, 160), (226, 216, 200)),
        metals=((150, 154, 158), (186, 170, 132)),
        paints=((246, 246, 242), (176, 198, 208), (214, 224, 222)),
        accents=((66, 104, 138), (126, 168, 172), (222, 182, 140), (198, 92, 82)),
        leg="square", leg_taper=0.7, leg_splay_m=0.01, chair_backs=("ladder", "slats"), handle="knob", base="legs",
        table_shapes=("rectangle", "round"), sofa_arms=("round", "slab"), lamp="cone", arm_height_m=(0.14, 0.2),
        arm_width_m=(0.14, 0.2), top_m=(0.028, 0.04), back_lean_m=(0.04, 0.07),
        fabric_textures=("", "stripes", "weave"), floor_textures=("planks", "carpet"),
    ),
    Style(
        "japandi", False,
        woods=((156, 122, 88), (190, 158, 122), (74, 62, 54), (134, 104, 78)),
        fabrics=((186, 178, 164), (124, 126, 112), (210, 202, 188), (98, 94, 88), (150, 142, 126)),
        walls=((234, 229, 218), (222, 216, 204), (240, 236, 228), (206, 204, 192)),
        floors=((182, 150, 112), (146, 116, 86), (202, 176, 142)),
        metals=((46, 44, 42), (120, 112, 98)),
        paints=((228, 222, 210), (88, 92, 84), (176, 168, 152)),
        accents=((104, 118, 92), (166, 92, 66), (66, 74, 82), (196, 170, 128)),
        leg="round", leg_taper=0.85, leg_splay_m=0.015, chair_backs=("bars", "shell"), handle="rail", base="legs",
        table_shapes=("round", "rectangle"), sofa_arms=("slab", "open"), lamp="drum", arm_height_m=(0.1, 0.15),
        arm_width_m=(0.12, 0.18), top_m=(0.03, 0.045), back_lean_m=(0.04, 0.08),
        accent_textures=("", "stripes"), floor_textures=("parquet", "planks"),
    ),
    Style(
        "industrial", True,
        woods=((122, 94, 70), (98, 78, 62), (146, 118, 92)),
        fabrics=((136, 88, 54), (70, 66, 64), (98, 108, 94), (160, 122, 86)),
        walls=((178, 174, 168), (164, 118, 96), (196, 192, 186), (148, 150, 150)),
        floors=((136, 132, 126), (108, 104, 98), (124, 98, 78)),
        metals=((38, 38, 40), (96, 98, 100)),
        paints=((60, 64, 66), (82, 98, 100), (128, 94, 68)),
        accents=((196, 150, 50), (146, 62, 42), (70, 104, 114)),
        leg="square", leg_taper=0.9, leg_splay_m=0.05, chair_backs=("bars", "panel"), handle="bar", base="legs",
        table_shapes=("rectangle",), sofa_arms=("slab",), lamp="drum", arm_height_m=(0.06, 0.1),
        arm_width_m=(0.06, 0.09), top_m=(0.05, 0.065), back_lean_m=(0.08, 0.11),
        wood_textures=PLAIN, fabric_textures=("", "corduroy"), accent_textures=("", "dots"), leaf_textures=PLAIN,
        stone_textures=("", "terrazzo"), floor_textures=("herringbone", "terrazzo"), wet_floor_textures=("terrazzo",),
        wall_textures=("", "brick"),
    ),
    Style(
        "retro", True,
        woods=((158, 92, 50), (176, 112, 64), (134, 78, 44)),
        fabrics=((204, 156, 60), (58, 120, 120), (206, 110, 66), (176, 118, 128), (110, 132, 72)),
        walls=((234, 214, 204), (206, 222, 212), (240, 228, 190), (214, 208, 224)),
        floors=((190, 134, 84), (166, 156, 140), (206, 176, 136)),
        metals=((182, 150, 92), (204, 204, 200)),
        paints=((240, 232, 214), (120, 160, 156), (222, 160, 120)),
        accents=((212, 86, 60), (236, 190, 74), (66, 132, 140), (152, 92, 124)),
        leg="round", leg_taper=0.4, leg_splay_m=0.07, chair_backs=("panel", "bars"), handle="bar", base="legs",
        table_shapes=("round", "rectangle"), sofa_arms=("open", "round"), lamp="drum", arm_height_m=(0.2, 0.26),
        arm_width_m=(0.07, 0.1), top_m=(0.02, 0.025), back_lean_m=(0.09, 0.13),
        wood_textures=PLAIN, fabric_textures=("", "corduroy"), accent_textures=("", "dots"), leaf_textures=PLAIN,
        stone_textures=("", "terrazzo"), floor_textures=("herringbone",), wet_floor_textures=("terrazzo",),
        wall_textures=("", "brick"),
    ),
)  # fmt: skip

FAMILIES: dict[str, Style] = {style.name: style for style in _FAMILIES}
COMMON_FAMILIES: tuple[str, ...] = tuple(s.name for s in _FAMILIES if not s.novel)
NOVEL_FAMILIES: tuple[str, ...] = tuple(s.name for s in _FAMILIES if s.novel)


def family(name: str) -> Style:
    """The style of a name. Raises SchemaError for an unknown one, naming the known."""
    try:
        return FAMILIES[name]
    except KeyError:
        raise SchemaError(f"style family {name!r} is unknown; expected one of {', '.join(FAMILIES)}") from None
