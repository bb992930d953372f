"""Export of PythonFMU classes."""

from __future__ import annotations

from zipfile import ZipFile

import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

from cosim.components.fmi import FmuFile, create_component
from cosim.components.python_class import load_component
from cosim.core.component import Ports
from cosim.core.errors import ComponentError, InputError
from cosim.export.build import build_to

SOURCE = '''
from types import SimpleNamespace

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real


class LeakyIntegrator(Fmi2Slave):
    """y' = gain (x - y), explicit Euler."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.gain, self.y, self.steps, self.moving = 2.0, 0.0, 0, False
        self.history = [0.0]
        self.vehicle = SimpleNamespace(x=1.0)
        self.register_variable(Real("vehicle.x", causality=Fmi2Causality.input))
        self.register_variable(
            Real("gain", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
        )
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        self.register_variable(Integer("steps", causality=Fmi2Causality.output))
        self.register_variable(Boolean("moving", causality=Fmi2Causality.local))

    def do_step(self, time, step_size):
        rate = self.gain * (self.vehicle.x - self.y)
        self.y = self.history[-1] + step_size * rate
        self.history.append(self.y)
        self.steps += 1
        self.moving = rate != 0
        return True
'''


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    path = tmp_path_factory.mktemp("python") / "leaky_integrator.py"
    path.write_text(SOURCE)
    return path


@pytest.fixture(scope="module")
def python_fmu(source):
    return build_to(source, None, source.with_suffix(".fmu"))


def test_it_validates_without_problems(python_fmu):
    assert validate_fmu(str(python_fmu)) == []


def test_it_computes_what_the_class_computes(python_fmu):
    result = simulate_fmu(
        str(python_fmu), stop_time=1.0, output_interval=0.1, start_values={"vehicle.x": 3.0}
    )
    y = 0.0
    for row in result:
        assert row["y"] == pytest.approx(y, rel=1e-12)
        y += 0.1 * (2.0 * (3.0 - y))
    assert result["steps"][-1] == 10


def test_the_same_source_gives_the_same_bytes(source, python_fmu, tmp_path):
    assert build_to(source, None, tmp_path / "again.fmu").read_bytes() == python_fmu.read_bytes()


def test_another_source_has_another_guid(python_fmu, tmp_path):
    other = tmp_path / "leaky_integrator.py"
    other.write_text(SOURCE.replace("!= 0", "> 0"))
    changed = build_to(other, None, tmp_path / "o.fmu")
    assert read_model_description(changed).guid != read_model_description(python_fmu).guid


def test_the_description_is_completed(python_fmu):
    model = read_model_description(python_fmu)
    assert [unknown.variable.name for unknown in model.initialUnknowns] == ["y", "steps"]
    assert {v.name: v.variability for v in model.modelVariables}["moving"] == "discrete"
    assert model.generationDateAndTime is None
    assert model.coSimulation.canGetAndSetFMUstate


def test_its_state_with_variables_that_are_not_registered_can_be_restored(python_fmu):
    component = create_component(FmuFile(python_fmu), "one")
    try:
        component.bind(Ports((), {}), Ports((), {}))
        component.instantiate()
        component.enter_initialization_mode(0.0, 1.0)
        component.exit_initialization_mode()
        component.do_step(0.0, 0.1)
        state = component.get_state()
        component.do_step(0.1, 0.1)
        onwards = component.get("y")
        component.set_state(state)
        assert component.get("y") == 0.1 * 2.0
        component.do_step(0.1, 0.1)
        assert component.get("y") == onwards
        component.free_state(state)
    finally:
        component.free()


def test_it_runs_on_linux_and_windows(python_fmu):
    with ZipFile(python_fmu) as archive:
        binaries = [name for name in archive.namelist() if name.startswith("binaries/")]
    assert binaries == ["binaries/linux64/LeakyIntegrator.so", "binaries/win64/LeakyIntegrator.dll"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "x = 1\n",
            (
                r"empty\.py: cannot be exported: ValueError: No child class of Fmi2Slave found in "
                r"module empty\.py"
            ),
        ),
        (
            SOURCE.replace("self.history = ", "del self.gain\n        self.history = "),
            r"empty\.py: cannot be exported: AttributeError: ",
        ),
        ("import no_such_package\n", "No module named 'no_such_package'"),
        (
            SOURCE.replace('Integer("steps",', 'Integer("no way", getter=lambda: 1,'),
            r'empty\.py: .*"no way".* is not a legal variable name',
        ),
    ],
)
def test_a_class_that_cannot_be_exported_is_refused(tmp_path, text, message):
    path = tmp_path / "empty.py"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        build_to(path, None, tmp_path / "empty.fmu")


READER = """
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

from gains import GAIN


class Reader(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.u = 0.0
        self.y = GAIN * float((Path(self.resources) / "offset.txt").read_text())
        self.z = 2 * float((Path(__file__).parent / "tables/offset.txt").read_text())
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        self.register_variable(Real("z", causality=Fmi2Causality.output))

    def do_step(self, time, step_size):
        self.y = self.y / (1 - self.u)
        return True
"""


