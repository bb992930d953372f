"""modelDescription.xml -> Model."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from .findings import DESCRIPTION_FILE, FatalFinding, Finding, Rule
from .model_description import ModelDescription, ModelVariable, TypeDefinition, UnitDefinition, Unknown

_ROOT = "FMI 2.0.5 section 2.2.1, FMI 3.0.2 section 2.4.1"
ROOT = Rule("model.root", _ROOT)
VERSION = Rule("model.version", _ROOT)
REPEATED = Rule("model.repeated", _ROOT)

TYPE_NAMES = {
    2: {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String", "Enumeration": "Enumeration"},
    3: {
        **{f"Float{bits}": f"Float{bits}" for bits in (32, 64)},
        **{f"{sign}Int{bits}": f"{sign}Int{bits}" for bits in (8, 16, 32, 64) for sign in ("", "U")},
        **{name: name for name in ("Boolean", "String", "Binary", "Enumeration", "Clock")},
    },
}
#: lists of the model structure -> their path in it
_FMI2_GROUPS = {
    "Output": "Outputs/Unknown",
    "ContinuousStateDerivative": "Derivatives/Unknown",
    "InitialUnknown": "InitialUnknowns/Unknown",
}
_FMI3_GROUPS = {
    name: name for name in ("Output", "ContinuousStateDerivative", "ClockedState", "InitialUnknown", "EventIndicator")
}
_FIXED_CAUSALITIES = ("parameter", "calculatedParameter", "structuralParameter")
#: no "3.0-beta": the C functions changed until 3.0
_SUPPORTED_VERSION = re.compile(r"2\.0(\.[0-9]+)?|3\.[0-9]+(\.[0-9]+)?")


def read_model(root: Any) -> ModelDescription:
    """The model description below a root element. Raises Flaw when it is of no FMI version that cosim knows."""
    if root.tag != "fmiModelDescription":
        raise FatalFinding(ROOT(f"found <{root.tag}>, expected <fmiModelDescription>", DESCRIPTION_FILE, root.sourceline))
    version = root.get("fmiVersion", "of unknown version")
    if not _SUPPORTED_VERSION.fullmatch(version):
        text = f"is an FMI {version} FMU; FMI 2.0 and 3.0 are supported"
        raise FatalFinding(VERSION(text, DESCRIPTION_FILE, root.sourceline))
    major = int(version[0])
    interface = root.find("CoSimulation")
    types = [_read_type(element, major) for element in root.iterfind("TypeDefinitions/*")]
    declared = {definition.name: definition for definition in types}
    return ModelDescription(
        major,
        _read_attributes(root),
        None if interface is None else _read_attributes(interface),
        _read_attributes(root.find("DefaultExperiment")),
        [_read_variable(element, major, declared) for element in root.iterfind("ModelVariables/*")],
        types,
        [_read_unit(element) for element in root.iterfind("UnitDefinitions/Unit")],
        list(_read_structure(root, major)),
        [element.get("name", "") for element in root.iterfind("LogCategories/Category")],
        {"": root.sourceline} | {element.tag: element.sourceline for element in root},
    )


def check_repeated_elements(root: Any) -> Iterator[Finding]:
    """Elements of which a second reader might take the other one."""
    counts = Counter(element.tag for element in root)
    for tag, count in counts.items():
        if count > 1:
            yield REPEATED(f"<{tag}> stands {count} times, expected once", DESCRIPTION_FILE, root.find(tag).sourceline)


def _read_attributes(element: Any) -> dict[str, str]:
    return {} if element is None else dict(element.items())


def _read_type(element: Any, major: int) -> TypeDefinition:
    typed = element
    if major == 2:
        typed = next((child for child in element if child.tag in TYPE_NAMES[2]), element)
    kind = TYPE_NAMES[major].get(typed.tag if major == 2 else typed.tag.removesuffix("Type"), "")
    items = [(item.get("name", ""), item.get("value", "")) for item in typed.iterfind("Item")]
    return TypeDefinition(
        element.get("name", ""), kind, _read_attributes(typed) | _read_attributes(element), items, element.sourceline
    )


def _read_variable(element: Any, major: int, declared: Mapping[str, TypeDefinition]) -> ModelVariable:
    typed = element
    if major == 2:
        typed = next((child for child in element if child.tag in TYPE_NAMES[2]), element)
    attributes = _read_attributes(typed) | _read_attributes(element)
    kind = TYPE_NAMES[major].get(typed.tag, "")
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
        declared.get(attributes.get("declaredType", "")),
    )


def _default_variability(kind: str, causality: str, major: int) -> str:
    if major == 3 and causality in _FIXED_CAUSALITIES:
        return "fixed"
    return "continuous" if kind.startswith("Float") else "discrete"


def _read_starts(element: Any, kind: str, text: str | None, major: int) -> Sequence[str] | None:
    """Words of an attribute; FMI 3.0 strings and binaries have elements of their own, one for each value."""
    if kind in ("String", "Binary") and major == 3:
        return [child.get("value", "") for child in element.iterfind("Start")] or None
    if text is None:
        return None
    return [text] if kind == "String" else text.split()


def _read_unit(element: Any) -> UnitDefinition:
    base = element.find("BaseUnit")
    display = [child.get("name", "") for child in element.iterfind("DisplayUnit")]
    return UnitDefinition(element.get("name", ""), None if base is None else _read_attributes(base), display, element.sourceline)


def _read_structure(root: Any, major: int) -> Iterator[Unknown]:
    for group, path in (_FMI2_GROUPS if major == 2 else _FMI3_GROUPS).items():
        for element in root.iterfind(f"ModelStructure/{path}"):
            yield _read_unknown(element, group, "index" if major == 2 else "valueReference")


def _read_unknown(element: Any, group: str, attribute: str) -> Unknown:
    words = [None if (text := element.get(name)) is None else text.split() for name in ("dependencies", "dependenciesKind")]
    return Unknown(group, element.get(attribute, ""), words[0], words[1], element.sourceline)
