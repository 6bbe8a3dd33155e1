"""Rotations, quaternions and rigid transforms against scipy and against each other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import (
    apply,
    cos_sin,
    invert,
    is_rigid,
    matrix_from_quaternion,
    planar,
    quaternion_from_matrix,
    rigid,
    rotation_x,
    rotation_y,
    rotation_z,
    wrap_angle,
)

ANGLES = st.floats(-20.0, 20.0)
METRES = st.floats(-100.0, 100.0)
VECTORS = st.tuples(METRES, METRES, METRES)
UNIT = st.floats(-1.0, 1.0)
QUATERNIONS = st.tuples(UNIT, UNIT, UNIT, UNIT).filter(lambda q: np.linalg.norm(q) > 0.1).map(np.array)
TURNED_180 = [np.array([0.0, *v]) for v in np.vstack([np.eye(3), -np.eye(3), [[1, 1, 0], [0, -1, 1], [1, -2, 3]]])]


def scipy_matrix(wxyz: np.ndarray) -> np.ndarray:
    w, x, y, z = wxyz
    return Rotation.from_quat([x, y, z, w]).as_matrix()


@given(ANGLES)
@pytest.mark.parametrize(("name", "rotation"), [("x", rotation_x), ("y", rotation_y), ("z", rotation_z)])
def test_axis_rotations_are_right_handed(name: str, rotation, angle: float) -> None:
    assert np.allclose(rotation(angle), Rotation.from_euler(name, angle).as_matrix(), rtol=0, atol=1e-11)


def test_quarter_turns_are_exact() -> None:
    # Rounding to 12 decimals removes the 6e-17 of the mathematics library.
    assert cos_sin(np.pi / 2) == (0.0, 1.0)
    assert cos_sin(np.pi) == (-1.0, 0.0)
    assert np.array_equal(rotation_z(np.pi / 2) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    assert np.array_equal(rotation_x(np.pi / 2) @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    assert np.array_equal(rotation_y(np.pi / 2) @ [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])


@given(QUATERNIONS)
@example(np.array([1.0, 0.0, 0.0, 0.0]))
def test_matrix_of_a_quaternion_is_scipys(q: np.ndarray) -> None:
    assert np.allclose(matrix_from_quaternion(q), scipy_matrix(q), rtol=0, atol=1e-12)


@given(QUATERNIONS, st.sampled_from([*TURNED_180, *np.eye(4)]), st.booleans())
def test_quaternion_round_trip(q: np.ndarray, exact: np.ndarray, use_exact: bool) -> None:
    q = (exact if use_exact else q) / np.linalg.norm(exact if use_exact else q)
    back = quaternion_from_matrix(matrix_from_quaternion(q))
    assert back[0] >= 0
    assert np.linalg.norm(back) == pytest.approx(1.0, abs=1e-14)
    assert min(np.abs(back - q).max(), np.abs(back + q).max()) < 1e-12


@pytest.mark.parametrize("q", TURNED_180)
@pytest.mark.parametrize("tilt", [0.0, 1e-9, -1e-9, 1e-5])
def test_turns_by_and_about_180_degrees(q: np.ndarray, tilt: float) -> None:
    turned = scipy_matrix(q) @ rotation_z(tilt)
    assert np.allclose(matrix_from_quaternion(quaternion_from_matrix(turned)), turned, rtol=0, atol=1e-12)


def test_quaternions_in_batches_and_of_any_length() -> None:
    rng = np.random.default_rng(0)
    q = rng.normal(size=(3, 5, 4))
    matrices = matrix_from_quaternion(q * 7.5)
    assert matrices.shape == (3, 5, 3, 3)
    for index in np.ndindex(3, 5):
        assert np.allclose(matrices[index], scipy_matrix(q[index]), rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match="length zero"):
        matrix_from_quaternion(np.array([[1.0, 0, 0, 0], [0, 0, 0, 0]]))


@given(QUATERNIONS, VECTORS, VECTORS)
def test_invert_undoes_apply(q: np.ndarray, t: tuple[float, ...], p: tuple[float, ...]) -> None:
    a_T_b = rigid(scipy_matrix(q), t)
    assert np.allclose(invert(a_T_b), np.linalg.inv(a_T_b), rtol=0, atol=1e-10)
    assert np.allclose(apply(invert(a_T_b), apply(a_T_b, np.array(p))), p, rtol=0, atol=1e-10)
    homogeneous = a_T_b @ [*p, 1.0]
    assert np.allclose(apply(a_T_b, np.array(p)), homogeneous[:3], rtol=0, atol=1e-10)


@given(VECTORS, ANGLES, VECTORS)
def test_planar_turns_about_z_then_moves(t: tuple[float, float, float], yaw: float, p: tuple[float, ...]) -> None:
    x, y, z = t
    moved = apply(planar(x, y, yaw, z), np.array(p))
    turned = (p[0] + 1j * p[1]) * np.exp(1j * yaw)
    assert np.allclose(moved, [turned.real + x, turned.imag + y, p[2] + z], rtol=0, atol=1e-9)


def test_products_of_transforms_apply_from_the_right() -> None:
    rng = np.random.default_rng(1)
    a_T_b = rigid(Rotation.random(random_state=1).as_matrix(), tuple(rng.normal(size=3)))
    b_T_c = rigid(Rotation.random(random_state=2).as_matrix(), tuple(rng.normal(size=3)))
    points_c = rng.normal(size=(4, 5, 3))
    assert np.allclose(apply(a_T_b @ b_T_c, points_c), apply(a_T_b, apply(b_T_c, points_c)), rtol=0, atol=1e-12)


@given(QUATERNIONS, VECTORS)
def test_rigid_transforms_are_recognised(q: np.ndarray, t: tuple[float, ...]) -> None:
    assert is_rigid(rigid(scipy_matrix(q), t))


def _spoilt(row: int, column: int, value: float) -> np.ndarray:
    matrix = planar(1.0, 2.0, 0.3)
    matrix[row, column] = value
    return matrix


@pytest.mark.parametrize(
    "matrix",
    [
        np.eye(3),
        np.diag([1.0, 1.0, -1.0, 1.0]),  # a mirror
        np.diag([1.001, 1.0, 1.0, 1.0]),  # a scale
        np.diag([1.0, 1.0, 1.0, 2.0]),
        np.zeros((4, 4)),
        _spoilt(3, 0, 1e-3),
        _spoilt(0, 3, np.nan),
        _spoilt(0, 3, np.inf),
        _spoilt(0, 2, 1e-3),  # a shear
        planar(1.0, 2.0, 0.3).T,
    ],
)
def test_other_matrices_are_not_rigid(matrix: np.ndarray) -> None:
    assert not is_rigid(matrix)


@given(st.floats(-1000.0, 1000.0))
@example(np.pi)
@example(-np.pi)
@example(3 * np.pi)
def test_wrap_angle_keeps_the_direction(angle: float) -> None:
    wrapped = float(wrap_angle(angle))
    assert -np.pi <= wrapped < np.pi
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * angle), abs=1e-11)


@given(st.integers(-(10**7), 10**7), st.floats(-0.49e-4, 0.49e-4))
def test_lengths_are_rounded_to_a_tenth_of_a_millimetre(tenths_mm: int, error: float) -> None:
    assert float(quantise_m(tenths_mm * 1e-4 + error)) == tenths_mm / 10**4
    assert float(quantise_m(quantise_m(tenths_mm * 1e-4 + error))) == tenths_mm / 10**4


def test_quantised_zero_has_no_sign() -> None:
    assert not np.signbit(quantise_m(np.array([-1e-9, -0.0, 0.0]))).any()
    assert quantise_m(np.float32(0.1)).dtype == np.float64


@given(st.integers(-36000, 36000), st.floats(-0.0049, 0.0049))
def test_angles_are_rounded_to_a_hundredth_of_a_degree(hundredths: int, error_deg: float) -> None:
    rounded = quantise_angle(np.radians(hundredths / 100 + error_deg))
    assert np.degrees(rounded) * 100 == pytest.approx(hundredths, abs=1e-9)
    assert quantise_angle(rounded) == rounded
