"""Export of continuous models with CasADi equations as blocks of C code."""

from __future__ import annotations

import ctypes
import math
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from cosim.core import resources
from cosim.core.component import Variable
from cosim.core.units import parse_unit
from cosim.export.equations.exported_interface import (
    ExportedFunction,
    describe_variables,
    interface_hash,
    read_functions,
)
from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import ContinuousModel, static_model
from cosim.export.fmu.block import Block

SHELL = resources.package_folder() / "export/shell"


def oscillator() -> ContinuousModel:
    """Create the model x'' = -stiffness x + force, with an array input, a Boolean output and all
    kinds of variables.
    """
    return ContinuousModel(
        "oscillator",
        "Two forces on a spring",
        (
            Variable("stiffness", causality="parameter", variability="fixed", start=4.0),
            Variable(
                "initial.x",
                causality="parameter",
                variability="fixed",
                start=1.0,
                unit=parse_unit("m"),
            ),
            Variable(
                "force", causality="input", start=(0.0, 0.5), shape=(2,), unit=parse_unit("N")
            ),
            Variable("x", causality="output", unit=parse_unit("m")),
            Variable("left", "Boolean", "output", "discrete"),
            Variable("energy", causality="output", unit=parse_unit("J")),
        ),
        ("x", "v"),
        lambda parameters: ca.vertcat(parameters[1], 0),
        lambda state, inputs, parameters: ca.vertcat(
            state[1], -parameters[0] * state[0] + inputs[0] + inputs[1]
        ),
        lambda state, _, parameters: ca.vertcat(
            state[0], state[0] < 0, (parameters[0] * state[0] ** 2 + state[1] ** 2) / 2
        ),
    )


class Compiled:
    """A compiled block that is called without FMI; `model` is its struct `Model`."""

    def __init__(self, block: Block, folder: Path, *options: str):
        for name, text in block.files.items():
            (folder / name).write_text(text)
        command = [
            "gcc",
            "-std=c11",
            "-O0",
            "-ffp-contract=off",
            "-Wall",
            "-Werror",
            "-fPIC",
            "-shared",
            f"-I{SHELL}",
            *options,
        ]
        subprocess.run([*command, "model.c", "-o", "model.so", "-lm"], cwd=folder, check=True)
        self.library = ctypes.CDLL(str(folder / "model.so"))
        for name in ("model_initialize", "model_step"):
            getattr(self.library, name).restype = ctypes.c_char_p
        members = re.findall(r"(double|bool) (\w+)\[(\d+)\];", block.files["model.h"])
        kinds = {"double": ctypes.c_double, "bool": ctypes.c_bool}
        self.model = type(
            "Model",
            (ctypes.Structure,),
            {"_fields_": [(name, kinds[kind] * int(n)) for kind, name, n in members]},
        )()
        self.library.model_start(ctypes.byref(self.model))
        self.library.model_parameters(ctypes.byref(self.model))

    def initialize(self) -> bytes | None:
        return self.library.model_initialize(ctypes.byref(self.model), ctypes.c_double(0))

    def step(self, size: float) -> bytes | None:
        return self.library.model_step(
            ctypes.byref(self.model), ctypes.c_double(0), ctypes.c_double(size)
        )

    def call(self, name: str, results: int, *arguments: list[float]) -> list[float]:
        vectors = [(ctypes.c_double * len(argument))(*argument) for argument in arguments]
        result = (ctypes.c_double * results)()
        inputs = (ctypes.c_void_p * len(vectors))(*(ctypes.addressof(vector) for vector in vectors))
        self.library[name](inputs, (ctypes.c_void_p * 1)(ctypes.addressof(result)))
        return list(result)


@pytest.fixture
def compiled(tmp_path: Path) -> Compiled:
    return Compiled(as_block(oscillator()), tmp_path)


def test_the_same_model_gives_the_same_text() -> None:
    assert as_block(oscillator()).files == as_block(oscillator()).files


