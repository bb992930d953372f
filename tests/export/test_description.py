"""Contents of modelDescription.xml, read with cosim's own reader."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from zipfile import ZipFile

import pytest
from fmpy import read_model_description
from fmpy.model_description import read_build_description

from cosim.components.fmi import FmuFile
from cosim.core.errors import InputError
from cosim.core.units import KNOWN_UNITS, parse_unit
from cosim.export.fmu.block import Block, BlockVariable
from cosim.export.fmu.description_xml import model_description_xml
from cosim.export.fmu.variable_table import check_block


def variables(fmu):
    return {variable.name: variable for variable in FmuFile(fmu).description.variables}


def test_causality_variability_and_limits_are_written(fmu):
    gain, limit = variables(fmu)["gain"], variables(fmu)["limit"]
    assert (gain.causality, gain.variability, gain.start, gain.minimum, gain.maximum) == (
        "parameter",
        "tunable",
        2.0,
        0.0,
        None,
    )
    assert (limit.variability, limit.maximum, limit.description) == ("fixed", 1000.0, "")
    assert gain.description == 'gain "k"'
    assert variables(fmu)["doubled_gain"].causality == "calculatedParameter"


def test_units_are_defined_by_their_base_units(fmu):
    assert variables(fmu)["gain"].unit == parse_unit("1/s")
    assert variables(fmu)["vehicle.position.x"].unit == KNOWN_UNITS["m"]


def test_units_with_factor_and_offset_are_exact():
    names = ["deg", "degC", "kg.m2/s3", "rev"]
    block = Block(
        "units",
        "",
        [BlockVariable(n, n, "Float64", "local", "continuous", unit=n) for n in names],
        0.01,
        {},
    )
    text = model_description_xml(block, 2, "", ["model.c"]).decode()
    assert f'<BaseUnit rad="1" factor="{pi / 180!r}" />' in text
    assert '<BaseUnit K="1" offset="273.15" />' in text
    assert '<BaseUnit kg="1" m="2" s="-3" />' in text


@pytest.mark.parametrize("version", [2], indirect=True)
def test_fmi2_has_a_scalar_for_each_element(fmu):
    found = variables(fmu)
    assert [found[f"weights[{i}]"].start for i in (1, 2, 3)] == [1.0, 0.5, 0.25]
    assert [name for name in found if name.startswith("matrix")] == [
        "matrix[1,1]",
        "matrix[1,2]",
        "matrix[2,1]",
        "matrix[2,2]",
    ]


@pytest.mark.parametrize("version", [3], indirect=True)
def test_fmi3_has_arrays(fmu):
    found = variables(fmu)
    assert (found["weights"].shape, found["weights"].start) == ((3,), (1.0, 0.5, 0.25))
    assert (found["matrix"].shape, found["matrix"].start) == ((2, 2), (0.0, 0.0, 0.0, 0.0))
    assert found["time"].causality == "independent"


def test_enumerations_share_one_type_with_literals(fmu):
    model = read_model_description(fmu)
    (declared,) = model.typeDefinitions
    assert [(item.name, item.value) for item in declared.items] == [
        ("HOLD", "1"),
        ("INTEGRATE", "2"),
        ("FAIL", "3"),
    ]
    assert [v.name for v in model.modelVariables if v.declaredType is declared] == [
        "mode",
        "active_mode",
    ]


def test_step_size_and_capabilities_are_written(fmu):
    model = read_model_description(fmu)
    interface = model.coSimulation
    assert float(model.defaultExperiment.stepSize) == 0.01
    assert interface.canGetAndSetFMUstate
    assert interface.canSerializeFMUstate
    assert interface.canHandleVariableCommunicationStepSize
    assert model.generationDateAndTime is None


@pytest.mark.parametrize("version", [3], indirect=True)
def test_fmi3_has_a_build_description(fmu):
    (configuration,) = read_build_description(str(fmu))
    (files,) = configuration.sourceFileSets
    assert (configuration.modelIdentifier, files.language, files.sourceFiles) == (
        "sample",
        "C11",
        ["fmi3.c", "model.c"],
    )


def test_every_source_file_that_is_named_exists(fmu):
    (configuration,) = read_model_description(fmu).buildConfigurations
    with ZipFile(fmu) as archive:
        names = archive.namelist()
    assert {f"sources/{name}" for name in configuration.sourceFileSets[0].sourceFiles} <= set(names)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"type": "Flaot64"},
            'sample: variable "gain": unknown type "Flaot64"; did you mean "Float64"?',
        ),
        ({"causality": "ouput"}, 'unknown causality "ouput"; did you mean "output"?'),
        ({"unit": "furlong"}, 'variable "gain": unknown unit "furlong"'),
        ({"start": (1.0, 2.0)}, "found 2 start values, expected 1"),
        ({"name": "limit"}, 'variable name "limit" is used 2 times'),
        ({"name": "time"}, 'variable name "time" is used 2 times'),
        (
            {"type": "Boolean"},
            "found variability continuous for the type Boolean, expected discrete",
        ),
        ({"type": "Enumeration", "variability": "tunable"}, "the enumeration has no literals"),
    ],
)
def test_a_faulty_variable_is_refused(block, change, message):
    gain = replace(block.variables[0], **({"variability": "continuous"} | change))
    with pytest.raises(InputError) as refusal:
        check_block(replace(block, variables=[gain, *block.variables[1:]]))
    assert message in str(refusal.value)


def test_all_faults_are_reported_at_once(block):
    faulty = [replace(block.variables[0], unit="x"), replace(block.variables[1], unit="y")]
    with pytest.raises(InputError) as refusal:
        check_block(replace(block, identifier="not one", variables=faulty))
    assert len(refusal.value.problems) == 3


def test_a_block_without_variables_is_refused(block):
    with pytest.raises(InputError, match="sample: has no variables"):
        check_block(replace(block, variables=[]))
