"""Cuboid candidates: everything that a box of furniture might be, given faces, hidden parts and places to sit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from scipy.ndimage import binary_opening, find_objects, label

from hsbench.baselines.occlusion.aligned import AlignedRoom
from hsbench.baselines.occlusion.config import CuboidConfig
from hsbench.baselines.occlusion.rectangles import Rectangle, rectangles
from hsbench.typing import AnyArray, BoolArray, FloatArray, IntArray

Cuboid = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]
"""Lowest and highest voxel border along x, y and z."""


def candidates(room: AlignedRoom, config: CuboidConfig) -> IntArray:
    """(C, 3, 2) voxel borders of the distinct candidates that have a size furniture has, before any choice."""
    faces = rectangles(room, config)
    solid = room.surface | room.hidden
    proposed = [*_from_faces(faces, room, config), *_from_parts(solid, config), *_from_seats(room, config)]
    found = np.array(sorted(set(proposed)), dtype=np.int64).reshape(-1, 3, 2)
    size_m = np.ptp(found, axis=2) * room.grid.voxel_m
    fits = (size_m >= config.least_m).all(axis=1) & (size_m.max(axis=1) >= config.longest_least_m)
    return found[fits & (size_m <= config.most_m).all(axis=1)]


def _from_faces(faces: list[Rectangle], room: AlignedRoom, config: CuboidConfig) -> Iterator[Cuboid]:
    """A box for each face, for each two perpendicular ones that meet, and for each top with two sides."""
    tops = [face for face in faces if face.axis == 2]
    sides = [face for face in faces if face.axis != 2]
    for top in tops:
        plan = top.span(0), top.span(1)
        yield from _down(plan, top.plane, room, config)
        meeting = [side for side in sides if _meet(top, side, config)]
        for side in meeting:
            yield from _down(_with_side(plan, side), top.plane, room, config)
        for first in meeting:
            for second in meeting:
                if first.axis < second.axis:
                    yield from _down(_with_side(_with_side(plan, first), second), top.plane, room, config)
    for side in sides:
        yield from _behind(side, room, config)
    for first in (side for side in sides if side.axis == 0):
        for second in (side for side in sides if side.axis == 1 and _meet_at_corner(first, side, config)):
            bottom, top_z = min(first.span(2)[0], second.span(2)[0]), max(first.span(2)[1], second.span(2)[1])
            yield second.span(0), first.span(1), (_floored(bottom, config), top_z)


def _down(plan: tuple[tuple[int, int], ...], top: int, room: AlignedRoom, config: CuboidConfig) -> Iterator[Cuboid]:
    """A plan and a top, down to the floor and down to the nearest voxel layer that is free for the most part."""
    (x0, x1), (y0, y1) = plan
    if x0 >= x1 or y0 >= y1 or top <= 0:
        return
    yield (x0, x1), (y0, y1), (0, top)
    layers = room.free[x0:x1, y0:y1, :top].mean(axis=(0, 1)) > config.free_share
    below = np.flatnonzero(layers)
    if len(below) and below[-1] + 1 < top:
        yield (x0, x1), (y0, y1), (int(below[-1]) + 1, top)


def _behind(side: Rectangle, room: AlignedRoom, config: CuboidConfig) -> Iterator[Cuboid]:
    """What lies behind a side: as deep as it is not free for the most part, and each usual depth less than that."""
    other = 1 - side.axis
    across, (bottom, top) = side.span(other), side.span(2)
    solid = np.moveaxis(room.free, side.axis, 0)[:, slice(*across), bottom:top]
    layers = solid.mean(axis=(1, 2)) > config.free_share
    step = -side.sign
    first = side.plane if step > 0 else side.plane - 1
    depth, most = 0, round(config.most_m / room.grid.voxel_m)
    while 0 <= first + step * depth < len(layers) and depth < most and not layers[first + step * depth]:
        depth += 1
    usual = (round(depth_m / room.grid.voxel_m) for depth_m in config.usual_depths_m)
    for cells in sorted({depth, *(d for d in usual if d < depth)} - {0}):
        along = (side.plane, side.plane + cells) if step > 0 else (side.plane - cells, side.plane)
        spans = (along, across) if side.axis == 0 else (across, along)
        yield spans[0], spans[1], (_floored(bottom, config), top)


def _floored(bottom: int, config: CuboidConfig) -> int:
    """The floor for what ends near it: what stands there is seldom seen down to its feet."""
    return 0 if bottom * config.voxel_m <= config.near_floor_m else bottom


def _with_side(plan: tuple[tuple[int, int], ...], side: Rectangle) -> tuple[tuple[int, int], ...]:
    """A plan that ends at a side, and is at least as wide as it."""
    spans = list(plan)
    low, high = spans[side.axis]
    spans[side.axis] = (low, side.plane) if side.sign > 0 else (side.plane, high)
    other = 1 - side.axis
    across = side.span(other)
    spans[other] = min(spans[other][0], across[0]), max(spans[other][1], across[1])
    return tuple(spans)


def _meet(top: Rectangle, side: Rectangle, config: CuboidConfig) -> bool:
    """Whether a side ends at a top's edge: near it in height and along its normal, and beside it across."""
    edge = top.span(side.axis)[1 if side.sign > 0 else 0]
    near = abs(side.plane - edge) <= config.meet_voxels and abs(side.span(2)[1] - top.plane) <= config.meet_voxels
    return near and _overlap(top.span(1 - side.axis), side.span(1 - side.axis)) >= config.meet_share


