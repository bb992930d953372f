"""The steps of a plan as numbered calls."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from ..core.component import PreparedCall
from .iteration import FixedPointIteration, IterationPhase
from .plan import Loop, Phase, Plan, ScheduledStep, Step, all_transfers
from .step_runner import StepRunner
from .transfer_plan import DelayLine, Transfer, TransferCall, compile_transfer


class Schedule:
    """Scheduled steps of all phases; their calls are numbered consecutively from 0.

    Attributes:
        phases: the steps of each phase of the plan, in order.
        shorter_steps: sizes of the steps (s) that differ from those of the plan, by component.
    """

    def __init__(self, plan: Plan, runner: StepRunner, delay_lines: Mapping[Transfer, DelayLine]):
        self._plan, self._runner, self._delay_lines = plan, runner, delay_lines
        self._steps: list[ScheduledStep] = []
        self.phases: list[list[ScheduledStep]] = []
        self.shorter_steps: Mapping[str, float] = {}

    def prepare(self, shorter_steps: Mapping[str, float] = MappingProxyType({})) -> None:
        """Schedule all phases, again for other sizes of steps.

        The components must be in step mode and prepare their calls.
        """
        self.shorter_steps, self._steps = shorter_steps, []
        self.phases = [self._schedule_phase(phase) for phase in self._plan.phases]

    def add_step(self, step: Step, calls: Sequence[PreparedCall]) -> ScheduledStep:
        """Append a step; its calls are numbered after those of all earlier steps."""
        first_call = self._steps[-1].first_call + len(self._steps[-1].calls) if self._steps else 0
        self._steps.append(ScheduledStep(step, calls, first_call))
        return self._steps[-1]

    def find_call(self, number: int) -> tuple[ScheduledStep, PreparedCall]:
        """Return the call with this number and the step that it belongs to."""
        step = next(step for step in reversed(self._steps) if step.first_call <= number)
        return step, step.calls[number - step.first_call]

    @property
    def call_names(self) -> list[tuple[str, str]]:
        """(component, function) of every call, by number."""
        return [(step.step.name, call.name) for step in self._steps for call in step.calls]

    def _schedule_phase(self, phase: Phase, is_outermost: bool = True) -> list[ScheduledStep]:
        sized = [
            replace(step, step_size=self.shorter_steps.get(step.name, step.step_size))
            for step in phase.steps
        ]
        steps = []
        for step in sized:
            calls = step.component.prepare_step_calls(self._runner.current_time, step.step_size)
            steps.append(
                self.add_step(
                    step,
                    calls or [PreparedCall(self._runner.run_python_component, (step,), "do_step")],
                )
            )
        return [*steps, self._schedule_loop(phase.loop, is_outermost)] if phase.loop else steps

    def _schedule_loop(self, loop: Loop, is_outermost: bool) -> ScheduledStep:
        """Schedule all iterations of a loop as one call.

        The outermost loop stores the values at the start of the macro step for the linear transfers
        of all inner loops.
        """
        phases = [self._iteration_phase(phase) for phase in loop.phases]
        linear = [t for t in all_transfers(loop.all_phases) if t.slope_indices is not None]
        prepare = [self._delay_lines[transfer].fill for transfer in linear] if is_outermost else []
        iteration = FixedPointIteration(
            loop, self._plan.outputs, phases, prepare, self._runner.run_step
        )
        step = Step(loop.name, next(iter(loop.components.values())), 1, 0.0)
        return self.add_step(
            step, [PreparedCall(self._runner.run_iteration, (iteration,), "iterated step")]
        )

    def _iteration_phase(self, phase: Phase) -> IterationPhase:
        linear = [transfer for transfer in phase.transfers if transfer.slope_indices is not None]
        delayed = [
            transfer
            for transfer in phase.transfers
            if transfer.delay and transfer.slope_indices is None
        ]
        every_iteration: list[TransferCall] = [
            compile_transfer(transfer) for transfer in phase.transfers if not transfer.delay
        ]
        every_iteration += [self._delay_lines[transfer].deliver_line for transfer in linear]
        first_iteration = [self._delay_lines[transfer].apply for transfer in delayed]
        return IterationPhase(every_iteration, first_iteration, self._schedule_phase(phase, False))
