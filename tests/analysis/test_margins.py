"""Margins of textbook loops, and the agreement of linear and estimated frequency responses."""

import math

import numpy as np
import pytest
from linear_blocks import StateSpace, block, loop
from scipy.signal import cont2discrete, ss2tf

import cosim
from cosim.analysis.loop_margins import margins
from cosim.analysis.loop_response import estimate_loop, measure_loops


def only(found):
    (each,) = found
    return each


def test_an_integrator_has_the_margins_of_its_formula():
    """L = k / (z - 1): |L| = 1 at 2 sin(wh/2) = k, where the phase margin is (pi - wh) / 2; at wh =
    pi, L = -k / 2.
    """
    k, h = 0.5, 0.1
    each = only(margins(loop(k, block([[1]], [[1]], [[1]]), h), "controller", loops=["plant.y0"]))
    crossover = 2 * math.asin(k / 2) / h
    assert each.crossover == pytest.approx(crossover, rel=1e-4)
    assert each.phase == pytest.approx((math.pi - crossover * h) / 2, rel=1e-4)
    assert each.delay == pytest.approx(each.phase / crossover, rel=1e-4)
    assert each.gain == pytest.approx(2 / k, rel=1e-4)
    assert each.gain_reduction == 0.0
    assert each.gain_frequency == pytest.approx(math.pi / h)
    assert each.stable


def test_a_sampled_third_order_loop_has_the_margins_of_its_transfer_function():
    """L = 2 / (s (s + 1) (s + 2)), sampled with 0.02 s; the reference is the transfer function on a
    dense grid of frequencies.
    """
    h, gain = 0.02, 2.0
    a, b, c = [[0, 1, 0], [0, 0, 1], [0, -2, -3]], [[0], [0], [1]], [[1, 0, 0]]
    ad, bd, *_ = cont2discrete(
        (np.array(a, float), np.array(b, float), np.array(c, float), np.zeros((1, 1))), h
    )
    each = only(
        margins(
            loop(gain, block(ad.tolist(), bd.tolist(), c), h),
            "controller",
            loops=["controller.y0"],
            duration=8,
        )
    )

    frequencies = np.geomspace(0.01, math.pi / h, 400_000)
    z = np.exp(1j * frequencies * h)
    numerator, denominator = ss2tf(ad, bd, np.array(c, float), np.zeros((1, 1)))
    values = gain * np.polyval(numerator[0], z) / np.polyval(denominator, z)
    above = int(np.flatnonzero(np.abs(values) < 1)[0])
    turn = int(np.flatnonzero((values.imag > 0) & (values.real < 0))[0])
    assert each.crossover == pytest.approx(frequencies[above], rel=1e-3)
    assert each.phase == pytest.approx(np.angle(-values[above]), rel=1e-3)
    assert each.delay == pytest.approx(np.angle(-values[above]) / frequencies[above], rel=1e-3)
    assert each.gain == pytest.approx(1 / np.abs(values[turn]), rel=1e-3)
    assert each.gain_frequency == pytest.approx(frequencies[turn], rel=1e-3)
    sensitivity, complementary = 1 / (1 + values), values / (1 + values)
    assert each.disk == pytest.approx(2 / np.abs(sensitivity - complementary).max(), rel=1e-3)


def test_an_unstable_loop_is_reported():
    each = only(margins(loop(-0.1, block([[1]], [[1]], [[1]])), "controller", loops=["plant.y0"]))
    assert not each.stable


def test_a_loop_of_several_rates_is_sampled_with_the_slowest_one():
    """The controller steps every second macro step; the plant integrates 0.5 per macro step, so L =
    k / (z - 1) at 0.2 s.
    """
    scenario = loop(0.5, block([[1]], [[0.5]], [[1]]))
    scenario["components"]["controller"]["period"] = 0.2
    each = only(margins(scenario, "controller", loops=["plant.y0"]))
    assert each.gain == pytest.approx(4, rel=1e-6)
    assert each.crossover == pytest.approx(2 * math.asin(0.25) / 0.2, rel=1e-6)


