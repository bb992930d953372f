"""modelDescription.xml and buildDescription.xml of an FMU: contents and validation."""

from collections.abc import Collection, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from zipfile import ZipFile

from ...core import units
from ...core.errors import InputError, Problem
from ...core.units import BASE_UNITS
from .block import Block, BlockVariable
from .variable_table import TableRow, start_values, variable_table

Element = ElementTree.Element
ERROR_LOG_CATEGORY = {"name": "logStatusError", "description": "why a call failed"}
_FMI2_TYPES = {"Float64": "Real", "Int32": "Integer"}


def model_description_xml(
    block: Block, fmi_version: int, token: str, c_files: Sequence[str]
) -> bytes:
    """Return the modelDescription.xml of a block.

    Args:
        block: The block.
        fmi_version: 2 or 3.
        token: The GUID (FMI 2.0) or instantiation token (FMI 3.0).
        c_files: Names of the C files to compile. FMI 2.0 lists them here, FMI 3.0 in
            buildDescription.xml.
    """
    return to_bytes(
        _fmi2_description(block, token, c_files)
        if fmi_version == 2
        else _fmi3_description(block, token)
    )


def build_description_xml(block: Block, c_files: Sequence[str]) -> bytes:
    """Return the buildDescription.xml of a source code FMU (FMI 3.0, section 2.5.2)."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = _add_element(root, "BuildConfiguration", modelIdentifier=block.identifier)
    file_set = _add_element(configuration, "SourceFileSet", language="C11")
    for name in c_files:
        _add_element(file_set, "SourceFile", name=name)
    return to_bytes(root)


def to_bytes(root: Element) -> bytes:
    """Serialize a tree as an indented XML document; equal trees give equal bytes."""
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


# -- FMI 2.0


def _fmi2_description(block: Block, token: str, c_files: Sequence[str]) -> Element:
    root = _root_element(block, "2.0", guid=token)
    common = {
        "modelIdentifier": block.identifier,
        "canNotUseMemoryManagementFunctions": True,
        "canGetAndSetFMUstate": True,
        "canSerializeFMUstate": True,
    }
    interfaces = []
    if block.exchange:
        root.set("numberOfEventIndicators", str(len(block.exchange.indicators)))
        unneeded = not block.exchange.stores_values
        interfaces.append(
            _add_element(root, "ModelExchange", completedIntegratorStepNotNeeded=unneeded, **common)
        )
    interfaces.append(
        _add_element(root, "CoSimulation", canHandleVariableCommunicationStepSize=True, **common)
    )
    for interface in interfaces:
        files = _add_element(interface, "SourceFiles")
        for name in c_files:
            _add_element(files, "File", name=name)
    table, declared = variable_table(block, 2), _declared_types(block)
    states = _states_of_derivatives(block, table)
    _add_common_elements(root, block, 2)
    variables = _add_element(root, "ModelVariables")
    for reference, row in enumerate(table):
        _add_fmi2_variable(variables, reference, row.variable, declared, states.get(reference))
    structure = _add_element(root, "ModelStructure")
    groups = {
        "Outputs": _output_indices(table),
        "Derivatives": list(states),
        "InitialUnknowns": _initial_unknown_indices(table, states),
    }
    for name, unknowns in groups.items():
        if unknowns:
            group = _add_element(structure, name)
            for reference in unknowns:
                _add_element(group, "Unknown", index=reference + 1)
    return root


def _add_fmi2_variable(
    parent: Element,
    reference: int,
    variable: BlockVariable,
    declared: dict[Any, str],
    state: int | None,
) -> None:
    scalar = _add_element(parent, "ScalarVariable", **_common_attributes(reference, variable))
    derivative = {"derivative": None if state is None else state + 1}
    _add_element(
        scalar,
        _FMI2_TYPES.get(variable.type, variable.type),
        **_type_attributes(variable, declared),
        **derivative,
    )


# -- FMI 3.0


def _fmi3_description(block: Block, token: str) -> Element:
    root = _root_element(block, "3.0", instantiationToken=token)
    common = {
        "modelIdentifier": block.identifier,
        "canGetAndSetFMUState": True,
        "canSerializeFMUState": True,
    }
    if block.exchange:
        _add_element(
            root,
            "ModelExchange",
            needsCompletedIntegratorStep=block.exchange.stores_values,
            **common,
        )
    _add_element(root, "CoSimulation", canHandleVariableCommunicationStepSize=True, **common)
    table, declared = variable_table(block, 3), _declared_types(block)
    states = _states_of_derivatives(block, table)
    _add_common_elements(root, block, 3)
    variables = _add_element(root, "ModelVariables")
    time = {
        "name": "time",
        "valueReference": 0,
        "causality": "independent",
        "variability": "continuous",
        "unit": "s",
    }
    _add_element(variables, "Float64", **time)
    for index, row in enumerate(table):
        attributes = _common_attributes(index + 1, row.variable) | _type_attributes(
            row.variable, declared
        )
        derivative = states[index] + 1 if index in states else None
        element = _add_element(variables, row.variable.type, **attributes, derivative=derivative)
        for size in row.variable.shape:
            _add_element(element, "Dimension", start=size)
    structure = _add_element(root, "ModelStructure")
    count = len(block.exchange.indicators) if block.exchange else 0
    groups = {
        "Output": _output_indices(table),
        "ContinuousStateDerivative": list(states),
        "InitialUnknown": _initial_unknown_indices(table, states),
        "EventIndicator": range(len(table) - count, len(table)),
    }
    for name, unknowns in groups.items():
        for reference in unknowns:
            _add_element(structure, name, valueReference=reference + 1)
    return root


# -- common to both versions


def _root_element(block: Block, fmi_version: str, **token: str) -> Element:
    return _set_attributes(
        Element("fmiModelDescription"),
        fmiVersion=fmi_version,
        modelName=block.identifier,
        **token,
        description=block.description or None,
        generationTool="cosim",
        variableNamingConvention="structured",
    )


def _add_common_elements(root: Element, block: Block, fmi_version: int) -> None:
    names = {
        variable.unit
        for variable in block.variables
        if variable.type == "Float64" and variable.unit
    }
    add_units(root, names | {"s"} if fmi_version == 3 else names)
    _add_enumerations(root, block, fmi_version)
    _add_element(_add_element(root, "LogCategories"), "Category", **ERROR_LOG_CATEGORY)
    _add_element(root, "DefaultExperiment", stepSize=block.step_size)


def add_units(root: Element, names: Collection[str]) -> None:
    """Append `UnitDefinitions` with the named units (Modelica syntax) to a model description.

    Nothing if there are none.
    """
    if not names:
        return
    definitions = _add_element(root, "UnitDefinitions")
    for name in sorted(names):
        unit = units.parse_unit(name)
        exponents = {
            base: exponent
            for base, exponent in zip(BASE_UNITS, unit.exponents, strict=True)
            if exponent
        }
        scale = {"factor": unit.factor if unit.factor != 1 else None, "offset": unit.offset or None}
        _add_element(_add_element(definitions, "Unit", name=name), "BaseUnit", **exponents, **scale)


def _declared_types(block: Block) -> dict[Any, str]:
    """Return the unique type name of each enumeration (a tuple of literals)."""
    names: dict[Any, str] = {}
    taken = {variable.name for variable in block.variables}
    for variable in block.variables:
        if variable.enumeration and variable.enumeration not in names:
            name = variable.type_name or f"{variable.name}_type"
            names[variable.enumeration] = f"{variable.name}_type" if name in taken else name
            taken.add(name)
    return names


def _add_enumerations(root: Element, block: Block, fmi_version: int) -> None:
    declared = _declared_types(block)
    if not declared:
        return
    definitions = _add_element(root, "TypeDefinitions")
    for literals, name in declared.items():
        if fmi_version == 2:
            enumeration = _add_element(
                _add_element(definitions, "SimpleType", name=name), "Enumeration"
            )
        else:
            enumeration = _add_element(definitions, "EnumerationType", name=name)
        for value, (literal, description) in enumerate(literals, start=1):
            _add_element(
                enumeration, "Item", name=literal, value=value, description=description or None
            )


def _common_attributes(reference: int, variable: BlockVariable) -> dict[str, Any]:
    return {
        "name": variable.name,
        "valueReference": reference,
        "description": variable.description or None,
        "causality": variable.causality,
        "variability": variable.variability,
        "initial": _initial(variable),
    }


def _initial(variable: BlockVariable) -> str | None:
    if variable.causality == "input":
        return None
    return (
        "exact"
        if variable.causality == "parameter" or variable.variability == "constant"
        else "calculated"
    )


def _type_attributes(variable: BlockVariable, declared: dict[Any, str]) -> dict[str, Any]:
    number = float if variable.type == "Float64" else int
    literals = len(variable.enumeration)
    minimum, maximum = (1, literals) if literals else (variable.minimum, variable.maximum)
    has_start = _initial(variable) != "calculated"
    return {
        "declaredType": declared.get(variable.enumeration),
        "quantity": variable.quantity or None if variable.type != "Boolean" else None,
        "unit": variable.unit or None if variable.type == "Float64" else None,
        "min": None if minimum is None else number(minimum),
        "max": None if maximum is None else number(maximum),
        "start": " ".join(
            _format_value({"Float64": float, "Boolean": bool}.get(variable.type, int)(value))
            for value in start_values(variable)
        )
        if has_start
        else None,
    }


def _output_indices(table: Sequence[TableRow]) -> list[int]:
    return [reference for reference, row in enumerate(table) if row.variable.causality == "output"]


def _initial_unknown_indices(table: Sequence[TableRow], states: Mapping[int, int]) -> list[int]:
    others = {*states, *states.values()}
    return [
        reference
        for reference, (variable, _) in enumerate(table)
        if (
            variable.causality in ("output", "calculatedParameter")
            and _initial(variable) == "calculated"
        )
        or reference in others
    ]


def _states_of_derivatives(block: Block, table: Sequence[TableRow]) -> dict[int, int]:
    """Return derivative -> state, as indices in the table and in the order of the states."""
    rows: dict[str, list[int]] = {}
    for index, row in enumerate(table):
        rows.setdefault(row.variable.member, []).append(index)
    members = {variable.name: variable.member for variable in block.variables}
    result: dict[int, int] = {}
    for state, derivative in block.exchange.states.items() if block.exchange else ():
        result.update(zip(rows[members[derivative]], rows[members[state]], strict=True))
    return result


def _add_element(parent: Element, tag: str, **attributes: Any) -> Element:
    return _set_attributes(ElementTree.SubElement(parent, tag), **attributes)


def _set_attributes(element: Element, **attributes: Any) -> Element:
    for name, value in attributes.items():
        if value is not None:
            element.set(name, _format_value(value))
    return element


def _format_value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(value)


DESCRIPTION_FILE = "modelDescription.xml"


def validate_description(description: bytes, source: Path) -> None:
    """Validate a modelDescription.xml with FMPy.

    FMPy's XML parser is not protected against entity expansion. Therefore the preflight parser,
    which rejects such documents, reads the description first.

    Args:
        description: The contents of the file.
        source: The source file that is named in the errors.

    Raises:
        InputError: The description is invalid (one problem for each error).
    """
    from fmpy import read_model_description
    from fmpy.model_description import ValidationError

    from ...components.fmi.preflight.findings import FatalFindingError, raise_errors
    from ...components.fmi.preflight.xml import parse_xml

    try:
        parse_xml(description, DESCRIPTION_FILE)
    except FatalFindingError as error:
        raise_errors(source, [error.finding])
    archive = BytesIO()
    with ZipFile(archive, "w") as file:
        file.writestr(DESCRIPTION_FILE, description)
    try:
        read_model_description(archive, validate_variable_names=True, validate_model_structure=True)
    except ValidationError as error:
        raise InputError([Problem(problem, str(source)) for problem in error.problems]) from None
