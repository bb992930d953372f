"""Linear state-space model with named inputs, outputs and states."""

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..results.files import write_file

#: formats of `LinearModel.write`
SUFFIXES = (".json", ".csv", ".mat")


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Deviations from an operating point.

    X[k+1] = A x[k] + B u[k] or x' = A x + B u, and y = C x + D u.

    Attributes:
        a: Matrix A, shape (states, states).
        b: Matrix B, shape (states, inputs).
        c: Matrix C, shape (outputs, states).
        d: Matrix D, shape (outputs, inputs).
        inputs: Names of the inputs.
        outputs: Names of the outputs.
        states: Names of the states; those of outputs if the states are outputs, else x1, x2, ...
        step: Step (s) of a discrete model, whose inputs are constant between two samples; None:
            continuous.
        time: Time of the operating point (s).
        notes: Hints, for example that the operating point is no equilibrium.
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    inputs: Sequence[str]
    outputs: Sequence[str]
    states: Sequence[str]
    step: float | None
    time: float
    notes: Sequence[str] = ()

    def poles(self) -> np.ndarray:
        """Return the eigenvalues of A by magnitude (1; of a continuous model 1/s)."""
        poles = np.linalg.eigvals(self.a)
        return poles[np.lexsort((poles.imag, poles.real, np.abs(poles)))]

    def frequency_response(self, frequencies: np.ndarray) -> np.ndarray:
        """Return the transfer matrix at angular frequencies (rad/s).

        Its shape is (frequencies, outputs, inputs).
        """
        points = (
            1j * np.asarray(frequencies)
            if self.step is None
            else np.exp(1j * np.asarray(frequencies) * self.step)
        )
        resolvents = points[:, None, None] * np.eye(len(self.a)) - self.a
        return np.asarray(
            self.c @ np.linalg.solve(resolvents, self.b.astype(complex)[None]) + self.d
        )

    def step_response(self, duration: float, count: int = 500) -> tuple[np.ndarray, np.ndarray]:
        """Return the response to a unit step of each input.

        Args:
            duration: Duration (s).
            count: Number of samples of a continuous model.

        Returns:
            Times (s), shape (samples,), and responses, shape (samples, outputs, inputs).
        """
        from scipy.linalg import expm

        step, a, b = self.step, self.a, self.b
        if step is None:
            step, states = duration / count, len(self.a)
            sampled = expm(
                np.block([[self.a, self.b], [np.zeros((self.b.shape[1], sum(self.b.shape)))]])
                * step
            )
            a, b = sampled[:states, :states], sampled[:states, states:]
        state, responses = np.zeros(self.b.shape), []
        times = np.arange(int(duration / step * (1 + 1e-12)) + 1) * step
        for _ in times:
            responses.append(self.c @ state + self.d)
            state = a @ state + b
        return times, np.array(responses)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as numbers, texts and lists.

        Poles are pairs of real and imaginary part.
        """
        matrices = {name.upper(): getattr(self, name).tolist() for name in "abcd"}
        names = {
            name: list(getattr(self, name)) for name in ("inputs", "outputs", "states", "notes")
        }
        poles = [[pole.real, pole.imag] for pole in self.poles().tolist()]
        return {"time": self.time, "step": self.step, **names, **matrices, "poles": poles}

    def write(self, file: Path) -> None:
        """Write the model to a JSON, CSV or MAT file.

        The CSV file is the table of A, B, C and D with the names of states, inputs and outputs. A
        MAT file holds the variables A, B, C, D, Ts (s; 0: continuous) and cell arrays of names.

        Raises:
            InputError: The name of the file has another suffix.
            OutputError: The file cannot be written.
        """
        check_suffix(file)
        writers = {".json": self._json, ".csv": self._csv, ".mat": self._mat}
        write_file(file, writers[file.suffix]())

    def _json(self) -> bytes:
        return (json.dumps(self.to_dict(), indent=1) + "\n").encode()

    def _csv(self) -> bytes:
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["", *self.states, *self.inputs])
        rows = np.block([[self.a, self.b], [self.c, self.d]]).tolist()
        following = "{}'" if self.step is None else "{}[k+1]"
        writer.writerows(
            [name, *row]
            for name, row in zip(
                [*map(following.format, self.states), *self.outputs], rows, strict=True
            )
        )
        return stream.getvalue().encode()

    def _mat(self) -> bytes:
        from scipy.io import savemat

        stream = io.BytesIO()
        matrices = {name.upper(): getattr(self, name) for name in "abcd"}
        names = {
            name: np.array(list(getattr(self, name)), object)
            for name in ("inputs", "outputs", "states")
        }
        savemat(stream, {**matrices, "Ts": self.step or 0.0, **names})
        # the header of the file holds the time of writing, which would make equal models differ
        return b"MATLAB 5.0 MAT-file, linear model".ljust(116) + stream.getvalue()[116:]


def check_suffix(file: Path) -> None:
    """Raise InputError if `LinearModel.write` has no format for a file of this name."""
    if file.suffix not in SUFFIXES:
        raise InputError(f"{file}: expected a file name with {', '.join(SUFFIXES)}")
