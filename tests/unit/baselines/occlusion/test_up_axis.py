"""Up from depth alone: boxes of rooms by rays at any lean, generated rooms with a Kinect's noise, and no floor."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.baselines.occlusion.boundary import wall_yaw
from hsbench.baselines.occlusion.up_axis import USUAL_HEIGHT_M, floor_plane, sensor_from_depth
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import apply, rotation_z
from hsbench.io.depth_noise import KINECT, add_noise, noise_rng
from hsbench.schema.sensor import Sensor
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.placement import CameraConfig, place_rgbd
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.truth.sight import ray_image

CAMERA = PinholeCamera(320, 240, 226.0, 226.0, 160.0, 120.0)
LOW, HIGH = np.array([-0.3, -2.0]), np.array([4.2, 1.8])


def degrees_apart(found: Sensor, true: Sensor) -> float:
    """Between the two directions of up in the camera frame."""
    return math.degrees(math.acos(min(1.0, float(found.world_T_camera[2, :3] @ true.world_T_camera[2, :3]))))


def empty_room(sensor: Sensor, yaw: float = 0.0, height_m: float = 2.5) -> np.ndarray:
    """(h, w) depth of a box whose axes are turned by ``yaw`` in the episode frame: the nearest plane of each ray."""
    rays = CAMERA.rays() @ sensor.world_T_camera[:3, :3].T
    along = rays[..., :2] @ rotation_z(yaw)[:2, :2]
    with np.errstate(divide="ignore"):
        sides = [np.where(along[..., k] > 0, HIGH[k], LOW[k]) / along[..., k] for k in range(2)]
        flat = np.where(rays[..., 2] > 0, height_m - sensor.height_m, -sensor.height_m) / rays[..., 2]
    return np.minimum.reduce([*sides, flat])


@settings(max_examples=40, deadline=None)
@given(st.floats(1.0, 2.1), st.floats(0.12, 0.6), st.floats(-0.25, 0.25), st.floats(-0.6, 0.6))
def test_an_empty_room_is_put_upright(height_m: float, tilt: float, roll: float, yaw: float) -> None:
    """Blocks across the edge between floor and wall are a little above the floor: the rest of the error."""
    true = Sensor("rgbd", CAMERA, height_m, tilt, roll)
    found = sensor_from_depth(CAMERA, empty_room(true, yaw))
    assert degrees_apart(found, true) < 0.3
    assert abs(found.height_m - height_m) < 0.01
    assert abs(found.roll_rad - roll) < math.radians(0.3)


@pytest.mark.parametrize("yaw_deg", [-35.0, -10.0, 0.0, 22.0])
def test_the_walls_of_the_upright_room_are_found_from_the_same_frame(yaw_deg: float) -> None:
    true = Sensor("rgbd", CAMERA, 1.6, 0.3, 0.05)
    depth = add_noise(empty_room(true, math.radians(yaw_deg)), KINECT, noise_rng(0, 7))
    found = sensor_from_depth(CAMERA, depth)
    points = apply(found.world_T_camera, CAMERA.unproject(depth))[depth > 0]
    # Roll does not turn the heading: the walls are where they were drawn.
    off = (math.degrees(wall_yaw(points)) - yaw_deg + 45.0) % 90.0 - 45.0
    assert abs(off) < 1.5
    assert degrees_apart(found, true) < 1.0


@pytest.mark.parametrize("number", range(6))
def test_furnished_rooms_with_noise(number: int) -> None:
    """Rooms and cameras that are generated, so that their tilt is known; a floor that furniture hides in large part."""
    seeds = Seeds(1).child(number)
    scene = build_scene(f"scene-{number}", seeds.child("room"), RoomConfig(), COMMON_FAMILIES)
    scene_T_episode, sensor = place_rgbd(scene, CameraConfig(), seeds.rng("camera"))
    image = ray_image(scene, sensor.camera, scene_T_episode @ sensor.world_T_camera)
    depth = add_noise(np.where(np.isfinite(image.depth_m), image.depth_m, 0.0), KINECT, noise_rng(number, 0))
    found = sensor_from_depth(sensor.camera, depth)
    assert degrees_apart(found, sensor) < 1.0
    assert abs(found.height_m - sensor.height_m) < 0.05


@pytest.mark.parametrize("depth", [0.0, 2.0])
def test_without_a_floor_the_camera_is_level(depth: float) -> None:
    """Nothing measured, and a wall alone that the camera faces."""
    image = np.full((240, 320), depth)
    assert floor_plane(CAMERA, image) is None
    found = sensor_from_depth(CAMERA, image)
    assert (found.height_m, found.tilt_rad, found.roll_rad) == (USUAL_HEIGHT_M, 0.0, 0.0)


def test_a_table_is_not_the_floor_while_some_floor_is_seen() -> None:
    """A large top at .75 m: seven times the pixels of what is left of the floor, but there is something below it."""
    sensor = Sensor("rgbd", CAMERA, 1.6, 0.5)
    depth = empty_room(sensor)
    points = apply(sensor.world_T_camera, CAMERA.unproject(depth))
    scale = (sensor.height_m - 0.75) / (sensor.height_m - points[..., 2])
    top = points * scale[..., None]
    on_top = (scale > 0) & (scale < 1) & (np.abs(top[..., 1]) < 0.9) & (top[..., 0] > 0.4) & (top[..., 0] < 1.8)
    with_table = np.where(on_top, depth * scale, depth)
    floor = (points[..., 2] < 0.01) & ~on_top
    assert 0 < 7 * floor.sum() < on_top.sum()
    assert abs(sensor_from_depth(CAMERA, with_table).height_m - 1.6) < 0.01
