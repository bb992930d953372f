"""Rules about the model structure: which variables are outputs, states and unknowns of the initialization."""

from __future__ import annotations

from collections.abc import Iterator

from .findings import DESCRIPTION, Finding, Rule
from .model_description import Model, ModelVariable, Unknown

_STRUCTURE = "FMI 2.0.5 section 2.2.8, FMI 3.0.2 section 2.4.8"
LINK = Rule("structure.reference", _STRUCTURE)
KINDS = Rule("structure.dependencies", _STRUCTURE, "warning")
TWICE = Rule("structure.unique", _STRUCTURE, "warning")
OUTPUTS = Rule("structure.outputs", _STRUCTURE, "warning")
DERIVATIVES = Rule("structure.derivatives", _STRUCTURE, "warning")
UNKNOWNS = Rule("structure.initial-unknowns", _STRUCTURE, "warning")

_KINDS = ("dependent", "constant", "fixed", "tunable", "discrete")


def check_links(model: Model) -> Iterator[Finding]:
    """References lead to variables, once in each list; dependencies and their kinds come in pairs."""
    seen: set[tuple[str, str]] = set()
    for unknown in model.structure:
        for reference in (unknown.reference.strip(), *(unknown.dependencies or ())):
            if reference not in model.by_reference:
                text = f'{unknown.group} refers to variable "{reference}", expected one of the {len(model.variables)} that exist'
                yield LINK(text, DESCRIPTION, unknown.line)
        if (unknown.group, unknown.reference) in seen:
            yield TWICE(f'{unknown.group} "{unknown.reference}" stands twice', DESCRIPTION, unknown.line)
        seen.add((unknown.group, unknown.reference))
        yield from _wrong_kinds(unknown)


def _wrong_kinds(unknown: Unknown) -> Iterator[Finding]:
    if unknown.kinds is None:
        return
    if unknown.dependencies is None or len(unknown.kinds) != len(unknown.dependencies):
        count = "no" if unknown.dependencies is None else len(unknown.dependencies)
        text = f"{unknown.group} has {len(unknown.kinds)} kinds of dependencies for {count} dependencies"
        yield KINDS(text, DESCRIPTION, unknown.line)
    for kind in unknown.kinds:
        if kind not in _KINDS:
            yield KINDS(f'found "{kind}", expected one of {", ".join(_KINDS)}', DESCRIPTION, unknown.line)


def check_completeness(model: Model) -> Iterator[Finding]:
    """Each list holds exactly the variables that belong into it."""
    lists = {group: _listed(model, group) for group in ("Output", "ContinuousStateDerivative", "InitialUnknown")}
    outputs = [variable for variable in model.variables if variable.causality == "output"]
    yield from _compare(OUTPUTS, "outputs", lists["Output"], outputs)
    for variable in lists["ContinuousStateDerivative"]:
        if "derivative" not in variable.attributes:
            yield DERIVATIVES(f"{variable}: is listed as derivative but has no derivative=", DESCRIPTION, variable.line)
    unknowns = _initial_unknowns(model, lists["ContinuousStateDerivative"])
    yield from _compare(UNKNOWNS, "initial unknowns", lists["InitialUnknown"], unknowns)


def _listed(model: Model, group: str) -> list[ModelVariable]:
    references = (unknown.reference.strip() for unknown in model.structure if unknown.group == group)
    return [model.by_reference[reference] for reference in references if reference in model.by_reference]


def _initial_unknowns(model: Model, derivatives: list[ModelVariable]) -> list[ModelVariable]:
    """Outputs, calculated parameters, states and their derivatives that initialization computes."""
    states = [model.by_reference.get(variable.attributes.get("derivative", "").strip()) for variable in derivatives]
    dynamic = [variable for variable in (*states, *derivatives) if variable is not None and _computed(variable)]
    outputs = [v for v in model.variables if v.causality == "output" and _computed(v) and "clocks" not in v.attributes]
    return [*outputs, *(v for v in model.variables if v.causality == "calculatedParameter"), *dynamic]


def _computed(variable: ModelVariable) -> bool:
    return variable.initial in ("approx", "calculated")


def _compare(rule: Rule, what: str, listed: list[ModelVariable], expected: list[ModelVariable]) -> Iterator[Finding]:
    here, there = {v.name: v.line for v in listed}, {v.name: v.line for v in expected}
    for name in (name for name in there if name not in here):
        yield rule(f'variable "{name}": is missing among the {what} of the model structure', DESCRIPTION, there[name])
    for name in (name for name in here if name not in there):
        yield rule(f'variable "{name}": is among the {what} of the model structure but is none', DESCRIPTION, here[name])


CHECKS = (check_links, check_completeness)
