"""Floor plan of a scene, as an architect draws it: cut at 1.4 m, seen from above. SVG text, or pixels.

What is drawn is decided once (``plan_drawing``), as shapes in metres on a page with x to the right and y up;
``plan_svg`` and ``plan_image`` only put it down. The page is turned so that the walls run along its edges; arrows in
the corner show the frame of the scene. Walls are what the cut meets; a leaf is drawn open, with the arc it swings
along, from the side away from its handle; furniture shows the outlines of its parts, dashed if it hangs above the cut.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from hsbench.geometry.footprints import hull, smallest_yaw
from hsbench.geometry.polygons import contains, signed_area
from hsbench.geometry.transforms import apply, planar
from hsbench.schema.categories import Category
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.typing import FloatArray, UInt8Array
from hsbench.viz.plan_canvas import Drawing, Label, Shape, raster, svg
from hsbench.viz.plan_outlines import part_outlines, slice_segments

CUT_M = 1.4  # doors and windows show, cupboards on the wall hang above
PAPER, FLOOR, INK, WALL, FAINT = "#ffffff", "#faf6ef", "#33363b", "#3d4147", "#8b9097"
HAIR_M, THIN_M, LINE_M, SHEET_M = 0.006, 0.012, 0.02, 0.04
DARKER = 0.62  # of a fill, for its outline
MARGIN_M, HEAD_M = 0.55, 0.55
SMALLEST_M2 = 5e-4  # handles and the like are left out
TEXT_M = (0.15, 0.12, 0.1, 0.085, 0.07)
"""Heights of letters that are tried until a name fits."""
LETTER = 0.56  # mean width of a letter over its height
OVERHANG_M = 0.02  # a name may stick out of its object so far
LINE = 1.15  # distance of lines over the height of letters
PLACES_ON = (
    (0.0, 0.0),
    (0.0, 0.25),
    (0.0, -0.25),
    (0.25, 0.0),
    (-0.25, 0.0),
    (0.0, 0.38),
    (0.0, -0.38),
    (0.38, 0.0),
    (-0.38, 0.0),
)
"""Where on an object its name is tried, in shares of its size."""
ARC_STEPS = 24
JAMB_M = 0.04  # of the frame, on either side of a leaf
CLOSED = 0.99  # cosine up to which a leaf counts as closed: 8 degrees
PLACES = 25  # along each side of a room where its name is tried
WINDOW_M = 0.08  # a window of a single sheet is drawn so deep

TINTS = (
    (("mattress",), "#dcd6ee"), (("seat",), "#f4ddb8"), (("tap", "front"), "#cfe3ee"),
    (("shelf", "door", "drawer"), "#d5e2d5"), (("top",), "#ead9c3"), (("screen", "board"), "#d8dbe0"),
)  # fmt: skip
"""Fill of furniture by what it is for: the first line of which a role belongs to its category."""
GROUP_TINTS = {"soft": "#f3ece2", "clutter": "#f7f4ee"}
NAMED_TINTS = {"plant": "#cfe6c3"}
OTHER_TINT = "#e4e4e2"


def plan_svg(scene: Scene) -> str:
    """The plan as an SVG document."""
    return svg(plan_drawing(scene))


def plan_image(scene: Scene, width_px: int) -> UInt8Array:
    """The plan as (h, width_px, 3) uint8 rgb, as high as it must be."""
    return raster(plan_drawing(scene), width_px)


def plan_drawing(scene: Scene) -> Drawing:
    """Everything on the page, in the order in which it is put down."""
    outlines = np.concatenate([room.outline_xy for room in scene.rooms])
    turn = -smallest_yaw(outlines, 0.0)
    scene = scene.moved(planar(0.0, 0.0, turn))
    shapes = [Shape(room.outline_xy, fill=FLOOR) for room in scene.rooms]
    labels: list[Label] = []
    furniture = [item for item in scene.objects if item.category.group != "structure"]
    for item in sorted(furniture, key=_top):
        shapes += _furniture(item)
    shapes += [shape for item in scene.objects if item.category_name == "wall" for shape in _wall(item)]
    shapes += [Shape(room.outline_xy, stroke=WALL, width_m=THIN_M) for room in scene.rooms]
    for item in scene.objects:
        shapes += _opening(item, scene)
    legend = _name_furniture(furniture, labels)
    _name_rooms(scene, furniture, labels)
    return _page(scene, shapes, labels, legend, turn)


# ---------------------------------------------------------------- furniture


def _top(item: SceneObject) -> float:
    return float(item.vertices[:, 2].max())


def _tint(category: Category) -> str:
    if category.name in NAMED_TINTS:
        return NAMED_TINTS[category.name]
    if category.group in GROUP_TINTS:
        return GROUP_TINTS[category.group]
    return next((tint for roles, tint in TINTS if set(roles) & set(category.roles)), OTHER_TINT)


def _darker(colour: str) -> str:
    return "#" + "".join(f"{round(int(colour[k : k + 2], 16) * DARKER):02x}" for k in (1, 3, 5))


def _furniture(item: SceneObject) -> list[Shape]:
    """Outlines of the parts, low ones first; of things above the cut only dashed lines."""
    above = bool(item.vertices[:, 2].min() > CUT_M)
    tint = _tint(item.category)
    shapes = []
    for part in sorted(item.parts, key=lambda part: float(apply(item.scene_T_object, part.vertices)[:, 2].max())):
        for outline in part_outlines(part, item.scene_T_object):
            if abs(signed_area(outline)) >= SMALLEST_M2:
                line = FAINT if above else _darker(tint)
                shapes.append(Shape(outline, None if above else tint, line, HAIR_M, dashed=above))
    return shapes


# ---------------------------------------------------------------- walls and what is in them


def _wall(item: SceneObject) -> list[Shape]:
    """What the cut meets: convex parts filled, sheets and meshes as lines."""
    shapes = []
    for part in item.parts:
        vertices = apply(item.scene_T_object, part.vertices)
        if part.solid is not None:
            outline = hull(slice_segments(vertices, part.triangles, CUT_M).reshape(-1, 2))
            if len(outline) >= 3:
                shapes.append(Shape(outline, fill=WALL, stroke=WALL, width_m=THIN_M))  # no light between pieces
        else:
            segments = slice_segments(vertices, part.triangles, CUT_M)
            shapes += [Shape(segment, stroke=WALL, width_m=SHEET_M, closed=False) for segment in segments]
    return shapes


def _opening(item: SceneObject, scene: Scene) -> list[Shape]:
    if item.category_name == "window":
        return _window(item)
    if item.category_name == "passage":
        return _passage(item)
    return _door(item, scene) if item.category_name == "door" else []


def _rectangle(points_xy: FloatArray, yaw: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(middle (2,), half the longer side as a vector, half the shorter) of the rectangle at a yaw around points."""
    along = np.array([math.cos(yaw), math.sin(yaw)])
    across = np.array([-along[1], along[0]])
    local = np.column_stack([points_xy @ along, points_xy @ across])
    low, high = local.min(axis=0), local.max(axis=0)
    middle = ((low + high) / 2) @ np.stack([along, across])
    first, second = along * (high[0] - low[0]) / 2, across * (high[1] - low[1]) / 2
    return (middle, first, second) if high[0] - low[0] >= high[1] - low[1] else (middle, second, -first)


