"""A scenario that Python loads, runs or steps."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, TypedDict, Unpack
from weakref import finalize

from ..core.errors import ComponentError, CosimError, InputError
from ..engine.component_states import SavedState
from ..engine.pacer import LatePolicy
from ..engine.plan_run import Observer, PlanRun, StepHook
from ..results import Result
from ..scenario import IsolationMode, PreparedRun
from ..scenario import load as prepare
from .arguments import check_load_arguments, check_names, check_options, expect, is_integer
from .execution import evaluate_outcome
from .variable_access import VariableAccess

#: prepares the scenario with changed values of variables and entries
Prepare = Callable[[Mapping[str, Any]], PreparedRun]


class Simulation:
    """Simulation of a scenario, made by `cosim.load`.

    Run it to the end, or step it from your own loop.

        with cosim.load("demo1_box") as simulation:
            while simulation.step():
                print(simulation.time, simulation.get("plant.uav.position.z"))

    The components are initialized by the first method that needs them. They are terminated and
    freed by `close`, at the end of a `with` block, or when the object is garbage-collected. Several
    simulations may be alive in one process, also in several threads; methods called from several
    threads wait for each other. Between two steps the process is in the state in which the caller
    left it: what components change (working directory, environment, floating-point mode and others)
    is changed back.

    After an error of a component, or an interrupt during a step, the components are in an unknown
    state. Then only `result`, `reset` and `close` can be called.

    Attributes:
        prepared: The scenario with its system and settings.
    """

    prepared: PreparedRun

    def __init__(self, prepare: Prepare):
        """Prepare the scenario; see `cosim.load`."""
        self._prepare = prepare
        self._lock = threading.RLock()
        self._open({})

    def _open(self, settings: Mapping[str, Any]) -> None:
        self.prepared = self._prepare(settings)
        self._run: PlanRun | None = None
        self._variables = VariableAccess(self.prepared)
        self._result: Result | None = None
        self._is_stepping = False
        #: ends the components; a list, so that the finalizer does not refer to this object
        self._ends: list[Callable[[], None]] = [self.prepared.free]
        self._finalizer = finalize(self, _end_quietly, self._ends, os.getpid())

    def __repr__(self) -> str:
        state = "closed" if not self._ends else f"at t = {self.time:.12g} s"
        return f"<Simulation {self.prepared!r}; {state}>"

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Terminate and free the components.

        Later calls do nothing; `result` and `reset` still work.

        Raises:
            ComponentError: A component failed to terminate or to be freed.
        """
        with self._lock:
            self._refuse_recursion()
            self._finalizer.detach()
            while self._ends:
                self._ends.pop()()

    # -- time

    @property
    def time(self) -> float:
        """Present time (s)."""
        return self._run.executor.time if self._run else self.prepared.plan.grid.time_at(0)

    @property
    def is_finished(self) -> bool:
        """True at the stop time, and after a component has requested the end."""
        return self._run is not None and self._run.is_finished

    def step(self, n: int = 1) -> bool:
        """Advance by `n` macro steps, or to the end if it is nearer.

        Args:
            n: Number of macro steps, at least 1.

        Returns:
            True until the end is reached: `while simulation.step(): ...`

        Raises:
            InputError: The simulation has reached its end, or `n` is no positive integer.
            ComponentError: A component failed; `result` of the error holds what was recorded until
                then.
            LateError: The simulation fell behind real time and `late` is "fail".
        """
        if n.__class__ is not int or n < 1:
            expect("n", n, is_integer(n) and n > 0, "a positive number of steps")
        with self._lock:
            run = self._running()
            if run.is_finished:
                raise InputError(
                    f"the simulation has reached its end at t = {self.time:.12g} s; reset() starts "
                    "it again"
                )
            self._advance(run, run.executor.completed_steps + n)
            return not run.is_finished

    def run(self, observers: Sequence[Observer] = ()) -> Result:
        """Run from the present time to the end, and evaluate the KPIs and checks.

        Args:
            observers: Functions called about 100 times with the number of finished and of all macro
                steps.

        Returns:
            The result; see `cosim.run`.

        Raises:
            InputError: The simulation has already failed or was closed, or a KPI refuses its
                arguments.
            ComponentError: A component or a KPI function failed; `result` of the error holds what
                was recorded until then.
            LateError: The simulation fell behind real time and `late` is "fail".
        """
        return _raise_failure(self.execute(observers))

    def execute(
        self, observers: Sequence[Observer] = (), step_hook: StepHook | None = None
    ) -> Result:
        """Like `run`, but return a failure in the result instead of raising it.

        Args:
            observers: See `run`.
            step_hook: Called with n before the macro step that starts at communication point n;
                only before the first step.
        """
        expect(
            "observers",
            observers,
            isinstance(observers, Sequence) and all(map(callable, observers)),
            "a list of functions",
        )
        with self._lock:
            with suppress(Exception, KeyboardInterrupt):  # it is the failure of the run
                self._advance(self._running(step_hook), self.prepared.plan.grid.count, observers)
            if self._run is None:  # it could not be created
                self._running(step_hook)
            return self._evaluate()

    @property
    def result(self) -> Result:
        """Result so far. At the end it includes the KPIs and checks.

        Raises:
            InputError: A KPI refuses its arguments.
            ComponentError: A KPI function failed.
        """
        with self._lock:
            if self._run is None and self._ends:
                self._running()
            result = self._evaluate()
            return result if self._run and self._run.failure else _raise_failure(result)

    def reset(self, seed: int | None = None, parameters: Mapping[str, Any] | None = None) -> None:
        """Return to the start time with new components.

        Args:
            seed: Value of the entries that the key "seeds" of the scenario lists; None: as loaded.
            parameters: Values that replace those of the scenario and of `load`, until the next
                reset.

        Raises:
            InputError: The scenario cannot be run with these values, it lists no seeds, or it
                contains a Python object, which cannot be made again.
            ComponentError: A component failed to terminate or to be freed.
        """
        check_names("parameters", parameters)
        expect("seed", seed, seed is None or is_integer(seed), "an integer")
        settings: dict[str, Any] = {}
        if seed is not None:
            if not self.prepared.spec.seeds:
                raise InputError(
                    'the scenario has no key "seeds", which lists the JSON pointers that a seed '
                    "sets"
                )
            settings = dict.fromkeys(self.prepared.spec.seeds, int(seed))
        with self._lock:
            self._refuse_recursion()
            self.prepared.document.refuse_objects(
                "expected a class, of which reset() makes a new object", classes=False
            )
            self.close()
            self._open({**settings, **(parameters or {})})

    # -- variables

    def get(self, name: str) -> Any:
        """Return the present value of a variable.

        Outputs have the values of the last step. A connected input has the value of its last
        transfer.

        Args:
            name: Name of a signal such as "plant.uav.position.z", of an input or a parameter. The
                name of an array, of variables with indices ("plant.uav.rotor_speed") or of a vector
                ("plant.uav.position") gives a list.

        Raises:
            InputError: There is no such variable.
            ComponentError: The component failed.
        """
        with self._lock:
            return self._variables.get(name, self._running())

    def set(self, name: str, value: Any) -> None:
        """Set an input without connection or a tunable parameter; it acts in the next step.

        The component receives the value at the begin of the next step, or before the next call of
        `get` or `save` that needs a component. If it refuses it, this call fails.

        Args:
            name: Name of the variable, of a list of variables with indices, or of a vector.
            value: The value, in the unit of the variable; a list for an array or a vector.

        Raises:
            InputError: There is no such variable, it cannot be set now, or it does not accept the
                value.
        """
        with self._lock:
            self._variables.set(name, value, self._running())

    # -- states

    def save(self) -> SavedState:
        """Return the present state, for `restore`.

        Raises:
            InputError: A component cannot return to a state (FMI: canGetAndSetFMUState).
            ComponentError: A component failed.
        """
        with self._lock:
            return self._running().save()

    def restore(self, state: SavedState) -> None:
        """Return to a state, as often as needed; the result then ends there.

        Raises:
            InputError: The state belongs to another simulation, or to this one before it was reset.
            ComponentError: A component failed.
        """
        expect("state", state, isinstance(state, SavedState), "a state that save() returned")
        with self._lock:
            self._result = None
            self._running().restore(state)

    # -- internal

    def _running(self, step_hook: StepHook | None = None) -> PlanRun:
        """Return the run with its components in step mode."""
        run = self._run
        if run is None or not self._ends or run.failure or self._is_stepping:
            self._refuse_recursion()
            if not self._ends:
                raise InputError("the simulation is closed; reset() opens it again")
            if run is None:
                run = self._run = PlanRun(self.prepared.plan, step_hook)
                self._ends[:] = [run.close]
                run.initialize()
            elif run.failure:
                raise InputError(
                    f"the simulation failed: {str(run.failure) or 'interrupted'}; reset() starts "
                    "it again"
                )
        return run

    def _refuse_recursion(self) -> None:
        if self._is_stepping:
            raise InputError(
                "the simulation is stepping; a component or an observer cannot step or change it "
                "meanwhile"
            )

    def _advance(self, run: PlanRun, end: int, observers: Sequence[Observer] = ()) -> None:
        self._is_stepping, self._result = True, None
        try:
            run.advance(min(end, self.prepared.plan.grid.count), observers)
        except CosimError as error:
            error.result = self._evaluate()
            raise
        finally:
            self._is_stepping = False

    def _evaluate(self) -> Result:
        if self._result is None:
            if self._run is None:
                raise InputError(
                    "the simulation was closed before it began; reset() opens it again"
                )
            self._result = evaluate_outcome(
                self.prepared, self._run.outcome(), self._run.is_finished
            )
        return self._result


