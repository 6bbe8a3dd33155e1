"""Recipe ``all-sensors``: one furnished room and the life of two people in it, filmed by five sensors at once.

The README beside this file is the data sheet; ``config.toml`` holds every setting.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hsbench.schema import Episode
from hsbench.synth.all_sensors import AllSensorsSettings, all_episodes
from hsbench.synth.recipes import Unit


def build(config: Mapping[str, Any], unit: Unit) -> Iterator[Episode]:
    """The episodes of a unit, one a sensor."""
    yield from all_episodes(unit, "all-sensors", AllSensorsSettings.of(config, unit.split))
