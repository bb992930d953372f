"""Foreign FMUs of both FMI versions as components."""

import logging
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from fakes import counter
from idle_folders import remove_idle_folders
from probe_fmus import build_probe_fmu
from systems import endpoint, make_system, run_system

from cosim.components.fmi import FmuFile, Isolation, create_component
from cosim.core.errors import ComponentError, InputError
from cosim.core.time_grid import exact_fraction
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings

pytestmark = pytest.mark.usefixtures("executor")


@pytest.fixture(params=[None, Isolation()], ids=["in process", "isolated"])
def make_instances(request):
    """Function that creates instances of an FMU by name, all in this process or each in a worker
    process.
    """

    def make(path, *names):
        file = FmuFile(path)
        return {name: create_component(file, name, isolation=request.param) for name in names}

    return make


@pytest.mark.parametrize("stages", [[("a", "b")], [("a",), ("b",)]], ids=["jacobi", "gauss-seidel"])
def test_two_lags_in_a_ring_that_start_at_one_stay_at_one(make_instances, probe, stages):
    built = make_system(make_instances(probe, "a", "b"), "a.y > b.u, b.y > a.u", stages)
    recording = run_system(built, 20, 0.01, ["a.y", "b.y"])
    assert set(recording.columns["a.y"]) == set(recording.columns["b.y"]) == {1.0}


def test_a_lag_equals_fmpy_and_the_closed_form(make_instances, probe):
    from fmpy import simulate_fmu

    recording = run_system(make_system(make_instances(probe, "a")), 2, 0.01, ["a.y"])
    expected = simulate_fmu(
        str(probe), stop_time=2, output_interval=0.01, step_size=0.01, output=["y"]
    )
    np.testing.assert_allclose(recording.columns["a.y"], expected["y"], rtol=1e-12)
    np.testing.assert_allclose(
        recording.columns["a.y"], (1 - 0.01 / 0.5) ** np.arange(201), rtol=1e-12
    )


def test_every_type_is_set_and_read(make_instances, probe):
    a = make_instances(probe, "a")["a"]
    values = {
        "b_in": True,
        "s_in": "hello",
        "e_in": 2,
        ("i_in" if a.description.major == 2 else "int32_in"): 41,
    }
    outputs = [v.name for v in a.variables if v.causality == "output" and not v.shape]
    built = make_system({"a": a}, start_values={"a": values})
    recording = run_system(built, 0.01, 0.01, [f"a.{name}" for name in outputs])
    last = {name: recording.columns[f"a.{name}"][-1] for name in outputs}
    assert (last["b_out"], last["s_out"], last["e_out"]) == (False, "<hello>", 2)
    assert last.get("i_out", last.get("int32_out")) == 42
    assert recording.columns["a.b_out"].dtype == bool


def test_every_type_is_connected(make_instances, probe):
    components = make_instances(probe, "a", "b")
    pairs = [("b_out", "b_in"), ("s_out", "s_in"), ("e_out", "e_in"), ("y", "u")]
    pairs.append(
        ("i_out", "i_in") if components["a"].description.major == 2 else ("int64_out", "int64_in")
    )
    wires = ", ".join(f"a.{source} > b.{target}" for source, target in pairs)
    built = make_system(
        components, wires, [("a",), ("b",)], start_values={"a": {"s_in": "x", "e_in": 2}}
    )
    recording = run_system(
        built, 0.02, 0.01, ["b.b_out", "b.s_out", "b.e_out", f"b.{pairs[-1][0]}"]
    )
    assert [column[-1] for column in recording.columns.values()] == [False, "<<x>>", 2, 2]


INTEGERS = {
    "int8": -8,
    "uint8": 200,
    "int16": -300,
    "uint16": 60000,
    "uint32": 4 * 10**9,
    "int64": -(2**62),
    "uint64": 2**63,
}


def test_integers_of_all_widths_keep_every_bit(make_instances, probes):
    values = {f"{name}_in": value for name, value in INTEGERS.items()}
    built = make_system(make_instances(probes[3], "a"), start_values={"a": values})
    recording = run_system(built, 0.01, 0.01, [f"a.{name}_out" for name in INTEGERS])
    assert {name: int(recording.columns[f"a.{name}_out"][-1]) for name in INTEGERS} == {
        name: value + 1 for name, value in INTEGERS.items()
    }


