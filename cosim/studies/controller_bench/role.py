"""Roles of controllers: what a controller in that place receives and gives, and which shipped ones stand there.

One JSON file each, the shipped ones in scenarios/roles/; paths in it are relative to the file:

    {"description": "...",
     "controllers": ["../../fmus/strider_autopilot.fmu"],                       wherever a scenario names one of these is a place
     "inputs": {"vehicle": {"outputs_of": "../../fmus/strider.fmu"},            all outputs of an FMU, below a name
                "target": {"outputs_of": "../../fmus/strider.fmu", "below": "deck"},
                "altitude_command": "m"},                                       or one variable and its unit
     "outputs": {"thrust": "N", "rotor_speed[1]": "rad/s"},
     "parameters": {"speed_command": "m/s"},
     "stand_ins": {"../../fmus/strider_autopilot.fmu": "../systems/strider_autopilot.json"}}

A controller declares the inputs and parameters that it uses and has to have all outputs; a parameter without an index stands
for an array. `stand_ins` names nested systems that
do the same as a file, so that parts of them can be replaced.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from ...components.fmi import FmuFile
from ...core import resources
from ...core.errors import InputError, Problem, did_you_mean
from ...core.units import Unit, parse_unit
from ...scenario.json_document import Document, read_document
from ...scenario.schema_types import Spec


class OutputsSpec(Spec):
    """Outputs of an FMU, those `below` a name of it or all."""

    outputs_of: str
    below: str = ""


class RoleSpec(Spec):
    """A role's file."""

    description: str
    controllers: list[str]
    inputs: dict[str, str | OutputsSpec]
    outputs: dict[str, str]
    parameters: dict[str, str] = {}
    stand_ins: dict[str, str] = {}


@dataclass(frozen=True)
class Role:
    """What a controller may and has to declare: units by variable name (None: any)."""

    name: str
    description: str
    inputs: dict[str, Unit | None]
    outputs: dict[str, Unit | None]
    parameters: dict[str, Unit | None]
    #: resolved paths of the shipped controllers, and of nested systems by that of the file they stand for
    controllers: frozenset[Path]
    stand_ins: dict[Path, Path]


def read_role(role: str) -> Role:
    """A shipped role by its name, or one of the user's own by the path of its JSON file. Raises InputError."""
    file = _find_role(role)
    document = read_document(file)
    spec = _validate_role(document)
    folder = file.parent.resolve()
    inputs = [item for name, source in spec.inputs.items() for item in _input_units(name, source, folder)]
    return Role(
        file.stem,
        spec.description,
        dict(inputs),
        {name: _parse_unit(unit) for name, unit in spec.outputs.items()},
        {name: _parse_unit(unit) for name, unit in spec.parameters.items()},
        frozenset((folder / path).resolve() for path in spec.controllers),
        {(folder / path).resolve(): (folder / system).resolve() for path, system in spec.stand_ins.items()},
    )


def role_names() -> list[str]:
    """Names of the shipped roles."""
    return sorted(path.stem for path in (resources.root() / "scenarios/roles").glob("*.json"))


def _find_role(role: str) -> Path:
    if role.endswith(".json"):
        return Path(role)
    if role not in role_names():
        raise InputError(f'there is no role "{role}"{did_you_mean(role, role_names()) or "; valid: " + ", ".join(role_names())}')
    return resources.root() / "scenarios/roles" / f"{role}.json"


def _validate_role(document: Document) -> RoleSpec:
    problems = list(document.problems)
    try:
        spec = TypeAdapter(RoleSpec).validate_python(document.value)
    except ValidationError as error:
        problems += [Problem(found["msg"], document.where(found["loc"])) for found in error.errors()]
    if problems:
        raise InputError(problems)
    return spec


def _input_units(name: str, source: str | OutputsSpec, folder: Path) -> list[tuple[str, Unit | None]]:
    if isinstance(source, str):
        return [(name, _parse_unit(source))]
    outputs = (v for v in FmuFile(folder / source.outputs_of).description.variables if v.causality == "output")
    head = f"{source.below}." if source.below else ""
    return [
        (f"{name}.{slot.removeprefix(head)}", variable.unit)
        for variable in outputs
        for slot in variable.scalar_names
        if slot.startswith(head)
    ]


def _parse_unit(text: str) -> Unit | None:
    try:
        return parse_unit(text) if text else None
    except ValueError as error:
        raise InputError(str(error)) from None
