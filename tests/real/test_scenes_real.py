"""Real 3D scenes through the importer: a SceneNet room, the habitat test assets, a living room of CC0 models.

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout. Trimesh is the other reader.
"""

from __future__ import annotations

import json
import math
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from hsbench.cli.main import run
from hsbench.datasets.importers.scene_import import ImportedScene, import_scene
from hsbench.datasets.importers.scene_labels import Label, LabelTable
from hsbench.datasets.importers.scene_placement import read_source, world_transforms
from hsbench.datasets.importers.scene_truth import scene_grid, scene_truth
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import apply
from hsbench.io.scene_folder import read_affordance, read_occupancy, read_scene
from hsbench.io.scene_glb import glb_bytes
from hsbench.schema.scene import Scene, SceneObject
from hsbench.schema.states import Affordance
from hsbench.truth.meshes import mesh_body
from hsbench.truth.occupancy import solid_occupancy
from hsbench.truth.sight import ray_image
from hsbench.viz.plan import plan_svg

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
SCENES = REALDATA / "scenes3d"
pytestmark = [
    pytest.mark.skipif(not SCENES.is_dir(), reason=f"needs the real scenes in {SCENES} (set HSBENCH_REALDATA)"),
    pytest.mark.filterwarnings("ignore:meshes with open pieces"),
]
DRAKE, HABITAT, ROOM_89 = SCENES / "drake_tutorials", SCENES / "habitat", SCENES / "scenenet_room_89_simple.obj"
MODELS = (
    *(
        f"drake_tutorials/{name}.gltf"
        for name in ("living_room", "curtain_open", "sofa_03_1k", "wooden_bookshelf_worn_1k")
    ),
    *(f"drake_tutorials/painted_wooden_{name}.gltf" for name in ("cabinet_02_1k", "cabinet_1k", "stool_1k")),
    *(f"habitat/{name}.glb" for name in ("chair", "simple_room", "stage_floor1")),
)


def table(rows: dict[str, str | Label]) -> LabelTable:
    return LabelTable({(k, ""): Label(v) if isinstance(v, str) else v for k, v in rows.items()})


def objects(scene: Scene, category: str) -> list[SceneObject]:
    return [item for item in scene.objects if item.category_name == category]


@pytest.mark.parametrize("name", MODELS)
def test_every_triangle_is_where_trimesh_puts_it(name: str) -> None:
    source = read_source(SCENES / name, (SCENES / name).parent)
    ours = np.concatenate(
        [
            apply(transform, mesh.vertices)[mesh.triangles]
            for transform, node in zip(world_transforms(source.nodes), source.nodes, strict=True)
            for mesh in node.meshes
        ]
    )
    other = trimesh.load(SCENES / name, process=False, force="scene").to_geometry()
    assert ours.shape == other.triangles.shape
    key = [np.lexsort(t.reshape(len(t), 9).round(4).T) for t in (ours, other.triangles)]
    assert np.allclose(ours[key[0]], other.triangles[key[1]], atol=1e-3)
    assert ours.sum() == pytest.approx(other.triangles.sum(), rel=1e-6, abs=1e-3)


# ---------------------------------------------------------------- SceneNet


@pytest.fixture(scope="module")
def room_89() -> ImportedScene:
    chairs = {f"chair_fmx{k}": "chair" for k in ("", "_1", "_3", "_4")} | {
        f"chair_fx{k}": "chair" for k in ("", "_2", "_4", "_5", "_6")
    }
    tables = {f"Table_{k}": "dining_table" for k in (1, 2, 3)}
    shell = {"room_skeleton": "wall", "floor_enclose_1": "floor", "ceiling_enclose": "ceiling"}
    pictures = {
        f"{where}_painting_{what}": Label("picture", where)
        for where in ("top", "bottom")
        for what in ("outer", "outer2", "inner")
    }
    return import_scene(ROOM_89, table(chairs | tables | shell | pictures), "room_89")  # type: ignore[operator]


def test_the_named_objects_of_an_obj_are_all_there(room_89: ImportedScene) -> None:
    scene = room_89.scene
    counts = {c: len(objects(scene, c)) for c in ("chair", "dining_table", "picture", "wall", "floor", "ceiling")}
    assert counts == {"chair": 9, "dining_table": 3, "picture": 2, "wall": 1, "floor": 1, "ceiling": 1}
    # One chair model stands nine times, at many angles: the smallest rectangle finds the same size each time.
    sizes = np.array([chair.box[3:6] for chair in objects(scene, "chair")])
    assert np.allclose(sizes, np.median(sizes, axis=0), atol=0.004)
    assert len({round(float(chair.box[6]), 2) for chair in objects(scene, "chair")}) >= 3
    assert all(abs(chair.box[2] - chair.box[5] / 2) < 0.01 for chair in objects(scene, "chair"))  # on the floor
    assert scene.rooms[0].area_m2 == pytest.approx(7.32 * 5.75, rel=0.01)
    assert scene.height_m == pytest.approx(2.90, abs=0.01)


