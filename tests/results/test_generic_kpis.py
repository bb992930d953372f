"""KPIs of any signal compared with closed forms of first- and second-order systems."""

import json
import math

import numpy as np
import pytest
from cosim_command import run_cosim

from cosim import kpis
from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.results import Result
from cosim.results.kpi import kpi_senses, kpi_units

TIME = np.arange(200_001) / 10_000  # 20 s
TAU = 0.7
ZETA, OMEGA = 0.3, 2.0
DAMPED = OMEGA * math.sqrt(1 - ZETA**2)

first_order = 1 - np.exp(-TIME / TAU)
second_order = 1 - np.exp(-ZETA * OMEGA * TIME) * (
    np.cos(DAMPED * TIME) + ZETA * OMEGA / DAMPED * np.sin(DAMPED * TIME)
)


def run(time=TIME, **columns):
    return Result(
        Recording(
            np.asarray(time, dtype=float),
            {name: np.asarray(v) for name, v in columns.items()},
            dict.fromkeys(columns, ""),
        )
    )


RUN = run(
    first=first_order,
    second=second_order,
    sine=3 * np.sin(2 * np.pi * TIME),
    step=5 - 2 * first_order,
    t=TIME,
)


def value(function, *arguments, result=RUN, **named):
    return function(result, *arguments, **named)["value"]


def test_rise_time_of_first_order_is_tau_log_nine():
    assert value(kpis.rise_time, "first") == pytest.approx(TAU * math.log(9), rel=1e-7)
    assert value(kpis.rise_time, "first", low=0.0, high=1 - math.exp(-1)) == pytest.approx(
        TAU, rel=1e-7
    )


def test_step_response_with_given_initial_value_and_target():
    assert value(kpis.rise_time, "step") == pytest.approx(TAU * math.log(9), rel=1e-7)
    shifted = run(TIME + 3, late=np.where(TIME < 1, 0.2, first_order))
    assert value(
        kpis.rise_time, "late", result=shifted, start=4.0, initial=0.0, target=1.0
    ) == pytest.approx(TAU * math.log(10) - 1)


def test_settling_time_of_first_order_is_tau_log_fifty():
    assert value(kpis.settling_time, "first", target=1.0) == pytest.approx(
        TAU * math.log(50), rel=1e-6
    )
    assert value(kpis.settling_time, "first", target=1.0, band=0.05) == pytest.approx(
        TAU * math.log(20), rel=1e-6
    )


def test_overshoot_of_second_order_is_that_of_its_damping():
    assert value(kpis.overshoot, "second", target=1.0) == pytest.approx(
        math.exp(-ZETA * math.pi / math.sqrt(1 - ZETA**2)), rel=1e-6
    )
    assert value(kpis.overshoot, "first", target=1.0) == 0.0


def test_a_downward_step_overshoots_downwards():
    down = run(x=10 - 4 * second_order)
    assert value(kpis.overshoot, "x", target=6.0, result=down) == pytest.approx(
        math.exp(-ZETA * math.pi / math.sqrt(1 - ZETA**2)), rel=1e-6
    )


def test_settling_of_second_order_ends_with_its_last_swing():
    """Afterwards the envelope exp(-zeta omega t) / sqrt(1 - zeta^2) may be outside the band, but
    not the response.
    """
    settled = value(kpis.settling_time, "second", target=1.0)
    assert settled <= math.log(1 / (0.02 * math.sqrt(1 - ZETA**2))) / (ZETA * OMEGA)
    assert np.abs(np.interp(settled, TIME, second_order) - 1) == pytest.approx(0.02)
    assert np.abs(second_order[settled + 1e-9 < TIME] - 1).max() < 0.02


def test_settling_time_is_nan_without_settling():
    assert math.isnan(value(kpis.settling_time, "sine", target=1.0))
    assert value(kpis.settling_time, "first", initial=0.0, target=1.0, start=10.0) == 0.0


def test_step_kpis_are_nan_without_a_step():
    flat = run(x=np.ones_like(TIME))
    for function in (kpis.rise_time, kpis.overshoot, kpis.settling_time):
        assert math.isnan(value(function, "x", result=flat))


def test_time_to_reach_a_level_from_either_side():
    assert value(kpis.time_to_reach, "first", 0.5) == pytest.approx(TAU * math.log(2), rel=1e-7)
    assert value(kpis.time_to_reach, "step", 4.0) == pytest.approx(TAU * math.log(2), rel=1e-7)
    assert value(kpis.time_to_reach, "t", 7.0, start=5.0) == pytest.approx(2.0)
    assert math.isnan(value(kpis.time_to_reach, "first", 1.5))