def test_variables_are_in_the_struct_members_of_the_block() -> None:
    members = {variable.name: variable.member for variable in as_block(oscillator()).variables}
    assert members == {
        "stiffness": "parameter[0]",
        "initial.x": "parameter[1]",
        "force": "input[0]",
        "x": "output[0]",
        "left": "flag[0]",
        "energy": "output[1]",
    }


def test_start_values_are_taken_from_the_variables(compiled: Compiled) -> None:
    assert list(compiled.model.parameter) == [4.0, 1.0]
    assert list(compiled.model.input) == [0.0, 0.5]


def test_initialization_depends_on_parameters_and_can_be_repeated(compiled: Compiled) -> None:
    for start in (1.0, -2.0):
        compiled.model.parameter[1] = start
        assert compiled.initialize() is None
        assert list(compiled.model.state) == [start, 0.0]
        assert list(compiled.model.output) == [start, 2 * start**2]
        assert list(compiled.model.flag) == [start < 0]


def exact(time: float) -> float:
    """The model oscillates from x = 1 with 2 rad/s around the equilibrium 0.5 / 4."""
    return 0.125 + 0.875 * math.cos(2 * time)


def test_steps_follow_the_exact_solution(compiled: Compiled) -> None:
    compiled.initialize()
    for _ in range(100):
        assert compiled.step(0.01) is None
    assert compiled.model.output[0] == pytest.approx(exact(1.0), abs=1e-9)


def test_the_integration_error_is_of_fourth_order(tmp_path: Path) -> None:
    def error(sub_step: float) -> float:
        model = oscillator()
        folder = tmp_path / str(sub_step)
        folder.mkdir()
        compiled = Compiled(
            as_block(ContinuousModel(**{**vars(model), "max_sub_step": sub_step})), folder
        )
        compiled.initialize()
        compiled.step(1.0)
        return abs(compiled.model.output[0] - exact(1.0))

    assert error(0.1) / error(0.05) == pytest.approx(16, rel=0.1)


@pytest.mark.parametrize("parts", [2, 5, 20])
def test_a_long_step_equals_its_sub_steps(compiled: Compiled, parts: int) -> None:
    compiled.initialize()
    for _ in range(parts):
        compiled.step(0.005)
    expected = list(compiled.model.state)
    compiled.initialize()
    compiled.step(0.005 * parts)
    assert list(compiled.model.state) == pytest.approx(expected, rel=1e-15)


def test_a_state_that_is_not_finite_is_reported_by_name(compiled: Compiled) -> None:
    compiled.initialize()
    compiled.model.input[0] = math.inf
    assert compiled.step(0.01) == b"the state x is not finite"


def test_projection_is_applied_after_each_sub_step(tmp_path: Path) -> None:
    """A point on the unit circle remains on it, except for rounding errors."""
    model = ContinuousModel(
        "circle",
        "Rotation",
        (Variable("x", causality="output"),),
        ("x", "y"),
        lambda _parameters: ca.SX([1, 0]),
        lambda state, _inputs, _parameters: ca.vertcat(-state[1], state[0]) * 30,
        lambda state, _inputs, _parameters: state[0],
        lambda state: state / ca.norm_2(state),
    )
    compiled = Compiled(as_block(model), tmp_path)
    compiled.initialize()
    compiled.step(1.0)
    assert math.hypot(*compiled.model.state) == pytest.approx(1.0, abs=1e-15)


@pytest.fixture
def spring(tmp_path: Path) -> Compiled:
    """Return a compiled model without states: a force that depends on a displacement."""
    variables = (
        Variable("stiffness", causality="parameter", variability="tunable", start=4.0),
        Variable("x", causality="input", start=0.5, unit=parse_unit("m")),
        Variable("force", causality="output", unit=parse_unit("N")),
        Variable("pulls", "Boolean", "output", "discrete"),
    )
    model = static_model("spring", "Spring", variables, lambda x, k: ca.vertcat(-k * x, x > 0))
    return Compiled(as_block(model), tmp_path)