def test_arrays_are_set_whole_and_connected_by_element(make_instances, probes):
    built = make_system(
        {**make_instances(probes[3], "a"), "count": counter()},
        "count.y > a.v_in[2]",
        [("count",), ("a",)],
    )
    recording = run_system(built, 0.02, 0.01, ["a.v_out[1]", "a.v_out[2]", "a.v_out[3]"])
    assert [column[-1] for column in recording.columns.values()] == [0.0, 4.0, 0.0]


def test_a_failure_names_component_function_status_time_and_the_fmus_message(make_instances, probe):
    built = make_system(make_instances(probe, "lag"), start_values={"lag": {"fail_time": 0.035}})
    major = 2 if probe.stem.endswith("2") else 3
    with pytest.raises(ComponentError) as failure:
        run_system(built, 1, 0.01)
    end = ", 0.0 s" if major == 2 else ""
    words = (
        f"lag: fmi{major}DoStep failed at t = 0.03 s: status 3 (error): told to fail, 100%s "
        f"sure{end}"
    )
    assert str(failure.value) == words


def test_log_messages_of_fmi_2_are_formatted_and_those_of_fmi_3_unchanged(
    make_instances, probe, caplog
):
    built = make_system(make_instances(probe, "lag"), start_values={"lag": {"fail_time": 0.0}})
    with caplog.at_level(logging.INFO, "cosim"), pytest.raises(ComponentError):
        run_system(built, 1, 0.01)
    end = ", 0.0 s" if "2" in probe.name else ""
    assert [(r.levelname, r.getMessage()) for r in caplog.records] == [
        ("ERROR", f"lag: told to fail, 100%s sure{end}")
    ]


def test_messages_go_to_the_instance_that_sends_them(make_instances, probes, caplog):
    built = make_system(
        make_instances(probes[2], "one", "two"), start_values={"two": {"fail_time": 0.0}}
    )
    with (
        caplog.at_level(logging.INFO, "cosim"),
        pytest.raises(ComponentError, match=r"two: fmi2DoStep failed.*sure, 0.0 s"),
    ):
        run_system(built, 1, 0.01)
    assert [r.getMessage().split(":")[0] for r in caplog.records] == ["two"]


def test_rows_until_a_failure_are_kept(make_instances, probe):
    built = make_system(make_instances(probe, "a"), start_values={"a": {"fail_time": 0.035}})
    outcome = simulate(
        built,
        Settings(
            exact_fraction(0), exact_fraction(1), exact_fraction(0.01), {"a.y": endpoint("a.y")}
        ),
    )
    assert outcome.recording.time.tolist() == [0, 0.01, 0.02, 0.03]


@pytest.mark.parametrize(("status", "freed"), [(3, True), (4, False)], ids=["error", "fatal"])
def test_free_instance_is_not_called_after_fatal(make_instances, probes, caplog, status, freed):
    start = {"fail_time": 0.0, "fail_status": status, "i_in": 9}
    built = make_system(make_instances(probes[2], "a"), start_values={"a": start})
    with (
        caplog.at_level(logging.INFO, "cosim"),
        pytest.raises(ComponentError, match=f"status {status}"),
    ):
        run_system(built, 1, 0.01)
    assert ("a: freed" in caplog.messages) is freed


def test_an_fmu_may_end_the_simulation(make_instances, probe):
    major = 2 if probe.stem.endswith("2") else 3
    request = {"i_in": 7, "fail_status": 2} if major == 2 else {"b_in": True}
    built = make_system(
        make_instances(probe, "a"), start_values={"a": {"fail_time": 0.025, **request}}
    )
    outcome = simulate(
        built,
        Settings(
            exact_fraction(0), exact_fraction(1), exact_fraction(0.01), {"a.y": endpoint("a.y")}
        ),
    )
    assert outcome.failure is None
    assert outcome.termination.component == "a"
    assert (
        len(outcome.recording.time) == {2: 3, 3: 4}[major]
    )  # FMI 2.0: a step that was discarded does not count


def test_a_restored_fmu_state_repeats_the_results_bit_for_bit(make_instances, probe):
    from cosim.engine import Recorder, compile_plan, executor_class
    from cosim.engine.initialization import instantiate_components

    built = make_system(
        make_instances(probe, "a", "b"), "a.y > b.u", start_values={"a": {"u": 3.0}}
    )
    settings = Settings(
        exact_fraction(0), exact_fraction(3), exact_fraction(0.01), {"b.y": endpoint("b.y")}
    )
    plan = compile_plan(built, settings)
    recorder = Recorder(plan)
    executor = executor_class("auto")(plan, recorder)
    instantiate_components(plan)
    executor.initialize()
    executor.run(100)
    states = {name: component.get_state() for name, component in built.components.items()}
    executor.run(200)
    first = recorder.recording().columns["b.y"][101:201].copy()
    for name, component in built.components.items():
        component.set_state(states[name])
        component.get_outputs()
        component.free_state(states[name])
    executor.run(300)
    assert np.array_equal(recorder.recording().columns["b.y"][201:], first)
    for component in built.components.values():
        component.free()


