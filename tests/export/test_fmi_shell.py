"""FMI 2.0 and 3.0 interface of a hand-written block, called by FMPy."""

from __future__ import annotations

import ctypes
import math
from contextlib import contextmanager
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from cosim.export.fmu.package import write_fmu

X = "vehicle.position.x"


def test_the_fmu_validates_without_problems(fmu):
    assert validate_fmu(str(fmu)) == []


def test_outputs_follow_the_equations(instantiate_sample):
    instance = instantiate_sample().initialize(
        gain=3.0, repeat=2, weights=[1.0, -2.0, 0.5], **{X: 0.25}
    )
    random = np.random.default_rng(7)
    integral = 6.0 * 0.25
    for k in range(300):
        x, matrix = random.normal(), random.normal(size=4)
        instance.set(X, x)
        instance.set("matrix", list(matrix))
        instance.step(k * 0.01)
        for _ in range(2):
            integral += 6.0 * x * 0.01
        assert instance.get("outputs") == [integral, -2.0 * integral, 0.5 * integral]
        assert instance.get("inner_product") == [
            matrix[0] * integral + matrix[1],
            matrix[2] * integral + matrix[3],
        ]
    assert instance.get("steps") == 300


def test_in_initialization_mode_outputs_depend_on_the_values_that_were_set(instantiate_sample):
    instance = instantiate_sample()
    instance.enter()
    instance.set(X, 1.0)
    assert instance.get("outputs")[0] == 4.0
    instance.set(X, 2.0)
    instance.set("gain", 5.0)
    assert instance.get("outputs")[0] == 20.0


def test_leaving_initialization_mode_computes_the_outputs(instantiate_sample):
    assert instantiate_sample().initialize(**{X: 2.0}).get("outputs")[0] == 8.0


def test_the_start_time_reaches_the_model(instantiate_sample):
    instance = instantiate_sample().initialize(start=12.5)
    assert instance.get("clock") == 12.5
    instance.step(12.5)
    assert instance.get("clock") == 12.51


def test_dependent_parameters_are_updated_in_every_phase(instantiate_sample):
    instance = instantiate_sample()
    instance.set("gain", 3.0)
    assert instance.get("doubled_gain") == 6.0
    instance.enter()
    instance.set("gain", 4.0)
    assert instance.get("doubled_gain") == 8.0
    instance.fmu.exitInitializationMode()
    instance.set("gain", 5.0)
    assert instance.get("doubled_gain") == 10.0


def test_enumerations_and_booleans_are_typed(instantiate_sample):
    instance = instantiate_sample().initialize(mode=1, limit=1.0, **{X: 1.0})
    assert instance.get("active_mode") == 1
    assert bool(instance.get("saturated")) is True
    instance.set("enabled", False)
    assert bool(instance.get("enabled")) is False


@contextmanager
def refused(instance, message):
    """Check that the call in this block fails and logs exactly one message, which contains
    `message`.
    """
    assert instance.messages == []
    with pytest.raises(FMICallException, match=r"status 3 \(error\)"):
        yield
    assert len(instance.messages) == 1
    assert message in instance.messages[0]


def test_a_fixed_parameter_cannot_be_set_while_stepping(instantiate_sample):
    instance = instantiate_sample().initialize()
    with refused(instance, "limit is a fixed parameter and cannot be set while stepping"):
        instance.set("limit", 5.0)


def test_an_output_cannot_be_set(instantiate_sample):
    instance = instantiate_sample()
    with refused(instance, "steps is neither parameter nor input"):
        instance.set("steps", 3)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_values_that_are_not_finite_are_refused(instantiate_sample, value):
    instance = instantiate_sample().initialize()
    with refused(instance, f"{X}: found {value}, expected a finite value"):
        instance.set(X, value)


