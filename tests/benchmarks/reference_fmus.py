"""Table of the differences of Reference-FMUs to their published results and to a plain FMI loop.

    python tests/benchmarks/reference_fmus.py FOLDER RESULTS

FOLDER contains FMUs, in any subfolders; RESULTS contains NAME_out.csv as published by the FMI
project. Each FMU is simulated from the first to the last time of its results by each of its
interfaces: Co-Simulation, and Model Exchange with Euler and with CVODE. The largest differences are

    published   to the results, including the times of the rows,
    plain       to a loop of calls through FMPy with the same steps (Co-Simulation and Euler),
    exact       of CVODE to the exact solution, where one is known.

The FMUs contain foreign code, which runs with the rights of this process.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from plain_loops import plain_loop
from scipy.integrate import solve_ivp

import cosim
from cosim.components.fmi import FmuFile
from cosim.core.errors import ComponentError, InputError
from cosim.results.csv_files import read_csv

#: internal steps (s) of the published results, where those of the FMU's default experiment are
#: missing or differ
INTERNAL_STEPS = {"BouncingBall": 1e-3, "StateSpace": 1e-3}
#: names of the signals, and their exact solution at increasing times (s)
EXACT: Mapping[str, tuple[Sequence[str], Callable[[np.ndarray], np.ndarray]]] = {
    "Dahlquist": (["x"], lambda time: np.exp(-time)[None]),
    "VanDerPol": (
        ["x0", "x1"],
        lambda time: _integrate(
            lambda _, x: [x[1], (1 - x[0] ** 2) * x[1] - x[0]], [2.0, 0.0], time
        ),
    ),
    "StateSpace": (
        ["y[1]", "y[2]", "y[3]"],
        lambda time: np.exp(time) * np.array([[1.0], [2.0], [3.0]]),
    ),
    "BouncingBall": (["h"], lambda time: np.array([_ball_height(float(t)) for t in time])[None]),
}
#: methods by interface; None: Co-Simulation
METHODS: Mapping[str, tuple[Any, ...]] = {
    "co-simulation": (None,),
    "model-exchange": ("euler", "cvode"),
}


def _integrate(
    derivatives: Callable[[float, Any], Any], start: Sequence[float], time: np.ndarray
) -> np.ndarray:
    """Return a reference solution with tight tolerance."""
    solution = solve_ivp(
        derivatives, (time[0], time[-1]), start, "DOP853", time, rtol=1e-12, atol=1e-12
    )
    return np.asarray(solution.y)


def _ball_height(time: float, gravity: float = 9.81, restitution: float = 0.7) -> float:
    """Return the height (m) of a ball that is dropped from 1 m and rests below 0.1 m/s."""
    begin, velocity, height = 0.0, 0.0, 1.0
    while True:
        flight = (velocity + math.sqrt(velocity**2 + 2 * gravity * height)) / gravity
        if time < begin + flight:
            t = time - begin
            return height + velocity * t - gravity * t**2 / 2
        begin, height, velocity = begin + flight, 0.0, -restitution * (velocity - gravity * flight)
        if velocity < 0.1:
            return 0.0


def subjects(folder: Path, results: Path) -> Iterator[tuple[Path, Path]]:
    """Yield the FMUs that have published results, with these results; those of Roberts are a copy
    of BouncingBall's.
    """
    for path in sorted(folder.rglob("*.fmu")):
        if path.stem != "Roberts" and (results / f"{path.stem}_out.csv").exists():
            yield path, results / f"{path.stem}_out.csv"


def read_published(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the times and the columns of published results; the elements of an array are separated
    by spaces.
    """
    recording = read_csv(path)
    columns = {}
    for name, values in recording.columns.items():
        if values.dtype == object and " " in str(values[0]) and str(values[0])[0].isdigit():
            rows = np.array([str(text).split() for text in values], float)
            columns.update({f"{name}[{i}]": column for i, column in enumerate(rows.T, 1)})
        else:
            columns[name] = values
    return recording.time, columns


def largest_difference(found: Mapping[str, Any], expected: Mapping[str, np.ndarray]) -> float:
    """Return the largest difference of the columns that both have; infinite if texts differ or rows
    are missing.
    """
    largest = 0.0
    for name in (name for name in expected if name in found):
        values, others = np.asarray(found[name]), np.asarray(expected[name])
        if len(values) != len(others):
            return np.inf
        if values.dtype.kind not in "biuf":
            largest = largest if _texts(values) == _texts(others) else np.inf
        else:
            words = (
                [str(v).lower() in ("true", "1") for v in others]
                if others.dtype == object
                else others
            )
            largest = max(
                largest, float(np.max(np.abs(np.asarray(words, float) - values.astype(float))))
            )
    return largest


def compare(path: Path, published: Path, interface: str, method: Any) -> str:
    """Return the cells of the table for one FMU and one method."""
    time, expected = read_published(published)
    step = float(time[1] - time[0])
    times = {"stop_time": float(time[-1]), "step_size": repr(round(step, 12))}
    experiment = FmuFile(path, interface=interface).description.default_experiment  # type: ignore[arg-type]  # a key of METHODS
    internal = INTERNAL_STEPS.get(path.stem) or float(experiment.step_size or round(step, 12))
    names = sorted(expected)
    try:
        result = cosim.simulate(
            path,
            **times,
            output=[name for name in names if name in _scalars(path)],
            solver=method,
            solver_step_size=repr(internal) if method == "euler" else None,
        )
    except (InputError, ComponentError) as error:
        return f"failed: {error}"
    found = {name: result[name] for name in result}
    with_times = found | {"time": result.time.round(12)}
    cells = [f"{largest_difference(with_times, expected | {'time': time.round(12)}):.2g}"]
    if method != "cvode" and not any("[" in name for name in found):  # the plain loop has no arrays
        plain = plain_loop(path, interface, [float(t) for t in result.time], internal, list(found))
        cells.append(f"{largest_difference(found, plain):.2g}")
    cells += ["-"] * (2 - len(cells))
    signals, solution = EXACT.get(path.stem, ([], None))
    if method == "cvode" and solution:
        exact = dict(zip(signals, solution(result.time), strict=True))
        cells.append(f"{largest_difference(found, exact):.2g}")
    return " | ".join([*cells, *["-"] * (3 - len(cells))])


def _texts(column: np.ndarray) -> list[str]:
    return [value.hex() if isinstance(value, bytes) else str(value) for value in column]


def _scalars(path: Path) -> set[str]:
    variables = FmuFile(path).description.variables
    return set(chain.from_iterable(variable.scalar_names for variable in variables))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("results", type=Path)
    arguments = parser.parse_args()
    print("| FMU | FMI | method | published | plain | exact |\n|---|---|---|---|---|---|")
    for path, published in subjects(arguments.folder, arguments.results):
        description = FmuFile(path).description
        for interface in description.interfaces:
            for method in METHODS[interface]:
                cells = compare(path, published, interface, method)
                print(
                    (
                        f"| {path.relative_to(arguments.folder)} | {description.fmi_version} | "
                        f"{method or 'CS'} | {cells} |"
                    ),
                    flush=True,
                )


if __name__ == "__main__":
    main()
