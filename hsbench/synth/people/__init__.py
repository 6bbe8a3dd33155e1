"""Simulated people: bodies, how they move, where they can walk, and what a detector sees of them."""

from hsbench.synth.people.body import Body, capsules
from hsbench.synth.people.mesh import body_mesh
from hsbench.synth.people.observe import KINECT, PosePreset, observe

__all__ = ["KINECT", "Body", "PosePreset", "body_mesh", "capsules", "observe"]
