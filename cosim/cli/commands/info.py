"""`cosim info`: properties and variables of an FMU."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click

from ...core.component import Variable
from ..messages import print_line

_INTERFACE_NAMES: Mapping[str, str] = {"co-simulation": "Co-Simulation", "model-exchange": "Model Exchange"}


@click.command()
@click.argument("fmu", type=click.Path(path_type=Path))
@click.option("--locals", "with_locals", is_flag=True, help="Also list local variables.")
def command(fmu: Path, with_locals: bool) -> None:
    """Print the properties and variables of FMU: version, capabilities, platforms, inputs, outputs and parameters."""
    from ...components.fmi import FmuFile

    file = FmuFile(fmu)
    about = file.description
    experiment = about.default_experiment
    capabilities = {
        "variable step size": about.variable_step,
        "state can be saved and restored": about.has_state,
        "one instance per process": about.once_per_process,
        "needs an external tool": about.needs_execution_tool,
    }
    rows = {
        "model": about.model_name,
        "description": about.description,
        "FMI version": f"{about.fmi_version} {' and '.join(_INTERFACE_NAMES[name] for name in about.interfaces)}",
        "made by": about.generation_tool,
        "platforms": ", ".join(about.platforms),
        "step size": f"{float(experiment.step_size):g} s" if experiment.step_size else "",
        "stop time": f"{float(experiment.stop_time):g} s" if experiment.stop_time else "",
        "tolerance": f"{experiment.tolerance:g}" if experiment.tolerance else "",
        "states": str(about.state_count) if about.interface == "model-exchange" else "",
        "capabilities": ", ".join(name for name, has in capabilities.items() if has),
        "sha256": file.sha256,
    }
    for name, value in rows.items():
        if value:
            print_line(f"{name:13} {value}")
    groups = ["input", "output", "structuralParameter", "parameter", "calculatedParameter", *(["local"] if with_locals else [])]
    for causality in groups:
        _print_variables(causality, [v for v in about.variables if v.causality == causality])


def _print_variables(causality: str, variables: list[Variable]) -> None:
    if not variables:
        return
    click.echo(f"\n{causality}s ({len(variables)})")
    width = min(40, max(len(variable.name) for variable in variables))
    for variable in variables:
        dimensions = f"[{','.join(map(str, variable.shape))}]" if variable.shape else ""
        unit = variable.unit.name if variable.unit else "-"
        start = "" if variable.start is None else f" = {_shorten(variable.start)}"
        start += "".join(f", {number}: {name}" for name, number in variable.items).replace(", ", "; ", 1)
        print_line(f"  {variable.name:{width}} {variable.type + dimensions:12} {unit:8} {variable.description}{start}".rstrip())


def _shorten(start: object) -> str:
    text = str(start)
    return text if len(text) <= 40 else text[:37] + "..."
