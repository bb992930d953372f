"""Mass, damping, propellers and wind of the Otter, which both of its models have.

README.md has the loads.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import SX

from cosim.export.equations.model import ContinuousModel

from ..common.interface import VESSEL_STATES
from ..common.named_values import NamedValues, values_by_name, variables_of
from ..vessel.hull import LoadArguments, load_of_force_at
from ..vessel.vessel_equations import VesselModel
from . import parameters as p
from .interface import VARIABLES


def mass_properties(parameters: NamedValues) -> tuple[SX, SX, SX]:
    """Return the mass of the hull with the payload of these parameters.

    Returns:
        Mass (kg), centre of mass from O (m, body frame), shape (3,), and inertia about the centre
        of mass (kg m2, body frame), shape (3, 3).
    """
    payload, position = parameters["payload_mass"], parameters["payload_position"]
    hull_centre = SX(p.HULL_CENTRE)
    mass = p.HULL_MASS + payload
    centre = (p.HULL_MASS * hull_centre + payload * position) / mass
    inertia = p.HULL_MASS * ca.diag(SX(p.RADII_OF_GYRATION) ** 2)
    for part, point in ((p.HULL_MASS, hull_centre), (payload, position)):
        lever = ca.skew(point - centre)
        inertia -= part * lever @ lever
    return mass, centre, inertia


def added_mass(inertia: SX) -> SX:
    """Return the diagonal of M_A, shape (6,), for an inertia about the centre of mass (kg m2)."""
    masses = [p.SURGE_ADDED_MASS, *(ratio * p.HULL_MASS for ratio in p.ADDED_MASS_SHARES)]
    return ca.vertcat(SX(masses), SX(p.ADDED_INERTIA_SHARES) * ca.diag(inertia))


def linear_damping(mass: SX, stiffness: SX) -> SX:
    """Return the diagonal of the linear damping D, shape (6,).

    Surge balances the largest thrust at the largest speed, sway and yaw have time constants, heave,
    roll and pitch damping ratios, as in MSS.

    Args:
        mass: Diagonal of M, shape (6,).
        stiffness: Stiffness in heave, roll and pitch, shape (3,).
    """
    frequencies = ca.sqrt(stiffness / mass[2:5])
    oscillating = 2 * SX(p.DAMPING_RATIOS) * frequencies * mass[2:5]
    sway, yaw = p.DAMPING_TIME_CONSTANTS
    return ca.vertcat(p.MAX_THRUST / p.MAX_SPEED, mass[1] / sway, oscillating, mass[5] / yaw)


def cross_flow_drag(draught: SX) -> SX:
    """Return the cross-flow drag of one station over its squared velocity (N s2/m2).

    The coefficient of a section follows Hoerner's curve over beam / (2 draught).
    """
    slenderness, coefficients = zip(*p.CROSS_FLOW_DRAG_CURVE, strict=True)
    inside = ca.fmin(ca.fmax(p.PONTOON_BEAM / (2 * draught), slenderness[0]), slenderness[-1])
    coefficient = ca.pw_lin(inside, ca.DM(slenderness), ca.DM(coefficients))
    return p.WATER_DENSITY / 2 * draught * coefficient * p.LENGTH / (p.STATION_COUNT - 1)


def damping(constants: NamedValues, now: LoadArguments) -> SX:
    """Return tau of the linear damping and of the cross-flow drag along the hull.

    The linear damping in yaw grows with the yaw rate. The cross-flow drag is the sum over stations
    of sections in transverse flow (Fossen 2021, section 6.4; Faltinsen 1990, Sea Loads on Ships and
    Offshore Structures, chapter 6).
    """
    growth = ca.vertcat(SX.ones(5), 1 + p.YAW_DAMPING_GROWTH * ca.fabs(now.relative_velocity[5]))
    relative = ca.vertcat(now.relative_velocity[0:3], now.rates_in_water, now.relative_velocity[5])
    load = -constants["damping"] * growth * relative
    _, v, w, _, q, r = ca.vertsplit(relative)
    for x in np.linspace(-p.LENGTH / 2, p.LENGTH / 2, p.STATION_COUNT).tolist():
        across, down = v + x * r, w - x * q
        drag = -constants["drag"] * ca.vertcat(0, ca.fabs(across) * across, ca.fabs(down) * down)
        load += load_of_force_at(SX([x, 0, 0]), drag)
    return load


def propulsion(constants: NamedValues, now: LoadArguments) -> SX:
    """Return the load tau of both propellers."""
    lag = constants["propeller_time_constant"]
    speed = ca.if_else(lag > 0, now.actuators, now.inputs["propeller_speed"])
    speed = ca.fmin(ca.fmax(speed, p.MIN_PROPELLER_SPEED), p.MAX_PROPELLER_SPEED)
    coefficient = ca.if_else(speed > 0, p.THRUST_AHEAD, p.THRUST_ASTERN)
    port, starboard = ca.vertsplit(coefficient * speed * ca.fabs(speed))
    return ca.vertcat(port + starboard, 0, 0, 0, 0, p.PONTOON_OFFSET * (starboard - port))


def wind(now: LoadArguments) -> SX:
    """Return the load tau of the wind relative to still air.

    The drag of still air is part of the surge damping.
    """
    areas = zip(p.PROJECTED_AREAS, p.WIND_COEFFICIENTS, strict=True)
    coefficients = SX([p.AIR_DENSITY / 2 * area * drag for area, drag in areas])
    still, air = now.velocity[0:2], now.air_relative_velocity[0:2]
    force = coefficients * (ca.fabs(still) * still - ca.fabs(air) * air)
    return load_of_force_at(SX([0, 0, p.WIND_HEIGHT]), ca.vertcat(force, 0))


@dataclass(frozen=True, kw_only=True)
class OtterModel(ContinuousModel):
    """Model whose shaft speeds are constant during a step, as in MSS.

    After it they follow their commands by one Euler step.

    Attributes:
        vessel: Equations by name.
    """

    vessel: VesselModel

    def integrate(self, state: SX, inputs: SX, parameters: SX, step: SX, sub_steps: int = 1) -> SX:
        """Return the state after `step` (s).

        One Runge-Kutta step of the vessel and one Euler step of the shafts.
        """
        del sub_steps  # always one, as in MSS
        end = super().integrate(state, inputs, parameters, step)
        first = len(VESSEL_STATES)
        lag = self.vessel.constants.by_name(parameters)["propeller_time_constant"]
        shafts = end[first:]
        commands = values_by_name(inputs, variables_of(VARIABLES, "input"))["propeller_speed"]
        share = ca.fmin(1, ca.if_else(lag > 0, step / lag, 1))
        return ca.vertcat(end[:first], shafts + share * (commands - shafts))


def otter_model(vessel: VesselModel) -> ContinuousModel:
    """Return the model to export."""
    return vessel.create_continuous_model(OtterModel, vessel=vessel)
