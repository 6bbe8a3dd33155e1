"""What hands reach, against lines that are walked through millimetre by millimetre."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from hsbench.geometry.convex import box, cylinder
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.truth.affordance import AffordanceScene, afford
from hsbench.truth.walkable import connected_to_doors, walk_map
from tests.unit.synth.living_rooms import chair, part, room, sofa, table

GREY = (120, 120, 120)
MARGIN_M = 2e-3
EDGE_M = 0.01
STEP_M = 2e-3


def surface_points(scene: Scene, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points within arm's reach of the floor plan, all over the furniture: points, object ids, part indices."""
    points, ids, parts = [], [], []
    for item in scene.objects:
        if item.category.group == "structure":
            continue
        for j, solid in enumerate(item.solids):
            a, b, c = (solid.vertices[solid.triangles[:, k]] for k in range(3))
            area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
            faces = rng.choice(len(area), count, p=area / area.sum())
            share = rng.dirichlet((1, 1, 1), count)
            drawn = share[:, :1] * a[faces] + share[:, 1:2] * b[faces] + share[:, 2:] * c[faces]
            depth = np.sort(drawn @ solid.planes[:, :3].T - solid.planes[:, 3], axis=1)
            drawn = drawn[depth[:, -2] < -EDGE_M]  # nearer to an edge the lines' first millimetres decide
            points.append(drawn)
            ids += [item.object_id] * len(drawn)
            parts += [j] * len(drawn)
    return np.concatenate(points), np.array(ids), np.array(parts)


