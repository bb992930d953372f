"""Check that the FMUs in `fmus/` correspond to their sources and behave like a rebuild."""

import multiprocessing
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zlib import crc32

import numpy as np

from ..core.component import Component, Ports, Variable
from ..core.component_log import discard_messages
from ..core.errors import ComponentError, CosimError, Problem
from .build import fmu_files, read_manifest
from .cache import file_hash
from .fmu_sources import Source, export_source, find_sources


def check_fmus(root: Path) -> list[Problem]:
    """Check that the FMUs in `fmus/` correspond to their sources.

    The hashes of all files must agree with the manifest, and rebuilt FMUs must behave like the
    present ones.

    Args:
        root: The project folder.

    Returns:
        All deviations; empty if there are none.
    """
    manifest, sources = read_manifest(root), find_sources(root)
    problems = _orphans(root, manifest, sources)
    unchanged = []
    for source in sources:
        mismatches = _manifest_mismatches(root, manifest, source)
        problems += mismatches
        if not mismatches:
            unchanged.append(source)
    return problems + _changed_behaviour(root, unchanged)


def _orphans(root: Path, manifest: Mapping[str, Any], sources: Sequence[Source]) -> list[Problem]:
    expected: set[Path] = set()
    for source in sources:
        expected.update(fmu_files(source, root).values())
    present = set((root / "fmus").rglob("*.fmu"))
    for entry in manifest.values():
        present.update(root / fmu for fmu in entry["fmus"])
    return [
        Problem("has no source", path.relative_to(root).as_posix())
        for path in sorted(present - expected)
    ]


def _manifest_mismatches(root: Path, manifest: Mapping[str, Any], source: Source) -> list[Problem]:
    """Return the deviations of a source and its FMUs from their entry in the manifest."""
    entry = manifest.get(source.manifest_key)
    if entry is None:
        return [Problem("has no FMU; run `cosim build`", source.path.relative_to(root).as_posix())]
    problems = []
    for name, recorded in entry["sources"].items():
        if not (root / name).is_file() or file_hash(root / name) != recorded:
            problems.append(
                Problem(f'changed since "{source.manifest_key}" was built; run `cosim build`', name)
            )
    for path in fmu_files(source, root).values():
        name = path.relative_to(root).as_posix()
        if not path.is_file():
            problems.append(Problem("is missing; run `cosim build`", name))
        elif file_hash(path) != entry["fmus"].get(name):
            problems.append(Problem("is not the file that `cosim build` wrote", name))
    return problems


def _changed_behaviour(root: Path, sources: Sequence[Source]) -> list[Problem]:
    problems: list[Problem] = []
    present: list[Path] = []
    rebuilt: list[Path] = []
    with TemporaryDirectory(prefix="cosim-check-") as temporary:
        for source in sources:
            targets = fmu_files(source, Path(temporary))
            try:
                export_source(source, targets)
            except CosimError as error:
                problems.append(
                    Problem(
                        f"can no longer be built: {error}", source.path.relative_to(root).as_posix()
                    )
                )
                continue
            present += fmu_files(source, root).values()
            rebuilt += targets.values()
        for path, difference in compare_fmus(present, rebuilt).items():
            problems.append(
                Problem(
                    f"differs from a rebuild: {difference}", path.relative_to(temporary).as_posix()
                )
            )
    return problems


STEP_COUNT, STEP_SIZE, STEPS_PER_INPUT = 300, 0.01, 15
RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-9, 1e-12
_NUMERIC_TYPES = ("Float64", "Int32", "Boolean", "Enumeration")


@dataclass(frozen=True)
class Trace:
    """Recorded outputs of one FMU simulation."""

    variables: Sequence[Variable]
    #: names of the scalar outputs, one for each column of `values`
    outputs: Sequence[str]
    #: outputs after initialization and after each step, shape (rows, columns)
    values: np.ndarray
    #: message of the error that ended the simulation, or ""
    failure: str = ""


