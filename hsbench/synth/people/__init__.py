"""Simulated people: bodies, how they move, and where they can walk."""

from hsbench.synth.people.body import Body, capsules
from hsbench.synth.people.mesh import body_mesh
from hsbench.synth.people.props import HELD

__all__ = ["HELD", "Body", "body_mesh", "capsules"]
