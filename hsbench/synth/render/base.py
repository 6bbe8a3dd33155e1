"""The renderer contract: meshes, a camera and lights in; RGB, depth and ids out.

Everything is in the world (= episode) frame, metres, z up; the camera frame is x right, y down, z forward.
What a back end draws: a triangle is seen where its front (counter-clockwise) side faces the camera and its depth is
at least NEAR_M; what is seen from behind is not there. Colour, depth and id belong to the ray through the pixel centre.
A pixel that sees nothing has depth 0, id 0 and black RGB.

A camera from above starts its rays at CUT_M, as a floor plan is cut. A solid that reaches through the cut has its
pixels at that height; what lies wholly above is not there. Its depth is the height: more of it is nearer, and the
floor has 0 like what is empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import Camera
from hsbench.typing import AnyArray, Float32Array, FloatArray, Int32Array, UInt8Array, UInt16Array

NEAR_M = 0.05
"""Nothing nearer to the camera plane than this is drawn."""

CUT_M = 2.30005
"""A camera from above sees nothing higher above the origin of its frame: 2.3 m, and half a step of the .1 mm to which
heights are rounded, so that no face lies in the cut."""

MAX_MESH_ID = 65534
MAX_LIGHTS_PER_KIND = 4

Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Mesh:
    """One object or person. The arrays are copied when writable, and read-only from then on.

    Back ends recognise a mesh they hold by the identity of its arrays: to move one, use ``moved``.
    ``mesh_id`` (1..65534) is its value in the id image. Raises SchemaError for a wrong id, shape or vertex index.
    """

    mesh_id: int
    vertices: FloatArray
    """(V, 3) float64 metres, world frame."""
    triangles: Int32Array
    """(T, 3) indices into ``vertices``, counter-clockwise seen from outside."""
    colours: UInt8Array
    """(T, 3) sRGB of each triangle."""
    smooth: bool = False
    """True: normals averaged at vertices (bodies); False: flat faces."""

    def __post_init__(self) -> None:
        if not 1 <= self.mesh_id <= MAX_MESH_ID:
            raise SchemaError(f"mesh_id is {self.mesh_id}; expected 1..{MAX_MESH_ID} (0 means nothing)")
        for name, dtype in (("vertices", np.float64), ("triangles", np.int32), ("colours", np.uint8)):
            object.__setattr__(self, name, _read_only(getattr(self, name), dtype, f"mesh {self.mesh_id}: {name}"))
        if len(self.colours) != len(self.triangles):
            raise SchemaError(
                f"mesh {self.mesh_id} has {len(self.colours)} colours for {len(self.triangles)} triangles; "
                "expected one each (are these per vertex?)"
            )
        if self.triangles.size and not (self.triangles.min() >= 0 and self.triangles.max() < len(self.vertices)):
            raise SchemaError(
                f"mesh {self.mesh_id} has vertex indices {self.triangles.min()}..{self.triangles.max()}; "
                f"expected 0..{len(self.vertices) - 1}"
            )
        if not np.isfinite(self.vertices).all():
            raise SchemaError(f"mesh {self.mesh_id} has vertices that are not finite")

    def moved(self, vertices: FloatArray) -> Mesh:
        """The same mesh at other (V, 3) vertices: what a moving person is, frame by frame. Cheap to draw again."""
        if np.shape(vertices) != self.vertices.shape:
            raise SchemaError(
                f"mesh {self.mesh_id}: moved vertices have shape {np.shape(vertices)}; expected {self.vertices.shape}"
            )
        return replace(self, vertices=vertices)


@dataclass(frozen=True)
class PointLight:
    """A lamp. ``intensity`` is the linear brightness it gives to a white face 1 m away that faces it (1 = white).

    Falls off with the square of the distance and casts no shadow. ``colour`` is linear RGB.
    """

    position: Vector
    intensity: float
    colour: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class DirectionalLight:
    """Light from infinitely far, travelling along ``direction``; ``intensity`` as for a face that faces it.

    Casts no shadow. ``colour`` is linear RGB.
    """

    direction: Vector
    intensity: float
    colour: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Lighting:
    """Ambient level plus lights; linear, 1 = a white face is just white. At most 4 lights of each kind (SchemaError).

    A face of linear colour c is drawn as c * (ambient + sum of what the lights add), without shadows.
    """

    ambient: float
    points: tuple[PointLight, ...] = ()
    directionals: tuple[DirectionalLight, ...] = ()

    def __post_init__(self) -> None:
        for name in ("points", "directionals"):
            if len(getattr(self, name)) > MAX_LIGHTS_PER_KIND:
                raise SchemaError(
                    f"lighting.{name} has {len(getattr(self, name))} lights; expected at most {MAX_LIGHTS_PER_KIND}"
                )


@dataclass(frozen=True)
class Window:
    """A rectangle of pixels of the full image: columns u0..u0+width-1, rows v0..v0+height-1."""

    u0: int
    v0: int
    width: int
    height: int

    def check(self, camera: Camera) -> None:
        """Raise SchemaError unless the window is non-empty and inside the camera's image."""
        if (
            min(self.width, self.height) < 1
            or min(self.u0, self.v0) < 0
            or self.u0 + self.width > camera.width_px
            or self.v0 + self.height > camera.height_px
        ):
            raise SchemaError(
                f"{self} is empty or reaches outside the image of {camera.width_px} x {camera.height_px} px"
            )

    @classmethod
    def full(cls, camera: Camera) -> Window:
        """The whole image of a camera."""
        return cls(0, 0, camera.width_px, camera.height_px)