def compare_fmus(first: Sequence[Path], second: Sequence[Path], seed: int = 1) -> dict[Path, str]:
    """Compare each FMU of `second` with its counterpart in `first`.

    The FMUs of each side run in a separate process, so that a crashing FMU is reported and does not
    end this process. Their messages are discarded, because random inputs and parameters make models
    complain.

    Args:
        first: The reference FMUs.
        second: The FMUs to compare, in the same order.
        seed: Seed of the random inputs and parameters.

    Returns:
        The first difference of each FMU of `second` that behaves differently. FMUs that behave
        alike are omitted.
    """
    if not first:
        return {}
    context = multiprocessing.get_context("spawn")
    pools = [ProcessPoolExecutor(1, context, initializer=discard_messages) for _ in range(2)]
    with pools[0] as first_pool, pools[1] as second_pool:
        first_traces = [first_pool.submit(record_traces, path, seed) for path in first]
        second_traces = [second_pool.submit(record_traces, path, seed) for path in second]
        differences = {}
        for path, a, b in zip(second, first_traces, second_traces, strict=True):
            if difference := _difference_of_results(a, b):
                differences[path] = difference
    return differences


def _difference_of_results(first: Future[list[Trace]], second: Future[list[Trace]]) -> str:
    try:
        pairs = zip(first.result(), second.result(), strict=True)
    except BrokenProcessPool:
        return "the process that simulates the FMUs crashed in this FMU or in one before it"
    except Exception as error:
        return f"cannot be simulated: {error}"
    return next(filter(None, (first_difference(a, b) for a, b in pairs)), "")


def first_difference(first: Trace, second: Trace) -> str:
    """Return the first difference between two traces, or "" if they agree within the tolerances."""
    first_variables = {variable.name: variable for variable in first.variables}
    second_variables = {variable.name: variable for variable in second.variables}
    for name in sorted(first_variables.keys() | second_variables.keys()):
        a, b = first_variables.get(name), second_variables.get(name)
        if a != b:
            return f'variable "{name}" {_declaration_difference(a, b)}'
    if first.failure != second.failure:
        return (
            f'outcome differs: "{first.failure or "no failure"}" and '
            f'"{second.failure or "no failure"}"'
        )
    for name, x, y in zip(first.outputs, first.values.T, second.values.T, strict=True):
        scale = np.nanmax(np.abs([*x, *y, 0.0]))
        differing = ~np.isclose(
            x, y, rtol=0, atol=RELATIVE_TOLERANCE * scale + ABSOLUTE_TOLERANCE, equal_nan=True
        )
        if differing.any():
            row = int(np.argmax(differing))
            return (
                f'output "{name}" differs at t = {row * STEP_SIZE:.12g} s: {x[row]!r} and '
                f"{y[row]!r}"
            )
    return ""


def _declaration_difference(first: Variable | None, second: Variable | None) -> str:
    if first is None or second is None:
        return f"exists only in the {'rebuilt' if first is None else 'present'} FMU"
    changed = [key for key in Variable.__slots__ if getattr(first, key) != getattr(second, key)]
    return "; ".join(
        f"has {key} {getattr(first, key)!r} and {getattr(second, key)!r}" for key in changed
    )


def record_traces(path: Path, seed: int) -> list[Trace]:
    """Simulate an FMU with its default parameters and with random ones.

    The random numbers depend on `seed` and on the file name.
    """
    return [
        _record_trace(path, np.random.default_rng([seed, crc32(path.name.encode())]), vary)
        for vary in (False, True)
    ]


