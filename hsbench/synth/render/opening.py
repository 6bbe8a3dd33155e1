"""Which back end draws: opening one by name, the fallback where EGL is missing, and facts for ``hsbench doctor``."""

from __future__ import annotations

import functools
import json
import subprocess
import sys
import warnings
from importlib import metadata
from typing import TYPE_CHECKING, Any, Literal

from hsbench.errors import HsbenchError, MissingExtraError
from hsbench.synth.render.base import Renderer

if TYPE_CHECKING:
    from hsbench.synth.render.pyrender_backend import PyrenderRenderer

RendererName = Literal["auto", "pyrender", "raycast"]

INSTALL_HINT = "install EGL and Mesa's drivers (Debian, Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri)"


def open_renderer(name: RendererName = "auto") -> Renderer:
    """A renderer of that name; "auto" takes pyrender and, where it cannot start, warns once and takes raycast.

    Raises MissingExtraError for an uninstalled package, HsbenchError where EGL does not start or for an unknown name.
    """
    if name == "raycast":
        return _open_raycast()
    if name == "pyrender":
        return _open_pyrender()
    if name != "auto":
        raise HsbenchError(f"renderer is {name!r}; expected 'auto', 'pyrender' or 'raycast'")
    try:
        return _open_pyrender()
    except HsbenchError as error:
        renderer = _open_raycast()
        hint = "" if isinstance(error, MissingExtraError) else f"; for the faster OpenGL renderer {INSTALL_HINT}"
        _warn_once(f"rendering with the ray caster: {error}{hint}")
        return renderer


def resolve(name: RendererName) -> RendererName:
    """The back end that ``open_renderer(name)`` would open, without opening it: for processes that start others.

    Warns once where "auto" becomes raycast. Raises HsbenchError where the one asked for cannot start.
    """
    if name == "raycast" or (name == "auto" and not (facts := probe())["egl"]):
        _open_raycast()
        if name == "auto":
            _warn_once(f"rendering with the ray caster: {facts['egl_fault']}; for OpenGL {INSTALL_HINT}")
        return "raycast"
    if name == "pyrender" and not (facts := probe())["egl"]:
        raise HsbenchError(f"{facts['egl_fault']}: {INSTALL_HINT}, or take --renderer raycast")
    return "pyrender"


def probe() -> dict[str, Any]:
    """Facts about rendering here: "egl" (bool), "egl_fault", "gl_vendor", "gl_renderer", "gl_version", and versions.

    OpenGL is started in a process of its own, so that a crashing driver is a fact and not the end of the caller.
    """
    facts: dict[str, Any] = {f"{name}_version": _version(name) for name in ("pyrender", "PyOpenGL", "embreex")}
    code = (
        "import json, hsbench.synth.render.opening as o\n"
        "try: print(json.dumps(o._open_pyrender().facts()))\n"
        "except Exception as error: print(json.dumps({'egl_fault': str(error)}))"
    )
    try:
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
        answer = json.loads(done.stdout.splitlines()[-1])
    except subprocess.TimeoutExpired:
        answer = {"egl_fault": "OpenGL did not start within 60 s"}
    except (IndexError, ValueError):
        answer = {"egl_fault": f"the process that starts OpenGL ended with code {done.returncode}"}
    return {"egl": "egl_fault" not in answer, **facts, **answer}


def _open_pyrender() -> PyrenderRenderer:
    from hsbench.synth.render.pyrender_backend import open_pyrender

    return open_pyrender()


def _open_raycast() -> Renderer:
    from hsbench.synth.render.raycast_backend import RaycastRenderer

    return RaycastRenderer()


@functools.cache
def _warn_once(message: str) -> None:
    warnings.warn(message, RuntimeWarning, stacklevel=3)


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None
