"""SUN RGB-D on real files: frame img_0063 with boxes and layout, a raw Kinect v2 frame, a frame as VoteNet text.

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout. Pictures of what was projected
are written to the test's ``tmp_path``.
"""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.datasets.importers import upright
from hsbench.datasets.importers.room_captures import sunrgbd_episode, sunrgbd_text_episode
from hsbench.datasets.importers.sunrgbd import SunRgbdFrame, read_sunrgbd
from hsbench.datasets.importers.sunrgbd_text import read_sunrgbd_text
from hsbench.errors import DataError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.polygons import contains, distance
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.episode import Episode
from hsbench.schema.scene import Scene, SceneObject
from hsbench.typing import AnyArray, BoolArray, FloatArray
from tests.unit.datasets.mutations import attempt, mutated

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
SUN = REALDATA / "sunrgbd"
VOTENET = SUN / "votenet_000001"
KINECT2 = "2014-12-18_11-31-54_260595134347"
pytestmark = pytest.mark.skipif(not SUN.is_dir(), reason=f"needs the real captures in {SUN} (set HSBENCH_REALDATA)")
ANY_FILE = settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])

INSIDE = {"bookshelf": 70_000, "chair": 15_000, "object": 1_100, "books": 1_500}
"""Depth points that each box of img_0063 holds at least, by category: of 239,547."""


def copied(folder: Path) -> Path:
    """img_0063 as the data set has it: its annotation lies apart in the real files."""
    for path in sorted((SUN / "images" / "img_0063").rglob("*")):
        if path.is_file():
            target = folder / path.relative_to(SUN / "images" / "img_0063")
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    for source, name in (("annotation3D", "annotation3Dfinal"), ("annotation3Dlayout", "annotation3Dlayout")):
        (folder / name).mkdir()
        (folder / name / "index.json").write_bytes((SUN / f"img_0063_{source}.json").read_bytes())
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copied(tmp_path_factory.mktemp("sunrgbd") / "img_0063")


@pytest.fixture(scope="module")
def frame(folder: Path) -> SunRgbdFrame:
    return read_sunrgbd(folder, filled=True)


@pytest.fixture(scope="module")
def episode(frame: SunRgbdFrame) -> Episode:
    return sunrgbd_episode(frame, "img_0063")[0]


def scene_of(episode: Episode) -> Scene:
    assert episode.truth is not None
    assert episode.truth.scene is not None
    return episode.truth.scene


def points_of(episode: Episode) -> FloatArray:
    """(h, w, 3) of the depth image in the episode frame."""
    camera, depth = episode.sensor.camera, episode.frames[0].depth_m
    assert isinstance(camera, PinholeCamera)
    assert depth is not None
    return apply(episode.sensor.world_T_camera, camera.unproject(depth))


def pixels_of(episode: Episode, points: FloatArray) -> FloatArray:
    camera = episode.sensor.camera
    assert isinstance(camera, PinholeCamera)
    return camera.project(apply(invert(episode.sensor.world_T_camera), points))[0]


def covered(episode: Episode, item: SceneObject) -> BoolArray:
    """(h, w) pixels within the projected outline of an object."""
    depth = episode.frames[0].depth_m
    assert depth is not None
    mask = np.zeros(depth.shape, dtype=np.uint8)
    pixels = np.nan_to_num(pixels_of(episode, item.vertices), nan=-1.0).round().astype(np.int32)
    cv2.fillConvexPoly(mask, cv2.convexHull(pixels), 1)
    return mask.astype(bool)


def grown(item: SceneObject, points: FloatArray, margin_m: float) -> BoolArray:
    return item.solids[0].contains(points, -margin_m)


