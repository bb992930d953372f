"""Warnings about scenarios that can run, although something in them is probably a mistake."""

import pytest
from cosim_command import run_cosim
from systems import connection

from cosim.core import resources
from cosim.scenario import load
from cosim.scenario.plausibility import find_warnings

SHIPPED = sorted((resources.root() / "scenarios").glob("*.json"))
BOTH = [connection("plant.ship", "pilot.vehicle"), connection("pilot.motor", "plant.ship.motor")]


def warnings_of(file):
    prepared = load(file)
    try:
        return [str(problem).partition(": $.")[2] for problem in find_warnings(prepared)]
    finally:
        prepared.free()


def ship(folder, connections, parameters=(), **more):
    components = {
        "plant": folder.block("Plant"),
        "pilot": folder.block("Controller", parameters={"offset": 0.0, **dict(parameters)}),
    }
    return warnings_of(folder.scenario(components, connections, **more))


@pytest.mark.parametrize(
    ("left", "inputs", "connection"),
    [
        (
            0,
            "plant: nothing feeds or sets plant.ship.motor[1], plant.ship.motor[2]: ",
            "pilot.motor to plant.ship.motor",
        ),
        (
            1,
            "pilot: nothing feeds or sets pilot.vehicle.position.x: ",
            "plant.ship.position.x to pilot.vehicle.position.x",
        ),
    ],
)
def test_a_missing_connection_is_recognized_by_matching_names(folder, left, inputs, connection):
    assert ship(folder, [BOTH[left]]) == [
        f"components.{inputs}is a connection from {connection} missing?"
    ]


def test_a_missing_connection_to_a_nested_system_is_one_warning_with_all_outputs_that_fit(folder):
    """The inner components share the port; a prefix fits if it has all of the names, whatever else
    it has.
    """
    text = (resources.root() / "scenarios/demo1_box.json").read_text()
    text = (
        text.replace('"../', '"cosim:')
        .replace('"systems/', '"cosim:scenarios/systems/')
        .replace('"references/', '"cosim:')
    )
    lines = {"plant.uav": [], "plant.usv.deck": []}
    for source, target in (("plant.uav", "uav.vehicle"), ("plant.usv.deck", "uav.target")):
        link = f'  {{"from": "{source}", "to": "{target}"}},\n'
        assert link in text
        lines[source] = [
            line
            for line in warnings_of(folder.write(text.replace(link, "")))
            if "connection" in line
        ]
    assert [line.partition(" more: ")[2] for line in lines["plant.uav"]] == [
        "is a connection from plant.uav or plant.usv to uav.vehicle missing?"
    ]
    (line,) = lines["plant.usv.deck"]
    inputs = (
        "position.x, uav.target.position.y, uav.target.position.z, uav.target.velocity.x and 1 more"
    )
    missing = "is a connection from plant.uav, plant.usv or plant.usv.deck to uav.target missing?"
    assert line == f"components.uav: nothing feeds or sets uav.target.{inputs}: {missing}"


def test_a_connection_that_a_nested_system_lacks_inside_names_its_own_components(folder):
    components = {
        "plant": folder.block("Plant"),
        "pilot": folder.block("Controller", parameters={"offset": 0.0}),
    }
    ports = {"inputs": {"push": "plant.ship.motor"}, "outputs": {"position": "plant.ship.position"}}
    folder.write({"components": components, "connections": [], "ports": ports}, "n.json")
    nested = {
        "inner": {"system": "n.json"},
        "pilot": folder.block("Controller", parameters={"offset": 0.0}),
    }
    fed = [connection("inner.position.x", "pilot.vehicle.position.x")]
    assert warnings_of(folder.scenario(nested, fed)) == [
        "components.pilot: nothing feeds or sets inner.pilot.vehicle.position.x: "
        "is a connection from inner.plant.ship.position.x to inner.pilot.vehicle.position.x "
        "missing?",
        # its port has another name
        "connections: nothing feeds or sets an input of inner.plant: are connections missing?",
    ]


KEEPS = 'it keeps its start value until a connection feeds or "parameters" set it'
OWN_BLOCK = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Real

INPUTS = ("position.x", "position.y", "altitude", "speed", "rotor_speeed",
          "gust.x", "gust.y", "gust.z")


