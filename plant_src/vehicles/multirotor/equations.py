"""Equations of motion of a multirotor: a rigid body with any number of rotors.

State: position p (m) and velocity v (m/s) in the world frame, unit quaternion q (body to world),
angular velocity w (rad/s, body frame) and rotor speeds n_i (rad/s). With all effects:

    p' = v                              u = R(q)^T (v - wind)         air-relative velocity, body
    q' = q * (0, w) / 2                 u_i = u + w x r_i             the same at rotor i
    v' = (R F + F_ext) / m - g e_z      F = sum_i F_i - |u| diag(body_drag) u
    w' = I^-1 (T + R^T T_ext - w x (I w + H) - H')
    F_i = (g_i c_T,i n_i^2 + l_i) a_i - n_i diag(rotor_drag) u_i
    T = sum_i (r_i x F_i + c_D,i n_i^2 a_i)
    H = -J sum_i s_i n_i a_i                                          angular momentum of the rotors
    n_i' = (command_i - n_i) / rotor_time_constant

r_i is the position of rotor i, a_i its thrust axis, s_i the sign of its reaction torque c_D,i n_i^2
and g_i its ground-effect factor (`loads.py`). l_i = translational_lift min(|u_p|^2, (R n_i / 2)^2)
is the additional thrust by the air speed u_p in the plane of the rotor. Together with the rotor
drag along the axis, which is the loss of thrust by axial inflow, it is the reduced blade-element
momentum model of Svacha, Mohta and Kumar, "Improving Quadrotor Trajectory Tracking by Compensating
for Aerodynamic Effects", ICUAS 2017, limited to the advance ratio 1/2. Rotor drag, applied at each
hub, and body drag follow Folk, Paulos and Kumar, "RotorPy", 2023. The rotor drag is the lumped
model of Faessler, Franchi and Scaramuzza, "Differential Flatness of Quadrotor Dynamics Subject to
Rotor Drag", 2018, distributed over the rotors. With a rotor time constant of 0 the rotor speeds
equal their commands, and H' is neglected.

The rotor speeds are the exact solution for held commands. The rigid body is integrated by the
classical Runge-Kutta method, which evaluates the rotor speeds at the times of its stages; a short
time constant therefore does not limit the step. If all effects are off, a shorter compiled function
is called. A step that begins or ends with a part of the vehicle in the water is divided into
shorter ones with the loads of the water.

All values are parameters. One binary holds the equations for up to MAX_ROTORS rotors; slots without
a rotor have the coefficients 0.
"""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from cosim.core.component import Variable
from cosim.export.equations.c_code import Callee
from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import runge_kutta_4
from cosim.export.fmu.block import Block

from ..common.contact_maps import FreeContactMaps, create_symbols
from ..common.named_values import ConstantsMap, NamedValues, values_by_name, variables_of
from ..common.rigid_body import (
    RIGID_BODY_STATE_COUNT,
    SteppedModel,
    initial_rigid_state,
    lagging_speeds,
    motion_of_state,
    normalised_state,
    rigid_body,
    rigid_body_rate,
    symmetric_matrix,
    with_world_outputs,
)
from ..common.water_surface import SURFACE_SUM
from .airframe import MAX_ROTORS, Airframe, Rotor, RotorEffects, states, variables
from .loads import (
    RotorFunctions,
    add_water_loads,
    emerged_fractions,
    gyroscopic_torque,
    rotor_table,
    still_air_loads,
)
from .surroundings import create_surroundings_function

_EFFECTS = [effect.name for effect in fields(RotorEffects)]

#: integration steps in water per step in air
WATER_SUB_STEPS = 5


class SpinningRotors(NamedTuple):
    """Rotors at one time.

    Speeds (rad/s) that act on air, angular momentum (N m s) and its rate (N m), body frame.
    """

    aerodynamic_speed: SX
    momentum: SX
    momentum_rate: SX