def draw(path: Path, episode: Episode) -> None:
    """The boxes on the picture, and beside it the points, boxes and room from above."""
    image = np.ascontiguousarray(episode.frames[0].rgb)
    scale, side = 100, 600
    plan = np.full((side, side, 3), 255, dtype=np.uint8)

    def above(xy: AnyArray) -> AnyArray:
        return (
            np.stack([side / 2 - xy[..., 1] * scale, side - 60 - xy[..., 0] * scale], axis=-1).round().astype(np.int32)
        )

    for u, v in above(points_of(episode).reshape(-1, 3)[::17, :2]):
        if 0 <= u < side and 0 <= v < side:
            plan[v, u] = 120
    scene = scene_of(episode)
    cv2.polylines(plan, [above(scene.rooms[0].outline_xy)], True, (0, 0, 0), 2)
    for item in scene.objects:
        colour = tuple(int(c) for c in np.random.default_rng(item.object_id).integers(60, 230, 3))
        triangles = item.solids[0].vertices[item.solids[0].triangles]
        for triangle in triangles:
            cv2.polylines(image, [pixels_of(episode, triangle).round().astype(np.int32)], True, colour, 1)
            cv2.polylines(plan, [above(triangle)], True, colour, 1)
    assert cv2.imwrite(str(path.with_name(path.stem + "_image.png")), image[..., ::-1])
    assert cv2.imwrite(str(path.with_name(path.stem + "_plan.png")), plan)


# depth and the upright frame


@pytest.mark.parametrize("name", ["img_0063", KINECT2])
@pytest.mark.parametrize("filled", [False, True])
def test_depth_is_that_of_a_room(name: str, filled: bool) -> None:
    found = read_sunrgbd(SUN / "images" / name, filled=filled)
    seen = found.depth_m[found.depth_m > 0]
    assert (len(seen) == found.depth_m.size) if filled else (0.6 < len(seen) / found.depth_m.size < 0.9)
    assert seen.min() > 0.5
    assert 2.0 < seen.max() < 8.0


