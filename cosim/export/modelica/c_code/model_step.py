"""The body of model_step: the events of a communication step, and the integration of continuous states between them.

`event` is the C statement that calls the function of that name at the time `now`.
"""

from __future__ import annotations


def sampled_step_body(clocks: int, event: str) -> list[str]:
    """A model without continuous states: an event at every tick; without a clock, one at the end of the step."""
    if clocks == 0 and "now" not in event:
        return _with_failure_check(["(void)time;", "(void)step_size;", event])
    if clocks == 0:
        return _with_failure_check(["const double now = time + step_size;", event])
    return _with_failure_check(_single_clock_loop(event) if clocks == 1 else _multi_clock_loop(clocks, [event]))


def continuous_step_body(clocks: int, event: str) -> list[str]:
    """A model with continuous states: they advance to each tick, and to the end of the step, where there is one more event."""
    if clocks == 0:
        return _with_failure_check(["const double now = time + step_size;", "advance(m, time, now);", event])
    idle = [f"const bool due[{clocks}] = {{false}};"] if "due" in event else []
    last = ["const double now = time + step_size;", *idle, "advance(m, reached, now);", event]
    return _with_failure_check(
        ["double reached = time;", *_multi_clock_loop(clocks, ["reached = advance(m, reached, now);", event]), *last]
    )


def _with_failure_check(lines: list[str]) -> list[str]:
    return ["m->failure = 0;", *lines, "return REASONS[m->failure];"]


def _single_clock_loop(event: str) -> list[str]:
    condition = "(now = next_tick(m->clock)) < time + step_size - TOLERANCE * m->clock->period"
    return ["double now;", f"while (m->failure == 0 && {condition}) {{", f"    {event}", "    m->clock->ticks++;", "}"]


def _multi_clock_loop(clocks: int, tick: list[str]) -> list[str]:
    lines = [
        f"bool due[{clocks}];",
        f"const double now = next_event(m->clock, {clocks}, due);",
        f"if (m->failure != 0 || now >= time + step_size - TOLERANCE * shortest_period(m->clock, {clocks})) break;",
        *tick,
        f"for (int k = 0; k < {clocks}; k++) m->clock[k].ticks += due[k];",
    ]
    return ["for (;;) {", *("    " + line for line in lines), "}"]
