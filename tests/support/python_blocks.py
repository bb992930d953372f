"""Components in Python for tests of sessions."""

import os

from cosim import Component, Variable


class Gain(Component):
    """y = k * u; some values of k make it misbehave."""

    binds_everything = False
    has_state = True

    def __init__(self, instance_name, k=2.0):
        self.name, self.k, self.u, self.y = instance_name, k, 0.0, 0.0
        self.variables = [
            Variable("u", causality="input", start=0.0),
            Variable("y", causality="output"),
            Variable("k", causality="parameter", variability="tunable", start=k),
            Variable("mass", causality="parameter", variability="fixed", start=1.0),
        ]
        self.mass, self.freed = 1.0, 0

    def set(self, name, value):
        """Set a variable."""
        setattr(self, name, value)

    def get(self, name):
        """Return a variable."""
        return getattr(self, name)

    def enter_initialization_mode(self, start_time, stop_time):
        """Do nothing."""

    def exit_initialization_mode(self):
        """Do nothing."""

    def bind(self, inputs, outputs):
        """Store the arrays."""
        self.inputs = [array for array in inputs.arrays.values() if len(array)]
        self.outputs = [array for array in outputs.arrays.values() if len(array)]

    def set_inputs(self):
        """Read u if it is connected."""
        for array in self.inputs:
            self.u = float(array[0])

    def do_step(self, _time, _step_size):
        """Compute y, or misbehave."""
        if self.k == -1:
            os.chdir("/")
        elif self.k == -2:
            raise ValueError("k is -2")
        elif self.k == -3:
            raise KeyboardInterrupt
        self.y = self.k * self.u + self.y

    def get_outputs(self):
        """Write y."""
        for array in self.outputs:
            array[0] = self.y

    def get_state(self):
        """Return u, y and k."""
        return self.u, self.y, self.k

    def set_state(self, state):
        """Restore u, y and k."""
        self.u, self.y, self.k = state

    def free_state(self, state):
        """Do nothing."""

    def terminate(self):
        """Do nothing."""

    def free(self):
        """Count."""
        self.freed += 1


class Stateless(Gain):
    """Gain that cannot return to a state."""

    has_state = False


def scenario(component=Gain, **changes):
    """Return a scenario of one component in Python, "g", without connections."""
    return {
        "name": "session",
        "stop_time": 1,
        "step_size": 0.1,
        "components": {"g": {"python": component}},
        **changes,
    }