def test_error_integrals_of_first_order():
    assert value(kpis.iae, "first", 1.0) == pytest.approx(TAU, rel=1e-6)
    assert value(kpis.ise, "first", 1.0) == pytest.approx(TAU / 2, rel=1e-6)
    assert value(kpis.itae, "first", 1.0) == pytest.approx(TAU**2, rel=1e-6)


def test_error_integrals_of_second_order():
    """ISE of a step of 1 / (s^2/w^2 + 2 z s/w + 1): (1 + 4 z^2) / (4 z w)."""
    assert value(kpis.ise, "second", 1.0) == pytest.approx(
        (1 + 4 * ZETA**2) / (4 * ZETA * OMEGA), rel=1e-4
    )


def test_time_in_itae_begins_with_the_window():
    late = run(TIME + 100, first=first_order)
    assert value(kpis.itae, "first", 1.0, result=late, start=100.0) == pytest.approx(
        TAU**2, rel=1e-6
    )


def test_kpis_of_a_sine_match_closed_forms():
    assert value(kpis.rms, "sine") == pytest.approx(3 / math.sqrt(2))
    assert value(kpis.mean, "sine") == pytest.approx(0, abs=1e-12)
    assert value(kpis.mean, "sine", stop=0.5) == pytest.approx(6 / math.pi, rel=1e-6)
    assert (
        value(kpis.maximum, "sine"),
        value(kpis.minimum, "sine"),
        value(kpis.peak, "sine", 1.0),
    ) == pytest.approx((3, -3, 4))


def test_target_can_be_another_signal():
    two = run(x=first_order + 0.25, reference=first_order)
    assert value(kpis.rms, "x", "reference", result=two) == pytest.approx(0.25)
    assert value(kpis.final, "x", "reference", result=two) == pytest.approx(0.25)


def test_averages_weight_rows_by_their_duration():
    uneven = run([0, 1, 1, 4], x=[0.0, 0.0, 2.0, 2.0])
    assert value(kpis.mean, "x", result=uneven) == 1.5
    assert value(kpis.rms, "x", result=uneven) == pytest.approx(math.sqrt(3))


def test_saturation_is_a_share_of_the_time():
    clipped = run([0, 1, 2, 5, 10], x=[0.0, 1.0, -1.0, 0.5, 1.0])
    assert value(kpis.saturation_share, "x", -1.0, 1.0, result=clipped) == pytest.approx(0.4)
    assert value(kpis.saturation_share, "x", upper=1.0, result=clipped) == pytest.approx(0.1)


def test_energy_is_the_integral_of_power():
    assert value(kpis.energy, "t", "t", stop=3.0) == pytest.approx(9, rel=1e-6)
    assert value(kpis.energy, "t", stop=3.0) == pytest.approx(4.5)
    assert value(kpis.energy, "t", -2.0, stop=3.0) == pytest.approx(-9)


def test_nan_makes_settling_and_saturation_nan():
    for place in (3, -1):
        values = np.array([0.0, 0.5, 1.0, 1.0, 1.0, 1.0])
        values[place] = math.nan
        lost = run(range(6), x=values)
        assert math.isnan(value(kpis.settling_time, "x", initial=0.0, target=1.0, result=lost))
        assert math.isnan(value(kpis.saturation_share, "x", upper=2.0, result=lost))


def test_energy_is_in_joules_whatever_the_units_of_the_signals():
    values = {
        "torque": np.array([2.0, 2.0]),
        "rate": np.array([30.0, 30.0]),
        "power": np.array([3.0, 3.0]),
    }
    result = Result(
        Recording(np.array([0.0, 2.0]), values, {"torque": "N.m", "rate": "rpm", "power": "kW"})
    )
    assert value(kpis.energy, "torque", "rate", result=result) == pytest.approx(
        4 * np.pi, rel=1e-12
    )
    assert value(kpis.energy, "power", result=result) == pytest.approx(6000.0, rel=1e-12)


def test_energy_of_integers_does_not_overflow():
    small = run(
        [0, 3],
        force=np.array([100_000, 100_000], np.int32),
        speed=np.array([50_000, 50_000], np.int32),
    )
    assert value(kpis.energy, "force", "speed", result=small) == 1.5e10


FUNCTIONS = [
    function
    for name, function in vars(kpis).items()
    if getattr(function, "__module__", "") == "cosim.kpis" and name[0].islower()
]


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda function: function.__name__)
def test_kpis_outside_the_run_are_nan(function):
    arguments = {"level": 0.5} if function is kpis.time_to_reach else {}
    window = {"stop": -1.0} if function is kpis.final else {"start": 30.0}
    assert math.isnan(value(function, "first", **arguments, **window))


