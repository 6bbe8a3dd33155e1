"""Affordance of meshes: a mesh of convex parts has the labels of the parts; other meshes by hand."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely

from hsbench.geometry.convex import span
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.schema.states import Affordance
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.truth.affordance import afford, part_affordances, top_down
from hsbench.truth.obstacles import pack_obstacles
from hsbench.truth.sittable import seat_uses
from hsbench.truth.tops import surfaces
from hsbench.truth.usability import uses
from hsbench.truth.validity import faults
from hsbench.truth.walkable import walk_map
from tests.unit.geometry.meshes import Mesh, joined, of
from tests.unit.synth.living_rooms import bed, chair, part, room, sofa, table, wardrobe
from tests.unit.truth.test_meshes import as_meshes

GREY = (120, 120, 120)
CELL_M = 0.05
TURN = planar(0.3, -0.2, 0.37)


def plans(*scenes: Scene) -> list[np.ndarray]:
    """(nx, ny) labels of each scene on one grid that holds the first."""
    corners = np.concatenate([o.vertices for o in scenes[0].objects])[:, :2]
    low = corners.min(axis=0) - CELL_M
    shape = tuple((np.ceil((corners.max(axis=0) + CELL_M - low) / CELL_M)).astype(int).tolist())
    return [top_down(afford(scene), low, shape) for scene in scenes]


def share_alike(a: np.ndarray, b: np.ndarray, kind: Affordance) -> float:
    """IoU of the cells with a label."""
    x, y = (plan >> kind & 1 == 1 for plan in (a, b))
    return float((x & y).sum() / max(1, (x | y).sum()))


def mesh_object(number: int, kind: str, pose: np.ndarray, role: str | None, mesh: Mesh, **more: bool) -> SceneObject:
    return SceneObject(number, kind, pose, (Part("mesh", GREY, role, mesh=mesh),), **more)


def prism(outline: np.ndarray, low: float, high: float) -> Mesh:
    """A closed mesh over any simple counter-clockwise outline (n, 2), along z."""
    n = len(outline)
    vertices = np.concatenate([np.column_stack([outline, np.full(n, z)]) for z in (low, high)])
    triangles = shapely.constrained_delaunay_triangles(shapely.Polygon(outline))
    index = {tuple(xy): k for k, xy in enumerate(outline.tolist())}
    flat = [[index[xy] for xy in shapely.geometry.polygon.orient(t).exterior.coords[:3]] for t in triangles.geoms]
    sides = [[[k, (k + 1) % n, n + (k + 1) % n], [k, n + (k + 1) % n, n + k]] for k in range(n)]
    faces = [*(t[::-1] for t in flat), *([n + k for k in t] for t in flat), *(t for pair in sides for t in pair)]
    return vertices, np.array(faces, dtype=np.int32)


def along_x(mesh: Mesh) -> Mesh:
    """A prism drawn in y and z, laid along x: z becomes x, x becomes y, y becomes z."""
    return np.ascontiguousarray(mesh[0][:, [2, 0, 1]]), mesh[1]


def easy_chair(width: float, seat: float = 0.45) -> Mesh:
    """One closed piece, no part of it convex by itself: seat .6 m deep, a back .2 m thick behind it, 1 m high."""
    profile = np.array([[-0.4, 0.0], [0.4, 0.0], [0.4, 1.0], [0.2, 1.0], [0.2, seat], [-0.4, seat]])
    return along_x(prism(profile, -width / 2, width / 2))


def labelled(scene: Scene, kind: Affordance) -> set[int]:
    found = part_affordances(afford(scene))
    return set(found.object_id[found.labels >> kind & 1 == 1].tolist())


@pytest.mark.parametrize("number", [1, 6])
def test_a_generated_room_of_meshes_has_the_labels_of_its_solids(number: int) -> None:
    """Welding orders corners anew, which moves patches on round faces: a cell in a thousand may differ."""
    scene = build_scene("x", Seeds(0).child(number), RoomConfig(), COMMON_FAMILIES).moved(TURN)
    meshes = as_meshes(scene)
    solid, mesh = plans(scene, meshes)
    assert (solid != mesh).mean() <= 1e-3
    for kind in (Affordance.WALKABLE, Affordance.SITTABLE, Affordance.LYABLE):
        assert share_alike(solid, mesh, kind) == 1.0 or not (solid >> kind & 1).any()
    ours, theirs = part_affordances(afford(scene)).labels, part_affordances(afford(meshes)).labels
    assert (ours != theirs).mean() <= 0.01


def test_meshes_can_be_judged_and_used() -> None:
    scene = as_meshes(
        room(5, 5, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0), bed(12, 4, 3.5, 0), wardrobe(13, 1, 4.6, 0))
    )
    solid = room(5, 5, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0), bed(12, 4, 3.5, 0), wardrobe(13, 1, 4.6, 0))
    assert uses(scene) == uses(solid)
    assert faults(scene).floating == ("bed 12 floats at z = 0.100 m",)
    assert faults(scene).blocked_doors == faults(solid).blocked_doors
    hung = dataclasses.replace(scene.object(11), scene_T_object=planar(3.5, 1.5, 0, 0.3))
    objects = tuple(hung if o.object_id == 11 else o for o in scene.objects)
    assert "chair 11 floats at z = 0.300 m" in faults(dataclasses.replace(scene, objects=objects)).floating


def bottomless(scene: Scene) -> Scene:
    """Every part of furniture a mesh whose lower side is missing: nothing is closed."""

    def opened(part: Part) -> Part:
        vertices, triangles = np.array(part.vertices), np.array(part.triangles)
        upward = np.cross(*(vertices[triangles[:, k]] - vertices[triangles[:, 0]] for k in (1, 2)))[:, 2] >= -1e-9
        return dataclasses.replace(part, solid=None, mesh=(vertices, np.ascontiguousarray(triangles[upward])))

    objects = tuple(
        o if o.category.group == "structure" else dataclasses.replace(o, parts=tuple(map(opened, o.parts)))
        for o in scene.objects
    )
    return dataclasses.replace(scene, objects=objects)


def test_open_meshes_have_nearly_the_labels_of_solids() -> None:
    """Triangles are cut into other patches than faces, which are judged at other points."""
    things = (table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0), sofa(12, 3, 3.8, 0.1), wardrobe(13, 0.7, 4.6, 0))
    scene = room(5, 5, *things, bed(14, 4.1, 1.4, 0)).moved(TURN)
    solid, mesh = plans(scene, bottomless(scene))
    for kind, least in {
        Affordance.WALKABLE: 1.0,
        Affordance.SITTABLE: 0.97,
        Affordance.LYABLE: 0.97,
        Affordance.INTERACTABLE: 0.9,
        Affordance.REACHABLE: 0.9,
        Affordance.SUPPORTABLE: 0.9,
    }.items():
        assert share_alike(solid, mesh, kind) >= least, kind.name


@pytest.mark.parametrize(("width", "lies"), [(0.5, False), (1.8, True)])
def test_the_seat_of_a_single_closed_mesh_is_sat_upon_not_its_back(width: float, lies: bool) -> None:
    scene = room(5, 5, mesh_object(10, "sofa", planar(2.5, 2.5, 0.0), "seat", easy_chair(width)))
    (plan,) = plans(scene)
    area = (plan >> Affordance.SITTABLE & 1).sum() * CELL_M**2
    assert area == pytest.approx(width * 0.6, abs=2 * (width + 0.6) * CELL_M / 2)
    assert labelled(scene, Affordance.LYABLE) == ({10} if lies else set())
    (plan,) = plans(room(5, 5, mesh_object(10, "sofa", planar(2.5, 2.5, 0.0), "seat", easy_chair(0.33))))
    assert not (plan >> Affordance.SITTABLE & 1).any()


def test_one_sits_facing_the_front_of_a_mesh_at_its_edge() -> None:
    scene = room(5, 5, mesh_object(10, "sofa", planar(2.5, 2.5, 0.0), "seat", easy_chair(0.8))).moved(TURN)
    (use,) = seat_uses(scene, walk_map(scene), pack_obstacles(scene))
    assert use.height_m == pytest.approx(0.45)
    assert np.allclose(use.front_xy, TURN[:2, :2] @ [0.0, -1.0])
    local = (use.centres_xy - TURN[:2, 3]) @ TURN[:2, :2] - 2.5
    assert local[:, 1].min() == pytest.approx(-0.4 + 0.175, abs=0.006)
    assert np.ptp(local[:, 0]) == pytest.approx(0.8 - 0.35, abs=0.02)


def test_a_movable_mesh_is_pulled_out_as_far_as_its_solids() -> None:
    pushed_in = chair(11, 2, 1.64, 0)
    one = mesh_object(
        11,
        "chair",
        pushed_in.scene_T_object,
        "seat",
        joined(*(of(p.solid) for p in pushed_in.parts if p.solid)),
        movable=True,
    )
    pulls = []
    for seat in (pushed_in, one):
        scene = room(4, 4, table(10, 2, 1.2, 0), seat)
        (use,) = seat_uses(scene, walk_map(scene), pack_obstacles(scene))
        pulls.append(use.pull_m)
    assert pulls[0] == pytest.approx(pulls[1], abs=0.0101)
    behind = SceneObject(12, "sideboard", np.eye(4), (part("bar", (0.9, 1.9, 0), (3.1, 1.95, 1.0)),))
    assert not labelled(room(4, 4, table(10, 2, 1.2, 0), one, behind), Affordance.SITTABLE)


def test_surfaces_of_a_corner_sofa_follow_its_outline() -> None:
    outline = np.array([[0, 0], [2, 0], [2, 0.7], [0.7, 0.7], [0.7, 2], [0, 2]], dtype=float) - 1.0
    item = mesh_object(10, "sofa", planar(2.5, 2.5, 0.6), "seat", prism(outline, 0.0, 0.42))
    scene = room(5, 5, item)
    (surface,) = surfaces(item, scene.objects.index(item), 0, pack_obstacles(scene))
    assert surface.height_m == 0.42
    covered = shapely.union_all([shapely.Polygon(o) for o in surface.outlines])
    exact = shapely.Polygon(outline @ item.scene_T_object[:2, :2].T + 2.5)
    assert covered.symmetric_difference(exact).area < 0.01 * exact.area
    inside = exact.buffer(-0.17)
    (use,) = seat_uses(scene, walk_map(scene), pack_obstacles(scene))
    assert shapely.contains_xy(inside, *use.centres_xy.T).all()


def test_legs_are_not_put_into_a_closed_mesh() -> None:
    """The block before the seat is one closed piece that is not convex, and flush with it: no triangle is entered."""
    outline = np.array([[-0.5, -1.4], [0.5, -1.4], [0.5, -0.4], [0.1, -0.4], [0.0, -0.401], [-0.1, -0.4], [-0.5, -0.4]])
    chair_ = mesh_object(10, "sofa", planar(2.5, 3.0, 0.0), "seat", easy_chair(0.5))
    block = mesh_object(11, "object", planar(2.5, 3.0, 0.0), None, prism(outline, 0.0, 0.45))
    assert labelled(room(5, 5, chair_), Affordance.SITTABLE) == {10}
    assert not labelled(room(5, 5, chair_, block), Affordance.SITTABLE)


def wavy(side: float, cells: int, height: float, wave: float) -> Mesh:
    """An open sheet of many small triangles, its corners up and down by ``wave``."""
    x = np.linspace(-side / 2, side / 2, cells + 1)
    grid = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    z = height + wave * np.where(np.arange(len(grid)) % 3 == 0, 1.0, -1.0)
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    b, c, d = a + cells + 1, a + cells + 2, a + 1
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.column_stack([grid, z]), faces.astype(np.int32)


def test_a_top_of_small_uneven_triangles_carries_and_serves_like_a_board() -> None:
    board = SceneObject(
        10, "dining_table", planar(2, 2, 0.2), (part("top", (-0.4, -0.4, 0.89), (0.4, 0.4, 0.9), "top"),)
    )
    sheet = mesh_object(10, "dining_table", planar(2, 2, 0.2), "top", wavy(0.8, 40, 0.9, 0.0005))
    solid, mesh = plans(room(4, 4, board), room(4, 4, sheet))
    assert share_alike(solid, mesh, Affordance.SUPPORTABLE) > 0.97
    assert share_alike(solid, mesh, Affordance.INTERACTABLE) > 0.97


def test_a_sheet_hides_what_is_behind_it() -> None:
    switch = SceneObject(
        10, "floor_lamp", planar(2, 3.9, 0), (part("switch", (-0.01, 0, 1.1), (0.01, 0.02, 1.12), "switch"),)
    )
    corners = np.array([[-1.0, 0, 0], [1, 0, 0], [1, 0, 2.2], [-1, 0, 2.2]])
    sheet = (corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))
    assert 10 in labelled(room(4, 4, switch), Affordance.INTERACTABLE)
    assert 10 not in labelled(
        room(4, 4, switch, mesh_object(11, "curtain", planar(2, 3.8, 0), None, sheet)), Affordance.INTERACTABLE
    )


@pytest.mark.parametrize(("gap", "opens"), [(0.29, False), (0.31, True)])
def test_a_drawer_of_triangles_opens_with_room_in_front(gap: float, opens: bool) -> None:
    vertices, triangles = of(span((-0.4, -0.32, 1.05), (0.4, -0.3, 1.25)))
    drawer = Part("drawer", GREY, "drawer", mesh=(vertices, triangles[:-1]))
    dresser = SceneObject(10, "dresser", planar(2, 3.7, 0), (part("body", (-0.4, -0.3, 0), (0.4, 0.3, 1.3)), drawer))
    bar = SceneObject(11, "dining_table", np.eye(4), (part("slab", (1.0, 3.37 - gap, 1.1), (3.0, 3.38 - gap, 1.12)),))
    assert (labelled(room(4, 4, dresser, bar), Affordance.OPENABLE) == {10}) == opens
