"""Boxes of a room as truth of an RGB-D capture: against exact geometry, on the command line, and what is refused."""

from __future__ import annotations

import copy
import json
import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.annotation import store
from hsbench.datasets.annotation.box_truth import BoxTruth, box_truth, scene_of
from hsbench.datasets.annotation.boxes import BoxLabels, in_episode_frame, read_boxes, write_boxes
from hsbench.datasets.annotation.plan import PlanRegion, write_plan
from hsbench.datasets.annotation.swept import LEAST_M, RADIUS_M, swept_by_joints
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.capture_set import add_capture, add_captures
from hsbench.errors import DataError, SchemaError
from hsbench.evaluation.score import score
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.polygons import contains
from hsbench.geometry.transforms import apply, invert
from hsbench.io.atomic import write_json
from hsbench.io.checksums import manifest, sha256_file
from hsbench.io.images import depth_from_mm, depth_to_mm
from hsbench.schema.episode import Episode, Frame, FrameList
from hsbench.schema.events import EventTable
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import KINECT_V2
from hsbench.schema.states import Affordance, Evidence, Visibility, VoxelState
from hsbench.submission import Metadata, write_submission
from hsbench.tasks.scene_completion import GRID
from hsbench.tasks.scene_completion import SCENE_COMPLETION as SPEC
from hsbench.truth.objects import object_truth
from hsbench.truth.occupancy import solid_occupancy
from hsbench.truth.sight import ray_image, true_states
from tests.unit.datasets.mutations import mutated, refused, refused_or_read

SENSOR = Sensor("rgbd", PinholeCamera(160, 120, 113.0, 113.0, 80.0, 60.0), 1.6, 0.35)
ROOM: dict[str, Any] = {
    "format": "hsbench-boxes",
    "version": 1,
    "frame": "episode",
    "room": {"room_type": "living", "outline_xy": [[-0.5, -2], [4, -2], [4, 2], [-0.5, 2]], "height_m": 2.5},
    "boxes": [
        {"id": 1, "category": "wardrobe", "centre_m": [2.2, 0.9, 0.9], "size_m": [1.2, 0.5, 1.8], "yaw_deg": 90},
        {
            "id": 2, "category": "chair", "centre_m": [2.9, -0.8, 0.45], "size_m": [0.5, 0.5, 0.9], "yaw_deg": -30,
            "movable": True, "touched": True,
            "parts": [
                {"name": "seat", "role": "seat", "centre_m": [0, 0, 0.22], "size_m": [0.5, 0.5, 0.44]},
                {"name": "back", "role": None, "centre_m": [0, 0.22, 0.45], "size_m": [0.5, 0.06, 0.9]},
            ],
        },
        {"id": 7, "category": "storage_box", "centre_m": [3.2, 1.4, 0.2], "size_m": [0.4, 0.4, 0.4], "yaw_deg": 0},
    ],
}  # fmt: skip


def labels_of(root: dict[str, Any], tmp_path: Path) -> BoxLabels:
    path = tmp_path / "boxes.json"
    path.write_text(json.dumps(root))
    return read_boxes(path)


def depth_of(scene: Scene) -> np.ndarray:
    """What an exact camera measures of a scene, as stored: whole millimetres."""
    depth_m = ray_image(scene, SENSOR.camera, SENSOR.world_T_camera).depth_m  # type: ignore[arg-type]
    return depth_from_mm(depth_to_mm(depth_m))


def capture(scene: Scene, poses: PoseTable | None = None) -> Episode:
    depth_m = depth_of(scene)
    frames = tuple(Frame(k * 10**9, np.zeros((120, 160, 3), dtype=np.uint8), depth_m) for k in range(3))
    return Episode("day-1", "lab", SENSOR, FrameList(frames), poses, 0, 2 * 10**9)