def floor_plane(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """((3,) normal, (N,) distances) of the plane that holds most of the points less than 30 cm above the lowest."""
    low = points[points[:, 2] < np.percentile(points[:, 2], 0.5) + 0.3]
    rng = np.random.default_rng(0)
    best, plane = 0, (np.zeros(3), np.zeros(3))
    for _ in range(400):
        a, b, c = low[rng.choice(len(low), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        normal /= max(float(np.linalg.norm(normal)), 1e-12)
        held = int((np.abs((low[::5] - a) @ normal) < 0.01).sum())
        if held > best and abs(normal[2]) > 0.5:
            best, plane = held, (normal * np.sign(normal[2]), a)
    return plane[0], (points - plane[1]) @ plane[0]


def degrees_apart(a: FloatArray, b: FloatArray) -> float:
    return math.degrees(math.acos(min(1.0, float(a @ b))))


@pytest.mark.parametrize(("name", "share"), [("img_0063", 0.03), (KINECT2, 0.3)])
def test_the_floor_is_level_and_lowest(folder: Path, name: str, share: float) -> None:
    found = read_sunrgbd(folder if name == "img_0063" else SUN / "images" / name)
    points = found.camera.unproject(found.depth_m)[found.depth_m > 0] @ found.upright_R_camera.T
    outside = np.ones(len(points), dtype=bool)
    for box in found.boxes:
        outside &= distance(box.outline_xy, points[:, :2]) > 0.02
    normal, above = floor_plane(points[outside])
    assert degrees_apart(normal, np.array([0.0, 0.0, 1.0])) < 1.0
    assert (np.abs(above) < 0.02).sum() / len(points) > share
    # What the importer takes for the floor is that plane, below everything else.
    level = upright.floor_level(points[:, 2])
    on_it = points[outside][np.abs(above) < 0.02]
    assert abs(float(np.median(on_it[:, 2])) - level) < 0.02
    assert (points[:, 2] < level - 0.1).mean() < 0.001
    # With the rotation the other way round that plane would lean by twice the tilt of the camera.
    down = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    turned = down @ (down.T @ found.upright_R_camera).T @ found.upright_R_camera.T @ normal
    assert degrees_apart(turned, np.array([0.0, 0.0, 1.0])) > 20.0


# boxes


def test_every_box_lies_on_its_object(episode: Episode, tmp_path: Path) -> None:
    draw(tmp_path / "img_0063", episode)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["img_0063_image.png", "img_0063_plan.png"]
    points = points_of(episode)
    scene = scene_of(episode)
    assert [item.category_name for item in scene.objects] == [
        *("bookshelf", "bookshelf", "chair", "object", "books", "books", "object"),
    ]
    for item in scene.objects:
        inside = grown(item, points, 0.0)
        assert inside.sum() >= INSIDE[item.category_name]
        assert (inside & ~covered(episode, item)).mean() < 1e-4  # what it holds is where it is drawn
    # Four pixels in five that show a bookshelf's outline have a point in it, or in something else in front of it.
    for item in scene.objects[:2]:
        mask = covered(episode, item)
        held = np.any([grown(other, points, 0.03) for other in scene.objects], axis=0)
        assert held[mask].mean() > 0.8


def test_no_other_reading_of_the_axes_comes_near(episode: Episode) -> None:
    points = points_of(episode).reshape(-1, 3)
    scene = scene_of(episode)
    eye = np.array([0.0, 0.0, episode.sensor.height_m])

    def held(signs: tuple[int, int, int]) -> float:
        moved = (points - eye) * np.array(signs) + eye
        return float(np.any([item.solids[0].contains(moved) for item in scene.objects], axis=0).mean())

    right = held((1, 1, 1))
    assert right > 0.7  # of all depth points
    assert held((1, -1, 1)) < right - 0.2  # left and right exchanged
    assert held((1, 1, -1)) < right - 0.2  # up and down


def test_boxes_are_those_of_the_toolbox(folder: Path, episode: Episode) -> None:
    """Centre, sizes and front by the toolbox's formulas (readframeSUNRGBD.m), written here anew."""
    entries = json.loads((folder / "annotation3Dfinal" / "index.json").read_text())["objects"]
    found = [entry for entry in entries if entry is not None]
    assert len(found) == len(scene_of(episode).objects) == 7
    heading = episode.sensor.world_T_camera[:2, 2]
    frame = read_sunrgbd(folder)
    c, s = frame.upright_R_camera[:2, 2] / np.linalg.norm(frame.upright_R_camera[:2, 2])
    turn = np.array([[c, s], [-s, c]])
    np.testing.assert_allclose(heading / np.linalg.norm(heading), [1.0, 0.0], atol=1e-12)
    for entry, item in zip(found, scene_of(episode).objects, strict=True):
        polygon = entry["polygon"][0]
        x, z = np.array(polygon["X"]), np.array(polygon["Z"])
        centre = np.array([(x[0] + x[2]) / 2, (z[0] + z[2]) / 2])
        sizes = [math.dist((x[0], z[0]), (x[1], z[1])), math.dist((x[1], z[1]), (x[2], z[2]))]
        front = np.array([(x[0] + x[1]) / 2, (z[0] + z[1]) / 2]) - centre
        # Two of the outlines are no exact rectangles, but skewed by up to 5 mm.
        np.testing.assert_allclose(item.box[:2], turn @ centre, atol=0.006)
        np.testing.assert_allclose(item.box[3:5], sizes, atol=0.015)
        np.testing.assert_allclose(item.box[5], polygon["Ymax"] - polygon["Ymin"], atol=1e-4)
        looks = turn @ front / np.linalg.norm(front)
        assert -item.scene_T_object[:2, 1] @ looks > math.cos(math.radians(2.0))


def test_left_stays_left(episode: Episode) -> None:
    camera = episode.sensor.camera
    for item in scene_of(episode).objects:
        u = pixels_of(episode, item.box[None, :3])[0, 0]
        assert (item.box[1] > 0.05) <= (u < camera.width_px / 2)
        assert (item.box[1] < -0.05) <= (u > camera.width_px / 2)
    # The chair is on the right, as one sees in the picture.
    assert scene_of(episode).objects[2].box[1] < -0.5


def test_the_room_holds_what_is_seen(episode: Episode) -> None:
    scene = scene_of(episode)
    points = points_of(episode).reshape(-1, 3)[:, :2]
    outline = scene.rooms[0].outline_xy
    assert scene.rooms[0].room_type == "office"
    near = distance(outline, points[::11]) < 0.1
    assert near.mean() > 0.9
    mirrored = distance(outline * [1, -1], points[::11]) < 0.1
    assert mirrored.mean() < near.mean()
    assert contains(outline, scene.objects[2].box[None, :2])[0]


# text


def votenet_files(folder: Path, frame: SunRgbdFrame, source: Path) -> Path:
    """The frame as VoteNet's scripts write it: the toolbox's formulas for boxes, Rtilt and points, written here."""
    out = folder / "text"
    out.mkdir()
    R = np.array(
        [row.split()[:3] for row in sorted((source / "extrinsics").glob("*"))[-1].read_text().splitlines()], float
    )
    A, B = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]), np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    tilt = A @ R @ B
    K = np.array((source / "intrinsics.txt").read_text().split(), float).reshape(3, 3)
    (out / "calib.txt").write_text("\n".join(" ".join(f"{v:.6f}" for v in m.ravel(order="F")) for m in (tilt, K)))
    lines = []
    for entry in json.loads((source / "annotation3Dfinal" / "index.json").read_text())["objects"]:
        if entry is None:
            continue
        p = entry["polygon"][0]
        x, y = np.array(p["X"]), np.array(p["Z"])
        half = [math.dist((x[0], y[0]), (x[1], y[1])) / 2, math.dist((x[1], y[1]), (x[2], y[2])) / 2]
        centre = [(x[0] + x[2]) / 2, (y[0] + y[2]) / 2, -(p["Ymin"] + p["Ymax"]) / 2]
        front = np.array([(x[0] + x[1]) / 2 - centre[0], (y[0] + y[1]) / 2 - centre[1]])
        row = [0, 0, 1, 1, *centre, *half, (p["Ymax"] - p["Ymin"]) / 2, *front / np.linalg.norm(front)]
        lines.append(f"{entry['name']} " + " ".join(f"{v:.6f}" for v in row))
    (out / "label.txt").write_text("\n".join(lines))
    v, u = np.mgrid[1 : frame.depth_m.shape[0] + 1, 1 : frame.depth_m.shape[1] + 1]
    z = frame.depth_m.astype(float)
    flat = np.stack([(u - K[0, 2]) * z / K[0, 0], z, -(v - K[1, 2]) * z / K[1, 1]], axis=-1).reshape(-1, 3) @ tilt.T
    chosen = np.random.default_rng(0).choice(len(flat), 50_000, replace=False)
    np.savez_compressed(out / "pc.npz", pc=np.pad(flat[chosen], ((0, 0), (0, 3))).astype(np.float32))
    shutil.copyfile(next((source / "image").iterdir()), out / "image.jpg")
    return out


def test_text_and_folder_give_the_same_episode(
    folder: Path, frame: SunRgbdFrame, episode: Episode, tmp_path: Path
) -> None:
    out = votenet_files(tmp_path, frame, folder)
    found = read_sunrgbd_text(out / "label.txt", out / "calib.txt", out / "image.jpg", out / "pc.npz")
    other, _ = sunrgbd_text_episode(found, "text")
    assert other.sensor.height_m == pytest.approx(episode.sensor.height_m, abs=0.005)
    assert other.sensor.tilt_rad == pytest.approx(episode.sensor.tilt_rad, abs=1e-5)
    for ours, theirs in zip(scene_of(episode).objects, scene_of(other).objects, strict=True):
        assert ours.category_name == theirs.category_name
        np.testing.assert_allclose(theirs.box[:6] - [0, 0, other.sensor.height_m, 0, 0, 0],
                                   ours.box[:6] - [0, 0, episode.sensor.height_m, 0, 0, 0], atol=0.015)  # fmt: skip
        assert abs(math.remainder(theirs.box[6] - ours.box[6], 2 * math.pi)) < math.radians(2.0)
    assert found.depth_m is not None
    known = found.depth_m > 0
    assert 49_900 <= known.sum() <= 50_000
    np.testing.assert_allclose(found.depth_m[known], frame.depth_m[known], atol=1e-5)


def overlap(a: FloatArray, b: FloatArray) -> float:
    """Intersection over union of rectangles (left, top, right, bottom)."""
    sides = np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2])
    shared = float(np.prod(np.maximum(sides, 0)))
    return shared / float(np.prod(a[2:] - a[:2]) + np.prod(b[2:] - b[:2]) - shared)