def _record_trace(path: Path, random: np.random.Generator, vary_parameters: bool) -> Trace:
    from ..components.fmi import FmuFile, create_component

    component = create_component(FmuFile(path), path.stem)
    variables = [variable for variable in component.variables if variable.type in _NUMERIC_TYPES]
    inputs = _allocate_ports([variable for variable in variables if variable.causality == "input"])
    outputs = _allocate_ports(
        [variable for variable in variables if variable.causality == "output"]
    )
    rows: list[np.ndarray] = []
    failure = ""
    try:
        component.bind(inputs, outputs)
        component.instantiate()
        if vary_parameters:
            _set_random_parameters(component, random, ("fixed", "tunable"))
        for _ in _simulate(component, inputs, random):
            component.get_outputs()
            rows.append(_concatenate(outputs))
            if vary_parameters and len(rows) == STEP_COUNT // 2:
                _set_random_parameters(component, random, ("tunable",))
    except ComponentError as error:
        failure = str(error)
    finally:
        component.free()
    # the variables in the order of their values in the concatenated arrays
    places = {dtype: place for place, dtype in enumerate(outputs.arrays)}
    ordered = sorted(outputs.variables, key=lambda variable: places[variable.dtype])
    names = list(chain.from_iterable(variable.scalar_names for variable in ordered))
    return Trace(component.variables, names, np.array(rows).reshape(len(rows), len(names)), failure)


def _simulate(component: Component, inputs: Ports, random: np.random.Generator) -> Iterator[None]:
    """Initialize and step the component; yield whenever its outputs can be read."""
    component.enter_initialization_mode(0.0, STEP_COUNT * STEP_SIZE)
    _set_random_inputs(inputs, random)
    component.set_inputs()
    component.exit_initialization_mode()
    yield
    for step in range(STEP_COUNT):
        if step % STEPS_PER_INPUT == 0:
            _set_random_inputs(inputs, random)
        component.set_inputs()
        component.do_step(step * STEP_SIZE, STEP_SIZE)
        yield
    component.terminate()


def _allocate_ports(variables: Sequence[Variable]) -> Ports:
    sizes: dict[np.dtype, int] = {}
    for variable in variables:
        sizes[variable.dtype] = sizes.get(variable.dtype, 0) + len(variable.scalar_names)
    return Ports(variables, {dtype: np.zeros(size, dtype) for dtype, size in sizes.items()})


def _concatenate(ports: Ports) -> np.ndarray:
    return np.concatenate([np.empty(0), *(array.astype(float) for array in ports.arrays.values())])


def _set_random_inputs(inputs: Ports, random: np.random.Generator) -> None:
    for dtype, array in inputs.arrays.items():
        array[:] = np.concatenate(
            [
                _random_values(variable, random)
                for variable in inputs.variables
                if variable.dtype == dtype
            ]
        )


def _set_random_parameters(
    component: Component, random: np.random.Generator, variabilities: Sequence[str]
) -> None:
    for variable in component.variables:
        if (
            variable.causality == "parameter"
            and variable.variability in variabilities
            and variable.type in _NUMERIC_TYPES
        ):
            values = _random_values(variable, random).tolist()
            component.set(variable.name, values if variable.shape else values[0])


def _random_values(variable: Variable, random: np.random.Generator) -> np.ndarray:
    """Return random values.

    Within the declared limits for bounded inputs, else around the start value.
    """
    size = len(variable.scalar_names)
    start = np.resize(np.array(variable.start if variable.start is not None else 0, float), size)
    low, high = (
        np.nan if limit is None else limit for limit in (variable.minimum, variable.maximum)
    )
    bounded = np.isfinite(high - low)
    if variable.type == "Boolean":
        return random.integers(0, 2, size).astype(variable.dtype)
    if variable.type != "Float64":
        return (random.integers(int(low), int(high) + 1, size) if bounded else start).astype(
            variable.dtype
        )
    if variable.causality == "input" and bounded:
        return random.uniform(low, high, size)
    absolute_range, relative_range = (0.1, 0.2) if variable.causality == "parameter" else (2.0, 2.0)
    values = start + np.where(
        start == 0, absolute_range, relative_range * np.abs(start)
    ) * random.uniform(-1, 1, size)
    return np.fmin(np.fmax(values, low), high)
