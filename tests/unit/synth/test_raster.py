"""The rasteriser: every pixel is what its own ray meets, for every camera; windows, edges and shading agree with it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from render_room import CAMERA as ROOM_CAMERA
from render_room import LIGHTS, POSE, ellipsoid, person

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import BrownCamera, Camera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.synth.crops import crop
from hsbench.synth.render import Lighting, Mesh, Window
from hsbench.synth.render.base import CUT_M, NEAR_M
from hsbench.synth.render.raster import amodal_masks, layer, rasterise

CAMERAS: dict[str, Camera] = {
    "pinhole": PinholeCamera(32, 24, 20.0, 22.0, 15.0, 12.5),
    "brown": BrownCamera(40, 30, 22.0, 22.0, 20.0, 15.0, k1=-0.2, k2=0.03, p1=0.002, p2=-0.003),
    "equirectangular": EquirectangularCamera(48, 24),
    "topdown": TopDownCamera(30, 26, 0.15),
}
UNLIT = Lighting(1.0)
SHADING_LEVELS = 1  # bytes may differ by rounding


@pytest.fixture(params=CAMERAS)
def camera(request: pytest.FixtureRequest) -> Camera:
    return CAMERAS[request.param]


def pose_of(camera: Camera) -> np.ndarray:
    return np.eye(4) if isinstance(camera, TopDownCamera) else POSE


def soup(rng: np.random.Generator, camera: Camera, count: int) -> Mesh:
    """Triangles around the camera, near and far, small and large, astride its plane, its seam and its poles."""
    middles = rng.normal(size=(count, 1, 3)) * rng.choice([0.1, 1.0, 2.0], size=(count, 1, 1))
    corners = middles + rng.normal(size=(count, 3, 3)) * rng.choice([0.1, 1.0, 3.0], size=(count, 1, 1))
    vertices = apply(pose_of(camera), corners.reshape(-1, 3))
    triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return Mesh(7, vertices, triangles, rng.integers(0, 256, (count, 3), np.uint8))


def brute_force(mesh: Mesh, camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(h, w) depth, (h, w, 3) colour, and whether a pixel is clear: no ray passes within 1e-7 of a triangle's border.

    Every pixel's ray against the plane of every triangle.
    """
    corners = apply(invert(pose_of(camera)), mesh.vertices)[mesh.triangles]
    rays = camera.rays()[:, :, None]
    start = camera.origins()[:, :, None] if isinstance(camera, TopDownCamera) else np.zeros(3)
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ab, ac)
    square = (normal**2).sum(axis=1)
    with np.errstate(all="ignore"):
        towards = (normal * rays).sum(axis=-1)
        along = (normal * (a - start)).sum(axis=-1) / towards
        offset = start + along[..., None] * rays - a
        v = (np.cross(offset, ac) * normal).sum(axis=-1) / square
        w = (np.cross(ab, offset) * normal).sum(axis=-1) / square
    from_above = isinstance(camera, TopDownCamera)
    front = towards > 0.0 if from_above else (towards < 0.0) & (along >= NEAR_M)
    least = np.minimum(np.minimum(v, w), 1.0 - v - w)
    hit = front & (least >= 0.0)
    clear = ~((np.abs(least) < 1e-7) | (np.abs(along - NEAR_M) < 1e-7)).any(axis=2)
    ranked = np.where(hit, -along if from_above else along, np.inf)
    best = ranked.argmin(axis=2)
    seen = hit.any(axis=2)
    depth = np.where(seen, np.take_along_axis(along, best[..., None], 2)[..., 0], 0.0)
    if from_above:
        depth = np.minimum(depth, CUT_M)
    return depth, np.where(seen[..., None], mesh.colours[best], 0), clear


@given(st.integers(0, 2**32), st.sampled_from(sorted(CAMERAS)))
@settings(max_examples=120, deadline=None)
def test_every_pixel_shows_what_its_ray_meets(seed: int, name: str) -> None:
    camera = CAMERAS[name]
    mesh = soup(np.random.default_rng(seed), camera, 12)
    view = rasterise([mesh], camera, pose_of(camera), UNLIT)
    depth, colour, clear = brute_force(mesh, camera)
    assert clear.mean() > 0.99
    assert np.array_equal((view.ids == 7)[clear], (depth != 0.0)[clear])
    assert np.allclose(view.depth_m[clear], depth[clear], rtol=1e-6, atol=1e-6)
    assert np.abs(view.rgb.astype(int) - colour)[clear].max(initial=0) <= SHADING_LEVELS