def scenario(folder, **kpi):
    block = {"python": "saw.py:Saw"}
    content = {
        "name": "saw",
        "stop_time": 1,
        "step_size": 0.25,
        "components": {"a": block},
        "kpis": [{"name": "x", **kpi}],
    }
    (folder / "saw.py").write_text(
        "from pythonfmu import Fmi2Causality, Fmi2Slave, Real\n\n\n"
        "class Saw(Fmi2Slave):\n"
        "    def __init__(self, **arguments):\n"
        "        super().__init__(**arguments)\n"
        "        self.y = 0.0\n"
        '        self.register_variable(Real("y", causality=Fmi2Causality.output))\n\n'
        "    def do_step(self, current_time, step_size):\n"
        "        self.y = current_time + step_size\n"
        "        return True\n"
    )
    (folder / "saw.json").write_text(json.dumps(content))
    return run_cosim("run", "saw.json", "--isolation", "none", cwd=folder)


def test_a_scenario_names_a_kpi_by_its_module(tmp_path):
    done = scenario(
        tmp_path, python="cosim.kpis:time_to_reach", arguments={"signal": "a.y", "level": 0.75}
    )
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "runs/saw/kpis.json").read_text()) == {"x.value": 0.75}
    assert "x.value    0.75   s" in done.stdout


@pytest.mark.parametrize(
    ("python", "arguments", "message"),
    [
        (
            "cosim.kpis:rise_tme",
            {"signal": "a.y"},
            'defines no function "rise_tme"; did you mean "rise_time"?',
        ),
        ("cosim.kpis:rms", {"signl": "a.y"}, 'takes no argument "signl"; did you mean "signal"?'),
        ("cosim.kpsi:rms", {}, 'module "cosim.kpsi" does not exist'),
        ("nowhere.kpis:rms", {}, 'module "nowhere.kpis" does not exist'),
        (
            "cosim/kpis:rms",
            {},
            'expected "file.py:function" or "package.module:function", found "cosim/kpis:rms"',
        ),
    ],
)
def test_unknown_kpis_and_signals_are_refused_before_the_run(tmp_path, python, arguments, message):
    done = scenario(tmp_path, python=python, arguments=arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert "$.kpis[0]" in done.stderr


def test_units_are_those_of_the_signals():
    named = [
        ("rise", kpis.rise_time, {"signal": "speed"}),
        ("work", kpis.energy, {"effort": "force"}),
        ("rms", kpis.rms, {"signal": "speed"}),
        ("iae", kpis.iae, {"signal": "speed"}),
        ("ise", kpis.ise, {"signal": "speed"}),
        ("itae", kpis.itae, {"signal": "angle"}),
        ("unknown", kpis.ise, {"signal": "other"}),
        ("overshoot", kpis.overshoot, {"signal": "speed"}),
    ]
    units = kpi_units(
        named,
        [f"{name}.value" for name, _, _ in named],
        {"speed": "m/s", "angle": "rad", "other": ""},
    )
    assert list(units.values()) == ["s", "J", "m/s", "m", "m2/s", "rad.s2", "", ""]


def test_better_is_declared():
    named = [("rms", kpis.rms, {}), ("mean", kpis.mean, {})]
    assert kpi_senses(named, ["rms.value", "mean.value"]) == {"rms.value": "lower"}


def test_a_target_is_converted_to_the_unit_of_the_signal():
    values = {
        "tank": np.array([20.0, 30.0]),
        "setpoint": np.array([293.15, 300.15]),
        "power": np.array([1.0, 2.0]),
    }
    units = {"tank": "degC", "setpoint": "K", "power": "W"}
    result = Result(Recording(np.array([0.0, 1.0]), values, units))
    assert value(kpis.final, "tank", "setpoint", result=result) == pytest.approx(3.0)
    with pytest.raises(InputError, match=r'"power" \(W\) cannot be compared with "tank" \(degC\)'):
        kpis.final(result, "tank", "power")


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        (kpis.settling_time, {"band": -0.3}, "expected a band of 0 or more; found -0.3"),
        (
            kpis.rise_time,
            {"low": 0.9, "high": 0.1},
            "expected 0 <= low < high; found low 0.9, high 0.1",
        ),
        (
            kpis.saturation_share,
            {"lower": 2.0, "upper": 1.0},
            "lower limit 2 is above upper limit 1",
        ),
        (kpis.peak, {"start": 3.0, "stop": 2.0}, "start 3 s is after stop 2 s"),
    ],
)
def test_implausible_arguments_are_refused(function, arguments, message):
    with pytest.raises(InputError) as refusal:
        function(RUN, "first", **arguments)
    assert str(refusal.value) == message
