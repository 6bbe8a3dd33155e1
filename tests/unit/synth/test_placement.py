"""Where the camera stands: a heading that says nothing, at the outskirts, never in furniture, always the same."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import chisquare, kstest

from hsbench.geometry.convex import span
from hsbench.geometry.polygons import contains
from hsbench.geometry.rays import cast, pack_solids
from hsbench.geometry.transforms import is_rigid
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.synth.placement import CameraConfig, place_rgbd
from hsbench.synth.seeds import Seeds

RECTANGLE = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0]])
L_SHAPE = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 2.0], [2.6, 2.0], [2.6, 4.0], [0.0, 4.0]])
TALL = (((0.1, 0.1, 0.0), (1.3, 0.7, 2.1)), ((3.9, 3.2, 0.0), (4.9, 3.9, 2.2)), ((0.0, 2.0, 0.0), (0.4, 3.0, 1.9)))
LOW = (((1.5, 1.5, 0.0), (3.0, 2.5, 0.7)), ((3.5, 0.1, 0.0), (4.8, 0.9, 0.9)))
CONFIG = CameraConfig()


def room(outline: np.ndarray, *boxes: tuple) -> Scene:
    objects = tuple(
        SceneObject(k, "wardrobe", np.eye(4), (Part("body", (1, 2, 3), solid=span(*corners)),))
        for k, corners in enumerate(boxes, 1)
    )
    return Scene("s", (Room("living", outline),), 2.5, objects)


ROOMS = {
    "empty": room(RECTANGLE),
    "furnished": room(RECTANGLE, *TALL, *LOW),
    "corner": room(L_SHAPE, *TALL[:1], *LOW[:1]),
}


def place(scene: Scene, k: int, config: CameraConfig = CONFIG):
    return place_rgbd(scene, config, Seeds(0).child(k).rng("camera"))


def distance_to_outline(outline: np.ndarray, point: np.ndarray) -> float:
    best = math.inf
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        share = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        best = min(best, float(np.linalg.norm(point - a - share * (b - a))))
    return best


@pytest.fixture(scope="module", params=ROOMS)
def placed(request: pytest.FixtureRequest):
    scene = ROOMS[request.param]
    return scene, [place(scene, k) for k in range(500 if request.param == "furnished" else 120)]


def test_the_heading_says_nothing_of_the_walls(placed) -> None:
    _, placements = placed
    yaw = np.array([math.atan2(pose[1, 0], pose[0, 0]) for pose, _ in placements])
    quarter = np.mod(yaw, np.pi / 2) / (np.pi / 2)
    assert kstest(quarter, "uniform").pvalue > 0.05
    assert chisquare(np.histogram(quarter, bins=10, range=(0, 1))[0]).pvalue > 0.01
    assert kstest((yaw + np.pi) / (2 * np.pi), "uniform").pvalue > 0.05
    gaps = np.diff(np.sort(yaw), append=yaw.min() + 2 * np.pi)
    assert gaps.max() < 2 * np.pi * 3 * math.log(len(yaw)) / len(yaw)  # by chance alone less than two thirds of it


def test_the_heading_is_drawn_whatever_stands_in_the_room() -> None:
    for k in range(30):
        poses = [place(scene, k)[0] for scene in ROOMS.values()]
        assert all(np.array_equal(p[:3, :3], poses[0][:3, :3]) for p in poses)
        sensors = [place(scene, k)[1] for scene in ROOMS.values()]
        assert sensors[0] == sensors[1] == sensors[2]


def test_the_camera_stands_at_the_outskirts_and_in_the_clear(placed) -> None:
    scene, placements = placed
    for pose, sensor in placements:
        assert is_rigid(pose)
        assert np.array_equal(pose[2], [0.0, 0.0, 1.0, 0.0])  # upright, on the floor
        x, y = pose[:2, 3]
        assert contains(scene.rooms[0].outline_xy, np.array([x, y]))
        assert distance_to_outline(scene.rooms[0].outline_xy, np.array([x, y])) == pytest.approx(
            CONFIG.wall_distance_m, abs=2e-4
        )
        lens = np.array([x, y, sensor.height_m])
        for item in scene.objects:
            low, high = item.solids[0].bounds
            assert np.linalg.norm(lens - np.clip(lens, low, high)) >= CONFIG.clearance_m - 1e-9


def test_values_are_in_range_and_quantised(placed) -> None:
    _, placements = placed
    for pose, sensor in placements:
        assert sensor.kind == "rgbd"
        assert sensor.camera == CONFIG.camera
        assert sensor.roll_rad == 0.0
        tilt, yaw = math.degrees(sensor.tilt_rad), math.degrees(math.atan2(pose[1, 0], pose[0, 0]))
        assert CONFIG.height_m[0] <= sensor.height_m <= CONFIG.height_m[1]
        assert CONFIG.tilt_deg[0] - 0.005 <= tilt <= CONFIG.tilt_deg[1] + 0.005
        for value, step in ((sensor.height_m, 1e-4), (pose[0, 3], 1e-4), (pose[1, 3], 1e-4), (tilt, 0.01), (yaw, 0.01)):
            assert value / step == pytest.approx(round(value / step), abs=1e-6)


def test_the_same_seed_places_the_same_camera() -> None:
    scene = ROOMS["furnished"]
    for k in range(10):
        (a_pose, a), (b_pose, b) = place(scene, k), place(scene, k)
        assert np.array_equal(a_pose, b_pose)
        assert a == b
    assert not np.array_equal(place(scene, 0)[0], place(scene, 1)[0])


def test_of_all_positions_the_one_that_sees_most_floor() -> None:
    # With one to choose from and nothing too near, no point at the walls sees more of the floor within its angle.
    config = CameraConfig(choose_from=1, near_share=1.0)
    half = math.atan(config.width_px / 2 / config.focal_px)
    floor = np.stack(np.meshgrid(np.arange(0.05, 5, 0.1), np.arange(0.05, 4, 0.1)), axis=-1).reshape(-1, 2)

    def share(position: np.ndarray, yaw: float) -> float:
        seen = 0
        for x, y in floor - position:
            turned = complex(x, y) * complex(math.cos(yaw), -math.sin(yaw))
            seen += abs(math.atan2(turned.imag, turned.real)) < half
        return seen / len(floor)

    along = np.arange(0.22, 4.79, 0.5)
    rivals = [(x, y) for x in along for y in (0.22, 3.78)] + [(x, y) for x in (0.22, 4.78) for y in along if y < 3.8]
    for k in range(4):
        pose, _ = place(ROOMS["empty"], k, config)
        yaw = math.atan2(pose[1, 0], pose[0, 0])
        best = max(share(np.array(rival), yaw) for rival in rivals)
        assert share(pose[:2, 3], yaw) >= best - 0.02  # the floor is sampled at other points


def test_pictures_full_of_furniture_come_last() -> None:
    columns = [((x, y, 0.0), (x + 0.5, y + 0.5, 2.2)) for x in (0.5, 2.2, 3.9) for y in (0.5, 2.9)]
    scene = room(RECTANGLE, *columns)
    solids = pack_solids([item.solids[0] for item in scene.objects])
    owner = np.zeros(len(scene.objects), dtype=np.int32)

    def crowded(k: int, config: CameraConfig) -> float:
        pose, sensor = place(scene, k, config)
        image = cast(sensor.camera, pose @ sensor.world_T_camera, solids, owner, 1)
        return float(np.mean(image.depth_m < config.near_m))

    careless = CameraConfig(near_share=1.0)
    assert sum(crowded(k, careless) > CONFIG.near_share + 0.02 for k in range(40)) >= 3
    assert not any(crowded(k, CONFIG) > CONFIG.near_share + 0.02 for k in range(40))


def test_a_room_without_a_clear_place_still_gets_a_camera() -> None:
    full = room(RECTANGLE, ((-1, -1, 0), (6, 5, 2.4)))
    pose, _ = place(full, 0)
    assert contains(full.rooms[0].outline_xy, pose[:2, 3])
