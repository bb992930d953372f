"""Rules about the model structure: which variables are outputs, states and unknowns of the initialization."""

from __future__ import annotations

from collections.abc import Iterator

from .findings import DESCRIPTION_FILE, Finding, Rule
from .model_description import ModelDescription, ModelVariable, Unknown

_STRUCTURE = "FMI 2.0.5 section 2.2.8, FMI 3.0.2 section 2.4.8"
UNRESOLVED = Rule("structure.reference", _STRUCTURE)
DEPENDENCY_KINDS = Rule("structure.dependencies", _STRUCTURE, "warning")
DUPLICATE = Rule("structure.unique", _STRUCTURE, "warning")
OUTPUTS = Rule("structure.outputs", _STRUCTURE, "warning")
DERIVATIVES = Rule("structure.derivatives", _STRUCTURE, "warning")
UNKNOWNS = Rule("structure.initial-unknowns", _STRUCTURE, "warning")

_VALID_KINDS = ("dependent", "constant", "fixed", "tunable", "discrete")


def check_references(model: ModelDescription) -> Iterator[Finding]:
    """References lead to variables, once in each list; dependencies and their kinds come in pairs."""
    seen: set[tuple[str, str]] = set()
    for unknown in model.model_structure:
        for reference in (unknown.reference.strip(), *(unknown.dependencies or ())):
            if reference not in model.by_reference:
                text = (
                    f'{unknown.element} refers to variable "{reference}", expected one of the {len(model.variables)} that exist'
                )
                yield UNRESOLVED(text, DESCRIPTION_FILE, unknown.line)
        if (unknown.element, unknown.reference) in seen:
            yield DUPLICATE(f'{unknown.element} "{unknown.reference}" stands twice', DESCRIPTION_FILE, unknown.line)
        seen.add((unknown.element, unknown.reference))
        yield from _check_dependency_kinds(unknown)


def _check_dependency_kinds(unknown: Unknown) -> Iterator[Finding]:
    if unknown.dependency_kinds is None:
        return
    if unknown.dependencies is None or len(unknown.dependency_kinds) != len(unknown.dependencies):
        count = "no" if unknown.dependencies is None else len(unknown.dependencies)
        text = f"{unknown.element} has {len(unknown.dependency_kinds)} kinds of dependencies for {count} dependencies"
        yield DEPENDENCY_KINDS(text, DESCRIPTION_FILE, unknown.line)
    for kind in unknown.dependency_kinds:
        if kind not in _VALID_KINDS:
            yield DEPENDENCY_KINDS(f'found "{kind}", expected one of {", ".join(_VALID_KINDS)}', DESCRIPTION_FILE, unknown.line)


def check_completeness(model: ModelDescription) -> Iterator[Finding]:
    """Each list holds exactly the variables that belong into it."""
    lists = {group: _variables_in(model, group) for group in ("Output", "ContinuousStateDerivative", "InitialUnknown")}
    outputs = [variable for variable in model.variables if variable.causality == "output"]
    yield from _check_list(OUTPUTS, "outputs", lists["Output"], outputs)
    for variable in lists["ContinuousStateDerivative"]:
        if "derivative" not in variable.attributes:
            yield DERIVATIVES(f"{variable}: is listed as derivative but has no derivative=", DESCRIPTION_FILE, variable.line)
    unknowns = _initial_unknowns(model, lists["ContinuousStateDerivative"])
    yield from _check_list(UNKNOWNS, "initial unknowns", lists["InitialUnknown"], unknowns)


def _variables_in(model: ModelDescription, group: str) -> list[ModelVariable]:
    references = (unknown.reference.strip() for unknown in model.model_structure if unknown.element == group)
    return [model.by_reference[reference] for reference in references if reference in model.by_reference]


def _initial_unknowns(model: ModelDescription, derivatives: list[ModelVariable]) -> list[ModelVariable]:
    """Outputs, calculated parameters, states and their derivatives that initialization computes."""
    states = [model.by_reference.get(variable.attributes.get("derivative", "").strip()) for variable in derivatives]
    dynamic = [variable for variable in (*states, *derivatives) if variable is not None and _is_computed(variable)]
    outputs = [v for v in model.variables if v.causality == "output" and _is_computed(v) and "clocks" not in v.attributes]
    return [*outputs, *(v for v in model.variables if v.causality == "calculatedParameter"), *dynamic]


def _is_computed(variable: ModelVariable) -> bool:
    return variable.initial in ("approx", "calculated")


def _check_list(rule: Rule, what: str, listed: list[ModelVariable], expected: list[ModelVariable]) -> Iterator[Finding]:
    here, there = {v.name: v.line for v in listed}, {v.name: v.line for v in expected}
    for name in (name for name in there if name not in here):
        yield rule(f'variable "{name}": is missing among the {what} of the model structure', DESCRIPTION_FILE, there[name])
    for name in (name for name in here if name not in there):
        yield rule(f'variable "{name}": is among the {what} of the model structure but is none', DESCRIPTION_FILE, here[name])


CHECKS = (check_references, check_completeness)
