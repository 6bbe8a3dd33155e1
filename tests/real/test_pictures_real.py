"""The readers of panoramas, meshes and footage on real files (never part of this project), and damaged copies of them.

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout. Pictures of what was checked go
to the tests' own folders (``--basetemp`` keeps them). There is no real file of ScanNet: PLY is read from Habitat's.
"""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.footage import footage_episodes, read_footage
from hsbench.datasets.importers.footage_views import agreement, steady_views
from hsbench.datasets.importers.ply import read_ply
from hsbench.datasets.importers.zind import ZindPanorama, read_zind, zind_episode
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.geometry.cameras import EquirectangularCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.io.images import encode_jpeg, read_rgb, write_png
from hsbench.typing import FloatArray, UInt8Array
from tests.unit.datasets.mutations import attempt, mutated, refused_or_read

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
pytestmark = pytest.mark.skipif(
    not REALDATA.is_dir(), reason=f"needs the real captures in realdata ({REALDATA}; set HSBENCH_REALDATA)"
)
PANO, VIDEO2D, HABITAT = REALDATA / "pano", REALDATA / "video2d", REALDATA / "scenes3d" / "habitat"
VIDEOS = {
    "intel_one-by-one-person-detection.mp4": (1394, (768, 432), 139.3),
    "intel_preview_classroom.gif": (45, (480, 270), 2.93),
    "pose2sim_multi_cam01.mp4": (100, (1088, 1920), 1.65),
}
ANY_FILE = settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])


def home(folder: Path) -> Path:
    """The home of ZInD with its two panoramas in their places."""
    (folder / "panos").mkdir(parents=True, exist_ok=True)
    for file in PANO.glob("zind_000_*.jpg"):
        shutil.copyfile(file, folder / "panos" / file.name.removeprefix("zind_000_"))
    shutil.copyfile(PANO / "zind_000_zind_data.json", folder / "zind_data.json")
    return folder / "zind_data.json"


def upright_edges(rgb: UInt8Array) -> FloatArray:
    """How much a picture changes across, per pixel, over the median of its row."""
    grey = cv2.GaussianBlur(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), (0, 0), 1.5).astype(np.float64)
    across = np.abs(np.roll(grey, -1, axis=1) - np.roll(grey, 1, axis=1))
    return across / (np.median(across, axis=1, keepdims=True) + 1)


def strength(edges: FloatArray, u: FloatArray, v: FloatArray) -> float:
    """The sharpest edge within 4 px (.7 degrees) of a line, at the median over its length."""
    near = np.floor(u).astype(int)[:, None] + np.arange(-4, 5)
    return float(np.median(edges[np.floor(v).astype(int)[:, None], near % edges.shape[1]].max(axis=1)))


def pixels_between(
    panorama: ZindPanorama, camera: EquirectangularCamera, start: FloatArray, end: FloatArray
) -> FloatArray:
    """(400, 2) pixels of a line from a point (3,) to another in the episode frame."""
    episode = zind_episode(panorama, "a")
    points = start + np.linspace(0, 1, 400)[:, None] * (end - start)
    assert episode.truth is not None
    assert episode.truth.sensor is not None
    return camera.project(apply(invert(episode.truth.sensor.world_T_camera), points))[0]


def posts(panorama: ZindPanorama) -> list[tuple[FloatArray, FloatArray]]:
    """The sides of doors, from the floor to their tops: upright, and sharp in the pictures."""
    sides = [(xy, opening) for opening in panorama.openings for xy in (opening.left_xy, opening.right_xy)]
    return [(np.array([*xy, o.low_m]), np.array([*xy, o.high_m])) for xy, o in sides]


def sharp(panorama: ZindPanorama) -> list[tuple[FloatArray, FloatArray]]:
    """Upright lines that are sharp in the picture: sides of doors; of a room seen from its door, the far corners."""
    if panorama.inside:
        return posts(panorama)
    corners = panorama.outline_xy
    far = corners[np.argsort(np.linalg.norm(corners, axis=1))[2:]]
    return [(np.array([*xy, 0.05]), np.array([*xy, panorama.height_m - 0.05])) for xy in far]


def test_layouts_lie_on_the_edges_of_panoramas(tmp_path: Path) -> None:
    found, notes = read_zind(home(tmp_path / "000"))
    assert [p.room_type for p in found] == ["bonus_room", "pantry"]
    assert "30 panoramas have no picture here" in notes[0]
    for panorama in found:
        rgb = read_rgb(panorama.image)
        camera = EquirectangularCamera(rgb.shape[1], rgb.shape[0])
        edges = upright_edges(rgb)
        lines = [pixels_between(panorama, camera, start, end) for start, end in sharp(panorama)]
        columns = np.array([line[:, 0].mean() for line in lines])
        for u, v in (line.T for line in lines):
            here = strength(edges, u, v)
            assert here >= 3.0  # wall and carpet have 1
            mirrored, turned = camera.width_px - u, u + camera.width_px / 4
            for other in (mirrored, turned):
                if np.abs(columns - other.mean()).min() > 60:  # a door in the middle is its own mirror image
                    assert here >= 1.5 * strength(edges, other, v)
        draw(tmp_path / f"{panorama.name}.png", rgb, panorama, camera)
    room, pantry = found
    assert (room.camera_height_m, room.height_m) == (1.435, 2.3412)
    assert all(1.9 < o.high_m < 2.1 for p in found for o in p.openings)
    assert (room.inside, pantry.inside) == (True, False)


