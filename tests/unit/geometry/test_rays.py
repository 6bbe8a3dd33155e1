"""Rays against triangles tested one by one, against embree, and against boxes worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import BrownCamera, CentralCamera, EquirectangularCamera, PinholeCamera, world_T_camera
from hsbench.geometry.convex import ConvexSolid, box, cylinder, span
from hsbench.geometry.rays import cast, pack_solids, segments_blocked
from hsbench.geometry.transforms import apply, invert, planar, rigid

CAMERA = PinholeCamera(48, 36, 40.0, 42.0, 23.7, 18.2)
LENS = BrownCamera(48, 36, 25.0, 25.0, 23.7, 18.2, -0.2, 0.04, 0.002, -0.001, -0.0035)
SPHERE = EquirectangularCamera(64, 32)
POSE = planar(0.4, -0.2, 0.3) @ world_T_camera(1.4, 0.3, 0.05)


def random_solids(seed: int, count: int) -> list[ConvexSolid]:
    """Turned boxes and cones around and in front of the camera."""
    rng = np.random.default_rng(seed)
    solids = []
    for k in range(count):
        pose = rigid(Rotation.random(random_state=seed + k).as_matrix(), tuple(rng.uniform([0, -2, 0], [5, 2, 2.5])))
        solid = box(rng.uniform(0.1, 1.0, 3)) if k % 2 else cylinder(0.4, -0.3, 0.3, sides=7, top_radius_m=0.1)
        solids.append(solid.transformed(pose))
    return solids


def nearest_by_triangles(origin: np.ndarray, rays: np.ndarray, solid: ConvexSolid) -> np.ndarray:
    """(N,) smallest multiple of each ray at which it meets a triangle from outside (Moller & Trumbore), +inf = none."""
    best = np.full(len(rays), np.inf)
    for a, b, c in solid.vertices[solid.triangles]:
        normal = np.cross(b - a, c - a)
        along = rays @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (a - origin) @ normal / along
            hit = origin + t[:, None] * rays
            sides = [np.cross(q - p, hit - p) @ normal for p, q in ((a, b), (b, c), (c, a))]
            meets = (along < 0) & (t > 0) & np.all([s >= 0 for s in sides], axis=0)
        best = np.where(meets & (t < best), t, best)
    return best


def reference(
    solids: list[ConvexSolid], owner: list[int], n_owners: int, camera: CentralCamera = CAMERA
) -> tuple[np.ndarray, ...]:
    rays = (camera.rays().reshape(-1, 3)) @ POSE[:3, :3].T
    depth = np.array([nearest_by_triangles(POSE[:3, 3], rays, s) for s in solids]).reshape(len(solids), len(rays))
    by_owner = np.array(
        [np.min([d for d, o in zip(depth, owner, strict=True) if o == k], axis=0, initial=np.inf, keepdims=True)[0]
         if k in owner else np.full(len(rays), np.inf) for k in range(n_owners)]
    )  # fmt: skip
    nearest = by_owner.min(axis=0)
    seen = np.where(np.isfinite(nearest), by_owner.argmin(axis=0), -1)
    shape = (camera.height_px, camera.width_px)
    return nearest.reshape(shape), seen.reshape(shape), np.isfinite(by_owner).sum(axis=1)


def close(depth: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Equal to 1e-9, or both nothing."""
    both = np.isfinite(depth) & np.isfinite(expected)
    with np.errstate(invalid="ignore"):
        return (np.isinf(depth) & np.isinf(expected)) | (both & (np.abs(depth - expected) < 1e-9))


# ---------------------------------------------------------------- images


@pytest.mark.parametrize("camera", [CAMERA, LENS, SPHERE], ids=["pinhole", "lens", "sphere"])
@pytest.mark.parametrize("seed", range(6))
def test_images_agree_with_every_triangle_tested(seed: int, camera: CentralCamera) -> None:
    solids = random_solids(100 * seed, 9)
    owner = [0, 0, 1, 2, 2, 2, 4, 4, 5]  # owner 3 has nothing
    depth, seen, amodal = reference(solids, owner, 6, camera)
    image = cast(camera, POSE, pack_solids(solids), np.array(owner, dtype=np.int32), 6)
    assert close(image.depth_m, depth).all()
    assert np.array_equal(image.owner, seen)
    assert np.array_equal(image.amodal_px, amodal)
    assert np.isfinite(depth).any()
    assert image.amodal_px[3] == 0


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.floats(-np.pi, np.pi), st.sampled_from([SPHERE, LENS]))
def test_no_pixel_of_a_solid_lies_outside_its_window(seed: int, yaw: float, camera: CentralCamera) -> None:
    """All around, above, below, across the seam and about the axis."""
    rng = np.random.default_rng(seed)
    size, middle = rng.uniform(0.05, 2.0, 3), rng.normal(size=3) * rng.choice([0.3, 1.0, 3.0])
    pose = rigid(Rotation.random(random_state=seed).as_matrix(), tuple(middle))
    solid = box(size).transformed(planar(0.0, 0.0, yaw) @ pose)
    view = world_T_camera(1.0, 0.0) if seed % 2 else POSE
    rays = camera.rays().reshape(-1, 3) @ view[:3, :3].T
    expected = np.isfinite(nearest_by_triangles(view[:3, 3], rays, solid)).reshape(camera.rays().shape[:2])
    image = cast(camera, view, pack_solids([solid]), [0], 1)
    assert ((image.owner == 0) == expected).mean() > 0.999  # a ray through an edge may go either way
    assert abs(int(image.amodal_px[0]) - int(expected.sum())) <= 1


