"""Activity maps in bulk: a life in the plane, seen with a 360 camera's errors, and the affordance truth from above."""

from hsbench.synth.activity_maps.config import MapConfig, PlanarLifeConfig, SphereErrors
from hsbench.synth.activity_maps.samples import map_episodes

__all__ = ["MapConfig", "PlanarLifeConfig", "SphereErrors", "map_episodes"]
