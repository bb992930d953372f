"""Invalid nested systems: their problems are located in their own files."""

from systems import connection


def test_a_port_does_not_hide_a_component_of_the_nested_system(folder):
    parts = {"left": folder.block("Gain"), "right": folder.block("Gain")}
    folder.write({"components": parts, "ports": {"outputs": {"right": "left"}}}, "inner.json")
    (line,) = folder.problems({"u": {"system": "inner.json"}})
    assert line.startswith("inner.json:")
    assert '"right" is already the name of a component here' in line


def test_an_unknown_port_is_reported_with_the_nearest_name(folder):
    folder.write(
        {"components": {"g": folder.block("Gain")}, "ports": {"inputs": {"command": "g.u"}}},
        "n.json",
    )
    components = {"a": {"system": "n.json"}, "b": folder.block("Gain")}
    (line,) = folder.problems(components, [connection("b.y", "a.comand")])
    assert 'nested system "a" has no input port "comand"; did you mean "command"?' in line


def test_problems_in_a_nested_file_are_located_in_that_file(folder):
    folder.write(
        {
            "components": {"g": folder.block("Gain", parameters={"kk": 1})},
            "ports": {"outputs": {"y": "h.y"}},
        },
        "n.json",
    )
    found = folder.problems({"a": {"system": "n.json"}})
    assert [line.split(":")[0] for line in found] == ["n.json", "n.json"]
    assert 'component "a.g" has no variable "kk"' in found[0]
    assert 'unknown component "h"' in found[1]


def test_a_period_inside_a_nested_system_is_found_in_its_file(folder):
    folder.write({"components": {"g": folder.block("Gain", period=1.5)}}, "n.json")
    (line,) = folder.problems({"a": {"system": "n.json"}})
    assert line.startswith("n.json:1:")
    assert "$.components.g.period: period 1.5 s is no multiple of the step size 1.0 s" in line


def test_a_system_that_contains_itself_is_refused(folder):
    folder.write({"components": {"again": {"system": "n.json"}}}, "n.json")
    (line,) = folder.problems({"a": {"system": "n.json"}})
    assert 'the nested system "n.json" contains itself' in line


def test_a_nested_system_with_times_is_refused(folder):
    folder.write(
        {"components": {"g": folder.block("Gain")}, "stop_time": 3, "step_size": 1}, "n.json"
    )
    found = folder.problems({"a": {"system": "n.json"}})
    assert [line.split(";")[0].split(": ", 1)[1] for line in found] == [
        "$.stop_time: unknown key",
        "$.step_size: unknown key",
    ]


def test_a_connection_to_a_whole_system_without_ports_is_refused(folder):
    system = {"system": {"components": {"g": folder.block("Gain")}}}
    components = {"a": system, "b": folder.block("Gain")}
    (line,) = folder.problems(components, [connection("b.y", "a")])
    assert '"a" names a nested system, expected one of its ports' in line
