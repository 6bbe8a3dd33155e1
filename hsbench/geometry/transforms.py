"""Rigid transforms: (4, 4) float64 matrices ``a_T_b`` that map b coordinates to a, and w x y z quaternions.

Rotations are built from cosines and sines rounded to 12 decimals, so that the last bit of a machine's
mathematics library never reaches a decision or a stored value.
"""

from __future__ import annotations

import numpy as np

from hsbench.typing import FloatArray

ANGLE_DECIMALS = 12


def cos_sin(angle_rad: float) -> tuple[float, float]:
    """Cosine and sine of an angle, rounded to 12 decimals (the same value on every machine)."""
    return (
        round(float(np.cos(angle_rad)), ANGLE_DECIMALS),
        round(float(np.sin(angle_rad)), ANGLE_DECIMALS),
    )


def rotation_x(angle_rad: float) -> FloatArray:
    """(3, 3) right-handed rotation about x."""
    c, s = cos_sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle_rad: float) -> FloatArray:
    """(3, 3) right-handed rotation about y."""
    c, s = cos_sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle_rad: float) -> FloatArray:
    """(3, 3) right-handed rotation about z (a yaw)."""
    c, s = cos_sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rigid(rotation: FloatArray, translation: FloatArray | tuple[float, float, float]) -> FloatArray:
    """(4, 4) transform from a (3, 3) rotation and a (3,) translation in metres."""
    a_T_b = np.eye(4)
    a_T_b[:3, :3] = rotation
    a_T_b[:3, 3] = translation
    return a_T_b


def planar(x_m: float, y_m: float, yaw_rad: float, z_m: float = 0.0) -> FloatArray:
    """(4, 4) transform that turns by a yaw about z and then moves to (x, y, z)."""
    return rigid(rotation_z(yaw_rad), (x_m, y_m, z_m))


def invert(a_T_b: FloatArray) -> FloatArray:
    """(4, 4) inverse ``b_T_a`` of a rigid transform."""
    rotation = a_T_b[:3, :3].T
    return rigid(rotation, -rotation @ a_T_b[:3, 3])


def apply(a_T_b: FloatArray, points_b: FloatArray) -> FloatArray:
    """(..., 3) points in b coordinates -> (..., 3) points in a coordinates."""
    return points_b @ a_T_b[:3, :3].T + a_T_b[:3, 3]


def is_rigid(matrix: FloatArray, tolerance: float = 1e-6) -> bool:
    """Whether a matrix is (4, 4), finite, a proper rotation and a translation."""
    return (
        matrix.shape == (4, 4)
        and bool(np.isfinite(matrix).all())
        and bool(np.allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=tolerance))
        and float(np.linalg.det(matrix[:3, :3])) > 0.0
        and bool(np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]))
    )


def matrix_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """(..., 4) unit quaternions w x y z -> (..., 3, 3) rotations. Zero quaternions raise ValueError."""
    quaternion = np.asarray(quaternion, dtype=np.float64)
    norm = np.linalg.norm(quaternion, axis=-1, keepdims=True)
    if not np.all(norm > 0.0):
        raise ValueError("quaternion has length zero; expected w x y z of unit length")
    w, x, y, z = np.moveaxis(quaternion / norm, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(rotation: FloatArray) -> FloatArray:
    """(3, 3) rotation -> (4,) unit quaternion w x y z with w >= 0 (Shepperd's method: largest component first)."""
    m = np.asarray(rotation, dtype=np.float64)
    trace = np.trace(m)
    squares = np.array([trace, m[0, 0], m[1, 1], m[2, 2]])
    largest = int(np.argmax(squares))
    if largest == 0:
        q = np.array([1 + trace, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    else:
        i, j, k = (largest - 1, largest % 3, (largest + 1) % 3)
        q = np.empty(4)
        q[0] = m[k, j] - m[j, k]
        q[1 + i] = 1 + m[i, i] - m[j, j] - m[k, k]
        q[1 + j] = m[j, i] + m[i, j]
        q[1 + k] = m[k, i] + m[i, k]
    q /= np.linalg.norm(q)
    return q if q[0] >= 0 else -q


def wrap_angle(angle_rad: FloatArray | float) -> FloatArray:
    """Angles in radians -> the same directions in [-pi, pi)."""
    return np.asarray((np.asarray(angle_rad, dtype=np.float64) + np.pi) % (2 * np.pi) - np.pi)
