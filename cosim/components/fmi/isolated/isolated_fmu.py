"""Importer side of an isolated FMU: a component that forwards all calls to a worker process."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from ....core.component import Component, Ports, PreparedCall, StepResult
from ....core.errors import InputError
from ....process.temporary_folders import WORKER_PREFIX, LockedFolder
from ..file import FmuFile
from ..function_calls import DISCARD, OK
from ..instance import FmuInstance
from ..instance_settings import InstanceSettings
from .answers import (
    call_names,
    derivative_values,
    state_number,
    step_result,
    string_values,
    variable_value,
)
from .isolation import Isolation
from .pipes import STEP_COMMAND, STEP_DONE
from .shared_memory import SharedMemoryBlock, matching_buffers, string_array
from .worker import Worker
from .worker_client import WorkerClient
from .worker_process import WorkerProcess


class IsolatedFmu(WorkerClient, Component):
    """Component whose FMU instance runs in a worker process.

    Results are identical to those of `FmuInstance`. A crash, exit or hang of the FMU raises a
    ComponentError.
    """

    binds_everything = False
    runs_foreign_code = False

    def __init__(
        self,
        instance_class: type[FmuInstance],
        file: FmuFile,
        instance_name: str,
        settings: InstanceSettings,
        isolation: Isolation,
    ):
        """Create the component; see `create_component`.

        The worker process is started by `instantiate`.

        Args:
            instance_class: Class of the instance in the worker process.
            file: The FMU.
            instance_name: Name of the FMU instance.
            settings: Tolerance and integration method.
            isolation: Deadlines and sandbox of the worker process.

        Raises:
            InputError: The operating system has no fork, or the FMU has no usable binary for this
                platform.
        """
        if not hasattr(os, "fork"):
            raise InputError("isolated FMUs need an operating system with fork (Linux, macOS)")
        file.check_binary()
        super().__init__(file, instance_name, isolation.deadlines.load)
        self._instance_class, self.isolation = instance_class, isolation
        self.description = file.description.with_structural_parameters(
            settings.structural_parameters, file.limits
        )
        self.variables, self.has_state = self.description.variables, self.description.has_state
        self.variable_step = self.description.variable_step
        self.dependencies, self.initial_dependencies = (
            self.description.dependencies,
            self.description.initial_dependencies,
        )
        self.continuous_states = self.description.continuous_states
        self.interpolates_inputs = self.description.interpolates_inputs
        self.gives_output_slopes = self.description.gives_output_slopes
        self._variables_by_name = {variable.name: variable for variable in self.variables}
        self._settings = settings
        self._temporary_folder: LockedFolder | None = None
        self._result: StepResult | None = None

    # -- life cycle
    # ----------------------------------------------------------------------------------------------------

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """Allocate the shared memory that mirrors the bound arrays."""
        self._shared_memory = SharedMemoryBlock(inputs, outputs)
        self._current_time = self._shared_memory.current_time
        self._input_buffers, self._output_buffers = (
            matching_buffers(self._shared_memory.inputs, inputs),
            matching_buffers(outputs, self._shared_memory.outputs),
        )
        self._input_strings, self._output_strings = string_array(inputs), string_array(outputs)
        self._has_strings = len(self._input_strings) + len(self._output_strings) > 0

    def instantiate(self) -> None:
        """Start the worker process and instantiate the FMU in it.

        Raises:
            InputError: The FMU cannot be extracted or loaded, or the sandbox is not supported.
            ComponentError: The FMU returned no instance, or the worker process ended.
        """
        folder = self._file.acquire()
        self._temporary_folder = LockedFolder(WORKER_PREFIX)
        self._start_worker(folder, Path(self._temporary_folder.name))
        self._execute("instantiate")
        self._deadline = self.isolation.deadlines.initialization

    def _start_worker(self, folder: Path, temporary: Path) -> None:
        import_module(
            f"fmpy.fmi{self.description.major}"
        )  # imported before the fork, so that workers need not
        setup = self.isolation.worker_setup(folder, temporary, os.getpid())

        def serve(commands: int, answers: int) -> None:
            instance = self._instance_class(self._file.share(), self.name, self._settings)
            Worker(instance, self._shared_memory, setup).serve(commands, answers, temporary)

        self._process = WorkerProcess(self.name, self._shared_memory.journal, serve)

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Call `FmuInstance.enter_initialization_mode` in the worker process."""
        self._execute("enter_initialization_mode", start_time, stop_time)

    def exit_initialization_mode(self) -> None:
        """Call `FmuInstance.exit_initialization_mode` in the worker process."""
        self._execute("exit_initialization_mode")
        self._deadline = self.isolation.deadlines.step

    def terminate(self) -> None:
        """Call `FmuInstance.terminate` in the worker process, unless the FMU has returned fatal."""
        self._deadline = self.isolation.deadlines.end
        if not self._file.has_fatal_error:
            self._execute_or_warn("terminate")

    def free(self) -> None:
        """Call `FmuInstance.free` in the worker process, stop it and remove its temporary folder."""
        self._deadline = self.isolation.deadlines.end
        if self._process and not self._file.has_fatal_error:
            self._execute_or_warn("free")
        if self._process:
            self._stop_worker()
        if self._temporary_folder:
            self._temporary_folder.cleanup()
            self._temporary_folder = None
            self._file.release()

    # -- access outside the stepping loop
    # ---------------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        """Set a variable of the FMU in the worker process."""
        self._execute("set", name, value)

    def get(self, name: str) -> Any:
        """Return the value of a variable of the FMU in the worker process."""
        return self._execute(
            "get", name, convert=partial(variable_value, variable=self._variables_by_name[name])
        )

    def get_directional_derivative(
        self, outputs: Sequence[str], input_name: str
    ) -> Sequence[float] | None:
        """Return the directional derivatives of the FMU in the worker process."""
        if not self.description.directional_derivatives:
            return None
        convert = partial(derivative_values, count=len(outputs))
        found: Sequence[float] | None = self._execute(
            "get_directional_derivative", list(outputs), input_name, convert=convert
        )
        return found

    def get_state(self) -> Any:
        """Save the FMU state in the worker process and return its number."""
        return self._execute("get_state", convert=state_number)

    def set_state(self, state: Any) -> None:
        """Restore the FMU state with a number."""
        self._execute("set_state", state)

    def free_state(self, state: Any) -> None:
        """Free the FMU state with a number."""
        self._execute("free_state", state)

    # -- steps
    # ---------------------------------------------------------------------------------------------------------

    def set_inputs(self) -> None:
        """Copy the bound inputs to the worker process and set them in the FMU."""
        self._copy_inputs()
        self._execute("set_inputs", self._input_strings.tolist())

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        """Call `FmuInstance.do_step` in the worker process."""
        return self._execute("do_step", time, step_size, convert=step_result)

    def get_outputs(self) -> None:
        """Get the outputs of the FMU in the worker process and copy them to the bound arrays."""
        strings = self._execute("get_outputs", convert=self._convert_strings)
        self._copy_outputs()
        self._output_strings[:] = strings

    def prepare_step_calls(
        self, current_time: ctypes.c_double, step_size: float
    ) -> Sequence[PreparedCall]:
        """Prepare one call that makes a whole step (set inputs, doStep, get outputs) in the worker process."""
        self._call_names = self._execute("prepare_step", step_size, convert=call_names)
        step = self._step_with_strings if self._has_strings else self._step
        return [PreparedCall(step, (current_time,), "step in the worker process")]

    def _step(self, current_time: ctypes.c_double) -> int:
        self._current_time.value = current_time.value
        for target, source in self._input_buffers:
            target[:] = source
        self._command = "step"
        answer = self._request(STEP_COMMAND)
        result = None if answer == STEP_DONE else self._parse_answer(answer, step_result)
        for target, source in self._output_buffers:
            target[:] = source
        return OK if result is None else self._store_early_return(result)

    def _step_with_strings(self, current_time: ctypes.c_double) -> int:
        self._current_time.value = current_time.value
        self._copy_inputs()
        result, strings = self._execute(
            "step", self._input_strings.tolist(), convert=self._convert_step_with_strings
        )
        self._copy_outputs()
        self._output_strings[:] = strings
        return self._store_early_return(result) if result else OK

    def _convert_strings(self, value: Any) -> list[Any]:
        return string_values(value, len(self._output_strings))

    def _convert_step_with_strings(self, value: Any) -> tuple[StepResult | None, list[Any]]:
        result, strings = value
        return step_result(result), self._convert_strings(strings)

    def _store_early_return(self, result: StepResult) -> int:
        """Store the result of a step for `interpret_status`, which the executor calls after the status discard."""
        self._result = result
        return DISCARD

    def interpret_status(self, _function: str, _status: int) -> StepResult:
        """Return the result of the step that returned discard."""
        assert self._result is not None
        return self._result

    def _copy_inputs(self) -> None:
        for target, source in self._input_buffers:
            target[:] = source

    def _copy_outputs(self) -> None:
        for target, source in self._output_buffers:
            target[:] = source
