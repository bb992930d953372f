"""The PyBullet calls of a mission: recorded during a run, replayed without plant, controllers and
importer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from inspect import getmembers, isbuiltin
from time import process_time
from typing import Any, NamedTuple

import pytest

from cosim.engine.plan_run import simulate
from plant_src.physics.bullet import pybullet


class BulletCall(NamedTuple):
    """One call of PyBullet and its result."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    options: dict[str, Any]
    result: Any


@dataclass(frozen=True)
class BulletCalls:
    """All calls of a mission; calls `first` to `last` belong to the stepping loop, which has
    `steps` macro steps.
    """

    calls: Sequence[BulletCall]
    first: int
    last: int
    steps: int

    def replay(self) -> float:
        """Repeat all calls, check that the results are equal, and return the CPU time (us) of the
        loop per macro step.
        """
        begin, loop, end = (
            self.calls[: self.first],
            self.calls[self.first : self.last],
            self.calls[self.last :],
        )
        _execute(begin)
        start = process_time()
        results = _execute(loop)
        seconds = process_time() - start
        _execute(end)
        assert results == [call.result for call in loop]
        return seconds / self.steps * 1e6


def _execute(calls: Sequence[BulletCall]) -> list[Any]:
    return [function(*arguments, **options) for function, arguments, options, _ in calls]


def record_calls(load: Callable[[], Any]) -> BulletCalls:
    """Run the scenario that `load` prepares, and return its calls of PyBullet."""
    calls: list[BulletCall] = []
    marks: list[int] = []
    with pytest.MonkeyPatch.context() as patch:
        for name, function in getmembers(pybullet, isbuiltin):
            patch.setattr(pybullet, name, _recording_wrapper(function, calls))
        prepared = load()
        run = simulate(
            prepared.system, prepared.plan.settings, [lambda *_: marks.append(len(calls))]
        )
    if run.failure:
        raise run.failure
    return BulletCalls(calls, marks[0], marks[-1], run.macro_steps)


def _recording_wrapper(function: Callable[..., Any], calls: list[BulletCall]) -> Callable[..., Any]:
    def recorded(*arguments: Any, **options: Any) -> Any:
        result = function(*arguments, **options)
        calls.append(BulletCall(function, arguments, options, result))
        return result

    return recorded
