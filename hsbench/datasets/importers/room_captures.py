"""Real rooms as episodes: what the readers of RGB-D captures give, put into the schema. Notes say what was assumed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hsbench.datasets.importers import upright
from hsbench.datasets.importers.captures import sensor_at
from hsbench.datasets.importers.nyu_labelled import CAMERA as NYU_COLOUR
from hsbench.datasets.importers.nyu_labelled import NyuFrame
from hsbench.datasets.importers.nyucad import RoomModel
from hsbench.datasets.importers.room_boxes import BOX_COLOUR, RoomBox, box_scene, category_of, unknown_names
from hsbench.datasets.importers.scene_objects import Group, LabelledMesh, build_objects, snapped
from hsbench.datasets.importers.sscnet import CAMERA as NYU_CAMERA
from hsbench.datasets.importers.sunrgbd import SunRgbdFrame
from hsbench.datasets.importers.sunrgbd_text import SunRgbdText
from hsbench.datasets.importers.tum_rgbd import MIN_FRAMES, TumSequence
from hsbench.errors import DataError
from hsbench.geometry.cameras import BrownCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.polygons import signed_area
from hsbench.geometry.transforms import apply
from hsbench.geometry.triangle_meshes import weld
from hsbench.io.pixel_labels import PixelLabels, Thing
from hsbench.schema.categories import category
from hsbench.schema.episode import Episode, EpisodeTruth, Frame, FrameList
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.schema.scene import Room, Scene
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import VoxelState
from hsbench.truth.sight import depth_states
from hsbench.typing import AnyArray, Float32Array, FloatArray

HIDDEN_M = 0.3
"""Where the annotation ends so much lower than the depth image, the floor is out of sight. Annotated floors are good to
about a tenth of a metre.
"""

TOP_PERCENT = 99.0
"""A room without a ceiling reaches as high as this percent of the depth points, or as its boxes."""


def sunrgbd_episode(frame: SunRgbdFrame, episode_id: str) -> tuple[Episode, list[str]]:
    """One frame with its boxes and room as truth, and notes.

    The floor is that of the depth image, or of the annotation where that lies much lower. Without a drawn room, its
    outline is estimated where there are boxes.
    Raises DataError for a depth image without a reading, and where the camera has no heading or is below the floor.
    """
    points = frame.camera.unproject(frame.depth_m)[frame.depth_m > 0] @ frame.upright_R_camera.T
    if not len(points):
        raise DataError("the depth image has no reading at all; expected metres somewhere")
    floor, note = _floor(points[:, 2], frame.boxes if frame.layout is None else (frame.layout,))
    episode_T_camera, episode_T_upright = upright.to_episode_frame(frame.upright_R_camera, floor)
    notes = [note]
    if frame.deleted:
        notes.append(f"left out {frame.deleted} entries that are null or without an outline: deleted things")
    boxes = [box.moved(episode_T_upright) for box in frame.boxes]
    layout = None if frame.layout is None else frame.layout.moved(episode_T_upright)
    scene, more = _scene(episode_id, frame.room_type, boxes, layout, apply(episode_T_upright, points))
    sensor = sensor_at(frame.camera, episode_T_camera)
    frames = FrameList((Frame(0, frame.rgb, frame.depth_m),))
    truth = None if scene is None else EpisodeTruth(scene=scene)
    return Episode(episode_id, "sunrgbd", sensor, frames, None, 0, 0, truth=truth), notes + more


def sunrgbd_text_episode(frame: SunRgbdText, episode_id: str) -> tuple[Episode, list[str]]:
    """One frame with its boxes as truth, and notes; without points, a picture of a camera without depth.

    The floor is that of the points or, without any, the bottom of the lowest box; without either nothing is placed.
    """
    depth = frame.depth_m
    points = np.empty((0, 3))
    if depth is not None:
        points = frame.camera.unproject(depth)[depth > 0] @ frame.upright_R_camera.T
    if depth is None and not frame.boxes:
        floor, note = -1.0, "neither points nor boxes: the height of the camera is not known"  # only angles are kept
    else:
        floor, note = _floor(points[:, 2], frame.boxes)
    episode_T_camera, episode_T_upright = upright.to_episode_frame(frame.upright_R_camera, floor)
    sensor = replace(sensor_at(frame.camera, episode_T_camera), kind="monocular" if depth is None else "rgbd")
    if depth is None and not frame.boxes:
        sensor = replace(sensor, height_m=None)
    boxes = [box.moved(episode_T_upright) for box in frame.boxes]
    scene, notes = _scene(episode_id, "room", boxes, None, apply(episode_T_upright, points))
    truth = None if scene is None else EpisodeTruth(scene=scene)
    frames = FrameList((Frame(0, frame.rgb, depth),))
    return Episode(episode_id, "sunrgbd-text", sensor, frames, None, 0, 0, truth=truth), [note, *notes]


def tum_episode(sequence: TumSequence, episode_id: str, height_m: float | None = None) -> tuple[Episode, list[str]]:
    """The first stretch of a sequence without motion, and notes. height_m: of the camera; default: by the first depth.

    Raises DataError for a first picture that cannot be read or has no depth, and where there is no heading.
    """
    frames = sequence.frames
    notes = [
        f"pairs {sequence.first} to {sequence.first + len(frames) - 1} of {sequence.pairs}: the first stretch of"
        f" {MIN_FRAMES} or more without motion; the camera strays by {100 * sequence.sway_m:.1f} cm in it"
    ]
    if sequence.unposed:
        notes.append(f"left out {sequence.unposed} pairs without a pose within 20 ms")
    first = frames[0].depth_m
    assert first is not None
    if height_m is None:
        heights = (sequence.camera.unproject(first)[first > 0] @ sequence.upright_R_camera.T)[:, 2]
        floor = upright.floor_level(heights)
        notes.append(_floor_note(heights, floor))
    else:
        floor = -height_m
    episode_T_camera, _ = upright.to_episode_frame(sequence.upright_R_camera, floor)
    straight = sequence.camera.pinhole if isinstance(sequence.camera, BrownCamera) else sequence.camera
    sensor = replace(sensor_at(straight, episode_T_camera), camera=sequence.camera)
    end_ns = int(frames.timestamps_ns[-1])
    return Episode(episode_id, "tum-rgbd", sensor, frames, None, 0, end_ns), notes


def nyucad_episode(model: RoomModel, episode_id: str, depth_m: Float32Array | None = None) -> tuple[Episode, list[str]]:
    """A room model as the truth of the camera it was made for, and notes. depth_m: (480, 640) of that camera, if any.

    Raises DataError where the floor is not below the camera, the camera has no heading, or nothing is above the floor.
    """
    if depth_m is not None and depth_m.shape != (NYU_CAMERA.height_px, NYU_CAMERA.width_px):
        raise DataError(f"the depth image is {depth_m.shape[1]} x {depth_m.shape[0]} px; expected 640 x 480")
    episode_T_camera, episode_T_upright = upright.to_episode_frame(model.upright_R_camera, model.floor_m)
    notes = [f"left out {model.without_mesh} objects without a mesh"] if model.without_mesh else []
    groups = []
    for item in model.objects:
        meshes = [
            LabelledMesh(f"mesh {i}", None, BOX_COLOUR, apply(episode_T_upright, vertices), triangles)
            for i, (vertices, triangles) in enumerate(item.meshes, start=1)
        ]
        meshes = [mesh for mesh in meshes if len(weld(snapped(mesh.vertices), mesh.triangles)[1])]
        if meshes:
            groups.append(Group(item.label, category_of(item.label), np.eye(4), meshes=meshes))
    notes += unknown_names([item.label for item in model.objects])
    ceilings = [g for g in groups if g.category == "ceiling"]
    tops = [mesh.vertices[:, 2] for group in ceilings or groups for mesh in group.meshes]
    height = float(quantise_m(min(z.min() for z in tops) if ceilings else max((z.max() for z in tops), default=0.0)))
    if height <= 0:
        raise DataError("nothing of the model is above its floor; expected a ceiling, walls or furniture (y down?)")
    notes.append(f"height {height:.2f} m: {'the underside of the ceiling' if ceilings else 'the top of everything'}")
    outlines = [
        quantise_m(apply(episode_T_upright, np.pad(outline, ((0, 0), (0, 1))))[:, :2]) for outline in model.outlines_xy
    ]
    rooms = tuple(Room("room", outline if signed_area(outline) > 0 else outline[::-1].copy()) for outline in outlines)
    scene = Scene(episode_id, rooms, height, build_objects(groups), "imported")
    frames = FrameList() if depth_m is None else FrameList((Frame(0, depth_m=depth_m),))
    sensor = sensor_at(NYU_CAMERA, episode_T_camera)
    return Episode(episode_id, "nyucad", sensor, frames, None, 0, 0, truth=EpisodeTruth(scene=scene)), notes


def nyu_episode(
    frame: NyuFrame, episode_id: str, upright_R_camera: FloatArray | None, grid: VoxelGrid
) -> tuple[Episode, list[str]]:
    """One labelled frame; with a rotation, its labelled surfaces in voxels of ``grid`` as truth; and notes.

    The floor is where pixels labelled so lie, else that of the depth image. Voxels that are neither seen to be free nor
    hold a labelled point are ignored. The labels of pixels, with the source's names, are truth with or without it.
    Raises DataError for a depth image without a reading.
    """
    frames = FrameList((Frame(0, frame.rgb, frame.depth_m),))
    named = zip(frame.names, frame.categories, strict=True)
    things = tuple(Thing(number, name, kind) for number, (name, kind) in enumerate(named, start=1))
    labels = PixelLabels((0,), things, (frame.instance,))
    if upright_R_camera is None:
        note = "how the camera leans is not known (give the rotations), so there is no truth in the episode frame"
        sensor, truth = Sensor("rgbd", NYU_COLOUR, None), EpisodeTruth(frames=labels)
        return Episode(episode_id, "nyu-v2", sensor, frames, None, 0, 0, truth=truth), [note]
    points = NYU_COLOUR.unproject(frame.depth_m) @ upright_R_camera.T
    seen = frame.depth_m > 0
    on_floor = seen & (frame.semantic == category("floor").category_id)
    if on_floor.any():
        floor = float(quantise_m(np.median(points[on_floor][:, 2])))
        notes = [f"the floor is {-floor:.2f} m below the camera, by {int(on_floor.sum()):,} pixels labelled so"]
    else:
        floor = upright.floor_level(points[seen][:, 2])
        notes = [_floor_note(points[seen][:, 2], floor)]
    episode_T_camera, episode_T_upright = upright.to_episode_frame(upright_R_camera, floor)
    sensor = sensor_at(NYU_COLOUR, episode_T_camera)
    labelled = seen & (frame.instance > 0)
    occupancy = _surfaces(frame, sensor, apply(episode_T_upright, points[labelled]), frame.instance[labelled], grid)
    notes += unknown_names(frame.names)
    truth = EpisodeTruth(occupancy=occupancy, frames=labels)
    return Episode(episode_id, "nyu-v2", sensor, frames, None, 0, 0, truth=truth), notes


def _surfaces(
    frame: NyuFrame, sensor: Sensor, points: FloatArray, instance: AnyArray, grid: VoxelGrid
) -> OccupancyTruth:
    """Labelled points (N, 3) of instances (N,) in voxels: each has the instance of most of its points.

    Points up to a voxel below the grid, as half of a real floor's are, belong to its lowest layer.
    """
    lowest = grid.origin_m[2]
    below = (points[:, 2] < lowest) & (points[:, 2] >= lowest - grid.voxel_m)
    raised = np.where(below, lowest + grid.voxel_m / 2, points[:, 2])
    index, inside = grid.index(np.column_stack([points[:, :2], raised]))
    flat = np.ravel_multi_index(tuple(index[inside].T), grid.shape)
    pairs, counts = np.unique(np.stack([flat, instance[inside].astype(np.int64)]), axis=1, return_counts=True)
    order = np.lexsort((-pairs[1], counts, pairs[0]))  # the last of a voxel: most points, then the lower number
    voxel, chosen = pairs[:, order]
    last = np.append(voxel[1:] != voxel[:-1], True) if len(voxel) else np.empty(0, bool)
    ids = np.zeros(math.prod(grid.shape), dtype=np.uint16)
    ids[voxel[last]] = chosen[last]
    ids = ids.reshape(grid.shape)
    table = np.array([0, *(category(name).category_id for name in frame.categories)], dtype=np.uint8)
    state = depth_states(grid, NYU_COLOUR, sensor.world_T_camera, frame.depth_m)
    state[ids > 0] = VoxelState.SURFACE  # seen, though the centre of a voxel may lie farther behind
    ignored = (ids == 0) & (state != VoxelState.FREE)
    state[ignored] = VoxelState.UNKNOWN
    swept = np.full(grid.shape, np.inf, dtype=np.float32)
    return OccupancyTruth(grid=grid, semantic=table[ids], instance=ids, state=state, ignored=ignored, swept_s=swept)


def _floor(heights_m: FloatArray, annotated: Sequence[RoomBox]) -> tuple[float, str]:
    """(z of the floor in the upright frame, note), by heights (N,) of depth points and by the room or the boxes.

    There must be one or the other.
    """
    drawn = min((box.bottom_m for box in annotated), default=math.inf)
    seen = upright.floor_level(heights_m) if len(heights_m) else math.inf
    if drawn < seen - HIDDEN_M:
        floor = float(quantise_m(drawn))
        return floor, f"the floor is not seen; by the annotation it is {-floor:.2f} m below the camera"
    return seen, _floor_note(heights_m, seen)


def _floor_note(heights_m: FloatArray, floor_m: float) -> str:
    share = float(upright.near_floor(heights_m, floor_m).mean())
    return f"the floor is estimated {-floor_m:.2f} m below the camera; {share:.0%} of the depth points lie on it"


def _scene(
    scene_id: str, room_type: str, boxes: Sequence[RoomBox], layout: RoomBox | None, points: FloatArray
) -> tuple[Scene | None, list[str]]:
    """(scene in the episode frame, notes); None where nobody annotated anything."""
    if layout is None and not boxes:
        return None, ["nothing is annotated, so there is no truth"]
    notes = []
    if layout is not None:
        outline, height = layout.outline_xy, layout.top_m
    else:
        corners = [box.outline_xy for box in boxes]
        outline = upright.seen_outline(np.concatenate([points[:, :2], *corners]))
        height = max(_top(points[:, 2]), *(box.top_m for box in boxes), 0.0)
        notes.append("no room is drawn: its outline and height are estimated, around all that is seen and annotated")
    if height <= 0:
        raise DataError(f"the room ends {-height:.2f} m below the floor that is seen; expected a ceiling above it")
    scene, more = box_scene(scene_id, boxes, room_type, outline, height)
    return scene, notes + more


def _top(heights_m: AnyArray) -> float:
    return float(np.percentile(heights_m, TOP_PERCENT)) if len(heights_m) else 0.0
