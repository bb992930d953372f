"""Functions that load and run a scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypedDict, Unpack

from ..core.errors import ComponentError
from ..engine.pacer import LatePolicy
from ..engine.plan_run import Observer
from ..results import Result
from ..scenario import IsolationMode, PreparedRun
from ..scenario import load as prepare
from .arguments import check_load_arguments, check_options
from .simulation import Simulation


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
