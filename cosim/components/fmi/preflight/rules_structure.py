"""Rules about the model structure: outputs, continuous-time states and initial unknowns."""

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
    """Check that elements refer to existing variables, occur once, and have one dependency kind for each dependency."""
    seen: set[tuple[str, str]] = set()
    for unknown in model.model_structure:
        for reference in (unknown.reference.strip(), *(unknown.dependencies or ())):
            if reference not in model.by_reference:
                text = f'{unknown.element} refers to variable "{reference}", which does not exist'
                yield UNRESOLVED(text, DESCRIPTION_FILE, unknown.line)
        if (unknown.element, unknown.reference) in seen:
            yield DUPLICATE(
                f'{unknown.element} "{unknown.reference}" occurs twice',
                DESCRIPTION_FILE,
                unknown.line,
            )
        seen.add((unknown.element, unknown.reference))
        yield from _check_dependency_kinds(unknown)


def _check_dependency_kinds(unknown: Unknown) -> Iterator[Finding]:
    if unknown.dependency_kinds is None:
        return
    if unknown.dependencies is None or len(unknown.dependency_kinds) != len(unknown.dependencies):
        count = "no" if unknown.dependencies is None else len(unknown.dependencies)
        text = (
            f"{unknown.element} has {len(unknown.dependency_kinds)} dependenciesKind for {count} "
            "dependencies"
        )
        yield DEPENDENCY_KINDS(text, DESCRIPTION_FILE, unknown.line)
    for kind in unknown.dependency_kinds:
        if kind not in _VALID_KINDS:
            yield DEPENDENCY_KINDS(
                f'found "{kind}", expected one of {", ".join(_VALID_KINDS)}',
                DESCRIPTION_FILE,
                unknown.line,
            )


def check_completeness(model: ModelDescription) -> Iterator[Finding]:
    """Check that each list of the model structure contains exactly the required variables."""
    if model.major == 1:
        return  # it has no model structure
    lists = {
        element: _variables_in(model, element)
        for element in ("Output", "ContinuousStateDerivative", "InitialUnknown")
    }
    outputs = [variable for variable in model.variables if variable.causality == "output"]
    yield from _check_list(OUTPUTS, "output", lists["Output"], outputs)
    for variable in lists["ContinuousStateDerivative"]:
        if "derivative" not in variable.attributes:
            text = f"{variable}: is listed as derivative but has no attribute derivative"
            yield DERIVATIVES(text, DESCRIPTION_FILE, variable.line)
    unknowns = _initial_unknowns(model, lists["ContinuousStateDerivative"])
    yield from _check_list(UNKNOWNS, "initial unknown", lists["InitialUnknown"], unknowns)


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
    """Return the outputs, calculated parameters, states and state derivatives that are computed in initialization mode."""
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
    rule: Rule, role: str, listed: list[ModelVariable], expected: list[ModelVariable]
) -> Iterator[Finding]:
    listed_lines, expected_lines = (
        {v.name: v.line for v in listed},
        {v.name: v.line for v in expected},
    )
    for name in (name for name in expected_lines if name not in listed_lines):
        text = (
            f'variable "{name}": is an {role} but is missing in the {role}s of the model structure'
        )
        yield rule(text, DESCRIPTION_FILE, expected_lines[name])
    for name in (name for name in listed_lines if name not in expected_lines):
        text = (
            f'variable "{name}": is listed in the {role}s of the model structure but is not an '
            f"{role}"
        )
        yield rule(text, DESCRIPTION_FILE, listed_lines[name])


CHECKS = (check_references, check_completeness)
