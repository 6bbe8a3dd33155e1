"""Rendering: meshes, a camera and lights in; RGB, depth and ids out. The scene description knows no renderer.

``open_renderer("auto")`` gives the OpenGL back end where EGL starts and the ray caster elsewhere. The picture of a room
without people, with textures, shadows and bounced light, is made on top of either (``background``).
"""

from hsbench.synth.render.base import (
    DirectionalLight,
    Lighting,
    Mesh,
    PointLight,
    Renderer,
    View,
    Window,
)
from hsbench.synth.render.opening import RendererName, open_renderer, probe, resolve

__all__ = [
    "DirectionalLight",
    "Lighting",
    "Mesh",
    "PointLight",
    "Renderer",
    "RendererName",
    "View",
    "Window",
    "open_renderer",
    "probe",
    "resolve",
]