def test_closed_tables_are_as_solid_as_their_volume(room_89: ImportedScene) -> None:
    """Seven closed pieces each, which hardly overlap: the points inside add up to the volume."""
    scene = room_89.scene
    _, instance = solid_occupancy(scene, scene_grid(scene))
    for item in objects(scene, "dining_table"):
        (part,) = item.parts
        assert mesh_body(item).open_share == 0
        volume = trimesh.Trimesh(*part.mesh, process=False).volume  # type: ignore[misc]
        assert (instance == item.object_id).sum() * 0.05**3 >= volume  # voxels are solid if any of their points is
        low, high = item.vertices.min(axis=0), item.vertices.max(axis=0)
        assert (instance == item.object_id).sum() * 0.05**3 < 0.5 * float(np.prod(high - low))  # with room for legs


def test_one_can_walk_between_the_chairs_but_not_through_the_tables(room_89: ImportedScene) -> None:
    truth = scene_truth(room_89.scene)
    middles = np.array(
        [item.box[:2] for item in (*objects(room_89.scene, "dining_table"), *objects(room_89.scene, "chair"))]
    )
    cells, inside = truth.walk.index(middles)
    assert inside.all()
    assert not truth.walk.free[tuple(cells.T)].any()
    assert 15 < truth.walk.free.sum() * 0.05**2 < 30


# ---------------------------------------------------------------- habitat


def test_the_stage_lies_as_its_configuration_says() -> None:
    rows: dict[str, str | Label] = {"Cube": "floor", "Cube.001": "object"}
    rows |= {f"Cube.00{k}": Label("dining_table", "table", "top" if k == 2 else None) for k in range(2, 7)}
    imported = import_scene(HABITAT / "simple_room.stage_config.json", table(rows), "simple")
    scene = imported.scene
    (desk,), (cube,) = objects(scene, "dining_table"), objects(scene, "object")
    assert np.allclose(cube.box[3:6], 2.0, atol=1e-3)
    assert np.allclose(desk.box[3:6], [1.4, 1.4, 1.011], atol=2e-3)
    assert all(part.solid is not None for item in scene.objects for part in item.parts)
    assert any("the floor lies at z = 0.1455 m" in note for note in imported.notes)
    truth = scene_truth(scene)
    solid = (truth.occupancy.instance == cube.object_id).sum() * 0.05**3
    assert solid == pytest.approx(8.0, rel=0.08)
    assert not truth.walk.free[tuple(truth.walk.index(cube.box[None, :2])[0][0])]


def test_a_scene_of_stage_and_chairs(tmp_path: Path) -> None:
    folder = tmp_path / "habitat"
    shutil.copytree(HABITAT, folder)
    half = math.sqrt(0.5)
    instances = [
        {"template_name": "objects/chair", "translation": [-2.0, 0.81, 1.0]},
        {"template_name": "objects/chair", "translation": [-2.0, 0.81, 3.0], "rotation": [half, 0, half, 0]},
    ]
    document = {"stage_instance": {"template_name": "stages/simple_room"}, "object_instances": instances}
    (folder / "two.scene_instance.json").write_text(json.dumps(document))
    rows: dict[str, str | Label] = {"Cube": "floor", "chair": Label("chair", movable=True)}
    rows |= {"Cube.001": "object"} | {f"Cube.00{k}": "object" for k in range(2, 7)}
    scene = import_scene(folder / "two.scene_instance.json", table(rows), "two").scene
    first, second = objects(scene, "chair")
    # The middle of the box along the axes of the file; that of the smallest rectangle lies millimetres beside.
    assert np.allclose(first.box[:2], [-2.0, -1.0], atol=0.01)
    assert np.allclose(second.box[:2], [-2.0, -3.0], atol=0.01)
    assert first.box[2] == pytest.approx(0.81 - 0.1455, abs=1e-3)
    assert np.allclose(first.box[3:6], second.box[3:6], atol=1e-3)
    assert second.box[6] - first.box[6] == pytest.approx(math.pi / 2, abs=1e-3)
    assert first.movable


# ---------------------------------------------------------------- the living room of CC0 models


