"""Fault injection for signals of actuators and sensors."""

import math
import re
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import did_you_mean
from cosim.core.units import parse_unit

from ..json_reader import JsonReader
from .signal_component import SignalComponent
from .variable_declarations import (
    boolean_variable,
    check_arguments,
    real_parameter,
    real_variable,
    seed_parameter,
)

#: values of the parameter `mode`
FAULT_MODES = ("normal", "frozen", "stuck", "missing")

#: factor of a signal from its gain, by the quantity that the gain multiplies: the signal itself or
#: its square
GAIN_FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "signal": lambda gain: gain,
    "square": lambda gain: math.copysign(math.sqrt(abs(gain)), gain),
}

_SIGNAL = re.compile(r"([A-Za-z_][\w.]*)(?:\[([1-9]\d*)\])?")
_TIME_TOLERANCE = 1e-9  # s, rounding error of times


class SignalFault(SignalComponent):
    """Fault block, transparent until a parameter activates a fault.

    Its inputs are `input.NAME`, its outputs `NAME` for each signal. Error model, in this order:
    `delay` (s), factor `gain.NAME`, offset `bias.NAME`, white noise with the standard deviation
    `noise.NAME`, then `mode` for the signals with `affected.NAME`:

    - normal: no further change
    - frozen: holds the last value before the mode; `valid` stays true
    - stuck: outputs `value.NAME`; `valid` stays true
    - missing: like frozen, and `valid` is false

    All parameters are tunable, so that events of a scenario can set them. A delay that grows holds
    the outputs until enough samples are stored.

    Args:
        instance_name: Name of the component.
        signals: Unit of each signal by name, "" without unit; "rotor_speed[4]" declares an array of
            four.
        gain_of: Quantity that the gain multiplies: "signal", or "square" for a gain of the thrust
            of a rotor speed (0.7 of the thrust is sqrt(0.7) of the speed).
        seed: Seed of the noise, together with the name of the component.

    Raises:
        InputError: One or more arguments are invalid; lists all problems.
    """

    state_attributes = ("_step", "_history")

    def __init__(
        self, instance_name: str, signals: Mapping[str, str], gain_of: str = "signal", seed: int = 0
    ):
        shapes = _read_signals(signals, gain_of, seed)
        mode = Variable(
            "mode", "String", "parameter", "tunable", "normal", description=", ".join(FAULT_MODES)
        )
        variables = []
        for name, (unit, shape) in shapes.items():
            variables += _signal_variables(name, unit, shape)
        valid = boolean_variable("valid", "output", "false while the mode is missing")
        super().__init__(
            instance_name,
            [
                *variables,
                mode,
                real_parameter("delay", "s", 0.0, "of all signals"),
                seed_parameter(seed),
                valid,
            ],
        )
        self._names, self._factor = list(shapes), GAIN_FUNCTIONS[gain_of]
        self.random_number_count = len(self.inputs)

    def apply_parameters(self) -> None:
        """Update the faults from the parameters."""
        mode = self.parameters["mode"]
        if mode not in FAULT_MODES:
            raise ValueError(f'unknown mode "{mode}"{did_you_mean(mode, FAULT_MODES)}')
        affected = self._parameters_of("affected")
        self._is_held = [mode != "normal" and is_affected for is_affected in affected]
        self._stuck = self._parameters_of("value") if mode == "stuck" else None
        self._factors = [self._factor(gain) for gain in self._parameters_of("gain")]
        self._biases, self._sigmas = self._parameters_of("bias"), self._parameters_of("noise")
        self._delay = self.parameters["delay"]
        self._is_inactive = not (
            any([*self._is_held, *self._biases, *self._sigmas, self._delay])
            or any(factor != 1 for factor in self._factors)
        )
        self.flags = (not (mode == "missing" and any(affected)),)

    def _parameters_of(self, kind: str) -> list[Any]:
        """Return the parameters `kind.NAME` of all signals as a flat list."""
        arrays = [np.ravel(self.parameters[f"{kind}.{name}"]) for name in self._names]
        values: list[Any] = np.concatenate(arrays).tolist()
        return values

    def initialise(self) -> None:
        """Set the initial outputs."""
        self._step, self._history = 0, deque([(self.start_time, self.inputs)])
        self.outputs = self.inputs
        self._apply_faults(self.inputs)

    def advance(self, now: float, step_size: float) -> None:
        """Set the outputs at `now` (s)."""
        self._step += 1
        if self._is_inactive:
            self.outputs = self.inputs
            self._history[0] = now, self.inputs
            return
        # the inputs of one delay ago, or the oldest stored ones
        history = self._history
        history.append((now, self.inputs))
        while len(history) > 1 and history[1][0] <= now - self._delay + _TIME_TOLERANCE:
            history.popleft()
        self._apply_faults(history[0][1])

    def _apply_faults(self, inputs: Sequence[float]) -> None:
        row = self.noise[self._step]
        changes = zip(inputs, self._factors, self._biases, self._sigmas, row, strict=True)
        faulty = [x * factor + bias + sigma * n for x, factor, bias, sigma, n in changes]
        held = self.outputs if self._stuck is None else self._stuck
        self.outputs = [
            old if hold else new for new, old, hold in zip(faulty, held, self._is_held, strict=True)
        ]


def _signal_variables(name: str, unit: str, shape: tuple[int, ...]) -> list[Variable]:
    def constant(value: float) -> object:
        return (value,) * shape[0] if shape else value

    def settable(kind: str, text: str, start: float = 0.0, of: str = unit) -> Variable:
        return real_variable(f"{kind}.{name}", of, "parameter", constant(start), text, shape=shape)

    affected = Variable(
        f"affected.{name}", "Boolean", "parameter", "tunable", constant(True), shape=shape
    )
    return [
        real_variable(f"input.{name}", unit, "input", shape=shape),
        settable("gain", "factor of the signal, or of its square", 1.0, "1"),
        settable("bias", "added to the signal"),
        settable("noise", "standard deviation of the noise added in each step"),
        settable("value", "of the signal while it is stuck"),
        affected,
        real_variable(name, unit, "output", shape=shape),
    ]


def _read_signals(
    signals: Mapping[str, str], gain_of: str, seed: int
) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Return unit and shape of each signal. Raises InputError with all problems."""
    reader = JsonReader()
    shapes: dict[str, tuple[str, tuple[int, ...]]] = {}
    for text, unit in reader.mapping(signals, ("signals",)).items():
        path = ("signals", text)
        if match := _SIGNAL.fullmatch(text):
            shapes[match[1]] = (unit, (int(match[2]),) if match[2] else ())
        else:
            reader.add_problem(
                path, f'found "{text}", expected a name such as "rudder_angle" or "rotor_speed[4]"'
            )
        try:
            parse_unit(str(unit) or "1")
        except ValueError as error:
            reader.add_problem(path, f"found {unit!r}, expected a unit: {error}")
    if signals == {}:
        reader.add_problem(("signals",), "found no signal, expected at least one")
    reader.choice(gain_of, ("gain_of",), list(GAIN_FUNCTIONS))
    check_arguments(reader, seed)
    return shapes