def walk(along_xy: list[tuple[float, float]], seconds: float = 2.0) -> PoseTable:
    """An upright, tracked skeleton of the right proportions that is at each place for a moment."""
    n = len(along_xy)
    upright = np.zeros((25, 3))
    heights = {"spine_base": 0.9, "spine_mid": 1.15, "spine_shoulder": 1.4, "neck": 1.45, "head": 1.6}
    for k, name in enumerate(KINECT_V2.names):
        side = 0.18 * (("left" in name) - ("right" in name))
        upper = {"shoulder": 1.38, "elbow": 1.1, "wrist": 0.9, "hand": 0.85, "thumb": 0.85}
        lower = {"hip": 0.9, "knee": 0.5, "ankle": 0.08, "foot": 0.03}
        height = {**upper, **lower}.get(name.split("_")[0], heights.get(name, 1.0))
        upright[k] = (0.0, side, height)
    joints = upright[None] + np.pad(np.array(along_xy), ((0, 0), (0, 1)))[:, None]
    stamps = np.round(np.linspace(0, seconds, n) * 1e9).astype(np.int64)
    states = np.full((n, 25), JointState.TRACKED, dtype=np.uint8)
    return PoseTable(KINECT_V2.name, stamps, np.ones(n, dtype=np.int32), states, joints.astype(np.float32))


def made(root: dict[str, Any], tmp_path: Path, poses: PoseTable | None = None) -> tuple[BoxTruth, Scene]:
    labels = labels_of(root, tmp_path)
    scene = scene_of(in_episode_frame(labels, 1.6), "room-1")
    return box_truth(labels, capture(scene, poses), "room-1", GRID), scene


def test_truth_is_what_a_generated_room_of_these_boxes_has(tmp_path: Path) -> None:
    found, scene = made(ROOM, tmp_path)
    image = ray_image(scene, SENSOR.camera, SENSOR.world_T_camera)  # type: ignore[arg-type]
    semantic, instance = solid_occupancy(scene, GRID)
    states = true_states(scene, GRID, SENSOR.camera, SENSOR.world_T_camera, image)  # type: ignore[arg-type]
    assert (found.occupancy.semantic == semantic).all()
    assert (found.occupancy.instance == instance).all()
    assert (found.occupancy.state == states).mean() > 0.9995  # depth is stored in millimetres
    none = EventTable(*(np.zeros(0, t) if t else () for t in (np.int32, 0, np.int32, 0, np.int64, np.int64, 0)))  # type: ignore[arg-type]
    exact = object_truth(scene, image, found.occupancy, none)
    assert (found.objects.amodal_px == exact.amodal_px).all()
    assert (found.objects.visible_px == exact.visible_px).all()
    assert found.explained == 1.0
    assert not np.isfinite(found.occupancy.swept_s).any()


def test_visibility_and_evidence_of_each_object(tmp_path: Path) -> None:
    around = [(2.9 + 0.62 * math.cos(a), -0.8 + 0.62 * math.sin(a)) for a in np.linspace(0, 2 * np.pi, 120)]
    root = copy.deepcopy(ROOM)
    root["boxes"][1]["touched"] = False
    found, scene = made(root, tmp_path, walk(around))
    of = {item.object_id: k for k, item in enumerate(scene.objects)}
    seen = found.objects.visibility
    assert seen[of[1]] == Visibility.VISIBLE
    assert seen[of[2]] == Visibility.VISIBLE
    assert seen[of[7]] == Visibility.FULLY_OCCLUDED  # behind the wardrobe, and labelled nevertheless
    assert found.objects.amodal_px[of[7]] > 100
    assert found.objects.evidence[of[2]] == Evidence.SKIRTED
    assert found.objects.evidence[of[1]] == Evidence.NEITHER
    touched, _ = made(ROOM, tmp_path, walk(around))
    assert touched.objects.evidence[of[2]] == Evidence.USED
    assert found.occupancy.solid[found.occupancy.instance == 7].all()
    assert (found.occupancy.state[found.occupancy.instance == 7] == VoxelState.OCCLUDED).mean() > 0.9


