"""CPU time of a step of each sensor, smallest of several rounds.

Run with: pytest -m benchmark -n 0 -s tests/plant_src/sensors/test_sensor_cost.py
"""

import ctypes
import time

import pytest
from sensor_harness import SensorHarness, with_parameters

from plant_src.sensors.barometer import Barometer
from plant_src.sensors.camera import Camera
from plant_src.sensors.deck_tracker import DeckTracker
from plant_src.sensors.fault import SignalFault
from plant_src.sensors.gnss import Gnss
from plant_src.sensors.imu import Imu
from plant_src.sensors.magnetometer import Magnetometer
from plant_src.sensors.marker_camera import MarkerCamera
from plant_src.sensors.navigation import Navigation
from plant_src.sensors.rangefinder import Rangefinder

pytestmark = pytest.mark.benchmark
ROUNDS, STEPS = 7, 2000


def rotors(**parameters):
    return with_parameters(
        SignalFault("fault", {"rotor_speed[4]": "rad/s"}, gain_of="square"), **parameters
    )


CONTENDERS = {
    "fault of four signals, normal": rotors,
    "fault of four signals, gain": lambda: rotors(gain__rotor_speed=[1, 0.7, 1, 1]),
    "IMU": lambda: Imu("sensor"),
    "GNSS, 5 Hz": lambda: Gnss("sensor"),
    "barometer, 50 Hz": lambda: Barometer("sensor"),
    "magnetometer, 50 Hz": lambda: Magnetometer("sensor"),
    "rangefinder, 100 Hz, one vessel": lambda: Rangefinder("sensor", vessels={"usv": "strider"}),
    "marker camera, 30 Hz": lambda: MarkerCamera("sensor"),
    "navigation": lambda: Navigation("sensor"),
    "deck tracker": lambda: DeckTracker("sensor"),
}


def steps(call, clock):
    began = time.process_time()
    for n in range(STEPS):
        clock.value = n * 0.01
        call.function(*call.arguments)
    return (time.process_time() - began) / STEPS * 1e6


def test_cost_of_a_step():
    print("\n| component | us a step at 100 Hz |\n|---|---|")
    for name, make in CONTENDERS.items():
        component = make()
        above = {"vehicle__position": (0, 0, 2.0)} if "camera" in name or "range" in name else {}
        SensorHarness(component, **above)
        clock = ctypes.c_double()
        (call,) = component.prepare_step_calls(clock, 0.01)
        costs = []
        for _ in range(ROUNDS):
            component.initialise()
            costs.append(steps(call, clock))
        component.free()
        print(f"| {name} | {min(costs):.1f} |")
        assert min(costs) < 100


def test_cost_of_a_picture(tmp_path):
    camera = Camera("eye", {"uav": "ar_drone", "usv": "strider"}, "uav", str(tmp_path))
    SensorHarness(camera, uav__position=(0, 0, 3.0))
    costs = []
    for number in range(ROUNDS):
        began = time.process_time()
        camera.measure(number, 1.0)
        costs.append((time.process_time() - began) * 1e3)
    camera.free()
    print(f"\na picture of 320 by 240 pixels with its file: {min(costs):.0f} ms")
    assert min(costs) < 1000
