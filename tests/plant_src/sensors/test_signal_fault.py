"""Effect of each fault on a signal."""

import numpy as np
import pytest
from sensor_harness import SensorHarness

from cosim.core.errors import ComponentError, InputError
from plant_src.sensors.fault import SignalFault


class FaultHarness(SensorHarness):
    """One signal `rudder_angle`, fed with 1, 2, 3, ... in steps 1, 2, 3, ..."""

    def __init__(self, **arguments):
        super().__init__(SignalFault("fault", {"rudder_angle": "rad"}, **arguments))

    def on(self, count=1, **parameters):
        """Set parameters like an event, step and return the outputs."""
        for name, value in parameters.items():
            self.component.set(name.replace("__", "."), value)
        found = []
        for _ in range(count):
            self["input.rudder_angle"] = self.steps + 1.0
            found.append(self.step()["rudder_angle"])
        return found


def test_signals_are_unchanged_without_a_fault():
    line = FaultHarness()
    assert line.on(3) == [1, 2, 3]
    assert line["valid"] is True


def test_frozen_keeps_the_last_value_and_stays_valid():
    line = FaultHarness()
    line.on(3)
    assert line.on(3, mode="frozen") == [3, 3, 3]
    assert line["valid"] is True
    assert line.on(2, mode="normal") == [7, 8]


def test_missing_keeps_the_last_value_and_is_invalid():
    line = FaultHarness()
    line.on(2)
    assert line.on(2, mode="missing") == [2, 2]
    assert line["valid"] is False
    assert line.on(1, mode="normal") == [5]
    assert line["valid"] is True


def test_stuck_outputs_its_value_and_follows_a_change():
    line = FaultHarness()
    assert line.on(2, mode="stuck", value__rudder_angle=0.4) == [0.4, 0.4]
    assert line.on(1, value__rudder_angle=-0.1) == [-0.1]


def test_gain_and_bias():
    assert FaultHarness().on(3, gain__rudder_angle=0.5, bias__rudder_angle=10.0) == [
        10.5,
        11.0,
        11.5,
    ]


def test_a_gain_of_the_square_scales_the_signal_by_its_root():
    found = FaultHarness(gain_of="square").on(3, gain__rudder_angle=0.49)
    assert np.allclose(np.square(found), 0.49 * np.square([1, 2, 3]), rtol=1e-15)


def test_a_delay_is_exact_after_it_is_filled():
    line = FaultHarness()
    line.on(5)
    assert line.on(6, delay=0.03) == [5, 5, 5, 6, 7, 8]
    assert line.on(3, delay=0.01) == [11, 12, 13]
    assert line.on(2, delay=0.0) == [15, 16]


def test_a_delay_comes_before_the_gain():
    line = FaultHarness()
    line.on(2)
    assert line.on(3, delay=0.02, gain__rudder_angle=2.0) == [4, 4, 6]


def test_added_noise_has_its_standard_deviation_and_no_mean():
    line = FaultHarness(seed=9)
    line.component.set("noise.rudder_angle", 0.2)
    error = np.array(line.on(5000)) - np.arange(1, 5001)
    assert error.std() == pytest.approx(0.2, rel=0.05)
    assert abs(error.mean()) < 4 * 0.2 / np.sqrt(5000)


def test_only_the_affected_elements_fail():
    trial = SensorHarness(SignalFault("fault", {"rotor_speed[4]": "rad/s", "extra": ""}))
    for name, value in (
        ("affected.rotor_speed", [False, True, False, False]),
        ("affected.extra", False),
        ("mode", "stuck"),
    ):
        trial.component.set(name, value)
    trial["input.rotor_speed"], trial["input.extra"] = [1.0, 2.0, 3.0, 4.0], 5.0
    trial.step()
    assert (trial["rotor_speed"], trial["extra"]) == ([1.0, 0.0, 3.0, 4.0], 5.0)


def test_missing_without_affected_signals_is_valid():
    trial = FaultHarness()
    trial.on(1, mode="missing", affected__rudder_angle=False)
    assert trial["valid"] is True


def test_the_initial_value_passes_through():
    trial = SensorHarness(SignalFault("fault", {"x": ""}), input__x=7.0)
    assert trial["x"] == 7.0


def test_an_unknown_mode_is_refused_with_the_nearest_one():
    with pytest.raises(ComponentError, match='unknown mode "frosen"; did you mean "frozen"'):
        FaultHarness().component.set("mode", "frosen")


def test_all_invalid_arguments_are_reported_together():
    with pytest.raises(InputError) as caught:
        SignalFault("fault", {"rotor speed": "", "x": "parsec"}, gain_of="cube")
    assert [problem.subject[1] for problem in caught.value.problems] == [
        "signals",
        "signals",
        "gain_of",
    ]