HALF = math.sqrt(0.5)
PLACED = [  # read off furnished_living_room.dmd.yaml by hand: yaw in degrees as a quaternion about z
    {"file": "living_room.gltf"},
    {"file": "painted_wooden_cabinet_1k.gltf", "name": "cabinet", "category": "sideboard",
     "translation": [-1.7753, 2.5818, 0]},
    {"file": "wooden_bookshelf_worn_1k.gltf", "name": "bookshelves", "category": "bookshelf",
     "translation": [2.716, -1.0716, 0], "rotation": [HALF, 0, 0, -HALF]},
    {"file": "painted_wooden_cabinet_02_1k.gltf", "name": "tall_cabinet", "category": "wardrobe",
     "translation": [0.0235, 2.6566, 0]},
    {"file": "sofa_03_1k.gltf", "name": "sofa", "category": "sofa", "translation": [0, -2.4117, 0],
     "rotation": [0, 0, 0, 1]},
    {"file": "painted_wooden_stool_1k.gltf", "name": "stool", "category": "stool", "translation": [1.7744, 1.6287, 0],
     "rotation": [math.cos(math.pi / 12), 0, 0, math.sin(math.pi / 12)]},
    {"file": "curtain_open.gltf", "name": "curtains", "category": "curtain"},
]  # fmt: skip
LABELS = [
    {"node": "walls", "category": "wall"}, {"node": "base board", "category": "wall"},
    {"node": "walls", "part": "Floor", "category": "floor"},
    {"node": "walls", "part": "Ceiling paint", "category": "ceiling"},
    {"node": "walls", "part": "Glass", "category": "window", "object": "window"},
    {"node": "walls", "part": "window_frame", "category": "window", "object": "window"},
    {"node": "door", "category": "door", "object": "door", "role": "door"},
    {"node": "door_frame", "category": "door", "object": "door"},
    {"node": "door knob", "category": "door", "object": "door", "role": "handle"},
    {"node": "curtain_rod", "category": "ignore"},
    *({"node": f"light{k}", "category": "ceiling_lamp"} for k in range(4)),
    {"node": "painted_wooden_stool", "role": "seat"},
    *({"node": f"painted_wooden_cabinet_{what}_0{k}", "role": what} for what in ("drawer", "door") for k in (1, 2)),
]  # fmt: skip


