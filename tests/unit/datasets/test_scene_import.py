"""3D files as scenes: objects, frames, rooms and their truth, against a room whose every measure is known."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hsbench.datasets.importers.scene_import import ImportedScene, import_scene
from hsbench.datasets.importers.scene_labels import LabelTable, read_labels
from hsbench.datasets.importers.scene_to_folder import import_to_folder
from hsbench.datasets.importers.scene_truth import scene_grid, scene_truth
from hsbench.errors import DataError
from hsbench.geometry.convex import box, cylinder, span
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import planar, rigid
from hsbench.io.scene_folder import read_affordance, read_occupancy, read_scene
from hsbench.io.scene_glb import glb_bytes
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.schema.states import Affordance, VoxelState
from hsbench.truth.occupancy import solid_occupancy
from tests.unit.datasets.scene_files import (
    CEILING,
    DEPTH,
    FLOOR,
    HEIGHT,
    ROOM_LABELS,
    SHELL,
    SOFA,
    TABLE_LEGS,
    TABLE_TOP,
    WALLS,
    WARDROBE,
    WIDTH,
    gltf,
    habitat,
    node,
    obj,
    room_nodes,
    solids,
    write_gltf,
    y_up,
)
from tests.unit.episode_builders import same
from tests.unit.geometry.meshes import Mesh, flipped, joined, of, torus

YAW = 0.4
ROOM = Room("room", np.array([[0.0, 0.0], [WIDTH, 0.0], [WIDTH, DEPTH], [0.0, DEPTH]]))
OPEN = pytest.mark.filterwarnings("ignore:meshes with open pieces")


def labels(tmp_path: Path, text: str = ROOM_LABELS, name: str = "labels.csv") -> LabelTable:
    path = tmp_path / name
    path.write_text(text)
    return read_labels(path)


@pytest.fixture
def imported(tmp_path: Path) -> ImportedScene:
    path = write_gltf(tmp_path / "room.gltf", gltf(*room_nodes(YAW)))
    return import_scene(path, labels(tmp_path), "a-room")


def by_name(scene: Scene, category: str) -> list[SceneObject]:
    return [item for item in scene.objects if item.category_name == category]


def imported_from(tmp_path: Path, *nodes: dict[str, Any], text: str, **options: Any) -> ImportedScene:
    return import_scene(write_gltf(tmp_path / "a.gltf", gltf(*nodes)), labels(tmp_path, text), "s", **options)


FLOOR_NODE = node("Floor", y_up(FLOOR))
FLOOR_ROW = "node,category,role,object\nFloor,floor,,\n"


# ---------------------------------------------------------------- objects


def test_nodes_become_objects_with_the_boxes_they_were_made_with(imported: ImportedScene) -> None:
    scene = imported.scene
    assert scene.scene_id == "a-room"
    assert sorted(o.category_name for o in scene.objects) == sorted(
        ["ceiling", "dining_table", "floor", "sofa", "sofa", "wall", "wardrobe"]
    )
    (table,), sofas, (wardrobe,) = (by_name(scene, c) for c in ("dining_table", "sofa", "wardrobe"))
    assert np.allclose(
        table.box, [1.2, 1.0, 0.37, 1.2, 0.8, 0.74, math.radians(round(math.degrees(YAW), 2))], atol=2e-4
    )
    assert np.allclose([s.box for s in sofas], [[1.0, 2.4, 0.4, 1.8, 0.8, 0.8, 0], [3.0, 2.4, 0.4, 1.8, 0.8, 0.8, 0]])
    assert np.allclose(wardrobe.box, [3.4, 0.4, 1.0, 1.0, 0.6, 2.0, 0])
    assert [o.object_id for o in scene.objects] == list(range(1, 8))
    assert [s.movable for s in sofas] == [True, True]
    assert not table.movable


def test_parts_carry_names_and_roles_and_convex_ones_are_solids(imported: ImportedScene) -> None:
    (table,) = by_name(imported.scene, "dining_table")
    assert [(p.name, p.role, p.solid is not None) for p in table.parts] == [
        ("Table_top", "top", True),
        ("Table_legs", None, False),
    ]
    assert table.parts[0].solid is not None
    assert table.parts[0].solid.volume_m3 == pytest.approx(TABLE_TOP.volume_m3, rel=1e-6)
    assert [p.role for s in by_name(imported.scene, "sofa") for p in s.parts] == ["seat", "seat"]


def truth_of_the_room() -> Scene:
    """The same room built of our own solids."""

    def thing(object_id: int, kind: str, pose: np.ndarray, *parts: Any) -> SceneObject:
        return SceneObject(object_id, kind, pose, tuple(Part(f"p{k}", (1, 2, 3), solid=p) for k, p in enumerate(parts)))

    yaw = math.radians(round(math.degrees(YAW), 2))
    objects = (
        thing(4, "dining_table", planar(1.2, 1.0, yaw), TABLE_TOP, *TABLE_LEGS),
        thing(5, "sofa", planar(1.0, 2.4, 0), *SOFA),
        thing(6, "sofa", planar(3.0, 2.4, 0), *SOFA),
        thing(7, "wardrobe", planar(3.4, 0.4, 0), WARDROBE),
    )
    return Scene("s", (ROOM,), HEIGHT, objects)


@OPEN
def test_occupancy_is_that_of_the_room_built_of_solids(imported: ImportedScene) -> None:
    grid = scene_grid(imported.scene)
    ours, theirs = solid_occupancy(imported.scene, grid), solid_occupancy(truth_of_the_room(), grid)
    furniture = ours[1] > 3
    assert np.array_equal(ours[0][furniture], theirs[0][furniture])
    assert np.array_equal(np.where(furniture, ours[1], 0), theirs[1])
    assert theirs[1].any()
    structure = ours[1][(ours[1] > 0) & ~furniture]
    assert set(np.unique(structure)) == {1, 3}  # the floor at z = 0 lies below the grid, the ceiling below its top


@pytest.mark.parametrize("yaw", [0.0, 0.4, -1.3, 2.9])
def test_the_yaw_of_a_box_follows_the_node_and_the_footprint(tmp_path: Path, yaw: float) -> None:
    """Turned by its node, or turned in its vertices under an upright node: the same rectangle."""
    half = yaw / 2
    by_node = node("A", y_up(of(box((0.9, 0.5, 1.0), (0, 0, 0.5)))), rotation=[0, math.sin(half), 0, math.cos(half)])
    baked = node("B", y_up(of(box((0.9, 0.5, 1.0), (0, 0, 0.5)).transformed(planar(2, 1, yaw)))))
    scene = imported_from(tmp_path, FLOOR_NODE, by_node, baked, text=FLOOR_ROW + "A,sofa\nB,sofa\n").scene
    turned, flat = by_name(scene, "sofa")
    assert turned.box[6] == pytest.approx(math.radians(round(math.degrees(yaw), 2)), abs=1e-9)
    assert np.allclose(turned.box[3:6], [0.9, 0.5, 1.0], atol=2e-4)
    assert abs(flat.box[6]) <= math.pi / 4 + 1e-9  # of four equal ones the nearest to the node's own
    assert math.remainder(flat.box[6] - yaw, math.pi / 2) == pytest.approx(0, abs=2e-4)
    assert sorted(flat.box[3:5]) == pytest.approx([0.5, 0.9], abs=4e-4)


def test_mirrored_and_scaled_nodes_are_still_solid_within(tmp_path: Path) -> None:
    ring = joined(torus(), of(box((0.2, 0.2, 0.2), (0.5, 0, 0))))
    nodes = (
        node("A", y_up(ring), translation=[1, 0.5, -1]),
        node("B", y_up(ring), translation=[3, 0.5, -1], scale=[-1, 1, 1]),
    )
    scene = imported_from(tmp_path, FLOOR_NODE, *nodes, text=FLOOR_ROW + "A,object\nB,object\n").scene
    one, two = by_name(scene, "object")
    grid = scene_grid(scene)
    with pytest.warns(UserWarning, match="floor 100%$"):  # of the floor only
        instance = solid_occupancy(scene, grid)[1]
    counts = [(instance == o.object_id).sum() for o in (one, two)]
    assert counts[0] > 100
    assert abs(counts[0] - counts[1]) < 0.1 * counts[0]


def test_nodes_of_one_object_and_materials_of_one_node(tmp_path: Path) -> None:
    """Legs and top that hang on no common node; a wall whose window is a material."""
    text = FLOOR_ROW.replace("node,", "node,part,").replace("Floor,", "Floor,,")
    text += "Leg,,dining_table,,table\nTop,,dining_table,top,table\nWall,,wall\nWall,glass,window\nLight,,ignore\n"
    legs = [node(f"Leg.{k:03d}", y_up(of(leg))) for k, leg in enumerate(TABLE_LEGS)]
    pieces = of(span((0, 3, 0), (1, 3.1, 2))), of(span((1, 3, 1), (2, 3.1, 2)))
    wall = node("Wall", *map(y_up, pieces), materials=("paint", "glass"))
    lights = node("Light", y_up(of(box((0.1, 0.1, 0.1), (1, 1, 2)))))
    scene = imported_from(tmp_path, FLOOR_NODE, *legs, node("Top", y_up(of(TABLE_TOP))), wall, lights, text=text).scene
    (table,) = by_name(scene, "dining_table")
    assert [p.role for p in table.parts] == [None] * 4 + ["top"]
    assert np.allclose(table.box[3:6], [1.2, 0.8, 0.74])
    assert [len(by_name(scene, c)) for c in ("wall", "window", "floor")] == [1, 1, 1]
    assert len(scene.objects) == 4


def test_extras_label_where_the_table_is_silent(tmp_path: Path) -> None:
    sofa = node("a", y_up(solids(*SOFA)), extras={"category": "sofa", "movable": True})
    table = node("b", y_up(of(TABLE_TOP)), extras={"category": "desk"})
    scene = imported_from(tmp_path, FLOOR_NODE, sofa, table, text=FLOOR_ROW + "b,coffee_table\n").scene
    assert by_name(scene, "sofa")[0].movable
    assert by_name(scene, "coffee_table")
    assert not by_name(scene, "desk")
    with pytest.raises(DataError, match=r"node 'a' extras: category 'couch' is unknown"):
        imported_from(tmp_path, node("a", y_up(FLOOR), extras={"category": "couch"}), text=FLOOR_ROW)


def test_thin_boards_stay_meshes_so_that_none_is_lost(tmp_path: Path) -> None:
    pane = node("Pane", y_up(of(span((1, 2.9, 0.5), (2, 2.904, 1.5)))))
    scene = imported_from(tmp_path, FLOOR_NODE, pane, text=FLOOR_ROW + "Pane,mirror\n").scene
    (mirror,) = by_name(scene, "mirror")
    assert mirror.parts[0].mesh is not None
    with pytest.warns(UserWarning, match="floor"):
        instance = solid_occupancy(scene, scene_grid(scene))[1]
    assert (instance == mirror.object_id).any(axis=1).sum() >= 20 * 20


# ---------------------------------------------------------------- rooms, frames


def test_rooms_come_from_the_floor_and_it_is_said(imported: ImportedScene) -> None:
    (room,) = imported.scene.rooms
    assert same(room.outline_xy[np.lexsort(room.outline_xy.T)], ROOM.outline_xy[np.lexsort(ROOM.outline_xy.T)])
    assert imported.scene.height_m == HEIGHT
    assert any("rooms are estimated: the outline of the floor (12.0 m2 with 4 corners)" in n for n in imported.notes)
    assert any(n == "height 2.50 m: the underside of the ceiling" for n in imported.notes)


def test_rooms_and_height_of_the_table_are_taken(tmp_path: Path) -> None:
    document = {
        "labels": [{"node": "Floor", "category": "floor"}],
        "rooms": [{"room_type": "study", "outline_xy": [[0, 0], [2, 0], [2, 3], [0, 3]]}],
        "height_m": 2.2,
    }
    table = labels(tmp_path, json.dumps(document), "labels.json")
    scene = import_scene(write_gltf(tmp_path / "a.gltf", gltf(FLOOR_NODE)), table, "s").scene
    assert [(r.room_type, r.area_m2) for r in scene.rooms] == [("study", 6.0)]
    assert scene.height_m == 2.2


def test_an_l_shaped_floor_of_two_slabs_and_a_second_room(tmp_path: Path) -> None:
    slabs = joined(of(span((0, 0, -0.2), (4, 2, 0))), of(span((6, 0, -0.2), (8, 3, 0))))
    l_part = np.array([[0.0, 2, 0], [2, 2, 0], [2, 4, 0], [0, 4, 0]]), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    walls = of(span((0, -0.1, 0), (8, 0, 2.6)))
    scene = imported_from(
        tmp_path, node("Floor", y_up(slabs)), node("Floor.001", y_up(l_part)), node("W", y_up(walls)),
        text=FLOOR_ROW + "W,wall\n",
    ).scene  # fmt: skip
    assert sorted(round(r.area_m2, 6) for r in scene.rooms) == [6.0, 12.0]
    assert scene.height_m == 2.6


@pytest.mark.parametrize("level", [0.15, -0.3])
def test_the_floor_is_moved_to_zero(tmp_path: Path, level: float) -> None:
    nodes = [
        dict(n, translation=(np.array(n.get("translation", [0, 0, 0])) + [0, level, 0]).tolist())
        for n in room_nodes(0.0)
    ]
    moved = import_scene(write_gltf(tmp_path / "a.gltf", gltf(*nodes)), labels(tmp_path), "s")
    still = import_scene(write_gltf(tmp_path / "b.gltf", gltf(*room_nodes(0.0))), labels(tmp_path), "s")
    assert any(f"the floor lies at z = {level:g} m" in note for note in moved.notes)
    assert np.allclose([o.box for o in moved.scene.objects], [o.box for o in still.scene.objects], atol=1e-9)
    assert moved.scene.height_m == still.scene.height_m


def test_the_same_room_as_obj_with_either_axis_up(tmp_path: Path) -> None:
    def files(turn: Any) -> dict[str, Mesh]:
        return {
            "Floor": turn(FLOOR), "Ceiling": turn(CEILING), "Walls": turn(WALLS), "Sofa": turn(solids(*SOFA)),
            "Wardrobe": turn((of(WARDROBE)[0] + [3, 2, 0], of(WARDROBE)[1])),
        }  # fmt: skip

    text = "node,category\nFloor,floor\nCeiling,ceiling\nWalls,wall\nSofa,sofa\nWardrobe,wardrobe\n"
    (tmp_path / "y.obj").write_text(obj(files(y_up)))
    (tmp_path / "z.obj").write_text(obj(files(lambda mesh: mesh)))
    (tmp_path / "mm.obj").write_text(obj(files(lambda mesh: (mesh[0] * 1000, mesh[1]))))
    table = labels(tmp_path, text)
    scenes = [
        import_scene(tmp_path / "y.obj", table, "s"),
        import_scene(tmp_path / "z.obj", table, "s", up="z"),
        import_scene(tmp_path / "mm.obj", table, "s", up="z", scale=0.001),
    ]
    for other in scenes[1:]:
        assert same(other.scene, scenes[0].scene)
    with pytest.raises(DataError, match=r"only 0% of the floor would be horizontal with y up; .* \(try --up z\)"):
        import_scene(tmp_path / "z.obj", table, "s")
    with pytest.raises(DataError, match=r"are these millimetres\? try --scale 0.001"):
        import_scene(tmp_path / "mm.obj", table, "s", up="z")


@pytest.mark.parametrize(
    ("factor", "hint"),
    [
        (1000, r"millimetres\? try --scale 0.001"),
        (100, r"centimetres\? try --scale 0.01"),
        (0.01, r"metres\? try --scale 10"),
    ],
)
def test_implausible_units_are_refused_with_a_hint(tmp_path: Path, factor: float, hint: str) -> None:
    floor = node("Floor", y_up((FLOOR[0] * factor, FLOOR[1])))
    with pytest.raises(DataError, match=hint):
        imported_from(tmp_path, floor, text=FLOOR_ROW)


# ---------------------------------------------------------------- what is refused


def test_nodes_without_a_label_are_listed_with_the_nearest_categories(tmp_path: Path) -> None:
    nodes = (node("OldSofa_03", y_up(solids(*SOFA))), node("Cube.007", y_up(of(WARDROBE))))
    with pytest.raises(DataError) as error:
        imported_from(tmp_path, FLOOR_NODE, *nodes, text=FLOOR_ROW)
    assert str(error.value) == (
        "2 nodes have no label: 'OldSofa_03' (sofa?), 'Cube.007';"
        " give each a category in --labels, or all of them --default object"
    )
    scene = imported_from(tmp_path, FLOOR_NODE, *nodes, text=FLOOR_ROW, default="object").scene
    assert [o.category_name for o in scene.objects] == ["floor", "object", "object"]


def test_rows_that_fit_no_node_are_told_with_the_nearest(tmp_path: Path) -> None:
    nodes = (FLOOR_NODE, node("Walls", y_up(WALLS)))
    notes = imported_from(tmp_path, *nodes, text=FLOOR_ROW + "Walls,wall\nFlor,floor\nGarage,wall\n").notes
    assert notes[0] == "2 labels fit no node: 'Flor' (is it 'Floor'?), 'Garage'; the nodes are Floor, Walls"


def test_a_node_without_triangles_is_left_out_and_told(tmp_path: Path) -> None:
    sliver = (np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0]]), np.array([[0, 1, 2]], np.int32))
    nodes = (FLOOR_NODE, node("W", y_up(WALLS)), node("S", sliver))
    notes = imported_from(tmp_path, *nodes, text=FLOOR_ROW + "S,sofa\nW,wall\n").notes
    assert "node 'S' has a mesh without triangles; left out" in notes
    with pytest.raises(DataError, match="no node has triangles and a category"):
        imported_from(tmp_path, node("Floor", sliver), text=FLOOR_ROW)


@pytest.mark.parametrize(
    ("nodes", "text", "message"),
    [
        ((node("S", y_up(solids(*SOFA))),), "node,category\nS,sofa\n", "no node is a floor; label one, or give rooms"),
        ((FLOOR_NODE,), FLOOR_ROW, "nothing reaches above the floor"),
        ((FLOOR_NODE, node("S", y_up(solids(*SOFA)))), FLOOR_ROW + "S,sofa,drawer\n", r"node 'S': .* role drawer"),
        ((FLOOR_NODE, node("A", y_up(of(WARDROBE))), node("B", y_up(of(WARDROBE)))),
         FLOOR_ROW + "A,sofa,,x\nB,chair,,x\n", "object 'x' is both sofa and chair"),
    ],
)  # fmt: skip
def test_what_makes_no_scene(tmp_path: Path, nodes: tuple, text: str, message: str) -> None:
    with pytest.raises(DataError, match=message):
        imported_from(tmp_path, *nodes, text=text)


def test_a_shell_of_outward_faces_does_not_fill_the_room_in_silence(tmp_path: Path) -> None:
    inward = imported_from(tmp_path, FLOOR_NODE, node("W", y_up(SHELL)), text=FLOOR_ROW + "W,wall\n").scene
    with pytest.warns(UserWarning, match="1 floor 100%$"):
        truth = scene_truth(inward)
    assert truth.occupancy.solid[3:-3, 3:-3, :-2].mean() < 0.01
    outward = imported_from(tmp_path, FLOOR_NODE, node("W", y_up(flipped(SHELL))), text=FLOOR_ROW + "W,wall\n").scene
    with (
        pytest.warns(UserWarning, match="1 floor 100%$"),
        pytest.raises(DataError, match=r"room of 12.0 m2 is 100% solid, mainly by 2 \(wall\); .* closed shell around"),
    ):
        scene_truth(outward)


# ---------------------------------------------------------------- truth


@OPEN
def test_truth_without_a_camera(imported: ImportedScene) -> None:
    truth = scene_truth(imported.scene)
    occupancy, grid = truth.occupancy, truth.occupancy.grid
    assert grid.origin_m == pytest.approx((-0.1, -0.1, 0.0))
    assert grid.shape == (84, 64, 50)
    inside = occupancy.state == VoxelState.UNKNOWN
    assert inside[:, :, 0].sum() * 0.05**2 == pytest.approx(12.0)
    assert (occupancy.state[~inside] == VoxelState.OUTSIDE_ROOM).all()
    assert np.isinf(occupancy.swept_s).all()
    assert 0 < truth.walk.free.sum() * 0.05**2 < 8
    cells, _ = truth.walk.index(np.array([[2.3, 1.3], [1.0, 2.4], [3.4, 0.4], [1.2, 1.0]]))
    assert truth.walk.free[tuple(cells.T)].tolist() == [True, False, False, False]  # amid, sofa, wardrobe, table


# ---------------------------------------------------------------- several files


def models(tmp_path: Path, *entries: dict[str, Any]) -> Path:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps({"models": list(entries)}))
    return path


@pytest.fixture
def parts_folder(tmp_path: Path) -> Path:
    write_gltf(tmp_path / "sofa.gltf", gltf(node("Cube", y_up(solids(*SOFA)))))
    (tmp_path / "wardrobe.obj").write_text(obj({"Cube": of(WARDROBE)}))
    write_gltf(tmp_path / "shell.gltf", gltf(FLOOR_NODE, node("Walls", y_up(WALLS))))
    return tmp_path


def test_a_list_of_models_places_each(parts_folder: Path) -> None:
    half = math.sqrt(0.5)
    path = models(
        parts_folder,
        {"file": "shell.gltf"},
        {"file": "sofa.gltf", "category": "sofa", "translation": [2, 1, 0], "rotation": [half, 0, 0, half]},
        {"file": "sofa.gltf", "name": "small sofa", "category": "sofa", "scale": 0.5,
         "scene_T_object": planar(1, 2, 0).tolist()},
        {"file": "wardrobe.obj", "category": "wardrobe", "up": "z", "translation": [3.4, 2.6, 0]},
    )  # fmt: skip
    scene = import_scene(path, labels(parts_folder, FLOOR_ROW + "Walls,wall\nsmall sofa,ottoman\n"), "s").scene
    (sofa,), (ottoman,), (wardrobe,) = (by_name(scene, c) for c in ("sofa", "ottoman", "wardrobe"))
    assert np.allclose(sofa.box, [2, 1, 0.4, 1.8, 0.8, 0.8, math.pi / 2], atol=1e-6)
    assert np.allclose(ottoman.box, [1, 2, 0.2, 0.9, 0.4, 0.4, 0], atol=1e-6)
    assert np.allclose(wardrobe.box, [3.4, 2.6, 1.0, 1.0, 0.6, 2.0, 0], atol=1e-6)
    assert len(scene.objects) == 5


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"name": "x"}, r"models\[0\] lacks file"),
        ({"file": "sofa.gltf", "scael": 2}, r"unknown \['scael'\]"),
        ({"file": "../sofa.gltf"}, "leads out of"),
        ({"file": "scene.json"}, "expected .glb, .gltf or .obj"),
        (
            {"file": "sofa.gltf", "rotation": [0, 0, 90, 0]},
            r"expected a unit quaternion w x y z \(these are angles\?\)",
        ),
        ({"file": "sofa.gltf", "translation": [0, 0]}, "expected 3 finite numbers"),
        ({"file": "sofa.gltf", "scene_T_object": np.diag([2.0, 2, 2, 1]).tolist()}, "no rigid 4 x 4 matrix"),
        ({"file": "sofa.gltf", "scale": 0}, "expected positive numbers"),
        ({"file": "sofa.gltf", "up": "x"}, "up is 'x'; expected y or z"),
        ({"file": "gone.gltf"}, "cannot be read"),
    ],
)
def test_a_wrong_list_of_models_names_the_entry(parts_folder: Path, entry: dict, message: str) -> None:
    with pytest.raises(DataError, match=message):
        import_scene(models(parts_folder, entry), LabelTable({}), "s", default="object")


def test_a_habitat_scene(tmp_path: Path) -> None:
    path = habitat(
        tmp_path,
        [
            {"template_name": "chair", "translation": [1, 0.45, -1]},  # by the middle of its box
            {"template_name": "chair", "translation": [2, 0, -1], "translation_origin": "asset_local"},
            {"template_name": "objects/big", "translation": [3, 0, -2], "translation_origin": "ASSET_LOCAL",
             "rotation": [math.sqrt(0.5), 0, math.sqrt(0.5), 0], "non_uniform_scale": [1, 0.5, 1]},
        ],
    )  # fmt: skip
    table = labels(tmp_path, FLOOR_ROW + "Walls,wall\nchair,chair\nbig,armchair\n")
    scene = import_scene(path, table, "s").scene
    chairs, (big,) = by_name(scene, "chair"), by_name(scene, "armchair")
    assert np.allclose(
        [c.box[:6] for c in chairs], [[1, 1, 0.45, 0.4, 0.5, 0.9], [2.2, 1.25, 0.45, 0.4, 0.5, 0.9]], atol=1e-6
    )
    # Habitat's frame: x right, y up, -z ahead. A quarter turn about y takes our x to y, and y to -x.
    assert np.allclose(big.box[:3], [3 - 0.5, 2 + 0.4, 0.45], atol=1e-6)
    assert np.allclose(big.box[3:], [0.8, 1.0, 0.9, math.pi / 2], atol=1e-6)
    assert np.allclose(np.ptp(scene.rooms[0].outline_xy, axis=0), [WIDTH, DEPTH])


def test_a_stated_centre_of_mass_and_what_is_missing(tmp_path: Path) -> None:
    path = habitat(tmp_path, [{"template_name": "big", "translation": [1, 0, -1]}], COM=[0.4, 0.0, -0.5])
    table = labels(tmp_path, FLOOR_ROW + "Walls,wall\nbig,armchair\n")
    (big,) = by_name(import_scene(path, table, "s").scene, "armchair")
    assert np.allclose(big.box[:3], [1, 1, 0.9], atol=1e-6)
    lost = habitat(tmp_path, [{"template_name": "lamp"}])
    with pytest.raises(
        DataError, match=r"template 'lamp': no lamp.object_config.json, .glb or .gltf under .* \(give --assets"
    ):
        import_scene(lost, table, "s")
    document = json.loads(path.read_text()) | {"articulated_object_instances": [{}], "object_instances": []}
    path.write_text(json.dumps(document))
    assert "1 articulated objects are left out" in import_scene(path, table, "s").notes


# ---------------------------------------------------------------- round trip, folder


GRID = VoxelGrid((-0.1, -0.1, -0.2), (130, 66, 56))


def furnished() -> Scene:
    """Turned objects, cylinders, a mesh, roles, textures, two rooms: what our own exporter has to carry."""

    def part(name: str, solid: Any, role: str | None = None, texture: str = "") -> Part:
        return Part(name, (200, 120, 40), role, solid, texture=texture)

    ring = torus(0.3, 0.1)
    walls = part("north", span((0, 3, 0), (6, 3.1, 2.5))), part("mid", span((3, 0, 0), (3.1, 2, 2.5)))
    table = part("top", TABLE_TOP, "top"), *(part("leg", leg) for leg in TABLE_LEGS)
    objects = (
        SceneObject(1, "floor", np.eye(4), (part("floor", span((0, 0, -0.1), (6, 3, 0)), texture="planks"),)),
        SceneObject(2, "wall", np.eye(4), walls),
        SceneObject(9, "dining_table", planar(1.5, 1.2, 0.7), table),
        SceneObject(12, "chair", planar(1.0, 2.2, -2.5), (part("seat", box((0.4, 0.4, 0.05), (0, 0, 0.45)), "seat"),
                    part("foot", cylinder(0.17, 0, 0.42))), movable=True),
        SceneObject(30, "object", planar(4.5, 1.5, 1.1, 0.4),
                    (Part("ring", (10, 200, 90), mesh=(ring[0].round(4), ring[1])),)),
    )  # fmt: skip
    rooms = (
        Room("living", np.array([[0.0, 0], [3, 0], [3, 3], [0, 3]])),
        Room("study", np.array([[3.1, 0.0], [6, 0], [6, 3], [3.1, 3]])),
    )
    return Scene("home-7", rooms, 2.5, objects, "nordic")


def test_export_and_import_give_the_same_scene_to_the_last_bit(tmp_path: Path) -> None:
    scene = furnished()
    path = tmp_path / "home.glb"
    path.write_bytes(glb_bytes(scene))
    again = import_scene(path, LabelTable({}), "home-7").scene
    assert same(again, scene)
    for ours, theirs in zip(solid_occupancy(again, GRID), solid_occupancy(scene, GRID), strict=True):
        assert np.array_equal(ours, theirs)


def test_what_was_edited_since_the_export_is_read_as_it_is_now(tmp_path: Path) -> None:
    """Another program writes the positions anew: the float64 beside them fit no more."""
    scene = furnished()
    data = bytearray(glb_bytes(scene))
    size = int.from_bytes(data[12:16], "little")
    document, start = json.loads(data[20 : 20 + size]), 28 + size
    part = next(n for n in document["nodes"] if n["name"] == "top")
    primitive = document["meshes"][part["mesh"]]["primitives"][0]
    view = document["bufferViews"][document["accessors"][primitive["attributes"]["POSITION"]]["bufferView"]]
    at, end = (start + view["byteOffset"] + k * view["byteLength"] for k in (0, 1))
    moved = np.frombuffer(bytes(data[at:end]), "<f4").reshape(-1, 3) * np.array([2, 1, 1], "<f4")
    data[at:end] = moved.tobytes()
    path = tmp_path / "home.glb"
    path.write_bytes(bytes(data))
    again = import_scene(path, LabelTable({}), "home-7").scene
    assert np.allclose(again.object(9).box[3:6], [2.4, 0.8, 0.74])
    assert np.allclose(again.object(12).box, scene.object(12).box)


def test_a_turned_export_loses_its_poses_but_not_its_boxes(tmp_path: Path) -> None:
    """Somebody put the exported home under a node of their own: ids and frames still fit."""
    scene = furnished().moved(rigid(planar(0, 0, 0.3)[:3, :3], (1.0, -2.0, 0.0)))
    path = tmp_path / "home.glb"
    path.write_bytes(glb_bytes(scene))
    again = import_scene(path, LabelTable({}), "home-7").scene
    assert np.allclose([o.box for o in again.objects], [o.box for o in scene.objects], atol=2e-6)


@OPEN
def test_a_folder_holds_scene_truth_and_source(tmp_path: Path) -> None:
    source = tmp_path / "room"
    source.mkdir()
    write_gltf(source / "room.gltf", gltf(*room_nodes(YAW)))
    (tmp_path / "labels.csv").write_text(ROOM_LABELS)
    out = tmp_path / "out"
    imported, truth = import_to_folder(source, tmp_path / "labels.csv", out, name="r-1")
    assert same(read_scene(out), imported.scene)
    assert same(read_occupancy(out), truth.occupancy)
    described = json.loads((out / "source.json").read_text())
    assert set(described["files"]) == {"room.gltf", "labels.csv"}
    assert described["notes"] == [*imported.notes, *truth.notes]
    assert {f.name for f in out.iterdir()} == {
        "scene.json", "scene.npz", "occupancy.json", "occupancy.npz", "walkable.npz", "affordance.npz", "source.json",
        "manifest.json",
    }  # fmt: skip
    with pytest.raises(DataError, match="exists already"):
        import_to_folder(source, None, out)


def test_what_a_folder_import_refuses(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"holds no .* expected a scene"):
        import_to_folder(tmp_path, None, tmp_path / "out")
    for name in ("a.glb", "b.glb"):
        (tmp_path / name).write_bytes(b"glTF")
    with pytest.raises(DataError, match=r"holds 2 scenes \(a.glb, b.glb\); name one"):
        import_to_folder(tmp_path, None, tmp_path / "out")
    with pytest.raises(DataError, match="--default couch: no such category"):
        import_to_folder(tmp_path / "a.glb", None, tmp_path / "out", default="couch")
    with pytest.raises(DataError, match="--scale -1"):
        import_to_folder(tmp_path / "a.glb", None, tmp_path / "out", scale=-1)
    assert not (tmp_path / "out").exists()


# ---------------------------------------------------------------- affordance


def test_an_imported_room_has_the_affordance_of_a_generated_one(tmp_path: Path) -> None:
    """The room of ``room_nodes``: sofas as single meshes of role seat, a table top, a wardrobe; nobody gave a door."""
    path = write_gltf(tmp_path / "room.gltf", gltf(*room_nodes(YAW)))
    (tmp_path / "labels.csv").write_text(ROOM_LABELS)
    with pytest.warns(UserWarning, match="open pieces"):
        imported, truth = import_to_folder(path, tmp_path / "labels.csv", tmp_path / "scene")
    source = json.loads((tmp_path / "scene" / "source.json").read_text())
    assert "no node is a door: people are taken to be on the largest piece of free floor" in source["notes"]
    found = read_affordance(tmp_path / "scene")
    assert np.array_equal(found.labels, truth.affordance.labels)
    assert found.parts is not None
    assert found.voxels is not None
    objects = {kind: set(found.parts.object_id[found.parts.labels >> kind & 1 == 1].tolist()) for kind in Affordance}
    ids = {
        name: {item.object_id for item in by_name(imported.scene, name)}
        for name in ("sofa", "dining_table", "wardrobe")
    }
    assert objects[Affordance.SITTABLE] == objects[Affordance.LYABLE] == ids["sofa"]
    assert objects[Affordance.INTERACTABLE] == ids["dining_table"] | ids["wardrobe"]
    seats = (found.labels >> Affordance.SITTABLE & 1).sum() * found.cell_m**2
    assert seats == pytest.approx(2 * 1.8 * 0.6, rel=0.05)
    half = len(found.labels) // 2
    for sofa in by_name(imported.scene, "sofa"):  # row 0 is the largest x, column 0 the largest y
        x, y = sofa.box[:2] + sofa.scene_T_object[:2, 1] * -0.2
        assert (
            found.labels[half - 1 - int(x // found.cell_m), half - 1 - int(y // found.cell_m)] >> Affordance.SITTABLE
            & 1
        )


def test_objects_without_roles_get_the_chief_one_of_their_category_and_it_is_said(tmp_path: Path) -> None:
    nodes = (FLOOR_NODE, node("S", y_up(solids(*SOFA))), node("L", y_up(of(WARDROBE))))
    imported = imported_from(tmp_path, *nodes, text=FLOOR_ROW + "S,sofa,,\nL,floor_lamp,,\n")
    assert [p.role for p in by_name(imported.scene, "sofa")[0].parts] == ["seat"]
    assert [p.role for p in by_name(imported.scene, "floor_lamp")[0].parts] == [None]  # a lamp is no switch
    assert "objects none of whose parts has a role are used as their category is: sofa as seat" in imported.notes


@pytest.mark.parametrize(("metres", "told"), [(2.5, False), (8.2, True), (1.5, True)])
def test_a_height_in_feet_is_told(tmp_path: Path, metres: float, told: bool) -> None:
    wall = node("W", y_up(of(span((0, 3, 0), (4, 3.1, metres)))))
    imported = imported_from(tmp_path, FLOOR_NODE, wall, text=FLOOR_ROW + "W,wall,,\n")
    assert any("unusual for a room" in note for note in imported.notes) == told