class Own(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.values = dict.fromkeys(INPUTS, 0.0)
        for name in INPUTS:
            access = {
                "getter": lambda n=name: self.values[n],
                "setter": lambda v, n=name: self.values.update({n: v}),
            }
            self.register_variable(Real(name, causality=Fmi2Causality.input, **access))
        self.reset = False
        self.register_variable(Boolean("reset", causality=Fmi2Causality.input))
        self.rotor_speed = self.height = 0.0
        for name in ("rotor_speed", "height"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        return True
"""


def own_pair(folder, connections, **more):
    (folder.path / "own.py").write_text(OWN_BLOCK)
    components = {"plant": {"python": "own.py:Own"}, "pilot": {"python": "own.py:Own", **more}}
    confirmed = {"position": [0.0, 0.0], "altitude": 0.0, "speed": 0.0, "rotor_speeed": 0.0}
    components["plant"]["parameters"] = confirmed
    return warnings_of(
        folder.scenario(
            components, [connection("plant.height", f"pilot.{name}") for name in connections]
        )
    )


def test_a_forgotten_number_beside_fed_inputs_is_named_with_the_most_similar_output(
    folder,
):
    fed = ["position.x", "position.y", "altitude", "speed"]
    line = (
        f"components.pilot: nothing feeds or sets pilot.rotor_speeed: {KEEPS}; the output nearest "
        "by name is plant.rotor_speed"
    )
    assert own_pair(folder, fed) == [line]  # gust.* and reset keep their start values on purpose
    assert own_pair(folder, fed, parameters={"rotor_speeed": 0.0}) == []
    assert own_pair(folder, ["altitude"]) == []  # few inputs of the component are in use


def test_an_output_outside_of_a_nested_system_is_not_proposed_for_its_inner_input(folder):
    (folder.path / "own.py").write_text(OWN_BLOCK)
    known = {"position": [0.0, 0.0], "altitude": 0.0, "speed": 0.0}
    folder.write(
        {"components": {"pilot": {"python": "own.py:Own", "parameters": known}}, "ports": {}},
        "n.json",
    )
    plant = {"python": "own.py:Own", "parameters": known | {"rotor_speeed": 0.0}}
    found = warnings_of(folder.scenario({"inner": {"system": "n.json"}, "plant": plant}))
    assert found == [f"components.pilot: nothing feeds or sets inner.pilot.rotor_speeed: {KEEPS}"]


def test_the_other_elements_of_a_vector_that_outputs_feed_in_part_are_named(folder):
    """A vertical component is 0 on purpose."""
    assert own_pair(folder, ["gust.x", "gust.y"]) == []
    assert own_pair(folder, ["gust.x"]) == [
        f"components.pilot: nothing feeds or sets pilot.gust.y: {KEEPS}"
    ]


def test_components_without_any_connected_input_cause_warnings(folder):
    set_to_one = folder.block("Plant", parameters={"ship.motor[1]": 1.0})
    components = {"one": folder.block("Plant"), "other": set_to_one, "third": folder.block("Plant")}
    link = connection("other.ship.position.x", "other.ship.motor[2]")
    line = "connections: nothing feeds or sets an input of one, third: are connections missing?"
    assert warnings_of(folder.scenario(components, [link])) == [line]
    assert warnings_of(folder.scenario(components)) == []  # every component by itself


def test_inputs_with_a_value_or_without_a_matching_output_cause_no_warning(folder):
    assert ship(folder, BOTH) == []
    assert ship(folder, BOTH[1:], {"vehicle.position.x": 1.0}) == []
    assert (
        ship(folder, BOTH[1:], events=[{"time": 1, "set": {"pilot.vehicle.position.x": 1.0}}]) == []
    )


def test_late_events_and_missing_references_cause_warnings(folder):
    late = {"events": [{"time": 4, "set": {"pilot.offset": 1.0}}]}
    missing = {"reference": {"file": "run.csv", "tolerances": {"*": {"absolute": 0.1}}}}
    assert ship(folder, BOTH, **late, **missing) == [
        "events[0]: this event does not happen: 4 s is after the stop time 3 s",
        'reference.file: file "run.csv" does not exist: `cosim regress --update` writes it',
    ]


def test_run_and_check_warn_of_times_after_the_end(folder):
    kpi = {"name": "late", "python": "cosim.kpis:peak", "arguments": {"signal": "a.y", "start": 99}}
    late = {"events": [{"time": 4, "set": {"a.u": 1.0}}], "kpis": [kpi]}
    file = folder.scenario({"a": folder.block("Gain")}, **late)
    lines = [
        "$.events[0]: this event does not happen: 4 s is after the stop time 3 s",
        (
            '$.kpis[0].arguments.start: KPI "late" starts at 99 s, after the stop time 3 s, and '
            "may have no value"
        ),
    ]
    for command in ("check", "run"):
        done = run_cosim(command, file, cwd=folder.path)
        assert done.returncode == 0, done.stderr
        assert [
            line.partition(": ")[2] for line in done.stderr.splitlines() if "WARNING" in line
        ] == lines


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_shipped_scenarios_cause_no_warnings(file):
    assert warnings_of(file) == []


def step_warnings(folder, step, **more):
    boats = {
        name: {"fmu": str(resources.root() / "fmus/strider.fmu"), **more}
        for name in ("one", "other")
    }
    found = warnings_of(folder.scenario(boats, step_size=step, stop_time=2))
    return [line for line in found if "recommends" in line]


def test_components_that_step_much_more_rarely_than_their_fmu_recommends_are_named(folder):
    text = (
        "one, other step every 0.05 s, 5 times the 0.01 s that strider.fmu recommends: the results "
        "may be wrong, use about 0.01 s"
    )
    assert step_warnings(folder, 0.04) == []
    assert step_warnings(folder, 0.05) == [f"step_size: {text}"]
    assert step_warnings(folder, 0.01, period=0.05) == [f"components.one.period: {text}"]


def test_the_solver_of_an_fmu_for_model_exchange_keeps_its_own_step(folder):
    fmu = {"fmu": str(resources.root() / "fmus/continuous_pid.fmu")}
    assert [
        len(warnings_of(folder.scenario({"pid": fmu | each}, step_size=0.05)))
        for each in ({}, {"solver": {"method": "euler"}})
    ] == [1, 0]
