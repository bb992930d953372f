"""Loads of rotors, air, ground and water on a multirotor, as CasADi expressions.

`equations.py` has the formulas of rotors and air.

Ground effect by the method of images: a hovering rotor is modelled as a source at its hub; its
image below the surface reduces its inflow (Cheeseman and Bennett, "The Effect of the Ground on a
Helicopter Rotor in Forward Flight", ARC R&M 3021, 1955). At the height z a rotor of the radius R
has 1 / (1 - (R / 4z)^2) times the thrust far from the surface. The images of the other rotors act
in the same way (Sanchez-Cuevas, Heredia and Ollero, "Characterization of the Aerodynamic Ground
Effect and Its Influence in Multirotor Control", International Journal of Aerospace Engineering
2017, 1823056). An image at the lateral distance d reduces the inflow by (R^2 / 2) z / (d^2 + 4
z^2)^(3/2). For d = 0 this is Cheeseman and Bennett's (R / 4z)^2; the sum over the corners of a
square is eq. 4 of Sanchez-Cuevas et al. Their empirical term for the flow between the rotors is
neglected. The reduction is limited to one half, because the images of many close rotors would
otherwise reverse the inflow.

Air that moves with the speed V in the plane of the rotor carries the wake away: the reduction is
divided by 1 + (V / v)^2, with the induced velocity v = sqrt(T / (2 rho A)) of the hovering rotor
(Cheeseman and Bennett, section on forward flight).

Water acts with buoyancy, drag and added mass of the body; rotors have no thrust below the surface.
With the height d of the surface above the centre of mass and the edges l, b, h of the box around
the body, the immersed fraction is s = clamp(d / h + 1/2, 0, 1) at every attitude. u is the velocity
relative to the current, body frame:

    F = rho g V s e_z - s R(q) (|u| D u)       D = rho C_D / 2 diag(b h, l h, l b)
    T = -s |w| K w                             K = rho C_D / 64 diag(l b^4, b l^4, h (l^4 + b^4))
    m_a = 0.68 s rho l b h                     added mass, that of a cube in all directions
                                               (DNV-RP-H103, table A-2)

The buoyancy acts at the centre of mass. K is the integral of the drag of flat plates that turn
about their centre lines. Added inertia and the pressure peak of the impact on the surface are
neglected. The aerodynamic loads of a rotor are those of the speed n_i e_i, with e_i = clamp((z_i -
level) / R + 1/2, 0, 1) of the height z_i of its hub.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
from casadi import SX

from cosim.export.equations.c_code import Callee, sum_over_rows

from ..common import kinematics
from ..common.elementary_functions import clamp
from ..common.named_values import NamedValues, vector_rows
from .airframe import ROTOR_TABLE_COLUMNS, table_rows

#: largest ratio of the air speed in the plane of a rotor to the speed of its tips for which the
#: translational lift grows
MAX_ADVANCE_RATIO = 0.5

#: smallest height in rotor radii; smaller heights are replaced by it, because the method of images
#: is not valid there
MIN_HEIGHT_RATIO = 0.5

#: largest relative reduction of the inflow
MAX_REDUCTION = 0.5

#: added to the thrust (N) in a division, for rotors at rest
SMALLEST_THRUST = 1e-12

AIR_DENSITY = 1.225  # kg/m3, ICAO standard atmosphere at sea level

WATER_DENSITY = 1025.0  # kg/m3, sea water

_ADDED_MASS_COEFFICIENT = 0.68
_SMALLEST_HEIGHT = 1e-3  # m, replaces the height of a hull without size


def rotor_table(parameters: NamedValues, slots: int) -> SX:
    """Return position, axis, thrust and torque coefficient of each rotor.

    Its shape is (table_rows(slots), ROTOR_TABLE_COLUMNS).
    """
    rows = ca.horzcat(
        vector_rows(parameters, "rotor_position"),
        vector_rows(parameters, "rotor_axis"),
        parameters["thrust_coefficient"],
        parameters["torque_coefficient"],
    )
    return ca.vertcat(rows, SX.zeros(table_rows(slots) - slots, ROTOR_TABLE_COLUMNS))


def still_air_loads(table: SX, slots: int) -> SX:
    """Return the matrix (6, slots) from squared rotor speeds to force (N) and torque (N m)."""
    loads = []
    for k in range(slots):
        position, axis, thrust, torque = table[k, 0:3].T, table[k, 3:6].T, table[k, 6], table[k, 7]
        loads.append(ca.vertcat(thrust * axis, ca.cross(position, thrust * axis) + torque * axis))
    return ca.horzcat(*loads)


_STILL_AIR_LOAD_C = """{
    for (int j = 0; j < 6; ++j) out[0][j] = 0;
    for (int i = 0; i < in[1][0]; ++i) {
        const double *const column = in[0] + 6 * i, squared = in[2][i] * in[2][i];
        for (int j = 0; j < 6; ++j) out[0][j] += column[j] * squared;
    }
}
"""


def _rotor_term() -> ca.Function:
    """Return the function of one rotor to its load.

    Its arguments are (air velocity, rates, rotor drag, gain of the ground effect, 2 rho A,
    translational lift, rotor radius), (speed, reduction of the inflow by the ground effect) and the
    row of the rotor.
    """
    common, moving = SX.sym("common", 13), SX.sym("moving", 2)
    row = SX.sym("row", ROTOR_TABLE_COLUMNS)
    air, rates, drag = ca.vertsplit(common[0:9], 3)
    gain, wake, lift, radius = ca.vertsplit(common[9:13])
    (speed, reduction), (position, axis) = ca.vertsplit(moving), ca.vertsplit(row[0:6], 3)
    squared = speed**2
    local_air = air + ca.cross(rates, position)
    in_plane = ca.dot(local_air, local_air) - ca.dot(local_air, axis) ** 2
    thrust = row[6] * squared
    pull = thrust_factor(reduction, gain, thrust, in_plane, wake) * thrust
    pull += lift * ca.fmin(in_plane, (MAX_ADVANCE_RATIO * radius) ** 2 * squared)
    force = pull * axis - speed * drag * local_air
    torque = ca.cross(position, force) + row[7] * squared * axis
    return ca.Function("rotor_load", [common, moving, row], [ca.vertcat(force, torque)])


@dataclass(frozen=True)
class RotorFunctions:
    """Functions of all rotors that remain calls in the generated C code.

    Attributes:
        slots: Number of elements of the arrays of rotors.
    """

    slots: int

    @property
    def callees(self) -> tuple[Callee, ...]:
        """All functions."""
        return self.inflow_reductions, self.still_air_load, self.load_sum

    @cached_property
    def inflow_reductions(self) -> Callee:
        """Relative reduction of each hovering rotor's inflow by the ground effect, not limited yet.

        Its arguments are (height of the rotor centre above the surface, rotor radius, number of
        rotors) and x and y of the hubs (m), each of the shape (slots,). Its result has the shape
        (slots,); only the elements with a rotor are of use.
        """
        common, x, y = (
            SX.sym("common", 3),
            SX.sym("x", self.slots),
            SX.sym("y", self.slots),
        )
        height, radius, count = ca.vertsplit(common)
        z = ca.fmax(height, MIN_HEIGHT_RATIO * radius)
        reductions = []
        for i in range(self.slots):
            reduction = SX(0)
            for j in range(self.slots):
                d2 = (x[i] - x[j]) ** 2 + (y[i] - y[j]) ** 2 + 4 * z**2
                reduction += ca.if_else(count > j, radius**2 / 2 * z / (d2 * ca.sqrt(d2)), 0)
            reductions.append(reduction)
        function = ca.Function("inflow_reductions", [common, x, y], [ca.vertcat(*reductions)])
        return Callee(
            function, _REDUCTIONS_C % {"slots": self.slots, "min_ratio": MIN_HEIGHT_RATIO}
        )

    @cached_property
    def still_air_load(self) -> Callee:
        """Sum of the loads of all rotors in still air far from a surface, shape (6,).

        Its arguments are the matrix of `still_air_loads`, the number of rotors and the speeds
        (rad/s).
        """
        matrix, speed = SX.sym("matrix", 6, self.slots), SX.sym("speed", self.slots)
        function = ca.Function(
            "still_air_load", [matrix, SX.sym("count"), speed], [matrix @ speed**2]
        )
        return Callee(function, _STILL_AIR_LOAD_C)

    @cached_property
    def load_sum(self) -> Callee:
        """Sum of the loads of all rotors in moving air."""
        return sum_over_rows("rotor_loads", _rotor_term(), table_rows(self.slots))

    def ground_reductions(self, inputs: NamedValues, constants: NamedValues) -> SX:
        """Return the relative reduction of each hovering rotor's inflow, shape (slots,)."""
        common = ca.vertcat(
            inputs["ground_distance"], constants["rotor_radius"], constants["rotor_count"]
        )
        return self.inflow_reductions(
            common, constants["rotor_position.x"], constants["rotor_position.y"]
        )

    def aerodynamic_loads(
        self,
        state: SX,
        speed: SX,
        reductions: SX,
        inputs: NamedValues,
        constants: NamedValues,
    ) -> tuple[SX, SX]:
        """Return force (N) and torque (N m) of rotors and body in moving air, body frame.

        Args:
            state: States of the rigid body.
            speed: Rotor speeds (rad/s), shape (slots,).
            reductions: Result of `ground_reductions`.
            inputs: Inputs of the model.
            constants: Constants of the equations.
        """
        air = kinematics.rotation_matrix(state[3:7]).T @ (state[7:10] - inputs["wind"])
        padding = SX.zeros(table_rows(self.slots) - self.slots)
        moving = ca.vertcat(speed, padding, reductions, padding)
        gain = constants["ground_effect"] * inputs["ground_share"]
        radius, lift = constants["rotor_radius"], constants["translational_lift"]
        wake = 2 * math.pi * AIR_DENSITY * radius**2
        common = ca.vertcat(air, state[10:13], constants["rotor_drag"], gain, wake, lift, radius)
        table = constants["rotor_table"]
        moving = ca.reshape(moving, table.rows(), 2)
        load = self.load_sum(common, constants["rotor_count"], moving, table)
        return load[0:3] - ca.norm_2(air) * constants["body_drag"] * air, load[3:6]