def _meet_at_corner(first: Rectangle, second: Rectangle, config: CuboidConfig) -> bool:
    """Whether sides along x and y end at one vertical edge and share heights."""
    edge_y = first.span(1)[1 if second.sign > 0 else 0]
    edge_x = second.span(0)[1 if first.sign > 0 else 0]
    near = abs(second.plane - edge_y) <= config.meet_voxels and abs(first.plane - edge_x) <= config.meet_voxels
    return near and _overlap(first.span(2), second.span(2)) >= config.meet_share


def _overlap(a: tuple[int, int], b: tuple[int, int]) -> float:
    """What two spans share, of the shorter one."""
    return (min(a[1], b[1]) - max(a[0], b[0])) / max(min(a[1] - a[0], b[1] - b[0]), 1)


def _from_parts(solid: BoolArray, config: CuboidConfig) -> Iterator[Cuboid]:
    """Boxes around connected parts of what is solid: as it is, with thin bridges cut, and below several heights."""
    for level_m in config.part_levels_m:
        below = solid.copy()
        below[:, :, round(level_m / config.voxel_m) :] = False
        for volume in (below, binary_opening(below, np.ones((3, 3, 3)))):
            yield from _boxes(volume, config)


def _boxes(volume: BoolArray, config: CuboidConfig) -> Iterator[Cuboid]:
    labels, _ = label(volume)
    for number, box in enumerate(find_objects(labels), start=1):
        if (labels[box] == number).sum() >= config.least_part_voxels:
            x, y, z = ((part.start, part.stop) for part in box)
            yield x, y, (_floored(z[0], config), z[1])


def _from_seats(room: AlignedRoom, config: CuboidConfig) -> Iterator[Cuboid]:
    """Boxes where people sat: up to the seat, and with a back."""
    for seat in room.seats:
        x, y = (np.flatnonzero(seat.mask.any(axis=1 - axis)) for axis in range(2))
        for back_m in config.backs_m:
            top = round((seat.height_m + back_m) / room.grid.voxel_m)
            if top > 0:
                yield (int(x[0]), int(x[-1]) + 1), (int(y[0]), int(y[-1]) + 1), (0, top)


def volumes(cuboids: AnyArray) -> IntArray:
    """(C,) voxels in (C, 3, 2) cuboids."""
    return np.asarray(np.prod(cuboids[:, :, 1] - cuboids[:, :, 0], axis=1))


def shared(cuboids: AnyArray) -> IntArray:
    """(C, C) voxels that each two of (C, 3, 2) cuboids share."""
    low = np.maximum(cuboids[:, None, :, 0], cuboids[None, :, :, 0])
    high = np.minimum(cuboids[:, None, :, 1], cuboids[None, :, :, 1])
    return np.asarray(np.prod(np.maximum(high - low, 0), axis=2))


def suppressed(cuboids: IntArray, cost: FloatArray, config: CuboidConfig) -> IntArray:
    """Rows of the cheapest candidates, none of which is nearly another (IoU), at most ``most_candidates``."""
    kept: list[int] = []
    both, size = shared(cuboids), volumes(cuboids)
    for k in np.argsort(cost, kind="stable"):
        iou = both[k, kept] / (size[k] + size[kept] - both[k, kept])
        if not (iou > config.same_iou).any():
            kept.append(int(k))
        if len(kept) == config.most_candidates:
            break
    return np.array(kept, dtype=np.int64)


def counted(volume: BoolArray, cuboids: AnyArray) -> IntArray:
    """(C,) true voxels of a volume (nx, ny, nz) in each of (C, 3, 2) cuboids, by a summed table."""
    table = np.zeros(np.add(volume.shape, 1), dtype=np.int64)
    table[1:, 1:, 1:] = volume.astype(np.int64).cumsum(axis=0).cumsum(axis=1).cumsum(axis=2)
    (x0, x1), (y0, y1), (z0, z1) = (cuboids[:, axis].T for axis in range(3))
    upper = table[x1, y1, z1] - table[x0, y1, z1] - table[x1, y0, z1] + table[x0, y0, z1]
    lower = table[x1, y1, z0] - table[x0, y1, z0] - table[x1, y0, z0] + table[x0, y0, z0]
    return np.asarray(upper - lower)


def sides_of(cuboids: AnyArray, shape: Iterable[int], reach: int) -> Iterator[tuple[int, int, IntArray, IntArray]]:
    """Each side of (C, 3, 2) cuboids but the bottom: (axis, sign, slabs about it (C, 3, 2), cells of the side (C,))."""
    limits = np.array(list(shape))
    for axis, sign in ((2, 1), (0, 1), (0, -1), (1, 1), (1, -1)):
        slab = np.array(cuboids)
        border = slab[:, axis, int(sign > 0)].copy()
        slab[:, axis, 0] = np.maximum(border - reach, 0)
        slab[:, axis, 1] = np.minimum(border + reach, limits[axis])
        others = [a for a in range(3) if a != axis]
        yield axis, sign, slab, np.asarray(np.prod(np.ptp(cuboids[:, others], axis=2), axis=1))
