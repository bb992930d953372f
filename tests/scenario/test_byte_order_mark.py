"""JSON files with a UTF-8 byte order mark, as some editors on Windows write them, are read like
those without.
"""

import json

import pytest
from systems import connection

import cosim
from cosim.core import resources
from cosim.scenario import load
from cosim.studies.controller_bench.role import read_role
from cosim.studies.regression import has_keys
from cosim.studies.sweep import Sweep
from cosim.studies.tune import Tuning

MARK = b"\xef\xbb\xbf"


@pytest.fixture
def marked(folder):
    """Function that writes a JSON file with a byte order mark."""

    def write(content, name="scenario.json"):
        text = content if isinstance(content, str) else json.dumps(content)
        (folder.path / name).write_bytes(MARK + text.encode())
        return folder.path / name

    return write


def test_a_scenario_and_a_nested_system(folder, marked):
    marked(
        {
            "components": {"x": folder.block("Gain")},
            "ports": {"inputs": {"u": "x.u"}, "outputs": {"y": "x.y"}},
        },
        "n.json",
    )
    components = {"a": {"system": "n.json", "parameters": {"x.u": 3.0}}, "b": folder.block("Gain")}
    content = {"name": "bom", "stop_time": 1, "step_size": 1, "components": components}
    assert cosim.run(marked(content | {"connections": [connection("a.y", "b.u")]}))[
        "b.y"
    ].tolist() == [0.0, 12.0]


def test_positions_do_not_count_the_mark(marked):
    with pytest.raises(cosim.InputError, match=r"scenario\.json:1:2: .*unknown key") as error:
        load(marked('{"colour": 1}'))
    assert "\ufeff" not in str(error.value)


def test_a_second_mark_is_no_json(marked):
    with pytest.raises(cosim.InputError, match=r"scenario\.json:1:1: expected a JSON value"):
        load(marked("\ufeff{}"))


def test_a_sweep_and_a_tuning(marked):
    sweep = {
        "name": "s",
        "scenario": "demo1_box",
        "factors": [{"name": "f", "set": "a.b", "values": [1, 2]}],
    }
    assert len(Sweep.from_file(marked(sweep, "sweep.json"))) == 2
    parameter = {"name": "p", "set": "a.b", "min": 0.0, "max": 1.0}
    tuning = {"name": "t", "scenario": "demo1_box", "minimize": "p", "parameters": [parameter]}
    assert Tuning.from_file(marked(tuning, "tune.json")).spec.name == "t"


def test_a_role(marked):
    text = (resources.root() / "scenarios/roles/uav_mixer.json").read_text()
    assert read_role(str(marked(text, "role.json"))).outputs == read_role("uav_mixer").outputs


def test_a_scenario_among_those_that_are_collected_by_pytest_and_regress(marked):
    assert has_keys(marked({"components": {"a": {}}, "checks": [{}]}), ("components",), ("checks",))
    assert not has_keys(marked({"components": {"a": {}}}), ("components",), ("checks",))


def test_the_mark_of_utf_16_is_refused_in_one_line(folder):
    file = folder.path / "scenario.json"
    file.write_text("{}", encoding="utf-16")
    with pytest.raises(cosim.InputError, match="is not UTF-8 text") as error:
        load(file)
    assert len(error.value.problems) == 1