@pytest.mark.parametrize("value", [0, 4])
def test_an_enumeration_accepts_only_its_literals(instantiate_sample, value):
    instance = instantiate_sample()
    with refused(instance, f"mode: found {value}, expected 1 to 3"):
        instance.set("mode", value)


def test_reading_as_another_type_is_refused(instantiate_sample):
    instance = instantiate_sample()
    with refused(instance, "is of type Boolean"):
        (instance.fmu.getReal if instance.version == 2 else instance.fmu.getFloat64)(
            instance._address("enabled")[1]
        )


def test_an_unknown_value_reference_is_refused(instantiate_sample):
    instance = instantiate_sample()
    with refused(instance, "found value reference 999, expected less than"):
        (instance.fmu.getReal if instance.version == 2 else instance.fmu.getFloat64)([999])


@pytest.mark.parametrize("version", [3], indirect=True)
@pytest.mark.parametrize("count", [2, 4])
def test_an_array_is_set_as_a_whole(instantiate_sample, count):
    instance = instantiate_sample()
    with refused(instance, f"found {count} values, expected"):
        instance.set("weights", [1.0] * count)


def test_a_step_needs_initialization(instantiate_sample):
    instance = instantiate_sample()
    with refused(instance, "DoStep: not allowed after instantiation"):
        instance.step(0.0)


def test_initialization_mode_is_entered_once(instantiate_sample):
    instance = instantiate_sample().initialize()
    with refused(instance, "not allowed while stepping"):
        instance.enter()


def test_nothing_is_set_after_termination(instantiate_sample):
    instance = instantiate_sample().initialize()
    instance.fmu.terminate()
    with refused(instance, "not allowed after termination"):
        instance.set(X, 1.0)


@pytest.mark.parametrize("time", [0.02, 0.0, math.nan])
def test_a_step_starts_where_the_last_one_ended(instantiate_sample, time):
    instance = instantiate_sample().initialize()
    instance.step(0.0)
    with refused(instance, "expected 0.01"):
        instance.step(time)


@pytest.mark.parametrize("step_size", [0.0, -0.01, math.nan, math.inf])
def test_a_step_size_is_positive(instantiate_sample, step_size):
    instance = instantiate_sample().initialize()
    with refused(instance, "expected a positive one"):
        instance.step(0.0, step_size)


def test_a_step_does_not_pass_the_stop_time(instantiate_sample):
    instance = instantiate_sample().initialize(stop=0.015)
    instance.step(0.0)
    with refused(instance, "passes the stop time 0.015"):
        instance.step(0.01)


def test_communication_points_may_be_rounded(instantiate_sample):
    instance = instantiate_sample().initialize(start=1e6, stop=1e6 + 30)
    for k in range(3000):
        instance.step(1e6 + k * 0.01)
    assert instance.get("steps") == 3000


def test_a_failing_model_ends_the_step_with_its_reason(instantiate_sample):
    instance = instantiate_sample().initialize()
    instance.set("mode", 3)
    reason = (
        "mode is FAIL (100 %% ##sure)" if instance.version == 2 else "mode is FAIL (100 % #sure)"
    )
    with refused(instance, f"DoStep: assertion: {reason}"):
        instance.step(0.0)


def test_a_failed_initialization_is_reported_with_its_reason(instantiate_sample):
    instance = instantiate_sample()
    instance.set("limit", 0.0)
    instance.enter()
    with refused(instance, "limit must be positive"):
        instance.fmu.exitInitializationMode()


def test_after_an_error_only_a_saved_state_or_a_reset_is_accepted(instantiate_sample):
    instance = instantiate_sample().initialize(**{X: 1.0})
    state = instance.save()
    with refused(instance, "found time 5"):
        instance.step(5.0)
    assert instance.get("outputs")[0] == 4.0
    instance.messages.clear()
    with refused(instance, "not allowed after an error"):
        instance.step(0.0)
    instance.restore(state)
    instance.step(0.0)
    assert instance.get("steps") == 1


