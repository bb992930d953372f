"""Each effect on a multirotor separately, against its closed form."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from multirotor_reference import GRAVITY, VEHICLES, Vehicle, square_ground_effect
from plant_fmu import PlantFmu
from plant_validation import MeasurementCheck

from plant_src.catalogue import MODELS
from plant_src.vehicles.multirotor.equations import MultirotorEquations

CRAZYFLIE, HEXACOPTER = VEHICLES["crazyflie"], VEHICLES["survey_hexacopter"]
IMAGES = "Sanchez-Cuevas et al. 2017"
HIGH = {"initial.position.z": 100.0}
NO_DRAG = {f"rotor_drag.{axis}": 0.0 for axis in "xyz"} | {
    f"body_drag.{axis}": 0.0 for axis in "xyz"
}
STILL = {**HIGH, **NO_DRAG, "ground_effect": 0.0, "rotor_inertia": 0.0}


def commands(vehicle: Vehicle, speed: float) -> dict[str, float]:
    return {f"rotor_speed[{number}]": speed for number in range(1, len(vehicle.rotors) + 1)}


def kinetic_energy(fmu: PlantFmu, inertia: np.ndarray) -> float:
    rates = fmu.vector("rates", "pqr")
    return float(rates @ inertia @ rates) / 2


@pytest.mark.parametrize("name", VEHICLES)
def test_hover_speed_carries_the_weight(name: str, measured: MeasurementCheck) -> None:
    vehicle = VEHICLES[name]
    fmu = PlantFmu(name, {**HIGH, "initial_rotor_speed": vehicle.hover_speed})
    fmu.set(commands(vehicle, vehicle.hover_speed))
    fmu.step(0.01, 100)
    speed = fmu.get("velocity.z")  # of 9.81 m/s in free fall
    measured(
        "Crazyflie and survey hexacopter",
        "vertical speed after 1 s of hovering",
        speed,
        0.0,
        "m/s",
        "thrust = weight",
        within=1e-6,
        case=name,
    )


@pytest.mark.parametrize("name", VEHICLES)
def test_tumbling_without_torque_keeps_the_energy(name: str, measured: MeasurementCheck) -> None:
    rates = {"initial.rates.p": 3.0, "initial.rates.q": 0.5, "initial.rates.r": -2.0}
    fmu = PlantFmu(name, {**STILL, **rates})
    before = kinetic_energy(fmu, VEHICLES[name].inertia)
    axis_before = fmu.vector("rates", "pqr")
    fmu.step(0.01, 1000)
    after = kinetic_energy(fmu, VEHICLES[name].inertia)
    measured(
        "Crazyflie and survey hexacopter",
        "energy after 10 s of tumbling",
        after,
        before,
        "J",
        "conservation",
        relative=1e-6,
        case=name,
    )
    assert np.abs(fmu.vector("rates", "pqr") - axis_before).max() > 0.1  # it has tumbled


def test_rotors_follow_a_step_of_their_command_with_a_first_order_lag(
    measured: MeasurementCheck,
) -> None:
    """Climb from thrust k n^2 with n = c (1 - exp(-t/T)), integrated by hand."""
    lag, speed = 0.08, 1.1 * CRAZYFLIE.hover_speed
    fmu = PlantFmu("crazyflie", {**STILL, "rotor_time_constant": lag})
    fmu.set(commands(CRAZYFLIE, speed))
    pull = 4 * CRAZYFLIE.thrust * speed**2 / CRAZYFLIE.mass
    for _ in range(5):
        fmu.step(0.01, 10)
        t, once, twice = fmu.time, np.exp(-fmu.time / lag), np.exp(-2 * fmu.time / lag)
        expected = pull * (t - 2 * lag * (1 - once) + lag / 2 * (1 - twice)) - GRAVITY * t
        measured(
            "Crazyflie and survey hexacopter",
            "climb with lagging rotors",
            fmu.get("velocity.z"),
            expected,
            "m/s",
            "closed form",
            within=1e-6,
        )


@pytest.mark.parametrize("lag", [1e-9, 1e-5])
def test_a_lag_much_shorter_than_a_step_is_stable_and_has_no_effect(lag: float) -> None:
    found = []
    for time_constant in (lag, 0.0):
        fmu = PlantFmu(
            "crazyflie",
            {
                **STILL,
                "rotor_time_constant": time_constant,
                "initial_rotor_speed": CRAZYFLIE.hover_speed,
            },
        )
        for speed in (1500.0, 1600.0, 1400.0):
            fmu.set(commands(CRAZYFLIE, speed))
            fmu.step(0.01, 10)
        found.append(fmu.get("velocity.z")[0])
    assert found[0] == pytest.approx(
        found[1], abs=0.02
    )  # m/s; a quarter of a step of another thrust, three times


def test_body_drag_ends_a_fall_at_the_terminal_velocity(measured: MeasurementCheck) -> None:
    fmu = PlantFmu("survey_hexacopter", {**HIGH, "ground_effect": 0.0})
    fmu.step(10.0, 5)
    speed, terminal = (
        -fmu.get("velocity.z"),
        np.sqrt(HEXACOPTER.mass * GRAVITY / HEXACOPTER.body_drag[2]),
    )
    measured(
        "Crazyflie and survey hexacopter",
        "terminal velocity by body drag",
        speed,
        terminal,
        "m/s",
        "closed form",
        relative=1e-9,
    )


def test_rotor_drag_ends_a_descent_at_the_terminal_velocity(measured: MeasurementCheck) -> None:
    speed, drag = 0.97 * CRAZYFLIE.hover_speed, CRAZYFLIE.rotor_drag[2]
    fmu = PlantFmu("crazyflie", {**HIGH, "initial_rotor_speed": speed, "ground_effect": 0.0})
    fmu.set(commands(CRAZYFLIE, speed))
    fmu.step(10.0, 20)
    terminal = (CRAZYFLIE.mass * GRAVITY - 4 * CRAZYFLIE.thrust * speed**2) / (4 * speed * drag)
    measured(
        "Crazyflie and survey hexacopter",
        "terminal velocity by rotor drag",
        -fmu.get("velocity.z"),
        terminal,
        "m/s",
        "closed form",
        relative=1e-9,
    )


def test_a_falling_body_drifts_with_the_wind() -> None:
    fmu = PlantFmu("survey_hexacopter", {**HIGH, "ground_effect": 0.0})
    fmu.set({"wind.x": 4.0, "wind.y": -3.0, "wind.z": 1.0})
    fmu.step(10.0, 12)
    terminal = np.sqrt(HEXACOPTER.mass * GRAVITY / HEXACOPTER.body_drag[2])
    assert fmu.vector("velocity") == pytest.approx([4.0, -3.0, 1.0 - terminal], abs=1e-6)


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("height", [0.1, 0.5, 0.8, 1.5, 3.0, 10.0])
def test_ground_effect_adds_the_published_share_of_thrust(
    name: str, height: float, measured: MeasurementCheck
) -> None:
    """`height` in rotor radii; below half a radius the effect no longer grows."""
    vehicle = VEHICLES[name]
    fmu = PlantFmu(name, {**STILL, "ground_effect": 1.0, "rotor_time_constant": 0.0})
    fmu.set({**commands(vehicle, vehicle.hover_speed), "ground_distance": height * vehicle.radius})
    fmu.step(0.01)
    share = 1 / (1 - vehicle.inflow_reduction(max(height, 0.5) * vehicle.radius)) - 1
    thrust = fmu.get("velocity.z") / 0.01
    measured(
        "Crazyflie and survey hexacopter",
        "thrust added by ground effect, over mass",
        thrust,
        GRAVITY * share,
        "m/s2",
        IMAGES,
        relative=1e-9,
        case=name,
    )


def test_far_from_a_surface_there_is_no_ground_effect() -> None:
    fmu = PlantFmu("crazyflie", {**STILL, "ground_effect": 1.0, "rotor_time_constant": 0.0})
    fmu.set(commands(CRAZYFLIE, CRAZYFLIE.hover_speed))
    fmu.step(0.01)
    assert abs(fmu.get("velocity.z")[0]) < 1e-10  # at the usual distance of 1000 m


def rates_after_a_moment(
    parameters: dict[str, float], speeds: dict[str, float], moment: float
) -> np.ndarray:
    fmu = PlantFmu("survey_hexacopter", {**STILL, "initial.rates.q": 2.0, **parameters})
    fmu.set(speeds)
    fmu.step(moment)
    return fmu.vector("rates", "pqr")


def test_spinning_rotors_turn_a_pitching_body_about_its_roll_axis(
    measured: MeasurementCheck,
) -> None:
    """Rotors 2, 4 and 6 turn counter-clockwise: their momentum H along z, carried along at q, takes
    the torque -q H about x.
    """
    inertia, speed, moment = 3.5e-4, 400.0, 1e-5
    speeds = {f"rotor_speed[{number}]": speed for number in (2, 4, 6)}
    without, with_rotors = (
        rates_after_a_moment({"rotor_time_constant": 0.0, "rotor_inertia": value}, speeds, moment)
        for value in (0.0, inertia)
    )
    expected = -2.0 * 3 * inertia * speed / HEXACOPTER.inertia[0, 0]
    found = (with_rotors - without) / moment
    assert found[1:] == pytest.approx(0.0, abs=1e-3)
    measured(
        "Crazyflie and survey hexacopter",
        "gyroscopic roll acceleration",
        found[0],
        expected,
        "rad/s2",
        "-q H / I",
        relative=1e-3,
    )


def test_accelerating_rotors_turn_the_body_in_the_opposite_direction() -> None:
    inertia, lag, speed, moment = 3.5e-4, 0.05, 400.0, 1e-6
    speeds = {f"rotor_speed[{number}]": speed for number in (2, 4, 6)}
    without, with_rotors = (
        rates_after_a_moment({"rotor_time_constant": lag, "rotor_inertia": value}, speeds, moment)
        for value in (0.0, inertia)
    )
    expected = -3 * inertia * speed / lag / HEXACOPTER.inertia[2, 2]
    assert (with_rotors - without)[2] / moment == pytest.approx(expected, rel=1e-3)


def test_without_effects_shorter_code_gives_the_same_flight() -> None:
    """A negligible effect selects the longer function."""
    found = []
    for drag in (0.0, 1e-200):
        fmu = PlantFmu("ar_drone", {**HIGH, "initial.rates.p": 1.0, "body_drag.x": drag})
        for number, speed in enumerate((345.0, 350.0, 344.0, 349.0), 1):
            fmu.set({f"rotor_speed[{number}]": speed})
        fmu.step(0.01, 200)
        found.append(
            [
                *fmu.vector("position"),
                *fmu.vector("orientation", "wxyz"),
                *fmu.vector("rates", "pqr"),
            ]
        )
    assert found[0] == pytest.approx(found[1], rel=1e-12, abs=1e-12)


def test_wind_carries_the_ground_effect_away(measured: MeasurementCheck) -> None:
    """Cheeseman and Bennett in forward flight: the reduction of the inflow over 1 + (V / v)^2."""
    fmu = PlantFmu("ar_drone", {**HIGH, "ground_effect": 1.0})
    thrust = 8.24e-6 * 350.0**2
    induced = np.sqrt(thrust / (2 * 1.225 * np.pi * 0.1016**2))
    for wind in (0.0, 3.0, 7.0):
        sums = []
        for distance in (0.15, 1e3):
            fmu = PlantFmu("ar_drone", {**HIGH, "ground_effect": 1.0})
            fmu.set(
                {f"rotor_speed[{k}]": 350.0 for k in range(1, 5)}
                | {"wind.x": wind, "ground_distance": distance}
            )
            fmu.step(1e-4)
            sums.append((fmu.get("velocity.z").item() / 1e-4 + GRAVITY) * 0.443892)
        reduction = square_ground_effect(0.1016, 0.181777 * np.sqrt(2))(0.15) / (
            1 + (wind / induced) ** 2
        )
        measured(
            "Multirotors",
            "ratio of thrust in ground effect, in wind",
            sums[0] / sums[1],
            1 / (1 - reduction),
            "1",
            "Cheeseman and Bennett 1955",
            relative=2e-3,
            case=f"{wind} m/s",
        )


def test_translational_lift_grows_with_the_air_speed_up_to_half_the_tip_speed(
    measured: MeasurementCheck,
) -> None:
    for wind, square in ((4.0, 16.0), (30.0, (0.5 * 0.1016 * 350.0) ** 2)):
        fmu = PlantFmu("ar_drone", {**HIGH, "translational_lift": 0.01})
        fmu.set({f"rotor_speed[{k}]": 350.0 for k in range(1, 5)} | {"wind.y": wind})
        fmu.step(1e-4)
        thrust = (fmu.get("velocity.z").item() / 1e-4 + GRAVITY) * 0.443892
        expected = 4 * (8.24e-6 * 350.0**2 + 0.01 * square)
        measured(
            "Multirotors",
            "thrust with translational lift",
            thrust,
            expected,
            "N",
            "closed form",
            relative=1e-6,
            case=f"{wind} m/s",
        )


def test_the_rate_of_the_state_is_the_derivative_of_a_step() -> None:
    random, moment = np.random.default_rng(5), 1e-6
    state = np.concatenate(
        [
            random.standard_normal(3),
            [1, 0, 0, 0],
            random.standard_normal(6),
            1500 + random.standard_normal(4),
        ]
    )
    inputs = np.concatenate(
        [
            0.01 * random.standard_normal(6),
            1600 + random.standard_normal(4),
            [1, 2, 3, 0.05, 0.9, -9, 0, 0],
        ]
    )
    model = MODELS["crazyflie"]
    effects = [0.07, 5e-8, 1e-6, 2e-6, 1e-6, 0.01, 0.02, 0.03, 1.0, 1e-3]
    equations = MultirotorEquations(model.airframe, 4)
    parameters = ca.SX([*model.start_values("parameter")[: -len(effects)], *effects])
    constants = ca.DM(equations.constants.vector(parameters)).full().ravel()
    symbols = [ca.SX.sym("", len(vector)) for vector in (state, inputs, constants)]
    rate = ca.Function("rate", symbols, [equations.rate(*symbols)])(state, inputs, constants)
    after = ca.Function("after", symbols, [equations.step_with_effects(*symbols, ca.SX(moment))])(
        state, inputs, constants
    )
    assert ((after - state) / moment).full().ravel() == pytest.approx(
        rate.full().ravel(), rel=1e-3, abs=1e-3
    )
