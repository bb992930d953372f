"""Linear models against closed forms, analytic Jacobians and known matrices."""

import csv
import json
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import original_system_reference as reference
import pytest
from linear_blocks import StateSpace, block, loop
from scipy.io import loadmat

import cosim
from cosim.analysis.linearization import linearize
from cosim.core import resources

HOVER = Path(__file__).with_name("hover.json")
QUADCOPTER_STATES = ["position", "velocity", "attitude", "rates"]


@pytest.fixture(scope="module")
def hover():
    """Rotor speeds (rad/s) of the hovering quadcopter."""
    equal = {"quadcopter.rotor_speed": [340.0] * 4}
    found = cosim.trim(
        HOVER, list(equal), ["quadcopter.velocity", "quadcopter.rates"], parameters=equal
    )
    assert found.is_found
    return found.parameters


def test_the_hovering_quadcopter_has_the_jacobian_of_its_closed_form(hover):
    """Linear Newton-Euler equations about hover, from masses and arms of the original system's fact
    sheet.
    """
    outputs = [f"quadcopter.{name}" for name in QUADCOPTER_STATES]
    model = linearize(HOVER, ["quadcopter.rotor_speed"], outputs, parameters=hover, continuous=True)
    assert list(model.states) == list(model.outputs)
    speeds = np.array(hover["quadcopter.rotor_speed"])
    slope = 2 * reference.THRUST_COEFFICIENT * speeds  # N.s/rad
    arms, inertia = (
        reference._ROTORS @ reference.FLIP,
        reference.FLIP @ reference._INERTIA @ reference.FLIP,
    )
    senses = np.array(reference._UP_TORQUE) * 2.38e-7 / reference.THRUST_COEFFICIENT
    torques = np.array([arms[:, 1], -arms[:, 0], senses]) * slope
    a, b = np.zeros((12, 12)), np.zeros((12, 4))
    a[0:3, 3:6] = a[6:9, 9:12] = np.eye(3)
    a[3, 7], a[4, 6] = reference.GRAVITY, -reference.GRAVITY
    b[5] = slope / reference.QUADCOPTER_MASS
    b[9:12] = np.linalg.solve(inertia, torques)
    assert np.abs(model.a - a).max() < 1e-6 * np.abs(a).max()
    assert np.abs(model.b - b).max() < 1e-6 * np.abs(b).max()
    assert model.b[5] == pytest.approx(b[5], rel=1e-6)
    assert not model.d.any()
    assert model.notes == []


def test_the_sailing_vessel_has_the_jacobian_of_its_equations():
    """Differences of the original equations at 1 m/s, with the thrust that a trim finds."""
    fmu = str(resources.root() / "fmus/strider.fmu")
    scenario = {
        "name": "vessel",
        "stop_time": 1,
        "step_size": 0.01,
        "components": {"vessel": {"fmu": fmu}},
    }
    start = {
        "vessel.initial.velocity_body.u": 1.0,
        "vessel.resistance": 0.0,
        "vessel.propeller_diameter": 0.0,
    }
    thrust = cosim.trim(scenario, ["vessel.thrust"], ["vessel.velocity_body.u"], parameters=start)
    assert thrust.is_found
    names = [
        "position.x",
        "position.y",
        "attitude.yaw",
        "velocity_body.u",
        "velocity_body.v",
        "rates.r",
    ]
    inputs, outputs = ["vessel.thrust", "vessel.rudder_angle"], [f"vessel.{name}" for name in names]
    model = linearize(
        scenario, inputs, outputs, parameters={**start, **thrust.parameters}, continuous=True
    )
    expected = vessel_jacobian([0, 0, 0, 1, 0, 0], thrust.parameters["vessel.thrust"])
    assert list(model.states) == outputs
    found = np.hstack([model.a, model.b])
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


