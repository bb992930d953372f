"""Comparison with a reference: failing signals, reasons, order."""

import numpy as np
import pytest

from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.results import Result
from cosim.results.comparison import compare, needed_share
from cosim.results.tolerance_tube import Tolerance

TIME = np.arange(101) / 10
EXACT = {"*": Tolerance()}


def recorded(time=TIME, units=None, **columns):
    columns = {name.replace("__", "."): np.asarray(values) for name, values in columns.items()}
    return Result(
        Recording(
            np.asarray(time, dtype=float), columns, {**dict.fromkeys(columns, ""), **(units or {})}
        )
    )


REFERENCE = recorded(a__x=np.sin(TIME), a__y=TIME, b__x=TIME > 5)


def changed(**columns):
    return recorded(
        **{**{name.replace(".", "__"): REFERENCE[name] for name in REFERENCE}, **columns}
    )


def failures(result, tolerances=EXACT, reference=REFERENCE):
    return [str(verdict) for verdict in compare(result, reference, tolerances).failures]


def test_a_run_is_equal_to_itself():
    comparison = compare(REFERENCE, REFERENCE, EXACT)
    assert comparison.passed
    assert str(comparison) == "3 signals compared, none leaves its tube"


def test_message_names_first_signal_time_and_distance():
    late, early = (
        np.where(TIME >= 7, 0.5, 0),
        np.where(TIME >= 3, 0.25, 0) + np.where(TIME == 4, 0.5, 0),
    )
    result = recorded(units={"a.y": "m"}, a__x=-late, a__y=TIME + early)
    reference = recorded(a__x=np.zeros(101), a__y=TIME)
    first = (
        "t = 3 s: 3.25 m is 0.05 m above its limit 3.2 m; at most 0.55 m outside, at t = 4 s; 71 "
        "of 101 points outside"
    )
    second = (
        "t = 7 s: -0.5 is 0.3 below its limit -0.2; at most 0.3 outside, at t = 7 s; 31 of 101 "
        "points outside"
    )
    assert str(compare(result, reference, {"*": Tolerance(absolute=0.2)})).splitlines() == [
        "2 of 2 signals failed",
        f"a.y leaves its tube at {first}",
        f"a.x leaves its tube at {second}",
    ]


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
@pytest.mark.parametrize("name", Tolerance._fields)
def test_an_invalid_tolerance_is_refused(name, value):
    """Infinity and NaN would accept every signal."""
    tolerances = {"*": Tolerance(), "a.*": Tolerance(**{name: value})}
    message = f'tolerance of "a.*": "{name}" is {value}, expected a finite number of at least 0'
    with pytest.raises(InputError) as raised:
        compare(REFERENCE, REFERENCE, tolerances)
    assert str(raised.value) == message


def test_all_invalid_tolerances_are_named():
    tolerances = {"a.x": Tolerance(absolute=-1, time=np.nan), "b.*": Tolerance(relative=-2)}
    with pytest.raises(InputError) as raised:
        compare(REFERENCE, REFERENCE, tolerances)
    assert [problem.message.split(",")[0] for problem in raised.value.problems] == [
        'tolerance of "a.x": "absolute" is -1',
        'tolerance of "a.x": "time" is nan',
        'tolerance of "b.*": "relative" is -2',
    ]


def test_a_missing_signal_fails():
    less = recorded(a__x=np.sin(TIME), b__x=TIME > 5)
    assert failures(less) == ['a.y is missing; did you mean "a.x"?']


def test_additional_signals_of_the_result_are_ignored():
    assert compare(changed(c=TIME), REFERENCE, EXACT).passed


@pytest.mark.parametrize(("start", "stop"), [(1, 101), (0, 100)])
def test_a_short_result_fails(start, stop):
    short = recorded(TIME[start:stop], a__x=np.sin(TIME[start:stop]))
    (failure,) = failures(short, {"a.x": Tolerance(9, 9, 9)})
    assert (
        failure
        == f"a.x covers {TIME[start]:g} s to {TIME[stop - 1]:g} s only, the reference 0 s to 10 s"
    )


