"""What people do in a room or home: whole lives of one or several, with their poses, actions, events and motions."""

from hsbench.synth.activities.config import LifeConfig
from hsbench.synth.activities.life import Life, live, stream

__all__ = ["Life", "LifeConfig", "live", "stream"]
