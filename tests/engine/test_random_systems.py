"""Random systems compared with a reference importer that copies one value at a time, in the order
of the stages.
"""

import math
import random

import pytest
from fakes import FakeComponent, inputs, outputs
from systems import run_system

from cosim.core.system import Connection, Endpoint, Group, System, component_names
from cosim.core.time_grid import exact_fraction
from cosim.core.units import parse_unit

UNITS = {name: parse_unit(name) for name in ("rad", "deg", "m", "mm", "degC", "K")} | {"": None}
STEPS = 12

pytestmark = pytest.mark.usefixtures("executor")


def mixed(seed, j, t, h, given):
    return math.sin(seed + j + t) + 0.3 * given[j] + 0.01 * sum(given) + h


def mixer(seed, units):
    """Return a component with one input and one output per unit: u0, u1, ... and y0, y1, ..."""
    indices = range(len(units))

    def step(values, t, h):
        given = [values[f"u{j}"] for j in indices]
        for j in indices:
            values[f"y{j}"] = mixed(seed, j, t, h, given)

    sides = [
        side(f"{letter}{j}", unit=UNITS[units[j]])[0]
        for side, letter in ((inputs, "u"), (outputs, "y"))
        for j in indices
    ]
    return FakeComponent(sides, step, start={f"y{j}": seed + 0.1 * j for j in indices})


def in_stages(draw, members):
    """Distribute the members in random order over random stages."""
    left, stages = draw.sample(members, len(members)), []
    while left:
        count = draw.randint(1, len(left))
        stages.append(tuple(left[:count]))
        left = left[count:]
    return tuple(stages)


def random_system(seed):
    """Return a random system of mixers with units, delays, sums, periods, stages and a group; and
    the units by component.
    """
    draw = random.Random(seed)  # noqa: S311
    names = [f"m{i}" for i in range(draw.randint(2, 5))]
    units = {name: draw.choices(list(UNITS), k=draw.randint(1, 6)) for name in names}
    outs = []
    for name in names:
        outs += [(Endpoint(name, f"y{j}"), unit) for j, unit in enumerate(units[name])]
    connections = []
    for name in names:
        for j, unit in enumerate(units[name]):
            sources = [source for source, other in outs if _fits(other, unit)]
            count = draw.choice([0, 1, 1, 1, 2, 3])
            for term in range(count):
                delay, numbers = (
                    draw.choice([0, 0, 0, 1, 2, 5]),
                    (draw.choice([1.0, -2.5]), 0.5, term + 1) if count > 1 else (),
                )
                connections.append(
                    Connection(draw.choice(sources), Endpoint(name, f"u{j}"), delay, "", *numbers)
                )
    grouped = draw.sample(names, draw.choice([0, 0, 1, 2]))
    outside = [name for name in names if name not in grouped]
    stages = in_stages(draw, outside + ([Group("g", in_stages(draw, grouped))] if grouped else []))
    counts = {name: draw.choice([1, 1, 1, 2, 3]) for name in names}
    periods = {name: exact_fraction(f"{n}/10") for name, n in counts.items() if n > 1}
    components = {name: mixer(i, units[name]) for i, name in enumerate(names)}
    return System(components, connections, stages, periods), units


def _fits(one, other):
    return not one or not other or UNITS[one].converts_to(UNITS[other])


class ReferenceImporter:
    """Simulates a system by copying every value of every step one by one."""

    def __init__(self, system, units):
        self.system, self.units = system, units
        self.seeds = {name: i for i, name in enumerate(units)}
        self.y = {}
        for name in units:
            self.y[name] = [self.seeds[name] + 0.1 * j for j in range(len(units[name]))]
        self.u = {name: [0.0] * len(units[name]) for name in units}
        self.terms = {(c.target, c.term): 0.0 for c in system.connections if c.term}
        self.delayed = {
            c: [self.y[c.source.component][int(c.source.scalar[1:])]] * c.delay
            for c in system.connections
        }

    def rows(self):
        rows = [{name: list(values) for name, values in self.y.items()}]
        for n in range(STEPS):
            self.stages(self.system.stages, set(self.units), n)
            rows.append({name: list(values) for name, values in self.y.items()})
        return rows

    def stages(self, stages, inside, n):
        for stage in stages:
            groups = [
                set(component_names(member.stages)) for member in stage if isinstance(member, Group)
            ]
            for connection in self.system.connections:
                ends = {connection.source.component, connection.target.component}
                reads_now = (
                    connection.target.component in component_names([stage])
                    and connection.source.component in inside
                )
                if reads_now and not any(ends <= group for group in groups):
                    self.read(connection)
            for member in stage:
                if not isinstance(member, Group):
                    self.step(member, n)
            for member in stage:
                if isinstance(member, Group):
                    self.stages(member.stages, set(component_names(member.stages)), n)

    def read(self, connection):
        source, target = connection.source.component, connection.target.component
        i, j = int(connection.source.scalar[1:]), int(connection.target.scalar[1:])
        queue = self.delayed[connection]
        queue.append(self.y[source][i])
        value, one, other = queue.pop(0), UNITS[self.units[source][i]], UNITS[self.units[target][j]]
        factor, offset = one.conversion(other) if one and other else (1.0, 0.0)
        factor, offset = connection.gain * factor, connection.gain * offset + connection.offset
        value = value if (factor, offset) == (1.0, 0.0) else factor * value + offset
        if connection.term:
            self.terms[connection.target, connection.term] = value
            value = self.sum(connection.target)
        self.u[target][j] = value

    def sum(self, target):
        first, *others = (value for (end, _), value in self.terms.items() if end == target)
        for value in others:
            first += value
        return first

    def step(self, name, n):
        count = int(self.system.periods.get(name, exact_fraction("1/10")) / exact_fraction("1/10"))
        if n % count == 0:
            h = float(exact_fraction("1/10") * count)
            given = self.u[name]
            self.y[name] = [mixed(self.seeds[name], j, n / 10, h, given) for j in range(len(given))]


@pytest.mark.parametrize("first", range(0, 120, 10))
def test_random_systems_follow_stages_units_delays_sums_and_periods(first):
    for seed in range(first, first + 10):
        system, units = random_system(seed)
        names = [f"{name}.y{j}" for name in units for j in range(len(units[name]))]
        recording = run_system(system, STEPS * exact_fraction("1/10"), "1/10", names)
        for n, row in enumerate(ReferenceImporter(system, units).rows()):
            found = {name: recording.columns[name][n] for name in names}
            assert found == {
                f"{name}.y{j}": row[name][j] for name in units for j in range(len(units[name]))
            }, (seed, n)