def vessel_jacobian(state, thrust):
    """Return [A B] of the vessel's equations, inputs thrust (N) and rudder angle (rad), by
    differences of fourth order.
    """
    point = np.array([*state, thrust, 0, 0, 0, 0, 0, 0, 0], float)

    def difference(i, size):
        change = np.zeros(len(point))
        change[i] = size
        plus, minus = (
            reference.vessel_rate(each[:6], each[6:]) for each in (point + change, point - change)
        )
        return (plus - minus) / (2 * size)

    return np.array([(4 * difference(i, 1e-4) - difference(i, 2e-4)) / 3 for i in range(8)]).T


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_with_directional_derivatives_gives_the_exact_model(version, balls, tmp_path):
    """x' = u - x, h' = v, v' = g, integrated by Euler: without the derivatives, the model has the
    pole of Euler's method.
    """
    file = offering_derivatives(balls[version], tmp_path / "ball.fmu")
    ball = {
        "fmu": str(file),
        "solver": {"method": "euler", "step_size": 0.01},
        "parameters": {"h": 5.0},
    }
    scenario = {"name": "ball", "stop_time": 1, "step_size": 0.01, "components": {"ball": ball}}
    exact = linearize(scenario, ["ball.u"], ["ball.x", "ball.h"], 0.1, continuous=True)
    assert list(exact.states) == ["ball.x", "ball.h", "ball.v"]
    assert exact.a.tolist() == [[-1, 0, 0], [0, 0, 1], [0, 0, 0]]
    assert exact.b.tolist() == [[1], [0], [0]]
    assert exact.c.tolist() == [[1, 0, 0], [0, 1, 0]]
    assert exact.d.tolist() == [[0], [0]]
    scenario["components"]["ball"]["fmu"] = str(balls[version])
    measured = linearize(scenario, ["ball.u"], ["ball.x"], 0.1, continuous=True)
    assert measured.a == pytest.approx(np.array([[np.log(0.99) / 0.01]]), rel=1e-6)


