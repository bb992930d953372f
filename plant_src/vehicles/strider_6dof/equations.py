"""Equations of motion of the catamaran in six degrees of freedom; README.md has the loads, `vehicles/README.md` the rest."""

from __future__ import annotations

import casadi as ca
import numpy as np

from cosim.export.equations.fmu_code import as_block
from cosim.export.fmu.block import Block

from ..common.named_values import NamedValues
from ..strider.equations import air_drag, hull_loads, rudder_loads
from ..strider.geometry import DECK_CENTRE
from ..strider.parameters import CENTRE_OF_MASS_HEIGHT, INERTIA, MASS
from ..vessel import floating_maps, vessel_equations
from ..vessel.hull import Hull, LoadArguments, load_of_force_at
from ..vessel.wave_loads import Footprint
from . import parameters as p
from .geometry import BODY
from .interface import VARIABLES

_ORIGIN = ca.SX.zeros(3)  # of the body frame; the centre of mass and the centre of flotation
_FOOTPRINT = Footprint(
    ca.SX(p.LONGITUDINAL_MOMENT / p.WATERPLANE_AREA), ca.SX(p.TRANSVERSE_MOMENT / p.WATERPLANE_AREA), ca.SX(p.DRAUGHT)
)
_RIGID_BODY_MASS_MATRIX = np.diag([MASS] * 3 + list(INERTIA))


def derive_constants(parameters: NamedValues) -> dict[str, ca.SX]:
    """Return the constants of the equations."""
    enabled = parameters["hydrodynamics"]
    return {
        **vessel_equations.initial_parameters(parameters),
        "hydrodynamics": enabled,
        "inverse_mass_matrix": ca.inv(_RIGID_BODY_MASS_MATRIX + enabled * ca.SX(p.ADDED_MASS)),
        "wave.count": parameters["wave.count"],
        "wave_table": vessel_equations.wave_table_of(parameters, _FOOTPRINT),
    }


def hull(constants: NamedValues) -> Hull:
    """Return the vessel with these constants."""
    enabled = constants["hydrodynamics"]
    return Hull(
        mass=ca.SX(MASS),
        centre_of_mass=_ORIGIN,
        inertia=ca.diag(ca.SX(INERTIA)),
        added_mass=enabled * ca.SX(p.ADDED_MASS),
        coriolis_added_mass=enabled * ca.SX(p.CORIOLIS_ADDED_MASS),
        inverse_mass_matrix=constants["inverse_mass_matrix"],
        centre_of_flotation=_ORIGIN,
        deck_centre=ca.SX(DECK_CENTRE),
        equilibrium=ca.SX([CENTRE_OF_MASS_HEIGHT, 0, 0]),
        footprint=_FOOTPRINT,
        wave_count=enabled * constants["wave.count"],
        wave_table=constants["wave_table"],
        loads=lambda now: (
            enabled * (water_loads(now) + wind_loads(now)) + load_of_force_at(_ORIGIN, ca.vertcat(now.inputs["thrust"], 0, 0))
        ),
    )


def water_loads(now: LoadArguments) -> ca.SX:
    """Return the load tau (6) of restoring forces, damping, hulls and rudder."""
    u, v, r = now.relative_velocity[0], now.relative_velocity[1], now.relative_velocity[5]
    return (
        restoring(now)
        + damping(now.relative_velocity)
        + load_from_planar(hull_loads(v, r), p.HULL_FORCE_HEIGHT)
        + rudder(now, u, v, r)
    )


def restoring(now: LoadArguments) -> ca.SX:
    """Return the restoring load tau (6): buoyancy minus weight along the world's z axis, and restoring moments.

    They are relative to the elevation and the slopes of the water. Buoyancy has no moment about the vertical, therefore the
    restoring moment is the cross product of a lever with the vertical.
    """
    up = now.frame.attitude[2, :].T
    heave, roll, pitch = p.STIFFNESS
    lift = heave * (CENTRE_OF_MASS_HEIGHT + now.elevation - now.height)
    lever = -ca.vertcat(pitch * (up[0] - now.slopes[0]), roll * (up[1] - now.slopes[1]), 0)
    return ca.vertcat(lift * up, ca.cross(lever, up))


def damping(relative: ca.SX) -> ca.SX:
    """Return tau of the linear damping of heave, roll and pitch, and of the drag of the bottoms of the hulls."""
    w, roll_rate, pitch_rate = ca.vertsplit(relative[2:5])
    load = -ca.vertcat(0, 0, ca.SX(p.DAMPING) * ca.vertcat(w, roll_rate, pitch_rate), 0)
    for x, y in p.DRAG_POINTS:
        speed = w + y * roll_rate - x * pitch_rate
        load += load_of_force_at(ca.SX([x, y, 0]), ca.vertcat(0, 0, -p.POINT_DRAG * ca.fabs(speed) * speed))
    return load


def rudder(now: LoadArguments, u: ca.SX, v: ca.SX, r: ca.SX) -> ca.SX:
    """Return the load tau of the rudder for u, v (m/s) and r (rad/s) relative to the water."""
    return load_from_planar(rudder_loads(u, v, r, now.inputs["rudder_angle"]), p.RUDDER_HEIGHT)


def wind_loads(now: LoadArguments) -> ca.SX:
    """Return the load tau of the air, which acts at the centre of mass."""
    return load_from_planar(air_drag(now.air_relative_velocity[0], now.air_relative_velocity[1]), 0.0)


def load_from_planar(load: ca.SX, height: float) -> ca.SX:
    """Return the load tau (6) of X, Y (N) and N (N m) that act at a height (m) above the centre of mass."""
    return ca.vertcat(load[0:2], 0, -height * load[1], height * load[0], load[2])


VESSEL = vessel_equations.VesselModel(
    "strider_6dof", "Strider V1.0 catamaran afloat, in six degrees of freedom", VARIABLES, derive_constants, hull
)


def block() -> Block:
    """Return the catamaran for export."""
    model = VESSEL.create_continuous_model()
    return as_block(model, floating_maps.FloatingContactMaps(model, VESSEL, BODY).functions())