def _raise_failure(result: Result) -> Result:
    """Return the result of a run, or raise its failure with the result."""
    if result.failure:
        # any exception has it, a KeyboardInterrupt too
        vars(result.failure)["result"] = result
        raise result.failure
    return result


def _end_quietly(ends: list[Callable[[], None]], process: int) -> None:
    """End the components of a simulation that was not closed, but not in a fork of its process."""
    while ends and os.getpid() == process:
        with suppress(CosimError):
            ends.pop()()


class LoadOptions(TypedDict, total=False):
    """Keyword arguments of `load` that `run` passes on; `load` documents them."""

    stop_time: float | str | None
    step_size: float | str | None
    real_time: float | None
    late: LatePolicy
    isolation: IsolationMode
    sandbox: bool


def load(
    scenario: str | Path | Mapping[str, Any],
    parameters: Mapping[str, Any] | None = None,
    *,
    stop_time: float | str | None = None,
    step_size: float | str | None = None,
    real_time: float | None = None,
    late: LatePolicy = "warn",
    isolation: IsolationMode = "none",
    sandbox: bool = False,
) -> Simulation:
    """Read, connect and check a scenario.

    Args:
        scenario: Path of a scenario file, name of a shipped scenario, or the content of a scenario
            file as a dict. In a dict, relative paths start from the working directory, and "python"
            may also be a class or an object: a PythonFMU slave or a `cosim.Component`.
        parameters: Values that replace those of the scenario. A key is the name of a variable
            ("uav.vtol.landing_time") or the JSON pointer of any entry
            ("/components/plant/arguments/environment/seed").
        stop_time: End of the simulation (s), a number or a fraction such as "1/3"; None: as in the
            scenario.
        step_size: Macro step (s), a number or a fraction such as "1/60"; None: as in the scenario.
        real_time: Simulated seconds per second of wall time; None: as fast as possible.
        late: Reaction to a real-time run that falls more than one step behind: "warn", or "fail"
            for a LateError.
        isolation: "fmu" runs every FMU in a separate process; "none" does so only where the
            scenario sets `isolation`, or where an FMU that allows one instance per process is used
            again.
        sandbox: Run every FMU in a separate process that reads and writes only its own files, has
            no network and starts no programs.

    Returns:
        The simulation at its start time. Close it, or use it in a `with` block.

    Raises:
        InputError: The scenario cannot be run, or an argument is of a wrong type; `problems` lists
            all reasons.
    """
    times = {"stop_time": stop_time, "step_size": step_size}
    options: dict[str, Any] = {
        **times,
        "real_time": real_time,
        "late": late,
        "isolation": isolation,
        "sandbox": sandbox,
    }
    check_load_arguments(scenario, parameters, options)
    given = dict(parameters or {})

    def prepare_with(changes: Mapping[str, Any]) -> PreparedRun:
        return prepare(scenario, {**given, **changes}, **options)

    return Simulation(prepare_with)


