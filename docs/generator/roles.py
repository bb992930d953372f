"""Reference of the roles of controllers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import chain
from pathlib import Path

from markdown_parts import code, page, plain, table

from cosim.cli.shipped import CATALOGUE
from cosim.components.fmi import FmuFile
from cosim.core import resources
from cosim.studies.controller_bench.candidate import CandidateInterface, parse_source
from cosim.studies.controller_bench.role import (
    OutputsSpec,
    ParameterSpec,
    RoleSpec,
    VariableSpec,
    read_role,
    read_role_file,
)
from cosim.studies.controller_bench.substitution import ControllerSubstitution

Source = str | VariableSpec | OutputsSpec
Rows = tuple[tuple[str, str, str], ...]


def roles_page() -> str:
    """Return the page with the variables that a controller of each role receives and returns."""
    intro = (
        "A role is a place for a controller. A controller declares the inputs and parameters that "
        "it uses; it must have all "
        "outputs. `cosim bench-controller CONTROLLER --role ROLE` runs a controller in every "
        "scenario with the role.\n\n"
        "`vehicle.NAME` stands for all measurements of the vehicle, and `target.NAME` for those "
        "of the deck on which it lands. "
        "The tables at the end of the page list the names. For example, the position to the east "
        "is `vehicle.position.x`. "
        "An input or output without a unit is an integer or a Boolean.\n\n"
        "Scenarios set parameters. A controller that lacks one flies without this setting, which "
        "the benchmark reports. "
        "`start` is the value of the shipped controller where the scenario sets none. The column "
        "*scenarios* counts the "
        "shipped scenarios with the role that set the parameter. A parameter with a prefix may be "
        "declared without it, for "
        "example `landing_time` in place of `vtol.landing_time`."
    )
    roles = {entry.name: read_role_file(entry.name)[1] for entry in CATALOGUE["roles"]()}
    titles = _group_titles(roles.values())
    sections = [_role_section(name, role, titles) for name, role in roles.items()]
    groups = (
        f"## {title}\n\n{table(('name', 'unit', 'meaning'), rows)}"
        for rows, title in titles.items()
    )
    return page("Roles of controllers", intro, *sections, *groups)


def _group_titles(roles: Iterable[RoleSpec]) -> dict[Rows, str]:
    """Return a title for each group of signals with a common prefix.

    Models with the same signals share a group.
    """
    models: dict[Rows, set[str]] = {}
    for role in roles:
        for source in role.inputs.values():
            if isinstance(source, OutputsSpec):
                part = f"the {source.below} of " if source.below else ""
                models.setdefault(_signals(source), set()).add(part + Path(source.outputs_of).stem)
    return {rows: f"Signals of {' and '.join(sorted(names))}" for rows, names in models.items()}


def _role_section(name: str, role: RoleSpec, titles: Mapping[Rows, str]) -> str:
    rows = [_row("input", *each, titles) for each in role.inputs.items()]
    rows += [_row("output", *each, titles) for each in role.outputs.items()]
    signals = table(("name", "kind", "unit", "meaning"), rows)
    return "\n\n".join(
        filter(
            None,
            (
                f"## {name}",
                plain(role.description),
                signals,
                parameter_table(name, role.parameters),
            ),
        )
    )


def parameter_table(role: str, parameters: Mapping[str, str | ParameterSpec]) -> str:
    """Return the table of a role's parameters.

    A column counts the shipped scenarios that set each.
    """
    if not parameters:
        return ""
    files = sorted((resources.root() / "scenarios").glob("*.json"))
    settings = list(filter(None, (settings_of(role, file) for file in files)))
    counts = Counter(chain.from_iterable(settings))
    header = ("parameter", "type", "unit", "start", f"scenarios (of {len(settings)})", "meaning")
    rows = (
        (code(name), *_parameter_cells(source, counts[name])) for name, source in parameters.items()
    )
    return table(header, rows)


def _parameter_cells(source: str | ParameterSpec, count: int) -> tuple[str, ...]:
    spec = ParameterSpec(unit=source, description="") if isinstance(source, str) else source
    start = "" if spec.start is None else f"{spec.start:g}"
    if isinstance(spec.start, bool):
        start = str(spec.start).lower()
    return spec.type, plain(spec.unit), start, str(count), plain(spec.description)


def settings_of(role_name: str, scenario: Path) -> set[str]:
    """Return the names of the variables of a role that a scenario sets or connects.

    They belong to the component with the role; there are none without it.
    """
    role = read_role(role_name)
    nothing = CandidateInterface(inputs={}, outputs={}, parameters={})
    substitution = ControllerSubstitution(
        role, parse_source(str(role.controllers[0])), nothing, scenario
    )
    substitution.substitute(Path())  # nothing is written
    return {each.lacking for each in substitution.omissions if not each.entry}


def _row(kind: str, name: str, source: Source, titles: Mapping[Rows, str]) -> tuple[str, ...]:
    if isinstance(source, OutputsSpec):
        title = titles[_signals(source)].lower()
        return code(f"{name}.NAME"), kind, "", f"each of the [{title}](#{title.replace(' ', '-')})"
    variable = VariableSpec(unit=source, description="") if isinstance(source, str) else source
    return code(name), kind, plain(variable.unit), plain(variable.description)


def _signals(source: OutputsSpec) -> Rows:
    """Return name, unit and meaning of the signals that a prefix stands for."""
    prefix = f"{source.below}." if source.below else ""
    return tuple(
        (
            code(variable.name.removeprefix(prefix)),
            plain(variable.unit.name if variable.unit else ""),
            plain(variable.description),
        )
        for variable in FmuFile(
            resources.root() / "fmus" / Path(source.outputs_of).name
        ).description.variables
        if variable.causality == "output" and variable.name.startswith(prefix)
    )
