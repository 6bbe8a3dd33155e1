"""Pictures of a room without people while things are not where they were at t0.

Only windows around things that have moved are drawn again, and just as the picture at t0 is: ids and depth of the
moved scene, colours by ``background_rgb``. So what is seen of a moved chair is lit and shaded like the rest, what stood
behind it appears, and what no pixel shows leaves no trace. Things whose windows do not meet are drawn apart, as if the
other ones had not moved, and are not drawn again while they rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, reduce
from typing import NamedTuple

import numpy as np

from hsbench.io.frame_store import Picture
from hsbench.io.images import depth_to_mm
from hsbench.schema.motions import Move, ObjectMotions, Thing, scene_at
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.crops import corners_of, crop, cut, differs, hull, joined, overlap, window_of
from hsbench.synth.render import Lighting, Mesh, Renderer, Window
from hsbench.synth.render.sources import Sources, sources_of
from hsbench.synth.render.still import Still
from hsbench.synth.scene_meshes import scene_meshes
from hsbench.typing import FloatArray, UInt8Array, UInt16Array

SHADE_REACH_M = 0.3  # light that a moved thing changes farther away stays as at t0, but for its shadow in the sun
FLOOR_M = 0.0  # no shade falls lower than that, or the thing itself
LEAST_CHANGE = 2  # levels of 255: smaller changes of a surface that did not move are not seen, and cost bytes

Moves = Mapping[Thing, Move]
Group = tuple[tuple[Thing, Move], ...]


class Shape(NamedTuple):
    """The room while things are elsewhere: outside of the window ``whole`` as at t0.

    depth_mm, instance: (h, w) of the full picture. groups: things that have moved, and the window each changes.
    """

    whole: Window
    depth_mm: UInt16Array
    instance: UInt16Array
    groups: list[tuple[Group, Window]]


@dataclass(frozen=True, eq=False)
class MovedRoom:
    """A scene whose things move, before a static camera; all in the world (= episode) frame."""

    scene: Scene
    motions: ObjectMotions
    sensor: Sensor
    renderer: Renderer
    # The last picture and what it was put together of: things rest for many frames.
    _last: dict[Group, tuple[Picture, Window | None]] = field(default_factory=dict, repr=False)
    _drawn: dict[Group, UInt8Array] = field(default_factory=dict, repr=False)

    def picture(self, background: Picture, timestamp_ns: int) -> tuple[Picture, Window | None]:
        """(The room at a time, the window outside of which it is as at t0; None: nowhere else).

        background: the picture at t0, the same at every call.
        """
        moves = self.motions.moves_at(timestamp_ns)
        if not moves:
            return background, None
        key = tuple(moves.items())
        if key not in self._last:
            last = self._put_together(background, moves)
            self._last.clear()
            self._last[key] = last
        return self._last[key]

    @property
    def at_rest(self) -> Picture:
        """The room at t0."""
        return self._at_rest[0]

    @cached_property
    def _at_rest(self) -> tuple[Picture, Still | None]:
        # Embree is an extra: a generator without pictures runs without.
        from hsbench.synth.render.background import still_background

        camera, pose = self.sensor.camera, self.sensor.world_T_camera
        view = self.renderer.render(self.meshes, camera, pose, Lighting(1.0), only="shape")
        rgb, still = still_background(self.scene, view.ids, self.renderer, camera, pose)
        return Picture(rgb, depth_to_mm(view.depth_m), view.ids), still

    @cached_property
    def meshes(self) -> list[Mesh]:
        """The scene at t0 for a renderer, a mesh an object."""
        return scene_meshes(self.scene)

    def shape(self, background: Picture, moves: Moves) -> Shape | None:
        """Ids and depth while things are elsewhere, and what is to be coloured again; None: no pixel.

        background: any picture of the room at t0.
        """
        after = scene_at(self.scene, moves)
        windows = {thing: self._window(thing, after) for thing in moves}
        whole = reduce(joined, windows.values())
        if whole is None:
            return None
        meshes = [
            mesh if old is new else mesh.moved(new.vertices)
            for mesh, old, new in zip(self.meshes, self.scene.objects, after.objects, strict=True)
        ]
        camera, pose = self.sensor.camera, self.sensor.world_T_camera
        view = self.renderer.render(meshes, camera, pose, Lighting(1.0), whole, only="shape")
        depth_mm, instance = background.depth_mm.copy(), background.instance.copy()
        depth_mm[crop(whole)], instance[crop(whole)] = depth_to_mm(view.depth_m), view.ids
        seen = set(np.unique(background.instance).tolist()) | set(np.unique(view.ids).tolist())
        in_view = {thing: (move, windows[thing]) for thing, move in moves.items() if thing[0] in seen}
        return Shape(whole, depth_mm, instance, _groups(in_view))

    def ids(self, background: Picture, shape: Shape, window: Window) -> UInt16Array:
        """(h, w) ids of the full picture if nothing but what shows in a window had moved."""
        ids = background.instance.copy()
        ids[crop(window)] = shape.instance[crop(window)]
        return ids

    def _put_together(self, background: Picture, moves: Moves) -> tuple[Picture, Window | None]:
        shape = self.shape(background, moves)
        if shape is None:
            return background, None
        picture = Picture(background.rgb.copy(), shape.depth_mm, shape.instance)
        drawn: dict[Group, UInt8Array] = {}
        for group, window in shape.groups:
            before = self._drawn.get(group)
            drawn[group] = self._coloured(group, window, shape, background) if before is None else before
            picture.rgb[crop(window)] = drawn[group]
        self._drawn.clear()
        self._drawn.update(drawn)
        return picture, trimmed(shape.whole, picture, background)

    def _window(self, thing: Thing, after: Scene) -> Window | None:
        """Pixels that a thing covers or shades at t0 and in the moved scene."""
        return window_of(self.sensor, [_shape(scene, thing, self._sources) for scene in (self.scene, after)])

    def _coloured(self, group: Group, window: Window, shape: Shape, background: Picture) -> UInt8Array:
        """(h, w, 3) sRGB of a window with a group of things moved."""
        # Embree is an extra: a generator without pictures runs without.
        from hsbench.synth.render.background import background_rgb

        ids, pose = self.ids(background, shape, window), self.sensor.world_T_camera
        scene = scene_at(self.scene, dict(group))
        rgb = background_rgb(scene, ids, self.renderer, self.sensor.camera, pose, window, self._at_rest[1])
        return repainted(rgb, group, window, shape, background)

    @cached_property
    def _sources(self) -> Sources:
        return sources_of(self.scene)


def repainted(rgb: UInt8Array, group: Group, window: Window, shape: Shape, background: Picture) -> UInt8Array:
    """(h, w, 3) sRGB of a window: that of the moved room where it is seen to differ from the background."""
    before, at = cut(background, window), crop(window)
    depth_mm, instance = shape.depth_mm[at], shape.instance[at]
    anew = np.abs(rgb.astype(np.int16) - before.rgb).max(axis=-1) > LEAST_CHANGE
    anew |= (depth_mm != before.depth_mm) | (instance != before.instance)
    anew |= np.isin(instance, [object_id for (object_id, _), _ in group])
    return np.where(anew[..., None], rgb, before.rgb)


def _groups(things: Mapping[Thing, tuple[Move, Window | None]]) -> list[tuple[Group, Window]]:
    """Things whose windows meet, ascending, and the window that holds all of theirs; no two of these meet."""
    found: list[tuple[Group, Window]] = []
    for thing, (move, window) in things.items():
        if window is None:
            continue
        group: Group = ((thing, move),)
        while met := [entry for entry in found if overlap(entry[1], window)]:
            for entry in met:
                found.remove(entry)
                group, window = group + entry[0], hull(window, entry[1])
        found.append((tuple(sorted(group)), window))
    return found


def _shape(scene: Scene, thing: Thing, sources: Sources) -> tuple[FloatArray, FloatArray]:
    """What a thing covers and what it shades, as ``window_of`` takes it."""
    object_id, name = thing
    item = scene.object(object_id)
    own = np.repeat([name in ("", part.name) for part in item.parts], [len(part.vertices) for part in item.parts])
    vertices = item.vertices[own]
    low, high = vertices.min(axis=0) - SHADE_REACH_M, vertices.max(axis=0) + SHADE_REACH_M
    low[2] = max(low[2], min(FLOOR_M, low[2] + SHADE_REACH_M))
    around = corners_of(low, high)
    return vertices, np.concatenate([around, _shadow_on_floor(vertices, sources)])


def _shadow_on_floor(points: FloatArray, sources: Sources) -> FloatArray:
    """(N, 3) where the floor lies behind those of the (V, 3) points that the sun may reach through a window."""
    if not sources.sun.any():
        return np.empty((0, 3))
    lit = np.zeros(len(points), dtype=np.bool_)
    for pane in sources.windows:
        towards = float(sources.sun_towards @ pane.normal)
        if towards < 0.0:  # from outside
            way = ((pane.centre - points) @ pane.normal)[:, None] / towards
            off = points + way * sources.sun_towards - pane.centre
            inside = [np.abs(off @ half) <= half @ half for half in (pane.half_u, pane.half_v)]
            lit |= (way[:, 0] > 0.0) & inside[0] & inside[1]
    return points[lit] - points[lit, 2:] / sources.sun_towards[2] * sources.sun_towards


def trimmed(window: Window, picture: Picture, background: Picture) -> Window | None:
    """The smallest window that holds all pixels of ``window`` in which two pictures differ."""
    rows, columns = np.nonzero(differs(cut(picture, window), cut(background, window)))
    if not len(rows):
        return None
    top, left = int(rows.min()), int(columns.min())
    return Window(window.u0 + left, window.v0 + top, int(columns.max()) - left + 1, int(rows.max()) - top + 1)
