"""Labels carried over from picture to picture: against warps that are known, and refused where nothing fits."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.annotation.backgrounds import background_depth, background_rgb
from hsbench.datasets.annotation.homography import (
    MAX_ERROR_PX,
    MAX_WORST_PX,
    MIN_INLIER_SHARE,
    MIN_INLIERS,
    MIN_OVERLAP,
    Quality,
    estimate,
    fixed,
    inverse,
    mapped,
    standard_error,
)
from hsbench.datasets.annotation.label_files import write_labels
from hsbench.datasets.annotation.labels import NAMES, Region, ViewLabels, bits_of, labels_at
from hsbench.datasets.annotation.lenses import bent, straight
from hsbench.datasets.annotation.overlay import COLOURS, VOID, overlaid
from hsbench.datasets.annotation.store import read_record, store_truth
from hsbench.datasets.annotation.view import carried, transfer
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.capture_set import add_captures
from hsbench.errors import DataError
from hsbench.geometry.cameras import BrownCamera, PinholeCamera, pixel_centres
from hsbench.io.checksums import sha256_file
from hsbench.schema.episode import Episode, Frame, FrameList
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import Affordance
from hsbench.typing import FloatArray, UInt8Array

WIDTH, HEIGHT = 320, 240
CAMERA = PinholeCamera(WIDTH, HEIGHT, 300.0, 300.0, 160.0, 120.0)
LENS = BrownCamera(WIDTH, HEIGHT, 165.0, 165.0, 160.0, 120.0, -0.2, 0.04, 0.0, 0.0, -0.0035)
CORNERS = np.array([[0.0, 0.0], [WIDTH, 0.0], [WIDTH, HEIGHT], [0.0, HEIGHT]])


def scenery(seed: int, width: int = WIDTH, height: int = HEIGHT) -> UInt8Array:
    """A picture of rectangles and cloudy noise, as full of features as a furnished room."""
    rng = np.random.default_rng(seed)
    picture = np.full((height, width, 3), 128.0)
    for _ in range(120):
        u, v = rng.integers(0, (width, height))
        w, h = rng.integers(6, 70, 2)
        picture[v : v + h, u : u + w] = rng.uniform(0, 255, 3)
    for cells in (8, 24):
        noise = rng.normal(0, 14, (cells, cells)).astype(np.float32)
        picture += cv2.resize(noise, (width, height), interpolation=cv2.INTER_CUBIC)[..., None]
    return cv2.GaussianBlur(picture.clip(0, 255), (0, 0), 0.7).astype(np.uint8)


def homography(seed: int, share: float = 0.12) -> FloatArray:
    """A homography that moves each corner of the picture by up to a share of its sides."""
    rng = np.random.default_rng(seed)
    to = CORNERS + rng.uniform(-share, share, (4, 2)) * (WIDTH, HEIGHT)
    return cv2.getPerspectiveTransform(CORNERS.astype(np.float32), to.astype(np.float32)).astype(np.float64)


def warp(picture: UInt8Array, H: FloatArray) -> UInt8Array:
    """The picture through a homography of places whose pixels have their middle at one half."""
    u, v = (mapped(inverse(H), pixel_centres(WIDTH, HEIGHT)) - 0.5).astype(np.float32).transpose(2, 0, 1)
    return np.asarray(cv2.remap(picture, u, v, cv2.INTER_CUBIC), dtype=np.uint8)


def episode(name: str, *pictures: UInt8Array, camera: PinholeCamera | BrownCamera = CAMERA) -> Episode:
    frames = FrameList(tuple(Frame(k * 10**9, rgb=picture) for k, picture in enumerate(pictures)))
    return Episode(name, "lab", Sensor("monocular", camera, None), frames, None, 0, (len(pictures) - 1) * 10**9)


def seat(mask: bool = False) -> ViewLabels:
    outline = np.array([[60.0, 50.0], [250.0, 70.0], [230.0, 200.0], [90.0, 180.0]])
    region = Region("sittable", (outline,))
    if mask:
        region = Region("sittable", mask=region.holds(pixel_centres(WIDTH, HEIGHT)))
    return ViewLabels("a.png", WIDTH, HEIGHT, (region,))


BITS = (1 << Affordance.SITTABLE,)


@settings(max_examples=25)
@given(st.integers(0, 10**6))
def test_corners_of_a_known_homography_are_found_to_a_pixel(seed: int) -> None:
    picture, H = scenery(seed), homography(seed)
    found = estimate(picture, warp(picture, H), CAMERA, CAMERA)
    assert found.quality.fault() is None
    gap = np.hypot(*(mapped(found.target_H_source, CORNERS) - mapped(H, CORNERS)).T)
    assert gap.max() < 1.0


@settings(max_examples=8)
@given(st.integers(0, 10**6))
def test_carried_polygons_are_the_polygons_of_the_other_picture(seed: int) -> None:
    picture, H = scenery(seed), homography(seed)
    other = episode("b", warp(picture, H))
    found = transfer(seat(), BITS, episode("a", picture), picture, other, "auto").labels
    corners = mapped(H, seat().regions[0].polygons_px[0])
    expected = Region("sittable", (corners,)).holds(pixel_centres(WIDTH, HEIGHT))
    back = mapped(inverse(H), pixel_centres(WIDTH, HEIGHT))
    reached = ((back >= 0) & (back < (WIDTH, HEIGHT))).all(axis=-1)
    sits = found & BITS[0] > 0
    assert (sits & expected).sum() / (sits | expected).sum() > 0.985
    assert np.mean((found == VIEW_UNSCORED) == ~reached) > 0.99


def test_people_do_not_disturb_a_camera_that_stands_still() -> None:
    room = scenery(1)
    pictures = []
    for k in range(5):
        picture = room.copy()
        picture[60:220, 60 * k : 60 * k + 50] = (30, 40, 90)
        pictures.append(picture)
    own = episode("a", *pictures)
    assert (background_rgb(own) == room).all()
    found = transfer(seat(mask=True), BITS, own, pictures[2], own, "auto")
    assert found.homography.is_identity
    assert (found.labels == labels_at(seat(), BITS, pixel_centres(WIDTH, HEIGHT))).all()
    assert found.homography.quality.overlap == 1.0


def test_other_light_is_no_other_place() -> None:
    picture, H = scenery(17), homography(17)
    dim = np.round(200 * (warp(picture, H) / 255.0) ** 1.7).astype(np.uint8)
    found = estimate(picture, dim, CAMERA, CAMERA)
    assert found.quality.fault() is None
    assert np.hypot(*(mapped(found.target_H_source, CORNERS) - mapped(H, CORNERS)).T).max() < MAX_WORST_PX


def test_labels_drawn_over_a_picture_leave_the_rest_as_it_is() -> None:
    picture, labels = scenery(1), np.zeros((HEIGHT, WIDTH), dtype=np.uint8)
    labels[40:90, 50:120], labels[:, 300:] = BITS[0], VIEW_UNSCORED
    drawn = overlaid(picture, labels)
    near = cv2.dilate((labels > 0).astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    assert (drawn[~near] == picture[~near]).all()
    assert (drawn[labels == VIEW_UNSCORED] == VOID).all()
    inner = np.s_[44:86, 54:116]
    mixed = np.round(0.5 * picture[inner] + 0.5 * np.array(COLOURS[Affordance.SITTABLE]))
    assert (drawn[inner] == mixed).all()


def test_a_lens_is_allowed_for() -> None:
    """A camera that turned about its centre: rays through both pictures tell where each pixel comes from."""
    picture = scenery(3)
    turn = cv2.Rodrigues(np.array([0.04, 0.12, -0.03]))[0]
    rays = LENS.rays() @ turn  # from the turned camera to the first
    places, _ = LENS.project(rays)
    u, v = (places - 0.5).astype(np.float32).transpose(2, 0, 1)
    turned = np.asarray(cv2.remap(picture, u, v, cv2.INTER_CUBIC), dtype=np.uint8)
    found = estimate(picture, turned, LENS, LENS)
    assert found.quality.fault() is None
    inside = LENS.contains(places)
    gap = np.hypot(*(found.sources(pixel_centres(WIDTH, HEIGHT)) - places)[inside].T)
    assert gap.max() < 1.0
    blind = estimate(picture, turned, CAMERA, CAMERA)
    assert (blind.quality.error_px or 9) > 3 * (found.quality.error_px or 9)


@given(st.floats(0, WIDTH), st.floats(0, HEIGHT))
def test_lenses_bend_back(u: float, v: float) -> None:
    place = np.array([u, v])
    assert np.allclose(bent(LENS, straight(LENS, place)), place, atol=1e-6)
    assert (straight(CAMERA, place) == place).all()
    assert np.isnan(bent(LENS, np.array([np.nan, v]))).all()


def test_the_figure_for_the_worst_place_is_its_standard_error() -> None:
    """Over many noisy fits of one homography the worst corner scatters as the figure of each fit says."""
    rng = np.random.default_rng(5)
    H = homography(5)
    a = rng.uniform((0, 0), (160, 240), (60, 2))  # in the left half: the right corners are told worse
    b, errors, told = mapped(H, a), [], []
    for _ in range(200):
        noisy = b + rng.normal(0, 0.5, b.shape)
        fit, _ = cv2.findHomography(a, noisy, 0)
        errors.append(mapped(fit, CORNERS) - mapped(H, CORNERS))
        told.append(standard_error(fit, a, noisy, CORNERS))
    scatter = np.sqrt((np.array(errors) ** 2).sum(axis=2).mean(axis=0)).max()
    assert np.mean(told) == pytest.approx(scatter, rel=0.15)


def test_places_come_back_though_the_first_pixel_lies_beyond_the_horizon() -> None:
    H = np.array([[1.0, 0.1, 3.0], [0.0, 1.2, -4.0], [0.01, 0.02, -1.0]])
    seen = np.array([[160.0, 120.0], [300.0, 30.0]])
    assert np.allclose(mapped(inverse(H), mapped(H, seen)), seen)
    assert np.isnan(mapped(H, np.zeros(2))).all()


def test_another_room_is_refused() -> None:
    other = episode("b", scenery(8))
    with pytest.raises(DataError, match=r"episode b: labels cannot be carried over: .* features fit"):
        transfer(seat(), BITS, episode("a", scenery(7)), scenery(7), other, "auto")


def test_a_blank_wall_is_refused() -> None:
    wall = np.full((HEIGHT, WIDTH, 3), 200, dtype=np.uint8)
    for source, target in ((wall, wall), (scenery(1), wall), (wall, scenery(1))):
        assert estimate(source, target, CAMERA, CAMERA).quality.fault() is not None
        assert fixed(source, target, CAMERA).quality.fault() is not None


def test_what_does_not_lie_in_one_plane_is_refused() -> None:
    """A camera that moved: stripes of the picture shift by different amounts."""
    picture = scenery(2)
    far = (0, 23, 5, 31, 11, 40, 3, 17)  # no plane shifts its rows like this
    shifted = np.vstack([np.roll(picture[30 * k : 30 * k + 30], far[k], axis=1) for k in range(8)])
    fault = estimate(picture, shifted, CAMERA, CAMERA).quality.fault()
    assert fault is not None
    assert "features fit" in fault


def test_a_camera_said_to_be_fixed_that_moved_is_refused() -> None:
    picture = scenery(4)
    moved = np.roll(picture, 5, axis=1)
    with pytest.raises(DataError, match="0 of"):
        transfer(seat(), BITS, episode("a", picture), picture, episode("b", moved), "fixed")
    found = transfer(seat(), BITS, episode("a", picture), picture, episode("b", picture), "fixed")
    assert found.homography.is_identity


@pytest.mark.parametrize(
    ("quality", "match"),
    [
        (Quality(400, MIN_INLIERS - 1, 0.1, 0.1, 1.0), "another place"),
        (Quality(400, int(400 * MIN_INLIER_SHARE) - 1, 0.1, 0.1, 1.0), "moved"),
        (Quality(400, 300, MAX_ERROR_PX + 0.1, 0.1, 1.0), "features fit to 1.10 px"),
        (Quality(400, 300, 0.1, MAX_WORST_PX + 0.1, 1.0), "worst place is known to 2.10 px"),
        (Quality(400, 300, 0.1, None, 1.0), "an unknown length"),
        (Quality(400, 300, 0.1, 0.1, MIN_OVERLAP - 0.1), "40% of the picture"),
    ],
)
def test_each_figure_has_a_limit(quality: Quality, match: str) -> None:
    assert match in (quality.fault() or "")
    assert Quality(400, 300, MAX_ERROR_PX, MAX_WORST_PX, MIN_OVERLAP).fault() is None


def test_labels_of_another_size_are_refused() -> None:
    picture = scenery(1)
    own = episode("a", picture)
    small = ViewLabels("a", 32, 24, ())
    with pytest.raises(DataError, match=r"of 32 x 24 px; expected 320 x 240 .*resized"):
        transfer(small, (), own, picture, own, "auto")


def test_depth_is_the_median_of_what_was_measured() -> None:
    readings = np.array([[0.0, 2.0, 0.0], [3.0, 2.2, 0.0], [3.1, 9.0, 0.0]], dtype=np.float32)
    frames = FrameList(tuple(Frame(k, depth_m=row[None]) for k, row in enumerate(readings)))
    camera = PinholeCamera(3, 1, 3.0, 3.0, 1.5, 0.5)
    own = Episode("a", "lab", Sensor("rgbd", camera, 1.0), frames, None, 0, 2)
    assert background_depth(own).tolist() == [[3.0, np.float32(2.2), 0.0]]
    with pytest.raises(DataError, match="no colour pictures"):
        background_rgb(own)


def test_the_command_labels_episodes_and_refuses_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    room, data = scenery(11), tmp_path / "data"
    turned = warp(room, homography(11, 0.08))
    add_captures(data, [episode("a", room, room), episode("b", turned), episode("c", scenery(12))])
    write_labels(tmp_path / "seat.json", seat(), "labelme")
    call = ["annotate", "view", str(tmp_path / "seat.json"), "--data", str(data), "--episode", "a"]
    assert run([*call, "--to-all", "--pictures", str(tmp_path / "seen")]) == 2
    assert sorted(path.name for path in (tmp_path / "seen").iterdir()) == ["a.png", "b.png"]
    out = capsys.readouterr()
    assert "episode a, camera as it was" in out.out
    assert "episode b, camera moved" in out.out
    assert "episode c: labels cannot be carried over" in out.err
    assert out.out.splitlines()[-1] == f"next: hsbench verify {data}"
    assert run(["verify", str(data)]) == 0
    a, b, c = load(data, truth=True)
    assert a.truth is not None
    assert b.truth is not None
    assert (a.truth.view_affordance == labels_at(seat(), BITS, pixel_centres(WIDTH, HEIGHT))).all()
    assert b.truth.view_affordance is not None
    assert (b.truth.view_affordance == VIEW_UNSCORED).any()
    assert c.truth is None or c.truth.view_affordance is None
    assert run(call) == 2
    assert "has truth of view_affordance already" in capsys.readouterr().err
    fresh = [*call[:-1], "c", "--pictures", str(tmp_path / "seen"), "--camera", "fixed"]
    (tmp_path / "seen" / "c.png").write_text("mine")
    assert run(fresh) == 2
    assert "c.png: exists already" in capsys.readouterr().err
    assert (tmp_path / "seen" / "c.png").read_text() == "mine"
    capsys.readouterr()
    assert run([*call, "--replace", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["refused"] == []
    assert told["episodes"]["a"]["moved"] is False
    given = {"file": "seat.json", "sha256": sha256_file(tmp_path / "seat.json"), "frame": 0, "camera": "auto"}
    assert read_record(data, "a") == {"view_affordance": {**given, "episode_id": "a", **told["episodes"]["a"]}}
    moved = read_record(data, "b")["view_affordance"]
    assert moved["moved"] is True
    assert (moved["episode_id"], moved["matches"] >= MIN_INLIERS) == ("a", True)
    assert read_record(data, "c") == {}
    assert run([*call, "--replace", "--pictures", str(tmp_path / "seen")]) == 0
    store_truth(data, "b", b.truth, ("affordance",), {"file": "plan.json"})
    assert read_record(data, "b") == {"view_affordance": moved, "affordance": {"file": "plan.json"}}
    assert run(["verify", str(data)]) == 0
    capsys.readouterr()
    assert run([*call, "--frame", "9", "--replace"]) == 2
    assert "no frame 9" in capsys.readouterr().err


def test_own_names_and_unknown_episodes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    room, data = scenery(11), tmp_path / "data"
    add_captures(data, [episode("a", room)])
    drawn = ViewLabels("a.png", WIDTH, HEIGHT, (Region("sofa cushion", seat().regions[0].polygons_px),))
    with pytest.raises(DataError, match="sofa cushion"):
        bits_of(drawn, NAMES, "x")
    write_labels(tmp_path / "a.json", drawn, "coco")
    (tmp_path / "names.json").write_text('{"sofa cushion": ["sittable", "lyable"]}')
    call = ["annotate", "view", str(tmp_path / "a.json"), "--data", str(data), "--labels", str(tmp_path / "names.json")]
    assert run([*call, "--episode", "z"]) == 2
    assert "has no episode 'z'; found a" in capsys.readouterr().err
    assert run([*call, "--episode", "a"]) == 0
    truth = load(data, truth=True)[0].truth
    assert truth is not None
    assert truth.view_affordance is not None
    assert set(np.unique(truth.view_affordance)) == {0, 1 << Affordance.SITTABLE | 1 << Affordance.LYABLE}


def test_carrying_back_is_the_inverse() -> None:
    picture, H = scenery(21), homography(21)
    found = estimate(picture, warp(picture, H), CAMERA, CAMERA)
    there = carried(seat(), BITS, found)
    assert set(np.unique(there)) <= {0, BITS[0], VIEW_UNSCORED}
    place = mapped(found.target_H_source, np.array([[150.0, 120.0]]))
    assert np.allclose(found.sources(place), [[150.0, 120.0]])
