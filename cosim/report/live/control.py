"""Control of a live run in the simulation process.

Commands that are carried out between macro steps.

A command is a JSON object: {"command": "pause"}, "resume", "step" (one macro step, then pause),
{"command": "speed", "factor"} (simulated seconds per second, null for as fast as possible) or
{"command": "set", "name", "value"}. The reply to each command is an object with "time" (s),
"paused" and "speed", and with "error" if the command was refused.
"""

import json
import select
from collections.abc import Mapping
from fractions import Fraction
from multiprocessing.connection import Connection
from typing import Any

from ...core.errors import ComponentError, InputError, did_you_mean
from ...core.system import System
from ...core.time_grid import TimeGrid
from ...engine.pacer import Pacer
from ...engine.run_checks import settable_variables
from ...process.journal import calling_component, current_journal, suspending_deadline
from ...process.run_files import read_metadata, write_metadata
from ...scenario.name_resolution import check_assignment

#: smallest and largest factor of the command "speed"
MIN_SPEED_FACTOR, MAX_SPEED_FACTOR = 0.01, 1000.0

COMMANDS = ("pause", "resume", "step", "speed", "set")


class LiveControl:
    """Step hook (`cosim.engine.plan_run.StepHook`) that carries out commands.

    Used in the main thread of the simulation process.

    Args:
        connection: The pipe to the supervising process.
        system: The system that is simulated.
        grid: The communication points.
        speed: Simulated seconds per second at the start; None for as fast as possible.
        run_info: Description of the run, sent before the first step together with the variables
            that can be set.
    """

    def __init__(
        self,
        connection: Connection,
        system: System,
        grid: TimeGrid,
        speed: float | None,
        run_info: Mapping[str, Any],
    ) -> None:
        self._connection, self._grid, self._run_info = connection, grid, run_info
        self._components = system.components
        self._adjustable = {
            f"{name}.{variable.name}": (name, variable)
            for name, variable in settable_variables(system)
        }
        self._poller = select.poll()
        self._poller.register(connection.fileno(), select.POLLIN)
        self._speed, self._paused, self._steps = speed, False, 0
        self._pacer: Pacer | None = None
        self._events: list[dict[str, Any]] = []

    def __call__(self, n: int) -> None:
        """Wait for real time and carry out commands before the step from communication point n."""
        if n == 0:
            self._handshake()
        if self._pacer and not self._paused:
            with suspending_deadline():
                self._pacer.wait(n)
        while self._poller.poll(0):
            self._handle_command(n)
        while self._paused and not self._steps:
            with suspending_deadline():
                self._poller.poll()
            self._handle_command(n)
        self._steps = max(0, self._steps - 1)

    def finish(self) -> list[dict[str, Any]]:
        """Report the end of the run and return the values that were set as events of a scenario."""
        self._send({"ended": True})
        return self._events

    def _handshake(self) -> None:
        """Describe the run and wait until the supervising process has opened its rows.

        A short run soon removes them.
        """
        adjustable = []
        for full_name, (component, variable) in self._adjustable.items():
            described = {
                "name": full_name,
                "value": self._components[component].get(variable.name),
                "unit": variable.unit.name if variable.unit else "",
            }
            for key in ("type", "minimum", "maximum", "description"):
                described[key] = getattr(variable, key)
            adjustable.append(described)
        with suspending_deadline():
            self._send({"about": {**self._run_info, "adjustable": adjustable}, **self._state(0)})
            self._connection.recv_bytes()
        self._restart_pacer(0)

    def _send(self, message: Mapping[str, Any]) -> None:
        self._connection.send_bytes(json.dumps(message, default=str).encode())

    def _state(self, n: int) -> dict[str, Any]:
        return {"time": self._grid.time_at(n), "paused": self._paused, "speed": self._speed}

    def _handle_command(self, n: int) -> None:
        message = json.loads(self._connection.recv_bytes())
        reply: dict[str, Any] = {"id": message.get("id")}
        try:
            self._execute(n, message)
        except InputError as error:
            reply["error"] = str(error)
        except ComponentError as error:
            self._send({**reply, "error": str(error), **self._state(n)})
            raise
        self._send({**reply, **self._state(n)})

    def _execute(self, n: int, message: Mapping[str, Any]) -> None:
        """Carry out a command before the step that starts at communication point n."""
        match str(message.get("command")):
            case "pause":
                self._paused, self._steps = True, 0
            case "resume":
                self._paused = False
                self._restart_pacer(n)
            case "step":
                self._paused = True
                self._steps += 1
            case "speed":
                self._set_speed(n, message.get("factor"))
            case "set":
                self._set(n, str(message.get("name")), message.get("value"))
            case name:
                raise InputError(f'unknown command "{name}"{did_you_mean(name, COMMANDS)}')

    def _set_speed(self, n: int, factor: Any) -> None:
        is_number = isinstance(factor, int | float) and not isinstance(factor, bool)
        if factor is not None and not (
            is_number and MIN_SPEED_FACTOR <= factor <= MAX_SPEED_FACTOR
        ):
            raise InputError(
                f"the speed must lie in {MIN_SPEED_FACTOR:g} ... {MAX_SPEED_FACTOR:g}, or be null; "
                f"found {json.dumps(factor)}"
            )
        self._speed = factor
        self._restart_pacer(n)

    def _restart_pacer(self, n: int) -> None:
        """Measure real time from communication point n on."""
        self._pacer = Pacer(self._grid, self._speed, "warn") if self._speed else None
        if self._pacer:
            self._pacer.start(n)

    def _set(self, n: int, full_name: str, value: Any) -> None:
        if full_name not in self._adjustable:
            hint = did_you_mean(full_name, self._adjustable)
            raise InputError(
                f'"{full_name}" is neither a tunable parameter nor an unconnected input{hint}'
            )
        name, variable = self._adjustable[full_name]
        try:
            for variable_name, checked in check_assignment(
                name, {variable.name: variable}, variable.name, value
            ).items():
                with calling_component(name, "set", "step", self._grid.time_at(n)):
                    self._components[name].set(variable_name, checked)
        except (ValueError, TypeError, OverflowError) as error:
            raise InputError(str(error)) from error
        # the event is also written to the files of the run, so that it survives a crash
        self._events.append({"time": self._event_time(n), "set": {full_name: value}})
        journal = current_journal()
        if journal and journal.folder:
            write_metadata(
                journal.folder, {**read_metadata(journal.folder), "live_events": self._events}
            )

    def _event_time(self, n: int) -> float | str:
        """Return the time of communication point n in a form that is read without rounding."""
        seconds, exact = self._grid.time_at(n), self._grid.start + n * self._grid.step
        return seconds if Fraction(repr(seconds)) == exact else str(exact)