def _corners(middle: FloatArray, along: FloatArray, across: FloatArray) -> FloatArray:
    return np.array(
        [middle - along - across, middle + along - across, middle + along + across, middle - along + across]
    )


def _deep(across: FloatArray, along: FloatArray, least_m: float) -> FloatArray:
    """``across``, lengthened to half of ``least_m``."""
    unit = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-9)
    return across if np.linalg.norm(across) >= least_m / 2 else unit * least_m / 2


def _window(item: SceneObject) -> list[Shape]:
    """A white gap with a line for the pane; dashed where the cut misses it."""
    points, met = _at_cut(item)
    middle, along, across = _rectangle(points, float(item.box[6]))
    corners = _corners(middle, along, _deep(across, along, WINDOW_M))
    if not met:
        return [Shape(corners, stroke=FAINT, width_m=HAIR_M, dashed=True)]
    pane = Shape(np.array([middle - along, middle + along]), stroke=INK, width_m=HAIR_M, closed=False)
    return [Shape(corners, PAPER, INK, THIN_M), pane]


def _passage(item: SceneObject) -> list[Shape]:
    middle, along, across = _rectangle(item.vertices[:, :2], float(item.box[6]))
    sides = [np.array([middle - along + s * across, middle + along + s * across]) for s in (-1, 1)]
    gap = Shape(_corners(middle, along, across), FLOOR)
    return [gap, *(Shape(side, stroke=FAINT, width_m=HAIR_M, dashed=True, closed=False) for side in sides)]