def test_what_nobody_labelled_hides_too(tmp_path: Path) -> None:
    """The capture shows a pillar before the chair; the labels do not know of it."""
    root = copy.deepcopy(ROOM)
    pillar = {"id": 9, "category": "wardrobe", "centre_m": [2.0, -0.6, 0.5], "size_m": [0.3, 0.3, 1], "yaw_deg": 0}
    root["boxes"].append(pillar)
    full = scene_of(in_episode_frame(labels_of(root, tmp_path), 1.6), "room-1")
    found = box_truth(labels_of(ROOM, tmp_path), capture(full), "room-1", GRID)
    chair = [item.object_id for item in found.scene.objects].index(2)
    in_full = [item.object_id for item in full.objects].index(2)
    image = ray_image(full, SENSOR.camera, SENSOR.world_T_camera)  # type: ignore[arg-type]
    assert found.objects.visible_px[chair] == (image.owner == in_full).sum()
    assert found.objects.visible_px[chair] < 0.6 * found.objects.amodal_px[chair]
    assert 0.5 <= found.explained < 0.95


def test_the_camera_frame_begins_at_the_camera(tmp_path: Path) -> None:
    root = copy.deepcopy(ROOM)
    root["frame"] = "camera"
    for box in root["boxes"]:
        box["centre_m"][2] -= 1.6
    there, here = (in_episode_frame(labels_of(r, tmp_path), 1.6) for r in (root, ROOM))
    for a, b in zip(there.boxes, here.boxes, strict=True):
        assert np.allclose(a.centre_m, b.centre_m)
    with pytest.raises(DataError, match=r"box 1 \(wardrobe\) reaches from .* expected between floor and ceiling"):
        in_episode_frame(replace(labels_of(root, tmp_path), frame="episode"), 1.6)


@settings(max_examples=40)
@given(st.floats(-350, 350), st.floats(0.2, 1.5), st.floats(0.2, 1.5), st.floats(0.2, 2), st.floats(1, 3))
def test_the_object_has_the_box_that_was_drawn(
    yaw: float, length: float, width: float, height: float, x: float
) -> None:
    labels = BoxLabels("episode", "living", np.array(ROOM["room"]["outline_xy"]), 2.5, ())
    from hsbench.datasets.annotation.boxes import _box

    row = {
        "id": 4,
        "category": "desk",
        "centre_m": [x, 0.5, height / 2],
        "size_m": [length, width, height],
        "yaw_deg": yaw,
    }
    box = _box(row, "x")
    item = next(o for o in scene_of(replace(labels, boxes=(box,)), "r").objects if o.object_id == 4)
    assert np.allclose(item.box[:3], [x, 0.5, height / 2], atol=2e-4)
    assert np.allclose(item.box[3:6], [length, width, height], atol=1e-4)
    turn = (item.box[6] - math.radians(yaw) + np.pi) % (2 * np.pi) - np.pi
    assert abs(turn) < math.radians(0.011)


def test_the_room_has_walls_outside_of_its_outline(tmp_path: Path) -> None:
    root = copy.deepcopy(ROOM)
    root["room"]["outline_xy"] = [[-1, -2], [-1, 2], [3, 2], [3, 0.5], [4, 0.5], [4, -2]]  # clockwise, with a corner
    labels = labels_of(root, tmp_path)
    scene = scene_of(labels, "room-1")
    walls = [item for item in scene.objects if item.category_name == "wall"]
    assert len(walls) == 6
    assert [o.object_id for o in scene.objects] == list(range(1, 12))
    for wall in walls:
        middle = apply(wall.scene_T_object, np.array([0.0, 0.05, 1.0]))
        assert not contains(labels.outline_xy, middle[:2])
        inside = apply(wall.scene_T_object, np.array([0.0, -0.05, 1.0]))
        assert contains(labels.outline_xy, inside[:2])


