"""Recipe ``activity-360``: a furnished room or flat, the people who live in it, one static 360 camera in its middle.

The README beside this file is the data sheet; ``config.toml`` holds every setting.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hsbench.schema import Episode
from hsbench.synth.panorama import PanoramaSettings, panorama_episode
from hsbench.synth.recipes import Unit


def build(config: Mapping[str, Any], unit: Unit) -> Iterator[Episode]:
    """The one episode of a unit."""
    yield panorama_episode(unit, "activity-360", PanoramaSettings.of(config, unit.split))
