"""The class attribute `units` of a PythonFMU class, in process and exported: units are converted,
or refused.
"""

import json
from pathlib import Path

import pytest

import cosim
from cosim.core.errors import InputError
from cosim.export.build import build_to

SOURCE = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class {name}(Fmi2Slave):
    units = {units}

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.x, self.y = 0.0, 90.0
        self.register_variable(Real("x", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, time, step_size):
        self.y = self.x or self.y
        return True
"""


def scenario(folder: Path, exported: bool, output: object, expected: object) -> Path:
    """A class whose output y, in degrees, is the input x of another class."""
    components = {}
    for name, units in (("Sender", output), ("Receiver", expected)):
        source = folder / f"{name.lower()}.py"
        source.write_text(SOURCE.format(name=name, units=units))
        if exported:
            build_to(source, None, source.with_suffix(".fmu"))
        components[name.lower()] = (
            {"fmu": f"{source.stem}.fmu"} if exported else {"python": f"{source.name}:{name}"}
        )
    connections = [{"from": "sender.y", "to": "receiver.x"}]
    file = folder / "s.json"
    content = {
        "name": "s",
        "stop_time": 2,
        "step_size": 1,
        "components": components,
        "connections": connections,
    }
    file.write_text(json.dumps(content))
    return file


@pytest.mark.parametrize("exported", [False, True])
def test_degrees_become_radians(tmp_path, exported):
    result = cosim.run(scenario(tmp_path, exported, {"y": "deg"}, {"x": "rad"}))
    assert result["receiver.y"][-1] == pytest.approx(1.5707963267948966, rel=1e-15)
    assert result.units["sender.y"] == "deg"


@pytest.mark.parametrize("exported", [False, True])
def test_degrees_cannot_become_newtons(tmp_path, exported):
    with pytest.raises(InputError, match='units "deg" and "N" measure different quantities'):
        cosim.run(scenario(tmp_path, exported, {"y": "deg"}, {"x": "N"}))


VECTOR = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Base(Fmi2Slave):
    author = "someone"
    units: dict[str, str] = {
        **{f"x[{i}]": "rad" for i in (1, 2, 3)},
        **{f"y[{i}]": "m" for i in (1, 2, 3)},
    }


class Both(Base):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        for name, causality in (("x", Fmi2Causality.input), ("y", Fmi2Causality.output)):
            for i in (1, 2, 3):
                access = {"getter": lambda: 0.0, "setter": lambda _: None}
                self.register_variable(Real(f"{name}[{i}]", causality=causality, **access))

    def do_step(self, time, step_size):
        return True
"""


def test_wrong_units_of_a_vector_are_one_line_with_the_place_of_their_declaration(tmp_path):
    (tmp_path / "both.py").write_text(VECTOR)
    components = {name: {"python": "both.py:Both"} for name in "ab"}
    wires = [{"from": "a.y", "to": "b.x"}]
    (tmp_path / "s.json").write_text(
        json.dumps(
            {
                "name": "s",
                "stop_time": 2,
                "step_size": 1,
                "components": components,
                "connections": wires,
            }
        )
    )
    with pytest.raises(InputError) as refusal:
        cosim.run(tmp_path / "s.json")
    (problem,) = refusal.value.problems
    place = "is declared by Base.units (both.py:7)"
    assert problem.message == (
        'a.y[1] cannot feed b.x[1], and 2 more elements likewise: units "m" and "rad" measure '
        "different quantities"
        f'; "m" {place}; "rad" {place}'
    )


@pytest.mark.parametrize(
    ("units", "message"),
    [
        (
            {"xx": "rad"},
            'names "xx", but no register_variable of type Real does; registered: x, y$',
        ),
        ({"y": "radd"}, r'contains "radd" for "y": unknown unit'),
        (
            {"x": "metre", "y": "metre"},
            r'contains "metre" for "x", "y": unknown unit "metre"; did you mean "m"\?$',
        ),
        (["y"], "is not a dict of names of variables and units"),
    ],
)
def test_wrong_units_are_refused(tmp_path, units, message):
    with pytest.raises(
        InputError, match=rf"the class attribute Sender\.units \(sender\.py:6\) {message}"
    ):
        cosim.run(scenario(tmp_path, False, units, {}))
    with pytest.raises(InputError, match=rf'sender\.py: the class attribute "units" {message}'):
        scenario(tmp_path, True, units, {})
