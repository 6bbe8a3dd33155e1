"""Does an episode's truth agree with itself? Pictures, boxes, voxels, bodies and views against exact geometry.

Each check returns faults, a line each, none where it is kept or has nothing to look at.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation

from hsbench.geometry.cameras import EquirectangularCamera, TopDownCamera
from hsbench.geometry.rays import pack_solids, segments_blocked
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.schema.episode import Episode
from hsbench.schema.scene import PERSON_ID_OFFSET, Scene
from hsbench.schema.sensor import Sensor
from hsbench.truth.sight import ray_image
from hsbench.typing import AnyArray, BoolArray, FloatArray, IntArray

DEPTH_M = 0.002
"""Clean depth is stored in whole millimetres and drawn in float32 by some renderers."""
SHARE = 0.999
"""Of pixels, points or joints that must fit: a ray may graze an edge on either side of it."""
BODY_SHARE = 0.99
"""Of joints: in a sharply bent limb one may lie a little outside of the skin."""
VIEW_M = 0.01
VIEW_POINTS = 1000
JOINT_PX = 0.5
"""Joints of one person at one time, told by two sensors, lie no farther apart in a picture."""
NEAR_M = 0.2
"""A joint nearer to a lens moves by pixels where it moves by the tenth of a millimetre to which it is stored."""
CUT_M = 2.3
"""A view from above is cut there, as a floor plan is."""
LIFT_M = 0.005
"""A point is looked at from so far before its surface: it must not hide itself."""
FLAT_M = 0.005
"""Pixels about a point that lie farther from one plane show an edge, and which side a point is on is chance."""
TINY = 1e-12


def geometry_faults(episode: Episode) -> Iterator[str]:
    """Faults of one generated episode; one without pictures and their truth has nothing to look at."""
    view = _View.of(episode)
    if view is None or isinstance(episode.sensor.camera, TopDownCamera):
        return
    yield from _depth_faults(view)
    yield from _box_faults(view)
    yield from _solid_faults(view)
    yield from _body_faults(episode)


def _depth_faults(view: _View) -> Iterator[str]:
    """Clean depth and ids at t0 against exact rays, where nobody stands."""
    camera = view.episode.sensor.camera
    assert not isinstance(camera, TopDownCamera)
    exact = ray_image(view.scene, camera, view.episode.placed_sensor.world_T_camera)
    room = view.ids <= PERSON_ID_OFFSET
    near = np.abs(np.where(np.isfinite(exact.depth_m), exact.depth_m, 0.0) - view.depth_m) <= DEPTH_M
    if (share := float(near[room].mean())) < SHARE:
        yield f"depth at t0 is within {1000 * DEPTH_M:g} mm of exact rays on {share:.2%}; expected {SHARE:.1%}"
    object_ids = np.array([item.object_id for item in view.scene.objects] + [0])  # the last is what -1 stands for
    alike = object_ids[exact.owner] == view.ids
    if (share := float(alike[room].mean())) < SHARE:
        yield f"ids at t0 are those of exact rays on {share:.2%}; expected {SHARE:.1%}"


def _box_faults(view: _View) -> Iterator[str]:
    """Every object's box holds the points that show it."""
    for item in view.scene.objects:
        points = view.points[view.point_ids == item.object_id]
        if not len(points):
            continue
        local = apply(invert(planar(*map(float, item.box[[0, 1, 6, 2]]))), points)
        share = float((np.abs(local) <= item.box[3:6] / 2 + DEPTH_M).all(axis=1).mean())
        if share < SHARE:
            yield f"box of {item.category_name} {item.object_id} holds {share:.2%} of its points; expected {SHARE:.1%}"


def _solid_faults(view: _View) -> Iterator[str]:
    """Every point of the picture at t0 lies within one voxel of a solid one, as far as the grid goes."""
    truth = view.episode.truth
    if truth is None or truth.occupancy is None:
        return
    grid = truth.occupancy.grid
    near = binary_dilation(truth.occupancy.solid, np.ones((3, 3, 3)))
    index, inside = grid.index(view.points)
    # At the rim the solid voxel next to a point may lie outside of the grid.
    inside &= ((index > 0) & (index < np.array(grid.shape) - 1)).all(axis=1)
    if inside.any() and (share := float(near[tuple(index[inside].T)].mean())) < SHARE:
        yield f"{share:.2%} of the points at t0 lie within a voxel of a solid; expected {SHARE:.1%}"


