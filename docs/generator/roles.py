"""Reference of the roles of controllers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from markdown_parts import code, page, plain, table

from cosim.cli.shipped import CATALOGUE
from cosim.components.fmi import FmuFile
from cosim.core import resources
from cosim.studies.controller_bench.role import OutputsSpec, RoleSpec, VariableSpec, read_role_file

Source = str | VariableSpec | OutputsSpec
Rows = tuple[tuple[str, str, str], ...]


def roles_page() -> str:
    """Return the page with the variables that a controller of each role receives and returns."""
    intro = (
        "A role is a place for a controller. A controller declares the inputs and parameters that it uses; it must have all "
        "outputs. `cosim bench-controller CONTROLLER --role ROLE` runs a controller in every scenario with the role.\n\n"
        "`vehicle.NAME` stands for all measurements of the vehicle, and `target.NAME` for those of the deck on which it lands. "
        "The tables at the end of the page list the names. For example, the position to the east is `vehicle.position.x`. "
        "A variable without a unit is an integer or a Boolean."
    )
    roles = {entry.name: read_role_file(entry.name)[1] for entry in CATALOGUE["roles"]()}
    titles = _group_titles(roles.values())
    sections = [_role_section(name, role, titles) for name, role in roles.items()]
    groups = (f"## {title}\n\n{table(('name', 'unit', 'meaning'), rows)}" for rows, title in titles.items())
    return page("Roles of controllers", intro, *sections, *groups)


def _group_titles(roles: Iterable[RoleSpec]) -> dict[Rows, str]:
    """Return a title for each group of signals with a common prefix; models with the same signals share a group."""
    models: dict[Rows, set[str]] = {}
    for role in roles:
        for source in role.inputs.values():
            if isinstance(source, OutputsSpec):
                part = f"the {source.below} of " if source.below else ""
                models.setdefault(_signals(source), set()).add(part + Path(source.outputs_of).stem)
    return {rows: f"Signals of {' and '.join(sorted(names))}" for rows, names in models.items()}


def _role_section(name: str, role: RoleSpec, titles: Mapping[Rows, str]) -> str:
    kinds: dict[str, Mapping[str, Source]] = {"input": role.inputs, "output": role.outputs, "parameter": role.parameters}
    rows = (_row(kind, name, source, titles) for kind, variables in kinds.items() for name, source in variables.items())
    return f"## {name}\n\n{plain(role.description)}\n\n{table(('name', 'kind', 'unit', 'meaning'), rows)}"


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
        for variable in FmuFile(resources.root() / "fmus" / Path(source.outputs_of).name).description.variables
        if variable.causality == "output" and variable.name.startswith(prefix)
    )