def run(
    scenario: str | Path | Mapping[str, Any],
    parameters: Mapping[str, Any] | None = None,
    *,
    observers: Sequence[Observer] = (),
    **options: Unpack[LoadOptions],
) -> Result:
    """Run a scenario in this process and evaluate its KPIs and checks.

    Runs in several threads of one process are safe, also in an event loop
    (`asyncio.to_thread(cosim.run, ...)`) and after a fork. Only one thread at a time loads or steps
    components, because FMUs may change the state of the whole process. This state (working
    directory, environment, locale and others) is restored before another thread continues.
    Therefore an observer must not wait for a run of another thread. If all components of several
    runs are isolated FMUs, these runs step at the same time.

    Args:
        scenario: Path of a scenario file, name of a shipped scenario, or the content of a scenario
            file as a dict, see `load`.
        parameters: Values that replace those of the scenario, see `load`.
        observers: Functions called about 100 times per run with the number of finished and of all
            macro steps.
        **options: `stop_time`, `step_size`, `real_time`, `late`, `isolation` and `sandbox`, see
          `load`.

    Returns:
        The recorded signals, KPIs and outcomes of the checks. A failed check raises no error.

    Raises:
        InputError: The scenario cannot be run, or a KPI refuses its arguments.
        ComponentError: A component or a KPI function failed. As with every error raised after the
            simulation began, the attribute `result` of the exception holds what was recorded until
            then.
        LateError: The run fell behind real time and `late` is "fail".
    """
    check_options(options, LoadOptions.__annotations__)
    result = None
    try:
        with load(scenario, parameters, **options) as simulation:
            result = simulation.run(observers)
    except ComponentError as error:
        error.result = (
            error.result or result
        )  # the components are terminated at the end of the block
        raise
    return result
