"""The GL back end: pyrender 0.1.45 on EGL, software or hardware. The only file that knows pyrender and OpenGL.

OpenGL draws pinhole pictures; every other camera's are left to the ray caster, whose rays are true.

pyrender keeps doing what it does well (shaders, scene, upload); a subclass of its renderer replaces what would cost
correctness or time here:

- Nodes and lights are drawn in a fixed order. pyrender keeps them in sets, ordered by memory address, so that
  coinciding surfaces and rounding would differ from process to process.
- No multisampling: colour belongs to the pixel centre, like depth and id, and silhouettes are not mixed with the
  empty background.
- One framebuffer grows as needed and is never replaced by a smaller one; scissor and readback are the window's.
- Only the meshes of the request are drawn; others stay uploaded. A moved mesh is a write into its vertex buffer.
- Depth and ids come from the SEG pass, whose 24-bit colour carries the id. Mesh bounds and shadows, which break on
  numpy 2, are never asked for.
"""

from __future__ import annotations

import functools
import os
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsbench.errors import HsbenchError, MissingExtraError
from hsbench.geometry.cameras import Camera, PinholeCamera
from hsbench.synth.render.base import NEAR_M, Lighting, Mesh, Only, Renderer, View, Window, check_request
from hsbench.synth.render.shading import corner_normals, to_linear
from hsbench.typing import AnyArray, Float32Array, FloatArray, UInt8Array, UInt16Array

# pyrender picks its OpenGL loader from this variable when it is imported.
os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
try:
    import pyrender
    from OpenGL import GL
except ModuleNotFoundError as error:
    raise MissingExtraError("the OpenGL renderer", error.name or "pyrender", "gen") from error
# PyOpenGL loads the system's libraries while it is imported; which exception it raises depends on what is missing.
except Exception as error:
    raise HsbenchError(f"OpenGL does not load ({type(error).__name__}: {error})".replace("\n", " ")) from error

MAX_UPLOADED_MESHES = 2048
"""Meshes kept in GL memory; beyond it those not drawn for longest are dropped."""

DIFFUSE_GAIN = np.pi / 0.94
"""pyrender's light intensity that makes a white, fully rough face facing the light white: its BRDF returns .94/pi."""

_COLOUR_FLAGS = pyrender.RenderFlags.OFFSCREEN | pyrender.RenderFlags.RGBA
_SEG_FLAGS = pyrender.RenderFlags.OFFSCREEN | pyrender.RenderFlags.SEG

# OpenGL camera axes (x right, y up, z backward) in ours (x right, y down, z forward).
_CAMERA_T_GL = np.diag([1.0, -1.0, -1.0, 1.0])


class _OrderedScene(pyrender.Scene):  # type: ignore[misc]
    """A pyrender scene whose lights come in the order in which they were given."""

    def __init__(self) -> None:
        super().__init__(bg_color=np.zeros(4))
        self.ordered_lights: list[Any] = []

    @property
    def light_nodes(self) -> list[Any]:
        return self.ordered_lights


class _EndlessLens(pyrender.IntrinsicsCamera):  # type: ignore[misc]
    """pyrender's pinhole without a far plane, which its own class knows but does not let one ask for."""

    def get_projection_matrix(self, width: int, height: int) -> FloatArray:
        projection: FloatArray = super().get_projection_matrix(width, height)
        projection[2, 2:] = -1.0, -2.0 * self.znear
        return projection


