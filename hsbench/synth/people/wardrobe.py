"""What people wear: garments as layers over the skin, and colours that go together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypedDict, get_args

import numpy as np

from hsbench.synth.people.regions import Region
from hsbench.synth.people.shapes import AFRICAN, ASIAN, EUROPEAN, Shape

Colour = tuple[int, int, int]
Sleeves = Literal["short", "long"]
Legs = Literal["trousers", "shorts", "skirt"]
Hair = Literal["short", "long", "shaved"]

SLEEVES: tuple[Sleeves, ...] = get_args(Sleeves)
LEGS: tuple[Legs, ...] = get_args(Legs)
HAIR_STYLES: tuple[Hair, ...] = get_args(Hair)

# sRGB palettes. Skins and hair run from light to dark.
SKINS: tuple[Colour, ...] = (
    (222, 180, 156),
    (206, 164, 134),
    (182, 136, 104),
    (146, 102, 74),
    (104, 70, 50),
    (78, 54, 42),
    (229, 188, 156),
    (205, 158, 122),
    (160, 112, 80),
    (112, 74, 52),
    (84, 56, 42),
)
HAIRS: tuple[Colour, ...] = ((158, 132, 94), (112, 78, 48), (62, 42, 30), (28, 24, 22), (150, 148, 144))
SHOES: tuple[Colour, ...] = ((30, 28, 28), (88, 58, 38), (168, 164, 158), (58, 62, 74))
IRISES: tuple[Colour, ...] = ((70, 96, 118), (74, 58, 40), (40, 28, 22))
DARK_HAIR = (130, 60)  # brightest channel of hair that goes with brown eyes, and with dark ones
EYE_WHITE: Colour = (214, 208, 200)
SOLE_TINT, SOLE_SHARE = (62, 58, 54), 0.7  # soles likewise
LIP_TINT, LIP_SHARE = (160, 66, 70), 0.45  # lips are skin with this much of this
SHAVED_SHARE = 0.25  # of the hair's colour on a shaved scalp

# Shirts and what is worn under them: washed cloth, no pure colours and no pure white.
OUTFITS: tuple[tuple[Colour, Colour], ...] = (
    ((72, 90, 124), (44, 48, 60)),
    ((204, 200, 190), (56, 64, 86)),
    ((146, 76, 72), (56, 58, 64)),
    ((98, 118, 100), (114, 102, 86)),
    ((58, 62, 72), (142, 130, 110)),
    ((180, 154, 108), (60, 68, 86)),
    ((118, 94, 120), (60, 60, 66)),
    ((124, 150, 170), (78, 82, 88)),
    ((84, 87, 90), (44, 48, 62)),
    ((176, 122, 108), (74, 84, 104)),
    ((74, 106, 110), (104, 94, 82)),
    ((208, 192, 172), (92, 78, 66)),
)


# How often: hair, sleeves and legs of women and men.
HAIR_SHARES = {"female": (0.25, 0.75, 0.0), "male": (0.80, 0.08, 0.12)}
LEG_SHARES = {"female": (0.72, 0.08, 0.20), "male": (0.90, 0.10, 0.0)}
LONG_SLEEVES_SHARE = 0.5
SKINS_OF = {AFRICAN: (3, 4, 5), ASIAN: (0, 1, 2), EUROPEAN: (0, 1)}  # places in SKINS
DARK_HAIRS, GREY_AGE = (2, 3), 0.6  # places in HAIRS of all but Europeans; a shape as old as this is grey


@dataclass(frozen=True)
class Dress:
    """What is worn, as ``bodies.npz`` knows it: layers over the skin, regions left out, colours of the regions."""

    layers: tuple[str, ...]
    hidden: tuple[Region, ...]
    colours: dict[Region, Colour]


class Looks(TypedDict):
    """The fields of a ``Body`` that a camera alone sees."""

    skin: Colour
    hair: Colour
    shirt: Colour
    trousers: Colour
    shoes: Colour
    hair_style: Hair
    sleeves: Sleeves
    legs: Legs


def looks(shape: Shape, rng: np.random.Generator) -> Looks:
    """Colours and clothes drawn for somebody of a shape."""
    main = max(shape.ancestry, key=lambda pair: pair[1])[0]
    grey = shape.age >= GREY_AGE
    hairs = HAIRS[-1:] if grey else HAIRS[:-1] if main == EUROPEAN else tuple(HAIRS[i] for i in DARK_HAIRS)
    shirt, trousers = OUTFITS[int(rng.integers(len(OUTFITS)))]
    return Looks(
        skin=SKINS[SKINS_OF[main][int(rng.integers(len(SKINS_OF[main])))]],
        hair=hairs[int(rng.integers(len(hairs)))],
        shirt=shirt,
        trousers=trousers,
        shoes=SHOES[int(rng.integers(len(SHOES)))],
        hair_style=HAIR_STYLES[_drawn(HAIR_SHARES[shape.gender], rng)],
        sleeves=SLEEVES[int(rng.random() < LONG_SLEEVES_SHARE)],
        legs=LEGS[_drawn(LEG_SHARES[shape.gender], rng)],
    )


def _drawn(shares: tuple[float, ...], rng: np.random.Generator) -> int:
    """A place, each as often as its share says."""
    return min(int(np.searchsorted(np.cumsum(shares), rng.random(), side="right")), len(shares) - 1)


def blend(first: Colour, second: Colour, share: float) -> Colour:
    """A colour with a share of another."""
    r, g, b = (round(a + share * (c - a)) for a, c in zip(first, second, strict=True))
    return r, g, b


def iris_of(hair: Colour) -> Colour:
    """Eyes as dark as they mostly are with hair of a colour."""
    return IRISES[sum(max(hair) < limit for limit in DARK_HAIR)]


def dress(
    skin: Colour, hair: Colour, shirt: Colour, trousers: Colour, shoes: Colour,
    style: Hair, sleeves: Sleeves, legs: Legs,
) -> Dress:  # fmt: skip
    """The layers, hidden regions and colours of somebody who wears this."""
    layers = ["shirt", "shorts", "shoes"]
    scalp, nape = (blend(skin, hair, SHAVED_SHARE), skin) if style == "shaved" else (hair, skin)
    if style == "long":
        nape = hair
    if style != "shaved":
        layers.append(f"{style}_hair")
    sleeve = shirt if sleeves == "long" else skin
    layers += ["sleeves"] if sleeves == "long" else []
    shank = trousers if legs == "trousers" else skin
    layers += {"trousers": ["trousers"], "shorts": [], "skirt": ["skirt"]}[legs]
    colours: dict[Region, Colour] = {
        Region.SKIN: skin, Region.EYE: EYE_WHITE, Region.IRIS: iris_of(hair), Region.BROW: blend(hair, skin, 0.2),
        Region.LIPS: blend(skin, LIP_TINT, LIP_SHARE), Region.SCALP: scalp, Region.NAPE: nape, Region.NAPE_EDGE: nape,
        Region.SHIRT: shirt, Region.NECK_EDGE: shirt, Region.SLEEVE_EDGE: shirt, Region.HEM_EDGE: shirt,
        Region.FOREARM: sleeve, Region.WRIST_EDGE: sleeve, Region.TROUSERS: trousers, Region.KNEE_EDGE: trousers,
        Region.SHANK: shank, Region.ANKLE_EDGE: shank if legs == "trousers" else shoes, Region.SHOE: shoes,
        Region.SKIRT: trousers, Region.SOLE: blend(shoes, SOLE_TINT, SOLE_SHARE),
    }  # fmt: skip
    return Dress(tuple(layers), () if legs == "skirt" else (Region.SKIRT,), colours)