@pytest.mark.parametrize("door", [False, True])
def test_parts_with_roles_afford_what_they_do_in_generated_rooms(door: bool, tmp_path: Path) -> None:
    root = copy.deepcopy(ROOM)
    if door:
        size, centre = [0.9, 0.1, 2.0], [-0.55, 1.2, 1.0]
        root["boxes"].append({"id": 12, "category": "door", "centre_m": centre, "size_m": size, "yaw_deg": 90})
    labels = labels_of(root, tmp_path)
    own = capture(scene_of(labels, "r"))
    assert box_truth(labels, own, "r", GRID).affordance is None
    found = box_truth(labels, own, "r", GRID, affordance=True).affordance
    assert found is not None
    assert found.labels.shape == (256, 256)
    assert found.voxels is not None
    assert found.voxels.grid == GRID
    assert found.parts is not None
    of = dict(zip(zip(found.parts.object_id.tolist(), found.parts.part, strict=True), found.parts.labels, strict=True))
    assert of[(2, "seat")] >> Affordance.SITTABLE & 1
    assert not of[(2, "back")] >> Affordance.SITTABLE & 1
    assert not of[(1, "box")] >> Affordance.SITTABLE & 1
    row, column = round((6.4 - 1.0) / 0.05), round((6.4 - 0.0) / 0.05)
    assert found.labels[row, column] >> Affordance.WALKABLE & 1  # in the middle of the free floor
    assert not found.labels[round((6.4 - 2.2) / 0.05), round((6.4 - 0.9) / 0.05)] >> Affordance.WALKABLE & 1


def test_a_corner_given_twice_is_one(tmp_path: Path) -> None:
    root = copy.deepcopy(ROOM)
    corners = root["room"]["outline_xy"]
    root["room"]["outline_xy"] = [*corners, corners[0]]
    twice, once = (scene_of(labels_of(r, tmp_path), "r") for r in (root, ROOM))
    assert sorted(twice.rooms[0].outline_xy.tolist()) == sorted(once.rooms[0].outline_xy.tolist())
    assert len(twice.objects) == len(once.objects) == 3 + 2 + 4


def test_bodies_sweep_what_a_tracked_bone_holds() -> None:
    grid = VoxelGrid((0.0, -0.5, 0.0), (20, 20, 40), 0.05)
    poses = walk([(0.5, 0.0)])
    swept = swept_by_joints(poses, 0, grid)
    joints = poses.joints_m[0].astype(np.float64)  # type: ignore[index]
    centres = grid.centres()
    expected = np.zeros(grid.shape, dtype=np.bool_)
    for parent, child in KINECT_V2.bones:
        name = KINECT_V2.names[child].removesuffix("_left").removesuffix("_right")
        a, along = joints[parent], joints[child] - joints[parent]
        share = np.clip((centres - a) @ along / max(along @ along, 1e-12), 0, 1)
        gap = np.linalg.norm(centres - a - share[..., None] * along, axis=-1)
        expected |= gap <= RADIUS_M.get(name, LEAST_M)
    assert (np.isfinite(swept) == expected).all()
    guessed = replace(poses, joint_state=np.full_like(poses.joint_state, JointState.INFERRED))
    assert not np.isfinite(swept_by_joints(guessed, 0, grid)).any()
    assert not np.isfinite(swept_by_joints(None, 0, grid)).any()
    late = replace(poses, timestamp_ns=poses.timestamp_ns + 5 * 10**9)
    assert swept_by_joints(late, 3 * 10**9, grid)[expected].max() == 2.0


def test_boxes_read_back_as_written(tmp_path: Path) -> None:
    labels = labels_of(ROOM, tmp_path)
    write_boxes(tmp_path / "again.json", labels)
    write_boxes(tmp_path / "thrice.json", read_boxes(tmp_path / "again.json"))
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "thrice.json").read_bytes()
    again = read_boxes(tmp_path / "again.json")
    assert [(b.object_id, b.category, b.movable, b.touched, len(b.parts)) for b in again.boxes] == [
        (b.object_id, b.category, b.movable, b.touched, len(b.parts)) for b in labels.boxes
    ]


