"""Rotations of vectors in plain floats, which are faster than NumPy arrays of three numbers.

Quaternions are (w, x, y, z), of unit length, and rotate body axes to world axes.
"""

import math
from collections.abc import Sequence

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

#: identity matrix (3, 3), row by row
IDENTITY_MATRIX = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def matrix_product(matrix: Sequence[float], v: Sequence[float]) -> Vector:
    """Return the product of a matrix (3, 3), row by row, with a vector."""
    a, b, c, d, e, f, g, h, i = matrix
    x, y, z = v
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def to_world(q: Sequence[float], v: Sequence[float]) -> Vector:
    """Rotate a vector from body axes to world axes."""
    return _rotate(q[0], q[1], q[2], q[3], v)


def to_body(q: Sequence[float], v: Sequence[float]) -> Vector:
    """Rotate a vector from world axes to body axes."""
    return _rotate(q[0], -q[1], -q[2], -q[3], v)


def _rotate(w: float, x: float, y: float, z: float, v: Sequence[float]) -> Vector:
    a, b, c = v
    s, t, u = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a + w * s + y * u - z * t, b + w * t + z * s - x * u, c + w * u + x * t - y * s


def quaternion_product(a: Sequence[float], b: Sequence[float]) -> Quaternion:
    """Return the quaternion product a b: the rotation b followed by a, about fixed axes."""
    w, x, y, z = a
    o, p, q, r = b
    return (
        w * o - x * p - y * q - z * r,
        w * p + x * o + y * r - z * q,
        w * q - x * r + y * o + z * p,
        w * r + x * q - y * p + z * o,
    )


def inverse_quaternion(q: Sequence[float]) -> Quaternion:
    """Return the inverse rotation."""
    return q[0], -q[1], -q[2], -q[3]


def normalised_quaternion(q: Sequence[float]) -> Quaternion:
    """Return the quaternion scaled to unit length."""
    w, x, y, z = q
    length = math.sqrt(w * w + x * x + y * y + z * z)
    return w / length, x / length, y / length, z / length


def quaternion_from_rotation_vector(v: Sequence[float]) -> Quaternion:
    """Return the quaternion of a rotation vector (rad)."""
    x, y, z = v
    angle = math.sqrt(x * x + y * y + z * z)
    share = math.sin(angle / 2) / angle if angle > 1e-9 else 0.5
    return math.cos(angle / 2), share * x, share * y, share * z


def midpoint_attitude(a: Sequence[float], b: Sequence[float]) -> Quaternion:
    """Return the attitude halfway between two attitudes, along the shorter rotation."""
    w, x, y, z = a
    o, p, q, r = b
    if w * o + x * p + y * q + z * r >= 0:
        return normalised_quaternion((w + o, x + p, y + q, z + r))
    return normalised_quaternion((w - o, x - p, y - q, z - r))


def euler_angles(q: Sequence[float]) -> Vector:
    """Return roll, pitch and yaw (rad, ZYX) of a quaternion."""
    w, x, y, z = q
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    return roll, pitch, math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Return the vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def add_scaled(vector: Sequence[float], gain: float, change: Sequence[float]) -> Vector:
    """Return vector + gain * change."""
    return vector[0] + gain * change[0], vector[1] + gain * change[1], vector[2] + gain * change[2]


def difference(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
