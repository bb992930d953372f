"""Signals between controllers and plant of the published simulator, and their delay.

The signals have its order and its frames:

- World frame: z up.
- Body frame of the quadcopter: x forward, y right, z down; phi > 0 right side down, theta > 0 nose
  up, psi clockwise seen from above (rad).
- Body frame of the vessel: x forward, y left, z up; yaw counter-clockwise (rad).
"""

from typing import Any

from cosim.core.component import Variable

from ..vehicles.common.interface import scalar_variable, vector_variables
from .fmu_base import ReplicaFmu

ROTORS = range(1, 5)
#: thrust of a rotor over its squared speed as in the published model (N s2/rad2); Table 2 of the
#: paper misprints its power
THRUST_COEFFICIENT = 9.148e-6

#: inputs of the plant (equation 10 of the paper)
INPUTS: tuple[Variable, ...] = (
    *(
        scalar_variable(f"uav.thrust[{i}]", "N", "along the quadcopter's body up, at the rotor")
        for i in ROTORS
    ),
    *(
        scalar_variable(
            f"uav.torque[{i}]", "N.m", "of the propeller; turns the body about its up: + - + -"
        )
        for i in ROTORS
    ),
    scalar_variable("usv.thrust", "N", "propeller, along the vessel's body x"),
    *vector_variables(
        "usv.rudder", "xy", "N", "rudder force, vessel body frame, at the rudder", "input"
    ),
    *vector_variables(
        "usv.water",
        "xy",
        "N",
        "hydrodynamic force, vessel body frame, at the centre of mass",
        "input",
    ),
    scalar_variable("usv.water.n", "N.m", "hydrodynamic moment about z"),
)

#: outputs of the plant (equation 11 of the paper)
OUTPUTS: tuple[Variable, ...] = (
    *vector_variables(
        "uav.position", "xyz", "m", "origin of the quadcopter's model frame, world frame"
    ),
    *vector_variables(
        "uav.attitude", ("phi", "theta", "psi"), "rad", "forward-right-down body frame"
    ),
    *vector_variables(
        "uav.velocity",
        "xyz",
        "m/s",
        "origin of the quadcopter's model frame, world frame (the paper says body frame)",
    ),
    *vector_variables(
        "uav.acceleration",
        "xyz",
        "m/s2",
        "as published: difference quotient of R v + position, no acceleration",
    ),
    *vector_variables("usv.position", "xyz", "m", "centre of mass, world frame"),
    *vector_variables("usv.velocity", "xyz", "m/s", "centre of mass, world frame"),
    *vector_variables("usv.angular_velocity", "xyz", "rad/s", "world frame"),
    *vector_variables("usv.attitude", ("yaw",), "rad", "counter-clockwise, in (-pi, pi]"),
)


class Bus(ReplicaFmu):
    """Delay of one sample for all 22 signals.

    The first outputs are zero, as in the published handshake.

    It is stepped before the controllers, which therefore receive the plant's signals of 10 ms ago.
    A connection with "delay": 1 differs only in the first sample.
    """

    description = "Delay of one sample that starts at zero"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self._names = [variable.name for variable in OUTPUTS]
        self.declare_inputs(*(f"plant.{name}" for name in self._names))
        self.declare_states(**{f"stored.{name}": 0.0 for name in self._names})
        self.declare_outputs(*self._names)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Output the stored signals and store the present ones."""
        value = self.values
        for name in self._names:
            value[name] = value[f"stored.{name}"]
            value[f"stored.{name}"] = value[f"plant.{name}"]
        return True