WRONG: tuple[tuple[tuple[Any, ...], Any, str], ...] = (
    (("format",), "boxes", "format and version"),
    (("frame",), "world", "frame is 'world'"),
    (("room",), None, "room is null"),
    (("room", "outline_xy"), [[0, 0], [2, 2], [2, 0], [0, 2]], "room.outline_xy: .* cross or touch"),
    (("room", "outline_xy"), [[0, 0], [2000, 0], [0, 2000]], "expected metres"),
    (("room", "height_m"), 250, "room.height_m is 250"),
    (("boxes",), [], "boxes is empty"),
    (("boxes",), [{}] * 3000, "3,000 items"),
    (("boxes", 0), None, r"boxes\[0\] is null"),
    (("boxes", 1, "id"), 1, r"boxes\[1\] has id 1 of boxes\[0\]"),
    (("boxes", 1, "id"), 0, r"boxes\[1\].id is 0"),
    (("boxes", 1, "category"), "throne", r"boxes\[1\].category is 'throne'"),
    (("boxes", 0, "size_m"), [1, -1, 1], r"boxes\[0\] \(wardrobe\).size_m is \[1.0, -1.0, 1.0\]"),
    (("boxes", 0, "size_m"), [0, 1, 1], r"size_m is \[0.0, 1.0, 1.0\]"),
    (("boxes", 0, "size_m"), [1, 1], "2 values; expected 3|expected 3"),
    (("boxes", 0, "size_m"), [60, 25, 90], "expected metres"),
    (("boxes", 0, "centre_m"), [1, None, 1], r"centre_m\[1\] is null"),
    (("boxes", 0, "centre_m"), [2200, 900, 900], r"centre_m\[0\] is 2200"),
    (("boxes", 0, "yaw_deg"), 400, "yaw_deg is 400; expected degrees"),
    (("boxes", 0, "yaw"), 1, r"boxes\[0\] has unknown 'yaw'"),
    (("boxes", 1, "touched"), "yes", "touched is 'yes'"),
    (("boxes", 1, "parts", 0, "role"), "mattress", r"parts\[0\].role is 'mattress'.*seat"),
    (("boxes", 1, "parts", 0, "size_m"), [0.9, 0.5, 0.44], "parts reach from .* expected the sides"),
)


@pytest.mark.parametrize(("keys", "value", "match"), WRONG)
def test_malformed_boxes_are_refused_naming_file_and_item(
    keys: tuple[Any, ...], value: Any, match: str, tmp_path: Path
) -> None:  # fmt: skip
    root = copy.deepcopy(ROOM)
    place: Any = root
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    path = tmp_path / "boxes.json"
    path.write_text(json.dumps(root))
    refused(read_boxes, path, match)


def test_files_that_are_no_json_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "boxes.json"
    for text, match in (("", "is empty"), ("[]", "is a list"), ('{"format": NaN}', "NaN"), ("{", "no valid JSON")):
        path.write_text(text)
        refused(read_boxes, path, match)


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_boxes_are_refused_or_read(data: st.DataObject, tmp_path: Path) -> None:
    damaged = data.draw(mutated(json.dumps(ROOM).encode()))
    refused_or_read(read_boxes, tmp_path / "bad.json", damaged, lambda b: scene_of(in_episode_frame(b, 1.6), "r"))


def test_boxes_that_do_not_fit_the_capture_are_refused(tmp_path: Path) -> None:
    labels = labels_of(ROOM, tmp_path)
    own = capture(scene_of(labels, "r"))
    outside = copy.deepcopy(ROOM)
    outside["boxes"][0]["centre_m"] = [2.2, 3.2, 0.9]
    with pytest.raises(DataError, match=r"box 1 \(wardrobe\) is centred 1.20 m outside of the room"):
        box_truth(labels_of(outside, tmp_path), own, "r", GRID)
    away = copy.deepcopy(ROOM)
    away["room"]["outline_xy"] = [[1, -2], [4, -2], [4, 2], [1, 2]]
    with pytest.raises(DataError, match=r"camera stands at \(0, 0\), 1.00 m outside"):
        box_truth(labels_of(away, tmp_path), own, "r", GRID)
    mirrored = copy.deepcopy(ROOM)
    for box in mirrored["boxes"]:
        box["centre_m"][1] *= -1
    with pytest.raises(DataError, match="of the points measured in the room lie on something annotated"):
        box_truth(labels_of(mirrored, tmp_path), own, "r", GRID)
    with pytest.raises(DataError, match="boxes need an RGB-D camera"):
        box_truth(labels, replace(own, sensor=Sensor("monocular", SENSOR.camera, None)), "r", GRID)
    with pytest.raises(DataError, match="no depth pictures"):
        box_truth(labels, replace(own, frames=FrameList()), "r", GRID)


