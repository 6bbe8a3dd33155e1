"""A joint is drawn where its camera projects it: small spheres at points, within half a pixel, for every camera."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from hsbench.geometry.cameras import BrownCamera, Camera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.sensor import Sensor
from hsbench.synth.render import Lighting, Mesh, open_renderer
from hsbench.synth.render.raster import rasterise

RADIUS_M, REPROJECTION_PX = 0.03, 0.5
APART_PX = 50  # so that no sphere hides another
SENSORS = {
    "rgbd": Sensor("rgbd", PinholeCamera(640, 480, 452.0, 452.0, 320.0, 240.0), 1.7, 0.3, 0.05),
    "monocular": Sensor("monocular", BrownCamera(640, 480, 380.0, 385.0, 318.0, 245.0, -0.2, 0.04, 0.001), 2.2, 0.4),
    "equirectangular": Sensor("equirectangular", EquirectangularCamera(2048, 1024), 1.5),
    "topdown": Sensor("topdown", TopDownCamera(512, 512, 0.01), None),
}  # fmt: skip


def places(camera: Camera, pose: np.ndarray, count: int = 40) -> np.ndarray:
    """(count, 3) points 1.5 to 5 m from the camera whose spheres lie whole in the picture and apart from each other."""
    rng = np.random.default_rng(3)
    points = apply(pose, rng.normal(size=(4000, 3)) * rng.uniform(0.5, 2.0, (4000, 1)))
    if isinstance(camera, TopDownCamera):
        points = rng.uniform((-3.0, -3.0, 0.1), (3.0, 3.0, 1.9), (4000, 3))
    pixels, _ = camera.project(apply(invert(pose), points))
    away = np.linalg.norm(points - pose[:3, 3], axis=1)
    u, v = pixels.T
    whole = (u > 20) & (u < camera.width_px - 20) & (v > 20) & (v < camera.height_px - 20)
    chosen: list[int] = []
    for k in np.flatnonzero(whole & (away > 1.5) & (away < 5.0)):
        if all(np.linalg.norm(pixels[chosen] - pixels[k], axis=1) > APART_PX):
            chosen.append(k)
    return points[chosen[:count]]


@pytest.mark.parametrize("drawn_by", ["raycast", "raster"])
@pytest.mark.parametrize("kind", SENSORS)
def test_a_small_sphere_is_drawn_about_its_projection(kind: str, drawn_by: str) -> None:
    sensor = SENSORS[kind]
    camera, pose = sensor.camera, sensor.world_T_camera
    ball = trimesh.creation.icosphere(subdivisions=2, radius=RADIUS_M)
    triangles = np.asarray(ball.faces, dtype=np.int32)
    colours = np.full((len(triangles), 3), 200, dtype=np.uint8)
    points = places(camera, pose)
    assert len(points) >= 30
    draw = open_renderer("raycast").render if drawn_by == "raycast" else rasterise
    meshes = [Mesh(k, np.asarray(ball.vertices) + point, triangles, colours) for k, point in enumerate(points, 1)]
    ids = draw(meshes, camera, pose, Lighting(1.0), None).ids
    for mesh, point in zip(meshes, points, strict=True):
        row, column = np.nonzero(ids == mesh.mesh_id)
        assert len(row) > 10
        expected, _ = camera.project(apply(invert(pose), point))
        if kind == "equirectangular":  # towards the poles columns are narrow: look across from the sphere's own azimuth
            assert abs(np.mean(row + 0.5) - expected[1]) < REPROJECTION_PX + 0.5 / len(np.unique(row))
            assert abs(np.median(column + 0.5) - expected[0]) < REPROJECTION_PX
        else:
            assert np.linalg.norm([np.mean(column + 0.5), np.mean(row + 0.5)] - expected) < REPROJECTION_PX