def walked(scene: Scene, points: np.ndarray, ids: np.ndarray, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(surely reached, perhaps reached) by someone standing: lines from every walkable cell, point by point, against
    all hulls grown and shrunk by a margin; the part at the end counts but for its last bit.
    """
    walk = walk_map(scene)
    cells = walk.centres()[connected_to_doors(walk, scene)]
    shoulders = np.column_stack([cells, np.full(len(cells), 1.4)])
    hulls = [
        (item.object_id, j, ConvexHull(solid.vertices).equations)
        for item in scene.objects
        for j, solid in enumerate(item.solids)
    ]
    surely, perhaps = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    for k, point in enumerate(points):
        away = np.linalg.norm(shoulders - point, axis=1)
        for shoulder in shoulders[away <= 0.75][np.argsort(away[away <= 0.75])]:
            length = np.linalg.norm(shoulder - point)
            t = np.arange(0.004, length, STEP_M) / length
            line = point + t[:, None] * (shoulder - point)
            depth = np.full(len(line), np.inf)  # outside of the nearest solid, negative inside
            for object_id, j, equations in hulls:
                outside = (line @ equations[:, :3].T + equations[:, 3]).max(axis=1)
                if (object_id, j) == (ids[k], parts[k]):
                    outside = np.where(t * length < 0.01, np.where(outside > 0, np.inf, outside), outside)
                depth = np.minimum(depth, outside)
            surely[k] |= bool((depth > MARGIN_M).all())
            perhaps[k] |= bool((depth > -MARGIN_M).all())
            if surely[k]:
                break
    return surely, perhaps


def cluttered(seed: int) -> Scene:
    rng = np.random.default_rng(seed)
    things = [table(10, 1.6, 1.9, rng.uniform(0, 3))]
    for k in range(8):
        size = rng.uniform(0.05, 0.6, 3)
        solid = box(size) if k % 2 else cylinder(size[0] / 2, -size[2] / 2, size[2] / 2, sides=9)
        pose = planar(*rng.uniform(0.6, 2.4, 2), rng.uniform(0, 6), rng.uniform(0.3, 1.8))
        things.append(SceneObject(20 + k, "sideboard", pose, (Part("body", GREY, solid=solid),)))
    return room(3, 3, *things)


@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_lines_walked_point_by_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = cluttered(seed)
    points, ids, parts = surface_points(scene, 12, rng)
    found = afford(scene).reaches(points, ids, parts)
    surely, perhaps = walked(scene, points, ids, parts)
    assert found[surely].all()
    assert not found[~perhaps].any()
    assert (surely != perhaps).mean() < 0.2
    assert 0.1 < found.mean() < 0.9


def reached_handle(scene: Scene) -> bool:
    found = afford(scene)
    item = scene.objects[-1]
    points = np.concatenate([s.vertices.mean(axis=0, keepdims=True) for s in item.solids])
    points[:, 1] = item.vertices[:, 1].min()  # the middle of the front, -y
    return bool(found.reaches(points, np.full(len(points), item.object_id), np.arange(len(points))).any())


def knob(x: float, y: float, z: float) -> SceneObject:
    return SceneObject(
        99, "wardrobe", planar(x, y, 0), (part("knob", (-0.02, 0, z - 0.02), (0.02, 0.02, z), "handle"),)
    )


@pytest.mark.parametrize(("z", "reached"), [(2.08, True), (2.14, False), (0.73, True), (0.68, False)])
def test_arm_length_up_and_down(z: float, reached: bool) -> None:
    # At y = 3.98: the nearest who stand there are at y = 3.725, .025 m aside, so the hand comes .705 m up and down.
    assert reached_handle(room(4, 4, knob(2.0, 3.98, z))) == reached


def test_a_handle_behind_a_sofa_is_out_of_reach() -> None:
    low, high = knob(2.0, 3.98, 0.73), knob(2.0, 3.98, 0.9)
    assert reached_handle(room(4, 4, low))
    assert not reached_handle(room(4, 4, sofa(10, 2.0, 3.5, 0.0), low))
    assert reached_handle(room(4, 4, sofa(10, 2.0, 3.5, 0.0), high))  # over the back, by who sits there


def test_a_screen_of_glass_is_reached_around_not_through() -> None:
    far, near = (part("pane", (-0.5, -0.01, 0.6), (w, 0.01, 1.7)) for w in (0.5, 0.1))
    wide = SceneObject(10, "shelf", planar(2.0, 3.9, 0.0), (far,))
    narrow = SceneObject(10, "shelf", planar(2.0, 3.9, 0.0), (near,))
    assert not reached_handle(room(4, 4, wide, knob(2.0, 3.98, 1.2)))
    assert reached_handle(room(4, 4, narrow, knob(2.0, 3.98, 1.2)))


def high_point(found: AffordanceScene, y: float) -> bool:
    return bool(found.reaches(np.array([[2.0, y, 0.74]]), np.array([10]), np.array([0]))[0])


def test_who_sits_reaches_farther_over_the_table() -> None:
    # The table's edge is at y = 1.6; standing .25 m before it, a hand comes .106 m in; shoulders that sit are at 1.0 m.
    alone, with_chair = (
        afford(room(4, 4, table(10, 2, 1.2, 0))),
        afford(room(4, 4, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0))),
    )
    assert high_point(alone, 1.52)
    assert not high_point(alone, 1.3)
    for y in (1.55, 1.3, 1.15):
        assert high_point(with_chair, y)
    # Seated with the patch's middle at most 1.835: sqrt(.75^2 - .26^2) = .703 m on.
    assert not high_point(with_chair, 1.05)


def test_nobody_reaches_through_the_back_of_the_own_chair() -> None:
    """Someone pulled out from the table does not touch, through the back, what stands behind."""
    high_back = chair(11, 2, 1.64, 0)
    back = part("back", (-0.3, 0.19, 0.45), (0.3, 0.22, 1.8))
    high_back = SceneObject(11, "chair", high_back.scene_T_object, (high_back.parts[0], back), movable=True)
    post = SceneObject(
        20, "wardrobe", planar(2, 2.35, 0), (part("knob", (-0.02, 0, 0.98), (0.02, 0.02, 1.02), "handle"),)
    )

    def touched(item: SceneObject) -> bool:
        # Bars keep all others from standing near.
        bars = [
            SceneObject(30 + k, "sideboard", np.eye(4), (part("bar", low, high),))
            for k, (low, high) in enumerate(
                [((1.0, 2.15, 0.03), (3.0, 2.17, 0.05)), ((1.0, 2.6, 0.03), (3.0, 2.62, 0.05)),
                 ((1.0, 3.0, 0.03), (3.0, 3.02, 0.05))]
            )
        ]  # fmt: skip
        scene = room(4, 4, table(10, 2, 1.2, 0), item, post, *bars)
        point, number, index = np.array([[2.0, 2.35, 1.0]]), np.array([20]), np.array([0])
        return bool(afford(scene).reaches(point, number, index)[0])

    assert touched(chair(11, 2, 1.64, 0))
    assert not touched(high_back)
