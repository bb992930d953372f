"""A scenario at a point in time, perturbed again and again from the same saved state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from fnmatch import fnmatchcase
from fractions import Fraction
from math import lcm
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np

from ..core.component import Variable
from ..core.errors import InputError, did_you_mean
from ..core.system import Connection, Endpoint
from ..core.time_grid import exact_fraction
from ..engine.perturbation import PerturbationTarget, PerturbingExecutor
from ..engine.plan_run import PlanRun
from ..engine.run_checks import not_settable_reason
from ..engine.transfer_plan import unit_conversion
from ..process.float_mode import default_float_mode
from ..scenario import PreparedRun
from ..scenario import load as prepare
from ..scenario.name_resolution import SlotIndex, Target, UnknownNameError, resolve_name
from ..scenario.nested_systems import load_scenario

#: path, name or content of a scenario
Scenario = str | Path | Mapping[str, Any]
#: targets of each channel by the name of the channel
Channels = Mapping[str, Sequence[PerturbationTarget]]

#: samples of a response by default, the fewest, and the most macro steps between two of them if
#: there is no duration
DEFAULT_SAMPLES, MIN_SAMPLES, MAX_STRIDE = 256, 8, 64

#: entries of a scenario that an experiment replaces: all outputs are recorded, and nothing is
#: evaluated or ends the run
REPLACED: Mapping[str, Any] = {
    "/record": {"signals": ["*"]},
    "/stop_when": [],
    "/kpis": [],
    "/figures": [],
    "/checks": [],
}


class Response(NamedTuple):
    """Course after the operating point.

    Attributes:
        outputs: Recorded outputs at the samples, shape (samples + 1, outputs).
        observed: Values of the channels before the addition, shape (samples, channels).
    """

    outputs: np.ndarray
    observed: np.ndarray


class Experiment:
    """A scenario that has run to a point in time; use it in a `with` block.

    Attributes:
        prepared: The scenario.
        step: Time between two samples (s), at which the steps of all components end.
        stride: Number of macro steps between two samples.
        sample_count: Number of samples of a response.
        max_sample_count: Largest number of samples; more than `sample_count` if no duration was
            given.
        time: The point in time (s).
    """

    def __init__(
        self,
        scenario: Scenario,
        parameters: Mapping[str, Any] | None = None,
        at: float | str | None = None,
        duration: float | None = None,
    ):
        """Run a scenario to a point in time.

        Args:
            scenario: Path, name or content.
            parameters: See `cosim.load`.
            at: The point in time (s), a communication point; None: the start time.
            duration: Duration of the responses (s); None: 256 samples.

        Raises:
            InputError: The scenario cannot be run, it ends before `at`, or a component cannot
                return to a state.
            ComponentError: A component failed.
        """
        settings = {**REPLACED, **(parameters or {})}
        spec = load_scenario(scenario, settings).spec
        begin = spec.start_time if at is None else _time("at", at)
        span = (
            spec.step_size * DEFAULT_SAMPLES * MAX_STRIDE
            if duration is None
            else _time("duration", duration)
        )
        self.prepared: PreparedRun = prepare(scenario, settings, stop_time=begin + span)
        self._run = PlanRun(self.prepared.plan, executor=PerturbingExecutor)
        try:
            self._run_to(begin, None if duration is None else span)
        except BaseException:
            self._run.close()
            raise

    def _run_to(self, begin: Fraction, span: Fraction | None) -> None:
        grid = self.prepared.plan.grid
        try:
            first = grid.index(begin)
        except ValueError as error:
            raise InputError(f"at: time {error}") from None
        self.stride = lcm(
            *(int(period / grid.step) for period in self.prepared.system.periods.values())
        )
        if first % self.stride:
            raise InputError(
                "at: expected a time at which the steps of all components end, found "
                f"{float(begin):.12g} s"
            )
        self.time, self.step = grid.time_at(first), float(grid.step * self.stride)
        self.max_sample_count = (grid.whole_steps - first) // self.stride
        self.sample_count = (
            self.max_sample_count if span else min(DEFAULT_SAMPLES, self.max_sample_count)
        )
        if self.sample_count < MIN_SAMPLES:
            raise InputError(
                f"duration: expected at least {MIN_SAMPLES} samples of {self.step:.12g} s, found "
                f"{self.sample_count}"
            )
        self._run.initialize()
        self._run.advance(first)
        if self._run.executor.termination:
            raise InputError(
                f"the run ended at t = {self._run.executor.time:.12g} s, before t = "
                f"{self.time:.12g} s"
            )
        self._saved = self._run.save()
        self._first_row = self._executor.recorder.row_count - 1

    @property
    def _executor(self) -> PerturbingExecutor:
        assert isinstance(self._run.executor, PerturbingExecutor)
        return self._run.executor

    def __enter__(self) -> Experiment:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._run.close()

    def choose(
        self, channels: Channels, outputs: Sequence[str], active: Set[str] | None = None
    ) -> None:
        """Choose what `respond` perturbs and returns.

        Args:
            channels: The perturbed channels.
            outputs: Names of recorded outputs.
            active: Names of the components that step; None: all.
        """
        self._run.restore(self._saved)
        with default_float_mode():
            self._executor.set_channels(list(channels.values()), active)
        self._outputs = list(outputs)

    def respond(self, values: np.ndarray) -> Response:
        """Return to the operating point and add values to the channels.

        Args:
            values: Added values, constant from one sample to the next, shape (samples, channels).

        Raises:
            ComponentError: A component failed.
        """
        self._run.restore(self._saved)
        executor, stride = self._executor, self.stride
        executor.set_values(np.repeat(values, stride, 0))
        self._run.advance(executor.completed_steps + stride * len(values))
        if executor.termination:
            raise InputError(
                f"the run ended at t = {executor.time:.12g} s, before the end of the response"
            )
        columns = executor.recorder.recording().columns
        rows = slice(self._first_row, self._first_row + stride * len(values) + 1, stride)
        outputs = (
            np.array([columns[name][rows] for name in self._outputs], float)
            .reshape(len(self._outputs), len(values) + 1)
            .T
        )
        return Response(outputs, executor.observed[::stride])

    def directional_derivatives(
        self, component: str, unknowns: Sequence[str], knowns: Sequence[str]
    ) -> np.ndarray | None:
        """Return the partial derivatives of variables of a component at the operating point.

        Args:
            component: Name of the component.
            unknowns: Names of outputs and of derivatives of states.
            knowns: Names of inputs and of states.

        Returns:
            None if the component does not offer them.

        Raises:
            ComponentError: The component failed.
        """
        columns = []
        for known in knowns:
            with self._run.accessing(component, "get_directional_derivative"):
                column = self.prepared.system.components[component].get_directional_derivative(
                    unknowns, known
                )
            if column is None:
                return None
            columns.append(column)
        return np.array(columns).reshape(len(knowns), len(unknowns)).T

    # -- names
    # ---------------------------------------------------------------------------------------

    def find_outputs(self, names: Sequence[str]) -> list[str]:
        """Return the recorded floating-point outputs that names or patterns stand for.

        Raises:
            InputError: A name stands for no output.
        """
        variables = self._executor.recorder.variables
        reals = [name for name, variable in variables.items() if variable.dtype.kind == "f"]
        found: dict[str, None] = {}
        for text in names:
            matching = [
                each
                for each in reals
                if each == text
                or each.startswith((f"{text}.", f"{text}["))
                or fnmatchcase(each, text)
            ]
            if not matching:
                raise InputError(
                    f'outputs: no floating-point output "{text}"{did_you_mean(text, reals)}'
                )
            found.update(dict.fromkeys(matching))
        return list(found)

    def find_inputs(self, names: Sequence[str]) -> dict[str, list[PerturbationTarget]]:
        """Return the channels that names of inputs, parameters or connected outputs stand for.

        Raises:
            InputError: A name stands for nothing that can be perturbed.
        """
        channels: dict[str, list[PerturbationTarget]] = {}
        for text in names:
            found: dict[str, list[PerturbationTarget]] = {}
            for suffix, target in self._targets(text):
                found.setdefault(f"{text}{suffix}", []).append(target)
            if not found:
                raise InputError(
                    f'inputs: "{text}" is no input, tunable parameter or connected output of '
                    "floating-point numbers"
                )
            channels |= found
        return channels

    def _targets(self, text: str) -> list[tuple[str, PerturbationTarget]]:
        """Return the inputs that a name stands for.

        Each has what follows the name in that of the input.
        """
        connections = self.prepared.system.connections
        fed = {connection.target for connection in connections}
        targets = []
        for component, prefix in self._resolve(text):
            for causality in ("input", "parameter"):
                index = SlotIndex(self.prepared.system.components[component], causality)
                for suffix, slot in index.below(prefix).items():
                    endpoint = Endpoint(component, slot)
                    if endpoint in fed or not not_settable_reason(
                        component, self._variable(endpoint), fed
                    ):
                        targets.append((suffix, PerturbationTarget(endpoint)))
            index = SlotIndex(self.prepared.system.components[component], "output")
            for suffix, slot in index.below(prefix).items():
                source = Endpoint(component, slot)
                targets += [
                    (suffix, self.target_of(each)) for each in connections if each.source == source
                ]
        return [
            (suffix, target)
            for suffix, target in targets
            if self._variable(target.endpoint).dtype.kind == "f"
        ]

    def _resolve(self, text: str) -> list[Target]:
        found: list[Target] = []
        problems = []
        for ports in ("inputs", "parameters", "outputs"):
            try:
                found += resolve_name(self.prepared.root, text, (ports,), include_inner=True)
            except UnknownNameError as error:
                problems.append(str(error))
        if not found:
            raise InputError(f'inputs: no variable "{text}": {problems[0]}')
        return list(dict.fromkeys(found))

    def target_of(self, connection: Connection) -> PerturbationTarget:
        """Return the input of a connection, with the factor of its unit and gain."""
        factor, _ = unit_conversion(
            self._variable(connection.source), self._variable(connection.target)
        )
        return PerturbationTarget(connection.target, factor * connection.gain)

    def find_components(self, names: Sequence[str]) -> set[str]:
        """Return the components that names stand for.

        The name of a nested system stands for its components.

        Raises:
            InputError: There is no such component.
        """
        components = self.prepared.system.components
        found: set[str] = set()
        for text in names:
            inside = {each for each in components if each == text or each.startswith(f"{text}.")}
            if not inside:
                raise InputError(f'no component "{text}"{did_you_mean(text, components)}')
            found |= inside
        return found

    def _variable(self, endpoint: Endpoint) -> Variable:
        return self.prepared.system.find_element(endpoint).variable


def _time(name: str, value: float | str) -> Fraction:
    try:
        return exact_fraction(value)
    except (ValueError, ZeroDivisionError) as error:
        raise InputError(f"{name}: {error}") from None
