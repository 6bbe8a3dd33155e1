"""The plan: what is drawn where. Shapes are judged in metres, then the two ways of putting them down."""

from __future__ import annotations

import dataclasses
import math
import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from hsbench.geometry.convex import span
from hsbench.geometry.polygons import contains
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.viz.plan import FLOOR, PAPER, WALL, plan_drawing, plan_image, plan_svg
from hsbench.viz.plan_canvas import Drawing, Label, Shape, raster, svg
from hsbench.viz.plan_outlines import part_outlines, slice_segments
from tests.unit.geometry.meshes import joined, of, torus

GREY = (120, 120, 120)
SVG = "{http://www.w3.org/2000/svg}"


def part(name: str, low: tuple, high: tuple, role: str | None = None) -> Part:
    return Part(name, GREY, role, span(low, high))


def home(yaw: float = 0.0, leaf_open: float = 0.0, name: str = "home-1") -> Scene:
    """Two rooms with a wall of three pieces between them: a door with frame and handle, above it a lintel."""
    hinge = -0.4
    leaf = SceneObject(1, "door", planar(hinge, 0, leaf_open), (part("leaf", (0, 0, 0), (0.8, 0.04, 2.0), "door"),))
    turned = leaf.parts[0].solid.transformed(leaf.scene_T_object)
    grip = span((0.7, -0.05, 1.0), (0.75, 0.0, 1.05)).transformed(leaf.scene_T_object)
    door = SceneObject(
        5, "door", planar(3.05, 1.5, math.pi / 2),
        (
            part("jamb", (-0.44, 0, 0), (-0.4, 0.1, 2.05)), part("jamb_2", (0.4, 0, 0), (0.44, 0.1, 2.05)),
            part("head", (-0.4, 0, 2.01), (0.4, 0.1, 2.05)),
            Part("door", GREY, "door", turned), Part("handle", GREY, "handle", grip),
        ),
    )  # fmt: skip
    wall = (
        part("south", (2.95, 0, 0), (3.05, 1.06, 2.5)), part("north", (2.95, 1.94, 0), (3.05, 3, 2.5)),
        part("lintel", (2.95, 1.06, 2.05), (3.05, 1.94, 2.5)),
    )  # fmt: skip
    objects = (
        SceneObject(1, "floor", np.eye(4), (part("floor", (0, 0, -0.1), (6, 3, 0)),)),
        SceneObject(2, "wall", np.eye(4), wall),
        door,
        SceneObject(6, "window", planar(1, 3, 0), (part("pane", (-0.5, 0, 1), (0.5, 0.1, 2.0)),)),
        SceneObject(7, "sofa", planar(1, 0.6, 0.3), (part("seat", (-0.9, -0.4, 0), (0.9, 0.4, 0.4), "seat"),)),
        SceneObject(8, "wall_cabinet", planar(5.5, 2.8, 0), (part("body", (-0.4, -0.15, 1.5), (0.4, 0.15, 2.1)),)),
        SceneObject(9, "waste_bin", planar(4.0, 0.5, 0), (part("bin", (-0.04, -0.04, 0), (0.04, 0.04, 0.3)),)),
    )
    rooms = (
        Room("living", np.array([[0.0, 0], [2.95, 0], [2.95, 3], [0, 3]])),
        Room("bedroom", np.array([[3.05, 0.0], [6, 0], [6, 3], [3.05, 3]])),
    )
    scene = Scene(name, rooms, 2.5, objects)
    return scene.moved(planar(2.0, -1.0, yaw)) if yaw else scene


def shapes_of(drawing: Drawing, **wanted: object) -> list[Shape]:
    return [s for s in drawing.shapes if all(getattr(s, key) == value for key, value in wanted.items())]


def words(drawing: Drawing) -> list[str]:
    return [" ".join(label.lines) for label in drawing.labels]


def covered(shapes: list[Shape], x: float, y: float) -> bool:
    return any(bool(contains(s.points, np.array([x, y]))) for s in shapes)


def test_walls_are_what_the_cut_meets() -> None:
    walls = shapes_of(plan_drawing(home()), fill=WALL)
    assert covered(walls, 3.0, 0.5)
    assert covered(walls, 3.0, 2.5)
    assert not covered(walls, 3.0, 1.5)  # the lintel is above
    assert not covered(walls, 1.0, 1.5)