@pytest.fixture(scope="module")
def reader_fmu(tmp_path_factory):
    folder, other = tmp_path_factory.mktemp("own"), tmp_path_factory.mktemp("other")
    (folder / "reader.py").write_text(READER)
    (folder / "gains.py").write_text("GAIN = 3.0\n")
    (folder / "unused.py").write_text("")
    (folder / "tables").mkdir()
    for file in (folder / "tables/offset.txt", other / "offset.txt"):
        file.write_text("2.0")
    return build_to(
        folder / "reader.py",
        None,
        folder / "r.fmu",
        include=[folder / "tables", other / "offset.txt"],
    )


def test_imported_modules_and_included_files_travel_with_the_fmu(reader_fmu):
    result = simulate_fmu(str(reader_fmu), stop_time=1.0, output=["y", "z"])
    assert (result["y"][-1], result["z"][-1]) == (6.0, 4.0)
    with ZipFile(reader_fmu) as archive:
        names = {name.removeprefix("resources/") for name in archive.namelist()}
    assert {"reader.py", "gains.py", "offset.txt", "tables/offset.txt"} <= names
    assert "unused.py" not in names


def test_the_class_finds_its_files_in_process_too(tmp_path):
    (tmp_path / "tables").mkdir()
    for name in ("offset.txt", "tables/offset.txt"):
        (tmp_path / name).write_text("2.0")
    (tmp_path / "gains.py").write_text("GAIN = 3.0\n")
    (tmp_path / "reader.py").write_text(READER)
    component = load_component("reader.py:Reader", tmp_path, "reader", {})
    assert (component.get("y"), component.get("z")) == (6.0, 4.0)


def test_an_exception_in_an_fmu_is_told_with_text_and_line(reader_fmu):
    component = create_component(FmuFile(reader_fmu), "one")
    component.bind(Ports((), {}), Ports((), {}))
    component.instantiate()
    component.enter_initialization_mode(0.0, 1.0)
    component.set("u", 1.0)
    component.exit_initialization_mode()
    message = (
        r"one: fmi2DoStep failed at t = 0 s: status 4 \(fatal\): ZeroDivisionError: float division "
        r"by zero \(reader\.py:20\)"
    )
    with pytest.raises(ComponentError, match=message):
        component.do_step(0.0, 0.1)


def test_an_exception_in_the_constructor_is_told_with_text_and_line(tmp_path):
    source = tmp_path / "reader.py"
    guarded = 'self.u = 1.0 / (kwargs["instance_name"] != "one")'
    source.write_text(SOURCE.replace("self.gain, ", f"{guarded}\n        self.gain, "))
    component = create_component(FmuFile(build_to(source, None, tmp_path / "r.fmu")), "one")
    component.bind(Ports((), {}), Ports((), {}))
    with pytest.raises(
        ComponentError, match=r"one: fmi2Instantiate failed: .*ZeroDivisionError.*\(reader\.py:12\)"
    ):
        component.instantiate()


def test_an_fmu_can_be_instantiated_many_times(reader_fmu):
    """The wrapper of PythonFMU releases the globals of the FMU's entry once too often at each
    instantiation.
    """
    for _ in range(20):
        component = create_component(FmuFile(reader_fmu), "one")
        component.bind(Ports((), {}), Ports((), {}))
        component.instantiate()
        component.free()


def test_only_python_classes_include_files(tmp_path):
    (tmp_path / "modelDescription.xml").touch()
    with pytest.raises(InputError, match="only the FMU of a Python class can include files"):
        build_to(tmp_path / "modelDescription.xml", None, tmp_path / "x.fmu", include=[tmp_path])


def test_a_class_of_several_in_a_file_is_exported_by_name(tmp_path):
    path = tmp_path / "pilots.py"
    step = "def do_step(self, time, step_size):\n        self.y = {}\n        return True\n"
    further = f"\n\nclass Fast(LeakyIntegrator):\n    {step}"
    path.write_text(SOURCE + further.format(5.0) + further.format(7.0).replace("Fast", "Faster"))
    with pytest.raises(
        InputError,
        match=r"several PythonFMU classes \(Fast, Faster, LeakyIntegrator\).*write pilots.py:Fast$",
    ):
        build_to(path, None, tmp_path / "x.fmu")
    with pytest.raises(InputError, match="no PythonFMU class is named Fist; found: Fast"):
        build_to(path, "Fist", tmp_path / "x.fmu")
    fmus = {name: build_to(path, name, tmp_path / f"{name}.fmu") for name in ("Fast", "Faster")}
    outputs = {}
    for name, fmu in fmus.items():  # in one process, with one `sys.modules`
        outputs[name] = simulate_fmu(str(fmu), stop_time=0.1, output_interval=0.1)["y"][-1]
    assert outputs == {"Fast": 5.0, "Faster": 7.0}