def test_a_model_without_states_has_outputs_after_initialization(spring: Compiled) -> None:
    assert spring.initialize() is None
    assert (list(spring.model.output), list(spring.model.flag)) == ([-2.0], [True])


def test_a_model_without_states_follows_inputs_and_parameters_in_every_step(
    spring: Compiled,
) -> None:
    spring.initialize()
    spring.model.input[0], spring.model.parameter[0] = -0.25, 10.0
    assert spring.step(0.01) is None
    assert (list(spring.model.output), list(spring.model.flag)) == ([2.5], [False])


def test_a_model_without_states_has_no_state_member(spring: Compiled) -> None:
    assert not hasattr(spring.model, "state")


a, b = ca.SX.sym("a"), ca.SX.sym("b")
OPERATIONS: list[tuple[ca.SX, Callable[[float, float], float]]] = [
    (a + b, lambda a, b: a + b),
    (a - b, lambda a, b: a - b),
    (a * b, lambda a, b: a * b),
    (a / b, lambda a, b: a / b),
    (-a, lambda a, _b: -a),
    (1 / a, lambda a, _b: 1 / a),
    (2 * a, lambda a, _b: 2 * a),
    (a**2, lambda a, _b: a * a),
    (ca.fabs(a) ** b, lambda a, b: abs(a) ** b),
    (ca.fabs(a) ** 1.3, lambda a, _b: abs(a) ** 1.3),
    (ca.sqrt(ca.fabs(a)), lambda a, _b: math.sqrt(abs(a))),
    (ca.exp(a), lambda a, _b: math.exp(a)),
    (ca.log(ca.fabs(a)), lambda a, _b: math.log(abs(a))),
    (ca.sin(a) + ca.cos(b), lambda a, b: math.sin(a) + math.cos(b)),
    (ca.tan(a), lambda a, _b: math.tan(a)),
    (ca.asin(a / 10), lambda a, _b: math.asin(a / 10)),
    (ca.acos(a / 10), lambda a, _b: math.acos(a / 10)),
    (ca.atan(a), lambda a, _b: math.atan(a)),
    (ca.atan2(a, b), lambda a, b: math.atan2(a, b)),
    (ca.sinh(a) + ca.cosh(b), lambda a, b: math.sinh(a) + math.cosh(b)),
    (ca.tanh(a), lambda a, _b: math.tanh(a)),
    (ca.hypot(a, b), lambda a, b: math.hypot(a, b)),
    (ca.floor(a), lambda a, _b: math.floor(a)),
    (ca.ceil(a), lambda a, _b: math.ceil(a)),
    (ca.fmod(a, b), lambda a, b: math.fmod(a, b)),
    (ca.fmin(a, b), lambda a, b: min(a, b)),
    (ca.fmax(a, b), lambda a, b: max(a, b)),
    (ca.sign(a), lambda a, _b: float(np.sign(a))),
    (ca.copysign(a, b), lambda a, b: math.copysign(a, b)),
    (ca.if_else(a < b, 1.5, -2.5), lambda a, b: 1.5 if a < b else -2.5),
    (ca.if_else(a <= b, a, b), lambda a, b: a if a <= b else b),
    (ca.if_else(a == b, 1, 2), lambda a, b: 1 if a == b else 2),
    (ca.if_else(a != b, 1, 2), lambda a, b: 1 if a != b else 2),
    (ca.logic_and(a > 0, b > 0), lambda a, b: a > 0 and b > 0),
    (ca.logic_or(a > 0, b > 0), lambda a, b: a > 0 or b > 0),
    (ca.logic_not(a > 0), lambda a, _b: not a > 0),
    (ca.if_else(a > 0, ca.inf, -ca.inf), lambda a, _b: math.inf if a > 0 else -math.inf),
    (ca.SX(0), lambda _a, _b: 0.0),
]


