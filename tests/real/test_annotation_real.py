"""Real annotations and pictures: COCO's polygons, static cameras while people walk, known warps of later frames."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from pycocotools.coco import COCO

from hsbench.datasets.annotation.box_truth import box_truth
from hsbench.datasets.annotation.boxes import AnnotatedBox, BoxLabels, read_boxes, write_boxes
from hsbench.datasets.annotation.homography import estimate, inverse, mapped
from hsbench.datasets.annotation.label_files import read_labels
from hsbench.datasets.importers.room_captures import sunrgbd_episode
from hsbench.datasets.importers.sunrgbd import read_sunrgbd
from hsbench.errors import DataError
from hsbench.geometry.cameras import PinholeCamera, pixel_centres
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.episode import Episode
from hsbench.schema.states import Visibility
from hsbench.tasks.scene_completion import GRID
from hsbench.typing import FloatArray, UInt8Array

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
FILMS, SUN = REALDATA / "video2d", REALDATA / "sunrgbd"
NAMES = ("pose2sim_multi_cam01.mp4", "intel_one-by-one-person-detection.mp4")
WIDTH = 768

pytestmark = pytest.mark.skipif(
    not REALDATA.is_dir(), reason=f"needs the real captures in realdata ({REALDATA}; set HSBENCH_REALDATA)"
)


def frames(name: str, count: int) -> list[UInt8Array]:
    """Pictures spread evenly over a film, 768 px wide."""
    film = cv2.VideoCapture(str(FILMS / name))
    total = int(film.get(cv2.CAP_PROP_FRAME_COUNT))
    found = []
    for place in np.linspace(0, total - 2, count).astype(int).tolist():
        film.set(cv2.CAP_PROP_POS_FRAMES, place)
        read, picture = film.read()
        assert read
        height = round(WIDTH * picture.shape[0] / picture.shape[1])
        found.append(
            cv2.cvtColor(cv2.resize(picture, (WIDTH, height), interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2RGB)
        )
    return found


def camera_of(picture: UInt8Array) -> PinholeCamera:
    height, width = picture.shape[:2]
    return PinholeCamera(width, height, float(width), float(width), width / 2, height / 2)


def corners_of(picture: UInt8Array) -> FloatArray:
    height, width = picture.shape[:2]
    return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])


@pytest.mark.parametrize("name", NAMES)
def test_a_camera_that_stands_still_is_found_to_do_so(name: str) -> None:
    first, *later = frames(name, 5)
    for picture in later:
        found = estimate(first, picture, camera_of(first), camera_of(first))
        assert found.quality.fault() is None, found.quality
        assert found.is_identity, found.quality


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(4))
def test_a_known_warp_of_a_later_frame_is_found_to_two_pixels(name: str, seed: int) -> None:
    """People walked on between the two pictures."""
    first, later = frames(name, 2)
    corners = corners_of(first)
    rng = np.random.default_rng(seed)
    to = corners + rng.uniform(-0.08, 0.08, (4, 2)) * corners.max(axis=0)
    H = cv2.getPerspectiveTransform(corners.astype(np.float32), to.astype(np.float32)).astype(np.float64)
    height, width = first.shape[:2]
    u, v = (mapped(inverse(H), pixel_centres(width, height)) - 0.5).astype(np.float32).transpose(2, 0, 1)
    found = estimate(first, cv2.remap(later, u, v, cv2.INTER_CUBIC), camera_of(first), camera_of(first))
    gap = np.hypot(*(mapped(found.target_H_source, corners) - to).T).max()
    print(f"{name} {seed}: worst corner {gap:.2f} px, {found.quality}")
    assert found.quality.fault() is None
    assert gap < 2.0


def test_other_rooms_are_refused() -> None:
    a, b = (frames(name, 1)[0] for name in NAMES)
    assert estimate(a, b, camera_of(a), camera_of(b)).quality.fault() is not None


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # pycocotools under numpy 2
def test_polygons_of_coco_hold_the_pixels_that_pycocotools_says(capsys: pytest.CaptureFixture[str]) -> None:
    path = FILMS / "mmpose_coco_test_coco.json"
    coco = COCO(str(path))
    capsys.readouterr()
    compared = 0
    for image in coco.dataset["images"]:
        labels = read_labels(path, image["file_name"])
        drawn = [a for a in coco.dataset["annotations"] if a["image_id"] == image["id"]]
        assert len(drawn) == len(labels.regions)
        centres = pixel_centres(labels.width_px, labels.height_px)
        for region, annotation in zip(labels.regions, drawn, strict=True):
            ours, theirs = region.holds(centres), coco.annToMask(annotation) > 0
            assert (ours & theirs).sum() / (ours | theirs).sum() > 0.98  # they round corners to fifths of a pixel
            assert ours.sum() == pytest.approx(annotation["area"], rel=0.02)
            compared += 1
    assert compared == 14


@pytest.fixture(scope="module")
def kinect_frame(tmp_path_factory: pytest.TempPathFactory) -> Episode:
    """SUN RGB-D's frame img_0063: real depth, with the boxes and the room that its annotators drew."""
    folder = tmp_path_factory.mktemp("sun") / "img_0063"
    shutil.copytree(SUN / "images" / "img_0063", folder)
    for name, source in (("annotation3Dfinal", "annotation3D"), ("annotation3Dlayout", "annotation3Dlayout")):
        (folder / name).mkdir()
        shutil.copy(SUN / f"img_0063_{source}.json", folder / name / "index.json")
    return sunrgbd_episode(read_sunrgbd(folder), "img_0063")[0]


def boxes_of(episode: Episode) -> BoxLabels:
    assert episode.truth is not None
    scene = episode.truth.scene
    assert scene is not None
    boxes = tuple(
        AnnotatedBox(o.object_id, o.category_name, quantise_m(o.box[:3]), quantise_m(o.box[3:6]), float(o.box[6]))
        for o in scene.objects
    )
    return BoxLabels("episode", scene.rooms[0].room_type, scene.rooms[0].outline_xy, scene.height_m, boxes)


def test_boxes_of_a_real_room_lie_on_what_its_camera_measured(kinect_frame: Episode, tmp_path: Path) -> None:
    write_boxes(tmp_path / "boxes.json", boxes_of(kinect_frame))
    found = box_truth(read_boxes(tmp_path / "boxes.json"), kinect_frame, "img_0063", GRID)
    print(f"{found.explained:.1%} of the measured points lie on something annotated")
    assert found.explained > 0.8
    seen = {
        item.object_id: Visibility(found.objects.visibility[k])
        for k, item in enumerate(found.scene.objects)
        if item.category_name in ("bookshelf", "chair")
    }
    assert set(seen.values()) == {Visibility.VISIBLE}
    assert len(seen) == 3


def test_boxes_of_a_real_room_in_another_frame_are_noticed(kinect_frame: Episode) -> None:
    labels = boxes_of(kinect_frame)
    shifted = tuple(replace(box, centre_m=box.centre_m + (0.4, 0.0, 0.0)) for box in labels.boxes)
    with pytest.raises(DataError, match="of the points measured in the room lie on something annotated"):
        box_truth(replace(labels, boxes=shifted), kinect_frame, "img_0063", GRID)