def test_a_closed_ball_around_the_camera_fills_the_picture(camera: Camera) -> None:
    """No pixel slips through: not at the seam or poles, where vertices lie exactly, nor between triangles."""
    if isinstance(camera, TopDownCamera):
        ball = ellipsoid(5, (0.0, 0.0, -5.0), (4.0, 4.0, 4.0), (10, 20, 30))
        camera_pose = np.eye(4)
    else:
        ball = ellipsoid(5, (0.0, 0.0, 0.0), (2.0, 2.0, 2.0), (10, 20, 30))
        ball = Mesh(5, ball.vertices, ball.triangles[:, ::-1], ball.colours)
        # Upright, so that the ball's poles and meridians are the picture's.
        camera_pose = np.eye(4)
        camera_pose[:3, :3] = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]).T
    view = rasterise([ball], camera, camera_pose, UNLIT)
    assert (view.ids == 5).all()


@given(st.integers(0, 2**32), st.sampled_from(sorted(CAMERAS)))
@settings(max_examples=60, deadline=None)
def test_a_window_is_cut_from_the_full_picture(seed: int, name: str) -> None:
    rng, camera = np.random.default_rng(seed), CAMERAS[name]
    mesh = soup(rng, camera, 20)
    u0, v0 = int(rng.integers(camera.width_px)), int(rng.integers(camera.height_px))
    window = Window(
        u0, v0, int(rng.integers(1, camera.width_px - u0 + 1)), int(rng.integers(1, camera.height_px - v0 + 1))
    )
    full = rasterise([mesh], camera, pose_of(camera), LIGHTS)
    part = rasterise([mesh], camera, pose_of(camera), LIGHTS, window)
    at = slice(v0, v0 + window.height), slice(u0, u0 + window.width)
    for kind in ("rgb", "depth_m", "ids"):
        assert np.array_equal(getattr(part, kind), getattr(full, kind)[at])


def test_shading_ids_and_depth_are_the_ray_casters() -> None:
    pytest.importorskip("embreex")
    from hsbench.synth.render import open_renderer

    meshes = [person(2.2, 2.0), ellipsoid(26, (2.9, 2.3, 0.85), (0.35, 0.35, 0.5), (92, 140, 84))]
    ours = rasterise(meshes, ROOM_CAMERA, POSE, LIGHTS)
    theirs = open_renderer("raycast").render(meshes, ROOM_CAMERA, POSE, LIGHTS)
    same = ours.ids == theirs.ids
    assert (~same).sum() <= 2  # embree finds triangles in float32
    close = same & (np.abs(ours.depth_m - theirs.depth_m) < 1e-4)
    assert (same & ~close).sum() <= 1e-3 * (ours.ids > 0).sum()
    assert np.abs(ours.rgb.astype(int) - theirs.rgb)[close].max() <= SHADING_LEVELS


def test_nothing_to_draw_and_what_is_refused(camera: Camera) -> None:
    empty = rasterise([], camera, pose_of(camera), LIGHTS)
    assert not empty.ids.any()
    assert not empty.depth_m.any()
    assert not empty.rgb.any()
    mesh = soup(np.random.default_rng(0), camera, 1)
    with pytest.raises(SchemaError, match="more than once"):
        rasterise([mesh, mesh], camera, pose_of(camera), LIGHTS)
    with pytest.raises(SchemaError, match="outside the image"):
        rasterise([mesh], camera, pose_of(camera), LIGHTS, Window(0, 0, camera.width_px + 1, 2))


# ---------------------------------------------------------------- silhouettes


def behind(camera: Camera, depth_m: float) -> np.ndarray:
    return np.full((camera.height_px, camera.width_px), depth_m, dtype=np.float32)


def ball_before(camera: Camera) -> Mesh:
    """A ball 2 m before the camera, or on the floor below one that looks from above."""
    centre = (0.3, 0.2, 0.8) if isinstance(camera, TopDownCamera) else tuple(apply(POSE, np.array([0.1, 0.2, 2.0])))
    return ellipsoid(9, centre, (0.6, 0.6, 0.6), (200, 100, 50))


