"""The Strider's hydrostatics, wave loads and resistance against strip theory and published
formulas.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from catamaran_reference import (
    AREA,
    BODY,
    BOX_DRAUGHT,
    DENSITY,
    GRAVITY,
    LENGTH,
    MASS,
    OFFSET,
    Catamaran,
)
from plant_validation import MeasurementCheck
from scipy.integrate import solve_ivp
from world_harness import WorldHarness, vessel_settings

from plant_src.environment import sea
from plant_src.environment.sea import Sea
from plant_src.vehicles.strider_6dof import parameters as p

MODEL = "Strider, six degrees of freedom"
BEAM_SEA, FLOAT_HEIGHT = np.pi / 2, 0.1245
STRIP_THEORY = "strip theory of twin hulls (Faltinsen 1990)"


def regular_waves(period: float, direction: float = BEAM_SEA, steepness: float = 1e-3) -> Sea:
    """One component with a height of `steepness` times its length; longer than the hull's draught
    it stays small.
    """
    frequency = np.array([2 * np.pi / period])
    number = frequency**2 / GRAVITY
    return Sea(steepness * np.pi / number, frequency, number, np.array([direction]), np.zeros(1))


@pytest.fixture(scope="module")
def static_load() -> Callable[..., np.ndarray]:
    """Function from orientation, height and elevations at the strips to the load of buoyancy and
    weight.
    """
    casadi = pytest.importorskip("casadi")
    from plant_src.vehicles.common import kinematics
    from plant_src.vehicles.strider_6dof import equations
    from plant_src.vehicles.vessel.strips import immersion

    q, height, elevations = casadi.SX.sym("q", 4), casadi.SX.sym("z"), casadi.SX.sym("e", 10)
    up = kinematics.rotation_matrix(q)[2, :].T
    load = equations.buoyancy_and_weight(
        immersion(equations._TWIN_HULL, up, height, elevations), up
    )
    function = casadi.Function("load", [q, height, elevations], [load])
    return lambda *arguments: function(*arguments).full().ravel()


def heeled(angle: float) -> list[float]:
    return [np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0]


@pytest.mark.parametrize("period", [0.8, 1.0, 1.25, 2.0])
def test_exciting_force_and_moment_in_beam_waves(
    period: float, static_load: Callable[..., np.ndarray], measured: MeasurementCheck
) -> None:
    """The held vessel in a wave that stands still: cos(k b) of the heave, sin(k b) / (k b) of the
    slope.
    """
    waves = regular_waves(period)
    k, amplitude = waves.wave_number[0], waves.amplitude[0]
    offset = np.sqrt(p.TRANSVERSE_MOMENT / p.WATERPLANE_AREA)
    crest, slope = (
        static_load(
            heeled(0.0),
            FLOAT_HEIGHT,
            amplitude * np.repeat(np.cos(k * offset * np.array([1, -1]) + phase), 5),
        )
        for phase in (0.0, -np.pi / 2)
    )
    stiffness = DENSITY * GRAVITY * AREA
    found = crest[2] / stiffness / amplitude, slope[3] / (stiffness * OFFSET**2) / (k * amplitude)
    expected = np.cos(k * OFFSET), np.sin(k * OFFSET) / (k * OFFSET)
    measured(
        MODEL,
        "exciting force over stiffness",
        found,
        expected,
        "1, rad/rad",
        STRIP_THEORY,
        within=0.05,
        case=f"T {period:g} s",
    )


@pytest.mark.parametrize("period", [0.8, 1.0, 1.25, 2.0])
def test_response_in_beam_waves(period: float, measured: MeasurementCheck) -> None:
    """With the pressure that accelerates the water, by linear mass, damping and stiffness."""
    waves = regular_waves(period)
    w, k, b = waves.frequency[0], waves.wave_number[0], OFFSET
    heave, roll = response(waves, period)
    decay = np.exp(-k * BOX_DRAUGHT / 2)
    mass, added, displaced = (
        np.diag(BODY)[2:4],
        np.diag(p.ADDED_MASS)[2:4],
        MASS * np.array([1.0, b**2]),
    )
    pressure = DENSITY * GRAVITY * AREA * np.array([1.0, b**2]) - [
        0,
        decay * MASS * GRAVITY * (FLOAT_HEIGHT + BOX_DRAUGHT / 2),
    ]
    moving = 1j * w * np.array(p.DAMPING[:2])
    shape = np.array([np.cos(k * b), np.sin(k * b) / (k * b)])
    excitation = shape * (pressure + decay * (moving - w**2 * (displaced + added)))
    expected = np.abs(excitation / (np.array(p.STIFFNESS[:2]) + moving - w**2 * (mass + added)))
    found = [heave, roll]
    measured(
        MODEL,
        "heave and roll over those of the wave",
        found,
        expected,
        "1",
        STRIP_THEORY,
        within=0.05,
        case=f"T {period:g} s",
    )


def response(waves: Sea, period: float, periods: int = 12) -> tuple[float, float]:
    """Amplitudes of heave over that of the elevation and of roll over that of the slope, at the
    place of the vessel.
    """
    amplitude, number = waves.amplitude[0], waves.wave_number[0]
    trial = at_sea(waves)
    trial.step(round(4 * period / 0.01))
    rows = []
    for _ in range(round(periods * period / 0.01)):
        trial.step()
        rows.append(
            (
                number * trial["usv.position.y"] - waves.frequency[0] * trial.steps * 0.01,
                trial["usv.position.z"],
                trial["usv.attitude.roll"],
            )
        )
    angle, z, roll = np.array(rows).T
    basis = np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(angle)])
    heave, slope = (
        np.hypot(*np.linalg.lstsq(basis, signal, rcond=None)[0][:2]) for signal in (z, roll)
    )
    return heave / amplitude, slope / (number * amplitude)


def at_sea(waves: Sea, vehicle: Mapping[str, object] | None = None, **more: object) -> WorldHarness:
    """The vessel in regular waves; their settings are found from the components."""
    vehicle = vehicle or vessel_settings([0.0, 0.0], motion="6dof", **more)
    period = 2 * np.pi / waves.frequency[0]
    settings = {
        "seed": 1,
        "waves": {"significant_height": 1.0, "peak_period": 1.0, "components": 1},
    }
    unit = sea(settings)
    share = unit.frequency[0] / (2 * np.pi)
    height = waves.amplitude[0] / unit.amplitude[0]
    environment = {
        "seed": 1,
        "waves": {**settings["waves"], "significant_height": height, "peak_period": period * share},
    }
    environment["waves"]["direction"] = float(waves.direction[0])
    return WorldHarness({"usv": vehicle}, environment=environment)


def test_long_beam_waves(measured: MeasurementCheck) -> None:
    """It rides on waves of 624 m."""
    measured(
        MODEL,
        "heave and roll over those of the wave, T 20 s",
        response(regular_waves(20.0), 20.0, 1),
        1.0,
        "1",
        "limit of long waves",
        within=0.01,
    )


def test_stiffness_and_limit_of_the_righting_moment(
    static_load: Callable[..., np.ndarray], measured: MeasurementCheck
) -> None:
    """Small heel: rho g V GM. At its limit one hull carries the vessel: m g times the offset of the
    hulls.
    """
    small, volume = 1e-4, MASS / DENSITY
    metacentric_height = p.TRANSVERSE_MOMENT / volume - FLOAT_HEIGHT - BOX_DRAUGHT / 2
    found = -static_load(heeled(small), FLOAT_HEIGHT, np.zeros(10))[3] / small
    expected = DENSITY * GRAVITY * volume * metacentric_height
    measured(
        MODEL, "static roll stiffness", found, expected, "N.m/rad", "rho g V GM", relative=1e-3
    )
    moments = [
        -static_load(heeled(angle), floating_height(angle, static_load), np.zeros(10))[3]
        for angle in np.radians(range(1, 60))
    ]
    measured(
        MODEL,
        "largest righting moment",
        max(moments),
        MASS * GRAVITY * OFFSET,
        "N.m",
        "one hull carries the vessel",
        relative=0.02,
    )
    assert moments[1] > 0.9 * max(moments)  # at 2 degrees
    assert (
        static_load(heeled(np.pi / 2), floating_height(np.pi / 2, static_load), np.zeros(10))[3] > 0
    )  # it capsizes


def floating_height(angle: float, static_load: Callable[..., np.ndarray]) -> float:
    """Height at which buoyancy carries the weight, by bisection."""
    low, high = -1.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        lift = static_load(heeled(angle), middle, np.zeros(10))[1:3] @ [
            np.sin(angle),
            np.cos(angle),
        ]
        low, high = (middle, high) if lift > 0 else (low, middle)
    return low


def test_a_push_capsizes_it() -> None:
    """25 N m exceed the largest righting moment."""
    trial = WorldHarness({"usv": vessel_settings([0.0, 0.0], motion="6dof")})
    trial["usv.external_torque.x"] = 25.0
    trial.step(400)
    assert trial["usv.crashed"]


def test_it_starts_on_the_waves_without_a_jump() -> None:
    """In steep waves the vertical acceleration stays that of the water; a level start in still
    water is thrown up or down.
    """
    waves = regular_waves(2.5, steepness=0.06)
    water = waves.amplitude[0] * waves.frequency[0] ** 2
    largest = []
    for parameters in ({}, {"initial.on_waves": 0.0}):
        trial = at_sea(waves, parameters=parameters)
        speeds = [trial["usv.velocity.z"]] + [trial.step()["usv.velocity.z"] for _ in range(30)]
        largest.append(np.abs(np.diff(speeds)).max() / 0.01)
    assert largest[0] < 1.3 * water
    assert largest[1] > 2 * water


def test_friction_is_that_of_ittc_57(measured: MeasurementCheck) -> None:
    casadi = pytest.importorskip("casadi")
    from plant_src.vehicles.strider import equations as resistance

    u = casadi.SX.sym("u")
    function = casadi.Function("friction", [u], [resistance.friction_coefficient(u)])
    speeds = np.array([-3.0, 0.02, 0.1, 0.5, 1.0, 2.0, 5.0])
    found, reynolds = (
        function(casadi.DM(speeds).T).full().ravel(),
        np.abs(speeds) * LENGTH / 1.0034e-6,
    )
    expected = 0.075 / (np.log10(reynolds) - 2) ** 2
    measured(
        "Strider, planar",
        "friction coefficient from 0.02 to 5 m/s",
        found,
        expected,
        "1",
        "ITTC-57",
        relative=1e-12,
    )


@pytest.mark.parametrize("froude", [0.4, 0.5, 0.7, 1.0, 1.2])
def test_residuary_resistance_is_that_of_thin_ships(
    froude: float, measured: MeasurementCheck
) -> None:
    speed = froude * np.sqrt(GRAVITY * LENGTH)
    reference = Catamaran()
    friction = 0.075 / (np.log10(speed * LENGTH / 1.0034e-6) - 2) ** 2
    wetted = 2 * LENGTH * (AREA / 2 / LENGTH + 2 * 0.0195)
    found = -reference.resistance(speed) - DENSITY / 2 * wetted * friction * speed**2
    expected = 2 * michell_resistance(speed)
    measured(
        "Strider, planar",
        "residuary resistance",
        found,
        expected,
        "N",
        "Michell's integral",
        relative=0.12,
        case=f"Fn {froude:g}",
    )


def michell_resistance(speed: float) -> float:
    """Michell (1898) for a wall-sided hull with the waterlines 1 - |2 x / L|^n of its block
    coefficient, n = 6.1.
    """
    draught, k = 0.0195, GRAVITY / speed**2
    block = MASS / DENSITY / (2 * LENGTH * 0.126 * draught)
    n = block / (1 - block)
    nodes, weights = np.polynomial.legendre.leggauss(120)
    x = nodes * LENGTH / 2
    slope = -0.126 / 2 * n * np.sign(nodes) * np.abs(nodes) ** (n - 1) / (LENGTH / 2)
    t, dt = np.linspace(0, 3.5, 1500, retstep=True)
    secant = np.cosh(t)
    down = -np.expm1(-k * secant**2 * draught) / (k * secant**2)
    amplitude = np.exp(1j * k * np.outer(secant, x)) @ (slope * weights * LENGTH / 2) * down
    integrand = np.abs(amplitude) ** 2 * secant**2
    return (
        4
        * DENSITY
        * GRAVITY**2
        / (np.pi * speed**2)
        * np.sum((integrand[1:] + integrand[:-1]) / 2)
        * dt
    )


def test_a_current_from_ahead_carries_it_along(measured: MeasurementCheck) -> None:
    """The relative velocity decays by the resistance; still air holds it back."""
    reference = Catamaran()
    solution = solve_ivp(
        lambda _, u: (reference.resistance(u[0] - 0.4) - 0.1 * u[0] * abs(u[0])) / MASS,
        (0, 30),
        [0.0],
        "DOP853",
        rtol=1e-11,
        atol=1e-12,
    )
    trial = WorldHarness(
        {"usv": vessel_settings([0.0, 0.0])}, environment={"current": {"velocity": [0.4, 0.0]}}
    )
    trial.step(3000)
    measured(
        "Strider, planar",
        "speed after 30 s in a current of 0.4 m/s",
        trial["usv.velocity.x"],
        solution.y[0, -1],
        "m/s",
        "DOP853",
        within=1e-6,
    )
