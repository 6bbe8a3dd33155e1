"""Where cameras stand: a heading that says nothing, at the place of their kind, never in furniture, always the same."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import chisquare, kstest

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import BrownCamera, PinholeCamera
from hsbench.geometry.convex import span
from hsbench.geometry.polygons import contains
from hsbench.geometry.rays import cast, pack_solids
from hsbench.geometry.transforms import is_rigid, planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.synth.placement import (
    CAMERAS,
    CameraConfig,
    SphereConfig,
    camera_config,
    place_camera,
    place_rgbd,
    place_sphere,
)
from hsbench.synth.seeds import Seeds
from hsbench.truth.walkable import walk_map

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


# --- kinds of cameras


def test_cameras_are_taken_by_name_and_changed_key_by_key() -> None:
    assert camera_config({}, "camera") == CameraConfig() == CAMERAS["kinect-v2-registered"]
    own = camera_config({"preset": "security", "width_px": 320, "tilt_deg": (20.0, 25.0)}, "camera")
    assert (own.stand, own.width_px, own.tilt_deg) == ("corner", 320, (20.0, 25.0))
    with pytest.raises(SchemaError, match="preset is 'fisheye'; expected one of kinect-v2-registered, kinect-v2, ord"):
        camera_config({"preset": "fisheye"}, "camera")
    with pytest.raises(SchemaError, match="unknown keys"):
        camera_config({"zoom": 2}, "camera")
    with pytest.raises(SchemaError, match=r"camera\.stand is 'ceiling'"):
        CameraConfig(stand="ceiling")


def across_deg(camera: PinholeCamera | BrownCamera, corner: tuple[float, float], other: tuple[float, float]) -> float:
    a, b = camera.rays_at(np.array([corner, other]))
    return math.degrees(math.acos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)))


def test_cameras_see_as_wide_as_they_say() -> None:
    kinect, security = CAMERAS["kinect-v2"].camera, CAMERAS["security"].camera
    assert isinstance(kinect, BrownCamera)
    assert (kinect.width_px, kinect.height_px) == (512, 424)
    assert across_deg(kinect, (0.0, 212.0), (512.0, 212.0)) == pytest.approx(70.6, abs=1.0)  # its published field
    assert across_deg(kinect, (256.0, 0.0), (256.0, 424.0)) == pytest.approx(60.0, abs=1.0)
    assert across_deg(CONFIG.camera, (0.0, 240.0), (640.0, 240.0)) == pytest.approx(70.6, abs=0.1)
    assert across_deg(security, (0.0, 240.0), (640.0, 240.0)) == pytest.approx(103.0, abs=0.5)


def test_a_security_camera_hangs_in_a_corner_and_looks_into_the_room() -> None:
    config = CAMERAS["security"]
    floor = np.stack(np.meshgrid(np.arange(0.1, 5, 0.2), np.arange(0.1, 4, 0.2)), axis=-1).reshape(-1, 2)
    for name, scene in ROOMS.items():
        outline = scene.rooms[0].outline_xy
        for k in range(25):
            pose, sensor = place_camera("monocular", scene, config, Seeds(0).child(k).rng("camera"))
            assert sensor.kind == "monocular"
            assert 1.9 <= sensor.height_m <= 2.15  # .15 m below the lowest ceiling
            assert 20.0 <= math.degrees(sensor.tilt_rad) <= 40.0
            away = np.abs(outline - pose[:2, 3]).max(axis=1).min()
            if name == "empty":  # elsewhere a corner may be full, or see the back of a shelf
                assert away == pytest.approx(config.wall_distance_m, abs=2e-4)
            ahead = (floor - pose[:2, 3]) @ pose[:2, 0] / np.linalg.norm(floor - pose[:2, 3], axis=1)
            assert (ahead > math.cos(math.radians(51.5)))[contains(outline, floor)].mean() > 0.35


def test_no_lens_is_put_into_the_ceiling() -> None:
    low = Scene("s", ROOMS["empty"].rooms, 2.05, ())
    for k in range(20):
        _, sensor = place_camera("monocular", low, CAMERAS["security"], Seeds(0).child(k).rng("camera"))
        assert sensor.height_m <= 1.9


# --- in the middle


SPHERE = SphereConfig()


def seen_from_middle(scene: Scene, k: int, config: SphereConfig = SPHERE):
    return place_sphere(scene, config, Seeds(0).child(k).rng("sphere"))


@pytest.mark.parametrize("name", ROOMS)
def test_a_sphere_stands_in_the_middle_where_a_body_can(name: str) -> None:
    scene = ROOMS[name]
    walk = walk_map(scene)
    cells = walk.centres()[walk.free]
    spread = np.array([((cells - cell) ** 2).sum(axis=1).mean() for cell in cells])
    for k in range(30):
        pose, sensor = seen_from_middle(scene, k)
        assert (sensor.kind, sensor.tilt_rad, sensor.roll_rad) == ("equirectangular", 0.0, 0.0)
        assert 1.2 <= sensor.height_m <= 1.8
        mine = np.abs(cells - pose[:2, 3]).max(axis=1).argmin()
        assert np.abs(cells[mine] - pose[:2, 3]).max() < 1e-4
        assert (spread < spread[mine] - 1e-9).mean() < SPHERE.central_share + 1e-9


def test_the_heading_of_a_sphere_says_nothing_of_the_walls() -> None:
    headings = {name: [seen_from_middle(scene, k)[0][:2, 0] for k in range(80)] for name, scene in ROOMS.items()}
    for found in headings.values():
        assert np.array_equal(found, headings["empty"])  # whatever stands in the room
    yaw = np.arctan2(*np.array(headings["empty"]).T[::-1])
    assert kstest(np.mod(yaw, np.pi / 2) / (np.pi / 2), "uniform").pvalue > 0.05


def test_a_sphere_keeps_out_of_the_way_of_doors() -> None:
    leaf = SceneObject(
        9,
        "door",
        planar(2.5, 4.0, np.pi),
        (Part("leaf", (1, 2, 3), "door", span((-0.45, -0.06, 0), (0.45, -0.02, 2))),),
    )
    small = Scene("s", (Room("hall", np.array([[1.0, 1.5], [4.0, 1.5], [4.0, 4.0], [1.0, 4.0]])),), 2.5, (leaf,))
    hinges = np.array([[2.05, 4.0], [2.95, 4.0]])
    stood = np.array([seen_from_middle(small, k, SphereConfig(central_share=1.0))[0][:2, 3] for k in range(60)])
    assert np.linalg.norm(stood[:, None] - hinges, axis=2).min() > 0.9
    assert stood[:, 1].max() > 2.7  # and no farther than needed


def test_a_place_before_a_shelf_is_left_for_a_clearer_one() -> None:
    high = room(RECTANGLE, ((0.3, 1.2, 0.9), (4.6, 1.35, 2.0)), ((0.3, 2.45, 0.9), (4.6, 2.6, 2.0)))
    free = SphereConfig(central_share=0.5, near_m=0.9, near_share=0.1)
    for k in range(10):
        pose, sensor = seen_from_middle(high, k, free)
        solids = pack_solids([s for item in high.objects for s in item.solids])
        image = cast(sensor.camera.scaled(0.1), pose @ sensor.world_T_camera, solids, np.zeros(2, np.int32), 1)
        assert (image.depth_m < 0.9).mean() < 0.12


def test_mesh_parts_count_as_convex_parts_do() -> None:
    """The same boxes as triangles: the same cameras."""
    scene = ROOMS["furnished"]
    objects = tuple(
        SceneObject(
            item.object_id,
            item.category_name,
            item.scene_T_object,
            tuple(Part(p.name, p.colour, p.role, None, (p.vertices, p.triangles)) for p in item.parts),
        )
        for item in scene.objects
    )
    imported = Scene(scene.scene_id, scene.rooms, scene.height_m, objects)
    for k in range(4):
        assert np.array_equal(seen_from_middle(scene, k)[0], seen_from_middle(imported, k)[0])
        pose, sensor = place(imported, k)
        lens = np.array([*pose[:2, 3], sensor.height_m])
        for item in scene.objects:
            low, high = item.solids[0].bounds
            assert np.linalg.norm(lens - np.clip(lens, low, high)) > 0.1