def _at_cut(item: SceneObject) -> tuple[FloatArray, bool]:
    """(N, 2) points of an object at the cut, and whether there are any; all its points where the cut misses it."""
    found = [slice_segments(apply(item.scene_T_object, p.vertices), p.triangles, CUT_M) for p in item.parts]
    points = np.concatenate(found).reshape(-1, 2)
    return (points, True) if len(points) else (item.vertices[:, :2], False)


def _door(item: SceneObject, scene: Scene) -> list[Shape]:
    """The gap in the wall, the leaf and its arc. A closed leaf is drawn open by a right angle, an open one as it is."""
    leaf = _points([part for part in item.parts if part.role == "door"] or list(item.parts), item)
    handles = _points([part for part in item.parts if part.role == "handle"], item)
    frame = _points([p for p in item.parts if p.role is None and _reach(p) > _reach_of_leaf(item)], item)
    middle, along, across = _rectangle(leaf[:, :2], smallest_yaw(leaf[:, :2], float(item.box[6])))
    _, wall, depth = _rectangle((frame if len(frame) else leaf)[:, :2], float(item.box[6]))
    if len(handles) and float((handles[:, :2].mean(axis=0) - middle) @ along) < 0:
        along = -along
    hinge, length = middle - along, 2 * float(np.linalg.norm(along))
    wall = wall / max(float(np.linalg.norm(wall)), 1e-9)
    if abs(float(along @ wall)) > CLOSED * length / 2:
        inward = np.array([-along[1], along[0]]) * 2
        room = scene.room_at(middle).outline_xy.mean(axis=0)
        closed, opened = 2 * along, inward if float(inward @ (room - middle)) >= 0 else -inward
        panel = Shape(np.array([hinge, hinge + opened]), stroke=INK, width_m=2 * LINE_M, closed=False)
    else:
        way = frame[:, :2].mean(axis=0) - hinge if len(frame) else wall
        closed, opened = wall * math.copysign(length, float(wall @ way)), 2 * along
        panel = Shape(_corners(middle, along, across), PAPER, INK, THIN_M)
    half = closed / 2 * (1 + 2 * JAMB_M / length)
    across_wall = depth / max(float(np.linalg.norm(depth)), 1e-9)
    middle_of_wall = across_wall * float(((frame if len(frame) else leaf)[:, :2].mean(axis=0) - hinge) @ across_wall)
    gap = Shape(_corners(hinge + middle_of_wall + closed / 2, half, _deep(depth, closed, WINDOW_M)), FLOOR)
    return [gap, Shape(_arc(hinge, closed, opened), stroke=FAINT, width_m=THIN_M, closed=False), panel]


def _points(parts: list[Part], item: SceneObject) -> FloatArray:
    """(N, 3) vertices of some parts of an object."""
    return np.concatenate([np.empty((0, 3)), *(apply(item.scene_T_object, part.vertices) for part in parts)])


def _reach(part: Part) -> float:
    return float(part.vertices[:, 2].max())