@dataclass(frozen=True)
class MultirotorEquations:
    """Equations of an airframe; the vectors hold the variables of `airframe.variables` in order.

    `inputs` and `constants` are vectors in the public methods and named values in the private ones.

    Attributes:
        airframe: Airframe with the start values.
        slots: Number of rotor slots.
    """

    airframe: Airframe
    slots: int

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """Parameters, inputs and outputs."""
        return variables(self.airframe, self.slots)

    @cached_property
    def constants(self) -> ConstantsMap:
        """Map from the parameters to the constants of the equations."""
        return ConstantsMap(self.variables, self.derive_constants)

    @cached_property
    def rotor_functions(self) -> RotorFunctions:
        """Functions of all rotors."""
        return RotorFunctions(self.slots)

    def derive_constants(self, parameters: NamedValues) -> dict[str, SX]:
        """Return the constants of the equations.

        The parameters, the inverse of the inertia tensor, the tables of the rotors, and the largest
        distances (m) of the hubs from the z axis and from the plane z = 0.
        """
        table = rotor_table(parameters, self.slots)
        x, y, z = ca.horzsplit(table[: self.slots, 0:3])
        turning = parameters["torque_sign"].T
        return {
            **parameters,
            "inverse_inertia": ca.inv(symmetric_matrix(parameters["inertia"])),
            "rotor_table": table,
            "still_air_loads": still_air_loads(table, self.slots),
            "rotor_reach": ca.vertcat(ca.sqrt(ca.mmax(x**2 + y**2)), ca.mmax(ca.fabs(z))),
            "momenta": -parameters["rotor_inertia"]
            * table[: self.slots, 3:6].T
            * ca.repmat(turning, 3, 1),
        }

    def _inputs(self, vector: SX) -> NamedValues:
        return values_by_name(vector, variables_of(self.variables, "input"))

    def initial_state(self, constants: SX) -> SX:
        """Return the state at the start."""
        initial = self.constants.by_name(constants)
        count, speed = initial["rotor_count"], initial["initial_rotor_speed"]
        rotors = [ca.if_else(count > k, speed, 0) for k in range(self.slots)]
        return ca.vertcat(initial_rigid_state(initial), *rotors)

    def rate(self, state: SX, inputs: SX, constants: SX) -> SX:
        """Return the time derivative of the state in air and water; the rotors lag."""
        given, known = self._inputs(inputs), self.constants.by_name(constants)
        speed, lag = state[RIGID_BODY_STATE_COUNT:], known["rotor_time_constant"]
        target = self._commanded_speeds(given, known)
        reductions = self.rotor_functions.ground_reductions(given, known)
        rotors = _spinning_rotors(speed, target, known)
        return ca.vertcat(
            self._rate_in_water(state[:RIGID_BODY_STATE_COUNT], rotors, reductions, given, known),
            ca.if_else(lag > 0, (target - speed) / lag, 0),
        )

    def step_without_effects(self, state: SX, inputs: SX, constants: SX, step: SX) -> SX:
        """Return the state after a step (s) with all effects off."""
        given, known = self._inputs(inputs), self.constants.by_name(constants)
        body, speed = rigid_body(known), self._commanded_speeds(given, known)
        load = self.rotor_functions.still_air_load(
            known["still_air_loads"], known["rotor_count"], speed
        )
        end = runge_kutta_4(
            lambda x: rigid_body_rate(body, known["gravity"], x, given, load[0:3], load[3:6]),
            state[:RIGID_BODY_STATE_COUNT],
            step,
        )
        return ca.vertcat(normalised_state(end), speed)

    def step_with_effects(
        self,
        state: SX,
        inputs: SX,
        constants: SX,
        step: SX,
        *,
        in_water: bool = False,
    ) -> SX:
        """Return the state after a step (s) with all effects, in air or with the loads of water."""
        body_rate = self._rate_in_water if in_water else self._body_rate
        given, known = self._inputs(inputs), self.constants.by_name(constants)
        target = self._commanded_speeds(given, known)
        start, middle, end = lagging_speeds(
            state[RIGID_BODY_STATE_COUNT:], target, known["rotor_time_constant"], step
        )
        reductions = self.rotor_functions.ground_reductions(given, known)
        first, second, last = (
            _spinning_rotors(speed, target, known) for speed in (start, middle, end)
        )
        stages = iter((first, second, second, last))
        body = runge_kutta_4(
            lambda x: body_rate(x, next(stages), reductions, given, known),
            state[:RIGID_BODY_STATE_COUNT],
            step,
        )
        return ca.vertcat(normalised_state(body), end)

    def _commanded_speeds(self, inputs: NamedValues, constants: NamedValues) -> SX:
        """Return the commanded rotor speeds (rad/s), limited to 0 ... `max_rotor_speed`."""
        return ca.fmin(ca.fmax(inputs["rotor_speed"], 0), constants["max_rotor_speed"])

    def _body_rate(
        self,
        state: SX,
        rotors: SpinningRotors,
        reductions: SX,
        inputs: NamedValues,
        constants: NamedValues,
    ) -> SX:
        """Return the time derivative of the rigid-body states in air with all effects."""
        force, torque = self.rotor_functions.aerodynamic_loads(
            state, rotors.aerodynamic_speed, reductions, inputs, constants
        )
        torque += gyroscopic_torque(state[10:13], rotors.momentum, rotors.momentum_rate)
        return rigid_body_rate(
            rigid_body(constants), constants["gravity"], state, inputs, force, torque
        )

    def _rate_in_water(
        self,
        state: SX,
        rotors: SpinningRotors,
        reductions: SX,
        inputs: NamedValues,
        constants: NamedValues,
    ) -> SX:
        """Return the time derivative of the rigid-body states with the loads of water."""
        emerged = emerged_fractions(state, inputs, constants)
        wet = rotors._replace(aerodynamic_speed=rotors.aerodynamic_speed * emerged)
        rate = self._body_rate(state, wet, reductions, inputs, constants)
        return add_water_loads(rate, state, inputs, constants)


def _spinning_rotors(speed: SX, target: SX, constants: NamedValues) -> SpinningRotors:
    """Return rotors with their first-order rates towards the commands."""
    lag = constants["rotor_time_constant"]
    rate = ca.if_else(lag > 0, (target - speed) / lag, 0)
    return SpinningRotors(speed, constants["momenta"] @ speed, constants["momenta"] @ rate)