def test_an_annotated_capture_is_verified_predicted_and_scored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, boxes, plan = tmp_path / "data", tmp_path / "boxes.json", tmp_path / "plan.json"
    labels = labels_of(ROOM, tmp_path)
    passing = [(1.0 + 0.02 * k, -1.4) for k in range(100)]
    add_capture(data, capture(scene_of(labels, "r"), walk(passing)))
    inputs = {n: h for n, h in manifest(data / "episodes" / "day-1").items() if n.startswith("inputs")}
    call = ["annotate", "boxes", str(boxes), "--data", str(data), "--episode", "day-1"]
    assert run(call) == 0
    out = capsys.readouterr().out
    assert "100.0% of the points" in out
    assert out.splitlines()[-1] == f"next: hsbench verify {data}"
    record = {"file": "boxes.json", "sha256": sha256_file(boxes), "explained": 1.0}
    assert store.read_record(data, "day-1") == dict.fromkeys(("scene", "occupancy", "objects"), record)
    assert "7 storage_box: fully occluded (0 of" in out
    square = np.array([[0.0, -1.0], [2.0, -1.0], [2.0, 1.0], [0.0, 1.0]])
    write_plan(plan, (PlanRegion("walkable", (square,)),))
    assert run(["annotate", "plan", str(plan), "--data", str(data), "--episode", "day-1"]) == 0
    assert "4.00 m2 walkable" in capsys.readouterr().out
    assert sorted(store.read_record(data, "day-1")) == ["affordance", "objects", "occupancy", "scene"]
    assert run(["verify", str(data)]) == 0
    assert {n: h for n, h in manifest(data / "episodes" / "day-1").items() if n.startswith("inputs")} == inputs
    truth = load(data, truth=True)[0].truth
    assert truth is not None
    assert truth.scene is not None
    assert truth.occupancy is not None
    assert truth.objects is not None
    assert truth.affordance is not None
    assert truth.affordance.labels.shape == (256, 256)
    pred = tmp_path / "pred"
    assert run(["predict", "carve", "--data", str(data), "--out", str(pred)]) == 0
    scoring = ["score", str(pred), "--task", "scene-completion", "--data", str(data), "--out", str(tmp_path / "r.json")]
    assert run(scoring) == 0
    report = json.loads((tmp_path / "r.json").read_text())
    assert 0.0 < report["primary"]["value"] < 1.0
    capsys.readouterr()
    assert run(call) == 2
    assert "truth of scene, occupancy, objects already; replace it: --replace" in capsys.readouterr().err
    before = manifest(data)
    assert run([*call, "--replace"]) == 0
    assert manifest(data) == before


def test_a_stop_while_storing_is_mended_by_storing_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = tmp_path / "data"
    add_capture(data, capture(scene_of(labels_of(ROOM, tmp_path), "r")))
    call = ["annotate", "boxes", str(tmp_path / "boxes.json"), "--data", str(data), "--episode", "day-1"]

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(store, "manifest", stop)
        assert run(call) == 130
    assert run(["verify", str(data)]) == 2
    assert not [path for path in data.rglob("*") if path.name.startswith(".")]
    assert run([*call, "--replace"]) == 0
    assert run(["verify", str(data)]) == 0


