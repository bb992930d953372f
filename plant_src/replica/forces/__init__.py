"""Force models between controllers and plant, the paper's "output processing".

Each module of the folder becomes an FMU; this one has what they share. The models have no state and
tunable parameters. They are stepped before the plant, with the delayed signals of the bus.
"""

from collections.abc import Callable, Sequence

import casadi as ca
from casadi import SX

from cosim.core.component import Variable
from cosim.core.units import parse_unit
from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import static_model
from cosim.export.fmu.block import Block

from ...vehicles.common.interface import scalar_variable, vector_variables

#: inputs: motion of the vessel as published by the plant (equation 11 of the paper)
VESSEL_INPUTS = (
    *vector_variables("vehicle.velocity", "xy", "m/s", "centre of mass, world frame", "input"),
    scalar_variable("vehicle.angular_velocity.z", "rad/s", "counter-clockwise"),
    scalar_variable("vehicle.attitude.yaw", "rad", "counter-clockwise from the world's x axis"),
)


def planar_velocity(motion: SX) -> SX:
    """Return surge u, sway v (m/s) and yaw rate r (rad/s) from `VESSEL_INPUTS`."""
    x, y, rate, yaw = ca.vertsplit(motion)
    return ca.vertcat(ca.cos(yaw) * x + ca.sin(yaw) * y, ca.cos(yaw) * y - ca.sin(yaw) * x, rate)


def tunable_parameter(name: str, start: float, unit: str, description: str) -> Variable:
    """Declare a tunable real parameter."""
    return Variable(
        name, "Float64", "parameter", "tunable", start, parse_unit(unit), description=description
    )


def load_outputs(what: str) -> tuple[Variable, ...]:
    """Declare the outputs X, Y (N) and N (N m) of a load on the vessel."""
    return (
        *vector_variables("load", "xy", "N", f"{what}, vessel body frame, at the centre of mass"),
        *vector_variables("load", "n", "N.m", f"{what}, moment about z"),
    )


def force_model(
    identifier: str,
    description: str,
    variables: Sequence[Variable],
    loads: Callable[[SX, SX], SX],
) -> Block:
    """Return the block of a force model.

    Args:
        identifier: Name of the FMU.
        description: Description of the FMU.
        variables: Inputs, parameters and outputs.
        loads: Function from inputs and parameters to outputs, each in the order of `variables`.

    Returns:
        Block that `cosim build` exports as an FMU.
    """
    return as_block(static_model(identifier, description, variables, loads))
