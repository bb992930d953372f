"""Landing on decks in waves: how well the quadcopter moves with a deck, and that it lands where the
cascaded control does.
"""

import json

import numpy as np
import pytest
from fmpy import read_model_description
from scipy.linalg import solve_discrete_are
from scipy.signal import cont2discrete
from systems import connection

import cosim
from cosim.core import resources

FMUS, SCENARIOS = (resources.root() / name for name in ("fmus", "scenarios"))
HEAVE, OMEGA, SWAY = 0.25, 2.5, 0.2


def deck_motion(path):
    """A deck that heaves and sways in a swell while it sails east."""
    t = np.linspace(0, 40, 8001)
    columns = {
        "time": t,
        "position.x": 0.5 * t,
        "position.y": SWAY * np.cos(OMEGA * t),
        "position.z": 0.3 + HEAVE * np.sin(OMEGA * t),
        "velocity.x": np.full_like(t, 0.5),
        "velocity.y": -OMEGA * SWAY * np.sin(OMEGA * t),
        "velocity.z": OMEGA * HEAVE * np.cos(OMEGA * t),
    }
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")
    return {name: f"uav.target.{name}" for name in columns if name != "time"}


def hover_above_the_deck(folder, controller, unread=(), **parameters):
    """Follow, then approach the deck, but never begin the descent unless `parameters` permit it."""
    motion = deck_motion(folder / "deck.csv")
    document = {
        "name": "swell",
        "stop_time": 40,
        "step_size": 0.01,
        "components": {
            "plant": {"fmu": str(FMUS / "ar_drone.fmu"), "parameters": {"initial.position.z": 0.5}},
            "uav": {
                "fmu": str(FMUS / controller),
                "parameters": {"vtol.landing_time": 10.0, "vtol.landing_error": 0.0} | parameters,
            },
        },
        "connections": [
            connection("plant", "uav.vehicle"),
            connection("uav.rotor_speed", "plant.rotor_speed"),
        ],
        "inputs": [
            {
                "file": "deck.csv",
                "to": {name: to for name, to in motion.items() if name not in unread},
            }
        ],
        "algorithm": {"stages": [["uav"], ["plant"]]},
    }
    (folder / "swell.json").write_text(json.dumps(document))
    return cosim.run(folder / "swell.json")


def errors(result):
    """Root mean squares of the horizontal error and of the one in the distance to the deck, over
    the last 15 s.
    """
    late = result.time > 25
    t = result.time[late]
    x, y, z = (result[f"plant.position.{axis}"][late] for axis in "xyz")
    deck = 0.5 * t, SWAY * np.cos(OMEGA * t), 0.3 + HEAVE * np.sin(OMEGA * t)
    above = z - deck[2]
    return np.sqrt(np.mean((x - deck[0]) ** 2 + (y - deck[1]) ** 2)), above.std()


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    def fly(name, **more):
        return hover_above_the_deck(tmp_path_factory.mktemp(name), f"{name}.fmu", **more)

    cascaded = fly("ar_drone_cascaded", unread=["velocity.z"])
    return {"cascaded": cascaded} | {
        name: fly(f"ar_drone_{name}") for name in ("geometric", "indi", "lqr", "mpc")
    }


@pytest.mark.parametrize("name", ["geometric", "indi", "lqr", "mpc"])
def test_landing_controllers_follow_a_deck_in_a_swell_within_centimetres(flights, name):
    horizontal, vertical = errors(flights[name])
    assert horizontal < 0.025
    assert vertical < 0.015


def test_cascaded_control_lags_behind_the_deck(flights):
    geometric, cascaded = (np.array(errors(flights[name])) for name in ("geometric", "cascaded"))
    assert cascaded[0] > 4 * geometric[0]
    assert cascaded[1] > geometric[1]


@pytest.mark.parametrize(
    "controller",
    [
        *(
            {"fmu": str(FMUS / f"ar_drone_{name}.fmu")}
            for name in ("geometric", "indi", "lqr", "mpc")
        ),
        {"system": str(SCENARIOS / "systems" / "ar_drone_inverse_landing.json")},
    ],
    ids=["geometric", "INDI", "LQR", "MPC", "inverse kinematics"],
)
def test_other_controllers_land_in_the_first_demo(tmp_path, controller):
    path = SCENARIOS / "demo1_box.json"
    document = json.loads(path.read_text())
    parameters = {"vtol.landing_time": 5.0, "altitude_command": 2.0, "yaw_command": 0.0}
    document["components"]["uav"] = controller | {"parameters": parameters}
    kpis = cosim.run(standing_alone(document, path.parent, tmp_path / "demo1.json")).kpis
    assert kpis["landing.lateral_error"] < 0.03
    assert kpis["touchdown.normal_speed"] == pytest.approx(0.3, abs=0.02)
    assert kpis["landing.landed_at_end"]
    assert kpis["motors.stopped_at_end"]
    assert kpis["descent.aborts"] == 0