@pytest.fixture(scope="module")
def living(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The imported scene folder; the models are copied, as a scene and its files lie together."""
    folder = tmp_path_factory.mktemp("drake")
    shutil.copytree(DRAKE, folder / "models")
    (folder / "models" / "living.json").write_text(json.dumps({"models": PLACED}))
    (folder / "labels.json").write_text(json.dumps({"labels": LABELS}))
    arguments = [
        str(folder / "models" / "living.json"),
        "--labels",
        str(folder / "labels.json"),
        "--out",
        str(folder / "scene"),
    ]
    assert run(["import", "scene", *arguments]) == 0
    return folder / "scene"


def test_the_living_room_is_furnished_as_its_placement_says(living: Path) -> None:
    scene = read_scene(living)
    yaws = {"bookshelf": -90.0, "sofa": 180.0, "stool": 30.0, "sideboard": 0.0, "wardrobe": 0.0}
    for category, yaw in yaws.items():
        (item,) = objects(scene, category)
        assert math.degrees(math.remainder(item.box[6] - math.radians(yaw), 2 * math.pi)) == pytest.approx(0, abs=0.02)
        placed = next(entry for entry in PLACED if entry.get("category") == category)
        assert np.linalg.norm(item.box[:2] - np.array(placed["translation"])[:2]) < 0.06  # type: ignore[index]
    assert scene.rooms[0].area_m2 == pytest.approx(36.0, rel=1e-6)
    assert scene.height_m == pytest.approx(3.2)
    (sofa,) = objects(scene, "sofa")
    assert np.allclose(sofa.box[3:6], [2.73, 0.925, 1.118], atol=2e-3)
    assert {p.role for p in objects(scene, "sideboard")[0].parts} == {None, "door", "drawer"}
    assert {p.role for p in objects(scene, "door")[0].parts} == {None, "door", "handle"}
    source = json.loads((living / "source.json").read_text())
    assert any("grey in their place: textures/" in note for note in source["notes"])
    assert "sofa_03.bin" in source["files"]


def test_the_living_room_can_be_seen_and_walked_in(living: Path) -> None:
    scene, occupancy = read_scene(living), read_occupancy(living)
    # The sofa of closed cushions is full: at least nine tenths of what lies well within its hull at seat height.
    (sofa,) = objects(scene, "sofa")
    grid = occupancy.grid
    inside, _ = grid.index(sofa.box[None, :3] + np.array([[x, 0.0, -0.3] for x in np.linspace(-0.9, 0.9, 19)]))
    assert (occupancy.instance[tuple(inside.T)] == sofa.object_id).mean() > 0.9
    with np.load(living / "walkable.npz") as walk:
        free = walk["free"].sum() * float(walk["cell_m"]) ** 2
    assert 15 < free < 28
    # A camera in a corner: every pixel meets something, and what a trimesh ray meets lies at the same depth.
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.column_stack([[0.8, -0.6, 0], [0, 0, -1], [0.6, 0.8, 0]]), (-2.5, -2.5, 1.5)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    image = ray_image(scene, PinholeCamera(80, 60, 60.0, 60.0, 40.0, 30.0), pose)
    assert np.isfinite(image.depth_m).all()
    whole = trimesh.util.concatenate(
        [
            trimesh.Trimesh(apply(o.scene_T_object, p.vertices), p.triangles, process=False)
            for o in scene.objects
            for p in o.parts
        ]
    )
    rays = PinholeCamera(80, 60, 60.0, 60.0, 40.0, 30.0).rays().reshape(-1, 3) @ pose[:3, :3].T
    hits, index, _ = whole.ray.intersects_location(np.tile(pose[:3, 3], (len(rays), 1)), rays, multiple_hits=False)
    depth = np.full(len(rays), np.nan)
    depth[index] = (hits - pose[:3, 3]) @ pose[:3, 2]
    close = np.abs(depth - image.depth_m.ravel()) < 1e-3
    assert close.mean() > 0.995  # embree is float32 and may slip past an edge


def test_the_living_room_goes_out_and_comes_back(living: Path, tmp_path: Path) -> None:
    scene = read_scene(living)
    (tmp_path / "living.glb").write_bytes(glb_bytes(scene))
    again = import_scene(tmp_path / "living.glb", LabelTable({}), scene.scene_id).scene
    assert np.allclose([o.box for o in again.objects], [o.box for o in scene.objects], atol=2e-6)
    grid = scene_grid(scene)
    assert np.array_equal(solid_occupancy(again, grid)[1], solid_occupancy(scene, grid)[1])
    drawn = plan_svg(scene)
    assert all(f">{name}<" in drawn for name in ("sofa", "bookshelf", "stool", "sideboard", "wardrobe"))


# ---------------------------------------------------------------- affordance


def afforded(scene: Scene) -> dict[Affordance, set[str]]:
    """Categories of the objects with a part of each label, for people who are on the largest piece of free floor."""
    parts = scene_truth(scene).affordance.parts
    assert parts is not None
    names = np.array([scene.object(i).category_name for i in parts.object_id.tolist()])
    return {kind: set(names[parts.labels >> kind & 1 == 1].tolist()) for kind in Affordance}


@pytest.mark.slow
def test_the_living_room_is_used_as_such_rooms_are(living: Path) -> None:
    """35,000 triangles, hardly a convex piece. The sofa is one mesh: its seat is sat upon, arms and back are not."""
    scene, found = read_scene(living), read_affordance(living)
    assert found.parts is not None
    names = np.array([scene.object(i).category_name for i in found.parts.object_id.tolist()])
    having = {kind: set(names[found.parts.labels >> kind & 1 == 1].tolist()) for kind in Affordance}
    assert having[Affordance.SITTABLE] == {"sofa", "stool"}
    assert having[Affordance.OPENABLE] == {"door", "sideboard"}
    assert having[Affordance.INTERACTABLE] == {"door", "sideboard", "bookshelf", "wardrobe"}
    assert {"bookshelf", "wardrobe", "sideboard", "stool"} <= having[Affordance.SUPPORTABLE]
    assert not {"ceiling_lamp", "ceiling"} & set().union(*having.values())
    half = len(found.labels) // 2
    cells = np.argwhere(found.labels >> Affordance.SITTABLE & 1 == 1) + 0.5
    xy = (half - cells) * found.cell_m
    (sofa,) = objects(scene, "sofa")
    local = (xy - sofa.box[:2]) @ sofa.scene_T_object[:2, :2]
    on_it = (np.abs(local) < sofa.box[3:5] / 2).all(axis=1)
    assert 1.0 < on_it.sum() * found.cell_m**2 < 1.6  # three cushions of about .6 x .7 m
    assert (np.abs(local[on_it, 0]) < sofa.box[3] / 2 - 0.3).all()  # the arms are wider


@pytest.mark.slow
def test_the_chairs_of_the_room_are_sat_upon_and_its_tables_used(room_89: ImportedScene) -> None:
    having = afforded(room_89.scene)
    assert having[Affordance.SITTABLE] == {"chair"}
    assert having[Affordance.INTERACTABLE] == {"dining_table"}
    assert not having[Affordance.OPENABLE] | having[Affordance.LYABLE]


def test_the_habitat_table_is_in_reach_and_nothing_is_a_seat() -> None:
    rows: dict[str, str | Label] = {"Cube": "floor", "Cube.001": "object"}
    rows |= {f"Cube.00{k}": Label("dining_table", "table", "top" if k == 2 else None) for k in range(2, 7)}
    having = afforded(import_scene(HABITAT / "simple_room.stage_config.json", table(rows), "simple").scene)
    assert having[Affordance.INTERACTABLE] == {"dining_table"}
    assert not having[Affordance.SITTABLE]
