"""Bodies: proportions, capsules, and the mesh that renderers draw."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.synth.people import Body, body_mesh, capsules
from hsbench.synth.people.body import CAPSULE_JOINTS, STATURE_RANGE_M, STATURE_SPREAD_M, J
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.people.shapes import SHAPE_OF
from hsbench.synth.people.style import LEFT_HANDED, RANGES
from hsbench.synth.people.wardrobe import HAIR_STYLES, LEGS, OUTFITS, SLEEVES


def standing_joints(body: Body, yaw: float = 0.0) -> np.ndarray:
    return pose(body, standing(body, np.zeros(2), yaw), 30, None)


def test_samples_stay_in_range_and_follow_the_seed() -> None:
    bodies = [Body.sample(np.random.default_rng(seed)) for seed in range(50)]
    assert all(STATURE_RANGE_M[0] <= b.stature_m <= STATURE_RANGE_M[1] for b in bodies)
    assert bodies == [Body.sample(np.random.default_rng(seed)) for seed in range(50)]
    assert len(set(bodies)) == 50


def test_centimetres_are_refused() -> None:
    with pytest.raises(SchemaError, match="centimetres"):
        Body(175.0)


@pytest.mark.parametrize("field", ["shape", "hair_style", "sleeves", "legs"])
def test_unknown_looks_are_refused_with_those_there_are(field: str) -> None:
    with pytest.raises(SchemaError, match=f"body.{field} is 'toga'; expected one of"):
        Body(1.75, **{field: "toga"})


def test_samples_have_the_girth_and_looks_of_their_shape() -> None:
    bodies = [Body.sample(np.random.default_rng(seed)) for seed in range(300)]
    assert {b.shape for b in bodies} == set(SHAPE_OF)
    low, high = Body.GIRTH_RANGE
    for b in bodies:
        assert low - 1e-4 <= b.girth / SHAPE_OF[b.shape].girth <= high + 1e-4
        assert abs(b.stature_m - SHAPE_OF[b.shape].stature_m) <= STATURE_SPREAD_M + 1e-4
        assert (b.shirt, b.trousers) in OUTFITS
        assert SHAPE_OF[b.shape].gender == "female" or b.legs != "skirt"
    for field, known in (("hair_style", HAIR_STYLES), ("sleeves", SLEEVES), ("legs", LEGS)):
        assert {getattr(b, field) for b in bodies} == set(known)


def test_samples_have_styles_of_their_own_and_some_are_left_handed() -> None:
    styles = [Body.sample(np.random.default_rng(seed)).style for seed in range(400)]
    for name, (low, high) in RANGES.items():
        drawn = np.array([getattr(style, name) for style in styles])
        assert low <= drawn.min() < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < drawn.max() <= high
    left = sum(style.hand == 0 for style in styles)
    assert abs(left - LEFT_HANDED * len(styles)) < 4 * np.sqrt(len(styles) * LEFT_HANDED * (1 - LEFT_HANDED))


@pytest.mark.parametrize("stature", [1.55, 1.75, 1.95])
def test_standing_body_is_as_tall_as_it_says(stature: float) -> None:
    body = Body(stature)
    vertices, _, _ = body_mesh(body, standing_joints(body)[0])
    assert vertices[:, 2].max() == pytest.approx(stature, abs=0.03)
    assert vertices[:, 2].min() == pytest.approx(0.0, abs=0.01)


def test_left_is_left_of_where_the_body_faces() -> None:
    joints = standing_joints(Body(1.75), yaw=0.0)[0]
    for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle"):
        assert joints[J[f"{name}_left"], 1] > 0 > joints[J[f"{name}_right"], 1]
    assert (joints[[J["foot_left"], J["foot_right"]], 0] > joints[[J["ankle_left"], J["ankle_right"]], 0]).all()


def test_capsules_hold_their_joints_and_make_a_torso_wider_than_deep() -> None:
    body = Body(1.75)
    ends, radii = capsules(body, standing_joints(body))
    assert ends.shape == (1, len(CAPSULE_JOINTS), 2, 3)
    torso = [i for i, names in enumerate(CAPSULE_JOINTS) if names[:2] == ("spine_mid", "spine_shoulder")]
    low = (ends[0, torso] - radii[torso, :, None]).reshape(-1, 3).min(axis=0)
    high = (ends[0, torso] + radii[torso, :, None]).reshape(-1, 3).max(axis=0)
    assert high[1] - low[1] > 1.5 * (high[0] - low[0])
    assert (ends[0, :, :, 2] - radii > -0.005).all()


def test_mesh_topology_is_fixed_closed_and_outward() -> None:
    body = Body(1.7)
    first = body_mesh(body, standing_joints(body)[0])
    second = body_mesh(body, standing_joints(body, yaw=2.0)[0])
    assert np.array_equal(first[1], second[1])
    assert np.array_equal(first[2], second[2])
    assert first[1].dtype == np.int32
    assert first[2].dtype == np.uint8
    assert first[2].shape == first[1].shape
    edges = np.concatenate([first[1][:, [0, 1]], first[1][:, [1, 2]], first[1][:, [2, 0]]])
    directed = {(int(a), int(b)) for a, b in edges}
    assert len(directed) == len(edges)
    assert all((b, a) in directed for a, b in directed)
    for vertices, triangles, _ in (first, second):
        a, b, c = (vertices[triangles[:, i]] for i in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(0.075, abs=0.035)  # cubic metres


def test_face_in_front_hair_behind_shoes_ahead() -> None:
    body = Body(1.75, skin=(1, 0, 0), hair=(2, 0, 0), shoes=(3, 0, 0))
    joints = standing_joints(body)[0]
    vertices, triangles, colours = body_mesh(body, joints)
    middle = vertices[triangles].mean(axis=1)
    hair = middle[colours[:, 0] == 2]
    face = middle[(colours[:, 0] == 1) & (middle[:, 2] > joints[J["head"], 2] - 0.06)]
    assert hair[:, 0].mean() < joints[J["head"], 0] < face[:, 0].mean()
    shoes = middle[colours[:, 0] == 3]
    assert shoes[:, 0].max() - joints[J["ankle_left"], 0] > 1.5 * (joints[J["ankle_left"], 0] - shoes[:, 0].min())


def test_nobody_has_no_capsules() -> None:
    ends, radii = capsules(Body(1.75), np.zeros((0, 25, 3)))
    assert ends.shape == (0, len(CAPSULE_JOINTS), 2, 3)
    assert len(radii) == len(CAPSULE_JOINTS)
