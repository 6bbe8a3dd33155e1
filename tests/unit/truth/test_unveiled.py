"""When voxels are first seen: against true states of the whole moved scene at every moment, and by hand."""

from __future__ import annotations

import numpy as np
from episode_builders import furniture
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.geometry.cameras import PinholeCamera, world_T_camera
from hsbench.geometry.convex import span
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import planar
from hsbench.schema import ObjectMotions, Room, Scene
from hsbench.schema.motions import scene_at
from hsbench.schema.states import VoxelState
from hsbench.truth.sight import ray_image, true_states
from hsbench.truth.unveiled import first_seen

CAMERA = PinholeCamera(64, 48, 50.0, 50.0, 32.0, 24.0)
POSE = world_T_camera(1.2, 0.25)
GRID = VoxelGrid((0.4, -1.5, 0.0), (26, 30, 20), 0.1)
OUTLINE = np.array([[-0.5, -2.0], [3.0, -2.0], [3.0, 2.0], [-0.5, 2.0]])
S = 1_000_000_000


def room(box_xy: tuple[float, float] = (1.2, 0.0), other_xy: tuple[float, float] = (2.2, 1.0)) -> Scene:
    wall = furniture(1, span((3.0, -2.0, 0.0), (3.1, 2.0, 2.4)), "wall")
    floor = furniture(2, span((-0.5, -2.0, -0.1), (3.0, 2.0, 0.0)), "floor")
    box = furniture(3, span((-0.2, -0.3, 0.0), (0.2, 0.3, 0.9)), "sideboard", planar(*box_xy, 0.0))
    other = furniture(4, span((-0.2, -0.2, 0.0), (0.2, 0.2, 0.6)), "stool", planar(*other_xy, 0.0))
    return Scene("s", (Room("living", OUTLINE),), 2.4, (wall, floor, box, other))


def moved(object_id: int, *keys: tuple[int, tuple[float, float, float]]) -> ObjectMotions:
    return ObjectMotions(
        np.array([t for t, _ in keys], dtype=np.int64),
        np.full(len(keys), object_id, dtype=np.int32),
        ("",) * len(keys),
        np.array([m for _, m in keys], dtype=np.float64),
    )


def states(scene: Scene) -> np.ndarray:
    return true_states(scene, GRID, CAMERA, POSE, ray_image(scene, CAMERA, POSE))


def found(scene: Scene, motions: ObjectMotions) -> np.ndarray:
    return first_seen(scene, GRID, CAMERA, POSE, states(scene), motions, 0, 100 * S)


def test_nothing_moves() -> None:
    scene = room()
    seen = found(scene, ObjectMotions.none())
    visible = np.isin(states(scene), (VoxelState.FREE, VoxelState.SURFACE))
    assert np.array_equal(seen == 0, visible)
    assert np.isinf(seen[~visible]).all()


@settings(max_examples=25)
@given(st.integers(-12, 12), st.integers(-12, 12), st.sampled_from([0.0, 0.7]), st.integers(1, 50))
def test_one_thing_goes_away_and_comes_back(dx: int, dy: int, yaw: float, when_s: int) -> None:
    """What is seen at a key pose or in the middle of a way is what the states of the whole scene say then."""
    scene, there = room(), (dx / 10, dy / 10, yaw)
    keys = ((when_s * S, (0.0, 0.0, 0.0)), ((when_s + 2) * S, there), ((when_s + 6) * S, (0.0, 0.0, 0.0)))
    motions = moved(3, *keys)
    expected = found(scene, ObjectMotions.none())
    at_t0 = states(scene)
    for time_s in (when_s + 1, when_s + 2, when_s + 4):
        now = np.isin(states(scene_at(scene, motions.moves_at(time_s * S))), (VoxelState.FREE, VoxelState.SURFACE))
        unveiled = now & (at_t0 == VoxelState.OCCLUDED)
        expected[unveiled] = np.minimum(expected[unveiled], time_s)
    assert np.array_equal(found(scene, motions), expected)


def test_what_stood_behind_is_seen_when_it_is_unveiled() -> None:
    scene = room()
    seen = found(scene, moved(3, (10 * S, (0.0, 0.0, 0.0)), (12 * S, (0.0, 1.4, 0.0))))
    behind = GRID.index(np.array([[1.75, 0.0, 0.45]]))[0][0]
    assert 11.0 <= seen[tuple(behind)] <= 12.0
    inside = GRID.index(np.array([[2.2, 1.0, 0.3]]))[0][0]
    assert np.isinf(seen[tuple(inside)]), "what is inside of a thing that stays is never seen"


def test_a_thing_that_moves_out_of_sight_of_what_it_hid_unveils_nothing_of_others() -> None:
    """The second box moves: only voxels behind it change."""
    scene = room()
    before, after = found(scene, ObjectMotions.none()), found(scene, moved(4, (5 * S, (0.3, -0.4, 0.0))))
    changed = np.isfinite(after) & np.isinf(before)
    assert changed.any()
    assert (after[changed] == 5).all()
    y = GRID.axis_centres(1)[np.nonzero(changed)[1]]
    assert (y > 0.6).all(), "the first box stands before lower y"
