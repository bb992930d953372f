"""FMUs whose functions fail: the run ends in one line with the cause, and the rows until then are
kept.
"""

from __future__ import annotations

import logging
import signal
from fractions import Fraction
from zipfile import ZipFile

import pytest
from ball_fmus import build_ball_fmu
from systems import endpoint, make_system

from cosim.components.fmi import (
    FmuFile,
    InstanceSettings,
    Isolation,
    SolverSettings,
    create_component,
    model_exchange,
)
from cosim.core.errors import InputError
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings

#: functions of ball.c by their number, with their names in FMI 1.0, 2.0 and 3.0; "" if the version
#: has none
FUNCTIONS = {
    1: ("GetContinuousStates",) * 3,
    2: ("SetContinuousStates",) * 3,
    3: ("GetDerivatives", "GetDerivatives", "GetContinuousStateDerivatives"),
    4: ("GetEventIndicators",) * 3,
    5: ("SetTime",) * 3,
    6: ("", "EnterEventMode", "EnterEventMode"),
    7: ("", "EnterContinuousTimeMode", "EnterContinuousTimeMode"),
    8: ("EventUpdate", "NewDiscreteStates", "UpdateDiscreteStates"),
    9: ("CompletedIntegratorStep",) * 3,
    10: ("", "ExitInitializationMode", "ExitInitializationMode"),
    11: ("Initialize", "EnterInitializationMode", "EnterInitializationMode"),
    13: ("GetReal", "GetReal", "GetFloat64"),
    16: (
        "GetNominalContinuousStates",
        "GetNominalsOfContinuousStates",
        "GetNominalsOfContinuousStates",
    ),
}
BEFORE_THE_FIRST_STEP = (10, 11)
STATUSES = {
    3: "status 3 (error)",
    4: "status 4 (fatal)",
    77: "status 77 (not defined by FMI)",
    2: "status 2 (discard)",
}
CRASHES = {90: "SIGSEGV", 91: "SIGABRT", 92: "exit code 7"}


def run(path, method, fault, isolation=None):
    solver = SolverSettings(method, Fraction(1, 100)) if method else None
    component = create_component(FmuFile(path), "ball", InstanceSettings(1e-6, solver), isolation)
    system = make_system({"ball": component}, start_values={"ball": {"fault": fault}})
    return simulate(
        system, Settings(Fraction(0), Fraction(1), Fraction(1, 10), {"ball.x": endpoint("ball.x")})
    )


def check(outcome, words, rows):
    text = str(outcome.failure)
    assert len(text.splitlines()) == 1
    assert [word for word in words if word not in text] == [], text
    assert len(outcome.recording.time) >= rows
    assert outcome.recording.columns["ball.x"].tolist()[:1] == [1.0][:rows]


#: method, FMI major version, function and status
STATUS_CASES = [
    (method, version, function, status)
    for method in ("euler", "cvode")
    for version in (1, 2, 3)
    for function in FUNCTIONS
    for status in STATUSES
    if FUNCTIONS[function][version - 1]
    and (method, function) != ("euler", 16)
    and (status == 3 or function in (2, 3, 4, 8))
]


@pytest.mark.parametrize(("method", "version", "function", "status"), STATUS_CASES)
def test_a_bad_status_names_function_and_status(balls, method, version, function, status):
    words = ("ball: ", f"{FUNCTIONS[function][version - 1]} failed at t = ", STATUSES[status])
    check(
        run(balls[version], method, 100 * function + status),
        words,
        0 if function in BEFORE_THE_FIRST_STEP else 5,
    )


@pytest.mark.parametrize("crash", CRASHES)
@pytest.mark.parametrize("function", [3, 8])
def test_a_crash_in_its_own_process_is_one_line(balls, function, crash):
    check(
        run(balls[2], "euler", 100 * function + crash, Isolation()),
        ("integration step" if function == 3 else FUNCTIONS[function][1], CRASHES[crash]),
        5,
    )