def test_exported_functions_compute_what_python_computes(tmp_path: Path) -> None:
    function = ca.Function(
        "probe", [a, b], [ca.vertcat(*(expression for expression, _ in OPERATIONS))]
    )
    compiled = Compiled(as_block(oscillator(), [function]), tmp_path)
    for x, y in ((0.7, 2.3), (-1.9, 0.4), (3.5, 3.5), (-2.0, -7.25)):
        found = compiled.call("probe", len(OPERATIONS), [x], [y])
        assert found == pytest.approx([float(python(x, y)) for _, python in OPERATIONS], rel=1e-15)


def test_matrices_are_passed_by_columns(tmp_path: Path) -> None:
    matrix, vector = ca.SX.sym("m", 2, 2), ca.SX.sym("v", 2)
    function = ca.Function("multiply", [matrix, vector], [matrix @ vector])
    compiled = Compiled(as_block(oscillator(), [function]), tmp_path)
    assert compiled.call("multiply", 2, [1.0, 2.0, 3.0, 4.0], [10.0, 1.0]) == [13.0, 24.0]


def test_structural_zeros_of_a_result_are_written(tmp_path: Path) -> None:
    function = ca.Function("sparse", [a], [ca.vertcat(a, 0, ca.SX(1, 1), a)])
    compiled = Compiled(as_block(oscillator(), [function]), tmp_path)
    assert compiled.call("sparse", 4, [2.0]) == [2.0, 0.0, 0.0, 2.0]


def test_an_operation_without_counterpart_in_c_is_refused() -> None:
    with pytest.raises(ValueError, match=r"probe: the CasADi operation .* has no counterpart in C"):
        as_block(oscillator(), [ca.Function("probe", [a], [ca.erf(a)])])


def exported_text(compiled: Compiled, name: str) -> str:
    return ctypes.string_at(
        ctypes.addressof(ctypes.c_char.in_dll(compiled.library, f"equations_{name}"))
    ).decode()


def test_the_binary_describes_its_variables_and_arrays(tmp_path: Path) -> None:
    matrix = ca.SX.sym("m", 2, 2)
    probe = ca.Function("probe", [a, matrix], [matrix @ ca.vertcat(a, 1)], ["gain", "m"], ["y"])
    model = oscillator()
    compiled = Compiled(as_block(model, [probe]), tmp_path)
    assert exported_text(compiled, "variables").splitlines() == [
        "state x",
        "state v",
        "parameter stiffness (Float64, no unit)",
        "parameter initial.x (Float64, m)",
        "input force[2] (Float64, N)",
        "output x (Float64, m)",
        "output left (Boolean, no unit)",
        "output energy (Float64, J)",
    ]
    declared = describe_variables(model.variables, model.states)
    assert exported_text(compiled, "hash") == interface_hash(declared)
    functions = read_functions(exported_text(compiled, "functions"))
    assert functions == {"probe": ExportedFunction({"gain": 1, "m": 4}, {"y": 2})}


def test_the_sizes_in_the_binary_are_those_of_the_equations(tmp_path: Path) -> None:
    for count in (3, 4):
        vector = ca.SX.sym("v", count)
        probe = ca.Function("probe", [vector], [2 * vector], ["v"], ["doubled"])
        (folder := tmp_path / str(count)).mkdir()
        compiled = Compiled(as_block(oscillator(), [probe]), folder)
        functions = read_functions(exported_text(compiled, "functions"))
        assert functions["probe"].sizes == {"v": count, "doubled": count}


def test_a_name_for_arrays_of_two_sizes_is_refused() -> None:
    functions = [
        ca.Function(f"probe{size}", [ca.SX.sym("v", size)], [ca.SX(1)], ["v"], ["y"])
        for size in (2, 3)
    ]
    with pytest.raises(
        ValueError, match=r'probe3: the array "v" has 3 elements, and 2 in another function'
    ):
        as_block(oscillator(), functions)
