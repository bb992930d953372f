"""Loads of a floating vessel that is given by data.

`vessel/hull.py` has the equations of motion, README.md the loads. One binary holds the equations of
all floating vessels; all values are parameters.
"""

from itertools import product

import casadi as ca
import numpy as np
from casadi import SX

from cosim.export.equations.c_code import call_in_c
from cosim.export.fmu.block import Block

from ..common.named_values import NamedValues, square_matrix
from ..common.rigid_body import symmetric_matrix
from ..vessel import propulsion
from ..vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS, Propeller
from ..vessel.hull import (
    Ballast,
    Hull,
    LoadArguments,
    hull_of,
    improved_equilibrium,
    load_of_force_at,
    rigid_body_mass_matrix,
    weight_and_buoyancy,
)
from ..vessel.strips import GRAVITY, Strips, TwinHull, equivalent_strips, immersion
from ..vessel.vessel_equations import BulletBody, VesselModel, floating_block, wave_table_of
from .surface_vessel import HullForm, SurfaceVessel, states, variables

#: number of stations along the hull for the cross-flow drag
DRAG_STATIONS = 21

#: steps of the iteration for the equilibrium
_EQUILIBRIUM_STEPS = 40

#: parameters that are no constants of the equations, because others are derived from them
_REPLACED = (
    "rudder_propeller",
    "wave.amplitude",
    "wave.frequency",
    "wave.direction",
    "wave.phase",
)


#: constants that determine the equilibrium
_HYDROSTATICS = (
    "mass",
    "water_density",
    "centre_of_mass.x",
    "centre_of_mass.y",
    "centre_of_mass.z",
    "transverse_moment",
    "longitudinal_moment",
    "waterplane_area",
    "waterplane_centre",
    "strip_beam",
    "hull_depth",
    "hull_bottom",
    "strip_spacing",
    "strip_offset",
    "draught",
)


def surface_vessel_model(
    vessel: SurfaceVessel, description: str, slots: tuple[int, int]
) -> VesselModel:
    """Return the equations of a floating vessel.

    Args:
        vessel: Vessel with the start values.
        description: Description of the FMU.
        slots: Numbers of elements of the arrays of propellers and rudders.
    """
    return VesselModel(
        vessel.name,
        description,
        variables(vessel, slots),
        derive_constants,
        hull,
        states(slots[0])[len(states(0)) :],
        propulsion.speed_rates,
        (propulsion.PROPELLER_SUM, *([propulsion.RUDDER_SUM] if slots[1] else [])),
    )


def derive_constants(parameters: NamedValues) -> dict[str, SX]:
    """Return the constants of the equations."""
    inertia = symmetric_matrix(parameters["inertia"])
    mass_matrix = rigid_body_mass_matrix(parameters["mass"], parameters["centre_of_mass"], inertia)
    mass_matrix += square_matrix(parameters["added_mass"])
    strips = equivalent_strips(
        _waterplane_centre(parameters),
        (parameters["transverse_moment"], parameters["longitudinal_moment"]),
        parameters["waterplane_area"],
    )
    depth = draught(parameters)
    constants = {
        **{name: value for name, value in parameters.items() if name not in _REPLACED},
        **propulsion.derive_races(parameters),
        "inertia_tensor": inertia,
        "inverse_mass_matrix": ca.inv(mass_matrix),
        "strip_spacing": strips.spacing,
        "strip_offset": strips.offset,
        "draught": depth,
        "centre_of_buoyancy": _waterplane_centre(parameters) - ca.vertcat(0, 0, depth / 2),
    }
    named = NamedValues(constants)
    table = wave_table_of(parameters, twin_hull(named))
    return constants | {"equilibrium": _equilibrium(named), "wave_table": table}


def draught(parameters: NamedValues) -> SX:
    """Return the mean draught (m)."""
    return parameters["mass"] / parameters["water_density"] / parameters["waterplane_area"]


def _waterplane_centre(parameters: NamedValues) -> SX:
    return ca.vertcat(
        parameters["waterplane_centre"], 0, parameters["hull_bottom"] + draught(parameters)
    )


