"""Options that the commands of ``hsbench import`` share, the id of what is imported, and what may follow."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hsbench.cli.common import FOLDER, next_step
from hsbench.errors import SchemaError

if TYPE_CHECKING:
    from hsbench.schema.episode import Episode

FILE = click.Path(path_type=Path, dir_okay=False)

DRAWN = {
    "rgbd": ("boxes", "BOXES.json"),
    "equirectangular": ("plan", "PLAN.json"),
    "monocular": ("view", "LABELS.json"),
}
"""What ``hsbench annotate`` takes for pictures of each kind of sensor."""


class Positive(click.FloatRange):
    """A finite number above 0: without this, nan passes every comparison."""

    def __init__(self) -> None:
        super().__init__(min=0, min_open=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """As FloatRange, refusing what is not finite."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is no finite number", param, ctx)
        return number


POSITIVE = Positive()

out_option = click.option(
    "--out", required=True, type=FOLDER, metavar="DIR", help="Data set folder; episodes are added to it."
)
focal_option = click.option(
    "--focal", "focal_px", type=POSITIVE, metavar="PX", help="Focal length; default: 1.2 times the longer side."
)


def name_option(text: str = "Episode id; default: the file's name.") -> Callable[..., Any]:
    """``--name ID``, refused before any work where it is no id."""
    return click.option("--name", metavar="ID", callback=_checked_id, help=text)


def camera_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Height and tilt of a camera, both or neither."""
    height = click.option(
        "--height",
        "height_m",
        type=click.FloatRange(0, 100),
        metavar="M",
        help="Camera height; default: estimated from standing poses.",
    )
    tilt = click.option(
        "--tilt",
        "tilt_deg",
        type=click.FloatRange(-90, 90),
        metavar="DEG",
        help="Camera tilt downwards; default: estimated.",
    )
    return height(tilt(command))


def size(context: click.Context, parameter: click.Parameter, value: str | None) -> tuple[int, int] | None:
    """``640x480`` -> (640, 480)."""
    if value is None:
        return None
    match = re.fullmatch(r"([1-9]\d{0,4})x([1-9]\d{0,4})", value, re.ASCII)
    if match is None:
        raise click.BadParameter(f"{value!r}; expected width and height in pixels, such as 640x480")
    return int(match[1]), int(match[2])


def chosen_id(name: str | None, default: str) -> str:
    """The id given by --name, else ``default``, the name of what is read. Raises SchemaError where that is no id."""
    from hsbench.schema.episode import check_id

    if name is None:
        try:
            check_id(default, "the name of what is imported")
        except SchemaError as error:
            raise SchemaError(f"{error}; give another by --name ID") from error
    return default if name is None else name


def tell_next(out: Path, episode: Episode) -> None:
    """The next command: draw the truth of pictures that have none, else look whether all is well."""
    truth, drawn = episode.truth, DRAWN.get(episode.sensor.kind)
    labels = () if truth is None else (truth.scene, truth.occupancy, truth.affordance, truth.view_affordance)
    if len(episode.frames) and drawn is not None and all(label is None for label in labels):
        next_step("annotate", *drawn, "--data", out, "--episode", episode.episode_id)
    else:
        next_step("verify", out)


def _checked_id(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    from hsbench.schema.episode import check_id

    if value is not None:
        check_id(value, "--name")
    return value
