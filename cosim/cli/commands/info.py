"""`cosim info`: properties and variables of an FMU, a Python class or a Modelica model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...core import resources
from ...core.component import Variable
from ...core.errors import InputError, did_you_mean
from ...core.text import shorten
from ...scenario.file_paths import SHIPPED
from .. import current_command_line
from ..messages import print_json, print_line
from ..options import flag_option, json_option
from ..shipped import shipped_fmus
from .new_vehicle import read_vehicle_file

if TYPE_CHECKING:
    from ...components.fmi import FmuFile
    from ...components.fmi.description import FmuDescription


#: largest width of the column of start values (characters)
_START_WIDTH = 14

#: length to which start values are shortened in the table (characters)
_MAX_START_LENGTH = 40

#: listed variables, in this order; the last kind only with --locals
_CAUSALITIES = (
    "input",
    "output",
    "structuralParameter",
    "parameter",
    "calculatedParameter",
    "local",
)

_INTERFACE_NAMES: Mapping[str, str] = {
    "co-simulation": "Co-Simulation",
    "model-exchange": "Model Exchange",
}


#: capability flags that cosim honours, in lower case (the versions of FMI differ in capitals)
_USED_CAPABILITIES = {
    "canhandlevariablecommunicationstepsize",
    "cangetandsetfmustate",
    "canbeinstantiatedonlyonceperprocess",
    "needsexecutiontool",
    "cannotusememorymanagementfunctions",
    "needscompletedintegratorstep",
    "completedintegratorstepnotneeded",
    "caninterpolateinputs",
    "providesdirectionalderivative",
    "providesdirectionalderivatives",
    "maxoutputderivativeorder",
    "haseventmode",
    "mightreturnearlyfromdostep",
}


@click.command()
@click.argument("fmu")
@flag_option("--locals", "with_locals", help="Also list local variables.")
@json_option(
    "an object with properties and variables, a list of name, type, causality, variability, unit, "
    "shape, start, minimum, "
    "maximum, items and description"
)
def command(fmu: str, with_locals: bool, as_json: bool) -> None:
    """Print the properties and variables of FMU.

    Version, capabilities, platforms, inputs, outputs and parameters.

    FMU is a file, the name of a shipped FMU such as multirotor_controller, or its path as in
    scenarios ("cosim:fmus/..."). It may also be file.py:Class, which is imported and constructed,
    or file.mo:Model, which is compiled.
    """
    found, all_variables = _describe(fmu)
    causalities = _CAUSALITIES if with_locals else _CAUSALITIES[:-1]
    variables: dict[str, list[Variable]] = {causality: [] for causality in causalities}
    for variable in all_variables:
        if variable.causality in variables:
            variables[variable.causality].append(variable)
    properties = {name: value for name, value in found.items() if value}
    if as_json:
        listed = [_variable_as_json(variable) for variable in chain(*variables.values())]
        print_json({"properties": properties, "variables": listed})
        return
    for name, value in properties.items():
        print_line(f"{name:13} {value}")
    for causality, group in variables.items():
        _print_variables(causality, group)


def _describe(source: str) -> tuple[Mapping[str, str], Sequence[Variable]]:
    """Return properties and variables of an FMU, a class, a Modelica model or a vehicle file."""
    from ...components.fmi import FmuFile
    from ...export.fmu_sources import MEMBERS

    file, _, name = source.rpartition(":")
    if Path(source).suffix in MEMBERS:
        kind = MEMBERS[Path(source).suffix]
        raise InputError(f"{source}: expected the name of a {kind.lower()}, as in {source}:{kind}")
    if file.endswith(".py"):
        from ...components.python_class import load_component

        component = load_component(source, Path(), "component", {})
        used = {
            "variable step size": component.variable_step,
            "state can be saved and restored": component.has_state,
            "inputs can be linear within a step": component.interpolates_inputs,
        }
        return {
            "class": source,
            "capabilities": ", ".join(name for name, has in used.items() if has),
        }, component.variables
    if source.endswith(".json"):
        from ...export.plant import describe_vehicle

        return read_vehicle_file(_find_fmu(source), describe_vehicle)
    if file.endswith(".mo"):
        from ...export.build import cached_fmu

        fmu = FmuFile(cached_fmu(Path(file), name))
    else:
        fmu = FmuFile(_find_fmu(source))
    return _properties(fmu), fmu.description.variables


def _find_fmu(fmu: str) -> Path:
    """Return the path of an FMU that is given by its path, or by the name of a shipped FMU."""
    if fmu.startswith(SHIPPED):
        return resources.root() / fmu.removeprefix(SHIPPED)
    path, files = Path(fmu), shipped_fmus()
    if path.suffix or path.exists():
        return path
    if fmu not in files:
        raise InputError(f'no FMU file and no shipped FMU "{fmu}"{did_you_mean(fmu, files)}')
    return files[fmu]


def _properties(file: FmuFile) -> dict[str, str]:
    about = file.description
    experiment = about.default_experiment
    used = {
        "variable step size": about.variable_step,
        "state can be saved and restored": about.has_state,
        "inputs can be linear within a step": about.interpolates_inputs,
        "derivatives of outputs": about.gives_output_slopes,
        "event mode": about.has_event_mode,
        "early return": about.may_return_early,
        "directional derivatives": about.directional_derivatives,
        "one instance per process": about.once_per_process,
        "own memory management": "canNotUseMemoryManagementFunctions" in about.capabilities,
    }
    unused = [name for name in about.capabilities if name.lower() not in _USED_CAPABILITIES]
    return {
        "model": about.model_name,
        "source": _source_name(file),
        "description": about.description,
        "FMI version": (
            f"{about.fmi_version} "
            f"{' and '.join(_INTERFACE_NAMES[name] for name in about.interfaces)}"
        ),
        "made by": about.generation_tool,
        "platforms": ", ".join(about.platforms),
        "step size": f"{float(experiment.step_size):g} s" if experiment.step_size else "",
        "stop time": f"{float(experiment.stop_time):g} s" if experiment.stop_time else "",
        "tolerance": f"{experiment.tolerance:g}" if experiment.tolerance else "",
        "states": str(about.state_count) if about.interface == "model-exchange" else "",
        "capabilities": ", ".join(name for name, has in used.items() if has),
        "needs": _needed_tool(about),
        "not used": ", ".join(unused),
        "sha256": file.sha256,
    }


def _source_name(file: FmuFile) -> str:
    """Return the name of the Modelica or Python file from which `cosim build` made the FMU.

    "" if it is not in the FMU.
    """
    name = file.description.model_name.replace("_", "").lower()
    for member in file.examination.members:
        folder, _, source = member.rpartition("/")
        stem, _, suffix = source.rpartition(".")
        is_own = suffix in ("mo", "py") and stem.replace("_", "").lower() == name
        if folder == "resources" and is_own:
            return source
    return ""


def _needed_tool(about: FmuDescription) -> str:
    """Return the program without which the FMU does not run; "" if it needs none."""
    if not about.needs_execution_tool:
        return ""
    if about.generation_tool.startswith("PythonFMU"):
        return "Python on the host, with the packages that its class imports"
    return about.generation_tool or "the program that made it, which it does not name"


def _variable_as_json(variable: Variable) -> dict[str, Any]:
    names = (
        "name",
        "type",
        "causality",
        "variability",
        "shape",
        "start",
        "minimum",
        "maximum",
        "description",
    )
    unit = variable.unit.name if variable.unit else None
    values = {name: getattr(variable, name) for name in names}
    return {**values, "unit": unit, "items": dict(variable.items)}


def _print_variables(causality: str, variables: list[Variable]) -> None:
    if not variables:
        return
    click.echo(f"\n{causality}s ({len(variables)})")
    width = min(40, max(len(variable.name) for variable in variables))
    starts = [
        "" if variable.start is None else f"start = {_start_text(variable.start)}"
        for variable in variables
    ]
    start_width = min(_START_WIDTH, max(map(len, starts)))
    for variable, start in zip(variables, starts, strict=True):
        dimensions = f"[{','.join(map(str, variable.shape))}]" if variable.shape else ""
        unit = variable.unit.name if variable.unit else "-"
        items = ", ".join(f"{number}: {name}" for number, name in variable.items)
        text = "; ".join(filter(None, (variable.description, items)))
        columns = (
            f"{variable.name:{width}} {variable.type + dimensions:12} {unit:8}",
            f"{start:{start_width}}",
            text,
        )
        print_line(f"  {' '.join(filter(None, columns))}".rstrip())


def _start_text(start: object) -> str:
    """Return a start value as text, with six significant digits; --verbose does not shorten it."""
    text = f"{start:.6g}" if isinstance(start, float) else str(start)
    return text if current_command_line().verbosity > 0 else shorten(text, _MAX_START_LENGTH)
