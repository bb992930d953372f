"""Rules about the model as a whole and its structure.

Names, interface, units, types, default experiment, log categories, outputs, continuous-time states
and initial unknowns.
"""

import math
import re
from collections.abc import Iterable, Iterator

from ....core.size_limits import MAX_SCALARS
from ....core.units import BASE_UNITS
from .model_description import (
    ModelDescription,
    ModelVariable,
    TypeDefinition,
    Unknown,
    Violation,
    parse_float,
    parse_value,
)

_C_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def check_names(model: ModelDescription) -> Iterator[Violation]:
    """Check the attributes of the root element and of the interfaces."""
    line = model.lines[""]
    attribute = "instantiationToken" if model.major == 3 else "guid"
    token = model.root.get(attribute)
    if token is None:
        yield "model.token", line, f"lacks the attribute {attribute}"
    elif not token:
        yield "model.empty-token", line, f"the attribute {attribute} is empty"
    if not model.root.get("modelName"):
        yield "model.name", line, "lacks the attribute modelName"
    if not model.interfaces:
        yield "model.interface", line, "offers neither Co-Simulation nor Model Exchange"
    for name, attributes in model.interfaces.items():
        element = "CoSimulation" if name == "co-simulation" else "ModelExchange"
        line = model.lines["" if model.major == 1 else element]
        identifier = attributes.get("modelIdentifier", "")
        if not identifier or not {"/", "\\"}.isdisjoint(identifier):
            yield (
                "model.library-name",
                line,
                f'found modelIdentifier "{identifier}", expected a file name',
            )
        elif not _C_IDENTIFIER.fullmatch(identifier):
            yield (
                "model.identifier",
                line,
                f'found modelIdentifier "{identifier}", expected a C identifier',
            )


def check_units(model: ModelDescription) -> Iterator[Violation]:
    """Check that unit names are unique, and the numbers of base units are valid."""
    for name, line in _find_duplicates((unit.name, unit.line) for unit in model.units):
        yield "unit.unique", line, f'the unit "{name}" is defined twice'
    for unit in model.units:
        for name, text in (unit.base_unit or {}).items():
            if not _is_valid_base_unit_value(name, text):
                expected = "an integer" if name in BASE_UNITS else "a finite number, a factor not 0"
                text = f'unit "{unit.name}": found {name}="{text}", expected {expected}'
                yield "unit.base", unit.line, text


def _is_valid_base_unit_value(name: str, text: str) -> bool:
    try:
        if name in BASE_UNITS:
            int(text)
            return True
        value = parse_float(text)
    except ValueError:
        return False
    return math.isfinite(value) and not (name == "factor" and value == 0)


def check_types(model: ModelDescription) -> Iterator[Violation]:
    """Check that types have unique names, are defined by FMI, and have valid items."""
    for name, line in _find_duplicates(
        (definition.name, definition.line) for definition in model.types
    ):
        yield "type.unique", line, f'the type "{name}" is defined twice'
    for definition in model.types:
        if not definition.kind:
            text = f'the type "{definition.name}" is not of a type defined by FMI'
            yield "type.kind", definition.line, text
        for message in _item_violations(definition):
            yield "type.items", definition.line, message
        if definition.kind == "Enumeration" and not definition.items:
            yield "type.kind", definition.line, f'the enumeration "{definition.name}" has no items'


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


def check_counts(model: ModelDescription) -> Iterator[Violation]:
    """Check the numbers of states and event indicators of FMI 1.0 and 2.0."""
    if "model-exchange" not in model.interfaces or model.major == 3:
        return
    for name in ("numberOfContinuousStates", "numberOfEventIndicators"):
        text = model.root.get(name, "0")
        if not (
            text.isascii() and text.isdecimal() and len(text) < 10 and int(text) <= MAX_SCALARS
        ):
            found = f'found {name}="{text}", expected an integer from 0 to {MAX_SCALARS}'
            yield "model.count", model.lines[""], found


def check_experiment(model: ModelDescription) -> Iterator[Violation]:
    """Check that the values of the default experiment are finite and consistent."""
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
            yield "experiment.value", line, f'found {name}="{text}", expected a finite number'
    start, stop = numbers.get("startTime", 0.0), numbers.get("stopTime", math.inf)
    if stop <= start:
        text = f"found stopTime {stop:g}, expected more than the startTime {start:g}"
        yield "experiment.order", line, text
    for name in ("stepSize", "tolerance"):
        if numbers.get(name, 1.0) <= 0:
            yield "experiment.order", line, f"found {name} {numbers[name]:g}, expected more than 0"


def check_categories(model: ModelDescription) -> Iterator[Violation]:
    """Check that log categories are unique."""
    for name, _ in _find_duplicates((name, 0) for name in model.log_categories):
        yield (
            "categories.unique",
            model.lines["LogCategories"],
            f'the log category "{name}" occurs twice',
        )


