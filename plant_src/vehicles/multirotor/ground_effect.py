"""Ground effect of a multirotor by the method of images, as CasADi expressions.

A hovering rotor is modelled as a source at its hub; its image below the surface reduces its inflow (Cheeseman and Bennett, "The
Effect of the Ground on a Helicopter Rotor in Forward Flight", ARC R&M 3021, 1955). At the height z a rotor of the radius R has
1 / (1 - (R / 4z)^2) times the thrust far from the surface. The images of the other rotors act in the same way (Sanchez-Cuevas,
Heredia and Ollero, "Characterization of the Aerodynamic Ground Effect and Its Influence in Multirotor Control", International
Journal of Aerospace Engineering 2017, 1823056). An image at the lateral distance d reduces the inflow by
(R^2 / 2) z / (d^2 + 4 z^2)^(3/2). For d = 0 this is Cheeseman and Bennett's (R / 4z)^2; the sum over the corners of a square is
eq. 4 of Sanchez-Cuevas et al. Their empirical term for the flow between the rotors is neglected.
"""

from __future__ import annotations

import math

import casadi as ca

from .airframe import Airframe

#: smallest height in rotor radii; smaller heights are replaced by it, because the method of images is not valid there
MIN_HEIGHT_RATIO = 0.5


def thrust_factors(airframe: Airframe, height: ca.SX) -> list[ca.SX]:
    """Return the ratio of each rotor's thrust to that in free air, for a height (m) of the rotor centre above the surface."""
    z = ca.fmax(height, MIN_HEIGHT_RATIO * airframe.rotor_radius)
    hubs = [rotor.position[:2] for rotor in airframe.rotors]
    return [1 / (1 - _inflow_reduction(airframe.rotor_radius, z, [math.dist(hub, other) for other in hubs])) for hub in hubs]


def _inflow_reduction(radius: float, z: ca.SX, distances: list[float]) -> ca.SX:
    """Return the relative reduction of a rotor's inflow by images at these lateral distances (m)."""
    return sum((radius**2 / 2 * z / ca.sqrt(d**2 + 4 * z**2) ** 3 for d in distances), ca.SX(0))
