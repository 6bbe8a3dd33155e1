"""Simulated people: bodies, how they move, and where they can walk."""

from hsbench.synth.people.body import Body, capsules
from hsbench.synth.people.mesh import body_mesh

__all__ = ["Body", "body_mesh", "capsules"]