class _WindowRenderer(pyrender.Renderer):  # type: ignore[misc]
    """pyrender's renderer with a fixed draw order, one single-sample framebuffer and windowed readback."""

    # pyrender's own attributes: names of the GL framebuffer and its buffers, and their size in pixels.
    _main_fb: Any
    _main_cb: Any
    _main_db: Any
    _main_fb_dims: Any

    def __init__(self) -> None:
        super().__init__(1, 1)
        self.draw_list: list[Any] = []
        self.box_gl = (0, 0, 1, 1)  # x, y (from the bottom), width, height of what is drawn and read, in pixels

    def _sorted_mesh_nodes(self, scene: Any) -> list[Any]:
        return self.draw_list

    def _update_context(self, scene: Any, flags: int) -> None:
        """Nothing: meshes are uploaded and freed by PyrenderRenderer; looking through all of them costs 1 ms a pass."""

    def _configure_forward_pass_viewport(self, flags: int) -> None:
        super()._configure_forward_pass_viewport(flags)
        GL.glEnable(GL.GL_SCISSOR_TEST)
        GL.glScissor(*self.box_gl)

    def _configure_main_framebuffer(self) -> None:
        width, height = self._main_fb_dims if self._main_fb is not None else (0, 0)
        if self.viewport_width <= width and self.viewport_height <= height:
            return
        if self._main_fb is not None:
            GL.glDeleteFramebuffers(1, [self._main_fb])
            GL.glDeleteRenderbuffers(2, [self._main_cb, self._main_db])
        width, height = max(width, self.viewport_width), max(height, self.viewport_height)
        self._main_cb, self._main_db = GL.glGenRenderbuffers(2)
        # pyrender draws into the "multisample" framebuffer: here that is the only one.
        self._main_fb = self._main_fb_ms = GL.glGenFramebuffers(1)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._main_fb)
        for buffer, layout, slot in (
            (self._main_cb, GL.GL_RGBA8, GL.GL_COLOR_ATTACHMENT0),
            (self._main_db, GL.GL_DEPTH_COMPONENT24, GL.GL_DEPTH_ATTACHMENT),
        ):
            GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, buffer)
            GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, layout, width, height)
            GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, slot, GL.GL_RENDERBUFFER, buffer)
        self._main_fb_dims = (width, height)

    def _read_main_framebuffer(self, scene: Any, flags: int) -> tuple[UInt8Array, Float32Array | None]:
        """(h, w, 4) RGBA bytes of the box, top row first, and after a SEG pass its (h, w) window-space depth."""
        _, _, width, height = self.box_gl
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._main_fb)
        rgba = GL.glReadPixels(*self.box_gl, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE)
        rgba = np.frombuffer(rgba, dtype=np.uint8).reshape(height, width, 4)[::-1]
        if not flags & pyrender.RenderFlags.SEG:
            return rgba, None
        depth = GL.glReadPixels(*self.box_gl, GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT)
        return rgba, np.frombuffer(depth, dtype=np.float32).reshape(height, width)[::-1]


@dataclass(eq=False)
class _Uploaded:
    """A mesh in GL memory and the arrays it was made from."""

    mesh: Mesh
    node: Any
    vertex_data: Float32Array  # (3 T, 10) position, normal, colour: pyrender's interleaved vertex buffer

    def shows(self, mesh: Mesh) -> bool:
        """Whether ``mesh`` differs at most in where its vertices are."""
        mine = self.mesh
        return mesh.triangles is mine.triangles and mesh.colours is mine.colours and mesh.smooth == mine.smooth

    def move(self, mesh: Mesh) -> None:
        _write_geometry(self.vertex_data, mesh)
        GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self.node.mesh.primitives[0]._buffers[0])
        GL.glBufferSubData(GL.GL_ARRAY_BUFFER, 0, self.vertex_data.nbytes, self.vertex_data)
        self.mesh = mesh


