"""Landing on decks in waves: how well the quadcopter moves with a deck, and that it lands where the cascaded control does."""

import json

import numpy as np
import pytest
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


def hover_above_the_deck(folder, controller, unread=()):
    """Follow, then approach the deck, but never begin the descent."""
    motion = deck_motion(folder / "deck.csv")
    document = {
        "name": "swell",
        "stop_time": 40,
        "step_size": 0.01,
        "components": {
            "plant": {"fmu": str(FMUS / "ar_drone.fmu"), "parameters": {"initial.position.z": 0.5}},
            "uav": {
                "fmu": str(FMUS / controller),
                "parameters": {"vtol.landing_time": 10.0, "vtol.landing_error": 0.0},
            },
        },
        "connections": [connection("plant", "uav.vehicle"), connection("uav.rotor_speed", "plant.rotor_speed")],
        "inputs": [{"file": "deck.csv", "to": {name: to for name, to in motion.items() if name not in unread}}],
        "algorithm": {"stages": [["uav"], ["plant"]]},
    }
    (folder / "swell.json").write_text(json.dumps(document))
    return cosim.run(folder / "swell.json")


def errors(result):
    """Root mean squares of the horizontal error and of the one in the distance to the deck, over the last 15 s."""
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

    return {"geometric": fly("ar_drone_geometric"), "cascaded": fly("ar_drone_cascaded", unread=["velocity.z"])}


def test_geometric_control_follows_a_deck_in_a_swell_within_centimetres(flights):
    horizontal, vertical = errors(flights["geometric"])
    assert horizontal < 0.025
    assert vertical < 0.015


def test_cascaded_control_lags_behind_the_deck(flights):
    geometric, cascaded = (np.array(errors(flights[name])) for name in ("geometric", "cascaded"))
    assert cascaded[0] > 4 * geometric[0]
    assert cascaded[1] > geometric[1]


@pytest.mark.parametrize(
    "controller",
    [{"fmu": str(FMUS / "ar_drone_geometric.fmu")}, {"system": str(SCENARIOS / "systems" / "ar_drone_inverse_landing.json")}],
    ids=["geometric", "inverse kinematics"],
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
    """Return the touchdown tilt of the geometric controller in short waves and gusts, on a fast vessel."""
    sea = "/components/plant/arguments/environment"
    weather = {
        f"{sea}/waves/significant_height": 0.1,
        f"{sea}/waves/peak_period": 1.79,
        f"{sea}/wind/speed": 4.0,
        f"{sea}/seed": 2,
    }
    flight = weather | {"usv.speed_command": 1.2} | {f"uav.{name}": value for name, value in parameters.items()}
    return cosim.run(SCENARIOS / "landing_waves.json", flight, stop_time=13.0).kpis["touchdown.tilt"]


def test_tilt_is_limited_just_above_the_deck():
    assert touchdown_tilt(flare_height=0.0) > 0.35
    assert touchdown_tilt() < 0.25


def standing_alone(document, folder, path):
    """The scenario in another folder, its files named in full, without figures and reference."""
    for spec in (*document["components"].values(), *document["kpis"]):
        for key in ("fmu", "python"):
            if spec.get(key, "").startswith("../"):
                spec[key] = str(folder / spec[key])
    path.write_text(json.dumps({key: value for key, value in document.items() if key not in ("reference", "figures")}))
    return path
