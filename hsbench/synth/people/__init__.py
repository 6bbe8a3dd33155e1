"""Simulated people: bodies, how they move, and where they can walk."""

from hsbench.synth.people.body import Body, capsules
from hsbench.synth.people.mesh import body_mesh, held_meshes
from hsbench.synth.people.props import HELD

__all__ = ["HELD", "Body", "body_mesh", "capsules", "held_meshes"]