def touchdown_tilt(**parameters):
    """Return the touchdown tilt of the geometric controller in waves and gusts on a vessel."""
    sea = "/components/plant/arguments/environment"
    weather = {
        f"{sea}/waves/significant_height": 0.2,
        f"{sea}/waves/peak_period": 2.5,
        f"{sea}/wind/speed": 7.0,
        f"{sea}/seed": 4,
    }
    flight = (
        weather
        | {"usv.speed_command": 1.2}
        | {f"uav.{name}": value for name, value in parameters.items()}
    )
    return cosim.run(SCENARIOS / "landing_waves.json", flight, stop_time=16.0).kpis[
        "touchdown.tilt"
    ]


def test_tilt_is_limited_just_above_the_deck():
    assert touchdown_tilt(flare_height=0.0) > 0.35
    assert touchdown_tilt() < 0.25


def largest_error_in_a_gust(controller):
    """Return the largest horizontal error of a hovering quadcopter (m) when 6 m/s of wind begin at
    5 s.
    """
    wind = {"time": 5.0, "set": {"plant.wind.x": 6.0, "plant.wind.y": 0.0}}
    document = {
        "name": "gust",
        "stop_time": 15,
        "step_size": 0.01,
        "components": {
            "plant": {
                "fmu": str(FMUS / "ar_drone.fmu"),
                "parameters": {"initial.position.z": 0.5, "body_drag.x": 0.02},
            },
            "uav": {
                "fmu": str(FMUS / f"{controller}.fmu"),
                "parameters": {"vtol.landing_enabled": False},
            },
        },
        "connections": [
            connection("plant", "uav.vehicle"),
            connection("uav.rotor_speed", "plant.rotor_speed"),
        ],
        "events": [wind],
        "algorithm": {"stages": [["uav"], ["plant"]]},
    }
    result = cosim.run(document)
    return np.abs(result["plant.position.x"][result.time > 5]).max()


def test_inversion_rejects_a_gust_better_than_integral_action():
    geometric, indi = (
        largest_error_in_a_gust(f"ar_drone_{name}") for name in ("geometric", "indi")
    )
    assert indi < 0.7 * geometric


def deck_speeds_at_the_decision(folder, **parameters):
    """Return the vertical speeds of the deck (m/s) when the descent leaves the waiting height, for
    several landing times.
    """
    for delay in np.arange(0.0, 2.5, 0.8):
        settings = {"vtol.landing_time": 6.0 + delay, "vtol.landing_error": 0.1} | parameters
        result = hover_above_the_deck(folder, "ar_drone_geometric.fmu", **settings)
        heave = HEAVE * np.sin(OMEGA * result.time)
        decided = (result["uav.mode"] == 5) & (
            result["uav.altitude_reference"] - heave < 0.3 + 0.056 + 0.13
        )
        yield OMEGA * HEAVE * abs(np.cos(OMEGA * result.time[decided.argmax()]))


def test_descent_waits_for_a_calm_deck(tmp_path):
    usual = OMEGA * HEAVE / np.sqrt(2)
    impatient = {"window.calm_share": 100.0}
    assert max(deck_speeds_at_the_decision(tmp_path, **{"window.patience": 1e6})) < 1.25 * usual
    assert max(deck_speeds_at_the_decision(tmp_path, **impatient)) > 1.3 * usual


def variable_start(fmu, name):
    return float(
        next(v.start for v in read_model_description(str(fmu)).modelVariables if v.name == name)
    )


def regulator_gains(state_matrix, input_matrix, weights):
    """Return the gains of the discrete regulator at 0.01 s with an input weight of 1."""
    count = len(weights)
    a, b, *_ = cont2discrete(
        (state_matrix, input_matrix, np.eye(count), np.zeros((count, 1))), 0.01
    )
    cost = solve_discrete_are(a, b, np.diag(weights), np.eye(1))
    return np.linalg.solve(1 + b.T @ cost @ b, b.T @ cost @ a)[0]


def test_gains_of_the_regulator_solve_the_riccati_equation():
    lag, fmu = 0.12, FMUS / "ar_drone_lqr.fmu"
    chain = np.diag([1.0, 1.0, 1.0], 1)
    chain[3, 3] = -1 / lag
    expected = {
        "horizontal": regulator_gains(
            chain, np.array([[0.0], [0.0], [0.0], [1 / lag]]), [100, 200, 8, 0]
        ),
        "vertical": regulator_gains(
            np.diag([1.0, 1.0], 1), np.array([[0.0], [0.0], [1.0]]), [100, 200, 30]
        ),
    }
    for axis, gains in expected.items():
        found = [variable_start(fmu, f"tracking.{axis}_gain[{i + 1}]") for i in range(len(gains))]
        np.testing.assert_allclose(found, gains, rtol=1e-6)


def standing_alone(document, folder, path):
    """The scenario in another folder, its files named in full, without figures and reference."""
    for spec in (*document["components"].values(), *document["kpis"]):
        for key in ("fmu", "python"):
            if spec.get(key, "").startswith("../"):
                spec[key] = str(folder / spec[key])
    path.write_text(
        json.dumps(
            {key: value for key, value in document.items() if key not in ("reference", "figures")}
        )
    )
    return path
