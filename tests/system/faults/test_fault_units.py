"""Units as people write them in model descriptions: KPI functions and connections take them all."""

from __future__ import annotations

import json

import pytest
from fault_fmu import STEP, scenario

RUN = ("--output-dir", "out", "--no-report")
#: places of the attributes of output and input in the model descriptions, by FMI version
OUTPUT = {2: 'initial="calculated"><Real', 3: '<Float64 name="y" valueReference="2"'}
INPUT = {2: 'causality="input"><Real', 3: '<Float64 name="u" valueReference="1"'}
KPIS = [
    {"name": name, "python": f"cosim.kpis:{name}", "arguments": {"signal": "lag.y"}}
    for name in ("mean", "iae", "ise", "itae")
]
UNITS = [
    "°C",
    "-",
    "N·m",
    "W/m²",
    "bar_g",
    "€/kWh",
    "bar(g)",
    "10^3 m",
    "m//",
    "{",
    "%",
    "$/MWh",
    "kg m",
]
DEFINITIONS = {
    "base unit": '<Unit name="{}"><BaseUnit kg="1"/></Unit>',
    "no base unit": '<Unit name="{}"/>',
    "undefined": "",
}


def with_unit(version, unit, place, definition=""):
    """Return the changes of a description that give a variable this unit."""
    changes = {place[version]: f'{place[version]} unit="{unit}"'}
    if definition:
        units = f"<UnitDefinitions>{definition.format(unit)}</UnitDefinitions>"
        changes["<DefaultExperiment"] = f"{units}<DefaultExperiment"
    return changes


@pytest.mark.parametrize(
    ("unit", "definition"),
    [(unit, list(DEFINITIONS)[number % len(DEFINITIONS)]) for number, unit in enumerate(UNITS)],
)
def test_kpis_of_a_signal_with_any_unit(fmus, runner, tmp_path, version, unit, definition):
    fmu = fmus(version, changes=with_unit(version, unit, OUTPUT, DEFINITIONS[definition]))
    done = runner.cosim(tmp_path, "run", scenario(tmp_path, fmu, kpis=KPIS), *RUN)
    assert done.code == 0, done.err
    about = json.loads((tmp_path / "out/run.json").read_text(encoding="utf-8"))
    assert about["units"]["lag.y"] == about["kpi_units"]["mean.value"] == unit
    assert unit in done.out


@pytest.mark.parametrize("definition", ["no base unit", "undefined"])
@pytest.mark.parametrize(
    ("source", "target", "factor", "offset"),
    [
        ("°C", "K", 1, 273.15),
        ("W/m²", "kg/s3", 1, 0),
        ("–", "%", 100, 0),
        ("bar_g", "Pa", 1, 0),
        ("m", "€/kWh", 1, 0),
    ],
)
def test_connections_convert_what_is_known(
    fmus, runner, tmp_path, version, source, target, factor, offset, definition
):
    lag = fmus(version, changes=with_unit(version, source, OUTPUT, DEFINITIONS[definition]))
    reader = fmus(
        version, name="next", changes=with_unit(version, target, INPUT, DEFINITIONS[definition])
    )
    components = {"lag": {"fmu": str(lag)}, "next": {"fmu": str(reader)}}
    file = scenario(
        tmp_path, lag, components=components, connections=[{"from": "lag.y", "to": "next.u"}]
    )
    done = runner.cosim(tmp_path, "run", file, *RUN)
    assert done.code == 0, done.err
    read = factor * done.rows[1]["lag.y"] + offset
    assert done.rows[1]["next.y"] == pytest.approx(1 + STEP * (read - 1) / 0.5, rel=1e-12)


@pytest.mark.parametrize(
    ("source", "target"), [("°C", "Pa"), ("N·m", "W"), ("-", "rad"), ("W/m²", "W")]
)
def test_connections_of_different_quantities_are_refused(
    fmus, runner, tmp_path, version, source, target
):
    lag = fmus(version, changes=with_unit(version, source, OUTPUT))
    reader = fmus(version, name="next", changes=with_unit(version, target, INPUT))
    components = {"lag": {"fmu": str(lag)}, "next": {"fmu": str(reader)}}
    file = scenario(
        tmp_path, lag, components=components, connections=[{"from": "lag.y", "to": "next.u"}]
    )
    done = runner.cosim(tmp_path, "run", file, *RUN)
    assert done.code == 2
    assert f'units "{source}" and "{target}" measure different quantities' in done.err
