"""Sensors and faults in the shipped scenarios and in both executors."""

import numpy as np
import pytest

import cosim
from cosim.core.component import Component
from cosim.core.system import Connection, Endpoint, System
from cosim.core.time_grid import exact_fraction
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Event, Settings
from plant_src.sensors.fault import SignalFault
from plant_src.sensors.gnss import Gnss
from plant_src.sensors.navigation import Navigation


def test_a_fault_without_events_changes_no_bit_of_the_flight(measured):
    faulty = cosim.run("fault_rotor_efficiency", stop_time=3)
    plain = cosim.run("demo1_box", {"uav.vtol.landing_time": 12.0}, stop_time=3)
    for axis in "xyz":
        name = f"plant.uav.position.{axis}"
        error = faulty[name] - plain[name]
        measured(
            "Sensors",
            "flight through a fault that is not on",
            error,
            0.0,
            "m",
            "the flight without it",
        )


def test_the_commands_of_a_weak_rotor_are_cut_by_the_root_of_its_efficiency():
    result = cosim.run("fault_rotor_efficiency", stop_time=11)
    late = result.time > 9.005
    for k, share in enumerate((1.0, 0.7, 1.0, 1.0), 1):
        given, kept = result[f"uav.mixer.rotor_speed[{k}]"], result[f"rotor_fault.rotor_speed[{k}]"]
        assert np.array_equal(given[~late], kept[~late])
        assert np.allclose(kept[late] ** 2, share * given[late] ** 2, rtol=1e-12)


def test_a_rotor_with_four_tenths_of_its_thrust_is_a_crash():
    gains = [1.0, 0.4, 1.0, 1.0]
    result = cosim.run(
        "fault_rotor_efficiency",
        {"/events/0/set/rotor_fault.gain.rotor_speed": gains},
        stop_time=12,
    )
    assert np.abs(result["plant.uav.attitude.roll"]).max() > 1.5


def test_another_seed_is_another_flight_and_the_same_seed_the_same():
    flights = []
    for seed in (5, 5, 6):
        result = cosim.run("landing_on_sensors", {"measured.seed": seed}, stop_time=2)
        flights.append(np.stack([result[name] for name in result]).tobytes())
    first, same, other = flights
    assert first == same != other


class Rising(Component):
    """A vehicle that rises with 1 m/s from z = 0."""

    binds_everything = has_state = False

    def __init__(self):
        self.variables = [
            v
            for v in Gnss("x").variables
            if v.causality == "output" and v.name.startswith(("pos", "vel"))
        ]
        self._z = 0.0

    def bind(self, _inputs, outputs):
        self._names, (self._values,) = [v.name for v in outputs.variables], outputs.arrays.values()

    def enter_initialization_mode(self, start_time, stop_time): ...
    def exit_initialization_mode(self): ...
    def set_inputs(self): ...
    def terminate(self): ...
    def free(self): ...

    def do_step(self, time, step_size):
        self._z = time + step_size

    def get_outputs(self):
        values = {"position.z": self._z, "velocity.z": 1.0}
        self._values[:] = [values.get(name, 0.0) for name in self._names]


def simulated(components, wires, record, stop, events=()):
    """Every component in a separate stage, from the first to the last."""

    def end(name):
        component, _, slot = name.partition(".")
        return Endpoint(component, slot)

    connections = [Connection(end(source), end(target)) for source, target in wires.items()]
    built = System(components, connections, tuple((name,) for name in components))
    settings = Settings(
        exact_fraction("0"),
        exact_fraction(stop),
        exact_fraction("0.01"),
        {name: end(name) for name in record},
        events=events,
    )
    outcome = simulate(built, settings)
    assert outcome.failure is None
    return outcome.recording


@pytest.mark.usefixtures("executor")
def test_a_sensor_in_a_later_stage_measures_the_same_time():
    gnss = Gnss("gnss", receiver="rtk")
    for name in gnss.parameters:
        if name.endswith(("_noise", "_drift")):
            gnss.set(name, 0.0)
    gnss.set("latency", 0.0)
    gnss.set("rate", 100.0)
    components = {"plant": Rising(), "gnss": gnss, "fault": SignalFault("fault", {"z": "m"})}
    wires = {"plant.position.z": "gnss.vehicle.position.z", "gnss.position.z": "fault.input.z"}
    events = [
        Event(exact_fraction("0.5"), {"fault": {"mode": "frozen"}}),
        Event(exact_fraction("0.7"), {"fault": {"mode": "normal"}}),
    ]
    recording = simulated(components, wires, ["gnss.position.z", "fault.z"], "1", events)
    z, faulty = recording.columns["gnss.position.z"], recording.columns["fault.z"]
    assert np.allclose(z, recording.time, rtol=1e-15)
    frozen = (recording.time > 0.501) & (recording.time < 0.701)
    assert np.array_equal(faulty[~frozen], z[~frozen])
    assert set(faulty[frozen]) == {0.5}


def test_initial_outputs_reach_navigation_through_the_sensors():
    components = {
        "plant": Rising(),
        "gnss": Gnss("gnss", seed=3),
        "navigation": Navigation("navigation"),
    }
    wires = {
        "plant.position.z": "gnss.vehicle.position.z",
        "gnss.position.z": "navigation.gnss.position.z",
    }
    recording = simulated(components, wires, ["gnss.position.z", "navigation.position.z"], "0.01")
    first, passed = (
        recording.columns[name][0] for name in ("gnss.position.z", "navigation.position.z")
    )
    assert passed == first != 0


def test_landing_on_sensors_succeeds_on_a_deck_in_waves():
    waves = {
        "spectrum": "jonswap",
        "significant_height": 0.05,
        "peak_period": 2.0,
        "direction": 0.6,
        "spreading": 2,
    }
    sea = {"vehicles/usv/motion": "6dof", "environment": {"seed": 1, "waves": waves}}
    settings = {f"/components/plant/arguments/{key}": value for key, value in sea.items()}
    result = cosim.run("landing_on_sensors", settings, stop_time=20)
    assert np.ptp(result["plant.usv.attitude.pitch"]) > 0.01
    assert result.kpis["landing.landed_at_end"]
    assert result.kpis["landing.lateral_error"] < 0.15