def label_overlaps(calib: Path) -> list[float]:
    """How well the projected boxes of the real label file agree with its own rectangles."""
    found = read_sunrgbd_text(VOTENET / "label_000001.txt", calib, VOTENET / "image_000001.jpg")
    episode, _ = sunrgbd_text_episode(found, "a")
    lines = (VOTENET / "label_000001.txt").read_text().splitlines()
    shares = []
    for line, item in zip(lines, scene_of(episode).objects, strict=True):
        left, top, width, height = (float(value) for value in line.split()[1:5])
        pixels = pixels_of(episode, item.vertices)
        size = np.array([found.camera.width_px, found.camera.height_px])
        low, high = np.clip(pixels.min(axis=0), 0, size), np.clip(pixels.max(axis=0), 0, size)
        shares.append(overlap(np.array([*low, *high]), np.array([left, top, left + width, top + height])))
    return shares


def test_the_boxes_of_a_label_file_agree_with_its_rectangles(tmp_path: Path) -> None:
    """The rectangles were drawn by hand around what is seen, boxes around the whole: night stand and lamp differ."""
    right = label_overlaps(VOTENET / "calib_000001.txt")
    assert min(right) > 0.2
    assert np.median(right) > 0.6
    # Read row by row, Rtilt leans the other way.
    rows = (VOTENET / "calib_000001.txt").read_text().splitlines()
    turned = np.array(rows[0].split(), float).reshape(3, 3).T.ravel()
    (tmp_path / "calib.txt").write_text(" ".join(str(v) for v in turned) + "\n" + rows[1])
    assert np.mean(label_overlaps(tmp_path / "calib.txt")) < np.mean(right) - 0.1


