from collections.abc import Callable
from typing import Any, Final

INTERFACE: Final[int]
#: codes that `on_status` receives beside FMI statuses; they exceed 32 bits
FLOAT_MODE_CHANGED: Final[int]
FLOAT_TRAPS_ENABLED: Final[int]
NOT_FINITE: Final[int]
CONDITIONS_CHANGED: Final[int]
#: answers of `on_status`: continue, or end the simulation with this macro step or with the one
#: before
CONTINUE: Final[int]
END_AFTER_STEP: Final[int]
END_BEFORE_STEP: Final[int]
#: indices into the marker
MARKER_CALL: Final[int]
MARKER_STEPS: Final[int]
MARKER_ROWS: Final[int]
#: number of macro steps in which the durations of doStep calls are measured
MEASURED_STEPS: Final[int]

class Program:
    def __init__(
        self, current_time: int, marker: int, on_status: Callable[[int, int], int], /
    ) -> None: ...
    def add_transfer(
        self,
        target: int,
        target_kind: str,
        target_indices: int,
        source: int,
        source_kind: str,
        source_indices: int,
        count: int,
        factor: int,
        offset: int,
        ring: int,
        delay: int,
        terms: int,
        slope_indices: int,
        interpolates: bool,
        step_size: float,
        /,
    ) -> None: ...
    def add_block_copy(self, target: int, source: int, size: int, /) -> None: ...
    def begin_step(self, divisor: int, /) -> None: ...
    def end_step(self) -> None: ...
    def add_get_set(
        self,
        call_number: int,
        fmi_version: int,
        function: int,
        instance: int,
        references: int,
        reference_count: int,
        values: int,
        value_count: int,
        /,
    ) -> None: ...
    def add_do_step2(
        self,
        call_number: int,
        function: int,
        instance: int,
        step_size: float,
        flags: int,
        last_successful_time: int,
        /,
    ) -> None: ...
    def add_do_step3(
        self,
        call_number: int,
        function: int,
        instance: int,
        step_size: float,
        flags: int,
        last_successful_time: int,
        /,
    ) -> None: ...
    def add_flag_check(
        self,
        call_number: int,
        function: int,
        instance: int,
        step_size: float,
        flags: int,
        last_successful_time: int,
        /,
    ) -> None: ...
    def add_python_call(
        self, call_number: int, callable: Callable[..., int], arguments: tuple[Any, ...], /
    ) -> None: ...
    def set_monitored_floats(
        self, doubles: int, double_count: int, singles: int, single_count: int, /
    ) -> None: ...
    def set_recording(
        self,
        record_every: int,
        row_size: int,
        buffer: int,
        buffer_size: int,
        record: Callable[[float], None] | None,
        /,
    ) -> None: ...
    def add_row_part(
        self, source: int, indices: int, count: int, item_size: int, position: int, /
    ) -> None: ...
    def begin_condition(self) -> None: ...
    def add_instruction(
        self, kind: int, value: float, source: int, source_kind: str, skip: int, /
    ) -> None: ...
    def set_wake_point(self, point: int, /) -> None: ...
    def set_rows(self, address: int, count: int, /) -> None: ...
    def step_durations(self) -> list[tuple[int, int]]: ...
    def run(
        self,
        first: int,
        count: int,
        time: float,
        origin: float,
        stride: float,
        denominator: float,
        /,
    ) -> None: ...
