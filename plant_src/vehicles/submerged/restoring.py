"""Weight, buoyancy and mass matrix of a submerged vehicle, as CasADi expressions.

`submerged_equations.py` has the formulas.
"""

from __future__ import annotations

import casadi as ca

from ..common.named_values import NamedValues
from ..common.rigid_body import rigid_body
from .interface import OCTANTS

_SMALLEST_EXTENT = 1e-3  # m, replaces the vertical extent of a box without size


def restoring_load(up: ca.SX, depth: ca.SX, constants: NamedValues) -> ca.SX:
    """Return weight and buoyancy: force (N) and torque about the centre of mass (N m), body frame.

    Args:
        up: Upward unit vector (body frame).
        depth: Depth of the centre of mass (m).
        constants: Constants of the equations.
    """
    fractions = _octant_fractions(up, depth, constants)
    buoyancy = constants["water_density"] * constants["gravity"] * constants["displaced_volume"]
    weight = constants["mass"] * constants["gravity"]
    torque = buoyancy * ca.cross(constants["octants"] @ fractions, up)
    return ca.vertcat((buoyancy * ca.sum1(fractions) - weight) * up, torque)


def immersed_fraction(up: ca.SX, depth: ca.SX, constants: NamedValues) -> ca.SX:
    """Return the immersed fraction of the displaced volume.

    The arguments are those of `restoring_load`.
    """
    return ca.sum1(_octant_fractions(up, depth, constants))


def _octant_fractions(up: ca.SX, depth: ca.SX, constants: NamedValues) -> ca.SX:
    """Return the immersed part of each octant over the whole displaced volume."""
    extent = ca.fmax(ca.dot(ca.fabs(up), constants["hull_size"]) / 2, _SMALLEST_EXTENT)
    return clamp((depth - constants["octants"].T @ up) / extent + 0.5) / OCTANTS


def mass_matrix(constants: NamedValues, immersed: ca.SX) -> ca.SX:
    """Return the mass matrix (6, 6) about the centre of mass with the added mass of the immersed fraction."""
    body = rigid_body(constants)
    return ca.diagcat(body.mass * ca.SX.eye(3), body.inertia) + immersed * matrix_of(
        constants["added_mass"]
    )


def matrix_of(elements: ca.SX) -> ca.SX:
    """Return the matrix (6, 6) whose rows follow each other in `elements`."""
    return ca.reshape(elements, 6, 6).T


def solve_symmetric(matrix: ca.SX, right: ca.SX) -> ca.SX:
    """Return the solution of a linear system with a symmetric positive definite matrix, by its LDL decomposition."""
    size = matrix.rows()
    lower, diagonal, solution = ca.SX.eye(size), ca.SX.zeros(size), ca.SX(right)
    for j in range(size):
        row = lower[j, :j].T
        diagonal[j] = matrix[j, j] - ca.dot(row * row, diagonal[:j])
        for i in range(j + 1, size):
            lower[i, j] = (matrix[i, j] - ca.dot(lower[i, :j].T * row, diagonal[:j])) / diagonal[j]
        solution[j] -= ca.dot(row, solution[:j])
    solution /= diagonal
    for j in reversed(range(size)):
        solution[j] -= ca.dot(lower[j + 1 :, j], solution[j + 1 :])
    return solution


def clamp(value: ca.SX) -> ca.SX:
    """Return the value limited to 0 ... 1."""
    return ca.fmin(ca.fmax(value, 0), 1)
