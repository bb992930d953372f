"""Faults of signals, actuators' and measurements' alike: a component that passes signals on, and spoils them when told to."""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Callable, Mapping, Sequence

from cosim.core.component import Variable
from cosim.core.errors import did_you_mean
from cosim.core.units import parse

from ..json_reader import Reader
from .signals import SignalComponent, accept, flag, parameter, read_seed, real, seed_parameter

#: what happens to the affected signals
MODES = ("normal", "frozen", "stuck", "missing")

#: the factor of a signal by what its gain acts on: the signal itself, or its square
GAIN_OF: Mapping[str, Callable[[float], float]] = {
    "signal": lambda gain: gain,
    "square": lambda gain: math.copysign(math.sqrt(abs(gain)), gain),
}

_SIGNAL = re.compile(r"([A-Za-z_][\w.]*)(?:\[([1-9]\d*)\])?")
_EARLY = 1e-9  # s, by which a delay may seem not to be over


class SignalFault(SignalComponent):
    """Passes every signal NAME from its input `input.NAME` to its output `NAME`, without delay while nothing is wrong.

    `signals`: name -> unit ("" for none); "rotor_speed[4]" is an array of four. `gain_of`: what `gain.NAME` multiplies, the
    "signal" or its "square": a rotor that keeps 0.7 of its thrust turns as if commanded sqrt(0.7) of its speed. `seed` is
    that of the added noise, which depends on the component's name, the seed and the number of the step.

    Each step: `delay` (s), then `gain.NAME`, `bias.NAME` and noise of the standard deviation `noise.NAME`, then `mode` for
    the signals with `affected.NAME`:

    normal   pass on
    frozen   keep the value from before the mode; `valid` stays true
    stuck    have `value.NAME`; `valid` stays true
    missing  as frozen, and `valid` is false

    A delay that becomes longer holds the outputs until it is filled. Raises InputError for bad arguments.
    """

    memory = ("_step", "_history")

    def __init__(self, instance_name: str, signals: Mapping[str, str], gain_of: str = "signal", seed: int = 0):
        shapes = _read(signals, gain_of, seed)
        mode = Variable("mode", "String", "parameter", "tunable", "normal", description=", ".join(MODES))
        variables = [variable for name, (unit, shape) in shapes.items() for variable in _channel(name, unit, shape)]
        valid = flag("valid", "output", "false while the mode is missing")
        super().__init__(
            instance_name, [*variables, mode, parameter("delay", "s", 0.0, "of all signals"), seed_parameter(seed), valid]
        )
        self._names, self._factor = list(shapes), GAIN_OF[gain_of]
        self.random_numbers = len(self.inputs)

    def prepare(self) -> None:
        mode = self.parameters["mode"]
        if mode not in MODES:
            raise ValueError(f'unknown mode "{mode}"{did_you_mean(mode, MODES)}')
        affected = self._all("affected")
        self._held = [mode != "normal" and one for one in affected]
        self._stuck = self._all("value") if mode == "stuck" else None
        self._factors = [self._factor(gain) for gain in self._all("gain")]
        self._biases, self._sigmas = self._all("bias"), self._all("noise")
        changed = any(self._held) or any(self._biases) or any(self._sigmas) or any(f != 1 for f in self._factors)
        self._delay = self.parameters["delay"]
        self._harmless = not changed and not self._delay
        self.flags = (not (mode == "missing" and any(affected)),)

    def _all(self, kind: str) -> list:
        """The parameters of a kind of all signals, one after the other."""
        values = (self.parameters[f"{kind}.{name}"] for name in self._names)
        return [x for value in values for x in (value if isinstance(value, list) else [value])]

    def begin(self) -> None:
        self._step, self._history = 0, deque([(self.start_time, self.inputs)])
        self.outputs = self.inputs
        self._spoil(self.inputs)

    def advance(self, now: float, step_size: float) -> None:
        self._step += 1
        if self._harmless:
            self.outputs = self.inputs
            self._history[0] = now, self.inputs
            return
        self._spoil(self._delayed(now))

    def _delayed(self, now: float) -> Sequence[float]:
        """The inputs a delay ago, or the oldest that are known."""
        history = self._history
        history.append((now, self.inputs))
        while len(history) > 1 and history[1][0] <= now - self._delay + _EARLY:
            history.popleft()
        return history[0][1]

    def _spoil(self, inputs: Sequence[float]) -> None:
        row = self.noise[self._step]
        changes = zip(inputs, self._factors, self._biases, self._sigmas, row, strict=True)
        spoilt = [x * factor + bias + sigma * n for x, factor, bias, sigma, n in changes]
        held = self.outputs if self._stuck is None else self._stuck
        self.outputs = [old if hold else new for new, old, hold in zip(spoilt, held, self._held, strict=True)]


def _channel(name: str, unit: str, shape: tuple[int, ...]) -> list[Variable]:
    def constant(value: float) -> object:
        return (value,) * shape[0] if shape else value

    def settable(kind: str, text: str, start: float = 0.0, of: str = unit) -> Variable:
        return real(f"{kind}.{name}", of, "parameter", constant(start), text, shape=shape)

    affected = Variable(f"affected.{name}", "Boolean", "parameter", "tunable", constant(True), shape=shape)
    return [
        real(f"input.{name}", unit, "input", shape=shape),
        settable("gain", "factor of the signal, or of its square", 1.0, "1"),
        settable("bias", "added to the signal"),
        settable("noise", "standard deviation of the noise added in each step"),
        settable("value", "of the signal while it is stuck"),
        affected,
        real(name, unit, "output", shape=shape),
    ]


def _read(signals: Mapping[str, str], gain_of: str, seed: int) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Unit and shape of each signal. Raises InputError with all problems."""
    reader = Reader()
    shapes: dict[str, tuple[str, tuple[int, ...]]] = {}
    for text, unit in reader.mapping(signals, ("signals",)).items():
        path = ("signals", text)
        if match := _SIGNAL.fullmatch(text):
            shapes[match[1]] = (unit, (int(match[2]),) if match[2] else ())
        else:
            reader.complain(path, f'found "{text}", expected a name such as "rudder_angle" or "rotor_speed[4]"')
        try:
            parse(str(unit) or "1")
        except ValueError as error:
            reader.complain(path, f"found {unit!r}, expected a unit: {error}")
    if signals == {}:
        reader.complain(("signals",), "found no signal, expected at least one")
    reader.choice(gain_of, ("gain_of",), list(GAIN_OF))
    read_seed(reader, seed)
    accept(reader)
    return shapes
