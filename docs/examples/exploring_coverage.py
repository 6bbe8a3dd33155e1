"""How much of a home's floor and seats one exploring person reveals in the time that the mode states.

    python docs/examples/exploring_coverage.py 10 [FIRST]

45 s a square metre of floor that can be walked on, 90 s a square metre of seats and 60 s a seat, in each of some
generated homes. A cell of the floor is revealed where a body, its arms included, was above it; a seat, with its whole
surface, when somebody sat on it. The last columns are the narrower shares of ``hsbench.truth.revealed``: floor within
.25 m of an upright body's pelvis, and sittable cells within .175 m of a pelvis that sits.
"""

import sys

import numpy as np
from scipy.spatial import ConvexHull

from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import apply, planar
from hsbench.schema.states import Affordance
from hsbench.synth.activities import LifeConfig, live
from hsbench.synth.people import capsules
from hsbench.synth.rooms import HomeConfig, build_home
from hsbench.synth.seeds import Seeds
from hsbench.truth.affordance import affordance_truth
from hsbench.truth.evidence import first_swept
from hsbench.truth.revealed import revealed

S_PER_M2, S_PER_SEAT_M2, S_PER_SEAT = 45.0, 90.0, 60.0
CELL_M, HEIGHT_M = 0.05, 2.0
SEATS = ("seat", "mattress")


def main(homes: int, first: int = 0) -> None:
    names = "home", "minutes", "floor m2", "revealed", "seats m2", "revealed", "seats", "sat on", "near", "sat cells"
    print("".join(f"{name:>10}" for name in names))
    rows = []
    for number in range(first, first + homes):
        minutes, floor, seats, narrow = coverage(number)
        rows.append((*floor, sum(area for area, sat in seats if sat), sum(area for area, _ in seats), *narrow))
        swept, free, sat_m2, seat_m2, near, near_of, cells, cells_of = rows[-1]
        print(
            f"{number:>10}{minutes:>10.0f}{free:>10.1f}{swept / free:>10.1%}{seat_m2:>10.1f}{sat_m2 / seat_m2:>10.1%}"
            f"{len(seats):>10}{sum(sat for _, sat in seats):>10}{near / near_of:>10.1%}{cells / cells_of:>10.1%}",
            flush=True,
        )
    swept, free, sat_m2, seat_m2, near, near_of, cells, cells_of = np.sum(rows, axis=0)
    print(f"of all homes together: {swept / free:.1%} of the floor, {sat_m2 / seat_m2:.1%} of the seats' surface")
    print(f"by the narrower shares: {near / near_of:.1%} of the floor, {cells / cells_of:.1%} of the sittable cells")


def coverage(number: int):
    """Minutes of a home, (swept, walkable) square metres, (area, was sat on) of each usable seat, narrow counts."""
    seeds = Seeds(0).child("coverage").child(number)
    built = build_home(f"home-{number}", seeds.child("home"), HomeConfig(), ("nordic",))
    outline = np.concatenate([room.outline_xy for room in built.rooms])
    scene = built.moved(planar(*(-(outline.min(axis=0) + outline.max(axis=0)) / 2), 0.0))
    cells = 2 * int(np.ceil(np.ptp(outline, axis=0).max() / 2 / CELL_M))
    truth = affordance_truth(scene, side_cells=cells, cell_m=CELL_M)
    walkable = (truth.labels >> Affordance.WALKABLE & 1).astype(bool)[::-1, ::-1]  # rows and columns grow with x and y
    usable = seats_of(scene, truth)
    floor_m2, seats_m2 = walkable.sum() * CELL_M**2, sum(usable.values())
    duration_s = S_PER_M2 * floor_m2 + S_PER_SEAT_M2 * seats_m2 + S_PER_SEAT * len(usable)
    life = live(scene, seeds.child("life"), LifeConfig(duration_s=duration_s, fps=10, unused_share=0.0))
    grid = VoxelGrid((-cells * CELL_M / 2, -cells * CELL_M / 2, 0.0), (cells, cells, round(HEIGHT_M / CELL_M)), CELL_M)
    ends, radii = capsules(life.bodies[0], life.poses.joints_m.astype(np.float64))
    swept = np.isfinite(first_swept(ends, radii, life.poses.timestamp_ns / 1e9, grid)).any(axis=2)
    events = life.events
    sat = {(int(e), p) for e, p, c in zip(events.object_id, events.part, events.contact, strict=True) if "pelvis" in c}
    floor = ((swept & walkable).sum() * CELL_M**2, floor_m2)
    used, narrow = revealed(life.poses, life.action, life.events, 0, cells, CELL_M), []
    for kind in (Affordance.WALKABLE, Affordance.SITTABLE):
        there = (truth.labels >> kind & 1).astype(bool)
        narrow += [int((np.isfinite(used[kind].first_s) & there).sum()), int(there.sum())]
    return duration_s / 60, floor, [(area, name in sat) for name, area in usable.items()], narrow


def seats_of(scene, truth) -> dict[tuple[int, str], float]:
    """Object and part of every seat that can be sat on: the area of its outline from above."""
    part = truth.parts
    found = {}
    for k in np.flatnonzero(part.labels >> Affordance.SITTABLE & 1):
        item = scene.object(int(part.object_id[k]))
        piece = item.parts[int(part.part_index[k])]
        if piece.role in SEATS:
            key, outline = (item.object_id, piece.name), apply(item.scene_T_object, piece.solid.vertices)[:, :2]
            found[key] = found.get(key, 0.0) + ConvexHull(outline).volume  # in two dimensions: the area
    return found


if __name__ == "__main__":
    main(*map(int, sys.argv[1:] or ["10"]))
