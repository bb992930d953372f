"""Turning circle and zig-zag scenarios of the Otter of MSS against the independent implementation
in NumPy.
"""

import math

import numpy as np
import pytest
from otter_reference import STEP, Otter

import cosim
from cosim.core import resources
from cosim.core.errors import InputError

SCENARIOS = resources.root() / "scenarios"
NUMPY = "`otter.m` a second time in NumPy"
SETTLING, DURATION = 2.0, 15.0


def rows(commands):
    """Place (x north, y east), heading (clockwise) after each step from the order on, from the
    steady speed ahead.
    """
    otter = Otter()
    otter.shafts[:], otter.nu[0] = 100.0, 2.85735
    for _ in range(20):
        otter.eta = otter.trim(otter.eta)
    for _ in range(round(SETTLING / STEP)):
        otter.step((100.0, 100.0))
    eta = [otter.eta]
    for _ in range(round(DURATION / STEP)):
        otter.step(commands(otter.eta[5]))
        eta.append(otter.eta)
    return np.array(eta)[:, [0, 1, 5]]


def passing(values, level):
    """Return the time (s) at which a value first passes a level, by linear interpolation between
    steps.
    """
    k = int(np.argmax(values >= level))
    return (k - (values[k] - level) / (values[k] - values[k - 1])) * STEP


@pytest.fixture(scope="module")
def circle():
    x, y, psi = rows(lambda _psi: (100.0, 60.0)).T
    quarter, half, t = passing(psi, math.pi / 2), passing(psi, math.pi), np.arange(len(psi)) * STEP
    x, y = x - x[0], y - y[0]
    return {
        "advance": np.interp(quarter, t, x),
        "transfer": np.interp(quarter, t, y),
        "tactical_diameter": np.interp(half, t, y),
        "time_to_90": quarter,
        "time_to_180": half,
    }


@pytest.fixture(scope="module")
def zigzag():
    side, angle = 1.0, math.radians(20)

    def commands(psi):
        nonlocal side
        if side * psi >= angle:
            side = -side
        return (100.0, 60.0) if side > 0 else (60.0, 100.0)

    psi = rows(commands)[:, 2]
    measures, first = {}, 0
    for number, sign in enumerate((1, -1, 1), 1):
        when = first * STEP + passing(sign * psi[first:], angle)
        row = math.ceil(when / STEP)
        back = row + int(np.argmax(-sign * psi[row:] >= angle))
        measures |= {
            f"execute[{number}]": when,
            f"overshoot[{number}]": (sign * psi[row:back]).max() - angle,
        }
        first = row
    return measures


@pytest.fixture(scope="module", params=["circle", "zigzag"])
def manoeuvre(request):
    name = {"circle": "otter_turning_circle", "zigzag": "otter_zigzag"}[request.param]
    return (
        request.param,
        cosim.run(SCENARIOS / f"{name}.json").kpis,
        request.getfixturevalue(request.param),
    )


def test_the_measures_are_those_of_the_independent_implementation(manoeuvre, measured):
    name, kpis, expected = manoeuvre
    for measure, value in expected.items():
        found, case = kpis[f"{name}.{measure}"], f"{name}, {measure}"
        measured(
            "Otter of MSS",
            "IMO measures from 100/100 rad/s",
            found,
            value,
            "m, s, rad",
            NUMPY,
            relative=1e-4,
            case=case,
        )


def test_a_manoeuvre_before_the_recording_is_refused():
    with pytest.raises(InputError, match="starts at -1 s, before the first recorded row"):
        cosim.run(
            SCENARIOS / "otter_zigzag.json",
            parameters={"/kpis/0/arguments/start": -1.0, "/stop_time": 1.0},
        )
