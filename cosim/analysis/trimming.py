"""Trim: inputs, parameters and initial states with which a scenario starts in equilibrium."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..api.simulation import load
from ..core.errors import InputError
from ..core.system import Endpoint
from ..scenario import PreparedRun
from ..scenario.json_document import find_value, missing_value, pointer_keys
from ..scenario.name_resolution import SlotIndex, UnknownNameError, resolve_name
from ..scenario.nested_systems import load_scenario
from .experiment import REPLACED, Scenario

#: entries of a scenario that a trim replaces: nothing is recorded, evaluated or ends the run
_REPLACED: Mapping[str, Any] = {**REPLACED, "/record": {"signals": []}, "/events": []}
#: largest residual of an operating point that counts as found
TOLERANCE = 1e-8
#: relative step of the finite differences of the residuals
_RELATIVE_STEP = 1e-6


@dataclass(frozen=True)
class Trim:
    """Operating point.

    Attributes:
        parameters: Found values, for the `parameters` of `cosim.load`.
        residuals: Rate of change of each steady signal (its unit per s), and deviation of each
            required signal.
        evaluations: Number of times that the scenario was started.
        without_effect: Free values that change no residual.
    """

    parameters: Mapping[str, Any]
    residuals: Mapping[str, float]
    evaluations: int
    without_effect: Sequence[str]

    @property
    def largest(self) -> str:
        """Signal with the largest residual."""
        return max(self.residuals, key=lambda name: abs(self.residuals[name]))

    @property
    def is_found(self) -> bool:
        """True if all residuals are at most `TOLERANCE`."""
        return abs(self.residuals[self.largest]) <= TOLERANCE


def trim(
    scenario: Scenario,
    free: Sequence[str],
    steady: Sequence[str],
    required: Mapping[str, float] | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
) -> Trim:
    """Find values with which a scenario starts in equilibrium.

    The scenario is started again and again with changed values, and makes one macro step. A trust
    region method with finite differences minimises the sum of the squared residuals.

    Args:
        scenario: Path of a scenario file, name of a shipped scenario, or the content of a scenario
            file as a dict.
        free: Changed values: names of inputs without connection, parameters and initial states, or
            JSON pointers of numbers. The search begins with their present values.
        steady: Names of signals that do not change during the first macro step.
        required: Values of signals at the start time.
        parameters: Values that replace those of the scenario, see `cosim.load`.

    Returns:
        The best operating point; `is_found` tells whether it is an equilibrium.

    Raises:
        InputError: The scenario cannot be run, a name is unknown, or a value is no number.
        ComponentError: A component failed.
    """
    from scipy.optimize import least_squares

    if not free or not (steady or required):
        raise InputError("expected at least one free value, and one steady or required signal")
    search = _Search(
        scenario,
        {**_REPLACED, **(parameters or {})},
        list(free),
        list(steady),
        dict(required or {}),
    )
    start = np.array(search.begin())
    found = least_squares(
        search.residuals,
        start,
        "2-point",
        x_scale="jac",
        diff_step=_RELATIVE_STEP,
        ftol=None,
        xtol=1e-15,
        gtol=1e-15,
        max_nfev=100,
    )
    residuals = dict(zip(search.names, search.residuals(found.x).tolist(), strict=True))
    return Trim(
        search.settings(found.x), residuals, search.evaluations, search.without_effect(found.jac)
    )


@dataclass
class _Search:
    """Evaluation of the residuals."""

    scenario: Scenario
    parameters: Mapping[str, Any]
    free: Sequence[str]
    steady: Sequence[str]
    required: Mapping[str, float]
    evaluations: int = 0
    #: names of the residuals
    names: Sequence[str] = ()
    #: number of elements of each free value; None: a scalar
    sizes: list[int | None] = field(default_factory=list)

    def begin(self) -> list[float]:
        """Return the present values."""
        document = load_scenario(self.scenario, self.parameters).root.document.value
        values: list[float] = []
        with load(self.scenario, self.parameters) as simulation:
            for name in self.free:
                if name.startswith("/"):
                    keys = pointer_keys(name)
                    present, depth = find_value(document, keys)
                    if depth < len(keys):
                        raise InputError(missing_value(document, name))
                else:
                    _refuse_connected(simulation.prepared, name)
                    present = simulation.get(name)
                self.sizes.append(len(present) if isinstance(present, list) else None)
                values += _elements(name, present).values()
        return values

    def settings(self, values: np.ndarray) -> dict[str, Any]:
        """Return the settings of the scenario for values of all elements."""
        settings: dict[str, Any] = {}
        position = 0
        for name, size in zip(self.free, self.sizes, strict=True):
            part = values[position : position + (size or 1)].tolist()
            settings[name] = part[0] if size is None else part
            position += size or 1
        return settings

    def without_effect(self, jacobian: np.ndarray) -> list[str]:
        """Return the free values of whose elements none changes a residual.

        The derivatives of the residuals show it.
        """
        ends = np.cumsum([size or 1 for size in self.sizes])
        parts = np.split(jacobian, ends[:-1], axis=1)
        return [name for name, part in zip(self.free, parts, strict=True) if not part.any()]

    def residuals(self, values: np.ndarray) -> np.ndarray:
        """Start the scenario with values, and return all residuals."""
        self.evaluations += 1
        with load(self.scenario, {**self.parameters, **self.settings(values)}) as simulation:
            before = {
                name: _elements(name, simulation.get(name))
                for name in (*self.steady, *self.required)
            }
            begin = simulation.time
            simulation.step()
            span = simulation.time - begin
            after = {name: _elements(name, simulation.get(name)) for name in self.steady}
        rates, deviations = dict[str, float](), dict[str, float]()
        for name in self.steady:
            for key, value in before[name].items():
                rates[f"{name}{key}"] = (after[name][key] - value) / span
        for name, target in self.required.items():
            for key, value in before[name].items():
                deviations[f"{name}{key}"] = value - target
        self.names = [*rates, *deviations]
        return np.array([*rates.values(), *deviations.values()])


def _refuse_connected(prepared: PreparedRun, name: str) -> None:
    """Raise an error if a name stands for an input that a connection feeds."""
    try:
        targets = resolve_name(prepared.root, name, ("inputs",), include_inner=True)
    except UnknownNameError:  # a parameter, or reported with the values
        return
    sources = {connection.target: connection.source for connection in prepared.system.connections}
    for component, prefix in targets:
        index = SlotIndex(prepared.system.components[component], "input")
        for slot in index.below(prefix).values():
            if source := sources.get(Endpoint(component, slot)):
                expected = "expected an input without connection, a parameter or an initial state"
                raise InputError(f'free: "{component}.{slot}" is fed by "{source}", {expected}')


def _elements(name: str, value: Any) -> dict[str, float]:
    """Return the elements of a signal by what follows its name."""
    if isinstance(value, list):
        return {f"[{i}]": _number(name, each) for i, each in enumerate(value, 1)}
    return {"": _number(name, value)}


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f'"{name}" is {value!r}, expected a number')
    return float(value)
