"""Wrong arguments from Python are refused with a sentence, and scenarios may be dicts."""

import numpy as np
import pytest
from python_blocks import Gain, Stateless, scenario

import cosim

SOURCES = "expected the path of a scenario file, the name of a shipped scenario, or a dict"


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"scenario": 3}, f"scenario: {SOURCES}; found 3 (int)"),
        ({"parameters": 3}, "parameters: expected a dict from names to values; found 3 (int)"),
        (
            {"parameters": {1: 2}},
            "parameters: expected a dict from names to values; found {1: 2} (dict)",
        ),
        ({"stop_time": [1]}, "stop_time: expected seconds as a number or a text; found [1] (list)"),
        ({"isolation": "all"}, "isolation: expected one of 'fmu', 'none'; found 'all' (str)"),
        ({"late": 1}, "late: expected one of 'warn', 'fail'; found 1 (int)"),
        ({"real_time": "fast"}, "real_time: expected a number or None; found 'fast' (str)"),
        ({"sandbox": 1}, "sandbox: expected True or False; found 1 (int)"),
        ({"observers": 3}, "observers: expected a list of functions; found 3 (int)"),
        ({"stoptime": 1}, 'unknown argument "stoptime"; did you mean "stop_time"?'),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_a_wrong_type_is_an_error_of_one_sentence(arguments, line):
    with pytest.raises(cosim.InputError) as error:
        cosim.run(**{"scenario": scenario(), **arguments})
    assert str(error.value) == line


@pytest.mark.parametrize("n", [0, -1, 1.5, True, "2", None])
def test_steps_are_counted_by_positive_integers(n):
    with (
        cosim.load(scenario()) as simulation,
        pytest.raises(cosim.InputError, match="n: expected a positive number of steps"),
    ):
        simulation.step(n)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (
            {"stop_time": float("nan")},
            "scenario: $.stop_time: NaN is not allowed, expected a finite number",
        ),
        ({"step_sze": 1}, 'scenario: $.step_sze: unknown key; did you mean "step_size"?'),
        ({"checks": {1: 2}}, "scenario: $.checks: expected texts as keys, found 1"),
        ({"checks": {1}}, "scenario: $.checks: expected a value as in JSON, found {1} (set)"),
        (
            {"components": {"g": {"python": Gain("g"), "arguments": {"k": 1}}}},
            (
                'scenario: $.components.g: python_blocks:Gain object takes no "arguments", because '
                "it has already been constructed"
            ),
        ),
    ],
)
def test_problems_of_a_dict_name_their_place(change, line):
    with pytest.raises(cosim.InputError) as error:
        cosim.load(scenario(**change))
    assert str(error.value) == line


def test_a_dict_may_contain_numbers_of_numpy_and_objects():
    gain = Gain("g", 3.0)
    result = cosim.run(
        scenario(gain, stop_time=np.float64(0.5), events=[{"time": 0, "set": {"g.u": np.int64(1)}}])
    )
    assert result["g.y"].tolist() == pytest.approx([0, 3, 6, 9, 12, 15])
    assert result.metadata["scenario"]["components"] == {
        "g": {"python": "python_blocks:Gain object"}
    }


@pytest.mark.parametrize(
    "parameters",
    [
        {"/components/g/python": Stateless},
        {"/components/g": {"python": Gain, "arguments": {"k": 3.0}}, "g.u": np.float64(1)},
    ],
    ids=["class", "component"],
)
def test_a_parameter_may_be_a_class(parameters):
    with cosim.load(scenario(Gain("g", 5.0)), parameters) as simulation:
        new = simulation.prepared.system.components["g"]
        assert type(new) is (Stateless if "/components/g/python" in parameters else Gain)
        assert new.k == (2.0 if type(new) is Stateless else 3.0)
        simulation.reset()  # no object is left of which reset() could not make a new one


def test_a_text_replaces_an_object(tmp_path, monkeypatch):
    (tmp_path / "blocks.py").write_text("from python_blocks import Gain\nclass Own(Gain): pass\n")
    monkeypatch.chdir(tmp_path)
    with cosim.load(scenario(Gain("g")), {"/components/g/python": "blocks.py:Own"}) as simulation:
        assert type(simulation.prepared.system.components["g"]).__name__ == "Own"


def test_a_dict_may_extend_a_scenario():
    result = cosim.run({"extends": "demo1_box", "name": "short", "stop_time": 0.5, "checks": []})
    assert result.time[-1] == 0.5
    assert result.metadata["name"] == "short"


def test_python_objects_stay_in_this_process():
    for options in ({"isolation": "fmu"}, {"sandbox": True}):
        with pytest.raises(cosim.InputError, match="Python objects exist in this process only"):
            cosim.load(scenario(), **options)
    with pytest.raises(
        cosim.InputError, match="other processes, in which Python objects do not exist"
    ):
        cosim.sweep({"name": "s", "scenario": scenario(), "factors": []})
    with (
        cosim.load(scenario(Gain("g"))) as simulation,
        pytest.raises(cosim.InputError, match="expected a class"),
    ):
        simulation.reset()


def test_all_public_names_exist():
    for name in cosim.__all__:
        assert getattr(cosim, name) is not None
