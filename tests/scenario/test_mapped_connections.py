"""Connections of components with other names and units: patterns with "*", gains and offsets."""

import numpy as np
import pytest
from systems import connection

import cosim
from cosim.scenario import load
from cosim.scenario.plausibility import find_warnings

FOREIGN = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Integer, Real


class Foreign(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        for name in ("pos_x_cm", "pos_y_cm"):
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.count = 0
        self.register_variable(Integer("count", causality=Fmi2Causality.input))
        self.turns = 0
        self.register_variable(Integer("turns", causality=Fmi2Causality.output))
        self.motor1 = self.motor2 = 3.0
        for name in ("motor1", "motor2"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.motor1, self.motor2 = self.pos_x_cm, self.pos_y_cm
        return True
"""
MAPPED = [
    connection("plant.ship.position.*", "pilot.pos_*_cm", gain=100.0),
    connection("pilot.motor*", "plant.ship.motor[*]", gain=0.01, offset=0.5),
]


@pytest.fixture
def pair(folder):
    (folder.path / "foreign.py").write_text(FOREIGN)
    return {"pilot": {"python": "foreign.py:Foreign"}, "plant": folder.block("Plant")}


def test_patterns_and_gains_map_a_foreign_controller(folder, pair):
    result = cosim.run(folder.scenario(pair, MAPPED))
    x, y = (result[f"plant.ship.position.{axis}"] for axis in "xy")
    assert x.tolist() == [0.0, 0.5, 1.5, 3.5]  # x += 0.01 * (100 x) + 0.5
    assert y.tolist() == [1.0, 2.5, 5.5, 11.5]
    assert [note for *_, note in result.metadata["system"]["connections"]] == ["gain 100"] * 2 + [
        "gain 0.01, offset 0.5"
    ] * 2


def test_a_connection_of_single_variables_overrides_a_pattern(folder, pair):
    file = folder.scenario(pair, [*MAPPED, connection("pilot.motor2", "plant.ship.motor[1]")])
    prepared = load(file)
    fed = {str(each.target): str(each.source) for each in prepared.system.connections}
    prepared.free()
    assert fed["plant.ship.motor[1]"] == "pilot.motor2"


def test_an_input_of_a_pattern_needs_an_output(folder, pair):
    wires = [
        connection("plant.ship.position.*", "pilot.*_cm"),
        connection("pilot.rotor*", "plant.ship.motor[*]"),
    ]
    texts = [problem.partition(": $")[2] for problem in folder.problems(pair, wires)]
    assert texts == [
        '.connections[1].from: component "pilot" has no output "rotor*"; did you mean "motor2"?',
        ".connections[0]: input pilot.pos_x_cm has no matching output plant.ship.position.pos_x; "
        "did you mean "
        '"plant.ship.position.x"?',
        ".connections[0]: input pilot.pos_y_cm has no matching output plant.ship.position.pos_y; "
        "did you mean "
        '"plant.ship.position.y"?',
    ]


def test_wrong_mappings_are_refused(folder, pair):
    problem, *others = folder.problems(
        pair, [connection("plant.ship.position.*", "pilot.pos_x_cm")]
    )
    assert 'expected one "*" in each of "from" and "to", or none' in problem
    assert not others
    problem, *others = folder.problems(pair, [connection("pilot.turns", "pilot.count", gain=2.0)])
    assert problem.endswith(
        "gains, offsets and sums are for inputs of floating-point numbers, found Int32"
    )
    assert not others


@pytest.mark.parametrize(
    ("gain", "warns"), [(100.0, True), (-100.0, True), (-1.0, False), (50.0, False)]
)
def test_a_gain_that_repeats_the_conversion_of_units_causes_a_warning(folder, gain, warns):
    (folder.path / "metric.py").write_text(
        FOREIGN.replace(
            "class Foreign(Fmi2Slave):",
            'class Foreign(Fmi2Slave):\n    units = {"pos_x_cm": "cm", "motor1": "m"}',
        )
    )
    both = {name: {"python": "metric.py:Foreign"} for name in ("one", "two")}
    file = folder.scenario(both, [connection("one.motor1", "two.pos_x_cm", gain=gain)])
    texts = [str(problem) for problem in find_warnings(load(file))]
    hint = (
        f"m is converted to cm, and then multiplied by the gain {gain:g}: is the gain "
        f"{int(np.sign(gain))} meant?"
    )
    assert any(hint in text for text in texts) is warns
