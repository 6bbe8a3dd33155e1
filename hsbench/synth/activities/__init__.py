"""What people do in a room: plans of walking, sitting, touching and looking, with their poses, actions and events."""

from hsbench.synth.activities.config import LifeConfig
from hsbench.synth.activities.life import Life, live

__all__ = ["Life", "LifeConfig", "live"]
