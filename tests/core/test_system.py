from fakes import FakeComponent, gain, inputs, outputs
from systems import make_system

from cosim.core.component import Variable
from cosim.core.units import parse_unit


def typed(causality, kind, **more):
    return FakeComponent(
        [Variable("v", kind, causality, **more)], lambda _values, _time, _step: None
    )


def texts(built):
    return [problem.message for problem in built.problems()]


def test_a_valid_system_has_no_problems():
    assert texts(make_system({"a": gain(), "b": gain()}, "a.y > b.u, b.y > a.u")) == []


def test_all_problems_are_found_at_once():
    components = {"a": gain(), "b": gain(), "c": gain(), "f": gain()}
    built = make_system(
        components,
        "a.y > b.u, c.y > b.u, a.z > c.u, a.u > c.u, a.y > d.u",
        stages=[("a", "e"), ("b",)],
    )
    assert texts(built) == [
        'unknown component "e"; valid: c, f',
        'component "c" is in no stage of "algorithm", so it would never step',
        'component "f" is in no stage of "algorithm", so it would never step',
        "input b.u is connected twice: it is already fed by a.y",
        'component "a" has no variable "z"; valid: y',
        "a.u is of causality input, expected an output",
        'unknown component "d"; valid: a, b, c, f',
    ]


def test_a_wrong_name_in_a_stage_explains_a_missing_one():
    built = make_system({"ship": gain(), "pilot": gain()}, stages=[("ship",), ("pilto",)])
    assert texts(built) == ['unknown component "pilto"; did you mean "pilot"?']


def test_an_output_cannot_be_a_target():
    assert texts(make_system({"a": gain(), "b": gain()}, "a.y > b.y")) == [
        "b.y is of causality output, expected an input"
    ]


def test_a_component_in_two_stages_is_refused():
    built = make_system({"a": gain()}, stages=[("a",), ("a",)])
    assert texts(built) == ['component "a" is in the stages twice']


def test_different_quantities_are_not_connected():
    a = FakeComponent(outputs("y", unit=parse_unit("m")), lambda _values, _time, _step: None)
    b = FakeComponent(inputs("u", unit=parse_unit("rad")), lambda _values, _time, _step: None)
    (text,) = texts(make_system({"a": a, "b": b}, "a.y > b.u"))
    assert text == 'a.y cannot feed b.u: units "m" and "rad" measure different quantities'


def test_types_with_lossy_conversion_are_not_connected():
    for source, target in [
        ("Float64", "Int32"),
        ("Int64", "Int32"),
        ("Boolean", "Float64"),
        ("String", "Float64"),
    ]:
        built = make_system(
            {"a": typed("output", source), "b": typed("input", target)}, "a.v > b.v"
        )
        hint = ' unless the connection has "convert": true' if source == "Boolean" else ""
        assert texts(built) == [
            f"a.v cannot feed b.v: type {source} cannot be converted to {target}{hint}"
        ]


def test_types_with_lossless_conversion_are_connected():
    for source, target in [
        ("Int32", "Float64"),
        ("Float32", "Float64"),
        ("Int32", "Int64"),
        ("Enumeration", "Int64"),
    ]:
        assert (
            texts(
                make_system(
                    {"a": typed("output", source), "b": typed("input", target)}, "a.v > b.v"
                )
            )
            == []
        )


def test_each_array_element_is_an_endpoint():
    assert Variable("m", shape=(2, 2)).scalar_names == ("m[1,1]", "m[1,2]", "m[2,1]", "m[2,2]")
