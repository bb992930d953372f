"""Equations of motion of the Otter in six degrees of freedom.

The pontoons are strips whose bottoms rise from bow to stern. README.md has the loads,
`vehicles/README.md` the rest.
"""

from functools import partial

import casadi as ca
from casadi import SX

from cosim.export.equations.c_code import call_in_c
from cosim.export.fmu.block import Block

from ..common import kinematics
from ..common.named_values import NamedValues, initial_parameters
from ..vessel.hull import (
    Ballast,
    Frame,
    Hull,
    LoadArguments,
    attitude_at,
    hull_of,
    improved_equilibrium,
    rigid_body_mass_matrix,
    upward_axis,
    weight_and_buoyancy,
)
from ..vessel.strips import STATION_COUNT, STRIP_COUNT, Box, TwinHull, equivalent_strips, immersion
from ..vessel.vessel_equations import VesselModel, floating_block, wave_table_of
from . import parameters as p
from .interface import PROPELLER_STATES, VARIABLES
from .loads import (
    added_mass,
    cross_flow_drag,
    damping,
    linear_damping,
    mass_properties,
    otter_model,
    propulsion,
    wind,
)

STRIPS = equivalent_strips(
    SX(p.CENTRE_OF_FLOTATION),
    (SX(p.TRANSVERSE_MOMENT), SX(p.LONGITUDINAL_MOMENT)),
    SX(p.WATERPLANE_AREA),
)

#: steps of the iteration for the equilibrium
_EQUILIBRIUM_STEPS = 40

_WEIGHT_DENSITY = p.WATER_DENSITY * p.GRAVITY  # N/m3
_MOMENTS = SX([p.TRANSVERSE_MOMENT, p.LONGITUDINAL_MOMENT])

#: smallest draught at rest of a station (m), for payloads that lift it out of the water
_MIN_DRAUGHT = 1e-3

_DEPTHS = [draught + p.PONTOON_TOP for draught in p.STATION_DRAUGHTS]
_MEAN_DEPTH = sum(_DEPTHS) / STATION_COUNT


def resting_pontoons(draughts: SX, mean_draught: SX) -> TwinHull:
    """Return the pontoons.

    Args:
        draughts: Draughts of the stations at rest from bow to stern (m), shape (STATION_COUNT,).
        mean_draught: Displaced volume over the area of the waterplane (m).
    """
    positive = ca.fmax(draughts, _MIN_DRAUGHT)
    weights = STATION_COUNT / ca.sum1(positive) * positive
    stations = zip(_DEPTHS, ca.vertsplit(positive), ca.vertsplit(weights), strict=True)
    boxes = [
        Box(SX(depth), SX(p.PONTOON_TOP - depth / 2), draught, depth / _MEAN_DEPTH, weight)
        for depth, draught, weight in stations
    ]
    return TwinHull(
        STRIPS,
        SX(p.PONTOON_BEAM),
        mean_draught,
        SX(_MEAN_DEPTH),
        SX(p.WATERPLANE_AREA),
        boxes,
    )


def station_draughts(equilibrium: SX) -> SX:
    """Return the draughts of the stations (m) for height of O (m), roll and pitch (rad) at rest."""
    up = upward_axis(equilibrium)
    draughts = [
        up[2] * draught - equilibrium[0] - up[0] * (STRIPS.centre[0] + x)
        for x, draught in zip(STRIPS.stations, p.STATION_DRAUGHTS, strict=True)
    ]
    return ca.vertcat(*draughts)


def derive_constants(parameters: NamedValues) -> dict[str, SX]:
    """Return the constants of the equations."""
    mass, centre_of_mass, own_inertia = mass_properties(parameters)
    ballast = Ballast(mass, centre_of_mass, SX(p.WATER_DENSITY))
    volume = mass / p.WATER_DENSITY
    equilibrium = _equilibrium(ballast)
    to_level = attitude_at(equilibrium)
    centre, inertia = to_level @ centre_of_mass, to_level @ own_inertia @ to_level.T
    draughts, mean_draught = station_draughts(equilibrium), volume / p.WATERPLANE_AREA
    buoyancy = _centre_of_buoyancy(equilibrium, draughts, mean_draught)
    added = added_mass(own_inertia)
    mass_matrix = rigid_body_mass_matrix(mass, centre, inertia) + ca.diag(added)
    stiffness = _WEIGHT_DENSITY * ca.vertcat(
        p.WATERPLANE_AREA, _MOMENTS + volume * (buoyancy[2] - centre[2])
    )
    pontoons = resting_pontoons(draughts, mean_draught)
    return {
        **initial_parameters(parameters),
        "mass": mass,
        "centre_of_mass": centre_of_mass,
        "centre_in_level_axes": centre,
        "centre_of_buoyancy": buoyancy,
        "inertia": inertia,
        "added_mass": added,
        "inverse_mass_matrix": ca.inv(mass_matrix),
        "mean_draught": mean_draught,
        "station_draughts": draughts,
        "to_level": to_level,
        "stiffness": stiffness,
        "damping": linear_damping(ca.diag(mass_matrix), stiffness),
        "drag": cross_flow_drag(volume / (2 * p.BLOCK_COEFFICIENT * p.PONTOON_BEAM * p.LENGTH)),
        "propeller_time_constant": parameters["propeller_time_constant"],
        "wave.count": parameters["wave.count"],
        "wave_table": wave_table_of(parameters, pontoons),
        "equilibrium": equilibrium,
    }