def gyroscopic_torque(rates: SX, momentum: SX, momentum_rate: SX) -> SX:
    """Return the torque (N m, body frame) of spinning and accelerating rotors on a rotating body.

    Args:
        rates: Angular velocity of the body (rad/s).
        momentum: Angular momentum of the rotors relative to the body (N m s).
        momentum_rate: Its time derivative in the body frame (N m).
    """
    return -(ca.cross(rates, momentum) + momentum_rate)


_REDUCTIONS_C = """{
    const double radius = in[0][1], count = in[0][2];
    const double z = in[0][0] > %(min_ratio)r * radius ? in[0][0] : %(min_ratio)r * radius;
    for (int i = 0; i < %(slots)d; ++i) out[0][i] = 0;
    for (int i = 0; i < count; ++i)
        for (int j = 0; j < count; ++j) {
            const double x = in[1][i] - in[1][j], y = in[2][i] - in[2][j], \
d2 = x * x + y * y + 4 * z * z;
            out[0][i] += radius * radius / 2 * z / (d2 * sqrt(d2));
        }
}
"""


def thrust_factor(reduction: SX, gain: SX, thrust: SX, air_speed_squared: SX, wake: SX) -> SX:
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


def emerged_fractions(state: SX, inputs: NamedValues, constants: NamedValues) -> SX:
    """Return the fraction of each rotor's speed that acts on air, shape (slots,)."""
    up = kinematics.rotation_matrix(state[3:7])[2, :]
    heights = state[2] + vector_rows(constants, "rotor_position") @ up.T
    return clamp((heights - inputs["water_level"]) / constants["rotor_radius"] + 0.5)


