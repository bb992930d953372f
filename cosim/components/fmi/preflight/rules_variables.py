"""Rules about variables.

Names, causality, variability, value references, and references to other definitions.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import islice

from ....core.errors import did_you_mean
from .findings import DESCRIPTION_FILE, Finding, Rule
from .model_description import ALLOWED_INITIAL, ModelDescription, ModelVariable

_VARIABLES = "FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7"
_ATTRIBUTES = "FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7.4"
_TYPE_SPECIFIC = "FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7.5"
_UNITS = "FMI 2.0.5 section 2.2.2, FMI 3.0.2 section 2.4.3"

NAME = Rule("variable.name", _VARIABLES)
UNIQUE = Rule("variable.unique", _VARIABLES, "warning")
CONVENTION = Rule(
    "variable.convention", "FMI 2.0.5 section 2.2.9, FMI 3.0.2 section 2.4.7.5.1", "warning"
)
KIND = Rule("variable.type", _VARIABLES)
ATTRIBUTE_VALUE = Rule("variable.word", _ATTRIBUTES)
COMBINATION = Rule("variable.combination", _ATTRIBUTES, "warning")
CONTINUOUS = Rule("variable.continuous", _ATTRIBUTES, "warning")
IMPLIED = Rule("variable.implied-continuous", _ATTRIBUTES, "warning")
INITIAL_RULE = Rule("variable.initial", _TYPE_SPECIFIC, "warning")
INITIAL_NOT_ALLOWED = Rule("variable.initial-not-allowed", _TYPE_SPECIFIC, "warning")
INDEPENDENT = Rule("variable.independent", _ATTRIBUTES, "warning")
REFERENCE = Rule("reference.value", _ATTRIBUTES)
SHARED = Rule("reference.shared", _ATTRIBUTES)
ALIAS = Rule("reference.alias", _ATTRIBUTES, "warning")
DECLARED = Rule("variable.declared-type", _TYPE_SPECIFIC, "warning")
OTHER_TYPE = Rule("variable.other-type", _TYPE_SPECIFIC)
UNIT = Rule("variable.unit", _UNITS, "warning")
DISPLAY_UNIT = Rule("variable.display-unit", _UNITS, "warning")
DERIVATIVE = Rule("variable.derivative", _TYPE_SPECIFIC)
CLOCK = Rule("variable.clocks", "FMI 3.0.2 section 2.4.7.4")

_ATTRIBUTE_VALUES = {
    "causality": (
        "parameter",
        "calculatedParameter",
        "input",
        "output",
        "local",
        "independent",
        "structuralParameter",
    ),
    "variability": ("constant", "fixed", "tunable", "discrete", "continuous"),
    "initial": ("exact", "approx", "calculated"),
}
_NAME_PATTERN = (
    r"(?:[A-Za-z_][A-Za-z0-9_]*|'(?:[A-Za-z0-9_!#$%&()*+,\-./:;<>=?@\[\]^{}|~ "
    r"]|\\['\"?\\abfnrtv])+')(?:\[[0-9]+(?:,[0-9]+)*\])?"
)
_STRUCTURED_NAME = re.compile(
    rf"{_NAME_PATTERN}(?:\.{_NAME_PATTERN})*|der\({_NAME_PATTERN}(?:\.{_NAME_PATTERN})*(?:,[0-9]+)?\)"
)
#: largest number of names that are compared for a spelling hint, which is slow
_MAX_HINT_CANDIDATES = 200
#: types of FMI 2.0 whose value references share one number range with another type
_ACCESSOR_TYPES = {"Enumeration": "Int32"}


def check_identity(model: ModelDescription) -> Iterator[Finding]:
    """Check that variable names are printable, unique and follow the declared naming convention."""
    first_lines: dict[str, int] = {}
    is_structured = model.root.get("variableNamingConvention") == "structured"
    for name, line in _all_names(model):
        if not name or not name.isprintable():
            yield NAME(
                f'found the variable name "{name}", expected one without control characters',
                DESCRIPTION_FILE,
                line,
            )
        elif is_structured and not _STRUCTURED_NAME.fullmatch(name):
            yield CONVENTION(
                f'the name "{name}" does not follow the structured naming convention',
                DESCRIPTION_FILE,
                line,
            )
        if name in first_lines:
            text = (
                f'the variable name "{name}" is already used in line {first_lines[name]}; this one '
                "is ignored"
            )
            yield UNIQUE(text, DESCRIPTION_FILE, line)
        first_lines.setdefault(name, line)


def _all_names(model: ModelDescription) -> Iterator[tuple[str, int]]:
    for variable in model.variables:
        yield variable.name, variable.line
        for alias in variable.aliases:
            yield alias.get("name", ""), variable.line


def check_kinds(model: ModelDescription) -> Iterator[Finding]:
    """Check that type, causality, variability and initial are valid and allowed in combination."""
    for variable in model.variables:
        if not variable.kind:
            yield _variable_finding(KIND, variable, "has no type that this FMI version defines")
        invalid_values = list(_check_attribute_values(variable))
        yield from invalid_values
        if not invalid_values and variable.kind != "Clock":
            yield from _check_combination(model, variable)
    count = sum(variable.causality == "independent" for variable in model.variables)
    if count > 1 or (model.major == 3 and count == 0):
        yield INDEPENDENT(
            f"found {count} independent variables, expected one", DESCRIPTION_FILE, model.lines[""]
        )


def _check_attribute_values(variable: ModelVariable) -> Iterator[Finding]:
    for attribute, words in _ATTRIBUTE_VALUES.items():
        word = variable.attributes.get(attribute, words[0])
        if word not in words:
            yield _variable_finding(
                ATTRIBUTE_VALUE, variable, f'found {attribute}="{word}"{did_you_mean(word, words)}'
            )


def _check_combination(model: ModelDescription, variable: ModelVariable) -> Iterator[Finding]:
    causality, variability = variable.causality, variable.variability
    allowed = ALLOWED_INITIAL.get((causality, variability))
    if allowed is None:
        text = f'causality="{causality}" is not allowed with variability="{variability}"'
        yield _variable_finding(COMBINATION, variable, text)
        return
    if variability == "continuous" and variable.kind and not variable.is_float:
        text = (
            f'type {variable.kind} is not allowed with variability="continuous"; it is treated as '
            "discrete"
        )
        yield _variable_finding(CONTINUOUS, variable, text)
    if (
        model.major == 2
        and "variability" not in variable.attributes
        and variable.kind
        and not variable.is_float
    ):
        text = (
            f"lacks the attribute variability; its default is continuous, but {variable.kind} is "
            "treated as discrete"
        )
        yield _variable_finding(IMPLIED, variable, text)
    initial = variable.attributes.get("initial")
    if initial and (causality == "independent" or (causality == "input" and model.major == 2)):
        text = f'found initial="{initial}", expected none for causality="{causality}"'
        yield _variable_finding(INITIAL_NOT_ALLOWED, variable, text)
    elif initial and initial not in allowed:
        text = (
            f'initial="{initial}" is not allowed with causality="{causality}" and '
            f'variability="{variability}"'
        )
        yield _variable_finding(INITIAL_RULE, variable, text)


def check_references(model: ModelDescription) -> Iterator[Finding]:
    """Check value references: unique in FMI 3.0, shared only by aliases in FMI 2.0."""
    groups: dict[tuple[str, int], list[ModelVariable]] = defaultdict(list)
    for variable in model.variables:
        text = variable.attributes.get("valueReference", "")
        if not re.fullmatch(r"\s*\+?[0-9]{1,10}\s*", text) or int(text) >= 2**32:
            message = f'found valueReference="{text}", expected an integer from 0 to 4294967295'
            yield _variable_finding(REFERENCE, variable, message)
        else:
            kind = _ACCESSOR_TYPES.get(variable.kind, variable.kind) if model.major < 3 else ""
            groups[kind, int(text)].append(variable)
    for group in groups.values():
        if len(group) > 1 and model.major > 1:  # FMI 1.0 allows aliases of all variables
            yield from (
                _check_shared_references(group) if model.major == 3 else _check_aliases(group)
            )


def _check_shared_references(group: Sequence[ModelVariable]) -> Iterator[Finding]:
    for variable in group[1:]:
        text = f'has the same value reference as "{group[0].name}", expected a unique one'
        yield _variable_finding(SHARED, variable, text)


def _check_aliases(group: Sequence[ModelVariable]) -> Iterator[Finding]:
    settable = [variable for variable in group if variable.causality in ("input", "parameter")]
    for variable in settable[1:]:
        text = (
            f'has the same value reference as "{settable[0].name}", expected a unique one for each '
            "input and parameter"
        )
        yield _variable_finding(SHARED, variable, text)
    first = group[0]
    for variable in group[1:]:
        if (variable.variability == "constant") != (first.variability == "constant"):
            yield _variable_finding(
                ALIAS, variable, f'is an alias of "{first.name}", but only one of them is constant'
            )
        if variable.attribute("unit") != first.attribute("unit"):
            yield _variable_finding(
                ALIAS, variable, f'is an alias of "{first.name}", but has another unit'
            )


def check_declarations(model: ModelDescription) -> Iterator[Finding]:
    """Check that the declared types, units, states and clocks that variables refer to exist."""
    units = {unit.name: unit.display_units for unit in model.units}
    for variable in model.variables:
        yield from _check_declared_type(model, variable)
        yield from _check_units(variable, units)
        state = variable.attributes.get("derivative", "").strip()
        if state and (state not in model.by_reference or not model.by_reference[state].is_float):
            text = f'found derivative="{state}", expected a reference to a floating-point variable'
            yield _variable_finding(DERIVATIVE, variable, text)
        for clock in variable.attributes.get("clocks", "").split():
            if clock not in model.by_reference or model.by_reference[clock].kind != "Clock":
                yield _variable_finding(
                    CLOCK,
                    variable,
                    f'found "{clock}" in its clocks, expected a reference to a clock',
                )


def _check_declared_type(model: ModelDescription, variable: ModelVariable) -> Iterator[Finding]:
    name = variable.attributes.get("declaredType")
    if name is None:
        if variable.kind == "Enumeration" and model.major > 1:
            yield _variable_finding(DECLARED, variable, "is an enumeration without declaredType")
    elif variable.declared_type is None:
        hint = did_you_mean(
            name, (definition.name for definition in model.types[:_MAX_HINT_CANDIDATES])
        )
        yield _variable_finding(
            DECLARED, variable, f'found declaredType="{name}", which is not defined{hint}'
        )
    elif variable.kind and variable.declared_type.kind not in ("", variable.kind):
        text = (
            f'the type "{name}" is {variable.declared_type.kind}, but the variable is '
            f"{variable.kind}"
        )
        yield _variable_finding(OTHER_TYPE, variable, text)


def _check_units(variable: ModelVariable, units: dict[str, Sequence[str]]) -> Iterator[Finding]:
    if not variable.is_float:
        return
    unit, display = variable.attribute("unit"), variable.attributes.get("displayUnit")
    if unit is not None and unit not in units:
        hint = did_you_mean(unit, islice(units, _MAX_HINT_CANDIDATES))
        yield _variable_finding(UNIT, variable, f'the unit "{unit}" is not defined{hint}')
    elif display is not None and display not in units.get(unit or "", ()):
        yield _variable_finding(
            DISPLAY_UNIT,
            variable,
            f'the display unit "{display}" is not defined for unit "{unit or ""}"',
        )


def _variable_finding(rule: Rule, variable: ModelVariable, text: str) -> Finding:
    return rule(f"{variable}: {text}", DESCRIPTION_FILE, variable.line)


CHECKS = (check_identity, check_kinds, check_references, check_declarations)