def test_a_longer_result_is_compared_where_the_reference_is():
    longer = np.arange(-50, 151) / 10
    result = recorded(longer, a__y=np.clip(longer, 0, 10) + (longer > 12))
    assert compare(result, REFERENCE, {"a.y": Tolerance()}).passed


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_non_finite_values_fail_in_any_tube(value):
    spoilt = np.where(TIME == 4.2, value, TIME)
    wide = {"*": Tolerance(1e300, 1, 100)}
    assert failures(changed(a__y=spoilt), wide) == [f"a.y is {value} at t = 4.2 s in the result"]
    assert failures(REFERENCE, wide, changed(a__y=spoilt)) == [
        f"a.y is {value} at t = 4.2 s in the reference"
    ]


def test_non_finite_values_before_the_reference_are_ignored():
    longer = np.arange(-50, 101) / 10
    assert compare(
        recorded(longer, a__y=np.where(longer < 0, np.nan, longer)),
        REFERENCE,
        {"a.y": Tolerance(1e-9)},
    ).passed


def test_non_finite_interpolated_values_fail():
    """The reference begins between a row with NaN and a finite one."""
    result = recorded([-0.05, 0.05, 10], a__y=[np.nan, 0.05, 10])
    assert failures(result, {"a.y": Tolerance(9, 9, 9)}) == ["a.y is nan at t = 0 s in the result"]


def test_the_last_pattern_counts():
    result = changed(a__x=np.sin(TIME) + 0.1, a__y=TIME + 0.1)
    general_first = {"*": Tolerance(), "a.*": Tolerance(0.2), "*.y": Tolerance(0.05)}
    assert [verdict.signal for verdict in compare(result, REFERENCE, general_first).failures] == [
        "a.y"
    ]


def test_signals_without_a_pattern_are_not_compared():
    assert compare(changed(a__x=np.cos(TIME)), REFERENCE, {"*.y": Tolerance()}).passed


def test_a_pattern_without_a_signal_fails():
    assert failures(REFERENCE, {"a.x": Tolerance(), "a.z": Tolerance()}) == [
        '"a.z" matches no signal of the reference; did you mean "a.y"?'
    ]
    assert failures(REFERENCE, {"a.[xy]": Tolerance()}) == [
        '"a.[xy]" matches no signal of the reference; only "*" is a wildcard'
    ]


def test_time_tolerance_permits_a_late_switch():
    late = changed(b__x=TIME > 5.3)
    assert compare(late, REFERENCE, {"*": Tolerance(time=0.3)}).passed
    assert failures(late, {"*": Tolerance(time=0.1)})[0].startswith(
        "b.x is 0 at t = 5.2 s, expected 1; "
    )


@pytest.mark.parametrize(
    ("offset", "share"), [(0.0, 0.0), (0.01, 1 / 16), (0.052, 3 / 8), (0.2, 1.0)]
)
def test_the_needed_share_of_the_tolerances_is_known_to_a_sixteenth(offset, share):
    assert (
        needed_share(changed(a__y=TIME + offset), REFERENCE, {"*": Tolerance(absolute=0.16)})
        == share
    )


def test_a_coarse_result_is_compared_at_rows_of_the_reference():
    peak = recorded(x=np.where(TIME == 5.5, 1.0, 0.0))
    coarse = recorded(TIME[::10], x=np.zeros(11))
    (failure,) = failures(coarse, {"x": Tolerance(0.5)}, peak)
    assert failure == "x is 0 at t = 5.5 s, expected 1; 1 of 101 points outside"


def test_integers_with_a_unit_or_a_wide_tolerance_have_a_tube():
    """A count that differs by 3 is outside a tolerance of 2; metres that happen to be integers are
    no discrete values.
    """
    for unit, tolerance in (("m", 0.0), ("", 2.0)):
        units = {"x": unit}
        verdicts = failures(
            recorded(units=units, x=np.full(101, 3)),
            {"x": Tolerance(tolerance)},
            recorded(x=np.zeros(101)),
        )
        assert verdicts[0].startswith("x leaves its tube at t = 0 s: 3")


def test_a_short_summary_lists_the_ten_earliest_failures():
    signals = {f"s{i}": i / 10 <= TIME for i in range(12)}
    comparison = compare(
        recorded(**{name: ~values for name, values in signals.items()}), recorded(**signals), EXACT
    )
    first, *lines, last = comparison.shortened().splitlines()
    assert (first, len(lines), last) == ("12 of 12 signals failed", 10, "... and 2 more")
    assert len(str(comparison).splitlines()) == 13