#: fault -> method and part of the message; None: the run reaches its end
SEMANTICS = {
    (9, "euler"): None,  # not finite values are a warning at the end of the run
    (9, "cvode"): "CVode failed",
    (10, "euler"): "the next time event is at NaN",
    (10, "cvode"): "the next time event is at NaN",
    (11, "euler"): None,
    (11, "cvode"): "more than 100 events in one communication step",
    (12, "cvode"): "fail",
    (12, "euler"): "fail",
    (13, "cvode"): "GetContinuousStates failed",
    (14, "cvode"): "more than 100 events in one communication step, the last one at t = 0.75 s",
    (14, "euler"): None,
    (15, "cvode"): "more than 100 events in one communication step, the last one at t = 0.75 s",
    (
        16,
        "cvode",
    ): (
        "CVode failed at t = 0.5 s: at t = 0.5 s: 100 internal steps without progress; a "
        "derivative may be infinite"
    ),
    (16, "euler"): None,
    (
        17,
        "cvode",
    ): (
        "GetNumberOfContinuousStates failed at t = 0 s: found 1099511627776, expected at most "
        "2000000"
    ),
    (
        18,
        "euler",
    ): (
        "GetNumberOfEventIndicators failed at t = 0 s: found 1099511627776, expected at most "
        "2000000"
    ),
}
#: faults that are found before the first row
FAULTS_OF_THE_INITIALIZATION = (13, 17, 18)


@pytest.mark.parametrize(("fault", "method"), SEMANTICS)
def test_values_without_meaning(balls, fault, method, monkeypatch):
    monkeypatch.setattr(model_exchange, "MAX_EVENTS_PER_STEP", 100)
    outcome = run(balls[3], method, fault)
    message = SEMANTICS[fault, method]
    if message is None:
        assert outcome.failure is None
    else:
        check(outcome, ("ball: ", message), 0 if fault in FAULTS_OF_THE_INITIALIZATION else 5)


def test_the_solver_prints_nothing(balls, capfd):
    run(balls[3], "cvode", 16)
    assert capfd.readouterr() == ("", "")


def test_a_signal_in_a_callback_of_the_solver_ends_the_run(balls):
    """ctypes would print the exception of the signal handler and continue with a wrong result."""

    def interrupt(_number, _frame):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        outcome = run(balls[3], "cvode", 19)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert isinstance(outcome.failure, KeyboardInterrupt)
    assert outcome.recording.time[-1] == pytest.approx(0.5)


def test_a_model_of_fmi_1_that_cannot_be_instantiated(balls):
    component = create_component(FmuFile(balls[1]), "impossible", InstanceSettings(1e-6))
    outcome = simulate(
        make_system({"impossible": component}),
        Settings(Fraction(0), Fraction(1), Fraction(1, 10), {}),
    )
    assert str(outcome.failure) == "impossible: fmi1InstantiateModel failed: the FMU gave no reason"


@pytest.mark.parametrize("text", ["-1", "2000000000", "many", ""])
@pytest.mark.parametrize(
    ("version", "name", "number"),
    [(1, "numberOfContinuousStates", 3), (2, "numberOfEventIndicators", 1)],
)
def test_a_declared_number_that_cannot_be_right_is_refused(
    balls, tmp_path, version, name, number, text
):
    path = tmp_path / "ball.fmu"
    change_description(balls[version], path, f'{name}="{number}"', f'{name}="{text}"')
    expected = f'found {name}="{text}", expected an integer from 0 to 2000000 \\[model.count'
    with pytest.raises(InputError, match=expected):
        create_component(FmuFile(path), "ball")


def change_description(source, target, old, new):
    with ZipFile(source) as archive, ZipFile(target, "w") as changed:
        for name in archive.namelist():
            content = archive.read(name)
            changed.writestr(
                name,
                content.replace(old.encode(), new.encode()) if name.endswith(".xml") else content,
            )


@pytest.fixture(scope="session")
def slave(tmp_path_factory):
    return build_ball_fmu(1, tmp_path_factory.mktemp("slave"), "CS")


@pytest.mark.parametrize(
    ("function", "name"), [(11, "InitializeSlave"), (13, "GetReal"), (15, "DoStep")]
)
@pytest.mark.parametrize("status", [*STATUSES, 5])
def test_a_slave_of_fmi_1_names_function_and_status(slave, function, name, status):
    words = {5: "status 5 (pending)"} | STATUSES
    check(
        run(slave, None, 100 * function + status),
        ("ball: ", f"{name} failed", words[status]),
        0 if function == 11 else 5,
    )


@pytest.mark.parametrize("crash", CRASHES)
def test_a_crash_of_a_slave_of_fmi_1(slave, crash):
    check(run(slave, None, 1500 + crash, Isolation()), ("ball: ", "DoStep", CRASHES[crash]), 5)


def test_a_failure_of_terminate_keeps_the_results(slave, caplog):
    with caplog.at_level(logging.WARNING, "cosim"):
        outcome = run(slave, None, 1203)
    assert len(outcome.recording.time) == 11
    assert "fmi1Terminate" in f"{outcome.failure}{caplog.text}"
