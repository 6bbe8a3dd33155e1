"""Patches of faces drawn into plans and voxels, against what the shapes say cell by cell."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.geometry.convex import ConvexSolid, cylinder, regular_outline, span
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.polygons import contains, outline_distance, rectangle
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.truth.obstacles import Obstacles, pack_obstacles
from hsbench.truth.surfaces import Patches, cut_patches, draw_plan, draw_voxels

OUTLINE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])
ORIGIN, SHAPE = np.zeros(2), (80, 80)


def patches_of(*solids: ConvexSolid) -> tuple[Patches, Obstacles]:
    parts = tuple(Part(f"p{k}", (1, 2, 3), solid=solid) for k, solid in enumerate(solids))
    scene = Scene("s", (Room("living", OUTLINE),), 2.5, (SceneObject(1, "sideboard", np.eye(4), parts),))
    obstacles = pack_obstacles(scene)
    return cut_patches(obstacles, -1.0, 3.0), obstacles


def plan(patches: Patches, obstacles: Obstacles, chosen: np.ndarray, cell_m: float = 0.05) -> np.ndarray:
    shape = (round(4 / cell_m), round(4 / cell_m))
    return draw_plan(patches, chosen.astype(np.uint8), obstacles, ORIGIN, shape, cell_m).astype(bool)


def centres(cell_m: float = 0.05) -> np.ndarray:
    x = (np.arange(round(4 / cell_m)) + 0.5) * cell_m
    return np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1)


@pytest.mark.parametrize("cell_m", [0.05, 0.02, 0.1])
@pytest.mark.parametrize("yaw", [0.0, 0.3, 1.1, np.pi / 2])
def test_an_upper_side_covers_the_cells_whose_centre_it_holds(yaw: float, cell_m: float) -> None:
    board = span((-0.61, -0.23, 0), (0.61, 0.23, 0.03)).transformed(planar(2.013, 1.871, yaw, 0.7))
    patches, obstacles = patches_of(board)
    outline = rectangle(np.array([2.013, 1.871]), np.array([0.61, 0.23]), yaw)
    assert np.array_equal(plan(patches, obstacles, patches.faces_up, cell_m), contains(outline, centres(cell_m)))


def test_a_round_upper_side_too() -> None:
    patches, obstacles = patches_of(cylinder(0.4, 0.0, 0.7, (2.01, 1.99), sides=16))
    outline = regular_outline(0.4, 16, (2.01, 1.99))
    drawn = plan(patches, obstacles, patches.faces_up)
    sure = outline_distance(outline, centres()) > 0.013  # slivers of patches narrower than that may go undrawn
    assert np.array_equal(drawn[sure], contains(outline, centres())[sure])


def test_upright_sides_draw_the_outermost_cells_of_a_thick_part() -> None:
    patches, obstacles = patches_of(span((1.01, 1.02, 0), (2.03, 1.98, 0.7)))
    upright = np.abs(patches.normal[patches.face, 2]) < 0.5
    held = contains(rectangle(np.array([1.52, 1.5]), np.array([0.51, 0.48]), 0), centres())
    inner = held[2:, 1:-1] & held[:-2, 1:-1] & held[1:-1, 2:] & held[1:-1, :-2]
    ring = held.copy()
    ring[1:-1, 1:-1] &= ~inner
    assert np.array_equal(plan(patches, obstacles, upright), ring)


def test_a_thin_part_is_not_lost() -> None:
    patches, obstacles = patches_of(span((1.0, 1.011, 0.5), (1.9, 1.023, 0.7)))
    everything = np.ones(len(patches.point), dtype=bool)
    drawn = plan(patches, obstacles, everything)
    assert np.array_equal(np.argwhere(drawn)[:, 1], np.full(18, 20))
    assert drawn[20:38, 20].all()


def test_patches_cover_every_face_once() -> None:
    solid = span((0.3, 0.4, 0.1), (1.53, 0.82, 0.19)).transformed(planar(0.2, 0.1, 0.4))
    patches, _ = patches_of(solid)
    area = 4 * np.linalg.norm(np.cross(*np.moveaxis(patches.half, 1, 0)), axis=1)[patches.face]
    assert area.sum() == pytest.approx(2 * (1.23 * 0.42 + 1.23 * 0.09 + 0.42 * 0.09), rel=1e-9)
    assert np.array_equal(patches.point, patches.middle)
    depth = np.einsum("ij,ij->i", patches.point, patches.normal[patches.face])
    others = solid.planes @ np.vstack([patches.point.T, np.full(len(patches.point), -1.0)])
    assert np.allclose(others.max(axis=0), 0, atol=1e-9)  # on the solid, on no side beyond it
    assert depth.max() > 0


def test_heights_limit_the_patches() -> None:
    _, obstacles = patches_of(span((0, 0, 0), (1, 1, 1)))
    patches = cut_patches(obstacles, 0.3, 0.7)
    assert patches.point[:, 2].min() >= 0.3
    assert patches.point[:, 2].max() <= 0.7
    assert len(patches.point) == 4 * 20 * 8


def test_voxels_of_a_box_are_its_outermost() -> None:
    patches, obstacles = patches_of(span((0.12, 0.21, 0.3), (0.61, 0.77, 0.75)))
    drawn = draw_voxels(
        patches, np.ones(len(patches.point), np.uint8), obstacles, VoxelGrid((0.0, 0.0, 0.0), (20, 20, 20))
    )
    expected = np.zeros((20, 20, 20), dtype=bool)
    expected[2:13, 4:16, 6:15] = True  # the top, at .75 m, lies in the voxel below it: the box fills that one
    expected[3:12, 5:15, 7:14] = False
    assert np.array_equal(drawn.astype(bool), expected)


def test_voxels_of_a_turned_box_hold_its_surface() -> None:
    solid = span((-0.2, -0.15, 0), (0.2, 0.15, 0.33)).transformed(planar(0.52, 0.47, 0.7, 0.21))
    patches, obstacles = patches_of(solid)
    grid = VoxelGrid((0.0, 0.0, 0.0), (20, 20, 20))
    drawn = draw_voxels(patches, np.ones(len(patches.point), np.uint8), obstacles, grid).astype(bool)
    a, b, c = (solid.vertices[solid.triangles[:, k]] for k in range(3))
    share = np.random.default_rng(0).dirichlet((1, 1, 1), (4000, len(a)))
    points = (share[..., None] * np.stack([a, b, c], axis=1)).sum(axis=2).reshape(-1, 3)
    index, _ = grid.index(points)
    counts = np.zeros(grid.shape)
    np.add.at(counts, tuple(index.T), 1)
    assert not counts[~drawn].sum() > 0.005 * len(points)  # corners that stick into a voxel by less than a centimetre
    assert (counts[drawn] > 0).mean() > 0.99


def test_bits_of_several_surfaces_are_kept() -> None:
    patches, obstacles = patches_of(span((1, 1, 0.4), (2, 2, 0.45)), span((1.5, 1, 0.7), (2.5, 2, 0.75)))
    bits = np.where(patches.owner == 0, 2, 4).astype(np.uint8) * patches.faces_up
    drawn = draw_plan(patches, bits, obstacles, ORIGIN, SHAPE, 0.05)
    assert (drawn[20:30, 20:40] == 2).all()
    assert (drawn[30:40, 20:40] == 6).all()
    assert (drawn[40:50, 20:40] == 4).all()
    assert np.count_nonzero(drawn) == 30 * 20