def test_a_slow_loop_is_measured_until_it_shows_its_slowest_mode():
    """L = k / (z - 1) with a time constant of 25 s at 0.1 s per step, which 256 samples hardly
    show.
    """
    k, h = 4e-3, 0.1
    scenario = loop(k, block([[1]], [[1]], [[1]]), h)
    (measured,) = measure_loops(scenario, ["controller"], loops=["plant.y0"])
    assert measured.is_covered(1024)
    assert measured.closed.poles() == pytest.approx([1 - k], abs=1e-9)
    assert only(margins(scenario, "controller", loops=["plant.y0"])).phase == pytest.approx(
        (math.pi - k) / 2, rel=1e-5
    )


def test_station_keeping_is_found_to_be_stable_although_its_modes_are_slow():
    """Its adaptation takes tens of seconds; a response of 2.56 s alone gives a slightly unstable
    model.
    """
    slow = only(measure_loops("station_keeping", ["usv"], 120, loops=["vessel.position.x"]))
    assert slow.is_stable
    assert slow.is_valid
    short = only(
        measure_loops("station_keeping", ["usv"], 120, loops=["vessel.position.x"], duration=2.56)
    )
    assert not short.is_covered(256)


class SwitchedGain(StateSpace):
    """A controller whose gain is ten times larger from 1 s on."""

    def do_step(self, time, _step_size):
        """Choose the gain."""
        self.d[:] = -0.1 if time < 0.95 else -1.0


def test_margins_of_a_model_that_misses_the_response_count_as_invalid():
    """The gain of the loop changes during the response, which no linear model with constant
    coefficients shows.
    """
    scenario = loop(0.5, block([[1]], [[1]], [[1]]))
    scenario["components"]["controller"]["python"] = SwitchedGain
    each = only(margins(scenario, "controller", loops=["plant.y0"]))
    assert not each.valid
    assert any("margins mean nothing" in note and "a mode changes" in note for note in each.notes)


def test_signals_that_act_on_nothing_that_returns_are_left_out():
    scenario = loop(0.5, block([[1]], [[1, 1]], [[1]]))
    scenario["components"]["course"] = block([[1]], [[0]], [[1]])
    scenario["connections"].append({"from": "course.y0", "to": "plant.u1"})
    assert [each.loop for each in margins(scenario, "plant")] == ["controller.y0", "plant.y0"]


def test_names_that_are_no_loops_are_refused():
    scenario = loop(0.5, block([[1]], [[1]], [[1]]))
    with pytest.raises(
        cosim.InputError, match=r'no connected signal "plant.y1" of controller.*"plant.y0"'
    ):
        margins(scenario, "controller", loops=["plant.y1"])
    with pytest.raises(cosim.InputError, match='no component "pilot"'):
        margins(scenario, "pilot")


@pytest.mark.parametrize("excitation", ["sines", "chirp"])
def test_the_response_of_the_nonlinear_system_agrees_with_the_linear_model_below_the_crossover(
    excitation,
):
    """Yaw of the quadcopter in flight: from a fifth of the crossover on within 2 %."""
    scenario, parameters, loops = (
        "free_flight",
        {"/components/usv/parameters/speed_command": 0.5},
        ["quadcopter.attitude.yaw"],
    )
    linear = only(
        measure_loops(scenario, ["uav"], 10, loops=loops, parameters=parameters, duration=3)
    )
    wanted = np.geomspace(3.5, 17, 6)
    frequencies, estimated = estimate_loop(
        scenario,
        ["uav"],
        *loops,
        wanted,
        10,
        amplitude=0.002,
        excitation=excitation,
        parameters=parameters,
    )
    assert np.abs(estimated / linear.open_loop(frequencies) - 1).max() < 0.02
    assert np.abs(estimated[0]) > 1.5
