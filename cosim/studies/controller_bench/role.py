"""Roles of controllers.

The signals that a controller in a role receives and returns, and the shipped controllers with it.

Each role is a JSON file; the shipped ones are in scenarios/roles/. Paths in it are relative to the
file:

    {"description": "...",
     "controllers": ["../../fmus/strider_autopilot.fmu"],
     "inputs": {"vehicle": {"outputs_of": "../../fmus/strider.fmu"},
                "target": {"outputs_of": "../../fmus/strider.fmu", "below": "deck"},
                "altitude_command": "m"},
     "outputs": {"thrust": {"unit": "N", "description": "Positive: forward"},
                 "rotor_speed[1]": "rad/s"},
     "parameters": {"speed_command": "m/s",
                    "vtol.landing_time": {"unit": "s", "start": 5, "description": "..."}},
     "goals": ["waypoints.reached", "waypoints.time*"],
     "cost_reference": "../../fmus/ar_drone_geometric.fmu",
     "stand_ins": {"../../fmus/strider_autopilot.fmu": "../systems/strider_autopilot.json"}}

Components with one of the `controllers` have the role. An entry of `inputs` is a prefix with all
outputs of an FMU, or a single variable with its unit. `parameters` are optional; scenarios set
them. `goals` are the KPIs that rank controllers, the first one first. Costs per step are ratios to
that of the FMU `cost_reference`.

A controller declares the inputs and parameters that it uses; it must have all outputs. A parameter
without an index stands for an array. A parameter with a prefix may also be declared without it:
`landing_time` in place of `vtol.landing_time`. `stand_ins` maps a file to an equivalent nested
system, so that a part of it can be replaced.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import ValidationError

from ...components.fmi import FmuFile
from ...core import resources
from ...core.errors import InputError, Problem, did_you_mean
from ...core.units import Unit, parse_unit
from ...scenario.json_document import read_document
from ...scenario.schema_types import Spec


class OutputsSpec(Spec):
    """Outputs of an FMU: all, or those below the prefix `below`."""

    outputs_of: str
    below: str = ""


class VariableSpec(Spec):
    """Unit and meaning of a single variable; no unit: any."""

    unit: str = ""
    description: str


class ParameterSpec(VariableSpec):
    """Parameter that scenarios set.

    `start` is the value where no scenario sets it (None: each scenario sets it).
    """

    type: Literal["Real", "Integer", "Boolean"] = "Real"
    start: bool | float | None = None


class RoleSpec(Spec):
    """Schema of a role's file."""

    description: str
    controllers: list[str]
    inputs: dict[str, str | VariableSpec | OutputsSpec]
    outputs: dict[str, str | VariableSpec]
    goals: list[str] = []
    cost_reference: str | None = None
    parameters: dict[str, str | ParameterSpec] = {}
    stand_ins: dict[str, str] = {}


@dataclass(frozen=True)
class Role:
    """Variables that a controller may or must declare, with their units (None: any unit)."""

    name: str
    description: str
    inputs: dict[str, Unit | None]
    outputs: dict[str, Unit | None]
    parameters: dict[str, Unit | None]
    #: patterns of the KPI values that rank controllers, the most important first; "*" matches any
    #: text
    goals: tuple[str, ...]
    #: resolved paths of the shipped controllers, and of nested systems by the path of the file that
    #: they replace
    controllers: tuple[Path, ...]
    stand_ins: dict[Path, Path]
    #: costs per step are ratios to that of this FMU; None: to that of the first controller
    cost_reference: Path | None

    @property
    def short_names(self) -> dict[str, str]:
        """Names without prefixes, such as "landing_time", of the parameters with prefixes."""
        return {name: name.rpartition(".")[2] for name in self.parameters if "." in name}

    @property
    def different_controllers(self) -> list[Path]:
        """First shipped controller of each name.

        Without the FMI 3.0, Python and nested versions of the same controller.
        """
        return list({path.stem: path for path in reversed(self.controllers)}.values())[::-1]


def read_role(role: str) -> Role:
    """Read a shipped role by its name, or a user's role by the path of its JSON file.

    Raises:
        InputError: with all problems of the file, or if there is no such role.
    """
    file, spec = read_role_file(role)
    folder = file.parent.resolve()
    inputs: dict[str, Unit | None] = {}
    for name, source in spec.inputs.items():
        inputs |= _input_units(name, source, folder)
    return Role(
        file.stem,
        spec.description,
        inputs,
        {name: _parse_unit(source) for name, source in spec.outputs.items()},
        {name: _parse_unit(source) for name, source in spec.parameters.items()},
        tuple(spec.goals),
        tuple((folder / path).resolve() for path in spec.controllers),
        {
            (folder / path).resolve(): (folder / system).resolve()
            for path, system in spec.stand_ins.items()
        },
        (folder / spec.cost_reference).resolve() if spec.cost_reference else None,
    )


def read_role_file(role: str) -> tuple[Path, RoleSpec]:
    """Return the path and the content of the file of a role, given as for `read_role`.

    The same errors are raised.
    """
    if role.endswith(".json"):
        file = Path(role)
    elif role in role_names():
        file = resources.root() / "scenarios/roles" / f"{role}.json"
    else:
        raise InputError(
            "there is no role "
            f'"{role}"{did_you_mean(role, role_names()) or "; valid: " + ", ".join(role_names())}'
        )
    document = read_document(file)
    if document.problems:
        raise InputError(document.problems)
    try:
        return file, RoleSpec.model_validate(document.value)
    except ValidationError as error:
        raise InputError(
            Problem(found["msg"], document.where(found["loc"])) for found in error.errors()
        ) from None


def role_names() -> list[str]:
    """Return the names of the shipped roles."""
    return resources.shipped_names("scenarios/roles/*.json")


def _input_units(
    name: str, source: str | VariableSpec | OutputsSpec, folder: Path
) -> dict[str, Unit | None]:
    """Return the units of the inputs that an entry of a role stands for, by their names."""
    if not isinstance(source, OutputsSpec):
        return {name: _parse_unit(source)}
    prefix = f"{source.below}." if source.below else ""
    units: dict[str, Unit | None] = {}
    for variable in FmuFile(folder / source.outputs_of).description.variables:
        if variable.causality == "output":
            for slot in variable.scalar_names:
                if slot.startswith(prefix):
                    units[f"{name}.{slot.removeprefix(prefix)}"] = variable.unit
    return units


def _parse_unit(source: str | VariableSpec) -> Unit | None:
    text = source if isinstance(source, str) else source.unit
    try:
        return parse_unit(text) if text else None
    except ValueError as error:
        raise InputError(str(error)) from None
