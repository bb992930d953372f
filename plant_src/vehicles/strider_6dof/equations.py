"""Equations of motion of the catamaran in six degrees of freedom.

README.md has the loads, `vehicles/README.md` the rest.
"""

import casadi as ca
import numpy as np
from casadi import SX

from cosim.export.fmu.block import Block

from ..common.named_values import NamedValues, initial_parameters
from ..strider.equations import (
    air_drag,
    hull_constants,
    hull_loads,
    race_velocity_squared,
    resistance,
    rudder_loads,
)
from ..strider.parameters import (
    CENTRE_OF_MASS_HEIGHT,
    DECK_CENTRE,
    GRAVITY,
    HULL_BEAM,
    INERTIA,
    MASS,
    WATER_DENSITY,
)
from ..vessel.hull import Hull, LoadArguments, load_of_force_at
from ..vessel.strips import Immersion, TwinHull, equivalent_strips, immersion
from ..vessel.vessel_equations import VesselModel, floating_block, wave_table_of
from . import parameters as p
from .interface import VARIABLES
from .parameters import BODY

_ORIGIN = SX.zeros(3)  # of the body frame; the centre of mass
_STRIPS = equivalent_strips(
    SX([0, 0, -CENTRE_OF_MASS_HEIGHT]),
    (SX(p.TRANSVERSE_MOMENT), SX(p.LONGITUDINAL_MOMENT)),
    SX(p.WATERPLANE_AREA),
)
_TWIN_HULL = TwinHull(
    _STRIPS,
    beam=SX(HULL_BEAM),
    draught=SX(p.MEAN_DRAUGHT),
    depth=SX(p.HULL_DEPTH),
    area=SX(p.WATERPLANE_AREA),
)
_CENTRE_OF_BUOYANCY = SX([0, 0, -CENTRE_OF_MASS_HEIGHT - p.MEAN_DRAUGHT / 2])
_WEIGHT_DENSITY = WATER_DENSITY * GRAVITY  # N/m3
_RIGID_BODY_MASS_MATRIX = np.diag([MASS] * 3 + list(INERTIA))


def derive_constants(parameters: NamedValues) -> dict[str, SX]:
    """Return the constants of the equations."""
    enabled = parameters["hydrodynamics"]
    return {
        **initial_parameters(parameters),
        **hull_constants(parameters),
        "hydrodynamics": enabled,
        "inverse_mass_matrix": ca.inv(_RIGID_BODY_MASS_MATRIX + enabled * SX(p.ADDED_MASS)),
        "wave.count": parameters["wave.count"],
        "wave_table": wave_table_of(parameters, _TWIN_HULL),
    }


def hull(constants: NamedValues) -> Hull:
    """Return the vessel with these constants."""
    enabled = constants["hydrodynamics"]
    return Hull(
        mass=SX(MASS),
        centre_of_mass=_ORIGIN,
        inertia=ca.diag(SX(INERTIA)),
        added_mass=enabled * SX(p.ADDED_MASS),
        coriolis_added_mass=enabled * SX(p.CORIOLIS_ADDED_MASS),
        inverse_mass_matrix=constants["inverse_mass_matrix"],
        deck_centre=SX(DECK_CENTRE),
        equilibrium=SX([CENTRE_OF_MASS_HEIGHT, 0, 0]),
        strips=_STRIPS,
        wave_count=enabled * constants["wave.count"],
        wave_table=constants["wave_table"],
        loads=lambda now: (
            enabled * (water_loads(constants, now) + wind_loads(now))
            + load_of_force_at(_ORIGIN, ca.vertcat(now.inputs["thrust"], 0, 0))
        ),
    )


def water_loads(constants: NamedValues, now: LoadArguments) -> SX:
    """Return the load tau (6) of weight and water.

    That of the moving water shrinks as the hulls leave it.
    """
    u, v, r = now.relative_velocity[0], now.relative_velocity[1], now.relative_velocity[5]
    up = now.frame.attitude[2, :].T
    under_water = immersion(_TWIN_HULL, up, now.height, now.water.elevations)
    hulls = hull_loads(v, r) + ca.vertcat(constants["resistance"] * resistance(u), 0, 0)
    race = race_velocity_squared(now.inputs["thrust"], constants["race_factor"])
    moving = (
        damping(now)
        + load_from_planar(hulls, p.HULL_FORCE_HEIGHT)
        + load_from_planar(rudder_loads(u, v, r, race, now.inputs["rudder_angle"]), p.RUDDER_HEIGHT)
        + now.froude_krylov_load(SX(MASS), _CENTRE_OF_BUOYANCY, _STRIPS)
    )
    return buoyancy_and_weight(under_water, up) + under_water.wetness * moving


def buoyancy_and_weight(under_water: Immersion, up: SX) -> SX:
    """Return the load tau (6) of buoyancy and weight for the vertical axis in the body frame.

    O is the centre of mass.
    """
    force = _WEIGHT_DENSITY * under_water.volume - MASS * GRAVITY
    return ca.vertcat(force * up, ca.cross(_WEIGHT_DENSITY * under_water.moment, up))


def damping(now: LoadArguments) -> SX:
    """Return tau of the damping of heave, roll and pitch.

    It is linear damping, and the drag of the bottoms of the hulls at four points.
    """
    w, (roll_rate, pitch_rate) = now.relative_velocity[2], ca.vertsplit(now.rates_in_water)
    load = -ca.vertcat(0, 0, SX(p.DAMPING) * ca.vertcat(w, roll_rate, pitch_rate), 0)
    for x, y in p.DRAG_POINTS:
        speed = w + y * roll_rate - x * pitch_rate
        drag = -p.POINT_DRAG * ca.fabs(speed) * speed
        load += load_of_force_at(SX([x, y, 0]), ca.vertcat(0, 0, drag))
    return load


def wind_loads(now: LoadArguments) -> SX:
    """Return the load tau of the air, which acts at the centre of mass."""
    return load_from_planar(air_drag(*ca.vertsplit(now.air_relative_velocity[0:2])), 0.0)


def load_from_planar(load: SX, height: float) -> SX:
    """Return the load tau (6) of X, Y (N) and N (N m) at a height (m) above the centre of mass."""
    return ca.vertcat(load[0:2], 0, -height * load[1], height * load[0], load[2])


VESSEL = VesselModel(
    "strider_6dof",
    "Strider V1.0 catamaran afloat, in six degrees of freedom",
    VARIABLES,
    derive_constants,
    hull,
)


def block() -> Block:
    """Return the catamaran for export."""
    return floating_block(VESSEL.create_continuous_model(), VESSEL, BODY)