def twin_hull(constants: NamedValues) -> TwinHull:
    """Return the strips with their dimensions."""
    centre = ca.vertcat(
        constants["waterplane_centre"], 0, constants["hull_bottom"] + constants["draught"]
    )
    strips = Strips(centre, constants["strip_spacing"], constants["strip_offset"])
    return TwinHull(
        strips,
        constants["strip_beam"],
        constants["draught"],
        constants["hull_depth"],
        constants["waterplane_area"],
    )


def _equilibrium(constants: NamedValues) -> SX:
    """Return height of O (m), roll and pitch (rad) at rest.

    By Newton's method with the constant stiffness of the upright hull.
    """
    symbols = NamedValues({name: SX.sym(name) for name in _HYDROSTATICS})
    state = SX.sym("state", 3)
    improve = ca.Function(
        "equilibrium", [state, symbols.vector()], [_improved_equilibrium(state, symbols)]
    )
    known = ca.vertcat(*(constants[name] for name in _HYDROSTATICS))
    result = ca.vertcat(-constants["hull_bottom"] - constants["draught"], 0, 0)
    for _ in range(_EQUILIBRIUM_STEPS):
        result = call_in_c(improve, result, known)[0]
    return result


def _improved_equilibrium(state: SX, constants: NamedValues) -> SX:
    """Return height of O (m), roll and pitch (rad) after one step towards the equilibrium."""
    form, weight_density = twin_hull(constants), GRAVITY * constants["water_density"]
    area, volume = constants["waterplane_area"], constants["mass"] / constants["water_density"]
    lever = form.strips.centre[2] - constants["draught"] / 2 - constants["centre_of_mass"][2]
    moments = ca.vertcat(constants["transverse_moment"], constants["longitudinal_moment"])
    return improved_equilibrium(
        state, form, ballast(constants), weight_density * ca.vertcat(area, moments + volume * lever)
    )


def ballast(constants: NamedValues) -> Ballast:
    """Return the weight of the vessel."""
    return Ballast(constants["mass"], constants["centre_of_mass"], constants["water_density"])


def hull(constants: NamedValues) -> Hull:
    """Return the vessel with these constants."""
    return hull_of(
        constants,
        inertia=constants["inertia_tensor"],
        added_mass=square_matrix(constants["added_mass"]),
        coriolis_added_mass=square_matrix(constants["coriolis_added_mass"]),
        deck_centre=constants["deck_centre"],
        strips=twin_hull(constants).strips,
        loads=lambda now: water_loads(constants, now) + wind_loads(constants, now),
    )


def water_loads(constants: NamedValues, now: LoadArguments) -> SX:
    """Return the load tau (6) of weight, water and propellers.

    That of the moving water shrinks as the hulls leave it.
    """
    form, up = twin_hull(constants), now.frame.attitude[2, :].T
    under_water = immersion(form, up, now.height, now.water.elevations)
    speed = propulsion.speeds(now.actuators, now.inputs, constants)
    flow = ca.vertcat(now.relative_velocity[0:3], now.rates_in_water, now.relative_velocity[5])
    moving = (
        damping(constants, flow)
        + vertical_drag(constants, flow)
        + cross_flow_drag(constants, flow)
        + propulsion.rudder_loads(speed, now.relative_velocity, now.inputs, constants)
        + now.froude_krylov_load(constants["mass"], constants["centre_of_buoyancy"], form.strips)
    )
    surface = ca.vertcat(-now.water.slopes[1], now.water.slopes[0], 0)
    depth = now.water.heave - ca.dot(surface, form.strips.centre) - now.height
    thrust = propulsion.propeller_loads(
        speed, now.relative_velocity, depth, up - surface, now.inputs, constants
    )
    static = weight_and_buoyancy(under_water, up, ballast(constants))
    return static + under_water.wetness * moving + thrust


def damping(constants: NamedValues, flow: SX) -> SX:
    """Return tau of the damping for the velocity relative to the water, shape (6,).

    -D nu_r - D_q (|nu_r| nu_r), products by elements (Fossen 2021, section 6.4).
    """
    linear = square_matrix(constants["linear_damping"])
    quadratic = square_matrix(constants["quadratic_damping"])
    return -(linear @ flow + quadratic @ (ca.fabs(flow) * flow))


