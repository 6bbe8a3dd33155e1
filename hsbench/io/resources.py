"""Where recipes, splits and boards lie: inside an installed wheel, else in the checkout."""

from __future__ import annotations

from pathlib import Path

from hsbench.errors import DataError

PACKAGE = Path(__file__).resolve().parents[1]
KINDS = ("generators", "splits", "leaderboards")


def resource(kind: str) -> Path:
    """The folder of ``generators``, ``splits`` or ``leaderboards``. Raises DataError where it is not installed."""
    if kind not in KINDS:
        raise DataError(f"resource {kind!r} is unknown; expected one of {', '.join(KINDS)}")
    for folder in (PACKAGE / "bundled" / kind, PACKAGE.parent / kind):
        if folder.is_dir():
            return folder
    raise DataError(
        f"the folder {kind}/ is neither in the installed package nor beside it (is the installation whole?)"
    )