def test_a_closed_door_swings_into_its_room_from_the_side_away_from_its_handle() -> None:
    drawing = plan_drawing(home())
    (arc,) = [s for s in drawing.shapes if not s.closed and len(s.points) > 10]
    hinge, tip = np.array([3.05, 1.1]), np.array([3.05, 1.9])
    middle = hinge + np.array([0.0, 0.0])
    radii = np.linalg.norm(arc.points - middle, axis=1)
    assert radii == pytest.approx(np.full(len(radii), 0.8), abs=0.05)
    assert np.linalg.norm(arc.points[0] - tip) < 0.1
    assert abs(arc.points[-1][0] - hinge[0]) == pytest.approx(0.8, abs=0.05)
    gaps = [s for s in shapes_of(drawing, fill=FLOOR) if np.ptp(s.points[:, 0]) < 0.5]
    assert covered(gaps, 3.0, 1.5)


@pytest.mark.parametrize("angle", [0.6, 1.5])
def test_an_open_leaf_is_drawn_where_it_is(angle: float) -> None:
    scene = home(leaf_open=-angle)
    drawing = plan_drawing(scene)
    (arc,) = [s for s in drawing.shapes if not s.closed and len(s.points) > 10]
    swept = math.acos(float((arc.points[0] - [3.05, 1.1]) @ (arc.points[-1] - [3.05, 1.1])) / 0.8**2)
    assert swept == pytest.approx(angle, abs=0.08)
    leaf = next(p for p in scene.object(5).parts if p.role == "door")
    corners = leaf.solid.transformed(scene.object(5).scene_T_object).vertices[:, :2].mean(axis=0)
    assert covered(shapes_of(drawing, fill=PAPER), *corners)


def test_windows_are_gaps_with_a_pane() -> None:
    drawing = plan_drawing(home())
    assert covered(shapes_of(drawing, fill=PAPER), 1.0, 3.05)
    high = dataclasses.replace(home().object(6), parts=(part("pane", (-0.5, 0, 1.8), (0.5, 0.1, 2.2)),))
    scene = home()
    objects = tuple(high if o.object_id == 6 else o for o in scene.objects)
    over = plan_drawing(dataclasses.replace(scene, objects=objects))
    assert not covered(shapes_of(over, fill=PAPER), 1.0, 3.05)
    assert covered(shapes_of(over, dashed=True), 1.0, 3.05)


def test_furniture_shows_its_outline_and_what_hangs_above_is_dashed() -> None:
    drawing = plan_drawing(home())
    sofa = home().object(7).vertices[:, :2]
    assert any(
        s.points.shape == (4, 2)
        and np.allclose(np.sort(s.points, axis=0), np.sort(np.unique(sofa.round(9), axis=0), axis=0))
        for s in drawing.shapes
    )
    assert covered(shapes_of(drawing, dashed=True, fill=None), 5.5, 2.8)


def test_what_has_no_room_for_its_name_gets_a_number_and_a_legend() -> None:
    said = words(plan_drawing(home()))
    assert {"sofa", "wall cabinet", "9", "9 waste bin"} <= set(said)
    assert "waste bin" not in said
    assert any(s.startswith("bedroom") for s in said)
    assert "home-1" in said
    assert any("2 rooms" in s for s in said)


