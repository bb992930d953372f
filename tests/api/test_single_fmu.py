"""`cosim.simulate`: one FMU with inputs, start values and recorded variables from Python."""

import numpy as np
import pytest

import cosim
from cosim.core import resources

AUTOPILOT = resources.root() / "fmus/strider_autopilot.fmu"
#: north of the vessel's course, so that the autopilot steers
INPUT = {"time": [0.0, 2.0], "vehicle.position.y": [0.0, 4.0]}
START = {"waypoint_count": 1, "waypoint_x": [10.0], "waypoint_y": [0.0], "speed_command": 1.0}


def simulate(**options):
    return cosim.simulate(
        AUTOPILOT, **{"stop_time": 2, "step_size": "1/10", "start_values": START, **options}
    )


def test_outputs_are_recorded_by_their_names():
    result = simulate()
    assert {"thrust", "rudder_angle"} < set(result)
    assert list(simulate(output=["thrust"])) == ["thrust"]
    assert result.time.tolist() == pytest.approx(np.linspace(0, 2, 21))
    assert result["thrust"][-1] > 0


def test_inputs_come_from_a_file_a_dict_or_an_array(tmp_path):
    table = np.zeros(2, dtype=[("time", float), ("vehicle.position.y", float)])
    table["time"], table["vehicle.position.y"] = INPUT.values()
    (tmp_path / "input.csv").write_text("time,vehicle.position.y\n0,0\n2,4\n")
    given = [INPUT, table, tmp_path / "input.csv"]
    results = [
        simulate(input=each, output=["rudder_angle", "vehicle.position.y"]) for each in given
    ]
    assert results[0]["rudder_angle"][-1] != simulate()["rudder_angle"][-1]
    assert results[0]["vehicle.position.y"][-2] == pytest.approx(
        3.6
    )  # of the step that ended there
    assert len({result["rudder_angle"].tobytes() for result in results}) == 1


def test_isolation_gives_the_same_bytes():
    assert simulate(isolation="fmu")["thrust"].tobytes() == simulate()["thrust"].tobytes()


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"output": ["trust"]}, 'output: the FMU has no variable "trust"; did you mean "thrust"?'),
        ({"output": 3}, "output: expected a list of names; found 3 (int)"),
        (
            {"input": 3},
            'input: expected a CSV file, or columns by name with a column "time"; found 3 (int)',
        ),
        (
            {"input": {"time": [0], "vehicle.position.w": [0]}},
            'input: the FMU has no input "vehicle.position.w"; did you mean',
        ),
        (
            {"input": {**INPUT, "time": [1, 0]}},
            "input: expected columns of equal length with finite numbers",
        ),
        ({"input": {**INPUT, "time": ["a", 0]}}, "input: expected numbers: could not convert"),
        ({"stop_time": [1]}, 'stop_time: expected seconds, found "[1]"'),
        ({"start_values": 3}, "start_values: expected a dict from names to values; found 3 (int)"),
        ({"start_values": {"sped": 1}}, 'start value sped: component "fmu" has no variable "sped"'),
        ({"isolation": True}, "isolation: expected 'fmu' or 'none'; found True (bool)"),
    ],
)
def test_wrong_arguments_are_refused_in_a_sentence(options, line):
    with pytest.raises(cosim.InputError) as error:
        simulate(**options)
    assert str(error.value).startswith(line)


def test_a_missing_fmu_is_refused():
    with pytest.raises(cosim.InputError, match=r'FMU "nope\.fmu" does not exist'):
        cosim.simulate("nope.fmu")
    with pytest.raises(cosim.InputError, match="fmu: expected the path of an FMU"):
        cosim.simulate(3)


def test_a_failure_has_the_rows_until_then(probe):
    with pytest.raises(cosim.ComponentError) as error:
        cosim.simulate(probe, start_values={"fail_time": 0.025}, stop_time=0.1, step_size=0.01)
    assert len(error.value.result.time) == 3