def free_step(equations: MultirotorEquations) -> Callee:
    """Return the function of one step.

    Its C code calls the function for the effects that are on and the water.
    """
    inputs, names = list[str](), list[str]()
    for variable in variables_of(equations.variables, "input"):
        inputs += variable.scalar_names
    for name, (rows, columns) in equations.constants.shapes.items():
        names += [name] * rows * columns
    state_count = len(states(equations.slots))
    sizes = {"state": state_count, "inputs": len(inputs), "constants": len(names), "step": 1}
    arguments = [*create_symbols(**sizes).values()]
    plain = ca.Function("plain_step", arguments, [equations.step_without_effects(*arguments)])
    full = ca.Function("step_with_effects", arguments, [equations.step_with_effects(*arguments)])
    wet = ca.Function(
        "step_in_water", arguments, [equations.step_with_effects(*arguments, in_water=True)]
    )
    either = ca.Function("free_step", arguments, [full(*arguments)], {"never_inline": True})
    effects = [k for k, name in enumerate(names) if name.partition(".")[0] in _EFFECTS]
    body = _FREE_STEP_C % {
        "first": effects[0],
        "end": effects[-1] + 1,
        "level": inputs.index("water_level"),
        "height": names.index("hull_size.z"),
        "reach": names.index("rotor_reach"),
        "radius": names.index("rotor_radius"),
        "states": state_count,
        "sub_steps": WATER_SUB_STEPS,
    }
    return Callee(either, body, [plain, full, wet])


#: a backslash continues a line of this source without a new line in the C code;
#: the lowest point is not above the bottom of the hull or a quarter turn of the rotors' discs below
#: their hubs
_FREE_STEP_C = """{
    const double *const ends[2] = {in[0], out[0]}, *const constants = in[2];
    int effects = 0, wet = 0;
    for (int i = %(first)d; i < %(end)d; ++i) effects |= constants[i] != 0;
    if (effects) step_with_effects(in, out);
    else plain_step(in, out);
    for (int i = 0; i < 2; ++i) {
        const double *const x = ends[i], up = 1 - 2 * (x[4] * x[4] + x[5] * x[5]), \
tilt = up * up < 1 ? sqrt(1 - up * up) : 0;
        const double rotors = tilt * constants[%(reach)d] + constants[%(reach)d + 1] \
+ constants[%(radius)d] / 2;
        const double hull = constants[%(height)d] / 2;
        wet |= x[2] - (rotors > hull ? rotors : hull) < in[1][%(level)d];
    }
    if (!wet) return;
    double state[%(states)d];
    const double part = in[3][0] / %(sub_steps)d, *const \
arguments[4] = {state, in[1], constants, &part};
    for (int i = 0; i < %(states)d; ++i) state[i] = in[0][i];
    for (int k = 0; k < %(sub_steps)d; ++k) {
        step_in_water(arguments, out);
        for (int i = 0; i < %(states)d; ++i) state[i] = out[0][i];
    }
}
"""


def multirotor_block(airframe: Airframe, description: str, rotor_slots: int | None = None) -> Block:
    """Return a multirotor for export.

    Its FMU in free flight and the contact functions of the world.

    Args:
        airframe: Airframe with the start values.
        description: Description of the FMU.
        rotor_slots: Number of rotor slots. None means the number of rotors.
    """
    equations = MultirotorEquations(airframe, rotor_slots or len(airframe.rotors))
    step, functions = free_step(equations), equations.rotor_functions
    surroundings, surroundings_callee = create_surroundings_function()
    model = SteppedModel(
        airframe.name,
        description,
        equations.variables,
        states(equations.slots),
        equations.initial_state,
        equations.rate,
        lambda state, _inputs, _constants: with_world_outputs(motion_of_state(state)),
        derived_parameters=equations.constants.vector,
        callees=[step, *functions.callees, surroundings_callee, SURFACE_SUM],
        step=step.function,
    )
    maps = FreeContactMaps(model, lambda c: rigid_body(equations.constants.by_name(c)))
    return as_block(model, [*maps.functions(), surroundings])


#: quadcopter of 1 kg whose rotors turn at 350 rad/s in hover; the start values of the FMU
AIRFRAME = Airframe(
    name="multirotor",
    mass=1.0,
    inertia=np.diag([0.01, 0.01, 0.02]),
    rotors=tuple(
        Rotor(label, (x, y, 0.0), sign, 2e-5, 3e-7)
        for label, x, y, sign in (
            ("front", 0.2, 0.0, 1.0),
            ("left", 0.0, 0.2, -1.0),
            ("rear", -0.2, 0.0, 1.0),
            ("right", 0.0, -0.2, -1.0),
        )
    ),
    max_rotor_speed=600.0,
    rotor_radius=0.1,
)


def block() -> Block:
    """Return the multirotor for export."""
    return multirotor_block(AIRFRAME, "Multirotor with up to 16 rotors in free flight", MAX_ROTORS)
