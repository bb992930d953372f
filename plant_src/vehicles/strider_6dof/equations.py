"""Equations of motion of the catamaran in six degrees of freedom: README.md has them in our notation."""

from __future__ import annotations

import casadi as ca
import numpy as np

from cosim.export.equations.fmu_code import as_block
from cosim.export.fmu.block import Block

from ..strider.equations import air_drag, hull_loads, rudder_loads
from ..strider.geometry import DECK_CENTRE
from ..strider.parameters import CENTRE_OF_MASS_HEIGHT, INERTIA, MASS
from ..vessel import floating_maps, vessel_equations
from ..vessel.hull import Hull, Named, Situation, at
from ..vessel.wave_loads import Footprint
from . import parameters as p
from .geometry import BODY
from .interface import VARIABLES

_ORIGIN = ca.SX.zeros(3)  # of the body's frame: the centre of mass
_FOOTPRINT = Footprint(
    ca.SX(p.LONGITUDINAL_MOMENT / p.WATERPLANE_AREA), ca.SX(p.TRANSVERSE_MOMENT / p.WATERPLANE_AREA), ca.SX(p.DRAUGHT)
)
_RIGID_BODY = np.diag([MASS] * 3 + list(INERTIA))


def prepare(parameters: Named) -> Named:
    """What the equations need of the parameters."""
    share = parameters["hydrodynamics"]
    return {
        **vessel_equations.initial(parameters),
        "hydrodynamics": share,
        "inverse": ca.inv(_RIGID_BODY + share * ca.SX(p.ADDED_MASS)),
        "wave.count": parameters["wave.count"],
        "sea": vessel_equations.sea_of(parameters, _FOOTPRINT),
    }


def hull(constants: Named) -> Hull:
    """The vessel with these constants."""
    share = constants["hydrodynamics"]
    return Hull(
        mass=ca.SX(MASS),
        centre=_ORIGIN,
        inertia=ca.diag(ca.SX(INERTIA)),
        added_mass=share * ca.SX(p.ADDED_MASS),
        flow_mass=share * ca.SX(p.FLOW_MASS),
        inverse=constants["inverse"],
        flotation=_ORIGIN,
        deck=ca.SX(DECK_CENTRE),
        rest=ca.SX([CENTRE_OF_MASS_HEIGHT, 0, 0]),
        footprint=_FOOTPRINT,
        wave_count=share * constants["wave.count"],
        sea=constants["sea"],
        loads=lambda now: share * (water_loads(now) + wind_loads(now)) + at(_ORIGIN, ca.vertcat(now.inputs["thrust"], 0, 0)),
    )


def water_loads(now: Situation) -> ca.SX:
    """Loads (6) of buoyancy less weight, damping and rudder."""
    u, v, r = now.relative[0], now.relative[1], now.relative[5]
    return restoring(now) + damping(now.relative) + in_plane(hull_loads(v, r), p.HULL_FORCE_HEIGHT) + rudder(now, u, v, r)


def restoring(now: Situation) -> ca.SX:
    """Buoyancy less weight, along the world's z axis, and righting moments relative to the slopes of the water.

    Buoyancy has no moment about the vertical: it acts at a lever, which is why the righting moment is a cross product with it.
    """
    up = now.frame.attitude[2, :].T
    heave, roll, pitch = p.STIFFNESS
    lift = heave * (CENTRE_OF_MASS_HEIGHT + now.elevation - now.rise)
    lever = -ca.vertcat(pitch * (up[0] - now.slopes[0]), roll * (up[1] - now.slopes[1]), 0)
    return ca.vertcat(lift * up, ca.cross(lever, up))


def damping(relative: ca.SX) -> ca.SX:
    """Linear damping of heave, roll and pitch, and drag of the bottoms of the hulls."""
    w, roll_rate, pitch_rate = ca.vertsplit(relative[2:5])
    load = -ca.vertcat(0, 0, ca.SX(p.DAMPING) * ca.vertcat(w, roll_rate, pitch_rate), 0)
    for x, y in p.DRAG_POINTS:
        speed = w + y * roll_rate - x * pitch_rate
        load += at(ca.SX([x, y, 0]), ca.vertcat(0, 0, -p.DRAG * ca.fabs(speed) * speed))
    return load


def rudder(now: Situation, u: ca.SX, v: ca.SX, r: ca.SX) -> ca.SX:
    """Load of the rudder."""
    return in_plane(rudder_loads(u, v, r, now.inputs["rudder_angle"]), p.RUDDER_HEIGHT)


def wind_loads(now: Situation) -> ca.SX:
    """Drag of the air, at the centre of mass."""
    return in_plane(air_drag(now.air[0], now.air[1]), 0.0)


def in_plane(load: ca.SX, height: float) -> ca.SX:
    """X, Y and N, taken at a height above the centre of mass, as a load (6)."""
    return ca.vertcat(load[0:2], 0, -height * load[1], height * load[0], load[2])


VESSEL = vessel_equations.Vessel(
    "strider_6dof", "Strider V1.0 catamaran afloat, in six degrees of freedom", VARIABLES, prepare, hull
)


def block() -> Block:
    """The catamaran on open water."""
    model = VESSEL.model()
    return as_block(model, floating_maps.FloatingBody(model, VESSEL, BODY).functions())