def _body_faults(episode: Episode) -> Iterator[str]:
    """Joints lie inside the bodies drawn: where nothing is before a joint, its pixel shows its person.

    The last joints of limbs lie on the skin and are left out.
    """
    truth = episode.truth
    assert truth is not None
    assert truth.frames is not None
    if truth.poses is None:
        return
    poses = truth.poses.poses
    assert poses.joints_m is not None  # true poses have them
    inner = sorted({parent for parent, _ in poses.layout.bones})
    camera, camera_T_world = episode.sensor.camera, invert(episode.placed_sensor.world_T_camera)
    hits: list[BoolArray] = [np.zeros(0, dtype=np.bool_)]
    stamps = episode.frames.timestamps_ns
    for index in np.flatnonzero(np.isin(stamps, poses.timestamp_ns)):
        rows = np.flatnonzero(poses.timestamp_ns == stamps[index])
        pixels, depth = camera.project(apply(camera_T_world, poses.joints_m[rows][:, inner].astype(np.float64)))
        inside = camera.contains(pixels)
        if not inside.any():
            continue
        frame = truth.frames[int(index)]
        assert frame.instance is not None
        assert frame.depth_m is not None
        people = np.broadcast_to(PERSON_ID_OFFSET + poses.track_id[rows, None], inside.shape)[inside]
        column, row = pixels[inside].astype(np.int64).T
        shown = frame.instance[row, column] == people
        hits.append(shown[shown | (frame.depth_m[row, column] > depth[inside])])
    joints = np.concatenate(hits)
    if len(joints) and (share := float(joints.mean())) < BODY_SHARE:
        yield f"{share:.2%} of the joints in view lie in their person's picture; expected {BODY_SHARE:.0%}"


def view_faults(episodes: Sequence[Episode]) -> Iterator[str]:
    """Episodes of one room by several sensors: a point that both see lies in one place."""
    for a in episodes:
        for b in episodes:
            if a is b:
                continue
            apart_px = joints_apart_px(a, b)
            if apart_px is not None and apart_px > JOINT_PX:
                yield (
                    f"a joint of {a.episode_id} projects {apart_px:.2f} px beside that of {b.episode_id}; "
                    f"expected at most {JOINT_PX:g} px"
                )
            share = agreement(a, b)
            if share is not None and share < SHARE:
                yield (
                    f"{share:.2%} of the points that {a.episode_id} and {b.episode_id} both see at t0 lie in one place "
                    f"to {100 * VIEW_M:g} cm; expected {SHARE:.1%}"
                )


def joints_apart_px(a: Episode, b: Episode) -> float | None:
    """How far in the picture of b two places of a joint lie at most: its own, and that of a, moved; None: no joint.

    Of true joints at times of both, where both show one life. Columns of a 360 picture are counted around it.
    """
    one, other = _joints(a), _joints(b)
    moved = None if one is None or other is None or not _show_one_life(a, b) else _scenes(a, b)
    if one is None or other is None or moved is None:
        return None
    theirs = {key: row for row, key in enumerate(zip(*other[:2], strict=True))}
    pairs = [(row, theirs[key]) for row, key in enumerate(zip(*one[:2], strict=True)) if key in theirs]
    if not pairs:
        return None
    camera, camera_T_world = b.sensor.camera, invert(b.placed_sensor.world_T_camera)
    rows, own_rows = np.array(pairs).T
    pixels, depth_m = camera.project(apply(camera_T_world @ moved, one[2][rows]))
    own, _ = camera.project(apply(camera_T_world, other[2][own_rows]))
    inside = camera.contains(own) & (depth_m > NEAR_M)
    if not inside.any():
        return None
    off = np.abs(pixels - own)[inside]
    if isinstance(camera, EquirectangularCamera):
        off[:, 0] = np.minimum(off[:, 0], camera.width_px - off[:, 0])
    return float(np.hypot(*off.T).max())


def _joints(episode: Episode) -> tuple[list[int], list[int], FloatArray] | None:
    """Time, person and (N, J, 3) places of the true joints."""
    truth = episode.truth
    if truth is None or truth.poses is None or truth.poses.poses.joints_m is None:
        return None
    poses = truth.poses.poses
    assert poses.joints_m is not None
    return poses.timestamp_ns.tolist(), poses.track_id.tolist(), poses.joints_m.astype(np.float64)


def _show_one_life(a: Episode, b: Episode) -> bool:
    """Whether two event logs are one, as far as can be told: rooms are lived in more than once (recipe ``pairs``)."""
    one, other = (None if episode.truth is None else episode.truth.events for episode in (a, b))
    if one is None or other is None:
        return True
    columns = ("person_id", "activity", "start_ns")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in columns)


def _scenes(a: Episode, b: Episode) -> FloatArray | None:
    """(4, 4) b_T_a of the frames of two episodes in one room, None where truth has no scene."""
    if a.truth is None or b.truth is None or a.truth.scene is None or b.truth.scene is None:
        return None
    return _transform(b.truth.scene, a.truth.scene)