def _reach_of_leaf(item: SceneObject) -> float:
    """The top of the leaf: what reaches higher is the frame."""
    return max((_reach(part) for part in item.parts if part.role == "door"), default=math.inf) - OVERHANG_M


def _arc(centre: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """(n, 2) points of the shorter arc about a centre from one arm to another."""
    a = math.atan2(start[1], start[0])
    turn = (math.atan2(end[1], end[0]) - a + math.pi) % (2 * math.pi) - math.pi
    angles = a + turn * np.linspace(0, 1, ARC_STEPS + 1)
    return np.asarray(centre + np.linalg.norm(start) * np.column_stack([np.cos(angles), np.sin(angles)]))


# ---------------------------------------------------------------- words


def _name_furniture(furniture: list[SceneObject], labels: list[Label]) -> list[str]:
    """Name what has room for its name, largest first; number the rest. Returns the lines of the legend."""
    taken: list[FloatArray] = []
    legend = []
    named = [item for item in furniture if item.category.group == "furniture"]
    for item in sorted(named, key=lambda item: (-float(item.box[3] * item.box[4]), item.object_id)):
        name = item.category_name.replace("_", " ")
        label = _fitting(item, name, taken, TEXT_M)
        if label is None:
            number = str(item.object_id)
            label = _fitting(item, number, taken, TEXT_M[-2:]) or Label(item.box[:2], (number,), TEXT_M[-1], INK)
            legend.append((item.object_id, f"{number} {name}"))
        taken.append(_extent(label))
        labels.append(label)
    return [line for _, line in sorted(legend)]


def _fitting(item: SceneObject, name: str, taken: list[FloatArray], sizes: tuple[float, ...]) -> Label | None:
    """The name in the largest letters in which it fits the object, in one line or more, clear of other names."""
    low, high = item.vertices[:, :2].min(axis=0), item.vertices[:, :2].max(axis=0)
    lines = dict.fromkeys([(name,), tuple(name.split())])
    for size, words, angle, place in itertools.product(sizes, lines, (0.0, 90.0), PLACES_ON):
        label = Label((low + high) / 2 + np.array(place) * (high - low), words, size, INK, angle)
        extent = _extent(label)
        inside = (extent[0] >= low - OVERHANG_M).all() and (extent[1] <= high + OVERHANG_M).all()
        if inside and not any(_overlap(extent, other) for other in taken):
            return label
    return None


def _extent(label: Label) -> FloatArray:
    """(2, 2) lower and upper corner of a label."""
    width = LETTER * label.size_m * max(len(line) for line in label.lines)
    half = np.array([width, LINE * label.size_m * len(label.lines)]) / 2
    half = half[::-1] if label.angle_deg else half
    return np.array([label.at - half, label.at + half])


def _overlap(a: FloatArray, b: FloatArray) -> bool:
    return bool((a[0] < b[1]).all() and (b[0] < a[1]).all())


def _name_rooms(scene: Scene, furniture: list[SceneObject], labels: list[Label]) -> None:
    """Type and area of each room, where a home has several, at the free place nearest to its middle."""
    if len(scene.rooms) < 2:
        return
    words = [_extent(label) for label in labels]
    things = [np.stack([i.vertices[:, :2].min(axis=0), i.vertices[:, :2].max(axis=0)]) for i in furniture]
    for room in scene.rooms:
        lines = (room.room_type.replace("_", " "), f"{room.area_m2:.1f} m²")
        low, high = room.outline_xy.min(axis=0), room.outline_xy.max(axis=0)
        steps = np.stack(np.meshgrid(*(np.linspace(a, b, PLACES) for a, b in zip(low, high, strict=True))), axis=-1)
        places = sorted(steps.reshape(-1, 2).tolist(), key=lambda p: math.dist(p, (low + high) / 2))
        tries = [Label(np.array(place), lines, TEXT_M[0], FAINT, bold=True) for place in places]
        tries = [t for t in tries if contains(room.outline_xy, _corners_of(_extent(t))).all()] or tries
        for taken in ((*words, *things), words, ()):
            free = next((t for t in tries if not any(_overlap(_extent(t), other) for other in taken)), None)
            if free is not None:
                labels.append(free)
                break


def _corners_of(extent: FloatArray) -> FloatArray:
    return np.array([[extent[i, 0], extent[j, 1]] for i in range(2) for j in range(2)])


# ---------------------------------------------------------------- the page


def _page(scene: Scene, shapes: list[Shape], labels: list[Label], legend: list[str], turn: float) -> Drawing:
    """Title above; scale, arrows, and the legend if there is one, below."""
    every = np.concatenate([shape.points for shape in shapes])
    low, high = every.min(axis=0) - MARGIN_M, every.max(axis=0) + MARGIN_M
    x, top = float(low[0]) + MARGIN_M, float(high[1])
    several = len(scene.rooms) > 1
    rooms = f"{len(scene.rooms)} rooms" if several else scene.rooms[0].room_type.replace("_", " ")
    area = sum(room.area_m2 for room in scene.rooms)
    facts = f"{rooms}, {area:.1f} m², {scene.height_m:.2f} m high, cut at {CUT_M:g} m"
    labels += [
        Label(np.array([x, top + 0.12]), (scene.scene_id,), 0.2, INK, anchor="start", bold=True),
        Label(np.array([x, top - 0.12]), (facts,), 0.12, FAINT, anchor="start"),
    ]
    foot = float(low[1]) + 0.05
    shapes += _scale_bar(x, foot, labels)
    shapes += _arrows(np.array([float(high[0]) - MARGIN_M - 0.35, foot]), turn, labels)
    y = foot - 0.4
    for line in _wrapped(legend, float(high[0] - low[0]) - 2 * MARGIN_M):
        labels.append(Label(np.array([x, y]), (line,), TEXT_M[1], INK, anchor="start"))
        y -= 1.5 * TEXT_M[1]
    corners = np.array([low[0], y]), np.array([high[0], top + HEAD_M])
    return Drawing(*corners, tuple(shapes), tuple(labels), scene.scene_id)


def _wrapped(entries: list[str], width_m: float) -> list[str]:
    """Entries joined into lines that fit the width."""
    lines: list[str] = []
    for entry in entries:
        longer = f"{lines[-1]}, {entry}" if lines else entry
        if lines and LETTER * TEXT_M[1] * len(longer) <= width_m:
            lines[-1] = longer
        else:
            lines.append(entry)
    return lines


def _scale_bar(x: float, y: float, labels: list[Label]) -> list[Shape]:
    """Two metres, by half metres."""
    bar = []
    for k in range(4):
        a, b = x + k / 2, x + (k + 1) / 2
        square = np.array([[a, y], [b, y], [b, y + 0.06], [a, y + 0.06]])
        bar.append(Shape(square, INK if k % 2 == 0 else PAPER, INK, HAIR_M))
    labels += [Label(np.array([x + k, y - 0.12]), (f"{k} m",), 0.1, INK) for k in range(3)]
    return bar


def _arrows(at: FloatArray, turn: float, labels: list[Label]) -> list[Shape]:
    """The x and y axes of the scene, as they lie on the page."""
    shapes = []
    for name, angle in (("x", turn), ("y", turn + math.pi / 2)):
        direction = np.array([math.cos(angle), math.sin(angle)])
        side = np.array([-direction[1], direction[0]])
        tip = at + 0.3 * direction
        shapes.append(Shape(np.array([at, tip]), stroke=INK, width_m=THIN_M, closed=False))
        head = np.array(
            [tip + 0.05 * direction, tip - 0.03 * direction + 0.035 * side, tip - 0.03 * direction - 0.035 * side]
        )
        shapes.append(Shape(head, fill=INK))
        labels.append(Label(at + 0.43 * direction, (name,), 0.1, INK))
    return shapes