class PyrenderRenderer:
    """Renderer through OpenGL. Make it with ``open_pyrender``: there is one per process, for life.

    Use it from the thread that opened it; a forked child cannot (HsbenchError): start workers by 'spawn'.
    """

    name = "pyrender"

    def __init__(self) -> None:
        self._platform = _open_platform()
        self._process = os.getpid()
        self._gl = _WindowRenderer()
        self._scene = _OrderedScene()
        self._camera_node = pyrender.Node(camera=_EndlessLens(1.0, 1.0, 0.0, 0.0, znear=NEAR_M))
        self._scene.add_node(self._camera_node)
        self._material = pyrender.MetallicRoughnessMaterial(metallicFactor=0.0, roughnessFactor=1.0)
        self._uploaded: OrderedDict[int, _Uploaded] = OrderedDict()
        self._lights: Lighting | None = None

    def render(
        self,
        meshes: Sequence[Mesh],
        camera: Camera,
        world_T_camera: FloatArray,
        lights: Lighting,
        window: Window | None = None,
        only: Only = None,
    ) -> View:
        """See Renderer.render."""
        if not isinstance(camera, PinholeCamera):
            return self._ray_caster.render(meshes, camera, world_T_camera, lights, window, only)
        window = check_request(meshes, camera, world_T_camera, window)
        if os.getpid() != self._process:
            raise HsbenchError("an OpenGL context does not survive a fork: start worker processes by 'spawn'")
        self._platform.make_current()
        shown = [mesh for mesh in meshes if len(mesh.triangles)]
        nodes = [self._node_for(mesh) for mesh in shown]
        while len(self._uploaded) > max(MAX_UPLOADED_MESHES, len(shown)):
            self._drop(self._uploaded.popitem(last=False)[1])
        self._set_lights(lights)
        self._gl.draw_list = nodes
        self._scene.set_pose(self._camera_node, world_T_camera @ _CAMERA_T_GL)
        view = View.blank(window)
        if only != "rgb":
            codes = {node: np.array([m.mesh_id & 255, m.mesh_id >> 8, 0]) for node, m in zip(nodes, shown, strict=True)}
            seg, window_depth = self._draw(camera, window, _SEG_FLAGS, codes)
            view = replace(view, depth_m=_metres(window_depth), ids=_ids(seg))
        if only != "shape":
            rgba, _ = self._draw(camera, window, _COLOUR_FLAGS, None)
            view = replace(view, rgb=rgba[..., :3].copy())
        return view

    @functools.cached_property
    def _ray_caster(self) -> Renderer:
        from hsbench.synth.render.raycast_backend import RaycastRenderer

        return RaycastRenderer()

    def facts(self) -> dict[str, str]:
        """Vendor, renderer and version string of the GL stack that draws."""
        self._platform.make_current()
        names = {"gl_vendor": GL.GL_VENDOR, "gl_renderer": GL.GL_RENDERER, "gl_version": GL.GL_VERSION}
        return {key: GL.glGetString(name).decode() for key, name in names.items()}

    def _draw(
        self, camera: PinholeCamera, window: Window, flags: int, colours: dict[Any, AnyArray] | None
    ) -> tuple[UInt8Array, Any]:
        lens = self._camera_node.camera
        lens.fx, lens.fy, lens.cx, lens.cy = camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
        # The viewport stays the full image and only scissor and readback shrink, so a window's pixels are computed
        # from the very same numbers as the full image's.
        self._gl.viewport_width, self._gl.viewport_height = camera.width_px, camera.height_px
        bottom = camera.height_px - window.v0 - window.height
        self._gl.box_gl = (window.u0, bottom, window.width, window.height)
        colour, depth = self._gl.render(self._scene, flags, colours)
        return colour, depth

    def _node_for(self, mesh: Mesh) -> Any:
        """The scene node that shows ``mesh``, uploaded or moved as needed, and now the most recently used."""
        entry = self._uploaded.get(mesh.mesh_id)
        if entry is not None and not entry.shows(mesh):
            self._drop(self._uploaded.pop(mesh.mesh_id))
            entry = None
        if entry is None:
            entry = self._upload(mesh)
            self._uploaded[mesh.mesh_id] = entry
        elif entry.mesh.vertices is not mesh.vertices:
            entry.move(mesh)
        self._uploaded.move_to_end(mesh.mesh_id)
        return entry.node

    def _upload(self, mesh: Mesh) -> _Uploaded:
        data = np.ones((3 * len(mesh.triangles), 10), dtype=np.float32)
        _write_geometry(data, mesh)
        data[:, 6:9] = np.repeat(to_linear(mesh.colours), 3, axis=0)
        primitive = pyrender.Primitive(
            positions=data[:, :3], normals=data[:, 3:6], color_0=data[:, 6:], material=self._material
        )
        primitive._add_to_context()
        node = pyrender.Node(mesh=pyrender.Mesh([primitive]))
        self._scene.add_node(node)
        return _Uploaded(mesh, node, data)

    def _drop(self, entry: _Uploaded) -> None:
        entry.node.mesh.primitives[0].delete()
        self._scene.remove_node(entry.node)

    def _set_lights(self, lights: Lighting) -> None:
        if lights == self._lights:
            return
        for node in self._scene.ordered_lights:
            self._scene.remove_node(node)
        nodes = []
        for lamp in lights.points:
            pose = np.eye(4)
            pose[:3, 3] = lamp.position
            light = pyrender.PointLight(color=np.array(lamp.colour), intensity=float(lamp.intensity * DIFFUSE_GAIN))
            nodes.append(pyrender.Node(light=light, matrix=pose))
        for sun in lights.directionals:
            light = pyrender.DirectionalLight(color=np.array(sun.colour), intensity=float(sun.intensity * DIFFUSE_GAIN))
            nodes.append(pyrender.Node(light=light, matrix=_pose_shining(np.asarray(sun.direction, dtype=np.float64))))
        for node in nodes:
            self._scene.add_node(node)
        self._scene.ordered_lights = nodes
        self._scene.ambient_light = np.full(3, float(lights.ambient))
        self._lights = lights


