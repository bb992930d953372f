"""Components with known linear equations for tests of the analysis."""

import numpy as np

from cosim import Component, Variable


class StateSpace(Component):
    """x[k+1] = A x[k] + B u[k]; after each step y = C x + D u, with the new state and the input of
    the step.
    """

    binds_everything = True
    has_state = True

    def __init__(self, instance_name, a, b, c, d=None, x0=None, has_state=True):  # noqa: ARG002
        outputs, inputs = len(c), len(b[0]) if b else len(d[0])
        self.a = np.array(a, float).reshape(len(a), len(a))
        self.b = np.array(b, float).reshape(len(a), inputs)
        self.c = np.array(c, float).reshape(outputs, len(a))
        self.d = np.zeros((outputs, inputs)) if d is None else np.array(d, float)
        self.x = np.zeros(len(self.a)) if x0 is None else np.array(x0, float)
        self.u, self.has_state = np.zeros(self.b.shape[1]), has_state
        self.variables = [
            *(Variable(f"u{i}", causality="input", start=0.0) for i in range(len(self.u))),
            *(Variable(f"y{i}", causality="output") for i in range(len(self.c))),
        ]

    def set(self, name, value):
        """Set an input."""
        self.u[int(name[1:])] = value
        self.bound_u[int(name[1:])] = value

    def get(self, name):
        """Return a variable."""
        return float((self.u if name[0] == "u" else self.y)[int(name[1:])])

    @property
    def y(self):
        """Outputs."""
        return self.c @ self.x + self.d @ self.u

    def enter_initialization_mode(self, start_time, stop_time):
        """Do nothing."""

    def exit_initialization_mode(self):
        """Do nothing."""

    def bind(self, inputs, outputs):
        """Store the arrays."""
        floats = np.dtype(float)
        self.bound_u, self.bound_y = inputs.arrays.get(floats, self.u), outputs.arrays[floats]

    def set_inputs(self):
        """Read u."""
        self.u[:] = self.bound_u

    def do_step(self, _time, _step_size):
        """Advance the state."""
        self.x = self.a @ self.x + self.b @ self.u

    def get_outputs(self):
        """Write y."""
        self.bound_y[:] = self.y

    def get_state(self):
        """Return the state and the inputs."""
        return self.x.copy(), self.u.copy()

    def set_state(self, state):
        """Restore the state and the inputs."""
        self.x, self.u = state[0].copy(), state[1].copy()

    def free_state(self, state):
        """Do nothing."""

    def terminate(self):
        """Do nothing."""

    def free(self):
        """Do nothing."""


def block(a, b, c, d=None, **more):
    """Return the scenario entry of a component."""
    arguments = {"a": a, "b": b, "c": c, **({} if d is None else {"d": d})}
    return {"python": StateSpace, "arguments": {**arguments, **more}}


def loop(gain, plant, step=0.1, stop_time=1.0):
    """Return a scenario in which a controller u = -gain y acts on a plant; the controller steps
    first.
    """
    controller = block([], [], [[]], [[-gain]])
    return {
        "name": "loop",
        "stop_time": stop_time,
        "step_size": step,
        "components": {"controller": controller, "plant": plant},
        "connections": [
            {"from": "controller.y0", "to": "plant.u0"},
            {"from": "plant.y0", "to": "controller.u0"},
        ],
    }
