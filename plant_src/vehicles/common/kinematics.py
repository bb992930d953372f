"""Rotations as CasADi expressions.

Quaternions are (w, x, y, z) and rotate body vectors into the world frame.
"""

import casadi as ca
from casadi import SX


def quaternion_product(a: SX, b: SX) -> SX:
    """Return the quaternion product a * b: rotation b followed by rotation a."""
    w, v = a[0], a[1:4]
    return ca.vertcat(w * b[0] - ca.dot(v, b[1:4]), w * b[1:4] + b[0] * v + ca.cross(v, b[1:4]))


def conjugate(q: SX) -> SX:
    """Return the conjugate, the inverse rotation of a unit quaternion."""
    return ca.vertcat(q[0], -q[1:4])


def normalised_quaternion(q: SX) -> SX:
    """Return q / |q|."""
    return q * (1 / ca.norm_2(q))


def rotation_matrix(q: SX) -> SX:
    """Return the rotation matrix (3, 3), body to world frame, of a unit quaternion."""
    w, x, y, z = ca.vertsplit(q)
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def quaternion_rate(q: SX, rates: SX) -> SX:
    """Return the time derivative of a quaternion for an angular velocity (rad/s, body frame)."""
    return quaternion_product(q, ca.vertcat(0, rates)) / 2


def quaternion_about_z(angle: SX) -> SX:
    """Return the rotation by an angle (rad) about the z axis."""
    return ca.vertcat(ca.cos(angle / 2), 0, 0, ca.sin(angle / 2))


def quaternion_from_euler(roll: SX, pitch: SX, yaw: SX) -> SX:
    """Return the quaternion of ZYX Euler angles (rad)."""
    about_x = ca.vertcat(ca.cos(roll / 2), ca.sin(roll / 2), 0, 0)
    about_y = ca.vertcat(ca.cos(pitch / 2), 0, ca.sin(pitch / 2), 0)
    return quaternion_product(quaternion_about_z(yaw), quaternion_product(about_y, about_x))


def euler_angles(q: SX) -> SX:
    """Return the ZYX Euler angles roll, pitch and yaw (rad), shape (3,)."""
    r = rotation_matrix(q)
    return ca.vertcat(
        ca.atan2(r[2, 1], r[2, 2]),
        ca.asin(ca.fmin(1, ca.fmax(-1, -r[2, 0]))),
        ca.atan2(r[1, 0], r[0, 0]),
    )


def euler_to_body_rates(roll: SX, pitch: SX) -> SX:
    """Return the matrix (3, 3) from the rates of roll, pitch and yaw to those of the body.

    The latter are p, q, r in the body frame (Fossen 2021, Handbook of Marine Craft Hydrodynamics
    and Motion Control, 2nd edition, section 2.2).
    """
    cos, sin = ca.cos(roll), ca.sin(roll)
    about_y = ca.vertcat(0, cos, -sin)
    about_z = ca.vertcat(-ca.sin(pitch), sin * ca.cos(pitch), cos * ca.cos(pitch))
    return ca.horzcat(SX([1, 0, 0]), about_y, about_z)


def body_to_euler_rates(roll: SX, pitch: SX) -> SX:
    """Return the inverse of `euler_to_body_rates`, singular at a pitch of 90 degrees."""
    cos, sin, tan_pitch = ca.cos(roll), ca.sin(roll), ca.tan(pitch)
    about_y = ca.vertcat(sin * tan_pitch, cos, sin / ca.cos(pitch))
    about_z = ca.vertcat(cos * tan_pitch, -sin, cos / ca.cos(pitch))
    return ca.horzcat(SX([1, 0, 0]), about_y, about_z)


def rotation_vector(q: SX) -> SX:
    """Return the rotation vector (axis times angle, rad) with the smaller angle.

    By a series for tiny angles.
    """
    shorter = ca.if_else(q[0] < 0, -1, 1) * q
    sine_squared = ca.dot(shorter[1:4], shorter[1:4])
    sine = ca.sqrt(sine_squared + 1e-300)
    factor = ca.if_else(
        sine_squared < 1e-12, 2 * (1 + sine_squared / 6), 2 * ca.atan2(sine, shorter[0]) / sine
    )
    return factor * shorter[1:4]


def quaternion_from_rotation_vector(vector: SX) -> SX:
    """Return the quaternion of a rotation vector (axis times angle, rad).

    By a series for tiny angles.
    """
    angle_squared = ca.dot(vector, vector)
    angle = ca.sqrt(angle_squared + 1e-300)
    factor = ca.if_else(
        angle_squared < 1e-6,
        0.5 - angle_squared / 48 + angle_squared**2 / 3840,
        ca.sin(angle / 2) / angle,
    )
    return ca.vertcat(ca.cos(angle / 2), factor * vector)


def motion_outputs(position: SX, orientation: SX, velocity: SX, rates: SX) -> SX:
    """Return the motion outputs of a vehicle (`interface.MOTION_OUTPUTS`).

    Args:
        position: Centre of mass (m, world frame).
        orientation: Unit quaternion.
        velocity: Velocity of the centre of mass (m/s, world frame).
        rates: Angular velocity (rad/s, body frame).
    """
    velocity_body = ca.mtimes(rotation_matrix(orientation).T, velocity)
    return ca.vertcat(
        position, orientation, euler_angles(orientation), velocity, velocity_body, rates
    )
