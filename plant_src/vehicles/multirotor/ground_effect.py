"""Ground effect of a multirotor by the method of images.

A hovering rotor is modelled as a source at its hub; its image below the surface reduces its inflow
(Cheeseman and Bennett, "The Effect of the Ground on a Helicopter Rotor in Forward Flight", ARC R&M
3021, 1955). At the height z a rotor of the radius R has 1 / (1 - (R / 4z)^2) times the thrust far
from the surface. The images of the other rotors act in the same way (Sanchez-Cuevas, Heredia and
Ollero, "Characterization of the Aerodynamic Ground Effect and Its Influence in Multirotor Control",
International Journal of Aerospace Engineering 2017, 1823056). An image at the lateral distance d
reduces the inflow by (R^2 / 2) z / (d^2 + 4 z^2)^(3/2). For d = 0 this is Cheeseman and Bennett's
(R / 4z)^2; the sum over the corners of a square is eq. 4 of Sanchez-Cuevas et al. Their empirical
term for the flow between the rotors is neglected. The reduction is limited to one half, because the
images of many close rotors would otherwise reverse the inflow.

Air that moves with the speed V in the plane of the rotor carries the wake away: the reduction is
divided by 1 + (V / v)^2, with the induced velocity v = sqrt(T / (2 rho A)) of the hovering rotor
(Cheeseman and Bennett, section on forward flight).
"""

from __future__ import annotations

import casadi as ca

from cosim.export.equations.c_code import Callee

#: smallest height in rotor radii; smaller heights are replaced by it, because the method of images
#: is not valid there
MIN_HEIGHT_RATIO = 0.5

#: largest relative reduction of the inflow
MAX_REDUCTION = 0.5

#: added to the thrust (N) in a division, for rotors at rest
SMALLEST_THRUST = 1e-12

AIR_DENSITY = 1.225  # kg/m3, ICAO standard atmosphere at sea level


def create_reductions(slots: int) -> Callee:
    """Create the function of the relative reduction of each hovering rotor's inflow, which is not limited yet.

    Args:
        slots: Number of elements of the arrays of rotors.

    Returns:
        Function of (height of the rotor centre above the surface, rotor radius, number of rotors) and x and y of the hubs (m),
        each of the shape (slots,). Its result has the shape (slots,); only the elements with a rotor are of use.
    """
    arguments = common, x, y = [
        ca.SX.sym(name, size) for name, size in (("common", 3), ("x", slots), ("y", slots))
    ]
    height, radius, count = ca.vertsplit(common)
    z = ca.fmax(height, MIN_HEIGHT_RATIO * radius)
    reductions = []
    for i in range(slots):
        images = ((x[i] - x[j]) ** 2 + (y[i] - y[j]) ** 2 + 4 * z**2 for j in range(slots))
        reductions.append(
            sum(
                ca.if_else(count > j, radius**2 / 2 * z / (d2 * ca.sqrt(d2)), 0)
                for j, d2 in enumerate(images)
            )
        )
    function = ca.Function("inflow_reductions", arguments, [ca.vertcat(*reductions)])
    return Callee(function, _REDUCTIONS_C % {"slots": slots, "min_ratio": MIN_HEIGHT_RATIO})


_REDUCTIONS_C = """{
    const double radius = in[0][1], count = in[0][2];
    const double z = in[0][0] > %(min_ratio)r * radius ? in[0][0] : %(min_ratio)r * radius;
    for (int i = 0; i < %(slots)d; ++i) out[0][i] = 0;
    for (int i = 0; i < count; ++i)
        for (int j = 0; j < count; ++j) {
            const double x = in[1][i] - in[1][j], y = in[2][i] - in[2][j], d2 = x * x + y * y + 4 * z * z;
            out[0][i] += radius * radius / 2 * z / (d2 * sqrt(d2));
        }
}
"""


def thrust_factor(
    reduction: ca.SX, gain: ca.SX, thrust: ca.SX, air_speed_squared: ca.SX, wake: ca.SX
) -> ca.SX:
    """Return the ratio of a rotor's thrust to that in free air.

    Args:
        reduction: Relative reduction of the inflow in hover (1).
        gain: Fraction of the additional thrust (1).
        thrust: Thrust in free air (N).
        air_speed_squared: Squared speed of the air in the plane of the rotor (m2/s2).
        wake: Thrust over the square of the induced velocity, 2 rho A (kg/m).
    """
    remaining = thrust / (thrust + wake * air_speed_squared + SMALLEST_THRUST)
    return 1 + gain * (1 / (1 - ca.fmin(reduction * remaining, MAX_REDUCTION)) - 1)
