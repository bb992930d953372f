"""PythonFMU classes for scenario tests."""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String

IN, OUT, PARAMETER = Fmi2Causality.input, Fmi2Causality.output, Fmi2Causality.parameter


class Block(Fmi2Slave):
    """Base that registers Real variables by name and keeps their values in a dictionary."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.values = {}

    def real(self, name, causality, start=0.0):
        self.values[name] = start
        variability = (
            Fmi2Variability.tunable if causality == PARAMETER else Fmi2Variability.continuous
        )
        self.register_variable(
            Real(
                name,
                causality=causality,
                variability=variability,
                start=start if causality != OUT else None,
                getter=lambda: self.values[name],
                setter=lambda value: self.values.__setitem__(name, value),
            ),
            nested=False,
        )


class Gain(Block):
    """y = k u."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.real("u", IN)
        self.real("y", OUT)
        self.real("k", PARAMETER, 2.0)

    def do_step(self, _current_time, _step_size):
        self.values["y"] = self.values["k"] * self.values["u"]
        return True


class Plant(Block):
    """Vehicle whose ship.position.x and .y grow by ship.motor[1] and ship.motor[2] in each step."""

    def __init__(self, vehicle="ship", **arguments):
        super().__init__(**arguments)
        self.vehicle = vehicle
        for axis in "xy":
            self.real(f"{vehicle}.position.{axis}", OUT, 1.0 if axis == "y" else 0.0)
        for i in (1, 2):
            self.real(f"{vehicle}.motor[{i}]", IN)

    def do_step(self, _current_time, _step_size):
        for i, axis in enumerate("xy", 1):
            self.values[f"{self.vehicle}.position.{axis}"] += self.values[
                f"{self.vehicle}.motor[{i}]"
            ]
        return True


class Controller(Block):
    """Controller with motor[i] = gain[i] + offset, and an input for the position of its vehicle."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.real("vehicle.position.x", IN)
        self.real("offset", IN)
        for i in (1, 2):
            self.real(f"gain[{i}]", PARAMETER, 0.0)
            self.real(f"motor[{i}]", OUT)

    def do_step(self, _current_time, _step_size):
        for i in (1, 2):
            self.values[f"motor[{i}]"] = self.values[f"gain[{i}]"] + self.values["offset"]
        return True


class Typed(Fmi2Slave):
    """Block with one variable of each type."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.number, self.flag, self.text = 1, False, "x"
        self.register_variable(
            Integer("number", causality=PARAMETER, variability=Fmi2Variability.tunable)
        )
        self.register_variable(
            Boolean("flag", causality=PARAMETER, variability=Fmi2Variability.tunable)
        )
        self.register_variable(
            String("text", causality=PARAMETER, variability=Fmi2Variability.tunable)
        )
        self.register_variable(Boolean("out", causality=OUT))
        self.out = True

    def do_step(self, _current_time, _step_size):
        return True


class FailingBlock(Block):
    """Block that logs a message and fails in its third step."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.real("y", OUT)

    def do_step(self, current_time, _step_size):
        if current_time > 1.5:
            self.log("about to fail")
            raise ValueError("tilt beyond limit")
        self.values["y"] += 1
        return True


class BaseExceptionBlock(FailingBlock):
    """Block that raises a BaseException in its first step, as libraries in Rust do."""

    def do_step(self, _current_time, _step_size):
        raise BaseException("index out of bounds")
