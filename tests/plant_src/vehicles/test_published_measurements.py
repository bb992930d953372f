"""Models compared with measured vehicles; docs/validation_measurements.md
describes the measurements.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from world_harness import WorldHarness

from plant_src.catalogue import MODELS

AR_DRONE, BLUEBOAT, BLUEROV, CRAZYFLIE = (
    "AR.Drone 2.0 in flight",
    "BlueBoat",
    "BlueROV2 Heavy",
    "Crazyflie 2.1",
)
CYBERSHIP, HERON, OTTER, WAMV = "CyberShip II", "Heron", "Otter at sea", "WAM-V 16"
RUNS, LAKE, BENDERS = (
    "runs of a BlueBoat, 2024",
    "runs of a Kingfisher, 2018",
    "flight data, Benders 2020",
)
OSLO, MEASURED = "runs of an Otter, 2024", "otter_measured"
SARDA, TRIALS = "bollard pull, Sarda et al. 2016", "trials, second hand"
GRAVITY = 9.81
RPM = np.pi / 30


def vessel(model: str, **settings: object) -> WorldHarness:
    return WorldHarness({"usv": {"model": model, "position": [0, 0], **settings}})


def speed(trial: WorldHarness) -> float:
    return float(np.hypot(*trial.vector("usv.velocity_body", "uv")))


def run(
    trial: WorldHarness,
    commands: list[float],
    duration: float,
    value: Callable[[WorldHarness], float] = speed,
) -> np.ndarray:
    """Return a value of every step (10 ms) while the propellers have these commands (rad/s)."""
    trial["usv.propeller_speed"] = commands
    return np.array([value(trial.step()) for _ in range(round(100 * duration))])


def turns_per_minute(
    trial: WorldHarness, port: float, starboard: float, duration: float
) -> np.ndarray:
    """Return the speed (m/s) of every step while the shafts turn so fast (1/min)."""
    return run(trial, [RPM * port, RPM * starboard], duration)


def time_between(speeds: np.ndarray, first: float, second: float) -> float:
    """Return the time (s) from the first sample beyond the first speed to that beyond the second
    one.
    """
    sign = np.sign(second - first)
    return 0.01 * float(
        np.argmax(sign * speeds > sign * second) - np.argmax(sign * speeds > sign * first)
    )


def vertical_acceleration(model: str, mass: float, rotor_speed: float) -> float:
    """Return the acceleration (m/s2) of a level multirotor at rest in the first step."""
    parameters = {"mass": mass, "initial_rotor_speed": rotor_speed}
    trial = WorldHarness(
        {"uav": {"model": model, "position": [0, 0, 50], "parameters": parameters}}
    )
    trial["uav.rotor_speed"] = [rotor_speed] * 4
    return float(trial.step()["uav.velocity.z"]) / 0.01


def rotor_thrust(model: str, mass: float, rotor_speed: float) -> float:
    return mass * (GRAVITY + vertical_acceleration(model, mass, rotor_speed)) / 4


@pytest.mark.parametrize(("mass", "pwm"), [(0.481, 169.06), (0.497, 172.91)])
def test_ar_drone_hovers_with_the_measured_rotor_speed(measured, mass: float, pwm: float) -> None:
    thrust, weight = rotor_thrust("ar_drone", mass, 1.451 * pwm + 130.9), mass * GRAVITY / 4
    measured(
        AR_DRONE,
        "thrust of a rotor, hover",
        thrust,
        weight,
        "N",
        BENDERS,
        relative=0.02,
        case=f"{mass} kg",
    )


def test_ar_drone_thrust_lies_between_two_test_benches(measured) -> None:
    thrust = rotor_thrust("ar_drone", 0.481, 376.2)
    delft = np.polyval([8.386e-6, -3.723e-5, -0.03818], 376.2)
    eindhoven = 9.36e-6 * 376.2**2
    assert delft < thrust < eindhoven
    measured(
        AR_DRONE,
        "thrust at 376 rad/s, test bench in Delft",
        thrust,
        delft,
        "N",
        BENDERS,
        relative=0.05,
    )
    measured(
        AR_DRONE,
        "thrust at 376 rad/s, test bench in Eindhoven",
        thrust,
        eindhoven,
        "N",
        BENDERS,
        relative=0.15,
    )


#: signs of the changes of the four rotors (front, left, rear, right arm) and axis; the hull points
#: between front and right arm
HULL_AXES = {
    "roll": ([1, 1, -1, -1], [1, -1, 0]),
    "pitch": ([1, -1, -1, 1], [1, 1, 0]),
    "yaw": ([-1, 1, -1, 1], [0, 0, 1]),
}


@pytest.mark.parametrize(
    ("name", "expected"), [("roll", 3.85e-4), ("pitch", 4.15e-4), ("yaw", 3.35e-5)]
)
def test_ar_drone_angular_acceleration(measured, name: str, expected: float) -> None:
    signs, axis = np.array(HULL_AXES[name][0]), np.array(HULL_AXES[name][1])
    rates = []
    for change in (100.0, -100.0):
        trial = WorldHarness(
            {
                "uav": {
                    "model": "ar_drone",
                    "position": [0, 0, 50],
                    "parameters": {"initial_rotor_speed": 363.0},
                }
            }
        )
        trial["uav.rotor_speed"] = np.sqrt(363.0**2 + change * signs).tolist()
        rates.append(trial.step().vector("uav.rates", "pqr"))
    acceleration = abs((rates[0] - rates[1]) @ axis / np.linalg.norm(axis)) / 0.01 / 800.0
    measured(
        AR_DRONE, (
            "angular acceleration over difference of squared speeds"
        ), acceleration, expected, "rad", BENDERS,
        relative=0.6, case=name,
    )  # fmt: skip


def test_blueboat_runs_straight(measured) -> None:
    trial = vessel("blueboat")
    speeds = run(trial, [320.0, 320.0], 15)
    measured(
        BLUEBOAT,
        "speed at full power ahead (identified)",
        speeds[-1],
        3.07,
        "m/s",
        RUNS,
        relative=0.02,
    )
    measured(
        BLUEBOAT,
        "acceleration from 0.8 to 2.5 m/s",
        time_between(speeds, 0.8, 2.5),
        0.69,
        "s",
        RUNS,
        relative=0.1,
    )
    speeds = run(trial, [0.0, 0.0], 12)
    measured(
        BLUEBOAT,
        "coasting from 1.3 to 0.7 m/s",
        time_between(speeds, 1.3, 0.7),
        1.93,
        "s",
        RUNS,
        relative=0.2,
    )
    measured(
        BLUEBOAT,
        "coasting from 1.3 to 0.5 m/s",
        time_between(speeds, 1.3, 0.5),
        3.6,
        "s",
        RUNS,
        relative=0.2,
    )
    astern = run(vessel("blueboat"), [-320.0, -320.0], 15)
    measured(
        BLUEBOAT,
        "speed at full power astern (identified)",
        astern[-1],
        2.28,
        "m/s",
        RUNS,
        relative=0.02,
    )


def test_blueboat_turns(measured) -> None:
    trial = vessel("blueboat")
    speeds = run(trial, [0.0, 320.0], 20)
    measured(BLUEBOAT, "speed with one thruster", speeds[-1], 2.07, "m/s", RUNS, relative=0.1)
    measured(
        BLUEBOAT,
        "yaw rate with one thruster (identified)",
        trial["usv.rates.r"],
        0.208,
        "rad/s",
        RUNS,
        relative=0.05,
    )
    trial = vessel("blueboat")
    boat = MODELS["blueboat"].boat
    assert boat is not None
    propeller = boat.propellers[0]
    ahead = 320.0 * (propeller.reverse_thrust_coefficient / propeller.thrust_coefficient) ** 0.5
    run(trial, [-320.0, ahead], 10)
    measured(
        BLUEBOAT,
        "yaw rate with opposed thrusters (identified)",
        trial["usv.rates.r"],
        0.89,
        "rad/s",
        RUNS,
        relative=0.05,
    )
    rates = run(trial, [0.0, 0.0], 1, lambda trial: trial["usv.rates.r"])
    decay = np.log(rates[49] / rates[99]) / 0.5
    measured(BLUEBOAT, "decay of the yaw rate (identified)", decay, 1.73, "1/s", RUNS, relative=0.1)


@pytest.mark.parametrize(("sense", "expected"), [("ahead", 36.4), ("astern", -28.6)])
def test_bluerov_thrust(measured, sense: str, expected: float) -> None:
    """Thrust from the surge acceleration in the first step, with four horizontal thrusters at 45
    degrees.
    """
    rov = {
        "model": "bluerov2_heavy",
        "position": [0, 0, -10],
        "parameters": {"thruster_time_constant": 0.0},
    }
    trial = WorldHarness({"rov": rov})
    trial["rov.thruster_speed"] = [
        *(np.sign(expected) * np.array([283.0, 283.0, -283.0, -283.0])),
        0,
        0,
        0,
        0,
    ]
    thrust = float(trial.step()["rov.velocity_body.u"]) / 0.01 * (13.5 + 6.36) / (4 * 0.5**0.5)
    measured(
        BLUEROV,
        "largest thrust of a thruster",
        thrust,
        expected,
        "N",
        "T200 at 12 V, maker",
        relative=0.2,
        case=sense,
    )


@pytest.mark.parametrize(
    ("turns", "grams"), [(10885, 10.9), (14691, 21.0), (17174, 28.6), (20539, 41.7), (23882, 57.9)]
)
def test_crazyflie_thrust(measured, turns: int, grams: float) -> None:
    thrust, expected = 4 * rotor_thrust("crazyflie", 0.027, turns * np.pi / 30), grams * 9.80665e-3
    measured(
        CRAZYFLIE,
        "thrust of all rotors",
        thrust,
        expected,
        "N",
        "Bitcraze 2015",
        relative=0.1,
        case=f"{turns} 1/min",
    )


@pytest.mark.parametrize("angle", [10, 20, 30])
def test_cybership_turns_by_its_rudders(measured, angle: int) -> None:
    """Yaw acceleration at 0.5 m/s without thrust, from inertia matrix and identified lift."""
    delta, u, lever = np.radians(angle), 0.5, 0.549
    inertia = np.array([[33.8, 23.8 * 0.046], [23.8 * 0.046, 2.76]])
    lift = 2 * (6.43306 * delta - 5.83594 * delta**2) * u**2  # of both rudders
    expected = np.linalg.solve(inertia, [lift, -lever * lift])[1]
    trial = vessel("cybership2", velocity_body=[u, 0, 0])
    trial["usv.rudder_angle"] = [delta, delta]
    acceleration = float(trial.step()["usv.rates.r"]) / 0.01
    measured(
        CYBERSHIP, (
            "yaw acceleration by the rudders at 0.5 m/s"
        ), acceleration, expected, "rad/s2", "Skjetne et al. 2004",
        relative=0.1, case=f"{angle} degrees",
    )  # fmt: skip


def test_heron_runs_straight(measured) -> None:
    speeds = run(vessel("heron"), [100.0, 100.0], 20)
    measured(HERON, "speed at full power", speeds[-1], 1.7, "m/s", "maker", relative=0.15)
    measured(HERON, "speed at full power, on a lake", speeds[-1], 1.5, "m/s", LAKE, relative=0.05)
    measured(
        HERON,
        "acceleration from 0.5 to 1.0 m/s",
        time_between(speeds, 0.5, 1.0),
        0.73,
        "s",
        LAKE,
        relative=0.2,
    )


def test_heron_turns(measured) -> None:
    """A turn from rest with one jet ahead and the other astern."""
    trial = vessel("heron")
    headings = np.degrees(
        run(trial, [-100.0, 100.0], 3.85, lambda trial: trial["usv.attitude.yaw"])
    )
    measured(
        HERON,
        "turn from 10 to 40 degrees",
        time_between(headings, 10, 40),
        1.0,
        "s",
        LAKE,
        relative=0.25,
    )
    measured(
        HERON,
        "turn from 40 to 80 degrees (identified)",
        time_between(headings, 40, 80),
        1.73,
        "s",
        LAKE,
        relative=0.05,
    )
    measured(HERON, "speed after 80 degrees", speed(trial), 0.92, "m/s", LAKE, relative=0.15)


def test_otter_top_speed(measured) -> None:
    otter, recorded = (run(vessel(model), [120.0, 120.0], 20)[-1] for model in ("otter", MEASURED))
    measured(
        OTTER,
        "speed at full power (identified)",
        otter,
        6 * 0.5144,
        "m/s",
        "maker",
        relative=0.01,
        case="otter",
    )
    measured(
        OTTER,
        "speed at full power",
        recorded,
        6 * 0.5144,
        "m/s",
        "maker",
        relative=0.15,
        case=MEASURED,
    )


def otter_figures(model: str) -> dict[str, float]:
    """Return what the recorded runs of an Otter show, of a model: times (s), speeds (m/s) and yaw
    rates to starboard (rad/s).
    """
    coasting = turns_per_minute(vessel(model, velocity_body=[1.6, 0, 0]), 0, 0, 5)
    start = turns_per_minute(vessel(model), 930, 930, 5)
    found = {
        "coasting": time_between(coasting, 1.4, 0.62),
        "fast coasting": time_between(coasting, 1.51, 0.82),
        "acceleration": time_between(start, 0.5, 1.5),
        "astern": turns_per_minute(vessel(model), -912, -912, 15)[-1],
    }
    found |= {f"at {n}": turns_per_minute(vessel(model), n, n, 15)[-1] for n in (447, 650, 930)}
    for name, port, starboard in (
        ("circle", 1098, 766),
        ("turn", 1112, 749),
        ("one thruster", 1109, 16),
    ):
        trial = vessel(model, velocity_body=[1.9, 0, 0])
        found[f"speed, {name}"] = turns_per_minute(trial, port, starboard, 15)[-1]
        found[f"rate, {name}"] = -trial["usv.rates.r"]
    return found


def test_otter_of_mss_beside_recorded_runs(measured) -> None:
    """The limits are the differences found, rounded up."""
    found, case = otter_figures("otter"), "otter"
    measured(
        OTTER,
        "coasting from 1.40 to 0.62 m/s",
        found["coasting"],
        3.5,
        "s",
        OSLO,
        relative=0.75,
        case=case,
    )
    measured(
        OTTER,
        "coasting from 1.51 to 0.82 m/s",
        found["fast coasting"],
        2.3,
        "s",
        OSLO,
        relative=0.75,
        case=case,
    )
    measured(
        OTTER,
        "acceleration from 0.5 to 1.5 m/s",
        found["acceleration"],
        0.93,
        "s",
        OSLO,
        relative=0.3,
        case=case,
    )
    measured(
        OTTER, "speed at 447 1/min", found["at 447"], 1.21, "m/s", OSLO, relative=0.5, case=case
    )
    measured(
        OTTER, "speed at 650 1/min", found["at 650"], 1.63, "m/s", OSLO, relative=0.2, case=case
    )
    measured(
        OTTER, "speed at 930 1/min", found["at 930"], 2.0, "m/s", OSLO, relative=0.4, case=case
    )
    measured(
        OTTER,
        "speed astern at 912 1/min",
        found["astern"],
        1.92,
        "m/s",
        OSLO,
        relative=0.25,
        case=case,
    )
    measured(
        OTTER,
        "yaw rate at 1098/766 1/min",
        found["rate, circle"],
        0.0410,
        "rad/s",
        OSLO,
        relative=6,
        case=case,
    )
    measured(
        OTTER,
        "yaw rate at 1109/16 1/min",
        found["rate, one thruster"],
        0.119,
        "rad/s",
        OSLO,
        relative=1.7,
        case=case,
    )


def test_otter_measured_follows_recorded_runs(measured) -> None:
    found, case = otter_figures(MEASURED), MEASURED
    measured(
        OTTER,
        "coasting from 1.40 to 0.62 m/s (identified)",
        found["coasting"],
        3.5,
        "s",
        OSLO,
        relative=0.02,
        case=case,
    )
    measured(
        OTTER,
        "coasting from 1.51 to 0.82 m/s",
        found["fast coasting"],
        2.3,
        "s",
        OSLO,
        relative=0.1,
        case=case,
    )
    acceleration = found["acceleration"]
    measured(
        OTTER,
        "acceleration from 0.5 to 1.5 m/s (identified)",
        acceleration,
        0.93,
        "s",
        OSLO,
        relative=0.05,
        case=case,
    )
    one_thruster = time_between(turns_per_minute(vessel(MEASURED), 1115, 0, 5), 0.5, 1.5)
    measured(
        OTTER,
        "acceleration by one thruster",
        one_thruster,
        1.55,
        "s",
        OSLO,
        relative=0.1,
        case=case,
    )
    measured(
        OTTER, "speed at 447 1/min", found["at 447"], 1.21, "m/s", OSLO, relative=0.15, case=case
    )
    measured(
        OTTER, "speed at 650 1/min", found["at 650"], 1.63, "m/s", OSLO, relative=0.15, case=case
    )
    measured(
        OTTER, "speed at 930 1/min", found["at 930"], 2.0, "m/s", OSLO, relative=0.15, case=case
    )
    measured(
        OTTER,
        "speed astern at 912 1/min (identified)",
        found["astern"],
        1.92,
        "m/s",
        OSLO,
        relative=0.02,
        case=case,
    )
    rate = found["rate, circle"]
    measured(
        OTTER,
        "yaw rate at 1098/766 1/min (identified)",
        rate,
        0.0410,
        "rad/s",
        OSLO,
        relative=0.02,
        case=case,
    )
    measured(
        OTTER,
        "speed at 1098/766 1/min",
        found["speed, circle"],
        2.01,
        "m/s",
        OSLO,
        relative=0.2,
        case=case,
    )
    measured(
        OTTER,
        "yaw rate at 1112/749 1/min",
        found["rate, turn"],
        0.0380,
        "rad/s",
        OSLO,
        relative=0.3,
        case=case,
    )
    measured(
        OTTER,
        "yaw rate at 1109/16 1/min",
        found["rate, one thruster"],
        0.119,
        "rad/s",
        OSLO,
        relative=0.3,
        case=case,
    )
    measured(
        OTTER,
        "speed at 1109/16 1/min",
        found["speed, one thruster"],
        1.83,
        "m/s",
        OSLO,
        relative=0.15,
        case=case,
    )


def wamv_bollard_thrust(command: float) -> float:
    """Return the thrust (N) of one thruster at a command (1 is full speed), from the surge
    acceleration in the first step.
    """
    trial = vessel("wamv16", parameters={"propeller_time_constant": [0.0, 0.0]})
    trial["usv.propeller_speed"] = [188.0 * command] * 2
    return float(trial.step()["usv.velocity_body.u"]) / 0.01 * (180 + 27) / 2


def test_wamv_bollard_thrust(measured) -> None:
    measured(
        WAMV,
        "largest thrust (identified)",
        wamv_bollard_thrust(1.0),
        240,
        "N",
        SARDA,
        relative=0.01,
    )
    measured(
        WAMV,
        "thrust at 80 % of the command",
        wamv_bollard_thrust(0.8),
        182,
        "N",
        SARDA,
        relative=0.3,
    )
    measured(
        WAMV,
        "thrust at 60 % of the command",
        wamv_bollard_thrust(0.6),
        120,
        "N",
        SARDA,
        relative=0.3,
    )
    measured(
        WAMV,
        "thrust at -95 % of the command (identified)",
        wamv_bollard_thrust(-0.95),
        -94,
        "N",
        SARDA,
        relative=0.01,
    )
    measured(
        WAMV,
        "thrust at -80 % of the command",
        wamv_bollard_thrust(-0.8),
        -67,
        "N",
        SARDA,
        relative=0.3,
    )
    measured(
        WAMV,
        "thrust at -60 % of the command",
        wamv_bollard_thrust(-0.6),
        -32,
        "N",
        SARDA,
        relative=0.3,
    )


def wamv_speeds(
    port: float, starboard: float, trial: WorldHarness | None = None, duration: float = 20
) -> np.ndarray:
    """Return the speed (m/s) of every step with these thrusts (N)."""
    largest = [240.0 if thrust > 0 else 104.2 for thrust in (port, starboard)]
    commands = [
        float(np.sign(n) * 188 * (abs(n) / n0) ** 0.5)
        for n, n0 in zip((port, starboard), largest, strict=True)
    ]
    return run(trial or vessel("wamv16"), commands, duration)


def wamv_turn(port: float, starboard: float) -> tuple[float, float, float]:
    """Return surge and sway velocity (m/s) and yaw rate to starboard (rad/s) of the steady turn
    with these thrusts (N).
    """
    trial = vessel("wamv16")
    wamv_speeds(port, starboard, trial)
    return trial["usv.velocity_body.u"], trial["usv.velocity_body.v"], -trial["usv.rates.r"]


def test_wamv_runs_straight(measured) -> None:
    """The expected values are closed forms of 207 kg du/dt = T - 112.4 kg/m u^2."""
    for thrust, expected in ((85, 1.23), (120, 1.46), (240, 2.07)):
        speeds = wamv_speeds(thrust, thrust)
        case = f"{thrust}/{thrust} N"
        measured(
            WAMV,
            "speed (identified)",
            speeds[-1],
            expected,
            "m/s",
            TRIALS,
            relative=0.01,
            case=case,
        )
    speeds = wamv_speeds(120, 120)
    measured(
        WAMV,
        "acceleration from 0.3 to 1.0 m/s at 120/120 N",
        time_between(speeds, 0.3, 1),
        0.79,
        "s",
        TRIALS,
        relative=0.1,
    )
    rise = 0.01 * float(np.argmax(speeds > 0.632 * speeds[-1]))
    measured(WAMV, "time to 63 % of the speed at 120/120 N", rise, 0.92, "s", TRIALS, relative=0.4)
    speeds = wamv_speeds(0, 0, vessel("wamv16", velocity_body=[1.6, 0, 0]), 5)
    measured(
        WAMV,
        "coasting from 1.4 to 0.7 m/s (identified)",
        time_between(speeds, 1.4, 0.7),
        1.31,
        "s",
        TRIALS,
        relative=0.02,
    )


def test_wamv_turns(measured) -> None:
    turns = (
        (120, 60, 1.26, 0.05, 0.067),
        (240, 120, 1.78, 0.11, 0.102),
        (120, 0, 1.01, 0.09, 0.159),
    )
    for port, starboard, u, v, r in turns:
        found, case = wamv_turn(port, starboard), f"{port}/{starboard} N"
        measured(WAMV, "speed in a turn", found[0], u, "m/s", TRIALS, relative=0.05, case=case)
        measured(WAMV, "drift in a turn", found[1], v, "m/s", TRIALS, within=0.05, case=case)
        measured(WAMV, "yaw rate in a turn", found[2], r, "rad/s", TRIALS, relative=0.15, case=case)
    measured(
        WAMV,
        "yaw rate of a spin at 60/-60 N",
        wamv_turn(60, -60)[2],
        0.311,
        "rad/s",
        TRIALS,
        relative=0.05,
    )