def offering_derivatives(source, target):
    """Copy an FMU with the flag of directional derivatives."""
    with ZipFile(source) as old, ZipFile(target, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                flag = b'providesDirectionalDerivative%s="true" modelIdentifier' % (
                    b"s" if b'"3.0"' in content else b""
                )
                content = content.replace(b"modelIdentifier", flag, 1)
            new.writestr(name, content)
    return target


def test_a_closed_loop_has_its_poles_and_the_outputs_as_states():
    """Position and speed with feedback of the position: x[k+1] = A x + B (u - 0.5 y0)."""
    a, b, c = np.array([[1, 0.1], [0, 0.9]]), np.array([[0.005], [0.1]]), np.eye(2)
    model = linearize(loop(0.5, block(a.tolist(), b.tolist(), c.tolist())), ["plant.u0"], ["plant"])
    assert list(model.states) == ["plant.y0", "plant.y1"]
    assert model.a == pytest.approx(a - 0.5 * b @ c[:1], abs=1e-9)
    assert model.b == pytest.approx(b, abs=1e-9)
    assert model.step == 0.1
    alone = linearize(
        loop(0.5, block(a.tolist(), b.tolist(), c.tolist())),
        ["plant.u0"],
        ["plant"],
        components=["plant"],
    )
    assert alone.a == pytest.approx(a, abs=1e-9)


def test_feedthrough_is_a_state_of_the_discrete_model_and_d_of_the_continuous_one():
    decay = float(np.exp(-0.2))
    scenario = {
        "name": "feedthrough", "stop_time": 1, "step_size": 0.1,
        "components": {"plant": block([[decay]], [[1 - decay]], [[1]], [[3]])},
    }  # fmt: skip
    continuous = linearize(scenario, ["plant.u0"], ["plant.y0"], continuous=True)
    assert continuous.a == pytest.approx(np.array([[-2]]), rel=1e-6)
    assert continuous.d == pytest.approx(np.array([[3]]), rel=1e-6)
    assert continuous.frequency_response(np.array([0.0]))[0, 0, 0] == pytest.approx(4)
    discrete = linearize(scenario, ["plant.u0"], ["plant.y0"])
    assert sorted(abs(discrete.poles())) == pytest.approx([0, decay], abs=1e-6)
    times, response = discrete.step_response(2.0)
    assert response[:3, 0, 0] == pytest.approx([0, 4 - decay, 4 - decay**2], abs=1e-6)
    assert times[1] == 0.1


def test_a_component_without_saved_states_is_named():
    scenario = loop(0.5, block([[1]], [[1]], [[1]], has_state=False))
    with pytest.raises(cosim.InputError, match=r'"?plant"? cannot return to a state'):
        linearize(scenario, ["plant.u0"], ["plant.y0"])


def test_wrong_names_and_times_are_refused():
    scenario = loop(0.5, block([[1]], [[1]], [[1]]))
    for inputs, outputs, at, message in (
        (["plant.u1"], ["plant.y0"], None, 'inputs: "plant.u1"'),
        (
            ["plant.u0"],
            ["plant.y1"],
            None,
            r'outputs: no floating-point output "plant.y1".*"plant.y0"',
        ),
        (["plant.u0"], ["plant.y0"], 0.05, "at: time"),
        (["plant.u0"], ["plant.y0"], "soon", "at: expected a number"),
    ):
        with pytest.raises(cosim.InputError, match=message):
            linearize(scenario, inputs, outputs, at)


def test_a_delay_has_no_continuous_model():
    scenario = loop(0.5, block([[0]], [[1]], [[1]]))
    with pytest.raises(
        cosim.InputError, match="no continuous model: the discrete model has a pole at"
    ):
        linearize(scenario, ["plant.u0"], ["plant.y0"], continuous=True)


def test_a_point_that_is_no_equilibrium_gives_a_hint():
    """Equal rotor speeds turn the quadcopter, whose arms are not equal, so that its response
    changes while it is measured.
    """
    equal = {"quadcopter.rotor_speed": [360.0] * 4}
    model = linearize(
        HOVER, ["quadcopter.rotor_speed"], ["quadcopter.position"], parameters=equal, duration=4
    )
    assert any("no equilibrium" in note for note in model.notes)


class Tanks(StateSpace):
    """Two tanks with outflow; the square roots make the response change while the levels fall."""

    def do_step(self, _time, step_size):
        """Advance the levels by Euler's method."""
        first, second = np.sqrt(self.x)
        self.x = self.x + step_size * (
            self.u + np.array([-0.5 * first, 0.5 * first - 0.4 * second])
        )


def test_a_moving_operating_point_adds_no_states():
    """The response differs from a linear one by products of the motion and the perturbation, which
    are no modes.
    """
    unit = np.eye(2).tolist()
    tanks = {"python": Tanks, "arguments": {"a": unit, "b": unit, "c": unit, "x0": [1.0, 1.5625]}}
    scenario = {"name": "s", "stop_time": 1, "step_size": 0.1, "components": {"plant": tanks}}
    moving = linearize(
        scenario, ["plant.u0", "plant.u1"], ["plant"], parameters={"plant.u0": 0.4999}
    )
    assert list(moving.states) == ["plant.y0", "plant.y1"]
    assert moving.a == pytest.approx(np.array([[0.975, 0], [0.025, 0.984]]), abs=1e-4)


def test_files_hold_the_matrices(tmp_path):
    a, b = [[0.5, 0.1], [0, 0.25]], [[0], [1]]
    scenario = {
        "name": "s",
        "stop_time": 1,
        "step_size": 0.5,
        "components": {"plant": block(a, b, [[1, 0], [0, 1]])},
    }
    model = linearize(scenario, ["plant.u0"], ["plant"])
    for suffix in ("json", "csv", "mat"):
        model.write(tmp_path / f"model.{suffix}")
    written = json.loads((tmp_path / "model.json").read_text())
    assert np.array(written["A"]) == pytest.approx(np.array(a), abs=1e-9)
    assert written["states"] == ["plant.y0", "plant.y1"]
    mat = loadmat(tmp_path / "model.mat")
    assert (mat["A"] == model.a).all()
    assert mat["Ts"].item() == 0.5
    assert [each.item() for each in mat["states"].ravel()] == written["states"]
    rows = list(csv.reader((tmp_path / "model.csv").open()))
    assert rows[0] == ["", "plant.y0", "plant.y1", "plant.u0"]
    assert [row[0] for row in rows[1:]] == [
        "plant.y0[k+1]",
        "plant.y1[k+1]",
        "plant.y0",
        "plant.y1",
    ]
    assert np.array(rows[1:], object)[:2, 1:].astype(float) == pytest.approx(
        np.hstack([model.a, model.b])
    )
    with pytest.raises(cosim.InputError, match=r"expected a file name with \.json, \.csv, \.mat"):
        model.write(tmp_path / "model.txt")
