"""Sums of outputs, elements and arrays, and integers and Booleans connected to real inputs."""

import pytest
from systems import connection

import cosim
from cosim.scenario import load
from cosim.scenario.nested_systems import load_scenario

SIGNALS = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Integer


class Signals(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.on, self.count = False, 0
        self.register_variable(Boolean("on", causality=Fmi2Causality.output))
        self.register_variable(Integer("count", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.on, self.count = not self.on, self.count + 1
        return True
"""

pytestmark = pytest.mark.usefixtures("executor")


@pytest.fixture
def gains(folder):
    """y = 1, 2 and 3 after the first step, and a sum of them."""
    blocks = {
        name: folder.block("Gain", parameters={"u": u, "k": 1.0})
        for name, u in zip("abc", (1.0, 2.0, 3.0), strict=True)
    }
    return {**blocks, "total": folder.block("Gain", parameters={"k": 10.0})}


def test_outputs_are_added_with_a_gain_each(folder, gains):
    wires = [connection(["a.y", "b.y", "c.y"], "total.u", gain=[1.0, -2.0, 0.5], offset=4.0)]
    result = cosim.run(folder.scenario(gains, wires))
    assert result["total.y"].tolist()[1:] == [10 * (1.0 - 2 * 2.0 + 0.5 * 3.0 + 4.0)] * 3
    notes = [note for *_, note in result.metadata["system"]["connections"]]
    assert notes == [
        "term 1 of a sum, offset 4",
        "term 2 of a sum, gain -2",
        "term 3 of a sum, gain 0.5",
    ]


def test_a_sum_of_prefixes_adds_the_outputs_of_the_same_names(folder):
    plants = {name: folder.block("Plant") for name in ("one", "two", "three")}
    wires = [
        connection(["one.ship.position.*", "two.ship.position.*"], "three.ship.motor[*]", delay=1)
    ]
    (line, *_) = folder.problems(plants, wires)
    assert "input three.ship.motor[1] has no matching output one.ship.position.1" in line
    names = {"x": "1", "y": "2"}
    wires = []
    for axis, i in names.items():
        sources = [f"one.ship.position.{axis}", f"two.ship.position.{axis}"]
        wires.append(connection(sources, f"three.ship.motor[{i}]"))
    result = cosim.run(folder.scenario(plants, wires))
    assert result["three.ship.position.y"].tolist() == [1.0, 3.0, 5.0, 7.0]  # + 1 + 1 in each step


def test_a_sum_crosses_the_border_of_an_iterated_system(folder, gains):
    """The iteration of `inner` solves y = 0.5 (a + y), where `a` is outside: y = a."""
    inner = {
        "components": {"total": folder.block("Gain", parameters={"k": 0.5})},
        "algorithm": {"stages": [["total"]], "iteration": {"tolerance": 1e-12}},
        "ports": {"inputs": {"u": "total.u"}, "outputs": {"y": "total.y"}},
    }
    folder.write(inner, "inner.json")
    parts = {"a": gains["a"], "inner": {"system": "inner.json"}}
    result = cosim.run(folder.scenario(parts, [connection(["a.y", "inner.y"], "inner.u")]))
    assert result["inner.y"].tolist()[1:] == pytest.approx([1.0] * 3, abs=1e-11)


def test_elements_and_whole_arrays_are_connected(folder, probes):
    fmu = {"fmu": str(probes[3])}
    wires = [
        connection("a.v_out", "b.v_in"),
        connection("a.v_out[3]", "b.u", gain=2.0),
        connection("a.y", "b.v_in[2]"),
    ]
    prepared = load(folder.scenario({"a": fmu, "b": fmu}, wires))
    fed = {str(each.target): str(each.source) for each in prepared.system.connections}
    prepared.free()
    assert fed == {
        "b.v_in[1]": "a.v_out[1]",
        "b.v_in[2]": "a.y",
        "b.v_in[3]": "a.v_out[3]",
        "b.u": "a.v_out[3]",
    }


def test_booleans_and_integers_become_reals_on_request(folder):
    (folder.path / "signals.py").write_text(SIGNALS)
    parts = {
        "s": {"python": "signals.py:Signals"},
        "g": folder.block("Gain", parameters={"k": 1.0}),
    }
    (line,) = folder.problems(parts, [connection("s.on", "g.u")])
    assert line.endswith(
        'type Boolean cannot be converted to Float64 unless the connection has "convert": true'
    )
    result = cosim.run(
        folder.scenario(
            parts, [connection(["s.on", "s.count"], "g.u", convert=True, gain=[100.0, 1.0])]
        )
    )
    assert result["g.y"].tolist()[1:] == [101.0, 2.0, 103.0]


def test_wrong_sums_are_refused_in_one_line(folder, gains):
    (line,) = folder.problems(gains, [connection(["a.y", "b.y"], "total.u", gain=[1.0])])
    assert line.endswith(
        'expected a number or one "gain" for each of 2 outputs, found 1; found {"from": ["a.y", '
        '"b.y"], '
        '"to": "total.u", "gain": [1.0]}'
    )
    (line,) = folder.problems(gains, [connection([], "total.u")])
    assert 'expected at least one output in "from"' in line
    (line,) = folder.problems(gains, [connection(["a.y", "b.w"], "total.u")])
    assert '.from[1]: component "b" has no output "w"; valid: y' in line


def test_a_removed_component_leaves_the_sum(folder, gains):
    base = folder.scenario(
        gains, [connection(["a.y", "b.y", "c.y"], "total.u", gain=[1.0, -2.0, 0.5])]
    )
    extension = folder.write(
        {"extends": base.name, "name": "less", "components": {"b": None}}, "less.json"
    )
    (wire,) = load_scenario(extension).expanded()["connections"]
    assert wire == {"from": ["a.y", "c.y"], "to": "total.u", "gain": [1.0, 0.5]}
    assert cosim.run(extension)["total.y"].tolist()[1:] == [25.0] * 3