def _find_duplicates(names: Iterable[tuple[str, int]]) -> Iterator[tuple[str, int]]:
    """Yield each (name, line) whose name occurred before."""
    seen: set[str] = set()
    for name, line in names:
        if name in seen:
            yield name, line
        seen.add(name)


CHECKS = (check_names, check_units, check_types, check_counts, check_experiment, check_categories)


_VALID_KINDS = ("dependent", "constant", "fixed", "tunable", "discrete")


def check_references(model: ModelDescription) -> Iterator[Violation]:
    """Check the references of the model structure.

    Elements refer to existing variables, occur once, and have one kind for each dependency.
    """
    seen: set[tuple[str, str]] = set()
    for unknown in model.model_structure:
        for reference in (unknown.reference.strip(), *(unknown.dependencies or ())):
            if reference not in model.by_reference:
                text = f'{unknown.element} refers to variable "{reference}", which does not exist'
                yield "structure.reference", unknown.line, text
        if (unknown.element, unknown.reference) in seen:
            yield (
                "structure.unique",
                unknown.line,
                f'{unknown.element} "{unknown.reference}" occurs twice',
            )
        seen.add((unknown.element, unknown.reference))
        yield from _check_dependency_kinds(unknown)


def _check_dependency_kinds(unknown: Unknown) -> Iterator[Violation]:
    if unknown.dependency_kinds is None:
        return
    if unknown.dependencies is None or len(unknown.dependency_kinds) != len(unknown.dependencies):
        count = "no" if unknown.dependencies is None else len(unknown.dependencies)
        text = (
            f"{unknown.element} has {len(unknown.dependency_kinds)} dependenciesKind for {count} "
            "dependencies"
        )
        yield "structure.dependencies", unknown.line, text
    for kind in unknown.dependency_kinds:
        if kind not in _VALID_KINDS:
            text = f'found "{kind}", expected one of {", ".join(_VALID_KINDS)}'
            yield "structure.dependencies", unknown.line, text


def check_completeness(model: ModelDescription) -> Iterator[Violation]:
    """Check that each list of the model structure contains exactly the required variables."""
    if model.major == 1:
        return  # it has no model structure
    derivatives = _variables_in(model, "ContinuousStateDerivative")
    outputs = [variable for variable in model.variables if variable.causality == "output"]
    yield from _check_list("structure.outputs", "output", _variables_in(model, "Output"), outputs)
    for variable in derivatives:
        if "derivative" not in variable.attributes:
            text = f"{variable}: is listed as derivative but has no attribute derivative"
            yield "structure.derivatives", variable.line, text
    unknowns = _initial_unknowns(model, derivatives)
    yield from _check_list(
        "structure.initial-unknowns",
        "initial unknown",
        _variables_in(model, "InitialUnknown"),
        unknowns,
    )


def _variables_in(model: ModelDescription, element: str) -> list[ModelVariable]:
    references = (
        unknown.reference.strip() for unknown in model.model_structure if unknown.element == element
    )
    return [
        model.by_reference[reference] for reference in references if reference in model.by_reference
    ]


def _initial_unknowns(
    model: ModelDescription, derivatives: list[ModelVariable]
) -> list[ModelVariable]:
    """Return the variables that are computed in initialization mode.

    These are outputs, calculated parameters, states and state derivatives.
    """
    states = [
        model.by_reference.get(variable.attributes.get("derivative", "").strip())
        for variable in derivatives
    ]
    dynamic = [
        variable
        for variable in (*states, *derivatives)
        if variable is not None and _is_computed(variable)
    ]
    outputs = [
        v
        for v in model.variables
        if v.causality == "output" and _is_computed(v) and "clocks" not in v.attributes
    ]
    return [
        *outputs,
        *(v for v in model.variables if v.causality == "calculatedParameter"),
        *dynamic,
    ]


def _is_computed(variable: ModelVariable) -> bool:
    return variable.initial in ("approx", "calculated")


def _check_list(
    rule: str, role: str, listed: list[ModelVariable], expected: list[ModelVariable]
) -> Iterator[Violation]:
    listed_lines = {v.name: v.line for v in listed}
    expected_lines = {v.name: v.line for v in expected}
    for name in (name for name in expected_lines if name not in listed_lines):
        text = (
            f'variable "{name}": is an {role} but is missing in the {role}s of the model structure'
        )
        yield rule, expected_lines[name], text
    for name in (name for name in listed_lines if name not in expected_lines):
        text = (
            f'variable "{name}": is listed in the {role}s of the model structure but is not an '
            f"{role}"
        )
        yield rule, listed_lines[name], text


STRUCTURE_CHECKS = (check_references, check_completeness)
