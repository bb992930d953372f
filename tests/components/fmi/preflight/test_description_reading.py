"""Model descriptions as read by cosim, compared with FMPy."""

import math

import pytest
from bad_fmus import members, pack_archive
from fmpy import read_model_description

from cosim.components.fmi import FmuFile
from cosim.core import resources
from cosim.core.units import Unit, parse_unit

FMUS = sorted(resources.root().glob("fmus/**/*.fmu"))
FMI2_TYPES = {"Real": "Float64", "Integer": "Int32"}


def limit(text):
    return None if text is None or math.isinf(float(text)) else float(text)


def numbers(expected):
    """Return FMPy's start value, converted to numbers for numeric types."""
    if expected.start is None or expected.type in ("String", "Binary"):
        return expected.start
    words = tuple(
        {"true": 1.0, "false": 0.0}.get(word) if word in ("true", "false") else float(word)
        for word in expected.start.split()
    )
    return words[0] if len(words) == 1 else words


def check_like_fmpy(path):
    description, expected = FmuFile(path).description, read_model_description(path)
    assert (description.fmi_version, description.model_name, description.instantiation_token) == (
        expected.fmiVersion,
        expected.modelName,
        expected.instantiationToken,
    )
    assert (description.description, description.generation_tool) == (
        expected.description or "",
        expected.generationTool or "",
    )
    assert description.model_identifier == expected.coSimulation.modelIdentifier
    assert description.has_state == expected.coSimulation.canGetAndSetFMUstate
    assert description.once_per_process == expected.coSimulation.canBeInstantiatedOnlyOncePerProcess
    assert description.needs_execution_tool == expected.coSimulation.needsExecutionTool
    assert sorted(description.value_references.items()) == sorted(
        (v.name, v.valueReference) for v in expected.modelVariables
    )
    variables = {variable.name: variable for variable in description.variables}
    assert len(variables) == len(expected.modelVariables)
    for other in expected.modelVariables:
        variable = variables[other.name]
        assert variable.type == FMI2_TYPES.get(other.type, other.type)
        assert (variable.causality, variable.variability) == (other.causality, other.variability)
        assert variable.start == numbers(other)
        assert variable.shape == tuple(other.shape)
        unit = other.unit or (other.declaredType.unit if other.declaredType else None)
        assert (variable.unit.name if variable.unit else None) == unit
        assert (variable.minimum, variable.maximum) == (limit(other.min), limit(other.max))


@pytest.mark.parametrize("path", FMUS, ids=lambda path: str(path.relative_to(resources.root())))
def test_shipped_fmus_are_read_as_fmpy_reads_them(path):
    check_like_fmpy(path)


@pytest.mark.parametrize("version", [2, 3])
def test_foreign_fmus_are_read_as_fmpy_reads_them(version, probes):
    check_like_fmpy(probes[version])


FMI3 = """<?xml version="1.0"?>
<fmiModelDescription fmiVersion="3.0" modelName="M" instantiationToken="t">
  <CoSimulation modelIdentifier="m" canBeInstantiatedOnlyOncePerProcess="true"/>
  <UnitDefinitions>
    <Unit name="km/h"><BaseUnit m="1" s="-1" factor="0.2777777777777778"/></Unit>
    <Unit name="deg"/><Unit name="bar(g)"/>
  </UnitDefinitions>
  <TypeDefinitions>
    <Float64Type name="Speed" unit="km/h" min="0" max="300" description="a speed"/>
    <Float64Type name="Angle" unit="deg" relativeQuantity="true"/>
    <EnumerationType name="Mode">
      <Item name="off" value="-1"/><Item name="on" value="4"/>
    </EnumerationType>
  </TypeDefinitions>
  <DefaultExperiment startTime="1" stopTime=" 2.5 "/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <UInt64 name="n" valueReference="1" causality="structuralParameter" start="2"/>
    <Float64 name="speed" valueReference="2" declaredType="Speed" causality="input" start="50">
      <Alias name="v" description="short"/>
    </Float64>
    <Float64 name="a" valueReference="3" causality="parameter" start="1 2 3 4 5 6">
      <Dimension valueReference="1"/><Dimension start="3"/>
    </Float64>
    <Binary name="b" valueReference="4" causality="input"><Start value="00ff"/></Binary>
    <Clock name="c" valueReference="5" causality="input" intervalVariability="triggered"/>
    <Float64 name="turn" valueReference="7" declaredType="Angle"/>
    <Float64 name="gauge" valueReference="8" unit="bar(g)"/>
    <Float64 name="flow" valueReference="10" unit="m³/s"/>
    <Enumeration name="mode" valueReference="9" declaredType="Mode" causality="parameter"
      start="4"/>
    <Int8 name="i" valueReference="6" causality="input" clocks="5" start="-128"/>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"""


def test_features_of_fmi3(tmp_path):
    path = tmp_path / "m.fmu"
    path.write_bytes(pack_archive(members({"modelDescription.xml": FMI3.encode()})))
    description = FmuFile(path).description
    found = {variable.name: variable for variable in description.variables}
    assert (found["a"].shape, found["a"].start) == ((2, 3), (1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    assert (found["speed"].unit.factor, found["speed"].minimum, found["speed"].maximum) == (
        0.2777777777777778,
        0.0,
        300.0,
    )
    assert (
        found["turn"].unit.factor,
        found["turn"].relative_quantity,
        found["speed"].relative_quantity,
    ) == (
        math.pi / 180,
        True,
        False,
    )
    assert found["gauge"].unit == Unit(
        "bar(g)", ()
    )  # a unit without BaseUnit whose name is not a known unit
    assert found["flow"].unit == parse_unit("m³/s")  # a unit that is not defined
    assert found["a"].unit is None
    assert found["mode"].items == (("off", -1), ("on", 4))
    assert (found["v"].description, found["speed"].description, found["v"].start) == (
        "short",
        "a speed",
        50.0,
    )
    assert description.value_references["v"] == description.value_references["speed"] == 2
    assert (found["b"].start, found["i"].start, found["n"].variability) == ("00ff", -128, "fixed")
    assert (
        description.default_experiment.start_time,
        float(description.default_experiment.stop_time),
    ) == (1, 2.5)
    assert (description.once_per_process, description.has_state) == (True, False)