def agreement(a: Episode, b: Episode) -> float | None:
    """Share of the points in a's picture at t0 that b sees too and shows within VIEW_M; None where there are none.

    Who sees a point is asked of exact rays against convex parts.
    """
    one, other = _View.of(a), _View.of(b)
    if one is None or other is None:
        return None
    chosen = np.linspace(0, len(one.points) - 1, VIEW_POINTS).astype(np.int64)
    points = apply(_transform(other.scene, one.scene), one.points[chosen])
    camera, world_T_camera = b.sensor.camera, b.placed_sensor.world_T_camera
    pixels, _ = camera.project(apply(invert(world_T_camera), points))
    inside = camera.contains(pixels)
    column, row = np.where(inside[:, None], pixels, 0).astype(np.int64).T
    inside &= (column > 0) & (row > 0) & (column < camera.width_px - 1) & (row < camera.height_px - 1)
    centre, normal, is_flat = _surface(apply(world_T_camera, camera.unproject(other.depth_m)), row, column, inside)
    compared = inside & is_flat & (other.ids[row, column] <= PERSON_ID_OFFSET) & (other.depth_m[row, column] > 0)
    compared[compared] = _is_seen(points[compared], b.placed_sensor, other.scene)
    if not compared.any():
        return None
    gap = np.abs(np.einsum("ni,ni->n", points - centre, normal))[compared]
    return float((gap <= VIEW_M).mean())


def _is_seen(points: FloatArray, sensor: Sensor, scene: Scene) -> BoolArray:
    """(N,) whether nothing stands between (N, 3) points on surfaces and a sensor."""
    solids = pack_solids([solid for item in scene.objects for solid in item.solids])
    if isinstance(sensor.camera, TopDownCamera):
        eyes = np.column_stack([points[:, :2], np.full(len(points), CUT_M)])
        below = points[:, 2] < CUT_M - LIFT_M
        lifted = points + np.array([0.0, 0.0, LIFT_M])
        pairs = zip(eyes, lifted[:, None], strict=True)
        return below & ~np.array([bool(segments_blocked(eye, point, solids)[0]) for eye, point in pairs])
    eye = sensor.world_T_camera[:3, 3]
    towards = (eye - points) / np.linalg.norm(eye - points, axis=1, keepdims=True)
    return ~segments_blocked(eye, points + LIFT_M * towards, solids)


@dataclass(frozen=True, eq=False)
class _View:
    """What an episode's sensor showed at t0: clean depth and ids (h, w), and points (N, 3) of what is no person."""

    episode: Episode
    scene: Scene
    depth_m: FloatArray
    ids: AnyArray
    points: FloatArray
    point_ids: AnyArray

    @classmethod
    def of(cls, episode: Episode) -> _View | None:
        """None for an episode without pictures or truth of them."""
        truth = episode.truth
        if truth is None or truth.scene is None or truth.frames is None or not len(truth.frames):
            return None
        first = truth.frames[0]
        if first.depth_m is None or first.instance is None:
            return None
        depth_m, ids = first.depth_m.astype(np.float64), first.instance
        shown = (depth_m > 0) & (ids <= PERSON_ID_OFFSET)
        points = apply(episode.placed_sensor.world_T_camera, episode.sensor.camera.unproject(depth_m)[shown])
        return cls(episode, truth.scene, depth_m, ids, points, ids[shown])


def _surface(
    shown: FloatArray, row: IntArray, column: IntArray, inside: BoolArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """(N, 3) point and unit normal of what pixels of (h, w, 3) points show, and whether the nine about it lie in it.

    Distances from that plane do not grow with the slope under which a pixel sees it. ``inside``: off the border.
    """
    row, column = np.where(inside, row, 1), np.where(inside, column, 1)
    centre = shown[row, column]
    normal = np.cross(shown[row, column + 1] - shown[row, column - 1], shown[row + 1, column] - shown[row - 1, column])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), TINY)
    steps = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    off = [np.einsum("ni,ni->n", shown[row + i, column + j] - centre, normal) for i, j in steps]
    return centre, normal, (np.abs(off) < FLAT_M).all(axis=0) & (np.linalg.norm(normal, axis=1) > 0.5)


def _transform(b: Scene, a: Scene) -> FloatArray:
    """(4, 4) b_T_a of one room told in two frames: by the objects they share."""
    places = {item.object_id: item.scene_T_object for item in a.objects}
    item = next(item for item in b.objects if item.object_id in places)
    return item.scene_T_object @ invert(places[item.object_id])
