"""Equations of motion of a submerged vehicle: a rigid body in water with any number of thrusters.

State: position p (m) and velocity v (m/s) of the centre of mass in the world frame, unit quaternion
q (body to world, R = R(q)), angular velocity w (rad/s, body frame) and thruster speeds n_i (rad/s).
With the acceleration a = R^T v' and the velocity relative to the current c, nu_r = (u_r; w) with
u_r = R^T (v - c):

    (M_RB + s M_A) (a; w') = tau - (0; w x I w) + s M_A (w x u_r; 0) - s C_A(nu_r) nu_r
                             - s (D_l nu_r + D_q (|nu_r| nu_r))
    tau = restoring loads + sum_i (a_i; r_i x a_i) T_i + (0; a_i) Q_i + (R^T F_ext; R^T T_ext)
    T_i = e_i (c_i n_i |n_i| - k |n_i| u_i)     Q_i = e_i q_i n_i |n_i|
    u_i = a_i . (u_r + w x r_i)
    n_i' = (command_i - n_i) / thruster_time_constant

These are equations 8.2 and 6.48 of Fossen, "Handbook of Marine Craft Hydrodynamics and Motion
Control", 2nd edition, 2021, about the centre of mass and in a steady uniform current. With (a_1;
a_2) = M_A nu_r, the load C_A nu_r is (w x a_1; u_r x a_1 + w x a_2). c_i is the coefficient of the
sense of rotation. k |n_i| u_i is the loss of thrust by axial inflow (Fossen, chapter 9).

The displaced volume consists of eight equal parts in the octants of a box. The part k at r_k is
immersed by the fraction f_k, which is linear over its vertical extent. It has the buoyancy rho g V
f_k / 8 at r_k. s is the mean of f_k: hydrodynamic loads are those of the submerged vehicle times s.
e_i is the immersed fraction of the height of a propeller. Slamming is neglected.

The rigid body is integrated by the classical Runge-Kutta method; the thruster speeds are the exact
solution for held commands.

All values are parameters. One binary holds the equations for up to MAX_THRUSTERS thrusters.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import casadi as ca
import numpy as np
from casadi import SX

from cosim.core.component import Variable
from cosim.export.equations.c_code import call_in_c
from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import runge_kutta_4
from cosim.export.fmu.block import Block

from ..common import kinematics
from ..common.contact_maps import SubmergedContactMaps
from ..common.elementary_functions import clamp
from ..common.named_values import (
    ConstantsMap,
    NamedValues,
    square_matrix,
    values_by_name,
    variables_of,
    vector_rows,
)
from ..common.rigid_body import (
    RIGID_BODY_STATE_COUNT,
    SteppedModel,
    initial_rigid_state,
    lagging_speeds,
    motion_of_state,
    normalised_state,
    rigid_body,
    symmetric_matrix,
    with_world_outputs,
)
from .craft import MAX_THRUSTERS, OCTANTS, Craft, Thruster, states, variables

_SMALLEST_EXTENT = 1e-3  # m, replaces the vertical extent of a box without size


def restoring_load(up: SX, depth: SX, constants: NamedValues) -> SX:
    """Return weight and buoyancy: force (N) and torque about the centre of mass (N m), body frame.

    Args:
        up: Upward unit vector (body frame).
        depth: Depth of the centre of mass (m).
        constants: Constants of the equations.
    """
    fractions = _octant_fractions(up, depth, constants)
    buoyancy = constants["water_density"] * constants["gravity"] * constants["displaced_volume"]
    weight = constants["mass"] * constants["gravity"]
    torque = buoyancy * ca.cross(constants["octants"] @ fractions, up)
    return ca.vertcat((buoyancy * ca.sum1(fractions) - weight) * up, torque)


def immersed_fraction(up: SX, depth: SX, constants: NamedValues) -> SX:
    """Return the immersed fraction of the displaced volume.

    The arguments are those of `restoring_load`.
    """
    return ca.sum1(_octant_fractions(up, depth, constants))


def _octant_fractions(up: SX, depth: SX, constants: NamedValues) -> SX:
    """Return the immersed part of each octant over the whole displaced volume."""
    extent = ca.fmax(ca.dot(ca.fabs(up), constants["hull_size"]) / 2, _SMALLEST_EXTENT)
    return clamp((depth - constants["octants"].T @ up) / extent + 0.5) / OCTANTS


def mass_matrix(constants: NamedValues, immersed: SX) -> SX:
    """Return the mass matrix (6, 6) about the centre of mass with the immersed added mass."""
    body = rigid_body(constants)
    rigid = ca.diagcat(body.mass * SX.eye(3), body.inertia)
    return rigid + immersed * square_matrix(constants["added_mass"])


def solve_symmetric(matrix: SX, right: SX) -> SX:
    """Return the solution of a linear system with a symmetric positive definite matrix.

    By its decomposition into L D L^T with a unit lower triangular matrix L and a diagonal one D,
    which needs no square roots and no pivots (Golub and Van Loan, "Matrix Computations", 4th
    edition, section 4.1.2).
    """
    size = matrix.rows()
    lower, diagonal, solution = SX.eye(size), SX.zeros(size), SX(right)
    for j in range(size):
        row = lower[j, :j].T
        diagonal[j] = matrix[j, j] - ca.dot(row * row, diagonal[:j])
        for i in range(j + 1, size):
            lower[i, j] = (matrix[i, j] - ca.dot(lower[i, :j].T * row, diagonal[:j])) / diagonal[j]
        solution[j] -= ca.dot(row, solution[:j])
    solution /= diagonal
    for j in reversed(range(size)):
        solution[j] -= ca.dot(lower[j + 1 :, j], solution[j + 1 :])
    return solution


@dataclass(frozen=True)
class SubmergedEquations:
    """Equations of a submerged vehicle.

    The vectors hold the variables of `craft.variables` in order.

    Attributes:
        craft: Craft with the start values.
        slots: Number of thruster slots.
    """

    craft: Craft
    slots: int

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """Parameters, inputs and outputs."""
        return variables(self.craft, self.slots)

    @cached_property
    def constants(self) -> ConstantsMap:
        """Map from the parameters to the constants of the equations."""
        return ConstantsMap(self.variables, self.derive_constants)

    def derive_constants(self, parameters: NamedValues) -> dict[str, SX]:
        """Return the constants of the equations.

        The parameters, the inverse of the inertia tensor, the centres of the octants and the loads
        of unit thrusts.
        """
        positions = vector_rows(parameters, "thruster_position")
        axes = vector_rows(parameters, "thruster_axis")
        loads = [
            ca.vertcat(axes[i, :].T, ca.cross(positions[i, :].T, axes[i, :].T))
            for i in range(self.slots)
        ]
        centre, quarter = parameters["centre_of_buoyancy"], parameters["hull_size"] / 4
        corners = product((-1, 1), repeat=3)
        return {
            **parameters,
            "inverse_inertia": ca.inv(symmetric_matrix(parameters["inertia"])),
            "octants": ca.horzcat(*(centre + quarter * ca.DM(signs) for signs in corners)),
            "unit_loads": ca.horzcat(*loads),
        }

    def _inputs(self, vector: SX) -> NamedValues:
        return values_by_name(vector, variables_of(self.variables, "input"))

    def initial_state(self, constants: SX) -> SX:
        """Return the state at the start; the thrusters rest."""
        return ca.vertcat(
            initial_rigid_state(self.constants.by_name(constants)), SX.zeros(self.slots)
        )

    def rate(self, state: SX, inputs: SX, constants: SX) -> SX:
        """Return the time derivative of the state of a vehicle whose thrusters lag."""
        speed, known = state[RIGID_BODY_STATE_COUNT:], self.constants.by_name(constants)
        lag = known["thruster_time_constant"]
        speed_rate = ca.if_else(
            lag > 0, (self._commanded_speeds(self._inputs(inputs), known) - speed) / lag, 0
        )
        return ca.vertcat(
            self.body_rate(state[:RIGID_BODY_STATE_COUNT], speed, inputs, constants), speed_rate
        )

    def _commanded_speeds(self, inputs: NamedValues, constants: NamedValues) -> SX:
        """Return the commanded thruster speeds (rad/s) within their limits."""
        limit = constants["max_thruster_speed"]
        return ca.fmin(ca.fmax(inputs["thruster_speed"], -limit), limit)

    def body_rate(self, state: SX, speed: SX, inputs: SX, constants: SX) -> SX:
        """Return the time derivative of the states of the rigid body.

        Args:
            state: States of the rigid body.
            speed: Thruster speeds (rad/s), shape (slots,).
            inputs: Inputs of the model.
            constants: Constants of the equations.
        """
        given, known = self._inputs(inputs), self.constants.by_name(constants)
        to_world, rates = kinematics.rotation_matrix(state[3:7]), state[10:13]
        flow = to_world.T @ (state[7:10] - ca.vertcat(given["current"], 0))
        relative = ca.vertcat(flow, rates)
        up, depth = to_world[2, :].T, given["water_level"] - state[2]
        load, immersed = restoring_load(up, depth, known), immersed_fraction(up, depth, known)
        added = immersed * square_matrix(known["added_mass"])
        momentum = added @ relative
        load += added @ ca.vertcat(ca.cross(rates, flow), SX.zeros(3))
        load -= ca.vertcat(
            ca.cross(rates, momentum[0:3]),
            ca.cross(flow, momentum[0:3]) + ca.cross(rates, momentum[3:6]),
        )
        damping = square_matrix(known["linear_damping"]) @ relative
        damping += square_matrix(known["quadratic_damping"]) @ (ca.fabs(relative) * relative)
        load += (
            self._thruster_load(to_world[2, :], state[2], speed, relative, given, known)
            - immersed * damping
        )
        load += ca.vertcat(
            to_world.T @ given["external_force"],
            to_world.T @ given["external_torque"]
            - ca.cross(rates, rigid_body(known).inertia @ rates),
        )
        acceleration = solve_symmetric(mass_matrix(known, immersed), load)
        turning = kinematics.quaternion_rate(state[3:7], rates)
        return ca.vertcat(state[7:10], turning, to_world @ acceleration[0:3], acceleration[3:6])

    def _thruster_load(
        self,
        up: SX,
        height: SX,
        speed: SX,
        relative: SX,
        inputs: NamedValues,
        constants: NamedValues,
    ) -> SX:
        """Return force and torque (6) of all thrusters."""
        hubs = vector_rows(constants, "thruster_position")
        below = inputs["water_level"] - height - hubs @ up.T
        immersed = clamp(below / (2 * constants["thruster_radius"]) + 0.5)
        squared = immersed * speed * ca.fabs(speed)
        forward, reverse = constants["thrust_coefficient"], constants["reverse_thrust_coefficient"]
        loss = (
            constants["advance_coefficient"]
            * immersed
            * ca.fabs(speed)
            * (constants["unit_loads"].T @ relative)
        )
        load = constants["unit_loads"] @ (ca.if_else(speed > 0, forward, reverse) * squared - loss)
        reaction = constants["unit_loads"][0:3, :] @ (constants["torque_coefficient"] * squared)
        return load + ca.vertcat(SX.zeros(3), reaction)

    @cached_property
    def step_function(self) -> ca.Function:
        """Function of (state, inputs, constants, step size in s) to the state after the step."""
        inputs = sum(
            len(variable.scalar_names) for variable in variables_of(self.variables, "input")
        )
        constants = sum(rows * columns for rows, columns in self.constants.shapes.values())
        sizes = {
            "state": RIGID_BODY_STATE_COUNT,
            "speed": self.slots,
            "inputs": inputs,
            "constants": constants,
        }
        body, speed, given, known = (SX.sym(name, size) for name, size in sizes.items())
        rate = ca.Function(
            "body_rate", [body, speed, given, known], [self.body_rate(body, speed, given, known)]
        )
        state, step = SX.sym("state", RIGID_BODY_STATE_COUNT + self.slots), SX.sym("step")
        names = self.constants.by_name(known)
        target = self._commanded_speeds(self._inputs(given), names)
        start, middle, end = lagging_speeds(
            state[RIGID_BODY_STATE_COUNT:], target, names["thruster_time_constant"], step
        )
        stages = iter((start, middle, middle, end))
        moved = runge_kutta_4(
            lambda x: call_in_c(rate, x, next(stages), given, known)[0],
            state[:RIGID_BODY_STATE_COUNT],
            step,
        )
        return ca.Function(
            "submerged_step",
            [state, given, known, step],
            [ca.vertcat(normalised_state(moved), end)],
        )


def submerged_block(craft: Craft, description: str, thruster_slots: int | None = None) -> Block:
    """Return a submerged vehicle for export.

    Its FMU in open water and the contact functions of the world.

    Args:
        craft: Craft with the start values.
        description: Description of the FMU.
        thruster_slots: Number of thruster slots. None means the number of thrusters.
    """
    equations = SubmergedEquations(craft, thruster_slots or len(craft.thrusters))
    model = SteppedModel(
        craft.name,
        description,
        equations.variables,
        states(equations.slots),
        equations.initial_state,
        equations.rate,
        lambda state, _inputs, _constants: with_world_outputs(motion_of_state(state)),
        derived_parameters=equations.constants.vector,
        step=lambda *arguments: call_in_c(equations.step_function, *arguments)[0],
    )
    by_name = equations.constants.by_name

    def velocity_change(up: SX, depth: SX, constants: SX, impulse: SX) -> SX:
        known = by_name(constants)
        return solve_symmetric(mass_matrix(known, immersed_fraction(up, depth, known)), impulse)

    maps = SubmergedContactMaps(model, lambda c: rigid_body(by_name(c)), velocity_change)
    return as_block(model, maps.functions())


#: neutrally buoyant vehicle of 10.25 kg with four horizontal thrusters at 45 degrees; the start
#: values of the FMU
CRAFT = Craft(
    name="submerged",
    mass=10.25,
    inertia=np.diag([0.2, 0.2, 0.2]),
    displaced_volume=0.01,
    centre_of_buoyancy=(0.0, 0.0, 0.02),
    size=(0.4, 0.3, 0.25),
    added_mass=np.diag([5.0, 10.0, 15.0, 0.1, 0.1, 0.1]),
    linear_damping=np.diag([4.0, 6.0, 5.0, 0.1, 0.1, 0.1]),
    quadratic_damping=np.diag([20.0, 40.0, 40.0, 1.0, 1.0, 1.0]),
    thrusters=tuple(
        Thruster(label, (0.15 * x, 0.1 * y, 0.0), (0.5**0.5, -x * y * 0.5**0.5, 0.0), 4e-4, 3e-4)
        for label, x, y in (
            ("front left", 1, 1),
            ("front right", 1, -1),
            ("rear left", -1, 1),
            ("rear right", -1, -1),
        )
    ),
    max_thruster_speed=300.0,
    thruster_radius=0.04,
)


def block() -> Block:
    """Return the submerged vehicle for export."""
    return submerged_block(
        CRAFT, "Submerged vehicle with up to 16 thrusters in open water", MAX_THRUSTERS
    )
