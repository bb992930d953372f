"""Structural parameters, arrays of several dimensions, binaries and 64-bit integers, from their
text to the recording.
"""

from __future__ import annotations

import json

import pytest
from cosim_command import run_cosim
from probe_fmus import build_probe_fmu

import cosim
from cosim.core.errors import InputError
from cosim.results.csv_files import read_csv

LARGEST, SMALLEST = 2**64 - 1, -(2**63)


@pytest.fixture(scope="session")
def shapes(tmp_path_factory):
    return build_probe_fmu(3, tmp_path_factory.mktemp("shapes"), name="shapes")


@pytest.mark.parametrize("isolation", ["none", "fmu"])
@pytest.mark.parametrize("size", [1, 3, 4])
def test_a_structural_parameter_sizes_the_arrays(shapes, size, isolation):
    rows = [[10.0 * i, 1.0] for i in range(size)]
    values = {"n": size, "m": rows, "u": list(range(size))}
    result = cosim.simulate(shapes, start_values=values, isolation=isolation)
    found = {name: result[name].tolist()[-1] for name in result if name.startswith("y")}
    assert found == {f"y[{i + 1}]": 11.0 * i + 1 for i in range(size)}


def scenario(shapes, folder, **parameters):
    document = {
        "name": "shapes",
        "stop_time": 1,
        "step_size": 0.5,
        "components": {
            "a": {"fmu": str(shapes), "parameters": {"n": 2, "m": [[1, 2], [3, 4]], "u": [0, 0]}},
            "b": {"fmu": str(shapes), "parameters": parameters},
        },
        "connections": [{"from": "a.y", "to": "b.u"}],
        "algorithm": {"stages": [["a"], ["b"]]},
        "record": {"signals": ["b.*"]},
    }
    path = folder / "shapes.json"
    path.write_text(json.dumps(document))
    return path


def test_arrays_are_connected_with_their_new_sizes(shapes, tmp_path):
    result = cosim.run(scenario(shapes, tmp_path, m=[[0, 0], [100, 0]]), {"b.n": 2})
    assert [result[f"b.y[{i}]"].tolist()[-1] for i in (1, 2)] == [3.0, 107.0]
    assert "b.y[3]" not in result


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"n": 0},
            (
                '"n" is a structural parameter, which is set before the start to a positive '
                "integer: it stays 3, found 0"
            ),
        ),
        ({"n": "2"}, 'it stays 3, found "2"'),
        ({"n": 10**9}, 'found 2 000 000 000 elements of "m", expected at most 1 000 000'),
        ({"n": 2, "m": [[1, 2]]}, '"m" is an array of 2 x 2 values, found [[1, 2]]'),
        (
            {"m": [[1, 2], [3], [4, 5]]},
            '"m" is an array of 3 x 2 values, found [[1, 2], [3], [4, 5]]',
        ),
        ({"m": [[[1], [2]]] * 3}, '"m" is an array of 3 x 2 values, found'),
        (
            {"b_in": "0g"},
            "\"b_in\" is of type Binary: found '0g', expected two hexadecimal digits per byte",
        ),
        ({"b_in": "123"}, "found '123', expected two hexadecimal digits per byte"),
        ({"b_in": 5}, '"b_in" is of type Binary, found 5'),
    ],
    ids=lambda value: "" if isinstance(value, str) else next(iter(value)),
)
def test_values_that_do_not_fit_are_refused_in_one_line(shapes, values, message):
    with pytest.raises(InputError) as refused:
        cosim.simulate(shapes, start_values=values)
    (problem,) = refused.value.problems
    assert message in str(problem)


def test_the_fmu_refuses_a_structural_parameter_in_one_line(shapes):
    with pytest.raises(cosim.ComponentError, match=r"fmi3SetUInt64 failed.*status 3"):
        cosim.simulate(shapes, start_values={"n": 5})


@pytest.mark.parametrize("isolation", ["none", "fmu"])
def test_binaries_are_hexadecimal_digits(shapes, tmp_path, isolation):
    table = tmp_path / "in.csv"
    table.write_text("time,b_in\n0,00ff\n0.5,cafe\n")
    result = cosim.simulate(shapes, input=table, output=["b_out"], isolation=isolation)
    assert result["b_out"].tolist() == [b"\x00\xff", b"\x00\xff", b"\xca\xfe"]
    result.to_csv(tmp_path / "out.csv")
    assert read_csv(tmp_path / "out.csv").columns["b_out"].tolist() == ["00ff", "00ff", "cafe"]


def test_the_command_line_reads_and_prints_hexadecimal_digits(shapes):
    options = (
        "--isolation",
        "none",
        "--start-value",
        "b_in=0aff",
        "--start-value",
        "m=[[1,0],[0,0],[0,0]]",
    )
    done = run_cosim("simulate", shapes, *options, "--json")
    values = json.loads(done.stdout)["values"]
    assert (values["b_out"], values["y[1]"]) == ("0aff", 1.0)
    assert "b_out = 0aff" in run_cosim("simulate", shapes, *options).stdout.splitlines()


@pytest.mark.parametrize(
    ("kind", "value"), [("uint64", LARGEST - 1), ("int64", SMALLEST), ("int64", 2**53 + 1)]
)
def test_no_digit_of_an_integer_is_lost(probes, tmp_path, kind, value):
    table = tmp_path / "in.csv"
    table.write_text(f"time,{kind}_in\n0,{value}\n2,{value}\n")
    columns = {"time": [0, 2], f"{kind}_in": [value, value]}
    ways = {"input": table}, {"input": columns}, {"start_values": {f"{kind}_in": value}}
    for arguments in ways:
        result = cosim.simulate(probes[3], output=[f"{kind}_out"], **arguments)
        assert int(result[f"{kind}_out"][-1]) == value + 1
        result.to_csv(tmp_path / "out.csv")
        assert int(read_csv(tmp_path / "out.csv").columns[f"{kind}_out"][-1]) == value + 1
