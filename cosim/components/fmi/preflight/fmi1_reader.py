"""Words of FMI 1.0 model descriptions in those of FMI 2.0."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from .model_description import Interface, UnitDefinition

#: causality and variability of FMI 1.0 that have another name in FMI 2.0
_CAUSALITIES = {"internal": "local", "none": "local"}
_STAND_ALONE, _TOOL = "CoSimulation_StandAlone", "CoSimulation_Tool"


def translate_variable(attributes: Mapping[str, str]) -> dict[str, str]:
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


def read_interfaces(root: Any) -> dict[Interface, dict[str, str]]:
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
    capabilities = stand_alone.find("Capabilities")
    return {
        "co-simulation": {
            **({} if capabilities is None else dict(capabilities.items())),
            **identifier,
        }
    }


def read_units(root: Any) -> Iterator[UnitDefinition]:
    """Read the units, of which FMI 1.0 gives only the names.

    Args:
        root: Root element of modelDescription.xml.
    """
    for element in root.iterfind("UnitDefinitions/BaseUnit"):
        display = [
            child.get("displayUnit", "") for child in element.iterfind("DisplayUnitDefinition")
        ]
        yield UnitDefinition(element.get("unit", ""), None, display, element.sourceline)
