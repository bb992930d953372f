"""The thrust that rotors gain above a surface, as CasADi expressions: the method of images.

A rotor in hover is a source at its hub, and its image below the surface blows against it (Cheeseman and Bennett, "The Effect
of the Ground on a Helicopter Rotor in Forward Flight", ARC R&M 3021, 1955): at the height z a rotor of the radius R pulls with
1 / (1 - (R / 4z)^2) of its thrust. The images of the other rotors do the same (Sanchez-Cuevas, Heredia and Ollero,
"Characterization of the Aerodynamic Ground Effect and Its Influence in Multirotor Control", International Journal of Aerospace
Engineering 2017, 1823056). An image at the lateral distance d reduces the inflow by (R^2 / 2) z / (d^2 + 4 z^2)^(3/2), which
is Cheeseman and Bennett's (R / 4z)^2 at d = 0 and, summed over the corners of a square, the equation 4 of Sanchez-Cuevas.
Their empirical term for the flow between the rotors is left out.
"""

from __future__ import annotations

import math

import casadi as ca

from .airframe import Airframe

#: heights (in rotor radii) below this one count as this one: nearer to the surface the images do not describe the flow
MIN_HEIGHT_RATIO = 0.5


def thrust_factors(airframe: Airframe, height: ca.SX) -> list[ca.SX]:
    """For each rotor its thrust over that far from any surface, at a height (m) of the rotor plane above the surface."""
    z = ca.fmax(height, MIN_HEIGHT_RATIO * airframe.rotor_radius)
    places = [rotor.position[:2] for rotor in airframe.rotors]
    return [
        1 / (1 - _inflow_reduction(airframe.rotor_radius, z, [math.dist(here, there) for there in places])) for here in places
    ]


def _inflow_reduction(radius: float, z: ca.SX, distances: list[float]) -> ca.SX:
    """Share of a rotor's inflow that the images at these lateral distances (m) take away."""
    return sum((radius**2 / 2 * z / ca.sqrt(d**2 + 4 * z**2) ** 3 for d in distances), ca.SX(0))