def trajectory(instance, first, count):
    random = np.random.default_rng(first)
    seen = []
    for k in range(first, first + count):
        instance.set(X, random.normal())
        instance.step(k * 0.01)
        seen.append(instance.all_values())
    return seen


def test_rollback_is_exact_and_repeatable(instantiate_sample):
    instance = instantiate_sample().initialize()
    trajectory(instance, 0, 20)
    state = instance.save()
    before = instance.all_values()
    onwards = trajectory(instance, 20, 30)
    for _ in range(2):
        instance.restore(state)
        assert instance.all_values() == before
        assert trajectory(instance, 20, 30) == onwards


def test_a_serialized_state_can_be_restored_in_another_instance(instantiate_sample):
    one, other = instantiate_sample().initialize(gain=4.0), instantiate_sample()
    trajectory(one, 0, 20)
    content = one.serialize(one.save())
    other.restore(other.deserialize(content))
    assert other.all_values() == one.all_values()
    assert trajectory(other, 20, 30) == trajectory(one, 20, 30)
    assert content == one.serialize(one.deserialize(content))


@pytest.mark.parametrize(
    ("change", "message"),
    [(lambda c: c[:-1], "bytes, expected"), (lambda c: b"?" + c[1:], "another FMU")],
)
def test_a_foreign_serialized_state_is_refused(instantiate_sample, change, message):
    instance = instantiate_sample().initialize()
    content = instance.serialize(instance.save())
    with refused(instance, message):
        instance.deserialize(change(content))


def test_reset_gives_a_new_instance(instantiate_sample):
    used, fresh = instantiate_sample().initialize(gain=9.0), instantiate_sample()
    trajectory(used, 0, 10)
    used.fmu.reset()
    assert used.serialize(used.save()) == fresh.serialize(fresh.save())
    assert trajectory(used.initialize(), 0, 10) == trajectory(fresh.initialize(), 0, 10)


def test_instances_are_independent(instantiate_sample):
    one, other = instantiate_sample().initialize(), instantiate_sample().initialize()
    trajectory(one, 0, 10)
    assert other.get("steps") == 0


def test_a_wrong_token_is_refused(instantiate_sample):
    messages = []
    with pytest.raises(Exception, match="instantiate"):
        instantiate_sample(guid="{wrong}", messages=messages)
    assert len(messages) == 1
    assert "found token {wrong}, expected {" in messages[0]


def test_functions_that_are_not_offered_are_refused(instantiate_sample):
    instance = instantiate_sample()
    if instance.version == 2:
        with refused(instance, "fmi2CancelStep: steps are not asynchronous"):
            instance.fmu.cancelStep()
    else:
        instance.initialize()
        with refused(instance, "fmi3EnterEventMode: not offered"):
            instance.fmu.enterEventMode()


def test_only_the_standard_and_marked_functions_are_exported(instantiate_sample):
    library = instantiate_sample().fmu.dll
    library.twice.restype, library.twice.argtypes = ctypes.c_double, [ctypes.c_double]
    assert library.twice(1.5) == 3.0
    with pytest.raises(AttributeError, match="model_step"):
        library.model_step  # noqa: B018


def test_the_shells_compile_without_a_warning(block, version, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "cc -Werror -Wpedantic -Wshadow")
    assert write_fmu(block, version, tmp_path / "strict.fmu").is_file()


def test_a_binary_from_the_sources_alone_is_identical(fmu, tmp_path):
    from cosim.export.fmu.compiler import compile_library

    with ZipFile(fmu) as archive:
        archive.extractall(tmp_path)
    binary = next((tmp_path / "binaries").rglob("sample.*"))
    sources = sorted(path.name for path in Path(tmp_path / "sources").glob("*.c"))
    compile_library(tmp_path / "sources", sources, tmp_path / binary.name)
    assert (tmp_path / binary.name).read_bytes() == binary.read_bytes()
