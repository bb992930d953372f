"""Rules about the model as a whole.

Names, interface, units, types, default experiment and log categories.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator

from ....core.size_limits import MAX_SCALARS
from ....core.unit_table import BASE_UNITS
from .findings import DESCRIPTION_FILE, Finding, Rule
from .model_description import ModelDescription, TypeDefinition, UnitDefinition
from .values import parse_float, parse_value

_ROOT = "FMI 2.0.5 section 2.2.1, FMI 3.0.2 section 2.4.1"
_INTERFACE = "FMI 2.0.5 section 4.3.1, FMI 3.0.2 sections 2.4.2 and 4.4"
_UNITS = "FMI 2.0.5 section 2.2.2, FMI 3.0.2 section 2.4.3"
_TYPES = "FMI 2.0.5 section 2.2.3, FMI 3.0.2 section 2.4.4"
_CATEGORIES = "FMI 2.0.5 section 2.2.4, FMI 3.0.2 section 2.4.5"
_EXPERIMENT = "FMI 2.0.5 section 2.2.5, FMI 3.0.2 section 2.4.6"

NAME = Rule("model.name", _ROOT, "warning")
TOKEN = Rule("model.token", _ROOT)
EMPTY_TOKEN = Rule("model.empty-token", _ROOT, "warning")
INTERFACE = Rule("model.interface", _INTERFACE)
LIBRARY_NAME = Rule("model.library-name", _INTERFACE)
IDENTIFIER = Rule("model.identifier", _INTERFACE, "warning")
COUNT = Rule("model.count", "FMI 1.0 ME section 3.1, FMI 2.0.5 section 2.2.1")
UNIT_NAME = Rule("unit.unique", _UNITS)
UNIT_BASE = Rule("unit.base", _UNITS)
TYPE_NAME = Rule("type.unique", _TYPES)
TYPE_KIND = Rule("type.kind", _TYPES, "warning")
ITEMS = Rule("type.items", _TYPES)
EXPERIMENT_VALUE = Rule("experiment.value", _EXPERIMENT, "warning")
EXPERIMENT = Rule("experiment.order", _EXPERIMENT, "warning")
CATEGORIES = Rule("categories.unique", _CATEGORIES, "warning")

_C_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def check_names(model: ModelDescription) -> Iterator[Finding]:
    """Check the attributes of the root element and of the interfaces."""
    line = model.lines[""]
    attribute = "instantiationToken" if model.major == 3 else "guid"
    token = model.root.get(attribute)
    if token is None:
        yield TOKEN(f"lacks the attribute {attribute}", DESCRIPTION_FILE, line)
    elif not token:
        yield EMPTY_TOKEN(f"the attribute {attribute} is empty", DESCRIPTION_FILE, line)
    if not model.root.get("modelName"):
        yield NAME("lacks the attribute modelName", DESCRIPTION_FILE, line)
    if not model.interfaces:
        yield INTERFACE("offers neither Co-Simulation nor Model Exchange", DESCRIPTION_FILE, line)
    for name, attributes in model.interfaces.items():
        line = model.lines[
            ""
            if model.major == 1
            else "CoSimulation"
            if name == "co-simulation"
            else "ModelExchange"
        ]
        identifier = attributes.get("modelIdentifier", "")
        if not identifier or not {"/", "\\"}.isdisjoint(identifier):
            yield LIBRARY_NAME(
                f'found modelIdentifier "{identifier}", expected a file name',
                DESCRIPTION_FILE,
                line,
            )
        elif not _C_IDENTIFIER.fullmatch(identifier):
            yield IDENTIFIER(
                f'found modelIdentifier "{identifier}", expected a C identifier',
                DESCRIPTION_FILE,
                line,
            )


def check_units(model: ModelDescription) -> Iterator[Finding]:
    """Check that unit names are unique, and that base units have valid exponents, factors and offsets."""
    for name, line in _find_duplicates((unit.name, unit.line) for unit in model.units):
        yield UNIT_NAME(f'the unit "{name}" is defined twice', DESCRIPTION_FILE, line)
    for unit in model.units:
        yield from _check_unit_base(unit)


def _check_unit_base(unit: UnitDefinition) -> Iterator[Finding]:
    for name, text in (unit.base_unit or {}).items():
        if not _is_valid_base_unit_value(name, text):
            expected = "an integer" if name in BASE_UNITS else "a finite number, a factor not 0"
            yield UNIT_BASE(
                f'unit "{unit.name}": found {name}="{text}", expected {expected}',
                DESCRIPTION_FILE,
                unit.line,
            )


def _is_valid_base_unit_value(name: str, text: str) -> bool:
    try:
        if name in BASE_UNITS:
            int(text)
            return True
        value = parse_float(text)
    except ValueError:
        return False
    return math.isfinite(value) and not (name == "factor" and value == 0)


def check_types(model: ModelDescription) -> Iterator[Finding]:
    """Check that type names are unique, that types are defined by FMI, and that enumerations have valid items."""
    for name, line in _find_duplicates(
        (definition.name, definition.line) for definition in model.types
    ):
        yield TYPE_NAME(f'the type "{name}" is defined twice', DESCRIPTION_FILE, line)
    for definition in model.types:
        if not definition.kind:
            yield TYPE_KIND(
                f'the type "{definition.name}" is not of a type defined by FMI',
                DESCRIPTION_FILE,
                definition.line,
            )
        for message in _item_violations(definition):
            yield ITEMS(message, DESCRIPTION_FILE, definition.line)
        if definition.kind == "Enumeration" and not definition.items:
            yield TYPE_KIND(
                f'the enumeration "{definition.name}" has no items',
                DESCRIPTION_FILE,
                definition.line,
            )


def _item_violations(definition: TypeDefinition) -> Iterator[str]:
    names, values = [name for name, _ in definition.items], [value for _, value in definition.items]
    for label, words in (("item", names), ("value", values)):
        for word, _ in _find_duplicates((word, 0) for word in words):
            yield f'the {label} "{word}" of enumeration "{definition.name}" occurs twice'
    for name, value in definition.items:
        try:
            parse_value(value, "Int64")
        except ValueError:
            yield (
                f'the item "{name}" of enumeration "{definition.name}" is "{value}", expected an '
                "integer"
            )


def check_counts(model: ModelDescription) -> Iterator[Finding]:
    """Check the numbers of states and event indicators that FMI 1.0 and 2.0 declare for Model Exchange."""
    if "model-exchange" not in model.interfaces or model.major == 3:
        return
    for name in ("numberOfContinuousStates", "numberOfEventIndicators"):
        text = model.root.get(name, "0")
        if not (
            text.isascii() and text.isdecimal() and len(text) < 10 and int(text) <= MAX_SCALARS
        ):
            found = f'found {name}="{text}", expected an integer from 0 to {MAX_SCALARS}'
            yield COUNT(found, DESCRIPTION_FILE, model.lines[""])


def check_experiment(model: ModelDescription) -> Iterator[Finding]:
    """Check that the values of the default experiment are finite, and that stop time, step size and tolerance are consistent."""
    line = model.lines.get("DefaultExperiment", 0)
    numbers: dict[str, float] = {}
    for name in ("startTime", "stopTime", "stepSize", "tolerance"):
        if (text := model.default_experiment.get(name)) is None:
            continue
        try:
            numbers[name] = parse_float(text)
        except ValueError:
            numbers[name] = math.nan
        if not math.isfinite(numbers[name]):
            yield EXPERIMENT_VALUE(
                f'found {name}="{text}", expected a finite number', DESCRIPTION_FILE, line
            )
    start, stop = numbers.get("startTime", 0.0), numbers.get("stopTime", math.inf)
    if stop <= start:
        yield EXPERIMENT(
            f"found stopTime {stop:g}, expected more than the startTime {start:g}",
            DESCRIPTION_FILE,
            line,
        )
    for name in ("stepSize", "tolerance"):
        if numbers.get(name, 1.0) <= 0:
            yield EXPERIMENT(
                f"found {name} {numbers[name]:g}, expected more than 0", DESCRIPTION_FILE, line
            )


def check_categories(model: ModelDescription) -> Iterator[Finding]:
    """Check that log categories are unique."""
    for name, _ in _find_duplicates((name, 0) for name in model.log_categories):
        yield CATEGORIES(
            f'the log category "{name}" occurs twice',
            DESCRIPTION_FILE,
            model.lines["LogCategories"],
        )


def _find_duplicates(names: Iterable[tuple[str, int]]) -> Iterator[tuple[str, int]]:
    """Yield each (name, line) whose name occurred before."""
    seen: set[str] = set()
    for name, line in names:
        if name in seen:
            yield name, line
        seen.add(name)


CHECKS = (check_names, check_units, check_types, check_counts, check_experiment, check_categories)
