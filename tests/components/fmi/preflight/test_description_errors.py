"""Errors in a model description: each is found by its rule, at its line, and the FMU is refused."""

import pytest
from bad_fmus import find_problems, refusal_message, with_change, with_description

#: case -> (FMI version, text of the valid description, its replacement, rule, line, part of the message)
ERRORS = {
    "type of other kind": (
        2,
        '<Integer start="0"/>',
        '<Integer declaredType="Mode" start="1"/>',
        "variable.other-type",
        17,
        'type "Mode" is Enumeration, but the variable is Int32',
    ),
    "absolute identifier": (3, 'Identifier="probe"', 'Identifier="/tmp/evil"', "model.library-name", 3, "expected a file name"),
    "path in identifier": (
        2,
        'Identifier="probe"',
        'Identifier="../../evil"',
        "model.library-name",
        3,
        '"../../evil", expected a file',
    ),
    "version 1.1": (2, 'fmiVersion="2.0"', 'fmiVersion="1.1"', "model.version", 2, "is an FMI 1.1 FMU; FMI 1.0, 2.0 and 3.0 are"),
    "version 4.0": (2, 'fmiVersion="2.0"', 'fmiVersion="4.0"', "model.version", 2, "is an FMI 4.0 FMU"),
    "version 2.1": (2, 'fmiVersion="2.0"', 'fmiVersion="2.1"', "model.version", 2, "is an FMI 2.1 FMU"),
    "beta version": (3, 'fmiVersion="3.0"', 'fmiVersion="3.0-beta.1"', "model.version", 2, "is an FMI 3.0-beta.1 FMU"),
    "no version": (2, 'fmiVersion="2.0"', "", "model.version", 2, "lacks the attribute fmiVersion"),
    "no guid": (2, 'guid="probe"', "", "model.token", 2, "lacks the attribute guid"),
    "no token": (3, 'instantiationToken="probe"', "", "model.token", 2, "lacks the attribute instantiationToken"),
    "only scheduled execution": (
        2,
        "<CoSimulation ",
        "<ScheduledExecution ",
        "model.interface",
        2,
        "offers neither Co-Simulation nor",
    ),
    "no identifier": (2, ' modelIdentifier="probe"', "", "model.library-name", 3, 'found modelIdentifier ""'),
    "two interfaces": (
        2,
        "<UnitDef",
        '<CoSimulation modelIdentifier="x"/><UnitDef',
        "model.repeated",
        3,
        "<CoSimulation> occurs 2 times",
    ),
    "two lists": (
        2,
        "<ModelStructure>",
        "<ModelVariables/><ModelStructure>",
        "model.repeated",
        12,
        "<ModelVariables> occurs 2 times",
    ),
    "unit twice": (2, '<Unit name="m">', '<Unit name="deg"/><Unit name="m">', "unit.unique", 6, 'unit "deg" is defined twice'),
    "unit exponent": (2, '<BaseUnit m="1"/>', '<BaseUnit m="x"/>', "unit.base", 6, 'found m="x", expected an integer'),
    "unit factor": (2, 'factor="0.017453292519943295"', 'factor="0"', "unit.base", 5, 'found factor="0"'),
    "type twice": (
        2,
        "</TypeDefinitions>",
        '<SimpleType name="Mode"><Real/></SimpleType></TypeDefinitions>',
        "type.unique",
        10,
        "defined twice",
    ),
    "item of no integer": (
        2,
        '<Item name="on" value="2"/>',
        '<Item name="on" value="2.0"/>',
        "type.items",
        9,
        'the item "on" of enumeration "Mode" is "2.0", expected an integer',
    ),
    "item twice": (
        2,
        'name="on" value="2"',
        'name="off" value="2"',
        "type.items",
        9,
        'the item "off" of enumeration "Mode" occurs twice',
    ),
    "value twice": (3, 'name="on" value="2"', 'name="on" value="1"', "type.items", 6, 'the value "1" of enumeration'),
    "no name": (2, 'name="u" ', "", "variable.name", 13, 'found the variable name ""'),
    "name with line end": (2, 'name="u" ', 'name="u&#10;v" ', "variable.name", 13, r'name "u\nv", expected one without'),
    "no type": (2, '<Real start="0" unit="m"/>', "", "variable.type", 13, "has no type that this FMI version defines"),
    "type of FMI 2": (3, '<Float64 name="u"', '<Real name="u"', "variable.type", 11, "has no type that this FMI version defines"),
    "causality": (2, 'causality="input"', 'causality="inptu"', "variable.word", 13, 'causality="inptu"; did you mean "input"?'),
    "variability": (2, 'variability="tunable"', 'variability="always"', "variable.word", 15, 'found variability="always"'),
    "initial": (2, 'initial="calculated"', 'initial="maybe"', "variable.word", 14, 'found initial="maybe"'),
    "no reference": (2, 'name="u" valueReference="0"', 'name="u"', "reference.value", 13, 'found valueReference=""'),
    "negative reference": (3, 'valueReference="1"', 'valueReference="-1"', "reference.value", 11, 'found valueReference="-1"'),
    "large reference": (
        2,
        'name="u" valueReference="0"',
        'name="u" valueReference="4294967296"',
        "reference.value",
        13,
        "0 to 4294967295",
    ),
    "two inputs": (
        2,
        'name="y_start" valueReference="2"',
        'name="y_start" valueReference="0"',
        "reference.shared",
        15,
        'the same value reference as "u"',
    ),
    "shared in FMI 3": (
        3,
        'name="y" valueReference="2"',
        'name="y" valueReference="1"',
        "reference.shared",
        12,
        'has the same value reference as "u", expected',
    ),
    "derivative": (2, '<Real unit="m"/>', '<Real unit="m" derivative="99"/>', "variable.derivative", 14, 'found derivative="99"'),
    "derivative of text": (
        3,
        'initial="calculated" unit="m"',
        'initial="calculated" derivative="60"',
        "variable.derivative",
        12,
        'found derivative="60"',
    ),
    "clock": (3, 'start="0" unit="m"', 'start="0" clocks="2"', "variable.clocks", 11, 'found "2" in its clocks'),
    "NaN": (2, '<Real start="0"', '<Real start="NaN"', "start.finite", 13, "found start value NaN, expected a finite number"),
    "infinite input": (
        3,
        'causality="input" start="0" unit',
        'causality="input" start="INF" unit',
        "start.finite",
        11,
        "found start value INF",
    ),
    "too large": (2, '<Real start="0"', '<Real start="1e999"', "start.finite", 13, "found start value 1e999"),
    "word": (
        2,
        '<Real start="0"',
        '<Real start="zero"',
        "start.value",
        13,
        'start value "zero" of variable "u" is not a valid Float64',
    ),
    "underscore": (2, '<Real start="0"', '<Real start="1_0"', "start.value", 13, 'start value "1_0"'),
    "C's nan": (2, '<Real start="0"', '<Real start="nan"', "start.value", 13, 'start value "nan"'),
    "fraction": (2, '<Integer start="0"', '<Integer start="0.5"', "start.value", 17, "is not a valid Int32"),
    "integer range": (2, '<Integer start="0"', '<Integer start="2147483648"', "start.value", 17, "is not a valid Int32"),
    "byte range": (
        3,
        'name="uint8_in" valueReference="22" causality="input" start="0"',
        'name="uint8_in" valueReference="22" causality="input" start="-1"',
        "start.value",
        21,
        "is not a valid UInt8",
    ),
    "truth": (2, '<Boolean start="false"', '<Boolean start="False"', "start.value", 22, "is not a valid Boolean"),
    "too few starts": (3, 'start="1 2 3"', 'start="1 2"', "start.count", 15, "found 2 start values, expected 3"),
    "many starts": (2, '<Real start="0"', '<Real start="0 0"', "start.count", 13, "found 2 start values, expected 1"),
    "no dimension": (
        3,
        '<Dimension start="3"/>',
        '<Dimension start="0"/>',
        "variable.dimension",
        15,
        'a dimension with start="0", expected',
    ),
    "empty dimension": (3, '<Dimension start="3"/>', "<Dimension/>", "variable.dimension", 15, "found a dimension with nothing"),
    "dimension of input": (
        3,
        '<Dimension start="3"/>',
        '<Dimension valueReference="1"/>',
        "variable.dimension",
        15,
        "value reference of a structural parameter",
    ),
    "dimension of itself": (
        3,
        '<Float64 name="u"',
        '<UInt64 name="n" valueReference="77" causality="structuralParameter" start="3"><Dimension valueReference="77"/></UInt64>'
        '<Float64 name="u"',
        "variable.dimension",
        11,
        "value reference of a structural parameter",
    ),
    "huge dimension": (
        3,
        '<Dimension start="3"/>',
        '<Dimension start="99999"/><Dimension start="99999"/>',
        "variable.size",
        15,
        "has 9999800001 elements",
    ),
    "many arrays": (
        3,
        '<Float64 name="u"',
        "".join(f'<Float64 name="b{i}" valueReference="{90 + i}"><Dimension start="1000000"/></Float64>' for i in range(3))
        + '<Float64 name="u"',
        "variable.size",
        11,
        "elements, expected at most 2000000",
    ),
    "many aliases of an array": (
        3,
        '<Float64 name="u"',
        '<Float64 name="b" valueReference="90"><Dimension start="1000000"/><Alias name="c"/><Alias name="d"/></Float64>'
        '<Float64 name="u"',
        "variable.size",
        11,
        "elements, expected at most 2000000",
    ),
    "output index": (
        2,
        '<Outputs><Unknown index="2"/>',
        '<Outputs><Unknown index="99"/>',
        "structure.reference",
        28,
        'Output refers to variable "99"',
    ),
    "output reference": (
        3,
        '<Output valueReference="6"/>',
        '<Output valueReference="999"/>',
        "structure.reference",
        43,
        'Output refers to variable "999"',
    ),
    "dependency": (
        2,
        '<Outputs><Unknown index="2"/>',
        '<Outputs><Unknown index="2" dependencies="1 0"/>',
        "structure.reference",
        28,
        'variable "0"',
    ),
}


@pytest.mark.parametrize("name", ERRORS)
def test_errors_are_refused(name, good, tmp_path):
    version, old, new, rule, line, words = ERRORS[name]
    path = with_change(old, new, good[version], tmp_path)
    text = refusal_message(path)
    (line_found,) = [row for row in text.splitlines() if words in row]
    assert line_found.startswith(f'"{path}": modelDescription.xml:{line}: ')
    assert f" [{rule}, FMI " in line_found or f" [{rule}, limits]" in line_found
    assert (rule, "error", line) in [(f.rule.name, f.rule.severity, f.line) for f in find_problems(path)]


def test_all_problems_are_reported_together(good, tmp_path):
    text = good[2]["modelDescription.xml"].decode()
    text = (
        text.replace('guid="probe"', "")
        .replace('<Real start="0"', '<Real start="NaN"')
        .replace('valueReference="1"', 'valueReference="x"', 1)
    )
    assert len(refusal_message(with_description(text, good[2], tmp_path)).splitlines()) == 3
