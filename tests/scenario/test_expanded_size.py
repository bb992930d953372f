"""Limits of the expanded size: a few small files cannot make a system that fills the memory."""

import cProfile
import pstats
from itertools import pairwise

import pytest
from systems import connection

import cosim
from cosim.cli.commands import check
from cosim.core import size_limits
from cosim.scenario import extension, load

ARRAYS = """
from cosim.core.component import Component, Variable
from cosim.scenario import load


class Arrays(Component):
    binds_everything = has_state = False

    def __init__(self, name, shape, outputs=1):
        self.variables = [
            Variable("u", causality="input", shape=tuple(shape), start=0.0),
            *(Variable(f"y{i}", causality="output", shape=tuple(shape)) for i in range(outputs)),
        ]

    def _never_called(self, *arguments):
        raise AssertionError

    bind = set = get = set_inputs = do_step = get_outputs = _never_called
"""


def refusal(scenario):
    """Return the only line with which a scenario is refused."""
    with pytest.raises(cosim.InputError) as error:
        load(scenario)
    (problem,) = error.value.problems
    return str(problem).replace(f"{scenario.parent}/", "")


def chain(folder, levels, width, last, **more):
    """Write `levels` nested systems of `width` components each, the last one of `last`."""
    for level in range(levels):
        inner = {"system": f"level{level + 1}.json"} if level < levels - 1 else last
        content = {"components": {f"c{i}": inner for i in range(width)}} | more
        folder.write(content, f"level{level}.json")
    return folder.scenario({"a": {"system": "level0.json"}})


@pytest.mark.parametrize(
    ("levels", "width", "last", "found"),
    [
        (12, 10, {"fmu": "none.fmu"}, "1 111 111 111 111"),
        (98, 10, {"fmu": "none.fmu"}, "about 10^98"),
        (5, 10, {"fmu": "none.fmu"}, "111 111"),
        (13, 10, {"system": "empty.json"}, "11 111 111 111 111"),
    ],
    ids=["10^12 components", "10^98 components", "a little too many", "systems without components"],
)
def test_small_files_that_expand_to_many_components_are_refused_before(
    folder, levels, width, last, found
):
    folder.write({"components": {}}, "empty.json")
    line = refusal(chain(folder, levels, width, last))
    assert line.startswith("scenario.json:1:")
    assert f"$.components: found {found}" in line
    assert line.endswith(
        " components and nested systems in the expanded scenario, expected at most 100 000"
    )


def test_a_file_is_read_once_however_often_it_is_used(folder, monkeypatch):
    read, files = extension.read_document, []
    monkeypatch.setattr(
        extension, "read_document", lambda file: files.append(file.name) or read(file)
    )
    (folder.path / "up").mkdir()
    folder.write({"components": {"x": folder.block("Gain")}}, "leaf.json")
    folder.write(
        {"components": {"a": {"system": "leaf.json"}, "b": {"system": "up/../leaf.json"}}},
        "pair.json",
    )
    scenario = folder.scenario(
        {
            "p": {"system": "pair.json"},
            "q": {"system": "up/../pair.json"},
            "x": {"system": "leaf.json"},
        }
    )
    loaded = load(scenario)
    loaded.free()
    assert list(loaded.system.components) == ["p.a.x", "p.b.x", "q.a.x", "q.b.x", "x.x"]
    assert files == ["scenario.json", "pair.json", "leaf.json"]


def test_a_mistake_in_a_file_is_reported_once_however_often_it_is_used(folder):
    folder.write({"colour": "red", "components": {"x": folder.block("Gain")}}, "leaf.json")
    line = refusal(folder.scenario({name: {"system": "leaf.json"} for name in "abc"}))
    assert line.startswith("leaf.json:1:2: $.colour: unknown key")


def test_deeply_nested_systems_are_refused_at_the_level_that_is_too_deep(folder):
    chain(folder, 99, 1, folder.block("Gain"))
    load(folder.scenario({"a": {"system": "level0.json"}})).free()
    folder.write({"components": {"c0": {"system": "level0.json"}}}, "more.json")
    line = refusal(folder.scenario({"a": {"system": "level0.json"}, "b": {"system": "more.json"}}))
    assert line.endswith(
        '$.components.c0.system: the nested system "level0.json" is nested more than 100 levels '
        "deep"
    )
    assert line.startswith("more.json")


def fan(folder, levels, kind, names, **root):
    """Write nested systems whose ports "p" and "q" both refer to both ports of the next one."""
    for level in range(levels):
        last = level == levels - 1
        inner = folder.block("Gain") if last else {"system": f"level{level + 1}.json"}
        targets = ["c.u"] if last else names
        folder.write(
            {"components": {"c": inner}, "ports": {kind: {"p": targets, "q": targets}}},
            f"level{level}.json",
        )
    return folder.scenario({"a": {"system": "level0.json"}, "g": folder.block("Gain")}, **root)


@pytest.mark.parametrize(
    ("kind", "names", "root", "line"),
    [
        (
            "inputs",
            ["c.p", "c.q"],
            {"connections": [connection("g.y", "a.p")]},
            "connections and output ports",
        ),
        (
            "inputs",
            ["c", "c"],
            {"connections": [connection("g.y", "a.p" + 39 * ".p")]},
            "connections and output ports",
        ),
        (
            "parameters",
            ["c.p", "c.q"],
            {"events": [{"time": 1, "set": {"a.p": 1}}]},
            "values of parameters and events",
        ),
        (
            "inputs",
            ["c.p", "c.q"],
            {"inputs": [{"file": "x.csv", "to": {"x": ["a.q"]}}]},
            "connections and output ports",
        ),
    ],
    ids=["connection", "ports by the rest of a name", "event", "input profile"],
)
def test_ports_that_double_at_each_level_are_refused(folder, kind, names, root, line):
    assert f"found 549 755 813 888 {line}" in refusal(fan(folder, 40, kind, names, **root)).replace(
        "889", "888"
    )


