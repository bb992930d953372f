"""cosim's own reading of model descriptions, held against FMPy's."""

import math

import pytest
from bad_fmus import members, pack_archive
from fmpy import read_model_description

from cosim.components.fmi import FmuFile
from cosim.core import resources

FMUS = sorted(resources.root().glob("fmus/**/*.fmu"))
FMI2_TYPES = {"Real": "Float64", "Integer": "Int32"}


def limit(text):
    return None if text is None or math.isinf(float(text)) else float(text)


def numbers(theirs):
    """The start value as FMPy has it, as numbers where it stands for some."""
    if theirs.start is None or theirs.type in ("String", "Binary"):
        return theirs.start
    words = tuple(
        {"true": 1.0, "false": 0.0}.get(word) if word in ("true", "false") else float(word) for word in theirs.start.split()
    )
    return words[0] if len(words) == 1 else words


def check_like_fmpy(path):
    ours, theirs = FmuFile(path).description, read_model_description(path)
    assert (ours.fmi_version, ours.model_name, ours.instantiation_token) == (
        theirs.fmiVersion,
        theirs.modelName,
        theirs.instantiationToken,
    )
    assert (ours.description, ours.generation_tool) == (theirs.description or "", theirs.generationTool or "")
    assert ours.model_identifier == theirs.coSimulation.modelIdentifier
    assert ours.has_state == theirs.coSimulation.canGetAndSetFMUstate
    assert ours.once_per_process == theirs.coSimulation.canBeInstantiatedOnlyOncePerProcess
    assert ours.needs_execution_tool == theirs.coSimulation.needsExecutionTool
    assert sorted(ours.value_references.items()) == sorted((v.name, v.valueReference) for v in theirs.modelVariables)
    mine = {variable.name: variable for variable in ours.variables}
    assert len(mine) == len(theirs.modelVariables)
    for other in theirs.modelVariables:
        variable = mine[other.name]
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
    <Unit name="km/h"><BaseUnit m="1" s="-1" factor="0.2777777777777778"/></Unit><Unit name="deg"/><Unit name="bar(g)"/>
  </UnitDefinitions>
  <TypeDefinitions>
    <Float64Type name="Speed" unit="km/h" min="0" max="300" description="a speed"/>
    <Float64Type name="Angle" unit="deg" relativeQuantity="true"/>
    <EnumerationType name="Mode"><Item name="off" value="-1"/><Item name="on" value="4"/></EnumerationType>
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
    <Enumeration name="mode" valueReference="9" declaredType="Mode" causality="parameter" start="4"/>
    <Int8 name="i" valueReference="6" causality="input" clocks="5" start="-128"/>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"""


def test_what_only_fmi3_has(tmp_path):
    path = tmp_path / "m.fmu"
    path.write_bytes(pack_archive(members({"modelDescription.xml": FMI3.encode()})))
    description = FmuFile(path).description
    found = {variable.name: variable for variable in description.variables}
    assert (found["a"].shape, found["a"].start) == ((2, 3), (1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    assert (found["speed"].unit.factor, found["speed"].minimum, found["speed"].maximum) == (0.2777777777777778, 0.0, 300.0)
    assert (found["turn"].unit.factor, found["turn"].relative_quantity, found["speed"].relative_quantity) == (
        math.pi / 180,
        True,
        False,
    )
    assert found["gauge"].unit is None  # nothing says what it is
    assert found["mode"].items == (("off", -1), ("on", 4))
    assert (found["v"].description, found["speed"].description, found["v"].start) == ("short", "a speed", 50.0)
    assert description.value_references["v"] == description.value_references["speed"] == 2
    assert (found["b"].start, found["i"].start, found["n"].variability) == ("00ff", -128, "fixed")
    assert (description.default_experiment.start_time, float(description.default_experiment.stop_time)) == (1, 2.5)
    assert description.once_per_process and not description.has_state
