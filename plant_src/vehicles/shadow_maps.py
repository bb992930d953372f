"""What the PyBullet world calls instead of integrating itself: the compiled half of the shadow scheme (`plant_src/shadow.py`).

Each vehicle exports three functions beside its FMU:

    shadow_spawn   initial parameters -> where Bullet has to place the body, state
    shadow_before  what Bullet measures, own velocity, inputs, step
                   -> state after a free step, the constant motion that leads there, what Bullet needs to make it
    shadow_after   what Bullet measures after the step
                   -> own velocity, contact impulse (zero for a free step), published variables

Bullet's solver changes the velocity when something is in the way. That change times Bullet's inertia is the contact impulse;
divided by the vehicle's inertia it is added to the velocity that the equations predicted. The published velocity is that
of Bullet while there is contact: the own velocity is a label for the end of the step and not zero at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from cosim.export.equations import ContinuousModel

from . import kinematics
from .shapes import quaternion

#: at most 5 ms long, since the world makes steps of at most 10 ms
SUB_STEPS = 2

#: below this contact impulse (N s) a step was free; rounding leaves less than 1e-14
FREE_IMPULSE = 1e-12


@dataclass(frozen=True)
class FreeBody:
    """A free rigid body with the state (position, orientation, world velocity, body rates).

    `mass` in kg; `inertia` (3, 3) in kg m2 about the centre of mass; `principal_axes` (3, 3) turns Bullet's body frame into the
    vehicle's; `observe` gives the published variables of a state. Bullet measures (position, quaternion x y z w, velocity,
    angular velocity), all in the world frame.
    """

    model: ContinuousModel
    mass: float
    inertia: np.ndarray
    principal_axes: np.ndarray
    observe: Callable[[ca.SX], ca.SX]

    def functions(self) -> list[ca.Function]:
        """The functions to export."""
        return [self._spawn(), self._before(), self._after()]

    def _spawn(self) -> ca.Function:
        (parameters,) = _symbols(parameters=len(self.model.slots("parameter")))
        state = self.model.initial_state(parameters)
        turned = kinematics.product(state[3:7], self._from_principal())
        return ca.Function("shadow_spawn", [parameters], [ca.vertcat(state[0:3], turned[1:4], turned[0]), state])

    def _before(self) -> ca.Function:
        measured, velocity, inputs, step = _symbols(measured=13, velocity=6, inputs=len(self.model.slots("input")), step=1)
        start = self._orientation(measured)
        end = self.model.advance(ca.vertcat(measured[0:3], start, velocity), inputs, ca.SX(), step, SUB_STEPS)
        linear = (end[0:3] - measured[0:3]) / step
        angular = kinematics.rotation_vector(kinematics.product(end[3:7], kinematics.conjugate(start))) / step
        # Bullet adds the gyroscopic torque of its body by itself: this one cancels it
        torque = ca.cross(angular, self._inertia_in_world(start) @ angular)
        results = [end, ca.vertcat(linear, angular), torque, start, _soundness(end, inputs)]
        return ca.Function("shadow_before", [measured, velocity, inputs, step], results)

    def _after(self) -> ca.Function:
        measured, predicted, twist, start = _symbols(measured=13, predicted=13, twist=6, start=4)
        linear, angular = ca.vertsplit(measured[7:13] - twist, 3)
        to_body = kinematics.matrix(predicted[3:7]).T
        turned = ca.inv(ca.SX(self.inertia)) @ (to_body @ (self._inertia_in_world(start) @ angular))
        velocity = predicted[7:13] + ca.vertcat(linear, turned)
        impulse = _contact(self.mass * ca.norm_2(linear))
        orientation = self._orientation(measured)
        mean = ca.vertcat(measured[7:10], kinematics.matrix(orientation).T @ measured[10:13])
        state = ca.vertcat(measured[0:3], orientation, ca.if_else(impulse > 0, mean, velocity))
        return ca.Function("shadow_after", [measured, predicted, twist, start], [velocity, impulse, self.observe(state)])

    def _from_principal(self) -> ca.SX:
        x, y, z, w = quaternion(self.principal_axes)
        return ca.SX([w, x, y, z])

    def _orientation(self, measured: ca.SX) -> ca.SX:
        return kinematics.product(ca.vertcat(measured[6], measured[3:6]), kinematics.conjugate(self._from_principal()))

    def _inertia_in_world(self, orientation: ca.SX) -> ca.SX:
        to_world = kinematics.matrix(orientation)
        return to_world @ ca.SX(self.inertia) @ to_world.T


@dataclass(frozen=True)
class PlanarChain:
    """A vessel in the horizontal plane with the state (x, y, yaw, surge, sway, yaw rate).

    In Bullet it is a chain of the joints x, y and yaw. `mass` (kg) and `moment` (kg m2, about z) are those of the hull, whose
    centre of mass lies on the yaw axis, so that the joints are decoupled. Bullet measures (x, y, yaw) and their rates.
    """

    model: ContinuousModel
    mass: float
    moment: float
    observe: Callable[[ca.SX], ca.SX]

    def functions(self) -> list[ca.Function]:
        """The functions to export."""
        return [self._spawn(), self._before(), self._after()]

    def _spawn(self) -> ca.Function:
        (parameters,) = _symbols(parameters=len(self.model.slots("parameter")))
        state = self.model.initial_state(parameters)
        rates = ca.vertcat(_turn(state[2]) @ state[3:5], state[5])
        return ca.Function("shadow_spawn", [parameters], [ca.vertcat(state[0:3], rates), state])

    def _before(self) -> ca.Function:
        measured, velocity, inputs, step = _symbols(measured=6, velocity=3, inputs=len(self.model.slots("input")), step=1)
        end = self.model.advance(ca.vertcat(measured[0:3], velocity), inputs, ca.SX(), step, SUB_STEPS)
        twist = (end[0:3] - measured[0:3]) / step
        effort = self._inertia() * (twist - measured[3:6]) / step
        results = [end, twist, effort, _soundness(end, inputs)]
        return ca.Function("shadow_before", [measured, velocity, inputs, step], results)

    def _after(self) -> ca.Function:
        measured, predicted, twist = _symbols(measured=6, predicted=6, twist=3)
        change = measured[3:6] - twist
        velocity = predicted[3:6] + ca.vertcat(_turn(predicted[2]).T @ change[0:2], change[2])
        impulse = _contact(ca.norm_2(self._inertia() * change))
        mean = ca.vertcat(_turn(measured[2]).T @ measured[3:5], measured[5])
        state = ca.vertcat(measured[0:3], ca.if_else(impulse > 0, mean, velocity))
        return ca.Function("shadow_after", [measured, predicted, twist], [velocity, impulse, self.observe(state)])

    def _inertia(self) -> ca.SX:
        return ca.SX([self.mass, self.mass, self.moment])


def _symbols(**sizes: int) -> list[ca.SX]:
    return [ca.SX.sym(name, size) for name, size in sizes.items()]


def _soundness(state: ca.SX, inputs: ca.SX) -> ca.SX:
    """Norm of the state; infinite when an input is not finite, not a number when the state is not."""
    return ca.if_else(ca.sum1(ca.fabs(inputs)) < ca.inf, ca.norm_2(state), ca.inf)


def _contact(impulse: ca.SX) -> ca.SX:
    """The impulse (N s), zero where there is only rounding; not a number stays so."""
    return ca.if_else(impulse <= FREE_IMPULSE, 0, impulse)


def _turn(yaw: ca.SX) -> ca.SX:
    """Rotation matrix (2, 2) of the plane."""
    return ca.vertcat(ca.horzcat(ca.cos(yaw), -ca.sin(yaw)), ca.horzcat(ca.sin(yaw), ca.cos(yaw)))