def test_a_layer_is_the_view_but_for_smooth_silhouettes(camera: Camera) -> None:
    mesh, pose = ball_before(camera), pose_of(camera)
    far = 0.0 if isinstance(camera, TopDownCamera) else 9.0
    view = rasterise([mesh], camera, pose, UNLIT)
    drawn = layer(mesh, camera, pose, UNLIT, behind(camera, far), Window.full(camera))
    assert drawn is not None
    at = crop(drawn.window)
    assert np.array_equal(drawn.ids, view.ids[at])
    assert np.array_equal(drawn.depth_m, view.depth_m[at])
    assert (view.ids > 0).sum() == (drawn.ids > 0).sum()
    assert not drawn.coverage[[0, -1]].any() or drawn.window.height == camera.height_px
    assert set(np.unique(drawn.coverage)) == {0.0, 0.25, 0.5, 0.75, 1.0}
    colour = (np.array([200, 100, 50]) / 255.0) ** 2.2
    assert np.allclose(drawn.light[drawn.coverage > 0.0], colour)
    assert (drawn.coverage[drawn.ids > 0] > 0.0).mean() > 0.98
    assert (drawn.coverage[drawn.ids == 0] < 1.0).all()


def test_coverage_measures_area_better_than_centres() -> None:
    """A square of known size in front of the camera, moved by parts of a pixel."""
    camera = PinholeCamera(40, 40, 40.0, 40.0, 20.0, 20.0)
    side_px, triangles = 10.4, np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    errors = []
    for shift in np.random.default_rng(0).uniform(0.0, 1.0, (40, 2)):
        square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * side_px + 10.0 + shift
        points = np.column_stack([(square - 20.0) / 40.0, np.ones(4)]) * 2.0
        mesh = Mesh(1, points, triangles, np.full((2, 3), 255, np.uint8))
        drawn = layer(mesh, camera, np.eye(4), UNLIT, behind(camera, 0.0), Window.full(camera))
        assert drawn is not None
        errors.append((drawn.coverage.sum() - side_px**2, (drawn.ids > 0).sum() - side_px**2))
    smooth, hard = np.abs(errors).mean(axis=0)
    assert smooth < 0.5 * hard


def test_what_stands_before_hides(camera: Camera) -> None:
    mesh, pose = ball_before(camera), pose_of(camera)
    before = 3.0 if isinstance(camera, TopDownCamera) else 0.5
    hidden = layer(mesh, camera, pose, UNLIT, behind(camera, before), Window.full(camera))
    assert hidden is not None
    assert not hidden.coverage.any()
    assert not hidden.ids.any()
    away = Mesh(9, mesh.vertices + pose[:3, :3] @ np.array([50.0, 0.0, -9.0]), mesh.triangles, mesh.colours)
    drawn = layer(away, camera, pose, UNLIT, behind(camera, 60.0), Window(0, 0, 3, 3))
    assert drawn is None or not drawn.ids.any()


def test_amodal_masks_are_what_each_mesh_shows_alone(camera: Camera) -> None:
    near, pose = ball_before(camera), pose_of(camera)
    offset = (0.2, 0.0, -0.5) if isinstance(camera, TopDownCamera) else pose[:3, :3] @ (0.2, 0.0, 1.0)
    far = Mesh(3, near.vertices + offset, near.triangles, near.colours)
    masks = amodal_masks([near, far], camera, pose)
    both = rasterise([near, far], camera, pose, UNLIT)
    for mesh, mask in zip((near, far), masks, strict=True):
        assert np.array_equal(mask, rasterise([mesh], camera, pose, UNLIT).ids > 0)
        assert mask[both.ids == mesh.mesh_id].all()
    assert (masks[0] & masks[1]).any()
    assert np.array_equal(masks.any(axis=0), both.ids > 0)


def test_somebody_across_the_seam_is_one_body() -> None:
    """Turned by half a turn, the same pixels are half a picture away."""
    camera, mesh = EquirectangularCamera(96, 48), person(1.5, 0.0)
    ahead = planar(0.0, 0.0, 0.0, 1.4) @ np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
    back = planar(0.0, 0.0, np.pi) @ ahead
    whole, split = (rasterise([mesh], camera, pose, UNLIT) for pose in (ahead, back))
    assert split.ids[:, 0].any()
    assert split.ids[:, -1].any()
    assert (np.roll(split.ids, 48, axis=1) != whole.ids).sum() <= 2
