"""Code generation of model_step: events in a communication step, and integration between them."""

from ..causality.hybrid import (
    MAX_EVENTS,
)


def sampled_step_body(clocks: int, event: str) -> list[str]:
    """Generate the body of model_step for a model without continuous states.

    There is an event at every tick, or at the end of the step if the model has no clock.

    Args:
        clocks: The number of clocks.
        event: The C statement that evaluates an event at the time `now`.

    Returns:
        The lines of C code.
    """
    if clocks == 0 and "now" not in event:
        return _with_failure_check(["(void)time;", "(void)step_size;", event])
    if clocks == 0:
        return _with_failure_check(["const double now = time + step_size;", event])
    return _with_failure_check(
        _single_clock_loop(event) if clocks == 1 else _multi_clock_loop(clocks, [event])
    )


def continuous_step_body(clocks: int, event: str) -> list[str]:
    """Generate the body of model_step for a model with continuous states.

    The states are integrated to each tick and to the end of the step. There is an event at every
    tick and at the end.

    Args:
        clocks: The number of clocks.
        event: The C statement that evaluates an event at the time `now`.

    Returns:
        The lines of C code.
    """
    if clocks == 0:
        return _with_failure_check(
            ["const double now = time + step_size;", "advance(m, time, now);", event]
        )
    no_tick = [f"const bool due[{clocks}] = {{false}};"] if "due" in event else []
    final_event = [
        "const double now = time + step_size;",
        *no_tick,
        "advance(m, reached, now);",
        event,
    ]
    return _with_failure_check(
        [
            "double reached = time;",
            *_multi_clock_loop(clocks, ["reached = advance(m, reached, now);", event]),
            *final_event,
        ]
    )


def _with_failure_check(lines: list[str]) -> list[str]:
    return ["m->failure = 0;", *lines, "return REASONS[m->failure];"]


def _single_clock_loop(event: str) -> list[str]:
    condition = "(now = next_tick(m->clock)) < time + step_size - TOLERANCE * m->clock->period"
    return [
        "double now;",
        f"while (m->failure == 0 && {condition}) {{",
        f"    {event}",
        "    m->clock->ticks++;",
        "}",
    ]


def _multi_clock_loop(clocks: int, tick: list[str]) -> list[str]:
    lines = [
        f"bool due[{clocks}];",
        f"const double now = next_event(m->clock, {clocks}, due);",
        (
            "if (m->failure != 0 || now >= time + step_size - TOLERANCE * "
            f"shortest_period(m->clock, {clocks})) break;"
        ),
        *tick,
        f"for (int k = 0; k < {clocks}; k++) m->clock[k].ticks += due[k];",
    ]
    return ["for (;;) {", *("    " + line for line in lines), "}"]


def hybrid_step_body(clocks: int, continuous: bool, inputs_first: bool) -> list[str]:
    """Generate the body of model_step.

    `inputs_first`: changes of inputs are an event before a tick at the same time.
    """
    lines = ["const double end = time + step_size;", "m->failure = 0;"]
    tick = ["const bool tick = false;", *["const double target = end;"] * continuous]
    if clocks:
        tick = [
            f"bool due[{clocks}];",
            f"const double next = next_event(m->clock, {clocks}, due);",
            f"const bool tick = next < end - TOLERANCE * shortest_period(m->clock, {clocks});",
            "const double target = tick ? next : end;",
        ]
    loop, at_start = [*tick], "count == 0"
    if clocks:
        loop += [
            (
                "const bool at_start = tick && next <= time + TOLERANCE * "
                f"shortest_period(m->clock, {clocks});"
            )
        ] * (continuous or not inputs_first)
        at_start += " && !at_start" * (not inputs_first)
    input_event = f"if ({at_start} && (m->changed || inputs_changed(m)))"
    loop += (
        [f"{input_event} {{", "    event(m, time, NO_TICK);", "    m->event_time = -INFINITY;", "}"]
        if inputs_first
        else [f"{input_event} event(m, time, NO_TICK);"]
    )
    if continuous:
        lines.append("double reached = time;")
        loop += [
            (
                f"const bool crossing = {'!at_start && ' * bool(clocks)}advance(m, reached, "
                "target, &reached);"
            ),
            "if (m->failure != 0) break;",
            "if (crossing) {",
            "    double z[RELATIONS];",
            f"    if (count == {MAX_EVENTS}) fail(m, CHATTERING[crossed(m, reached, z)]);",
            "    else event(m, reached, NO_TICK);",
            "    continue;",
            "}",
        ]
    loop += ["if (!tick) break;"]
    if clocks:
        loop += [
            "event(m, target, due);",
            f"for (int k = 0; k < {clocks}; k++) m->clock[k].ticks += due[k];",
        ]
    lines += [
        "for (int count = 0; m->failure == 0; count++) {",
        *("    " + line for line in loop),
        "}",
    ]
    return [*lines, "if (m->failure == 0) event(m, end, NO_TICK);", "return REASONS[m->failure];"]