def test_the_box_array_holds_its_points() -> None:
    """Seven chairs among 50,000 points: each box holds hundreds; in the mirrored room five of them none or a few."""
    calib, image = VOTENET / "calib_000001.txt", VOTENET / "image_000001.jpg"
    points = np.load(VOTENET / "000001_pc.npz")["pc"][:, :3].astype(float)
    boxes = read_sunrgbd_text(VOTENET / "000001_bbox.npy", calib, image).boxes
    assert [box.name for box in boxes] == 7 * ["chair"]

    def held(where: FloatArray) -> list[int]:
        return [
            int((contains(b.outline_xy, where[:, :2]) & (where[:, 2] > b.bottom_m) & (where[:, 2] < b.top_m)).sum())
            for b in boxes
        ]

    right = held(points)
    assert min(right) > 200
    assert sum(right) > 7_000
    assert sum(number < 100 for number in held(points * [-1, 1, 1])) == 5


def test_the_points_at_hand_are_of_another_frame_than_the_calibration() -> None:
    """The real files come from two numberings of the frames, which the reader finds out."""
    with pytest.raises(DataError, match=r"55% of 50,000 points lie in the picture; .*another frame"):
        read_sunrgbd_text(
            VOTENET / "label_000001.txt",
            VOTENET / "calib_000001.txt",
            VOTENET / "image_000001.jpg",
            VOTENET / "000001_pc.npz",
        )


# damage


PARTS = (
    *("annotation3Dfinal/index.json", "annotation3Dlayout/index.json", "intrinsics.txt", "scene.txt"),
    *("extrinsics/20140915210114.txt", "image/img_0063.jpg", "depth/img_0063_abs.png"),
)


@ANY_FILE
@given(data=st.data())
def test_mutated_real_files_are_read_or_refused(folder: Path, data: st.DataObject) -> None:
    path = folder / data.draw(st.sampled_from(PARTS))
    sound = path.read_bytes()
    try:
        path.write_bytes(data.draw(mutated(sound)))
        found, refusal = attempt(lambda: read_sunrgbd(folder))
        if found is not None:
            _, refusal = attempt(lambda: sunrgbd_episode(found, "a"))
        assert refusal is None or str(refusal).isprintable()
    finally:
        path.write_bytes(sound)


@ANY_FILE
@given(data=st.data())
def test_mutated_real_text_is_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    names = ("label_000001.txt", "calib_000001.txt", "000001_bbox.npy")
    damaged = data.draw(st.sampled_from(names))
    for name in names:
        content = (VOTENET / name).read_bytes()
        (tmp_path / name).write_bytes(data.draw(mutated(content)) if name == damaged else content)
    label = "000001_bbox.npy" if damaged.endswith("npy") else "label_000001.txt"
    read: Callable[[], object] = lambda: sunrgbd_text_episode(  # noqa: E731
        read_sunrgbd_text(tmp_path / label, tmp_path / "calib_000001.txt", VOTENET / "image_000001.jpg"), "a"
    )
    _, refusal = attempt(read)
    assert refusal is None or str(refusal).isprintable()
