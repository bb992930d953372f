"""Tables of docs/variables.md: the variables of all vehicles of the world.

Run this file to write the tables.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cosim.core.component import Variable
from plant_src.catalogue import VEHICLE_MODELS, Model
from plant_src.world import World
from plant_src.world_settings import INITIAL_PREFIX, WAVE_PREFIX

DOCUMENT = Path(__file__).parents[2] / "docs/variables.md"
BEGIN, END = "<!-- made by tests/plant_src/vehicle_variables.py -->\n", "<!-- end -->\n"
#: a variable without its last part, which a row joins
_LAST_PART = re.compile(r"(.*[.\[])([a-z\d]+)(\]?)$")
#: last parts that several variables of a quantity have
_COMPONENTS = [*"xyzwuvpqr", "roll", "pitch", "yaw", *map(str, range(1, 9))]


def make_tables() -> str:
    """Return the tables of measurements, inputs, rotors and parameters."""
    vehicles, labels = {}, {}
    for vehicle, motions in VEHICLE_MODELS.items():
        for motion, model in motions.items():
            name = f"v{len(vehicles)}"
            position = [10 * len(vehicles), 0] if model.is_vessel else [10 * len(vehicles), 0, 5]
            vehicles[name] = {
                "model": vehicle,
                "position": position,
                **({"motion": motion} if len(motions) > 1 else {}),
            }
            labels[name] = f"{vehicle} ({motion})" if len(motions) > 1 else vehicle
    variables = [
        variable
        for variable in World("plant", vehicles=vehicles).variables
        if variable.name.split(".")[0] in labels
    ]
    parts = []
    for title, causality in (("Measurements (outputs)", "output"), ("Inputs", "input")):
        parts += [f"### {title}\n", "| variable | unit | meaning | vehicles |", "|---|---|---|---|"]
        parts += [
            *_rows([variable for variable in variables if variable.causality == causality], labels),
            "",
        ]
    parts += [
        "### Rotors\n",
        "| vehicle | input | place | position forward, left / m | its reaction turns the body |",
        "|---|---|---|---|---|",
    ]
    parts += [
        *_rotor_rows(),
        "",
        "### Parameters\n",
        (
            "The argument `vehicles/NAME/parameters` of the world sets these parameters of a "
            "vehicle. The parameters of vehicles"
        ),
        "that are given by files are those of their family; the file contains their values.\n",
        "| vehicle | parameter | unit | default | meaning |",
        "|---|---|---|---|---|",
    ]
    models = [each for motions in VEHICLE_MODELS.values() for each in motions.values()]
    described = {
        model.equations or label: model
        for label, model in reversed([*zip(labels.values(), models, strict=True)])
    }
    rows = [
        row for label, model in sorted(described.items()) for row in _parameter_rows(label, model)
    ]
    return "\n".join([*parts, *rows, ""])


def _parameter_rows(label: str, model: Model) -> Iterator[str]:
    for variable in model.real_variables("parameter"):
        if not variable.name.startswith((INITIAL_PREFIX, WAVE_PREFIX)):
            unit = variable.unit.name if variable.unit else ""
            lengths = ["n"] if model.equations and len(variable.shape) == 1 else variable.shape
            size = f"[{','.join(f'1..{length}' for length in lengths)}]" if lengths else ""
            default = (
                ""
                if model.equations
                else ", ".join(f"{value:.7g}" for value in np.ravel(variable.start))
            )
            meaning = variable.description.replace("|", "\\|")
            yield f"| {label} | `{variable.name}{size}` | {unit} | {default} | {meaning} |"


def _rotor_rows() -> Iterator[str]:
    airframes = [
        model.airframe
        for motions in VEHICLE_MODELS.values()
        for model in motions.values()
        if model.airframe
    ]
    for airframe in airframes:
        for i, rotor in enumerate(airframe.rotors, start=1):
            sense = "counter-clockwise" if rotor.torque_sign > 0 else "clockwise"
            place = ", ".join(f"{length:z.3f}" for length in rotor.position[:2])
            yield f"| {airframe.name} | `rotor_speed[{i}]` | {rotor.label} | {place} | {sense} |"


def _rows(variables: list[Variable], labels: dict[str, str]) -> Iterator[str]:
    """Yield a row for each quantity; its variables differ in the last part of their names only."""
    rows: dict[tuple[str, str, str], dict[str, list[str]]] = {}
    for variable in variables:
        vehicle, _, name = variable.name.partition(".")
        size = f"[1..{len(variable.scalar_names)}]" if variable.shape else ""
        quantity, part, end, meaning = _split(name + size, variable.description)
        unit = variable.unit.name if variable.unit else f"({variable.type})"
        rows.setdefault((f"{quantity}{{}}{end}", unit, meaning), {}).setdefault(vehicle, []).append(
            part
        )
    for (pattern, unit, meaning), users in rows.items():
        for parts in dict.fromkeys(map(tuple, users.values())):
            names = [labels[vehicle] for vehicle, used in users.items() if tuple(used) == parts]
            name = pattern.format("\\|".join(part for part in parts))
            text = meaning.replace("|", "\\|")
            yield (
                f"| `{name}` | {unit} | {text} | "
                f"{'all' if len(names) == len(labels) else ', '.join(names)} |"
            )


def _split(name: str, description: str) -> tuple[str, str, str, str]:
    """Return beginning, last part and end of a name, and the description without the last part."""
    match = _LAST_PART.match(name)
    if match is None or match[2] not in _COMPONENTS:
        return name, "", "", description
    return match[1], match[2], match[3], description.removesuffix(f": {match[2]}")


def replace_tables(text: str) -> str:
    """Return the text of the document with new tables."""
    before, rest = text.split(BEGIN)
    return before + BEGIN + make_tables() + END + rest.split(END)[1]


if __name__ == "__main__":
    DOCUMENT.write_text(replace_tables(DOCUMENT.read_text()))