def test_an_fmu_is_extracted_once_and_leaves_nothing_behind(
    make_instances, probe, tmp_path, monkeypatch
):
    remove_idle_folders()  # those of earlier tests in this process
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    folder_counts = []
    built = make_system(make_instances(probe, "a", "b", "c"))
    outcome = simulate(
        built,
        Settings(exact_fraction(0), exact_fraction(1), exact_fraction(0.01)),
        [lambda _, __: folder_counts.append(len(list(tmp_path.glob("cosim-fmu-*"))))],
    )
    assert outcome.failure is None
    assert set(folder_counts) == {1}
    remove_idle_folders()
    assert list(tmp_path.iterdir()) == []


def test_other_files_are_refused(tmp_path):
    (tmp_path / "text.fmu").write_text("hello")
    with pytest.raises(InputError, match="is not an FMU: it is not a ZIP file"):
        _ = FmuFile(tmp_path / "text.fmu").description
    with pytest.raises(InputError, match="does not exist"):
        _ = FmuFile(tmp_path / "missing.fmu").description
    with ZipFile(tmp_path / "empty.fmu", "w"):
        pass
    with pytest.raises(InputError, match=r"no member 'modelDescription\.xml'"):
        _ = FmuFile(tmp_path / "empty.fmu").description


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            (b'fmiVersion="2.0"', b'fmiVersion="1.1"'),
            r"is an FMI 1\.1 FMU; FMI 1\.0, 2\.0 and 3\.0 are supported",
        ),
        ((b'guid="probe"', b""), "lacks the attribute guid"),
        ((b"<CoSimulation", b"<CoSimulation><"), "is not well-formed XML: "),
        (
            (b'start="1" min', b'start="one" min'),
            'start value "one" of variable "y_start" is not a valid Float64',
        ),
    ],
)
def test_an_invalid_description_is_refused(probes, tmp_path, change, words):
    changed = tmp_path / "changed.fmu"
    with ZipFile(probes[2]) as source, ZipFile(changed, "w") as target:
        target.writestr(
            "modelDescription.xml", source.read("modelDescription.xml").replace(*change)
        )
    with pytest.raises(InputError, match=words):
        _ = FmuFile(changed).description


def test_an_fmu_for_another_platform_is_refused_with_its_platforms(probes, tmp_path):
    foreign = tmp_path / "windows.fmu"
    with ZipFile(probes[2]) as source, ZipFile(foreign, "w") as target:
        target.writestr("modelDescription.xml", source.read("modelDescription.xml"))
        target.writestr("binaries/win32/probe.dll", b"MZ")
    with pytest.raises(InputError, match=r"has no binary for \S+ \(\S+\); it has: win32"):
        create_component(FmuFile(foreign), "a")


def test_a_binary_under_a_wrong_name_is_an_input_error(make_instances, tmp_path):
    misnamed = build_probe_fmu(2, tmp_path, identifier="other")
    with pytest.raises(InputError, match=r"cannot be loaded: .*probe\.so"):
        run_system(make_system(make_instances(misnamed, "a")), 1, 0.01)


def test_a_wrong_guid_is_reported_with_the_fmus_message(make_instances, probes, tmp_path):
    changed = tmp_path / "changed.fmu"
    with ZipFile(probes[2]) as source, ZipFile(changed, "w") as target:
        for name in source.namelist():
            target.writestr(name, source.read(name).replace(b'guid="probe"', b'guid="other"'))
    with pytest.raises(ComponentError, match="a: fmi2Instantiate failed: wrong GUID"):
        run_system(make_system(make_instances(Path(changed), "a")), 1, 0.01)


def test_units_and_ranges_come_from_the_description(probes):
    variables = {v.name: v for v in FmuFile(probes[2]).description.variables}
    assert variables["u"].unit.name == "m"
    assert (variables["y_start"].minimum, variables["y_start"].maximum) == (-10, 10)
    assert variables["b_in"].start is False
