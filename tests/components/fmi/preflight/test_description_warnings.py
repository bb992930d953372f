"""Harmless violations of the standard are warnings: each is found by its rule, at its line, and the
FMU is accepted.
"""

import pytest
from bad_fmus import find_problems, with_change, with_description

from cosim.components.fmi import FmuFile

#: case -> (FMI version, text of the valid description, its replacement, rule, line, part of the
#: message)
WARNINGS = {
    "alias twice": (
        3,
        'start="1"/>',
        'start="1"><Alias name="u"/></Float64>',
        "variable.unique",
        13,
        'name "u" is already used in line 11',
    ),
    "name twice": (
        2,
        'name="y" ',
        'name="u" ',
        "variable.unique",
        14,
        'the variable name "u" is already used in line 13',
    ),
    "stop time": (
        2,
        'stopTime="2"',
        'stopTime="NaN"',
        "experiment.value",
        11,
        'found stopTime="NaN", expected a finite number',
    ),
    "step size": (
        3,
        'stepSize="0.01"',
        'stepSize="fast"',
        "experiment.value",
        8,
        'found stepSize="fast"',
    ),
    "fixed input": (
        2,
        'name="u" valueR',
        'name="u" variability="fixed" valueR',
        "variable.combination",
        13,
        '"input" is not allowed with variability="fixed"',
    ),
    "continuous parameter": (
        2,
        ' variability="tunable"',
        "",
        "variable.combination",
        15,
        '"parameter" is not allowed with variability="continuous"',
    ),
    "tunable output": (
        3,
        'name="y" valueR',
        'name="y" variability="tunable" valueR',
        "variable.combination",
        12,
        '"output" is not allowed with',
    ),
    "continuous integer": (
        2,
        'causality="input" variability="discrete"',
        'causality="input" variability="continuous"',
        "variable.continuous",
        17,
        "Int32 is not allowed with",
    ),
    "exact calculated": (
        2,
        'causality="parameter" variability',
        'initial="calculated" causality="parameter" variability',
        "variable.initial",
        15,
        'initial="calculated" is not allowed',
    ),
    "unknown type": (
        2,
        'declaredType="Mode" start',
        'declaredType="Mood" start',
        "variable.declared-type",
        19,
        'declaredType="Mood", which is not defined; did you mean "Mode"?',
    ),
    "enumeration without type": (
        3,
        ' declaredType="Mode" start',
        " start",
        "variable.declared-type",
        35,
        "is an enumeration without declaredType",
    ),
    "input without start": (
        2,
        '<Real start="0" unit="m"/>',
        '<Real unit="m"/>',
        "start.missing",
        13,
        "has no start value, which is required for inputs",
    ),
    "exact without start": (
        3,
        'causality="output" initial="calculated" unit',
        'causality="output" initial="exact" unit',
        "start.missing",
        12,
        'required for initial="exact"',
    ),
    "above max": (
        2,
        'start="1" min="-10"',
        'start="11" min="-10"',
        "start.range",
        15,
        "found start value 11, expected -10 to 10",
    ),
    "no item": (
        2,
        'declaredType="Mode" start="1"',
        'declaredType="Mode" start="3"',
        "start.range",
        19,
        'found start value 3, expected an item of "Mode"',
    ),
    "limits": (2, 'min="-10"', 'min="20"', "variable.limits", 15, "min 20 is above max 10"),
    "limit": (
        2,
        'min="-10"',
        'min="low"',
        "variable.limit-value",
        15,
        'found min="low", expected a number',
    ),
    "wide limit": (
        2,
        '<Integer start="0"/>',
        '<Integer start="0" max="99999999999" min="one"/>',
        "variable.limit-value",
        17,
        'found min="one"',
    ),
    "no model name": (
        2,
        'modelName="Probe"',
        'modelName=""',
        "model.name",
        2,
        "lacks the attribute modelName",
    ),
    "no items": (
        2,
        "</TypeDefinitions>",
        '<SimpleType name="E"><Enumeration/></SimpleType></TypeDefinitions>',
        "type.kind",
        10,
        'enumeration "E" has no items',
    ),
    "stop before start": (
        2,
        'stopTime="2"',
        'stopTime="-1"',
        "experiment.order",
        11,
        "found stopTime -1, expected more than the startTime 0",
    ),
    "no step": (
        2,
        'stepSize="0.01"',
        'stepSize="0"',
        "experiment.order",
        11,
        "found stepSize 0, expected more than 0",
    ),
    "tolerance": (
        3,
        'stopTime="2"',
        'stopTime="2" tolerance="-1"',
        "experiment.order",
        8,
        "found tolerance -1",
    ),
    "category twice": (
        2,
        "<DefaultExp",
        '<LogCategories><Category name="a"/><Category name="a"/></LogCategories><DefaultExp',
        "categories.unique",
        11,
        '"a" occurs twice',
    ),
    "implied variability": (
        2,
        'causality="input" variability="discrete"><Int',
        'causality="input"><Int',
        "variable.implied-continuous",
        17,
        "Int32 is treated as discrete",
    ),
    "initial of input": (
        2,
        'causality="input">',
        'causality="input" initial="exact">',
        "variable.initial-not-allowed",
        13,
        'found initial="exact", expected none',
    ),
    "no time": (
        3,
        (
            '<Float64 name="time" valueReference="0" causality="independent" '
            'variability="continuous"/>'
        ),
        "",
        "variable.independent",
        2,
        "found 0 independent",
    ),
    "alias with other unit": (
        2,
        'name="y_start" valueReference="2"',
        'name="y_start" valueReference="1"',
        "reference.alias",
        15,
        "another unit",
    ),
    "unit": (
        2,
        'start="0" unit="m"',
        'start="0" unit="mm"',
        "variable.unit",
        13,
        'the unit "mm" is not defined',
    ),
    "display unit": (
        3,
        'start="0" unit="m"',
        'start="0" unit="m" displayUnit="km"',
        "variable.display-unit",
        11,
        'the display unit "km" is not defined for unit "m"',
    ),
    "start of calculated": (
        2,
        '<Real unit="m"/>',
        '<Real unit="m" start="1"/>',
        "start.unwanted",
        14,
        'has a start value, but initial="calculated"',
    ),
    "start of time": (
        3,
        'causality="independent"',
        'causality="independent" start="0"',
        "start.unwanted",
        10,
        "has a start value, but it is independent",
    ),
    "infinite parameter": (
        2,
        'start="1e9"',
        'start="INF"',
        "start.infinite",
        16,
        "found start value INF, expected a finite number",
    ),
    "own start out of range": (
        2,
        'initial="calculated"><Real unit="m"/>',
        'initial="approx"><Real unit="m" start="5" max="1"/>',
        "start.range",
        14,
        "start value 5, expected -inf to 1",
    ),
    "output not listed": (
        2,
        '<Outputs><Unknown index="2"/>',
        "<Outputs>",
        "structure.outputs",
        14,
        'variable "y": is an output but is missing in the outputs',
    ),
    "input listed": (
        2,
        '<Outputs><Unknown index="2"/>',
        '<Outputs><Unknown index="2"/><Unknown index="1"/>',
        "structure.outputs",
        13,
        'variable "u": is listed in the outputs',
    ),
    "listed twice": (
        3,
        '<Output valueReference="6"/>',
        '<Output valueReference="6"/><Output valueReference="6"/>',
        "structure.unique",
        43,
        'Output "6" occurs twice',
    ),
    "unknown not listed": (
        2,
        '<InitialUnknowns><Unknown index="2"/>',
        "<InitialUnknowns>",
        "structure.initial-unknowns",
        14,
        "is an initial unknown but is missing in the initial unknowns",
    ),
    "derivative without state": (
        2,
        "</Outputs>",
        '</Outputs><Derivatives><Unknown index="2"/></Derivatives>',
        "structure.derivatives",
        14,
        "is listed as derivative",
    ),
    "kinds": (
        2,
        '<Outputs><Unknown index="2"/>',
        '<Outputs><Unknown index="2" dependencies="1" dependenciesKind="fixed fixed"/>',
        "structure.dependencies",
        28,
        "has 2 dependenciesKind for 1",
    ),
    "kind": (
        2,
        '<Outputs><Unknown index="2"/>',
        '<Outputs><Unknown index="2" dependencies="1" dependenciesKind="often"/>',
        "structure.dependencies",
        28,
        'found "often", expected one of',
    ),
    "unknown attribute": (
        2,
        'modelName="Probe"',
        'modelName="Probe" colour="red"',
        "xml.schema",
        2,
        "'colour' is not allowed",
    ),
    "misplaced element": (
        3,
        "<UnitDefinitions>",
        "<Colour/><UnitDefinitions>",
        "xml.schema",
        4,
        "'Colour': This element is not expected",
    ),
}


