"""Steers a run between its macro steps: commands come through a pipe from the process that supervises it.

A command is a JSON object: {"command": "pause"}, "resume", "step" (one macro step, then pause), {"command": "speed", "factor"}
(simulated seconds per second, null for as fast as possible) or {"command": "set", "name", "value"}. Each is answered by an
object with "time" (s), "paused" and "speed", and "error" when it was refused.
"""

from __future__ import annotations

import json
import select
from collections.abc import Callable, Mapping
from fractions import Fraction
from multiprocessing.connection import Connection
from typing import Any

from ...core.component import Variable
from ...core.errors import ComponentError, InputError, did_you_mean
from ...core.system import System
from ...core.time_grid import TimeGrid
from ...engine.pacer import Pacer
from ...engine.run_checks import settable_variables
from ...process.journal import calling_component, current_journal, suspending_deadline
from ...process.run_files.folder import read_metadata, write_metadata
from ...scenario.name_resolution import check_assignment

#: smallest and largest factor of speed that a command may ask for
MIN_SPEED_FACTOR, MAX_SPEED_FACTOR = 0.01, 1000.0


class LiveControl:
    """A `cosim.engine.run_loop.Control` that obeys what comes through `link`; `speed` is where it begins.

    `about` is told to the other side before anything moves, with "adjustable": what can be set, and its values.
    """

    def __init__(self, connection: Connection, system: System, grid: TimeGrid, speed: float | None, run_info: Mapping[str, Any]):
        self._connection, self._grid, self._run_info = connection, grid, run_info
        self._components = system.components
        self._adjustable = {f"{name}.{variable.name}": (name, variable) for name, variable in settable_variables(system)}
        self._poller = select.poll()
        self._poller.register(connection.fileno(), select.POLLIN)
        self._speed, self._paused, self._steps = speed, False, 0
        self._pacer: Pacer | None = None
        self._commands: Mapping[str, Callable[[int, Mapping[str, Any]], None]] = {
            "pause": self._pause,
            "resume": self._resume,
            "step": self._step,
            "speed": self._set_speed,
            "set": self._set,
        }
        self._events: list[dict[str, Any]] = []

    def __call__(self, n: int) -> None:
        """Before the step that starts at communication point n: keep pace, and obey what has come."""
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
        """The run is over, nobody listens any more; returns what was set, as a scenario writes its events."""
        self._send({"ended": True})
        return self._events

    def _handshake(self) -> None:
        """Wait until the other side follows the rows: those of a short run would be gone before."""
        values = [self._describe_variable(full_name, *place) for full_name, place in self._adjustable.items()]
        with suspending_deadline():
            self._send({"about": {**self._run_info, "adjustable": values}, **self._state(0)})
            self._connection.recv_bytes()
        self._restart_pacer(0)

    def _describe_variable(self, full_name: str, name: str, variable: Variable) -> dict[str, Any]:
        return {
            "name": full_name,
            "type": variable.type,
            "value": self._components[name].get(variable.name),
            "unit": variable.unit.name if variable.unit else "",
            "minimum": variable.minimum,
            "maximum": variable.maximum,
            "description": variable.description,
        }

    def _send(self, message: Mapping[str, Any]) -> None:
        self._connection.send_bytes(json.dumps(message, default=str).encode())

    def _state(self, n: int) -> dict[str, Any]:
        return {"time": self._grid.time_at(n), "paused": self._paused, "speed": self._speed}

    def _handle_command(self, n: int) -> None:
        message = json.loads(self._connection.recv_bytes())
        answer: dict[str, Any] = {"id": message.get("id")}
        try:
            self._find_command(message)(n, message)
        except InputError as error:
            answer["error"] = str(error)
        except ComponentError as error:
            self._send({**answer, "error": str(error), **self._state(n)})
            raise
        self._send({**answer, **self._state(n)})

    def _find_command(self, message: Mapping[str, Any]) -> Callable[[int, Mapping[str, Any]], None]:
        name = str(message.get("command"))
        if name not in self._commands:
            raise InputError(f'unknown command "{name}"{did_you_mean(name, self._commands)}')
        return self._commands[name]

    def _pause(self, n: int, message: Mapping[str, Any]) -> None:
        self._paused, self._steps = True, 0

    def _resume(self, n: int, message: Mapping[str, Any]) -> None:
        self._paused = False
        self._restart_pacer(n)

    def _step(self, n: int, message: Mapping[str, Any]) -> None:
        self._paused = True
        self._steps += 1

    def _set_speed(self, n: int, message: Mapping[str, Any]) -> None:
        factor = message.get("factor")
        is_number = isinstance(factor, int | float) and not isinstance(factor, bool)
        if factor is not None and not (is_number and MIN_SPEED_FACTOR <= factor <= MAX_SPEED_FACTOR):
            raise InputError(
                f"the speed must lie in {MIN_SPEED_FACTOR:g} ... {MAX_SPEED_FACTOR:g}, or be null, found {json.dumps(factor)}"
            )
        self._speed = factor
        self._restart_pacer(n)

    def _restart_pacer(self, n: int) -> None:
        """From now on the clock counts from communication point n."""
        self._pacer = Pacer(self._grid, self._speed, "warn") if self._speed else None
        if self._pacer:
            self._pacer.start(n)

    def _set(self, n: int, message: Mapping[str, Any]) -> None:
        full_name, value = str(message.get("name")), message.get("value")
        if full_name not in self._adjustable:
            near = did_you_mean(full_name, self._adjustable)
            raise InputError(f'"{full_name}" is no tunable parameter and no unconnected input{near}')
        name, variable = self._adjustable[full_name]
        try:
            for own, checked in check_assignment(name, {variable.name: variable}, variable.name, value).items():
                with calling_component(name, "set", "step", self._grid.time_at(n)):
                    self._components[name].set(own, checked)
        except (ValueError, TypeError, OverflowError) as error:
            raise InputError(str(error)) from error
        self._record_event(n, full_name, value)

    def _record_event(self, n: int, name: str, value: Any) -> None:
        """Kept beside the rows too, so that it is known of a run that comes to a bad end."""
        self._events.append({"time": self._event_time(n), "set": {name: value}})
        journal = current_journal()
        if journal and journal.folder:
            write_metadata({**read_metadata(journal.folder), "live_events": self._events})

    def _event_time(self, n: int) -> float | str:
        """Time of communication point n as a scenario has to write it to mean exactly that."""
        seconds, exact = self._grid.time_at(n), self._grid.start + n * self._grid.step
        return seconds if Fraction(repr(seconds)) == exact else str(exact)