def test_depth_on_a_sphere_is_the_distance() -> None:
    room = [span((-2, -3, -1), (-1.9, 3, 3)), span((2, -3, -1), (2.1, 3, 3)), span((-2, -3, -1), (2, 3, 0))]
    image = cast(SPHERE, world_T_camera(1.5, 0.0), pack_solids(room), [0, 1, 2], 3)
    points = apply(world_T_camera(1.5, 0.0), SPHERE.unproject(np.where(image.owner >= 0, image.depth_m, 0.0)))
    assert points[image.owner == 0][:, 0] == pytest.approx(-1.9, abs=1e-9)
    assert points[image.owner == 1][:, 0] == pytest.approx(2.0, abs=1e-9)
    assert points[image.owner == 2][:, 2] == pytest.approx(0.0, abs=1e-9)
    assert (image.owner[20:] == 2).any(axis=1).all()  # down to the pole


def test_images_agree_with_embree() -> None:
    pytest.importorskip("embreex")
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    solids = random_solids(7, 12)
    mesh = trimesh.util.concatenate([trimesh.Trimesh(s.vertices, s.triangles, process=False) for s in solids])
    of_triangle = np.repeat(np.arange(len(solids)), [len(s.triangles) for s in solids])
    rays = CAMERA.rays().reshape(-1, 3) @ POSE[:3, :3].T
    origins = np.broadcast_to(POSE[:3, 3], rays.shape)
    intersector = RayMeshIntersector(mesh)
    triangle = intersector.intersects_first(origins, rays)
    image = cast(CAMERA, POSE, pack_solids(solids), np.arange(12, dtype=np.int32), 12)
    expected = np.where(triangle >= 0, of_triangle[triangle], -1).reshape(image.owner.shape)
    agree = image.owner == expected
    assert agree.mean() > 0.995  # embree works in single precision: silhouettes may flip a pixel
    normal, corner = mesh.face_normals[triangle], mesh.triangles[triangle, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.einsum("ij,ij->i", corner - origins, normal) / np.einsum("ij,ij->i", rays, normal)
    hit = agree & (expected >= 0)
    assert np.allclose(image.depth_m[hit], t.reshape(hit.shape)[hit], rtol=0, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_amodal_counts_are_those_of_an_owner_alone(seed: int) -> None:
    solids = random_solids(31 * seed, 8)
    owner = np.array([0, 1, 1, 2, 2, 2, 3, 3], dtype=np.int32)
    together = cast(CAMERA, POSE, pack_solids(solids), owner, 4)
    for k in range(4):
        mine = [s for s, o in zip(solids, owner, strict=True) if o == k]
        alone = cast(CAMERA, POSE, pack_solids(mine), np.zeros(len(mine), np.int32), 1)
        assert together.amodal_px[k] == (alone.owner == 0).sum() == alone.amodal_px[0]
        assert (alone.depth_m <= together.depth_m)[together.owner == k].all()
    assert ((together.owner == -1) == np.isinf(together.depth_m)).all()


def test_a_box_in_front_by_hand() -> None:
    # Camera at height 1 looking along +x; front face x = 2, y -.5...5, z .5..1.5: tangent .25 to all sides.
    camera = PinholeCamera(80, 60, 40.0, 40.0, 40.0, 30.0)
    image = cast(camera, world_T_camera(1.0, 0.0), pack_solids([span((2, -0.5, 0.5), (3, 0.5, 1.5))]), [0], 1)
    expected = np.full((60, 80), np.inf)
    expected[20:40, 30:50] = 2.0  # 10 px = 40 px * .25 to each side
    assert np.array_equal(image.depth_m, expected)
    assert image.amodal_px.tolist() == [400]


def test_depth_is_the_camera_z_coordinate_not_the_distance() -> None:
    wall = span((3.0, -50.0, -50.0), (4.0, 50.0, 50.0))
    image = cast(CAMERA, world_T_camera(1.0, 0.0), pack_solids([wall]), [0], 1)
    assert np.allclose(image.depth_m, 3.0, rtol=0, atol=1e-12)
    tilted = cast(CAMERA, world_T_camera(1.0, 0.4), pack_solids([wall]), [0], 1)
    points = apply(world_T_camera(1.0, 0.4), CAMERA.unproject(tilted.depth_m))
    assert np.allclose(points[..., 0], 3.0, rtol=0, atol=1e-9)


@settings(max_examples=25)
@given(st.integers(0, 1000))
def test_unprojected_pixels_lie_on_the_surface(seed: int) -> None:
    solids = random_solids(seed, 5)
    image = cast(CAMERA, POSE, pack_solids(solids), np.arange(5, dtype=np.int32), 5)
    seen = image.owner >= 0
    points = apply(POSE, CAMERA.unproject(np.where(seen, image.depth_m, 0.0)))
    for k, solid in enumerate(solids):
        mine = points[image.owner == k]
        excess = (mine @ solid.planes[:, :3].T - solid.planes[:, 3]).max(axis=1, initial=-np.inf)
        assert (np.abs(excess) < 1e-9).all()


@settings(max_examples=25)
@given(st.integers(0, 1000))
def test_moving_camera_and_solids_together_changes_no_image(seed: int) -> None:
    solids = random_solids(seed, 4)
    a_T_world = planar(3.0, -2.0, 1.1, 0.5)
    owner = np.arange(4, dtype=np.int32)
    still = cast(CAMERA, POSE, pack_solids(solids), owner, 4)
    moved = cast(CAMERA, a_T_world @ POSE, pack_solids([s.transformed(a_T_world) for s in solids]), owner, 4)
    same = (still.owner == moved.owner) & close(still.depth_m, moved.depth_m)
    assert same.mean() > 0.999  # a pixel exactly on an edge may fall to either side


def test_solids_around_behind_and_across_the_camera() -> None:
    pose = world_T_camera(1.0, 0.0)
    around = span((-1, -1, 0), (1, 1, 2))
    behind = span((-3, -1, 0), (-1, 1, 2))
    across = span((-1, -9, 0.0), (5, 9, 0.5))  # a platform below that reaches behind the camera
    image = cast(CAMERA, pose, pack_solids([around, behind, across]), np.arange(3, dtype=np.int32), 3)
    assert image.amodal_px[:2].tolist() == [0, 0]  # one does not see a solid from inside
    down = CAMERA.rays()[..., 1]
    with np.errstate(divide="ignore"):
        height = np.where(down > 0, 0.5 / down, np.inf)
    expected = np.where(height <= 5.0, height, np.inf)  # its far edge is 5 m away
    assert close(image.depth_m, expected).all()


def test_nothing_gives_an_empty_image() -> None:
    image = cast(CAMERA, POSE, pack_solids([]), np.empty(0, dtype=np.int32), 2)
    assert np.isinf(image.depth_m).all()
    assert (image.owner == -1).all()
    assert image.amodal_px.tolist() == [0, 0]


@pytest.mark.parametrize("owner", [[0], [0, 1, 1], [1, 0]])
def test_owners_must_fit(owner: list[int]) -> None:
    with pytest.raises(SchemaError, match=f"owner has {len(owner)} entries for 2 solids.*ascending"):
        cast(CAMERA, POSE, pack_solids([box((1, 1, 1)), box((2, 2, 2))]), np.array(owner, dtype=np.int32), 2)


def test_packing_keeps_every_plane_and_corner() -> None:
    solids = random_solids(1, 3)
    packed = pack_solids(solids)
    assert len(packed) == 3
    assert len(pack_solids([])) == 0
    for k, solid in enumerate(solids):
        assert np.array_equal(packed.planes[packed.plane_start[k] : packed.plane_start[k + 1]], solid.planes)
        assert np.array_equal(packed.corners[packed.corner_start[k] : packed.corner_start[k + 1]], solid.vertices)


# ---------------------------------------------------------------- lines of sight


@pytest.mark.parametrize("seed", range(5))
def test_blocked_segments_agree_with_dense_sampling(seed: int) -> None:
    solids = random_solids(17 * seed, 4)
    rng = np.random.default_rng(seed)
    origin = np.array([-0.5, 0.0, 1.2])
    targets = rng.uniform([0, -2, 0], [5, 2, 2.5], (300, 3))
    blocked = segments_blocked(origin, targets, pack_solids(solids))
    share = np.linspace(0, 1, 1500)[:, None]
    depths = []
    for target in targets:
        points = origin + share * (target - origin)
        depths.append(max(float(-(points @ s.planes[:, :3].T - s.planes[:, 3]).max(axis=1).min()) for s in solids))
    deepest = np.array(depths)  # how far inside a solid the segment comes, within the step of the samples
    assert blocked[deepest > 0].all()
    assert not blocked[deepest < -0.003].any()
    assert 0 < blocked.sum() < len(blocked)


@pytest.mark.parametrize("seed", range(3))
def test_blocked_segments_agree_with_triangles(seed: int) -> None:
    # From outside, a segment is blocked where it meets a triangle from outside before its end.
    solids = random_solids(5 + 40 * seed, 6)
    origin = np.array([-3.0, 0.1, 1.2])
    assert not any(s.contains(origin) for s in solids)
    targets = np.random.default_rng(seed).uniform([0, -2, 0], [5, 2, 2.5], (400, 3))
    nearest = np.min([nearest_by_triangles(origin, targets - origin, s) for s in solids], axis=0)
    assert np.array_equal(segments_blocked(origin, targets, pack_solids(solids)), nearest < 1.0)


CUBE = pack_solids([span((1, -1, -1), (2, 1, 1))])


@pytest.mark.parametrize(
    ("origin", "target", "blocked"),
    [
        ((0, 0, 0), (3, 0, 0), True),  # through
        ((0, 0, 0), (0.9, 0, 0), False),  # short of it
        ((0, 0, 0), (1, 0, 0), False),  # ends on the face
        ((0, 0, 0), (1 + 1e-9, 0, 0), True),  # ends just inside
        ((0, 0, 0), (1.5, 0, 0), True),  # target inside
        ((1.5, 0, 0), (5, 0, 0), True),  # origin inside
        ((1.2, 0, 0), (1.8, 0.5, 0.5), True),  # both inside
        ((2, 0, 0), (3, 0, 0), False),  # starts on the far face and leaves
        ((2, 0, 0), (1.5, 0, 0), True),  # starts on a face and goes in
        ((1, 1, 0), (2, 1, 0), False),  # along a face
        ((0, 1, 0), (3, 1, 0), False),  # along a face, from afar
        ((0, 1, 1), (3, 1, 1), False),  # along an edge
        ((0, 1 - 1e-9, 0), (3, 1 - 1e-9, 0), True),  # a hair inside the face
        ((0, 2, 0), (2, 0.0001, 0), True),
        ((0, 2, 0), (2, 2, 0), False),  # parallel, outside
        ((0, 0, 0), (2, 2, 0), False),  # touches the edge x = 1, y = 1 only
        ((3, 0, 0), (0, 0, 0), True),  # backwards
        ((-1, 0, 0), (-3, 0, 0), False),  # away from it
        ((1.5, 0, 0), (1.5, 0, 0), True),  # no length, inside
        ((0, 0, 0), (0, 0, 0), False),  # no length, outside
    ],
)
def test_segments_at_a_cube_by_hand(origin: tuple, target: tuple, blocked: bool) -> None:
    result = segments_blocked(np.array(origin, dtype=np.float64), np.array([target], dtype=np.float64), CUBE)
    assert result.tolist() == [blocked]


@given(st.tuples(*[st.floats(-4, 4)] * 3), st.tuples(*[st.floats(-4, 4)] * 3))
def test_a_segment_is_blocked_from_either_end(a: tuple, b: tuple) -> None:
    solids = pack_solids(random_solids(3, 3))
    p, q = np.array(a), np.array(b)
    deep = segments_blocked(p, q[None], solids)[0]
    # Grazing contacts may round differently; compare where shrinking the solids by 1 nm changes nothing.
    shrunk = pack_solids(random_solids(3, 3))
    shrunk.planes[:, 3] -= 1e-9
    if deep == segments_blocked(p, q[None], shrunk)[0]:
        assert segments_blocked(q, p[None], solids)[0] == deep


def test_no_solids_block_nothing() -> None:
    assert not segments_blocked(np.zeros(3), np.ones((4, 3)), pack_solids([])).any()
    assert segments_blocked(np.zeros(3), np.empty((0, 3)), CUBE).shape == (0,)


def test_what_the_image_shows_is_not_blocked() -> None:
    solids = random_solids(23, 6)
    packed = pack_solids(solids)
    image = cast(CAMERA, POSE, packed, np.arange(6, dtype=np.int32), 6)
    seen = image.owner >= 0
    z = image.depth_m[seen][:, None]
    rays = CAMERA.rays()[seen]
    before, behind = apply(POSE, rays * (z - 1e-6)), apply(POSE, rays * (z + 1e-6))
    assert not segments_blocked(POSE[:3, 3], before, packed).any()
    assert segments_blocked(POSE[:3, 3], behind, packed).all()
    assert np.allclose(apply(invert(POSE), before)[:, 2], z[:, 0] - 1e-6, rtol=0, atol=1e-9)