@functools.cache
def open_pyrender() -> PyrenderRenderer:
    """The GL renderer of this process. Raises HsbenchError, one line, where EGL or OpenGL does not start.

    The one piece of process-wide state: collecting a pyrender platform ends EGL for the whole process, so the object
    is made once and held by this cache until the process ends.
    """
    return PyrenderRenderer()


def _open_platform() -> Any:
    if os.environ["PYOPENGL_PLATFORM"] != "egl":
        raise HsbenchError(f"PYOPENGL_PLATFORM is {os.environ['PYOPENGL_PLATFORM']!r}; expected 'egl'")
    try:
        from pyrender.platforms import egl

        device = egl.get_device_by_index(int(os.environ.get("EGL_DEVICE_ID", "0")))
        platform = egl.EGLPlatform(1, 1, device=device)
        platform.init_context()
        platform.make_current()
    # Which exception says "no EGL here" depends on what is missing: loader, driver, device or permission.
    except Exception as error:
        raise HsbenchError(f"EGL does not start ({type(error).__name__}: {error})".replace("\n", " ")) from error
    return platform


def _write_geometry(vertex_data: Float32Array, mesh: Mesh) -> None:
    """Fill position and normal of the (3 T, 10) vertex buffer: every triangle has three corners of its own."""
    vertex_data[:, 0:3] = mesh.vertices[mesh.triangles].reshape(-1, 3)
    vertex_data[:, 3:6] = corner_normals(mesh).reshape(-1, 3)


def _pose_shining(direction: FloatArray) -> FloatArray:
    """(4, 4) pose whose -z axis is ``direction``: how pyrender states where a directional light shines."""
    backward = -direction / np.linalg.norm(direction)
    helper = np.array([1.0, 0.0, 0.0]) if abs(backward[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    right = np.cross(helper, backward)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(backward, right), backward], axis=1)
    return pose


def _metres(window_depth: Float32Array) -> Float32Array:
    """(h, w) GL depth of a projection without far plane -> camera z; 1 (nothing drawn) -> 0."""
    remainder = 1.0 - window_depth.astype(np.float64)
    return np.divide(NEAR_M, remainder, out=np.zeros_like(remainder), where=remainder > 0.0).astype(np.float32)


def _ids(seg: UInt8Array) -> UInt16Array:
    """(h, w, 4) SEG colours -> (h, w) ids: red is the low byte, green the high one."""
    return seg[..., 0].astype(np.uint16) | (seg[..., 1].astype(np.uint16) << np.uint16(8))
