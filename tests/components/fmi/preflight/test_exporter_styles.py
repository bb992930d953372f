"""Descriptions in the style of widespread exporters are accepted, if with warnings."""

import pytest
from bad_fmus import find_problems, members, pack_archive

from cosim.components.fmi import FmuFile

HEAD = (
    '<?xml version="1.0" encoding="{encoding}"?>\n<fmiModelDescription fmiVersion="2.0" '
    'guid="{{1}}" {root}>'
)
INTERFACE = (
    '<CoSimulation modelIdentifier="probe" canHandleVariableCommunicationStepSize="true" {more}/>'
)


def scalar(name, reference, typed, **attributes):
    words = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return (
        f'<ScalarVariable name="{name}" '
        f'valueReference="{reference}"{words}>{typed}</ScalarVariable>'
    )


def description(
    variables,
    encoding="UTF-8",
    root='modelName="M"',
    more="",
    before="",
    structure="<ModelStructure/>",
):
    head = HEAD.format(encoding=encoding, root=root) + INTERFACE.format(more=more)
    listed = f"<ModelVariables>{''.join(variables)}</ModelVariables>"
    return f"{head}{before}{listed}{structure}</fmiModelDescription>".encode(encoding)


DESCRIPTIONS = {
    "OpenModelica: temporary names, units without definitions, wide limits": description(
        [
            scalar("$cse1", 0, "<Real/>"),
            scalar("der(x)", 1, '<Real derivative="3"/>'),
            scalar(
                "x",
                2,
                '<Real start="0.0" unit="m" min="-1.7976931348623157e+308"/>',
                initial="exact",
            ),
            scalar(
                "n",
                0,
                '<Integer start="3" min="-4611686018427387903"/>',
                causality="parameter",
                variability="fixed",
            ),
        ],
        root='modelName="M" variableNamingConvention="structured" numberOfEventIndicators="0"',
    ),
    "Dymola: aliases with start values, own starts out of range": description(
        [
            scalar("a.phi", 33554432, '<Real start="0" min="1"/>', initial="approx"),
            scalar("b.phi", 33554432, '<Real start="0"/>', initial="approx"),
            scalar(
                "p", 16777216, '<Real start="1"/>', causality="parameter", variability="tunable"
            ),
            scalar(
                "p2", 16777216, "<Real/>", causality="calculatedParameter", variability="tunable"
            ),
        ],
    ),
    "Simulink: infinite limits of saturations, spaces in names": description(
        [
            scalar(
                "Saturation upper",
                0,
                '<Real start="INF"/>',
                causality="parameter",
                variability="fixed",
            ),
            scalar("In 1", 1, '<Real start="0"/>', causality="input", variability="discrete"),
            scalar(
                "Out 1",
                2,
                "<Real/>",
                causality="output",
                variability="discrete",
                initial="calculated",
            ),
        ],
        root='modelName="a model"',
        more='needsExecutionTool="false" canInterpolateInputs="false"',
    ),
    "outputs missing in the model structure": description(
        [scalar("y", 0, "<Real/>", causality="output")]
    ),
    "discrete types without variability": description(
        [scalar("on", 0, "<Boolean/>", causality="output")]
    ),
    "Latin-1": description(
        [scalar("y", 0, "<Real/>", description="Ölstand")], encoding="ISO-8859-1"
    ),
    "extra attributes and annotations": description(
        [scalar("y", 0, "<Real/><Annotations><Tool name='t'><more a='1'/></Tool></Annotations>")],
        root='modelName="M" vendor="x" numberOfContinuousStates="0"',
        before='<VendorAnnotations><Tool name="t"><any xmlns="urn:x"/></Tool></VendorAnnotations>',
    ),
    "a unit without base unit": description(
        [scalar("y", 0, '<Real unit="1"/>')],
        before='<UnitDefinitions><Unit name="1"/></UnitDefinitions>',
    ),
    "model exchange as well": description(
        [scalar("y", 0, "<Real/>")],
        before='<ModelExchange modelIdentifier="probe"/>',
        root='modelName="M" generationTool="T 1.0"',
    ),
}


@pytest.mark.parametrize("style", DESCRIPTIONS)
def test_styles_of_exporters_are_accepted(style, good, tmp_path):
    path = tmp_path / "foreign.fmu"
    path.write_bytes(pack_archive(members(good[2] | {"modelDescription.xml": DESCRIPTIONS[style]})))
    FmuFile(path).check_binary()
    assert FmuFile(path).description.variables
    findings = [
        finding for finding in find_problems(path) if finding.rule != "binary.functions"
    ]  # of the other interface
    assert {finding.severity for finding in findings} <= {"warning"}
