"""Conversion of the XML elements of modelDescription.xml to a `ModelDescription`."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ....core.component import DTYPES
from .findings import DESCRIPTION_FILE, FatalFindingError, Finding
from .model_description import (
    Interface,
    ModelDescription,
    ModelVariable,
    TypeDefinition,
    UnitDefinition,
    Unknown,
)

#: causality and variability of FMI 1.0 that have another name in FMI 2.0
_CAUSALITIES = {"internal": "local", "none": "local"}
_STAND_ALONE, _TOOL = "CoSimulation_StandAlone", "CoSimulation_Tool"


def _translate_fmi1_variable(attributes: Mapping[str, str]) -> dict[str, str]:
    """Translate causality and variability of a variable.

    A negated alias of an input or parameter becomes a local variable, because it cannot be set
    without a change of its sign.

    Args:
        attributes: XML attributes of the variable and of its type element.
    """
    causality = attributes.get("causality", "internal")
    variability = attributes.get("variability", "continuous")
    causality = _CAUSALITIES.get(causality, causality)
    if variability == "parameter":
        causality, variability = (
            ("output", "discrete") if causality == "output" else ("parameter", "fixed")
        )
    elif variability == "constant" and causality == "input":
        causality = "local"
    if attributes.get("alias") == "negatedAlias" and causality in ("input", "parameter"):
        causality, variability = "local", "fixed" if variability == "fixed" else "discrete"
    return {**attributes, "causality": causality, "variability": variability}


def _read_fmi1_interfaces(root: Any) -> dict[Interface, dict[str, str]]:
    """Read the interface of an FMU.

    An FMI 1.0 FMU has exactly one, none if it only starts its tool.

    Args:
        root: Root element of modelDescription.xml.
    """
    identifier = {"modelIdentifier": root.get("modelIdentifier", "")}
    if (implementation := root.find("Implementation")) is None:
        return {"model-exchange": identifier}
    if (stand_alone := implementation.find(_STAND_ALONE)) is None:
        return {}
    return {"co-simulation": _read_attributes(stand_alone.find("Capabilities")) | identifier}


def _read_fmi1_units(root: Any) -> Iterator[UnitDefinition]:
    """Read the units, of which FMI 1.0 gives only the names.

    Args:
        root: Root element of modelDescription.xml.
    """
    for element in root.iterfind("UnitDefinitions/BaseUnit"):
        display = [
            child.get("displayUnit", "") for child in element.iterfind("DisplayUnitDefinition")
        ]
        yield UnitDefinition(element.get("unit", ""), None, display, element.sourceline)


#: names of type elements -> FMI 3.0 type names, by FMI major version
_FMI2_TYPES = {
    "Real": "Float64",
    "Integer": "Int32",
    "Boolean": "Boolean",
    "String": "String",
    "Enumeration": "Enumeration",
}
TYPE_NAMES = {1: _FMI2_TYPES, 2: _FMI2_TYPES, 3: {name: name for name in DTYPES}}
#: FMI 3.0 names of the elements of the model structure -> their path in it
_FMI2_STRUCTURE = {
    "Output": "Outputs/Unknown",
    "ContinuousStateDerivative": "Derivatives/Unknown",
    "InitialUnknown": "InitialUnknowns/Unknown",
}
_FMI3_STRUCTURE = {
    name: name
    for name in (
        "Output",
        "ContinuousStateDerivative",
        "ClockedState",
        "InitialUnknown",
        "EventIndicator",
    )
}
#: elements of the interfaces, the preferred one first
_INTERFACES: Mapping[Interface, str] = {
    "co-simulation": "CoSimulation",
    "model-exchange": "ModelExchange",
}
_FIXED_CAUSALITIES = ("parameter", "calculatedParameter", "structuralParameter")
#: without "3.0-beta", because the C functions changed until 3.0
_SUPPORTED_VERSION = re.compile(r"1\.0|2\.0(\.[0-9]+)?|3\.[0-9]+(\.[0-9]+)?")


def read_model(root: Any) -> ModelDescription:
    """Read a model description.

    Args:
        root: Root element of modelDescription.xml.

    Raises:
        FatalFindingError: The root element is not a model description of a supported FMI version.
    """
    if root.tag != "fmiModelDescription":
        raise FatalFindingError(
            "model.root",
            f"found <{root.tag}>, expected <fmiModelDescription>",
            DESCRIPTION_FILE,
            root.sourceline,
        )
    version = root.get("fmiVersion")
    if version is None or not _SUPPORTED_VERSION.fullmatch(version):
        found = "lacks the attribute fmiVersion"
        if version is not None:
            pre_release = ", a pre-release, whose C functions differ" if "-" in version else ""
            found = f"is an FMI {version} FMU{pre_release}"
        raise FatalFindingError(
            "model.version",
            f"{found}; FMI 1.0, 2.0 and 3.0 are supported",
            DESCRIPTION_FILE,
            root.sourceline,
        )
    major = int(version[0])
    types = [_read_type(element, major) for element in root.iterfind("TypeDefinitions/*")]
    types_by_name = {definition.name: definition for definition in types}
    return ModelDescription(
        major,
        _read_attributes(root),
        _read_fmi1_interfaces(root) if major == 1 else _read_interfaces(root),
        _read_attributes(root.find("DefaultExperiment")),
        [
            _read_variable(element, major, types_by_name)
            for element in root.iterfind("ModelVariables/*")
        ],
        types,
        list(
            _read_fmi1_units(root)
            if major == 1
            else map(_read_unit, root.iterfind("UnitDefinitions/Unit"))
        ),
        list(_read_structure(root, major)),
        [element.get("name", "") for element in root.iterfind("LogCategories/Category")],
        {"": root.sourceline} | {element.tag: element.sourceline for element in root},
    )


def _read_interfaces(root: Any) -> dict[Interface, dict[str, str]]:
    return {
        name: _read_attributes(root.find(tag))
        for name, tag in _INTERFACES.items()
        if root.find(tag) is not None
    }


def check_repeated_elements(root: Any) -> Iterator[Finding]:
    """Find elements that occur several times, because other tools may read another one of them.

    Args:
        root: Root element of modelDescription.xml.
    """
    counts = Counter(element.tag for element in root)
    for tag, count in counts.items():
        if count > 1:
            yield Finding(
                "model.repeated",
                f"<{tag}> occurs {count} times, expected once",
                DESCRIPTION_FILE,
                root.find(tag).sourceline,
            )


def _read_attributes(element: Any) -> dict[str, str]:
    return {} if element is None else dict(element.items())


def _type_element(element: Any, major: int) -> Any:
    """Return the element with the type of a variable or type definition.

    A child in FMI 2.0, the element itself in FMI 3.0.
    """
    if major < 3:
        for child in element:
            if child.tag.removesuffix("Type") in _FMI2_TYPES:
                return child
    return element


def _read_type(element: Any, major: int) -> TypeDefinition:
    type_element = _type_element(element, major)
    kind = TYPE_NAMES[major].get(
        type_element.tag if major == 2 else type_element.tag.removesuffix("Type"), ""
    )
    attributes = _read_attributes(type_element) | _read_attributes(element)
    numbered = enumerate(type_element.iterfind("Item"), 1)  # FMI 1.0 has no values
    items = [
        (item.get("name", ""), item.get("value", str(n) if major == 1 else ""))
        for n, item in numbered
    ]
    return TypeDefinition(element.get("name", ""), kind, attributes, items, element.sourceline)


def _read_variable(
    element: Any, major: int, types_by_name: Mapping[str, TypeDefinition]
) -> ModelVariable:
    type_element = _type_element(element, major)
    attributes = _read_attributes(type_element) | _read_attributes(element)
    if major == 1:
        attributes = _translate_fmi1_variable(attributes)
    kind = TYPE_NAMES[major].get(type_element.tag, "")
    causality = attributes.get("causality", "local")
    return ModelVariable(
        attributes.get("name", ""),
        kind,
        causality,
        attributes.get("variability") or _default_variability(kind, causality, major),
        attributes,
        _read_starts(element, kind, attributes.get("start"), major),
        [_read_attributes(child) for child in element.iterfind("Dimension")],
        [_read_attributes(child) for child in element.iterfind("Alias")],
        element.sourceline,
        types_by_name.get(attributes.get("declaredType", "")),
    )


def _default_variability(kind: str, causality: str, major: int) -> str:
    if major == 3 and causality in _FIXED_CAUSALITIES:
        return "fixed"
    return "continuous" if kind.startswith("Float") else "discrete"


def _read_starts(element: Any, kind: str, text: str | None, major: int) -> Sequence[str] | None:
    """Return the words of a start value.

    String and Binary variables of FMI 3.0 have one element per value.
    """
    if kind in ("String", "Binary") and major == 3:
        values = [child.get("value", "") for child in element.iterfind("Start")]
        if not values and text is not None and kind == "String":
            values = [text]  # Dymola 2023x writes an attribute
        return values or None
    if text is None:
        return None
    return [text] if kind == "String" else text.split()


def _read_unit(element: Any) -> UnitDefinition:
    base = element.find("BaseUnit")
    base_unit = None if base is None else dict(base.items())
    display = [child.get("name", "") for child in element.iterfind("DisplayUnit")]
    return UnitDefinition(element.get("name", ""), base_unit, display, element.sourceline)


def _read_structure(root: Any, major: int) -> Iterator[Unknown]:
    paths, attribute = _FMI2_STRUCTURE, "index"
    if major == 3:
        paths, attribute = _FMI3_STRUCTURE, "valueReference"
    for name, path in paths.items():
        for element in root.iterfind(f"ModelStructure/{path}"):
            reference = element.get(attribute, "")
            dependencies = _words(element.get("dependencies"))
            kinds = _words(element.get("dependenciesKind"))
            yield Unknown(name, reference, dependencies, kinds, element.sourceline)


def _words(text: str | None) -> list[str] | None:
    return None if text is None else text.split()