def test_parameters_through_ports_that_double_at_each_level_are_refused(folder):
    fan(folder, 40, "parameters", ["c.p", "c.q"])
    assert "found 1 649 267 441 664 values of parameters and events" in refusal(
        folder.scenario({"a": {"system": "level0.json", "parameters": {"p": [1, 2, 3]}}})
    )


def test_delays_of_nested_systems_are_counted_with_all_instances(folder):
    pair = {"components": {"x": folder.block("Gain"), "y": folder.block("Gain")}}
    folder.write({**pair, "connections": [connection("x.y", "y.u", delay=1_000_000)]}, "pair.json")
    line = refusal(folder.scenario({f"c{i}": {"system": "pair.json"} for i in range(101)}))
    assert line.endswith(
        "found 101 000 000 values that delays store in the expanded scenario, expected at most 100 "
        "000 000"
    )


@pytest.mark.parametrize(("size", "delay"), [(1000, 1_000_000), (20_000, 5001), (101, 1_000_000)])
def test_delays_of_arrays_are_counted_with_all_elements(folder, size, delay):
    (folder.path / "arrays.py").write_text(ARRAYS)
    array = {"python": "arrays.py:Arrays", "arguments": {"shape": [size]}}
    connections = [connection("g.y", "g.u"), connection("a.y0", "b.u", delay=delay)]
    line = refusal(
        folder.scenario({"a": array, "b": array, "g": folder.block("Gain")}, connections)
    )
    assert line.endswith(
        f"the delays store {size_limits.format_count(size * delay)} values, expected at most 100 "
        "000 000"
    )
    assert "$.connections[1]" in line


@pytest.mark.parametrize(
    ("shape", "count", "found"),
    [
        ([1_000_001], 1, "2 000 002"),
        ([1000, 1000, 1000], 1, "2 000 000 000"),
        ([10_000], 101, "2 020 000"),
    ],
    ids=["long array", "array of three dimensions", "many components"],
)
def test_elements_of_arrays_are_counted_before_they_get_names(folder, shape, count, found):
    (folder.path / "arrays.py").write_text(ARRAYS)
    array = {"python": "arrays.py:Arrays", "arguments": {"shape": shape}}
    line = refusal(folder.scenario({f"a{i}": array for i in range(count)}))
    assert (
        f"$.components.a{count - 1}: found {found} variables and elements of arrays up to "
        f"a{count - 1}, expected"
    ) in line


def test_output_ports_that_show_the_same_array_again_are_counted(folder, monkeypatch):
    monkeypatch.setattr("cosim.scenario.system_builder.MAX_SCALARS", 20_000)
    (folder.path / "arrays.py").write_text(ARRAYS)
    array = {"python": "arrays.py:Arrays", "arguments": {"shape": [1000]}}
    folder.write(
        {"components": {"x": array}, "ports": {"outputs": {f"p{i}": "x.y0" for i in range(1000)}}},
        "n.json",
    )
    assert "found 21 000 signals of output ports up to a.p20" in refusal(
        folder.scenario({"a": {"system": "n.json"}})
    )


def test_the_same_connection_of_arrays_again_and_again_is_refused(folder, monkeypatch):
    monkeypatch.setattr("cosim.scenario.wiring.MAX_CONNECTIONS", 10_000)
    (folder.path / "arrays.py").write_text(ARRAYS)
    array = {"python": "arrays.py:Arrays", "arguments": {"shape": [1000]}}
    line = refusal(folder.scenario({"a": array, "b": array}, [connection("a.y0", "b.u")] * 1000))
    assert (
        "$.connections[10]: found 10 001 connections of scalars up to here, expected at most 10 000"
        in line
    )


def ring(folder, groups):
    """Write a scenario of one nested system that contains `groups` nested systems of 10 connected
    components each.
    """
    names = [f"c{i}" for i in range(10)]
    wires = [connection(f"{a}.y", f"{b}.u") for a, b in pairwise(names)]
    ports = {"inputs": {"u": "c0.u"}, "outputs": {"y": "c9.y"}}
    folder.write(
        {
            "components": {n: folder.block("Gain", period=1) for n in names},
            "connections": wires,
            "ports": ports,
        },
        "n.json",
    )
    outer = [f"s{i}" for i in range(groups)]
    wires = [
        connection(f"{a}.y", f"{b}.u") for a, b in zip(outer, outer[1:] + outer[:1], strict=True)
    ]
    folder.write(
        {"components": {n: {"system": "n.json"} for n in outer}, "connections": wires}, "ring.json"
    )
    return folder.scenario({"all": {"system": "ring.json"}})


@pytest.mark.parametrize(
    "work",
    [
        lambda file: load(file).free(),
        lambda file: check.command.main([str(file), "--isolation", "none"], standalone_mode=False),
        lambda file: load(file).metadata,
        lambda file: cosim.run(file),
    ],
    ids=["load", "check", "description", "run"],
)
def test_the_work_grows_in_proportion_to_the_number_of_components(folder, work):
    work(ring(folder, 2))  # imports
    calls = []
    for groups in (4, 40):
        profile = cProfile.Profile()
        profile.runcall(work, ring(folder, groups))
        calls.append(pstats.Stats(profile).total_calls)
    assert calls[1] < 11 * calls[0]