def vertical_drag(constants: NamedValues, flow: SX) -> SX:
    """Return tau of the drag of the bottoms.

    It acts at four points around the centre of the waterplane, whose mean squared distances are
    those of the bottoms.
    """
    pressure = constants["water_density"] / 8 * constants["vertical_drag_coefficient"]
    coefficient = pressure * constants["waterplane_area"]
    load = SX.zeros(6)
    for ahead, side in product((-1, 1), repeat=2):
        x = constants["waterplane_centre"] + ahead * constants["drag_point.x"]
        y = side * constants["drag_point.y"]
        speed = flow[2] + y * flow[3] - x * flow[4]
        drag = -coefficient * ca.fabs(speed) * speed
        load += load_of_force_at(ca.vertcat(x, y, 0), ca.vertcat(0, 0, drag))
    return load


def cross_flow_drag(constants: NamedValues, flow: SX) -> SX:
    """Return tau of the cross-flow drag along the hull, at half of the draught.

    Each station is a section in transverse flow, whose velocity grows with the yaw rate (Fossen
    2021, section 6.4).
    """
    length, depth = constants["hull_length"], constants["draught"]
    spacing = length / (DRAG_STATIONS - 1)
    coefficient = (
        constants["water_density"] / 2 * depth * constants["cross_flow_drag_coefficient"] * spacing
    )
    force, moment = SX(0), SX(0)
    for share in np.linspace(-0.5, 0.5, DRAG_STATIONS).tolist():
        x = constants["waterplane_centre"] + share * length
        across = flow[1] + x * flow[5]
        drag = -coefficient * ca.fabs(across) * across
        force, moment = force + drag, moment + x * drag
    height = constants["hull_bottom"] + depth / 2
    return ca.vertcat(0, force, 0, -height * force, 0, moment)


def wind_loads(constants: NamedValues, now: LoadArguments) -> SX:
    """Return tau of the air."""
    air = now.air_relative_velocity[0:2]
    force = ca.vertcat(-constants["air_drag"] * ca.fabs(air) * air, 0)
    return load_of_force_at(constants["air_centre"], force)


def surface_vessel_block(
    vessel: SurfaceVessel, description: str, slots: tuple[int, int] | None = None
) -> Block:
    """Return a floating vessel for export.

    Args:
        vessel: Vessel with the start values.
        description: Description of the FMU.
        slots: Numbers of slots of propellers and rudders. None means the numbers of the vessel.
    """
    equations = surface_vessel_model(vessel, description, slots or vessel.slots)

    def body(constants: SX) -> BulletBody:
        known = equations.constants.by_name(constants)
        return BulletBody(known["mass"], ca.diag(known["inertia_tensor"]))

    model = equations.create_continuous_model().with_called_derivatives()
    return floating_block(model, equations, body)


#: catamaran of 30 kg with two propellers; the start values of the FMU
VESSEL = SurfaceVessel(
    name="surface_vessel",
    mass=30.0,
    inertia=np.diag([3.0, 4.0, 6.0]),
    centre_of_mass=(0.0, 0.0, 0.0),
    added_mass=np.diag([2.0, 20.0, 30.0, 3.0, 3.0, 3.0]),
    coriolis_added_mass=np.diag([2.0, 20.0, 30.0, 3.0, 3.0, 3.0]),
    linear_damping=np.diag([10.0, 40.0, 100.0, 20.0, 30.0, 20.0]),
    quadratic_damping=np.diag([10.0, 40.0, 0.0, 0.0, 0.0, 10.0]),
    air_drag=(0.0, 0.0),
    air_centre=(0.0, 0.0, 0.0),
    deck_centre=(0.0, 0.0, 0.2),
    propellers=tuple(
        Propeller(label, (-0.5, y, -0.15), (1.0, 0.0, 0.0), 4e-3, 3e-3, 100.0, 100.0)
        for label, y in (("port", 0.3), ("starboard", -0.3))
    ),
    rudders=(),
    hull=HullForm(
        count=2,
        length=1.3,
        beam=0.2,
        offset=0.3,
        depth=0.25,
        bottom=-0.2,
        waterplane_centre=0.0,
        waterplane_coefficient=0.9,
        transverse_moment=0.044,
        longitudinal_moment=0.06,
    ),
)


def block() -> Block:
    """Return the floating vessel for export."""
    text = "Vessel afloat in six degrees of freedom with up to 16 propellers and 16 rudders"
    return surface_vessel_block(VESSEL, text, (MAX_PROPELLERS, MAX_RUDDERS))
