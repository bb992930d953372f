"""Invalid components: sources, values, periods and arguments."""

import pytest
from systems import connection

import cosim
from cosim.core import resources
from cosim.scenario import load


@pytest.mark.parametrize(
    ("component", "line"),
    [
        ({"fmuu": "x.fmu"}, '$.components.a.fmuu: unknown key; did you mean "fmu"?'),
        ({}, "expected exactly one of fmu, python, modelica, system; found none"),
        ({"fmu": "x.fmu", "python": "y.py:Y"}, "found fmu and python"),
        ({"fmu": "missing.fmu"}, 'missing.fmu" does not exist'),
        ({"python": "missing.py:X"}, 'file "missing.py" does not exist'),
        ({"python": "x"}, 'expected "file.py:name", found "x"'),
        ({"system": "missing.json"}, "No such file or directory"),
        ({"modelica": "missing.mo:X"}, 'file "missing.mo" does not exist'),
    ],
)
def test_a_component_with_an_invalid_source_is_reported_once_and_without_consequences(
    folder, component, line
):
    found = folder.problems(
        {"a": component, "b": folder.block("Gain")},
        [connection("a.y", "b.u"), connection("b.y", "a.u")],
    )
    assert len(found) == 1
    assert line in found[0]


@pytest.mark.parametrize(
    ("parameters", "line"),
    [
        ({"number": 1.5}, '"number" is of type Int32, found 1.5'),
        ({"flag": 1}, '"flag" is of type Boolean, found 1'),
        ({"text": 3}, '"text" is of type String, found 3'),
        ({"out": True}, '"out" is of causality output and cannot be set'),
        ({"numbr": 1}, 'component "a" has no variable "numbr"; did you mean "number"?'),
        ({"number": {"x": 1}}, "expected a number, true, false, a text, or a list of these"),
    ],
)
def test_values_must_have_the_type_of_their_variables(folder, parameters, line):
    found = folder.problems({"a": folder.block("Typed", parameters=parameters)})
    assert len(found) == 1
    assert line in found[0]


@pytest.mark.parametrize(
    ("value", "end"),
    [
        ("4.5", 'found "4.5"; write 4.5 without quotes'),
        ("true", 'found "true"'),
        ("4,5", 'found "4,5"'),
    ],
)
def test_a_number_in_quotes_is_refused_with_a_hint(folder, probes, value, end):
    (line,) = folder.problems({"a": {"fmu": str(probes[2]), "parameters": {"y_start": value}}})
    assert line.endswith(f'"y_start" is of type Float64, {end}')


def test_ranges_of_an_fmu_are_respected(folder, probes):
    found = folder.problems({"a": {"fmu": str(probes[2]), "parameters": {"y_start": 11}}})
    assert len(found) == 1
    assert '"y_start" must lie in -10.0 ... 10.0, found 11' in found[0]


@pytest.mark.parametrize(
    ("name", "value", "line"),
    [
        ("int8_in", 300, '"int8_in" must lie in -128 ... 127, found 300'),
        ("uint8_in", -1, '"uint8_in" must lie in 0 ... 255, found -1'),
        ("int32_in", 2**40, '"int32_in" must lie in -2147483648 ... 2147483647'),
        ("int64_in", 2**63, '"int64_in" must lie in'),
        ("uint64_in", 2**64 + 5, '"uint64_in" must lie in 0 ... 18446744073709551615'),
        ("f_in", 1e300, '"f_in" must lie in -3.4'),
        ("e_in", 7, '"e_in" is one of off (1), on (2), found 7'),
        ("e_in", "onn", '"e_in" is one of off (1), on (2), found "onn"; did you mean "on"?'),
    ],
)
def test_values_outside_the_range_of_their_type_are_refused(folder, probes, name, value, line):
    assert line in folder.problems({"a": {"fmu": str(probes[3]), "parameters": {name: value}}})[0]


@pytest.mark.parametrize("value", [2, "on"])
def test_enumeration_items_can_be_set_by_number_or_name(folder, probe, value):
    result = cosim.run(folder.scenario({"a": {"fmu": str(probe), "parameters": {"e_in": value}}}))
    assert result["a.e_out"][-1] == 2


def test_an_event_must_set_all_elements_of_an_array(folder, probes):
    """The elements that are missing would get their start values again."""
    events = [{"time": 1, "set": {"a.v_in": [11.0]}}]
    assert (
        "takes 3 values, found 1"
        in folder.problems({"a": {"fmu": str(probes[3])}}, events=events)[0]
    )


def test_a_list_that_is_too_long_is_reported_with_the_largest_length(folder):
    found = folder.problems({"a": folder.block("Controller", parameters={"gain": [1, 2, 3]})})
    assert [line.split(": ", 1)[1] for line in found] == [
        '$.components.a.parameters.gain: "gain" takes at most 2 values, found 3'
    ]


def test_periods_must_fit_step_size_and_duration(folder):
    found = folder.problems(
        {"a": folder.block("Gain", period=1.5), "b": folder.block("Gain", period=4)}
    )
    assert [line.split(": $.")[1] for line in found] == [
        "components.a.period: period 1.5 s is no multiple of the step size 1.0 s",
        (
            "components.b.period: the duration 3.0 s is shorter than the period of b: expected at "
            "least 4.0 s"
        ),
    ]


def test_arguments_may_have_the_parameter_names_of_the_loader(folder):
    load(
        folder.scenario({"a": folder.block("Gain", arguments={"kind": 1, "reference": "x"})})
    ).free()


def test_the_instance_name_cannot_be_an_argument(folder):
    (line,) = folder.problems({"a": folder.block("Gain", arguments={"instance_name": "b"})})
    assert 'Gain receives its "instance_name" from the scenario' in line


def test_problems_of_a_python_component_are_located_at_its_arguments(folder):
    world = str(resources.root() / "plant_src/world.py:World")
    vehicles = {
        "uav": {"model": "ar_dron", "position": [0, 0, 1]},
        "usv": {"model": "strider", "position": [0]},
    }
    found = folder.problems({"plant": {"python": world, "arguments": {"vehicles": vehicles}}})
    assert [line.split(": ", 1)[1] for line in found] == [
        (
            '$.components.plant.arguments.vehicles.uav.model: unknown vehicle model "ar_dron"; did '
            'you mean "ar_drone"?'
        ),
        (
            "$.components.plant.arguments.vehicles.usv.position: found [0], expected a list of 2 "
            "numbers [x, y]"
        ),
    ]


@pytest.mark.parametrize(
    ("source", "key"),
    [("x.py:Class", "python"), ("plant.mo:Plant", "modelica"), ("plant.mo", "modelica")],
)
def test_a_source_that_is_no_fmu_names_its_key(folder, source, key):
    (problem,) = folder.problems_of(folder.scenario({"a": {"fmu": source}}))
    assert problem.endswith(f'{source}" is not an FMU; it is named by "{key}" instead of "fmu"')


def test_an_entry_of_the_scenario_is_named_by_a_pointer(folder):
    file = folder.scenario({"a": folder.block("Gain")})
    with pytest.raises(cosim.InputError, match='name it by a JSON pointer: "/components'):
        cosim.load(file, {"components.a": None})