def _equilibrium(ballast: Ballast) -> SX:
    """Return height of O (m), roll and pitch (rad) at rest.

    By Newton's method with the constant stiffness of the level hull.
    """
    state, mass, centre = SX.sym("state", 3), SX.sym("mass"), SX.sym("centre", 3)
    given = Ballast(mass, centre, ballast.water_density)
    lever = mass / p.WATER_DENSITY * (p.HULL_CENTRE_OF_BUOYANCY[2] - centre[2])
    stiffness = _WEIGHT_DENSITY * ca.vertcat(p.WATERPLANE_AREA, _MOMENTS + lever)
    pontoons = resting_pontoons(SX(p.STATION_DRAUGHTS), SX(p.MEAN_DRAUGHT))
    improve = ca.Function(
        "otter_equilibrium",
        [state, mass, centre],
        [improved_equilibrium(state, pontoons, given, stiffness)],
    )
    result = SX.zeros(3)
    for _ in range(_EQUILIBRIUM_STEPS):
        result = call_in_c(improve, result, ballast.mass, ballast.centre_of_mass)[0]
    return result


def _centre_of_buoyancy(equilibrium: SX, draughts: SX, mean_draught: SX) -> SX:
    """Return the centre of the displaced water at rest from O (m, level axes), shape (3,)."""
    pontoons = resting_pontoons(draughts, mean_draught)
    under_water = immersion(
        pontoons, upward_axis(equilibrium), equilibrium[0], SX.zeros(STRIP_COUNT)
    )
    return attitude_at(equilibrium) @ (under_water.moment / under_water.volume)


def frame(to_level: SX, orientation: SX) -> Frame:
    """Return the rotations.

    Velocities are expressed in axes fixed in the hull that are level when it is at rest.
    """
    attitude = kinematics.rotation_matrix(orientation)
    to_world = attitude @ to_level.T
    return Frame(attitude, to_world, to_level.T, to_world.T)


def hull(constants: NamedValues) -> Hull:
    """Return the vessel with these constants."""
    added = ca.diag(constants["added_mass"])
    return hull_of(
        constants,
        inertia=constants["inertia"],
        added_mass=added,
        coriolis_added_mass=added,
        deck_centre=SX(p.DECK_CENTRE),
        strips=STRIPS,
        loads=lambda now: water_loads(constants, now) + propulsion(constants, now) + wind(now),
        frame=partial(frame, constants["to_level"]),
        centre_in_velocity_axes=constants["centre_in_level_axes"],
    )


def water_loads(constants: NamedValues, now: LoadArguments) -> SX:
    """Return the load tau (6) of weight and water.

    That of the moving water shrinks as the pontoons leave it.
    """
    pontoons = resting_pontoons(constants["station_draughts"], constants["mean_draught"])
    up = now.frame.attitude[2, :].T
    under_water = immersion(pontoons, up, now.height, now.water.elevations)
    ballast = Ballast(constants["mass"], constants["centre_of_mass"], SX(p.WATER_DENSITY))
    static = weight_and_buoyancy(under_water, up, ballast)
    to_level = constants["to_level"]
    moving = damping(constants, now) + now.froude_krylov_load(
        constants["mass"], constants["centre_of_buoyancy"], STRIPS
    )
    return ca.vertcat(to_level @ static[0:3], to_level @ static[3:6]) + under_water.wetness * moving


VESSEL = VesselModel(
    "otter",
    "Maritime Robotics Otter with a landing deck, afloat",
    VARIABLES,
    derive_constants,
    hull,
    PROPELLER_STATES,
)


def block() -> Block:
    """Return the Otter for export."""
    return floating_block(otter_model(VESSEL), VESSEL, p.BODY)
