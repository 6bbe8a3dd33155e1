"""Where the weights lie that come with hsbench, and the card in a file of weights; needs no torch."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from hsbench.errors import DataError

CARD = "card"
"""Key of the one JSON text in the header of our files: several keys would stand in no fixed order."""

ENDING = ".safetensors"
FOLDER = Path(__file__).parent / "weights"
LENGTH_BYTES = 8  # of the header's length, little-endian, at the start of a safetensors file
MOST_HEADER_BYTES = 100_000_000  # the format's own limit


def bundled(name: str) -> Path:
    """The file of weights of a method that come with hsbench. It may not be there."""
    return FOLDER / f"{name}{ENDING}"


def read_card(path: Path) -> dict[str, Any]:
    """The card of a file of weights. Raises DataError where the file is missing or hsbench did not write it."""
    if not path.is_file():
        raise DataError(f"{path}: there are no weights (hsbench train writes them)")
    try:
        with path.open("rb") as file:
            length = int.from_bytes(file.read(LENGTH_BYTES), "little")
            header = json.loads(file.read(min(length, MOST_HEADER_BYTES)))
        card = json.loads(header["__metadata__"][CARD])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(f"{path}: no weights of hsbench; expected a file that hsbench train wrote") from error
    if not isinstance(card, dict):
        raise DataError(f"{path}: the card is a {type(card).__name__}; expected a file that hsbench train wrote")
    return card