def test_strings_must_be_equal():
    phases = np.array(["climb"] * 50 + ["land"] * 51, dtype=object)
    reference = recorded(phase=phases)
    assert compare(recorded(phase=phases), reference, EXACT).passed
    late = np.roll(phases, 1)
    late[0] = "climb"
    assert failures(recorded(phase=late), EXACT, reference) == [
        'phase is "climb" at t = 5 s, expected "land"'
    ]
    assert failures(recorded(phase=TIME), EXACT, reference) == [
        "phase holds text in the reference, and numbers in the other"
    ]


def test_strings_are_compared_between_rows_of_the_reference():
    phases = np.array(["climb"] * 50 + ["hover"] * 3 + ["climb"] * 48, dtype=object)
    ends = recorded(TIME[[0, -1]], phase=np.array(["climb", "climb"], dtype=object))
    assert failures(recorded(phase=phases), EXACT, ends) == [
        'phase is "hover" at t = 5 s, expected "climb"'
    ]
    assert failures(ends, EXACT, recorded(phase=phases)) == [
        'phase is "climb" at t = 5 s, expected "hover"'
    ]


def test_an_empty_comparison_fails():
    empty = recorded([], a__x=[], a__y=[], b__x=[])
    assert failures(empty) == ["the result has no rows"]
    assert failures(REFERENCE, EXACT, empty) == ["the reference has no rows"]
    assert not compare(REFERENCE, recorded(), EXACT).passed
    assert str(compare(REFERENCE, REFERENCE, {})) == "nothing was compared"
    assert not compare(REFERENCE, REFERENCE, {}).passed


def test_worst_signals_are_sorted_by_relative_excess():
    result = changed(a__x=np.sin(TIME) + 0.3, a__y=TIME + 0.5)
    comparison = compare(
        result, REFERENCE, {"a.x": Tolerance(0.1), "a.y": Tolerance(0.4), "b.x": Tolerance(1)}
    )
    assert [verdict.signal for verdict in comparison.worst] == ["a.x", "a.y", "b.x"]
    assert [verdict.excess for verdict in comparison.worst] == pytest.approx([2, 0.25, -1])


def principal(angles):
    return np.angle(np.exp(1j * angles))


WEST = np.pi + 0.1 * np.sin(3 * TIME)


@pytest.mark.parametrize(("unit", "scale"), [("rad", 1.0), ("deg", 180 / np.pi)])
def test_an_angle_may_cross_half_a_turn_at_another_time_than_its_reference(unit, scale):
    reference = recorded(yaw=scale * principal(WEST))
    result = recorded(units={"yaw": unit}, yaw=scale * principal(WEST + 0.04))
    assert compare(result, reference, {"yaw": Tolerance(0.05 * scale)}).passed
    assert not compare(result, reference, {"yaw": Tolerance(0.03 * scale)}).passed


def test_the_deviation_of_an_angle_is_at_most_half_a_turn():
    result, reference = (
        recorded(units={"yaw": "rad"}, yaw=principal(WEST + 0.2)),
        recorded(yaw=principal(WEST)),
    )
    (text,) = failures(result, {"yaw": Tolerance(0.05)}, reference)
    assert "at most 0.15 rad outside" in text
    assert "101 of 101 points outside" in text


def test_an_angle_without_a_jump_on_the_other_side_of_half_a_turn_is_near():
    result, reference = (
        recorded(units={"yaw": "rad"}, yaw=np.full(101, 3.14)),
        recorded(yaw=np.full(101, -3.14)),
    )
    assert compare(result, reference, {"yaw": Tolerance(0.01)}).passed


def test_a_whole_turn_is_a_deviation_of_an_angle_that_counts_turns():
    turns = 2 * TIME
    result, reference = recorded(units={"yaw": "rad"}, yaw=turns + 2 * np.pi), recorded(yaw=turns)
    assert len(failures(result, {"yaw": Tolerance(0.1)}, reference)) == 1


def test_a_whole_turn_is_a_deviation_of_a_number_without_the_unit_of_an_angle():
    result, reference = (
        recorded(units={"x": "m"}, x=np.full(101, 3.14)),
        recorded(x=np.full(101, -3.14)),
    )
    assert len(failures(result, {"x": Tolerance(0.1)}, reference)) == 1