def add_water_loads(rate: SX, state: SX, inputs: NamedValues, constants: NamedValues) -> SX:
    """Return the rate of the rigid-body states with the loads of the water.

    Args:
        rate: Time derivative without water.
        state: States of the rigid body.
        inputs: Inputs of the model.
        constants: Constants of the equations.
    """
    to_world, rates = kinematics.rotation_matrix(state[3:7]), state[10:13]
    length, width, height = ca.vertsplit(constants["hull_size"])
    immersed = clamp((inputs["water_level"] - state[2]) / ca.fmax(height, _SMALLEST_HEIGHT) + 0.5)
    flow = to_world.T @ (state[7:10] - ca.vertcat(inputs["current"], 0))
    pressure = WATER_DENSITY * constants["water_drag_coefficient"] / 2
    areas = ca.vertcat(width * height, length * height, length * width)
    moments = ca.vertcat(length * width**4, width * length**4, height * (length**4 + width**4)) / 32
    buoyancy = WATER_DENSITY * constants["displaced_volume"] * constants["gravity"]
    force = ca.vertcat(0, 0, buoyancy) - to_world @ (ca.norm_2(flow) * pressure * areas * flow)
    torque = -ca.norm_2(rates) * pressure * moments * rates
    mass = constants["mass"]
    added = immersed * _ADDED_MASS_COEFFICIENT * WATER_DENSITY * length * width * height
    acceleration = (mass * rate[7:10] + immersed * force) / (mass + added)
    return ca.vertcat(
        rate[0:7], acceleration, rate[10:13] + constants["inverse_inertia"] @ (immersed * torque)
    )
