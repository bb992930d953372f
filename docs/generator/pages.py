"""Reference of the Python interface, variables, units, KPIs and shipped scenarios."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, groupby
from pathlib import Path

from markdown_parts import code, page, plain, table

import cosim
from cosim.cli.shipped import CATALOGUE, Entry, group_scenarios
from cosim.components.fmi import FmuFile
from cosim.components.python_import import load_object
from cosim.core import resources
from cosim.core.component import Variable
from cosim.core.units import BASE_UNITS, KNOWN_UNITS, PREFIXED, PREFIXES, UNPREFIXED, multiply_units

#: public names that the package `cosim` does not contain
OTHERS = ("cosim.core.component.StepResult", "cosim.core.units.parse_unit")
_CAUSALITIES = ("input", "output", "parameter")


def python_page() -> str:
    """Return the page with the public names of the package `cosim`."""
    names = [
        f"cosim.{name}" for name in sorted(cosim.__all__, key=str.swapcase) if name != "__version__"
    ]
    return page("Python", *(f"::: {name}" for name in (*names, *OTHERS)))


def variables_page() -> str:
    """Return the page with the variables of the vehicle models."""
    intro = (
        "In a scenario with the plant, the variables of a vehicle `V` are `plant.V.NAME`. "
        "Controllers receive them as "
        "`vehicle.NAME`. The world frame is east-north-up, the body frame forward-left-up; all "
        "quantities are in SI units."
    )
    return page("Variables", intro, *(_model_section(entry) for entry in CATALOGUE["models"]()))


def units_page() -> str:
    """Return the page with the known units and SI prefixes."""
    intro = (
        "These units are known in the attribute `units` of Python classes, in Modelica models, "
        "vehicle files and roles. "
        "Connections of variables with different units of one quantity are converted. A unit is "
        "written as in Modelica: "
        "`kg.m2/s3`, `W/(m2.K)`; common spellings such as `N·m`, `m/s²`, `°C` and `µF` are "
        "understood. "
        "An FMU may define any other unit by the SI base units. Quantities with a logarithmic "
        "scale, such as `dB`, are not known."
    )
    prefixes = ((code(name), f"{factor:g}") for name, factor in PREFIXES.items())
    return page(
        "Units",
        intro,
        (
            "## Units with prefixes\n\n"
            f"{table(('unit', 'in SI base units'), map(_unit_row, PREFIXED))}"
        ),
        (
            "## Units without prefixes\n\n"
            f"{table(('unit', 'in SI base units'), map(_unit_row, UNPREFIXED))}"
        ),
        f"## Prefixes\n\n{table(('prefix', 'factor'), prefixes)}",
    )


def _unit_row(name: str) -> tuple[str, str]:
    """Return a unit, and its value in SI base units."""
    unit = KNOWN_UNITS[name]
    base = multiply_units(zip(BASE_UNITS, unit.exponents, strict=True))
    offset = f", zero at {unit.offset:g} K" if unit.offset else ""
    return code(name), f"{unit.factor:.10g}{'' if base == '1' else f' {base}'}{offset}"


def _model_section(entry: Entry) -> str:
    """Return the variables of the FMU of a model."""
    variables = FmuFile(resources.root() / f"fmus/{entry.name}.fmu").description.variables
    tables = (
        (
            f"**{causality.capitalize()}s**\n\n"
            f"{table(('name', 'unit', 'start', 'meaning'), _variable_rows(variables, causality))}"
        )
        for causality in _CAUSALITIES
    )
    file = Path(entry.file).relative_to(resources.root())
    text = "Data" if file.suffix == ".json" else "Equations and parameters"
    link = f"[{text}](../../{file.as_posix()})"
    return "\n\n".join((f"## {entry.description}", f"Model `{entry.name}`. {link}", *tables))


def _variable_rows(variables: Iterable[Variable], causality: str) -> Iterator[tuple[str, ...]]:
    for variable in variables:
        if variable.causality == causality:
            unit = "1" if variable.type.startswith("Float") else variable.type
            if variable.unit:
                unit = variable.unit.name
            start = "" if variable.start is None or causality == "output" else f"{variable.start:g}"
            yield code(variable.name), plain(unit), start, plain(variable.description)


def kpis_page() -> str:
    """Return the page with the shipped KPI functions."""
    intro = (
        'A scenario names a KPI function under `"kpis"`; a relative path starts at the folder of '
        "the scenario. A value has the "
        "name of the KPI in the scenario as its prefix. The unit `{signal}` is that of the signal "
        "that the argument names."
    )
    parts = [intro]
    for file, entries in groupby(
        CATALOGUE["kpis"](), key=lambda entry: entry.name.rpartition(":")[0]
    ):
        parts.append(f"## {file}")
        parts += chain.from_iterable(map(_kpi_parts, entries))
    return page("KPIs", *parts)


def _kpi_parts(entry: Entry) -> Iterator[str]:
    name, path = entry.name.rpartition(":")[2], Path(entry.file)
    function = load_object(f"{path.name}:{name}", path.parent)
    units, senses = getattr(function, "units", {}), getattr(function, "better", {})
    rows = (
        (code(value), code(units.get(value, "")), senses.get(value, ""))
        for value in dict.fromkeys((*units, *senses))
    )
    reference = f"cosim:{entry.name}" if ".py:" in entry.name else entry.name
    yield f"::: {entry.name.partition(':')[0].removesuffix('.py').replace('/', '.')}.{name}"
    yield code(f'"python": "{reference}"')
    yield table(("value", "unit", "better"), rows)


def scenarios_page() -> str:
    """Return the page with the shipped scenarios, sweeps and tunings."""
    groups, studies = group_scenarios(CATALOGUE["scenarios"]()), CATALOGUE["sweeps"]()
    return page(
        "Shipped scenarios",
        "`cosim run NAME` runs a scenario, `cosim sweep NAME`, `cosim tune NAME` and `cosim tune "
        "--worst NAME` a study. "
        "`cosim list` prints these lists.",
        *(
            f"## {heading.capitalize()}\n\n{_entry_table('scenario', entries)}"
            for heading, entries in groups.items()
        ),
        f"## Sweeps and tunings\n\n{_entry_table('study', studies)}",
    )


def _entry_table(kind: str, entries: Iterable[Entry]) -> str:
    return table(
        (kind, "content"), ((code(each.name), plain(each.description)) for each in entries)
    )