def test_names_do_not_lie_on_each_other() -> None:
    from hsbench.viz.plan import _extent

    seat = part("seat", (-0.25, -0.25, 0), (0.25, 0.25, 0.45), "seat")
    crowd = [
        SceneObject(10 + k, "chair", planar(0.5 + 0.55 * (k % 4), 1.3 + 0.6 * (k // 4), 0), (seat,)) for k in range(8)
    ]
    scene = home()
    labels = plan_drawing(dataclasses.replace(scene, objects=(*scene.objects, *crowd))).labels
    chairs = [_extent(label) for label in labels if label.lines == ("chair",)]
    assert len(chairs) == 8
    for k, a in enumerate(chairs):
        assert all((a[0] >= b[1]).any() or (b[0] >= a[1]).any() for b in chairs[:k])


@pytest.mark.parametrize("yaw", [0.3, -0.6, 2.0])
def test_the_page_is_turned_with_the_walls(yaw: float) -> None:
    drawing = plan_drawing(home(yaw))
    floors = [s for s in shapes_of(drawing, fill=FLOOR) if len(s.points) == 4][:2]
    for shape in floors:
        sides = np.roll(shape.points, -1, axis=0) - shape.points
        assert np.abs(sides).min(axis=1).max() < 2e-3  # each runs along the page, to .01 degree
    labels = {label.lines[0]: label.at for label in drawing.labels if label.lines in (("x",), ("y",))}
    across = labels["x"] - labels["y"]
    assert np.linalg.norm(across) == pytest.approx(0.43 * math.sqrt(2), rel=1e-6)


# ---------------------------------------------------------------- outlines


def test_a_silhouette_is_that_of_the_mesh_and_not_its_hull() -> None:
    l_shape = joined(of(span((0, 0, 0), (2, 1, 1))), of(span((0, 1, 0), (1, 2, 1))))
    (outline,) = part_outlines(Part("l", GREY, mesh=l_shape), np.eye(4))
    assert len(outline) == 6
    area = abs(np.sum(outline[:, 0] * np.roll(outline[:, 1], -1) - np.roll(outline[:, 0], -1) * outline[:, 1]) / 2)
    assert area == pytest.approx(3.0, rel=0.02)
    (square,) = part_outlines(Part("b", GREY, mesh=of(span((0, 0, 0), (1, 1, 1)))), planar(3, 0, 0.7))
    assert len(square) == 4  # exact where the silhouette is convex


def test_a_cut_through_a_ring_is_two_circles() -> None:
    segments = slice_segments(*torus(0.3, 0.1, 48, 24), 0.001)
    radii = np.linalg.norm(segments.reshape(-1, 2), axis=1)
    assert len(segments) == 2 * 2 * 48
    assert set(np.round(radii, 1)) == {0.2, 0.4}
    assert len(slice_segments(*torus(), 0.5)) == 0


# ---------------------------------------------------------------- SVG and pixels


def test_the_svg_is_well_formed_and_complete() -> None:
    drawing = plan_drawing(home())
    root = ET.fromstring(plan_svg(home()))
    polygons = root.findall(f"{SVG}polygon") + root.findall(f"{SVG}polyline")
    assert len(polygons) == len(drawing.shapes)
    assert [" ".join(t.text or "" for t in text) for text in root.findall(f"{SVG}text")] == words(drawing)
    width, height = map(float, root.attrib["viewBox"].split()[2:])
    numbers = np.array([[float(v) for v in p.split(",")] for e in polygons for p in e.attrib["points"].split()])
    assert (numbers >= 0).all()
    assert (numbers <= [width, height]).all()


def test_names_are_escaped() -> None:
    evil = '</svg><script>alert("x")</script>&\x00'
    text = plan_svg(home(name=evil))
    assert "<script" not in text
    root = ET.fromstring(text)
    assert evil.replace("\x00", " ") in "".join(root.itertext())


def test_the_same_scene_gives_the_same_svg() -> None:
    assert plan_svg(home()) == plan_svg(home())


def test_pixels_show_what_the_shapes_say() -> None:
    scene = home()
    drawing, image = plan_drawing(scene), plan_image(scene, 900)
    scale = 900 / (drawing.high - drawing.low)[0]
    assert image.shape == (round(scale * (drawing.high - drawing.low)[1]), 900, 3)
    assert image.dtype == np.uint8

    def pixel(x: float, y: float) -> tuple[int, ...]:
        column, row = (np.array([x, drawing.high[1]]) - [drawing.low[0], y]) * scale
        return tuple(int(v) for v in image[int(row), int(column)])

    assert pixel(3.0, 0.3) == tuple(int(WALL[k : k + 2], 16) for k in (1, 3, 5))
    assert pixel(2.0, 2.0) == tuple(int(FLOOR[k : k + 2], 16) for k in (1, 3, 5))
    assert pixel(-0.3, 1.5) == (255, 255, 255)


def test_dashes_cover_their_share_of_a_line() -> None:
    line = np.array([[0.2, 0.5], [1.8, 0.5]])
    page = Drawing(
        np.zeros(2),
        np.array([2.0, 1.0]),
        (Shape(line, stroke="#000000", width_m=0.004, dashed=True, closed=False),),
        (),
        "",
    )
    dark = (raster(page, 800)[:, :, 0] < 128).any(axis=0)
    assert dark.sum() / 800 * 2 == pytest.approx(1.6 * 0.054 / 0.085, rel=0.08)  # ends are round
    whole = dataclasses.replace(page, shapes=(dataclasses.replace(page.shapes[0], dashed=False),))
    assert (raster(whole, 800)[:, :, 0] < 128).any(axis=0).sum() / 800 * 2 == pytest.approx(1.6, rel=0.03)
    assert "stroke-dasharray" in svg(page)


@pytest.mark.parametrize("angle", [0.0, 90.0])
def test_a_label_stands_about_its_point(angle: float) -> None:
    label = Label(np.array([1.0, 0.5]), ("Mmmm", "mmmm"), 0.2, "#000000", angle)
    page = Drawing(np.zeros(2), np.array([2.0, 1.0]), (), (label,), "")
    rows, columns = np.nonzero(raster(page, 800)[:, :, 0] < 128)
    assert columns.mean() / 400 == pytest.approx(1.0, abs=0.05)
    assert rows.mean() / 400 == pytest.approx(0.5, abs=0.05)
    tall = np.ptp(rows) > np.ptp(columns)
    assert tall == (angle == 90.0)
    assert bool(re.search("rotate", svg(page))) == (angle == 90.0)
