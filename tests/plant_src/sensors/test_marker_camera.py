"""The marker camera against projections by plain NumPy matrices."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_harness import SensorHarness, with_parameters

from plant_src.sensors.marker_camera import MarkerCamera

EXACT = {"drop_out": 0.0, "pixel_noise": 0.0, "latency": 0.0, "rate": 100.0}
FOCAL, WIDTH, HEIGHT, SIZE = 320.0, 320.0, 240.0, 0.4


def wxyz(turn):
    x, y, z, w = turn.as_quat()
    return w, x, y, z


def look(vehicle, attitude, deck, deck_attitude, **parameters):
    camera = with_parameters(
        MarkerCamera("marker", seed=parameters.pop("seed", 0)), **{**EXACT, **parameters}
    )
    inputs = {"vehicle__position": vehicle, "vehicle__orientation": wxyz(attitude)}
    return SensorHarness(
        camera, **inputs, deck__position=deck, deck__orientation=wxyz(deck_attitude)
    )


def projected(points, vehicle, attitude, tilt, mounting):
    """Pixels (n, 2) from the middle of the picture and depths (n,) by homogeneous matrices."""
    ahead, right = np.array([np.sin(tilt), 0, -np.cos(tilt)]), np.array([0, -1.0, 0])
    axes = np.stack([right, np.cross(ahead, right), ahead])  # rows: right, down, ahead in body axes
    to_camera = axes @ attitude.inv().as_matrix()
    intrinsic = np.diag([FOCAL, FOCAL, 1.0])
    homogeneous = (intrinsic @ to_camera @ (points - vehicle - attitude.apply(mounting)).T).T
    return homogeneous[:, :2] / homogeneous[:, 2:], homogeneous[:, 2]


def test_a_marker_is_valid_if_all_corners_are_in_the_picture(measured):
    random = np.random.default_rng(8)
    square = np.array([[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]]) * SIZE / 2
    seen, wrong = [], 0
    for _ in range(300):
        attitude = Rotation.from_euler("ZYX", random.normal(0, [1, 0.2, 0.2]))
        deck_attitude = Rotation.from_euler("ZYX", random.normal(0, [1, 0.1, 0.1]))
        vehicle, deck = np.array([0, 0, random.uniform(1, 6)]), random.normal(0, [0.8, 0.8, 0.1])
        tilt, mounting = random.uniform(-0.3, 0.6), random.normal(0, 0.05, 3)
        trial = look(
            vehicle,
            attitude,
            deck,
            deck_attitude,
            tilt=tilt,
            mounting=mounting,
            incidence=np.pi / 2,
        )
        place, depth = projected(
            deck + deck_attitude.apply(square), vehicle, attitude, tilt, mounting
        )
        inside = (np.abs(place) <= (WIDTH / 2, HEIGHT / 2)).all() and (depth > 0).all()
        seen.append(trial["valid"])
        wrong += trial["valid"] != inside
    assert 50 < sum(seen) < 250
    measured(
        "Sensors",
        "marker camera: wrong decisions what is in view, of 300",
        wrong,
        0,
        "1",
        "pinhole projection in NumPy",
    )


def test_pose_is_exact_without_errors(measured):
    vehicle, deck = np.array([1.0, 2.0, 2.5]), np.array([1.2, 1.9, 0.3])
    attitude, deck_attitude = (
        Rotation.from_euler("ZYX", [2.0, 0.1, -0.1]),
        Rotation.from_euler("ZYX", [2.4, -0.05, 0.08]),
    )
    trial = look(vehicle, attitude, deck, deck_attitude, tilt=0.1, mounting=[0.02, 0.01, -0.03])
    assert trial["valid"] is True
    error = vehicle + attitude.apply(trial.vector("position")) - deck
    measured(
        "Sensors",
        "marker camera without errors: place of the deck",
        error,
        0.0,
        "m",
        "rigid transforms",
        within=1e-12,
    )
    found = [trial[f"attitude.{angle}"] for angle in ("yaw", "pitch", "roll")]
    assert np.allclose(
        (attitude * Rotation.from_euler("ZYX", found)).as_matrix(),
        deck_attitude.as_matrix(),
        atol=1e-12,
    )


LEVEL = Rotation.identity()


@pytest.mark.parametrize("why", ["below", "oblique", "far", "upside down"])
def test_a_marker_is_invalid(why):
    place, attitude, parameters = {
        "below": ([0, 0, -2.0], Rotation.from_euler("x", np.pi), {}),
        "oblique": ([-2.5, 0, 1.5], LEVEL, {"tilt": np.arctan2(2.5, 1.5), "incidence": 1.0}),
        "far": ([0, 0, FOCAL * SIZE / 12 + 0.1], LEVEL, {}),
        "upside down": ([0, 0, 2.0], Rotation.from_euler("x", np.pi), {}),
    }[why]
    assert look(place, attitude, [0, 0, 0], LEVEL, **parameters)["valid"] is False


def test_an_oblique_marker_is_valid_with_a_larger_incidence():
    tilt = np.arctan2(2.5, 1.5)
    assert look([-2.5, 0, 1.5], LEVEL, [0, 0, 0], LEVEL, tilt=tilt, incidence=1.1)["valid"] is True


def test_noise_grows_with_the_depth_across_and_with_its_square_along_the_view():
    names = ["position.x", "position.y", "position.z", "attitude.yaw", "attitude.roll"]
    for depth in (1.0, 3.0):
        trial = look([0, 0, depth], LEVEL, [0, 0, 0], LEVEL, pixel_noise=0.5, seed=2)
        across, turn = 0.5 * depth / FOCAL, 0.5 * depth / FOCAL / SIZE
        assert trial.record(4000, names).std(axis=0) == pytest.approx(
            [across, across, turn * depth, turn, 3 * turn], rel=0.06
        )


def test_drop_outs_have_their_rate():
    trial = look([0, 0, 2.0], LEVEL, [0, 0, 0], LEVEL, drop_out=0.3)
    assert 1 - trial.record(4000, ["valid"]).mean() == pytest.approx(0.3, abs=0.03)


def test_the_last_pose_stays_when_the_marker_is_lost():
    trial = look([0, 0, 2.0], LEVEL, [0.1, 0, 0], LEVEL, latency=0.05)
    trial.step(20).set_inputs(deck__position=(30.0, 0, 0)).step(20)
    assert (trial["valid"], trial["position.x"], trial["time"]) == (
        False,
        pytest.approx(0.1),
        pytest.approx(0.2),
    )