@dataclass(frozen=True, eq=False)
class View:
    """What was rendered: the window's pixels. The arrays belong to the caller. What was not asked for is 0."""

    rgb: UInt8Array
    """(H, W, 3) sRGB."""
    depth_m: Float32Array
    """(H, W) metres as the camera counts depth, 0 = nothing."""
    ids: UInt16Array
    """(H, W) mesh ids, 0 = nothing."""

    @classmethod
    def blank(cls, window: Window) -> View:
        """A view of nothing."""
        shape = (window.height, window.width)
        return cls(np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.float32), np.zeros(shape, np.uint16))


Only = Literal["rgb", "shape"] | None
"""What is wanted of a view: ``rgb``, ``shape`` (depth and ids), or None, both."""


class Renderer(Protocol):
    """A back end. One object serves any number of scenes, one after the other or in turns."""

    @property
    def name(self) -> str:
        """What open_renderer calls it: pyrender or raycast."""

    def render(
        self,
        meshes: Sequence[Mesh],
        camera: Camera,
        world_T_camera: FloatArray,
        lights: Lighting,
        window: Window | None = None,
        only: Only = None,
    ) -> View:
        """Draw ``meshes``, and only these, seen by ``camera`` at the (4, 4) pose ``world_T_camera``.

        ``window`` (default: the full image) crops: its pixels equal those of a full render. ``only`` what is asked for
        need be drawn, which can take half the time.
        Raises SchemaError for a window outside the image or two meshes with one id.
        """


def check_request(meshes: Sequence[Mesh], camera: Camera, world_T_camera: FloatArray, window: Window | None) -> Window:
    """The checks every back end makes of a request; returns the window to draw. Raises SchemaError."""
    window = window or Window.full(camera)
    window.check(camera)
    if np.shape(world_T_camera) != (4, 4):
        raise SchemaError(f"world_T_camera has shape {np.shape(world_T_camera)}; expected (4, 4)")
    if len({mesh.mesh_id for mesh in meshes}) != len(meshes):
        ids = [mesh.mesh_id for mesh in meshes]
        repeated = sorted({i for i in ids if ids.count(i) > 1})
        raise SchemaError(f"mesh ids {repeated} occur more than once; expected one mesh per id")
    return window


def _read_only(values: AnyArray, dtype: type[np.generic], what: str) -> AnyArray:
    """(N, 3) array of ``dtype`` that nobody can write: the same object if it is that already, else a copy."""
    if not (isinstance(values, np.ndarray) and values.dtype == dtype and not values.flags.writeable):
        given = np.asarray(values)
        if given.dtype.kind not in "iuf" or (given.dtype.kind == "f" and np.dtype(dtype).kind != "f"):
            raise SchemaError(f"{what} has dtype {given.dtype}; expected {np.dtype(dtype)}")
        copy: np.ndarray[Any, Any] = np.array(given, dtype=dtype, order="C")
        if copy.dtype.kind != "f" and not np.array_equal(copy, given):
            raise SchemaError(f"{what} does not fit {np.dtype(dtype)}")
        copy.flags.writeable = False
        values = copy
    if values.ndim != 2 or values.shape[1] != 3:
        raise SchemaError(f"{what} has shape {values.shape}; expected (n, 3)")
    return values