@pytest.mark.parametrize("name", WARNINGS)
def test_warnings_are_reported_but_do_not_prevent_a_run(name, good, tmp_path):
    version, old, new, rule, line, words = WARNINGS[name]
    path = with_change(old, new, good[version], tmp_path)
    findings = find_problems(path)
    assert {f.severity for f in findings} == {"warning"}
    assert [(f.rule, f.line) for f in findings if words in f.message] == [(rule, line)]
    FmuFile(path).check_binary()


def structured(name, good, folder):
    text = (
        good[2]["modelDescription.xml"]
        .decode()
        .replace('guid="probe"', 'guid="probe" variableNamingConvention="structured"')
    )
    return with_description(text.replace('name="u"', f'name="{name}"'), good[2], folder)


@pytest.mark.parametrize(
    "name", ["a", "a.b[1,2].c", "der(a.b)", "der(a,2)", "'any thing (1)'.x", "_1"]
)
def test_structured_names_are_recognized(name, good, tmp_path):
    assert find_problems(structured(name, good, tmp_path)) == []


@pytest.mark.parametrize("name", ["a..b", "1a", "a[", "a[1", "a b", "der(a", "a.", "'a"])
def test_other_names_break_the_convention(name, good, tmp_path):
    assert [f.rule for f in find_problems(structured(name, good, tmp_path))] == [
        "variable.convention"
    ]
