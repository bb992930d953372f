"""Published controller by inverse kinematics, and the acceleration profiles of its demo.

Equations 14 to 20 of the paper as in the published code: accelerations are along the body's forward
and right axes for every psi, although the paper calls them inertial.
"""

import math
from typing import Any

import numpy as np

from .bus import THRUST_COEFFICIENT
from .fmu_base import Pid, ReplicaFmu

MASS = 0.441  # kg, assumed by the controller
MAX_SPEED = 5000.0  # 1/min

#: order and cut-off frequency (rad/s) of the Butterworth low-pass
FILTER_ORDER, CUT_OFF_FREQUENCY = 15, 2 * math.pi * 20.0
_FILTER_STATES = [f"filter[{i}]" for i in range(1, FILTER_ORDER + 1)]


class InverseKinematics(ReplicaFmu):
    """Controller from acceleration commands (m/s2) to tilt commands (rad) and throttle (%).

    The vertical force is the output of an altitude loop behind a low-pass filter. It starts at
    `initial_force` (N): 0 as published, which makes the first tilt commands very large. The weight
    is a better start value.
    """

    description = "Attitude and throttle from accelerations"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.declare_inputs(
            "altitude_command", "vehicle.position.z", "forward_acceleration", "right_acceleration"
        )
        self.declare_parameters(initial_force=0.0)
        self.declare_states(**dict.fromkeys(_FILTER_STATES, 0.0))
        self.declare_outputs("phi_command", "theta_command", "throttle", "vertical_force")
        self._altitude = self.register_pid(
            "altitude", Pid(10.0, 10.0, 3.0, 40.0, lower=2.0, upper=7.0, clamping=True)
        )
        self._step_size, self._filter_matrix, self._filter_gain = (
            math.nan,
            np.eye(FILTER_ORDER),
            np.zeros(FILTER_ORDER),
        )

    def exit_initialization_mode(self) -> None:
        """Start altitude loop and low-pass in the steady state of `initial_force`."""
        force = self._altitude.integral = self.values["initial_force"]
        self.values |= dict(zip(_FILTER_STATES, low_pass_steady_state(force).tolist(), strict=True))

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute the commands of this sample (equations 14 to 20 of the paper)."""
        value = self.values
        unfiltered = self._altitude.step(
            value["altitude_command"] - value["vehicle.position.z"], step_size
        )
        z = value["vertical_force"] = self._low_pass_step(unfiltered, step_size)
        x, y = MASS * value["forward_acceleration"], MASS * value["right_acceleration"]
        force = math.hypot(x, y, z)
        value["phi_command"], value["theta_command"] = (
            math.atan2(y, z),
            -math.asin(x / force) if force else 0.0,
        )
        value["throttle"] = (
            100 * 60 / (MAX_SPEED * 2 * math.pi) * math.sqrt(force / (4 * THRUST_COEFFICIENT))
        )
        return True

    def _low_pass_step(self, force: float, step_size: float) -> float:
        """Return the output of the low-pass at this sample, then advance its states."""
        if step_size != self._step_size:
            self._step_size, (self._filter_matrix, self._filter_gain) = (
                step_size,
                low_pass_matrices(step_size),
            )
        state = np.array([self.values[name] for name in _FILTER_STATES])
        self.values |= dict(
            zip(
                _FILTER_STATES,
                (self._filter_matrix @ state + self._filter_gain * force).tolist(),
                strict=True,
            )
        )
        return float(state[-1])


def low_pass_matrices(step_size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the discretised Butterworth low-pass x(k+1) = M x(k) + g u(k).

    It is discretised by the published third-order Runge-Kutta method.

    The filter is a first-order section followed by seven second-order sections with the states
    (derivative, output).

    Args:
        step_size: Sample period (s).

    Returns:
        M, shape (15, 15), and g, shape (15,). The last state is the output.
    """
    a, b = np.zeros((FILTER_ORDER, FILTER_ORDER)), np.zeros(FILTER_ORDER)
    a[0, 0], b[0] = -CUT_OFF_FREQUENCY, CUT_OFF_FREQUENCY
    for k, row in enumerate(range(1, FILTER_ORDER, 2), start=1):
        damping = 2 * math.cos(k * math.pi / FILTER_ORDER)
        a[row, [row - 1, row, row + 1]] = (
            CUT_OFF_FREQUENCY**2,
            -damping * CUT_OFF_FREQUENCY,
            -(CUT_OFF_FREQUENCY**2),
        )
        a[row + 1, row] = 1.0
    first = step_size * np.eye(FILTER_ORDER) + step_size**2 / 2 * a + step_size**3 / 6 * a @ a
    return np.eye(FILTER_ORDER) + first @ a, first @ b


def low_pass_steady_state(value: float) -> np.ndarray:
    """Return the steady state (15,) of the low-pass for a constant input."""
    return np.array([value if i % 2 == 0 else 0.0 for i in range(FILTER_ORDER)])


class AccelerationProfiles(ReplicaFmu):
    """Acceleration profiles of the demo (m/s2).

    5 m forth and back along `forward`, 25 m along `right`, in 20 s; then zero.
    """

    description = "Acceleration profiles of the published demo"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.declare_outputs("forward", "right")

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Set both accelerations at `current_time` (s)."""
        self.values["forward"] = return_move_acceleration(current_time) / 2
        self.values["right"] = stop_move_acceleration(current_time) / 4
        return True


def return_move_acceleration(time: float) -> float:
    """Return the acceleration (m/s2) of a minimum-jerk move of 10 m in 10 s and back."""
    s = time / 10 % 1
    forth = (60 * s - 180 * s**2 + 120 * s**3) / 10
    return _there_and_back(forth, time)


def stop_move_acceleration(time: float) -> float:
    """Return the acceleration (m/s2) to 10 m/s within 10 s and to rest within 10 s (100 m)."""
    s = time / 10 % 1
    faster = 30 * s**2 * (1 - s) ** 2
    return _there_and_back(faster, time)


def _there_and_back(value: float, time: float) -> float:
    """Return a value in the first 10 s, its negative in the next 10 s, and 0 afterwards."""
    if time < 10:
        return value
    return -value if time < 20 else 0.0