def test_what_is_annotated_is_scored_of_a_set_that_is_partly_so(tmp_path: Path) -> None:
    data, pred = tmp_path / "data", tmp_path / "pred"
    own = capture(scene_of(labels_of(ROOM, tmp_path), "r"))
    add_captures(data, [own, replace(own, episode_id="day-2"), replace(own, episode_id="day-3")])
    call = ["annotate", "boxes", str(tmp_path / "boxes.json"), "--data", str(data), "--episode"]
    assert [run([*call, name]) for name in ("day-1", "day-3")] == [0, 0]
    loaded = load(data, truth=True)
    annotated = loaded.where(annotated=("occupancy", "objects"))
    assert annotated.episode_ids == ("day-1", "day-3")
    assert loaded.where(annotated=("affordance",)).episode_ids == ()
    assert loaded.where().episode_ids == loaded.episode_ids
    metadata = Metadata(SPEC.name, SPEC.version, "nothing", SPEC.tracks[0], causal=True)
    write_submission(pred, SPEC, metadata, ((e.episode_id, SPEC.dummy(e)) for e in annotated))
    counts = score("scene-completion", pred, annotated).counts
    assert (counts.scored, counts.missing) == (2, 0)
    with pytest.raises(SchemaError, match="annotated are truth"):
        load(data).where(annotated=("occupancy",))
    for wrong in ("occupancy", ("voxels",)):
        with pytest.raises(SchemaError, match="expected some of scene, poses"):
            loaded.where(annotated=wrong)


def test_what_has_no_truth_is_left_out_aloud(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, pred, out = tmp_path / "data", tmp_path / "pred", tmp_path / "r.json"
    own = capture(scene_of(labels_of(ROOM, tmp_path), "r"))
    add_captures(data, [own, *(replace(own, episode_id=f"day-{k}") for k in range(2, 12))])
    metadata = Metadata(SPEC.name, SPEC.version, "nothing", SPEC.tracks[0], causal=True)
    write_submission(pred, SPEC, metadata, ((e.episode_id, SPEC.dummy(e)) for e in load(data)))
    scoring = ["score", str(pred), "--task", SPEC.name, "--data", str(data), "--out", str(out)]
    assert run([*scoring, "--annotated-only"]) == 2
    assert "has no episode with truth for task scene-completion" in capsys.readouterr().err
    assert run(["annotate", "boxes", str(tmp_path / "boxes.json"), "--data", str(data), "--episode", "day-2"]) == 0
    assert run(scoring) == 2
    assert "episode day-1 has no truth for task scene-completion" in capsys.readouterr().err
    assert run([*scoring, "--annotated-only"]) == 0
    said = capsys.readouterr()
    assert "1 episodes of 1 scenes scored, 0 missing" in said.out
    names = "day-1, day-10, day-11, day-3, day-4, day-5, day-6, day-7, ..."
    assert f"note: 10 of 11 episodes have no truth for scene-completion and are left out: {names}\n" in said.err
    report = json.loads(out.read_text())
    assert report["split"] == "all, annotated"
    assert [row["episode_id"] for row in report["episodes"]] == ["day-2"]
    annotated = load(data, truth=True).where(annotated=("occupancy",))
    assert (
        score(SPEC.name, pred, load(data), annotated_only=True).metrics
        == score(SPEC.name, with_only(pred, tmp_path / "one", "day-2"), annotated).metrics
    )


def with_only(pred: Path, to: Path, episode_id: str) -> Path:
    """A submission with the answer to one episode alone."""
    shutil.copytree(pred, to)
    for file in (to / "predictions").iterdir():
        if file.stem != episode_id:
            file.unlink()
    return to


def test_generated_data_keep_their_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = tmp_path / "data"
    add_capture(data, capture(scene_of(labels_of(ROOM, tmp_path), "r")))
    description = json.loads((data / "dataset.json").read_text())
    write_json(data / "dataset.json", {**description, "recipe_sha256": "0" * 64})
    before = manifest(data)
    assert run(["annotate", "boxes", str(tmp_path / "boxes.json"), "--data", str(data), "--episode", "day-1"]) == 2
    assert "is generated and has exact truth" in capsys.readouterr().err
    assert manifest(data) == before


def test_the_camera_frame_is_upright() -> None:
    """Boxes turn about z alone: the frame of the camera has the tilt taken out."""
    assert np.allclose(
        invert(SENSOR.world_T_camera)[:3, :3].T @ np.array([0, 0, 1.0]), [np.cos(0.35), 0, -np.sin(0.35)]
    )