def draw(path: Path, rgb: UInt8Array, panorama: ZindPanorama, camera: EquirectangularCamera) -> None:
    """The panorama with the room's corners, its floor and ceiling, and the sides of its openings."""
    picture = rgb.copy()
    outline = panorama.outline_xy
    lines = posts(panorama)
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        lines += [(np.array([*a, z]), np.array([*b, z])) for z in (0.0, panorama.height_m)]
        lines.append((np.array([*a, 0.0]), np.array([*a, panorama.height_m])))
    for start, end in lines:
        for u, v in pixels_between(panorama, camera, start, end):
            cv2.circle(picture, (int(u), int(v)), 2, (0, 255, 0), -1)
    write_png(path, picture)


def test_a_real_home_becomes_a_data_set(tmp_path: Path) -> None:
    out = tmp_path / "data"
    assert run(["import", "zind", str(home(tmp_path / "000")), "--out", str(out)]) == 0
    assert list(verify_files(out)) == []
    for episode in load(out, truth=True):
        assert verify_episode(episode) == []
        assert episode.frames[0].rgb.shape == (1024, 2048, 3)


def test_panoramas_of_one_room_agree_on_it(tmp_path: Path) -> None:
    document = json.loads((PANO / "zind_000_zind_data.json").read_text())
    (tmp_path / "panos").mkdir()
    blank = encode_jpeg(np.zeros((64, 128, 3), np.uint8))
    room_of = {}
    for room, parts in document["merger"]["floor_01"].items():
        for panorama in (p for part in parts.values() for p in part.values()):
            room_of[Path(panorama["image_path"]).stem] = room
            (tmp_path / panorama["image_path"]).write_bytes(blank)
    shutil.copyfile(PANO / "zind_000_zind_data.json", tmp_path / "zind_data.json")
    found, notes = read_zind(tmp_path / "zind_data.json")
    assert (len(found), notes) == (32, [])
    areas: dict[str, list[float]] = {}
    for panorama in found:
        scene = zind_episode(panorama, "a").truth.scene
        areas.setdefault(room_of[panorama.name], []).append(scene.rooms[0].area_m2)
        assert scene.contains(np.zeros((1, 2)))[0] or not panorama.inside
        assert 2.2 < scene.height_m < 2.7
    assert max(len(values) for values in areas.values()) >= 10
    for values in areas.values():
        assert np.ptp(values) < 0.02 * max(values)


@ANY_FILE
@given(data=st.data())
def test_damaged_real_homes_are_refused_or_read(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "000" / "zind_data.json"
    if not path.exists():
        home(tmp_path / "000")
    sound = (PANO / "zind_000_zind_data.json").read_bytes()
    refused_or_read(read_zind, path, data.draw(mutated(sound)), lambda found: zind_episode(found[0][0], "a"))


def test_real_plys_are_read() -> None:
    files = sorted(HABITAT.glob("*.ply"))
    assert files
    for file in files:
        mesh = read_ply(file)
        assert len(mesh.triangles) > 0
        assert np.ptp(mesh.points, axis=0).max() < 10


@pytest.mark.parametrize("name", VIDEOS)
def test_static_cameras_give_one_episode(name: str, tmp_path: Path) -> None:
    count, size, seconds = VIDEOS[name]
    footage = read_footage(VIDEO2D / name)
    (episode,), notes = footage_episodes(footage, "a")
    assert notes == ()
    assert len(episode.frames) == count
    assert (episode.sensor.camera.width_px, episode.sensor.camera.height_px) == size
    assert episode.duration_s == pytest.approx(seconds)
    assert footage.frames.background is None
    write_png(tmp_path / "background.png", episode.frames.background)


def test_a_push_of_two_percent_and_a_cut_are_found_in_real_footage() -> None:
    one, room = (read_footage(VIDEO2D / name) for name in list(VIDEOS)[:2])
    steps = range(0, 1390, 30)
    pictures = [one.frames[k].rgb for k in steps]
    shift = np.float64([[1, 0, 0.02 * 768], [0, 1, 0]])
    pushed = [cv2.warpAffine(p, shift, (768, 432), borderMode=cv2.BORDER_REFLECT) for p in pictures]
    views = steady_views([*pictures[:20], *pushed[20:]])
    assert [(int(v[0]), len(v)) for v in views] == [(0, 20), (20, len(pictures) - 20)]
    cut = [*pictures[:10], *(cv2.resize(room.frames[k].rgb, (768, 432)) for k in range(10)), *pictures[10:]]
    assert [len(v) for v in steady_views(cut)] == [10, 10, len(pictures) - 10]
    dark = [(0.3 * p).astype(np.uint8) for p in pictures]
    assert len(steady_views([*pictures[:20], *dark[20:30], *pictures[30:]])) == 1


@ANY_FILE
@given(data=st.data())
def test_damaged_real_footage_is_refused_or_read(tmp_path: Path, data: st.DataObject) -> None:
    sound = (VIDEO2D / "intel_preview_classroom.gif").read_bytes()
    path = tmp_path / "a.gif"
    path.write_bytes(data.draw(mutated(sound)))
    _, refusal = attempt(lambda: footage_episodes(read_footage(path), "a"))
    assert refusal is None or (path.name in str(refusal) and str(refusal).isprintable())


def test_agreement_of_a_picture_with_itself_is_whole() -> None:
    grey = cv2.imread(str(VIDEO2D / "hmr_random.jpg"), cv2.IMREAD_GRAYSCALE).astype(np.float32)
    assert agreement(grey, grey) == 1.0
    assert json.loads((VIDEO2D / "hmr_random_keypoints.json").read_text())["people"]
